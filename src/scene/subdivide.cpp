#include "scene/subdivide.h"

#include <array>
#include <cstdint>
#include <unordered_map>
#include <utility>

namespace catoptric::scene {
namespace {

/// Halving so often reaches any length that a caller asks for; ours.
constexpr int kMostRounds = 16;

/// One round: every edge that is too long gets a vertex in its middle.
class Round {
 public:
  Round(Mesh& mesh, const Vec3& scale, float longest)
      : mesh_(mesh), scale_(scale), longest_(longest) {}

  /// Returns whether any edge was split.
  bool run() {
    const std::vector<std::uint32_t> before = std::move(mesh_.indices);
    mesh_.indices.clear();
    for (std::size_t i = 0; i + 2 < before.size(); i += 3)
      split({before[i], before[i + 1], before[i + 2]});
    return !middles_.empty();
  }

 private:
  using Corners = std::array<std::uint32_t, 3>;

  void add(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    mesh_.indices.insert(mesh_.indices.end(), {a, b, c});
  }

  float length(std::uint32_t a, std::uint32_t b) const {
    return glm::length(scale_ * (mesh_.positions[a] - mesh_.positions[b]));
  }

  void split(Corners c) {
    std::array<bool, 3> isLong{};  // the edge from corner k to the next
    int count = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      isLong[k] = length(c[k], c[(k + 1) % 3]) > longest_;
      count += isLong[k] ? 1 : 0;
    }
    if (count == 0) return add(c[0], c[1], c[2]);
    if (count == 3) {
      const Corners m{middle(c[0], c[1]), middle(c[1], c[2]), middle(c[2], c[0])};
      for (std::size_t k = 0; k < 3; ++k) add(c[k], m[k], m[(k + 2) % 3]);
      return add(m[0], m[1], m[2]);
    }
    // Turned so that the first edge is long and, of two, the last is not
    std::size_t turn = 0;
    while (!isLong[turn] || (count == 2 && isLong[(turn + 2) % 3])) ++turn;
    c = {c[turn], c[(turn + 1) % 3], c[(turn + 2) % 3]};
    const std::uint32_t m = middle(c[0], c[1]);
    if (count == 1) {
      add(c[0], m, c[2]);
      return add(m, c[1], c[2]);
    }
    const std::uint32_t n = middle(c[1], c[2]);
    add(m, c[1], n);
    if (length(c[0], n) < length(m, c[2])) {
      add(c[0], m, n);
      add(c[0], n, c[2]);
    } else {
      add(c[0], m, c[2]);
      add(m, n, c[2]);
    }
  }

  /// The vertex in the middle of an edge; each edge has one.
  std::uint32_t middle(std::uint32_t a, std::uint32_t b) {
    if (a > b) std::swap(a, b);
    const auto [found, isNew] = middles_.try_emplace(std::uint64_t{a} << 32 | b, 0u);
    if (!isNew) return found->second;
    found->second = static_cast<std::uint32_t>(mesh_.positions.size());
    const auto average = [a, b](auto& values) {
      if (!values.empty()) values.push_back((values[a] + values[b]) * 0.5f);
    };
    average(mesh_.positions);
    average(mesh_.uv[0]);
    average(mesh_.uv[1]);
    average(mesh_.colors);
    const Vec3 normal = mesh_.normals[a];
    mesh_.normals.push_back(normalizedOr(normal + mesh_.normals[b], normal));
    if (!mesh_.tangents.empty()) {
      const Vec4 tangent = mesh_.tangents[a];
      mesh_.tangents.emplace_back(Vec3(tangent) + Vec3(mesh_.tangents[b]), tangent.w);
    }
    return found->second;
  }

  Mesh& mesh_;
  Vec3 scale_;
  float longest_;
  std::unordered_map<std::uint64_t, std::uint32_t> middles_;
};

}  // namespace

void subdivide(Mesh& mesh, const Vec3& scale, float longest) {
  if (!mesh.morphTargets.empty() || !mesh.joints.empty()) return;
  for (int round = 0; round < kMostRounds && Round(mesh, scale, longest).run(); ++round) {
  }
}

}  // namespace catoptric::scene
