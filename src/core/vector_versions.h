// Plain loops that the compiler turns into vector code, once for each level of the machine. A file
// with such loops defines VERSION(name, attributes), which puts functions with these attributes
// into the namespace `name`, for CATOPTRIC_EACH_VECTOR_LEVEL(VERSION); versionOf() picks one.
#pragma once

#include "core/vector_level.h"

/// Before a loop whose turns do not depend on each other.
#if defined(__GNUC__) && !defined(__clang__)
#define CATOPTRIC_INDEPENDENT _Pragma("GCC ivdep")
#else
#define CATOPTRIC_INDEPENDENT
#endif

/// Of what a version calls: it is compiled for the level of its caller.
#define CATOPTRIC_INLINE [[gnu::always_inline]] inline

#define CATOPTRIC_EACH_VECTOR_LEVEL(VERSION)             \
  VERSION(base, )                                        \
  VERSION(v2, [[gnu::target("sse4.2,popcnt")]])          \
  VERSION(v3, [[gnu::target("avx2,fma,bmi,bmi2")]])      \
  VERSION(v4, [[gnu::target("avx512f,avx512vl,avx512bw," \
                            "avx512dq,avx512cd,avx2,fma,bmi,bmi2")]])

namespace catoptric {

/// What runs at this machine's level, or at what limitVectorLevel() allows.
template <class T>
const T& versionOf(const T& base, const T& v2, const T& v3, const T& v4) {
  switch (vectorLevel()) {
    case VectorLevel::V4:
      return v4;
    case VectorLevel::V3:
      return v3;
    case VectorLevel::V2:
      return v2;
    case VectorLevel::Base:
      break;
  }
  return base;
}

}  // namespace catoptric
