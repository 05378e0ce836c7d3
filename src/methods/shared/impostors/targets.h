// The possible contents of impostors: whole objects, or the planes of an object.
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

/// The properties of an object in its pose that impostors need.
struct Shape {
  Vec3 centroid{0.0f};  ///< of its surface
  float radius = 0.0f;  ///< of the bounding sphere about the centroid
  float area = 0.0f;
  /// The planes that contain all triangles. One: the object is flat. Empty: more than kMostPlanes.
  std::vector<Plane> planes;
  bool flat() const { return planes.size() == 1; }
};

/// Enough for a room, a box or an open cabinet. Not from the paper.
inline constexpr std::size_t kMostPlanes = 8;

struct SurfacePoint {
  Vec3 place;
  Vec3 normal;  ///< unit length
};
/// `count` points, each of which represents an equal part of the object's surface; none if it has
/// no area.
std::vector<SurfacePoint> pointsOn(const frame::Geometry& geometry, int object, int count);

/// `sceneMetres`: the scene's diameter. Distances below a small fraction of it count as zero.
Shape shapeOf(const frame::Geometry& geometry, int object, float sceneMetres);

/// The shapes of all objects, indexed by object.
std::vector<Shape> shapesOf(const frame::Geometry& geometry);

/// Vertices of the object, world space.
std::vector<Vec3> verticesOf(const frame::Geometry& geometry, int object);
/// The vertices of the object's triangles in a plane.
std::vector<Vec3> verticesIn(const frame::Geometry& geometry, int object, const Plane& plane,
                             float sceneMetres);

}  // namespace catoptric::methods::impostors
