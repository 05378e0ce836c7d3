// The clip plane that removes what lies behind a cluster, and the depth of the cluster's image.
#pragma once

#include <cstdint>
#include <span>

#include "methods/second_order/cameras/window.h"

namespace catoptric::methods::second_order {

/// Depth of a planar cluster's image at infinity is 1 minus this.
constexpr double kDepthRange = 0.999;
/// Surfaces closer to a planar cluster than this fraction of its distance from the eye are not
/// drawn. This excludes mainly the cluster's own surface. Not from the paper.
constexpr double kClipSlack = 1e-4;

/// The row of a projection whose depth is 1 on the plane dot(normal, p) = offset and decreases in
/// front of it, so that nothing behind the plane is drawn. `steepest`: the largest dot product of
/// the normal with rays that advance by 1 along the camera's axis; it keeps depth above 0.
Vec4 depthBeyond(const glm::dvec3& normal, double offset, double steepest, const Vec4& rowW);

/// Raises `ClusterWindow::lowest` of each curved cluster's plane until the fraction kMostBelow of
/// its samples lies below. Otherwise a few samples on a rounded edge would admit everything behind
/// the other samples.
void raiseClipPlanes(const Clustering& clustering, std::span<const std::uint8_t> curved,
                     std::span<const ClusterFrame> frames, std::span<const ClusterCamera> cameras,
                     std::span<ClusterWindow> windows);

/// Sets the depth of a curved cluster's image. If few rays cross a plane below nearly all samples,
/// that plane is the clip plane, and nothing behind it is drawn. Otherwise a near plane in front of
/// all samples is used.
void setDepth(const Cluster& cluster, const ClusterFrame& frame, const ClusterWindow& window,
              const Vec2& corner, float texel, ClusterCamera& made);

}  // namespace catoptric::methods::second_order
