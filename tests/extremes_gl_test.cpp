// Closed meshes and planes of adjacent triangles leave no pinhole in the G-buffer, from within,
// from a graze and at every scale; Embree's watertightness is tested in trace/trace_test.cpp.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "frame/test_scenes.h"
#include "methods/testing/gl_harness.h"

namespace catoptric {
namespace {

using test::SceneBuilder;

constexpr int kSize = 256;

/// Samples without an object, over all views.
std::size_t holes(const scene::Scene& scene, const std::vector<scene::Camera>& cameras) {
  test::GlStage stage(scene, test::framesOf(kSize, kSize, 1));
  std::size_t count = 0;
  for (const scene::Camera& camera : cameras) {
    stage.draw(camera);
    const std::vector<std::uint32_t> ids = raster::readIds(stage.gbuffer.object);
    count += static_cast<std::size_t>(std::count(ids.begin(), ids.end(), 0u));
  }
  return count;
}

/// Cameras at random places within half a metre of 0, looking anywhere; all scaled.
std::vector<scene::Camera> camerasInside(int count, float scale) {
  std::mt19937 random(7);
  std::uniform_real_distribution<float> any(-1.0f, 1.0f);
  const auto vector = [&] { return Vec3(any(random), any(random), any(random)); };
  std::vector<scene::Camera> cameras;
  for (int i = 0; i < count; ++i) {
    const Vec3 eye = 0.3f * vector();
    scene::Camera camera =
        scene::lookAt(scale * eye, scale * (eye + vector()), {0.0f, 1.0f, 0.0f}, 1.2f);
    camera.nearMetres = 1e-3f * scale;
    cameras.push_back(camera);
  }
  return cameras;
}

TEST(Coverage, ClosedMeshesHaveNoPinholesFromWithin) {
  std::size_t samples = 0;
  for (const float scale : {1e-4f, 1.0f, 1e5f}) {
    for (int mesh = 0; mesh < 3; ++mesh) {
      SceneBuilder builder;
      scene::BoxShape box;
      box.size = Vec3(2.0f);
      box.segments = {23, 23, 23};
      builder.add(mesh == 0   ? scene::makeIcosphere(1.0f, 6, scene::UvMode::Unit)
                  : mesh == 1 ? scene::makeSphere(1.0f, 193, 101, scene::UvMode::Unit)
                              : scene::makeBox(box, scene::UvMode::Unit),
                  builder.diffuse(Vec3(1.0f)), glm::scale(Mat4(1.0f), Vec3(scale)));
      const std::vector<scene::Camera> cameras = camerasInside(3, scale);
      EXPECT_EQ(holes(builder.scene(), cameras), 0u) << "mesh " << mesh << ", scale " << scale;
      samples += cameras.size() * kSize * kSize;
    }
  }
  EXPECT_GE(samples, 1'000'000u);
}

TEST(Coverage, APlaneOfTrianglesHasNoPinholes) {
  SceneBuilder builder;
  builder.add(scene::makePlane({1.0f, 1.0f}, {97, 89}, scene::UvMode::Unit),
              builder.diffuse(Vec3(1.0f)), test::rotation(90.0f, {1.0f, 0.2f, 0.1f}));
  // The plane's own axes, so that the views stay within it however they graze
  const Mat3 world(test::rotation(90.0f, {1.0f, 0.2f, 0.1f}));
  std::vector<scene::Camera> cameras;
  for (const float height : {0.2f, 0.01f, 1e-4f}) {
    scene::Camera camera = scene::lookAt(world * Vec3(0.0f, height, 0.3f), world * Vec3(0.0f),
                                         world * Vec3(0.0f, 1.0f, 0.0f), 0.2f * height);
    camera.nearMetres = 1e-4f;
    cameras.push_back(camera);
  }
  EXPECT_EQ(holes(builder.scene(), cameras), 0u);
}

}  // namespace
}  // namespace catoptric
