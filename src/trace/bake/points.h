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
  /// Place of each point along a Morton curve through all points that face about the same way.
  /// Points with close ranks are close in space.
  std::vector<std::uint32_t> ranks;
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

/// What the rays of points tell about their values, per point.
struct ValueErrors {
  std::vector<float> noise;     ///< standard error of brightness()
  std::vector<float> nearness;  ///< mean of 1 / distance of what the rays hit, 1/m

  explicit ValueErrors(std::size_t points) : noise(points, 0.0f), nearness(points, 0.0f) {}
};

/// Averages each point with its neighbours, weighted by the point's variance over the square of the
/// difference to expect. Light changes by its own amount over the harmonic mean distance of the
/// surfaces around, or where the normal turns by a radian [Ward1988]: smoothing narrows
/// near other surfaces and on curved ones. Variances, which are estimates, are first averaged over
/// two rings of neighbours. Noisy points move more than their neighbours, so skewed noise loses
/// light: up to 0.4 % of the mean. Symmetric weights would halve this loss, but make errors of dark
/// points larger by up to a fifth.
void smoothValues(const BakePoints& points, const ValueErrors& errors, std::vector<Vec4>& values);

}  // namespace catoptric::trace
