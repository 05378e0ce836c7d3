// Which single triangles are dropped, in pixels of a frame of 8 x 8.
#include "raster/regions/triangle_culling.h"

#include <gtest/gtest.h>

namespace catoptric::raster {
namespace {

constexpr int kPixels = 8;
constexpr float kSnap = 1.0f / 256.0f;  // that a driver moves vertices by

Vec3 fromPixel(const Vec2& pixel) {
  return {pixel.x / (0.5f * kPixels) - 1.0f, pixel.y / (0.5f * kPixels) - 1.0f, 0.5f};
}

/// Whether the triangle of three points of the frame is kept.
bool keeps(const Vec2& a, const Vec2& b, const Vec2& c, bool cullBacks = false,
           const Vec4& clip = Vec4(0, 0, 0, 1)) {
  const TriangleCulling culling(Mat4(1.0f), {Vec3(-2.0f), Vec3(2.0f)}, kPixels, kPixels, kSnap,
                                cullBacks, clip);
  const std::vector<Vec3> positions = {fromPixel(a), fromPixel(b), fromPixel(c)};
  const std::vector<std::uint32_t> indices = {0, 1, 2};
  std::vector<std::uint32_t> kept;
  culling.append(indices, positions, kept);
  return kept == indices;
}

/// Its box reaches from `low` to `high` on both axes.
bool keepsBox(const Vec2& low, const Vec2& high) {
  return keeps(low, {high.x, low.y}, {low.x, high.y});
}

TEST(TriangleCulling, DropsWhatLiesBetweenPixelsCentres) {
  EXPECT_TRUE(keepsBox({3.4f, 3.4f}, {3.6f, 3.6f}));
  EXPECT_FALSE(keepsBox({3.6f, 3.6f}, {4.4f, 4.4f}));
  EXPECT_FALSE(keepsBox({3.4f, 3.6f}, {4.6f, 4.4f}));
  EXPECT_FALSE(keepsBox({3.6f, 3.4f}, {4.4f, 4.6f}));
}

TEST(TriangleCulling, KeepsWhatADriverMayMoveOverACentre) {
  for (const float end : {4.5f - kSnap, 4.5f - 3.0f * kSnap}) {
    const bool near = end > 4.5f - 2.0f * kSnap;
    EXPECT_EQ(keepsBox({4.1f, 4.1f}, {end, 4.6f}), near);
    EXPECT_EQ(keepsBox({4.1f, 4.1f}, {4.6f, end}), near);
    EXPECT_EQ(keepsBox({9.0f - end, 4.1f}, {4.9f, 4.9f}), near);
    EXPECT_EQ(keepsBox({4.1f, 9.0f - end}, {4.9f, 4.9f}), near);
  }
}

TEST(TriangleCulling, DropsWhatLiesOutside) {
  EXPECT_TRUE(keepsBox({-3.0f, 2.0f}, {1.0f, 6.0f}));
  EXPECT_FALSE(keepsBox({-3.0f, 2.0f}, {-0.1f, 6.0f}));
  EXPECT_FALSE(keepsBox({8.1f, 2.0f}, {11.0f, 6.0f}));
  EXPECT_FALSE(keepsBox({2.0f, -3.0f}, {6.0f, -0.1f}));
  EXPECT_FALSE(keepsBox({2.0f, 8.1f}, {6.0f, 11.0f}));
}

TEST(TriangleCulling, DropsBacksAndWhatIsClipped) {
  const Vec2 a(1.0f, 1.0f);
  const Vec2 b(7.0f, 1.0f);
  const Vec2 c(1.0f, 7.0f);
  EXPECT_TRUE(keeps(a, b, c, true));
  EXPECT_FALSE(keeps(a, c, b, true));
  EXPECT_TRUE(keeps(a, c, b, false));
  // A back as narrow as the driver's steps may turn to the front.
  EXPECT_TRUE(keeps(a, {6.0f, 6.0f + 0.5f * kSnap}, {6.0f, 6.0f}, true));
  // Nothing is drawn where x + 0.5 is negative: left of pixel 2.
  EXPECT_TRUE(keeps(a, b, c, false, {1, 0, 0, 0.5f}));
  EXPECT_FALSE(keeps(a, {1.9f, 1.0f}, c, false, {1, 0, 0, 0.5f}));
}

}  // namespace
}  // namespace catoptric::raster
