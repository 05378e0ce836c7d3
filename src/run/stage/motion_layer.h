// Layer `motion` of a frame: how far each surface point has moved in the image since the previous
// frame of the path.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/math.h"
#include "frame/geometry.h"
#include "scene/camera.h"
#include "scene/scene.h"

namespace catoptric::run {

/// The frame before the current one: its camera, and ObjectRange::worldFromObject of each object.
struct EarlierView {
  scene::Camera camera;
  std::vector<Mat4> worldFromObject;
};
EarlierView earlierView(const scene::Scene& scene, const scene::PathFrame& frame);

/// Where the samples of a frame are: reversed-Z depths and ids of objects, row 0 on top.
struct SamplePlaces {
  std::span<const float> depth;
  std::span<const std::uint32_t> object;
  int width = 0;  ///< pixels
  int height = 0;
  int samples = 1;  ///< per pixel and axis
};

/// Per pixel, of its middle sample: x and y by which the surface point moved in the image, in
/// pixels (y points down), and its distance along the view direction in the earlier frame, in
/// metres. All are 0 if that place is unknown: on the background, behind the earlier camera, and on
/// objects that change their shape.
std::vector<Vec3> motionLayer(const SamplePlaces& places, const scene::Camera& camera,
                              const frame::Geometry& geometry, const EarlierView& earlier);

}  // namespace catoptric::run
