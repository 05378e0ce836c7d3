// What GL draws held against closed forms: spheres, planes, lights, textures, classes, precision,
// the composite's arithmetic, cube maps.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/error.h"
#include "frame/test_scenes.h"
#include "gl/test_context.h"
#include "raster/scene_raster.h"
#include "scene/animate.h"
#include "scene/texture.h"

namespace catoptric::raster {
namespace {

using test::rotation;
using test::SceneBuilder;
using test::translation;

constexpr int kWidth = 64;
constexpr int kHeight = 48;
constexpr std::size_t kSamples = std::size_t{kWidth} * kHeight;

/// A scene at one moment on the GL side.
struct Stage {
  explicit Stage(const scene::Scene& s, double seconds = 0.0)
      : context(gl::testContext()),
        scene(s),
        pose(scene::poseAt(s, seconds)),
        geometry(frame::makeGeometry(s, pose)),
        lighting(
            frame::makeLighting(s, pose, std::make_shared<frame::EnvironmentLight>(s.environment))),
        raster(s, geometry) {}
  gl::Context& context;
  const scene::Scene& scene;
  scene::Pose pose;
  frame::Geometry geometry;
  frame::Lighting lighting;
  SceneRaster raster;
};

/// A drawn G-buffer, read back.
struct Shot {
  Shot(Stage& stage, const scene::Camera& camera, int perAxis = 1)
      : eye(camera.eye()), samples(perAxis) {
    GBuffer target = stage.raster.makeGBuffer({kWidth, kHeight, perAxis, false});
    statistics = stage.raster.drawGBuffer(target, camera, stage.lighting);
    stage.context.check("the G-buffer");
    width = target.sampleWidth();
    diffuse = readRgba(target.diffuse);
    normal = readRgba(target.normal);
    id = readIds(target.object);
    depth = readDepth(target.depth);
    const std::vector<std::uint32_t> pairs =
        target.depth.read<std::uint32_t>(0, GL_DEPTH_STENCIL, GL_FLOAT_32_UNSIGNED_INT_24_8_REV, 2);
    for (std::size_t i = 1; i < pairs.size(); i += 2) stencil.push_back(pairs[i] & 0xFFu);
    for (std::size_t i = 0; i < id.size(); ++i) {
      const float scale = 1.0f / static_cast<float>(samples);
      direction.push_back(scene::rayDirection(camera, kWidth, kHeight,
                                              (static_cast<float>(i % width) + 0.5f) * scale,
                                              (static_cast<float>(i / width) + 0.5f) * scale));
      const float z = camera.nearMetres / depth[i];
      position.push_back(eye + direction[i] * (z / glm::dot(direction[i], camera.forward())));
    }
  }
  Vec3 radiance(std::size_t i) const {
    return {diffuse[4 * i], diffuse[4 * i + 1], diffuse[4 * i + 2]};
  }
  Vec3 n(std::size_t i) const { return {normal[4 * i], normal[4 * i + 1], normal[4 * i + 2]}; }
  float s(std::size_t i) const { return diffuse[4 * i + 3]; }
  float g(std::size_t i) const { return normal[4 * i + 3]; }

  Vec3 eye;
  int samples;
  std::size_t width = 0;
  DrawStatistics statistics;
  std::vector<float> diffuse, normal, depth;
  std::vector<std::uint32_t> id, stencil;
  std::vector<Vec3> direction, position;  ///< by the depth; nonsense on the background
};

const Vec3 kUp(0.0f, 1.0f, 0.0f);
constexpr float kFov = 0.8f;

scene::Camera front(float distance = 5.0f) {
  return scene::lookAt({0.0f, 0.0f, distance}, Vec3(0.0f), kUp, kFov);
}

/// A camera above a plane at y = 0, looking down at a slant.
scene::Camera above() {
  return scene::lookAt({0.3f, 1.5f, 2.0f}, Vec3(0.0f), kUp, kFov);
}

scene::Mesh plane(float size = 2.0f) {
  return scene::makePlane({size, size}, {1, 1}, scene::UvMode::Unit);
}

/// One texel everywhere.
int addTexture(SceneBuilder& builder, int width, int height, std::vector<std::uint8_t> rgba,
               bool nearest = true, bool srgb = false) {
  scene::Texture t;
  t.name = "texels";
  t.srgb = srgb;
  t.nearest = nearest;
  t.levels = scene::makeMipChain(width, height, std::move(rgba), srgb);
  builder.scene().textures.push_back(t);
  return static_cast<int>(builder.scene().textures.size()) - 1;
}

TEST(Raster, SphereHasItsDepthNormalsAndArea) {
  SceneBuilder builder;
  builder.add(scene::makeSphere(1.0f, 512, 256, scene::UvMode::Unit), builder.diffuse(Vec3(1.0f)));
  Stage stage(builder.scene());
  // Samples lie at ((i + .5) / 3, (j + .5) / 3): `direction` above says so
  const Shot shot(stage, front(), 3);
  std::size_t covered = 0;
  int compared = 0;
  for (std::size_t i = 0; i < shot.id.size(); ++i) {
    covered += shot.id[i] == 1 ? 1 : 0;
    const float b = -glm::dot(shot.eye, shot.direction[i]);
    const float root = b * b - (glm::dot(shot.eye, shot.eye) - 1.0f);
    if (root < 0.05f) continue;
    const Vec3 p = shot.eye + (b - std::sqrt(root)) * shot.direction[i];
    ASSERT_EQ(shot.id[i], 1u);
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
  Stage stage(builder.scene());
  const scene::Camera camera =
      below ? scene::lookAt({0.3f, -1.5f, 2.0f}, Vec3(0.0f), kUp, kFov) : above();
  const Shot shot(stage, camera);
  float largest = 0.0f;
  for (std::size_t i = 0; i < shot.id.size(); ++i) {
    if (shot.id[i] == 0) continue;
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
  Stage stage(builder.scene());
  const Shot shot(stage, above());
  for (std::size_t i = 0; i < kSamples; ++i) {
    if (shot.id[i] == 1) {
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
  Stage lit(builder.scene());
  const Shot cone(lit, above());
  int dark = 0;
  int full = 0;
  int between = 0;
  for (std::size_t i = 0; i < kSamples; ++i) {
    if (cone.id[i] == 0) continue;
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
  Stage stage(builder.scene());
  const Shot shot(stage, front());
  for (std::size_t i = 0; i < kSamples; ++i) {
    for (int c = 0; c < 3; ++c) ASSERT_NEAR(shot.radiance(i)[c], 1.0f, 1e-5f) << shot.id[i];
  }
  // Composited: 1 everywhere, and coverage where surfaces are
  GBuffer target = stage.raster.makeGBuffer({kWidth, kHeight, 2, false});
  stage.raster.drawGBuffer(target, front(), stage.lighting);
  gl::Texture frame = gl::Texture::make2D("frame", GL_RGBA32F, kWidth, kHeight);
  stage.raster.composite(target, front(), {}, frame);
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
  Stage stage(builder.scene());
  // normal (0, 1, 0), tangent +z, bitangent = cross(normal, tangent) = +x
  const Vec3 m = 2.0f * Vec3(204.0f, 128.0f, 230.0f) / 255.0f - 1.0f;
  const Vec3 bent = glm::normalize(Vec3(m.y, m.z, m.x));
  for (const float side : {1.0f, -1.0f}) {
    const Shot shot(stage, scene::lookAt({0.0f, 3.0f * side, 2.0f}, Vec3(0.0f), kUp, kFov));
    int seen[3] = {};
    for (std::size_t i = 0; i < kSamples; ++i) {
      ++seen[shot.id[i]];
      if (shot.id[i] == 1) {
        ASSERT_NEAR(shot.n(i).y, side, 1e-6f);
      }
      if (shot.id[i] == 2) {
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
  Stage stage(builder.scene());
  const scene::Camera camera = above();
  const Shot shot(stage, camera);
  const float spread = scene::pixelSpreadRad(camera, kHeight);
  float lowest = 100.0f;
  float highest = 0.0f;
  for (std::size_t i = 0; i < kSamples; ++i) {
    if (shot.id[i] == 0) continue;
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
  Stage stage(builder.scene());
  const Shot shot(stage, scene::lookAt({0.0f, 7.0f, 0.5f}, Vec3(0.0f), kUp, kFov));
  int seen[4] = {};
  for (std::size_t i = 0; i < kSamples; ++i) {
    ++seen[shot.id[i]];
    const Vec3 p = shot.eye - shot.direction[i] * (shot.eye.y / shot.direction[i].y);
    const auto colour = [&](float x) {
      return Vec3(0.5f + 0.25f * (p.x - x), 0.5f + 0.25f * p.z, 1.0f);
    };
    Vec3 expected(2.0f);  // the environment
    if (shot.id[i] == 1) expected = 2.0f * colour(-2.1f);
    if (shot.id[i] == 2) expected = 0.5f * colour(0.0f);
    if (shot.id[i] == 3) expected = Vec3(0.0f, 0.0f, 2.0f * 102.0f / 255.0f);
    ASSERT_LT(glm::length(shot.radiance(i) - expected), 1e-4f) << shot.id[i];
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
  Stage stage(builder.scene());
  const Shot shot(stage, front());
  int left = 0;
  int right = 0;
  for (std::size_t i = 0; i < kSamples; ++i) {
    const Vec3 p = shot.direction[i] * (5.0f / -shot.direction[i].z);
    if (std::abs(std::abs(p.x) - 0.5f) > 0.45f || std::abs(p.y) > 0.95f) continue;
    (p.x < 0.0f ? left : right) += shot.id[i] == 1 ? 1 : 0;
    ASSERT_EQ(shot.id[i], p.x < 0.0f ? 0u : 1u);
    ASSERT_EQ(shot.depth[i] > 0.0f, shot.id[i] == 1);
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
  builder.add(plane(0.9f), textured, translation({2.0f, 0.0f, 0.0f}) * upright);
  Stage stage(builder.scene());
  const Shot shot(stage, front(6.5f));
  const float s[] = {-1.0f, 0.0f, 0.5f, 0.75f, 0.25f, 0.52f};
  const float g[] = {0.0f, 0.0f, 0.0f, 0.0f, 0.5f, 0.1f};
  const SampleClass classes[] = {SampleClass::Background,   SampleClass::Diffuse,
                                 SampleClass::PlanarMirror, SampleClass::CurvedMirror,
                                 SampleClass::Glossy,       SampleClass::Glossy};
  int seen[6] = {};
  for (std::size_t i = 0; i < kSamples; ++i) {
    const std::uint32_t id = shot.id[i];
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
    Stage stage(builder.scene());
    scene::Camera camera = scene::lookAt(Vec3(0.0f), {0.0f, 0.0f, -1.0f}, kUp, 0.05f);
    const Shot shot(stage, camera);
    for (std::size_t i = 0; i < kSamples; ++i) {
      ASSERT_EQ(shot.id[i], gap > 0.0f ? 2u : 1u);
      ASSERT_NEAR(camera.nearMetres / shot.depth[i], 1000.0f, 0.002f);
    }
  }
}

TEST(Raster, CompositeIsItsFormula) {
  SceneBuilder builder;
  builder.add(plane(), builder.diffuse(Vec3(1.0f)));
  builder.add(plane(), builder.reflective(0.5f, 0.0f, Vec3(0.5f), Vec3(1.0f, 0.5f, 0.25f)));
  Stage stage(builder.scene());
  GBuffer buffer = stage.raster.makeGBuffer({2, 1, 2, false});
  // Left pixel: background, diffuse, two mirrors; right pixel: four mirrors (dyadic numbers)
  const std::vector<float> diffuse{1, 2, 4, -1, 8, 4, 2, 0,    1, 1, 1, 0.5f, 2, 2, 2, 0.25f,
                                   4, 4, 4, 1,  2, 4, 8, 0.5f, 1, 1, 1, 0.5f, 2, 2, 2, 0.25f};
  const std::vector<float> reflected{16, 16, 16, 1, 16, 16, 16, 1, 8, 8, 8, 1, 4, 4, 4, 1,
                                     16, 8,  4,  1, 0,  0,  0,  1, 8, 8, 8, 1, 4, 4, 4, 1};
  // Rows are 4 samples wide: the left pixel has samples 0, 1, 4, 5
  const std::vector<std::uint32_t> ids{0, 1, 2, 2, 2, 2, 2, 2};
  std::vector<float> normals;
  for (int i = 0; i < 8; ++i) normals.insert(normals.end(), {0.0f, 0.0f, 1.0f, 0.0f});
  buffer.diffuse.upload(0, 0, GL_RGBA, GL_FLOAT, diffuse.data());
  buffer.reflection.upload(0, 0, GL_RGBA, GL_FLOAT, reflected.data());
  buffer.object.upload(0, 0, GL_RED_INTEGER, GL_UNSIGNED_INT, ids.data());
  buffer.normal.upload(0, 0, GL_RGBA, GL_FLOAT, normals.data());
  const scene::Camera camera = front();
  const Vec3 tint(1.0f, 0.5f, 0.25f);
  for (const bool fresnel : {false, true}) {
    gl::Texture frame = gl::Texture::make2D("frame", GL_RGBA32F, 2, 1);
    stage.raster.composite(buffer, camera, {.fresnelSchlick = fresnel}, frame);
    stage.context.check("composite");
    const std::vector<float> pixels = readRgba(frame);
    for (std::size_t pixel = 0; pixel < 2; ++pixel) {
      Vec3 sum(0.0f);
      float covered = 0.0f;
      for (const std::size_t k : {std::size_t{0}, std::size_t{1}, std::size_t{4}, std::size_t{5}}) {
        const std::size_t i = 2 * pixel + k;
        const Vec3 d(diffuse[4 * i], diffuse[4 * i + 1], diffuse[4 * i + 2]);
        const Vec3 r(reflected[4 * i], reflected[4 * i + 1], reflected[4 * i + 2]);
        float s = diffuse[4 * i + 3];
        if (fresnel && s > 0.0f) {
          const Vec3 ray = scene::rayDirection(camera, 2, 1, (static_cast<float>(i % 4) + 0.5f) / 2,
                                               (static_cast<float>(i / 4) + 0.5f) / 2);
          s += (1.0f - s) * std::pow(1.0f + ray.z, 5.0f);
        }
        sum += s > 0.0f ? (1.0f - s) * d + s * tint * r : d;
        covered += ids[i] != 0 ? 1.0f : 0.0f;
      }
      for (int c = 0; c < 3; ++c) {
        if (fresnel) {
          EXPECT_NEAR(pixels[4 * pixel + c], 0.25f * sum[c], 1e-5f);
        } else {
          EXPECT_EQ(pixels[4 * pixel + c], 0.25f * sum[c]);
        }
      }
      EXPECT_EQ(pixels[4 * pixel + 3], 0.25f * covered);
    }
  }
}

/// Closed shapes about the camera's way, some behind others, one moving; `all`: the spheres
/// by nothing.
scene::Scene crowd(bool all = false) {
  SceneBuilder builder;
  builder.constantEnvironment(Vec3(0.7f, 0.8f, 0.9f));
  scene::Light light;
  light.position = {1.0f, 3.0f, 2.0f};
  light.intensity = Vec3(9.0f);
  builder.scene().lights.push_back(light);
  const int red = builder.diffuse(Vec3(0.8f, 0.2f, 0.1f));
  const int mirror = builder.reflective(0.5f);
  for (int i = 0; i < 6; ++i) {
    const float angle = static_cast<float>(i) * kPi / 3.0f;
    builder.add(scene::makeSphere(0.5f, 96, 48, scene::UvMode::Unit), i % 2 == 0 ? red : mirror,
                translation({1.2f * std::cos(angle), 0.3f * std::sin(3.0f * angle),
                             1.2f * std::sin(angle)}));
  }
  builder.add(scene::makeTorus(0.7f, 0.2f, 96, 48, scene::UvMode::Unit), mirror,
              rotation(70.0f, {1.0f, 0.0f, 0.3f}));
  scene::BoxShape box;
  box.size = Vec3(0.4f);
  builder.move(builder.add(scene::makeBox(box, scene::UvMode::Unit), red), {0.5f, 0.2f, 0.3f},
               1.0f);
  for (int i = 0; all && i < 6; ++i) builder.move(i, Vec3(0.0f), 1.0f);
  return builder.scene();
}

void expectSame(const Shot& a, const Shot& b) {
  EXPECT_TRUE(a.id == b.id);
  EXPECT_TRUE(a.depth == b.depth);
  EXPECT_TRUE(a.diffuse == b.diffuse);
  EXPECT_TRUE(a.normal == b.normal);
  EXPECT_TRUE(a.stencil == b.stencil);
}

TEST(Raster, CullingChangesNoPixel) {
  Stage culled(crowd());
  // The backs of what moves are drawn
  Stage whole(crowd(true));
  // From outside, from between the shapes, and from inside of a sphere
  for (const Vec3& eye : {Vec3(0.0f, 1.0f, 4.0f), Vec3(0.0f, 0.1f, 0.1f), Vec3(1.2f, 0.1f, 0.0f)}) {
    const scene::Camera camera = scene::lookAt(eye, {0.2f, 0.0f, -1.0f}, kUp, 1.0f);
    const Shot a(culled, camera);
    const Shot b(whole, camera);
    expectSame(a, b);
    EXPECT_LT(a.statistics.triangles, b.statistics.triangles);
    EXPECT_EQ(a.statistics.triangles + a.statistics.culledTriangles,
              b.statistics.triangles + b.statistics.culledTriangles);
    // ... and the same pixels twice
    expectSame(a, Shot(culled, camera));
  }
}

TEST(Raster, UpdatesEqualAFreshStart) {
  const scene::Scene scene = crowd();
  Stage followed(scene);
  const scene::Pose pose = scene::poseAt(scene, 0.6);
  const std::vector<int> changed = frame::updateGeometry(followed.geometry, scene, pose);
  EXPECT_THAT(changed, testing::ElementsAre(7));
  const scene::Camera camera = scene::lookAt({0.0f, 1.0f, 4.0f}, Vec3(0.0f), kUp, 0.9f);
  const Shot before(followed, camera);
  followed.raster.update(followed.geometry, changed);
  const Shot after(followed, camera);
  Stage fresh(scene, 0.6);
  expectSame(after, Shot(fresh, camera));
  EXPECT_FALSE(before.depth == after.depth);
}

TEST(Raster, CubeMapsSeeAlongTheirTexelsDirections) {
  // A room whose walls show their position as a colour
  SceneBuilder builder;
  scene::BoxShape box;
  box.size = Vec3(2.0f);
  box.inward = true;
  scene::Mesh room = scene::makeBox(box, scene::UvMode::Unit);
  for (const Vec3& p : room.positions) room.colors.push_back(0.5f + 0.5f * p);
  const int material = builder.diffuse(Vec3(1.0f));
  builder.scene().materials[material].unlit = true;
  builder.add(room, material);
  // Something in the way that is left out
  builder.add(scene::makeSphere(0.2f, 16, 8, scene::UvMode::Unit), builder.diffuse(Vec3(0.0f)),
              translation({0.3f, -0.2f, 0.1f}));
  Stage stage(builder.scene());
  const Vec3 centre(0.3f, -0.2f, 0.1f);
  constexpr int kSize = 16;
  const gl::Texture cube =
      stage.raster.drawCubeMap(centre, kSize, stage.lighting, ObjectSet::without({2}));
  stage.context.check("the cube map");
  const std::vector<float> texels = readRgba(cube);
  ASSERT_EQ(texels.size(), std::size_t{6 * kSize * kSize * 4});
  // A closed body about the centre does not show, named or not
  EXPECT_EQ(texels, readRgba(stage.raster.drawCubeMap(centre, kSize, stage.lighting)));
  for (int face = 0; face < 6; ++face) {
    for (int y = 0; y < kSize; ++y) {
      for (int x = 0; x < kSize; ++x) {
        // GL 4.5, table 8.19
        const float s = (2.0f * static_cast<float>(x) + 1.0f) / kSize - 1.0f;
        const float t = (2.0f * static_cast<float>(y) + 1.0f) / kSize - 1.0f;
        const Vec3 directions[] = {{1, -t, -s}, {-1, -t, s}, {s, 1, t},
                                   {s, -1, -t}, {s, -t, 1},  {-s, -t, -1}};
        const Vec3 d = directions[face];
        float reach = 1e9f;
        for (int a = 0; a < 3; ++a) {
          if (d[a] != 0.0f) reach = std::min(reach, ((d[a] > 0 ? 1.0f : -1.0f) - centre[a]) / d[a]);
        }
        const Vec3 expected = 0.5f + 0.5f * (centre + reach * d);
        const std::size_t i = 4 * static_cast<std::size_t>((face * kSize + y) * kSize + x);
        const Vec3 drawn(texels[i], texels[i + 1], texels[i + 2]);
        ASSERT_LT(glm::length(drawn - expected), 2e-3f) << face << " " << x << " " << y;
        ASSERT_EQ(texels[i + 3], 1.0f);
      }
    }
  }
}

TEST(Raster, CubeMapsShowTheLitSides) {
  // A sun from above: the floor below the centre is lit, the ceiling above it is dark
  SceneBuilder builder;
  const int white = builder.diffuse(Vec3(1.0f));
  builder.add(plane(), white, translation({0.0f, -1.0f, 0.0f}));
  builder.add(plane(), white, translation({0.0f, 1.0f, 0.0f}));
  scene::Light sun;
  sun.type = scene::LightType::Directional;
  sun.intensity = Vec3(kPi);
  builder.scene().lights.push_back(sun);
  Stage stage(builder.scene());
  constexpr std::size_t kSize = 4;
  const std::vector<float> texels =
      readRgba(stage.raster.drawCubeMap(Vec3(0.0f), kSize, stage.lighting));
  const std::size_t middle = kSize * kSize / 2 + kSize / 2;
  EXPECT_NEAR(texels[4 * (3 * kSize * kSize + middle)], 1.0f, 1e-3f);
  EXPECT_EQ(texels[4 * (2 * kSize * kSize + middle)], 0.0f);
}

TEST(Raster, MemoryIsThatOfVerticesIndicesAndTextures) {
  SceneBuilder builder;
  const int material = builder.diffuse(Vec3(1.0f));
  builder.add(scene::makeSphere(1.0f, 64, 32, scene::UvMode::Unit), material);
  Stage plain(builder.scene());
  const std::size_t needed =
      plain.geometry.vertexCount() * (sizeof(Vec3) + sizeof(frame::VertexAttributes)) +
      plain.geometry.indices.size() * sizeof(std::uint32_t);
  EXPECT_GE(plain.raster.memoryBytes(), needed);
  EXPECT_LT(plain.raster.memoryBytes(), needed + 8192);
  // 64 x 64 RGBA8 and its mip levels
  builder.scene().materials[material].baseColorTexture.texture =
      addTexture(builder, 64, 64, std::vector<std::uint8_t>(64 * 64 * 4, 99), false);
  Stage textured(builder.scene());
  EXPECT_EQ(textured.raster.memoryBytes() - plain.raster.memoryBytes(), 4u * 5461u);
}

TEST(Raster, SizesBeyondTheDeviceAreUsageErrors) {
  SceneBuilder builder;
  builder.add(plane(), builder.diffuse(Vec3(1.0f)));
  Stage stage(builder.scene());
  const int limit = stage.context.info().limits.maxTextureSize;
  EXPECT_THROW(stage.raster.makeGBuffer({limit + 1, 1, 1, false}), UsageError);
  EXPECT_THROW(stage.raster.makeGBuffer({1, limit / 2 + 1, 2, false}), UsageError);
  EXPECT_THROW(stage.raster.makeGBuffer({0, 8, 1, false}), UsageError);
  EXPECT_THROW(stage.raster.makeGBuffer({8, 8, 0, false}), UsageError);
  stage.context.check("refused sizes");  // no GL error is left behind
}

}  // namespace
}  // namespace catoptric::raster
