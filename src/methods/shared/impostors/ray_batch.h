// Rays in arrays of one component each, for vector code, and what they meet.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "core/lanes.h"
#include "core/math.h"
#include "methods/shared/impostors/half_image.h"
#include "trace/lobes/point_lanes.h"

namespace catoptric::methods::impostors {

/// Rays that are worked on at once: samples of a tile of 16 x 16. Ours.
inline constexpr std::size_t kMostRays = 256;
using Lane = std::array<float, kMostRays>;
using Vectors = Vec3Lanes<kMostRays>;

/// Samples of a depth image that reflect.
struct Samples {
  alignas(64) Lane x{}, y{};  ///< in samples, at their centres
  alignas(64) Lane depth{};   ///< reversed-Z
  Vectors normal;
};

/// Rays that are all of one reflector, and the nearest of its impostors.
struct RayBatch {
  std::size_t count = 0;
  int object = 0;  ///< id of the reflector
  Vectors origin, direction;
  alignas(64) Lane distance{};  ///< of the path from the eye to the origin
  // The nearest: at `t`, 1e30 where there is none
  alignas(64) Lane t{}, u{}, v{}, level{};
  Vectors color;
  alignas(64) Lane share{};               ///< of the environment map, on transition walls
  std::array<int, kMostRays> impostor{};  ///< -1: none
  std::array<std::uint32_t, kMostRays> sample{};
  std::array<std::uint32_t, kMostRays> marks{};

  bool found(std::size_t i) const { return impostor[i] >= 0; }
};

/// What holds all rays of a batch.
struct RayBounds {
  Vec3 least, most;  ///< of the origins
  Vec3 axis;         ///< of a cone about the directions
  float cosine;      ///< of its half angle
  /// Whether any of the rays may meet something within a sphere.
  bool mayMeet(const Vec3& centre, float radius) const;
};

/// Places where the rays of a batch meet an impostor; `on` 0: not.
struct Meetings {
  alignas(64) Lane t{}, u{}, v{}, share{};
  alignas(64) std::array<std::int32_t, kMostRays> on{};
};

/// Look-ups in one image, in a row.
struct LookUps {
  std::size_t count = 0;
  alignas(64) Lane u{}, v{}, level{}, alpha{};
  Vectors color;
};

/// Rays in the image of a depth map's camera: clipped by its six planes.
struct MapRays {
  std::size_t count = 0;
  alignas(64) Lane fromX{}, fromY{}, fromG{}, toX{}, toY{}, toG{};  ///< texels, depth 0..1
  alignas(64) Lane tFrom{}, tTo{}, wFrom{}, wTo{};
  alignas(64) Lane at{};  ///< share of the way from .. to; above 1: meets nothing
  alignas(64) std::array<std::int32_t, kMostRays> on{};
  std::array<std::uint16_t, kMostRays> ray{};
};

/// Look-ups in the environment map [Lagarde2012], as environmentAlong() of impostors.glsl.
struct EnvironmentLookUps {
  std::size_t count = 0;
  Vectors origin, direction;
  alignas(64) Lane t{};  ///< where the ray leaves the scene's box
  Vectors color;
  alignas(64) Lane closed{};
};
struct Surroundings {
  const HalfCube* cube;
  Vec3 least, most, centre;  ///< of the scene's box; of the map
};

/// Lines of an impostor that rays are intersected with.
struct QuadLines {
  Vec4 plane, rowU, rowV;
};

// The loops over rays give the same bits at every level of vector instructions.

void aim(const trace::SampleCamera& camera, const Samples& samples, RayBatch& rays);
RayBounds bound(const RayBatch& rays);
/// The largest `t` of the batch.
float farthest(const RayBatch& rays);
/// Whether any ray meets it.
bool meetQuad(const QuadLines& quad, const RayBatch& rays, Meetings& met);
/// `height`: of the walls, negative where the plane's normal points downwards.
bool meetBox(const QuadLines& quad, float height, const RayBatch& rays, Meetings& met);
/// All rays of the batch: MapRays::on says whose rest is not empty and begins before what is
/// found.
void project(const std::array<Vec4, 4>& rows, float size, const RayBatch& rays, MapRays& map);
/// Texels that a look-up's cone covers, as log2, from distance and slant; `t`, by look-up.
void levels(float spreadPerTexel, const Lane& width, const Lane& slant, LookUps& at);
void lookUp(const HalfImage& image, LookUps& at);
void environment(const Surroundings& around, EnvironmentLookUps& at);

}  // namespace catoptric::methods::impostors
