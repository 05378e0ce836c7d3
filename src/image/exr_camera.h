// The camera as EXR files state it.
#pragma once

#include <cmath>
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

/// The attribute worldToNDC, likewise for row vectors: p' = p M, divided by its fourth component,
/// is (0, 0) in the upper left corner of the image and (1, 1) in the lower right one; its third is
/// 0 at the near plane and 1 at infinity. `aspect` = width / height.
inline std::vector<float> exrWorldToNdc(const Mat4& cameraFromWorld, float verticalFovRad,
                                        float aspect, float nearMetres) {
  const float halfHeight = std::tan(0.5f * verticalFovRad);
  Mat4 ndcFromCamera(0.0f);  // of the right-handed camera space: forward is -z
  ndcFromCamera[0][0] = 0.5f / (halfHeight * aspect);
  ndcFromCamera[1][1] = -0.5f / halfHeight;
  ndcFromCamera[2] = Vec4(-0.5f, -0.5f, -1.0f, -1.0f);
  ndcFromCamera[3][2] = -nearMetres;
  const Mat4 all = ndcFromCamera * cameraFromWorld;
  const float* first = &all[0][0];
  return {first, first + 16};
}

}  // namespace catoptric::image
