// World-space triangles of the whole scene at one moment: the one definition of geometry that GL
// and Embree share, bit for bit. Objects are contiguous ranges, in order of their ids.
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

/// Everything of a vertex but its position; the same bytes go to GL.
struct VertexAttributes {
  Vec3 normal{0.0f, 1.0f, 0.0f};  ///< unit length
  Vec4 tangent{1.0f, 0.0f, 0.0f, 1.0f};
  Vec2 uv0{0.0f};
  Vec2 uv1{0.0f};
  Vec3 color{1.0f};
  /// Baked irradiance in W/m^2 (rgb) and ambient visibility 0..1 (a); (0,0,0,1) without a bake.
  Vec4 bake{0.0f, 0.0f, 0.0f, 1.0f};
};

/// One object's place in the arrays.
struct ObjectRange {
  std::uint32_t firstVertex = 0;
  std::uint32_t vertexCount = 0;
  std::uint32_t firstIndex = 0;  ///< a multiple of 3
  std::uint32_t indexCount = 0;
  bool moving = false;
  /// Its shape can change over time (morph targets, moving joints): worldFromObject does not say
  /// where its vertices are.
  bool deforms = false;
  Mat4 worldFromObject{1.0f};  ///< of the mesh's vertices at this moment; identity where skinned
  float scale = 1.0f;  ///< metres per unit of the mesh: cube root of worldFromObject's volume
  Box3 bounds;
  /// Square root of (texture area in uv units / world area), mean over the object, for uv set 0:
  /// times a texture's size it gives texels per metre for the choice of a mip level.
  float uvPerMetre = 0.0f;
  /// Index in Geometry::surfaces of the implicit surface that the triangles approximate; -1: none.
  /// Rays meet that surface; the triangles give its attributes, each point those of the nearest.
  int surface = -1;
};

/// An implicit surface in world space.
struct PlacedSurface {
  implicit::Surface surface;
  int object = 0;      ///< index in Geometry::objects
  double reach = 0.0;  ///< metres: the longest edge of its triangles; they are nearer than that
  /// Where a scale of 0 leaves nothing of the object: rays miss it, and `surface` says nothing.
  std::optional<Vec3> vanishedAt;
};

struct Geometry {
  /// One extra, unused position at the end: Embree reads 16 bytes at the last vertex.
  std::vector<Vec3> positions;
  std::vector<VertexAttributes> attributes;
  /// Absolute vertex numbers, three per triangle, wound so that the geometric normal lies on the
  /// side of the vertex normals (of the mesh as loaded; some models disagree with themselves).
  std::vector<std::uint32_t> indices;
  std::vector<ObjectRange> objects;  ///< objects[id - 1]
  /// Of the objects that have one: not those whose alpha mask cuts them.
  std::vector<PlacedSurface> surfaces;
  Box3 bounds;
  double timeSeconds = 0.0;

  std::size_t vertexCount() const { return attributes.size(); }
  std::size_t triangleCount() const { return indices.size() / 3; }
};

/// Flattens the scene at a moment. Throws SceneError when a transform makes positions non-finite or
/// flattens an implicit surface to a disk.
Geometry makeGeometry(const scene::Scene& scene, const scene::Pose& pose);

/// Recomputes moving objects only; returns the numbers (index in objects) of what changed.
std::vector<int> updateGeometry(Geometry& geometry, const scene::Scene& scene,
                                const scene::Pose& pose);

}  // namespace catoptric::frame
