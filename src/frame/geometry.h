// The world-space triangles of the whole scene at one time. GL and Embree both use this geometry,
// so it is bit-identical for both. Objects are contiguous ranges, ordered by id.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/math.h"
#include "scene/animate.h"
#include "scene/implicit/surface.h"
#include "scene/scene.h"

namespace catoptric::frame {

/// The attributes of a vertex, except its position. GL receives the same bytes.
struct VertexAttributes {
  Vec3 normal{0.0f, 1.0f, 0.0f};  ///< unit length
  Vec4 tangent{1.0f, 0.0f, 0.0f, 1.0f};
  Vec2 uv0{0.0f};
  Vec2 uv1{0.0f};
  Vec3 color{1.0f};
  /// Baked irradiance in W/m^2 (rgb) and ambient visibility 0..1 (a); (0,0,0,1) without a bake.
  Vec4 bake{0.0f, 0.0f, 0.0f, 1.0f};
};

/// The range of one object in the arrays.
struct ObjectRange {
  std::uint32_t firstVertex = 0;
  std::uint32_t vertexCount = 0;
  std::uint32_t firstIndex = 0;  ///< a multiple of 3
  std::uint32_t indexCount = 0;
  bool moving = false;
  /// Whether its shape can change over time (morph targets, moving joints). The vertices then do
  /// not follow from worldFromObject alone.
  bool deforms = false;
  Mat4 worldFromObject{
      1.0f};  ///< transform of the mesh's vertices at this moment; identity for skinned objects
  Box3 bounds;
  /// Square root of (texture area in uv units / world area), averaged over the object, for uv set
  /// 0. Multiplied by a texture's size it gives texels per metre, which determines the mip level.
  float uvPerMetre = 0.0f;
  /// Index in Geometry::surfaces of the implicit surface that the triangles approximate; -1: none.
  /// Rays are intersected with that surface. The attributes of a hit are those of the nearest point
  /// of the triangles.
  int surface = -1;
};

/// An implicit surface in world space.
struct PlacedSurface {
  implicit::Surface surface;
  int object = 0;      ///< index in Geometry::objects
  double reach = 0.0;  ///< metres: the longest edge of the triangles; every triangle lies within
                       ///< this distance of the surface
  /// Set if a scale of 0 makes the object vanish: rays then miss it, and `surface` is not valid.
  std::optional<Vec3> vanishedAt;
};

struct Geometry {
  /// There is one extra, unused position at the end, because Embree reads beyond the last.
  std::vector<Vec3> positions;
  std::vector<VertexAttributes> attributes;
  /// Vertex numbers, three per triangle, counted over the whole scene. The winding is such that the
  /// geometric normal lies on the side of the vertex normals of the mesh as loaded (some models are
  /// inconsistent in this).
  std::vector<std::uint32_t> indices;
  std::vector<ObjectRange> objects;  ///< objects[id - 1]
  /// The implicit surfaces of the objects that have one, except objects with an alpha mask.
  std::vector<PlacedSurface> surfaces;
  Box3 bounds;
  double timeSeconds = 0.0;

  std::size_t vertexCount() const { return attributes.size(); }
  std::size_t triangleCount() const { return indices.size() / 3; }
};

/// Asks memory for the vertices of a triangle (three vertex numbers) before they are read.
inline void prefetchTriangle(const Geometry& geometry, const std::uint32_t* triangle) {
  for (int i = 0; i < 3; ++i) {
    __builtin_prefetch(&geometry.positions[triangle[i]]);
    const VertexAttributes& attributes = geometry.attributes[triangle[i]];
    __builtin_prefetch(&attributes);
    __builtin_prefetch(&attributes.bake);
  }
}

/// Whether a scale of 0 leaves no more of the object (index in `objects`) than a point or a line,
/// which no ray hits.
bool vanished(const Geometry& geometry, int object);

/// Builds the geometry of the scene at one time. Throws SceneError if a transform makes positions
/// non-finite or flattens an implicit surface to a disk.
Geometry makeGeometry(const scene::Scene& scene, const scene::Pose& pose);

/// The size of the arrays of makeGeometry().
std::uint64_t geometryBytes(const scene::Scene& scene);

/// Recomputes the moving objects only. Returns the indices (in `objects`) of those that changed.
std::vector<int> updateGeometry(Geometry& geometry, const scene::Scene& scene,
                                const scene::Pose& pose);

}  // namespace catoptric::frame
