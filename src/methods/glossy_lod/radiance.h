// Diffuse radiance of all geometry images, on both sides, with mip levels.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "frame/shading.h"
#include "methods/glossy_lod/scene_images.h"

namespace catoptric::methods::glossy_lod {

/// What texels are shaded with: must outlive their shading.
struct Shading {
  const scene::Scene* scene = nullptr;
  const frame::Geometry* geometry = nullptr;
  const frame::Lighting* lighting = nullptr;
  const SceneImages* images = nullptr;
};

class Radiance {
 public:
  /// Shades all texels of these objects by the pipeline's shading (frame::shadeSurface), and
  /// averages them into coarser levels.
  void shade(const Shading& shading, std::span<const int> objects);
  /// The same, but each side of a chart only when it is first asked for.
  void shadeLater(const Shading& shading, std::span<const int> objects);
  bool allShaded() const { return stale_.load(std::memory_order_acquire) == 0; }
  /// Before a side of a chart is looked at it must be shaded: ensure() shades it where that is
  /// still to be done, or waits until another thread has done so. True if it shaded.
  bool isShaded(std::uint32_t chart, int side) const {
    return states_[2 * std::size_t{chart} + static_cast<std::size_t>(side)].load(
               std::memory_order_acquire) == State::Shaded;
  }
  bool ensure(std::uint32_t chart, int side);

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
  enum class State : std::uint8_t { Shaded, Stale, Shading };

  void allocate();
  void shadeRows(const PlacedChart& chart, int side, std::uint32_t first, std::uint32_t end);
  void average(const PlacedChart& chart, int side);
  void setShaded(std::uint32_t chart, int side);

  /// Level 0 is a square on the left, the others lie below each other to the right of it.
  std::size_t width() const { return side_ + side_ / 2; }
  std::size_t at(int level, std::size_t x, std::size_t y) const {
    if (level == 0) return y * width() + x;
    return (side_ - (side_ >> (level - 1)) + y) * width() + side_ + x;
  }

  std::uint32_t side_ = 0;  ///< of level 0, texels
  std::vector<Vec4> texels_[2];
  Shading shading_;
  std::unique_ptr<std::atomic<State>[]> states_;  ///< by chart and side
  std::atomic<std::size_t> stale_{0};             ///< sides that are not Shaded
  std::atomic<std::uint64_t> notFinite_{0};       ///< since texels were shaded for the first time
};

}  // namespace catoptric::methods::glossy_lod
