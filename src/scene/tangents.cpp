#include "scene/tangents.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace catoptric::scene {
namespace {

/// Sine of the angle between two edges below which a triangle has no direction to speak of. Ours.
constexpr float kSliver = 1e-6f;

/// Angle between two edges, 0 when one has no length.
float cornerAngle(const Vec3& u, const Vec3& v) {
  const Vec3 a = normalizedOr(u, Vec3(0.0f));
  const Vec3 b = normalizedOr(v, Vec3(0.0f));
  return std::acos(std::clamp(glm::dot(a, b), -1.0f, 1.0f));
}

template <class T>
void appendCopy(std::vector<T>& values, std::size_t index) {
  if (!values.empty()) values.push_back(T(values[index]));
}

void duplicateVertex(Mesh& mesh, std::size_t index) {
  appendCopy(mesh.positions, index);
  appendCopy(mesh.normals, index);
  appendCopy(mesh.uv[0], index);
  appendCopy(mesh.uv[1], index);
  appendCopy(mesh.colors, index);
  appendCopy(mesh.joints, index);
  appendCopy(mesh.weights, index);
  for (MorphTarget& target : mesh.morphTargets) {
    appendCopy(target.positions, index);
    appendCopy(target.normals, index);
    appendCopy(target.tangents, index);
  }
}

}  // namespace

Vec3 anyPerpendicular(const Vec3& n) {
  const Vec3 axis = std::abs(n.x) < 0.5f ? Vec3(1.0f, 0.0f, 0.0f) : Vec3(0.0f, 1.0f, 0.0f);
  return glm::normalize(axis - n * glm::dot(axis, n));
}

std::size_t makeTangents(Mesh& mesh, const TextureSlot& slot) {
  const std::vector<Vec2>& uv = mesh.uv[static_cast<std::size_t>(slot.uvSet)];
  const std::size_t triangles = mesh.indices.size() / 3;
  const std::size_t original = mesh.positions.size();

  // Each triangle's direction of growing u, and its handedness.
  std::vector<Vec3> direction(triangles, Vec3(0.0f));
  std::vector<std::int8_t> side(triangles, 0);
  for (std::size_t t = 0; t < triangles && !uv.empty(); ++t) {
    const std::uint32_t* v = mesh.indices.data() + 3 * t;
    const auto at = [&](int k) { return slot.transform * Vec3(uv[v[k]], 1.0f); };
    const Vec2 s1 = at(1) - at(0);
    const Vec2 s2 = at(2) - at(0);
    const Vec3 e1 = mesh.positions[v[1]] - mesh.positions[v[0]];
    const Vec3 e2 = mesh.positions[v[2]] - mesh.positions[v[0]];
    const float area = s1.x * s2.y - s1.y * s2.x;
    const Vec3 alongU =
        normalizedOr((e1 * s2.y - e2 * s1.y) * (area < 0.0f ? -1.0f : 1.0f), Vec3(0.0f));
    if (area == 0.0f || alongU == Vec3(0.0f)) continue;
    const Vec3 geometric = glm::cross(e1, e2);
    // In slivers rounding decides on which side the triangle faces.
    if (glm::dot(geometric, geometric) <= kSliver * kSliver * glm::dot(e1, e1) * glm::dot(e2, e2)) {
      continue;
    }
    // glTF's bitangent points up in the image, against growing v (row 0 is v = 0): positive where
    // (u, -v, normal) is right-handed. Normals on the back of the triangle turn it.
    const Vec3 n = mesh.normals[v[0]] + mesh.normals[v[1]] + mesh.normals[v[2]];
    const bool backwards = glm::dot(geometric, n) < 0.0f;
    direction[t] = alongU;
    side[t] = (area < 0.0f) != backwards ? std::int8_t{1} : std::int8_t{-1};
  }

  // Split vertices that triangles of both sides share.
  std::vector<std::int8_t> sideOf(original, 0);
  std::vector<std::uint32_t> other(original, 0);
  for (std::size_t t = 0; t < triangles; ++t) {
    if (side[t] == 0) continue;
    for (std::size_t k = 0; k < 3; ++k) {
      std::uint32_t& vertex = mesh.indices[3 * t + k];
      if (sideOf[vertex] == 0) sideOf[vertex] = side[t];
      if (sideOf[vertex] == side[t]) continue;
      if (other[vertex] == 0) {
        other[vertex] = static_cast<std::uint32_t>(mesh.positions.size());
        duplicateVertex(mesh, vertex);
        sideOf.push_back(side[t]);
        other.push_back(0);
      }
      vertex = other[vertex];
    }
  }

  // Angle-weighted sums of the directions, each in the plane of the vertex' normal.
  const std::size_t count = mesh.positions.size();
  std::vector<Vec3> sum(count, Vec3(0.0f));
  for (std::size_t t = 0; t < triangles; ++t) {
    if (side[t] == 0) continue;
    const std::uint32_t* v = mesh.indices.data() + 3 * t;
    for (int k = 0; k < 3; ++k) {
      const Vec3& p = mesh.positions[v[k]];
      const float angle =
          cornerAngle(mesh.positions[v[(k + 1) % 3]] - p, mesh.positions[v[(k + 2) % 3]] - p);
      const Vec3& n = mesh.normals[v[k]];
      const Vec3 tangent = direction[t] - n * glm::dot(n, direction[t]);
      sum[v[k]] += angle * normalizedOr(tangent, Vec3(0.0f));
    }
  }
  std::size_t madeUp = 0;
  mesh.tangents.assign(count, Vec4(0.0f));
  for (std::size_t i = 0; i < count; ++i) {
    const float length = glm::length(sum[i]);
    const bool good = length > 1e-6f && std::isfinite(length);
    if (!good) ++madeUp;
    // Projected once more: the sum of rounded vectors may leave the plane.
    Vec3 tangent = good ? sum[i] / length : anyPerpendicular(mesh.normals[i]);
    tangent = glm::normalize(tangent - mesh.normals[i] * glm::dot(mesh.normals[i], tangent));
    mesh.tangents[i] = Vec4(tangent, sideOf[i] < 0 ? -1.0f : 1.0f);
  }
  return madeUp;
}

}  // namespace catoptric::scene
