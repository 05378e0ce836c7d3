// Virtual objects: the triangles of an object as a reflector shows them [Chen2000] Sec. III-C.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "frame/geometry.h"
#include "methods/perturbation/reflector.h"
#include "methods/perturbation/virtual_draw.h"

namespace catoptric::methods::perturbation {

/// What TriangleOptions::maxTraced is at least: small images show many reflections too (ours).
inline constexpr std::size_t kFewestTraced = 262'144;

struct TriangleOptions {
  float errorPixels = 0.5f;  ///< edges are halved where they miss their middle by more; 0: never
  /// Ends what the length of edges as seen from the reflector should have ended (ours: an edge of a
  /// kilometre comes to a millimetre).
  int maxHalvings = 20;
  /// Edges are halved no more where so many paths would have been traced anew for one object.
  std::size_t maxTraced = kFewestTraced;
  /// Hears, from any thread, how many places were looked up; may be empty.
  std::function<void(std::size_t)> lookedUp;
};

struct TriangleCounts {
  PathCounts paths;
  std::uint64_t vertices = 0;   ///< that were looked up; those in one place once
  std::uint64_t triangles = 0;  ///< of virtual objects
  /// Whose vertices have no or different numbers of reflections, after all halvings. None of order
  /// auto, which cuts them.
  std::uint64_t dropped = 0;
  std::uint64_t coarse = 0;  ///< 1: maxTraced has ended the halvings
  void add(const TriangleCounts& other);
};

/// What of one object's mesh stays from update to update as a rule, for any reflector; made anew
/// where other vertices coincide than before. Its indices never change.
struct Connectivity {
  /// Three vertices, by number in the object.
  using Triangle = std::array<std::uint32_t, 3>;
  /// Between two places, the smaller number first.
  struct Edge {
    std::uint32_t a = 0;
    std::uint32_t b = 0;
  };
  /// The edges of some triangles, each once, sorted.
  struct Edges {
    std::vector<Edge> ends;
    std::vector<std::uint32_t> of;  ///< three per triangle: from corner c to the next
  };
  std::vector<std::uint32_t> placeOf;  ///< by vertex: vertices that coincide are in one place
  std::vector<Triangle> triangles;
  Edges edges;
};

/// One object (index into geometry.objects) in a sequence of reflectors; `own`: it is the last of
/// them. `result` is written anew; the memory it has is used.
void virtualTriangles(const frame::Geometry& geometry, int object, const Reflector& reflector,
                      bool own, const View& view, Order order, const TriangleOptions& options,
                      Connectivity& known, TriangleCounts& counts, VirtualTriangles& result);

/// In planes alone, in the order from the eye on: mirrored, exactly.
VirtualTriangles mirroredTriangles(const frame::Geometry& geometry, int object,
                                   std::span<const Plane<double>> planes, const glm::dvec3& eye,
                                   TriangleCounts& counts);

}  // namespace catoptric::methods::perturbation
