// Vectors of a few values, in the vector types that GCC and Clang share. Operators act on each lane
// separately, comparisons return -1 or 0 per lane, and `mask ? a : b` selects per lane. The
// instructions are those of the function into which the code is inlined (core/vector_versions.h).
// GCC 12 compares vectors of more than eight floats one lane at a time, so longer vectors need
// intrinsics.
#pragma once

#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "core/math.h"
#include "core/vector_versions.h"

// All functions that take lanes are inlined, so the calling convention for vectors does not matter.
#pragma GCC diagnostic ignored "-Wpsabi"

namespace catoptric {

template <class T, std::size_t N>
struct LanesType {
  using Type [[gnu::vector_size(N * sizeof(T))]] = T;
};
template <class T, std::size_t N>
using Lanes = typename LanesType<T, N>::Type;
using Floats4 = Lanes<float, 4>;
using Mask4 = Lanes<std::int32_t, 4>;  ///< -1 or 0 per lane, e.g. the result of Floats4 < Floats4

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

/// The smaller value of each lane; that of `b` if `a` is NaN.
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

/// The mask as bits; the first lane is the lowest bit.
CATOPTRIC_INLINE unsigned bitsOf(const Mask4& mask) {
  return static_cast<unsigned>(__builtin_ia32_movmskps(std::bit_cast<Floats4>(mask)));
}

/// Transposes four rows in place.
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

/// Vectors stored as one array per component, for plain loops.
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
