#include "methods/second_order/cameras/planar.h"

#include <algorithm>
#include <cmath>

#include "methods/second_order/cameras/clip_plane.h"

namespace catoptric::methods::second_order {

ClusterCamera planarCamera(const Cluster& cluster, const scene::Camera& camera, int sampleWidth,
                           int sampleHeight, const CameraOptions& options) {
  ClusterCamera made;
  made.mirrorGrid = true;
  made.scale = options.depthImageScale;
  const glm::dvec3 n = glm::normalize(glm::dvec3(cluster.meanNormal));
  const glm::dvec3 eye = 2.0 * glm::dot(n, glm::dvec3(cluster.centroid)) * n;
  made.eye = Vec3(eye);
  const glm::dmat3 rayFromPixel(scene::rayFromPixel(camera, sampleWidth, sampleHeight));
  glm::dmat3 mirrored;
  for (int c = 0; c < 3; ++c) {
    mirrored[c] = rayFromPixel[c] - 2.0 * glm::dot(rayFromPixel[c], n) * n;
  }
  const glm::dmat3 rows = glm::transpose(glm::inverse(mirrored));
  // A mirror turns right to left: turned back, so that triangles keep their winding
  const glm::dvec3 x =
      (static_cast<double>(cluster.right) * rows[2] - rows[0]) * static_cast<double>(made.scale);
  const glm::dvec3 y =
      (rows[1] - static_cast<double>(cluster.top) * rows[2]) * static_cast<double>(made.scale);
  made.rowX = Vec4(Vec3(x), static_cast<float>(-glm::dot(x, eye)));
  made.rowY = Vec4(Vec3(y), static_cast<float>(-glm::dot(y, eye)));
  made.rowW = Vec4(Vec3(rows[2]), static_cast<float>(-glm::dot(rows[2], eye)));
  made.mirrorRight = static_cast<float>(cluster.right);
  made.mirrorTop = static_cast<float>(cluster.top);
  const auto texels = [&](int samples) {
    return std::max(1,
                    static_cast<int>(std::ceil(static_cast<float>(samples) * made.scale - 1e-3f)));
  };
  made.width = texels(cluster.right - cluster.left);
  made.height = texels(cluster.bottom - cluster.top);
  made.texelSpreadRad = scene::pixelSpreadRad(camera, sampleHeight) / made.scale;

  double steepest = 0.0;
  for (const int px : {cluster.left, cluster.right}) {
    for (const int py : {cluster.top, cluster.bottom}) {
      steepest = std::max(steepest, glm::dot(n, mirrored * glm::dvec3(px, py, 1.0)));
    }
  }
  const double offset = glm::dot(n, glm::dvec3(cluster.centroid)) +
                        kClipSlack * glm::length(glm::dvec3(cluster.centroid));
  made.rowZ = depthBeyond(n, offset, std::max(steepest, 1e-6), made.rowW);
  const double c = kDepthRange / std::max(steepest, 1e-6);
  made.aboveHorizon = static_cast<float>(c * (offset - glm::dot(n, eye)));
  // Of rays that advance by 1 along the axis, depth at infinity is 1 - c dot(n, ray)
  const glm::dvec3 slope = c * (glm::transpose(mirrored) * n);
  const double texel = 1.0 / static_cast<double>(made.scale);
  made.horizon = Vec3(slope.x * texel, -slope.y * texel,
                      1.0 - slope.x * cluster.right - slope.y * cluster.top - slope.z);
  return made;
}

}  // namespace catoptric::methods::second_order
