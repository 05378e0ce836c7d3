#include "report/errors.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstdio>
#include <limits>

#include "config/json_text.h"
#include "core/error.h"
#include "core/file.h"
#include "core/parallel.h"

namespace catoptric::report {
namespace {

using image::Image;

std::string sizeText(const Image& image) {
  return std::to_string(image.width) + " x " + std::to_string(image.height);
}

/// Indices of R, G, B.
std::array<int, 3> colours(const Image& image, const std::string& name) {
  const std::array<int, 3> indices{image.channel("R"), image.channel("G"), image.channel("B")};
  if (*std::min_element(indices.begin(), indices.end()) < 0)
    throw UsageError(name + ": no channels R, G, B to compare");
  return indices;
}

void requireSameSize(const Image& image, const Image& reference, const std::string& name) {
  if (image.width != reference.width || image.height != reference.height)
    throw UsageError(name + ": " + sizeText(image) + " pixels, the reference has " +
                     sizeText(reference));
}

int step8(float value) {
  return static_cast<int>(std::lround(image::display8(value)));
}

/// Where the reflective pixels are told: an image and its channel; null when nobody tells.
struct ReflectiveLayer {
  const Image* image = nullptr;
  int channel = -1;
};
ReflectiveLayer reflectiveLayer(const Image& image, const Image& reference) {
  for (const char* layer : {"mask.reflective", "s"})
    for (const Image* candidate : {&image, &reference})
      if (const int channel = candidate->channel(layer); channel >= 0) return {candidate, channel};
  return {};
}

double quotient(double sum, double count) {
  return count > 0.0 ? sum / count : 0.0;
}

void add(ImageError& pooled, const ImageError& one, int frame) {
  pooled.pixels += one.pixels;
  pooled.notFinite += one.notFinite;
  pooled.notFiniteReference += one.notFiniteReference;
  pooled.hasReflective = pooled.hasReflective || one.hasReflective;
  pooled.reflectivePixels += one.reflectivePixels;
  pooled.sum8 += one.sum8;
  pooled.sum8Reflective += one.sum8Reflective;
  if (one.max8 > pooled.max8) {
    pooled.max8 = one.max8;
    pooled.max8Frame = frame;
    pooled.max8X = one.max8X;
    pooled.max8Y = one.max8Y;
  }
  pooled.linearValues += one.linearValues;
  pooled.sumAbsolute += one.sumAbsolute;
  pooled.sumSquared += one.sumSquared;
  if (one.maxLinear > pooled.maxLinear) {
    pooled.maxLinear = one.maxLinear;
    pooled.maxLinearX = one.maxLinearX;
    pooled.maxLinearY = one.maxLinearY;
  }
  pooled.ssimSum += one.ssimSum;
  pooled.images += one.images;
}

std::string decibels(double psnr) {
  return std::isinf(psnr) ? "inf" : fixedText(psnr, 2);
}

std::string place(const ImageError& e) {
  return e.max8X < 0 ? "" : std::to_string(e.max8X) + "," + std::to_string(e.max8Y);
}

/// Measures of a row of the tables, after its first cells.
void appendMeasures(std::vector<std::string>& cells, const ImageError& e) {
  cells.push_back(fixedText(e.l1(), 3));
  cells.push_back(e.hasReflective ? fixedText(e.l1Reflective(), 3) : "");
  cells.push_back(fixedText(e.mae(), 5));
  cells.push_back(fixedText(e.rmse(), 5));
  cells.push_back(decibels(e.psnr()));
  cells.push_back(fixedText(e.ssim(), 4));
  cells.push_back(std::to_string(e.max8));
}

const std::vector<Column> kMeasures = {{"L1_8bit", true}, {"reflective", true}, {"MAE", true},
                                       {"RMSE", true},    {"PSNR dB", true},    {"SSIM", true},
                                       {"max_8bit", true}};
constexpr const char* kMeaning =
    "L1_8bit, max_8bit: display-referred steps of 255, \"reflective\" over reflective pixels only; "
    "MAE, RMSE, PSNR (peak 1), SSIM (luminance): scene-linear.";

/// NaN and infinities first: nothing else can be trusted beside them.
void appendNotFinite(Table& table, const std::string& name, const ImageError& e) {
  if (e.notFinite + e.notFiniteReference == 0) return;
  table.notes.push_back("ATTENTION: " + name + ": NaN or infinity in " +
                        std::to_string(e.notFinite) + " pixels, and in " +
                        std::to_string(e.notFiniteReference) +
                        " of the reference; they count as 255 off, and in no linear measure.");
}

std::string frameList(const std::vector<int>& frames) {
  std::string text;
  for (const int frame : frames) text += (text.empty() ? "" : ",") + std::to_string(frame);
  return text;
}

void appendMissing(Table& table, const RunComparison& c) {
  if (!c.onlyInRun.empty())
    table.notes.push_back(c.reference + " lacks frames " + frameList(c.onlyInRun) + " of " +
                          c.name + ".");
  if (!c.onlyInReference.empty())
    table.notes.push_back(c.name + " lacks frames " + frameList(c.onlyInReference) + " of " +
                          c.reference + ".");
}

std::string json(const ImageError& e, const std::string& frameMember) {
  config::JsonText text;
  if (!frameMember.empty()) text.raw("frame", frameMember);
  text.add("not_finite", e.notFinite).add("not_finite_reference", e.notFiniteReference);
  text.add("pixels", e.pixels).add("l1_8bit", e.l1());
  if (e.hasReflective)
    text.add("reflective_pixels", e.reflectivePixels).add("l1_8bit_reflective", e.l1Reflective());
  text.add("mae", e.mae()).add("rmse", e.rmse());
  if (std::isinf(e.psnr()))
    text.raw("psnr", "null");
  else
    text.add("psnr", e.psnr());
  text.add("ssim", e.ssim()).add("max_8bit", e.max8).add("max_linear", e.maxLinear);
  if (e.max8X >= 0) text.add("max_8bit_pixel", std::vector<int>{e.max8X, e.max8Y});
  if (frameMember.empty() && e.max8X >= 0) text.add("max_8bit_frame", e.max8Frame);
  return text.object();
}

std::string frameFile(int frame, const char* extension) {
  char name[64];
  std::snprintf(name, sizeof name, "frame.%04d%s", frame, extension);
  return name;
}

/// Numbers of the frames that both have.
std::vector<int> commonFrames(const RunData& run, const RunData& reference) {
  std::vector<int> common;
  for (const auto& [number, file] : run.frames)
    if (reference.frames.contains(number)) common.push_back(number);
  if (common.empty())
    throw UsageError(run.folder.string() + " has no frame in common with " +
                     reference.folder.string() + " (" + std::to_string(run.frames.size()) +
                     " and " + std::to_string(reference.frames.size()) + " frames)");
  return common;
}

}  // namespace

double ImageError::l1() const {
  return quotient(static_cast<double>(sum8), 3.0 * static_cast<double>(pixels));
}
double ImageError::l1Reflective() const {
  return quotient(static_cast<double>(sum8Reflective), 3.0 * static_cast<double>(reflectivePixels));
}
double ImageError::mae() const {
  return quotient(sumAbsolute, static_cast<double>(linearValues));
}
double ImageError::rmse() const {
  return std::sqrt(quotient(sumSquared, static_cast<double>(linearValues)));
}
double ImageError::psnr() const {
  const double error = rmse();
  return error > 0.0 ? -20.0 * std::log10(error) : std::numeric_limits<double>::infinity();
}
double ImageError::ssim() const {
  return quotient(ssimSum, images);
}

double ssim(std::span<const float> a, std::span<const float> b, int width, int height) {
  assert(a.size() == b.size() && a.size() == static_cast<std::size_t>(width) * height);
  constexpr int kRadius = 5;
  constexpr double kSigma = 1.5;
  constexpr double kC1 = 0.01 * 0.01;  // (K L)^2 with L = 1
  constexpr double kC2 = 0.03 * 0.03;
  std::array<double, 2 * kRadius + 1> kernel{};
  for (int i = -kRadius; i <= kRadius; ++i)
    kernel[static_cast<std::size_t>(i + kRadius)] = std::exp(-0.5 * i * i / (kSigma * kSigma));

  // Five weighted means: a, b, aa, bb, ab; rows first, then columns
  using Moments = std::array<double, 5>;
  const auto index = [&](int x, int y) { return static_cast<std::size_t>(y) * width + x; };
  std::vector<Moments> rows(a.size());
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      Moments sum{};
      double weights = 0.0;
      for (int i = std::max(-kRadius, -x); i <= std::min(kRadius, width - 1 - x); ++i) {
        const double w = kernel[static_cast<std::size_t>(i + kRadius)];
        const double va = a[index(x + i, y)];
        const double vb = b[index(x + i, y)];
        weights += w;
        sum[0] += w * va;
        sum[1] += w * vb;
        sum[2] += w * va * va;
        sum[3] += w * vb * vb;
        sum[4] += w * va * vb;
      }
      for (std::size_t m = 0; m < 5; ++m) rows[index(x, y)][m] = sum[m] / weights;
    }
  double total = 0.0;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      Moments mean{};
      double weights = 0.0;
      for (int i = std::max(-kRadius, -y); i <= std::min(kRadius, height - 1 - y); ++i) {
        const double w = kernel[static_cast<std::size_t>(i + kRadius)];
        weights += w;
        for (std::size_t m = 0; m < 5; ++m) mean[m] += w * rows[index(x, y + i)][m];
      }
      for (double& m : mean) m /= weights;
      const double varianceA = mean[2] - mean[0] * mean[0];
      const double varianceB = mean[3] - mean[1] * mean[1];
      const double covariance = mean[4] - mean[0] * mean[1];
      total += (2.0 * mean[0] * mean[1] + kC1) * (2.0 * covariance + kC2) /
               ((mean[0] * mean[0] + mean[1] * mean[1] + kC1) * (varianceA + varianceB + kC2));
    }
  return total / static_cast<double>(a.size());
}

ImageError compareImages(const Image& image, const Image& reference, const std::string& name) {
  requireSameSize(image, reference, name);
  const std::array<int, 3> from = colours(image, name);
  const std::array<int, 3> to = colours(reference, name + " (reference)");
  const ReflectiveLayer layer = reflectiveLayer(image, reference);

  ImageError e;
  e.pixels = image.pixelCount();
  e.hasReflective = layer.image != nullptr;
  e.images = 1;
  std::vector<float> grey(image.pixelCount());
  std::vector<float> greyReference(image.pixelCount());
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      std::array<float, 3> a{};
      std::array<float, 3> b{};
      bool finiteA = true;
      bool finiteB = true;
      for (std::size_t c = 0; c < 3; ++c) {
        a[c] = image.at(x, y, from[c]);
        b[c] = reference.at(x, y, to[c]);
        finiteA = finiteA && std::isfinite(a[c]);
        finiteB = finiteB && std::isfinite(b[c]);
      }
      e.notFinite += !finiteA;
      e.notFiniteReference += !finiteB;

      std::uint64_t sum = 0;
      int worst = 0;
      double worstLinear = 0.0;
      if (finiteA && finiteB) {
        for (std::size_t c = 0; c < 3; ++c) {
          const int difference = std::abs(step8(a[c]) - step8(b[c]));
          sum += static_cast<std::uint64_t>(difference);
          worst = std::max(worst, difference);
          const double linear = std::abs(double{a[c]} - double{b[c]});
          e.sumAbsolute += linear;
          e.sumSquared += linear * linear;
          worstLinear = std::max(worstLinear, linear);
        }
        e.linearValues += 3;
      } else {
        sum = 3 * 255;
        worst = 255;
      }
      e.sum8 += sum;
      if (worst > e.max8) {
        e.max8 = worst;
        e.max8X = x;
        e.max8Y = y;
      }
      if (worstLinear > e.maxLinear) {
        e.maxLinear = worstLinear;
        e.maxLinearX = x;
        e.maxLinearY = y;
      }
      if (layer.image != nullptr && layer.image->at(x, y, layer.channel) > 0.0f) {
        ++e.reflectivePixels;
        e.sum8Reflective += sum;
      }
      // Luminance of Rec.709; what is not finite shows as black here, and is counted above
      const std::size_t p = static_cast<std::size_t>(y) * image.width + x;
      const auto luminance = [](const std::array<float, 3>& v) {
        return 0.2126f * v[0] + 0.7152f * v[1] + 0.0722f * v[2];
      };
      grey[p] = finiteA ? luminance(a) : 0.0f;
      greyReference[p] = finiteB ? luminance(b) : 0.0f;
    }
  e.ssimSum = ssim(grey, greyReference, image.width, image.height);
  return e;
}

RunComparison compareRuns(const RunData& run, const RunData& reference) {
  RunComparison comparison;
  comparison.name = run.name;
  comparison.reference = reference.name;
  for (const auto& [number, file] : run.frames)
    if (!reference.frames.contains(number)) comparison.onlyInRun.push_back(number);
  for (const auto& [number, file] : reference.frames)
    if (!run.frames.contains(number)) comparison.onlyInReference.push_back(number);

  const std::vector<int> common = commonFrames(run, reference);
  std::vector<ImageError> errors(common.size());
  parallelFor(common.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const auto& file = run.frames.at(common[i]);
      errors[i] = compareImages(image::readImage(file),
                                image::readImage(reference.frames.at(common[i])), file.string());
    }
  });
  for (std::size_t i = 0; i < common.size(); ++i) {
    comparison.frames[common[i]] = errors[i];
    add(comparison.pooled, errors[i], common[i]);
  }
  return comparison;
}

Table errorView(const RunComparison& comparison) {
  Table table;
  table.title = comparison.name + " against " + comparison.reference;
  table.columns = {{"frame", true}};
  table.columns.insert(table.columns.end(), kMeasures.begin(), kMeasures.end());
  table.columns.push_back({"at x,y", true});
  for (const auto& [number, e] : comparison.frames) {
    std::vector<std::string> cells{std::to_string(number)};
    appendMeasures(cells, e);
    cells.push_back(place(e));
    table.rows.push_back(cells);
  }
  table.rows.emplace_back();
  std::vector<std::string> cells{"all"};
  appendMeasures(cells, comparison.pooled);
  const std::string worst = place(comparison.pooled);
  cells.push_back(worst.empty() ? ""
                                : worst + " of " + std::to_string(comparison.pooled.max8Frame));
  table.rows.push_back(cells);
  appendNotFinite(table, comparison.name, comparison.pooled);
  appendMissing(table, comparison);
  table.notes.emplace_back(kMeaning);
  return table;
}

Table errorSummary(std::span<const RunComparison> comparisons,
                   std::span<const TimingTable> timings) {
  Table table;
  table.columns = {{"method", false}, {"against", false}, {"frames", true}};
  table.columns.insert(table.columns.end(), kMeasures.begin(), kMeasures.end());
  if (!timings.empty()) {
    table.columns.push_back({"ms", true});
    table.columns.push_back({"x of reference", true});
  }
  const auto meanOf = [&](const std::string& name) {
    for (const TimingTable& timing : timings)
      if (timing.name == name) return timing.rendering.mean;
    return 0.0;
  };
  for (const RunComparison& c : comparisons) {
    std::vector<std::string> cells{c.name, c.reference, std::to_string(c.frames.size())};
    appendMeasures(cells, c.pooled);
    if (!timings.empty()) {
      const double mean = meanOf(c.name);
      const double base = meanOf(c.reference);
      cells.push_back(mean > 0.0 ? fixedText(mean * 1e3, 2) : "");
      cells.push_back(mean > 0.0 && base > 0.0 ? fixedText(mean / base, 3) : "");
    }
    table.rows.push_back(cells);
    appendNotFinite(table, c.name + " against " + c.reference, c.pooled);
    appendMissing(table, c);
  }
  table.notes.emplace_back(kMeaning);
  return table;
}

std::string errorCsv(std::span<const RunComparison> comparisons) {
  std::string text =
      "method,against,frame,not_finite,not_finite_reference,pixels,reflective_pixels,l1_8bit,"
      "l1_8bit_reflective,mae,rmse,psnr,ssim,max_8bit,max_8bit_x,max_8bit_y,max_linear\n";
  for (const RunComparison& c : comparisons) {
    const auto row = [&](const std::string& frame, const ImageError& e) {
      text += csvCell(c.name) + "," + csvCell(c.reference) + "," + frame + "," +
              std::to_string(e.notFinite) + "," + std::to_string(e.notFiniteReference) + "," +
              std::to_string(e.pixels) + "," +
              (e.hasReflective ? std::to_string(e.reflectivePixels) : "") + "," +
              exactText(e.l1()) + "," + (e.hasReflective ? exactText(e.l1Reflective()) : "") + "," +
              exactText(e.mae()) + "," + exactText(e.rmse()) + "," + exactText(e.psnr()) + "," +
              exactText(e.ssim()) + "," + std::to_string(e.max8) + "," +
              (e.max8X >= 0 ? std::to_string(e.max8X) + "," + std::to_string(e.max8Y) : ",") + "," +
              exactText(e.maxLinear) + "\n";
    };
    for (const auto& [number, e] : c.frames) row(std::to_string(number), e);
    row("all", c.pooled);
  }
  return text;
}

std::string errorJson(std::span<const RunComparison> comparisons) {
  std::string text = "[";
  for (const RunComparison& c : comparisons) {
    std::string frames;
    for (const auto& [number, e] : c.frames)
      frames += (frames.empty() ? "" : ",") + json(e, std::to_string(number));
    text += (text.size() > 1 ? "," : "") + config::JsonText()
                                               .add("method", c.name)
                                               .add("against", c.reference)
                                               .raw("pooled", json(c.pooled, ""))
                                               .raw("frames", "[" + frames + "]")
                                               .add("only_in_run", c.onlyInRun)
                                               .add("only_in_reference", c.onlyInReference)
                                               .object();
  }
  return text + "]";
}

std::vector<std::uint8_t> differenceRgb8(const Image& image, const Image& reference, int gain) {
  requireSameSize(image, reference, "difference");
  const std::array<int, 3> from = colours(image, "difference");
  const std::array<int, 3> to = colours(reference, "difference (reference)");
  std::vector<std::uint8_t> rgb;
  rgb.reserve(image.pixelCount() * 3);
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      std::array<std::uint8_t, 3> pixel{};
      bool finite = true;
      for (std::size_t c = 0; c < 3; ++c) {
        const float a = image.at(x, y, from[c]);
        const float b = reference.at(x, y, to[c]);
        finite = finite && std::isfinite(a) && std::isfinite(b);
        if (finite)
          pixel[c] = static_cast<std::uint8_t>(std::min(255, gain * std::abs(step8(a) - step8(b))));
      }
      if (!finite) pixel = {255, 0, 255};
      rgb.insert(rgb.end(), pixel.begin(), pixel.end());
    }
  return rgb;
}

void writeDifferences(const RunData& run, const RunData& reference,
                      const std::filesystem::path& folder) {
  const std::vector<int> common = commonFrames(run, reference);
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) throw OutputError(folder.string() + ": cannot be created: " + error.message());
  parallelFor(common.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Image a = image::readImage(run.frames.at(common[i]));
      const Image b = image::readImage(reference.frames.at(common[i]));
      for (const auto& [gain, extension] : {std::pair{1, ".png"}, std::pair{50, ".x50.png"}})
        writeFileAtomically(folder / frameFile(common[i], extension),
                            image::encodePng(a.width, a.height, 3, differenceRgb8(a, b, gain)));
    }
  });
}

}  // namespace catoptric::report
