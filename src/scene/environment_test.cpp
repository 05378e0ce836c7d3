// Environments that stand in for a missing light, or that a run names.
#include "scene/environment.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "core/error.h"
#include "scene/gltf/test_fixture.h"

namespace catoptric::scene {
namespace {

using ::testing::HasSubstr;
using namespace catoptric::scene::testing;

Environment named(const std::string& text, const std::filesystem::path& file = "none") {
  return namedEnvironment(
      config::parseText("{\"environment\": \"" + text + "\"}", "f.json").get("environment"), file);
}

std::string messageOf(const std::string& text) {
  try {
    named(text);
  } catch (const UsageError& error) {
    return error.what();
  }
  return "(no error)";
}

TEST(NamedEnvironment, ColoursSkiesAndFiles) {
  EXPECT_EQ(named("#ffffff").color, Vec3(1.0f));
  EXPECT_EQ(named("#000000").color, Vec3(0.0f));
  EXPECT_NEAR(named("#808080").color.x, 0.21586f, 1e-4f);  // sRGB decoded
  EXPECT_EQ(named("0.5,1,2").color, Vec3(0.5f, 1.0f, 2.0f));
  EXPECT_EQ(named("sky").type, EnvironmentType::Gradient);
  EXPECT_EQ(named("sky").color, defaultEnvironment().color);
  EXPECT_FALSE(named("sky").isDefault);
  const TemporaryFolder folder;
  std::ofstream(folder.path() / "a.exr") << "x";
  EXPECT_EQ(named("a.exr", folder.path() / "a.exr").type, EnvironmentType::File);
  EXPECT_EQ(named("a.exr", folder.path() / "a.exr").file, folder.path() / "a.exr");
}

TEST(NamedEnvironment, WhatIsWrongIsSaid) {
  EXPECT_THAT(messageOf("a.exr"), HasSubstr("f.json:1: /environment: there is no file none; an "
                                            "environment is an image, a colour"));
  EXPECT_THAT(messageOf("#12"), HasSubstr("is not a colour"));
  for (const char* text : {"1,1", "1,1,1,1", "-1,0,0", "1,,1"})
    EXPECT_THAT(messageOf(text), HasSubstr("is not a colour of three numbers from 0")) << text;
}

TEST_F(Gltf, FilesWithoutALightGetASkyAndASun) {
  w = triangleFile();
  const Scene bare = loadScene(w.gltf(folder));
  EXPECT_TRUE(bare.environment.isDefault);
  EXPECT_EQ(bare.environment.type, EnvironmentType::Gradient);
  EXPECT_GT(bare.environment.ground.x, 0.0f);
  ASSERT_EQ(bare.lights.size(), 1u);
  EXPECT_TRUE(bare.lights[0].baked);
  EXPECT_EQ(bare.bake.mode, BakeMode::Full);
  // As an asset of a description it brings none.
  EXPECT_EQ(load().environment.color, Vec3(0.0f));

  const Environment white = named("1,1,1");
  const Scene chosen = loadScene(w.gltf(folder), {}, white);
  EXPECT_FALSE(chosen.environment.isDefault);
  EXPECT_TRUE(chosen.lights.empty());
  EXPECT_EQ(chosen.bake.mode, BakeMode::None);
  EXPECT_EQ(chosen.environment.color, Vec3(1.0f));
  EXPECT_NE(chosen.fingerprint, bare.fingerprint);  // frames of the one are none of the other

  w.members["extensions"] = R"({"KHR_lights_punctual":{"lights":[{"type":"point"}]}})";
  w.arrays["nodes"] = {R"({"mesh":0,"extensions":{"KHR_lights_punctual":{"light":0}}})"};
  const Scene lit = loadScene(w.gltf(folder));
  EXPECT_FALSE(lit.environment.isDefault);
  EXPECT_EQ(lit.environment.color, Vec3(0.0f));
}

TEST_F(Gltf, DielectricsReflectInAFileOnItsOwn) {
  materialOf(R"({"pbrMetallicRoughness":{"metallicFactor":0,"roughnessFactor":0.3}})");
  const Scene scene = loadScene(w.gltf(folder));
  EXPECT_EQ(scene.reflectorCount(), 1);
  EXPECT_FLOAT_EQ(scene.materials[0].specularLevel, 0.04f);
  EXPECT_FLOAT_EQ(scene.materials[0].roughness, 0.3f);
  // As an asset of a description they are diffuse, unless it lets them reflect
  const auto described = [&](const char* more) {
    const std::string text = R"({"objects": [{"asset": "test.gltf"}])" + std::string(more) + "}";
    return loadScene(folder.write("scene.json", text)).reflectorCount();
  };
  EXPECT_EQ(described(""), 0);
  EXPECT_EQ(described(R"(, "dielectrics": "off")"), 0);
  EXPECT_EQ(described(R"(, "dielectrics": "on")"), 1);
}

}  // namespace
}  // namespace catoptric::scene
