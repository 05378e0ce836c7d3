// An implicit surface as Embree user geometry: boxes that hold pieces of it, in each of which a ray
// meets the surface itself, and its triangles' structure for the attributes of hits.
#pragma once

#include <embree3/rtcore.h>

#include <atomic>
#include <cstdint>
#include <vector>

#include "frame/geometry.h"

namespace catoptric::trace {

class ImplicitGeometry {
 public:
  /// `placed` follows the object and outlives this. `attributes`: hits tell the nearest triangle;
  /// without it they all are at triangle 0.
  ImplicitGeometry(RTCDevice device, const scene::Mesh& mesh, const frame::PlacedSurface& placed,
                   bool attributes);
  ~ImplicitGeometry();
  ImplicitGeometry(const ImplicitGeometry&) = delete;
  ImplicitGeometry& operator=(const ImplicitGeometry&) = delete;

  /// Makes `geometry`, of type user, be this surface.
  void attach(RTCGeometry geometry);

  /// World-space box of all pieces.
  Box3 bounds() const;

  /// The triangle nearest to a point, and its barycentric coordinates there.
  struct Nearest {
    unsigned primitive = 0;
    float u = 0.0f;
    float v = 0.0f;
  };
  Nearest nearestTriangle(const Vec3& world) const;

  /// Rays that were given up on (implicit::HitStatus::Unresolved): they missed.
  std::uint64_t unresolved() const { return unresolved_; }

 private:
  Box3 boundsOfPiece(std::size_t piece) const;
  /// Distance of the first hit in a piece, or a negative number.
  float hitOf(std::size_t piece, const Vec3& origin, const Vec3& direction, float tMin,
              float tMax) const;
  static void boundsFunction(const RTCBoundsFunctionArguments* arguments);
  static void intersectFunction(const RTCIntersectFunctionNArguments* arguments);
  static void occludedFunction(const RTCOccludedFunctionNArguments* arguments);

  const scene::Mesh& mesh_;
  const frame::PlacedSurface& placed_;
  std::vector<implicit::Domain> pieces_;  ///< local
  RTCScene triangles_ = nullptr;          ///< local
  std::vector<Vec3> positions_;           ///< one more than the mesh has: Embree reads beyond
  mutable std::atomic<std::uint64_t> unresolved_{0};
};

}  // namespace catoptric::trace
