#include "trace/lobes/reflect.h"

#include <algorithm>
#include <atomic>
#include <cassert>
#include <cmath>
#include <functional>
#include <optional>
#include <vector>

#include "core/basis.h"
#include "core/clock.h"
#include "core/parallel.h"
#include "core/sampling.h"
#include "scene/implicit/gradient.h"
#include "scene/reflectance.h"

namespace catoptric::trace {
namespace {

/// Of the extent of what a point lies on: 16 roundings. Embree's distance from a triangle is off by
/// up to 6 of its longest edge, more in slivers. Ours.
constexpr float kLeastOffset = 9.5e-7f;
constexpr std::size_t kRaysPerBatch = std::size_t{1} << 20;  ///< bounds memory; ours
constexpr std::size_t kPointGrain = 512;                     ///< points a task works on; ours

void forRange(bool parallel, std::size_t count,
              const std::function<void(std::size_t, std::size_t)>& body) {
  if (parallel) {
    parallelFor(count, kPointGrain, body);
  } else if (count > 0) {
    body(0, count);
  }
}

/// One batch of points, all of whose rays are held at once.
class Batch {
 public:
  Batch(const TraceScene& trace, const frame::Lighting& lighting, float spreadRad,
        const ReflectionOptions& options, bool parallel)
      : trace_(trace),
        lighting_(lighting),
        spreadRad_(spreadRad),
        options_(options),
        parallel_(parallel) {}

  /// Of the points of the last run().
  void firstHits(std::span<FirstHit> hits) const {
    forRange(parallel_, hits.size(), [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const Ray& ray = rays_[first_[i]];
        hits[i] = {hits_[first_[i]], ray.origin, ray.direction};
      }
    });
  }

  void run(std::span<const ReflectionPoint> points, int raysPerLobe, int bouncesLeft,
           std::span<Vec3> radiance, std::span<std::uint8_t> flags, ReflectionCounts& counts) {
    std::int64_t start = nowNs();
    makeRays(points, raysPerLobe, flags, counts);
    counts.resolveSeconds += secondsSince(start);

    start = nowNs();
    hits_.resize(rays_.size());
    const TraceCounts traced = parallel_ ? trace_.intersect(rays_, hits_, true)
                                         : trace_.intersectSerial(rays_, hits_, true);
    counts.traceSeconds += secondsSince(start);
    counts.rays += traced.rays;
    counts.refused += traced.refused;

    start = nowNs();
    if (bouncesLeft > 1) surfaces_.resize(rays_.size());
    resolve(points, raysPerLobe, bouncesLeft > 1, flags, counts);
    counts.resolveSeconds += secondsSince(start);
    if (bouncesLeft > 1) continueReflective(points, bouncesLeft, counts);

    // Mean over each lobe, in the order of its rays.
    forRange(parallel_, points.size(), [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        Vec3 sum(0.0f);
        for (std::size_t r = first_[i]; r < first_[i + 1]; ++r) sum += values_[r];
        radiance[i] = sum / static_cast<float>(first_[i + 1] - first_[i]);
      }
    });
  }

 private:
  void makeRays(std::span<const ReflectionPoint> points, int raysPerLobe,
                std::span<std::uint8_t> flags, ReflectionCounts& counts) {
    first_.resize(points.size() + 1);
    first_[0] = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      first_[i + 1] =
          first_[i] + static_cast<std::size_t>(lobeRays(points[i].glossiness, raysPerLobe));
    }
    rays_.resize(first_.back());
    std::atomic<std::uint64_t> folded{0};
    std::atomic<std::uint64_t> total{0};
    std::atomic<std::uint64_t> atOutline{0};
    std::atomic<std::uint64_t> offSurface{0};
    forRange(parallel_, points.size(), [&](std::size_t begin, std::size_t end) {
      std::uint64_t foldedHere = 0;
      for (std::size_t i = begin; i < end; ++i) {
        ReflectionPoint point = points[i];
        const Moved moved = settle(trace_, point);
        if (moved == Moved::ToOutline) ++atOutline;
        if (moved == Moved::Nowhere) ++offSurface;
        const int count = static_cast<int>(first_[i + 1] - first_[i]);
        for (int k = 0; k < count; ++k) {
          bool below = false;
          bool totally = false;
          rays_[first_[i] + static_cast<std::size_t>(k)] = lobeRay(point, k, count, below, totally);
          total += totally ? 1 : 0;
          if (below) {
            ++foldedHere;
            if (!flags.empty()) flags[i] |= 2;
          }
        }
      }
      folded += foldedHere;
    });
    counts.belowHorizon += folded;
    counts.totalReflections += total;
    counts.atOutline += atOutline;
    counts.offSurface += offSurface;
  }

  void resolve(std::span<const ReflectionPoint> points, int raysPerLobe, bool keepSurfaces,
               std::span<std::uint8_t> flags, ReflectionCounts& counts) {
    values_.resize(rays_.size());
    std::atomic<std::uint64_t> misses{0};
    std::atomic<std::uint64_t> notFinite{0};
    forRange(parallel_, points.size(), [&](std::size_t begin, std::size_t end) {
      std::uint64_t missesHere = 0;
      for (std::size_t i = begin; i < end; ++i) {
        const float spread = lobeSpread(points[i].glossiness, raysPerLobe);
        for (std::size_t r = first_[i]; r < first_[i + 1]; ++r) {
          const Hit& hit = hits_[r];
          const Vec3 direction = rays_[r].direction;
          if (hit.miss()) {
            const bool refused = !isTraceable(rays_[r]);
            if (!flags.empty()) flags[i] |= refused ? 1 : 4;
            missesHere += refused ? 0 : 1;
            values_[r] = refused && !isFinite(direction)
                             ? Vec3(0.0f)
                             : lighting_.environment->radiance(direction);
            if (keepSurfaces) surfaces_[r].object = 0;
            continue;
          }
          const float width =
              spreadRad_ * (points[i].distance + hit.distance) + spread * hit.distance;
          const frame::SurfacePoint surface = frame::shadeSurface(
              trace_.scene(), trace_.geometry(), lighting_, hit.object, hit.primitive, hit.u, hit.v,
              rays_[r].origin + hit.distance * direction, direction, width);
          values_[r] = surface.diffuse;
          if (!isFinite(values_[r])) {
            values_[r] = Vec3(0.0f);
            ++notFinite;
          }
          if (keepSurfaces) {
            surfaces_[r] = surface;
            surfaces_[r].diffuse = values_[r];
          }
        }
      }
      misses += missesHere;
    });
    counts.misses += misses;
    counts.notFinite += notFinite;
  }

  /// Replaces the values of reflective hits by diffuse and reflected light, weighted by s.
  void continueReflective(std::span<const ReflectionPoint> points, int bouncesLeft,
                          ReflectionCounts& counts) {
    std::vector<std::size_t> where;
    std::vector<ReflectionPoint> next;
    for (std::size_t i = 0; i < points.size(); ++i) {
      for (std::size_t r = first_[i]; r < first_[i + 1]; ++r) {
        const frame::SurfacePoint& surface = surfaces_[r];
        if (surface.object == 0 || !(surface.specularLevel > 0.0f)) continue;
        where.push_back(r);
        next.push_back(nextPoint(trace_, points[i], static_cast<int>(r - first_[i]),
                                 rays_[r].direction, hits_[r], surface));
      }
    }
    if (next.empty()) return;
    std::vector<Vec3> reflected(next.size());
    Batch deeper(trace_, lighting_, spreadRad_, options_, parallel_);
    deeper.run(next, 1, bouncesLeft - 1, reflected, {}, counts);
    for (std::size_t k = 0; k < where.size(); ++k) {
      const frame::SurfacePoint& surface = surfaces_[where[k]];
      const float s = reflectionWeight(surface.specularLevel, next[k].direction, surface.normal,
                                       options_.fresnelSchlick);
      values_[where[k]] = (1.0f - s) * surface.diffuse + s * surface.tint * reflected[k];
    }
  }

  const TraceScene& trace_;
  const frame::Lighting& lighting_;
  float spreadRad_;
  const ReflectionOptions& options_;
  bool parallel_;
  std::vector<std::size_t> first_;
  std::vector<Ray> rays_;
  std::vector<Hit> hits_;
  std::vector<Vec3> values_;
  std::vector<frame::SurfacePoint> surfaces_;
};

}  // namespace

void ReflectionCounts::add(const ReflectionCounts& other) {
  rays += other.rays;
  misses += other.misses;
  refused += other.refused;
  belowHorizon += other.belowHorizon;
  totalReflections += other.totalReflections;
  notFinite += other.notFinite;
  atOutline += other.atOutline;
  offSurface += other.offSurface;
  traceSeconds += other.traceSeconds;
  resolveSeconds += other.resolveSeconds;
}

int lobeRays(float glossiness, int rays) {
  return glossiness <= scene::kMirrorGlossiness ? 1 : std::max(1, rays);
}

Moved moveOntoSurface(const TraceScene& trace, ReflectionPoint& point) {
  if (point.object == 0) return Moved::Nothing;
  const int index = trace.geometry().objects[point.object - 1].surface;
  if (index < 0) return Moved::Nothing;
  const frame::PlacedSurface& placed = trace.geometry().surfaces[index];
  const glm::dvec3 position(point.position);
  const glm::dvec3 direction(point.direction);

  // Along the ray, not behind the eye.
  const double before = std::min(placed.reach, static_cast<double>(point.distance));
  const implicit::SurfaceHit hit = implicit::firstHit(
      placed.surface, {position - before * direction, direction, 0.0, before + placed.reach});
  Moved moved = Moved::AlongRay;
  std::optional<glm::dvec3> place;
  if (hit.status == implicit::HitStatus::Hit) {
    place = position + (hit.t - before) * direction;
  } else {
    moved = Moved::ToOutline;
    place = implicit::nearestPoint(placed.surface, position, placed.reach);
  }
  if (!place) return Moved::Nowhere;
  point.distance += static_cast<float>(glm::dot(*place - position, direction));
  point.position = Vec3(*place);
  const scene::Object& object = trace.scene().objects[point.object - 1];
  if (trace.scene().materials[object.material].normalTexture.used()) return moved;
  if (const auto normal = implicit::normalAt(placed.surface, *place)) {
    // Turned to the viewer, who sees the outline's from the side that the triangles showed.
    const Vec3 n(*normal);
    const bool back = moved == Moved::AlongRay ? glm::dot(n, point.direction) > 0.0f
                                               : glm::dot(n, point.normal) < 0.0f;
    point.normal = back ? -n : n;
  }
  return moved;
}

Moved settle(const TraceScene& trace, ReflectionPoint& point) {
  const Moved moved = moveOntoSurface(trace, point);
  if (point.object != 0) {
    const scene::Scene& scene = trace.scene();
    const float index = scene.materials[scene.objects[point.object - 1].material].refraction;
    point.refraction = index > 0.0f ? 1.0f / index : 0.0f;
  }
  return moved;
}

Ray lobeRay(const ReflectionPoint& point, int index, int count, bool& belowHorizon, bool& total) {
  Ray ray;
  belowHorizon = total = false;
  const float offset = surfaceOffset(point);
  if (point.refraction > 0.0f) {
    ray.direction = specularDirection(point, total);
    ray.origin = point.position + point.normal * (total ? offset : -offset);
  } else {
    ray.direction = lobeDirection(point, index, count, belowHorizon);
    ray.origin = point.position + point.normal * offset;
  }
  return ray;
}

ReflectionPoint nextPoint(const TraceScene& trace, const ReflectionPoint& point, int index,
                          const Vec3& direction, const Hit& hit,
                          const frame::SurfacePoint& surface) {
  // A lobe within a lobe: one ray each, at shifted places.
  const float k = static_cast<float>(index);
  const Vec2 shift(wrapUnit(point.shift.x + glm::fract(0.7548777f * (k + 1.0f))),
                   wrapUnit(point.shift.y + glm::fract(0.5698403f * (k + 1.0f))));
  return {surface.position,
          surface.normal,
          direction,
          surface.glossiness,
          point.distance + hit.distance,
          refractionAt(trace, hit, surface.position, direction),
          shift,
          0,
          trace.extentOf(hit.object)};
}

Vec3 specularDirection(const ReflectionPoint& point, bool& total) {
  Vec3 direction(0.0f);
  if (point.refraction > 0.0f)
    direction = glm::refract(point.direction, point.normal, point.refraction);
  total = point.refraction > 0.0f && direction == Vec3(0.0f);
  if (direction == Vec3(0.0f)) direction = glm::reflect(point.direction, point.normal);
  return glm::normalize(direction);
}

float refractionAt(const TraceScene& trace, const Hit& hit, const Vec3& position,
                   const Vec3& direction) {
  const scene::Scene& scene = trace.scene();
  const float index = scene.materials[scene.objects[hit.object].material].refraction;
  if (!(index > 0.0f)) return 0.0f;
  const frame::Geometry& geometry = trace.geometry();
  const frame::ObjectRange& range = geometry.objects[hit.object];
  Vec3 outwards(0.0f);
  if (range.surface >= 0) {
    const auto normal = implicit::normalAt(geometry.surfaces[range.surface].surface, position);
    if (normal) outwards = Vec3(*normal);
  } else {
    const std::uint32_t* corner = &geometry.indices[range.firstIndex + 3 * hit.primitive];
    const Vec3 p = geometry.positions[corner[0]];
    outwards = glm::cross(geometry.positions[corner[1]] - p, geometry.positions[corner[2]] - p);
  }
  return glm::dot(outwards, direction) > 0.0f ? index : 1.0f / index;
}

Vec3 lobeDirection(const ReflectionPoint& point, int index, int count, bool& belowHorizon) {
  const Vec3 mirror = glm::normalize(glm::reflect(point.direction, point.normal));
  belowHorizon = false;
  Vec3 direction = mirror;
  if (point.glossiness > scene::kMirrorGlossiness) {
    // Invert the lobe's distribution: cos(alpha) = (1 - u)^(1 / (n + 1)).
    const float n = scene::phongExponentFromGlossiness(point.glossiness);
    const float u = (static_cast<float>(index) + point.shift.x) / static_cast<float>(count);
    const float v = wrapUnit(radicalInverse2(static_cast<std::uint32_t>(index)) + point.shift.y);
    const float cosine = std::pow(std::max(1.0f - u, 1e-7f), 1.0f / (n + 1.0f));
    const float sine = std::sqrt(std::max(0.0f, 1.0f - cosine * cosine));
    const float angle = 2.0f * kPi * v;
    const Basis basis(mirror);
    direction = glm::normalize(sine * std::cos(angle) * basis.x + sine * std::sin(angle) * basis.y +
                               cosine * mirror);
  }
  const float above = glm::dot(direction, point.normal);
  if (above < 0.0f) {
    belowHorizon = true;
    direction -= 2.0f * above * point.normal;
  }
  return direction;
}

float surfaceOffset(const ReflectionPoint& point) {
  // Near 0 and near the eye the rounding is that of the way to the triangle's corners
  return std::max(kLeastOffset * point.extent, rayOffset(point.position, point.distance));
}

float lobeSpread(float glossiness, int count) {
  if (glossiness <= scene::kMirrorGlossiness) return 0.0f;
  const float n = scene::phongExponentFromGlossiness(glossiness);
  const float density = (n + 1.0f) / (2.0f * kPi);
  return std::sqrt(1.0f / (static_cast<float>(count) * density));
}

float reflectionWeight(float specularLevel, const Vec3& direction, const Vec3& normal,
                       bool fresnelSchlick) {
  if (!fresnelSchlick || !(specularLevel > 0.0f)) return specularLevel;
  const float c = std::clamp(1.0f + glm::dot(direction, normal), 0.0f, 1.0f);
  return specularLevel + (1.0f - specularLevel) * (c * c) * (c * c) * c;
}

ReflectionCounts reflectedRadiance(const TraceScene& trace, const frame::Lighting& lighting,
                                   float spreadRad, std::span<const ReflectionPoint> points,
                                   const ReflectionOptions& options, bool parallel,
                                   std::span<Vec3> radiance, std::span<std::uint8_t> flags,
                                   std::span<FirstHit> hits) {
  assert(radiance.size() >= points.size());
  ReflectionCounts counts;
  Batch batch(trace, lighting, spreadRad, options, parallel);
  const std::size_t perBatch =
      std::max<std::size_t>(1, kRaysPerBatch / static_cast<std::size_t>(std::max(1, options.rays)));
  for (std::size_t first = 0; first < points.size(); first += perBatch) {
    const std::size_t count = std::min(perBatch, points.size() - first);
    batch.run(points.subspan(first, count), options.rays, options.bounces,
              radiance.subspan(first, count), flags.empty() ? flags : flags.subspan(first, count),
              counts);
    if (!hits.empty()) batch.firstHits(hits.subspan(first, count));
  }
  return counts;
}

}  // namespace catoptric::trace
