// Path calculus against what is known on paper: the paper's own recursion taken literally, planes,
// Alhazen's problem, caustics, scenes of other sizes.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "methods/perturbation/test_paths.h"

namespace catoptric::methods::perturbation {
namespace {

const implicit::Domain kBox{{-9, -9, -9}, {9, 9, 9}};

// ---- The paper's formulas, literally, with numerical derivatives of (5) in 50 digits ----

using State = std::array<Real, 10>;  ///< x_{i-1}, x_i, x_{i+1}, lambda

struct PaperBounce {
  Real jacobian[4][3];      ///< D
  Real gradientD[3][4][3];  ///< (nabla_m D)_ij
};

/// (5) for the segments at x_i.
std::array<Real, 4> equations(const Surface& surface, const State& s) {
  const Vector<Real> p{{s[0], s[1], s[2]}};
  const Vector<Real> x{{s[3], s[4], s[5]}};
  const Vector<Real> q{{s[6], s[7], s[8]}};
  const Jet3<Real> g = jetAt<Real>(surface, x);
  const Vector<Real> sum = normalized(x - p) + normalized(x - q);
  return {sum[0] + s[9] * g.gradient(0), sum[1] + s[9] * g.gradient(1),
          sum[2] + s[9] * g.gradient(2), g.value()};
}

/// First and second derivatives of F by all ten variables.
struct Differences {
  Real first[4][10];
  Real second[4][10][10];
};
void findDifferences(const Surface& surface, const State& s, Differences& d) {
  const Real h("1e-12");
  const auto shifted = [&](std::size_t a, int ka, std::size_t b, int kb) {
    State t = s;
    t[a] += ka * h;
    t[b] += kb * h;
    return equations(surface, t);
  };
  for (std::size_t a = 0; a < 10; ++a) {
    const auto plus = shifted(a, 1, a, 0);
    const auto minus = shifted(a, -1, a, 0);
    for (std::size_t r = 0; r < 4; ++r) d.first[r][a] = (plus[r] - minus[r]) / (2 * h);
    for (std::size_t b = 0; b < 10; ++b) {
      const auto pp = shifted(a, 1, b, 1);
      const auto pm = shifted(a, 1, b, -1);
      const auto mp = shifted(a, -1, b, 1);
      const auto mm = shifted(a, -1, b, -1);
      for (std::size_t r = 0; r < 4; ++r)
        d.second[r][a][b] = (pp[r] - pm[r] - mp[r] + mm[r]) / (4 * h * h);
    }
  }
}

/// SimpleJac and SimpleHess (Fig. 4 and 5) with D = -Gamma^-1 T, from those of the next bounce.
PaperBounce paperBounce(const Surface& surface, const State& s, const PaperBounce* next) {
  static Differences differences;
  findDifferences(surface, s, differences);
  const auto& [first, second] = differences;
  // Columns of the variables: T's from 0, A's from 3 and lambda's 9, B's from 6.
  const auto columnA = [](std::size_t c) { return c < 3 ? 3 + c : std::size_t{9}; };
  Real gamma[4][4];
  for (std::size_t r = 0; r < 4; ++r) {
    for (std::size_t c = 0; c < 4; ++c) {
      gamma[r][c] = first[r][columnA(c)];
      for (std::size_t k = 0; next && c < 3 && k < 3; ++k)
        gamma[r][c] += first[r][6 + k] * next->jacobian[k][c];
    }
  }
  const auto solve = [&](std::array<std::array<Real, 3>, 4> right, Real(&result)[4][3]) {
    Real m[4][7];
    for (std::size_t r = 0; r < 4; ++r) {
      for (std::size_t c = 0; c < 7; ++c) m[r][c] = c < 4 ? gamma[r][c] : -right[r][c - 4];
    }
    for (std::size_t c = 0; c < 4; ++c) {
      std::size_t pivot = c;
      for (std::size_t r = c; r < 4; ++r) {
        if (abs(m[r][c]) > abs(m[pivot][c])) pivot = r;
      }
      for (std::size_t k = 0; k < 7; ++k) std::swap(m[c][k], m[pivot][k]);
      for (std::size_t r = 0; r < 4; ++r) {
        const Real factor = m[r][c] / m[c][c];
        for (std::size_t k = 0; r != c && k < 7; ++k) m[r][k] -= factor * m[c][k];
      }
    }
    for (std::size_t r = 0; r < 4; ++r) {
      for (std::size_t c = 0; c < 3; ++c) result[r][c] = m[r][4 + c] / m[r][r];
    }
  };
  PaperBounce result;
  std::array<std::array<Real, 3>, 4> t;
  for (std::size_t r = 0; r < 4; ++r) {
    for (std::size_t c = 0; c < 3; ++c) t[r][c] = first[r][c];
  }
  solve(t, result.jacobian);  // (9)

  // (11), (13): the total derivative of an entry dF_r / dv by x_{i-1}.
  const auto total = [&](std::size_t r, std::size_t v, std::size_t m) {
    Real sum = second[r][v][m];
    for (std::size_t k = 0; k < 4; ++k) sum += second[r][v][columnA(k)] * result.jacobian[k][m];
    for (std::size_t k = 0; next && k < 3; ++k) {
      for (std::size_t l = 0; l < 3; ++l)
        sum += second[r][v][6 + k] * next->jacobian[k][l] * result.jacobian[l][m];
    }
    return sum;
  };
  for (std::size_t m = 0; m < 3; ++m) {
    std::array<std::array<Real, 3>, 4> right;
    for (std::size_t r = 0; r < 4; ++r) {
      Real gradientGamma[4];  // (12)
      for (std::size_t c = 0; c < 4; ++c) {
        gradientGamma[c] = total(r, columnA(c), m);
        for (std::size_t k = 0; next && c < 3 && k < 3; ++k) {
          gradientGamma[c] += total(r, 6 + k, m) * next->jacobian[k][c];
          for (std::size_t l = 0; l < 3; ++l)
            gradientGamma[c] += first[r][6 + k] * next->gradientD[l][k][c] * result.jacobian[l][m];
        }
      }
      for (std::size_t j = 0; j < 3; ++j) {
        right[r][j] = total(r, j, m);
        for (std::size_t c = 0; c < 4; ++c) right[r][j] += gradientGamma[c] * result.jacobian[c][j];
      }
    }
    solve(right, result.gradientD[m]);  // (10)
  }
  return result;
}

TEST(PathCalculus, EqualsThePapersRecursion) {
  TestPath path;
  path.surfaces = {implicit::torusSurface(1.0, 0.4), implicit::ellipsoidSurface({5, 6, 5.5})};
  path.q = {{2.9, 1.3, -1.9}};
  std::mt19937 random(11);
  int paths = 0;
  for (int attempt = 0; attempt < 100 && paths < 2; ++attempt) {
    if (!tracePath(path, 0.8 * randomDirection(random) - pointOf(path.q), 3)) continue;
    ++paths;
    const Vector<Real> p = converted<Real>(path.p);
    const Vector<Real> q = converted<Real>(path.q);
    std::vector<PathVertex<Real>> exact;
    ASSERT_TRUE(path.solve<Real>(p, exact));
    const auto expansion = expandPath<Real>(p, exact, q);
    ASSERT_EQ(expansion.status, PathStatus::Regular);
    std::vector<PaperBounce> paper(exact.size());
    for (std::size_t i = exact.size(); i-- > 0;) {
      const Vector<Real>& a = i > 0 ? exact[i - 1].x : p;
      const Vector<Real>& x = exact[i].x;
      const Vector<Real>& b = i + 1 < exact.size() ? exact[i + 1].x : q;
      // Fig. 4, line 4; by the whole gradient instead of one component of it.
      const auto& g = exact[i].g;
      const Vector<Real> gradient{{g.gradient(0), g.gradient(1), g.gradient(2)}};
      const Real lambda =
          -dot(normalized(x - a) + normalized(x - b), gradient) / dot(gradient, gradient);
      const State state{a[0], a[1], a[2], x[0], x[1], x[2], b[0], b[1], b[2], lambda};
      paper[i] = paperBounce(path.surfaces[path.hit[i]], state,
                             i + 1 < exact.size() ? &paper[i + 1] : nullptr);
      const auto ours = derivativesOf(expansion.bounces[i], expansion.distances[i]);
      for (std::size_t j = 0; j < 3; ++j) {
        for (std::size_t k = 0; k < 3; ++k) {
          EXPECT_LT(abs(ours.jacobian[j][k] - paper[i].jacobian[j][k]), Real(1e-18)) << i;
          for (std::size_t m = k; m < 3; ++m) {  // (14)
            EXPECT_LT(abs(ours.hessian[j][implicit::kHessianIndex[k][m] - 4] -
                          paper[i].gradientD[m][j][k]),
                      Real(1e-14))
                << i;
          }
        }
      }
    }
  }
  EXPECT_EQ(paths, 2);
}

TEST(PathCalculus, PlaneEqualsItsClosedForm) {
  // Mirror y = 0: x = (q_y p + p_y q) / (p_y + q_y) in x and z.
  const Vector<double> p{{0.4, 1.5, -0.3}};
  const Vector<double> q{{-0.8, 2.5, 0.9}};
  const double s = p[1] + q[1];
  const Vector<double> x{{(q[1] * p[0] + p[1] * q[0]) / s, 0.0, (q[1] * p[2] + p[1] * q[2]) / s}};
  const Surface plane = implicit::planeSurface({0, 1, 0}, 0.0, kBox);
  const auto expansion = expandPath<double>(p, {{x, jetAt<double>(plane, x)}}, q);
  const auto d = derivativesOf(expansion.bounces[0], expansion.distances[0]);
  for (const std::size_t i : {std::size_t{0}, std::size_t{2}}) {
    const double byY = q[1] * (q[i] - p[i]) / (s * s);
    EXPECT_NEAR(d.jacobian[i][i], q[1] / s, 3e-16);
    EXPECT_NEAR(d.jacobian[i][2 - i], 0.0, 3e-16);
    EXPECT_NEAR(d.jacobian[i][1], byY, 3e-16);
    for (std::size_t a = 0; a < 3; ++a) {
      for (std::size_t b = a; b < 3; ++b) {
        double expected = 0.0;
        if (a == 1 && b == 1) expected = -2 * byY / s;
        if ((a == i && b == 1) || (a == 1 && b == i)) expected = -q[1] / (s * s);
        EXPECT_NEAR(d.hessian[i][implicit::kHessianIndex[a][b] - 4], expected, 3e-16);
      }
    }
  }
  for (std::size_t a = 0; a < 3; ++a) EXPECT_NEAR(d.jacobian[1][a], 0.0, 1e-17);
}

TEST(PathCalculus, AlhazensProblem) {
  // Against bisection on the circle through p, q and the centre, in 50 digits.
  const Surface ball = implicit::sphereSurface(1.0);
  std::mt19937 random(2);
  std::uniform_real_distribution<double> distance(1.05, 6.0);
  double worst = 0.0;
  int problems = 0;
  for (int k = 0; k < 200; ++k) {
    const Point p = distance(random) * randomDirection(random);
    const Point q = distance(random) * randomDirection(random);
    const Point bisector = glm::normalize(glm::normalize(p) + glm::normalize(q));
    // Both must see the point.
    if (glm::dot(bisector, p) < 1.3 || glm::dot(bisector, q) < 1.3) continue;
    ++problems;
    std::vector<PathVertex<double>> path{{vectorOf(bisector), {}, 1.0}};
    const auto at = [&](std::size_t, const Vector<double>& x, Jet3<double>& jet) {
      jet = jetAt<double>(ball, x);
      return true;
    };
    ASSERT_TRUE(solvePath<double>(vectorOf(p), vectorOf(q), at, 1.0, 1e-14, path));
    // Frame in the plane: e1 to p, e2 to q's side; the angle where both make the same sine.
    const Vector<Real> rp = converted<Real>(vectorOf(p));
    const Vector<Real> rq = converted<Real>(vectorOf(q));
    const Vector<Real> e1 = normalized(rp);
    const Vector<Real> e2 = normalized(rq - dot(rq, e1) * e1);
    Real a(0);
    Real b = atan2(dot(rq, e2), dot(rq, e1));
    Vector<Real> x;
    for (int step = 0; step < 120; ++step) {
      const Real angle = (a + b) / 2;
      x = cos(angle) * e1 + sin(angle) * e2;
      const Vector<Real> tangent = cos(angle) * e2 - sin(angle) * e1;
      const Real slope = dot(normalized(x - rp) + normalized(x - rq), tangent);
      (slope < 0 ? a : b) = angle;
    }
    worst = std::max(worst, static_cast<double>(length(converted<Real>(path[0].x) - x)));
  }
  EXPECT_GT(problems, 80);
  EXPECT_LT(worst, 2e-15);
}

TEST(PathCalculus, FocalPointsAreCaustics) {
  // A concave mirror of radius 2 seen from its centre: all paths come back to it.
  const Surface mirror = implicit::sphereSurface(2.0);
  const Vector<double> x{{0, 0, -2}};
  const std::vector<PathVertex<double>> vertices{{x, jetAt<double>(mirror, x)}};
  EXPECT_EQ(expandPath<double>({{0, 0, 0}}, vertices, {{0, 0, 0}}).status, PathStatus::Caustic);
  EXPECT_EQ(expandPath<double>({{0, 0, -1}}, vertices, {{0, 0, 0}}).status, PathStatus::Regular);
  // From q at distance 3 before the mirror, 1/p + 1/q = 2/r: the image is at 1.5.
  const Vector<double> q{{0, 0, 1}};
  EXPECT_EQ(expandPath<double>({{0, 0, -0.5}}, vertices, q).status, PathStatus::Caustic);
  EXPECT_EQ(expandPath<double>({{0, 0, -0.49}}, vertices, q).status, PathStatus::Regular);
  // Near it the Jacobian grows as 1 / distance.
  const auto size = [&](double off) {
    const auto e = expandPath<double>({{0, 0, -0.5 + off}}, vertices, q);
    return derivativesOf(e.bounces[0], e.distances[0]).jacobian[0][0] * off;
  };
  EXPECT_NEAR(size(1e-3), size(1e-4), 1e-3 * std::abs(size(1e-4)));
}

TEST(PathCalculus, SingularPathsHaveAStatus) {
  const Surface ball = implicit::sphereSurface(1.0);
  const Vector<double> top{{0, 1, 0}};
  const std::vector<PathVertex<double>> vertices{{top, jetAt<double>(ball, top)}};
  // Along the tangent plane.
  EXPECT_EQ(expandPath<double>({{-2, 1, 0}}, vertices, {{2, 1, 0}}).status, PathStatus::Grazing);
  // p or q in x.
  EXPECT_EQ(expandPath<double>(top, vertices, {{2, 3, 0}}).status, PathStatus::Degenerate);
  EXPECT_EQ(expandPath<double>({{-2, 3, 0}}, vertices, top).status, PathStatus::Degenerate);
  // A cone's apex.
  const Vector<double> apex{{0, 0, 0}};
  const Surface cone = implicit::coneSurface(1, 1);
  EXPECT_EQ(
      expandPath<double>({{-2, 3, 0}}, {{apex, jetAt<double>(cone, apex)}}, {{2, 3, 0}}).status,
      PathStatus::Degenerate);
  // p so near to its mirror that rounding shows: still finite, J the projection along the ray.
  const Vector<double> near{{-1e-9, 1 + 1e-9, 0}};
  const auto e = expandPath<double>(near, vertices, {{2, 3, 0}});
  ASSERT_EQ(e.status, PathStatus::Regular);
  const auto d = derivativesOf(e.bounces[0], e.distances[0]);
  EXPECT_NEAR(d.jacobian[0][0], 1.0, 1e-7);
  EXPECT_NEAR(d.jacobian[0][1], 1.0, 1e-7);
  for (const auto& h : d.hessian) {
    for (const double v : h) EXPECT_TRUE(std::isfinite(v));
  }
}

/// Calls `check` for the bounces of 300 random rays by each of seven surfaces, with a step of 0.2
/// to 10 % of the distance across the ray.
template <class Check>
void forEachMove(const Check& check) {
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
      check(path, e.bounces[0], rho, vectorOf(0.002 * std::pow(50, unit(random)) * rho * across));
    }
  }
}

TEST(PathCalculus, MovesAreThoseOfTheDerivatives) {
  forEachMove(
      [](const TestPath&, const Bounce<double>& bounce, double rho, const Vector<double>& step) {
        const Move<double> move = moveOf(bounce, rho, step);
        const auto d = derivativesOf(bounce, rho);
        for (std::size_t i = 0; i < 3; ++i) {
          double linear = 0.0;
          double second = 0.0;
          double size = 0.0;  // of the sums' terms
          for (std::size_t a = 0; a < 3; ++a) {
            linear += d.jacobian[i][a] * step[a];
            for (std::size_t b = 0; b < 3; ++b) {
              const double h = 0.5 * d.hessian[i][implicit::kHessianIndex[a][b] - 4];
              second += h * step[a] * step[b];
              size += std::abs(h * step[a] * step[b]);
            }
            size += std::abs(d.jacobian[i][a] * step[a]);
          }
          EXPECT_NEAR(move.linear[i], linear, 1e-12 * size);
          EXPECT_NEAR(move.second[i], second, 1e-12 * size);
        }
      });
}

TEST(PathCalculus, EstimatesItsErrors) {
  std::vector<double> linear;
  std::vector<double> quadratic;
  forEachMove([&](const TestPath& path, const Bounce<double>& bounce, double rho,
                  const Vector<double>& step) {
    const Move<double> move = moveOf(bounce, rho, step);
    std::vector<PathVertex<double>> exact{{bounce.x + move.linear + move.second, {}, 1.0}};
    if (!path.solve<double>(path.p + step, exact)) return;
    const double second = length(move.second);
    const Vector<double> moved = exact[0].x - bounce.x;
    if (length(moved - move.linear) > 1e-12) linear.push_back(length(moved - move.linear) / second);
    const double error = length(moved - move.linear - move.second);
    if (error > 1e-12)
      quadratic.push_back(error / remainderOf(length(move.linear), second, rho, length(step)));
  });
  const auto part = [](std::vector<double>& ratios, double at) {
    std::sort(ratios.begin(), ratios.end());
    return ratios[static_cast<std::size_t>(at * static_cast<double>(ratios.size()))];
  };
  ASSERT_GT(std::min(linear.size(), quadratic.size()), 800u);
  // Linear: exact to a fifth for nine of ten. Quadratic: an upper bound for nine of ten within a
  // quarter, and seldom ten times too much (planes, whose third order is small).
  EXPECT_LT(part(linear, 0.9), 1.2);
  EXPECT_GT(part(linear, 0.1), 0.8);
  EXPECT_LT(part(quadratic, 0.9), 1.25);
  EXPECT_GT(part(quadratic, 0.1), 0.05);
}

TEST(PathCalculus, DoesNotDependOnTheScenesSize) {
  TestPath path;
  path.surfaces = {implicit::vaseSurface(), implicit::ellipsoidSurface({5, 6, 5.5})};
  path.q = {{2.9, 1.3, -1.9}};
  std::mt19937 random(4);
  while (!tracePath(path, Point(0, 1, 0) + 0.5 * randomDirection(random) - pointOf(path.q), 3)) {
  }
  const auto expansion = [&](double scale) {
    TestPath scaled = path;
    for (Surface& s : scaled.surfaces) s = implicit::placed(s, glm::dmat3(scale), Point(0.0));
    scaled.q = scale * scaled.q;
    for (auto& x : scaled.points) x = scale * x;
    std::vector<PathVertex<double>> vertices;
    const Vector<double> p = scale * path.p;
    EXPECT_TRUE(scaled.solve<double>(p, vertices));
    return expandPath<double>(p, vertices, scaled.q);
  };
  const auto one = expansion(1.0);
  for (const double scale : {1e-4, 1e5}) {
    const auto other = expansion(scale);
    ASSERT_EQ(other.status, PathStatus::Regular);
    for (std::size_t i = 0; i < 3; ++i) {
      const auto a = derivativesOf(one.bounces[i], one.distances[i]);
      const auto b = derivativesOf(other.bounces[i], other.distances[i]);
      for (std::size_t r = 0; r < 3; ++r) {
        double hessian = 0.0;
        for (std::size_t c = 0; c < 6; ++c) hessian = std::max(hessian, std::abs(a.hessian[r][c]));
        for (std::size_t c = 0; c < 3; ++c)
          EXPECT_NEAR(a.jacobian[r][c], b.jacobian[r][c], 1e-12 * (1 + std::abs(a.jacobian[r][c])));
        for (std::size_t c = 0; c < 6; ++c)
          EXPECT_NEAR(a.hessian[r][c], scale * b.hessian[r][c], 1e-11 * (1 + hessian));
      }
    }
  }
}

}  // namespace
}  // namespace catoptric::methods::perturbation
