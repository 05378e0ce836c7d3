// The vector and matrix types of the program (glm), and a few scalar helpers that modules share.
// Coordinates are right-handed, y up, in metres. Matrices are column-major and named
// TARGETFromSOURCE, e.g. worldFromCamera.
#pragma once

#include <cmath>
#include <cstdint>
#include <glm/glm.hpp>
#include <glm/gtc/matrix_transform.hpp>
#include <glm/gtc/quaternion.hpp>
#include <limits>
#include <numbers>

namespace catoptric {

using Vec2 = glm::vec2;
using Vec3 = glm::vec3;
using Vec4 = glm::vec4;
using Mat3 = glm::mat3;
using Mat4 = glm::mat4;
using Quat = glm::quat;

inline constexpr float kPi = std::numbers::pi_v<float>;

/// Axis-aligned bounding box; initially empty (min > max).
struct Box3 {
  Vec3 min{std::numeric_limits<float>::infinity()};
  Vec3 max{-std::numeric_limits<float>::infinity()};

  bool empty() const { return min.x > max.x; }
  void extend(const Vec3& p) {
    min = glm::min(min, p);
    max = glm::max(max, p);
  }
  void extend(const Box3& b) {
    min = glm::min(min, b.min);
    max = glm::max(max, b.max);
  }
  Vec3 centre() const { return empty() ? Vec3(0) : 0.5f * (min + max); }
  /// Length of the diagonal; 0 when empty.
  float diameter() const { return empty() ? 0.0f : glm::length(max - min); }
  /// Whether the box is a point or a line. An extent below 1e-18 counts as none: its square is not
  /// a normal float.
  bool atMostALine() const {
    const auto extents = glm::greaterThan(max - min, Vec3(1e-18f));
    return static_cast<int>(extents.x) + static_cast<int>(extents.y) + static_cast<int>(extents.z) <
           2;
  }
};

inline bool isFinite(const Vec3& v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

/// `v` scaled to length 1, or `fallback` if its length is zero or not finite.
inline Vec3 normalizedOr(const Vec3& v, const Vec3& fallback) {
  const float length = glm::length(v);
  return (length > 0.0f && std::isfinite(length)) ? v / length : fallback;
}

inline constexpr float radians(float degrees) {
  return degrees * (kPi / 180.0f);
}
inline constexpr float degrees(float rad) {
  return rad * (180.0f / kPi);
}

}  // namespace catoptric
