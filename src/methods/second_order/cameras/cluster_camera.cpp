#include "methods/second_order/cameras/cluster_camera.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "methods/second_order/cameras/clip_plane.h"
#include "methods/second_order/cameras/extents.h"
#include "methods/second_order/cameras/frame.h"
#include "methods/second_order/cameras/planar.h"
#include "methods/second_order/cameras/window.h"
#include "trace/lobes/reflect.h"

namespace catoptric::methods::second_order {
namespace {

/// The eye stays within this many scene diameters behind the image plane. Ours.
constexpr float kFarthestEye = 10.0f;
/// The nearest sample lies at least this share of the cluster's diagonal before the eye. Ours.
constexpr float kNearestShare = 0.1f;
/// The frame's least width on the plane 1 m before the eye: 4 texels that single precision still
/// tells apart. Ours.
constexpr float kNarrowestTangent = 1e-5f;
/// Texels around the frame, so that neighbouring clusters overlap and every look-up has
/// neighbours.
constexpr float kBorder = 1.5f;
/// Texels of a glossy cluster are not finer than this share of a ray's own spread. Ours.
constexpr float kTexelOfSpread = 0.125f;

/// The eye by equation (1), signed by whether the rays have crossed at the far plane, which lies
/// `depth` metres behind the image plane.
void placeEye(const Cluster& cluster, const ClusterFrame& frame, const ClusterExtents& all,
              float depth, ClusterCamera& made) {
  const float near = all.near.diagonal();
  float distance = frame.eyeToPlane;
  if (all.rays > 1 && near > 0.0f) {
    const double crossed =
        all.product - glm::dot(all.nearSum, all.farSum) / static_cast<double>(all.rays);
    const float far = crossed < 0.0 ? -all.far.diagonal() : all.far.diagonal();
    distance = eyeDistance(near, far, depth);
    made.crossing = far < 0.0f;
    made.parallel = !(distance > 0.0f) || distance > kFarthestEye * depth;
    if (made.parallel) distance = kFarthestEye * depth;
  }
  const float least = kNearestShare * near - all.sag;
  if (distance < least) {
    distance = least;
    made.pushedBack = true;
  }
  made.displacement = distance / frame.eyeToPlane;
  made.eye = cluster.centroid - distance * frame.axis;
}

/// Width of a texel on the plane 1 m before the eye: the samples' own spacing, within the limits of
/// the lobes and the options.
float texelOf(const Cluster& cluster, const ClusterWindow& all, const Vec2& size,
              const CameraOptions& options, bool& capped) {
  float texel =
      all.pairs > 0 ? static_cast<float>(all.spacing / static_cast<double>(all.pairs)) : 0.0f;
  if (!(texel > 0.0f)) texel = glm::length(size) / std::sqrt(static_cast<float>(cluster.samples));
  const auto share = static_cast<float>(all.lobeShare / cluster.samples);
  texel =
      std::max(texel, kTexelOfSpread * share * trace::lobeSpread(cluster.widestLobe, options.rays));
  texel /= options.depthImageScale;
  const float most = options.maxTexelsPerSample *
                     std::max(16.0f, static_cast<float>(cluster.samples)) *
                     options.depthImageScale * options.depthImageScale;
  const float asked = size.x / texel * (size.y / texel);
  capped = asked > most;
  if (capped) texel *= std::sqrt(asked / most);
  const float side = static_cast<float>(options.maxTextureSize) - 2.0f * kBorder - 1.0f;
  const float longest = std::max(size.x, size.y) / texel;
  if (longest > side) {
    capped = true;
    texel *= longest / side;
  }
  return texel;
}

/// The image's size and projection.
void setWindow(const Cluster& cluster, const ClusterFrame& frame, const ClusterWindow& all,
               const CameraOptions& options, ClusterCamera& made) {
  const Vec2 size = glm::max(all.rect.max - all.rect.min, Vec2(kNarrowestTangent));
  const float texel = texelOf(cluster, all, size, options, made.capped);
  made.width = static_cast<int>(std::ceil(size.x / texel + 2.0f * kBorder));
  made.height = static_cast<int>(std::ceil(size.y / texel + 2.0f * kBorder));
  made.texelSpreadRad = texel;
  made.walkTexels = static_cast<float>(all.walks / cluster.samples) / texel;
  made.nearestMetres = all.nearest;
  made.farthestMetres = all.farthest;
  const Vec2 corner = all.rect.min - Vec2(kBorder * texel);
  const auto row = [&](const Vec3& v) { return Vec4(v, -glm::dot(v, made.eye)); };
  made.rowX = row((frame.right - corner.x * frame.axis) / texel);
  made.rowY = row((frame.down - corner.y * frame.axis) / texel);
  made.rowW = row(frame.axis);
  setDepth(cluster, frame, all, corner, texel, made);
}

}  // namespace

float eyeDistance(float near, float far, float depth) {
  if (far == near) return std::numeric_limits<float>::infinity();
  return near * depth / (far - near);
}

Mat4 ClusterCamera::clipFromWorld(const Vec3& frameEye) const {
  // In double: the rows are steep, and the eye may be far from the origin
  const auto absolute = [&](const Vec4& row) {
    return glm::dvec4(
        glm::dvec3(Vec3(row)),
        static_cast<double>(row.w) - glm::dot(glm::dvec3(Vec3(row)), glm::dvec3(frameEye)));
  };
  const glm::dvec4 x = absolute(rowX);
  const glm::dvec4 y = absolute(rowY);
  const glm::dvec4 w = absolute(rowW);
  const glm::dvec4 z = absolute(rowZ);
  const glm::dmat4 rows(2.0 / width * x - w, w - 2.0 / height * y, z, w);
  return Mat4(glm::transpose(rows));
}

std::vector<ClusterCamera> makeClusterCameras(const Clustering& clustering,
                                              const scene::Camera& camera, int sampleWidth,
                                              int sampleHeight, const CameraOptions& options) {
  const std::vector<Cluster>& clusters = clustering.clusters();
  const std::size_t count = clusters.size();
  std::vector<ClusterCamera> cameras(count);
  std::vector<ClusterFrame> frames(count);
  std::vector<std::uint8_t> curved(count, 0);
  for (std::size_t c = 0; c < count; ++c) {
    if (clusters[c].retraced) {
      cameras[c].width = cameras[c].height = 0;
    } else if (clusters[c].planar && clusters[c].widestLobe.mirror()) {
      cameras[c] = planarCamera(clusters[c], camera, sampleWidth, sampleHeight, options);
    } else {
      frames[c] = frameOf(clusters[c], camera, options.rays);
      curved[c] = 1;
    }
  }
  const auto forCurved = [&](auto&& body) {
    for (std::size_t c = 0; c < count; ++c) {
      if (curved[c] != 0) body(c);
    }
  };

  // The eyes
  const float depth = std::max(options.sceneBounds.diameter(), 1e-30f);  // D
  const std::vector<ClusterExtents> extents = findExtents(clustering, curved, frames, depth);
  forCurved(
      [&](std::size_t c) { placeEye(clusters[c], frames[c], extents[c], depth, cameras[c]); });

  // The frame around near and far ends, and the samples' spacing in it
  std::vector<ClusterWindow> windows =
      findWindows(clustering, curved, frames, cameras, options.sceneBounds);
  raiseClipPlanes(clustering, curved, frames, cameras, windows);
  forCurved(
      [&](std::size_t c) { setWindow(clusters[c], frames[c], windows[c], options, cameras[c]); });
  return cameras;
}

}  // namespace catoptric::methods::second_order
