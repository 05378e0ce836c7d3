// The camera as EXR files state it.
#pragma once

#include <vector>

#include "core/math.h"

namespace catoptric::image {

/// The attribute worldToCamera of ExrOptions::matrices: 16 floats, row vectors (p' = p M), camera
/// space left-handed with x right, y up and +z forward, from our right-handed camera space whose
/// forward is -z. Throws nothing; the matrix must be finite.
inline std::vector<float> exrWorldToCamera(const Mat4& cameraFromWorld) {
  const Mat4 flipped = glm::scale(Mat4(1.0f), Vec3(1.0f, 1.0f, -1.0f)) * cameraFromWorld;
  // Our columns, one after the other, are EXR's rows
  const float* first = &flipped[0][0];
  return {first, first + 16};
}

}  // namespace catoptric::image
