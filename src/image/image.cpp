#include "image/image.h"

#include <algorithm>
#include <cmath>

namespace catoptric::image {

int Image::channel(const std::string& name) const {
  const auto found = std::find(channels.begin(), channels.end(), name);
  return found == channels.end() ? -1 : static_cast<int>(found - channels.begin());
}

float display8(float linear) {
  if (std::isnan(linear)) return linear;
  if (linear <= 0.0f) return 0.0f;
  if (linear >= 1.0f) return 255.0f;
  // IEC 61966-2-1, 5.2.2: linear segment near black, power 1/2.4 above
  const double l = linear;
  const double encoded = l <= 0.0031308 ? 12.92 * l : 1.055 * std::pow(l, 1.0 / 2.4) - 0.055;
  return static_cast<float>(255.0 * encoded);
}

}  // namespace catoptric::image
