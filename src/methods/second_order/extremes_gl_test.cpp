#include <gtest/gtest.h>

#include <cmath>

#include "methods/second_order/test_comparison.h"

namespace catoptric::methods::second_order {
namespace {

// Bounds of the default, and of depth images alone, are at most three times what was measured.

TEST(SecondOrder, ExtremesStayWithinTheirBounds) {
  const scene::UvMode uv = scene::UvMode::Metres;
  const auto expectWithin = [](double bound, double aloneBound, const scene::Scene& scene,
                               const scene::Camera& camera, const char* options = "{}",
                               const BesideOptions& beside = {}) {
    for (const bool alone : {false, true}) {
      const Comparison frame(scene, camera, alone ? imagesAlone(options) : options, beside);
      EXPECT_TRUE(frame.finite);
      EXPECT_GT(frame.samples, 0u);
      EXPECT_LT(frame.l1Of8Bit, alone ? aloneBound : bound);
    }
  };
  const auto sphere = [&](float radius) {
    return roomWith(scene::makeSphere(radius, 96, 48, uv), Mat4(1.0f));
  };
  const scene::Camera aside = cameraAt({0.0f, 0.8f, 3.6f}, {0.0f, 0.0f, 0.0f});
  // A sphere that fills the frame, one of about 3 pixels (no cluster: traced, or the cube map)
  expectWithin(0.5, 0.5, sphere(1.0f), cameraAt({0.0f, 0.0f, 1.3f}, {0.0f, 0.0f, 0.0f}));
  expectWithin(0.1, 20.0, sphere(0.03f), aside);
  // From inside a sphere, whose far side only Embree's rays find
  expectWithin(0.1, 16.0, sphere(1.0f), cameraAt({0.0f, 0.0f, 0.3f}, {0.0f, 0.0f, -1.0f}));
  expectWithin(0.1, 0.07, sphere(0.1f), aside,
               R"({"max_theta_bins": 128, "max_phi_bins": 64, "bin_density": 1000})",
               {[](Options& options) { options.cluster.minSamples = 1; }});  // a sample each
  // Edge-on
  expectWithin(0.07, 0.07, roomWith(scene::makePlane({4.0f, 4.0f}, {1, 1}, uv), Mat4(1.0f)),
               cameraAt({0.0f, 0.01f, 3.6f}, {0.0f, 0.0f, 0.0f}));
  expectWithin(0.5, 2.0, roomWith(scene::makeTorus(0.7f, 0.25f, 48, 24, uv), Mat4(1.0f)),
               cameraAt({0.0f, 0.0f, 3.0f}, {0.0f, 0.0f, 0.0f}));
  // 500 reflectors, a cluster or less each: no better than the cube map
  test::SceneBuilder many;
  const int mirror = many.reflective(0.8f);
  for (int i = 0; i < 500; ++i) {
    const int column = i % 25 - 12;
    const int row = i / 25 - 10;
    many.add(scene::makeSphere(0.1f, 24, 12, uv), mirror,
             test::translation(
                 {0.3f * static_cast<float>(column), 0.3f * static_cast<float>(row), 0.0f}));
  }
  many.add(scene::makeBox({.size = {9.0f, 9.0f, 0.1f}}, uv), many.diffuse({0.3f, 0.7f, 0.3f}),
           test::translation({0.0f, 0.0f, -1.0f}));
  many.add(scene::makeBox({.size = {0.1f, 9.0f, 9.0f}}, uv), many.diffuse({0.8f, 0.7f, 0.3f}),
           test::translation({4.5f, 0.0f, 3.0f}));
  many.constantEnvironment(Vec3(0.8f));
  expectWithin(1.2, 27.0, many.scene(), cameraAt({0.0f, 0.8f, 6.6f}, {0.0f, 0.0f, 0.0f}));
  // None at all
  test::SceneBuilder none;
  none.add(scene::makeSphere(1.0f, 24, 12, uv), none.diffuse(Vec3(0.5f)));
  const Comparison empty(none.scene(), aside);
  EXPECT_EQ(empty.samples, 0u);
  EXPECT_EQ(empty.output.counters.at("sky"), 0u);
}

TEST(SecondOrder, DegenerateClustersAreCountedAndStayWithinTheirBounds) {
  const scene::UvMode uv = scene::UvMode::Metres;
  const std::string oneBin = R"("max_theta_bins": 1, "max_phi_bins": 1)";
  const auto expectCounted = [](const char* counter, double bound, double aloneBound,
                                const scene::Scene& scene, const scene::Camera& camera,
                                const std::string& options, const BesideOptions& beside = {}) {
    for (const bool alone : {false, true}) {
      const std::string given = "{" + options + "}";
      const Comparison frame(scene, camera, alone ? imagesAlone(given) : given, beside);
      EXPECT_TRUE(frame.finite) << counter;
      EXPECT_GT(frame.samples, 1000u) << counter;
      EXPECT_LT(frame.l1Of8Bit, alone ? aloneBound : bound) << counter;
      EXPECT_TRUE(!alone || frame.output.counters.at(counter) > 0) << counter;
    }
  };
  const auto sphere = [&] { return roomWith(scene::makeSphere(1.0f, 96, 48, uv), Mat4(1.0f)); };
  const scene::Camera before = cameraAt({0.4f, 0.8f, 3.6f}, {0.0f, 0.0f, 0.0f});
  const scene::Camera atFocus = cameraAt({0.0f, 0.0f, 0.0f}, {0.0f, 0.0f, -1.0f});
  // The eye in a bowl's focus sends parallel rays; from beyond its centre they cross
  expectCounted("parallel_clusters", 0.04, 0.07, roomWithBowl(-0.2f, 0.9f), atFocus, "");
  expectCounted("crossing_clusters", 0.1, 13.0, roomWithBowl(-0.2f, 1.8f),
                cameraAt({0.9f, 0.7f, 2.6f}, {0.0f, 0.0f, -1.0f}), "");
  // A whole sphere in a cluster bends more than a camera can follow
  expectCounted("pushed_back", 13.0, 13.0, sphere(), before, oneBin);
  expectCounted("capped_images", 0.04, 4.0, sphere(), before, "",
                {[](Options& options) { options.camera.maxTexelsPerSample = 0.25f; }});
  // Along a pipe's axis, whose walls face each other all around
  expectCounted(
      "normals_cancel", 1.7, 1.7,
      roomWith(scene::makeCylinder(0.5f, 0.5f, 2.0f, 96, 8, false, uv),
               test::translation({0.0f, 0.0f, -1.0f}) * test::rotation(90.0f, {1.0f, 0.0f, 0.0f})),
      cameraAt({0.0f, 0.0f, 1.2f}, {0.0f, 0.0f, 0.0f}), oneBin);
  test::SceneBuilder many;
  const int mirror = many.reflective(0.8f);
  for (int i = 0; i < 100; ++i) {
    const int row = i / 10;
    const Vec3 place(0.25f * static_cast<float>(i % 10 - 5), 0.25f * static_cast<float>(row - 5),
                     0.0f);
    many.add(scene::makeSphere(0.1f, 24, 12, uv), mirror, test::translation(place));
  }
  many.constantEnvironment(Vec3(0.8f));
  expectCounted("bins_halved", 30.0, 30.0, many.scene(), before,
                R"("max_theta_bins": 128, "max_phi_bins": 64, "bin_density": 1000)");
}

TEST(SecondOrder, OddReflectorsStayFinite) {
  const auto expectFinite = [](scene::Mesh mesh, const Mat4& place, const scene::Camera& camera) {
    const Comparison frame(roomWith(std::move(mesh), place), camera);
    EXPECT_TRUE(frame.finite);
  };
  const scene::UvMode uv = scene::UvMode::Metres;
  // From inside a sphere, a sphere of about 3 pixels, edge-on, a sphere that fills the frame
  expectFinite(scene::makeSphere(1.0f, 48, 24, uv), Mat4(1.0f),
               cameraAt({0.0f, 0.0f, 0.3f}, {0.0f, 0.0f, -1.0f}));
  expectFinite(scene::makeSphere(0.03f, 24, 12, uv), Mat4(1.0f),
               cameraAt({0.0f, 0.8f, 3.6f}, {0.0f, 0.0f, 0.0f}));
  expectFinite(scene::makePlane({4.0f, 4.0f}, {1, 1}, uv), Mat4(1.0f),
               cameraAt({0.0f, 1e-4f, 3.6f}, {0.0f, 0.0f, 0.0f}));
  expectFinite(scene::makeSphere(1.0f, 48, 24, uv), Mat4(1.0f),
               cameraAt({0.0f, 0.0f, 1.02f}, {0.0f, 0.0f, 0.0f}));
  expectFinite(scene::makeTorus(0.7f, 0.25f, 48, 24, uv), Mat4(1.0f),
               cameraAt({0.4f, 1.5f, 2.0f}, {0.0f, 0.0f, 0.0f}));
}

}  // namespace
}  // namespace catoptric::methods::second_order
