// Shapes against closed forms: watertight, Euler number, outward winding, exact normals, area and
// volume.
#include "scene/shapes/shapes.h"

#include <gtest/gtest.h>

#include <map>

namespace catoptric::scene {
namespace {

/// Topology and measures of a mesh whose vertices in one place count as one.
struct Measure {
  std::size_t vertices = 0, edges = 0, faces = 0;
  std::size_t openEdges = 0;  ///< without exactly one edge of the other direction
  double area = 0.0, volume = 0.0;
  int euler() const {
    return static_cast<int>(vertices) - static_cast<int>(edges) + static_cast<int>(faces);
  }
};

Measure measure(const Mesh& mesh, bool shared = false) {
  std::map<std::array<long, 3>, int> places;
  std::vector<int> welded;
  for (const Vec3& p : mesh.positions) {
    const std::array<long, 3> key{std::lround(p.x * 2e5), std::lround(p.y * 2e5),
                                  std::lround(p.z * 2e5)};
    const int index = static_cast<int>(shared ? welded.size() : places.size());
    welded.push_back(shared ? index : places.try_emplace(key, index).first->second);
  }
  std::map<std::pair<int, int>, int> edges;
  Measure m;
  std::map<int, int> used;
  for (std::size_t t = 0; t + 2 < mesh.indices.size(); t += 3) {
    const std::array<int, 3> v{welded[mesh.indices[t]], welded[mesh.indices[t + 1]],
                               welded[mesh.indices[t + 2]]};
    const glm::dvec3 a(mesh.positions[mesh.indices[t]]);
    const glm::dvec3 b(mesh.positions[mesh.indices[t + 1]]);
    const glm::dvec3 c(mesh.positions[mesh.indices[t + 2]]);
    m.area += 0.5 * glm::length(glm::cross(b - a, c - a));
    m.volume += glm::dot(a, glm::cross(b, c)) / 6.0;
    if (v[0] == v[1] || v[1] == v[2] || v[2] == v[0]) continue;
    ++m.faces;
    for (std::size_t k = 0; k < 3; ++k) {
      ++edges[{v[k], v[(k + 1) % 3]}];
      ++used[v[k]];
    }
  }
  m.vertices = used.size();
  for (const auto& [edge, count] : edges) {
    const auto back = edges.find({edge.second, edge.first});
    if (count != 1 || back == edges.end() || back->second != 1) ++m.openEdges;
    if (edge.first < edge.second || back == edges.end()) ++m.edges;
  }
  return m;
}

/// Normals of unit length on the side that the winding says; at least `least` is the cosine
/// between a face and its vertices' normals.
void expectConsistent(const Mesh& mesh, float least) {
  ASSERT_EQ(mesh.positions.size(), mesh.normals.size());
  ASSERT_EQ(mesh.positions.size(), mesh.uv[0].size());
  ASSERT_FALSE(mesh.indices.empty());
  for (const Vec3& n : mesh.normals) ASSERT_NEAR(glm::length(n), 1.0f, 1e-4f);
  float worst = 1.0f;
  for (std::size_t t = 0; t < mesh.indices.size(); t += 3) {
    const Vec3& a = mesh.positions[mesh.indices[t]];
    const Vec3 face = glm::cross(mesh.positions[mesh.indices[t + 1]] - a,
                                 mesh.positions[mesh.indices[t + 2]] - a);
    if (glm::length(face) < 1e-9f) continue;
    for (std::size_t k = 0; k < 3; ++k) {
      worst = std::min(worst, glm::dot(glm::normalize(face), mesh.normals[mesh.indices[t + k]]));
    }
  }
  EXPECT_GT(worst, least);
}

TEST(Shapes, SphereIsClosedAndConverges) {
  const double area = 4.0 * std::numbers::pi * 0.49;
  const double volume = 4.0 / 3.0 * std::numbers::pi * 0.343;
  double lastError = 1.0;
  for (const int n : {16, 32, 64}) {
    const Mesh mesh = makeSphere(0.7f, 2 * n, n, UvMode::Unit);
    const Measure m = measure(mesh);
    EXPECT_EQ(m.openEdges, 0u);
    EXPECT_EQ(m.euler(), 2);
    const double error = std::abs(m.volume / volume - 1.0) + std::abs(m.area / area - 1.0);
    EXPECT_LT(error, lastError / 3.5);  // second order
    lastError = error;
    expectConsistent(mesh, 0.9f);
    for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
      ASSERT_NEAR(glm::dot(mesh.positions[v], mesh.normals[v]), 0.7f, 1e-5f);
    }
  }
  for (const int level : {0, 3}) {
    const Measure m = measure(makeIcosphere(0.7f, level, UvMode::Unit));
    EXPECT_EQ(m.openEdges, 0u);
    EXPECT_EQ(m.euler(), 2);
    EXPECT_EQ(m.faces, 20u << (2 * level));
    EXPECT_GT(m.volume, 0.0);
  }
}

TEST(Shapes, TorusHasEulerNumberZeroAndPappusVolume) {
  const Mesh mesh = makeTorus(0.5f, 0.2f, 192, 96, UvMode::Unit);
  const Measure m = measure(mesh);
  EXPECT_EQ(m.openEdges, 0u);
  EXPECT_EQ(m.euler(), 0);
  const double pi = std::numbers::pi;
  EXPECT_NEAR(m.volume, 2.0 * pi * pi * 0.5 * 0.04, 1e-3 * m.volume * 2.0);
  EXPECT_NEAR(m.area, 4.0 * pi * pi * 0.5 * 0.2, 2e-3 * m.area);
  expectConsistent(mesh, 0.98f);
}

TEST(Shapes, BoxesAndPanelsAreClosed) {
  BoxShape box{{1.0f, 2.0f, 3.0f}, {2, 3, 4}};
  const Measure b = measure(makeBox(box, UvMode::Unit));
  EXPECT_EQ(b.openEdges, 0u);
  EXPECT_EQ(b.euler(), 2);
  EXPECT_NEAR(b.volume, 6.0, 1e-5);
  EXPECT_NEAR(b.area, 22.0, 1e-5);
  box.inward = true;
  EXPECT_NEAR(measure(makeBox(box, UvMode::Unit)).volume, -6.0, 1e-5);
  expectConsistent(makeBox(box, UvMode::Metres), 0.999f);

  const Mesh rounded = makeRoundedBox({1.0f, 0.6f, 0.8f}, 0.1f, 12, UvMode::Unit);
  const Measure r = measure(rounded);
  EXPECT_EQ(r.openEdges, 0u);
  EXPECT_EQ(r.euler(), 2);
  // Steiner's formula: inner box, slabs, quarter cylinders, a sphere.
  const double x = 0.8, y = 0.4, z = 0.6, q = 0.1, pi = std::numbers::pi;
  EXPECT_NEAR(r.volume,
              x * y * z + 2 * q * (x * y + y * z + z * x) + pi * q * q * (x + y + z) +
                  4.0 / 3.0 * pi * q * q * q,
              2e-4);
  expectConsistent(rounded, 0.98f);

  PanelShape panel{
      {3.0f, 2.0f}, 0.2f, {{-1.0f, 0.5f, 0.8f, 1.0f}, {0.4f, 0.0f, 0.7f, 1.6f}}, 0.25f};
  const Mesh wall = makePanel(panel, UvMode::Metres);
  const Measure w = measure(wall);
  EXPECT_NEAR(w.volume, 0.2 * (6.0 - 0.8 - 1.12), 1e-5);
  expectConsistent(wall, 0.999f);
  panel.thickness = 0.0f;
  EXPECT_NEAR(measure(makePanel(panel, UvMode::Metres)).area, 6.0 - 0.8 - 1.12, 1e-5);
}

TEST(Shapes, CylindersConesDisks) {
  const double pi = std::numbers::pi;
  const Mesh cylinder = makeCylinder(0.5f, 0.5f, 2.0f, 256, 3, true, UvMode::Unit);
  const Measure c = measure(cylinder);
  EXPECT_EQ(c.openEdges, 0u);
  EXPECT_EQ(c.euler(), 2);
  EXPECT_NEAR(c.volume, pi * 0.5, 1e-3);
  expectConsistent(cylinder, 0.99f);
  const Mesh cone = makeCylinder(0.5f, 0.0f, 2.0f, 256, 3, true, UvMode::Unit);
  const Measure k = measure(cone);
  EXPECT_EQ(k.openEdges, 0u);
  EXPECT_NEAR(k.volume, pi * 0.5 / 3.0, 1e-3);
  expectConsistent(cone, 0.99f);
  const Mesh ring = makeDisk(0.5f, 0.2f, 256, 2, UvMode::Unit);
  EXPECT_NEAR(measure(ring).area, pi * (0.25 - 0.04), 1e-3);
  expectConsistent(ring, 0.999f);
  for (const Vec3& n : ring.normals) EXPECT_EQ(n, Vec3(0, 1, 0));
  for (const Vec3& n : makePlane({1, 1}, {2, 2}, UvMode::Unit).normals) EXPECT_EQ(n, Vec3(0, 1, 0));
  expectConsistent(makePlane({2, 1}, {3, 2}, UvMode::Unit), 0.999f);
}

TEST(Shapes, RevolutionsAgreeWithPappus) {
  // r(y) = 1 + y^2 over 0..1: volume pi (1 + 2/3 + 1/5).
  RevolutionShape polynomial;
  polynomial.curve = ProfileCurve::Polynomial;
  polynomial.coefficients = {1.0f, 0.0f, 1.0f};
  polynomial.around = 256;
  polynomial.along = 128;
  const Mesh mesh = makeRevolution(polynomial, UvMode::Unit);
  const Measure p = measure(mesh);
  EXPECT_EQ(p.openEdges, 0u);
  EXPECT_EQ(p.euler(), 2);
  EXPECT_NEAR(p.volume, std::numbers::pi * (1.0 + 2.0 / 3.0 + 0.2), 2e-3 * p.volume);
  expectConsistent(mesh, 0.98f);

  RevolutionShape vessel;
  vessel.profile = {{0.0f, 0.0f}, {0.3f, 0.02f}, {0.4f, 0.3f}, {0.25f, 0.6f}, {0.3f, 0.8f}};
  vessel.thickness = 0.02f;
  const Mesh vase = makeRevolution(vessel, UvMode::Metres);
  const Measure v = measure(vase);
  EXPECT_EQ(v.openEdges, 0u);
  EXPECT_EQ(v.euler(), 2);
  EXPECT_GT(v.volume, 0.0);
  EXPECT_NEAR(v.volume, 0.5 * v.area * 0.02, 0.1 * v.volume);  // a thin shell
}

TEST(Shapes, TubesAndPrisms) {
  TubeShape tube;
  tube.points = {{0, 0, 0}, {0, 1, 0}};
  tube.radii = {0.1f};
  tube.around = 128;
  const Measure straight = measure(makeTube(tube, UvMode::Unit));
  EXPECT_EQ(straight.openEdges, 0u);
  EXPECT_EQ(straight.euler(), 2);
  EXPECT_NEAR(straight.volume, std::numbers::pi * 0.01 * (1.0 + 4.0 / 3.0 * 0.1),
              0.02 * straight.volume);

  TubeShape ring;
  ring.points = {{1, 0, 0}, {0, 0.3f, -1}, {-1, 0, 0}, {0, -0.2f, 1}};
  ring.radii = {0.1f};
  ring.closed = true;
  const Mesh ringMesh = makeTube(ring, UvMode::Unit);
  const Measure r = measure(ringMesh);
  EXPECT_EQ(r.openEdges, 0u);
  EXPECT_EQ(r.euler(), 0);
  EXPECT_GT(r.volume, 0.0);
  expectConsistent(ringMesh, 0.9f);

  // An L, either way round.
  std::vector<Vec2> outline{{0, 0}, {2, 0}, {2, 1}, {1, 1}, {1, 3}, {0, 3}};
  for (int turn = 0; turn < 2; ++turn) {
    const Mesh prism = makePrism(outline, 0.5f, 0.0f, UvMode::Unit);
    const Measure m = measure(prism);
    EXPECT_EQ(m.openEdges, 0u);
    EXPECT_EQ(m.euler(), 2);
    EXPECT_NEAR(m.volume, 0.5 * 4.0, 1e-5);
    expectConsistent(prism, 0.999f);
    std::reverse(outline.begin(), outline.end());
  }
}

TEST(Shapes, TeapotStandsUprightWithOutwardNormals) {
  const Mesh teapot = makeTeapot(0.5f, 8, true, UvMode::Unit);
  EXPECT_EQ(teapot.positions.size(), 32u * 81u);
  Box3 bounds;
  for (const Vec3& p : teapot.positions) bounds.extend(p);
  EXPECT_NEAR(bounds.min.y, 0.0f, 1e-6f);
  EXPECT_NEAR(bounds.max.y, 0.5f, 1e-6f);
  EXPECT_NEAR(bounds.min.z, -bounds.max.z, 1e-6f);
  EXPECT_GT(bounds.max.x, -bounds.min.x);  // the spout reaches further than the handle
  expectConsistent(teapot, 0.1f);
  // The body's and the lid's normals point away from the axis or up, and the poles are vertical.
  int checked = 0;
  for (std::size_t v = 0; v < teapot.positions.size(); ++v) {
    const Vec3& p = teapot.positions[v];
    const Vec3& n = teapot.normals[v];
    const float r = std::hypot(p.x, p.z);
    if (r < 1e-6f && p.y > 0.45f) {
      EXPECT_NEAR(n.y, 1.0f, 1e-4f);
      ++checked;
    }
    if (r < 1e-6f && p.y < 0.01f) {
      EXPECT_NEAR(n.y, -1.0f, 1e-4f);
      ++checked;
    }
    if (p.y > 0.15f && p.y < 0.25f && std::abs(p.z) > 0.2f) {
      EXPECT_GT(n.x * p.x + n.z * p.z, 0.0f);
      ++checked;
    }
  }
  EXPECT_GT(checked, 100);
}

/// Largest distance of vertices from the surface, by g / |gradient|, against its size; and normals
/// against the gradient by its own differences.
void expectOnSurface(const Mesh& mesh, const implicit::Surface& surface, double tolerance) {
  const double size = surface.domain.diameter();
  double worst = 0.0;
  for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
    const implicit::Point p(mesh.positions[v]);
    implicit::Point difference;
    for (int a = 0; a < 3; ++a) {
      implicit::Point h(0.0);
      h[a] = 1e-6 * size;
      difference[a] =
          (implicit::valueAt(surface, p + h) - implicit::valueAt(surface, p - h)) / (2.0 * h[a]);
    }
    if (glm::length(difference) < 0.02) continue;  // near an apex
    worst = std::max(worst, std::abs(implicit::valueAt(surface, p)) / glm::length(difference));
    ASSERT_GT(glm::dot(glm::normalize(difference), glm::dvec3(mesh.normals[v])), 1.0 - 1e-5);
  }
  EXPECT_LT(worst, tolerance * size);
}

TEST(Shapes, ImplicitSurfacesAreManifoldWithTheRightGenus) {
  struct Case {
    implicit::Surface surface;
    int euler;
    double volume;  ///< 0: not known in closed form
  };
  const double pi = std::numbers::pi;
  const std::vector<Case> cases{
      {implicit::sphereSurface(0.5), 2, 4.0 / 3.0 * pi * 0.125},
      {implicit::ellipsoidSurface({0.5, 0.3, 0.2}), 2, 4.0 / 3.0 * pi * 0.03},
      {implicit::torusSurface(0.5, 0.2), 0, 2.0 * pi * pi * 0.5 * 0.04},
      {implicit::metaballsSurface({{-0.3, 0, 0, 0.3}, {0.3, 0, 0, 0.3}}, 2.0), 2, 0.0},
      {implicit::superquadricSurface({0.5, 0.5, 0.5}, 0.5, 0.5), 2, 0.0},
      {heartSurface(), 2, 0.0},
      {genus2Surface(), -2, 0.0},
      {blobbyCubeSurface(), 2, 0.0},
  };
  for (std::size_t c = 0; c < cases.size(); ++c) {
    SCOPED_TRACE(c);
    const Mesh mesh = makeImplicit(cases[c].surface, 40, UvMode::Unit);
    const Measure m = measure(mesh, true);  // its vertices are shared
    EXPECT_EQ(m.openEdges, 0u);
    EXPECT_EQ(m.euler(), cases[c].euler);
    EXPECT_GT(m.volume, 0.0);
    if (cases[c].volume > 0.0) {
      EXPECT_NEAR(m.volume, cases[c].volume, 0.01 * m.volume);
    }
    expectOnSurface(mesh, cases[c].surface, 1e-6);
    ASSERT_NE(mesh.surface, nullptr);
  }
}

TEST(Shapes, OpenImplicitSurfacesEndInCleanRims) {
  // The vase: every open edge lies on one of the two planes that cut it off, on its circle there.
  const implicit::Surface vase = implicit::vaseSurface();
  const Mesh mesh = makeImplicit(vase, 40, UvMode::Unit);
  expectOnSurface(mesh, vase, 1e-6);
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
  for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = mesh.indices[i + k];
      const std::uint32_t b = mesh.indices[i + (k + 1) % 3];
      ++edges[std::minmax(a, b)];
    }
  }
  int rim = 0;
  double length = 0.0;
  for (const auto& [edge, count] : edges) {
    if (count == 2) continue;
    EXPECT_EQ(count, 1);
    ++rim;
    for (const std::uint32_t v : {edge.first, edge.second}) {
      const Vec3& p = mesh.positions[v];
      EXPECT_TRUE(p.y == 0.0f || p.y == 2.0f) << p.y;
    }
    length += glm::length(mesh.positions[edge.first] - mesh.positions[edge.second]);
  }
  EXPECT_GT(rim, 50);
  const double circles = 2.0 * std::numbers::pi * (0.47 + 0.39);
  EXPECT_NEAR(length, circles, 0.005 * circles);
}

TEST(Shapes, RegularTessellationsLieOnTheirSurface) {
  const implicit::Surface cone = implicit::coneSurface(0.5, 1.0);
  const ImplicitProfile profile{[](double s) { return glm::dvec2(0.5 * (1.0 - s), s - 1.0); }};
  const Mesh mesh = makeTurnedImplicit(cone, profile, {24, 8}, UvMode::Unit);
  expectOnSurface(mesh, cone, 1e-6);
  // At the apex each triangle has its own slope, not a made-up direction.
  int apex = 0;
  for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
    if (mesh.positions[v] != Vec3(0.0f)) continue;
    ++apex;
    EXPECT_NEAR(glm::length(mesh.normals[v]), 1.0f, 1e-5f);
    // The last of them closes the circle and belongs to no triangle.
    if (apex <= 24) {
      EXPECT_NEAR(mesh.normals[v].y, 1.0f / std::sqrt(5.0f), 0.01f);
    }
  }
  EXPECT_EQ(apex, 25);
  expectConsistent(mesh, 0.9f);
}

TEST(Shapes, MorphNormalsAreThoseOfTheDeformedShape) {
  Mesh mesh = makeSphere(0.5f, 96, 48, UvMode::Unit);
  for (const MorphType type :
       {MorphType::Bulge, MorphType::Twist, MorphType::Stretch, MorphType::Wave}) {
    mesh.morphTargets.clear();
    const int targets = addMorphTargets(mesh, {type, 0.1f, 2.0f, {0, 1, 0}});
    ASSERT_EQ(mesh.morphTargets.size(), static_cast<std::size_t>(targets));
    Mesh deformed = mesh;
    for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
      deformed.positions[v] += mesh.morphTargets[0].positions[v];
      deformed.normals[v] = glm::normalize(mesh.normals[v] + mesh.morphTargets[0].normals[v]);
    }
    expectConsistent(deformed, 0.9f);
  }
}

}  // namespace
}  // namespace catoptric::scene
