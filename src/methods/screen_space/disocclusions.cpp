#include "methods/screen_space/disocclusions.h"

#include <algorithm>
#include <cmath>
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

/// Where the frame would show a place: x, y in samples, z metres along the axis.
class Projection {
 public:
  Projection(const raster::GBufferCopy& gbuffer, const scene::Camera& camera)
      : gbuffer_(gbuffer),
        nearMetres_(camera.nearMetres),
        eye_(camera.eye()),
        pixelFromRay_(glm::inverse(
            scene::rayFromPixel(camera, gbuffer.sampleWidth(), gbuffer.sampleHeight()))) {}

  Vec3 operator()(const Vec3& place) const {
    const Vec3 p = pixelFromRay_ * (place - eye_);
    return {p.x / p.z, p.y / p.z, p.z};
  }

  bool isShown(const Vec3& at, int object) const {
    if (!(at.z > 0.0f && at.x >= 0.0f && at.y >= 0.0f &&
          at.x < static_cast<float>(gbuffer_.sampleWidth()) &&
          at.y < static_cast<float>(gbuffer_.sampleHeight())))
      return false;
    const std::size_t sample =
        static_cast<std::size_t>(at.y) * static_cast<std::size_t>(gbuffer_.sampleWidth()) +
        static_cast<std::size_t>(at.x);
    return gbuffer_.object[sample] == static_cast<std::uint32_t>(object) + 1 &&
           agrees(gbuffer_.depth[sample], at.z, kShownShare);
  }

  /// Whether the ray of `end` hit the sample that shows the place.
  bool isHit(const Vec3& at, std::uint32_t end) const {
    const std::uint32_t x = end >> 4 & 0x3FFFu;
    const std::uint32_t y = end >> 18;
    const std::size_t sample =
        std::size_t{y} * static_cast<std::size_t>(gbuffer_.sampleWidth()) + x;
    const Vec2 away = Vec2(at) - Vec2(static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f);
    return at.z > 0.0f && glm::length(away) <= kWrongSamples &&
           agrees(gbuffer_.depth[sample], at.z, kWrongShare);
  }

 private:
  bool agrees(float depth, float metres, float share) const {
    const float shown = nearMetres_ / std::max(depth, 1e-30f);
    return std::abs(shown - metres) <= share * std::max(shown, metres);
  }

  const raster::GBufferCopy& gbuffer_;
  float nearMetres_;
  Vec3 eye_;
  Mat3 pixelFromRay_;
};

}  // namespace

Disocclusions findDisocclusions(const raster::GBufferCopy& gbuffer, const scene::Camera& camera,
                                std::span<const std::uint32_t> ends, const trace::TraceScene& trace,
                                std::span<std::uint16_t> masks) {
  const auto width = static_cast<std::size_t>(gbuffer.sampleWidth());
  const SamplePoints pointAt(gbuffer, camera, trace);
  const Projection projection(gbuffer, camera);
  const auto height = static_cast<std::size_t>(gbuffer.sampleHeight());
  return sumOverRows<Disocclusions>(height, [&](std::size_t y, AskedRays& asked) {
    std::vector<std::size_t> samples;
    for (std::size_t x = 0; x < width; ++x) {
      if (ends[y * width + x] == 0) continue;
      trace::ReflectionPoint point = pointAt(static_cast<int>(x), static_cast<int>(y));
      trace::moveOntoSurface(trace, point);
      asked.rays.push_back(trace::lobeRay(point, 0, 1).ray);
      samples.push_back(y * width + x);
    }
    asked.ask(trace);
    Disocclusions counted;
    for (std::size_t k = 0; k < samples.size(); ++k) {
      const trace::Ray& ray = asked.rays[k];
      const trace::Hit& hit = asked.hits[k];
      const std::uint32_t end = ends[samples[k]];
      const Vec3 at = projection(ray.origin + hit.distance * ray.direction);
      const bool found = (end & 15u) == 1u + static_cast<std::uint32_t>(kHit);
      const bool wrong = found ? hit.miss() || !projection.isHit(at, end) : !hit.miss();
      if (!wrong) continue;
      counted.wrongHits += found ? 1 : 0;
      counted.disoccluded += found ? 0 : 1;
      counted.missedHits += !found && projection.isShown(at, hit.object) ? 1 : 0;
      if (!masks.empty()) masks[samples[k]] |= raster::kMaskDisoccluded;
    }
    return counted;
  });
}

}  // namespace catoptric::methods::screen_space
