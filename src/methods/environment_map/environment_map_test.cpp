#include "methods/environment_map/environment_map.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "frame/test_scenes.h"
#include "methods/environment_map/cube_map.h"
#include "methods/shared/cube_map.h"

namespace catoptric::methods {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Property;
using testing::Throws;

std::unique_ptr<Method> makeMethod(const std::string& options) {
  return environmentMapEntry().make(config::parseText(options, "options"));
}

// OpenGL 4.5 core, table 8.19: face and (s, t) of a direction.
struct FacePoint {
  int face;
  float s, t;
};
FacePoint facePoint(const Vec3& r) {
  const Vec3 a = glm::abs(r);
  float sc = 0;
  float tc = 0;
  float ma = 0;
  int face = 0;
  if (a.x >= a.y && a.x >= a.z) {
    face = r.x > 0 ? 0 : 1;
    sc = r.x > 0 ? -r.z : r.z;
    tc = -r.y;
    ma = a.x;
  } else if (a.y >= a.z) {
    face = r.y > 0 ? 2 : 3;
    sc = r.x;
    tc = r.y > 0 ? r.z : -r.z;
    ma = a.y;
  } else {
    face = r.z > 0 ? 4 : 5;
    sc = r.z > 0 ? r.x : -r.x;
    tc = -r.y;
    ma = a.z;
  }
  return {face, 0.5f * (sc / ma + 1.0f), 0.5f * (tc / ma + 1.0f)};
}

TEST(CubeMap, DirectionsInvertTheTableOfOpenGl) {
  for (int face = 0; face < 6; ++face) {
    for (const float s : {0.1f, 0.5f, 0.9f}) {
      for (const float t : {0.2f, 0.5f, 0.7f}) {
        const FacePoint point = facePoint(3.0f * cubeDirection(face, s, t));
        EXPECT_EQ(point.face, face);
        EXPECT_NEAR(point.s, s, 1e-6f);
        EXPECT_NEAR(point.t, t, 1e-6f);
      }
    }
  }
}

TEST(CubeMap, BytesOfTheWholeChain) {
  EXPECT_EQ(cubeMapBytes(1, 8), 48u);
  EXPECT_EQ(cubeMapBytes(4, 8), 48u * (16 + 4 + 1));
}

scene::Scene sceneWith(float specularLevel, float roughness, bool moving) {
  test::SceneBuilder builder;
  const int wall = builder.add(scene::makePlane(Vec2(2), glm::ivec2(1), scene::UvMode::Unit),
                               builder.diffuse(Vec3(0.5f)));
  if (specularLevel > 0) {
    builder.add(scene::makePlane(Vec2(1), glm::ivec2(1), scene::UvMode::Unit),
                builder.reflective(specularLevel, roughness));
  }
  if (moving) builder.move(wall, Vec3(1, 0, 0), 1.0f);
  return builder.scene();
}

std::vector<std::string> planned(const std::string& options, const scene::Scene& scene) {
  std::vector<std::string> lines;
  for (const PlanItem& item : makeMethod(options)->plan(scene, RunSettings{}).items) {
    lines.push_back(item.kind + " " + item.name);
    EXPECT_NE(item.reason, "");
  }
  return lines;
}

TEST(EnvironmentMapPlan, HasOnlyWhatTheSceneRequires) {
  using Lines = std::vector<std::string>;
  const std::string any = "{}";
  // Nothing reflects: the G-buffer and its composite are the whole frame.
  EXPECT_EQ(planned(any, sceneWith(0, 0, false)), Lines{});
  EXPECT_TRUE(makeMethod(any)->plan(sceneWith(0, 0, false), RunSettings{}).gbuffer);
  const Lines once = {"precomputation cube_map", "resource cube map", "pass resolve"};
  const Lines again = {"pass cube_map", "resource cube map", "pass resolve"};
  EXPECT_EQ(planned(any, sceneWith(1, 0, false)), once);
  EXPECT_EQ(planned(any, sceneWith(1, 0, true)), again);
  // The environment does not move with the scene.
  EXPECT_EQ(planned(R"({"source": "environment"})", sceneWith(1, 0, true)), once);
}

TEST(EnvironmentMapPlan, SaysWhichReflectorsAndHowManyBytes) {
  const auto plan = makeMethod(R"({"face_size": 4})")->plan(sceneWith(1, 0.5f, false), {});
  EXPECT_THAT(plan.items.back().reason, AllOf(HasSubstr("glossy"), Not(HasSubstr("mirrors"))));
  EXPECT_EQ(plan.items[1].bytes, 48u * 21);
  // A constant environment needs one texel per face.
  const auto constant =
      makeMethod(R"({"source": "environment"})")->plan(sceneWith(1, 0, false), {});
  EXPECT_THAT(constant.items.back().reason, AllOf(HasSubstr("mirrors"), Not(HasSubstr("glossy"))));
  EXPECT_EQ(constant.items[1].bytes, 96u);
}

TEST(EnvironmentMapPlan, HasAMapForEachGroupOfReflectors) {
  scene::Scene scene = sceneWith(1, 0, false);
  const std::string options = R"({"face_size": 4, "probes": 3, "blend": "distance"})";
  // More maps than reflectors are of no use
  const MethodPlan single = makeMethod(options)->plan(scene, {});
  EXPECT_EQ(single.items[1].bytes, 48u * 21);
  EXPECT_EQ(single.items.back().name, "resolve");
  EXPECT_THAT(single.items.back().reason, HasSubstr("one look-up"));
  for (int i = 0; i < 4; ++i) scene.objects.push_back(scene.objects.back());
  EXPECT_EQ(planned(options, scene),
            (std::vector<std::string>{"precomputation cube_map", "resource cube map", "pass probes",
                                      "pass resolve"}));
  const MethodPlan three = makeMethod(options)->plan(scene, {});
  EXPECT_EQ(three.items[1].bytes, 3u * 48u * 21);
  EXPECT_THAT(three.items[1].reason, HasSubstr("up to 3 of 6 faces"));
  EXPECT_THAT(three.items.back().reason, HasSubstr("two look-ups"));
  // The environment is infinitely far from all of them
  EXPECT_EQ(planned(R"({"source": "environment", "probes": 3})", scene).size(), 3u);
}

TEST(EnvironmentMapOptions, WrongValuesNamePlaceAndWhatIsAllowed) {
  const auto refuses = [](const std::string& options, const std::string& place,
                          const std::string& allowed) {
    EXPECT_THAT([&] { makeMethod(options); },
                Throws<UsageError>(
                    Property(&UsageError::what, AllOf(HasSubstr(place), HasSubstr(allowed)))))
        << options;
  };
  refuses(R"({"center": "middle"})", "/center", "[x, y, z]");
  refuses(R"({"center": [1, 2]})", "/center", "3");
  refuses(R"({"source": "sky"})", "/source", "environment");
  refuses(R"({"face_size": 0})", "/face_size", "1");
  refuses(R"({"probes": 9})", "/probes", "8");
  refuses(R"({"probes": 2, "center": [1, 2, 3]})", "/center", "\"scene\"");
  refuses(R"({"face_sise": 5})", "face_sise", "face_size");
  EXPECT_NO_THROW(makeMethod(R"({"center": [1, 2, 3], "source": "scene", "face_size": 64})"));
}

}  // namespace
}  // namespace catoptric::methods
