// The texels of a depth map, ordered by columns for sampling along lines.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace catoptric::methods::depth_impostors {

/// Stores the texels of each column contiguously, with a border of background. A column runs along
/// the minor axis, which is y if `alongX`, otherwise x.
class Columns {
 public:
  static constexpr int kBorder = 36;  ///< texels of background before and after a column

  Columns(std::span<const float> texels, int size, bool alongX)
      : size_(size), stride_(static_cast<std::size_t>(size + 2 * kBorder)) {
    const auto n = static_cast<std::size_t>(size);
    texels_.assign(n * stride_, 0.0f);
    for (std::size_t y = 0; y < n; ++y)
      for (std::size_t x = 0; x < n; ++x)
        texels_[(alongX ? x * stride_ + y : y * stride_ + x) + kBorder] = texels[y * n + x];
  }

  int size() const { return size_; }
  /// Texel `minor` (at least -kBorder) of column `major` is at major * stride() + minor.
  const float* texels() const { return texels_.data() + kBorder; }
  int stride() const { return static_cast<int>(stride_); }

  /// The depth at a texel centre along the major axis, interpolated linearly between two texels
  /// along the minor axis. If one of them is background, the nearer texel's depth. 0 outside.
  [[gnu::always_inline]] float at(int major, float minor) const {
    const float place = minor + 0.5f;
    const bool on = (place >= 0.0f) & (place < static_cast<float>(size_ + 1));
    const int j = on ? static_cast<int>(place) : 0;
    const float f = place - static_cast<float>(j);
    const float* const texel = texels() + major * static_cast<int>(stride_) + j - 1;
    const float a = texel[0];
    const float b = texel[1];
    const float nearer = f < 0.5f ? a : b;
    const float between = a + f * (b - a);
    const float value = ((a > 0.0f) & (b > 0.0f)) ? between : nearer;
    return on ? value : 0.0f;
  }

 private:
  int size_;
  std::size_t stride_;
  std::vector<float> texels_;
};

}  // namespace catoptric::methods::depth_impostors
