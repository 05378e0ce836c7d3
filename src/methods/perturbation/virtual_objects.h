// Virtual objects: the triangles of an object as seen in a reflector [Chen2000] Sec. III-C.
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

/// Minimum of TriangleOptions::maxTraced, because even small images may show many reflections (not
/// from the paper).
inline constexpr std::size_t kFewestTraced = 262'144;

struct TriangleOptions {
  float errorPixels = 0.5f;  ///< edges are split if their middle is off by more; 0: never
  /// Maximum number of successive splits. Normally the apparent length of edges ends them earlier:
  /// 20 splits reduce a kilometre to a millimetre (not from the paper).
  int maxHalvings = 20;
  /// Edges are no longer split when one object would need more than this many retraced paths.
  std::size_t maxTraced = kFewestTraced;
  /// Called from any thread with the number of positions that were looked up; may be empty.
  std::function<void(std::size_t)> lookedUp;
};

struct TriangleCounts {
  PathCounts paths;
  std::uint64_t vertices = 0;   ///< number of looked-up positions
  std::uint64_t triangles = 0;  ///< triangles of virtual objects
  /// Triangles whose vertices lack matching reflections after all splits. Order auto cuts them
  /// instead.
  std::uint64_t dropped = 0;
  std::uint64_t coarse = 0;  ///< 1: maxTraced has ended the splitting
  void add(const TriangleCounts& other);
};

/// The part of a mesh's data that is independent of the reflector and usually stays valid. It is
/// rebuilt if other vertices coincide than before; its indices never change.
struct Connectivity {
  /// Three vertex numbers of the object.
  using Triangle = std::array<std::uint32_t, 3>;
  /// Two position indices, the smaller one first.
  struct Edge {
    std::uint32_t a = 0;
    std::uint32_t b = 0;
  };
  /// The edges of some triangles, each once, sorted.
  struct Edges {
    std::vector<Edge> ends;
    std::vector<std::uint32_t> of;  ///< three per triangle: the edge from corner c to the next one
  };
  std::vector<std::uint32_t> placeOf;  ///< position of each vertex; coinciding vertices share one
  std::vector<Triangle> triangles;
  Edges edges;
};

/// Makes the virtual triangles of one object (index into geometry.objects) in a sequence of
/// reflectors. `own`: the object is the last reflector. Overwrites `result` and reuses its memory.
void virtualTriangles(const frame::Geometry& geometry, int object, const Reflector& reflector,
                      bool own, const View& view, Order order, const TriangleOptions& options,
                      Connectivity& known, TriangleCounts& counts, VirtualTriangles& result);

/// The exact mirror image in a sequence of planes, which are ordered from the eye.
/// Overwrites `result` and reuses its memory.
void mirroredTriangles(const frame::Geometry& geometry, int object,
                       std::span<const Plane<double>> planes, const glm::dvec3& eye,
                       TriangleCounts& counts, VirtualTriangles& result);

}  // namespace catoptric::methods::perturbation
