#include "image/image.h"

#include <set>

#include "core/error.h"
#include "image/checks.h"

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

std::string describe(const Image& image) {
  return std::to_string(image.width) + " x " + std::to_string(image.height) + " pixels of " +
         std::to_string(image.channels.size()) + " channels";
}

void requireWellFormed(const Image& image) {
  if (image.width < 1 || image.height < 1 || image.channels.empty())
    throw OutputError("image of " + describe(image) + ": nothing to write");
  if (image.data.size() != image.pixelCount() * image.channels.size())
    throw OutputError("image of " + describe(image) + " has " + std::to_string(image.data.size()) +
                      " values; this is not width x height x channels");
  std::set<std::string> seen;
  for (const std::string& name : image.channels) {
    if (name.empty() || name.size() > 255)
      throw OutputError("image channel \"" + name + "\": names have 1 to 255 characters");
    if (!seen.insert(name).second) throw OutputError("image channel " + name + " occurs twice");
  }
}

}  // namespace catoptric::image
