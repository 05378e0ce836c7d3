// Radiance that reaches a reflective point along its lobe: mirror rays, lobes, further bounces.
// The methods `traced` and `reference` share this code, so that their light transport is the same.
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>

#include "core/math.h"
#include "frame/shading.h"
#include "scene/lobe.h"
#include "trace/embree/trace_scene.h"

namespace catoptric::trace {

class EnvironmentLevels;

/// Minimum ray offset as a fraction of the extent of the surface at a point: 16 rounding errors.
/// Embree's hit distances are off by up to 6 rounding errors of a triangle's longest edge, more in
/// slivers. Our choice.
inline constexpr float kLeastOffset = 9.5e-7f;

/// A reflective point that a pixel or a ray hits.
struct ReflectionPoint {
  Vec3 position{0.0f};
  Vec3 normal{0.0f, 1.0f, 0.0f};      ///< shading normal, turned to the viewer
  Vec3 direction{0.0f, -1.0f, 0.0f};  ///< from the viewer to the point, unit length
  scene::Lobe lobe;
  float distance = 0.0f;  ///< path length in metres from the eye to this point
  /// Index of refraction before the surface divided by the one behind it; 0: the surface reflects.
  /// For points with an object it follows from that object's material, seen from outside.
  float refraction = 0.0f;
  /// Shift of the lobe's low-discrepancy points, 0..1 each: x between neighbouring points, y as a
  /// fraction of a turn.
  Vec2 shift{0.5f, 0.0f};
  /// Id of the point's object if position and normal are those of its triangles. If the object has
  /// an implicit surface, rays then start on that surface. 0: position and normal are exact.
  int object = 0;
  /// TraceScene::extentOf() the point's object.
  float extent = 0.0f;
  /// frame::aboveSurface() has changed the normal; all rays count as below the horizon.
  bool bent = false;
  /// frame::SurfacePoint::lobeHorizon; 0: the same as `normal`.
  Vec3 lobeHorizon{0.0f};
};

struct ReflectionOptions {
  int rays = 1;     ///< per lobe, 1..256; mirrors have one
  int bounces = 1;  ///< 1: a reflective surface that a ray hits shows only its diffuse component
  /// Paths also end where the next reflection would add less than this share of the radiance along
  /// the path's first ray; 0: they do not.
  float leastShare = 0.0f;
  /// For means over many calls with independent shifts: the shifts of bounces after a lobe are
  /// independent of it, and the cones of a lobe's rays are as narrow as among kConvergedRays rays.
  /// Otherwise the radiance of lobes within lobes converges to a slightly different value.
  bool converges = false;
  bool fresnelSchlick = false;  ///< for bounces after the first
  /// Radiance from distance t is multiplied by exp(-t / fadeMetres), along all bounces of a path;
  /// the environment's radiance comes from kSkyMetres. 0: no attenuation.
  float fadeMetres = 0.0f;
  /// If set, rays that leave the scene receive its mean over their solid angle; null: the radiance
  /// along their centre.
  const EnvironmentLevels* environment = nullptr;
};

/// See ReflectionOptions::converges. Our choice: 16 samples with 16 rays each.
inline constexpr int kConvergedRays = 256;

struct ReflectionCounts {
  std::uint64_t rays = 0;
  std::uint64_t misses = 0;        ///< rays that received the environment's radiance
  std::uint64_t refused = 0;       ///< not traceable; they get the environment's radiance
  std::uint64_t belowHorizon = 0;  ///< rays below the surface: bent normals, or reflected upwards
  std::uint64_t totalReflections = 0;  ///< rays that could not leave a refractive object
  std::uint64_t notFinite = 0;         ///< NaN or infinite radiances, which were replaced by 0
  /// Points on triangles of an implicit surface whose ray misses the surface at its silhouette.
  /// atOutline: moved to the nearest point of the surface; offSurface: not moved because no point
  /// is near.
  std::uint64_t atOutline = 0;
  std::uint64_t offSurface = 0;
  /// Paths that `bounces` cut although `leastShare` would have let them go on.
  std::uint64_t unfinished = 0;
  double traceSeconds = 0.0;    ///< in Embree
  double resolveSeconds = 0.0;  ///< generation of rays and shading of hits

  void add(const ReflectionCounts& other);
  /// Scales both times, which are sums over threads, so that they add up to `seconds` of wall time.
  void shareTime(double seconds);
};

/// Number of rays of a point's lobe: 1 for mirrors.
inline int lobeRays(scene::Lobe lobe, int rays) {
  return lobe.mirror() ? 1 : std::max(1, rays);
}

/// Point `index` of `count` Hammersley points of the unit square, shifted.
Vec2 lobePoint(const Vec2& shift, int index, int count);

/// The slot of a lobe in tables of data that depend only on lobe and shift. The 64 shifts of
/// methods::lobeShift() have slots of their own.
inline constexpr std::size_t kLobeSlots = 256;
inline std::size_t lobeSlot(float lobe, const Vec2& shift) {
  const auto place = static_cast<std::uint32_t>(shift.x * static_cast<float>(kLobeSlots));
  return (place + (std::bit_cast<std::uint32_t>(lobe) * 0x9E3779B1u >> 24)) % kLobeSlots;
}

/// Direction `index` of `count` of the Phong lobe cos^n about the z axis. It has unit length up to
/// rounding.
Vec3 phongSample(float g, const Vec2& shift, int index, int count);

/// As phongSample(), but returns the point of the unit disk from which scene::ggxRay makes a GGX
/// ray.
Vec2 ggxSample(const Vec2& shift, int index, int count);

/// A ray of a lobe. A Phong ray has weight 1. Below the surface it is reflected upwards, r - 2
/// (r.h) h with h = ReflectionPoint::lobeHorizon, so that all rays of a lobe have equal weight and
/// none enters the triangle that it leaves. A GGX ray below the surface is reflected upwards too,
/// with weight 0.
struct LobeRay {
  Vec3 direction{0.0f};       ///< unit length
  float weight = 1.0f;        ///< weight of its radiance in the lobe's mean
  float density = 0.0f;       ///< of GGX directions, per steradian
  bool belowHorizon = false;  ///< it was below the surface, or the normal was corrected
};
LobeRay lobeDirection(const ReflectionPoint& point, int index, int count);

/// Tangent space of a view: z is the normal, and the view lies in the xz plane.
struct GgxFrame {
  Vec3 x, y, z;
  scene::GgxView view;
  /// `normal` is turned to the viewer, `direction` comes from the viewer; both have unit length.
  GgxFrame(const Vec3& normal, const Vec3& direction, float alpha);
};

/// The mirrored direction of a point, or the refracted one (Snell's law); unit length. `total` is
/// set if refraction turns into total reflection.
Vec3 specularDirection(const ReflectionPoint& point, bool& total);

/// ReflectionPoint::refraction at a point that a ray with `direction` has hit.
float refractionAt(const TraceScene& trace, const Hit& hit, const Vec3& position,
                   const Vec3& direction);

/// Moves a point on an object's triangles onto the object's implicit surface: to the first hit of
/// the ray through the point, if that is at most a triangle's edge away. If the ray misses the
/// surface, to the nearest point (Newton's method). The normal becomes that of the surface's
/// gradient, unless a normal map has changed it. Objects without an implicit surface are not
/// changed.
enum class Moved { Nothing, AlongRay, ToOutline, Nowhere };
Moved moveOntoSurface(const TraceScene& trace, ReflectionPoint& point);

/// As moveOntoSurface(), and sets ReflectionPoint::refraction from the object's material, seen from
/// outside.
Moved settle(const TraceScene& trace, ReflectionPoint& point);

/// Ray `index` of `count` of a point's lobe, or its refracted ray, with its origin off the surface.
struct PointRay {
  Ray ray;
  LobeRay made;        ///< from lobeDirection()
  bool total = false;  ///< as in specularDirection()
};
PointRay lobeRay(const ReflectionPoint& point, int index, int count);

/// ReflectionPoint::shift of the point that ray `index` hits. It is also the `scatter` with which
/// frame::shadeSurface() shades that point.
Vec2 nextShift(const Vec2& shift, int index);

/// The next point of a path: ray `index` of `point` has hit a reflective surface at distance
/// `metres`. `extent`: as in ReflectionPoint.
ReflectionPoint nextPoint(const ReflectionPoint& point, int index, const Vec3& direction,
                          float metres, const frame::SurfacePoint& surface, float extent);
/// As the other nextPoint(), for a hit on any surface; at refractive objects the path enters or
/// leaves them.
ReflectionPoint nextPoint(const TraceScene& trace, const ReflectionPoint& point, int index,
                          const Vec3& direction, const Hit& hit,
                          const frame::SurfacePoint& surface);
/// The shift of the point after ray `index` of a lobe with the shift `shift`; independent of it.
Vec2 independentShift(const Vec2& shift, int index);

/// Distance along the normal by which ray origins are moved off the surface. It covers the rounding
/// error of the point's position, for scenes of any size.
float surfaceOffset(const ReflectionPoint& point);

/// Solid angle of ray `index` of `count` of a Phong lobe: 1 / (count p), where p is the density of
/// directions there [Yu2008] Eq. (5); at most the whole sphere.
float phongSolidAngle(float g, const Vec2& shift, int index, int count);
float solidAngleOf(float density, int count);

/// Width of the central ray among `count` rays of a lobe, per metre of distance, at normal
/// incidence: the root of its solid angle 1 / (count p).
float lobeSpread(scene::Lobe lobe, int count);

/// The weights of a reflective surface's radiance: diffuse * diffuse radiance + reflection *
/// radiance along the lobe. Phong: 1 - s and s tint, optionally with Schlick's term [Schlick1994];
/// GGX: always with Schlick's term, as in glTF (scene::meanSchlick), up to F90 at the rim.
struct ReflectionWeights {
  float diffuse;
  Vec3 reflection;
};
inline ReflectionWeights reflectionWeights(float specularLevel, const Vec3& tint, float f90,
                                           scene::Lobe lobe, const Vec3& direction,
                                           const Vec3& normal, bool fresnelSchlick) {
  float s = specularLevel;
  const float cosine = -glm::dot(direction, normal);
  if (lobe.ggx()) {
    const float p = s > 0.0f ? scene::meanSchlick(lobe.roughness(), cosine) : 0.0f;
    return {(1.0f - s) * (1.0f - p) + (1.0f - f90) * p, s * tint * (1.0f - p) + f90 * p};
  }
  if (fresnelSchlick && s > 0.0f) {
    const float c = std::clamp(1.0f - cosine, 0.0f, 1.0f);
    s += (1.0f - s) * (c * c) * (c * c) * c;
  }
  return {1.0f - s, s * tint};
}

/// The hit of the first ray of a point.
struct FirstHit {
  Hit hit;
  Vec3 origin{0.0f};
  Vec3 direction{0.0f};
};

/// The second hit of a path: a point's ray has hit a mirror, whose reflected ray hits this surface.
/// The point's radiance is exactly surface + arrived.
struct SecondHit {
  Hit hit;
  Vec3 direction{0.0f};  ///< of the reflected ray; 0: there is none
  Vec3 normal{0.0f};     ///< of the mirror
  Vec3 surface{0.0f};    ///< radiance of the mirror itself
  Vec3 arrived{0.0f};    ///< radiance along the reflected ray
};

/// Incoming radiance along the lobes: radiance[i] is the mean over the rays of points[i].
/// `spreadRad`: angle of a sample's ray cone. `parallel`: in all threads; otherwise in the calling
/// thread, with the same result. `flags[i]` (may be empty) gets bit 0 if a ray was refused, bit 1
/// if one was reflected upwards, bit 2 if one left the scene. `hits` and `seconds` (may be empty)
/// are filled for each point's first ray; `seconds` only for points with one ray. `oneBounce` (may
/// be empty) gets the radiance of paths with one bounce, without attenuation.
ReflectionCounts reflectedRadiance(const TraceScene& trace, const frame::Lighting& lighting,
                                   float spreadRad, std::span<const ReflectionPoint> points,
                                   const ReflectionOptions& options, bool parallel,
                                   std::span<Vec3> radiance, std::span<std::uint8_t> flags = {},
                                   std::span<FirstHit> hits = {}, std::span<SecondHit> seconds = {},
                                   std::span<Vec3> oneBounce = {});

}  // namespace catoptric::trace
