// Surfaces that GL draws held against closed forms: spheres, planes, lights, textures, classes,
// precision.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "raster/test_shots.h"

namespace catoptric::raster {
namespace {

using test::above;
using test::addTexture;
using test::front;
using test::kFov;
using test::kHeight;
using test::kSamples;
using test::kUp;
using test::kWidth;
using test::plane;
using test::rotation;
using test::SceneBuilder;
using test::Shot;
using test::translation;
using test::Uploaded;

TEST(Raster, SphereHasItsDepthNormalsAndArea) {
  SceneBuilder builder;
  builder.add(scene::makeSphere(1.0f, 512, 256, scene::UvMode::Unit), builder.diffuse(Vec3(1.0f)));
  Uploaded stage(builder.scene());
  // Samples lie at ((i + .5) / 3, (j + .5) / 3): `direction` above says so
  const Shot shot(stage, front(), 3);
  std::size_t covered = 0;
  int compared = 0;
  for (std::size_t i = 0; i < shot.ids.size(); ++i) {
    covered += shot.ids[i] == 1 ? 1 : 0;
    const float b = -glm::dot(shot.eye, shot.direction[i]);
    const float root = b * b - (glm::dot(shot.eye, shot.eye) - 1.0f);
    if (root < 0.05f) continue;
    const Vec3 p = shot.eye + (b - std::sqrt(root)) * shot.direction[i];
    ASSERT_EQ(shot.ids[i], 1u);
    ASSERT_NEAR(glm::length(p - shot.position[i]), 0.0f, 6e-4f);  // sagitta 1e-4 over the cosine
    ASSERT_GT(glm::dot(shot.n(i), p), 0.99999f);
    ++compared;
  }
  EXPECT_GT(compared, 2000);
  // The silhouette of a sphere on the axis is a circle of tangent r / sqrt(d^2 - r^2)
  const float focal = 0.5f * 3.0f * kHeight / std::tan(0.5f * kFov);
  EXPECT_NEAR(static_cast<double>(covered) / (kPi * focal * focal / 24.0f), 1.0, 0.005);
}

/// Draws a plane under one light; `expected` is the irradiance at a point. Returns the largest.
template <class Expected>
float drawLambert(const scene::Light& light, bool below, Expected&& expected) {
  SceneBuilder builder;
  builder.add(plane(40.0f), builder.diffuse(Vec3(0.5f, 0.25f, 1.0f)));
  builder.scene().lights.push_back(light);
  Uploaded stage(builder.scene());
  const scene::Camera camera =
      below ? scene::lookAt({0.3f, -1.5f, 2.0f}, Vec3(0.0f), kUp, kFov) : above();
  const Shot shot(stage, camera);
  float largest = 0.0f;
  for (std::size_t i = 0; i < shot.ids.size(); ++i) {
    if (shot.ids[i] == 0) continue;
    // The ray's own point, not that of the depth
    const Vec3 p = shot.eye - shot.direction[i] * (shot.eye.y / shot.direction[i].y);
    const float e = static_cast<float>(expected(p)) / kPi;
    largest = std::max(largest, e);
    EXPECT_NEAR(shot.radiance(i).x, 0.5f * e, 1e-4f * e + 1e-7f) << p.x << " " << p.z;
    EXPECT_NEAR(shot.radiance(i).y, 0.25f * e, 1e-4f * e + 1e-7f);
    EXPECT_NEAR(shot.radiance(i).z, e, 1e-4f * e + 1e-7f);
  }
  return largest;
}

TEST(Raster, PlanesUnderLightsAreLambertian) {
  scene::Light light;
  light.type = scene::LightType::Point;
  light.position = {0.4f, 0.7f, -0.2f};
  light.intensity = Vec3(3.0f);
  const auto point = [&](const Vec3& p) {
    const double dx = light.position.x - p.x;
    const double dz = light.position.z - p.z;
    const double r2 = dx * dx + dz * dz + 0.49;
    return 3.0 * 0.7 / std::sqrt(r2) / r2;
  };
  EXPECT_GT(drawLambert(light, false, point), 0.1f);
  // Seen from the other side, the same light is behind the surface
  EXPECT_EQ(drawLambert(light, true, [](const Vec3&) { return 0.0; }), 0.0f);
  // ... and one below it lights that side
  light.position.y = -0.7f;
  EXPECT_GT(drawLambert(light, true, point), 0.1f);
  EXPECT_EQ(drawLambert(light, false, [](const Vec3&) { return 0.0; }), 0.0f);
}

TEST(Raster, DirectionalLightsAndSpots) {
  scene::Light sun;
  sun.type = scene::LightType::Directional;
  sun.direction = Vec3(3.0f, -4.0f, 0.0f);
  sun.intensity = Vec3(2.0f);
  SceneBuilder builder;
  builder.add(plane(40.0f), builder.diffuse(Vec3(1.0f)));
  builder.scene().lights.push_back(sun);
  Uploaded stage(builder.scene());
  const Shot shot(stage, above());
  for (std::size_t i = 0; i < kSamples; ++i) {
    if (shot.ids[i] == 1) {
      ASSERT_NEAR(shot.radiance(i).x, 2.0f * 0.8f / kPi, 1e-5f);
    }
  }

  scene::Light spot;
  spot.type = scene::LightType::Spot;
  spot.position = {0.0f, 2.0f, 0.0f};
  spot.intensity = Vec3(5.0f);
  spot.innerConeRad = 0.1f;
  spot.outerConeRad = 0.4f;
  builder.scene().lights = {spot};
  Uploaded lit(builder.scene());
  const Shot cone(lit, above());
  int dark = 0;
  int full = 0;
  int between = 0;
  for (std::size_t i = 0; i < kSamples; ++i) {
    if (cone.ids[i] == 0) continue;
    const Vec3 p = cone.eye - cone.direction[i] * (cone.eye.y / cone.direction[i].y);
    const float r = std::sqrt(p.x * p.x + p.z * p.z + 4.0f);
    const float cosine = 2.0f / r;
    const float unshaped = 5.0f * cosine / (r * r) / kPi;
    const float angle = std::acos(std::min(1.0f, cosine));
    if (angle > 0.4f) {
      ASSERT_EQ(cone.radiance(i).x, 0.0f);
      ++dark;
    } else if (angle < 0.099f) {
      ASSERT_NEAR(cone.radiance(i).x, unshaped, 1e-4f * unshaped);
      ++full;
    } else if (angle > 0.101f) {
      const float t = (cosine - std::cos(0.4f)) / (std::cos(0.1f) - std::cos(0.4f));
      ASSERT_NEAR(cone.radiance(i).x, unshaped * t * t, 2e-4f * unshaped);
      ++between;
    }
  }
  EXPECT_GT(dark, 100);
  EXPECT_GT(full, 10);
  EXPECT_GT(between, 100);
}

TEST(Raster, WhiteFurnaceIsWhite) {
  SceneBuilder builder;
  builder.constantEnvironment(Vec3(1.0f));
  const int white = builder.diffuse(Vec3(1.0f));
  builder.add(scene::makeSphere(1.0f, 64, 32, scene::UvMode::Unit), white);
  builder.add(scene::makeTorus(1.6f, 0.2f, 64, 16, scene::UvMode::Unit), white,
              rotation(50.0f, {1.0f, 0.4f, 0.0f}));
  builder.add(plane(), white, translation({0.0f, -1.2f, 0.0f}));
  Uploaded stage(builder.scene());
  const Shot shot(stage, front());
  for (std::size_t i = 0; i < kSamples; ++i) {
    for (int c = 0; c < 3; ++c) ASSERT_NEAR(shot.radiance(i)[c], 1.0f, 1e-5f) << shot.ids[i];
  }
  // Composited: 1 everywhere, and coverage where surfaces are
  GBuffer target = stage.raster->makeGBuffer({kWidth, kHeight, 2, false});
  stage.raster->drawGBuffer(target, front(), stage.lighting);
  gl::Texture frame = gl::Texture::make2D("frame", GL_RGBA32F, kWidth, kHeight);
  stage.raster->composite(target, front(), {}, frame);
  const std::vector<float> pixels = readRgba(frame);
  for (std::size_t i = 0; i < 4 * kSamples; ++i) {
    if (i % 4 != 3) {
      ASSERT_NEAR(pixels[i], 1.0f, 1e-5f);
    }
  }
}

TEST(Raster, NormalsTurnToTheViewerAndNormalMapsTilt) {
  SceneBuilder builder;
  // m = (0.6, 0, 0.8) to the rounding of 8 bits
  const int texture = addTexture(builder, 1, 1, {204, 128, 230, 255});
  const int flat = builder.diffuse(Vec3(1.0f));
  const int tilted = builder.diffuse(Vec3(1.0f));
  builder.scene().materials[tilted].normalTexture.texture = texture;
  builder.add(plane(), flat, translation({-1.1f, 0.0f, 0.0f}));
  scene::Mesh mapped = plane();
  mapped.tangents.assign(mapped.positions.size(), Vec4(0.0f, 0.0f, 1.0f, 1.0f));
  builder.add(mapped, tilted, translation({1.1f, 0.0f, 0.0f}));
  Uploaded stage(builder.scene());
  // normal (0, 1, 0), tangent +z, bitangent = cross(normal, tangent) = +x
  const Vec3 m = 2.0f * Vec3(204.0f, 128.0f, 230.0f) / 255.0f - 1.0f;
  const Vec3 bent = glm::normalize(Vec3(m.y, m.z, m.x));
  for (const float side : {1.0f, -1.0f}) {
    const Shot shot(stage, scene::lookAt({0.0f, 3.0f * side, 2.0f}, Vec3(0.0f), kUp, kFov));
    int seen[3] = {};
    for (std::size_t i = 0; i < kSamples; ++i) {
      ++seen[shot.ids[i]];
      if (shot.ids[i] == 1) {
        ASSERT_NEAR(shot.n(i).y, side, 1e-6f);
      }
      if (shot.ids[i] == 2) {
        ASSERT_LT(glm::length(shot.n(i) - side * bent), 1e-4f);
      }
    }
    EXPECT_GT(seen[1], 100);
    EXPECT_GT(seen[2], 100);
  }
}

TEST(Raster, MipLevelsAreThoseOfSampleTexture) {
  SceneBuilder builder;
  builder.constantEnvironment(Vec3(1.0f));
  std::vector<std::uint8_t> rgba;
  for (int y = 0; y < 64; ++y) {
    for (int x = 0; x < 64; ++x) {
      const bool odd = ((x / 4 + y / 4) & 1) != 0;
      rgba.insert(rgba.end(),
                  {std::uint8_t(odd ? 255 : 0), std::uint8_t(4 * x), std::uint8_t(4 * y), 255});
    }
  }
  const int texture = addTexture(builder, 64, 64, rgba, false, true);
  const int material = builder.diffuse(Vec3(1.0f));
  builder.scene().materials[material].baseColorTexture.texture = texture;
  // A transform of scale 12 and an offset, on the plane's first uv set
  builder.scene().materials[material].baseColorTexture.transform =
      glm::mat3x2(12.0f, 0.0f, 0.0f, 12.0f, 0.25f, 0.5f);
  builder.add(plane(40.0f), material);
  Uploaded stage(builder.scene());
  const scene::Camera camera = above();
  const Shot shot(stage, camera);
  const float spread = scene::pixelSpreadRad(camera, kHeight);
  float lowest = 100.0f;
  float highest = 0.0f;
  for (std::size_t i = 0; i < kSamples; ++i) {
    if (shot.ids[i] == 0) continue;
    // u = (x + 20) / 40, v falls with -z
    const float t = -shot.eye.y / shot.direction[i].y;
    const Vec3 p = shot.eye + shot.direction[i] * t;
    const scene::Mesh& mesh = builder.scene().meshes[0];
    // Affine map of the mesh's own corners
    Vec2 uv = mesh.uv[0][0];
    for (std::size_t k = 1; k < mesh.positions.size(); ++k) {
      const Vec3 e = mesh.positions[k] - mesh.positions[0];
      const Vec2 d = mesh.uv[0][k] - mesh.uv[0][0];
      if (e.x != 0.0f && e.z == 0.0f) uv += d * ((p.x - mesh.positions[0].x) / e.x);
      if (e.z != 0.0f && e.x == 0.0f) uv += d * ((p.z - mesh.positions[0].z) / e.z);
    }
    uv = 12.0f * uv + Vec2(0.25f, 0.5f);
    // 64 * 12 texels over 40 m
    const float lod =
        std::log2(768.0f / 40.0f * spread * t / std::sqrt(std::max(0.05f, -shot.direction[i].y)));
    lowest = std::min(lowest, lod);
    highest = std::max(highest, lod);
    const Vec4 texel =
        frame::sampleTexture(builder.scene().textures[texture], uv, std::clamp(lod, 0.0f, 6.0f));
    for (int c = 0; c < 3; ++c) ASSERT_NEAR(shot.radiance(i)[c], texel[c], 0.012f) << lod;
  }
  EXPECT_LT(lowest, 1.0f);
  EXPECT_GT(highest, 2.0f);
}

TEST(Raster, VertexColoursUnlitEmissionAndUvSets) {
  SceneBuilder builder;
  scene::Mesh mesh = plane();
  for (const Vec3& p : mesh.positions) {
    mesh.colors.push_back(Vec3(0.5f + 0.25f * p.x, 0.5f + 0.25f * p.z, 1.0f));
    mesh.uv[1].push_back(Vec2(0.25f, 0.5f));
  }
  // Four texels in a row; the second uv set points at the first, its transform at the third
  const int texture = addTexture(
      builder, 4, 1, {255, 0, 0, 255, 0, 51, 0, 255, 0, 0, 102, 255, 153, 153, 153, 255});
  const int lit = builder.diffuse(Vec3(1.0f));
  const int unlit = builder.diffuse(Vec3(0.5f), Vec3(7.0f));
  builder.scene().materials[unlit].unlit = true;
  const int emissive = builder.diffuse(Vec3(0.0f), Vec3(2.0f));
  scene::TextureSlot& slot = builder.scene().materials[emissive].emissiveTexture;
  slot.texture = texture;
  slot.uvSet = 1;
  slot.transform = glm::mat3x2(1.0f, 0.0f, 0.0f, 1.0f, 0.375f, 0.0f);  // u = 0.625
  builder.constantEnvironment(Vec3(2.0f));
  builder.add(mesh, lit, translation({-2.1f, 0.0f, 0.0f}));
  builder.add(mesh, unlit);
  builder.add(mesh, emissive, translation({2.1f, 0.0f, 0.0f}));
  Uploaded stage(builder.scene());
  const Shot shot(stage, scene::lookAt({0.0f, 7.0f, 0.5f}, Vec3(0.0f), kUp, kFov));
  int seen[4] = {};
  for (std::size_t i = 0; i < kSamples; ++i) {
    ++seen[shot.ids[i]];
    const Vec3 p = shot.eye - shot.direction[i] * (shot.eye.y / shot.direction[i].y);
    const auto colour = [&](float x) {
      return Vec3(0.5f + 0.25f * (p.x - x), 0.5f + 0.25f * p.z, 1.0f);
    };
    Vec3 expected(2.0f);  // the environment
    if (shot.ids[i] == 1) expected = 2.0f * colour(-2.1f);
    if (shot.ids[i] == 2) expected = 0.5f * colour(0.0f);
    if (shot.ids[i] == 3) expected = Vec3(0.0f, 0.0f, 2.0f * 102.0f / 255.0f);
    ASSERT_LT(glm::length(shot.radiance(i) - expected), 1e-4f) << shot.ids[i];
  }
  for (int object = 1; object <= 3; ++object) EXPECT_GT(seen[object], 50);
}

TEST(Raster, AlphaMasksCutAway) {
  SceneBuilder builder;
  const int texture = addTexture(builder, 2, 1, {255, 255, 255, 127, 255, 255, 255, 128});
  const int material = builder.diffuse(Vec3(1.0f));
  scene::Material& m = builder.scene().materials[material];
  m.baseColorTexture.texture = texture;
  m.alphaMode = scene::AlphaMode::Mask;
  m.alphaCutoff = 0.5f;
  builder.add(plane(), material, rotation(90.0f, {1.0f, 0.0f, 0.0f}));
  Uploaded stage(builder.scene());
  const Shot shot(stage, front());
  int left = 0;
  int right = 0;
  for (std::size_t i = 0; i < kSamples; ++i) {
    const Vec3 p = shot.direction[i] * (5.0f / -shot.direction[i].z);
    if (std::abs(std::abs(p.x) - 0.5f) > 0.45f || std::abs(p.y) > 0.95f) continue;
    (p.x < 0.0f ? left : right) += shot.ids[i] == 1 ? 1 : 0;
    ASSERT_EQ(shot.ids[i], p.x < 0.0f ? 0u : 1u);
    ASSERT_EQ(shot.depth[i] > 0.0f, shot.ids[i] == 1);
  }
  EXPECT_EQ(left, 0);
  EXPECT_GT(right, 50);
}

TEST(Raster, ClassesAndReflectanceOfTexels) {
  SceneBuilder builder;
  const scene::Mesh sphere = scene::makeSphere(0.45f, 32, 16, scene::UvMode::Unit);
  const Mat4 upright = rotation(90.0f, {1.0f, 0.0f, 0.0f});
  builder.add(sphere, builder.diffuse(Vec3(1.0f)), translation({-2.0f, 0.0f, 0.0f}));
  builder.add(plane(0.9f), builder.reflective(0.5f), translation({-1.0f, 0.0f, 0.0f}) * upright);
  builder.add(sphere, builder.reflective(0.75f));
  builder.add(sphere, builder.reflective(0.25f, 0.5f), translation({1.0f, 0.0f, 0.0f}));
  // roughness 51/255 * 0.5, metallic 255/255 * 0.5
  const int texture = addTexture(builder, 1, 1, {0, 51, 255, 255});
  const int textured = builder.diffuse(Vec3(1.0f));
  scene::Material& m = builder.scene().materials[textured];
  m.metallicRoughnessTexture.texture = texture;
  m.metallicFactor = 0.5f;
  m.roughnessFactor = 0.5f;
  m.specularLevel = 0.52f;
  m.roughness = 0.1f;
  builder.add(plane(0.9f), textured, translation({2.0f, 0.0f, 0.0f}) * upright);
  Uploaded stage(builder.scene());
  const Shot shot(stage, front(6.5f));
  const float s[] = {-1.0f, 0.0f, 0.5f, 0.75f, 0.25f, 0.52f};
  const float g[] = {0.0f, 0.0f, 0.0f, 0.0f, 0.5f, 0.1f};
  const SampleClass classes[] = {SampleClass::Background,   SampleClass::Diffuse,
                                 SampleClass::PlanarMirror, SampleClass::CurvedMirror,
                                 SampleClass::Glossy,       SampleClass::Glossy};
  int seen[6] = {};
  for (std::size_t i = 0; i < kSamples; ++i) {
    const std::uint32_t id = shot.ids[i];
    ++seen[id];
    ASSERT_EQ(shot.stencil[i], static_cast<std::uint32_t>(classes[id])) << id;
    ASSERT_NEAR(shot.s(i), s[id], 1e-6f) << id;
    if (id > 1) {
      ASSERT_NEAR(shot.g(i), g[id], 1e-6f) << id;
    }
  }
  for (const int count : seen) EXPECT_GT(count, 20);
}

TEST(Raster, DepthTellsAMillimetreApartAtAKilometre) {
  // near / 1000 m = 1e-5 lies in [2^-17, 2^-16): a float's step there is 2^-40, which is 0.09 mm
  for (const float gap : {-0.001f, 0.001f}) {
    SceneBuilder builder;
    const scene::Mesh big = plane(100.0f);
    const Mat4 upright = rotation(90.0f, {1.0f, 0.0f, 0.0f});
    builder.add(big, builder.diffuse(Vec3(1.0f)), translation({0.0f, 0.0f, -1000.0f}) * upright);
    builder.add(big, builder.diffuse(Vec3(1.0f)),
                translation({0.0f, 0.0f, -1000.0f + gap}) * upright);
    Uploaded stage(builder.scene());
    scene::Camera camera = scene::lookAt(Vec3(0.0f), {0.0f, 0.0f, -1.0f}, kUp, 0.05f);
    const Shot shot(stage, camera);
    for (std::size_t i = 0; i < kSamples; ++i) {
      ASSERT_EQ(shot.ids[i], gap > 0.0f ? 2u : 1u);
      ASSERT_NEAR(camera.nearMetres / shot.depth[i], 1000.0f, 0.002f);
    }
  }
}

}  // namespace
}  // namespace catoptric::raster
