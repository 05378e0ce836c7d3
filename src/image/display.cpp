// Frames as they are shown, by OpenColorIO.
#include <OpenColorIO/OpenColorIO.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <mutex>
#include <new>
#include <sstream>
#include <string_view>

#include "core/error.h"
#include "core/log.h"
#include "image/checks.h"
#include "image/image.h"
#include "image/ocio_config.h"

namespace catoptric::image {
namespace {

namespace ocio = OCIO_NAMESPACE;

/// The compression of Khronos PBR Neutral (its specification, 2024): colours up to 0.8 stay,
/// brighter ones approach 1 and lose saturation. DEVIATION: it also takes 0.04 off, what
/// dielectrics reflect, and 6.25 x^2 is left of a dark x. Black plastic and lacquer lose all detail
/// by that.
void compress(float* rgb) {
  constexpr float kStart = 0.8f;
  constexpr float kDesaturation = 0.15f;
  constexpr float kRoom = 1.0f - kStart;
  const float peak = std::max({rgb[0], rgb[1], rgb[2]});
  if (peak < kStart) return;
  const float shown = 1.0f - kRoom * kRoom / (peak + kRoom - kStart);
  const float white = 1.0f - 1.0f / (kDesaturation * (peak - shown) + 1.0f);
  for (int c = 0; c < 3; ++c) rgb[c] = std::lerp(rgb[c] * shown / peak, shown, white);
}

/// A view, ready for use.
struct Processor {
  bool neutral = false;
  ocio::ConstCPUProcessorRcPtr display;
};

/// "sRGB: Standard, Filmic; P3: Standard"
std::string viewsOf(const ocio::Config& config) {
  std::string text;
  for (int d = 0; d < config.getNumDisplays(); ++d) {
    const char* display = config.getDisplay(d);
    text += (d > 0 ? "; " : "") + std::string(display) + ": ";
    for (int v = 0; v < config.getNumViews(display); ++v)
      text += (v > 0 ? ", " : "") + std::string(config.getView(display, v));
  }
  return text;
}

/// The first display that has a view, from the default one on; empty: none has it.
std::string displayOf(const ocio::Config& config, const std::string& view) {
  std::vector<std::string> displays = {config.getDefaultDisplay()};
  for (int d = 0; d < config.getNumDisplays(); ++d) displays.emplace_back(config.getDisplay(d));
  for (const std::string& display : displays)
    for (int v = 0; v < config.getNumViews(display.c_str()); ++v)
      if (view == config.getView(display.c_str(), v)) return display;
  return {};
}

/// What a config calls scene-linear Rec.709; empty: no name that is known.
std::string rec709Of(const ocio::Config& config) {
  for (const char* name : {"lin_rec709", "Linear Rec.709 (sRGB)", "Utility - Linear - sRGB",
                           "lin_srgb", "Linear Rec.709"})
    if (config.getColorSpace(name) != nullptr) return name;
  return {};
}

/// From scene-linear Rec.709 to a view of a config.
ocio::ConstTransformRcPtr transformTo(const ocio::Config& config, const DisplayView& wanted,
                                      const std::string& display, const std::string& view) {
  const auto all = ocio::GroupTransform::Create();
  if (wanted.exposureStops != 0.0f) {
    const auto exposure = ocio::ExposureContrastTransform::Create();
    exposure->setStyle(ocio::EXPOSURE_CONTRAST_LINEAR);
    exposure->setExposure(wanted.exposureStops);
    all->appendTransform(exposure);
  }
  std::string source = rec709Of(config);
  if (source.empty() && config.hasRole(ocio::ROLE_INTERCHANGE_SCENE)) {
    // Linear Rec.709, D65, to ACES2065-1, with Bradford's adaptation
    constexpr double kAcesFromRec709[16] = {0.4396329819,
                                            0.3829886981,
                                            0.1773783199,
                                            0,
                                            0.0897764428,
                                            0.8134394286,
                                            0.0967841284,
                                            0,
                                            0.0175411704,
                                            0.1115465500,
                                            0.8709122797,
                                            0,
                                            0,
                                            0,
                                            0,
                                            1};
    const auto matrix = ocio::MatrixTransform::Create();
    matrix->setMatrix(kAcesFromRec709);
    all->appendTransform(matrix);
    source = ocio::ROLE_INTERCHANGE_SCENE;
  }
  if (source.empty()) {
    log::warning(wanted.config.string() +
                 ": has neither a known name of linear Rec.709 nor the role aces_interchange; its "
                 "scene_linear is taken for Rec.709");
    source = ocio::ROLE_SCENE_LINEAR;
  }
  const auto shown = ocio::DisplayViewTransform::Create();
  shown->setSrc(source.c_str());
  shown->setDisplay(display.c_str());
  shown->setView(view.c_str());
  all->appendTransform(shown);
  return all;
}

ocio::ConstConfigRcPtr configOf(const std::filesystem::path& file) {
  if (!file.empty()) {
    ocio::ConstConfigRcPtr config = ocio::Config::CreateFromFile(file.c_str());
    config->validate();
    return config;
  }
  std::istringstream text(kOcioConfig);
  return ocio::Config::CreateFromStream(text);
}

Processor makeProcessor(const DisplayView& wanted) {
  const ocio::ConstConfigRcPtr config = configOf(wanted.config);
  const bool neutral = wanted.config.empty() && wanted.view == kNeutralView;
  std::string view = neutral ? std::string() : wanted.view;
  if (view.empty()) view = config->getDefaultView(config->getDefaultDisplay());
  const std::string display = displayOf(*config, view);
  if (display.empty())
    throw UsageError((wanted.config.empty() ? "the built-in config" : wanted.config.string()) +
                     ": has no view \"" + view + "\"; its views are " + viewsOf(*config) +
                     (wanted.config.empty() ? std::string(", ") + kNeutralView : std::string()));
  return {neutral, config->getProcessor(transformTo(*config, wanted, display, view))
                       ->getOptimizedCPUProcessor(ocio::BIT_DEPTH_F32, ocio::BIT_DEPTH_UINT8,
                                                  ocio::OPTIMIZATION_LOSSLESS)};
}

/// The views asked for.
class Displays {
 public:
  const Processor& of(const DisplayView& view) {
    const std::lock_guard lock(mutex_);
    const auto [found, isNew] = processors_.try_emplace(view);
    if (found->second.display == nullptr) found->second = makeProcessor(view);
    return found->second;
  }

 private:
  std::mutex mutex_;
  std::map<DisplayView, Processor> processors_;
};

Displays& displays() {
  static Displays instance;
  return instance;
}

}  // namespace

std::string viewFingerprint(const DisplayView& view) {
  try {
    return (view.config.empty() ? view.view + " " : "") + displays().of(view).display->getCacheID();
  } catch (const ocio::Exception& error) {
    throw UsageError(view.config.string() + ": " + error.what());
  }
}

std::vector<std::uint8_t> displayRgb8(const Image& image, const DisplayView& view) {
  requireWellFormed(image);
  const int red = image.channel("R");
  const int green = image.channel("G");
  const int blue = image.channel("B");
  if (red < 0 || green < 0 || blue < 0)
    throw OutputError("image of " + describe(image) + ": it has no channels R, G, B to show");

  // What OpenColorIO need not see is bounded here, and marked afterwards
  constexpr float kBound = 1e9f;
  const std::size_t count = image.channels.size();
  const auto width = static_cast<std::size_t>(image.width);
  std::vector<float> rgb(width * 3);
  std::vector<std::uint8_t> out(image.pixelCount() * 3);
  std::vector<std::size_t> notNumbers;
  const int indices[3] = {red, green, blue};
  const auto packRow = [&](std::size_t firstPixel) {
    for (std::size_t x = 0; x < width; ++x) {
      bool bad = false;
      for (std::size_t c = 0; c < 3; ++c) {
        const float value =
            image.data[(firstPixel + x) * count + static_cast<std::size_t>(indices[c])];
        bad = bad || std::isnan(value);
        rgb[3 * x + c] = std::isnan(value) ? 0.0f : std::clamp(value, -kBound, kBound);
      }
      if (bad) notNumbers.push_back(firstPixel + x);
    }
  };
  try {
    // A row each: OpenColorIO takes 28 bytes for each pixel of a row
    const Processor& processor = displays().of(view);
    for (std::size_t first = 0; first < image.pixelCount(); first += width) {
      packRow(first);
      if (processor.neutral)
        for (std::size_t x = 0; x < width; ++x) compress(&rgb[3 * x]);
      const ocio::PackedImageDesc from(rgb.data(), image.width, 1, 3);
      ocio::PackedImageDesc to(&out[3 * first], image.width, 1, 3, ocio::BIT_DEPTH_UINT8, 1,
                               ocio::AutoStride, ocio::AutoStride);
      processor.display->apply(from, to);
    }
  } catch (const ocio::Exception& error) {
    // It hides what was thrown.
    if (std::string_view(error.what()).find("bad_alloc") != std::string_view::npos)
      throw std::bad_alloc();
    throw OutputError("preview of " + describe(image) + ": " + error.what());
  }
  for (const std::size_t p : notNumbers) {
    out[3 * p] = 255;
    out[3 * p + 1] = 0;
    out[3 * p + 2] = 255;
  }
  return out;
}

}  // namespace catoptric::image
