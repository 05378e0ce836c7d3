#include "methods/second_order/disocclusions.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "methods/shared/sample_points.h"
#include "methods/shared/sample_questions.h"
#include "trace/lobes/reflect.h"

namespace catoptric::methods::second_order {
namespace {

/// A hit is of another surface when Embree's, seen by the cluster's camera, lies more texels or a
/// larger share of the distance away. Along the ray they may differ more: rays that nearly pass the
/// camera's eye cross many metres of depth within a texel. Ours.
constexpr float kWrongTexels = 2.0f;
constexpr float kWrongShare = 0.25f;

/// Whether the texel that a ray found shows the surface at `position` (from the frame's eye).
bool shows(const ClusterCamera& camera, const std::array<float, 3>& at, const Vec3& position) {
  const Vec4 p(position, 1.0f);
  const float w = glm::dot(camera.rowW, p);
  if (!(w > 0.0f)) return false;
  const Vec2 texel = Vec2(glm::dot(camera.rowX, p), glm::dot(camera.rowY, p)) / w;
  const float expected = camera.aboveHorizon / w;
  const Vec2 found(at[0], at[1]);
  return glm::distance(texel, found) <= kWrongTexels &&
         std::abs(at[2] - expected) <= kWrongShare * std::max(expected, at[2]);
}

struct Question {
  std::size_t sample = 0;
  bool nothing = false;
};

}  // namespace

Disocclusions findDisocclusions(const raster::GBufferCopy& gbuffer, const scene::Camera& camera,
                                std::span<const FoundByRays> found,
                                std::span<const std::uint16_t> clusterOf,
                                std::span<const ClusterCamera> cameras, int rays,
                                const trace::TraceScene& trace, std::span<std::uint16_t> masks) {
  const auto width = static_cast<std::size_t>(gbuffer.sampleWidth());
  const auto height = static_cast<std::size_t>(gbuffer.sampleHeight());
  const SamplePoints pointAt(gbuffer, camera, trace);
  return sumOverRows<Disocclusions>(height, [&](std::size_t y, AskedRays& asked) {
    std::vector<Question> questions;
    for (std::size_t x = 0; x < width; ++x) {
      const std::size_t at = y * width + x;
      const FoundByRays& f = found[at];
      if (f.nothing[0] == 0 && f.nothing[1] == 0 && !(f.at[2] > 0.0f)) continue;

      trace::ReflectionPoint point = pointAt(static_cast<int>(x), static_cast<int>(y));
      trace::moveOntoSurface(trace, point);
      const int count = trace::lobeRays(point.lobe, rays);
      for (int k = 0; k < count; ++k) {
        const bool nothing = (f.nothing[static_cast<std::size_t>(k) / 32] >> (k % 32) & 1u) != 0;
        if (!nothing && !(f.at[2] > 0.0f)) continue;
        asked.rays.push_back(trace::lobeRay(point, k, count).ray);
        questions.push_back({at, nothing});
      }
    }
    asked.ask(trace);
    Disocclusions counted;
    std::size_t last = static_cast<std::size_t>(-1);  // sample counted as disoccluded
    for (std::size_t k = 0; k < questions.size(); ++k) {
      const auto [at, nothing] = questions[k];
      const trace::Ray& ray = asked.rays[k];
      const trace::Hit& hit = asked.hits[k];
      if (!nothing) {
        const Vec3 position = ray.origin + hit.distance * ray.direction - camera.eye();
        const ClusterCamera& made = cameras[clusterOf[at] - 2u];
        counted.wrongHits += hit.miss() || !shows(made, found[at].at, position) ? 1 : 0;
      } else if (!hit.miss() && at != last) {
        last = at;
        ++counted.samples;
        if (!masks.empty()) masks[at] |= raster::kMaskDisoccluded;
      }
    }
    return counted;
  });
}

}  // namespace catoptric::methods::second_order
