// The camera of a cluster's depth image [Wang2014, section 3.3]. As everywhere in this method,
// positions are relative to the eye of the frame.
#pragma once

#include <cstdint>
#include <vector>

#include "core/math.h"
#include "methods/second_order/clustering/clusters.h"
#include "scene/camera.h"

namespace catoptric::methods::second_order {

struct CameraOptions {
  float depthImageScale = 1.0f;
  /// Maximum number of texels of a depth image per sample of its cluster; grazing rays would
  /// otherwise need a huge image. Not an option and not in the paper.
  float maxTexelsPerSample = 2.0f;
  int rays = 8;  ///< rays of a glossy sample, which determine the width of its cone and its texels
  Box3 sceneBounds;            ///< relative to the eye of the frame
  int maxTextureSize = 16384;  ///< limit of width and height
};

/// Projects a point p to the texel (X / W, Y / W) of a depth image (row 0 on top) with depth Z / W:
/// 1 at the nearest point, falling to 0, and affine along lines in the image.
struct ClusterCamera {
  Vec4 rowX{0.0f};  ///< X = dot(rowX, (p, 1)), and so on
  Vec4 rowY{0.0f};
  Vec4 rowZ{0.0f, 0.0f, 0.0f, 1.0f};
  Vec4 rowW{0.0f, 0.0f, 0.0f, 1.0f};
  /// Depth of points at infinity at texel (x, y): dot(horizon, (x, y, 1)). The depth of other
  /// points is greater by aboveHorizon / W.
  Vec3 horizon{0.0f};
  float aboveHorizon = 1.0f;
  /// The cluster's own object is only drawn where dot(own, (p, 1)) > 0, that is, above all samples.
  /// Its inner sides thus occlude nothing.
  Vec4 own{0.0f, 0.0f, 0.0f, 1.0f};
  Vec3 eye{0.0f};  ///< e_c
  int width = 1;
  int height = 1;
  float texelSpreadRad = 1e-3f;
  float nearestMetres = 0.0f;   ///< distance from e_c to the nearest sample of the cluster
  float farthestMetres = 0.0f;  ///< distance to the farthest sample; for curved clusters
  /// Images of planar mirrors have the sample grid of the mirrored frame: sample (x, y) lies at
  /// (mirrorRight - (x + 0.5), (y + 0.5) - mirrorTop) * scale, without a projection.
  bool mirrorGrid = false;
  float mirrorRight = 0.0f;
  float mirrorTop = 0.0f;
  float scale = 1.0f;
  float displacement = 1.0f;  ///< f of equation (1)
  /// Mean length of a mirror ray in the image, in texels; 0 if all rays meet in the eye.
  float walkTexels = 0.0f;

  // Deviations from the paper's formulas
  bool parallel = false;  ///< rays are (nearly) parallel or converge: the eye is placed far behind
  bool crossing = false;  ///< rays cross within the scene
  /// The eye was moved back, because it would have been in front of some sample.
  bool pushedBack = false;
  bool capped = false;  ///< fewer texels than the spacing of samples requires

  /// Clip-space matrix for absolute world positions; `frameEye`: the eye of the frame.
  Mat4 clipFromWorld(const Vec3& frameEye) const;
};

/// One camera for each cluster, in the same order. Passes over all samples. The result does not
/// depend on the number of threads.
std::vector<ClusterCamera> makeClusterCameras(const Clustering& clustering,
                                              const scene::Camera& camera, int sampleWidth,
                                              int sampleHeight, const CameraOptions& options);

/// Distance h of the eye behind the image plane for rays that come from one point. Over `depth`
/// metres they spread from `near` (diagonal on the image plane) to `far` (negative if they have
/// crossed). Infinite if they are parallel, negative if they converge. For the paper's d_n, d_F and
/// D this is f of equation (1), times the distance of e_0 from the plane.
float eyeDistance(float near, float far, float depth);

}  // namespace catoptric::methods::second_order
