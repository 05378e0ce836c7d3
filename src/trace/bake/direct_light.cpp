#include <algorithm>
#include <cmath>
#include <vector>

#include "core/parallel.h"
#include "core/sampling.h"
#include "scene/animate.h"
#include "trace/bake/baker.h"

namespace catoptric::trace {
namespace {

/// A light that is baked, at the pose of the geometry.
struct BakedLight {
  frame::WorldLight light;
  float radius = 0.0f;  ///< metres; of a directional light at one metre
};

/// Samples one light from one point after the other, for one thread.
class LightSampler {
 public:
  LightSampler(const TraceScene& trace, const frame::Geometry& geometry)
      : trace_(trace),
        farAway_(2.0f * geometry.bounds.diameter()),
        lattice_(latticePoints(kShadowRays)) {}

  std::uint64_t traced() const { return traced_; }
  std::uint64_t refused() const { return refused_; }

  /// Irradiance at a point, shadows included.
  Vec3 irradiance(const BakedLight& light, const Vec3& position, const Vec3& normal,
                  const Vec2& shift) {
    light_ = &light;
    position_ = position;
    normal_ = normal;
    const bool directional = light.light.type == scene::LightType::Directional;
    toLight_ = directional ? -light.light.direction : light.light.position - position;
    const float distance = glm::length(toLight_);
    if (!(distance > 0.0f)) return Vec3(0.0f);
    const Basis basis(toLight_ / distance);
    if (!(light.radius > 0.0f)) {
      aim(0, basis, Vec2(0.0f));
      const bool lit = glm::any(glm::greaterThan(arriving_[0], Vec3(0.0f))) && countFree(1) == 1;
      return lit ? arriving_[0] : Vec3(0.0f);
    }
    // Where the emitter's whole rim is seen, or none of it, there is no penumbra.
    for (int k = 0; k < kRimRays; ++k) {
      const float angle = 2.0f * kPi * (static_cast<float>(k) + shift.x) / kRimRays;
      aim(k, basis, {std::cos(angle), std::sin(angle)});
    }
    const auto rim = countFree(kRimRays);
    if (rim == 0) return Vec3(0.0f);
    for (int k = 0; k < kShadowRays; ++k)
      aim(k, basis, concentricDisk(shifted(lattice_[k], shift)));
    if (rim < kRimRays) {
      countFree(kShadowRays);
    } else {
      std::fill(free_.begin(), free_.end(), std::uint8_t{1});
    }
    Vec3 sum(0.0f);
    for (int k = 0; k < kShadowRays; ++k) {
      if (free_[k] != 0) sum += arriving_[k];
    }
    return sum / static_cast<float>(kShadowRays);
  }

 private:
  /// Ray `k` towards a place of the emitter's disk as the point sees it. Whatever lies within the
  /// emitter's radius casts no shadow.
  void aim(int k, const Basis& basis, const Vec2& disk) {
    const float radius = light_->radius;
    const Vec3 aside = radius * (basis.x * disk.x + basis.y * disk.y);
    frame::WorldLight sample = light_->light;
    if (sample.type == scene::LightType::Directional) {
      const Vec3 d = glm::normalize(toLight_ + aside);
      sample.direction = -d;
      rays_[k] = {position_, d, 0.0f, farAway_};
    } else {
      sample.position += aside;
      const Vec3 to = sample.position - position_;
      const float depth = radius * std::sqrt(std::max(0.0f, 1.0f - glm::dot(disk, disk)));
      const float length = glm::length(to);
      rays_[k] = {position_, to, 0.0f,
                  length > 0.0f ? std::max(0.0f, 1.0f - depth / length) : 0.0f};
    }
    arriving_[k] = frame::lightIrradiance(sample, position_, normal_);
  }

  std::ptrdiff_t countFree(int count) {
    refused_ +=
        trace_.visibleSerial(std::span(rays_).first(count), std::span(free_).first(count), true)
            .refused;
    traced_ += static_cast<std::uint64_t>(count);
    return std::count(free_.begin(), free_.begin() + count, 1);
  }

  const TraceScene& trace_;
  float farAway_;
  std::vector<Vec2> lattice_;
  const BakedLight* light_ = nullptr;
  Vec3 position_{0.0f};
  Vec3 normal_{0.0f};
  Vec3 toLight_{0.0f};
  std::vector<Ray> rays_ = std::vector<Ray>(kShadowRays);
  std::vector<Vec3> arriving_ = std::vector<Vec3>(kShadowRays);
  std::vector<std::uint8_t> free_ = std::vector<std::uint8_t>(kShadowRays);
  std::uint64_t traced_ = 0;
  std::uint64_t refused_ = 0;
};

}  // namespace

std::vector<Vec3> Baker::directLight() {
  const scene::Pose pose = scene::poseAt(scene_, geometry_.timeSeconds);
  std::vector<BakedLight> lights;
  for (const scene::Light& light : scene_.lights)
    if (light.baked) lights.push_back({frame::worldLight(light, pose), light.radius});
  std::vector<Vec3> values(points_.size(), Vec3(0.0f));
  if (!lights.empty())
    parallelFor(points_.size(), kPointsPerTask, [&](std::size_t begin, std::size_t end) {
      if (stopped()) return;
      LightSampler sampler(trace_, geometry_);
      for (std::size_t i = begin; i < end; ++i) {
        const Vec2 shift = shiftOf(i);
        for (const BakedLight& light : lights)
          values[i] += sampler.irradiance(light, points_.positions[i], points_.normals[i], shift);
      }
      rays_ += sampler.traced();
      refused_ += sampler.refused();
      advance((end - begin) * kShadowRays);
    });
  return values;
}

}  // namespace catoptric::trace
