#include "methods/shared/impostors/half_image.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <span>

#include "core/math.h"
#include "methods/shared/impostors/half_float.h"
#include "raster/cube_faces.h"
#include "raster/scene_raster.h"

namespace catoptric::methods::impostors {
namespace {

constexpr std::size_t kValues = 4;  ///< of a texel

std::size_t valuesOf(int size) {
  const auto side = static_cast<std::size_t>(size) + 2;
  return kValues * side * side;
}

/// Of the mean of such values: rounded towards 0.
std::uint16_t halfOf(float value) {
  const auto bits = std::bit_cast<std::uint32_t>(value);
  const std::uint32_t sized = bits & 0x7FFFFFFFu;
  if (sized < (113u << 23)) return 0;
  return static_cast<std::uint16_t>((bits >> 16 & 0x8000u) | ((sized - (112u << 23)) >> 13));
}

struct Texel {
  std::size_t face;
  int x, y;
};

/// The texel beside an edge of a face, at -1 or `size` in one of x and y: the neighbour's.
Texel beyond(std::size_t face, int x, int y, int size) {
  const auto place = [&](int i) {
    return (2.0f * static_cast<float>(i) + 1.0f) / static_cast<float>(size) - 1.0f;
  };
  const float inwards = 1.0f - 1.0f / static_cast<float>(size);
  const Vec2 at(std::clamp(place(x), -1.0f, 1.0f), std::clamp(place(y), -1.0f, 1.0f));
  const Vec3 direction = at.x * raster::kCubeFaces[face].right +
                         at.y * raster::kCubeFaces[face].down +
                         inwards * raster::kCubeFaces[face].forward;
  for (std::size_t f = 0; f < raster::kCubeFaces.size(); ++f) {
    if (glm::dot(direction, raster::kCubeFaces[f].forward) < 1.0f) continue;
    const auto index = [&](const Vec3& axis) {
      const float s = 0.5f * (glm::dot(direction, axis) + 1.0f) * static_cast<float>(size);
      return std::clamp(static_cast<int>(std::floor(s)), 0, size - 1);
    };
    return {f, index(raster::kCubeFaces[f].right), index(raster::kCubeFaces[f].down)};
  }
  return {face, std::clamp(x, 0, size - 1), std::clamp(y, 0, size - 1)};
}

/// What HalfImage::read() works with.
struct Scratch {
  std::vector<std::uint16_t> texels;
  std::vector<float> fine;
  std::vector<float> coarse;
};

/// A level's texels, with its border.
void put(std::span<const std::uint16_t> texels, const HalfLevel& level,
         std::vector<std::uint16_t>& values) {
  const auto size = static_cast<std::size_t>(level.size);
  const std::size_t side = size + 2;
  std::uint16_t* const into = values.data() + level.first;
  for (std::size_t y = 0; y < side; ++y) {
    const std::uint16_t* const from =
        &texels[kValues * size * (std::clamp<std::size_t>(y, 1, size) - 1)];
    std::uint16_t* const row = into + kValues * side * y;
    std::copy_n(from, kValues, row);
    std::copy_n(from, kValues * size, row + kValues);
    std::copy_n(from + kValues * (size - 1), kValues, row + kValues * (size + 1));
  }
}

/// The next level of `fine`, into it and `texels`, as glGenerateMipmap: linear look-ups at the
/// coarse texels' centres.
void shrink(Scratch& scratch, int from, int to) {
  const auto wide = kValues * static_cast<std::size_t>(from);
  const auto narrow = static_cast<std::size_t>(to);
  scratch.coarse.resize(kValues * narrow * narrow);
  // The first of two fine texels, and the share of the second
  const auto place = [&](std::size_t i, float& share) {
    const float at =
        (static_cast<float>(i) + 0.5f) * static_cast<float>(from) / static_cast<float>(to) - 0.5f;
    const auto low = static_cast<std::size_t>(at);
    share = at - static_cast<float>(low);
    return low;
  };
  for (std::size_t y = 0; y < narrow; ++y) {
    float fy = 0.0f;
    const float* const upper = scratch.fine.data() + wide * place(y, fy);
    const float* const lower = upper + wide;
    for (std::size_t x = 0; x < narrow; ++x) {
      float fx = 0.0f;
      const std::size_t left = kValues * place(x, fx);
      const std::size_t right = left + kValues;
      float* const into = &scratch.coarse[kValues * (y * narrow + x)];
      for (std::size_t c = 0; c < kValues; ++c) {
        const float top = upper[left + c] + fx * (upper[right + c] - upper[left + c]);
        const float bottom = lower[left + c] + fx * (lower[right + c] - lower[left + c]);
        into[c] = top + fy * (bottom - top);
      }
    }
  }
  std::swap(scratch.fine, scratch.coarse);
  scratch.texels.resize(scratch.fine.size());
  std::ranges::transform(scratch.fine, scratch.texels.begin(), nearestHalf);
}

}  // namespace

std::uint64_t HalfImage::read(const gl::Texture& texture) {
  static thread_local std::vector<std::uint16_t> texels;
  const auto size = static_cast<std::size_t>(texture.levelWidth(0));
  texels.resize(kValues * size * size);
  texture.read(0, GL_RGBA, GL_HALF_FLOAT, std::as_writable_bytes(std::span(texels)));
  return set(texture.levelWidth(0), texels);
}

std::uint64_t HalfImage::set(int edge, std::span<const std::uint16_t> texels) {
  static thread_local Scratch scratch;
  levels_.clear();
  std::size_t count = 0;
  for (int size = edge; size > 0; size /= 2) {
    levels_.push_back({size, count});
    count += valuesOf(size);
  }
  values_.resize(count);
  const std::uint64_t clamped = raster::clampedTexels(texels);
  scratch.fine.resize(texels.size());
  std::ranges::transform(texels, scratch.fine.begin(), floatOf);
  put(texels, levels_.front(), values_);
  for (std::size_t level = 1; level < levels_.size(); ++level) {
    shrink(scratch, levels_[level - 1].size, levels_[level].size);
    put(scratch.texels, levels_[level], values_);
  }
  return clamped;
}

void HalfImage::copy(int level, std::vector<std::uint16_t>& texels) const {
  const HalfLevel& from = levels_[static_cast<std::size_t>(level)];
  const auto size = static_cast<std::size_t>(from.size);
  texels.resize(kValues * size * size);
  for (std::size_t y = 0; y < size; ++y)
    std::copy_n(&values_[from.first + kValues * ((y + 1) * (size + 2) + 1)], kValues * size,
                &texels[kValues * size * y]);
}

void HalfCube::read(const gl::Texture& texture, int coarse) {
  fine_ = {texture.levelWidth(0), 0};
  coarse_ = {texture.levelWidth(coarse), raster::kCubeFaces.size() * valuesOf(fine_.size)};
  values_.resize(coarse_.first + raster::kCubeFaces.size() * valuesOf(coarse_.size));
  add(texture, 0, fine_);
  add(texture, coarse, coarse_);
  most_ = 0.0f;
  for (std::size_t i = coarse_.first + 3; i < values_.size(); i += kValues)
    most_ = std::max(most_, floatOf(values_[i]));
}

void HalfCube::add(const gl::Texture& texture, int level, HalfLevel& into) {
  const int size = into.size;
  const auto side = static_cast<std::size_t>(size) + 2;
  const auto inner = static_cast<std::size_t>(size);
  read_.resize(raster::kCubeFaces.size() * kValues * inner * inner);
  texture.read(level, GL_RGBA, GL_HALF_FLOAT, std::as_writable_bytes(std::span(read_)));
  const auto texel = [&](const Texel& t) {
    return &read_[kValues * ((t.face * inner + static_cast<std::size_t>(t.y)) * inner +
                             static_cast<std::size_t>(t.x))];
  };
  for (std::size_t face = 0; face < raster::kCubeFaces.size(); ++face) {
    std::uint16_t* const values = values_.data() + into.first + face * valuesOf(size);
    const auto place = [&](int x, int y) {
      return values +
             kValues * (static_cast<std::size_t>(y + 1) * side + static_cast<std::size_t>(x + 1));
    };
    for (int y = 0; y < size; ++y) {
      std::copy_n(texel({face, 0, y}), kValues * inner, place(0, y));
      std::copy_n(texel(beyond(face, -1, y, size)), kValues, place(-1, y));
      std::copy_n(texel(beyond(face, size, y, size)), kValues, place(size, y));
    }
    for (int x = 0; x < size; ++x) {
      std::copy_n(texel(beyond(face, x, -1, size)), kValues, place(x, -1));
      std::copy_n(texel(beyond(face, x, size, size)), kValues, place(x, size));
    }
    // Three faces meet at a corner: the mean of their texels
    for (const int y : {-1, size}) {
      for (const int x : {-1, size}) {
        const int nextX = x < 0 ? 0 : size - 1;
        const int nextY = y < 0 ? 0 : size - 1;
        for (std::size_t c = 0; c < kValues; ++c)
          place(x, y)[c] = halfOf((floatOf(place(nextX, nextY)[c]) + floatOf(place(x, nextY)[c]) +
                                   floatOf(place(nextX, y)[c])) /
                                  3.0f);
      }
    }
  }
}

}  // namespace catoptric::methods::impostors
