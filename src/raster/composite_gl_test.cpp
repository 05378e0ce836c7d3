// The composite's arithmetic on made-up samples, in numbers that floats hold exactly.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/error.h"
#include "raster/test_support.h"

namespace catoptric {
namespace {

using test::SceneBuilder;
using test::Uploaded;

/// Two pixels by one, 2x2 samples each.
struct Fixture {
  Uploaded world;
  raster::GBuffer g;
  gl::Texture frame = gl::Texture::make2D("frame", GL_RGBA32F, 2, 1);
  scene::Camera camera = scene::lookAt({0, 0, 1}, Vec3(0.0f), {0, 1, 0}, 0.8f);

  static scene::Scene scene(const Vec3& tint) {
    SceneBuilder builder;
    builder.add(scene::makePlane({1, 1}, {1, 1}, scene::UvMode::Unit), builder.diffuse(Vec3(1.0f)));
    builder.add(scene::makePlane({1, 1}, {1, 1}, scene::UvMode::Unit),
                builder.reflective(0.5f, 0.0f, Vec3(0.5f), tint));
    return builder.scene();
  }
  explicit Fixture(const Vec3& tint)
      : world(scene(tint)), g(world.raster->makeGBuffer({2, 1, 2})) {}

  std::vector<float> composite(const std::vector<Vec4>& diffuse,
                               const std::vector<Vec4>& reflection,
                               const std::vector<std::uint32_t>& ids,
                               const std::vector<Vec4>& normals = {}, bool fresnel = false) {
    g.diffuse.upload(0, 0, GL_RGBA, GL_FLOAT, diffuse.data());
    g.reflection.upload(0, 0, GL_RGBA, GL_FLOAT, reflection.data());
    g.object.upload(0, 0, GL_RED_INTEGER, GL_UNSIGNED_INT, ids.data());
    if (!normals.empty()) g.normal.upload(0, 0, GL_RGBA, GL_FLOAT, normals.data());
    raster::CompositeOptions options;
    options.fresnelSchlick = fresnel;
    world.raster->composite(g, camera, options, frame);
    gl::checkErrors("composite");
    return raster::readRgba(frame);
  }
};

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

TEST(Composite, MeanOfDiffuseAndReflectionByS) {
  Fixture f(Vec3(1.0f, 0.5f, 0.25f));
  // Rows of samples: y = 0 holds the upper samples of both pixels
  const std::vector<Vec4> diffuse = {{1, 1, 1, 0},  {2, 4, 8, 0.5f},  {1, 2, 3, -1},
                                     {1, 2, 3, -1}, {4, 4, 4, 0.25f}, {8, 8, 8, 1.0f},
                                     {1, 2, 3, -1}, {5, 6, 7, 0}};
  const std::vector<Vec4> reflection = {{kNan, kNan, kNan, 0}, {16, 16, 16, 1}, {kNan, 0, 0, 0},
                                        {kNan, 0, 0, 0},       {8, 16, 32, 1},  {4, 8, 16, 1},
                                        {0, 0, 0, 0},          {0, 0, 0, 0}};
  const std::vector<std::uint32_t> ids = {1, 2, 0, 0, 2, 2, 0, 1};
  const std::vector<float> frame = f.composite(diffuse, reflection, ids);
  // (1 - s) diffuse + s tint reflection per sample, a quarter of the sum
  const Vec3 sums[4] = {{1, 1, 1}, {1 + 8, 2 + 4, 4 + 2}, {3 + 2, 3 + 2, 3 + 2}, {4, 4, 4}};
  for (int c = 0; c < 3; ++c) {
    EXPECT_EQ(frame[c], (sums[0][c] + sums[1][c] + sums[2][c] + sums[3][c]) / 4.0f) << c;
  }
  EXPECT_EQ(frame[3], 1.0f);
  // Background shows its radiance and does not count as covered
  EXPECT_EQ(frame[4], (1 + 1 + 1 + 5) / 4.0f);
  EXPECT_EQ(frame[5], (2 + 2 + 2 + 6) / 4.0f);
  EXPECT_EQ(frame[6], (3 + 3 + 3 + 7) / 4.0f);
  EXPECT_EQ(frame[7], 0.25f);
}

TEST(Composite, UntintedScenesGiveTheSame) {
  Fixture f(Vec3(1.0f));
  const std::vector<Vec4> diffuse(8, Vec4(2, 4, 8, 0.5f));
  const std::vector<Vec4> reflection(8, Vec4(6, 2, 0, 1));
  const std::vector<float> frame =
      f.composite(diffuse, reflection, std::vector<std::uint32_t>(8, 2));
  EXPECT_EQ(frame[0], 4.0f);
  EXPECT_EQ(frame[1], 3.0f);
  EXPECT_EQ(frame[2], 4.0f);
}

TEST(Composite, FresnelBySchlick) {
  Fixture f(Vec3(1.0f));
  const std::vector<Vec4> diffuse(8, Vec4(0, 0, 0, 0.25f));
  const std::vector<Vec4> reflection(8, Vec4(1, 1, 1, 1));
  // Normals with a given cosine to each sample's view direction
  for (const float cosine : {1.0f, 0.5f, 0.0f}) {
    std::vector<Vec4> normals;
    for (int y = 0; y < 2; ++y) {
      for (int x = 0; x < 4; ++x) {
        const Vec3 d = scene::rayDirection(f.camera, 4, 2, static_cast<float>(x) + 0.5f,
                                           static_cast<float>(y) + 0.5f);
        const Vec3 side = glm::normalize(glm::cross(d, Vec3(0.0f, 1.0f, 0.0f)));
        normals.emplace_back(-cosine * d + std::sqrt(1.0f - cosine * cosine) * side, 0.0f);
      }
    }
    const std::vector<float> frame =
        f.composite(diffuse, reflection, std::vector<std::uint32_t>(8, 2), normals, true);
    const float expected = 0.25f + 0.75f * std::pow(1.0f - cosine, 5.0f);
    EXPECT_NEAR(frame[0], expected, 2e-6f) << cosine;
    EXPECT_NEAR(frame[4], expected, 2e-6f) << cosine;
  }
}

TEST(Composite, FrameOfAnotherSizeIsABug) {
  Fixture f(Vec3(1.0f));
  gl::Texture wrong = gl::Texture::make2D("frame", GL_RGBA32F, 4, 1);
  EXPECT_THROW(f.world.raster->composite(f.g, f.camera, {}, wrong), Error);
}

}  // namespace
}  // namespace catoptric
