// Diffuse radiance of all geometry images, for both sides of a surface, with mip levels.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "frame/shading.h"
#include "methods/glossy_lod/scene_images.h"

namespace catoptric::methods::glossy_lod {

/// The inputs of shading; they must outlive it.
struct Shading {
  const scene::Scene* scene = nullptr;
  const frame::Geometry* geometry = nullptr;
  const frame::Lighting* lighting = nullptr;
  const SceneImages* images = nullptr;
};

class Radiance {
 public:
  /// Shades the texels of these objects, seen from the front, with the renderer's own shading
  /// (frame::shadeSurface) and averages them into coarser levels. Backs are shaded when ensure() is
  /// first called for them.
  void shade(const Shading& shading, std::span<const int> objects);
  /// As shade(), but fronts, too, are only shaded when ensure() is first called for them.
  void shadeLater(const Shading& shading, std::span<const int> objects);
  bool allShaded() const { return stale_.load(std::memory_order_acquire) == 0; }
  /// A side of a chart must be shaded before it is read: ensure() shades it if necessary, or waits
  /// while another thread does so. Returns true if this call shaded it.
  bool isShaded(std::uint32_t chart, int side) const {
    return states_[2 * std::size_t{chart} + static_cast<std::size_t>(side)].load(
               std::memory_order_acquire) == State::Shaded;
  }
  bool ensure(std::uint32_t chart, int side);

  std::uint64_t notFinite() const { return notFinite_; }
  /// Texels of level 0 of one side: rgb is radiance, a is the texel's area in m^2, negative where
  /// an alpha mask removes the surface.
  const Vec4& texel(int side, std::uint32_t x, std::uint32_t y) const {
    return texels_[static_cast<std::size_t>(side)][std::size_t{y} * width() + x];
  }
  /// A texel of a coarser level. The texel above it lies row() texels further.
  const Vec4* onLevel(int side, int level, std::size_t x, std::size_t y) const {
    return &texels_[static_cast<std::size_t>(side)][at(level, x, y)];
  }
  std::size_t row() const { return width(); }

 private:
  enum class State : std::uint8_t { Shaded, Stale, Shading };

  void allocate();
  void shadeRows(const PlacedChart& chart, int side, std::uint32_t first, std::uint32_t end);
  void average(const PlacedChart& chart, int side);
  void setShaded(std::uint32_t chart, int side);

  /// Level 0 is on the left; the other levels lie below each other to its right.
  std::size_t width() const { return size_.x + size_.x / 2; }
  std::size_t at(int level, std::size_t x, std::size_t y) const {
    if (level == 0) return y * width() + x;
    return (size_.y - (size_.y >> (level - 1)) + y) * width() + size_.x + x;
  }

  glm::uvec2 size_{0};  ///< size of level 0 in texels
  /// Indexed by side. Texels are not initialized before they are shaded, so that the system
  /// provides no memory for backs that are never hit.
  std::array<std::unique_ptr<Vec4[]>, 2> texels_;
  Shading shading_;
  std::unique_ptr<std::atomic<State>[]> states_;  ///< indexed by chart and side
  std::atomic<std::size_t> stale_{0};             ///< sides that are not Shaded
  std::atomic<std::uint64_t> notFinite_{0};  ///< counted when texels are shaded for the first time
};

}  // namespace catoptric::methods::glossy_lod
