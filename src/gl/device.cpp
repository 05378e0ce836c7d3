#include "gl/device.h"

#include <charconv>

#include "core/error.h"
#include "core/text.h"

namespace catoptric::gl {

std::string DeviceChoice::text() const {
  if (automatic) return "auto";
  switch (platform) {
    case Platform::EglDevice:
      return "egl:" + std::to_string(index);
    case Platform::EglSurfaceless:
      return "surfaceless";
    case Platform::OsMesa:
      return "osmesa";
  }
  return {};
}

DeviceChoice parseDevice(std::string_view text) {
  if (text == "auto") return {};
  if (text == "surfaceless") return {false, Platform::EglSurfaceless, 0};
  if (text == "osmesa") return {false, Platform::OsMesa, 0};
  if (text.starts_with("egl:")) {
    const std::string_view number = text.substr(4);
    int index = 0;
    const auto [end, error] = std::from_chars(number.data(), number.data() + number.size(), index);
    if (error == std::errc() && end == number.data() + number.size() && index >= 0) {
      return {false, Platform::EglDevice, index};
    }
  }
  static const std::string names[] = {"auto", "egl:0", "surfaceless", "osmesa"};
  throw UsageError("device \"" + std::string(text) +
                   "\": allowed are auto, egl:N (N = 0, 1, ...), " + "surfaceless, osmesa" +
                   didYouMean(text, names));
}

}  // namespace catoptric::gl
