// Light that reaches a reflective point along its lobe: mirror rays, lobes, further bounces.
// What the methods `traced` and `reference` share, so that both see the same transport.
#pragma once

#include <cstdint>
#include <span>

#include "core/math.h"
#include "frame/shading.h"
#include "scene/lobe.h"
#include "trace/embree/trace_scene.h"

namespace catoptric::trace {

class EnvironmentLevels;

/// Of the extent of what a point lies on: 16 roundings. Embree's distance from a triangle is off by
/// up to 6 of its longest edge, more in slivers. Ours.
inline constexpr float kLeastOffset = 9.5e-7f;

/// A reflective point as a pixel or a ray sees it.
struct ReflectionPoint {
  Vec3 position{0.0f};
  Vec3 normal{0.0f, 1.0f, 0.0f};      ///< shading normal, turned to the viewer
  Vec3 direction{0.0f, -1.0f, 0.0f};  ///< from the viewer to the point, unit length
  scene::Lobe lobe;
  float distance = 0.0f;  ///< metres from the eye to here along the path
  /// Index of refraction before the surface, divided by the one behind it; 0: it mirrors. Of points
  /// with an object: made by that object's material, seen from outside.
  float refraction = 0.0f;
  /// Of the lobe's low-discrepancy points, 0..1 each: x in steps between two points, y in turns.
  Vec2 shift{0.5f, 0.0f};
  /// Id of the object that the point lies on, where position and normal are those of its triangles:
  /// its rays start on the object's implicit surface then, if it has one. 0: they are exact.
  int object = 0;
  /// TraceScene::extentOf() the object that it lies on.
  float extent = 0.0f;
  /// The normal is frame::aboveSurface()'s: all rays count as below the horizon.
  bool bent = false;
  /// frame::SurfacePoint::lobeHorizon; 0: `normal`.
  Vec3 lobeHorizon{0.0f};
};

struct ReflectionOptions {
  int rays = 1;                 ///< per lobe, 1..256; mirrors take one
  int bounces = 1;              ///< 1: a reflective surface that is hit shows its diffuse component
  bool fresnelSchlick = false;  ///< of bounces after the first
  /// What a ray meets at a distance t is dimmed by exp(-t / fadeMetres), along all bounces of its
  /// path; where it leaves the scene it sees nothing. 0: not at all.
  float fadeMetres = 0.0f;
  /// Where rays leave the scene, its mean over their solid angle; null: its radiance in their
  /// middle.
  const EnvironmentLevels* environment = nullptr;
};

struct ReflectionCounts {
  std::uint64_t rays = 0;
  std::uint64_t misses = 0;            ///< saw the environment
  std::uint64_t refused = 0;           ///< could not be traced; saw the environment
  std::uint64_t belowHorizon = 0;      ///< rays below the surface: by a bent normal, or folded up
  std::uint64_t totalReflections = 0;  ///< where rays could not leave a body that refracts
  std::uint64_t notFinite = 0;         ///< radiances that were NaN or infinite: taken as 0
  /// Points of triangles over an implicit surface whose ray passes it by, at its outline: they
  /// moved to the nearest place of it; and those that stayed, where there is none near.
  std::uint64_t atOutline = 0;
  std::uint64_t offSurface = 0;
  double traceSeconds = 0.0;    ///< Embree alone
  double resolveSeconds = 0.0;  ///< making rays and shading hits

  void add(const ReflectionCounts& other);
  /// Scales both times, sums over threads, to `seconds` of the wall's clock together.
  void shareTime(double seconds);
};

/// Rays of a point's lobe: 1 for mirrors.
int lobeRays(scene::Lobe lobe, int rays);

/// Number `index` of `count` Hammersley points of the unit square, shifted.
Vec2 lobePoint(const Vec2& shift, int index, int count);

/// Direction number `index` of `count` of the Phong lobe cos^n with z as its axis. Of unit length
/// up to rounding.
Vec3 phongSample(float g, const Vec2& shift, int index, int count);

/// The same of the points of the unit disk that GGX' rays are made of (scene::ggxRay).
Vec2 ggxSample(const Vec2& shift, int index, int count);

/// A ray of a lobe. Of Phong's: weight 1; below the surface it is folded up, r - 2 (r.h) h with h =
/// ReflectionPoint::lobeHorizon, so that all rays of a lobe count alike and none enters the
/// triangle that it leaves. Of GGX': below the surface the weight is 0, and the ray is folded up
/// all the same.
struct LobeRay {
  Vec3 direction{0.0f};       ///< unit length
  float weight = 1.0f;        ///< of its radiance in the lobe's mean
  float density = 0.0f;       ///< of GGX' rays, per steradian
  bool belowHorizon = false;  ///< it was, or the normal is bent
};
LobeRay lobeDirection(const ReflectionPoint& point, int index, int count);

/// The frame of a view of a rough surface: z the normal, the view in the xz plane.
struct GgxFrame {
  Vec3 x, y, z;
  scene::GgxView view;
  /// `normal` turned to the viewer, `direction` from there; unit vectors.
  GgxFrame(const Vec3& normal, const Vec3& direction, float alpha);
};

/// The mirrored direction of a point, or the refracted one (Snell's law); `total`: it would be
/// refracted but is reflected totally. Unit length.
Vec3 specularDirection(const ReflectionPoint& point, bool& total);

/// ReflectionPoint::refraction of a place that a ray of `direction` has hit.
float refractionAt(const TraceScene& trace, const Hit& hit, const Vec3& position,
                   const Vec3& direction);

/// Moves a point of an object's triangles onto the object's implicit surface: to where the ray that
/// shows it first meets the surface, at most an edge of the triangles away, or where it passes the
/// surface by to the nearest place by Newton's method. The normal becomes the gradient's, unless a
/// normal map has bent it. Nothing to do for objects without such a surface.
enum class Moved { Nothing, AlongRay, ToOutline, Nowhere };
Moved moveOntoSurface(const TraceScene& trace, ReflectionPoint& point);

/// moveOntoSurface(), and what the object's material makes of rays from outside:
/// ReflectionPoint::refraction.
Moved settle(const TraceScene& trace, ReflectionPoint& point);

/// Ray number `index` of `count` of a point's lobe, or the refracted one, from off its surface.
struct PointRay {
  Ray ray;
  LobeRay made;        ///< lobeDirection()'s
  bool total = false;  ///< as specularDirection() has it
};
PointRay lobeRay(const ReflectionPoint& point, int index, int count);

/// Where ray number `index` of `point`, in this direction, has hit a reflective surface `metres`
/// away: the point from which it goes on as a mirrored one. `extent`: ReflectionPoint's.
ReflectionPoint nextPoint(const ReflectionPoint& point, int index, const Vec3& direction,
                          float metres, const frame::SurfacePoint& surface, float extent);
/// The same of a hit; where bodies refract it goes on into them, or out.
ReflectionPoint nextPoint(const TraceScene& trace, const ReflectionPoint& point, int index,
                          const Vec3& direction, const Hit& hit,
                          const frame::SurfacePoint& surface);

/// Distance along the normal by which the rays of a point start off its surface: what rounding may
/// have moved it by, however large the scene around it is.
float surfaceOffset(const ReflectionPoint& point);

/// Solid angle of ray number `index` of `count` of a point's lobe, 1 / (count p) for the density p
/// of its directions there [Yu2008] Eq. (5); at most the whole sphere.
float phongSolidAngle(float g, const Vec2& shift, int index, int count);
float solidAngleOf(float density, int count);

/// Half-angle-like spread (metres of width per metre) of one of `count` rays of a lobe at its
/// centre, seen at normal incidence: the root of the solid angle 1 / (count p).
float lobeSpread(scene::Lobe lobe, int count);

/// What a reflective place shows: diffuse * its diffuse radiance + reflection * what arrives along
/// its lobe. Phong: 1 - s and s tint, s with Schlick's term when asked for [Schlick1994]; GGX: with
/// Schlick's term always, as glTF has it (scene::meanSchlick).
struct ReflectionWeights {
  float diffuse;
  Vec3 reflection;
};
ReflectionWeights reflectionWeights(float specularLevel, const Vec3& tint, scene::Lobe lobe,
                                    const Vec3& direction, const Vec3& normal, bool fresnelSchlick);

/// What the first ray of a point has met.
struct FirstHit {
  Hit hit;
  Vec3 origin{0.0f};
  Vec3 direction{0.0f};
};

/// Of a point's ray that has met a mirror: what the ray from there has met. The point's radiance is
/// surface + arrived, to the bit.
struct SecondHit {
  Hit hit;
  Vec3 direction{0.0f};  ///< of the ray that goes on; 0: none does
  Vec3 normal{0.0f};     ///< of the mirror
  Vec3 surface{0.0f};    ///< light from the mirror itself
  Vec3 arrived{0.0f};    ///< light that came along the ray that goes on
};

/// Incoming radiance along the lobes: radiance[i] belongs to points[i], the mean over its rays.
/// `spreadRad`: of a sample's ray cone. `parallel`: over all threads; otherwise on the calling one.
/// The same result either way. `flags[i]` (may be empty) gets bit 0 where a ray was refused, bit 1
/// where one was folded up, bit 2 where one left the scene. `hits` and `seconds` (may be empty): of
/// each point's first ray; seconds of points with one ray.
ReflectionCounts reflectedRadiance(const TraceScene& trace, const frame::Lighting& lighting,
                                   float spreadRad, std::span<const ReflectionPoint> points,
                                   const ReflectionOptions& options, bool parallel,
                                   std::span<Vec3> radiance, std::span<std::uint8_t> flags = {},
                                   std::span<FirstHit> hits = {},
                                   std::span<SecondHit> seconds = {});

}  // namespace catoptric::trace
