// Parts of an image in tiles of 16 texels.
#include "raster/regions/rectangle.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace catoptric::raster {
namespace {

bool covers(const std::vector<Rectangle>& cover, const Rectangle& part) {
  return std::ranges::any_of(cover,
                             [&](const Rectangle& r) { return intersection(r, part) == part; });
}

TEST(Region, IsClippedToTiles) {
  Region region(500, 500);
  region.add({0, 0, 500, 500});
  region.clip({100, 40, 200, 60});
  EXPECT_EQ(region.rectangles(), (std::vector<Rectangle>{{96, 32, 208, 64}}));
  EXPECT_TRUE(region.touches({207, 63, 300, 300}));
  EXPECT_FALSE(region.touches({208, 0, 500, 500}));
  Region rest(500, 500);
  rest.add({0, 0, 500, 500});
  rest.remove(region);
  EXPECT_FALSE(rest.touches({96, 32, 208, 64}));
  EXPECT_TRUE(rest.touches({95, 32, 96, 33}));
}

TEST(Region, OfManyPartsIsCoveredByFewRectangles) {
  // Every third tile both ways of 41 x 41
  Region region(650, 650);
  std::vector<Rectangle> parts;
  for (int y = 0; y < 650; y += 48)
    for (int x = 0; x < 650; x += 48)
      parts.push_back(intersection({x, y, x + 16, y + 16}, {0, 0, 650, 650}));
  for (const Rectangle& part : parts) region.add(part);
  const std::vector<Rectangle> cover = region.rectangles();
  EXPECT_LE(cover.size(), 48u);
  for (const Rectangle& part : parts) EXPECT_TRUE(covers(cover, part)) << part.x0 << " " << part.y0;
  for (const Rectangle& a : cover)
    for (const Rectangle& b : cover) EXPECT_TRUE(&a == &b || intersection(a, b).empty());
}

}  // namespace
}  // namespace catoptric::raster
