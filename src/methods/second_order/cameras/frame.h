// Axes of a curved cluster's camera, and rectangles on its image planes.
#pragma once

#include <array>
#include <limits>

#include "core/math.h"
#include "methods/second_order/clustering/types.h"
#include "methods/second_order/lanes.h"
#include "scene/camera.h"

namespace catoptric::methods::second_order {

/// Planes that cut off what lies behind a curved cluster: their normals are n_c plus so much of the
/// camera's axis; the first that no reflected ray passes is taken. Ours.
constexpr std::array<float, 4> kClipTilts = {0.0f, 0.5f, 2.0f, 8.0f};

/// Axes of a curved cluster's camera, and where rays from the mirrored eye pass its image plane.
struct ClusterFrame {
  Vec3 mirroredEye{0.0f};  ///< e_0
  Vec3 right{1.0f, 0.0f, 0.0f};
  Vec3 down{0.0f, -1.0f, 0.0f};
  Vec3 axis{0.0f, 0.0f, -1.0f};                             ///< from e_0 to P_c
  float eyeToPlane = 1.0f;                                  ///< |P_c - e_0|
  float lobe = 0.0f;                                        ///< radians around each reflected ray
  std::array<float, 4> tiltLength{1.0f, 1.0f, 1.0f, 1.0f};  ///< of planeNormal + tilt axis
};

/// The axes; the lobe of a cluster whose glossy samples have `rays` rays.
ClusterFrame frameOf(const Cluster& cluster, const scene::Camera& camera, int rays);

struct SampleRect {
  Vec2 min{std::numeric_limits<float>::infinity()};
  Vec2 max{-std::numeric_limits<float>::infinity()};
  void extend(const Vec2& p) {
    min = glm::min(min, p);
    max = glm::max(max, p);
  }
  void extend(const SampleRect& r) {
    min = glm::min(min, r.min);
    max = glm::max(max, r.max);
  }
  float diagonal() const { return min.x > max.x ? 0.0f : glm::length(max - min); }
};

/// Rectangles of what passes each lane.
struct LanesRect {
  Lanes2 min{floats4(std::numeric_limits<float>::infinity()),
             floats4(std::numeric_limits<float>::infinity())};
  Lanes2 max{floats4(-std::numeric_limits<float>::infinity()),
             floats4(-std::numeric_limits<float>::infinity())};
  void extend(const Lanes2& p) {
    min = {least(p.x, min.x), least(p.y, min.y)};
    max = {most(p.x, max.x), most(p.y, max.y)};
  }
  void extend(const Lanes2& p, const Mask4& counts) {
    min = {counts ? least(min.x, p.x) : min.x, counts ? least(min.y, p.y) : min.y};
    max = {counts ? most(max.x, p.x) : max.x, counts ? most(max.y, p.y) : max.y};
  }
  SampleRect all() const {
    return {{leastOf(min.x), leastOf(min.y)}, {mostOf(max.x), mostOf(max.y)}};
  }
};

}  // namespace catoptric::methods::second_order
