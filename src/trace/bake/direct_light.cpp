#include <algorithm>
#include <cmath>
#include <vector>

#include "core/parallel.h"
#include "scene/animate.h"
#include "trace/bake/baker.h"

namespace catoptric::trace {
namespace {

/// Below this radius, in distances of the light, its disk is sampled by a ring alone; ours.
constexpr float kSmallLight = 0.1f;

Vec2 onCircle(float turns) {
  const float angle = 2.0f * kPi * turns;
  return {std::cos(angle), std::sin(angle)};
}

/// A light that is baked, at the pose of the geometry.
struct BakedLight {
  frame::WorldLight light;
  float radius = 0.0f;  ///< metres; of a directional light at one metre
};

/// What a point sees of a light.
enum class Seen : std::uint8_t {
  Nothing,  ///< whatever lies between: the point or the light faces away, or it is too far
  None,
  Part,
  All,
};

/// Samples one light from one point after the other, for one thread.
class LightSampler {
 public:
  LightSampler(const TraceScene& trace, const frame::Geometry& geometry)
      : trace_(trace),
        farAway_(2.0f * geometry.bounds.diameter()),
        disk_(kShadowRays),
        rim_(kRimRays) {
    for (int k = 0; k < kRimRays; ++k)
      rim_[k] = onCircle(static_cast<float>(k) / static_cast<float>(kRimRays));
    // Vogel's spiral: even over the disk, and in any half of it
    for (int k = 0; k < kShadowRays; ++k) {
      const float share = (static_cast<float>(k) + 0.5f) / static_cast<float>(kShadowRays);
      disk_[k] = std::sqrt(share) * onCircle(fraction(k * kGolden));
    }
  }

  std::uint64_t traced() const { return traced_; }
  std::uint64_t refused() const { return refused_; }

  /// The light and the point that the next calls are about. Places on the light are turned by
  /// `turns`, 0..1.
  void set(const BakedLight& light, const Vec3& position, const Vec3& normal, float turns) {
    light_ = &light;
    position_ = position;
    normal_ = normal;
    turn_ = onCircle(turns);
    const bool directional = light.light.type == scene::LightType::Directional;
    toLight_ = directional ? -light.light.direction : light.light.position - position;
    distance_ = glm::length(toLight_);
  }

  /// By rays to `count` places of the emitter's rim, evenly spaced; to its middle where it has no
  /// radius.
  Seen look(int count) {
    if (!mayArrive()) return Seen::Nothing;
    const Basis basis(toLight_ / distance_);
    if (!(light_->radius > 0.0f)) {
      aim(0, basis, Vec2(0.0f));
      return countFree(1) == 1 ? Seen::All : Seen::None;
    }
    for (int k = 0; k < count; ++k) aim(k, basis, turned(rim_[k * kRimRays / count]));
    const auto free = countFree(count);
    return free == 0 ? Seen::None : free == count ? Seen::All : Seen::Part;
  }

  /// Irradiance where that much is seen; where a part is, by rays.
  Vec3 irradiance(Seen seen) {
    if (seen == Seen::Nothing || seen == Seen::None) return Vec3(0.0f);
    const Basis basis(toLight_ / distance_);
    if (!(light_->radius > 0.0f)) {
      aim(0, basis, Vec2(0.0f));
      return arriving_[0];
    }
    // Without shadows the irradiance of a small light is nearly linear over its disk.
    const bool ring = seen == Seen::All && light_->radius < kSmallLight * distance_;
    const int count = ring ? kRimRays : kShadowRays;
    for (int k = 0; k < count; ++k)
      aim(k, basis, turned(ring ? std::sqrt(0.5f) * rim_[k] : disk_[k]));
    if (seen == Seen::Part) countFree(count);
    Vec3 sum(0.0f);
    for (int k = 0; k < count; ++k) {
      if (seen == Seen::All || free_[k] != 0) sum += arriving_[k];
    }
    return sum / static_cast<float>(count);
  }

 private:
  /// False: lightIrradiance() is 0 for every place of the emitter's disk.
  bool mayArrive() const {
    const float radius = light_->radius;
    if (!(distance_ > 0.0f) || !(glm::dot(normal_, toLight_) > -radius)) return false;
    const frame::WorldLight& light = light_->light;
    if (light.type == scene::LightType::Directional) return true;
    if (light.range > 0.0f && distance_ >= light.range) return false;
    if (light.type != scene::LightType::Spot) return true;
    const float cosine = -glm::dot(toLight_, light.direction) / distance_;
    const float disk = std::atan2(radius, distance_);
    constexpr float kRounding = 1e-3f;  // radians
    return std::acos(std::clamp(cosine, -1.0f, 1.0f)) - disk <
           std::acos(light.cosOuter) + kRounding;
  }

  Vec2 turned(const Vec2& p) const {
    return {turn_.x * p.x - turn_.y * p.y, turn_.x * p.y + turn_.y * p.x};
  }

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
        trace_.visibleSerial(std::span(rays_).first(count), std::span(free_).first(count), false)
            .refused;
    traced_ += static_cast<std::uint64_t>(count);
    return std::count(free_.begin(), free_.begin() + count, 1);
  }

  const TraceScene& trace_;
  float farAway_;
  std::vector<Vec2> disk_;
  std::vector<Vec2> rim_;
  const BakedLight* light_ = nullptr;
  Vec3 position_{0.0f};
  Vec3 normal_{0.0f};
  Vec2 turn_{1.0f, 0.0f};
  Vec3 toLight_{0.0f};
  float distance_ = 0.0f;
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
  std::vector<Seen> glance(points_.size());
  const auto forPoints = [&](const BakedLight& light, auto&& work) {
    parallelFor(points_.size(), kPointsPerTask, [&](std::size_t begin, std::size_t end) {
      if (stopped()) return;
      LightSampler sampler(trace_, geometry_);
      for (std::size_t i = begin; i < end; ++i) {
        sampler.set(light, points_.positions[i], points_.normals[i],
                    sequenceShift(points_.ranks[i]).x);
        work(sampler, i);
      }
      rays_ += sampler.traced();
      refused_ += sampler.refused();
      advance((end - begin) * kShadowRays / (2 * lights.size()));
    });
  };
  for (const BakedLight& light : lights) {
    forPoints(light,
              [&](LightSampler& sampler, std::size_t i) { glance[i] = sampler.look(kGlanceRays); });
    // Where neighbours see the same as a glance, there is no penumbra; else the rim tells
    forPoints(light, [&](LightSampler& sampler, std::size_t i) {
      const Seen seen = glance[i];
      const std::span<const std::uint32_t> neighbours = points_.neighboursOf(i);
      const bool agree = !neighbours.empty() && std::ranges::all_of(neighbours, [&](auto n) {
        return glance[n] == seen || glance[n] == Seen::Nothing;
      });
      const bool sure = seen == Seen::Nothing || (agree && seen != Seen::Part);
      values[i] += sampler.irradiance(sure ? seen : sampler.look(kRimRays));
    });
  }
  return values;
}

}  // namespace catoptric::trace
