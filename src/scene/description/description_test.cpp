// Scene descriptions: composition, messages, and the scenes of this repository.
#include "scene/description/description.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>

#include "core/error.h"
#include "scene/animate.h"
#include "scene/camera.h"
#include "scene/procedural/procedural.h"

namespace catoptric::scene {
namespace {

using ::testing::HasSubstr;

std::filesystem::path written(const std::string& text) {
  const std::filesystem::path file =
      std::filesystem::path(::testing::TempDir()) / "catoptric_description.json";
  std::ofstream(file) << text;
  return file;
}
Scene load(const std::string& text) {
  return loadScene(written(text));
}
std::string errorOf(const std::string& text) {
  try {
    load(text);
  } catch (const SceneError& error) {
    return error.what();
  }
  return "no error";
}

TEST(Description, AllErrorsAreSaidTogether) {
  // What tables tell, of objects of all depths, materials and the rest
  const std::string text = errorOf(R"({"objects": [
    {"shape": "plane", "size": [1, 1], "colour": 1},
    {"shape": "sphere", "radius": -1, "material": {"shine": 1}},
    {"shape": "bx", "children": [{"shape": "plane", "size": [1, 1], "sise": 2}]}, 5],
    "materials": {"m": {"s": 2}}, "lights": [{"type": "lamp"}], "enviroment": {}})");
  for (const char* place :
       {":2: /objects/0/colour: unknown", ":3: /objects/1/radius: -1 is out of range",
        ":4: /objects/2/shape: there is no shape", ":4: /objects/2/children/0/sise: unknown",
        ":4: /objects/3: 5 is not", ":5: /materials/m/s: 2 is out of range",
        ":5: /lights/0/type: ", ":5: /enviroment: unknown"})
    EXPECT_THAT(text, HasSubstr(place));
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 7);

  // What comes up when objects are made; a material that several use is wrong once
  const std::string made = errorOf(R"({"objects": [
    {"shape": "sphere", "radius": 1, "material": "gold"},
    {"children": [{"shape": "sphere", "radius": 1, "quaternion": [0, 0, 0, 0]},
                  {"shape": "sphere", "radius": 1, "material": "m", "repeat": {"count": 3}}]},
    {"shape": "sphere", "radius": 1, "material": "m"}],
    "materials": {"m": {"s": 1, "metallic": 1}}})");
  for (const char* place : {":2: /objects/0/material: ", ":3: /objects/1/children/0/quaternion: ",
                            ":6: /materials/m: mixes \"s\""})
    EXPECT_THAT(made, HasSubstr(place));
  EXPECT_EQ(std::count(made.begin(), made.end(), '\n'), 2);

  // What needs the objects
  const std::string rest = errorOf(R"({"objects": [{"name": "a", "shape": "sphere", "radius": 1}],
    "lights": [{"type": "sphere"}, {"type": "point", "object": "b"}],
    "cameras": [{"position": [0, 0, 0], "target": [0, 0, 0]}],
    "animation": [{"object": "b", "channel": "scale", "keys": [[0, 1, 1, 1]]}],
    "environment": {"type": "file", "file": "none.hdr"}})");
  EXPECT_EQ(std::count(rest.begin(), rest.end(), '\n'), 4) << rest;
}

TEST(Description, ManyErrorsAreCounted) {
  std::string objects;
  for (int i = 0; i < 50; ++i)
    objects += std::string(i > 0 ? "," : "") + R"({"shape": "sphere", "radius": 0})";
  const std::string text = errorOf(R"({"objects": [)" + objects + "]}");
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 20);
  EXPECT_THAT(text, HasSubstr("/objects/19/radius"));
  EXPECT_THAT(text, ::testing::EndsWith("\n... and 30 more"));
}

TEST(Description, LimitsEndTheMakingOfObjects) {
  LoadLimits limits;
  limits.maxBytes = 100'000;
  std::string objects;
  for (int i = 0; i < 50; ++i)
    objects += std::string(i > 0 ? "," : "") + R"({"shape": "sphere", "radius": )" +
               std::to_string(i + 1) + "}";
  try {
    loadScene(written(R"({"objects": [)" + objects + "]}"), limits);
    FAIL() << "no error";
  } catch (const SceneError& error) {
    EXPECT_THAT(error.what(), HasSubstr("bytes in memory"));
    EXPECT_THAT(error.what(), ::testing::Not(HasSubstr("\n")));
  }
}

TEST(Description, ComposesTransformsRepeatsAndAnchors) {
  const Scene scene = load(R"({"objects": [
    {"name": "group", "translate": [1, 0, 0], "rotate": [0, 90, 0], "children": [
      {"name": "box", "shape": "box", "fit": [2, null, null], "anchor": "bottom", "translate": [0, 0, -3],
       "repeat": {"count": 3, "step": [0, 5, 0]}}]}]})");
  ASSERT_EQ(scene.objects.size(), 3u);
  EXPECT_EQ(scene.meshes.size(), 1u);
  const Pose pose = poseAt(scene, 0.0);
  for (int i = 0; i < 3; ++i) {
    Box3 box;
    for (const Vec3& p :
         worldVertices(scene, scene.objects[static_cast<std::size_t>(i)], pose).positions) {
      box.extend(p);
    }
    // Heading 90 degrees turns -z to -x.
    EXPECT_LT(glm::length(box.min - Vec3(-3, 5.0f * static_cast<float>(i), -1)), 1e-5f);
    EXPECT_LT(glm::length(box.max - Vec3(-1, 5.0f * static_cast<float>(i) + 2, 1)), 1e-5f);
  }
}

TEST(Description, RepeatsStandInRowsAndRings) {
  const auto centres = [](const std::string& repeat) {
    const Scene scene = load(R"({"objects": [{"shape": "box", "translate": [2, 0, 0], "repeat": )" +
                             repeat + "}]}");
    std::vector<Vec3> found;
    for (const Object& object : scene.objects) {
      Box3 box;
      for (const Vec3& p : worldVertices(scene, object, poseAt(scene, 0.0)).positions)
        box.extend(p);
      found.push_back(box.centre());
    }
    return found;
  };
  const auto expectAt = [](const std::vector<Vec3>& found, const std::vector<Vec3>& wanted) {
    ASSERT_EQ(found.size(), wanted.size());
    for (std::size_t i = 0; i < found.size(); ++i)
      EXPECT_LT(glm::length(found[i] - wanted[i]), 1e-5f) << i;
  };
  // Each turns about its own position.
  expectAt(centres(R"({"count": 3, "step": [0, 1, 0], "rotate_step": [0, 45, 0]})"),
           {{2, 0, 0}, {2, 1, 0}, {2, 2, 0}});
  expectAt(centres(R"({"count": [2, 1, 2], "step": [1, 5, 3]})"),
           {{2, 0, 0}, {3, 0, 0}, {2, 0, 3}, {3, 0, 3}});
  expectAt(centres(R"({"around": {"count": 4, "radius": 3}})"),
           {{2, 0, 3}, {5, 0, 0}, {2, 0, -3}, {-1, 0, 0}});
}

TEST(Description, LightsCamerasAndSurroundingsAreReadWhole) {
  const Scene scene = load(R"({"objects": [{"name": "box", "shape": "box"}],
    "lights": [
      {"name": "spot", "type": "spot", "position": [1, 2, 3], "target": [1, 2, 1], "range": 7,
       "color": [1, 0.5, 0.25], "intensity": 4, "inner_cone": 10, "outer_cone": 20},
      {"type": "sphere", "radius": 0.5, "baked": true, "object": "box"},
      {"type": "directional", "direction": [0, -2, 0]}],
    "cameras": [{"name": "front", "position": [0, 1, 4], "target": [0, 1, 0], "fov": 40}],
    "environment": {"type": "gradient", "zenith": [1, 2, 3], "horizon": [4, 5, 6],
                    "ground": [7, 8, 9], "scale": 2},
    "bake": {"mode": "full", "rays": 64, "bounces": 3, "distance": 1.5},
    "ambient": [0.1, 0.2, 0.3], "highlights": true})");
  ASSERT_EQ(scene.lights.size(), 3u);
  const Light& spot = scene.lights[0];
  EXPECT_EQ(spot.name, "spot");
  EXPECT_EQ(spot.type, LightType::Spot);
  EXPECT_EQ(spot.intensity, Vec3(4, 2, 1));
  EXPECT_EQ(spot.range, 7.0f);
  EXPECT_FLOAT_EQ(spot.innerConeRad, radians(10.0f));
  EXPECT_FLOAT_EQ(spot.outerConeRad, radians(20.0f));
  EXPECT_EQ(spot.radius, 0.0f);
  EXPECT_FALSE(spot.baked);
  EXPECT_EQ(spot.node, kNone);
  EXPECT_EQ(spot.position, Vec3(1, 2, 3));
  EXPECT_EQ(spot.direction, Vec3(0, 0, -1));
  EXPECT_EQ(scene.lights[1].type, LightType::Point);
  EXPECT_EQ(scene.lights[1].radius, 0.5f);
  EXPECT_TRUE(scene.lights[1].baked);
  EXPECT_NE(scene.lights[1].node, kNone);
  EXPECT_EQ(scene.lights[2].type, LightType::Directional);
  EXPECT_EQ(scene.lights[2].direction, Vec3(0, -1, 0));

  ASSERT_EQ(scene.cameras.size(), 1u);
  EXPECT_FLOAT_EQ(scene.cameras[0].verticalFovRad, radians(40.0f));
  EXPECT_EQ(scene.nodes[static_cast<std::size_t>(scene.cameras[0].node)].matrix[3],
            Vec4(0, 1, 4, 1));

  EXPECT_EQ(scene.environment.type, EnvironmentType::Gradient);
  EXPECT_EQ(scene.environment.color, Vec3(1, 2, 3));
  EXPECT_EQ(scene.environment.horizon, Vec3(4, 5, 6));
  EXPECT_EQ(scene.environment.ground, Vec3(7, 8, 9));
  EXPECT_EQ(scene.environment.scale, 2.0f);
  EXPECT_EQ(scene.bake.mode, BakeMode::Full);
  EXPECT_EQ(scene.bake.rays, 64);
  EXPECT_EQ(scene.bake.bounces, 3);
  EXPECT_EQ(scene.bake.ambientOcclusionDistance, 1.5f);
  EXPECT_EQ(scene.ambient, Vec3(0.1f, 0.2f, 0.3f));
  EXPECT_TRUE(scene.highlights);
}

TEST(Description, MemoryHasASettableBudget) {
  // 1000 x 1000 quads: some 32 MB of vertices and 24 MB of triangles
  const std::string text =
      R"({"objects": [{"shape": "plane", "size": [1, 1], "segments": [1000, 1000]}]})";
  EXPECT_EQ(load(text).objects.size(), 1u);
  setenv("CATOPTRIC_SCENE_MIB", "32", 1);
  EXPECT_THAT(errorOf(text), HasSubstr("/objects/0: the shapes up to this one take"));
  EXPECT_THAT(errorOf(text), HasSubstr("CATOPTRIC_SCENE_MIB allows: 33554432"));
  for (const char* bad : {"0", "-1", "1.5", "many", "99999999999999999999"}) {
    setenv("CATOPTRIC_SCENE_MIB", bad, 1);
    EXPECT_THROW(limitsOfEnvironment(), UsageError) << bad;
  }
  unsetenv("CATOPTRIC_SCENE_MIB");
  EXPECT_EQ(limitsOfEnvironment().maxBytes, LoadLimits{}.maxBytes);
}

TEST(Description, RotatesAboutZThenXThenY) {
  const Vec3 v = rotationOf({90, 90, 0}) * Vec3(0, 1, 0);  // about x: to +z; about y: to +x
  EXPECT_LT(glm::length(v - Vec3(1, 0, 0)), 1e-6f);
}

TEST(Description, MaterialsKeepSAndG) {
  const Scene scene = load(R"({"materials": {"m": {"base_color": "#ff0000", "s": 0.4, "g": 0.25}},
    "objects": [{"shape": "sphere", "material": "m"}, {"shape": "sphere", "material": "m", "reflective": false},
                {"shape": "sphere", "material": "m", "reflective": {"s": 0.9, "g": 0}}]})");
  const auto material = [&](std::size_t i) {
    return scene.materials[static_cast<std::size_t>(scene.objects[i].material)];
  };
  EXPECT_NEAR(material(0).specularLevel, 0.4f, 1e-6f);
  EXPECT_NEAR(material(0).roughness, 0.25f, 1e-6f);
  EXPECT_NEAR(material(0).baseColor.x, 1.0f, 1e-6f);
  EXPECT_EQ(material(1).specularLevel, 0.0f);
  EXPECT_NEAR(material(2).specularLevel, 0.9f, 1e-6f);
  EXPECT_EQ(scene.reflectorCount(), 2);
}

TEST(Description, RoughnessIsAnotherNameOfG) {
  const Scene scene = load(R"({"objects": [
    {"shape": "sphere", "material": {"s": 0.4, "g": 0.25}},
    {"shape": "sphere", "material": {"s": 0.4, "roughness": 0.25}},
    {"shape": "sphere", "reflective": {"s": 0.4, "roughness": 0.25}},
    {"shape": "sphere", "material": {"metallic": 0.4, "roughness": 0.25}}]})");
  for (std::size_t i = 0; i < 4; ++i) {
    const Material& material = scene.materials[static_cast<std::size_t>(scene.objects[i].material)];
    EXPECT_EQ(material.roughness, 0.25f) << i;
    EXPECT_EQ(material.lobe, i < 3 ? LobeModel::Phong : LobeModel::Ggx) << i;
  }
  const auto refusal = [](const std::string& material) {
    return errorOf(R"({"objects": [{"shape": "sphere", "material": )" + material + "}]}");
  };
  EXPECT_THAT(refusal(R"({"s": 1, "g": 0.1, "roughness": 0.1})"),
              HasSubstr("has both \"g\" and \"roughness\""));
  EXPECT_THAT(refusal(R"({"s": 1, "metallic": 1, "roughness": 0.1})"), HasSubstr("mixes \"s\""));
  EXPECT_THAT(refusal(R"({"g": 0.1, "roughness": 0.1})"), HasSubstr("mixes \"s\""));
}

TEST(Description, AnimatesAndMorphs) {
  const Scene scene = load(R"({"objects": [
      {"name": "ball", "shape": "sphere", "morph": {"type": "bulge", "amplitude": 0.1, "waves": 0, "cycle": 2}},
      {"name": "cube", "shape": "box"}],
    "animation": [{"object": "cube", "channel": "translate", "keys": [[0, 0, 0, 0], [1, 2, 0, 0]]}]})");
  EXPECT_EQ(movingObjects(scene), (std::vector<bool>{true, true}));
  const Pose half = poseAt(scene, 0.5);  // a quarter of the cycle: the weight is 1
  EXPECT_NEAR(glm::length(worldVertices(scene, scene.objects[0], half).positions[100]), 0.6f,
              1e-3f);
  EXPECT_NEAR(half.worldFromNode[static_cast<std::size_t>(scene.objects[1].node)][3].x, 1.0f,
              1e-6f);
}

TEST(Description, SmoothKeysTakeTheShortWayAndGoRoundInLoops) {
  const Scene scene =
      load(R"({"objects": [{"name": "a", "shape": "box"}, {"name": "b", "shape": "box"}],
    "animation": [{"object": "a", "channel": "translate", "interpolation": "smooth",
                   "keys": [[0, 0, 0, 0], [1, 2, 0, 0], [2, 1, 0, 0], [4, 0, 0, 0]]},
                  {"object": "b", "channel": "quaternion", "interpolation": "smooth",
                   "keys": [[0, 0, 0, 0, 1], [1, 0, 0.38268, 0, 0.92388], [2, 0, -0.70711, 0, -0.70711]]}]})");
  const auto placed = [&](std::size_t object, double seconds) {
    return poseAt(scene, seconds)
        .worldFromNode[static_cast<std::size_t>(scene.objects[object].node)];
  };
  // A loop: from (1, 0, 0) at 2 s of 4 s over the start to (2, 0, 0) at 1 s, 1 m in 3 s
  EXPECT_NEAR(placed(0, 0.001)[3].x / 0.001f, 1.0f / 3.0f, 0.02f);
  EXPECT_NEAR(placed(0, 3.999)[3].x / -0.001f, 1.0f / 3.0f, 0.02f);
  // The last key is a turn of 90 degrees, written with the other sign; the spline's end is at rest:
  // half of the middle and the last key, and an eighth of the middle one's tangent
  const Vec4 x = placed(1, 1.5)[0];
  EXPECT_NEAR(degrees(std::atan2(-x.z, x.x)), 72.93f, 0.05f);
}

TEST(Description, ErrorsNamePlaceAndWhatIsAllowed) {
  EXPECT_THAT(errorOf(R"({"objects": [{"shape": "spere"}]})"),
              HasSubstr("did you mean \"sphere\""));
  EXPECT_THAT(errorOf(R"({"objects": [{"shape": "sphere", "radus": 1}]})"),
              HasSubstr("did you mean \"radius\""));
  EXPECT_THAT(errorOf(R"({"objects": [{"shape": "sphere", "radius": -1}]})"),
              HasSubstr("/objects/0/radius"));
  EXPECT_THAT(
      errorOf(R"({"objects": [{"shape": "box", "material": "wod"}], "materials": {"wood": {}}})"),
      HasSubstr("did you mean \"wood\""));
  EXPECT_THAT(errorOf(R"({"objects": [{"asset": "assets/none.glb"}]})"),
              HasSubstr("prepare_assets"));
  EXPECT_THAT(errorOf(R"({"objects": [{"shape": "box", "reflective": true}]})"),
              HasSubstr("reflects"));
  EXPECT_THAT(
      errorOf(R"({"objects": [{"shape": "box"}], "lights": [{"type": "point", "baked": true}]})"),
      HasSubstr("needs \"bake\""));
  EXPECT_THAT(
      errorOf(R"({"objects": [{"shape": "box", "material": {"texture": {"procedural": "wod"}}}]})"),
      HasSubstr("did you mean \"wood\""));
  EXPECT_THAT(
      errorOf(
          R"({"objects": [{"shape": "box"}], "animation": [{"object": "b", "channel": "rotate", "keys": [[0,0,0,0]]}]})"),
      HasSubstr("there is no object"));
  EXPECT_THAT(errorOf(R"({"objects": [{"name": "group"}]})"), HasSubstr("no visible object"));
  EXPECT_THAT(errorOf("{"), HasSubstr("catoptric_description.json:1"));
}

TEST(Description, MissingAssetsAreOneErrorWithOneRemedy) {
  const std::string text = errorOf(R"({"objects": [{"asset": "assets/none_a.glb"},
    {"asset": "assets/none_b.glb"}, {"asset": "assets/none_a.glb"}]})");
  EXPECT_THAT(text, HasSubstr(":1: /objects/0/asset: there is no file "));
  EXPECT_THAT(text, HasSubstr(", and one more file of assets/ is missing; run "));
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 0) << text;
}

TEST(Description, MissingNamesAreAllToldAtOnceWithTheNearest) {
  const std::filesystem::path asset = std::filesystem::path(testing::TempDir()) / "pianino.glb";
  std::ofstream(asset) << "x";
  const std::string text = errorOf(R"({"materials": {"brass": {}}, "objects": [
    {"asset": "pianin.glb"}, {"shape": "box", "material": "bras"},
    {"shape": "box", "material": "gold"},
    {"asset": "assets/none.glb", "materials": {"*": "brasss"}}]})");
  std::filesystem::remove(asset);
  EXPECT_THAT(text, HasSubstr("/objects/0/asset: there is no file "));
  EXPECT_THAT(text, HasSubstr("pianino.glb\"?)"));
  EXPECT_THAT(text, HasSubstr("there is no material \"bras\" (did you mean \"brass\"?)"));
  EXPECT_THAT(text, HasSubstr("there is no material \"gold\"; defined: brass"));
  EXPECT_THAT(text, HasSubstr("/objects/3/materials/*: there is no material \"brasss\""));
  EXPECT_THAT(text, HasSubstr("assets/none.glb; run "));
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 4) << text;
}

TEST(Description, ImplicitSurfacesKeepTheirSurface) {
  const Scene scene = load(R"({"objects": [
    {"shape": "implicit", "surface": "vase", "segments": [24, 24]},
    {"shape": "implicit", "surface": "formula", "formula": "x^2 + y^2 + z^2 - r^2",
     "parameters": {"r": 0.5}, "bounds": [-1, -1, -1, 1, 0.25, 1], "resolution": 16},
    {"shape": "implicit", "surface": "sphere", "morph": {"type": "bulge"}}]})");
  ASSERT_EQ(scene.meshes.size(), 3u);
  EXPECT_EQ(scene.meshes[0].indices.size() / 3, 2u * 24u * 24u);
  EXPECT_NE(scene.meshes[0].surface, nullptr);
  ASSERT_NE(scene.meshes[1].surface, nullptr);
  EXPECT_EQ(scene.meshes[2].surface, nullptr);  // it deforms
  float top = -1.0f;
  for (const Vec3& p : scene.meshes[1].positions) {
    EXPECT_NEAR(glm::length(p), 0.5f, 1e-6f);
    top = std::max(top, p.y);
  }
  EXPECT_EQ(top, 0.25f);
}

TEST(Description, ImplicitSurfacesErrorsNamePlaceAndCure) {
  const auto error = [](const std::string& members) {
    return errorOf(R"({"objects": [
      {"shape": "implicit", )" +
                   members + "}]}");
  };
  const auto formula = [&](const std::string& text) {
    return error(R"("surface": "formula", "bounds": 1, "formula": ")" + text + "\"");
  };
  EXPECT_THAT(formula("x^2 + y^2 +"), HasSubstr(".json:2: /objects/0/formula"));
  EXPECT_THAT(formula("x^2 + y^2 +"), HasSubstr("column"));
  EXPECT_THAT(formula("x^2 + y^2 + z^2 + 1"), HasSubstr("above 0"));
  EXPECT_THAT(formula("x^2 + y^2 + z^2 + 1"), HasSubstr("change the bounds"));
  EXPECT_THAT(formula("x - 7"), HasSubstr("below 0"));
  EXPECT_THAT(formula("0*x"), HasSubstr("everywhere"));
  EXPECT_THAT(formula("abs(x) - sqrt(x^2)"), HasSubstr("0 everywhere"));
  EXPECT_THAT(formula("(x^2 + y^2 + z^2 - 0.5)^3"), HasSubstr("has no normal"));
  EXPECT_THAT(formula("1e-300*(x^2 + y^2 + z^2 - 0.5)"), HasSubstr("has no normal"));
  EXPECT_THAT(formula("sqrt(-1 - x^2)"), HasSubstr("NaN everywhere"));
  EXPECT_THAT(formula("1/x"), HasSubstr("poles"));
  EXPECT_THAT(formula("x*y + q"), HasSubstr("q"));
  EXPECT_THAT(error(R"("surface": "formula", "formula": "x")"), HasSubstr("\"bounds\""));
  EXPECT_THAT(error(R"("surface": "formula", "bounds": [1, 2], "formula": "x")"),
              HasSubstr("/objects/0/bounds"));
  EXPECT_THAT(error(R"("surface": "heart", "segments": [8, 8])"), HasSubstr("resolution"));
  EXPECT_THAT(error(R"("surface": "ellipsoid", "radii": [1, 2])"), HasSubstr("3 numbers"));
  EXPECT_THAT(error(R"("surface": "sphere", "bounds": [2, 2, 2, 3, 3, 3])"), HasSubstr("outside"));
}

TEST(Description, SmallScenesLoad) {
  for (const char* name : {"cornell_box", "nine_spheres", "teapots", "planar_mirror",
                           "glossy_sphere", "normal_mapped", "moving", "deforming", "vase_lizard",
                           "vase_sphere", "vase_window", "user_formula", "lens"}) {
    SCOPED_TRACE(name);
    const std::filesystem::path root(CATOPTRIC_SOURCE_DIR);
    const Scene scene = loadScene(root / "scenes" / (std::string(name) + ".json"));
    EXPECT_GT(scene.reflectorCount(), 0);
    const auto path = loadPath(root / "paths" / (std::string(name) + ".json"), scene);
    for (int f = 1; f <= path->count(); ++f) {
      EXPECT_TRUE(isFinite(path->frame(f).camera.eye()));
    }
    const std::string_view moving = name;
    EXPECT_EQ(scene.animated(),
              moving == "moving" || moving == "deforming" || moving.starts_with("vase_"));
  }
}

TEST(Procedural, SeamlessDeterministicAndBounded) {
  for (const std::string& name : proceduralNames()) {
    SCOPED_TRACE(name);
    const config::Value settings =
        config::parseText("{\"procedural\": \"" + name + "\", \"size\": 128}", "texture");
    const ProceduralImage a = makeProcedural(settings);
    const ProceduralImage b = makeProcedural(settings);
    EXPECT_EQ(a.rgba, b.rgba);
    ASSERT_EQ(a.rgba.size(), 128u * 128u * 4u);
    for (const float h : a.height) ASSERT_TRUE(std::isfinite(h));
    if (name == "painting" || name == "books" || name == "rug") continue;
    // Steps over the seam are like steps inside.
    double seam = 0.0;
    double inside = 0.0;
    for (std::size_t k = 0; k < 128; ++k) {
      const auto texel = [&](std::size_t x, std::size_t y) {
        return static_cast<double>(a.rgba[4 * (y * 128 + x)]);
      };
      seam += std::abs(texel(127, k) - texel(0, k)) + std::abs(texel(k, 127) - texel(k, 0));
      for (std::size_t j = 0; j < 127; ++j) {
        inside +=
            (std::abs(texel(j, k) - texel(j + 1, k)) + std::abs(texel(k, j) - texel(k, j + 1))) /
            127.0;
      }
    }
    // Patterns with joints at the seam step there as at any joint.
    const bool jointed = name == "wood" || name == "tiles" || name == "bricks" ||
                         name == "checker" || name == "stripes";
    EXPECT_LT(seam, (jointed ? 40.0 : 2.5) * inside + 128.0);
  }
}

TEST(Procedural, NormalMapsOfASlope) {
  // One period of a sine along x: the normal's x is minus its slope.
  const int size = 64;
  std::vector<float> height(64 * 64);
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) {
      height[static_cast<std::size_t>(y * size + x)] =
          0.02f * std::sin(2.0f * kPi * static_cast<float>(x) / 64.0f);
    }
  }
  const std::vector<std::uint8_t> map = normalMapFromHeight(height, size, 1.0f);
  const float slope = 0.02f * 2.0f * kPi;
  EXPECT_NEAR(map[0] / 255.0f * 2.0f - 1.0f, -slope / std::hypot(slope, 1.0f), 0.01f);
  EXPECT_NEAR(map[1], 128, 1);
  EXPECT_GT(map[2], 250);
}

}  // namespace
}  // namespace catoptric::scene
