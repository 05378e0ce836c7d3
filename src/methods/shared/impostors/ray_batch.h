// Rays in arrays of one component each, for vector code, and what they meet.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "core/math.h"
#include "methods/shared/impostors/half_image.h"

namespace catoptric::methods::impostors {

/// Rays that are worked on at once: samples of a tile of 16 x 16. Ours.
inline constexpr std::size_t kMostRays = 256;
using Lane = std::array<float, kMostRays>;

/// Samples of a depth image that reflect.
struct Samples {
  alignas(64) Lane x{}, y{};  ///< in samples, at their centres
  alignas(64) Lane depth{};   ///< reversed-Z
  alignas(64) Lane normalX{}, normalY{}, normalZ{};
};

/// A camera as the rays of its samples need it.
struct SampleCamera {
  Vec3 eye;
  float nearMetres;
  Mat3 rayFromSample;
};

/// Rays that are all of one reflector, and the nearest of its impostors.
struct RayBatch {
  std::size_t count = 0;
  int object = 0;  ///< id of the reflector
  alignas(64) Lane originX{}, originY{}, originZ{}, directionX{}, directionY{}, directionZ{};
  alignas(64) Lane distance{};  ///< of the path from the eye to the origin
  // The nearest: at `t`, 1e30 where there is none
  alignas(64) Lane t{}, red{}, green{}, blue{}, u{}, v{}, level{};
  alignas(64) Lane share{};               ///< of the environment map, on transition walls
  std::array<int, kMostRays> impostor{};  ///< -1: none
  std::array<std::uint32_t, kMostRays> sample{};
  std::array<std::uint32_t, kMostRays> marks{};

  bool found(std::size_t i) const { return impostor[i] >= 0; }
  Vec3 origin(std::size_t i) const { return {originX[i], originY[i], originZ[i]}; }
  Vec3 direction(std::size_t i) const { return {directionX[i], directionY[i], directionZ[i]}; }
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
  alignas(64) Lane u{}, v{}, level{}, red{}, green{}, blue{}, alpha{};
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
  alignas(64) Lane originX{}, originY{}, originZ{}, directionX{}, directionY{}, directionZ{};
  alignas(64) Lane t{};  ///< where the ray leaves the scene's box
  alignas(64) Lane red{}, green{}, blue{}, closed{};
};
struct Surroundings {
  const HalfCube* cube;
  Vec3 least, most, centre;  ///< of the scene's box; of the map
};

/// Lines of an impostor that rays are intersected with.
struct QuadLines {
  Vec4 plane, rowU, rowV;
};

/// The loops over rays, once for each level of vector instructions; all give the same bits.
struct RayLoops {
  void (*aim)(const SampleCamera&, const Samples&, RayBatch&);
  RayBounds (*bound)(const RayBatch&);
  /// The largest `t` of the batch.
  float (*farthest)(const RayBatch&);
  /// Whether any ray meets it.
  bool (*meetQuad)(const QuadLines&, const RayBatch&, Meetings&);
  /// `height`: of the walls, negative where the plane's normal points downwards.
  bool (*meetBox)(const QuadLines&, float height, const RayBatch&, Meetings&);
  /// All rays of the batch: MapRays::on says whose rest is not empty and begins before what is
  /// found.
  void (*project)(const std::array<Vec4, 4>& rows, float size, const RayBatch&, MapRays&);
  /// Texels that a look-up's cone covers, as log2, from distance and slant; `t`, by look-up.
  void (*levels)(float spreadPerTexel, const Lane& width, const Lane& slant, LookUps&);
  void (*lookUp)(const HalfImage&, LookUps&);
  void (*environment)(const Surroundings&, EnvironmentLookUps&);
};
const RayLoops& rayLoops();

}  // namespace catoptric::methods::impostors
