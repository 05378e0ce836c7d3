// The camera of a cluster's depth image [Wang2014, section 3.3]. As everywhere in this method
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
  /// Texels of a depth image per sample of its cluster, at most: grazing rays would blow the frame
  /// up. No option; ours.
  float maxTexelsPerSample = 2.0f;
  int rays = 8;      ///< of a glossy sample: what the width of its cone and its texels follow
  Box3 sceneBounds;  ///< relative to the eye of the frame
  int maxTextureSize = 16384;  ///< of one side
};

/// Projects a point p to the texel (X / W, Y / W) of a depth image, row 0 on top, with depth Z / W:
/// 1 at the nearest, falling to 0, linear along lines in the image.
struct ClusterCamera {
  Vec4 rowX{0.0f};  ///< X = dot(rowX, (p, 1)), and so on
  Vec4 rowY{0.0f};
  Vec4 rowZ{0.0f, 0.0f, 0.0f, 1.0f};
  Vec4 rowW{0.0f, 0.0f, 0.0f, 1.0f};
  /// Depth of what is infinitely far, at texel (x, y): dot(horizon, (x, y, 1)). Depth is above it
  /// by aboveHorizon / W.
  Vec3 horizon{0.0f};
  float aboveHorizon = 1.0f;
  /// The cluster's own object is drawn where dot(own, (p, 1)) > 0: above all samples, so that its
  /// inner sides hide nothing.
  Vec4 own{0.0f, 0.0f, 0.0f, 1.0f};
  Vec3 eye{0.0f};  ///< e_c
  int width = 1;
  int height = 1;
  float texelSpreadRad = 1e-3f;
  float nearestMetres = 0.0f;   ///< of the cluster's samples to e_c
  float farthestMetres = 0.0f;  ///< likewise; of curved clusters
  /// Planar mirrors have the mirrored frame's own sample grid: sample (x, y) is found at
  /// (mirrorRight - (x + 0.5), (y + 0.5) - mirrorTop) * scale, without any projection.
  bool mirrorGrid = false;
  float mirrorRight = 0.0f;
  float mirrorTop = 0.0f;
  float scale = 1.0f;
  float displacement = 1.0f;  ///< f of equation (1)
  /// Length of a mirror ray in the image, texels, on average: 0 where all rays meet in the eye.
  float walkTexels = 0.0f;

  // What had to be decided otherwise than by the paper's formulas
  bool parallel = false;    ///< rays (nearly) parallel or converging: the eye set far behind
  bool crossing = false;    ///< rays that cross within the scene
  bool pushedBack = false;  ///< the eye would have been in front of some sample
  bool capped = false;      ///< fewer texels than the samples' spacing asks for

  /// Clip-space matrix for absolute world positions; `frameEye`: the eye of the frame.
  Mat4 clipFromWorld(const Vec3& frameEye) const;
};

/// One camera for each cluster, in their order. Passes over all samples; the same result for any
/// number of threads.
std::vector<ClusterCamera> makeClusterCameras(const Clustering& clustering,
                                              const scene::Camera& camera, int sampleWidth,
                                              int sampleHeight, const CameraOptions& options);

/// Distance h of the eye behind the image plane for which rays that spread from `near` (diagonal on
/// the image plane) to `far` (signed: negative when they have crossed) over `depth` metres leave
/// one point; infinite when they are parallel, negative when they converge. With d_n, d_F, D this
/// is equation (1)'s f times the distance of e_0.
float eyeDistance(float near, float far, float depth);

}  // namespace catoptric::methods::second_order
