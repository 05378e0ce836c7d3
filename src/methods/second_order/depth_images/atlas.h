// Packs many rectangles onto few layers.
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
  std::vector<AtlasPlace> places;  ///< one per rectangle, in the same order
  int layers = 0;
};

/// Packs rectangles, tallest first, onto shelves of layers of size `layer`. Every rectangle must
/// fit a layer. Deterministic; the places do not overlap.
Atlas packAtlas(std::span<const AtlasSize> rectangles, const AtlasSize& layer);

}  // namespace catoptric::methods::second_order
