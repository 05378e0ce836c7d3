// The batches in float against the same formulas in double.
#include "methods/perturbation/batch.h"

#include <gtest/gtest.h>

#include <algorithm>

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
  std::vector<MovedVertex> linear(c.vertices.size());
  std::vector<MovedVertex> quadratic(c.vertices.size());
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
      worst = std::max(worst, std::abs(linear[v].move[i] - one[i]) / scale);
      worst = std::max(worst, std::abs(quadratic[v].move[i] - two[i]) / scale);
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
  std::vector<MovedVertex> all(c.vertices.size());
  moveVertices(c.records, c.vertices, 2, all);
  for (std::size_t v = 0; v < c.vertices.size(); v += 13) {
    MovedVertex alone;
    moveVertices(c.records, std::span(c.vertices).subspan(v, 1), 2, {&alone, 1});
    EXPECT_EQ(alone.move, all[v].move);
    EXPECT_EQ(alone.error, all[v].error);
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
  std::vector<MovedVertex> moves(2);
  EXPECT_EQ(moveVertices(records, vertices, 2, moves), 1u);
  EXPECT_EQ(moves[0].move, (std::array<float, 3>{}));
  EXPECT_TRUE(std::isinf(moves[0].error));
  EXPECT_GT(std::abs(moves[1].move[0]), 0.01f);
}

TEST(PerturbationBatch, EstimatesItsErrors) {
  // Moves of 0.2 to 10 % of the distance, across the ray, against exact paths.
  using namespace implicit;
  const std::vector<Surface> surfaces{sphereSurface(1.2),
                                      ellipsoidSurface({1.0, 0.7, 1.4}),
                                      cylinderSurface(0.8, 2.0),
                                      torusSurface(1.0, 0.4),
                                      placed(vaseSurface(), glm::dmat3(1.0), {0, -1, 0}),
                                      metaballsSurface({{0, 0, 0, 0.7}, {0.8, 0.2, 0, 0.5}}, 2.0),
                                      planeSurface({1, 2, -0.5}, 0.3, {Point(-2), Point(2)})};
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  for (const int order : {1, 2}) {
    std::vector<double> ratios;
    std::vector<double> newton;
    for (const Surface& surface : surfaces) {
      TestPath path;
      path.surfaces = {surface, ellipsoidSurface({9, 8, 8.5})};
      path.q = {{2.9, 1.3, -1.9}};
      for (int i = 0; i < 300; ++i) {
        if (!tracePath(path, 0.8 * randomDirection(random) - pointOf(path.q), 1)) continue;
        const Vector<double>& x = path.points[0];
        const auto e = expandPath<double>(path.p, {{x, jetAt<double>(surface, x)}}, path.q);
        if (e.status != PathStatus::Regular) continue;
        const Point across = glm::cross(pointOf(e.bounces[0].d), randomDirection(random));
        const double rho = e.distances[0];
        const Vector<double> step = vectorOf(0.002 * std::pow(50, unit(random)) * rho * across);
        const Move<double> move = moveOf(e.bounces[0], rho, step);
        const Vector<double> guess = x + (order == 1 ? move.linear : move.linear + move.second);
        std::vector<PathVertex<double>> exact{{guess, {}, 1.0}};
        double firstStep = 0.0;
        const auto surfaceAt = [&](std::size_t, const Vector<double>& at, Jet3<double>& jet) {
          jet = jetAt<double>(surface, at);
          return true;
        };
        if (solvePath<double>(path.p + step, path.q, surfaceAt, 1.0, 1e-13, exact, &firstStep) !=
            PathStatus::Regular)
          continue;
        const double error = length(exact[0].x - guess);
        if (error < 1e-12) continue;
        ratios.push_back(error / remainderOf(move, order, rho, step));
        newton.push_back(error / firstStep);
      }
    }
    ASSERT_GT(ratios.size(), 800u);
    std::sort(ratios.begin(), ratios.end());
    std::sort(newton.begin(), newton.end());
    const auto part = [](const std::vector<double>& v, double at) {
      return v[static_cast<std::size_t>(at * static_cast<double>(v.size()))];
    };
    // Linear: exact to a fifth for nine of ten. Quadratic: an upper bound for nine of ten within a
    // quarter, and seldom ten times too much (planes, whose third order is small).
    EXPECT_LT(part(ratios, 0.9), order == 1 ? 1.2 : 1.25);
    EXPECT_GT(part(ratios, 0.1), order == 1 ? 0.8 : 0.05);
    // Newton's first step (its largest component) is the error.
    EXPECT_GT(part(newton, 0.05), 0.9);
    EXPECT_LT(part(newton, 0.95), 1.8);
  }
}

}  // namespace
}  // namespace catoptric::methods::perturbation
