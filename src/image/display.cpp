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
#include "image/checks.h"
#include "image/image.h"
#include "image/ocio_config.h"

namespace catoptric::image {
namespace {

namespace ocio = OCIO_NAMESPACE;

/// The processors of our config, one for each exposure asked for.
class Displays {
 public:
  ocio::ConstCPUProcessorRcPtr of(float stops) {
    const std::lock_guard lock(mutex_);
    if (!config_) {
      std::istringstream text(kOcioConfig);
      config_ = ocio::Config::CreateFromStream(text);
      config_->validate();
    }
    auto& processor = processors_[stops];
    if (!processor) {
      const auto exposure = ocio::ExposureContrastTransform::Create();
      exposure->setStyle(ocio::EXPOSURE_CONTRAST_LINEAR);
      exposure->setExposure(stops);
      const auto view = ocio::DisplayViewTransform::Create();
      view->setSrc("scene_linear");
      view->setDisplay("sRGB");
      view->setView("sRGB");
      const auto both = ocio::GroupTransform::Create();
      if (stops != 0.0f) both->appendTransform(exposure);
      both->appendTransform(view);
      processor = config_->getProcessor(both)->getOptimizedCPUProcessor(
          ocio::BIT_DEPTH_F32, ocio::BIT_DEPTH_UINT8, ocio::OPTIMIZATION_LOSSLESS);
    }
    return processor;
  }

 private:
  std::mutex mutex_;
  ocio::ConstConfigRcPtr config_;
  std::map<float, ocio::ConstCPUProcessorRcPtr> processors_;
};

Displays& displays() {
  static Displays instance;
  return instance;
}

}  // namespace

std::vector<std::uint8_t> displayRgb8(const Image& image, float exposureStops) {
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
    const ocio::ConstCPUProcessorRcPtr processor = displays().of(exposureStops);
    for (std::size_t first = 0; first < image.pixelCount(); first += width) {
      packRow(first);
      const ocio::PackedImageDesc from(rgb.data(), image.width, 1, 3);
      ocio::PackedImageDesc to(&out[3 * first], image.width, 1, 3, ocio::BIT_DEPTH_UINT8, 1,
                               ocio::AutoStride, ocio::AutoStride);
      processor->apply(from, to);
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
