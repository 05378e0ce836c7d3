// Baked and ambient light, backgrounds, uv sets, sRGB, and the diffuse pass. Lights, normal maps
// and mip levels: surfaces_gl_test.cpp.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "frame/test_environment.h"
#include "raster/test_support.h"

namespace catoptric {
namespace {

using test::cameraAt;
using test::drawSamples;
using test::levelsTexture;
using test::rotation;
using test::Samples;
using test::SceneBuilder;
using test::translation;
using test::Uploaded;

constexpr int kImageSize = 96;

/// A plane facing +z of one material, `size` metres wide, uv in metres or 0..1.
int addPlane(SceneBuilder& builder, int material, float size, scene::UvMode uv) {
  return builder.add(scene::makePlane({size, size}, {1, 1}, uv), material, test::facingZ());
}

TEST(Shading, BakedAndAmbientLight) {
  // L = albedo / pi * (bake + visibility * (E_sky + pi ambient))
  SceneBuilder builder;
  builder.constantEnvironment(Vec3(0.5f));
  builder.scene().ambient = Vec3(0.25f, 0.5f, 1.0f);
  const int plane = addPlane(builder, builder.diffuse(Vec3(0.5f)), 20.0f, scene::UvMode::Unit);
  Uploaded world(builder.scene());
  const Vec4 bake(1.0f, 2.0f, 3.0f, 0.75f);
  for (frame::VertexAttributes& v : world.geometry.attributes) v.bake = bake;
  const int changed[] = {plane};
  world.raster->update(world.geometry, changed);
  const Samples samples =
      drawSamples(world, cameraAt({0.0f, 0.0f, 4.0f}, Vec3(0.0f)), {8, 8, 1, false});
  for (int c = 0; c < 3; ++c) {
    const float expected = 0.5f / kPi * (bake[c] + 0.75f * kPi * (0.5f + world.scene.ambient[c]));
    EXPECT_NEAR(samples.radiance(20)[c] / expected, 1.0f, 1e-5f);
  }
}

TEST(Shading, BackgroundIsTheEnvironmentAlongEachRay) {
  for (const scene::EnvironmentType type :
       {scene::EnvironmentType::Constant, scene::EnvironmentType::Gradient,
        scene::EnvironmentType::File}) {
    SceneBuilder builder;
    scene::Environment& e = builder.scene().environment;
    e.type = type;
    const bool isFile = type == scene::EnvironmentType::File;
    if (isFile) {
      e.file = test::writeEnvironment("catoptric_round.exr", 16, 8, [](const Vec3& d) {
        return 0.5f + 0.5f * Vec3(d.x, d.y, d.z);
      });
      e.rotationRad = 0.3f;
    }
    e.color = {0.1f, 0.3f, 0.9f};
    e.horizon = Vec3(1.0f);
    e.ground = {0.3f, 0.2f, 0.1f};
    e.scale = 2.0f;
    builder.add(scene::makeSphere(0.3f, 16, 8, scene::UvMode::Unit), builder.diffuse(Vec3(0.0f)));
    Uploaded world(builder.scene());
    // The ends of the image meet towards +z
    const scene::Camera camera = cameraAt({0.5f, 1.0f, isFile ? -4.0f : 4.0f}, Vec3(0.0f), 1.6f);
    const Samples samples = drawSamples(world, camera, {kImageSize, kImageSize / 2, 1, false});
    for (int y = 0; y < samples.height; ++y) {
      for (int x = 0; x < samples.width; ++x) {
        if (samples.ids[samples.at(x, y)] != 0) continue;
        const Vec3 expected = world.lighting.environment->radiance(
            scene::rayDirection(camera, samples.width, samples.height, static_cast<float>(x) + 0.5f,
                                static_cast<float>(y) + 0.5f));
        ASSERT_LT(glm::distance(samples.radiance(samples.at(x, y)), expected),
                  isFile ? 0.02f : 1e-5f)
            << x << ' ' << y;
      }
    }
  }
}

/// A 2 x 2 texture: red, green / blue, white (rows from the top).
scene::Texture quadrants() {
  scene::Texture texture;
  texture.srgb = false;
  texture.nearest = true;
  texture.levels.push_back(
      {2, 2, {255, 0, 0, 255, 0, 255, 0, 255, 0, 0, 255, 255, 255, 255, 255, 0}});
  return texture;
}

TEST(Shading, TextureTransformAndSecondUvSet) {
  // A constant uv per vertex in set 1, moved by the slot's transform
  for (const int set : {0, 1}) {
    SceneBuilder builder;
    builder.scene().textures.push_back(quadrants());
    const int material = builder.diffuse(Vec3(1.0f));
    scene::Material& m = builder.scene().materials[material];
    m.unlit = true;
    m.baseColorTexture.texture = 0;
    m.baseColorTexture.uvSet = set;
    m.baseColorTexture.transform = glm::mat3x2(0.5f, 0.0f, 0.0f, 0.5f, 0.5f, 0.25f);
    scene::Mesh mesh = scene::makePlane({20.0f, 20.0f}, {1, 1}, scene::UvMode::Unit);
    mesh.uv[0].assign(mesh.positions.size(), Vec2(0.25f, 0.25f));  // -> (0.625, 0.375): green
    mesh.uv[1].assign(mesh.positions.size(), Vec2(-0.5f, 0.8f));   // -> (0.25, 0.65): blue
    builder.add(mesh, material, test::facingZ());
    Uploaded world(builder.scene());
    const Samples samples =
        drawSamples(world, cameraAt({0.0f, 0.0f, 4.0f}, Vec3(0.0f)), {8, 8, 1, false});
    EXPECT_EQ(samples.radiance(20), set == 0 ? Vec3(0.0f, 1.0f, 0.0f) : Vec3(0.0f, 0.0f, 1.0f));
  }
}

TEST(Shading, SrgbTexelsAreDecoded) {
  SceneBuilder builder;
  builder.scene().textures.push_back(levelsTexture({{188, 55, 255, 255}}, true));
  const int material = builder.diffuse(Vec3(0.5f));
  builder.scene().materials[material].unlit = true;
  builder.scene().materials[material].baseColorTexture.texture = 0;
  addPlane(builder, material, 20.0f, scene::UvMode::Unit);
  Uploaded world(builder.scene());
  const Samples samples =
      drawSamples(world, cameraAt({0.0f, 0.0f, 4.0f}, Vec3(0.0f)), {8, 8, 1, false});
  const Vec3 expected(0.5f * 0.50289f, 0.5f * 0.03820f, 0.5f);  // by IEC 61966-2-1
  // llvmpipe decodes sRGB by a polynomial that is off by up to 0.0008 (tables are exact)
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(samples.radiance(20)[c], expected[c], 5e-4f);
}

TEST(Diffuse, SkippedObjectsAndBackgroundHaveAlphaZero) {
  SceneBuilder builder;
  builder.constantEnvironment(Vec3(0.25f));
  builder.add(scene::makeSphere(0.5f, 32, 16, scene::UvMode::Unit),
              builder.diffuse(Vec3(0.0f), Vec3(0.5f)));
  Uploaded world(builder.scene());
  const scene::Camera camera = cameraAt({0.0f, 0.0f, 3.0f}, Vec3(0.0f));
  const gl::Texture color = gl::Texture::make2D("test", GL_RGBA32F, 32, 32);
  const gl::Texture depth = gl::Texture::make2D("test", GL_DEPTH_COMPONENT32F, 32, 32);
  const gl::Framebuffer target("test", {{color}}, {depth});
  for (const int skip : {0, 1}) {
    target.bind();
    target.clearDepth(0.0f);
    world.raster->drawDiffuse(scene::clipFromCamera(camera, 1.0f) * scene::cameraFromWorld(camera),
                              camera.eye(), scene::pixelSpreadRad(camera, 32), world.lighting,
                              {.objects = raster::ObjectSet::without({skip})});
    const std::vector<float> pixels = raster::readRgba(color);
    const float* middle = &pixels[4 * (16 * 32 + 16)];
    EXPECT_EQ(middle[0], skip == 0 ? 0.5f : 0.25f);
    EXPECT_EQ(middle[3], skip == 0 ? 1.0f : 0.0f);
    EXPECT_EQ(pixels[0], 0.25f);
    EXPECT_EQ(pixels[3], 0.0f);
  }
}

}  // namespace
}  // namespace catoptric
