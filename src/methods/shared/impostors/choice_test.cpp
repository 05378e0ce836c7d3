// Which objects get impostors, at both sides of every limit.
#include "methods/shared/impostors/choice.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "frame/test_scenes.h"
#include "methods/testing/cpu_harness.h"

namespace catoptric::methods::impostors {
namespace {

constexpr float kRadius = 0.2f;  ///< of the mirror

/// A mirror ball on a wide floor, with boxes of 0.2 m at a height above it each.
class World {
 public:
  World(const Vec3& mirror, const std::vector<float>& heights) {
    test::SceneBuilder builder;
    const int grey = builder.diffuse(Vec3(0.5f));
    builder.add(scene::makePlane({20.0f, 20.0f}, {1, 1}, scene::UvMode::Unit), grey,
                test::translation({0.0f, -1.0f, 0.0f}));
    builder.add(scene::makeIcosphere(kRadius, 3, scene::UvMode::Unit), builder.reflective(1.0f),
                test::translation(mirror));
    for (const float height : heights)
      builder.add(scene::makeBox({.size = Vec3(0.2f)}, scene::UvMode::Unit), grey,
                  test::translation(mirror + Vec3(0.0f, height, 0.0f)));
    scene_ = builder.scene();
    geometry_ = test::Moment(scene_).geometry;
  }

  Choice choose(const Options& options, int reflector = kMirror) const {
    const float metres = geometry_.bounds.diameter();
    std::vector<Shape> shapes;
    std::vector<bool> mirrors;
    for (int object = 0; object < static_cast<int>(geometry_.objects.size()); ++object) {
      shapes.push_back(shapeOf(geometry_, object, metres));
      mirrors.push_back(object == reflector);
    }
    return impostors::choose(options, Kind::DepthMap, scene_, geometry_, shapes, mirrors, mirrors);
  }
  bool chooses(int object, float least) const {
    Options options;
    options.least = least;
    return choose(options).chosen[static_cast<std::size_t>(object)];
  }
  Vec3 centre() const { return geometry_.bounds.centre(); }

  static constexpr int kFloor = 0;
  static constexpr int kMirror = 1;
  static constexpr int kBox = 2;

 private:
  scene::Scene scene_;
  frame::Geometry geometry_;
};

TEST(Choice, TakesObjectsThatALookUpByDirectionWouldMisplace) {
  // The solid angle of the box, times the angle between where it is and where the map has it: the
  // mirror is away from the map's centre.
  for (const Vec3& mirror : {Vec3(0.0f), Vec3(6.0f, 0.0f, 0.0f), Vec3(0.0f, 0.0f, -9.0f)}) {
    const World world(mirror, {2.0f});
    const float away = 2.0f - 0.1f;
    const float solid = 0.5f * 6.0f * 0.2f * 0.2f / (away * away);
    const float aside = glm::length(mirror - world.centre()) + kRadius;
    const float error = solid * std::atan(aside / away);
    EXPECT_TRUE(world.chooses(World::kBox, 0.98f * error)) << mirror.x << " " << mirror.z;
    EXPECT_FALSE(world.chooses(World::kBox, 1.02f * error)) << mirror.x << " " << mirror.z;
  }
}

TEST(Choice, TakesTheMostMisplacedWhereThereAreTooMany) {
  const World world(Vec3(3.0f, 0.0f, 0.0f), {4.0f, 1.0f, 2.0f});
  Options options;
  options.least = 1e-5f;
  EXPECT_EQ(world.choose(options).left, 0u);
  options.most = 2;
  const Choice choice = world.choose(options);
  EXPECT_EQ(choice.left, 2u);
  EXPECT_EQ(choice.chosen, (std::vector<bool>{true, false, false, true, false}));
}

TEST(Choice, AFloorHasSeveralMapsOfWhatStandsOnIt) {
  // By the box's height above the floor; the floor is 20 m wide
  const auto views = [](float height, int maps, int reflector) {
    const World world(Vec3(0.0f), {height - 1.0f});
    Options options;
    options.objects = {"object2"};
    options.maps = maps;
    const ImpostorList list =
        world.choose(options, reflector).listOf[static_cast<std::size_t>(reflector)];
    EXPECT_EQ(list.views.size(), list.members.size());
    EXPECT_EQ(list.views.front(),
              list.members.size() == 1 ? 0 : static_cast<int>(list.members.size()));
    return list.members.size();
  };
  EXPECT_EQ(views(0.1f, 0, World::kFloor), 7u);
  EXPECT_EQ(views(0.1f, 1, World::kFloor), 1u);
  EXPECT_EQ(views(0.1f, 3, World::kFloor), 3u);
  EXPECT_EQ(views(15.0f, 0, World::kFloor), 1u);
  EXPECT_EQ(views(0.1f, 0, World::kMirror), 1u);
}

TEST(Choice, BillboardsOfAReflectorAreTogetherBelowTheLimit) {
  // Boxes at this distance from the mirror's centre have this predicted error
  const auto error = [](float distance) {
    const float across = kRadius * 0.1f * std::sqrt(3.0f);
    const float distance2 = distance * distance;
    return 0.5f * 6.0f * 0.2f * 0.2f / distance2 * std::atan(across / distance2);
  };
  constexpr float kLimit = 0.25f;
  ASSERT_LT(3.0f * error(0.5f), kLimit);
  ASSERT_GT(4.0f * error(0.5f), kLimit);
  ASSERT_GT(error(0.35f), kLimit);
  const auto maps = [](const std::vector<float>& distances) {
    const World world(Vec3(0.0f), distances);
    Options options;
    options.depthMaps = DepthMaps::Needed;
    options.objects.clear();
    for (std::size_t i = 0; i < distances.size(); ++i)
      options.objects.push_back("object" + std::to_string(World::kBox + i));
    const Choice choice = world.choose(options);
    std::vector<int> objects;
    for (const int member : choice.listOf[World::kMirror].members) {
      const Impostor& impostor = choice.impostors[static_cast<std::size_t>(member)];
      if (impostor.depth) objects.push_back(impostor.object - World::kBox);
    }
    return objects;
  };
  EXPECT_EQ(maps({0.5f, 0.5f, 0.5f}), (std::vector<int>{}));
  EXPECT_EQ(maps({0.5f, 0.5f, 0.5f, 0.5f}), (std::vector<int>{3}));
  EXPECT_EQ(maps({0.35f, 0.5f, 0.5f, 0.5f}), (std::vector<int>{0}));
  EXPECT_EQ(maps({0.5f, 0.4f, 0.5f, 2.0f}), (std::vector<int>{1}));
}

TEST(Choice, TakesWhatIsNamedAlone) {
  const World world(Vec3(3.0f, 0.0f, 0.0f), {4.0f, 1.0f});
  Options options;
  options.objects = {"object2"};
  EXPECT_EQ(world.choose(options).chosen, (std::vector<bool>{false, false, true, false}));
}

}  // namespace
}  // namespace catoptric::methods::impostors
