// The method's images against Embree's rays from the same samples.
#include <gtest/gtest.h>

#include <cmath>

#include "frame/test_scenes.h"
#include "gl/test_context.h"
#include "methods/second_order/second_order.h"
#include "scene/animate.h"
#include "scene/shapes.h"
#include "trace/reflect.h"

namespace catoptric::methods {
namespace {

/// One frame of a scene by the method, and the light that Embree's rays find at its samples.
class Comparison {
 public:
  Comparison(scene::Scene scene, const scene::Camera& camera, const std::string& options = "{}")
      : context_(gl::testContext()),
        scene_(std::move(scene)),
        pose_(scene::poseAt(scene_, 0.0)),
        geometry_(frame::makeGeometry(scene_, pose_)),
        lighting_(frame::makeLighting(
            scene_, pose_, std::make_shared<frame::EnvironmentLight>(scene_.environment))),
        raster_(scene_, geometry_),
        trace_(scene_, geometry_, trace::BvhPolicy::Static) {
    settings_.width = settings_.height = 128;
    settings_.masks = true;
    settings_.layers = {"cluster"};
    raster::GBuffer gbuffer =
        raster_.makeGBuffer({settings_.width, settings_.height, settings_.samples, true});
    frame::StepTimer timer;
    timer.setFinish([] { gl::Context::current().finish("a step"); });
    Services services{scene_, geometry_, lighting_, &raster_, &gbuffer, &trace_, timer};
    const std::unique_ptr<Method> method =
        secondOrderEntry().make(config::parseText(options, "options"));
    method->prepare(services, settings_);
    raster_.drawGBuffer(gbuffer, camera, lighting_);
    FrameInput input;
    input.frame.camera = camera;
    method->render(input, services, output);
    context_.check("the frame");

    // The same samples by Embree
    raster::GBufferCopy copy;
    raster::readBack(gbuffer, false, copy);
    const std::vector<float> reflection = raster::readRgba(gbuffer.reflection);
    masks = raster::readMasks(gbuffer.masks);
    const Mat3 rays = scene::rayFromPixel(camera, copy.sampleWidth(), copy.sampleHeight());
    std::vector<trace::ReflectionPoint> points;
    std::vector<Vec3> ours;
    for (int y = 0; y < copy.sampleHeight(); ++y) {
      for (int x = 0; x < copy.sampleWidth(); ++x) {
        const std::size_t at = static_cast<std::size_t>(y) * copy.sampleWidth() + x;
        if (copy.object[at] != 1) continue;
        const Vec3 ray =
            rays * Vec3(static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f, 1.0f);
        trace::ReflectionPoint point;
        const float scale = camera.nearMetres / copy.depth[at];
        point.position = camera.eye() + scale * ray;
        point.direction = glm::normalize(ray);
        point.distance = scale * glm::length(ray);
        point.normal = Vec3(copy.normal[4 * at], copy.normal[4 * at + 1], copy.normal[4 * at + 2]);
        points.push_back(point);
        ours.emplace_back(reflection[4 * at], reflection[4 * at + 1], reflection[4 * at + 2]);
      }
    }
    std::vector<Vec3> radiance(points.size());
    trace::reflectedRadiance(trace_, lighting_, scene::pixelSpreadRad(camera, copy.sampleHeight()),
                             points, {}, true, radiance);
    samples = points.size();
    for (std::size_t i = 0; i < ours.size(); ++i) {
      const Vec3 d = glm::abs(ours[i] - radiance[i]);
      finite = finite && isFinite(ours[i]);
      const float difference = (d.x + d.y + d.z) / 3.0f;
      meanDifference += static_cast<double>(difference) / static_cast<double>(ours.size());
      different += difference > 0.02f ? 1.0 / static_cast<double>(ours.size()) : 0.0;
    }
  }

  FrameOutput output;
  std::vector<std::uint8_t> masks;
  std::size_t samples = 0;
  double meanDifference = 0.0;  ///< of radiance
  double different = 0.0;       ///< share of samples that differ by more than 0.02
  bool finite = true;

 private:
  gl::Context& context_;
  scene::Scene scene_;
  scene::Pose pose_;
  frame::Geometry geometry_;
  frame::Lighting lighting_;
  raster::SceneRaster raster_;
  trace::TraceScene trace_;
  RunSettings settings_;
};

/// Samples of the frame that have a bit of raster::MaskBit.
std::size_t marked(const Comparison& frame, std::uint8_t bit) {
  std::size_t count = 0;
  for (const std::uint8_t bits : frame.masks) count += (bits & bit) != 0;
  return count;
}

scene::Camera cameraAt(const Vec3& eye, const Vec3& target) {
  return scene::lookAt(eye, target, Vec3(0.0f, 1.0f, 0.0f), radians(50.0f));
}

/// A mirror (the first object) among coloured boxes in a room.
scene::Scene roomWith(scene::Mesh mirror, const Mat4& worldFromMirror, float glossiness = 0.0f) {
  test::SceneBuilder builder;
  builder.add(std::move(mirror), builder.reflective(1.0f, glossiness), worldFromMirror);
  const auto box = [&](const Vec3& centre, const Vec3& size, const Vec3& color) {
    builder.add(scene::makeBox({.size = size}, scene::UvMode::Metres), builder.diffuse(color),
                glm::translate(Mat4(1.0f), centre));
  };
  box({0.0f, 1.5f, -4.0f}, {8.0f, 5.0f, 0.1f}, {0.8f, 0.3f, 0.2f});
  box({0.0f, 1.5f, 4.5f}, {8.0f, 5.0f, 0.1f}, {0.3f, 0.7f, 0.3f});
  box({-4.0f, 1.5f, 0.0f}, {0.1f, 5.0f, 9.0f}, {0.2f, 0.4f, 0.8f});
  box({4.0f, 1.5f, 0.0f}, {0.1f, 5.0f, 9.0f}, {0.8f, 0.8f, 0.3f});
  box({0.0f, 4.0f, 0.0f}, {8.0f, 0.1f, 9.0f}, {0.9f, 0.9f, 0.9f});
  box({0.0f, -1.1f, 0.0f}, {8.0f, 0.1f, 9.0f}, {0.5f, 0.4f, 0.3f});
  box({1.6f, 0.3f, -0.6f}, {0.5f, 1.4f, 0.5f}, {0.9f, 0.1f, 0.5f});
  box({-1.5f, -0.2f, 1.0f}, {0.4f, 0.8f, 0.4f}, {0.1f, 0.8f, 0.8f});
  builder.constantEnvironment(Vec3(1.0f));
  return builder.scene();
}

TEST(SecondOrder, SamplesNameTheirClusters) {
  const Comparison frame(roomWith(scene::makeSphere(0.7f, 64, 32, scene::UvMode::Unit), Mat4(1.0f)),
                         cameraAt({0.0f, 0.4f, 3.0f}, {0.0f, 0.0f, 0.0f}));
  std::vector<std::uint64_t> counts(frame.output.clusters.size() + 1, 0);
  for (const std::uint16_t cluster : frame.output.clusterOf) ++counts.at(cluster);
  ASSERT_GT(counts.size(), 10u);
  for (std::size_t i = 0; i < frame.output.clusters.size(); ++i) {
    EXPECT_EQ(counts[i + 1], frame.output.clusters[i].samples) << "cluster " << i;
  }
}

TEST(SecondOrder, APlanarMirrorIsExact) {
  const Comparison frame(
      roomWith(scene::makePlane({4.0f, 4.0f}, {1, 1}, scene::UvMode::Metres), Mat4(1.0f)),
      cameraAt({0.7f, 1.5f, 3.2f}, {0.0f, 0.0f, 0.0f}));
  EXPECT_GT(frame.samples, 10000u);
  EXPECT_TRUE(frame.finite);
  EXPECT_LT(frame.different, 0.002);  // edges within a rounding of a sample's centre
  EXPECT_LT(frame.meanDifference, 1e-3);
  EXPECT_EQ(frame.output.counters.at("planar_samples"), frame.samples);
  EXPECT_EQ(frame.output.counters.at("environment"), 0u);
}

TEST(SecondOrder, ASphereComesCloseToItsRays) {
  const Comparison frame(
      roomWith(scene::makeSphere(1.0f, 96, 48, scene::UvMode::Metres), Mat4(1.0f)),
      cameraAt({0.4f, 0.8f, 3.6f}, {0.0f, 0.0f, 0.0f}));
  EXPECT_GT(frame.samples, 10000u);
  EXPECT_TRUE(frame.finite);
  EXPECT_GT(frame.output.counters.at("clusters"), 20u);
  EXPECT_LT(frame.meanDifference, 0.012);
  EXPECT_LT(frame.different, 0.06);
  EXPECT_LT(static_cast<double>(frame.output.counters.at("environment")),
            0.02 * static_cast<double>(frame.samples));
}

TEST(SecondOrder, FinerDepthImagesErrLess) {
  const auto error = [](const char* options) {
    return Comparison(roomWith(scene::makeSphere(1.0f, 96, 48, scene::UvMode::Metres), Mat4(1.0f)),
                      cameraAt({0.4f, 0.8f, 3.6f}, {0.0f, 0.0f, 0.0f}), options)
        .meanDifference;
  };
  const double coarse = error(R"({"depth_image_scale": 0.3333})");
  const double plain = error("{}");
  const double fine = error(R"({"depth_image_scale": 2})");
  EXPECT_LT(plain, coarse);
  EXPECT_LT(fine, plain);
}

TEST(SecondOrder, WhatFallsBackIsMarkedAndCounted) {
  // Clusters that are all too small to search
  const Comparison frame(
      roomWith(scene::makeSphere(1.0f, 96, 48, scene::UvMode::Metres), Mat4(1.0f)),
      cameraAt({0.4f, 0.8f, 3.6f}, {0.0f, 0.0f, 0.0f}), R"({"min_cluster_samples": 1000000})");
  EXPECT_EQ(frame.output.counters.at("clusters"), 0u);
  EXPECT_EQ(frame.output.counters.at("unclustered"), frame.samples);
  EXPECT_EQ(marked(frame, raster::kMaskEnvironment), frame.samples);
}

TEST(SecondOrder, DisocclusionsAreToldFromTrueMisses) {
  const char* options = R"({"count_disocclusions": true})";
  const scene::Camera camera = cameraAt({0.4f, 0.8f, 3.6f}, {0.0f, 0.0f, 0.0f});
  // A planar mirror has none
  const Comparison plane(
      roomWith(scene::makePlane({4.0f, 4.0f}, {1, 1}, scene::UvMode::Metres), Mat4(1.0f)),
      cameraAt({0.7f, 1.5f, 3.2f}, {0.0f, 0.0f, 0.0f}), options);
  EXPECT_EQ(plane.output.counters.at("disoccluded"), 0u);
  EXPECT_EQ(plane.output.counters.at("wrong_hit"), 0u);
  // In a closed room every ray hits: what found nothing is disoccluded, for mirrors and lobes
  for (const float glossiness : {0.0f, 0.3f}) {
    const Comparison closed(
        roomWith(scene::makeSphere(1.0f, 96, 48, scene::UvMode::Metres), Mat4(1.0f), glossiness),
        camera, options);
    const std::uint64_t missed = closed.output.counters.at("environment");
    EXPECT_GE(closed.output.counters.at("disoccluded"), missed);
    EXPECT_LE(closed.output.counters.at("disoccluded"), missed + closed.output.counters.at("sky"));
    EXPECT_EQ(marked(closed, raster::kMaskDisoccluded), closed.output.counters.at("disoccluded"));
    EXPECT_LT(static_cast<double>(closed.output.counters.at("wrong_hit")),
              0.05 * static_cast<double>(closed.samples));
  }
  // Alone under the sky nothing is, but where smooth normals send rays through the next facet
  test::SceneBuilder builder;
  builder.add(scene::makeSphere(1.0f, 96, 48, scene::UvMode::Metres), builder.reflective(1.0f));
  builder.constantEnvironment(Vec3(1.0f));
  const Comparison open(builder.scene(), camera, options);
  EXPECT_GT(open.output.counters.at("sky"), 10000u);
  EXPECT_LT(open.output.counters.at("disoccluded") + open.output.counters.at("wrong_hit"),
            open.samples / 500);
  // Not asked for, not counted
  const Comparison plain(builder.scene(), camera);
  EXPECT_EQ(plain.output.counters.count("disoccluded"), 0u);
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
}  // namespace catoptric::methods
