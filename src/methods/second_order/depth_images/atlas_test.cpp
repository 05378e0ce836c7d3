#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <vector>

#include "methods/second_order/depth_images/atlas.h"

namespace catoptric::methods::second_order {
namespace {

TEST(Atlas, PlacesDoNotOverlapAndStayInside) {
  std::vector<AtlasSize> sizes;
  for (int i = 0; i < 200; ++i) sizes.push_back({1 + i * 7919 % 120, 1 + i * 104729 % 90});
  const AtlasSize layer{256, 200};
  const Atlas atlas = packAtlas(sizes, layer);
  ASSERT_EQ(atlas.places.size(), sizes.size());
  std::vector<int> covered(static_cast<std::size_t>(atlas.layers) * 256 * 200, 0);
  for (std::size_t i = 0; i < sizes.size(); ++i) {
    const AtlasPlace& p = atlas.places[i];
    ASSERT_LE(p.x + sizes[i].width, layer.width);
    ASSERT_LE(p.y + sizes[i].height, layer.height);
    for (int y = p.y; y < p.y + sizes[i].height; ++y) {
      for (int x = p.x; x < p.x + sizes[i].width; ++x) {
        ++covered[(static_cast<std::size_t>(p.layer) * 200 + static_cast<std::size_t>(y)) * 256 +
                  static_cast<std::size_t>(x)];
      }
    }
  }
  EXPECT_EQ(std::count_if(covered.begin(), covered.end(), [](int n) { return n > 1; }), 0);
  std::int64_t area = 0;
  for (const AtlasSize& size : sizes) area += size.width * size.height;
  EXPECT_EQ(std::count(covered.begin(), covered.end(), 1), area);
}

}  // namespace
}  // namespace catoptric::methods::second_order
