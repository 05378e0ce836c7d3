// Coarser versions of objects, for passes whose texels are larger than triangles.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "frame/geometry.h"
#include "frame/shading.h"
#include "raster/scene_gpu/level_fit.h"
#include "raster/scene_gpu/meshlets.h"

namespace catoptric::raster {

/// A coarser version of an object's triangles, with vertices at places of some of its own.
struct DetailLevel {
  LevelError error;
  std::uint32_t firstMeshlet = 0;
  std::uint32_t meshletCount = 0;
};

/// Coarser versions of all objects that do not deform: from fine to coarse, each with about
/// two thirds of the triangles of the one before. What is too small to gain has none.
struct DetailLevels {
  /// Vertices of the geometry; from geometry.vertexCount() on those that levels have of their own.
  std::vector<std::uint32_t> indices;
  std::vector<Meshlet> meshlets;  ///< firstIndex counts from the first of `indices`
  std::vector<DetailLevel> levels;
  std::vector<std::uint32_t> firstOfObject;  ///< into levels; per object, and one past the end
  /// Levels' own vertices: the vertex of the geometry at the same place, and what it shows of its
  /// surroundings.
  std::vector<std::uint32_t> places;
  std::vector<frame::VertexAttributes> attributes;

  std::span<const DetailLevel> ofObject(std::size_t object) const {
    return {levels.data() + firstOfObject[object], levels.data() + firstOfObject[object + 1]};
  }
};

/// `sources[object]`. Deterministic for any thread count.
DetailLevels buildDetailLevels(const frame::Geometry& geometry,
                               std::span<const LevelSource> sources,
                               const frame::Lighting& lighting);

}  // namespace catoptric::raster
