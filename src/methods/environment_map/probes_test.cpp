#include "methods/environment_map/probes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "frame/test_scenes.h"
#include "methods/shared/cube_map.h"

namespace catoptric::methods {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

frame::Geometry geometryOf(const scene::Scene& scene, double seconds = 0.0) {
  return frame::makeGeometry(scene, scene::poseAt(scene, seconds));
}

/// Balls of radius 0.1 m.
frame::Geometry ballsAt(const std::vector<Vec3>& places) {
  test::SceneBuilder builder;
  const int mirror = builder.reflective(1.0f);
  for (const Vec3& place : places)
    builder.add(scene::makeIcosphere(0.1f, 2, scene::UvMode::Unit), mirror,
                test::translation(place));
  return geometryOf(builder.scene());
}

TEST(Probes, GroupsAreCutWhereReflectorsLieFarthestApart) {
  // Two pairs 6 m apart in x; one pair is 2 m apart in z, the other 1 m in y
  const frame::Geometry geometry = ballsAt({{-3, 0, -1}, {3, 0, 0}, {-3, 0, 1}, {3, 1, 0}});
  const auto groups = [&](int most) { return groupReflectors({0, 1, 2, 3}, geometry, most); };
  EXPECT_THAT(groups(1), ElementsAre(ElementsAre(0, 1, 2, 3)));
  EXPECT_THAT(groups(2), ElementsAre(ElementsAre(0, 2), ElementsAre(1, 3)));
  EXPECT_THAT(groups(3), ElementsAre(ElementsAre(0), ElementsAre(1, 3), ElementsAre(2)));
  EXPECT_THAT(groups(8),
              ElementsAre(ElementsAre(0), ElementsAre(1), ElementsAre(2), ElementsAre(3)));
  EXPECT_THAT(groupReflectors({}, geometry, 4), IsEmpty());
}

TEST(Probes, ReflectorsOfOnePlaceShareAMap) {
  const frame::Geometry geometry = ballsAt({{1, 2, 3}, {1, 2, 3}, {5, 2, 3}});
  EXPECT_THAT(groupReflectors({0, 1, 2}, geometry, 8),
              ElementsAre(ElementsAre(0, 1), ElementsAre(2)));
}

TEST(Probes, AMapStandsInTheMiddleOfItsGroup) {
  const frame::Geometry geometry = ballsAt({{-3, 0, -1}, {3, 0, 0}, {-3, 0, 1}});
  const std::vector<int> one{1};
  const std::vector<int> two{0, 2};
  EXPECT_LT(glm::distance(probeCentre(one, geometry), Vec3(3, 0, 0)), 1e-6f);
  EXPECT_LT(glm::distance(probeCentre(two, geometry), Vec3(-3, 0, 0)), 1e-6f);
}

TEST(Probes, AFlatGroupsMapIsRaisedTowardsTheScene) {
  test::SceneBuilder builder;
  const int mirror = builder.reflective(1.0f);
  // A floor of 3 x 4 m with a diagonal of 5 m, and a low one under a ceiling
  builder.add(scene::makePlane(Vec2(3, 4), glm::ivec2(1), scene::UvMode::Unit), mirror);
  builder.add(scene::makePlane(Vec2(3, 4), glm::ivec2(1), scene::UvMode::Unit), mirror,
              test::translation({0, 2, 0}));
  const std::vector<int> floor{0};
  const std::vector<int> ceiling{1};
  const frame::Geometry high = geometryOf(builder.scene());
  EXPECT_LT(glm::distance(probeCentre(floor, high), Vec3(0, 0.625f, 0)), 1e-6f);
  EXPECT_LT(glm::distance(probeCentre(ceiling, high), Vec3(0, 1.375f, 0)), 1e-6f);
  // Not beyond the scene's middle
  builder.scene().nodes[1].matrix = test::translation({0, 0.5f, 0});
  EXPECT_LT(glm::distance(probeCentre(floor, geometryOf(builder.scene())), Vec3(0, 0.25f, 0)),
            1e-6f);
}

TEST(CubeMap, LeavesOutObjectsThatEncloseItsCentreButNoRoom) {
  test::SceneBuilder builder;
  const int stone = builder.diffuse(Vec3(0.5f));
  scene::BoxShape room;
  room.size = Vec3(10.0f);
  room.inward = true;
  builder.add(scene::makeBox(room, scene::UvMode::Unit), stone);
  room.size = Vec3(1.0f);  // as an alcove: open to the centre, whatever its size
  builder.add(scene::makeBox(room, scene::UvMode::Unit), stone);
  builder.add(scene::makeTorus(1.0f, 0.2f, 32, 16, scene::UvMode::Unit), stone);
  const int ball = builder.add(scene::makeSphere(0.5f, 16, 8, scene::UvMode::Unit), stone);
  builder.add(scene::makePlane(Vec2(2), glm::ivec2(1), scene::UvMode::Unit), stone);
  builder.add(scene::makeSphere(0.8f, 16, 8, scene::UvMode::Unit), builder.reflective(1.0f));
  builder.add(scene::makePlane(Vec2(3), glm::ivec2(1), scene::UvMode::Unit),
              builder.reflective(1.0f));
  builder.move(ball, Vec3(2.0f, 0.0f, 0.0f), 1.0f);
  const scene::Scene& scene = builder.scene();
  EXPECT_THAT(enclosing(Vec3(0.0f, 0.01f, 0.0f), scene, geometryOf(scene)), ElementsAre(4, 6));
  // Within the tube of the torus
  EXPECT_THAT(enclosing(Vec3(1.0f, 0.01f, 0.0f), scene, geometryOf(scene)), ElementsAre(3));
  EXPECT_THAT(enclosing(Vec3(0.0f, 0.01f, 0.0f), scene, geometryOf(scene, 1.0)), ElementsAre(6));
}

/// As of a file with one object: seen from within, it would hide what it reflects.
TEST(CubeMap, LeavesOutALargeSolidThatReflects) {
  test::SceneBuilder builder;
  builder.add(scene::makeSphere(1.0f, 16, 8, scene::UvMode::Unit), builder.reflective(1.0f));
  scene::BoxShape room;
  room.size = Vec3(2.5f);
  room.inward = true;
  builder.add(scene::makeBox(room, scene::UvMode::Unit), builder.reflective(1.0f));
  builder.add(scene::makeSphere(1.2f, 16, 8, scene::UvMode::Unit), builder.diffuse(Vec3(0.5f)));
  const scene::Scene& scene = builder.scene();
  EXPECT_THAT(enclosing(Vec3(0.0f, 0.01f, 0.0f), scene, geometryOf(scene)), ElementsAre(1));
}

TEST(CubeMap, PlanCountsItsFaces) {
  const std::vector<PlanItem> one = cubeMapItems(4, false);
  EXPECT_EQ(one[0].kind, "precomputation");
  EXPECT_EQ(one[1].bytes, cubeMapBytes(4, 8));
  EXPECT_THAT(one[1].reason, testing::StartsWith("6 faces of 4 x 4"));
  const std::vector<PlanItem> three = cubeMapItems(4, true, 3);
  EXPECT_EQ(three[0].kind, "pass");
  EXPECT_EQ(three[1].bytes, 3 * cubeMapBytes(4, 8));
  EXPECT_THAT(three[1].reason, testing::StartsWith("up to 3 of 6 faces of 4 x 4"));
}

}  // namespace
}  // namespace catoptric::methods
