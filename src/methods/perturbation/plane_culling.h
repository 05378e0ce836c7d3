// What planar mirrors certainly show nothing of: most pairs of many mirrors and objects.
#pragma once

#include <map>
#include <span>
#include <vector>

#include "frame/geometry.h"
#include "methods/perturbation/reflector.h"
#include "raster/regions/rectangle.h"
#include "scene/camera.h"

namespace catoptric::methods::perturbation {

/// Of one camera and one moment.
class PlaneCulling {
 public:
  /// Rectangles are of an image of width x height.
  PlaneCulling(const frame::Geometry& geometry, const scene::Camera& camera, int width, int height)
      : geometry_(geometry), camera_(camera), width_(width), height_(height) {}

  /// Whether no sample shows the object in these planes, in their order from the eye on. `first`:
  /// object of the first plane, on whose samples all of it shows.
  bool hides(std::span<const Plane<double>> planes, int first, int object);

 private:
  const raster::Rectangle& rectangleOf(int mirror);

  const frame::Geometry& geometry_;
  const scene::Camera& camera_;
  int width_;
  int height_;
  std::map<int, raster::Rectangle> rectangles_;  ///< of mirrors
};

}  // namespace catoptric::methods::perturbation
