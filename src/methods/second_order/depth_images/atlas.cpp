#include "methods/second_order/depth_images/atlas.h"

#include <algorithm>
#include <numeric>

namespace catoptric::methods::second_order {

Atlas packAtlas(std::span<const AtlasSize> rectangles, const AtlasSize& layer) {
  std::vector<std::size_t> order(rectangles.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return rectangles[a].height > rectangles[b].height;
  });
  struct Shelf {
    int layer, y, height, used;
  };
  std::vector<Shelf> shelves;
  std::vector<int> filled;  // height used of each layer
  Atlas atlas;
  atlas.places.resize(rectangles.size());
  for (const std::size_t i : order) {
    const AtlasSize& size = rectangles[i];
    // The first shelf with room; heights fall, so every open shelf is high enough
    auto shelf = std::find_if(shelves.begin(), shelves.end(),
                              [&](const Shelf& s) { return s.used + size.width <= layer.width; });
    if (shelf == shelves.end()) {
      auto room = std::find_if(filled.begin(), filled.end(),
                               [&](int used) { return used + size.height <= layer.height; });
      if (room == filled.end()) room = filled.insert(filled.end(), 0);
      shelves.push_back({static_cast<int>(room - filled.begin()), *room, size.height, 0});
      *room += size.height;
      shelf = shelves.end() - 1;
    }
    atlas.places[i] = {shelf->layer, shelf->used, shelf->y};
    shelf->used += size.width;
  }
  atlas.layers = static_cast<int>(filled.size());
  return atlas;
}

}  // namespace catoptric::methods::second_order
