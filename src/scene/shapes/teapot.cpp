// The Utah teapot from its 32 bicubic Bezier patches [Newell1975]. Ten patches are stored; the
// body, rim, lid and bottom are mirrored in x and y, handle and spout in y.
#include <array>

#include "scene/shapes/builder.h"
#include "scene/shapes/shapes.h"

namespace catoptric::scene {
namespace {

constexpr std::array<std::array<int, 16>, 10> kPatches{{
    {102, 103, 104, 105, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15},                // rim
    {12, 13, 14, 15, 16, 17, 18, 19, 20, 21, 22, 23, 24, 25, 26, 27},              // body
    {24, 25, 26, 27, 29, 30, 31, 32, 33, 34, 35, 36, 37, 38, 39, 40},              // body
    {96, 96, 96, 96, 97, 98, 99, 100, 101, 101, 101, 101, 0, 1, 2, 3},             // knob
    {0, 1, 2, 3, 106, 107, 108, 109, 110, 111, 112, 113, 114, 115, 116, 117},      // lid
    {118, 118, 118, 118, 124, 122, 119, 121, 123, 126, 125, 120, 40, 39, 38, 37},  // bottom
    {41, 42, 43, 44, 45, 46, 47, 48, 49, 50, 51, 52, 53, 54, 55, 56},              // handle
    {53, 54, 55, 56, 57, 58, 59, 60, 61, 62, 63, 64, 28, 65, 66, 67},              // handle
    {68, 69, 70, 71, 72, 73, 74, 75, 76, 77, 78, 79, 80, 81, 82, 83},              // spout
    {80, 81, 82, 83, 84, 85, 86, 87, 88, 89, 90, 91, 92, 93, 94, 95},              // spout
}};
constexpr std::size_t kMirroredTwice = 6;  ///< patches before this one are quarters

// z up, as published.
constexpr std::array<std::array<float, 3>, 127> kPoints{{
    {0.2f, 0, 2.7f},
    {0.2f, -0.112f, 2.7f},
    {0.112f, -0.2f, 2.7f},
    {0, -0.2f, 2.7f},
    {1.3375f, 0, 2.53125f},
    {1.3375f, -0.749f, 2.53125f},
    {0.749f, -1.3375f, 2.53125f},
    {0, -1.3375f, 2.53125f},
    {1.4375f, 0, 2.53125f},
    {1.4375f, -0.805f, 2.53125f},
    {0.805f, -1.4375f, 2.53125f},
    {0, -1.4375f, 2.53125f},
    {1.5f, 0, 2.4f},
    {1.5f, -0.84f, 2.4f},
    {0.84f, -1.5f, 2.4f},
    {0, -1.5f, 2.4f},
    {1.75f, 0, 1.875f},
    {1.75f, -0.98f, 1.875f},
    {0.98f, -1.75f, 1.875f},
    {0, -1.75f, 1.875f},
    {2, 0, 1.35f},
    {2, -1.12f, 1.35f},
    {1.12f, -2, 1.35f},
    {0, -2, 1.35f},
    {2, 0, 0.9f},
    {2, -1.12f, 0.9f},
    {1.12f, -2, 0.9f},
    {0, -2, 0.9f},
    {-2, 0, 0.9f},
    {2, 0, 0.45f},
    {2, -1.12f, 0.45f},
    {1.12f, -2, 0.45f},
    {0, -2, 0.45f},
    {1.5f, 0, 0.225f},
    {1.5f, -0.84f, 0.225f},
    {0.84f, -1.5f, 0.225f},
    {0, -1.5f, 0.225f},
    {1.5f, 0, 0.15f},
    {1.5f, -0.84f, 0.15f},
    {0.84f, -1.5f, 0.15f},
    {0, -1.5f, 0.15f},
    {-1.6f, 0, 2.025f},
    {-1.6f, -0.3f, 2.025f},
    {-1.5f, -0.3f, 2.25f},
    {-1.5f, 0, 2.25f},
    {-2.3f, 0, 2.025f},
    {-2.3f, -0.3f, 2.025f},
    {-2.5f, -0.3f, 2.25f},
    {-2.5f, 0, 2.25f},
    {-2.7f, 0, 2.025f},
    {-2.7f, -0.3f, 2.025f},
    {-3, -0.3f, 2.25f},
    {-3, 0, 2.25f},
    {-2.7f, 0, 1.8f},
    {-2.7f, -0.3f, 1.8f},
    {-3, -0.3f, 1.8f},
    {-3, 0, 1.8f},
    {-2.7f, 0, 1.575f},
    {-2.7f, -0.3f, 1.575f},
    {-3, -0.3f, 1.35f},
    {-3, 0, 1.35f},
    {-2.5f, 0, 1.125f},
    {-2.5f, -0.3f, 1.125f},
    {-2.65f, -0.3f, 0.9375f},
    {-2.65f, 0, 0.9375f},
    {-2, -0.3f, 0.9f},
    {-1.9f, -0.3f, 0.6f},
    {-1.9f, 0, 0.6f},
    {1.7f, 0, 1.425f},
    {1.7f, -0.66f, 1.425f},
    {1.7f, -0.66f, 0.6f},
    {1.7f, 0, 0.6f},
    {2.6f, 0, 1.425f},
    {2.6f, -0.66f, 1.425f},
    {3.1f, -0.66f, 0.825f},
    {3.1f, 0, 0.825f},
    {2.3f, 0, 2.1f},
    {2.3f, -0.25f, 2.1f},
    {2.4f, -0.25f, 2.025f},
    {2.4f, 0, 2.025f},
    {2.7f, 0, 2.4f},
    {2.7f, -0.25f, 2.4f},
    {3.3f, -0.25f, 2.4f},
    {3.3f, 0, 2.4f},
    {2.8f, 0, 2.475f},
    {2.8f, -0.25f, 2.475f},
    {3.525f, -0.25f, 2.49375f},
    {3.525f, 0, 2.49375f},
    {2.9f, 0, 2.475f},
    {2.9f, -0.15f, 2.475f},
    {3.45f, -0.15f, 2.5125f},
    {3.45f, 0, 2.5125f},
    {2.8f, 0, 2.4f},
    {2.8f, -0.15f, 2.4f},
    {3.2f, -0.15f, 2.4f},
    {3.2f, 0, 2.4f},
    {0, 0, 3.15f},
    {0.8f, 0, 3.15f},
    {0.8f, -0.45f, 3.15f},
    {0.45f, -0.8f, 3.15f},
    {0, -0.8f, 3.15f},
    {0, 0, 2.85f},
    {1.4f, 0, 2.4f},
    {1.4f, -0.784f, 2.4f},
    {0.784f, -1.4f, 2.4f},
    {0, -1.4f, 2.4f},
    {0.4f, 0, 2.55f},
    {0.4f, -0.224f, 2.55f},
    {0.224f, -0.4f, 2.55f},
    {0, -0.4f, 2.55f},
    {1.3f, 0, 2.55f},
    {1.3f, -0.728f, 2.55f},
    {0.728f, -1.3f, 2.55f},
    {0, -1.3f, 2.55f},
    {1.3f, 0, 2.4f},
    {1.3f, -0.728f, 2.4f},
    {0.728f, -1.3f, 2.4f},
    {0, -1.3f, 2.4f},
    {0, 0, 0},
    {1.425f, -0.798f, 0},
    {1.5f, 0, 0.075f},
    {1.425f, 0, 0},
    {0.798f, -1.425f, 0},
    {0, -1.5f, 0.075f},
    {0, -1.425f, 0},
    {1.5f, -0.84f, 0.075f},
    {0.84f, -1.5f, 0.075f},
}};
constexpr float kHeight = 3.15f;

using Patch = std::array<std::array<glm::dvec3, 4>, 4>;

std::array<double, 4> bernstein(double t) {
  const double s = 1.0 - t;
  return {s * s * s, 3.0 * s * s * t, 3.0 * s * t * t, t * t * t};
}

std::array<double, 4> bernsteinDerivative(double t) {
  const double s = 1.0 - t;
  return {-3.0 * s * s, 3.0 * s * s - 6.0 * s * t, 6.0 * s * t - 3.0 * t * t, 3.0 * t * t};
}

glm::dvec3 combine(const Patch& patch, const std::array<double, 4>& along,
                   const std::array<double, 4>& across) {
  glm::dvec3 sum(0.0);
  for (std::size_t i = 0; i < 4; ++i) {
    for (std::size_t j = 0; j < 4; ++j) sum += along[i] * across[j] * patch[i][j];
  }
  return sum;
}

}  // namespace

Mesh makeTeapot(float height, int segments, bool lid, UvMode uv) {
  const double scale = static_cast<double>(height) / static_cast<double>(kHeight);
  ShapeBuilder builder;
  for (std::size_t p = 0; p < kPatches.size(); ++p) {
    if (!lid && (p == 3 || p == 4)) continue;
    const int copies = p < kMirroredTwice ? 4 : 2;
    for (int copy = 0; copy < copies; ++copy) {
      const bool mirrorX = (copy & 2) != 0;
      const bool mirrorY = (copy & 1) != 0;
      // y up: (x, y, z) of the published data becomes (x, z, -y).
      Patch patch;
      for (std::size_t k = 0; k < 16; ++k) {
        const auto& c = kPoints[static_cast<std::size_t>(kPatches[p][k])];
        patch[k / 4][k % 4] =
            scale * glm::dvec3(mirrorX ? -c[0] : c[0], c[2], mirrorY ? c[1] : -c[1]);
      }
      const bool mirrored = mirrorX != mirrorY;
      builder.grid(segments, segments, mirrored, [&](int i, int j) {
        const double u = static_cast<double>(i) / segments;  // across: around the body
        const double v = static_cast<double>(j) / segments;  // along: rim to bottom
        const glm::dvec3 position = combine(patch, bernstein(v), bernstein(u));
        const glm::dvec3 du = combine(patch, bernstein(v), bernsteinDerivative(u));
        const glm::dvec3 dv = combine(patch, bernsteinDerivative(v), bernstein(u));
        glm::dvec3 normal = glm::cross(du, dv);
        if (glm::length(normal) < 1e-9 * scale * scale) {
          // At a pole du vanishes; the limit of the direction is the mixed derivative's.
          normal = glm::cross(combine(patch, bernsteinDerivative(v), bernsteinDerivative(u)), dv);
          if (v > 0.5) normal = -normal;
        }
        normal = glm::normalize(mirrored ? -normal : normal);
        const bool pole = v == 0.0 && patch[0][0] == patch[0][3];
        const double column = pole ? (i + 0.5) / segments : u;
        const float size = uv == UvMode::Metres ? height : 1.0f;
        // + 0 turns negative zeros into positive ones, so that seams weld.
        return ShapeVertex{Vec3(position) + Vec3(0.0f), Vec3(normal),
                           Vec2(static_cast<float>(column), static_cast<float>(v)) * size};
      });
    }
  }
  return builder.take();
}

}  // namespace catoptric::scene
