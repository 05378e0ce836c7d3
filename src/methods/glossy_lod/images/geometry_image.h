// Geometry images of an object [Gu2002], [Sander2003]: its surface as square grids of vertices, one
// for each chart. Neighbouring charts have the same vertices along their common border, so that
// there are no gaps.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "methods/glossy_lod/images/flat_mesh.h"

namespace catoptric::methods::glossy_lod {

/// A vertex of the grids, on a triangle of the object or an edge of it:
/// p0 + w1 (p1 - p0) + w2 (p2 - p0).
struct Sample {
  std::array<std::uint32_t, 3> vertex{};  ///< of the object
  float w1 = 0.0f;
  float w2 = 0.0f;
};

/// A chart's grid of 2^level x 2^level quads and its square of 2^texelLevel texels a side.
struct ChartImage {
  int level = 0;
  int texelLevel = 0;
  std::uint32_t firstGrid = 0;   ///< of ObjectImage::grid: (2^level + 1)^2, row by row
  std::uint32_t firstTexel = 0;  ///< of ObjectImage::texels: 4^texelLevel
  bool plain = false;            ///< one or two triangles, as they are
};

struct ObjectImage {
  std::vector<Sample> samples;
  std::vector<std::uint32_t> grid;    ///< numbers of samples
  std::vector<TrianglePlace> texels;  ///< where on the object the centre of each texel lies
  std::vector<ChartImage> charts;
  std::uint64_t plainTriangles = 0;       ///< traced as they are
  std::uint64_t degenerateTriangles = 0;  ///< without area, left out
  std::uint64_t notFlattened = 0;         ///< charts that could not be, and were cut
  double meanStretch = 1.0;  ///< of FlatMesh::stretch(), over charts that are not plain
  double mostStretch = 1.0;
};

/// `quads`: as many as all charts have together, about: they are shared by area and by triangles.
/// `size`: quads along the edge of a chart at the most.
ObjectImage makeObjectImage(const MeshView& mesh, double quads, int size);

}  // namespace catoptric::methods::glossy_lod
