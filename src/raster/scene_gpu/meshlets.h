// Meshlets: small clusters of neighbouring triangles with bounds, the units of culling. Only
// triangles that are provably invisible are culled, so the images are identical with and without
// culling.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/math.h"
#include "frame/geometry.h"

namespace catoptric::raster {

constexpr std::uint32_t kMeshletTriangles = 64;  ///< at most

/// A meshlet: a contiguous range of an object's reordered indices.
struct Meshlet {
  std::uint32_t firstIndex = 0;
  std::uint32_t indexCount = 0;
  Vec3 centre{0.0f};  ///< of the bounding sphere, world space
  float radius = 0.0f;
  /// The normals of all triangles lie within the cone about coneAxis. If dot(centre - eye,
  /// coneAxis) >= coneCutoff * |centre - eye| + radius, the eye sees only back faces. coneCutoff >
  /// 1: never.
  Vec3 coneAxis{0.0f, 1.0f, 0.0f};
  float coneCutoff = 2.0f;
};

/// The reordered triangles of a whole geometry.
struct Meshlets {
  std::vector<std::uint32_t> indices;  ///< the same triangles and windings, grouped by meshlet
  std::vector<Meshlet> meshlets;
  std::vector<std::uint32_t> firstOfObject;  ///< one entry per object, and one past the end
  /// Whether an object is a closed surface with outward normals. From outside of its bounds, its
  /// back faces are then hidden behind its own front faces. (This does not hold for parts that a
  /// self-intersection turns inside out.) It is false for objects that ever move or deform, so that
  /// a frame does not depend on the frames before it.
  std::vector<bool> closed;

  std::span<const Meshlet> ofObject(std::size_t object) const {
    return {meshlets.data() + firstOfObject[object], meshlets.data() + firstOfObject[object + 1]};
  }
};

/// Groups triangles into meshlets of up to 64 triangles, along a space-filling curve
/// (meshoptimizer). The result is the same for any thread count.
Meshlets buildMeshlets(const frame::Geometry& geometry);

/// The meshlets of one object, with indices from 0.
struct ObjectMeshlets {
  std::vector<std::uint32_t> indices;
  std::vector<Meshlet> meshlets;
  bool closed = false;
};

/// The indices of an object, counted from its first vertex.
std::vector<std::uint32_t> localIndices(const frame::Geometry& geometry,
                                        const frame::ObjectRange& range);

/// Appends triangles (indices from the object's first vertex) as meshlets. The triangles are sorted
/// along a space-filling curve and cut into runs. This takes a tenth of the time of growing
/// meshlets along shared vertices.
void appendMeshlets(const frame::Geometry& geometry, const frame::ObjectRange& range,
                    std::span<const std::uint32_t> local, ObjectMeshlets& result);

/// Recomputes the bounds of meshlets, whose ranges refer to `indices`, after vertices have moved.
void updateBounds(std::span<Meshlet> meshlets, std::span<const std::uint32_t> indices,
                  const frame::Geometry& geometry);

/// Recomputes the bounds of one object's meshlets after its vertices have moved.
void updateMeshletBounds(Meshlets& meshlets, const frame::Geometry& geometry, int object);

/// Whether an eye certainly sees only back faces of a meshlet.
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
  std::array<Vec4, 6>
      planes_;  ///< with unit normals; a degenerate plane (no far plane) accepts everything
};

}  // namespace catoptric::raster
