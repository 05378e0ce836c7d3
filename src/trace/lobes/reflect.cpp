#include "trace/lobes/reflect.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <optional>

#include "core/basis.h"
#include "core/random.h"
#include "core/sampling.h"
#include "scene/implicit/gradient.h"

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
  unfinished += other.unfinished;
  traceSeconds += other.traceSeconds;
  resolveSeconds += other.resolveSeconds;
}

void ReflectionCounts::shareTime(double seconds) {
  const double sum = traceSeconds + resolveSeconds;
  if (!(sum > 0.0)) return;
  traceSeconds *= seconds / sum;
  resolveSeconds *= seconds / sum;
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

PointRay lobeRay(const ReflectionPoint& point, int index, int count) {
  PointRay sent;
  const float offset = surfaceOffset(point);
  if (point.refraction > 0.0f) {
    sent.ray.direction = specularDirection(point, sent.total);
    sent.ray.origin = point.position + point.normal * (sent.total ? offset : -offset);
  } else {
    sent.made = lobeDirection(point, index, count);
    sent.ray.direction = sent.made.direction;
    sent.ray.origin = point.position + point.normal * offset;
  }
  return sent;
}

Vec2 nextShift(const Vec2& shift, int index) {
  // A lobe within a lobe: one ray each. Its shift is 32 (index + 1) places further on in the
  // sequence of shifts, so the rays of neighbouring samples differ here, too.
  const std::uint32_t places = 32u * (static_cast<std::uint32_t>(index) + 1u);
  return {wrapUnit(shift.x + unitFloat(places * kR2xBits)),
          wrapUnit(shift.y + unitFloat(places * kR2yBits))};
}

ReflectionPoint nextPoint(const ReflectionPoint& point, int index, const Vec3& direction,
                          float metres, const frame::SurfacePoint& surface, float extent) {
  return {surface.position,
          surface.normal,
          direction,
          surface.lobe,
          point.distance + metres,
          0.0f,
          nextShift(point.shift, index),
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

Vec2 independentShift(const Vec2& shift, int index) {
  const std::uint32_t bits = mixedBits(
      std::bit_cast<std::uint32_t>(shift.x) ^
      mixedBits(std::bit_cast<std::uint32_t>(shift.y) + static_cast<std::uint32_t>(index)));
  return {unitFloat(bits), unitFloat(mixedBits(bits))};
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

Vec2 lobePoint(const Vec2& shift, int index, int count) {
  return {(static_cast<float>(index) + shift.x) / static_cast<float>(count),
          wrapUnit(radicalInverse2(static_cast<std::uint32_t>(index)) + shift.y)};
}

Vec3 phongSample(float g, const Vec2& shift, int index, int count) {
  // Invert the lobe's distribution: cos(alpha) = (1 - u)^(1 / (n + 1)).
  const float n = scene::phongExponentFromRoughness(g);
  const Vec2 place = lobePoint(shift, index, count);
  const float cosine = std::pow(std::max(1.0f - place.x, 1e-7f), 1.0f / (n + 1.0f));
  const float sine = std::sqrt(std::max(0.0f, 1.0f - cosine * cosine));
  const float angle = 2.0f * kPi * place.y;
  return {sine * std::cos(angle), sine * std::sin(angle), cosine};
}

Vec2 ggxSample(const Vec2& shift, int index, int count) {
  const Vec2 place = lobePoint(shift, index, count);
  const float radius = std::sqrt(place.x);
  const float angle = 2.0f * kPi * place.y;
  return {radius * std::cos(angle), radius * std::sin(angle)};
}

GgxFrame::GgxFrame(const Vec3& normal, const Vec3& direction, float alpha) : z(normal) {
  const float cosine = -glm::dot(normal, direction);
  view = scene::ggxView(alpha, cosine);
  const Vec3 along = -direction - cosine * normal;
  const float length2 = glm::dot(along, along);
  x = length2 > 1e-12f ? along / std::sqrt(length2) : Basis(normal).x;
  y = glm::cross(normal, x);
}

LobeRay lobeDirection(const ReflectionPoint& point, int index, int count) {
  LobeRay made;
  made.belowHorizon = point.bent;
  const Vec3 mirror = glm::normalize(glm::reflect(point.direction, point.normal));
  made.direction = mirror;
  if (!point.lobe.mirror() && point.lobe.ggx()) {
    const GgxFrame frame(point.normal, point.direction, point.lobe.alpha());
    const Vec2 disk = ggxSample(point.shift, index, count);
    const scene::GgxRay ray = scene::ggxRay(frame.view, disk.x, disk.y);
    made.direction = glm::normalize(ray.x * frame.x + ray.y * frame.y + ray.z * frame.z);
    made.weight = ray.weight;
    made.density = ray.density;
    made.belowHorizon = made.belowHorizon || !(ray.weight > 0.0f);
  } else if (!point.lobe.mirror()) {
    const Vec3 sample = phongSample(point.lobe.code, point.shift, index, count);
    const Basis basis(mirror);
    made.direction = glm::normalize(sample.x * basis.x + sample.y * basis.y + sample.z * mirror);
  }
  const Vec3& horizon = point.lobeHorizon == Vec3(0.0f) ? point.normal : point.lobeHorizon;
  const float above = glm::dot(made.direction, horizon);
  if (above < 0.0f) {
    made.belowHorizon = true;
    if (point.lobe.ggx()) made.weight = 0.0f;
    made.direction -= 2.0f * above * horizon;
  }
  return made;
}

float surfaceOffset(const ReflectionPoint& point) {
  // Near 0 and near the eye the rounding is that of the way to the triangle's corners
  return std::max(kLeastOffset * point.extent, rayOffset(point.position, point.distance));
}

float lobeSpread(scene::Lobe lobe, int count) {
  if (lobe.mirror()) return 0.0f;
  if (lobe.ggx()) return std::sqrt(solidAngleOf(scene::ggxView(lobe.alpha(), 1.0f).peak(), count));
  const float n = scene::phongExponentFromRoughness(lobe.code);
  const float density = (n + 1.0f) / (2.0f * kPi);
  return std::sqrt(1.0f / (static_cast<float>(count) * density));
}

float phongSolidAngle(float g, const Vec2& shift, int index, int count) {
  const float n = scene::phongExponentFromRoughness(g);
  const float u = (static_cast<float>(index) + shift.x) / static_cast<float>(count);
  // cos^n of phongSample()'s angle
  const float cosines = std::pow(std::max(1.0f - u, 1e-7f), n / (n + 1.0f));
  return std::min(2.0f * kPi / (static_cast<float>(count) * (n + 1.0f) * cosines), 4.0f * kPi);
}

float solidAngleOf(float density, int count) {
  return 1.0f / std::max(static_cast<float>(count) * density, 1.0f / (4.0f * kPi));
}

}  // namespace catoptric::trace
