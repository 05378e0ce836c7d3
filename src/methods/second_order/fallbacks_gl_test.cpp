// What rays show that find nothing in their depth image, and how it is counted.
#include <gtest/gtest.h>

#include "methods/second_order/test_comparison.h"

namespace catoptric::methods::second_order {
namespace {

/// No cluster is large enough to be searched.
constexpr BesideOptions kNoClusters{[](Options& options) { options.cluster.minSamples = 1000000; }};

TEST(SecondOrder, WhatFallsBackIsMarkedAndCounted) {
  // Clusters that are all too small to search
  const Comparison frame(
      roomWith(scene::makeSphere(1.0f, 96, 48, scene::UvMode::Metres), Mat4(1.0f)),
      cameraAt({0.4f, 0.8f, 3.6f}, {0.0f, 0.0f, 0.0f}), imagesAlone(), kNoClusters);
  EXPECT_EQ(frame.output.counters.at("clusters"), 0u);
  EXPECT_EQ(frame.output.counters.at("planar_clusters"), 0u);
  EXPECT_EQ(frame.output.counters.at("unclustered"), frame.samples);
  EXPECT_EQ(marked(frame, raster::kMaskEnvironment), frame.samples);
}

TEST(SecondOrder, DisocclusionsAreToldFromTrueMisses) {
  const std::string options = imagesAlone();
  const BesideOptions counted{.countDisocclusions = true};
  const scene::Camera camera = cameraAt({0.4f, 0.8f, 3.6f}, {0.0f, 0.0f, 0.0f});
  // A planar mirror has none
  const Comparison plane(
      roomWith(scene::makePlane({4.0f, 4.0f}, {1, 1}, scene::UvMode::Metres), Mat4(1.0f)),
      cameraAt({0.7f, 1.5f, 3.2f}, {0.0f, 0.0f, 0.0f}), options, counted);
  EXPECT_EQ(plane.output.counters.at("disoccluded"), 0u);
  EXPECT_EQ(plane.output.counters.at("wrong_hit"), 0u);
  // In a closed room every ray hits: what found nothing is disoccluded, for mirrors and lobes
  for (const float roughness : {0.0f, 0.3f}) {
    const Comparison closed(
        roomWith(scene::makeSphere(1.0f, 96, 48, scene::UvMode::Metres), Mat4(1.0f), roughness),
        camera, options, counted);
    const std::uint64_t missed = closed.output.counters.at("environment");
    EXPECT_GE(closed.output.counters.at("disoccluded"), missed);
    EXPECT_LE(closed.output.counters.at("disoccluded"), missed + closed.output.counters.at("sky"));
    EXPECT_EQ(marked(closed, raster::kMaskDisoccluded), closed.output.counters.at("disoccluded"));
    EXPECT_LT(static_cast<double>(closed.output.counters.at("wrong_hit")),
              0.05 * static_cast<double>(closed.samples));
  }
  // Alone under the sky nothing is, but where smooth normals send rays through the next facet
  test::SceneBuilder builder;
  builder.add(scene::makeSphere(1.0f, 96, 48, scene::UvMode::Metres), builder.reflective(1.0f));
  builder.constantEnvironment(Vec3(1.0f));
  const Comparison open(builder.scene(), camera, options, counted);
  EXPECT_GT(open.output.counters.at("sky"), 10000u);
  EXPECT_LT(open.output.counters.at("disoccluded") + open.output.counters.at("wrong_hit"),
            open.samples / 500);
  // Not asked for, not counted
  const Comparison plain(builder.scene(), camera);
  EXPECT_EQ(plain.output.counters.count("disoccluded"), 0u);
}

TEST(SecondOrder, WhatFindsNothingSeesTheSkyOrTheCubeMap) {
  // Alone under a sky of one radiance, which both show; where smooth normals send rays through the
  // next facet Embree's rays meet the mirror
  for (const float roughness : {0.0f, 0.3f}) {
    test::SceneBuilder builder;
    builder.add(scene::makeSphere(1.0f, 96, 48, scene::UvMode::Metres),
                builder.reflective(1.0f, roughness));
    builder.constantEnvironment(Vec3(0.25f, 0.5f, 0.75f));
    const scene::Camera camera = cameraAt({0.4f, 0.8f, 3.6f}, {0.0f, 0.0f, 0.0f});
    const Comparison sky(builder.scene(), camera, imagesAlone());
    EXPECT_GT(sky.output.counters.at("sky"), 10000u);
    EXPECT_EQ(marked(sky, raster::kMaskSky), sky.output.counters.at("sky"));
    EXPECT_LT(sky.different, 0.003);

    // A plane: not seen from the place of its cube map, on itself
    test::SceneBuilder flat;
    flat.add(scene::makePlane({2.0f, 2.0f}, {1, 1}, scene::UvMode::Metres),
             flat.reflective(1.0f, roughness));
    flat.constantEnvironment(Vec3(0.25f, 0.5f, 0.75f));
    const Comparison none(flat.scene(), camera, imagesAlone(), kNoClusters);
    EXPECT_EQ(none.output.counters.at("unclustered"), none.samples);
    EXPECT_EQ(marked(none, raster::kMaskEnvironment), none.samples);
    EXPECT_LT(none.different, 0.003);
  }
}

TEST(SecondOrder, NoSkyIsSeenThroughTheGapsOfAClosedRoom) {
  // A handle at a wall: many of its rays find nothing in their clusters' depth images
  for (const float roughness : {0.0f, 0.2f}) {
    test::SceneBuilder builder;
    builder.add(scene::makeTorus(0.15f, 0.02f, 48, 16, scene::UvMode::Metres),
                builder.reflective(1.0f, roughness), test::translation({0.0f, 0.0f, -0.95f}));
    for (int axis = 0; axis < 3; ++axis) {
      Vec3 size(2.2f);
      size[axis] = 0.1f;
      for (const float side : {-1.05f, 1.05f}) {
        Vec3 centre(0.0f);
        centre[axis] = side;
        builder.add(scene::makeBox({.size = size}, scene::UvMode::Metres),
                    builder.diffuse(Vec3(0.3f)), test::translation(centre));
      }
    }
    builder.constantEnvironment(Vec3(100.0f));  // the walls show 30 of it, the handle at most 50
    const Comparison frame(builder.scene(), cameraAt({0.2f, 0.3f, -0.4f}, {0.0f, 0.0f, -0.95f}),
                           imagesAlone());
    EXPECT_GT(frame.samples, 1000u);
    EXPECT_GT(frame.output.counters.at("sky"), 4u) << "nothing is tested";
    EXPECT_LT(frame.brightest, 51.0f);
  }
}

}  // namespace
}  // namespace catoptric::methods::second_order
