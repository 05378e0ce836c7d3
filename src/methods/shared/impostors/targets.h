// What impostors can show: whole objects, or the planes that make up an object.
#pragma once

#include <vector>

#include "frame/geometry.h"
#include "scene/scene.h"

namespace catoptric::methods::impostors {

/// A plane of an object: all points with dot(normal, p) = offset.
struct Plane {
  Vec3 normal{0, 1, 0};  ///< unit length
  float offset = 0.0f;
  bool operator==(const Plane&) const = default;
};

/// An object in its pose, as far as impostors need it.
struct Shape {
  Vec3 centroid{0.0f};  ///< of its surface
  float radius = 0.0f;  ///< of the sphere about it that holds the vertices
  float area = 0.0f;
  /// Planes that hold all triangles; one: it is flat; none: there are more than kMostPlanes.
  std::vector<Plane> planes;
  bool flat() const { return planes.size() == 1; }
};

/// A room, a box, an open cabinet. Ours.
inline constexpr std::size_t kMostPlanes = 8;

/// `sceneMetres`: the scene's diameter, by which sizes that vanish are told.
Shape shapeOf(const frame::Geometry& geometry, int object, float sceneMetres);

/// Vertices of the object, world space.
std::vector<Vec3> verticesOf(const frame::Geometry& geometry, int object);
/// Those of its triangles that lie in a plane.
std::vector<Vec3> verticesIn(const frame::Geometry& geometry, int object, const Plane& plane,
                             float sceneMetres);

}  // namespace catoptric::methods::impostors
