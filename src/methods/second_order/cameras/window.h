// The area that the image of a curved cluster must contain: its samples and their rays' far ends.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "methods/second_order/cameras/cluster_camera.h"
#include "methods/second_order/cameras/frame.h"

namespace catoptric::methods::second_order {

/// What determines the size and the planes of the final camera.
struct ClusterWindow {
  SampleRect rect;  ///< in tangents
  float nearest = std::numeric_limits<float>::infinity();
  double spacing = 0.0;
  std::uint64_t pairs = 0;
  double walks = 0.0;  ///< sum over samples of the mirror ray's length in the image, in tangents
  /// Sum over samples: length of the mirror ray / distance of its end from the eye.
  double lobeShare = 0.0;
  std::array<float, kClipTilts.size()> lowest = allInfinite();  ///< lowest sample along each normal
  std::array<std::uint32_t, kClipTilts.size()> passing{};  ///< number of rays that cross the plane

  std::array<float, kClipTilts.size()> highest{};  ///< highest sample along each normal; positive
  float farthest = 0.0f;                           ///< farthest sample along the axis

  static std::array<float, kClipTilts.size()> allInfinite() {
    std::array<float, kClipTilts.size()> values;
    values.fill(std::numeric_limits<float>::infinity());
    return values;
  }
  void add(const ClusterWindow& w) {
    farthest = std::max(farthest, w.farthest);
    for (std::size_t k = 0; k < kClipTilts.size(); ++k) {
      lowest[k] = std::min(lowest[k], w.lowest[k]);
      highest[k] = std::max(highest[k], w.highest[k]);
      passing[k] += w.passing[k];
    }
    rect.extend(w.rect);
    nearest = std::min(nearest, w.nearest);
    spacing += w.spacing;
    walks += w.walks;
    lobeShare += w.lobeShare;
    pairs += w.pairs;
  }
};

/// The windows of the curved clusters, whose cameras already have their eyes. The result does not
/// depend on the number of threads.
std::vector<ClusterWindow> findWindows(const Clustering& clustering,
                                       std::span<const std::uint8_t> curved,
                                       std::span<const ClusterFrame> frames,
                                       std::span<const ClusterCamera> cameras,
                                       const Box3& sceneBounds);

}  // namespace catoptric::methods::second_order
