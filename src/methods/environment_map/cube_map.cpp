#include "methods/environment_map/cube_map.h"

#include <array>
#include <vector>

#include "core/parallel.h"

namespace catoptric::methods {

Vec3 cubeDirection(int face, float s, float t) {
  const float u = 2.0f * s - 1.0f;
  const float v = 2.0f * t - 1.0f;
  switch (face) {
    case 0:
      return {1.0f, -v, -u};
    case 1:
      return {-1.0f, -v, u};
    case 2:
      return {u, 1.0f, v};
    case 3:
      return {u, -1.0f, -v};
    case 4:
      return {u, -v, 1.0f};
    default:
      return {-u, -v, -1.0f};
  }
}

int environmentFaceSize(const scene::Environment& environment, int faceSize) {
  return environment.type == scene::EnvironmentType::Constant ? 1 : faceSize;
}

gl::Texture makeEnvironmentCubeMap(const frame::EnvironmentLight& environment, int faceSize) {
  gl::Texture cube = gl::Texture::makeCube("environment as a cube map", GL_RGBA32F, faceSize, 0);
  const auto size = static_cast<std::size_t>(faceSize);
  const float texel = 1.0f / static_cast<float>(faceSize);
  std::vector<Vec4> pixels(size * size);
  for (int face = 0; face < 6; ++face) {
    parallelFor(size, 16, [&](std::size_t begin, std::size_t end) {
      for (std::size_t row = begin; row < end; ++row) {
        const float t = (static_cast<float>(row) + 0.5f) * texel;
        for (std::size_t column = 0; column < size; ++column) {
          const float s = (static_cast<float>(column) + 0.5f) * texel;
          const Vec3 direction = glm::normalize(cubeDirection(face, s, t));
          pixels[row * size + column] = Vec4(environment.radiance(direction), 0.0f);
        }
      }
    });
    cube.upload(0, face, GL_RGBA, GL_FLOAT, pixels.data());
  }
  cube.generateMipmaps();
  return cube;
}

}  // namespace catoptric::methods
