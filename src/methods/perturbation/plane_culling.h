// Finds objects that a planar mirror certainly does not show. In scenes with many mirrors and
// objects these are most pairs of a mirror and an object.
#pragma once

#include <map>
#include <span>
#include <vector>

#include "frame/geometry.h"
#include "methods/perturbation/reflector.h"
#include "raster/regions/rectangle.h"
#include "scene/camera.h"

namespace catoptric::methods::perturbation {

/// Valid for one camera and one time.
class PlaneCulling {
 public:
  /// Rectangles refer to an image of width x height.
  PlaneCulling(const frame::Geometry& geometry, const scene::Camera& camera, int width, int height)
      : geometry_(geometry), camera_(camera), width_(width), height_(height) {}

  /// Whether no sample shows the object in these planes, which are ordered from the eye. `first`:
  /// object of the first plane, on whose samples the reflection appears.
  bool hides(std::span<const Plane<double>> planes, int first, int object);

 private:
  const raster::Rectangle& rectangleOf(int mirror);

  const frame::Geometry& geometry_;
  const scene::Camera& camera_;
  int width_;
  int height_;
  std::map<int, raster::Rectangle> rectangles_;  ///< screen rectangles of mirrors
};

}  // namespace catoptric::methods::perturbation
