// Points and rays in arrays of one component each, for vector code: what trace/lobes works on,
// a tile of points at a time.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "core/lanes.h"
#include "trace/lobes/reflect.h"

namespace catoptric::trace {

/// Points, and rays, that are worked on at once: what fits a core's cache. Ours.
inline constexpr std::size_t kMostLanes = 1024;

/// Rays of the largest packets that Embree traces at once.
inline constexpr std::size_t kMostPacket = 16;

/// With room for a whole packet from any point on.
using Lane = std::array<float, kMostLanes + kMostPacket>;

using PointVectors = Vec3Lanes<kMostLanes + kMostPacket>;

/// ReflectionPoint by components.
struct PointLanes {
  std::size_t count = 0;
  PointVectors position, normal, direction;
  PointVectors lobeHorizon;  ///< never 0
  alignas(64) Lane lobe{};   ///< scene::Lobe::code
  alignas(64) Lane distance{}, refraction{}, shiftX{}, shiftY{}, extent{};
  /// Distance before settle() moved the point: what ray cones grow with.
  alignas(64) Lane coneDistance{};
  std::array<int, kMostLanes> object{};
  std::array<std::uint8_t, kMostLanes> bent{};
  // What aim() makes of them
  PointVectors axis;         ///< mirrored direction, unit length
  PointVectors origin;       ///< of rays to the outside
  alignas(64) Lane above{};  ///< cosine between axis and lobeHorizon

  ReflectionPoint at(std::size_t i) const;
  void set(std::size_t i, const ReflectionPoint& point);
  void add(const ReflectionPoint& point) { set(count++, point); }
};

/// Samples of a depth image that points are made of.
struct SampleLanes {
  static constexpr std::size_t kMost = 256;
  alignas(64) std::array<float, kMost> x{}, y{};  ///< in samples, at their centres
  alignas(64) std::array<float, kMost> depth{};   ///< reversed-Z
};

/// A camera as the points of its samples need it.
struct SampleCamera {
  Vec3 eye;
  float nearMetres;
  Mat3 rayFromPixel;  ///< world-space ray of depth 1 along the view from (x, y, 1)
};

/// position, direction and both distances of the first points.count samples.
void placePoints(const SampleCamera& camera, const SampleLanes& samples, PointLanes& points);

/// axis, origin and above of all points.
void aim(PointLanes& points);

/// Directions of a Phong lobe about an axis: x, y along the axes of Basis(axis), z along the axis.
/// Of GGX' lobes x, y: points of the unit disk.
using LobeLanes = Vec3Lanes<256>;

/// `count` rays of a point with a Phong lobe from number `first` on; true where none lies below
/// lobeHorizon's plane.
bool aimPhong(const PointLanes& points, std::size_t point, const LobeLanes& lobe, std::size_t count,
              PointVectors& directions, std::size_t first);
/// The same with a GGX lobe, and each ray's weight and density (scene::GgxRay).
bool aimGgx(const PointLanes& points, std::size_t point, const LobeLanes& disk, std::size_t count,
            PointVectors& directions, Lane& weights, Lane& densities, std::size_t first);

}  // namespace catoptric::trace
