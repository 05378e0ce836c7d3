// Virtual objects: the triangles of an object as a reflector shows them [Chen2000] Sec. III-C.
#pragma once

#include <cstdint>
#include <span>

#include "frame/geometry.h"
#include "methods/perturbation/reflector.h"
#include "raster/virtual_objects.h"

namespace catoptric::methods::perturbation {

struct TriangleOptions {
  float errorPixels = 0.5f;  ///< edges are halved where they miss their middle by more; 0: never
  int maxHalvings = 8;
};

struct TriangleCounts {
  PathCounts paths;
  std::uint64_t vertices = 0;   ///< that were looked up; those in one place once
  std::uint64_t triangles = 0;  ///< of virtual objects
  /// Whose vertices have no or different numbers of reflections, after all halvings.
  std::uint64_t dropped = 0;
  std::uint64_t outside = 0;  ///< vertices outside the octree
  void add(const TriangleCounts& other);
};

/// One object (index into geometry.objects) in a sequence of reflectors; `own`: it is the last of
/// them.
raster::VirtualTriangles virtualTriangles(const frame::Geometry& geometry, int object,
                                          const Reflector& reflector, bool own, const View& view,
                                          Order order, const TriangleOptions& options,
                                          TriangleCounts& counts);

/// In planes alone, in the order from the eye on: mirrored, exactly.
raster::VirtualTriangles mirroredTriangles(const frame::Geometry& geometry, int object,
                                           std::span<const Plane<double>> planes,
                                           const glm::dvec3& eye, TriangleCounts& counts);

}  // namespace catoptric::methods::perturbation
