// Draws of sets of objects with chosen outputs, held against draws of the whole scene.
#include <gtest/gtest.h>

#include "core/error.h"
#include "raster/constants.h"
#include "raster/test_shots.h"
#include "scene/reflectance.h"

namespace catoptric::raster {
namespace {

using test::kHeight;
using test::kSamples;
using test::kWidth;
using test::SceneBuilder;
using test::translation;
using test::Uploaded;

TEST(Constants, OfShadersAreThoseOfTheScene) {
  EXPECT_EQ(shared::kReflectiveThreshold, scene::kReflectiveThreshold);
}

TEST(ObjectSet, HasWhatItIsMadeOf) {
  const ObjectSet all;
  const ObjectSet some = ObjectSet::only({5, 2});
  const ObjectSet others = ObjectSet::without({5, 2});
  for (int id = 1; id < 8; ++id) {
    const bool named = id == 5 || id == 2;
    EXPECT_TRUE(all.has(id));
    EXPECT_EQ(some.has(id), named);
    EXPECT_EQ(others.has(id), !named);
  }
  EXPECT_FALSE(ObjectSet::only({}).has(1));
}

/// A wall behind a sphere with a normal map, a glossy torus and an unlit plane.
scene::Scene shelf() {
  SceneBuilder builder;
  builder.constantEnvironment(Vec3(0.5f, 0.7f, 1.0f));
  const int wall = builder.diffuse(Vec3(0.7f, 0.68f, 0.6f));
  const int mapped = builder.diffuse(Vec3(0.8f, 0.2f, 0.1f));
  const int glossy = builder.reflective(0.6f, 0.3f);
  const int unlit = builder.diffuse(Vec3(0.3f, 0.9f, 0.4f));
  builder.scene().materials[unlit].unlit = true;
  builder.scene().materials[mapped].normalTexture.texture =
      test::addTexture(builder, 1, 1, {204, 128, 230, 255});
  builder.add(test::plane(8.0f), wall, translation({0.0f, 0.0f, -2.0f}) * test::facingZ());
  builder.add(scene::makeSphere(0.8f, 64, 32, scene::UvMode::Unit), mapped,
              translation({-0.9f, 0.0f, 0.0f}));
  builder.add(scene::makeTorus(0.6f, 0.2f, 64, 16, scene::UvMode::Unit), glossy,
              translation({0.6f, 0.1f, 0.2f}));
  builder.add(test::plane(0.7f), unlit, translation({1.2f, -0.6f, 0.6f}) * test::facingZ());
  return builder.scene();
}

/// Targets of a draw with all outputs, cleared.
struct Outputs {
  gl::Texture radiance = gl::Texture::make2D("radiance", GL_RGBA32F, kWidth, kHeight);
  gl::Texture normal = gl::Texture::make2D("normal", GL_RGBA32F, kWidth, kHeight);
  gl::Texture specular = gl::Texture::make2D("s and g", GL_RGBA32F, kWidth, kHeight);
  gl::Texture depth = gl::Texture::make2D("depth", GL_DEPTH_COMPONENT32F, kWidth, kHeight);

  void clear(const gl::Framebuffer& target, int colors) {
    target.bind();
    target.clearDepth(0.0f);
    for (int i = 0; i < colors; ++i) target.clearColor(i, 0.0f, 0.0f, 0.0f, 0.0f);
  }
};

void draw(Uploaded& world, const scene::Camera& camera, const DiffuseDraw& what) {
  const float aspect = static_cast<float>(kWidth) / kHeight;
  world.raster->drawDiffuse(scene::clipFromCamera(camera, aspect) * scene::cameraFromWorld(camera),
                            camera.eye(), scene::pixelSpreadRad(camera, kHeight), world.lighting,
                            what);
  gl::checkErrors("drawDiffuse");
}

TEST(DiffuseDraw, ASetDrawnAloneIsThePartOfTheWholeThatItShows) {
  Uploaded world(shelf());
  const scene::Camera camera = test::front();
  const test::Samples whole = test::drawSamples(world, camera, {kWidth, kHeight, 1, false});
  for (const int alone : {1, 2, 3, 4}) {
    Outputs out;
    const gl::Framebuffer target(
        "set", {{.texture = out.radiance}, {.texture = out.normal}, {.texture = out.specular}},
        {.texture = out.depth});
    out.clear(target, 3);
    draw(world, camera,
         {.objects = ObjectSet::only({alone}),
          .outputs = {.radiance = true, .normal = true, .specular = true},
          .background = false});
    const std::vector<float> radiance = readRgba(out.radiance);
    const std::vector<float> normal = readRgba(out.normal);
    const std::vector<float> specular = readRgba(out.specular);
    const std::vector<float> depth = readDepth(out.depth);
    std::size_t shown = 0;
    std::size_t hidden = 0;
    for (std::size_t i = 0; i < kSamples; ++i) {
      const float alpha = depth[i] > 0.0f ? 1.0f : 0.0f;
      ASSERT_EQ(radiance[4 * i + 3], alpha);
      ASSERT_EQ(normal[4 * i + 3], alpha);
      ASSERT_EQ(specular[4 * i + 3], alpha);
      if (whole.ids[i] != static_cast<std::uint32_t>(alone)) {
        hidden += alpha > 0.0f ? 1 : 0;
        ASSERT_LE(depth[i], whole.depth[i]) << "in front of what the whole shows";
        continue;
      }
      ++shown;
      ASSERT_EQ(depth[i], whole.depth[i]);
      for (std::size_t c = 0; c < 3; ++c) {
        ASSERT_EQ(radiance[4 * i + c], whole.diffuse[4 * i + c]) << alone;
        // The G-buffer has normals of reflections
        if (isBent(whole.normal[4 * i + 3])) continue;
        ASSERT_EQ(normal[4 * i + c], whole.normal[4 * i + c]) << alone;
      }
      ASSERT_EQ(specular[4 * i], whole.s(i));
      ASSERT_NEAR(specular[4 * i + 1], whole.g(i), 1e-6f);
    }
    EXPECT_GT(shown, 50u) << alone;
    if (alone == 1) {
      EXPECT_GT(hidden, 50u);
    }
  }
}

TEST(DiffuseDraw, OutputsGoToColoursInOrderAndChangeNoOther) {
  Uploaded world(shelf());
  const scene::Camera camera = test::front();
  Outputs all;
  const gl::Framebuffer three(
      "three", {{.texture = all.radiance}, {.texture = all.normal}, {.texture = all.specular}},
      {.texture = all.depth});
  all.clear(three, 3);
  draw(world, camera,
       {.outputs = {.radiance = true, .normal = true, .specular = true}, .background = false});
  Outputs some;
  const gl::Framebuffer two("two", {{.texture = some.normal}, {.texture = some.specular}},
                            {.texture = some.depth});
  some.clear(two, 2);
  draw(world, camera,
       {.outputs = {.radiance = false, .normal = true, .specular = true}, .background = false});
  EXPECT_EQ(readRgba(all.normal), readRgba(some.normal));
  EXPECT_EQ(readRgba(all.specular), readRgba(some.specular));
  EXPECT_EQ(readDepth(all.depth), readDepth(some.depth));
}

TEST(DiffuseDraw, SetsAreJoinedAsTheWholeIs) {
  Uploaded world(shelf());
  const scene::Camera camera = test::front();
  Outputs whole;
  Outputs joined;
  for (Outputs* out : {&whole, &joined}) {
    const gl::Framebuffer target("radiance", {{.texture = out->radiance}}, {.texture = out->depth});
    out->clear(target, 1);
    if (out == &whole) {
      draw(world, camera, {.background = false});
    } else {
      draw(world, camera, {.objects = ObjectSet::only({2, 4}), .background = false});
      draw(world, camera, {.objects = ObjectSet::without({2, 4}), .background = false});
    }
  }
  EXPECT_EQ(readRgba(whole.radiance), readRgba(joined.radiance));
  EXPECT_EQ(readDepth(whole.depth), readDepth(joined.depth));
}

TEST(DiffuseDraw, ABackgroundHasRadianceAlone) {
  Uploaded world(shelf());
  EXPECT_THROW(draw(world, test::front(), {.outputs = {.normal = true}}), Error);
}

}  // namespace
}  // namespace catoptric::raster
