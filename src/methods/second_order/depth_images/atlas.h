// Places of many rectangles on few layers.
#pragma once

#include <span>
#include <vector>

namespace catoptric::methods::second_order {

struct AtlasPlace {
  int layer = 0;
  int x = 0;
  int y = 0;
};

struct AtlasSize {
  int width = 0;
  int height = 0;
};

struct Atlas {
  std::vector<AtlasPlace> places;  ///< in the order of the rectangles
  int layers = 0;
};

/// Packs rectangles, tallest first, onto shelves of layers of `layer`'s size. Every rectangle must
/// fit a layer. Deterministic; places do not overlap.
Atlas packAtlas(std::span<const AtlasSize> rectangles, const AtlasSize& layer);

}  // namespace catoptric::methods::second_order
