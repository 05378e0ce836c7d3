// Rays as a structure of arrays for vector code, and their hits.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "core/lanes.h"
#include "core/math.h"
#include "methods/shared/impostors/half_image.h"
#include "trace/lobes/point_lanes.h"

namespace catoptric::methods::impostors {

/// Maximum number of rays in a batch: the samples of a 16 x 16 tile. Not from the paper.
inline constexpr std::size_t kMostRays = 256;
using Lane = std::array<float, kMostRays>;
using Vectors = Vec3Lanes<kMostRays>;

/// Reflective samples of the G-buffer.
struct Samples {
  alignas(64) Lane x{}, y{};  ///< the sample's centre, in samples
  alignas(64) Lane depth{};   ///< reversed-Z
  Vectors normal;
};

/// Rays of one reflector, and the nearest impostor that each ray hits.
struct RayBatch {
  std::size_t count = 0;
  int object = 0;  ///< id of the reflector
  Vectors origin, direction;
  alignas(64) Lane distance{};  ///< length of the path from the eye to the origin
  // The nearest hit at distance `t`; 1e30 if there is none
  alignas(64) Lane t{}, u{}, v{}, level{};
  Vectors color;
  alignas(64) Lane share{};  ///< weight of the environment map, on transition walls
  Lane hidden{};  ///< distance from which on all maps of some object hide the ray; 1e30: nowhere
  std::array<int, kMostRays> impostor{};  ///< -1: none
  std::array<std::uint32_t, kMostRays> sample{};
  std::array<std::uint32_t, kMostRays> marks{};

  bool found(std::size_t i) const { return impostor[i] >= 0; }
};

/// Bounds of all rays of a batch.
struct RayBounds {
  Vec3 least, most;  ///< box around the origins
  Vec3 axis;         ///< axis of a cone around the directions
  float cosine;      ///< cosine of its half angle
  /// Whether any of the rays may hit something in a sphere.
  bool mayMeet(const Vec3& centre, float radius) const;
};

/// The hits of a batch on one impostor; `on` is 0 for rays that miss.
struct Meetings {
  alignas(64) Lane t{}, u{}, v{}, share{};
  alignas(64) std::array<std::int32_t, kMostRays> on{};
};

/// Consecutive look-ups in one image.
struct LookUps {
  std::size_t count = 0;
  alignas(64) Lane u{}, v{}, level{}, alpha{};
  Vectors color;
};

/// Rays in the image of a depth map's camera, clipped by its six planes.
struct MapRays {
  std::size_t count = 0;
  alignas(64) Lane fromX{}, fromY{}, fromG{}, toX{}, toY{}, toG{};  ///< x, y: texels; g: depth 0..1
  alignas(64) Lane tFrom{}, tTo{}, wFrom{}, wTo{};
  alignas(64) Lane at{};  ///< fraction of the way from `from` to `to`; above 1: no hit
  /// Above 0 for one of several maps of an object: depth per texel of the steepest surface. Steeper
  /// steps are edges. If a ray passes behind an edge, its `at` is shared::kHidden plus the fraction
  /// of the way at which it passes there.
  float steepest = 0.0f;
  std::uint64_t texels = 0;  ///< along all projections; set by walks
  alignas(64) std::array<std::int32_t, kMostRays> on{};
  std::array<std::uint16_t, kMostRays> ray{};
};

/// Look-ups in the environment map [Lagarde2012], as in environmentAlong() of impostors.glsl.
struct EnvironmentLookUps {
  std::size_t count = 0;
  Vectors origin, direction;
  alignas(64) Lane t{};  ///< distance at which the ray leaves the scene's box
  Vectors color;
  alignas(64) Lane closed{};
};
struct Surroundings {
  const HalfCube* cube;
  Vec3 least, most, centre;  ///< least, most: the scene's box; centre: of the map
};

/// The quad of an impostor, for intersection.
struct QuadLines {
  Vec4 plane, rowU, rowV;
};

// The loops over rays are bit-identical at every vector level.

void aim(const trace::SampleCamera& camera, const Samples& samples, RayBatch& rays);
RayBounds bound(const RayBatch& rays);
/// The largest `t` of the batch.
float farthest(const RayBatch& rays);
/// Returns whether any ray hits the quad.
bool meetQuad(const QuadLines& quad, const RayBatch& rays, Meetings& met);
/// `height`: height of the transition walls; negative if the plane's normal points downwards.
bool meetBox(const QuadLines& quad, float height, const RayBatch& rays, Meetings& met);
/// Clips all rays of the batch. Sets MapRays::on for rays whose clipped part is not empty and
/// begins before the nearest hit.
void project(const std::array<Vec4, 4>& rows, float size, const RayBatch& rays, MapRays& map);
/// Sets the mip levels of look-ups: log2 of the texels that a ray's cone covers. `width` and
/// `slant` are indexed by look-up.
void levels(float spreadPerTexel, const Lane& width, const Lane& slant, LookUps& at);
void lookUp(const HalfImage& image, LookUps& at);
void environment(const Surroundings& around, EnvironmentLookUps& at);

}  // namespace catoptric::methods::impostors
