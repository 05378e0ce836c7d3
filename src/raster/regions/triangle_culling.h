// Culls single triangles that are certainly invisible in a view. If vertex processing and binning
// run on one thread, this is cheaper than to leave it to the driver. The images are identical with
// and without culling.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/math.h"

namespace catoptric::raster {

class TriangleCulling {
 public:
  /// For vertices within `bounds`. The clip space is that of Frustum. `snap`: pixels by which a
  /// driver may displace a vertex, 2^-GL_SUBPIXEL_BITS. `cullBacks`: triangles that are clockwise
  /// in clip space are dropped, as by GL_CULL_FACE. `clip`: nothing is drawn where dot(clip, (p,
  /// 1)) < 0.
  TriangleCulling(const Mat4& clipFromWorld, const Box3& bounds, int width, int height, float snap,
                  bool cullBacks, const Vec4& clip);

  /// Appends the triangles that may cover the centre of a pixel to `kept`, in their order.
  void append(std::span<const std::uint32_t> indices, std::span<const Vec3> positions,
              std::vector<std::uint32_t>& kept) const;

 private:
  std::array<Vec4, 4> rows_;  ///< rows of clipFromWorld for clip x, y, z and w
  Vec4 clip_;
  float slackX_, slackY_, slackZ_,
      clipSlack_;  ///< bounds on the rounding errors of w + x and the like
  float leastW_;   ///< if w is larger, positions in pixels are accurate to `margin_`
  float margin_;
  float halfWidth_, halfHeight_;
  bool cullBacks_;
};

}  // namespace catoptric::raster
