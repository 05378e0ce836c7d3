// The environment's image filtered over solid angles, for rays of lobes that leave the scene.
#pragma once

#include <memory>
#include <vector>

#include "core/math.h"
#include "frame/shading.h"

namespace catoptric::trace {

/// Levels of half the size each, every texel the mean of the radiance over its solid angle.
class EnvironmentLevels {
 public:
  explicit EnvironmentLevels(std::shared_ptr<const frame::EnvironmentLight> environment);

  /// Mean radiance about a unit direction over about so many steradians: between the two levels
  /// whose texels there are next to it, bilinear in each. Where that is level 0, and for skies
  /// without an image, which change slowly, it is the environment's own radiance.
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
