// Compiles plain loops to vector code, once for each instruction level of the machine. The loop
// stands in a function that is marked CATOPTRIC_INLINE; atVectorLevel<function>(arguments) runs it.
#pragma once

#include <cstddef>

#include "core/vector_level.h"

/// Marks the following loop as one whose iterations are independent of each other.
#if defined(__GNUC__) && !defined(__clang__)
#define CATOPTRIC_INDEPENDENT _Pragma("GCC ivdep")
#else
#define CATOPTRIC_INDEPENDENT
#endif

/// Marks a function that a version calls: it is compiled for the level of its caller.
#define CATOPTRIC_INLINE [[gnu::always_inline]] inline

/// The instruction sets of the levels.
#define CATOPTRIC_V3 "avx2,fma,bmi,bmi2,popcnt,lzcnt"
#define CATOPTRIC_V4 "avx512f,avx512vl,avx512bw,avx512dq,avx512cd," CATOPTRIC_V3

namespace catoptric {

/// The number of floats in the widest vector.
inline constexpr std::size_t kWidestVector = 16;

/// `count` rounded up to a multiple of kWidestVector. Surplus values are not used.
CATOPTRIC_INLINE std::size_t wholeVectors(std::size_t count) {
  return (count + kWidestVector - 1) / kWidestVector * kWidestVector;
}

/// One function, compiled for each level.
template <auto kFunction>
struct Versions {
  template <class... A>
  static auto base(A&... a) {
    return kFunction(a...);
  }
  template <class... A>
  [[gnu::target("sse4.2,popcnt")]] static auto v2(A&... a) {
    return kFunction(a...);
  }
  template <class... A>
  [[gnu::target(CATOPTRIC_V3)]] static auto v3(A&... a) {
    return kFunction(a...);
  }
  template <class... A>
  [[gnu::target(CATOPTRIC_V4)]] static auto v4(A&... a) {
    return kFunction(a...);
  }
};

/// Calls a function at the level that vectorLevel() returns.
template <auto kFunction, class... A>
auto atVectorLevel(A&&... a) {
  switch (vectorLevel()) {
    case VectorLevel::V4:
      return Versions<kFunction>::v4(a...);
    case VectorLevel::V3:
      return Versions<kFunction>::v3(a...);
    case VectorLevel::V2:
      return Versions<kFunction>::v2(a...);
    case VectorLevel::Base:
      break;
  }
  return Versions<kFunction>::base(a...);
}

}  // namespace catoptric
