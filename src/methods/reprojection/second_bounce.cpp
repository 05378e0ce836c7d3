#include "methods/reprojection/second_bounce.h"

#include <algorithm>
#include <cmath>

#include "core/parallel.h"

namespace catoptric::methods::reprojection {
namespace {

constexpr std::size_t kRaysPerTask = 2048;

/// Second mirror and what it shows are one id of KeyFrame: ids up to here, each (ours).
constexpr int kMostObjects = 1 << 15;

/// How far a ray that goes on may be off its mirrored direction: bent normals, lobes and bodies
/// that refract send it elsewhere (ours).
constexpr float kMirrored = 1e-4f;

std::size_t sampleAt(const KeyFrame& key, const Vec2& place) {
  const Vec2 nearest = glm::floor(place + 0.5f);
  return key.index(static_cast<int>(nearest.x), static_cast<int>(nearest.y));
}

bool reflects(std::uint32_t id, const scene::Scene& scene) {
  return id != 0 && scene.objects[id - 1].reflector != 0;
}

}  // namespace

bool SecondBounce::used(const frame::Geometry& geometry) const {
  return used_ && geometry.objects.size() < static_cast<std::size_t>(kMostObjects) &&
         std::none_of(geometry.objects.begin(), geometry.objects.end(),
                      [](const frame::ObjectRange& range) { return range.moving; });
}

void SecondBounce::begin(int width, int height, const scene::Camera& camera,
                         const frame::Lighting& lighting, const frame::Geometry& geometry) {
  key_.begin(width, height, camera, lighting, geometry, true);
}

bool SecondBounce::keep(std::size_t at, const trace::ReflectionPoint& point,
                        const trace::FirstHit& hit, const trace::SecondHit& second,
                        const scene::Scene& scene) {
  if (second.direction == Vec3(0.0f)) return false;
  const Vec3 off = second.direction - glm::reflect(hit.direction, glm::normalize(second.normal));
  if (!(glm::dot(off, off) <= kMirrored * kMirrored)) return false;
  // A third bounce depends on more than the place.
  if (!second.hit.miss() && options_.bounces > 2 &&
      reflects(static_cast<std::uint32_t>(second.hit.object + 1), scene))
    return false;
  trace::ReflectionPoint mirror = point;
  mirror.normal = second.normal;
  trace::FirstHit unfolded = hit;
  unfolded.hit = second.hit;
  if (!second.hit.miss()) {
    unfolded.hit.object = (hit.hit.object + 1) * kMostObjects + second.hit.object;
    unfolded.hit.distance = hit.hit.distance + second.hit.distance;
  }
  key_.keep(at, mirror, unfolded, second.arrived);
  return true;
}

void SecondBounce::finish(const frame::Geometry& geometry, float epsilon) {
  key_.finish(geometry, epsilon);
}

bool SecondBounce::faithful(std::size_t i, const KeyFrame& key, const Match& first) const {
  const std::size_t at = sampleAt(key_, reuse_.match(i).place);
  const std::size_t mirror = sampleAt(key, first.place);
  if (key.surface(at) != key.surface(mirror)) return false;
  if (at == mirror) return true;
  // A mirror that is turned by an angle, or lies off by a distance, moves what it shows by twice of
  // it.
  const float width = scene::pixelSpreadRad(key.camera(), key.height());
  const Vec3 apart = Vec3(key.place(mirror)) - Vec3(key.place(at));
  const float off = std::abs(glm::dot(key_.normal(at), apart));
  const float turned = glm::distance(key_.normal(at), key_.normal(mirror));
  if (key_.shown(at) == 0) return 2.0f * turned <= options_.fidelity * width;
  const float beyond = std::max(0.0f, key_.length(at) - key.length(at));
  return 2.0f * (off + turned * beyond) <= options_.fidelity * width * key_.length(at);
}

void SecondBounce::find(const MirrorSamples& samples, const KeyFrame& key, Reuse& first,
                        Services& services, std::vector<Vec3>& radiance) {
  if (key_.empty() || !used(services.geometry)) return;
  bool any = false;
  rays_.assign(samples.rays().begin(), samples.rays().end());
  for (std::size_t i = 0; i < rays_.size(); ++i) {
    const bool asked = first.outcome(i) == Outcome::Found &&
                       reflects(key.shown(sampleAt(key, first.match(i).place)), services.scene);
    if (!asked) rays_[i].reflector = 0;
    any = any || asked;
  }
  if (!any) return;
  radiance_.assign(rays_.size(), Vec3(0.0f));
  reuse_.begin(samples, services, rays_);
  reuse_.findIn(key_, services, radiance_);
  services.timer.measure("warp", [&] {
    parallelFor(rays_.size(), kRaysPerTask, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        if (rays_[i].reflector == 0) continue;
        if (reuse_.outcome(i) == Outcome::Found && faithful(i, key, first.match(i))) {
          radiance[i] += radiance_[i];
        } else {
          first.lose(i, Outcome::SecondBounce);
          radiance[i] = Vec3(0.0f);
        }
      }
    });
  });
}

}  // namespace catoptric::methods::reprojection
