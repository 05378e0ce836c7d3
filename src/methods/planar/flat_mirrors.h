// The planes of flat mirrors, and views from mirrored eyes.
#pragma once

#include <vector>

#include "core/math.h"
#include "frame/geometry.h"
#include "raster/regions/rectangle.h"
#include "scene/scene.h"

namespace catoptric::methods::planar {

/// A plane in world space: normal . x = distance.
struct Plane {
  glm::dvec3 normal{0.0, 1.0, 0.0};  ///< unit length
  double distance = 0.0;             ///< metres

  double above(const Vec3& x) const { return glm::dot(normal, glm::dvec3(x)) - distance; }
};

/// Flat mirrors in one plane, which share a view.
struct FlatMirrors {
  Plane plane;
  std::vector<int> ids;  ///< of objects, ascending
  Box3 bounds;           ///< world space
};

/// Whether `planar` renders reflections in an object.
bool isFlatMirror(const scene::Scene& scene, const scene::Object& object);

/// The flat mirrors of a scene at one moment, by planes; objects that have no extent are left out.
std::vector<FlatMirrors> findFlatMirrors(const scene::Scene& scene,
                                         const frame::Geometry& geometry);

/// What an eye sees, directly or in mirrors.
struct View {
  glm::dmat4 clipFromWorld{1.0};        ///< reversed-Z, for the whole frame
  glm::dvec3 eye{0.0};                  ///< metres, world space
  glm::dvec4 clip{0.0, 0.0, 0.0, 1.0};  ///< x is drawn where dot(clip, (x, 1)) >= 0
};

/// The view in a mirror that `view` sees; of the scene, only the eye's side of the plane is drawn.
View mirrored(const View& view, const Plane& plane);

/// Whether no part of the box is drawn: it lies on the far side of the view's plane.
bool isCut(const View& view, const Box3& box);

/// clipFromWorld for drawing a part of a frame, with a viewport of that part.
Mat4 clipOfPart(const View& view, const raster::Rectangle& part, int width, int height);

}  // namespace catoptric::methods::planar
