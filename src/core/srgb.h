// The sRGB transfer function (IEC 61966-2-1): encoded 0..1 to linear light and back.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>

namespace catoptric {

inline double linearFromSrgb(double encoded) {
  return encoded <= 0.04045 ? encoded / 12.92 : std::pow((encoded + 0.055) / 1.055, 2.4);
}
inline double srgbFromLinear(double linear) {
  return linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1.0 / 2.4) - 0.055;
}

/// The linear value of each 8-bit code.
inline const std::array<float, 256>& linearOfSrgb8() {
  static const std::array<float, 256> table = [] {
    std::array<float, 256> values{};
    for (std::size_t i = 0; i < values.size(); ++i)
      values[i] = static_cast<float>(linearFromSrgb(static_cast<double>(i) / 255.0));
    return values;
  }();
  return table;
}

}  // namespace catoptric
