// Images are as fine as their objects' triangles and pixels ask for, within the memory.
#include "methods/glossy_lod/sizes.h"

#include <gtest/gtest.h>

#include <cmath>

#include "frame/test_scenes.h"
#include "scene/camera.h"
#include "scene/shapes/shapes.h"

namespace catoptric::methods::glossy_lod {
namespace {

class StillCamera : public scene::CameraPath {
 public:
  int count() const override { return 3; }
  scene::PathFrame frame(int number) const override {
    return {number, 0.0, scene::lookAt({0, 1, 0}, {0, 1, -1}, {0, 1, 0}, 0.8f)};
  }
};

/// A mirror below squares of 0.2 m, 4 m and 16 m away, a square without a texture, and a sphere.
scene::Scene mirrorAndSquares() {
  test::SceneBuilder builder;
  const int white = builder.diffuse(Vec3(0.7f));
  const int textured = builder.diffuse(Vec3(0.7f));
  builder.scene().materials[static_cast<std::size_t>(textured)].baseColorTexture.texture = 0;
  const auto square = [] { return scene::makePlane(Vec2(0.2f), {1, 1}, scene::UvMode::Unit); };
  builder.add(scene::makePlane(Vec2(40.0f), {1, 1}, scene::UvMode::Unit), builder.reflective(0.9f));
  builder.add(square(), textured, test::translation({0, 1, -4}));
  builder.add(square(), textured, test::translation({0, 1, -16}));
  builder.add(square(), white, test::translation({0, 1, -4}));
  builder.add(scene::makeIcosphere(1.0f, 5, scene::UvMode::Unit), white,
              test::translation({0, 1, -4}));
  return builder.scene();
}

TEST(GlossyLodSizes, FollowFromPixelsAndTriangles) {
  const StillCamera path;
  const scene::Scene scene = mirrorAndSquares();
  RunSettings settings;
  settings.path = &path;
  settings.height = 8192;
  Options options;
  options.memoryBytes = std::uint64_t{4} << 30;
  const Sizes sizes = findSizes(scene, settings, options);
  const auto texels = [&](std::size_t object) { return sizes.ofObject[object].texels; };
  // 2 texels for a pixel of 0.8 rad over 8192 rows at 4 m
  const double pixel = 2.0 * std::tan(0.4) / 8192.0 * 4.0;
  EXPECT_NEAR(texels(1), 2.0 * 0.2 * 0.2 / (pixel * pixel), 0.01 * texels(1));
  EXPECT_NEAR(texels(1) / texels(2), 16.0, 0.1);
  EXPECT_LT(texels(3), 0.5 * texels(1));
  EXPECT_EQ(sizes.reduced, 0u);
  settings.height = 512;
  EXPECT_EQ(findSizes(scene, settings, {}).ofObject[4].quads, 2.0 * 20.0 * 1024.0);
  settings.height = 64;  // fewer pixels than triangles
  EXPECT_LT(findSizes(scene, settings, {}).ofObject[4].quads, 20.0 * 1024.0);
}

TEST(GlossyLodSizes, StayWithinTheMemory) {
  const StillCamera path;
  RunSettings settings;
  settings.path = &path;
  settings.height = 512;
  const scene::Scene scene = mirrorAndSquares();
  const Sizes all = findSizes(scene, settings, {});
  const Sizes less = findSizes(scene, settings, {.memoryBytes = all.bytes / 2});
  EXPECT_LE(less.bytes, all.bytes / 2);
  EXPECT_GT(less.quads, 0.25 * all.quads);
  EXPECT_EQ(less.reduced, 5u);
  EXPECT_EQ(all.reduced, 0u);
  const Sizes least = findSizes(scene, settings, {.memoryBytes = 1u << 20});
  EXPECT_LE(least.bytes, 1u << 20);
  EXPECT_LT(least.quads, all.quads);
}

TEST(GlossyLodSizes, AreTheOptionsWhereItIsGiven) {
  const Sizes sizes = findSizes(mirrorAndSquares(), {}, {.size = 64, .objects = Objects::Diffuse});
  EXPECT_EQ(sizes.ofObject[0].quads, 0.0);
  for (std::size_t object = 1; object < 5; ++object) {
    EXPECT_EQ(sizes.ofObject[object].quads, 4096.0);
    EXPECT_EQ(sizes.ofObject[object].texels, 0.0);
    EXPECT_EQ(sizes.ofObject[object].most, 64);
  }
}

}  // namespace
}  // namespace catoptric::methods::glossy_lod
