// What only the whole scene shows: how far it reaches at rest and in motion, how many lights it
// has.
#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "core/error.h"
#include "scene/animate.h"
#include "scene/finish.h"
#include "scene/finish_steps.h"
#include "scene/loader.h"

namespace catoptric::scene {
namespace {

/// Matrices that the poses looked at may take together: some 50 ms. Ours.
constexpr std::size_t kMaxMatrices = 1'000'000;

/// True for NaN and infinity too.
bool isFar(const Vec3& p) {
  return !(std::abs(p.x) <= kMaxCoordinate && std::abs(p.y) <= kMaxCoordinate &&
           std::abs(p.z) <= kMaxCoordinate);
}

[[noreturn]] void fail(const Scene& scene, const std::string& what, double timeSeconds,
                       const Vec3& p) {
  throw SceneError(
      fmt::format("{}: {} reaches ({:.6g}, {:.6g}, {:.6g}) metres at {:.6g} s; coordinates up to "
                  "{:.6g} are allowed",
                  scene.source.string(), what, p.x, p.y, p.z, timeSeconds, kMaxCoordinate));
}

std::array<Vec3, 8> cornersOf(const Box3& box) {
  std::array<Vec3, 8> corners;
  for (std::size_t i = 0; i < 8; ++i) {
    corners[i] = Vec3((i & 1) != 0 ? box.max.x : box.min.x, (i & 2) != 0 ? box.max.y : box.min.y,
                      (i & 4) != 0 ? box.max.z : box.min.z);
  }
  return corners;
}

Box3 boxOf(const std::vector<Vec3>& points) {
  Box3 box;
  for (const Vec3& p : points) box.extend(p);
  return box;
}

/// A mesh's bounds, and those of its morph targets' deltas.
struct Bounds {
  Box3 rest;
  std::vector<Box3> targets;
};

/// Keys of all channels and the moments between them, at most `count` of them.
std::vector<double> momentsOf(const Scene& scene, std::size_t count) {
  std::vector<double> times{0.0};
  for (const AnimationChannel& channel : scene.animation) {
    for (std::size_t k = 0; k < channel.times.size(); ++k) {
      times.push_back(channel.times[k]);
      // Cubic splines may swing beyond their keys
      if (k > 0 && channel.interpolation == Interpolation::CubicSpline) {
        times.push_back(0.5 * (double{channel.times[k - 1]} + double{channel.times[k]}));
      }
    }
  }
  std::sort(times.begin(), times.end());
  times.erase(std::unique(times.begin(), times.end()), times.end());
  if (times.size() <= count) return times;
  std::vector<double> some;
  for (std::size_t i = 0; i < count; ++i) {
    some.push_back(times[count < 2 ? 0 : i * (times.size() - 1) / (count - 1)]);
  }
  return some;
}

/// No product of factors may be so bright that sums of it overflow.
void checkBrightness(const Scene& scene) {
  const auto check = [&](const Vec3& value, const std::string& what) {
    if (glm::all(glm::lessThanEqual(value, Vec3(kMaxRadiance)))) return;  // false for NaN too
    throw SceneError(fmt::format("{}: {} is ({:.6g}, {:.6g}, {:.6g}); up to {:.6g} is allowed",
                                 scene.source.string(), what, value.x, value.y, value.z,
                                 kMaxRadiance));
  };
  for (const Light& light : scene.lights) {
    check(light.intensity, "the intensity of light \"" + light.name + "\"");
  }
  for (const Material& material : scene.materials) {
    check(material.emissive, "the emitted radiance of material \"" + material.name + "\"");
  }
  const Environment& sky = scene.environment;
  if (sky.type == EnvironmentType::File) return;  // its pixels are checked as they are read
  for (const Vec3& color : {sky.color, sky.horizon, sky.ground}) {
    check(sky.scale * color, "the environment's radiance");
  }
}

void checkObject(const Scene& scene, const Object& object, const Bounds& bounds, const Pose& pose) {
  if (bounds.rest.empty()) return;
  Box3 box = bounds.rest;
  if (object.node != kNone) {
    const std::vector<float>& weights = pose.morphWeights[index(object.node)];
    for (std::size_t t = 0; t < std::min(weights.size(), bounds.targets.size()); ++t) {
      if (bounds.targets[t].empty()) continue;
      const Vec3 a = weights[t] * bounds.targets[t].min;
      const Vec3 b = weights[t] * bounds.targets[t].max;
      box.min += glm::min(glm::min(a, b), Vec3(0.0f));
      box.max += glm::max(glm::max(a, b), Vec3(0.0f));
    }
  }
  const std::array<Vec3, 8> corners = cornersOf(box);
  const auto check = [&](const Mat4& m) {
    for (const Vec3& corner : corners) {
      const Vec3 p(m * Vec4(corner, 1.0f));
      if (isFar(p)) fail(scene, "object \"" + object.name + "\"", pose.timeSeconds, p);
    }
  };
  const int skin = object.node == kNone ? kNone : scene.nodes[index(object.node)].skin;
  if (skin != kNone && !scene.meshes[index(object.mesh)].joints.empty()) {
    // A skinned vertex lies among its places under each joint
    const Skin& joints = scene.skins[index(skin)];
    for (std::size_t j = 0; j < joints.joints.size(); ++j) {
      check(pose.worldFromNode[index(joints.joints[j])] * joints.inverseBind[j]);
    }
  } else {
    check((object.node == kNone ? Mat4(1.0f) : pose.worldFromNode[index(object.node)]) *
          object.nodeFromInstance);
  }
}

}  // namespace

void checkScene(const Scene& scene) {
  checkBrightness(scene);
  const auto unbaked = static_cast<std::size_t>(std::count_if(
      scene.lights.begin(), scene.lights.end(),
      [&](const Light& light) { return !light.baked || scene.bake.mode != BakeMode::Full; }));
  if (unbaked > kMaxUnbakedLights) {
    throw SceneError(scene.source.string() + ": the scene has " + std::to_string(unbaked) +
                     " lights that are not baked; at most " + std::to_string(kMaxUnbakedLights) +
                     " are allowed; set \"baked\": true for some of them");
  }
  for (const Light& light : scene.lights) {
    if (light.node == kNone && isFar(light.position)) {
      fail(scene, "light \"" + light.name + "\"", 0.0, light.position);
    }
  }

  std::vector<Bounds> bounds(scene.meshes.size());
  for (std::size_t m = 0; m < bounds.size(); ++m) {
    bounds[m].rest = boxOf(scene.meshes[m].positions);
    for (const MorphTarget& target : scene.meshes[m].morphTargets) {
      bounds[m].targets.push_back(boxOf(target.positions));
    }
  }
  const std::size_t matrices = scene.nodes.size() + scene.objects.size() + 1;
  for (const double time : momentsOf(scene, std::max(kMaxMatrices / matrices, std::size_t{3}))) {
    const Pose pose = poseAt(scene, time);
    for (const Object& object : scene.objects) {
      checkObject(scene, object, bounds[index(object.mesh)], pose);
    }
    for (std::size_t n = 0; n < scene.nodes.size(); ++n) {
      const Vec3 p(pose.worldFromNode[n][3]);
      if (isFar(p)) fail(scene, "node \"" + scene.nodes[n].name + "\"", time, p);
    }
  }
}

}  // namespace catoptric::scene
