// std::max() and std::min() for plain loops that become vector code (core/vector_versions.h).
#pragma once

#include "core/vector_versions.h"

namespace catoptric {

/// `a` if one is NaN.
CATOPTRIC_INLINE float larger(float a, float b) {
  return a < b ? b : a;
}
/// `a` if one is NaN.
CATOPTRIC_INLINE float smaller(float a, float b) {
  return b < a ? b : a;
}

}  // namespace catoptric
