// What cuts off the scene behind a cluster, and the depth of its image with it.
#pragma once

#include <cstdint>
#include <span>

#include "methods/second_order/cameras/window.h"

namespace catoptric::methods::second_order {

/// Depth of a planar cluster's image at infinity is 1 minus this.
constexpr double kDepthRange = 0.999;
/// What lies closer to a planar cluster, as a share of its distance from the eye, is not drawn: its
/// own surface above all. Ours.
constexpr double kClipSlack = 1e-4;

/// Rows of a depth that is 1 on the plane dot(normal, p) = offset and falls in front of it, so that
/// nothing behind the plane is drawn. `steepest`, the largest dot product of the normal with rays
/// that advance by 1 along the camera's axis, keeps it above 0.
Vec4 depthBeyond(const glm::dvec3& normal, double offset, double steepest, const Vec4& rowW);

/// Raises `ClusterWindow::lowest` of each curved cluster's plane until kMostBelow of its samples
/// lie below: a few samples on a rounded edge would let in all that stands behind the others.
void raiseClipPlanes(const Clustering& clustering, std::span<const std::uint8_t> curved,
                     std::span<const ClusterFrame> frames, std::span<const ClusterCamera> cameras,
                     std::span<ClusterWindow> windows);

/// Depth of a curved cluster's image: cut off by a plane below nearly all samples that hardly a
/// ray passes, or by a near plane before all samples where there is none.
void setDepth(const Cluster& cluster, const ClusterFrame& frame, const ClusterWindow& window,
              const Vec2& corner, float texel, ClusterCamera& made);

}  // namespace catoptric::methods::second_order
