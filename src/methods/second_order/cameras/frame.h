// The axes of a curved cluster's camera, and rectangles on its image planes.
#pragma once

#include <array>
#include <limits>

#include "core/math.h"
#include "methods/second_order/clustering/types.h"
#include "methods/second_order/lanes.h"
#include "scene/camera.h"

namespace catoptric::methods::second_order {

/// Tilts of the plane that removes what lies behind a curved cluster: its normal is n_c plus this
/// multiple of the camera's axis. The first plane that no reflected ray crosses is used. Not from
/// the paper.
constexpr std::array<float, 4> kClipTilts = {0.0f, 0.5f, 2.0f, 8.0f};

/// The coordinate frame of a curved cluster's camera.
struct ClusterFrame {
  Vec3 mirroredEye{0.0f};  ///< e_0
  Vec3 right{1.0f, 0.0f, 0.0f};
  Vec3 down{0.0f, -1.0f, 0.0f};
  Vec3 axis{0.0f, 0.0f, -1.0f};  ///< from e_0 to P_c
  float eyeToPlane = 1.0f;       ///< |P_c - e_0|
  float lobe = 0.0f;             ///< half angle of the cone around each reflected ray, in radians
  std::array<float, 4> tiltLength{1.0f, 1.0f, 1.0f, 1.0f};  ///< length of planeNormal + tilt * axis
};

/// `rays`: number of rays per glossy sample, which determines the lobe's width.
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

/// Bounding rectangles of the values of each lane.
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
