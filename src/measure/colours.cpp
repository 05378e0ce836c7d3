#include "measure/colours.h"

#include <algorithm>
#include <vector>

#include "core/error.h"

namespace catoptric::measure {
namespace {

using image::Image;

std::string sizeText(const Image& image) {
  return std::to_string(image.width) + " x " + std::to_string(image.height);
}

}  // namespace

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

ColourView layerColours(const Image& image, const std::string& layer) {
  ColourView view{&image, {}};
  for (std::size_t c = 0; c < 3; ++c) {
    view.channels[c] = image.channel(layer + "." + "RGB"[c]);
    if (view.channels[c] < 0) return {nullptr, {-1, -1, -1}};
  }
  return view;
}

void requireSameSize(const Image& image, const Image& reference, const std::string& name) {
  if (image.width != reference.width || image.height != reference.height)
    throw UsageError(name + ": " + sizeText(image) + " pixels, but the reference has " +
                     sizeText(reference));
}

}  // namespace catoptric::measure
