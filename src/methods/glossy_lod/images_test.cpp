// Geometry images have no gaps, whatever the mesh; the tree over them visits every quad.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "methods/glossy_lod/images/geometry_image.h"
#include "methods/glossy_lod/images/image_cache.h"
#include "methods/glossy_lod/tree/tree.h"
#include "scene/shapes/shapes.h"

namespace catoptric::methods::glossy_lod {
namespace {

using scene::UvMode;

MeshView viewOf(const scene::Mesh& mesh) {
  return {mesh.positions, mesh.indices, mesh.normals};
}

/// As many quads as a square of so many along its edge.
ImageSize sizeOf(int size) {
  return {static_cast<double>(size) * size, 0.0, size};
}

/// Triangles of all grids by their samples, without those that have no area by construction.
std::vector<std::array<std::uint32_t, 3>> trianglesOf(const ObjectImage& image) {
  std::vector<std::array<std::uint32_t, 3>> all;
  for (const ChartImage& chart : image.charts) {
    const std::uint32_t n = 1u << chart.level;
    for (std::uint32_t y = 0; y < n; ++y) {
      for (std::uint32_t x = 0; x < n; ++x) {
        const std::uint32_t* v = &image.grid[chart.firstGrid + y * (n + 1) + x];
        for (const auto& t : {std::array{v[0], v[1], v[n + 1]}, {v[n + 2], v[n + 1], v[1]}}) {
          if (t[0] != t[1] && t[1] != t[2] && t[2] != t[0]) all.push_back(t);
        }
      }
    }
  }
  return all;
}

/// Edges by how often triangles pass them one way less the other way: 0 where two neighbours meet.
std::size_t openEdges(const ObjectImage& image) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> passed;
  for (const auto& t : trianglesOf(image)) {
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint32_t a = t[i];
      const std::uint32_t b = t[(i + 1) % 3];
      passed[{std::min(a, b), std::max(a, b)}] += a < b ? 1 : -1;
    }
  }
  return static_cast<std::size_t>(
      std::count_if(passed.begin(), passed.end(), [](const auto& e) { return e.second != 0; }));
}

Vec3 placeOf(const scene::Mesh& mesh, const Sample& s) {
  const Vec3 p0 = mesh.positions[s.vertex[0]];
  return p0 + s.w1 * (mesh.positions[s.vertex[1]] - p0) + s.w2 * (mesh.positions[s.vertex[2]] - p0);
}

double areaOf(const scene::Mesh& mesh, const ObjectImage& image) {
  double area = 0.0;
  for (const auto& t : trianglesOf(image)) {
    const Vec3 a = placeOf(mesh, image.samples[t[0]]);
    area +=
        0.5 * static_cast<double>(glm::length(glm::cross(placeOf(mesh, image.samples[t[1]]) - a,
                                                         placeOf(mesh, image.samples[t[2]]) - a)));
  }
  return area;
}

/// Closed bodies of genus 0 and 1, round and with creases.
std::vector<scene::Mesh> closedBodies() {
  scene::BoxShape box;
  box.size = Vec3(1.0f, 2.0f, 0.5f);
  box.segments = {4, 8, 2};  // whose faces have the very same corners
  return {scene::makeIcosphere(1.0f, 4, UvMode::Unit),
          scene::makeSphere(1.0f, 37, 19, UvMode::Unit),
          scene::makeTorus(1.0f, 0.3f, 48, 24, UvMode::Unit), scene::makeBox(box, UvMode::Unit),
          scene::makeRoundedBox(Vec3(1.0f), 0.1f, 3, UvMode::Unit)};
}

TEST(GeometryImages, OfClosedBodiesAreClosed) {
  const std::vector<scene::Mesh> bodies = closedBodies();
  for (const int size : {1, 4, 32, 128}) {
    for (const scene::Mesh& mesh : bodies) {
      const ObjectImage image = makeObjectImage(viewOf(mesh), sizeOf(size));
      EXPECT_EQ(openEdges(image), 0u) << "body " << &mesh - bodies.data() << ", size " << size;
    }
  }
}

TEST(GeometryImages, ApproachTheSurface) {
  const scene::Mesh mesh = scene::makeTorus(1.0f, 0.3f, 48, 24, UvMode::Unit);
  double real = 0.0;
  for (std::size_t t = 0; t < mesh.indices.size(); t += 3) {
    const Vec3 a = mesh.positions[mesh.indices[t]];
    real +=
        0.5 * static_cast<double>(glm::length(glm::cross(mesh.positions[mesh.indices[t + 1]] - a,
                                                         mesh.positions[mesh.indices[t + 2]] - a)));
  }
  double before = 1.0;
  for (const int size : {16, 32, 64}) {
    const ObjectImage image = makeObjectImage(viewOf(mesh), sizeOf(size));
    const double error = std::abs(1.0 - areaOf(mesh, image) / real);
    EXPECT_LT(error, before) << size;
    EXPECT_EQ(image.notFlattened, 0u);
    EXPECT_LT(image.mostStretch, 3.0);
    before = error;
  }
  EXPECT_LT(before, 0.012);  // in strips along the borders of charts
}

TEST(GeometryImages, KeepTrianglesOfABoxAsTheyAre) {
  const scene::Mesh mesh = scene::makeBox({.size = Vec3(1.0f)}, UvMode::Unit);
  const ObjectImage image = makeObjectImage(viewOf(mesh), sizeOf(64));
  EXPECT_EQ(image.charts.size(), 6u);
  EXPECT_EQ(image.plainTriangles, 12u);
  EXPECT_DOUBLE_EQ(areaOf(mesh, image), 6.0);
  EXPECT_EQ(openEdges(image), 0u);
  // Centres of texels spread over the whole face
  Box3 box;
  const ChartImage& chart = image.charts[0];
  for (std::uint32_t i = 0; i < 1u << (2 * chart.texelLevel); ++i) {
    const TrianglePlace& p = image.texels[chart.firstTexel + i];
    const std::uint32_t* v = &mesh.indices[3 * std::size_t{p.triangle}];
    const Vec3 p0 = mesh.positions[v[0]];
    box.extend(p0 + p.b1 * (mesh.positions[v[1]] - p0) + p.b2 * (mesh.positions[v[2]] - p0));
  }
  const float texel = 1.0f / static_cast<float>(1u << chart.texelLevel);
  EXPECT_NEAR(box.diameter(), std::sqrt(2.0f) * (1.0f - texel), 1e-5f);
}

TEST(GeometryImages, CutLargeChartsWithoutGaps) {
  scene::BoxShape box;
  box.size = Vec3(1.0f, 0.125f, 0.5f);
  box.segments = {256, 32,
                  128};  // two faces of 65,536 triangles; vertices have the very same places
  const scene::Mesh mesh = scene::makeBox(box, UvMode::Unit);
  const ObjectImage image = makeObjectImage(viewOf(mesh), sizeOf(64));
  EXPECT_LE(image.charts.size(), 80u);
  EXPECT_EQ(image.notFlattened, 0u);
  EXPECT_EQ(openEdges(image), 0u);
  // Where grids are coarser than the jags of a border they fold a little
  EXPECT_NEAR(areaOf(mesh, image), 1.375, 2e-4);
}

// [Sander2003] charts that grow freely leave cusps, at which the finest meshes fell into thousands
TEST(GeometryImages, OfALargeMeshAreFewAndLittleStretched) {
  const scene::Mesh mesh = scene::makeTorus(0.35f, 0.14f, 256, 256, UvMode::Unit);
  const ObjectImage image = makeObjectImage(viewOf(mesh), sizeOf(128));
  EXPECT_LE(image.charts.size(), 70u);
  EXPECT_EQ(image.plainTriangles, 0u);
  EXPECT_EQ(image.notFlattened, 0u);
  EXPECT_EQ(openEdges(image), 0u);
  EXPECT_LT(image.mostStretch, 1.6);
}

TEST(GeometryImages, TakeAnyMesh) {
  // An open strip with a triangle on its middle edge, one of it twice, and one without area
  scene::Mesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0.5f, 0.5f, 1}, {2, 0, 0}};
  mesh.indices = {0, 1, 2, 0, 2, 3, 0, 2, 4, 0, 2, 4, 0, 1, 5, 3, 3, 1};
  const ObjectImage image = makeObjectImage(viewOf(mesh), sizeOf(4));
  EXPECT_EQ(image.degenerateTriangles, 2u);
  EXPECT_EQ(image.plainTriangles, 4u);
  EXPECT_NEAR(areaOf(mesh, image), 1.0 + 2.0 * 0.5 * std::sqrt(2.0), 1e-6);
}

bool same(const ObjectImage& a, const ObjectImage& b) {
  const auto samples = [](const Sample& x, const Sample& y) {
    return x.vertex == y.vertex && x.w1 == y.w1 && x.w2 == y.w2;
  };
  const auto places = [](const TrianglePlace& x, const TrianglePlace& y) {
    return x.triangle == y.triangle && x.b1 == y.b1 && x.b2 == y.b2;
  };
  const auto charts = [](const ChartImage& x, const ChartImage& y) {
    return x.level == y.level && x.texelLevel == y.texelLevel && x.firstGrid == y.firstGrid &&
           x.firstTexel == y.firstTexel && x.plain == y.plain;
  };
  return a.grid == b.grid &&
         std::equal(a.samples.begin(), a.samples.end(), b.samples.begin(), b.samples.end(),
                    samples) &&
         std::equal(a.texels.begin(), a.texels.end(), b.texels.begin(), b.texels.end(), places) &&
         std::equal(a.charts.begin(), a.charts.end(), b.charts.begin(), b.charts.end(), charts) &&
         a.plainTriangles == b.plainTriangles && a.mostStretch == b.mostStretch;
}

TEST(GeometryImages, AreTheSameFromAColdAWarmAndADamagedCache) {
  const scene::Mesh mesh = scene::makeTorus(1.0f, 0.3f, 64, 32, UvMode::Unit);
  const std::filesystem::path folder =
      std::filesystem::path(testing::TempDir()) / "geometry_images";
  std::filesystem::remove_all(folder);
  const ObjectImage made = makeObjectImage(viewOf(mesh), sizeOf(32));
  const auto cached = [&] { return cachedObjectImage(viewOf(mesh), sizeOf(32), folder); };
  EXPECT_TRUE(same(cached(), made));
  const auto files = [&] { return std::distance(std::filesystem::directory_iterator(folder), {}); };
  EXPECT_EQ(files(), 1);
  EXPECT_TRUE(same(cached(), made));
  for (const auto& file : std::filesystem::directory_iterator(folder)) {
    std::fstream bytes(file.path(), std::ios::in | std::ios::out | std::ios::binary);
    bytes.seekp(50);
    bytes.put('\x7f');
    bytes.close();
    EXPECT_TRUE(same(cached(), made)) << file.path();
  }
  EXPECT_TRUE(same(cached(), made));
  EXPECT_EQ(files(), 1);
}

TEST(GeometryImages, ShareStepsByLength) {
  EXPECT_EQ(shareSteps(8, {1.0, 1.0, 2.0}, {1, 1, 1}), (std::vector<int>{2, 2, 4}));
  EXPECT_EQ(shareSteps(4, {1e-9, 1.0, 1e-9}, {1, 1, 1}), (std::vector<int>{1, 2, 1}));
  EXPECT_EQ(shareSteps(3, {0.0, 0.0}, {1, 1}), (std::vector<int>{2, 1}));
}

TEST(Tree, VisitsEveryQuadOnceAndNestsItsBoxes) {
  const std::vector<Grid> grids = {{0, 0, 2}, {25, 16, 0}, {29, 17, 1}};
  std::vector<Vec4> vertices;
  for (int i = 0; i < 38; ++i)
    vertices.emplace_back(std::sin(3.0f * static_cast<float>(i)), 0.1f * static_cast<float>(i),
                          std::cos(5.0f * static_cast<float>(i)), 0.0f);
  for (const std::optional<Vec3>& from :
       {std::optional<Vec3>(), std::optional(Vec3(0.0f, 9.0f, 0.0f))}) {
    Tree tree;
    tree.build(grids, vertices, std::vector<Vec3>(21), from);
    const std::vector<Node>& nodes = tree.nodes();
    EXPECT_EQ(nodes.size(), 21u + 1u + 5u + 2u);
    std::set<std::pair<std::uint32_t, std::uint32_t>> leaves;
    for (std::uint32_t i = 0; i < nodes.size(); ++i) {
      ASSERT_GT(nodes[i].miss, i);
      ASSERT_LE(nodes[i].miss, nodes.size());
      for (std::uint32_t below = i + 1; below < nodes[i].miss; ++below) {
        EXPECT_LE(nodes[below].miss, nodes[i].miss);
        EXPECT_TRUE(glm::all(glm::lessThanEqual(nodes[i].least, nodes[below].least)));
        EXPECT_TRUE(glm::all(glm::greaterThanEqual(nodes[i].most, nodes[below].most)));
      }
      if ((nodes[i].flags & kIsLeaf) == 0) continue;
      EXPECT_EQ(nodes[i].miss, i + 1);
      leaves.insert({tree.quads()[i].chart, tree.quads()[i].place});
    }
    EXPECT_EQ(leaves.size(), 16u + 1u + 4u);
  }
}

TEST(Tree, HasTheNearestChildrenFirst) {
  // One flat chart of 4 x 4 quads, seen from beyond each of its corners
  std::vector<Vec4> vertices;
  for (int row = 0; row < 5; ++row)
    for (int column = 0; column < 5; ++column)
      vertices.emplace_back(static_cast<float>(column), 0.0f, static_cast<float>(row), 0.0f);
  for (const Vec3 from : {Vec3(-1, 0, -2), Vec3(9, 0, -2), Vec3(-1, 0, 9), Vec3(9, 0, 8)}) {
    Tree tree;
    tree.build(std::vector<Grid>{{0, 0, 2}}, vertices, std::vector<Vec3>(16), from);
    const auto middle = [&](std::uint32_t node) {
      return 0.5f * (tree.nodes()[node].least + tree.nodes()[node].most);
    };
    for (std::uint32_t i = 0; i < tree.nodes().size(); ++i) {
      float before = 0.0f;
      for (std::uint32_t child = i + 1; child < tree.nodes()[i].miss;
           child = tree.nodes()[child].miss) {
        EXPECT_GE(glm::distance(from, middle(child)), before);
        before = glm::distance(from, middle(child));
      }
    }
  }
}

TEST(Tree, FollowsTheChartsThatMoved) {
  const std::vector<Grid> grids = {{0, 0, 2}, {25, 16, 0}, {29, 17, 1}};
  std::vector<Vec4> vertices;
  for (int i = 0; i < 38; ++i)
    vertices.emplace_back(std::sin(3.0f * static_cast<float>(i)), 0.1f * static_cast<float>(i),
                          std::cos(5.0f * static_cast<float>(i)), 0.0f);
  Tree partly;
  partly.build(grids, vertices, std::vector<Vec3>(21), std::nullopt);
  Tree wholly = partly;
  const Node before = partly.nodes().front();
  for (std::size_t i = 29; i < 38; ++i) vertices[i] = 0.2f * vertices[i] - Vec4(3.0f);
  partly.refit(vertices, std::vector<std::uint32_t>{2});
  wholly.refit(vertices, std::vector<std::uint32_t>{0, 1, 2});
  EXPECT_NE(partly.nodes().front().least, before.least);
  EXPECT_NE(partly.nodes().front().most, before.most);  // nothing keeps where it was
  for (std::size_t i = 0; i < partly.nodes().size(); ++i) {
    EXPECT_EQ(partly.nodes()[i].least, wholly.nodes()[i].least) << i;
    EXPECT_EQ(partly.nodes()[i].most, wholly.nodes()[i].most) << i;
  }
}

}  // namespace
}  // namespace catoptric::methods::glossy_lod
