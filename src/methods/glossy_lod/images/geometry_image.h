// Geometry images of an object [Gu2002], [Sander2003]: its surface as square grids of vertices,
// one grid per chart. Neighbouring charts share the vertices along their common border, so that
// the finest level has no gaps. Levels::Stitched closes the gaps between coarser levels.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "methods/glossy_lod/images/flat_mesh.h"

namespace catoptric::methods::glossy_lod {

/// A grid vertex, on a triangle or an edge of the object: p0 + w1 (p1 - p0) + w2 (p2 - p0).
struct Sample {
  std::array<std::uint32_t, 3> vertex{};  ///< vertex numbers of the object
  float w1 = 0.0f;
  float w2 = 0.0f;
};

/// A chart's grid of 2^level x 2^level quads, and its square of 2^texelLevel x 2^texelLevel texels.
struct ChartImage {
  int level = 0;
  int texelLevel = 0;
  std::uint32_t firstGrid = 0;  ///< start in ObjectImage::grid: (2^level + 1)^2 entries, row by row
  std::uint32_t firstTexel = 0;  ///< start in ObjectImage::texels: 4^texelLevel entries
  bool plain = false;            ///< the chart is one or two triangles of the object, unchanged
};

struct ObjectImage {
  std::vector<Sample> samples;
  std::vector<std::uint32_t> grid;    ///< indices of samples
  std::vector<TrianglePlace> texels;  ///< position of each texel's centre on the object
  std::vector<ChartImage> charts;
  std::uint64_t plainTriangles = 0;       ///< triangles in plain charts
  std::uint64_t degenerateTriangles = 0;  ///< triangles without area, which are left out
  std::uint64_t notFlattened = 0;         ///< charts that could not be flattened and were divided
  double meanStretch = 1.0;  ///< mean of FlatMesh::stretch() over charts that are not plain
  double mostStretch = 1.0;
};

/// How fine an image is, approximately.
struct ImageSize {
  double quads = 0.0;  ///< number over all charts, which share it by area and by triangle count
  /// Number over all charts, which share it by area; 0: one texel for each quad.
  double texels = 0.0;
  int most = 0;  ///< maximum number of quads or texels along the edge of a chart
};

ObjectImage makeObjectImage(const MeshView& mesh, const ImageSize& size);

}  // namespace catoptric::methods::glossy_lod
