// A ball before the paper's vase, for tests and benchmarks of virtual objects.
#pragma once

#include <cstdint>

#include "frame/geometry.h"
#include "methods/perturbation/virtual_objects.h"
#include "scene/camera.h"
#include "scene/implicit/surface.h"
#include "scene/shapes/shapes.h"

namespace catoptric::methods::perturbation {

struct BallBeforeVase {
  implicit::Surface vase = implicit::vaseSurface();
  frame::Geometry geometry;
  Turn turn{&vase, {}};
  Box3 around;
  View view{scene::lookAt({0.0f, 2.6f, 5.4f}, {0.0f, 0.78f, 0.2f}, {0.0f, 1.0f, 0.0f}, 0.65f), 640,
            480};

  /// 2 * rows segments around the ball.
  explicit BallBeforeVase(int rows) {
    const scene::Mesh ball = scene::makeSphere(0.5f, 2 * rows, rows, scene::UvMode::Metres);
    for (const Vec3& p : ball.positions) geometry.positions.push_back(p + Vec3(0.9f, 0.9f, 1.2f));
    geometry.attributes.resize(geometry.positions.size());
    geometry.indices = ball.indices;
    frame::ObjectRange range;
    range.vertexCount = static_cast<std::uint32_t>(geometry.positions.size());
    range.indexCount = static_cast<std::uint32_t>(geometry.indices.size());
    geometry.objects.push_back(range);
    turn.bounds.extend(Vec3(-1.0f, 0.0f, -1.0f));
    turn.bounds.extend(Vec3(1.0f, 2.0f, 1.0f));
    around.extend(Vec3(-4.0f, -1.0f, -4.0f));
    around.extend(Vec3(4.0f, 4.0f, 6.0f));
  }
  BallBeforeVase(const BallBeforeVase&) = delete;
  BallBeforeVase& operator=(const BallBeforeVase&) = delete;
};

}  // namespace catoptric::methods::perturbation
