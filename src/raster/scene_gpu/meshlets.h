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

/// One object's meshlets, with indices from 0.
struct ObjectMeshlets {
  std::vector<std::uint32_t> indices;
  std::vector<Meshlet> meshlets;
  bool closed = false;
};

/// An object's indices, counted from its first vertex.
std::vector<std::uint32_t> localIndices(const frame::Geometry& geometry,
                                        const frame::ObjectRange& range);

/// Appends triangles (indices from the object's first vertex) as meshlets: along a space-filling
/// curve, cut into runs: neighbours in space, at a tenth of the cost of growing meshlets along
/// shared vertices.
void appendMeshlets(const frame::Geometry& geometry, const frame::ObjectRange& range,
                    std::span<const std::uint32_t> local, ObjectMeshlets& result);

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
