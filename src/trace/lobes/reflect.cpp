#include "trace/lobes/reflect.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "core/basis.h"
#include "core/sampling.h"
#include "scene/implicit/gradient.h"
#include "scene/reflectance.h"

namespace catoptric::trace {

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

void ReflectionCounts::shareTime(double seconds) {
  const double sum = traceSeconds + resolveSeconds;
  if (!(sum > 0.0)) return;
  traceSeconds *= seconds / sum;
  resolveSeconds *= seconds / sum;
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
    point.normal = point.lobeHorizon = back ? -n : n;
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

ReflectionPoint nextPoint(const ReflectionPoint& point, int index, const Vec3& direction,
                          float metres, const frame::SurfacePoint& surface, float extent) {
  // A lobe within a lobe: one ray each, at shifted places.
  const float k = static_cast<float>(index);
  const Vec2 shift(wrapUnit(point.shift.x + glm::fract(0.7548777f * (k + 1.0f))),
                   wrapUnit(point.shift.y + glm::fract(0.5698403f * (k + 1.0f))));
  return {surface.position,
          surface.normal,
          direction,
          surface.glossiness,
          point.distance + metres,
          0.0f,
          shift,
          0,
          extent,
          surface.bent,
          surface.lobeHorizon};
}

ReflectionPoint nextPoint(const TraceScene& trace, const ReflectionPoint& point, int index,
                          const Vec3& direction, const Hit& hit,
                          const frame::SurfacePoint& surface) {
  ReflectionPoint next =
      nextPoint(point, index, direction, hit.distance, surface, trace.extentOf(hit.object));
  next.refraction = refractionAt(trace, hit, surface.position, direction);
  return next;
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

Vec3 lobeSample(float glossiness, const Vec2& shift, int index, int count) {
  // Invert the lobe's distribution: cos(alpha) = (1 - u)^(1 / (n + 1)).
  const float n = scene::phongExponentFromGlossiness(glossiness);
  const float u = (static_cast<float>(index) + shift.x) / static_cast<float>(count);
  const float v = wrapUnit(radicalInverse2(static_cast<std::uint32_t>(index)) + shift.y);
  const float cosine = std::pow(std::max(1.0f - u, 1e-7f), 1.0f / (n + 1.0f));
  const float sine = std::sqrt(std::max(0.0f, 1.0f - cosine * cosine));
  const float angle = 2.0f * kPi * v;
  return {sine * std::cos(angle), sine * std::sin(angle), cosine};
}

Vec3 lobeDirection(const ReflectionPoint& point, int index, int count, bool& belowHorizon) {
  const Vec3 mirror = glm::normalize(glm::reflect(point.direction, point.normal));
  belowHorizon = point.bent;
  Vec3 direction = mirror;
  if (point.glossiness > scene::kMirrorGlossiness) {
    const Vec3 sample = lobeSample(point.glossiness, point.shift, index, count);
    const Basis basis(mirror);
    direction = glm::normalize(sample.x * basis.x + sample.y * basis.y + sample.z * mirror);
  }
  const Vec3& horizon = point.lobeHorizon == Vec3(0.0f) ? point.normal : point.lobeHorizon;
  const float above = glm::dot(direction, horizon);
  if (above < 0.0f) {
    belowHorizon = true;
    direction -= 2.0f * above * horizon;
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

float lobeSolidAngle(float glossiness, const Vec2& shift, int index, int count) {
  const float n = scene::phongExponentFromGlossiness(glossiness);
  const float u = (static_cast<float>(index) + shift.x) / static_cast<float>(count);
  // cos^n of lobeSample()'s angle
  const float cosines = std::pow(std::max(1.0f - u, 1e-7f), n / (n + 1.0f));
  return std::min(2.0f * kPi / (static_cast<float>(count) * (n + 1.0f) * cosines), 4.0f * kPi);
}

float reflectionWeight(float specularLevel, const Vec3& direction, const Vec3& normal,
                       bool fresnelSchlick) {
  if (!fresnelSchlick || !(specularLevel > 0.0f)) return specularLevel;
  const float c = std::clamp(1.0f + glm::dot(direction, normal), 0.0f, 1.0f);
  return specularLevel + (1.0f - specularLevel) * (c * c) * (c * c) * c;
}

}  // namespace catoptric::trace
