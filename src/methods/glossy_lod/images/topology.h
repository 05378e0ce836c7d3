// What hangs together in a mesh: its vertices welded by place, its edges, and triangles on both
// sides of an edge.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/math.h"

namespace catoptric::methods::glossy_lod {

/// Triangles of one object, in its own space.
struct MeshView {
  std::span<const Vec3> positions;
  std::vector<std::uint32_t> indices;  ///< three per triangle
  std::span<const Vec3> normals = {};  ///< of vertices: where they agree there is no crease
  std::size_t triangles() const { return indices.size() / 3; }
};

inline constexpr std::int32_t kNobody = -1;

struct Topology {
  /// Per corner of a triangle (3 t + i): the first vertex at the same place.
  std::vector<std::uint32_t> vertex;
  /// Per side (from corner i to the next one): the edge's number, and the corner 3 t + i on the
  /// other side of an edge between two triangles that are wound alike; kNobody elsewhere.
  std::vector<std::uint32_t> edge;
  std::vector<std::int32_t> across;
  std::size_t edges = 0;
  std::vector<bool> degenerate;  ///< per triangle: without area
};

/// A triangle's normal, as long as twice its area; and that of its vertices, of length 1.
Vec3 areaNormal(const MeshView& mesh, std::size_t t);
Vec3 smoothNormal(const MeshView& mesh, std::size_t t);

Topology findTopology(const MeshView& mesh);

/// Joins triangles without a chart (kNobody) into charts from number `charts` on: disks, by
/// construction, that do not bend much nor pass creases, each within one group of triangles.
/// Degenerate ones stay without. Returns the number of charts then.
std::int32_t growCharts(const MeshView& mesh, const Topology& topology,
                        const std::vector<std::uint32_t>& groupOf, std::int32_t charts,
                        std::vector<std::int32_t>& chartOf);

inline std::size_t nextCorner(std::size_t corner) {
  return corner % 3 == 2 ? corner - 2 : corner + 1;
}

}  // namespace catoptric::methods::glossy_lod
