// Which reflectors get images, at both sides of every limit.
#include "methods/shared/impostors/budget.h"

#include <gtest/gtest.h>

namespace catoptric::methods::impostors {
namespace {

constexpr Cost kImage{100, 100.0};
constexpr Cost kEnough{1'000'000, 1e9};

TEST(Budget, ThoseComeFirstWhoseImagesServeMostRays) {
  const std::vector<Cost> costs(4, kImage);
  // Worth 10,000, 15,000 and 20,000 rays an image
  const std::vector<Wish> wishes{
      {0, 10'000, 0.0, {0}}, {1, 30'000, 0.0, {1, 2}}, {2, 20'000, 0.0, {3}}};
  EXPECT_EQ(grant(wishes, costs, {400, 1e9}), (std::vector<bool>{true, true, true}));
  EXPECT_EQ(grant(wishes, costs, {399, 1e9}), (std::vector<bool>{false, true, true}));
  EXPECT_EQ(grant(wishes, costs, {1000, 399.0}), (std::vector<bool>{false, true, true}));
  // The second does not fit any more; the first does
  EXPECT_EQ(grant(wishes, costs, {299, 1e9}), (std::vector<bool>{true, false, true}));
  EXPECT_EQ(grant(wishes, costs, {99, 1e9}), (std::vector<bool>{false, false, false}));
}

TEST(Budget, SharedImagesArePaidOnce) {
  const std::vector<Cost> costs(1, kImage);
  const std::vector<Wish> wishes{{0, 1'000, 0.0, {0}}, {1, 1'000, 0.0, {0}}};
  EXPECT_EQ(grant(wishes, costs, kImage), (std::vector<bool>{true, true}));
}

TEST(Budget, ImagesOfFewRaysAreDear) {
  const std::vector<Cost> costs(1, Cost{1, 64'000.0});
  const auto granted = [&](std::uint64_t rays, double texels) -> bool {
    return grant(std::vector<Wish>{{0, rays, texels, {0}}}, costs, kEnough).front();
  };
  EXPECT_TRUE(granted(1'000, 0.0));
  EXPECT_FALSE(granted(999, 0.0));
  EXPECT_FALSE(granted(1'000, 1.0));  // intersections that take longer than tracing
  // Without images it would show the environment map alone
  EXPECT_FALSE(grant(std::vector<Wish>{{0, 999, 0.0, {}}}, costs, kEnough).front());
  EXPECT_TRUE(grant(std::vector<Wish>{{0, 1'000, 0.0, {}}}, costs, kEnough).front());
}

TEST(Budget, WhatExceedsTracingCounts) {
  EXPECT_DOUBLE_EQ(beyondTracing(1e6, 0), 1e6);
  EXPECT_DOUBLE_EQ(beyondTracing(100.0, 1'000), 0.0);
  EXPECT_DOUBLE_EQ(1e6 - beyondTracing(1e6, 100),
                   2.0 * (allowedTexels(0, 200) - allowedTexels(0, 100)));
}

TEST(Budget, AFramesPixelsAskForWhatTheirRaysMayMeet) {
  // A mirror floor at y = 0 under a camera that looks along (1, -1, 0): its rays leave along (1, 1,
  // 0)
  raster::GBufferCopy copy;
  copy.width = 40;
  copy.height = copy.rows = 3;
  const scene::Camera camera =
      scene::lookAt({-4.0f, 4.0f, 0.0f}, Vec3(0.0f), {0, 1, 0}, radians(4.0f));
  const Mat3 rayFromPixel = scene::rayFromPixel(camera, 40, 3);
  for (int y = 0; y < 3; ++y) {
    for (int x = 0; x < 40; ++x) {
      const Vec3 ray =
          rayFromPixel * Vec3(static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f, 1.0f);
      copy.depth.push_back(camera.nearMetres * -ray.y / camera.eye().y);
      copy.normal.insert(copy.normal.end(), {0.0f, 1.0f, 0.0f, 0.0f});
      copy.object.push_back(x < 20 ? 1 : 2);
    }
  }
  // Where the mirrored rays go; behind; aside; and two of one group, of which one is met
  const std::vector<Reach> reaches{
      {{3.0f, 3.0f, 0.0f}, 0.5f},       {{-3.0f, -3.0f, 0.0f}, 0.5f},
      {{3.0f, 0.0f, 3.0f}, 0.5f},       {{0.0f, -2.0f, 9.0f}, 0.5f},
      {{2.0f, 2.0f, 0.0f}, 0.5f},       {{2.0f, 2.0f, 0.0f}, 5.0f, true},
      {{2.0f, 2.0f, 0.0f}, 5.0f, true}, {{-3.0f, -3.0f, 0.0f}, 0.5f, true}};
  ImpostorList list{{0, 1, 2, 3, 4}, {0, 0, 0, 2, 0}, 2};
  const std::vector<ImpostorList> lists{list, list, list};
  const std::vector<Demand::Rays> raysOf{Demand::Rays::Mirrored, Demand::Rays::None,
                                         Demand::Rays::Any};
  const Demand demand(copy, camera, raysOf, lists, reaches);
  EXPECT_EQ(demand.samplesOf(0), 60u);
  EXPECT_EQ(demand.samplesOf(1), 0u);
  EXPECT_EQ(demand.samplesOf(2), 0u);
  const ImpostorList asked = demand.listOf(0);
  EXPECT_EQ(asked.members, (std::vector<int>{0, 3, 4}));
  EXPECT_EQ(asked.views, (std::vector<int>{0, 2, 0}));
  EXPECT_EQ(asked.diffuse, 1);
  EXPECT_EQ(demand.listOf(2).members, list.members);
  // Two maps of one object count once, what no ray meets not at all
  const ImpostorList mapped{{4, 5, 6, 7}, {0, 2, 0, 0}, 4};
  const std::vector<ImpostorList> mappedLists{mapped, mapped, mapped};
  EXPECT_EQ(Demand(copy, camera, raysOf, mappedLists, reaches).testsOf(0), 60u);
  EXPECT_EQ(demand.testsOf(0), 0u);
}

}  // namespace
}  // namespace catoptric::methods::impostors
