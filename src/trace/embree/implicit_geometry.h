// An implicit surface as Embree user geometry: boxes that each contain a piece of the surface, in
// which rays are intersected with the surface itself. A BVH of its triangles yields the attributes
// of hits.
#pragma once

#include <embree3/rtcore.h>

#include <atomic>
#include <cstdint>
#include <vector>

#include "frame/geometry.h"

namespace catoptric::trace {

class ImplicitGeometry {
 public:
  /// `placed` is updated when the object moves; it must outlive this. `attributes`: whether hits
  /// report the nearest triangle; otherwise they all report triangle 0.
  ImplicitGeometry(RTCDevice device, const scene::Mesh& mesh, const frame::PlacedSurface& placed,
                   bool attributes);
  ~ImplicitGeometry();
  ImplicitGeometry(const ImplicitGeometry&) = delete;
  ImplicitGeometry& operator=(const ImplicitGeometry&) = delete;

  /// Makes `geometry`, which must be user geometry, represent this surface.
  void attach(RTCGeometry geometry);

  /// World-space bounding box of all pieces.
  Box3 bounds() const;

  /// The triangle nearest to a point, and the barycentric coordinates of its nearest point.
  struct Nearest {
    unsigned primitive = 0;
    float u = 0.0f;
    float v = 0.0f;
  };
  Nearest nearestTriangle(const Vec3& world) const;

  /// The number of rays that were given up (implicit::HitStatus::Unresolved); they count as misses.
  std::uint64_t unresolved() const { return unresolved_; }

 private:
  Box3 boundsOfPiece(std::size_t piece) const;
  /// Distance of the first hit in a piece; negative for a miss.
  float hitOf(std::size_t piece, const Vec3& origin, const Vec3& direction, float tMin,
              float tMax) const;
  static void boundsFunction(const RTCBoundsFunctionArguments* arguments);
  static void intersectFunction(const RTCIntersectFunctionNArguments* arguments);
  static void occludedFunction(const RTCOccludedFunctionNArguments* arguments);

  const scene::Mesh& mesh_;
  const frame::PlacedSurface& placed_;
  std::vector<implicit::Domain> pieces_;  ///< in local space
  RTCScene triangles_ = nullptr;          ///< in local space
  std::vector<Vec3>
      positions_;  ///< one more than the mesh has, because Embree reads beyond the last
  mutable std::atomic<std::uint64_t> unresolved_{0};
};

}  // namespace catoptric::trace
