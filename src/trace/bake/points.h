// The points that a bake lights: vertices welded by position and normal, moved a little so that
// they lie neither in a wall nor exactly in a corner, with the mesh's edges between them.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/math.h"
#include "frame/geometry.h"

namespace catoptric::trace {

struct BakePoints {
  std::vector<Vec3> positions;  ///< where rays start: off the surface, pulled into its triangles
  std::vector<Vec3> normals;
  std::vector<float> offsets;                ///< metres off the surface
  std::vector<std::uint32_t> pointOfVertex;  ///< one per vertex of the geometry
  // Neighbours along triangle edges: those of point i are neighbours[first[i] .. first[i + 1]).
  std::vector<std::uint32_t> first;
  std::vector<std::uint32_t> neighbours;

  std::size_t size() const { return positions.size(); }
  std::span<const std::uint32_t> neighboursOf(std::size_t i) const {
    return std::span(neighbours).subspan(first[i], first[i + 1] - first[i]);
  }
};

/// Points lie off their surface by a fiftieth of the mesh's edges there, at most 2e-4 of the
/// scene's diameter, and are pulled into their triangles by up to five times that.
BakePoints makeBakePoints(const frame::Geometry& geometry);

/// Mean of rgb, or a where rgb is 0.
float brightness(const Vec4& value);

/// Gives points that are not valid the mean of their valid neighbours, ring by ring; what no valid
/// point reaches keeps its value.
void fillInvalid(const BakePoints& points, std::vector<std::uint8_t> valid,
                 std::vector<Vec4>& values);

/// Averages each point with those neighbours that differ by less than about what noise explains:
/// takes noise away and leaves shadows. `noise`: standard error of each value's brightness (mean of
/// rgb, or a where rgb is 0), itself an estimate: it is averaged over two rings first.
void smoothValues(const BakePoints& points, int iterations, std::vector<float> noise,
                  std::vector<Vec4>& values);

}  // namespace catoptric::trace
