// Connectivity of a mesh: vertices welded by position, edges, and neighbouring triangles.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/math.h"

namespace catoptric::methods::glossy_lod {

/// Triangles of one object, in object space.
struct MeshView {
  std::span<const Vec3> positions;
  std::vector<std::uint32_t> indices;  ///< three per triangle
  std::span<const Vec3> normals = {};  ///< per vertex; equal normals mean that there is no crease
  std::size_t triangles() const { return indices.size() / 3; }
};

inline constexpr std::int32_t kNobody = -1;

/// Charts end where the angle between the normals of two triangles has a smaller cosine. Ours: 40
/// degrees.
inline constexpr float kCrease = 0.77f;

struct Topology {
  /// Per corner of a triangle (3 t + i): the first vertex at the same position.
  std::vector<std::uint32_t> vertex;
  /// Per side of a triangle (from corner i to the next one): the number of its edge, and the same
  /// side 3 t + i of the neighbouring triangle. kNobody unless two triangles, wound alike, share
  /// the edge.
  std::vector<std::uint32_t> edge;
  std::vector<std::int32_t> across;
  std::size_t edges = 0;
  std::vector<bool> degenerate;  ///< per triangle: it has no area
};

/// areaNormal(): a triangle's normal, with twice its area as length. smoothNormal(): unit length,
/// from its vertices' normals.
Vec3 areaNormal(const MeshView& mesh, std::size_t t);
Vec3 smoothNormal(const MeshView& mesh, std::size_t t);

Topology findTopology(const MeshView& mesh);

/// Joins triangles without a chart (kNobody) into charts, numbered from `charts` on. Each chart is
/// a topological disk within one group of triangles, bends little and crosses no crease. Degenerate
/// triangles get no chart. Returns the new number of charts.
std::int32_t growCharts(const MeshView& mesh, const Topology& topology,
                        const std::vector<std::uint32_t>& groupOf, std::int32_t charts,
                        std::vector<std::int32_t>& chartOf);

inline std::size_t nextCorner(std::size_t corner) {
  return corner % 3 == 2 ? corner - 2 : corner + 1;
}

}  // namespace catoptric::methods::glossy_lod
