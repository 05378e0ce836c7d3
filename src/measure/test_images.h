// Test images with known differences in display steps.
#pragma once

#include <cmath>

#include "image/image.h"

namespace catoptric::test {

/// The linear value whose display value is `step`.
inline float linearOf(int step) {
  const double v = step / 255.0;
  return static_cast<float>(v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4));
}

inline image::Image flat(int width, int height, float value) {
  image::Image image{width, height, {"R", "G", "B"}, {}};
  image.data.assign(image.pixelCount() * 3, value);
  return image;
}

}  // namespace catoptric::test
