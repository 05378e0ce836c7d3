// What counts as another surface: by hand, below and above each threshold.
#include "methods/second_order/disocclusions.h"

#include <gtest/gtest.h>

#include <tuple>
#include <vector>

#include "frame/test_scenes.h"
#include "methods/second_order/test_samples.h"

namespace catoptric::methods::second_order {
namespace {

/// A floor that mirrors a ceiling at y = 3, seen from the middle, and a camera at the frame's eye
/// that looks up: 10 texels a metre at a distance of 1 m.
struct Bench {
  test::SceneBuilder builder;
  scene::Camera camera = cameraAt({0.0f, 1.5f, 3.0f}, {0.0f, 0.0f, 0.0f});
  raster::GBufferCopy gbuffer = rasterized(camera, 0.0f, hitFloor);
  std::vector<FoundByRays> found;
  std::vector<std::uint16_t> clusterOf;
  ClusterCamera made;
  std::size_t samples = 0;

  Bench() {
    const scene::Mesh plane = scene::makePlane({4.0f, 4.0f}, {1, 1}, scene::UvMode::Unit);
    builder.add(plane, builder.reflective(1.0f));
    builder.add(scene::makePlane({100.0f, 100.0f}, {1, 1}, scene::UvMode::Unit),
                builder.diffuse(Vec3(0.5f)), test::translation({0.0f, 3.0f, 0.0f}));
    made.rowX = Vec4(10.0f, 0.0f, 0.0f, 0.0f);
    made.rowY = Vec4(0.0f, 0.0f, 10.0f, 0.0f);
    made.rowW = Vec4(0.0f, 1.0f, 0.0f, 0.0f);
    made.aboveHorizon = 0.6f;  // depth 0.4 at the ceiling
    clusterOf.assign(gbuffer.object.size(), 2);
    for (const std::uint32_t object : gbuffer.object) samples += object != 0 ? 1 : 0;
  }

  /// All samples found their ray's end, `off` texels to the side, at so many times its depth.
  Disocclusions foundAt(const Vec2& off, float depth, std::span<std::uint16_t> masks = {}) {
    found.assign(gbuffer.object.size(), {});
    const Mat3 rays = scene::rayFromPixel(camera, kSize, kSize);
    for (std::size_t at = 0; at < found.size(); ++at) {
      if (gbuffer.object[at] == 0) continue;
      const Vec3 d = rays * Vec3(static_cast<float>(at % kSize) + 0.5f,
                                 static_cast<float>(at / kSize) + 0.5f, 1);
      // From the eye down by 1.5 m, then up by 3 m; the ceiling is 1.5 m above the eye
      const Vec3 end = d * (4.5f / -d.y);
      found[at].at = {10.0f * end.x / 1.5f + off.x, 10.0f * end.z / 1.5f + off.y, 0.4f * depth};
    }
    return count(masks);
  }
  Disocclusions count(std::span<std::uint16_t> masks = {}) {
    const scene::Scene& scene = builder.scene();
    const frame::Geometry geometry = frame::makeGeometry(scene, scene::poseAt(scene, 0.0));
    const trace::TraceScene trace(scene, geometry, trace::BvhPolicy::Static);
    return findDisocclusions(gbuffer, camera, found, clusterOf, {&made, 1}, 1, trace, masks);
  }
};

TEST(Disocclusions, HitsAreOfAnotherSurfaceBeyondTwoTexelsOrAQuarterOfTheDepth) {
  Bench bench;
  ASSERT_GT(bench.samples, 1000u);
  for (const auto& [off, depth, wrong] : {std::tuple(Vec2(0.0f), 1.0f, false),
                                          {Vec2(1.9f, 0.0f), 1.0f, false},
                                          {Vec2(2.1f, 0.0f), 1.0f, true},
                                          {Vec2(0.0f, -2.1f), 1.0f, true},
                                          {Vec2(0.0f), 1.3f, false},
                                          {Vec2(0.0f), 1.4f, true},
                                          {Vec2(0.0f), 0.76f, false},
                                          {Vec2(0.0f), 0.74f, true}}) {
    const Disocclusions counted = bench.foundAt(off, depth);
    EXPECT_EQ(counted.wrongHits, wrong ? bench.samples : 0u)
        << off.x << ' ' << off.y << ' ' << depth;
    EXPECT_EQ(counted.samples, 0u);
  }
}

TEST(Disocclusions, AreSamplesThatFoundNothingWhereASurfaceIs) {
  Bench bench;
  std::vector<std::uint16_t> masks(bench.gbuffer.object.size(), 0);
  bench.found.assign(masks.size(), {});
  for (std::size_t at = 0; at < masks.size(); ++at)
    if (bench.gbuffer.object[at] != 0) bench.found[at].nothing[0] = 1;
  const Disocclusions counted = bench.count(masks);
  EXPECT_EQ(counted.samples, bench.samples);
  EXPECT_EQ(counted.wrongHits, 0u);
  for (std::size_t at = 0; at < masks.size(); ++at)
    ASSERT_EQ(masks[at], bench.gbuffer.object[at] != 0 ? raster::kMaskDisoccluded : 0) << at;
  // Under the sky nothing is there, and none is
  bench.builder.scene().nodes[1].matrix[3].y = -3.0f;
  EXPECT_EQ(bench.count().samples, 0u);
}

}  // namespace
}  // namespace catoptric::methods::second_order
