#include "scene/shapes/shapes.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "scene/shapes/builder.h"

namespace catoptric::scene {
namespace {

/// Cosine and sine of i / n turns; exact at the quarters, and the same for i = 0 and i = n.
Vec2 onCircle(int i, int n) {
  const int k = ((i % n) + n) % n;
  if (k * 4 % n == 0) {
    constexpr std::array<Vec2, 4> kQuarters{Vec2(1, 0), Vec2(0, 1), Vec2(-1, 0), Vec2(0, -1)};
    return kQuarters[static_cast<std::size_t>(k * 4 / n)];
  }
  const double angle = 2.0 * std::numbers::pi * k / n;
  return {static_cast<float>(std::cos(angle)), static_cast<float>(std::sin(angle))};
}

/// A rectangle of the box: centre, half axes (their cross product is the normal).
struct Face {
  Vec3 centre;
  Vec3 right;  ///< half extent, u grows along it
  Vec3 up;     ///< half extent, v falls along it (row 0 of a texture is its top)
  int columns;
  int rows;
};

void addFace(ShapeBuilder& builder, const Face& face, bool inward, UvMode uv) {
  const Vec3 normal = glm::normalize(glm::cross(face.right, face.up)) * (inward ? -1.0f : 1.0f);
  const Vec2 extent = uv == UvMode::Metres
                          ? Vec2(2.0f * glm::length(face.right), 2.0f * glm::length(face.up))
                          : Vec2(1.0f);
  builder.grid(face.columns, face.rows, inward, [&](int i, int j) {
    const float u = fraction(i, face.columns);
    const float v = fraction(j, face.rows);
    // Seen from inside, u runs the other way so that texts stay readable.
    return ShapeVertex{face.centre + (2.0f * u - 1.0f) * face.right + (2.0f * v - 1.0f) * face.up,
                       normal, Vec2(inward ? 1.0f - u : u, 1.0f - v) * extent};
  });
}

}  // namespace

Mesh makePlane(Vec2 size, glm::ivec2 segments, UvMode uv) {
  ShapeBuilder builder;
  addFace(builder,
          {Vec3(0.0f), Vec3(0.5f * size.x, 0.0f, 0.0f), Vec3(0.0f, 0.0f, -0.5f * size.y),
           segments.x, segments.y},
          false, uv);
  return builder.take();
}

Mesh makeBox(const BoxShape& shape, UvMode uv) {
  const Vec3 h = 0.5f * shape.size;
  const glm::ivec3 n = shape.segments;
  const std::array<Face, 6> faces{{
      {{h.x, 0, 0}, {0, 0, -h.z}, {0, h.y, 0}, n.z, n.y},
      {{-h.x, 0, 0}, {0, 0, h.z}, {0, h.y, 0}, n.z, n.y},
      {{0, h.y, 0}, {h.x, 0, 0}, {0, 0, -h.z}, n.x, n.z},
      {{0, -h.y, 0}, {h.x, 0, 0}, {0, 0, h.z}, n.x, n.z},
      {{0, 0, h.z}, {h.x, 0, 0}, {0, h.y, 0}, n.x, n.y},
      {{0, 0, -h.z}, {-h.x, 0, 0}, {0, h.y, 0}, n.x, n.y},
  }};
  ShapeBuilder builder;
  for (std::size_t f = 0; f < faces.size(); ++f) {
    if (shape.faces[f]) addFace(builder, faces[f], shape.inward, uv);
  }
  return builder.take();
}

Mesh makeRoundedBox(Vec3 size, float radius, int rounding, UvMode uv) {
  const Vec3 h = 0.5f * size;
  const float r = std::min({radius, h.x, h.y, h.z});
  const Vec3 inner = h - Vec3(r);
  // Samples along one side of a face: rounding, flat part, rounding; as sines of the angle from
  // the face's normal towards the neighbour, and the offset of the inner box.
  struct Sample {
    float tangent;  ///< of the angle towards the neighbouring face; +-1 at the edge's middle
    float side;     ///< -1 or +1: which end of the inner box
  };
  std::vector<Sample> samples;
  for (int k = 0; k <= rounding; ++k) {
    samples.push_back({-std::tan(0.25f * kPi * (1.0f - fraction(k, rounding))), -1.0f});
  }
  samples[static_cast<std::size_t>(rounding)].tangent = 0.0f;
  samples.front().tangent = -1.0f;
  for (std::size_t k = samples.size(); k-- > 0;) {
    samples.push_back({-samples[k].tangent, 1.0f});
  }
  const std::array<std::array<Vec3, 2>, 6> axes{{{{{0, 0, -1}, {0, 1, 0}}},
                                                 {{{0, 0, 1}, {0, 1, 0}}},
                                                 {{{1, 0, 0}, {0, 0, -1}}},
                                                 {{{1, 0, 0}, {0, 0, 1}}},
                                                 {{{1, 0, 0}, {0, 1, 0}}},
                                                 {{{-1, 0, 0}, {0, 1, 0}}}}};
  ShapeBuilder builder;
  const int n = static_cast<int>(samples.size()) - 1;
  for (const auto& axis : axes) {
    const Vec3 right = axis[0];
    const Vec3 up = axis[1];
    const Vec3 out = glm::cross(right, up);
    const float halfU = std::abs(glm::dot(right, h));
    const float halfV = std::abs(glm::dot(up, h));
    builder.grid(n, n, false, [&](int i, int j) {
      const Sample& a = samples[static_cast<std::size_t>(i)];
      const Sample& b = samples[static_cast<std::size_t>(j)];
      const Vec3 normal = glm::normalize(out + a.tangent * right + b.tangent * up);
      const Vec3 position = inner * (out + a.side * right + b.side * up) + r * normal;
      Vec2 st(glm::dot(position, right) + halfU, halfV - glm::dot(position, up));
      if (uv == UvMode::Unit) st /= Vec2(2.0f * halfU, 2.0f * halfV);
      return ShapeVertex{position, normal, st};
    });
  }
  return builder.take();
}

namespace {

/// Cells of a panel between grid lines; those in its openings are not solid.
struct PanelGrid {
  PanelGrid(const PanelShape& panel, UvMode uv)
      : shape(panel),
        halfWidth(0.5f * panel.size.x),
        xs(lines(-halfWidth, halfWidth, 0)),
        ys(lines(0.0f, panel.size.y, 1)),
        columns(static_cast<int>(xs.size()) - 1),
        rows(static_cast<int>(ys.size()) - 1),
        uvScale(uv == UvMode::Metres ? Vec2(1.0f) : 1.0f / panel.size) {}

  /// Grid lines at the borders, at the openings, and so that no cell is wider than `cell`.
  std::vector<float> lines(float low, float high, int axis) const {
    std::vector<float> at{low, high};
    for (const Vec4& o : shape.openings) {
      at.push_back(std::clamp(o[axis], low, high));
      at.push_back(std::clamp(o[axis] + o[axis + 2], low, high));
    }
    std::sort(at.begin(), at.end());
    at.erase(std::unique(at.begin(), at.end(), [](float a, float b) { return b - a < 1e-5f; }),
             at.end());
    std::vector<float> all{at.front()};
    for (std::size_t i = 1; i < at.size(); ++i) {
      const float span = at[i] - at[i - 1];
      const int parts = shape.cell > 0.0f
                            ? std::max(1, static_cast<int>(std::ceil(span / shape.cell - 1e-4f)))
                            : 1;
      for (int k = 1; k < parts; ++k) all.push_back(at[i - 1] + span * fraction(k, parts));
      all.push_back(at[i]);
    }
    return all;
  }

  bool solid(int i, int j) const {
    if (i < 0 || j < 0 || i >= columns || j >= rows) return false;
    const float x = 0.5f * (xs[static_cast<std::size_t>(i)] + xs[static_cast<std::size_t>(i + 1)]);
    const float y = 0.5f * (ys[static_cast<std::size_t>(j)] + ys[static_cast<std::size_t>(j + 1)]);
    return std::none_of(shape.openings.begin(), shape.openings.end(), [&](const Vec4& o) {
      return x > o.x && x < o.x + o.z && y > o.y && y < o.y + o.w;
    });
  }

  const PanelShape& shape;
  float halfWidth;
  std::vector<float> xs, ys;
  int columns, rows;
  Vec2 uvScale;
};

/// Front, and back when the wall has a thickness; vertices shared within a side.
void addPanelSides(ShapeBuilder& builder, const PanelGrid& grid) {
  for (int side = 0; side < (grid.shape.thickness > 0.0f ? 2 : 1); ++side) {
    const float z = side == 0 ? 0.0f : -grid.shape.thickness;
    const float sign = side == 0 ? 1.0f : -1.0f;
    std::map<std::pair<int, int>, std::uint32_t> shared;
    const auto corner = [&](int i, int j) {
      const auto [entry, isNew] = shared.try_emplace({i, j}, 0u);
      if (isNew) {
        const float x = grid.xs[static_cast<std::size_t>(i)];
        const float y = grid.ys[static_cast<std::size_t>(j)];
        entry->second =
            builder.vertex({x, y, z}, {0, 0, sign},
                           Vec2(grid.halfWidth + sign * x, grid.shape.size.y - y) * grid.uvScale);
      }
      return entry->second;
    };
    for (int j = 0; j < grid.rows; ++j) {
      for (int i = 0; i < grid.columns; ++i) {
        if (!grid.solid(i, j)) continue;
        if (side == 0) {
          builder.quad(corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1));
        } else {
          builder.quad(corner(i + 1, j), corner(i, j), corner(i, j + 1), corner(i + 1, j + 1));
        }
      }
    }
  }
}

/// Outer edges and reveals: wherever a solid cell borders on none.
void addPanelEdges(ShapeBuilder& builder, const PanelGrid& grid) {
  const auto edge = [&](Vec3 a, Vec3 b, const Vec3& normal) {
    // a to b along the front edge, with `normal` out of the grid.solid; going back by the
    // thickness.
    const Vec3 back(0.0f, 0.0f, -grid.shape.thickness);
    const float along = glm::length(b - a);
    const auto at = [&](const Vec3& p, float s, float t) {
      return builder.vertex(p, normal, Vec2(s, t) * grid.uvScale);
    };
    const float start = std::abs(normal.x) > 0.5f ? a.y : a.x;
    const std::uint32_t p = at(a, start, 0.0f);
    const std::uint32_t q = at(b, start + along, 0.0f);
    const std::uint32_t r = at(b + back, start + along, grid.shape.thickness);
    const std::uint32_t s = at(a + back, start, grid.shape.thickness);
    if (glm::dot(glm::cross(b - a, back), normal) > 0.0f) {
      builder.quad(p, q, r, s);
    } else {
      builder.quad(q, p, s, r);
    }
  };
  for (int j = 0; j < grid.rows; ++j) {
    for (int i = 0; i < grid.columns; ++i) {
      if (!grid.solid(i, j)) continue;
      const float x0 = grid.xs[static_cast<std::size_t>(i)];
      const float x1 = grid.xs[static_cast<std::size_t>(i + 1)];
      const float y0 = grid.ys[static_cast<std::size_t>(j)];
      const float y1 = grid.ys[static_cast<std::size_t>(j + 1)];
      if (!grid.solid(i - 1, j)) edge({x0, y0, 0}, {x0, y1, 0}, {-1, 0, 0});
      if (!grid.solid(i + 1, j)) edge({x1, y0, 0}, {x1, y1, 0}, {1, 0, 0});
      if (!grid.solid(i, j - 1)) edge({x0, y0, 0}, {x1, y0, 0}, {0, -1, 0});
      if (!grid.solid(i, j + 1)) edge({x0, y1, 0}, {x1, y1, 0}, {0, 1, 0});
    }
  }
}

}  // namespace

Mesh makePanel(const PanelShape& shape, UvMode uv) {
  const PanelGrid grid(shape, uv);
  ShapeBuilder builder;
  addPanelSides(builder, grid);
  if (shape.thickness > 0.0f) addPanelEdges(builder, grid);
  return builder.take();
}

Mesh makeSphere(float radius, int around, int rows, UvMode uv) {
  ShapeBuilder builder;
  const Vec2 extent = uv == UvMode::Metres ? Vec2(2.0f * kPi * radius, kPi * radius) : Vec2(1.0f);
  builder.grid(around, rows, true, [&](int i, int j) {
    const Vec2 c = onCircle(i, around);
    const double polar = std::numbers::pi * j / rows;
    const bool pole = j == 0 || j == rows;
    const auto sine = pole ? 0.0f : static_cast<float>(std::sin(polar));
    const auto cosine = j == 0 ? 1.0f : j == rows ? -1.0f : static_cast<float>(std::cos(polar));
    const Vec3 n = glm::normalize(Vec3(sine * c.x, cosine, -sine * c.y));
    const float u = (static_cast<float>(i) + (pole ? 0.5f : 0.0f)) / static_cast<float>(around);
    return ShapeVertex{radius * n, n, Vec2(u, fraction(j, rows)) * extent};
  });
  return builder.take();
}

Mesh makeIcosphere(float radius, int level, UvMode uv) {
  const float t = 0.5f * (1.0f + std::sqrt(5.0f));
  std::vector<Vec3> points;
  for (const Vec3& p : {Vec3(-1, t, 0), Vec3(1, t, 0), Vec3(-1, -t, 0), Vec3(1, -t, 0),
                        Vec3(0, -1, t), Vec3(0, 1, t), Vec3(0, -1, -t), Vec3(0, 1, -t),
                        Vec3(t, 0, -1), Vec3(t, 0, 1), Vec3(-t, 0, -1), Vec3(-t, 0, 1)}) {
    points.push_back(glm::normalize(p));
  }
  using Triangle = std::array<std::uint32_t, 3>;
  std::vector<Triangle> triangles{{0, 11, 5}, {0, 5, 1},  {0, 1, 7},   {0, 7, 10}, {0, 10, 11},
                                  {1, 5, 9},  {5, 11, 4}, {11, 10, 2}, {10, 7, 6}, {7, 1, 8},
                                  {3, 9, 4},  {3, 4, 2},  {3, 2, 6},   {3, 6, 8},  {3, 8, 9},
                                  {4, 9, 5},  {2, 4, 11}, {6, 2, 10},  {8, 6, 7},  {9, 8, 1}};
  for (int k = 0; k < level; ++k) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
    const auto middle = [&](std::uint32_t a, std::uint32_t b) {
      const auto [entry, isNew] = middles.try_emplace(std::minmax(a, b), 0u);
      if (isNew) {
        entry->second = static_cast<std::uint32_t>(points.size());
        points.push_back(glm::normalize(points[a] + points[b]));
      }
      return entry->second;
    };
    std::vector<Triangle> finer;
    for (const auto& [a, b, c] : triangles) {
      const std::uint32_t ab = middle(a, b);
      const std::uint32_t bc = middle(b, c);
      const std::uint32_t ca = middle(c, a);
      finer.insert(finer.end(), {{a, ab, ca}, {b, bc, ab}, {c, ca, bc}, {ab, bc, ca}});
    }
    triangles = std::move(finer);
  }
  // Longitude has a seam and is undefined at the poles: vertices are shared where uv agrees.
  const Vec2 extent = uv == UvMode::Metres ? Vec2(2.0f * kPi * radius, kPi * radius) : Vec2(1.0f);
  ShapeBuilder builder;
  std::map<std::tuple<std::uint32_t, float>, std::uint32_t> shared;
  for (const Triangle& triangle : triangles) {
    std::array<float, 3> u{};
    const Vec3 centre = points[triangle[0]] + points[triangle[1]] + points[triangle[2]];
    const auto longitude = [](const Vec3& p) {
      const float turns = std::atan2(-p.z, p.x) / (2.0f * kPi);
      return turns < 0.0f ? turns + 1.0f : turns;
    };
    const float mean = longitude(centre);
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3& p = points[triangle[k]];
      const bool pole = p.x * p.x + p.z * p.z < 1e-10f;
      u[k] = pole ? mean : longitude(p);
      if (u[k] < mean - 0.5f) u[k] += 1.0f;
      if (u[k] > mean + 0.5f) u[k] -= 1.0f;
    }
    std::array<std::uint32_t, 3> corner{};
    for (std::size_t k = 0; k < 3; ++k) {
      const auto [entry, isNew] = shared.try_emplace({triangle[k], u[k]}, 0u);
      if (isNew) {
        const Vec3& n = points[triangle[k]];
        const float v = std::acos(std::clamp(n.y, -1.0f, 1.0f)) / kPi;
        entry->second = builder.vertex(radius * n, n, Vec2(u[k], v) * extent);
      }
      corner[k] = entry->second;
    }
    builder.triangle(corner[0], corner[1], corner[2]);
  }
  return builder.take();
}

Mesh makeTorus(float radius, float tube, int around, int aroundTube, UvMode uv) {
  ShapeBuilder builder;
  const Vec2 extent =
      uv == UvMode::Metres ? Vec2(2.0f * kPi * radius, 2.0f * kPi * tube) : Vec2(1.0f);
  builder.grid(around, aroundTube, false, [&](int i, int j) {
    const Vec2 c = onCircle(i, around);
    const Vec2 d = onCircle(j, aroundTube);
    const Vec3 outward(c.x, 0.0f, -c.y);
    const Vec3 normal = d.x * outward + Vec3(0.0f, d.y, 0.0f);
    return ShapeVertex{radius * outward + tube * normal, normal,
                       Vec2(fraction(i, around), 1.0f - fraction(j, aroundTube)) * extent};
  });
  return builder.take();
}

namespace {

/// A flat ring facing +y or -y; the texture lies on it as on a plane.
void addRing(ShapeBuilder& builder, float y, float outer, float inner, int around, int rings,
             bool up, UvMode uv) {
  builder.grid(around, rings, !up, [&](int i, int j) {
    const Vec2 c = onCircle(i, around);
    const float r = outer + (inner - outer) * fraction(j, rings);
    const Vec3 p = j == rings && inner == 0.0f ? Vec3(0.0f, y, 0.0f) : Vec3(r * c.x, y, -r * c.y);
    const Vec2 flat(p.x, up ? p.z : -p.z);  // the picture's top is at -z, from below at +z
    return ShapeVertex{p, Vec3(0.0f, up ? 1.0f : -1.0f, 0.0f),
                       uv == UvMode::Metres ? flat : 0.5f + 0.5f * flat / outer};
  });
}

}  // namespace

Mesh makeDisk(float radius, float inner, int around, int rings, UvMode uv) {
  ShapeBuilder builder;
  addRing(builder, 0.0f, radius, inner, around, rings, true, uv);
  return builder.take();
}

Mesh makeCylinder(float radius, float topRadius, float height, int around, int up, bool caps,
                  UvMode uv) {
  ShapeBuilder builder;
  const float slant = std::hypot(height, radius - topRadius);
  const Vec2 extent =
      uv == UvMode::Metres ? Vec2(2.0f * kPi * std::max(radius, topRadius), slant) : Vec2(1.0f);
  builder.grid(around, up, false, [&](int i, int j) {
    const Vec2 c = onCircle(i, around);
    const float t = fraction(j, up);
    const float r = radius + (topRadius - radius) * t;
    const bool pole = r == 0.0f;
    const Vec2 side = pole ? Vec2(std::cos(2.0f * kPi * (static_cast<float>(i) + 0.5f) /
                                           static_cast<float>(around)),
                                  std::sin(2.0f * kPi * (static_cast<float>(i) + 0.5f) /
                                           static_cast<float>(around)))
                           : c;
    const Vec3 normal = glm::normalize(Vec3(height * side.x, radius - topRadius, -height * side.y));
    const float u = (static_cast<float>(i) + (pole ? 0.5f : 0.0f)) / static_cast<float>(around);
    return ShapeVertex{Vec3(r * c.x, height * t, -r * c.y), normal, Vec2(u, 1.0f - t) * extent};
  });
  if (caps) {
    if (radius > 0.0f) addRing(builder, 0.0f, radius, 0.0f, around, 1, false, uv);
    if (topRadius > 0.0f) addRing(builder, height, topRadius, 0.0f, around, 1, true, uv);
  }
  return builder.take();
}

}  // namespace catoptric::scene
