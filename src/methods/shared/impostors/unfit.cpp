#include "methods/shared/impostors/unfit.h"

#include <algorithm>
#include <cmath>

#include "core/parallel.h"
#include "trace/embree/trace_scene.h"

namespace catoptric::methods::impostors {
namespace {

/// A reflector is unfit if it reflects more of itself. Ours, measured in docs/papers/impostors.md.
constexpr float kMostOfItself = 0.125f;
/// Or if the predicted errors of its billboards sum to more: to those of a hemisphere full of
/// billboards that are off by 45 degrees, sr rad. Ours, measured there, too.
constexpr float kMostOfBillboards = 2.0f * kPi * 0.25f * kPi;

constexpr int kCheckedPoints = 128;  ///< on a surface; ours
constexpr int kPairs = 8;            ///< of directions, on each side of a point; ours
/// Share of the object's diameter below which heights are rounding, and rays hit nothing. Ours.
constexpr float kRounding = 1e-4f;

/// Whether no point lies in front of another one's surface.
bool convex(const std::vector<SurfacePoint>& points, float roundingMetres) {
  return std::ranges::none_of(points, [&](const SurfacePoint& from) {
    return std::ranges::any_of(points, [&](const SurfacePoint& to) {
      return glm::dot(from.normal, to.place - from.place) > roundingMetres;
    });
  });
}

/// Adds pairs of rays that mirror each other about the normal, on both sides of a surface, with a
/// density proportional to the cosine.
void addPairs(const SurfacePoint& from, float turnRad, float near, std::vector<trace::Ray>& rays) {
  constexpr float kGoldenRad = 2.3999632f;
  const Vec3 axis = std::abs(from.normal.y) < 0.9f ? Vec3(0, 1, 0) : Vec3(1, 0, 0);
  const Vec3 right = glm::normalize(glm::cross(from.normal, axis));
  const Vec3 up = glm::cross(from.normal, right);
  for (int i = 0; i < kPairs; ++i) {
    const float sine2 = (static_cast<float>(i) + 0.5f) / static_cast<float>(kPairs);
    const float turn = turnRad + kGoldenRad * static_cast<float>(i);
    const Vec3 across = std::sqrt(sine2) * (std::cos(turn) * right + std::sin(turn) * up);
    const Vec3 along = std::sqrt(1.0f - sine2) * from.normal;
    for (const Vec3& side : {along, -along})
      for (const Vec3& direction : {side + across, side - across})
        rays.push_back({.origin = from.place, .direction = direction, .near = near});
  }
}

}  // namespace

float selfReflection(const scene::Scene& scene, const frame::Geometry& geometry, int object) {
  const std::vector<SurfacePoint> points = pointsOn(geometry, object, kCheckedPoints);
  const float rounding =
      kRounding * geometry.objects[static_cast<std::size_t>(object)].bounds.diameter();
  if (convex(points, rounding)) return 0.0f;
  std::vector<trace::Ray> rays;
  for (std::size_t i = 0; i < points.size(); ++i)
    addPairs(points[i], static_cast<float>(i), rounding, rays);
  const trace::TraceScene itself(scene, geometry, trace::BvhPolicy::RebuildLow,
                                 {.objects = {object}, .extents = false});
  std::vector<std::uint8_t> free(rays.size());
  itself.visibleSerial(rays, free);
  // A ray that leaves the object is a line of sight; its pair is the mirrored ray
  std::uint64_t seen = 0;
  std::uint64_t again = 0;
  for (std::size_t i = 0; i < free.size(); i += 2) {
    seen += std::uint64_t{free[i]} + free[i + 1];
    again += free[i] != free[i + 1] ? 1 : 0;
  }
  return seen > 0 ? static_cast<float>(again) / static_cast<float>(seen) : 0.0f;
}

std::vector<Unfit> unfitReflectors(const Options& options, const scene::Scene& scene,
                                   const frame::Geometry& geometry, const Choice& choice,
                                   const std::vector<bool>& reflects) {
  std::vector<Unfit> unfit(reflects.size(), Unfit::No);
  // Tracing took 18 times as long as images there (user_formula)
  if (!geometry.surfaces.empty()) return unfit;
  parallelFor(reflects.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t o = begin; o < end; ++o) {
      if (!reflects[o]) continue;
      if (choice.billboardErrors[o] > kMostOfBillboards)
        unfit[o] = Unfit::Near;
      else if (options.selfMaps == 0 &&
               selfReflection(scene, geometry, static_cast<int>(o)) > kMostOfItself)
        unfit[o] = Unfit::Itself;
    }
  });
  return unfit;
}

}  // namespace catoptric::methods::impostors
