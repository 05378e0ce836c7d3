// Coarser versions of objects (levels of detail), for passes with large texels.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "frame/geometry.h"
#include "frame/shading.h"
#include "raster/scene_gpu/level_fit.h"
#include "raster/scene_gpu/meshlets.h"

namespace catoptric::raster {

/// A coarser version of an object's triangles. Its vertices lie at positions of some of the
/// object's own vertices.
struct DetailLevel {
  LevelError error;
  std::uint32_t firstMeshlet = 0;
  std::uint32_t meshletCount = 0;
};

/// Coarser versions of all objects that do not deform, from fine to coarse. Each has about two
/// thirds of the triangles of the one before. Objects that are too small to gain have none.
struct DetailLevels {
  /// Vertex numbers. Numbers from geometry.vertexCount() on are the levels' own vertices.
  std::vector<std::uint32_t> indices;
  std::vector<Meshlet> meshlets;  ///< firstIndex counts from the start of `indices`
  std::vector<DetailLevel> levels;
  std::vector<std::uint32_t>
      firstOfObject;  ///< index into `levels`; one entry per object, and one past the end
  /// For each of the levels' own vertices: the vertex of the geometry at the same position, and the
  /// fitted attributes.
  std::vector<std::uint32_t> places;
  std::vector<frame::VertexAttributes> attributes;

  std::span<const DetailLevel> ofObject(std::size_t object) const {
    return {levels.data() + firstOfObject[object], levels.data() + firstOfObject[object + 1]};
  }
};

/// `sources[object]` describes each object. The result is the same for any thread count.
DetailLevels buildDetailLevels(const frame::Geometry& geometry,
                               std::span<const LevelSource> sources,
                               const frame::Lighting& lighting);

}  // namespace catoptric::raster
