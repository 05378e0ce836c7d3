// Noise fields that repeat seamlessly. They are made row by row from integer hashes, at a few
// nanoseconds per texel.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "core/math.h"
#include "core/parallel.h"

namespace catoptric::scene::procedural {

/// A 32-bit hash of three integers (the finalizer of MurmurHash3, twice).
inline std::uint32_t hash(std::uint32_t x, std::uint32_t y, std::uint32_t seed) {
  std::uint32_t h = x * 0x8DA6B343u ^ y * 0xD8163841u ^ seed * 0xCB1AB31Fu;
  h ^= h >> 16;
  h *= 0x85EBCA6Bu;
  h ^= h >> 13;
  h *= 0xC2B2AE35u;
  h ^= h >> 16;
  return h;
}
/// A hash in [0, 1).
inline float hash01(int x, int y, std::uint32_t seed) {
  return static_cast<float>(
             hash(static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y), seed) >> 8) *
         (1.0f / 16777216.0f);
}

inline int wrap(int i, int n) {
  const int r = i % n;
  return r < 0 ? r + n : r;
}
/// As wrap(), for i from -n to 2 n - 1, without a division.
inline int wrapNear(int i, int n) {
  return i < 0 ? i + n : i >= n ? i - n : i;
}
inline float smoothstep(float a, float b, float x) {
  const float t = std::clamp((x - a) / (b - a), 0.0f, 1.0f);
  return t * t * (3.0f - 2.0f * t);
}
/// The fractional part, without std::floor, which is a function call unless SSE 4.1 may be assumed.
inline float fract(float x) {
  const auto whole = static_cast<float>(static_cast<int>(x));
  return x < whole ? x - whole + 1.0f : x - whole;
}
inline float mix(float a, float b, float t) {
  return a + (b - a) * t;
}
/// Distance of the fraction f from the nearer end of [0, 1]: 0 at cell borders.
inline float edgeDistance(float f) {
  return std::min(f, 1.0f - f);
}

/// A field of size x size floats that repeats.
class Field {
 public:
  explicit Field(int size) : size_(size), values_(static_cast<std::size_t>(size) * size, 0.0f) {}

  /// Valid for x and y from -size to 2 size - 1.
  float at(int x, int y) const {
    return values_[static_cast<std::size_t>(wrapNear(y, size_)) * size_ + wrapNear(x, size_)];
  }
  /// Bilinear interpolation; u and v are in tiles.
  float sample(float u, float v) const {
    const float x = fract(u) * static_cast<float>(size_) - 0.5f;
    const float y = fract(v) * static_cast<float>(size_) - 0.5f;
    const int x0 = static_cast<int>(x + 1.0f) - 1;  // x is at least -0.5
    const int y0 = static_cast<int>(y + 1.0f) - 1;
    const float fx = x - static_cast<float>(x0);
    const float fy = y - static_cast<float>(y0);
    return mix(mix(at(x0, y0), at(x0 + 1, y0), fx), mix(at(x0, y0 + 1), at(x0 + 1, y0 + 1), fx),
               fy);
  }
  float* row(int y) { return values_.data() + static_cast<std::size_t>(y) * size_; }
  const float* row(int y) const { return values_.data() + static_cast<std::size_t>(y) * size_; }
  int size() const { return size_; }

 private:
  int size_;
  std::vector<float> values_;
};

/// Calls body(y) for all rows, in parallel.
template <class F>
void forRows(int size, const F& body) {
  parallelFor(static_cast<std::size_t>(size), 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t y = begin; y < end; ++y) body(static_cast<int>(y));
  });
}

/// A sum of `octaves` octaves of gradient noise [Perlin2002]. The first has periodX x periodY cells
/// per tile; each following one has twice as many per axis and `gain` times the amplitude. Values
/// are about -1..1, with mean 0.
Field fbm(int size, int periodX, int periodY, int octaves, std::uint32_t seed, float gain = 0.5f);

/// Cellular noise at one position: the distances to the two nearest points, in cells, and a hash of
/// the nearest point.
struct Cell {
  float nearest = 0.0f;
  float second = 0.0f;
  float dx = 0.0f;  ///< offset from the nearest point, in cells
  float dy = 0.0f;
  std::uint32_t id = 0;
};
/// Cellular noise [Worley1996] with `period` x `period` jittered points per tile.
class Cells {
 public:
  Cells(int period, float jitter, std::uint32_t seed);
  Cell at(float u, float v) const;  ///< valid for u and v from -1 to 2

 private:
  int period_;
  std::uint32_t seed_;
  std::vector<Vec2> points_;
};

}  // namespace catoptric::scene::procedural
