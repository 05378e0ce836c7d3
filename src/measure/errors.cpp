#include "measure/errors.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <set>

#include "core/parallel.h"
#include "measure/colours.h"
#include "measure/display_steps.h"
#include "measure/ssim.h"

namespace catoptric::measure {
namespace {

using image::Image;

/// Of relMse: keeps dark pixels from counting for everything. [Rousselle2011] Sec. 5
constexpr double kRelativeFloor = 0.01;
constexpr int kBandRows = 32;

void add(RegionError& pooled, const RegionError& one, int frame) {
  pooled.pixels += one.pixels;
  pooled.notFinite += one.notFinite;
  pooled.notFiniteReference += one.notFiniteReference;
  pooled.bothBlack += one.bothBlack;
  pooled.sum8 += one.sum8;
  if (one.max8 > pooled.max8) {
    pooled.max8 = one.max8;
    pooled.max8Frame = frame;
    pooled.max8X = one.max8X;
    pooled.max8Y = one.max8Y;
  }
  pooled.linearValues += one.linearValues;
  pooled.sumAbsolute += one.sumAbsolute;
  pooled.sumSquared += one.sumSquared;
  pooled.sumRelative += one.sumRelative;
  pooled.sumLargest += one.sumLargest;
  if (one.maxLinear > pooled.maxLinear) {
    pooled.maxLinear = one.maxLinear;
    pooled.maxLinearFrame = frame;
    pooled.maxLinearX = one.maxLinearX;
    pooled.maxLinearY = one.maxLinearY;
  }
  pooled.over += one.over;
  pooled.sumStandardError += one.sumStandardError;
  pooled.sumOneBounce8 += one.sumOneBounce8;
  pooled.sumBounces8 += one.sumBounces8;
  pooled.ssimSum += one.ssimSum;
  pooled.flipSum += one.flipSum;
  pooled.hdrFlipSum += one.hdrFlipSum;
  pooled.flipMax = std::max(pooled.flipMax, one.flipMax);
  pooled.hdrFlipMax = std::max(pooled.hdrFlipMax, one.hdrFlipMax);
}

/// Luminance of Rec.709; what is not finite shows as black here, and is counted elsewhere.
std::vector<float> greyOf(const ColourView& view) {
  std::vector<float> grey(view.image->pixelCount());
  const std::size_t stride = view.image->channels.size();
  for (std::size_t p = 0; p < grey.size(); ++p) {
    const float* pixel = view.image->data.data() + p * stride;
    const float v = 0.2126f * pixel[view.channels[0]] + 0.7152f * pixel[view.channels[1]] +
                    0.0722f * pixel[view.channels[2]];
    grey[p] = std::isfinite(v) ? v : 0.0f;
  }
  return grey;
}

/// Indices in the image and in its reference: of R, G, B and, `forLimits`, if both have it, A.
using ChannelPairs = std::vector<std::array<int, 2>>;

ChannelPairs comparedChannels(const ColourView& test, const ColourView& truth, bool forLimits) {
  ChannelPairs pairs;
  for (std::size_t c = 0; c < 3; ++c) pairs.push_back({test.channels[c], truth.channels[c]});
  const std::array<int, 2> a = {test.image->channel("A"), truth.image->channel("A")};
  if (forLimits && a[0] >= 0 && a[1] >= 0) pairs.push_back(a);
  return pairs;
}

/// Measures of one pixel by its own values.
RegionError pixelError(const ColourView& test, const ColourView& truth, int x, int y,
                       const ChannelPairs& channels, const CompareOptions& options) {
  RegionError one;
  one.pixels = 1;
  bool finiteA = true;
  bool finiteB = true;
  for (const auto& [from, to] : channels) {
    finiteA = finiteA && std::isfinite(test.image->at(x, y, from));
    finiteB = finiteB && std::isfinite(truth.image->at(x, y, to));
  }
  one.notFinite = finiteA ? 0 : 1;
  one.notFiniteReference = finiteB ? 0 : 1;
  if (finiteA && finiteB) {
    bool black = true;
    for (std::size_t c = 0; c < channels.size(); ++c) {
      const float a = test.image->at(x, y, channels[c][0]);
      const float b = truth.image->at(x, y, channels[c][1]);
      const double linear = std::abs(double{a} - double{b});
      const double large = options.forLimits ? std::max(std::abs(a), std::abs(b)) : 1.0;
      one.maxLinear = std::max(one.maxLinear, linear / std::max(1.0, large));
      if (c == 3) break;  // A
      black = black && a == 0.0f && b == 0.0f;
      const int difference = std::abs(step8(a) - step8(b));
      one.sum8 += static_cast<std::uint64_t>(difference);
      one.max8 = std::max(one.max8, difference);
      one.sumAbsolute += linear;
      one.sumSquared += linear * linear;
      one.sumRelative += linear * linear / (double{b} * double{b} + kRelativeFloor);
    }
    one.linearValues = 3;
    one.sumLargest = one.maxLinear;
    one.bothBlack = black ? 1 : 0;
    one.over = one.maxLinear > options.threshold ? 1 : 0;
  } else {
    one.sum8 = 3 * 255;
    one.max8 = 255;
    one.over = 1;
  }
  one.max8X = one.maxLinearX = x;
  one.max8Y = one.maxLinearY = y;
  return one;
}

/// The sum over R, G, B of the differences of 8-bit values at one pixel; 255 each if a value is not
/// finite.
std::uint64_t difference8(const ColourView& a, const ColourView& b, int x, int y) {
  std::uint64_t sum = 0;
  for (std::size_t c = 0; c < 3; ++c) {
    const float from = a.image->at(x, y, a.channels[c]);
    const float to = b.image->at(x, y, b.channels[c]);
    if (!std::isfinite(from) || !std::isfinite(to)) return 3 * 255;
    sum += static_cast<std::uint64_t>(std::abs(step8(from) - step8(to)));
  }
  return sum;
}

/// The layers of a reference by the method `reference`; absent from others.
struct TruthLayers {
  ColourView standardError;
  ColourView oneBounce;

  explicit TruthLayers(const Image& reference)
      : standardError(layerColours(reference, "standard_error")),
        oneBounce(layerColours(reference, "one_bounce")) {}
};

/// Two images and what looks at neighbours in them, measured before.
struct Comparison {
  ColourView test;
  ColourView truth;
  const TruthLayers layers;
  const Classes& classes;
  const std::set<int> reflectors;
  const std::vector<double> similarity;
  const ErrorMaps& maps;
  const ChannelPairs channels;
  const CompareOptions& options;

  /// Errors of some rows.
  ImageError band(int firstRow, int lastRow) const {
    ImageError e;
    const Layer& reflective = classes.reflective();
    const Layer& id = classes.id();
    e.hasReflective = static_cast<bool>(reflective);
    e.hasStandardError = layers.standardError.image != nullptr;
    e.hasOneBounce = layers.oneBounce.image != nullptr;
    e.classes = classes.empty();
    const int width = test.image->width;
    for (int y = firstRow; y < lastRow; ++y)
      for (int x = 0; x < width; ++x) {
        const std::size_t p = static_cast<std::size_t>(y) * width + x;
        RegionError one = pixelError(test, truth, x, y, channels, options);
        one.ssimSum = similarity[p];
        one.flipMax = maps.flip[p];
        one.flipSum = one.flipMax;
        one.hdrFlipMax = maps.hdrFlip[p];
        one.hdrFlipSum = one.hdrFlipMax;
        addTruthLayers(one, x, y);

        add(static_cast<RegionError&>(e), one, 0);
        const bool isReflective = reflective && reflective.at(p) > 0.0f;
        if (isReflective) {
          add(e.reflective, one, 0);
          if (id && reflectors.contains(static_cast<int>(id.at(p))))
            add(e.objects[static_cast<int>(id.at(p))], one, 0);
        } else {
          add(e.elsewhere, one, 0);
        }
        classes.count(e.classes, x, y, isReflective, {1, one.sum8, one.sumSquared, one.hdrFlipSum});
      }
    return e;
  }

  void addTruthLayers(RegionError& one, int x, int y) const {
    for (const int c : layers.standardError.channels)
      if (c >= 0) one.sumStandardError += std::abs(truth.image->at(x, y, c)) / 3.0;
    if (layers.oneBounce.image == nullptr) return;
    one.sumOneBounce8 = difference8(test, layers.oneBounce, x, y);
    one.sumBounces8 = difference8(truth, layers.oneBounce, x, y);
  }
};

}  // namespace

double quotient(double sum, double count) {
  return count > 0.0 ? sum / count : 0.0;
}

double RegionError::l1() const {
  return quotient(static_cast<double>(sum8), 3.0 * static_cast<double>(pixels));
}
double RegionError::standardError() const {
  return quotient(sumStandardError, static_cast<double>(pixels));
}
double RegionError::l1OneBounce() const {
  return quotient(static_cast<double>(sumOneBounce8), 3.0 * static_cast<double>(pixels));
}
double RegionError::l1Bounces() const {
  return quotient(static_cast<double>(sumBounces8), 3.0 * static_cast<double>(pixels));
}
double RegionError::mae() const {
  return quotient(sumAbsolute, static_cast<double>(linearValues));
}
double RegionError::rmse() const {
  return std::sqrt(quotient(sumSquared, static_cast<double>(linearValues)));
}
double RegionError::relMse() const {
  return quotient(sumRelative, static_cast<double>(linearValues));
}
double RegionError::psnr() const {
  const double error = rmse();
  return error > 0.0 ? -20.0 * std::log10(error) : std::numeric_limits<double>::infinity();
}
double RegionError::ssim() const {
  return quotient(ssimSum, static_cast<double>(pixels));
}
double RegionError::flip() const {
  return quotient(flipSum, static_cast<double>(pixels));
}
double RegionError::hdrFlip() const {
  return quotient(hdrFlipSum, static_cast<double>(pixels));
}
double RegionError::overPercent() const {
  return 100.0 * quotient(static_cast<double>(over), static_cast<double>(pixels));
}
double RegionError::meanLargest() const {
  return quotient(sumLargest, static_cast<double>(pixels));
}

void FlipPool::add(std::span<const float> map) {
  for (const float v : map) {
    ++bins_[static_cast<std::size_t>(v * kBins + 0.5f)];
    min_ = std::min(min_, static_cast<double>(v));
  }
  count_ += map.size();
}
void FlipPool::add(const FlipPool& other) {
  if (other.count_ == 0) return;
  for (std::size_t i = 0; i < bins_.size(); ++i) bins_[i] += other.bins_[i];
  count_ += other.count_;
  min_ = std::min(min_, other.min_);
}
double FlipPool::weightedQuantile(double share) const {
  // Sums in integers: bin i weighs i
  std::uint64_t total = 0;
  for (std::size_t i = 0; i < bins_.size(); ++i) total += i * bins_[i];
  std::uint64_t sum = 0;
  for (std::size_t i = 0; i < bins_.size(); ++i) {
    sum += i * bins_[i];
    if (static_cast<double>(sum) > share * static_cast<double>(total))
      return static_cast<double>(i) / kBins;
  }
  return 0.0;
}

void addErrors(ImageError& pooled, const ImageError& one, int frame) {
  add(static_cast<RegionError&>(pooled), one, frame);
  pooled.hasReflective = pooled.hasReflective || one.hasReflective;
  pooled.hasStandardError = pooled.hasStandardError || one.hasStandardError;
  pooled.hasOneBounce = pooled.hasOneBounce || one.hasOneBounce;
  add(pooled.reflective, one.reflective, frame);
  add(pooled.elsewhere, one.elsewhere, frame);
  for (const auto& [id, object] : one.objects) add(pooled.objects[id], object, frame);
  for (const ErrorClass& part : one.classes) {
    auto found = std::find_if(pooled.classes.begin(), pooled.classes.end(),
                              [&](const ErrorClass& c) { return c.name == part.name; });
    if (found == pooled.classes.end()) {
      pooled.classes.push_back({part.name, {}, {}});
      found = std::prev(pooled.classes.end());
    }
    found->all.add(part.all);
    found->own.add(part.own);
  }
  pooled.flipPool.add(one.flipPool);
  pooled.hdrFlipPool.add(one.hdrFlipPool);
}

ImageError compareImages(const Image& image, const Image& reference, const std::string& name,
                         const CompareOptions& options, ErrorMaps* maps) {
  requireSameSize(image, reference, name);
  const ColourView test{&image, colourChannels(image, name)};
  const ColourView truth{&reference, colourChannels(reference, name + " (reference)")};
  const Classes classes(image, reference);

  ErrorMaps own;
  ErrorMaps& errors = maps != nullptr ? *maps : own;
  errors.flip = ldrFlip(truth, test, options.flip);
  errors.hdrFlip = hdrFlip(truth, test, options.flip);
  const Comparison comparison{test,
                              truth,
                              TruthLayers(reference),
                              classes,
                              classes.reflectors(),
                              ssimMap(greyOf(test), greyOf(truth), image.width, image.height),
                              errors,
                              comparedChannels(test, truth, options.forLimits),
                              options};

  // Bands of rows, added up in order: the same sums for any number of threads
  const int bands = (image.height + kBandRows - 1) / kBandRows;
  std::vector<ImageError> parts(static_cast<std::size_t>(bands));
  parallelFor(parts.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      parts[i] = comparison.band(static_cast<int>(i) * kBandRows,
                                 std::min(image.height, (static_cast<int>(i) + 1) * kBandRows));
  });
  ImageError e;
  for (const ImageError& part : parts) addErrors(e, part, 0);
  e.flipPool.add(errors.flip);
  e.hdrFlipPool.add(errors.hdrFlip);
  return e;
}

}  // namespace catoptric::measure
