// The camera attributes of EXR files.
#pragma once

#include <cmath>
#include <vector>

#include "core/math.h"

namespace catoptric::image {

/// The attribute worldToCamera of ExrOptions::matrices: 16 floats, for row vectors (p' = p M).
/// EXR's camera space is left-handed with x right, y up and +z forward; ours is right-handed and
/// looks along -z. Does not throw; the matrix must be finite.
inline std::vector<float> exrWorldToCamera(const Mat4& cameraFromWorld) {
  const Mat4 flipped = glm::scale(Mat4(1.0f), Vec3(1.0f, 1.0f, -1.0f)) * cameraFromWorld;
  // Our columns, in order, are EXR's rows
  const float* first = &flipped[0][0];
  return {first, first + 16};
}

/// The attribute worldToNDC, also for row vectors. p' = p M, divided by its fourth component, is
/// (0, 0) in the upper left corner of the image and (1, 1) in the lower right corner. Its third
/// component is 0 at the near plane and 1 at infinity. `aspect` = width / height.
inline std::vector<float> exrWorldToNdc(const Mat4& cameraFromWorld, float verticalFovRad,
                                        float aspect, float nearMetres) {
  const float halfHeight = std::tan(0.5f * verticalFovRad);
  Mat4 ndcFromCamera(0.0f);  // from the right-handed camera space, which looks along -z
  ndcFromCamera[0][0] = 0.5f / (halfHeight * aspect);
  ndcFromCamera[1][1] = -0.5f / halfHeight;
  ndcFromCamera[2] = Vec4(-0.5f, -0.5f, -1.0f, -1.0f);
  ndcFromCamera[3][2] = -nearMetres;
  const Mat4 all = ndcFromCamera * cameraFromWorld;
  const float* first = &all[0][0];
  return {first, first + 16};
}

}  // namespace catoptric::image
