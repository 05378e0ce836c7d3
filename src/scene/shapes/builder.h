// Collects vertices and triangles of a shape.
#pragma once

#include <functional>

#include "scene/scene.h"

namespace catoptric::scene {

inline float fraction(int i, int n) {
  return static_cast<float>(i) / static_cast<float>(n);
}

struct ShapeVertex {
  Vec3 position{0.0f};
  Vec3 normal{0.0f, 1.0f, 0.0f};
  Vec2 uv{0.0f};
};

class ShapeBuilder {
 public:
  std::uint32_t vertex(const Vec3& position, const Vec3& normal, const Vec2& uv) {
    mesh_.positions.push_back(position);
    mesh_.normals.push_back(normal);
    mesh_.uv[0].push_back(uv);
    return static_cast<std::uint32_t>(mesh_.positions.size() - 1);
  }

  /// Adds a triangle, unless two of its corners coincide (at poles).
  void triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    const Vec3& pa = mesh_.positions[a];
    const Vec3& pb = mesh_.positions[b];
    const Vec3& pc = mesh_.positions[c];
    if (pa == pb || pb == pc || pc == pa) return;
    mesh_.indices.insert(mesh_.indices.end(), {a, b, c});
  }

  /// Adds a quad with counter-clockwise corners a, b, c, d. The shorter diagonal divides it, unless
  /// one side is a point.
  void quad(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) {
    triangle(a, b, c);
    triangle(a, c, d);
  }

  /// Adds a grid of (columns + 1) x (rows + 1) vertices made by at(i, j). Its outer side is the one
  /// to which d/di x d/dj points (with `flip`, the opposite one). If all vertices of the first or
  /// last row coincide, the row is a pole: each of its vertices belongs to one triangle, so its uv
  /// should lie in the middle of its column.
  void grid(int columns, int rows, bool flip, const std::function<ShapeVertex(int, int)>& at) {
    const auto first = static_cast<std::uint32_t>(mesh_.positions.size());
    for (int j = 0; j <= rows; ++j) {
      for (int i = 0; i <= columns; ++i) {
        const ShapeVertex v = at(i, j);
        vertex(v.position, v.normal, v.uv);
      }
    }
    const auto index = [&](int i, int j) {
      return first + static_cast<std::uint32_t>(j) * static_cast<std::uint32_t>(columns + 1) +
             static_cast<std::uint32_t>(i);
    };
    for (int j = 0; j < rows; ++j) {
      for (int i = 0; i < columns; ++i) {
        const std::uint32_t a = index(i, j);
        const std::uint32_t b = index(i + 1, j);
        const std::uint32_t c = index(i + 1, j + 1);
        const std::uint32_t d = index(i, j + 1);
        // Triangle i uses vertex i of a pole.
        const bool upperPole = mesh_.positions[c] == mesh_.positions[d];
        const auto tri = [&](std::uint32_t p, std::uint32_t q, std::uint32_t r) {
          flip ? triangle(p, r, q) : triangle(p, q, r);
        };
        if (upperPole) {
          tri(a, b, d);
        } else {
          tri(a, b, c);
          tri(a, c, d);
        }
      }
    }
  }

  Mesh take() { return std::move(mesh_); }
  Mesh& mesh() { return mesh_; }

 private:
  Mesh mesh_;
};

}  // namespace catoptric::scene
