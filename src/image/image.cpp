#include "image/image.h"

#include <algorithm>
#include <cmath>

#include "core/srgb.h"

namespace catoptric::image {

int Image::channel(const std::string& name) const {
  const auto found = std::find(channels.begin(), channels.end(), name);
  return found == channels.end() ? -1 : static_cast<int>(found - channels.begin());
}

float display8(float linear) {
  if (std::isnan(linear)) return linear;
  if (linear <= 0.0f) return 0.0f;
  if (linear >= 1.0f) return 255.0f;
  return static_cast<float>(255.0 * srgbFromLinear(linear));
}

}  // namespace catoptric::image
