// The points that a bake lights: vertices welded by position and normal, and connected by the
// mesh's edges. Points are moved slightly, so that they lie neither in a wall nor exactly in a
// corner.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/math.h"
#include "frame/geometry.h"

namespace catoptric::trace {

struct BakePoints {
  std::vector<Vec3>
      positions;  ///< origins of rays: lifted off the surface, and pulled into its triangles
  std::vector<Vec3> normals;
  std::vector<float> offsets;                ///< metres by which points are lifted off the surface
  std::vector<std::uint32_t> pointOfVertex;  ///< indexed by vertex of the geometry
  // Neighbours along triangle edges: those of point i are neighbours[first[i]] to
  // neighbours[first[i + 1] - 1].
  std::vector<std::uint32_t> first;
  std::vector<std::uint32_t> neighbours;

  std::size_t size() const { return positions.size(); }
  std::span<const std::uint32_t> neighboursOf(std::size_t i) const {
    return std::span(neighbours).subspan(first[i], first[i + 1] - first[i]);
  }
};

/// Lifts points off their surface by a fiftieth of the length of the mesh's edges there, at most
/// 2e-4 of the scene's diameter. Pulls them into their triangles by up to five times that distance.
BakePoints makeBakePoints(const frame::Geometry& geometry);

/// The mean of rgb; a if rgb is 0.
float brightness(const Vec4& value);

/// Sets points that are not valid to the mean of their valid neighbours, ring by ring. Points that
/// cannot be reached from a valid point keep their value.
void fillInvalid(const BakePoints& points, std::vector<std::uint8_t> valid,
                 std::vector<Vec4>& values);

/// Averages each point with those neighbours whose difference noise can explain. This removes noise
/// and keeps shadows. `noise`: standard error of each value's brightness(). As this is an estimate
/// itself, it is first averaged over two rings of neighbours.
void smoothValues(const BakePoints& points, int iterations, std::vector<float> noise,
                  std::vector<Vec4>& values);

}  // namespace catoptric::trace
