// The batches in float against the same formulas in double.
#include "methods/perturbation/batch.h"

#include <gtest/gtest.h>

#include "methods/perturbation/test_paths.h"

namespace catoptric::methods::perturbation {
namespace {

struct Case {
  std::vector<Bounce<double>> bounces;
  std::vector<BounceRecord> records;
  std::vector<VertexMove> vertices;
};
/// Vertices about rays that a vase mirrors; their number is no multiple of four.
Case vaseCase() {
  Case c;
  TestPath path;
  path.surfaces = {implicit::placed(implicit::vaseSurface(), glm::dmat3(1.0), {0, -1, 0}),
                   implicit::ellipsoidSurface({5, 6, 5.5})};
  path.q = {{0.5, 0.6, 4.0}};
  std::mt19937 random(9);
  while (c.bounces.size() < 50) {
    if (!tracePath(path, 0.9 * randomDirection(random) - pointOf(path.q), 1)) continue;
    const auto e = expandPath<double>(
        path.p, {{path.points[0], jetAt<double>(path.surfaces[0], path.points[0])}}, path.q);
    if (e.status != PathStatus::Regular) continue;
    c.bounces.push_back(e.bounces[0]);
    c.records.push_back(recordOf(e.bounces[0]));
  }
  std::uniform_real_distribution<float> unit(-1.0f, 1.0f);
  for (std::uint32_t i = 0; i < 1001; ++i)
    c.vertices.push_back({i * 7 % 50,
                          1.5f + unit(random),
                          {0.1f * unit(random), 0.1f * unit(random), 0.1f * unit(random)}});
  return c;
}

TEST(PerturbationBatch, EqualsTheFormulasInDouble) {
  const Case c = vaseCase();
  std::vector<std::array<float, 3>> linear(c.vertices.size());
  std::vector<std::array<float, 3>> quadratic(c.vertices.size());
  std::vector<DerivativeBlock> blocks((c.vertices.size() + 3) / 4);
  EXPECT_EQ(moveVertices(c.records, c.vertices, 1, linear), 0u);
  EXPECT_EQ(moveVertices(c.records, c.vertices, 2, quadratic), 0u);
  vertexDerivatives(c.records, c.vertices, blocks);
  double worst = 0.0;
  double difference = 0.0;
  for (std::size_t v = 0; v < c.vertices.size(); ++v) {
    const VertexMove& vertex = c.vertices[v];
    const Bounce<double>& bounce = c.bounces[vertex.bounce];
    const double rho = vertex.distance;
    const Vector<double> step{{vertex.step[0], vertex.step[1], vertex.step[2]}};
    const Vector<double> one = movedPoint<1>(bounce, rho, step) - bounce.x;
    const Vector<double> two = movedPoint<2>(bounce, rho, step) - bounce.x;
    const auto d = derivativesOf(bounce, rho);
    double size = 0.0;
    for (const auto& row : d.hessian) {
      for (const double h : row) size = std::max(size, std::abs(h));
    }
    for (std::size_t i = 0; i < 3; ++i) {
      const double scale = length(step) + size * dot(step, step);
      worst = std::max(worst, std::abs(linear[v][i] - one[i]) / scale);
      worst = std::max(worst, std::abs(quadratic[v][i] - two[i]) / scale);
      difference = std::max(difference, std::abs(one[i] - two[i]));
      for (std::size_t k = 0; k < 3; ++k) {
        EXPECT_NEAR(blocks[v / 4][3 * i + k][v % 4], d.jacobian[i][k], 1e-5 * (1 + size));
      }
      for (std::size_t k = 0; k < 6; ++k)
        EXPECT_NEAR(blocks[v / 4][9 + 6 * i + k][v % 4], d.hessian[i][k], 1e-4 * (1 + size));
    }
    // The tensors and the direct evaluation agree.
    for (std::size_t i = 0; i < 3; ++i) {
      double sum = 0.0;
      for (std::size_t a = 0; a < 3; ++a) {
        sum += d.jacobian[i][a] * step[a];
        for (std::size_t b = 0; b < 3; ++b)
          sum += 0.5 * d.hessian[i][implicit::kHessianIndex[a][b] - 4] * step[a] * step[b];
      }
      EXPECT_NEAR(sum, two[i], 1e-13 * (1 + size));
    }
  }
  EXPECT_LT(worst, 1e-5);
  EXPECT_GT(difference, 1e-3) << "the second order should matter here";
}

TEST(PerturbationBatch, DoesNotDependOnWhoSharesABatch) {
  const Case c = vaseCase();
  std::vector<std::array<float, 3>> all(c.vertices.size());
  moveVertices(c.records, c.vertices, 2, all);
  for (std::size_t v = 0; v < c.vertices.size(); v += 13) {
    std::array<float, 3> alone{};
    moveVertices(c.records, std::span(c.vertices).subspan(v, 1), 2, {&alone, 1});
    EXPECT_EQ(alone, all[v]);
  }
}

TEST(PerturbationBatch, FocalPointsAreRefusedAndCounted) {
  // A concave mirror seen from its centre: p in the centre is in focus.
  const implicit::Surface mirror = implicit::sphereSurface(2.0);
  const Vector<double> x{{0, 0, -2}};
  const auto e = expandPath<double>({{0, 0, -1}}, {{x, jetAt<double>(mirror, x)}}, {{0, 0, 0}});
  ASSERT_EQ(e.status, PathStatus::Regular);
  const std::vector<BounceRecord> records{recordOf(e.bounces[0])};
  const std::vector<VertexMove> vertices{{0, 2.0f, {0.1f, 0, 0}}, {0, 1.0f, {0.1f, 0, 0}}};
  std::vector<std::array<float, 3>> moves(2);
  EXPECT_EQ(moveVertices(records, vertices, 2, moves), 1u);
  EXPECT_EQ(moves[0], (std::array<float, 3>{}));
  EXPECT_GT(std::abs(moves[1][0]), 0.01f);
}

}  // namespace
}  // namespace catoptric::methods::perturbation
