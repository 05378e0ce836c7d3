// Passes held against closed forms and each other: the composite's arithmetic, culling, updates,
// cube maps, memory and sizes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/error.h"
#include "raster/test_shots.h"

namespace catoptric::raster {
namespace {

using test::above;
using test::addTexture;
using test::front;
using test::kUp;
using test::plane;
using test::rotation;
using test::SceneBuilder;
using test::Shot;
using test::translation;
using test::Uploaded;

TEST(Raster, ClampedTexelsAreThoseAtTheLimitOfHalfFloatsOrBeyond) {
  constexpr std::uint16_t kMinusZero = 0x8000;
  constexpr std::uint16_t kMinusOne = 0xBC00;
  constexpr std::uint16_t kLargest = 0x7BFF;
  constexpr std::uint16_t kMinusInfinity = 0xFC00;
  constexpr std::uint16_t kNan = 0x7E00;
  const std::vector<std::uint16_t> texels{kMinusZero,
                                          kMinusOne,
                                          0,
                                          kLargest,  // alpha is no colour
                                          0,
                                          kLargest,
                                          0,
                                          0,  //
                                          0,
                                          0,
                                          kNan,
                                          0,  //
                                          kMinusInfinity,
                                          0,
                                          0,
                                          0};
  EXPECT_EQ(clampedTexels(texels), 3u);
}

TEST(Raster, CompositeIsItsFormula) {
  SceneBuilder builder;
  builder.add(plane(), builder.diffuse(Vec3(1.0f)));
  builder.add(plane(), builder.reflective(0.5f, 0.0f, Vec3(0.5f), Vec3(1.0f, 0.5f, 0.25f)));
  Uploaded stage(builder.scene());
  GBuffer buffer = stage.raster->makeGBuffer({2, 1, 2, false});
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
    stage.raster->composite(buffer, camera, {.fresnelSchlick = fresnel}, frame);
    gl::testContext().check("composite");
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
  EXPECT_TRUE(a.ids == b.ids);
  EXPECT_TRUE(a.depth == b.depth);
  EXPECT_TRUE(a.diffuse == b.diffuse);
  EXPECT_TRUE(a.normal == b.normal);
  EXPECT_TRUE(a.stencil == b.stencil);
}

TEST(Raster, CullingChangesNoPixel) {
  Uploaded culled(crowd());
  // The backs of what moves are drawn
  Uploaded whole(crowd(true));
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
  Uploaded followed(scene);
  const scene::Pose pose = scene::poseAt(scene, 0.6);
  const std::vector<int> changed = frame::updateGeometry(followed.geometry, scene, pose);
  EXPECT_THAT(changed, testing::ElementsAre(7));
  const scene::Camera camera = scene::lookAt({0.0f, 1.0f, 4.0f}, Vec3(0.0f), kUp, 0.9f);
  const Shot before(followed, camera);
  followed.raster->update(followed.geometry, changed);
  const Shot after(followed, camera);
  Uploaded fresh(scene, 0.6);
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
  Uploaded stage(builder.scene());
  const Vec3 centre(0.3f, -0.2f, 0.1f);
  constexpr int kSize = 16;
  const gl::Texture cube =
      stage.raster->drawCubeMap(centre, kSize, stage.lighting, ObjectSet::without({2}));
  gl::testContext().check("the cube map");
  const std::vector<float> texels = readRgba(cube);
  ASSERT_EQ(texels.size(), std::size_t{6 * kSize * kSize * 4});
  // A closed body about the centre does not show, named or not
  EXPECT_EQ(texels, readRgba(stage.raster->drawCubeMap(centre, kSize, stage.lighting)));
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
  Uploaded stage(builder.scene());
  constexpr std::size_t kSize = 4;
  const std::vector<float> texels =
      readRgba(stage.raster->drawCubeMap(Vec3(0.0f), kSize, stage.lighting));
  const std::size_t middle = kSize * kSize / 2 + kSize / 2;
  EXPECT_NEAR(texels[4 * (3 * kSize * kSize + middle)], 1.0f, 1e-3f);
  EXPECT_EQ(texels[4 * (2 * kSize * kSize + middle)], 0.0f);
}

TEST(Raster, MemoryIsThatOfVerticesIndicesAndTextures) {
  SceneBuilder builder;
  const int material = builder.diffuse(Vec3(1.0f));
  builder.add(scene::makeSphere(1.0f, 64, 32, scene::UvMode::Unit), material);
  Uploaded plain(builder.scene());
  const std::size_t needed =
      plain.geometry.vertexCount() * (sizeof(Vec3) + sizeof(frame::VertexAttributes)) +
      plain.geometry.indices.size() * sizeof(std::uint32_t);
  EXPECT_GE(plain.raster->memoryBytes(), needed);
  EXPECT_LT(plain.raster->memoryBytes(), needed + 8192);
  // 64 x 64 RGBA8 and its mip levels
  builder.scene().materials[material].baseColorTexture.texture =
      addTexture(builder, 64, 64, std::vector<std::uint8_t>(64 * 64 * 4, 99), false);
  Uploaded textured(builder.scene());
  EXPECT_EQ(textured.raster->memoryBytes() - plain.raster->memoryBytes(), 4u * 5461u);
}

TEST(Raster, SizesBeyondTheDeviceAreUsageErrors) {
  SceneBuilder builder;
  builder.add(plane(), builder.diffuse(Vec3(1.0f)));
  Uploaded stage(builder.scene());
  const int limit = gl::testContext().info().limits.maxTextureSize;
  EXPECT_THROW(stage.raster->makeGBuffer({limit + 1, 1, 1, false}), UsageError);
  EXPECT_THROW(stage.raster->makeGBuffer({1, limit / 2 + 1, 2, false}), UsageError);
  EXPECT_THROW(stage.raster->makeGBuffer({0, 8, 1, false}), UsageError);
  EXPECT_THROW(stage.raster->makeGBuffer({8, 8, 0, false}), UsageError);
  gl::testContext().check("refused sizes");  // no GL error is left behind
}

}  // namespace
}  // namespace catoptric::raster
