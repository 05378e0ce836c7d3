// Compares the method's images with Embree's rays from the same samples.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "core/srgb.h"
#include "frame/test_scenes.h"
#include "methods/second_order/second_order.h"
#include "methods/testing/gl_harness.h"
#include "scene/shapes/shapes.h"

namespace catoptric::methods::second_order {

/// Options for a test of depth images alone: no cluster is traced.
inline std::string imagesAlone(const std::string& options = "{}") {
  return R"({"probes": 0)" + (options == "{}" ? "}" : ", " + options.substr(1));
}

/// Settings of a comparison that are not options of the method.
struct BesideOptions {
  void (*change)(Options&) = [](Options&) {};
  bool countDisocclusions = false;
};

/// One frame of a scene, rendered by the method, and the radiance of Embree's rays from its
/// samples.
class Comparison {
 public:
  Comparison(scene::Scene scene, const scene::Camera& camera, const std::string& options = "{}",
             const BesideOptions& beside = {}) {
    RunSettings settings = test::framesOf(128, 128, 2, true);
    settings.countDisocclusions = beside.countDisocclusions;
    settings.layers = {"cluster"};
    test::GlStage stage(std::move(scene), settings);
    stage.embree(trace::BvhPolicy::Static);
    Options parsed = optionTable().parse(config::parseText(options, "test options"));
    beside.change(parsed);
    output = test::GlMethod(stage, std::make_unique<SecondOrder>(parsed)).render(camera);
    masks = raster::readMasks(stage.gbuffer.masks);
    const test::TracedSamples found(stage, camera, {.rays = 8});
    traced = found.counts;
    samples = found.points.size();
    l1Of8Bit = found.l1Of8Bit();
    finite = found.finite();
    std::size_t below = 0;
    steps.resize(masks.size());
    for (std::size_t i = 0; i < samples; ++i) {
      const Vec3& ours = found.ours[i];
      const Vec3 d = glm::abs(ours - found.traced[i]);
      const double difference = static_cast<double>((d.x + d.y + d.z) / 3.0f);
      for (int c = 0; c < 3; ++c)
        steps[found.places[i]] +=
            85.0 * std::abs(shownValue(ours[c]) - shownValue(found.traced[i][c]));
      light += static_cast<double>(ours.x + ours.y + ours.z);
      tracedLight += static_cast<double>(found.traced[i].x + found.traced[i].y + found.traced[i].z);
      brightest = std::max({brightest, ours.x, ours.y, ours.z});
      meanDifference += difference / static_cast<double>(samples);
      different += difference > 0.02 ? 1.0 / static_cast<double>(samples) : 0.0;
      if ((masks[found.places[i]] & raster::kMaskBelowHorizon) == 0) continue;
      differenceBelow += difference;
      ++below;
    }
    differenceBelow /= static_cast<double>(std::max<std::size_t>(1, below));
  }

  static double shownValue(float radiance) {
    return srgbFromLinear(std::clamp<double>(radiance, 0.0, 1.0));
  }

  FrameOutput output;
  std::vector<std::uint16_t> masks;
  trace::ReflectionCounts traced;
  std::size_t samples = 0;
  float brightest = 0.0f;
  double meanDifference = 0.0;  ///< mean difference of radiance
  double light = 0.0;           ///< sum of the method's radiances, and of Embree's (tracedLight)
  double tracedLight = 0.0;
  double l1Of8Bit = 0.0;  ///< over reflective samples, of gamma 2.2 values
  /// Per sample of the frame: difference in 8-bit steps, as Retrace measures it; 0 for samples that
  /// do not reflect.
  std::vector<double> steps;
  double different = 0.0;  ///< share of samples that differ by more than 0.02
  /// Mean difference of radiance over the samples with kMaskBelowHorizon.
  double differenceBelow = 0.0;
  bool finite = true;
};

/// Samples of the frame that have a bit of raster::MaskBit.
inline std::size_t marked(const Comparison& frame, std::uint16_t bit) {
  std::size_t count = 0;
  for (const std::uint16_t bits : frame.masks) count += (bits & bit) != 0;
  return count;
}

inline scene::Camera cameraAt(const Vec3& eye, const Vec3& target) {
  return scene::lookAt(eye, target, Vec3(0.0f, 1.0f, 0.0f), radians(50.0f));
}

/// A mirror (the first object) among coloured boxes in a room.
inline scene::Scene roomWith(scene::Mesh mirror, const Mat4& worldFromMirror,
                             float roughness = 0.0f) {
  test::SceneBuilder builder;
  builder.add(std::move(mirror), builder.reflective(1.0f, roughness), worldFromMirror);
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

/// The part of a sphere with z <= until * radius (`until`: -1..1), turned inside out.
inline scene::Mesh bowl(float radius, float until) {
  scene::Mesh mesh = scene::makeSphere(radius, 96, 64, scene::UvMode::Metres);
  std::vector<std::uint32_t> kept;
  for (std::size_t t = 0; t + 2 < mesh.indices.size(); t += 3) {
    bool inside = true;
    for (std::size_t k = 0; k < 3; ++k) {
      inside = inside && mesh.positions[mesh.indices[t + k]].z <= until * radius;
    }
    if (inside)
      kept.insert(kept.end(), {mesh.indices[t], mesh.indices[t + 2], mesh.indices[t + 1]});
  }
  mesh.indices = kept;
  for (Vec3& normal : mesh.normals) normal = -normal;
  return mesh;
}

/// A bowl of radius 2 m whose centre is at z = 1, its vertex at z = -1 and its focus at z = 0, with
/// a box `distance` metres before its vertex.
inline scene::Scene roomWithBowl(float until, float distance) {
  const scene::UvMode uv = scene::UvMode::Metres;
  test::SceneBuilder builder;
  builder.add(bowl(2.0f, until), builder.reflective(1.0f), test::translation({0.0f, 0.0f, 1.0f}));
  builder.add(scene::makeBox({.size = {0.3f, 0.3f, 0.3f}}, uv), builder.diffuse({0.9f, 0.2f, 0.1f}),
              test::translation({0.15f, -0.1f, -1.0f + distance}));
  builder.add(scene::makeBox({.size = {9.0f, 6.0f, 0.1f}}, uv), builder.diffuse({0.3f, 0.7f, 0.3f}),
              test::translation({0.0f, 0.0f, 6.0f}));
  builder.add(scene::makeBox({.size = {9.0f, 0.1f, 9.0f}}, uv), builder.diffuse({0.3f, 0.3f, 0.8f}),
              test::translation({0.0f, -2.5f, 2.0f}));
  builder.constantEnvironment(Vec3(0.8f));
  return builder.scene();
}

}  // namespace catoptric::methods::second_order
