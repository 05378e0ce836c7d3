// A few values at a time, in the vector types that GCC and Clang share: operators work on each lane
// by itself, comparisons give -1 or 0, and `mask ? a : b` chooses. The instructions are those of
// the function that the code is inlined into (core/vector_versions.h). GCC 12 compares more than
// eight floats one by one: longer vectors need intrinsics.
#pragma once

#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "core/math.h"
#include "core/vector_versions.h"

// All that takes lanes is inlined: it does not matter how they would be passed.
#pragma GCC diagnostic ignored "-Wpsabi"

namespace catoptric {

template <class T, std::size_t N>
struct LanesType {
  using Type [[gnu::vector_size(N * sizeof(T))]] = T;
};
template <class T, std::size_t N>
using Lanes = typename LanesType<T, N>::Type;
using Floats4 = Lanes<float, 4>;
using Mask4 = Lanes<std::int32_t, 4>;  ///< -1 or 0, as by Floats4 < Floats4

/// The same value in each lane.
CATOPTRIC_INLINE Floats4 floats4(float value) {
  return value - Floats4{};
}
template <class V>
CATOPTRIC_INLINE V load(const void* values) {
  V loaded;
  __builtin_memcpy(&loaded, values, sizeof loaded);
  return loaded;
}
template <class V>
CATOPTRIC_INLINE void store(const V& value, void* values) {
  __builtin_memcpy(values, &value, sizeof value);
}

/// `b` where `a` is not a number.
template <class V>
CATOPTRIC_INLINE V least(const V& a, const V& b) {
  return a < b ? a : b;
}
template <class V>
CATOPTRIC_INLINE V most(const V& a, const V& b) {
  return a > b ? a : b;
}
template <class V>
CATOPTRIC_INLINE V root(const V& a) {
  std::array<float, sizeof(V) / sizeof(float)> roots;
  store(a, roots.data());
  for (float& value : roots) value = std::sqrt(value);
  return load<V>(roots.data());
}

/// Lanes of a mask, the first one the lowest bit.
CATOPTRIC_INLINE unsigned bitsOf(const Mask4& mask) {
  return static_cast<unsigned>(__builtin_ia32_movmskps(std::bit_cast<Floats4>(mask)));
}

/// Rows become columns.
CATOPTRIC_INLINE void transpose(Floats4& r0, Floats4& r1, Floats4& r2, Floats4& r3) {
  const Floats4 a = __builtin_shufflevector(r0, r1, 0, 4, 1, 5);
  const Floats4 b = __builtin_shufflevector(r2, r3, 0, 4, 1, 5);
  const Floats4 c = __builtin_shufflevector(r0, r1, 2, 6, 3, 7);
  const Floats4 d = __builtin_shufflevector(r2, r3, 2, 6, 3, 7);
  r0 = __builtin_shufflevector(a, b, 0, 1, 4, 5);
  r1 = __builtin_shufflevector(a, b, 2, 3, 6, 7);
  r2 = __builtin_shufflevector(c, d, 0, 1, 4, 5);
  r3 = __builtin_shufflevector(c, d, 2, 3, 6, 7);
}

/// Vectors by components: an array for each, for plain loops.
template <std::size_t N>
struct Vec3Lanes {
  alignas(64) std::array<float, N> x{}, y{}, z{};

  Vec3 at(std::size_t i) const { return {x[i], y[i], z[i]}; }
  void set(std::size_t i, const Vec3& v) {
    x[i] = v.x;
    y[i] = v.y;
    z[i] = v.z;
  }
};

}  // namespace catoptric
