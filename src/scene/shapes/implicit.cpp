// Triangle meshes of implicit surfaces, whose vertices lie on them, and surfaces that are formulas.
#include <algorithm>
#include <array>
#include <cmath>
#include <unordered_map>

#include "core/error.h"
#include "core/parallel.h"
#include "scene/implicit/gradient.h"
#include "scene/shapes/builder.h"
#include "scene/shapes/shapes.h"

namespace catoptric::scene {
namespace {

using implicit::Domain;
using implicit::Point;
using implicit::Surface;

/// Where grid planes inside the domain lie, in cells: off the planes of symmetry of the surface.
const Point kGridShift(0.0137, 0.0071, 0.0193);

/// Grid points over a box; the first and the last plane of each axis are the box's own faces.
struct Grid {
  Domain box;
  glm::ivec3 cells;
  Point cell;

  Grid(const Domain& domain, int resolution) : box(domain) {
    const Point size = box.max - box.min;
    const double longest = std::max({size.x, size.y, size.z});
    for (int a = 0; a < 3; ++a) {
      cells[a] = std::max(1, static_cast<int>(std::ceil(resolution * size[a] / longest - 1e-9)));
      cell[a] = size[a] / cells[a];
    }
  }
  Point at(const glm::ivec3& p) const {
    Point result;
    for (int a = 0; a < 3; ++a) {
      result[a] = p[a] == 0          ? box.min[a]
                  : p[a] == cells[a] ? box.max[a]
                                     : box.min[a] + cell[a] * (p[a] + kGridShift[a]);
    }
    return result;
  }
  std::size_t number(const glm::ivec3& p) const {
    return (static_cast<std::size_t>(p.z) * static_cast<std::size_t>(cells.y + 1) +
            static_cast<std::size_t>(p.y)) *
               static_cast<std::size_t>(cells.x + 1) +
           static_cast<std::size_t>(p.x);
  }
  std::size_t count() const { return number(cells) + 1; }
};

enum class Side : std::int8_t { Undefined, Inside, Outside };

/// Where g is, at all grid points; what is found for the messages.
struct Sides {
  std::vector<Side> of;
  std::size_t inside = 0;
  std::size_t outside = 0;
  std::size_t zero = 0;
};

Sides sidesOf(const Surface& surface, const Grid& grid) {
  Sides sides;
  sides.of.resize(grid.count());
  std::vector<std::array<std::size_t, 3>> counts(static_cast<std::size_t>(grid.cells.z) + 1);
  parallelFor(counts.size(), 1, [&](std::size_t begin, std::size_t end) {
    implicit::Evaluator<double> evaluate(surface.tape);
    for (auto z = static_cast<int>(begin); z < static_cast<int>(end); ++z) {
      std::array<std::size_t, 3>& count = counts[static_cast<std::size_t>(z)];
      for (int y = 0; y <= grid.cells.y; ++y) {
        for (int x = 0; x <= grid.cells.x; ++x) {
          const Point p = grid.at({x, y, z});
          const double value = evaluate(p.x, p.y, p.z);
          Side side = Side::Undefined;
          if (value < 0.0) side = Side::Inside;
          if (value >= 0.0) side = Side::Outside;
          sides.of[grid.number({x, y, z})] = side;
          count[0] += side == Side::Inside ? 1 : 0;
          count[1] += value > 0.0 ? 1 : 0;
          count[2] += value == 0.0 ? 1 : 0;
        }
      }
    }
  });
  for (const std::array<std::size_t, 3>& count : counts) {
    sides.inside += count[0];
    sides.outside += count[1];
    sides.zero += count[2];
  }
  return sides;
}

/// The zero of g between a point inside and one outside; nullopt for a pole or a jump.
std::optional<Point> crossingOf(implicit::Evaluator<double>& evaluate, const Point& inside,
                                const Point& outside) {
  const auto at = [&](double t) { return inside + t * (outside - inside); };
  const auto value = [&](double t) {
    const Point p = at(t);
    return evaluate(p.x, p.y, p.z);
  };
  double a = 0.0;
  double b = 1.0;
  double ga = value(a);
  double gb = value(b);
  const double before = std::max(std::abs(ga), std::abs(gb));
  constexpr int kSteps = 150;
  constexpr double kDone = 1e-15;
  for (int step = 0; step < kSteps && gb != 0.0 && b - a > kDone; ++step) {
    // Two secants, then a halving: fast, and never stuck.
    double t = a - ga * (b - a) / (gb - ga);
    if (step % 3 == 2 || !(t > a && t < b)) t = 0.5 * (a + b);
    if (!(t > a && t < b)) break;
    const double g = value(t);
    if (!std::isfinite(g)) return std::nullopt;
    (g < 0.0 ? a : b) = t;
    (g < 0.0 ? ga : gb) = g;
  }
  // At a pole the values grow, at a jump they stay.
  if (!(std::min(std::abs(ga), std::abs(gb)) <= 0.5 * before)) return std::nullopt;
  return at(std::abs(ga) < std::abs(gb) ? a : b);
}

std::array<int, 3> parts(int corner) {
  return {corner & 1, (corner >> 1) & 1, corner >> 2};
}

/// Normals: the gradient's; where it has none (a cone's apex) the mean of the triangles around.
/// Throws SceneError where most of the surface has none.
void setNormals(Mesh& mesh, const std::vector<Point>& exact, const Surface& surface) {
  std::vector<std::uint8_t> smooth(mesh.positions.size(), 0);
  parallelFor(exact.size(), 256, [&](std::size_t begin, std::size_t end) {
    for (std::size_t v = begin; v < end; ++v) {
      const std::optional<Point> normal = implicit::normalAt(surface, exact[v]);
      smooth[v] = normal ? 1 : 0;
      mesh.normals[v] = normal ? Vec3(*normal) : Vec3(0.0f);
    }
  });
  const auto without = std::ranges::count(smooth, 0);
  if (2 * without > std::ssize(smooth)) {
    throw SceneError("the formula's gradient is 0 at " + std::to_string(without) + " of " +
                     std::to_string(smooth.size()) +
                     " points of the surface, which has no normal there: do not raise the whole "
                     "formula to a power or multiply it by a tiny factor");
  }
  for (std::size_t i = 0; i + 2 < mesh.indices.size(); i += 3) {
    const std::uint32_t* t = &mesh.indices[i];
    if (smooth[t[0]] && smooth[t[1]] && smooth[t[2]]) continue;
    const Vec3 side = glm::cross(mesh.positions[t[1]] - mesh.positions[t[0]],
                                 mesh.positions[t[2]] - mesh.positions[t[0]]);
    for (int k = 0; k < 3; ++k) {
      if (!smooth[t[k]]) mesh.normals[t[k]] += side;
    }
  }
  for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
    if (!smooth[v]) mesh.normals[v] = normalizedOr(mesh.normals[v], Vec3(0, 1, 0));
  }
}

std::string boxText(const Domain& d) {
  const auto point = [](const Point& p) {
    return "(" + std::to_string(p.x) + ", " + std::to_string(p.y) + ", " + std::to_string(p.z) +
           ")";
  };
  return point(d.min) + " to " + point(d.max);
}

[[noreturn]] void failEmpty(const Surface& surface, const Sides& sides, int resolution) {
  const std::string where = " within its bounds, " + boxText(surface.domain);
  if (sides.inside + sides.outside + sides.zero == 0) {
    throw SceneError("the formula is NaN everywhere" + where +
                     "; look for roots and logarithms of negative values, and divisions by 0");
  }
  if (sides.inside + sides.outside == 0) {
    throw SceneError("the formula is 0 everywhere" + where + ": no surface, but all of space");
  }
  const std::string sign = sides.inside == 0 ? "above" : "below";
  if (sides.inside > 0 && sides.outside > 0) {
    throw SceneError("the formula changes its sign only at jumps or poles" + where +
                     ": it has no zero");
  }
  throw SceneError("the formula is " + sign + " 0 at all points of a grid of " +
                   std::to_string(resolution) + " cells" + where +
                   "; the surface is where the formula is 0: change the bounds, or raise "
                   "\"resolution\" if the surface is thinner than a cell");
}

/// Cuts a grid's cells along the surface. One vertex per crossed grid edge: a manifold by
/// construction, whose rims lie on the domain's faces.
class GridCut {
 public:
  GridCut(const Grid& grid, const Sides& sides) : grid_(grid), sides_(sides) {
    // Six tetrahedra around each cell's diagonal [Kuhn]; neighbouring cells agree on their faces.
    constexpr std::array<std::array<int, 4>, 6> kTetrahedra{
        {{0, 1, 3, 7}, {0, 3, 2, 7}, {0, 2, 6, 7}, {0, 6, 4, 7}, {0, 4, 5, 7}, {0, 5, 1, 7}}};
    for (int z = 0; z < grid_.cells.z; ++z) {
      for (int y = 0; y < grid_.cells.y; ++y) {
        for (int x = 0; x < grid_.cells.x; ++x) {
          for (const std::array<int, 4>& tetrahedron : kTetrahedra) cut({x, y, z}, tetrahedron);
        }
      }
    }
  }

  struct Edge {
    glm::ivec3 inside, outside;
  };
  std::vector<Edge> edges;                              ///< of the vertices
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< vertices, seen from outside

 private:
  /// The vertex between two corners.
  std::uint32_t crossing(const glm::ivec3& inside, const glm::ivec3& outside) {
    const std::uint64_t ia = grid_.number(inside);
    const std::uint64_t ib = grid_.number(outside);
    const std::uint64_t key = (std::min(ia, ib) << 32) | std::max(ia, ib);
    const auto [entry, isNew] = numbers_.try_emplace(key, static_cast<std::uint32_t>(edges.size()));
    if (isNew) edges.push_back({inside, outside});
    return entry->second;
  }

  void cut(const glm::ivec3& base, const std::array<int, 4>& tetrahedron) {
    std::array<glm::ivec3, 4> in{};
    std::array<glm::ivec3, 4> out{};
    std::size_t ins = 0;
    std::size_t outs = 0;
    for (const int c : tetrahedron) {
      const auto [dx, dy, dz] = parts(c);
      const glm::ivec3 p = base + glm::ivec3(dx, dy, dz);
      const Side side = sides_.of[grid_.number(p)];
      if (side == Side::Undefined) return;
      (side == Side::Inside ? in[ins++] : out[outs++]) = p;
    }
    if (ins == 0 || outs == 0) return;
    // Pairs of corners (inside, outside) in order around the cut.
    std::array<std::array<std::size_t, 2>, 4> pairs{};
    std::size_t corners = 3;
    if (ins == 1) {
      pairs = {{{0, 0}, {0, 1}, {0, 2}}};
    } else if (ins == 3) {
      pairs = {{{0, 0}, {1, 0}, {2, 0}}};
    } else {
      pairs = {{{0, 0}, {0, 1}, {1, 1}, {1, 0}}};
      corners = 4;
    }
    // The outer side is where the outside corners are. Edge midpoints stand for the crossings: same
    // orientation, never degenerate.
    Vec3 outwards(0.0f);
    for (std::size_t k = 0; k < outs; ++k) outwards += Vec3(out[k]) / static_cast<float>(outs);
    for (std::size_t k = 0; k < ins; ++k) outwards -= Vec3(in[k]) / static_cast<float>(ins);
    const auto middle = [&](std::size_t k) {
      return 0.5f * (Vec3(in[pairs[k][0]]) + Vec3(out[pairs[k][1]]));
    };
    const Vec3 side = glm::cross(middle(1) - middle(0), middle(2) - middle(0));
    if (glm::dot(side, outwards) < 0.0f) std::reverse(pairs.begin(), pairs.begin() + corners);
    std::array<std::uint32_t, 4> v{};
    for (std::size_t k = 0; k < corners; ++k) v[k] = crossing(in[pairs[k][0]], out[pairs[k][1]]);
    triangles.push_back({v[0], v[1], v[2]});
    if (corners == 4) triangles.push_back({v[0], v[2], v[3]});
  }

  const Grid& grid_;
  const Sides& sides_;
  std::unordered_map<std::uint64_t, std::uint32_t> numbers_;
};

/// uv: projections along the largest axis of the normal.
void projectUv(Mesh& mesh, const std::vector<Point>& exact, const Domain& bounds, UvMode uv) {
  const Point extent = uv == UvMode::Metres ? Point(1.0) : bounds.max - bounds.min;
  for (std::size_t v = 0; v < exact.size(); ++v) {
    const Vec3 a = glm::abs(mesh.normals[v]);
    const Vec3 p((exact[v] - bounds.min) / extent);
    mesh.uv[0][v] = a.y >= a.x && a.y >= a.z ? Vec2(p.x, p.z)
                    : a.x >= a.z             ? Vec2(p.z, 1.0f - p.y)
                                             : Vec2(p.x, 1.0f - p.y);
  }
}

}  // namespace

Mesh makeImplicit(const Surface& surface, int resolution, UvMode uv) {
  const Domain bounds = implicit::boundsOf(surface);
  if (bounds.empty()) {
    failEmpty(surface, sidesOf(surface, Grid(surface.domain, resolution)), resolution);
  }
  const Grid grid(bounds, resolution);
  const Sides sides = sidesOf(surface, grid);
  const GridCut cut(grid, sides);
  const std::vector<GridCut::Edge>& edges = cut.edges;

  // Vertices where g is zero along their edges.
  std::vector<Point> exact(edges.size());
  std::vector<std::uint8_t> found(edges.size(), 0);
  parallelFor(edges.size(), 256, [&](std::size_t begin, std::size_t end) {
    implicit::Evaluator<double> evaluate(surface.tape);
    for (std::size_t e = begin; e < end; ++e) {
      const std::optional<Point> p =
          crossingOf(evaluate, grid.at(edges[e].inside), grid.at(edges[e].outside));
      found[e] = p ? 1 : 0;
      exact[e] = p.value_or(grid.at(edges[e].inside));
    }
  });
  ShapeBuilder builder;
  for (const Point& p : exact) builder.vertex(Vec3(p), Vec3(0.0f), Vec2(0.0f));
  for (const auto& [a, b, c] : cut.triangles) {
    if (found[a] && found[b] && found[c]) builder.triangle(a, b, c);
  }
  Mesh mesh = builder.take();
  if (mesh.indices.empty()) failEmpty(surface, sides, resolution);
  setNormals(mesh, exact, surface);

  projectUv(mesh, exact, bounds, uv);
  mesh.surface = std::make_shared<const Surface>(surface);
  return mesh;
}

Mesh makeTurnedImplicit(const Surface& surface, const ImplicitProfile& profile,
                        const glm::ivec2& segments, UvMode uv) {
  constexpr double kTurn = 2.0 * std::numbers::pi;
  std::vector<Point> exact;
  double length = 0.0;
  double radius = 0.0;
  glm::dvec2 last = profile.at(0.0);
  for (int j = 1; j <= segments.y; ++j) {
    const glm::dvec2 next = profile.at(static_cast<double>(j) / segments.y);
    length += glm::length(next - last);
    radius = std::max(radius, next.x);
    last = next;
  }
  const Vec2 extent = uv == UvMode::Metres ? Vec2(glm::dvec2(kTurn * radius, length)) : Vec2(1.0f);
  ShapeBuilder builder;
  builder.grid(segments.x, segments.y, false, [&](int i, int j) {
    const glm::dvec2 p = profile.at(static_cast<double>(j) / segments.y);
    // Whole turns end exactly where they begin.
    const double angle = kTurn * (i % segments.x) / segments.x;
    exact.push_back(Point(p.x * std::sin(angle), p.y, p.x * std::cos(angle)) * profile.scale);
    const bool pole = p.x == 0.0;
    const Vec2 st((static_cast<float>(i) + (pole ? 0.5f : 0.0f)) / static_cast<float>(segments.x),
                  1.0f - static_cast<float>(j) / static_cast<float>(segments.y));
    return ShapeVertex{Vec3(exact.back()), Vec3(0.0f), st * extent};
  });
  Mesh mesh = builder.take();
  setNormals(mesh, exact, surface);
  mesh.surface = std::make_shared<const Surface>(surface);
  return mesh;
}

Surface gyroidSurface(double period, double thickness, double radius) {
  // |gyroid| < t inside a ball, t in the gyroid's own units; a rounded maximum joins them.
  const double k = 2.0 * std::numbers::pi / period;
  return implicit::formulaSurface(
      "hypot(max((abs(sin(k*x)*cos(k*y) + sin(k*y)*cos(k*z) + sin(k*z)*cos(k*x)) - t)/k + q, 0),"
      "      max(hypot(x, y, z) - r + q, 0))"
      " + min(max((abs(sin(k*x)*cos(k*y) + sin(k*y)*cos(k*z) + sin(k*z)*cos(k*x)) - t)/k + q,"
      "           hypot(x, y, z) - r + q), 0) - q",
      {{"k", k}, {"t", 0.5 * thickness * k}, {"r", radius}, {"q", 0.05 * radius}},
      {Point(-1.01 * radius), Point(1.01 * radius)}, "gyroid");
}

Surface heartSurface() {
  // [Taubin1994], y up.
  return implicit::formulaSurface("(x^2 + 9/4*z^2 + y^2 - 1)^3 - x^2*y^3 - 9/80*z^2*y^3", {},
                                  {{-1.25, -1.35, -0.75}, {1.25, 1.35, 0.75}}, "heart");
}

Surface genus2Surface() {
  return implicit::formulaSurface(
      "2*y*(y^2 - 3*x^2)*(1 - z^2) + (x^2 + y^2)^2 - (9*z^2 - 1)*(1 - z^2)", {},
      {{-2.2, -2.4, -1.1}, {2.2, 2.4, 1.1}}, "genus2");
}

Surface blobbyCubeSurface() {
  return implicit::formulaSurface("x^4 + y^4 + z^4 - 0.6*(x^2 + y^2 + z^2) - 0.1", {},
                                  {Point(-1.05), Point(1.05)}, "blobby_cube");
}

}  // namespace catoptric::scene
