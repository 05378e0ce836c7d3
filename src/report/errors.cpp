#include "report/errors.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cmath>
#include <limits>
#include <set>

#include "core/error.h"
#include "core/parallel.h"
#include "report/differences.h"

namespace catoptric::report {
namespace {

using image::Image;

std::string sizeText(const Image& image) {
  return std::to_string(image.width) + " x " + std::to_string(image.height);
}

/// round(display8(value)) by a table: the smallest value of each step, found by bisection, and a
/// first guess from the leading bits of the value.
class Steps8 {
 public:
  Steps8() {
    for (int step = 1; step < 256; ++step) {
      std::uint32_t low = 0;  // shows less than `step`
      std::uint32_t high = std::bit_cast<std::uint32_t>(1.0f);
      while (high - low > 1) {
        const std::uint32_t middle = low + (high - low) / 2;
        const float shown = image::display8(std::bit_cast<float>(middle));
        (std::lround(shown) >= step ? high : low) = middle;
      }
      first_[static_cast<std::size_t>(step)] = std::bit_cast<float>(high);
    }
    for (std::size_t i = 0; i < guess_.size(); ++i) {
      const float least = std::bit_cast<float>(static_cast<std::uint32_t>(i) << kShift);
      int step = 0;
      while (step < 255 && first_[static_cast<std::size_t>(step + 1)] <= least) ++step;
      guess_[i] = static_cast<std::uint8_t>(step);
    }
  }
  int operator()(float value) const {
    if (!(value > 0.0f)) return 0;
    if (value >= 1.0f) return 255;
    int step = guess_[std::bit_cast<std::uint32_t>(value) >> kShift];
    while (step < 255 && value >= first_[static_cast<std::size_t>(step + 1)]) ++step;
    return step;
  }

 private:
  static constexpr int kShift = 17;
  std::array<float, 256> first_{};
  std::array<std::uint8_t, (0x3f800000u >> kShift) + 1> guess_{};
};

/// Where a layer is: an image and its channel; null when nobody has it.
struct Layer {
  const Image* image = nullptr;
  int channel = -1;

  float at(std::size_t pixel) const {
    return image->data[pixel * image->channels.size() + static_cast<std::size_t>(channel)];
  }
  explicit operator bool() const { return image != nullptr; }
};
Layer findLayer(const Image& image, const Image& reference,
                std::initializer_list<const char*> names) {
  for (const char* name : names)
    for (const Image* candidate : {&image, &reference})
      if (const int channel = candidate->channel(name); channel >= 0) return {candidate, channel};
  return {};
}

double quotient(double sum, double count) {
  return count > 0.0 ? sum / count : 0.0;
}

void add(RegionError& pooled, const RegionError& one, int frame) {
  pooled.pixels += one.pixels;
  pooled.notFinite += one.notFinite;
  pooled.notFiniteReference += one.notFiniteReference;
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
  if (one.maxLinear > pooled.maxLinear) {
    pooled.maxLinear = one.maxLinear;
    pooled.maxLinearFrame = frame;
    pooled.maxLinearX = one.maxLinearX;
    pooled.maxLinearY = one.maxLinearY;
  }
  pooled.over += one.over;
  pooled.ssimSum += one.ssimSum;
  pooled.flipSum += one.flipSum;
  pooled.hdrFlipSum += one.hdrFlipSum;
  pooled.flipMax = std::max(pooled.flipMax, one.flipMax);
  pooled.hdrFlipMax = std::max(pooled.hdrFlipMax, one.hdrFlipMax);
}

void add(ErrorShare& pooled, const ErrorShare& one) {
  pooled.pixels += one.pixels;
  pooled.sum8 += one.sum8;
  pooled.sumSquared += one.sumSquared;
  pooled.hdrFlipSum += one.hdrFlipSum;
}

void add(ImageError& pooled, const ImageError& one, int frame) {
  add(static_cast<RegionError&>(pooled), one, frame);
  pooled.hasReflective = pooled.hasReflective || one.hasReflective;
  add(pooled.reflective, one.reflective, frame);
  for (const auto& [id, object] : one.objects) add(pooled.objects[id], object, frame);
  for (const ErrorClass& part : one.classes) {
    auto found = std::find_if(pooled.classes.begin(), pooled.classes.end(),
                              [&](const ErrorClass& c) { return c.name == part.name; });
    if (found == pooled.classes.end()) {
      pooled.classes.push_back({part.name, {}, {}});
      found = std::prev(pooled.classes.end());
    }
    add(found->all, part.all);
    add(found->own, part.own);
  }
  pooled.flipPool.add(one.flipPool);
  pooled.hdrFlipPool.add(one.hdrFlipPool);
}

/// The layers that put a pixel into a class, the most telling first.
struct Classes {
  std::vector<std::pair<std::string, Layer>> masks;
  Layer id;
  Layer glossy;
  Layer reflective;

  Classes(const Image& image, const Image& reference) : width(image.width), height(image.height) {
    for (const char* name : {"mask.disoccluded", "mask.clamped", "mask.retraced",
                             "mask.environment", "mask.below_horizon"})
      if (const int c = image.channel(name); c >= 0) masks.push_back({name, {&image, c}});
    // Masks that we do not know come after those that we do
    for (std::size_t c = 0; c < image.channels.size(); ++c) {
      const std::string& name = image.channels[c];
      const auto known = [&](const auto& mask) { return mask.first == name; };
      if (name.starts_with("mask.") && name != "mask.reflective" && name != "mask.glossy" &&
          std::none_of(masks.begin(), masks.end(), known))
        masks.push_back({name, {&image, static_cast<int>(c)}});
    }
    id = findLayer(image, reference, {"id.object", "id"});
    glossy = findLayer(image, reference, {"mask.glossy", "g"});
    reflective = findLayer(image, reference, {"mask.reflective", "s"});
  }

  std::vector<ErrorClass> empty() const {
    std::vector<ErrorClass> all;
    for (const auto& mask : masks) all.push_back({mask.first, {}, {}});
    if (id) all.push_back({"silhouette", {}, {}});
    if (glossy) all.push_back({"glossy", {}, {}});
    if (reflective) all.push_back({"other reflective", {}, {}});
    all.push_back({"rest", {}, {}});
    return all;
  }

  /// An edge of objects: one of the eight neighbours has another id.
  bool silhouette(int x, int y) const {
    const float own = id.at(static_cast<std::size_t>(y) * width + x);
    for (int j = std::max(0, y - 1); j <= std::min(height - 1, y + 1); ++j)
      for (int i = std::max(0, x - 1); i <= std::min(width - 1, x + 1); ++i)
        if (id.at(static_cast<std::size_t>(j) * width + i) != own) return true;
    return false;
  }

  /// Ids of objects that reflect. At an edge the pixel reflects while its middle sample, whose id
  /// it has, may not: trusted are pixels all samples of which reflect, or (layer `s` alone, a mean)
  /// those that lie at no edge.
  std::set<int> reflectors() const {
    std::set<int> ids;
    if (!id || !reflective) return ids;
    const Image& layers = *reflective.image;
    const bool isMask =
        layers.channels[static_cast<std::size_t>(reflective.channel)] == "mask.reflective";
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) {
        const std::size_t pixel = static_cast<std::size_t>(y) * width + x;
        const int own = static_cast<int>(id.at(pixel));
        if (own == 0 || ids.contains(own)) continue;
        const float value = reflective.at(pixel);
        if (isMask ? value >= 1.0f : value > 0.0f && !silhouette(x, y)) ids.insert(own);
      }
    return ids;
  }

  /// Adds a pixel's error to its classes.
  void count(std::vector<ErrorClass>& all, int x, int y, bool isReflective,
             const ErrorShare& share) const {
    const std::size_t pixel = static_cast<std::size_t>(y) * width + x;
    std::size_t next = 0;
    bool owned = false;
    const auto member = [&](bool belongs) {
      ErrorClass& one = all[next++];
      if (!belongs) return;
      add(one.all, share);
      if (!owned) add(one.own, share);
      owned = true;
    };
    for (const auto& mask : masks) member(mask.second.at(pixel) > 0.0f);
    if (id) member(silhouette(x, y));
    if (glossy) member(isReflective && glossy.at(pixel) > 0.0f);
    if (reflective) member(isReflective && !owned);
    member(!owned);
  }

  int width = 0;
  int height = 0;
};

constexpr double kRelativeFloor = 0.01;

}  // namespace

double RegionError::l1() const {
  return quotient(static_cast<double>(sum8), 3.0 * static_cast<double>(pixels));
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

std::array<int, 3> colourChannels(const Image& image, const std::string& name) {
  const auto all = [&](const std::string& prefix, const char* r, const char* g, const char* b) {
    return std::array<int, 3>{image.channel(prefix + r), image.channel(prefix + g),
                              image.channel(prefix + b)};
  };
  const auto complete = [](const std::array<int, 3>& c) {
    return *std::min_element(c.begin(), c.end()) >= 0;
  };
  if (const auto c = all("", "R", "G", "B"); complete(c)) return c;
  if (const auto c = all("", "r", "g", "b"); complete(c)) return c;
  // The only layer that has colours
  std::vector<std::array<int, 3>> layers;
  for (const std::string& channel : image.channels)
    if (channel.ends_with(".R"))
      if (const auto c = all(channel.substr(0, channel.size() - 1), "R", "G", "B"); complete(c))
        layers.push_back(c);
  if (layers.size() == 1) return layers.front();
  if (const int y = image.channel("Y"); y >= 0) return {y, y, y};
  throw UsageError(name + ": no channels R, G, B to compare" +
                   (layers.size() > 1 ? " (several layers have them)" : ""));
}

void requireSameSize(const Image& image, const Image& reference, const std::string& name) {
  if (image.width != reference.width || image.height != reference.height)
    throw UsageError(name + ": " + sizeText(image) + " pixels, the reference has " +
                     sizeText(reference));
}

int step8(float value) {
  static const Steps8 steps;
  return steps(value);
}

std::vector<double> ssimMap(std::span<const float> a, std::span<const float> b, int width,
                            int height) {
  assert(a.size() == b.size() && a.size() == static_cast<std::size_t>(width) * height);
  constexpr int kRadius = 5;
  constexpr double kSigma = 1.5;
  constexpr double kC1 = 0.01 * 0.01;  // (K L)^2 with L = 1
  constexpr double kC2 = 0.03 * 0.03;
  std::array<double, 2 * kRadius + 1> kernel{};
  for (int i = -kRadius; i <= kRadius; ++i)
    kernel[static_cast<std::size_t>(i + kRadius)] = std::exp(-0.5 * i * i / (kSigma * kSigma));
  // Windows are cut at the borders: what is left of their weights
  const auto inverseWeights = [&](int size) {
    std::vector<double> inverse;
    for (int i = 0; i < size; ++i) {
      double sum = 0.0;
      for (int k = std::max(-kRadius, -i); k <= std::min(kRadius, size - 1 - i); ++k)
        sum += kernel[static_cast<std::size_t>(k + kRadius)];
      inverse.push_back(1.0 / sum);
    }
    return inverse;
  };
  const std::vector<double> perColumn = inverseWeights(width);
  const std::vector<double> perRow = inverseWeights(height);

  // Five weighted means: a, b, aa, bb, ab; rows first, then columns
  constexpr std::size_t kMeans = 5;
  const auto stride = static_cast<std::size_t>(width);
  std::array<std::vector<double>, kMeans> rows;
  for (auto& plane : rows) plane.resize(a.size());
  parallelFor(static_cast<std::size_t>(height), 16, [&](std::size_t begin, std::size_t end) {
    const std::size_t padded = stride + 2 * kRadius;
    std::vector<double> line(padded * kMeans, 0.0);
    for (std::size_t y = begin; y < end; ++y) {
      for (std::size_t x = 0; x < stride; ++x) {
        const double va = a[y * stride + x];
        const double vb = b[y * stride + x];
        const double values[kMeans] = {va, vb, va * va, vb * vb, va * vb};
        for (std::size_t m = 0; m < kMeans; ++m) line[m * padded + kRadius + x] = values[m];
      }
      for (std::size_t m = 0; m < kMeans; ++m) {
        double* __restrict out = rows[m].data() + y * stride;
        for (std::size_t k = 0; k < kernel.size(); ++k) {
          const double w = kernel[k];
          const double* in = line.data() + m * padded + k;
          for (std::size_t x = 0; x < stride; ++x) out[x] += w * in[x];
        }
        for (std::size_t x = 0; x < stride; ++x) out[x] *= perColumn[x];
      }
    }
  });
  std::vector<double> map(a.size());
  parallelFor(static_cast<std::size_t>(height), 16, [&](std::size_t begin, std::size_t end) {
    std::array<std::vector<double>, kMeans> mean;
    for (std::size_t y = begin; y < end; ++y) {
      const int row = static_cast<int>(y);
      for (std::size_t m = 0; m < kMeans; ++m) {
        mean[m].assign(stride, 0.0);
        double* __restrict out = mean[m].data();
        for (int k = std::max(-kRadius, -row); k <= std::min(kRadius, height - 1 - row); ++k) {
          const double w = kernel[static_cast<std::size_t>(k + kRadius)] * perRow[y];
          const double* in = rows[m].data() + static_cast<std::size_t>(row + k) * stride;
          for (std::size_t x = 0; x < stride; ++x) out[x] += w * in[x];
        }
      }
      for (std::size_t x = 0; x < stride; ++x) {
        const double ma = mean[0][x];
        const double mb = mean[1][x];
        const double varianceA = mean[2][x] - ma * ma;
        const double varianceB = mean[3][x] - mb * mb;
        const double covariance = mean[4][x] - ma * mb;
        map[y * stride + x] = (2.0 * ma * mb + kC1) * (2.0 * covariance + kC2) /
                              ((ma * ma + mb * mb + kC1) * (varianceA + varianceB + kC2));
      }
    }
  });
  return map;
}

double ssim(std::span<const float> a, std::span<const float> b, int width, int height) {
  double total = 0.0;
  for (const double v : ssimMap(a, b, width, height)) total += v;
  return total / static_cast<double>(a.size());
}

ImageError compareImages(const Image& image, const Image& reference, const std::string& name,
                         const CompareOptions& options, ErrorMaps* maps) {
  requireSameSize(image, reference, name);
  const std::array<int, 3> from = colourChannels(image, name);
  const std::array<int, 3> to = colourChannels(reference, name + " (reference)");
  const Classes classes(image, reference);

  // Maps of what looks at neighbours
  ErrorMaps own;
  ErrorMaps& errors = maps != nullptr ? *maps : own;
  const ColourView test{&image, from};
  const ColourView truth{&reference, to};
  errors.flip = ldrFlip(truth, test, options.flip);
  errors.hdrFlip = hdrFlip(truth, test, options.flip);
  // Luminance of Rec.709; what is not finite shows as black here, and is counted below
  const auto greyOf = [](const ColourView& view) {
    std::vector<float> grey(view.image->pixelCount());
    const std::size_t stride = view.image->channels.size();
    for (std::size_t p = 0; p < grey.size(); ++p) {
      const float* pixel = view.image->data.data() + p * stride;
      const float v = 0.2126f * pixel[view.channels[0]] + 0.7152f * pixel[view.channels[1]] +
                      0.0722f * pixel[view.channels[2]];
      grey[p] = std::isfinite(v) ? v : 0.0f;
    }
    return grey;
  };
  const std::vector<double> similarity =
      ssimMap(greyOf(test), greyOf(truth), image.width, image.height);

  const std::set<int> reflectors = classes.reflectors();

  // Bands of rows, added up in order: the same sums for any number of threads
  constexpr int kBand = 32;
  const int bands = (image.height + kBand - 1) / kBand;
  std::vector<ImageError> parts(static_cast<std::size_t>(bands));
  const auto band = [&](ImageError& e, int firstRow, int lastRow) {
    e.hasReflective = static_cast<bool>(classes.reflective);
    e.classes = classes.empty();
    for (int y = firstRow; y < lastRow; ++y)
      for (int x = 0; x < image.width; ++x) {
        const std::size_t p = static_cast<std::size_t>(y) * image.width + x;
        RegionError one;
        one.pixels = 1;
        bool finiteA = true;
        bool finiteB = true;
        for (std::size_t c = 0; c < 3; ++c) {
          finiteA = finiteA && std::isfinite(image.at(x, y, from[c]));
          finiteB = finiteB && std::isfinite(reference.at(x, y, to[c]));
        }
        one.notFinite = finiteA ? 0 : 1;
        one.notFiniteReference = finiteB ? 0 : 1;
        if (finiteA && finiteB) {
          for (std::size_t c = 0; c < 3; ++c) {
            const float a = image.at(x, y, from[c]);
            const float b = reference.at(x, y, to[c]);
            const int difference = std::abs(step8(a) - step8(b));
            one.sum8 += static_cast<std::uint64_t>(difference);
            one.max8 = std::max(one.max8, difference);
            const double linear = std::abs(double{a} - double{b});
            one.sumAbsolute += linear;
            one.sumSquared += linear * linear;
            one.sumRelative += linear * linear / (double{b} * double{b} + kRelativeFloor);
            one.maxLinear = std::max(one.maxLinear, linear);
          }
          one.linearValues = 3;
          one.over = one.maxLinear > options.threshold ? 1 : 0;
        } else {
          one.sum8 = 3 * 255;
          one.max8 = 255;
          one.over = 1;
        }
        one.max8X = one.maxLinearX = x;
        one.max8Y = one.maxLinearY = y;
        one.ssimSum = similarity[p];
        one.flipMax = errors.flip[p];
        one.flipSum = one.flipMax;
        one.hdrFlipMax = errors.hdrFlip[p];
        one.hdrFlipSum = one.hdrFlipMax;

        add(static_cast<RegionError&>(e), one, 0);
        const bool isReflective = classes.reflective && classes.reflective.at(p) > 0.0f;
        if (isReflective) {
          add(e.reflective, one, 0);
          if (classes.id && reflectors.contains(static_cast<int>(classes.id.at(p))))
            add(e.objects[static_cast<int>(classes.id.at(p))], one, 0);
        }
        classes.count(e.classes, x, y, isReflective, {1, one.sum8, one.sumSquared, one.hdrFlipSum});
      }
  };
  parallelFor(parts.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      band(parts[i], static_cast<int>(i) * kBand,
           std::min(image.height, (static_cast<int>(i) + 1) * kBand));
  });
  ImageError e;
  for (const ImageError& part : parts) add(e, part, 0);
  e.flipPool.add(errors.flip);
  e.hdrFlipPool.add(errors.hdrFlip);
  return e;
}

RunComparison compareRuns(const RunData& run, const RunData& reference,
                          const CompareOptions& options, const PictureOptions& pictures) {
  RunComparison comparison;
  comparison.name = run.name;
  comparison.reference = reference.name;
  comparison.objectNames = run.objectNames.empty() ? reference.objectNames : run.objectNames;
  std::vector<int> common;
  for (const auto& [number, file] : run.frames)
    (reference.frames.contains(number) ? common : comparison.onlyInRun).push_back(number);
  for (const auto& [number, file] : reference.frames)
    if (!run.frames.contains(number)) comparison.onlyInReference.push_back(number);
  if (common.empty())
    throw UsageError(run.folder.string() + " has no frame in common with " +
                     reference.folder.string() + " (" + std::to_string(run.frames.size()) +
                     " and " + std::to_string(reference.frames.size()) + " frames)");

  std::vector<ImageError> errors(common.size());
  parallelFor(common.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const auto& file = run.frames.at(common[i]);
      const Image image = image::readImage(file);
      const Image truth = image::readImage(reference.frames.at(common[i]));
      ErrorMaps maps;
      errors[i] = compareImages(image, truth, file.string(), options, &maps);
      if (!pictures.folder.empty())
        writeDifferences({image, truth, maps, errors[i], common[i], run.name, reference.name},
                         pictures.folder);
    }
  });
  for (std::size_t i = 0; i < common.size(); ++i) {
    comparison.frames[common[i]] = errors[i];
    add(comparison.pooled, errors[i], common[i]);
  }
  return comparison;
}

}  // namespace catoptric::report
