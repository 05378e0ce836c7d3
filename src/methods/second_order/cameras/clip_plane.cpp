#include "methods/second_order/cameras/clip_plane.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <vector>

namespace catoptric::methods::second_order {
namespace {

/// Share of rays that may pass the plane (shading normals can turn them below their own surface).
/// Ours.
constexpr double kMostPassing = 0.005;
/// Share of samples that may lie below it, by steps of their heights' range, from about so many
/// samples of each cluster. Ours.
constexpr double kMostBelow = 0.1;
constexpr float kFlatShare = 1e-6f;  ///< of the heights: nothing to raise in less
constexpr std::size_t kHeightSteps = 64;
constexpr std::uint32_t kHeightSamples = 1024;

/// The half space that begins `height` beyond the eye along a normal, and a little more.
Vec4 planeAbove(const glm::dvec3& normal, double height, double distance, const Vec3& eye) {
  const double offset = glm::dot(normal, glm::dvec3(eye)) + height + kClipSlack * distance;
  return Vec4(glm::dvec4(normal, -offset));
}

/// Whether few rays pass the plane with the k-th tilt below all samples, and the eye lies behind
/// it.
bool cutsOff(const Cluster& cluster, const ClusterWindow& window, std::size_t k) {
  return window.passing[k] <= kMostPassing * cluster.samples && window.lowest[k] > 0.0f;
}

}  // namespace

Vec4 depthBeyond(const glm::dvec3& normal, double offset, double steepest, const Vec4& rowW) {
  return Vec4(glm::dvec4(rowW) - kDepthRange / steepest * glm::dvec4(normal, -offset));
}

void raiseClipPlanes(const Clustering& clustering, std::span<const std::uint8_t> curved,
                     std::span<const ClusterFrame> frames, std::span<const ClusterCamera> cameras,
                     std::span<ClusterWindow> windows) {
  struct Heights {
    Vec3 normal{0.0f};
    float eye = 0.0f;    ///< the eye's, from the frame's eye
    float scale = 0.0f;  ///< steps per unit; 0: not raised
    std::size_t tilt = 0;
    std::uint32_t every = 1;  ///< so many samples, one is looked at
    std::uint32_t next = 0;   ///< samples until then
    std::array<std::uint32_t, kHeightSteps> count{};
  };
  const std::vector<Cluster>& clusters = clustering.clusters();
  std::vector<Heights> heights(clusters.size());
  for (std::size_t c = 0; c < clusters.size(); ++c) {
    Heights& of = heights[c];
    if (curved[c] == 0 || clusters[c].planar) continue;
    while (of.tilt < kClipTilts.size() && !cutsOff(clusters[c], windows[c], of.tilt)) ++of.tilt;
    if (of.tilt == kClipTilts.size()) continue;
    const float highest = windows[c].highest[of.tilt];
    const float range = highest - windows[c].lowest[of.tilt];
    if (!(range > kFlatShare * highest)) continue;
    of.normal = clusters[c].planeNormal + kClipTilts[of.tilt] * frames[c].axis;
    of.eye = glm::dot(cameras[c].eye, of.normal);
    of.scale = static_cast<float>(kHeightSteps) / range;
    of.every = std::max(1u, clusters[c].samples / kHeightSamples);
  }
  for (const SampleBlock& block : clustering.blocks()) {
    for (const SampleRun& run : block.runs) {
      const std::size_t c = block.slots[run.slot];
      Heights& of = heights[c];
      if (of.scale == 0.0f) continue;
      std::uint32_t i = of.next;
      for (; i < run.count; i += of.every) {
        const float height = glm::dot(block.position[run.first + i], of.normal) - of.eye;
        const float step = (height - windows[c].lowest[of.tilt]) * of.scale;
        ++of.count[static_cast<std::size_t>(
            std::clamp(step, 0.0f, static_cast<float>(kHeightSteps - 1)))];
      }
      of.next = i - run.count;
    }
  }
  for (std::size_t c = 0; c < clusters.size(); ++c) {
    const Heights& of = heights[c];
    if (of.scale == 0.0f) continue;
    const double all = std::accumulate(of.count.begin(), of.count.end(), 0.0);
    std::size_t step = 0;
    for (double below = of.count[0]; below <= kMostBelow * all; below += of.count[step]) ++step;
    windows[c].lowest[of.tilt] += static_cast<float>(step) / of.scale;
  }
}

void setDepth(const Cluster& cluster, const ClusterFrame& frame, const ClusterWindow& window,
              const Vec2& corner, float texel, ClusterCamera& made) {
  for (std::size_t k = 0; k < kClipTilts.size(); ++k) {
    const glm::dvec3 normal = glm::dvec3(cluster.planeNormal) +
                              static_cast<double>(kClipTilts[k]) * glm::dvec3(frame.axis);
    if (!cutsOff(cluster, window, k)) continue;
    const double length = glm::length(normal);
    const double lowest = static_cast<double>(window.lowest[k]) / length;
    const glm::dvec3 unit = normal / length;
    double steepest = 0.0;
    for (const float x : {window.rect.min.x, window.rect.max.x}) {
      for (const float y : {window.rect.min.y, window.rect.max.y}) {
        steepest = std::max(
            steepest, glm::dot(unit, glm::dvec3(frame.axis + x * frame.right + y * frame.down)));
      }
    }
    if (!(steepest > 1e-6)) continue;
    // A planar cluster's own surface lies on the plane: beyond it. A curved one's is left out by
    // its facing.
    const double distance = glm::length(glm::dvec3(cluster.centroid));
    const double offset = glm::dot(unit, glm::dvec3(made.eye)) + lowest +
                          (cluster.planar ? kClipSlack : -kClipSlack) * distance;
    if (!(offset > glm::dot(unit, glm::dvec3(made.eye)))) continue;
    made.rowZ = depthBeyond(unit, offset, steepest, made.rowW);
    made.own =
        planeAbove(unit, static_cast<double>(window.highest[k]) / length, distance, made.eye);
    const double c = kDepthRange / steepest;
    made.aboveHorizon = static_cast<float>(c * (offset - glm::dot(unit, glm::dvec3(made.eye))));
    const double alongX = c * static_cast<double>(texel) * glm::dot(unit, glm::dvec3(frame.right));
    const double alongY = c * static_cast<double>(texel) * glm::dot(unit, glm::dvec3(frame.down));
    made.horizon = Vec3(-alongX, -alongY,
                        1.0 - c * glm::dot(unit, glm::dvec3(frame.axis + corner.x * frame.right +
                                                            corner.y * frame.down)));
    return;
  }
  made.aboveHorizon = std::max(0.999f * window.nearest, 1e-30f);
  made.rowZ = Vec4(0.0f, 0.0f, 0.0f, made.aboveHorizon);
  made.own = planeAbove(glm::dvec3(frame.axis), static_cast<double>(window.farthest),
                        glm::length(glm::dvec3(cluster.centroid)), made.eye);
}

}  // namespace catoptric::methods::second_order
