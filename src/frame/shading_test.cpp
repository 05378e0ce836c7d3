#include "frame/shading.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "core/random.h"
#include "frame/test_environment.h"
#include "frame/test_scenes.h"
#include "scene/animate.h"
#include "scene/texture.h"

namespace catoptric::frame {
namespace {

using test::SceneBuilder;

const std::vector<Vec3>& directions() {
  static const std::vector<Vec3> list = [] {
    std::vector<Vec3> d = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
    for (int i = 0; i < 50; ++i) {
      const float y = 1.0f - 2.0f * (static_cast<float>(i) + 0.5f) / 50.0f;
      const float r = std::sqrt(1.0f - y * y);
      const float a = 2.399963f * static_cast<float>(i);
      d.emplace_back(r * std::cos(a), y, r * std::sin(a));
    }
    return d;
  }();
  return list;
}

TEST(EnvironmentLight, ConstantGivesPiTimesItsRadiance) {
  scene::Environment e;
  e.color = Vec3(0.25f, 1.0f, 3.0f);
  e.scale = 2.0f;
  const EnvironmentLight light(e);
  for (const Vec3& n : directions()) {
    EXPECT_EQ(light.radiance(n), Vec3(0.5f, 2.0f, 6.0f));
    EXPECT_NEAR(light.irradiance(n).x, kPi * 0.5f, 2e-5f);
    EXPECT_NEAR(light.irradiance(n).z, kPi * 6.0f, 2e-4f);
  }
}

TEST(EnvironmentLight, LinearGradientGivesItsClosedForm) {
  // L = 2 + 1.5 y: order 1, so that E = 2 pi + 1.5 (2 pi / 3) n.y exactly.
  scene::Environment e;
  e.type = scene::EnvironmentType::Gradient;
  e.color = Vec3(3.5f);
  e.horizon = Vec3(2.0f);
  e.ground = Vec3(0.5f);
  const EnvironmentLight light(e);
  for (const Vec3& n : directions()) {
    EXPECT_NEAR(light.irradiance(n).y, 2.0f * kPi + kPi * n.y, 2e-5f);
  }
}

TEST(EnvironmentLight, CosineSkyIsRightToOrderTwo) {
  // L = max(0, y): its irradiance, integrated numerically, against order 2, whose error is at most
  // 1/16 of the radiance's maximum times pi / 2 (the missing order 4) [Ramamoorthi2001].
  scene::Environment e;
  e.type = scene::EnvironmentType::Gradient;
  e.color = Vec3(1.0f);
  const EnvironmentLight light(e);
  for (const Vec3& n : directions()) {
    double exact = 0.0;
    const int rows = 200;
    for (int i = 0; i < rows; ++i) {
      const double y = (i + 0.5) / rows;
      const double r = std::sqrt(1.0 - y * y);
      for (int j = 0; j < rows; ++j) {
        const double a = 2.0 * std::numbers::pi * (j + 0.5) / rows;
        const double c = static_cast<double>(n.x) * r * std::cos(a) + static_cast<double>(n.y) * y +
                         static_cast<double>(n.z) * r * std::sin(a);
        exact += std::max(0.0, c) * y * 2.0 * std::numbers::pi / rows / rows;
      }
    }
    EXPECT_NEAR(static_cast<double>(light.irradiance(n).x), exact, 0.02 * std::numbers::pi);
  }
}

TEST(EnvironmentLight, ImageFollowsTheMappingAndTurns) {
  // A bright half sky towards +x, as an image; turned by 90 degrees about +y it stands towards -z.
  const auto file = test::writeEnvironment("catoptric_env.exr", 256, 128, [](const Vec3& d) {
    const float value = 1.0f + d.x;
    return Vec3(value, 2.0f * value, 0.5f * value);
  });
  scene::Environment e;
  e.type = scene::EnvironmentType::File;
  e.file = file;
  e.scale = 3.0f;
  const EnvironmentLight straight(e);
  e.rotationRad = radians(90.0f);
  const EnvironmentLight turned(e);
  std::filesystem::remove(file);
  for (const Vec3& d : directions()) {
    EXPECT_NEAR(straight.radiance(d).x, 3.0f * (1.0f + d.x), 0.02f);
    EXPECT_NEAR(straight.radiance(d).y, 6.0f * (1.0f + d.x), 0.04f);
    EXPECT_NEAR(turned.radiance(d).x, 3.0f * (1.0f - d.z), 0.02f);
    EXPECT_NEAR(straight.irradiance(d).x, 3.0f * (kPi + 2.0f * kPi / 3.0f * d.x), 5e-3f);
    EXPECT_NEAR(turned.irradiance(d).x, 3.0f * (kPi - 2.0f * kPi / 3.0f * d.z), 5e-3f);
  }
}

TEST(EnvironmentLight, NegativeRadianceCountsAsNone) {
  scene::Environment e;
  e.type = scene::EnvironmentType::File;
  const auto light = [&](float below) {
    e.file = test::writeEnvironment("catoptric_negative.exr", 64, 32, [&](const Vec3& d) {
      return d.y > 0.0f ? Vec3(2.0f, 1.0f, 1.0f) : Vec3(1.0f, below, 1.0f);
    });
    return EnvironmentLight(e);
  };
  const EnvironmentLight negative = light(-0.5f);
  const EnvironmentLight none = light(0.0f);
  for (const Vec3& d : directions()) {
    EXPECT_EQ(negative.radiance(d), none.radiance(d));
    EXPECT_EQ(negative.irradiance(d), none.irradiance(d));
  }
  std::filesystem::remove(e.file);
}

TEST(LightIrradiance, FollowsKhrLightsPunctual) {
  WorldLight light;
  light.position = {0.0f, 2.0f, 0.0f};
  light.intensity = Vec3(8.0f);
  const Vec3 up(0.0f, 1.0f, 0.0f);
  EXPECT_NEAR(lightIrradiance(light, Vec3(0.0f), up).x, 2.0f, 1e-6f);
  EXPECT_EQ(lightIrradiance(light, Vec3(0.0f), -up).x, 0.0f);
  light.range = 4.0f;  // (1 - (2 / 4)^4)
  EXPECT_NEAR(lightIrradiance(light, Vec3(0.0f), up).x, 2.0f * (1.0f - 0.0625f), 1e-6f);
  EXPECT_EQ(lightIrradiance(light, Vec3(0.0f, -3.0f, 0.0f), up).x, 0.0f);
  light.range = 0.0f;
  light.type = scene::LightType::Spot;
  light.direction = -up;
  light.cosInner = std::cos(0.2f);
  light.cosOuter = std::cos(0.6f);
  EXPECT_NEAR(lightIrradiance(light, Vec3(0.0f), up).x, 2.0f, 1e-6f);
  const float aside = 2.0f * std::tan(0.4f);
  const float cosine = std::cos(0.4f);
  const float cone = (cosine - light.cosOuter) / (light.cosInner - light.cosOuter);
  EXPECT_NEAR(lightIrradiance(light, Vec3(aside, 0.0f, 0.0f), up).x,
              8.0f * cosine / (4.0f + aside * aside) * cone * cone, 1e-5f);
  EXPECT_EQ(lightIrradiance(light, Vec3(2.0f, 0.0f, 0.0f), up).x, 0.0f);
  light.type = scene::LightType::Directional;
  EXPECT_EQ(lightIrradiance(light, Vec3(5.0f), up).x, 8.0f);
}

scene::Texture checker() {
  // 4 x 4, 2 x 2, 1 x 1: each level a value of its own.
  scene::Texture t;
  t.srgb = false;
  const auto level = [](int size, std::uint8_t value) {
    scene::MipLevel l;
    l.width = size;
    l.height = size;
    l.rgba.assign(static_cast<std::size_t>(size * size * 4), value);
    return l;
  };
  t.levels = {level(4, 0), level(2, 51), level(1, 255)};
  return t;
}

TEST(SampleTexture, InterpolatesBetweenLevelsAndClamps) {
  const scene::Texture t = checker();
  EXPECT_EQ(sampleTexture(t, {0.3f, 0.6f}, -5.0f).x, 0.0f);
  EXPECT_NEAR(sampleTexture(t, {0.3f, 0.6f}, 0.5f).x, 0.1f, 1e-6f);
  EXPECT_NEAR(sampleTexture(t, {0.3f, 0.6f}, 1.5f).x, 0.6f, 1e-6f);
  EXPECT_EQ(sampleTexture(t, {0.3f, 0.6f}, 99.0f).x, 1.0f);
  EXPECT_EQ(sampleTexture(t, {0.3f, 0.6f}, std::nanf("")).x, 0.0f);
}

TEST(SampleTexture, WrapsAndFiltersAtTexelCentres) {
  scene::Texture t;
  t.srgb = false;
  scene::MipLevel level{2, 1, {0, 0, 0, 255, 255, 255, 255, 255}};
  t.levels = {level};
  EXPECT_EQ(sampleTexture(t, {0.25f, 0.5f}, 0.0f).x, 0.0f);
  EXPECT_EQ(sampleTexture(t, {0.75f, 0.5f}, 0.0f).x, 1.0f);
  EXPECT_NEAR(sampleTexture(t, {0.5f, 0.5f}, 0.0f).x, 0.5f, 1e-6f);
  EXPECT_NEAR(sampleTexture(t, {0.0f, 0.5f}, 0.0f).x, 0.5f, 1e-6f);  // repeats
  EXPECT_NEAR(sampleTexture(t, {7.75f, -3.5f}, 0.0f).x, 1.0f, 1e-6f);
  t.wrapS = scene::Wrap::ClampToEdge;
  EXPECT_EQ(sampleTexture(t, {0.0f, 0.5f}, 0.0f).x, 0.0f);
  EXPECT_EQ(sampleTexture(t, {5.0f, 0.5f}, 0.0f).x, 1.0f);
  t.wrapS = scene::Wrap::MirroredRepeat;
  EXPECT_EQ(sampleTexture(t, {1.25f, 0.5f}, 0.0f).x, 1.0f);
  EXPECT_EQ(sampleTexture(t, {-0.25f, 0.5f}, 0.0f).x, 0.0f);
  EXPECT_EQ(sampleTexture(t, {1e30f, std::nanf("")}, 0.0f).w, 1.0f);
}

TEST(SampleTexture, DecodesSrgbBeforeFiltering) {
  scene::Texture t;
  scene::MipLevel level{2, 1, {0, 0, 0, 255, 188, 188, 188, 128}};
  t.levels = {level};
  const float linear = std::pow((188.0f / 255.0f + 0.055f) / 1.055f, 2.4f);
  EXPECT_NEAR(sampleTexture(t, {0.5f, 0.5f}, 0.0f).x, 0.5f * linear, 1e-5f);
  EXPECT_NEAR(sampleTexture(t, {0.75f, 0.5f}, 0.0f).w, 128.0f / 255.0f, 1e-6f);
}

class ShadeSurface : public ::testing::Test {
 protected:
  SurfacePoint shade(const Vec3& direction, float coneWidth = 0.0f,
                     const Vec2& scatter = Vec2(0.0f)) {
    const float u = 0.25f;
    const float v = 0.25f;
    const scene::Scene& scene = builder.scene();
    const scene::Pose pose = scene::poseAt(scene, 0.0);
    geometry = makeGeometry(scene, pose);
    const Lighting lighting =
        makeLighting(scene, pose, std::make_shared<EnvironmentLight>(scene.environment));
    const std::uint32_t* t = geometry.indices.data();
    const Vec3 position = (1.0f - u - v) * geometry.positions[t[0]] + u * geometry.positions[t[1]] +
                          v * geometry.positions[t[2]];
    return shadeSurface(scene, geometry, lighting, 0, 0, u, v, position, direction, coneWidth,
                        scatter);
  }
  SceneBuilder builder;
  Geometry geometry;
  scene::Mesh plane = scene::makePlane({2.0f, 2.0f}, {1, 1}, scene::UvMode::Unit);
  Vec3 down{0.0f, -1.0f, 0.0f};
};

TEST_F(ShadeSurface, SumsAmbientSkyLightsAndEmission) {
  builder.constantEnvironment(Vec3(0.5f));
  builder.scene().ambient = Vec3(0.25f);
  builder.add(plane, builder.diffuse(Vec3(0.5f, 1.0f, 0.0f), Vec3(0.125f)));
  scene::Light light;
  light.type = scene::LightType::Directional;
  light.direction = down;
  light.intensity = Vec3(kPi);
  builder.scene().lights.push_back(light);
  const SurfacePoint point = shade(down);
  EXPECT_NEAR(point.diffuse.x, 0.5f * (0.5f + 0.25f + 1.0f) + 0.125f, 1e-5f);
  EXPECT_NEAR(point.diffuse.y, 1.75f + 0.125f, 1e-5f);
  EXPECT_EQ(point.diffuse.z, 0.125f);
  EXPECT_EQ(point.object, 1);
}

TEST_F(ShadeSurface, TurnsNormalsToTheViewer) {
  builder.add(plane, builder.diffuse(Vec3(1.0f)));
  EXPECT_NEAR(shade(down).normal.y, 1.0f, 1e-6f);
  EXPECT_NEAR(shade(-down).normal.y, -1.0f, 1e-6f);
  EXPECT_NEAR(shade(-down).geometricNormal.y, -1.0f, 1e-6f);
}

TEST_F(ShadeSurface, BakedLightsAreLeftOutOnlyAfterAFullBake) {
  builder.add(plane, builder.diffuse(Vec3(1.0f)));
  scene::Light light;
  light.type = scene::LightType::Directional;
  light.direction = down;
  light.intensity = Vec3(kPi);
  light.baked = true;
  builder.scene().lights.push_back(light);
  EXPECT_NEAR(shade(down).diffuse.x, 1.0f, 1e-6f);
  builder.scene().bake.mode = scene::BakeMode::Full;
  EXPECT_EQ(shade(down).diffuse.x, 0.0f);
}

TEST_F(ShadeSurface, UnlitIsAlbedoAndNothingElse) {
  builder.constantEnvironment(Vec3(5.0f));
  const int material = builder.diffuse(Vec3(0.3f), Vec3(9.0f));
  builder.scene().materials[material].unlit = true;
  builder.add(plane, material);
  EXPECT_EQ(shade(down).diffuse, Vec3(0.3f));
}

TEST_F(ShadeSurface, ConeWidthChoosesTheMipLevel) {
  builder.constantEnvironment(Vec3(1.0f));
  builder.scene().textures.push_back(checker());
  const int material = builder.diffuse(Vec3(1.0f));
  builder.scene().materials[material].baseColorTexture.texture = 0;
  builder.add(plane, material);
  // uv per metre 1/2, 4 texels: a cone of 1 m is 2 texels wide, level 1; half of that level 0.
  EXPECT_NEAR(shade(down, 1.0f).diffuse.x, 0.2f, 1e-5f);
  EXPECT_NEAR(shade(down, 0.5f).diffuse.x, 0.0f, 1e-6f);
  EXPECT_NEAR(shade(down, std::sqrt(2.0f)).diffuse.x, 0.6f, 1e-5f);
  // Seen at 60 degrees the footprint grows by sqrt(2): cos = 1/2.
  const Vec3 slanted(std::sin(radians(60.0f)), -0.5f, 0.0f);
  EXPECT_NEAR(shade(slanted, std::sqrt(0.5f)).diffuse.x, 0.2f, 1e-5f);
  // A transform that repeats the texture twice halves the texels' size.
  builder.scene().materials[material].baseColorTexture.transform =
      glm::mat3x2(2.0f, 0.0f, 0.0f, 2.0f, 0.0f, 0.0f);
  EXPECT_NEAR(shade(down, 0.5f).diffuse.x, 0.2f, 1e-5f);
}

TEST_F(ShadeSurface, NormalMapTiltsInTheTangentFrame) {
  // A texel (1, 0.5, 0.5): m = (1, 0, 0) to rounding, so that the normal is the tangent.
  scene::Texture t;
  t.srgb = false;
  t.levels = {{1, 1, {255, 128, 128, 255}}};
  builder.scene().textures.push_back(t);
  const int material = builder.diffuse(Vec3(1.0f));
  builder.scene().materials[material].normalTexture.texture = 0;
  plane.tangents.assign(plane.positions.size(), Vec4(0.0f, 0.0f, 1.0f, 1.0f));
  builder.add(plane, material);
  const SurfacePoint front = shade(down);
  EXPECT_NEAR(front.normal.z, 1.0f, 1e-3f);
  EXPECT_NEAR(shade(-down).normal.z, -1.0f, 1e-3f);
  EXPECT_NEAR(front.geometricNormal.y, 1.0f, 1e-6f);
  builder.scene().materials[material].normalScale = 0.0f;
  EXPECT_NEAR(shade(down).normal.y, 1.0f, 1e-6f);
}

TEST_F(ShadeSurface, ReflectionsSeeTheNormalsThatAMipLevelHasAveraged) {
  // One half tilted by +0.3, the other by -0.3; level 3, of 4 x 4 texels, blends them in half of
  // its area
  const float theta = 0.3f;
  const auto unorm = [](float x) { return static_cast<std::uint8_t>(127.5f + 127.5f * x + 0.5f); };
  std::vector<std::uint8_t> rgba;
  for (int i = 0; i < 32 * 32; ++i) {
    const float x = i % 32 < 16 ? std::sin(theta) : -std::sin(theta);
    rgba.insert(rgba.end(), {unorm(x), 128, unorm(std::cos(theta)), 255});
  }
  scene::Texture t;
  t.srgb = false;
  t.levels = scene::makeMipChain(32, 32, rgba, false);
  builder.scene().textures.push_back(t);
  const int mirror = builder.reflective(0.5f);
  builder.scene().materials[mirror].normalTexture.texture = 0;
  plane.tangents.assign(plane.positions.size(), Vec4(0.0f, 0.0f, 1.0f, 1.0f));
  builder.add(plane, mirror);

  int left = 0;
  int right = 0;
  for (int i = 0; i < 1024; ++i) {
    const Vec2 place = scatterPlace(i % 32, i / 32);
    EXPECT_EQ(shade(down, 0.0f, place).normal, shade(down).normal);
    const SurfacePoint point = shade(down, 100.0f, place);
    EXPECT_EQ(point.diffuse, shade(down, 100.0f).diffuse);
    const float tilt = std::asin(point.normal.z);
    EXPECT_LE(std::abs(tilt), theta + 0.01f);
    left += tilt > theta - 0.01f ? 1 : 0;
    right += tilt < -theta + 0.01f ? 1 : 0;
  }
  EXPECT_NEAR(left, 256, 25);
  EXPECT_NEAR(right, 256, 25);
}

TEST_F(ShadeSurface, MetallicRoughnessTexelsGiveSAndG) {
  scene::Texture t;
  t.srgb = false;
  t.levels = {{1, 1, {0, 51, 255, 255}}};
  builder.scene().textures.push_back(t);
  const int material = builder.diffuse(Vec3(1.0f));
  scene::Material& m = builder.scene().materials[material];
  m.metallicRoughnessTexture.texture = 0;
  m.metallicFactor = 0.5f;
  m.roughnessFactor = 0.5f;
  builder.add(plane, material);
  EXPECT_NEAR(shade(down).specularLevel, 0.5f + 0.5f * 0.04f, 1e-6f);
  EXPECT_NEAR(shade(down).lobe.roughness(), 0.1f, 1e-6f);
  builder.scene().materials[material].metallicFactor = 0.0f;
  EXPECT_EQ(shade(down).specularLevel, 0.0f);
}

TEST(AboveSurface, NormalsAreBentAsFarAsMirroredRaysNeed) {
  const auto unit = [](std::uint32_t i) {
    const auto f = [](std::uint32_t x) { return 2.0f * unitFloat(mixedBits(x)) - 1.0f; };
    return normalizedOr(Vec3(f(3 * i), f(3 * i + 1), f(3 * i + 2)), Vec3(1.0f, 0.0f, 0.0f));
  };
  int bentOnes = 0;
  for (std::uint32_t i = 0; i < 20000; ++i) {
    const Vec3 direction = unit(3 * i);
    Vec3 geometric = unit(3 * i + 1);
    if (glm::dot(geometric, direction) > 0.0f) geometric = -geometric;
    const Vec3 before = unit(3 * i + 2);
    const float least =
        std::min(kElevationShare * -glm::dot(geometric, direction), kLeastElevation);
    const bool below = glm::dot(geometric, glm::reflect(direction, before)) < least;
    Vec3 normal = before;
    ASSERT_EQ(aboveSurface(geometric, direction, normal), below);
    if (!below) {
      ASSERT_EQ(normal, before);
      continue;
    }
    ++bentOnes;
    // As far as needed, no farther, and in the plane of both normals
    ASSERT_NEAR(glm::length(normal), 1.0f, 1e-5f);
    ASSERT_NEAR(glm::dot(geometric, glm::reflect(direction, normal)), least, 2e-4f);
    ASSERT_NEAR(glm::dot(normal, glm::cross(geometric, before)), 0.0f, 2e-4f);
    ASSERT_GE(glm::dot(normal, geometric), 0.0f);
    ASSERT_LE(glm::dot(normal, direction), 1e-5f);
  }
  EXPECT_GT(bentOnes, 5000);
}

}  // namespace
}  // namespace catoptric::frame
