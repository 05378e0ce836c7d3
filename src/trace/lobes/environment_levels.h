// The environment's image filtered over solid angles, for lobe rays that leave the scene.
#pragma once

#include <memory>
#include <vector>

#include "core/math.h"
#include "frame/shading.h"

namespace catoptric::trace {

/// Levels that halve in size; every texel is the mean radiance over its solid angle.
class EnvironmentLevels {
 public:
  explicit EnvironmentLevels(std::shared_ptr<const frame::EnvironmentLight> environment);

  /// Mean radiance around a unit direction over approximately this solid angle: interpolated
  /// between the two levels with the closest texel size, bilinear in each. If a texel of level 0 is
  /// at least as large as the solid angle, or if the environment has no image (and thus changes
  /// slowly), returns the environment's own radiance.
  Vec3 radiance(const Vec3& direction, float solidAngle) const;

  int levels() const { return static_cast<int>(levels_.size()); }

 private:
  struct Level {
    int width = 0, height = 0;
    std::vector<Vec3> texels;
  };
  static Level halved(const Level& from);
  Vec3 at(const Level& level, const Vec2& uv) const;

  std::shared_ptr<const frame::EnvironmentLight> environment_;
  std::vector<Level> levels_;
};

}  // namespace catoptric::trace
