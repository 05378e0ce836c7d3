// Small clusters of neighbouring triangles with bounds: what culling decides upon. Only triangles
// that can be proved invisible are culled, so images are the same with and without.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/math.h"
#include "frame/geometry.h"

namespace catoptric::raster {

/// A contiguous range of an object's reordered indices.
struct Meshlet {
  std::uint32_t firstIndex = 0;
  std::uint32_t indexCount = 0;
  Vec3 centre{0.0f};  ///< of the bounding sphere, world space
  float radius = 0.0f;
  /// All triangles' normals lie within the cone about coneAxis; from an eye with
  /// dot(centre - eye, coneAxis) >= coneCutoff * |centre - eye| + radius, all show their backs.
  /// coneCutoff > 1: never.
  Vec3 coneAxis{0.0f, 1.0f, 0.0f};
  float coneCutoff = 2.0f;
};

/// Reordered triangles of a whole geometry.
struct Meshlets {
  std::vector<std::uint32_t> indices;  ///< same triangles and windings, grouped by meshlet
  std::vector<Meshlet> meshlets;
  std::vector<std::uint32_t> firstOfObject;  ///< per object, and one past the end
  /// Objects that are closed surfaces with outward normals: from outside of their bounds their
  /// back faces are hidden behind their own front faces. (Not proved: parts turned inside out by
  /// passing through themselves. Objects that move or deform at any time therefore never are, so
  /// that a frame does not depend on the frames before it.)
  std::vector<bool> closed;

  std::span<const Meshlet> ofObject(std::size_t object) const {
    return {meshlets.data() + firstOfObject[object], meshlets.data() + firstOfObject[object + 1]};
  }
};

/// Groups triangles into meshlets of up to 64, along a space-filling curve (meshoptimizer).
/// Deterministic for any thread count.
Meshlets buildMeshlets(const frame::Geometry& geometry);

/// A coarser version of an object's triangles, on a subset of its vertices.
struct DetailLevel {
  float error = 0.0f;  ///< metres; how far its surface may lie from the object's own
  std::uint32_t firstMeshlet = 0;
  std::uint32_t meshletCount = 0;
};

/// Coarser versions of all objects that do not deform: from fine to coarse, each with about
/// two thirds of the triangles of the one before. What is too small to gain has none.
struct DetailLevels {
  std::vector<std::uint32_t> indices;
  std::vector<Meshlet> meshlets;  ///< firstIndex counts from the first of `indices`
  std::vector<DetailLevel> levels;
  std::vector<std::uint32_t> firstOfObject;  ///< into levels; per object, and one past the end

  std::span<const DetailLevel> ofObject(std::size_t object) const {
    return {levels.data() + firstOfObject[object], levels.data() + firstOfObject[object + 1]};
  }
};

/// What levels of an object must know of it beside its geometry.
struct LevelSource {
  bool whole = false;   ///< gets no levels (of what deforms their error would not hold)
  float albedo = 1.0f;  ///< largest component, mean over its texture
};

/// `sources[object]`. `skyIrradiance`: of ambient light and environment where all of them is
/// visible, W/m^2, the largest component. Deterministic for any thread count.
DetailLevels buildDetailLevels(const frame::Geometry& geometry,
                               std::span<const LevelSource> sources, float skyIrradiance);

/// Recomputes the bounds of meshlets (indices into `indices`) after vertices moved.
void updateBounds(std::span<Meshlet> meshlets, std::span<const std::uint32_t> indices,
                  const frame::Geometry& geometry);

/// Recomputes the bounds of one object's meshlets after its vertices moved.
void updateMeshletBounds(Meshlets& meshlets, const frame::Geometry& geometry, int object);

/// Whether all triangles of a meshlet certainly show their backs to an eye.
inline bool facesAway(const Meshlet& meshlet, const Vec3& eye) {
  const Vec3 toCentre = meshlet.centre - eye;
  return glm::dot(toCentre, meshlet.coneAxis) >=
         meshlet.coneCutoff * glm::length(toCentre) + meshlet.radius;
}

/// The clip volume of a matrix, as planes with dot(plane, (p, 1)) >= 0 inside.
class Frustum {
 public:
  /// For clip space -w <= x, y <= w and 0 <= z <= w.
  explicit Frustum(const Mat4& clipFromWorld);
  bool mayContain(const Vec3& centre, float radius) const;
  bool mayContain(const Box3& box) const;

 private:
  std::array<Vec4, 6> planes_;  ///< unit normals; degenerate ones (no far plane) accept all
};

}  // namespace catoptric::raster
