// Drops single triangles that certainly show nothing in a view: where vertex work and binning run
// on one thread this is cheaper than to leave it to the driver. Images are the same with and
// without.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/math.h"

namespace catoptric::raster {

class TriangleCulling {
 public:
  /// For vertices within `bounds`, clip space as Frustum's. `snap`: pixels by which a driver may
  /// move a vertex, 2^-GL_SUBPIXEL_BITS. `cullBacks`: faces that are clockwise in clip space are
  /// not drawn, as if by GL_CULL_FACE. `clip`: nothing is drawn where dot(clip, (p, 1)) < 0.
  TriangleCulling(const Mat4& clipFromWorld, const Box3& bounds, int width, int height, float snap,
                  bool cullBacks, const Vec4& clip);

  /// Appends the triangles that may cover a pixel's centre, in their order.
  void append(std::span<const std::uint32_t> indices, std::span<const Vec3> positions,
              std::vector<std::uint32_t>& kept) const;

 private:
  std::array<Vec4, 4> rows_;  ///< of clip x, y, z and w
  Vec4 clip_;
  float slackX_, slackY_, slackZ_, clipSlack_;  ///< bounds on the rounding of w + x, ...
  float leastW_;  ///< positions in pixels are known to `margin_` where w is larger
  float margin_;
  float halfWidth_, halfHeight_;
  bool cullBacks_;
};

}  // namespace catoptric::raster
