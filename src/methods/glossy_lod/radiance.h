// Diffuse radiance of all geometry images, on both sides, with mip levels.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "frame/shading.h"
#include "methods/glossy_lod/scene_images.h"

namespace catoptric::methods::glossy_lod {

class Radiance {
 public:
  /// Shades all texels of these objects by the pipeline's shading (frame::shadeSurface), and
  /// averages them into coarser levels.
  void shade(const scene::Scene& scene, const frame::Geometry& geometry,
             const frame::Lighting& lighting, const SceneImages& images,
             std::span<const int> objects);

  std::uint64_t notFinite() const { return notFinite_; }
  /// Texels of level 0 of one side: rgb radiance, a the area in m^2 that a texel has, negative
  /// where an alpha mask cuts it away.
  const Vec4& texel(int side, std::uint32_t x, std::uint32_t y) const {
    return texels_[side][std::size_t{y} * width() + x];
  }
  /// Those of a coarser level, and from one to the texel above it.
  const Vec4* onLevel(int side, int level, std::size_t x, std::size_t y) const {
    return &texels_[side][at(level, x, y)];
  }
  std::size_t row() const { return width(); }

 private:
  std::uint64_t shadeChart(const scene::Scene& scene, const frame::Geometry& geometry,
                           const frame::Lighting& lighting, const SceneImages& images,
                           const PlacedChart& chart);
  void average(const PlacedChart& chart);

  /// Level 0 is a square on the left, the others lie below each other to the right of it.
  std::size_t width() const { return side_ + side_ / 2; }
  std::size_t at(int level, std::size_t x, std::size_t y) const {
    if (level == 0) return y * width() + x;
    return (side_ - (side_ >> (level - 1)) + y) * width() + side_ + x;
  }

  std::uint32_t side_ = 0;  ///< of level 0, texels
  std::vector<Vec4> texels_[2];
  std::uint64_t notFinite_ = 0;
};

}  // namespace catoptric::methods::glossy_lod
