// Points and rays as structures of arrays for vector code. trace/lobes processes one tile of
// points at a time.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "core/lanes.h"
#include "trace/lobes/reflect.h"

namespace catoptric::trace {

/// Maximum number of points or rays that are processed together, so that they fit a core's cache.
/// Our choice.
inline constexpr std::size_t kMostLanes = 1024;

/// Number of rays in the largest packet that Embree traces.
inline constexpr std::size_t kMostPacket = 16;

/// Has room for a whole packet after any point.
using Lane = std::array<float, kMostLanes + kMostPacket>;

using PointVectors = Vec3Lanes<kMostLanes + kMostPacket>;

/// ReflectionPoint, stored by component.
struct PointLanes {
  std::size_t count = 0;
  PointVectors position, normal, direction;
  PointVectors lobeHorizon;  ///< never 0
  alignas(64) Lane lobe{};   ///< scene::Lobe::code
  alignas(64) Lane distance{}, refraction{}, shiftX{}, shiftY{}, extent{};
  /// Distance before settle() moved the point; ray cones grow with this distance.
  alignas(64) Lane coneDistance{};
  std::array<int, kMostLanes> object{};
  std::array<std::uint8_t, kMostLanes> bent{};
  // Set by aim()
  PointVectors axis;         ///< mirrored direction, unit length
  PointVectors origin;       ///< origin of rays on the viewer's side
  alignas(64) Lane above{};  ///< cosine between axis and lobeHorizon

  ReflectionPoint at(std::size_t i) const;
  void set(std::size_t i, const ReflectionPoint& point);
  void add(const ReflectionPoint& point) { set(count++, point); }
};

/// Samples of a depth image, which placePoints() converts to points.
struct SampleLanes {
  static constexpr std::size_t kMost = 256;
  alignas(64) std::array<float, kMost> x{}, y{};  ///< in samples, at their centres
  alignas(64) std::array<float, kMost> depth{};   ///< reversed-Z
};

/// The properties of a camera that placePoints() needs.
struct SampleCamera {
  Vec3 eye;
  float nearMetres;
  Mat3 rayFromPixel;  ///< maps (x, y, 1) to the world-space ray of depth 1 along the view
};

/// Sets position, direction and both distances of the first points.count samples.
void placePoints(const SampleCamera& camera, const SampleLanes& samples, PointLanes& points);

/// Sets axis, origin and above of all points.
void aim(PointLanes& points);

/// Phong: directions about an axis, x and y along the axes of Basis(axis), z along the axis. GGX: x
/// and y are points of the unit disk.
using LobeLanes = Vec3Lanes<256>;

/// Makes `count` rays of a point with a Phong lobe, stored from number `first` on. Returns whether
/// none of them lies below the plane of lobeHorizon.
bool aimPhong(const PointLanes& points, std::size_t point, const LobeLanes& lobe, std::size_t count,
              PointVectors& directions, std::size_t first);
/// As aimPhong() for a GGX lobe; also sets each ray's weight and density (scene::GgxRay).
bool aimGgx(const PointLanes& points, std::size_t point, const LobeLanes& disk, std::size_t count,
            PointVectors& directions, Lane& weights, Lane& densities, std::size_t first);

}  // namespace catoptric::trace
