#include "methods/screen_space/disocclusions.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "methods/shared/sample_points.h"
#include "methods/shared/sample_questions.h"
#include "trace/lobes/reflect.h"

namespace catoptric::methods::screen_space {
namespace {

#include "methods/screen_space/shaders/constants.glsl"

/// A hit is wrong when Embree's lies more samples away in the frame, or a larger share of its
/// depth, as in second_order: along the ray they may differ more. Ours.
constexpr float kWrongSamples = 2.0f;
constexpr float kWrongShare = 0.25f;
/// The frame shows a place if its sample has the same object at the same depth, but for this share.
constexpr float kShownShare = 0.02f;

/// kHit, ... or kSecondHit, of an end as it is stored.
int endOf(std::uint32_t stored) {
  return static_cast<int>(stored & 15u) - 1;
}

/// Where the frame would show a place: x, y in samples, z metres along the axis.
class Projection {
 public:
  Projection(const raster::GBufferCopy& gbuffer, const FollowedRays& followed,
             const scene::Camera& camera)
      : gbuffer_(gbuffer),
        followed_(followed),
        nearMetres_(camera.nearMetres),
        eye_(camera.eye()),
        pixelFromRay_(glm::inverse(
            scene::rayFromPixel(camera, gbuffer.sampleWidth(), gbuffer.sampleHeight()))) {}

  Vec3 operator()(const Vec3& place) const {
    const Vec3 p = pixelFromRay_ * (place - eye_);
    return {p.x / p.z, p.y / p.z, p.z};
  }

  /// Whether a layer shows the place.
  bool isShown(const Vec3& at, int object) const {
    if (!(at.z > 0.0f && at.x >= 0.0f && at.y >= 0.0f &&
          at.x < static_cast<float>(gbuffer_.sampleWidth()) &&
          at.y < static_cast<float>(gbuffer_.sampleHeight())))
      return false;
    const std::size_t sample =
        static_cast<std::size_t>(at.y) * static_cast<std::size_t>(gbuffer_.sampleWidth()) +
        static_cast<std::size_t>(at.x);
    const auto shows = [&](std::span<const std::uint32_t> objects, std::span<const float> depths) {
      return !objects.empty() && objects[sample] == static_cast<std::uint32_t>(object) + 1 &&
             agrees(depths[sample], at.z, kShownShare);
    };
    return shows(gbuffer_.object, gbuffer_.depth) ||
           shows(followed_.secondObject, followed_.secondDepth);
  }

  /// Whether the ray of `end` hit the sample that shows the place.
  bool isHit(const Vec3& at, std::uint32_t end) const {
    const std::uint32_t x = end >> 4 & 0x3FFFu;
    const std::uint32_t y = end >> 18;
    const std::size_t sample =
        std::size_t{y} * static_cast<std::size_t>(gbuffer_.sampleWidth()) + x;
    const Vec2 away = Vec2(at) - Vec2(static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f);
    const std::vector<float>& depths =
        endOf(end) == kSecondHit ? followed_.secondDepth : gbuffer_.depth;
    return at.z > 0.0f && glm::length(away) <= kWrongSamples &&
           agrees(depths[sample], at.z, kWrongShare);
  }

 private:
  bool agrees(float depth, float metres, float share) const {
    const float shown = nearMetres_ / std::max(depth, 1e-30f);
    return std::abs(shown - metres) <= share * std::max(shown, metres);
  }

  const raster::GBufferCopy& gbuffer_;
  const FollowedRays& followed_;
  float nearMetres_;
  Vec3 eye_;
  Mat3 pixelFromRay_;
};

/// Ray `index` of a point's lobe, or the ray of its cone, as in reflect.frag.
trace::Ray rayOf(const trace::ReflectionPoint& point, int index, const FollowedRays& followed) {
  const int count = trace::lobeRays(point.lobe, followed.rays);
  trace::Ray ray = trace::lobeRay(point, index, count).ray;
  if (!followed.cone || count == 1) return ray;
  Vec3 middle(0.0f);
  for (int i = 0; i < count; ++i) {
    const trace::LobeRay made = trace::lobeDirection(point, i, count);
    middle += made.weight * made.direction;
  }
  ray.direction = glm::normalize(middle);
  return ray;
}

/// Whether a ray hits the side of a triangle that the eye is on.
bool hitsSideOf(const Vec3& eye, const trace::Ray& ray, const trace::Hit& hit,
                const frame::Geometry& geometry) {
  const std::uint32_t first = geometry.objects[hit.object].firstIndex + 3 * hit.primitive;
  const auto corner = [&](std::uint32_t k) {
    return geometry.positions[geometry.indices[first + k]];
  };
  const Vec3 normal = glm::cross(corner(1) - corner(0), corner(2) - corner(0));
  return glm::dot(normal, ray.direction) * glm::dot(normal, corner(0) - eye) > 0.0f;
}

}  // namespace

Disocclusions findDisocclusions(const raster::GBufferCopy& gbuffer, const scene::Camera& camera,
                                const FollowedRays& followed, const trace::TraceScene& trace,
                                std::span<std::uint16_t> masks) {
  const auto width = static_cast<std::size_t>(gbuffer.sampleWidth());
  const auto height = static_cast<std::size_t>(gbuffer.sampleHeight());
  const std::size_t perLobe = followed.ends.size() / (width * height);
  const SamplePoints pointAt(gbuffer, camera, trace);
  const Projection projection(gbuffer, followed, camera);
  return sumOverRows<Disocclusions>(height, [&](std::size_t y, AskedRays& asked) {
    std::vector<std::pair<std::size_t, std::uint32_t>> asking;  // sample, end
    for (std::size_t at = y * width; at < (y + 1) * width; ++at) {
      // A ray of weight 0 is not followed
      const auto stored = [&](std::size_t ray) { return followed.ends[ray * width * height + at]; };
      std::size_t first = 0;
      while (first < perLobe && stored(first) == 0) ++first;
      if (first == perLobe) continue;
      trace::ReflectionPoint point = pointAt(static_cast<int>(at - y * width), static_cast<int>(y));
      trace::moveOntoSurface(trace, point);
      for (std::size_t ray = first; ray < perLobe; ++ray) {
        if (stored(ray) == 0) continue;
        asked.rays.push_back(rayOf(point, static_cast<int>(ray), followed));
        asking.emplace_back(at, stored(ray));
      }
    }
    asked.ask(trace);
    Disocclusions counted;
    for (std::size_t k = 0; k < asking.size(); ++k) {
      const auto& [sample, followedTo] = asking[k];
      const trace::Ray& ray = asked.rays[k];
      const trace::Hit& hit = asked.hits[k];
      const Vec3 at = projection(ray.origin + hit.distance * ray.direction);
      const int end = endOf(followedTo);
      const bool found = end == kHit || end == kSecondHit;
      const bool wrong = found ? hit.miss() || !projection.isHit(at, followedTo) : !hit.miss();
      if (!wrong) continue;
      counted.wrongHits += found ? 1 : 0;
      counted.disoccluded += found ? 0 : 1;
      const bool isShown = !found && projection.isShown(at, hit.object) &&
                           hitsSideOf(camera.eye(), ray, hit, trace.geometry());
      counted.missedHits += isShown ? 1 : 0;
      if (!masks.empty()) masks[sample] |= raster::kMaskDisoccluded;
    }
    return counted;
  });
}

}  // namespace catoptric::methods::screen_space
