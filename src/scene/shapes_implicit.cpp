#include <algorithm>
#include <array>
#include <cmath>
#include <unordered_map>

#include "core/parallel.h"
#include "scene/shape_builder.h"
#include "scene/shapes.h"

namespace catoptric::scene {
namespace {

float square(float x) {
  return x * x;
}

/// a or b, whichever is larger, with its gradient.
struct Term {
  float value;
  Vec3 gradient;
};

}  // namespace

ImplicitSurface implicitSphere(float radius) {
  return {[=](const Vec3& p) { return glm::length(p) - radius; },
          [](const Vec3& p) { return normalizedOr(p, Vec3(0, 1, 0)); }, Vec3(1.1f * radius)};
}

ImplicitSurface implicitTorus(float radius, float tube) {
  return {[=](const Vec3& p) { return std::hypot(std::hypot(p.x, p.z) - radius, p.y) - tube; },
          [=](const Vec3& p) {
            const float ring = std::max(std::hypot(p.x, p.z), 1e-9f);
            const float d = std::max(std::hypot(ring - radius, p.y), 1e-9f);
            const float k = (ring - radius) / (d * ring);
            return Vec3(k * p.x, p.y / d, k * p.z);
          },
          1.1f * Vec3(radius + tube, tube, radius + tube)};
}

ImplicitSurface implicitMetaballs(const std::vector<Vec4>& balls, float level) {
  // Sum of squared fall-offs (1 - d^2 / (2r)^2)^2, scaled so that one ball alone ends at r.
  const auto alone = square(1.0f - 0.25f);
  Vec3 half(0.0f);
  for (const Vec4& b : balls) half = glm::max(half, glm::abs(Vec3(b)) + Vec3(2.05f * b.w));
  return {[=](const Vec3& p) {
            float sum = 0.0f;
            for (const Vec4& b : balls) {
              const Vec3 d = p - Vec3(b);
              const float q = 1.0f - glm::dot(d, d) / (4.0f * b.w * b.w);
              if (q > 0.0f) sum += q * q / alone;
            }
            return level - sum;
          },
          [=](const Vec3& p) {
            Vec3 sum(0.0f);
            for (const Vec4& b : balls) {
              const Vec3 d = p - Vec3(b);
              const float q = 1.0f - glm::dot(d, d) / (4.0f * b.w * b.w);
              if (q > 0.0f) sum += (2.0f * q / alone) * d * (2.0f / (4.0f * b.w * b.w));
            }
            return sum;
          },
          half};
}

ImplicitSurface implicitGyroid(float period, float thickness, float radius) {
  const float k = 2.0f * kPi / period;
  // |gyroid| < t inside a ball; t in the gyroid's own units from the wall's thickness.
  const float t = 0.5f * thickness * k;
  const auto gyroid = [=](const Vec3& p) {
    return std::sin(k * p.x) * std::cos(k * p.y) + std::sin(k * p.y) * std::cos(k * p.z) +
           std::sin(k * p.z) * std::cos(k * p.x);
  };
  const auto evaluate = [=](const Vec3& p) {
    const float g = gyroid(p);
    const Term wall{
        (std::abs(g) - t) / k,
        Vec3(std::cos(k * p.x) * std::cos(k * p.y) - std::sin(k * p.z) * std::sin(k * p.x),
             std::cos(k * p.y) * std::cos(k * p.z) - std::sin(k * p.x) * std::sin(k * p.y),
             std::cos(k * p.z) * std::cos(k * p.x) - std::sin(k * p.y) * std::sin(k * p.z)) *
            (g < 0.0f ? -1.0f : 1.0f)};
    const Term ball{glm::length(p) - radius, normalizedOr(p, Vec3(0, 1, 0))};
    // A rounded maximum: hypot where both are near the edge.
    const float rounding = 0.05f * radius;
    const float a = wall.value + rounding;
    const float b = ball.value + rounding;
    if (a > 0.0f && b > 0.0f) {
      const float h = std::hypot(a, b);
      return Term{h - rounding, (a * wall.gradient + b * ball.gradient) / h};
    }
    return a > b ? Term{a - rounding, wall.gradient} : Term{b - rounding, ball.gradient};
  };
  return {[=](const Vec3& p) { return evaluate(p).value; },
          [=](const Vec3& p) { return evaluate(p).gradient; }, Vec3(1.05f * radius)};
}

ImplicitSurface implicitHeart() {
  // (x^2 + 9/4 z^2 + y^2 - 1)^3 - x^2 y^3 - 9/80 z^2 y^3 = 0 (Taubin's heart), y up.
  return {[](const Vec3& p) {
            const float q = p.x * p.x + 2.25f * p.z * p.z + p.y * p.y - 1.0f;
            const float y3 = p.y * p.y * p.y;
            return q * q * q - p.x * p.x * y3 - 0.1125f * p.z * p.z * y3;
          },
          [](const Vec3& p) {
            const float q = p.x * p.x + 2.25f * p.z * p.z + p.y * p.y - 1.0f;
            const float q2 = 3.0f * q * q;
            const float y2 = p.y * p.y;
            return Vec3(2.0f * p.x * q2 - 2.0f * p.x * y2 * p.y,
                        2.0f * p.y * q2 - 3.0f * p.x * p.x * y2 - 0.3375f * p.z * p.z * y2,
                        4.5f * p.z * q2 - 0.225f * p.z * y2 * p.y);
          },
          Vec3(1.25f, 1.35f, 0.75f)};
}

ImplicitSurface implicitGenus2() {
  // 2 y (y^2 - 3 x^2)(1 - z^2) + (x^2 + y^2)^2 - (9 z^2 - 1)(1 - z^2) = 0.
  return {[](const Vec3& p) {
            const float x2 = p.x * p.x;
            const float y2 = p.y * p.y;
            const float z2 = p.z * p.z;
            return 2.0f * p.y * (y2 - 3.0f * x2) * (1.0f - z2) + square(x2 + y2) -
                   (9.0f * z2 - 1.0f) * (1.0f - z2);
          },
          [](const Vec3& p) {
            const float x2 = p.x * p.x;
            const float y2 = p.y * p.y;
            const float z2 = p.z * p.z;
            return Vec3(-12.0f * p.x * p.y * (1.0f - z2) + 4.0f * p.x * (x2 + y2),
                        6.0f * (y2 - x2) * (1.0f - z2) + 4.0f * p.y * (x2 + y2),
                        -4.0f * p.z * p.y * (y2 - 3.0f * x2) - 20.0f * p.z + 36.0f * p.z * z2);
          },
          Vec3(2.2f, 2.4f, 1.1f)};
}

ImplicitSurface implicitBlobbyCube() {
  return {[](const Vec3& p) {
            return square(square(p.x)) + square(square(p.y)) + square(square(p.z)) -
                   0.6f * glm::dot(p, p) - 0.1f;
          },
          [](const Vec3& p) { return 4.0f * p * p * p - 1.2f * p; }, Vec3(1.05f)};
}

Mesh makeImplicit(const ImplicitSurface& surface, int resolution, UvMode uv) {
  const float cell = 2.0f * std::max({surface.halfSize.x, surface.halfSize.y, surface.halfSize.z}) /
                     static_cast<float>(resolution);
  // One cell of margin all around; the odd shift keeps grid points off planes of symmetry.
  const glm::ivec3 cells = glm::ivec3(glm::ceil(2.0f * surface.halfSize / cell)) + 2;
  const Vec3 origin = -0.5f * cell * Vec3(cells) + cell * Vec3(0.0137f, 0.0071f, 0.0193f);
  const glm::ivec3 points = cells + 1;
  const auto number = [&](const glm::ivec3& p) {
    return static_cast<std::size_t>((p.z * points.y + p.y) * points.x + p.x);
  };
  const auto place = [&](const glm::ivec3& p) { return origin + cell * Vec3(p); };

  // Values at grid points; the border counts as outside, which closes the surface there.
  std::vector<float> values(static_cast<std::size_t>(points.x) * points.y * points.z);
  parallelFor(static_cast<std::size_t>(points.z), 1, [&](std::size_t begin, std::size_t end) {
    for (auto z = static_cast<int>(begin); z < static_cast<int>(end); ++z) {
      for (int y = 0; y < points.y; ++y) {
        for (int x = 0; x < points.x; ++x) {
          const glm::ivec3 p(x, y, z);
          const bool border =
              x == 0 || y == 0 || z == 0 || x == cells.x || y == cells.y || z == cells.z;
          float value = surface.value(place(p));
          if (border) value = std::max(value, 1e-3f);
          values[number(p)] = value == 0.0f ? 1e-9f : value;
        }
      }
    }
  });

  // One vertex per crossed grid edge: a closed manifold by construction.
  ShapeBuilder builder;
  std::unordered_map<std::uint64_t, std::uint32_t> vertices;
  std::vector<Vec3> crossings;
  const auto crossing = [&](const glm::ivec3& a, const glm::ivec3& b) {
    const std::size_t ia = number(a);
    const std::size_t ib = number(b);
    const float t = values[ia] / (values[ia] - values[ib]);
    const std::uint64_t key = (std::uint64_t{std::min(ia, ib)} << 32) | std::max(ia, ib);
    const auto [entry, isNew] =
        vertices.try_emplace(key, static_cast<std::uint32_t>(crossings.size()));
    if (isNew) crossings.push_back(place(a) + t * (place(b) - place(a)));
    return entry->second;
  };

  // Six tetrahedra around each cell's diagonal [Kuhn]; neighbouring cells agree on their faces.
  constexpr std::array<std::array<int, 4>, 6> kTetrahedra{
      {{0, 1, 3, 7}, {0, 3, 2, 7}, {0, 2, 6, 7}, {0, 6, 4, 7}, {0, 4, 5, 7}, {0, 5, 1, 7}}};
  std::vector<std::array<std::uint32_t, 3>> triangles;
  for (int z = 0; z < cells.z; ++z) {
    for (int y = 0; y < cells.y; ++y) {
      for (int x = 0; x < cells.x; ++x) {
        const glm::ivec3 base(x, y, z);
        int inside = 0;
        for (int c = 0; c < 8; ++c) {
          inside += values[number(base + glm::ivec3(c & 1, (c >> 1) & 1, c >> 2))] < 0.0f;
        }
        if (inside == 0 || inside == 8) continue;
        for (const auto& tetrahedron : kTetrahedra) {
          std::array<glm::ivec3, 4> in{};
          std::array<glm::ivec3, 4> out{};
          std::size_t ins = 0;
          std::size_t outs = 0;
          for (const int c : tetrahedron) {
            const glm::ivec3 p = base + glm::ivec3(c & 1, (c >> 1) & 1, c >> 2);
            (values[number(p)] < 0.0f ? in[ins++] : out[outs++]) = p;
          }
          // Winding is put right below, once the vertices are where they belong.
          if (ins == 1) {
            triangles.push_back(
                {crossing(in[0], out[0]), crossing(in[0], out[1]), crossing(in[0], out[2])});
          } else if (ins == 3) {
            triangles.push_back(
                {crossing(in[0], out[0]), crossing(in[1], out[0]), crossing(in[2], out[0])});
          } else if (ins == 2) {
            const std::uint32_t a = crossing(in[0], out[0]);
            const std::uint32_t b = crossing(in[0], out[1]);
            const std::uint32_t c = crossing(in[1], out[1]);
            const std::uint32_t d = crossing(in[1], out[0]);
            triangles.push_back({a, b, c});
            triangles.push_back({a, c, d});
          }
          // The triangle's outer side is where the outside corners are.
          const std::size_t made = ins == 2 ? 2 : (ins == 1 || ins == 3) ? 1 : 0;
          if (made == 0) continue;
          Vec3 outwards(0.0f);
          for (std::size_t k = 0; k < outs; ++k)
            outwards += Vec3(out[k]) / static_cast<float>(outs);
          for (std::size_t k = 0; k < ins; ++k) outwards -= Vec3(in[k]) / static_cast<float>(ins);
          // Edge midpoints stand for the crossings: same orientation, never degenerate.
          const auto mid = [&](const glm::ivec3& a, const glm::ivec3& b) {
            return 0.5f * (Vec3(a) + Vec3(b));
          };
          Vec3 p0 = mid(in[0], out[0]);
          Vec3 p1 = ins == 3 ? mid(in[1], out[0]) : mid(in[0], out[1]);
          Vec3 p2 = ins == 1   ? mid(in[0], out[2])
                    : ins == 3 ? mid(in[2], out[0])
                               : mid(in[1], out[1]);
          if (glm::dot(glm::cross(p1 - p0, p2 - p0), outwards) < 0.0f) {
            for (std::size_t k = triangles.size() - made; k < triangles.size(); ++k) {
              std::swap(triangles[k][1], triangles[k][2]);
            }
          }
        }
      }
    }
  }

  // Vertices onto the surface: Newton steps along the gradient, at most half a cell in all.
  const std::size_t count = crossings.size();
  std::vector<Vec3> positions(count);
  std::vector<Vec3> normals(count);
  parallelFor(count, 256, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) {
      const Vec3 start = crossings[k];
      Vec3 p = start;
      for (int step = 0; step < 6; ++step) {
        const Vec3 gradient = surface.gradient(p);
        const float size2 = glm::dot(gradient, gradient);
        if (size2 < 1e-12f) break;
        const Vec3 next = p - gradient * (surface.value(p) / size2);
        const float moved = glm::length(next - start);
        if (!(moved < 0.5f * cell)) break;
        p = next;
      }
      positions[k] = p;
      normals[k] = normalizedOr(surface.gradient(p), Vec3(0, 1, 0));
    }
  });
  const Vec3 extent = uv == UvMode::Metres ? Vec3(1.0f) : 2.0f * surface.halfSize;
  for (std::size_t k = 0; k < count; ++k) {
    const Vec3 a = glm::abs(normals[k]);
    const Vec3 p = (positions[k] + surface.halfSize) / extent;
    const Vec2 st = a.y >= a.x && a.y >= a.z ? Vec2(p.x, p.z)
                    : a.x >= a.z             ? Vec2(p.z, 1.0f - p.y)
                                             : Vec2(p.x, 1.0f - p.y);
    builder.vertex(positions[k], normals[k], st);
  }
  for (const auto& [a, b, c] : triangles) {
    if (a != b && b != c && c != a)
      builder.mesh().indices.insert(builder.mesh().indices.end(), {a, b, c});
  }
  return builder.take();
}

}  // namespace catoptric::scene
