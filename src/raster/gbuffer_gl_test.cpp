// Where the G-buffer's samples lie, which side of a surface they show, that culling and repetition
// change none. Closed forms of depth, normals and light: surfaces_gl_test.cpp.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstring>

#include "raster/regions/screen.h"
#include "raster/test_support.h"

namespace catoptric {
namespace {

using test::cameraAt;
using test::drawSamples;
using test::readSamples;
using test::rotation;
using test::Samples;
using test::SceneBuilder;
using test::translation;
using test::Uploaded;

constexpr int kSize = 128;

Vec3 rayThrough(const scene::Camera& camera, const Samples& samples, int x, int y) {
  return scene::rayDirection(camera, samples.width, samples.height, static_cast<float>(x) + 0.5f,
                             static_cast<float>(y) + 0.5f);
}

template <class T>
void expectSameBits(const std::vector<T>& a, const std::vector<T>& b, const char* what) {
  ASSERT_EQ(a.size(), b.size()) << what;
  EXPECT_EQ(std::memcmp(a.data(), b.data(), a.size() * sizeof(T)), 0) << what;
}
void expectSame(const Samples& a, const Samples& b) {
  expectSameBits(a.diffuse, b.diffuse, "diffuse");
  expectSameBits(a.normal, b.normal, "normal");
  expectSameBits(a.depth, b.depth, "depth");
  expectSameBits(a.ids, b.ids, "ids");
  expectSameBits(a.stencil, b.stencil, "stencil");
}

TEST(Screen, HoldsWhatFloatsMakeOfPointsFarFromTheOrigin) {
  constexpr int kPixels = 1024;
  for (const float far : {0.0f, 1e3f, 1e5f, 1e6f}) {
    const Vec3 target(far, -0.3f * far, 0.7f * far);
    const scene::Camera camera = cameraAt(target + Vec3(1.0f, 2.0f, 3.0f), target, 0.5f);
    const raster::Screen screen(camera, kPixels, kPixels);
    const Mat4 clipFromWorld = scene::clipFromCamera(camera, 1.0f) * scene::cameraFromWorld(camera);
    for (int i = 0; i < 1000; ++i) {
      const auto part = [&](float step) { return std::fmod(step * static_cast<float>(i), 1.0f); };
      const std::array<Vec3, 1> point{target + Vec3(part(0.618f), part(0.414f), part(0.732f)) -
                                      0.5f};
      const raster::Rectangle shown = screen.shows(point);
      const Vec4 c = clipFromWorld * Vec4(point[0], 1.0f);
      const Vec2 at = static_cast<float>(kPixels) * (0.5f + 0.5f * Vec2(c.x, -c.y) / c.w);
      if (!(c.w > camera.nearMetres) || glm::min(at.x, at.y) < 0.0f ||
          glm::max(at.x, at.y) >= static_cast<float>(kPixels)) {
        continue;
      }
      const auto x = static_cast<int>(at.x);
      const auto y = static_cast<int>(at.y);
      EXPECT_TRUE(shown.x0 <= x && x < shown.x1 && shown.y0 <= y && y < shown.y1)
          << far << ": " << at.x << " " << at.y << " not in " << shown.x0 << " " << shown.y0 << " "
          << shown.x1 << " " << shown.y1;
      if (far == 0.0f) {
        EXPECT_LE(shown.width(), 4);
      }
    }
  }
}

TEST(GBuffer, PartsAreThoseOfTheWhole) {
  SceneBuilder builder;
  builder.add(scene::makePlane({20.0f, 20.0f}, {9, 9}, scene::UvMode::Metres),
              builder.diffuse(Vec3(0.5f)), translation({0.0f, -1.0f, 0.0f}));
  for (float x = -1.5f; x < 2.0f; x += 0.5f) {
    // Triangles down to fractions of a sample
    builder.add(scene::makeSphere(0.5f, 120, 60, scene::UvMode::Metres),
                builder.reflective(0.3f, 0.2f), translation({x, 0.0f, 0.3f * x}));
  }
  builder.move(3, {1.0f, 0.4f, -2.0f}, 1.0f);
  builder.move(4, Vec3(0.0f), 1.0f);
  builder.constantEnvironment(Vec3(0.3f));
  Uploaded world(builder.scene());
  const scene::Camera camera = cameraAt({0.4f, 0.7f, 5.0f}, {0.2f, 0.0f, 0.0f});
  raster::GBuffer g = world.raster->makeGBuffer({kSize, kSize, 2, false});
  gl::Texture frame = gl::Texture::make2D("frame", GL_RGBA32F, kSize, kSize);
  world.raster->drawGBuffer(g, camera, world.lighting);
  world.raster->composite(g, camera, {}, frame);
  const Samples before = readSamples(g);

  // What moved is drawn anew where it was and where it is, and nowhere else
  const auto shown = [&] {
    return raster::shownRectangle(camera, g.sampleWidth(), g.sampleHeight(),
                                  world.geometry.objects[3].bounds);
  };
  raster::GBuffer anew = world.raster->makeGBuffer({kSize, kSize, 2, false});
  for (const double seconds : {0.3, 1.0, 0.5}) {
    raster::Region part(g.sampleWidth(), g.sampleHeight());
    part.add(shown());
    const std::vector<int> changed =
        frame::updateGeometry(world.geometry, world.scene, scene::poseAt(world.scene, seconds));
    EXPECT_THAT(changed, testing::ElementsAre(3));
    world.raster->update(world.geometry, changed);
    part.add(shown());
    world.raster->drawGBuffer(g, camera, world.lighting, part, &world.geometry);
    world.raster->composite(g, camera, {}, frame, part);
    const Samples after = readSamples(g);
    EXPECT_NE(before.ids, after.ids);

    Uploaded other(world.scene);
    other.raster->update(world.geometry, changed);
    other.raster->drawGBuffer(anew, camera, world.lighting);
    expectSame(after, readSamples(anew));
    gl::Texture composed = gl::Texture::make2D("frame", GL_RGBA32F, kSize, kSize);
    other.raster->composite(anew, camera, {}, composed);
    expectSameBits(raster::readRgba(frame), raster::readRgba(composed), "frame");
  }

  // Neither what moves nor what could is part of what stands still
  raster::Region all(g.sampleWidth(), g.sampleHeight());
  all.add({0, 0, g.sampleWidth(), g.sampleHeight()});
  const std::vector<std::uint32_t> still = raster::readIds(
      world.raster->drawStill(g, camera, world.lighting, all, world.geometry).object);
  EXPECT_THAT(still, testing::Contains(3u));
  EXPECT_THAT(still, testing::Not(testing::Contains(4u)));
  EXPECT_THAT(still, testing::Not(testing::Contains(5u)));
}

TEST(GBuffer, SlantedPlaneHasItsDepth) {
  SceneBuilder builder;
  builder.add(scene::makePlane({200.0f, 200.0f}, {1, 1}, scene::UvMode::Metres),
              builder.diffuse(Vec3(0.5f)));
  Uploaded world(builder.scene());
  const scene::Camera camera = cameraAt({3.0f, 2.0f, 5.0f}, {0.0f, 0.0f, 0.0f});
  const Samples samples = drawSamples(world, camera, {kSize, kSize, 1, false});
  int compared = 0;
  for (int y = 0; y < samples.height; ++y) {
    for (int x = 0; x < samples.width; ++x) {
      const Vec3 d = rayThrough(camera, samples, x, y);
      if (d.y > -0.05f) continue;
      const double t = camera.eye().y / -static_cast<double>(d.y);
      const double z = t * glm::dot(d, camera.forward());
      ASSERT_EQ(samples.ids[samples.at(x, y)], 1u);
      EXPECT_NEAR(camera.nearMetres / samples.depth[samples.at(x, y)] / z, 1.0, 2e-5);
      EXPECT_EQ(samples.n(samples.at(x, y)), Vec3(0.0f, 1.0f, 0.0f));
      ++compared;
    }
  }
  EXPECT_GT(compared, kSize * kSize / 2);
}

TEST(GBuffer, BothSidesOfASurfaceAreSeenAndFaceTheViewer) {
  SceneBuilder builder;
  builder.scene().ambient = Vec3(0.0f);
  builder.add(scene::makePlane({2.0f, 2.0f}, {4, 4}, scene::UvMode::Unit),
              builder.diffuse(Vec3(1.0f)), test::facingZ());
  for (const float z : {1.0f, -1.0f}) {
    scene::Light light;
    light.position = {0.0f, 0.0f, 2.0f * z};
    light.intensity = Vec3(z > 0.0f ? 1.0f : 0.5f);
    builder.scene().lights.push_back(light);
  }
  Uploaded world(builder.scene());
  for (const float side : {1.0f, -1.0f}) {
    const Samples samples = drawSamples(world, cameraAt({0.0f, 0.0f, 3.0f * side}, Vec3(0.0f)),
                                        {kSize, kSize, 1, false});
    const std::size_t centre = samples.at(kSize / 2, kSize / 2);
    ASSERT_EQ(samples.ids[centre], 1u);
    EXPECT_LT(glm::distance(samples.n(centre), Vec3(0.0f, 0.0f, side)), 1e-6f);
    // Lit by the light on the viewer's side alone: I / r^2 / pi
    const float expected = (side > 0.0f ? 1.0f : 0.5f) / 4.0f / kPi;
    EXPECT_NEAR(samples.radiance(centre).x / expected, 1.0f, 1e-3f);
  }
}

TEST(GBuffer, MirroredObjectsFaceTheViewerToo) {
  SceneBuilder builder;
  builder.add(scene::makeSphere(1.0f, 64, 32, scene::UvMode::Unit), builder.diffuse(Vec3(1.0f)),
              glm::scale(Mat4(1.0f), Vec3(-1.0f, 1.0f, 1.0f)));
  Uploaded world(builder.scene());
  const scene::Camera camera = cameraAt({0.0f, 0.0f, 4.0f}, Vec3(0.0f));
  const Samples samples = drawSamples(world, camera, {kSize, kSize, 1, false});
  int seen = 0;
  for (int y = 0; y < samples.height; ++y) {
    for (int x = 0; x < samples.width; ++x) {
      const std::size_t i = samples.at(x, y);
      if (samples.ids[i] == 0) continue;
      ++seen;
      EXPECT_LT(glm::dot(samples.n(i), rayThrough(camera, samples, x, y)), 0.05f);
    }
  }
  EXPECT_GT(seen, 1000);
}

TEST(GBuffer, SamplesLieWhereTheSamplesOfALargerFrameDo) {
  SceneBuilder builder;
  builder.constantEnvironment(Vec3(0.5f));
  builder.add(scene::makeTorus(0.8f, 0.3f, 64, 32, scene::UvMode::Unit),
              builder.diffuse(Vec3(0.3f, 0.6f, 0.9f)), rotation(40.0f, {1.0f, 0.2f, 0.0f}));
  Uploaded world(builder.scene());
  const scene::Camera camera = cameraAt({0.3f, 0.5f, 3.0f}, Vec3(0.0f));
  expectSame(drawSamples(world, camera, {60, 40, 3, false}),
             drawSamples(world, camera, {180, 120, 1, false}));
}

TEST(GBuffer, SampleOnTheLeftOfAnEdgeIsCovered) {
  // A half plane x < 0.3 pixels right of the frame's middle: with 4 samples per pixel the one at
  // 1/8 is covered, those at 3/8 and beyond are not.
  SceneBuilder builder;
  const float pixel = 2.0f * std::tan(0.4f) / 16.0f;  // metres at distance 1
  builder.add(scene::makePlane({10.0f, 10.0f}, {1, 1}, scene::UvMode::Unit),
              builder.diffuse(Vec3(1.0f)),
              translation({0.3f * pixel - 5.0f, 0.0f, 0.0f}) * test::facingZ());
  Uploaded world(builder.scene());
  const Samples samples =
      drawSamples(world, cameraAt({0.0f, 0.0f, 1.0f}, Vec3(0.0f)), {16, 16, 4, false});
  for (int y = 0; y < samples.height; ++y) {
    for (int x = 0; x < samples.width; ++x) {
      ASSERT_EQ(samples.ids[samples.at(x, y)], x <= 32 ? 1u : 0u) << x << ", " << y;
    }
  }
}

TEST(GBuffer, RowZeroIsTheTop) {
  SceneBuilder builder;
  builder.add(scene::makePlane({20.0f, 1.0f}, {1, 1}, scene::UvMode::Unit),
              builder.diffuse(Vec3(1.0f)), translation({0.0f, 1.0f, 0.0f}) * test::facingZ());
  Uploaded world(builder.scene());
  const Samples samples =
      drawSamples(world, cameraAt({0.0f, 0.0f, 4.0f}, Vec3(0.0f)), {32, 32, 1, false});
  EXPECT_EQ(samples.ids[samples.at(16, 6)], 1u);
  EXPECT_EQ(samples.ids[samples.at(16, 25)], 0u);
}

/// A crowd of closed and open objects, opaque and masked; `moving` says they move, by nothing.
SceneBuilder crowd(bool moving) {
  SceneBuilder builder;
  builder.constantEnvironment(Vec3(0.4f));
  const int grey = builder.diffuse(Vec3(0.5f));
  const int mirror = builder.reflective(0.7f);
  scene::BoxShape room;
  room.size = Vec3(8.0f);
  room.segments = glm::ivec3(8);
  room.inward = true;
  builder.add(scene::makeBox(room, scene::UvMode::Unit), grey);
  for (int i = 0; i < 12; ++i) {
    const float a = 0.52f * static_cast<float>(i);
    const Mat4 place =
        translation({2.0f * std::cos(a), 0.3f * std::sin(3.0f * a), 2.0f * std::sin(a)});
    switch (i % 4) {
      case 0:
        builder.add(scene::makeSphere(0.4f, 48, 24, scene::UvMode::Unit), mirror, place);
        break;
      case 1:
        builder.add(scene::makeTorus(0.3f, 0.1f, 48, 24, scene::UvMode::Unit), grey, place);
        break;
      case 2:
        builder.add(scene::makeTeapot(0.5f, 6, true, scene::UvMode::Unit), mirror, place);
        break;
      default:
        builder.add(scene::makeCylinder(0.3f, 0.2f, 0.5f, 32, 4, false, scene::UvMode::Unit), grey,
                    place);
    }
  }
  for (int i = 0; moving && i < 13; ++i) builder.move(i, Vec3(0.0f), 1.0f);
  return builder;
}

TEST(GBuffer, CullingChangesNoSample) {
  Uploaded culled(crowd(false).scene());
  // The backs of what moves are drawn
  Uploaded plain(crowd(true).scene());
  // From inside the ring, from inside a sphere, from outside of the room, past the near plane
  const scene::Camera cameras[] = {cameraAt({0.0f, 0.4f, 0.2f}, {2.0f, 0.0f, 0.0f}, 1.4f),
                                   cameraAt({2.0f, 0.0f, 0.1f}, Vec3(0.0f)),
                                   cameraAt({9.0f, 7.0f, 8.0f}, Vec3(0.0f)),
                                   cameraAt({2.405f, 0.0f, 0.0f}, {2.0f, 0.0f, 0.0f})};
  for (const scene::Camera& camera : cameras) {
    const Samples a = drawSamples(culled, camera, {kSize, kSize, 1, false});
    const Samples b = drawSamples(plain, camera, {kSize, kSize, 1, false});
    // Surfaces, not draw order, decide: ids may only differ where depths are equal
    expectSameBits(a.depth, b.depth, "depth");
    expectSameBits(a.ids, b.ids, "ids");
    EXPECT_EQ(a.statistics.triangles + a.statistics.culledTriangles,
              culled.geometry.triangleCount());
  }
  const Samples inside = drawSamples(culled, cameras[0], {kSize, kSize, 1, false});
  const Samples drawn = drawSamples(plain, cameras[0], {kSize, kSize, 1, false});
  EXPECT_LT(inside.statistics.triangles, drawn.statistics.triangles);
  EXPECT_LT(drawn.statistics.triangles, plain.geometry.triangleCount());
}

TEST(GBuffer, SameBitsTwice) {
  const scene::Camera camera = cameraAt({0.0f, 0.4f, 0.2f}, {2.0f, 0.0f, 0.0f}, 1.4f);
  Uploaded first(crowd(false).scene());
  const Samples a = drawSamples(first, camera, {kSize, kSize, 2, false});
  const Samples b = drawSamples(first, camera, {kSize, kSize, 2, false});
  Uploaded second(crowd(false).scene());
  expectSame(a, b);
  expectSame(a, drawSamples(second, camera, {kSize, kSize, 2, false}));
}

}  // namespace
}  // namespace catoptric
