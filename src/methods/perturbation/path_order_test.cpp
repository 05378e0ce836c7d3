// Taylor's series of exactly solved paths: the error falls as h^2 with the Jacobian and as h^3 with
// the Hessian, in 50 digits over five decades of h and in double until rounding.
#include <gtest/gtest.h>

#include "methods/perturbation/test_paths.h"
#include "scene/implicit/test_surfaces.h"

namespace catoptric::methods::perturbation {
namespace {

std::vector<test::NamedSurface> catalogue() {
  using namespace implicit;
  std::vector<test::NamedSurface> all = test::namedSurfaces();
  all.push_back({"vase", placed(vaseSurface(), glm::dmat3(1.0), {0, -1, 0})});
  all.push_back({"formula", formulaSurface("x^2 + y^2*z/3 + z^2 + sin(3*x)*cos(2*y)/5 - 0.8", {},
                                           test::kBox)});
  return all;
}

/// The exact paths for moves of p by h along each of three directions.
struct Moves {
  std::vector<Vector<Real>> steps;
  std::vector<std::vector<PathVertex<Real>>> paths;
  bool solved = true;
};
Moves exactMoves(const TestPath& path, const std::vector<PathVertex<Real>>& base,
                 const Vector<Real>& p, const Real& h) {
  Moves moves;
  for (const Point& direction :
       {Point(0.6, -0.64, 0.48), Point(-0.48, 0.6, 0.64), Point(0.8, 0.36, 0.48)}) {
    moves.steps.push_back(h * converted<Real>(vectorOf(direction)));
    moves.paths.push_back(base);
    moves.solved = moves.solved && path.solve<Real>(p + moves.steps.back(), moves.paths.back());
  }
  return moves;
}

/// The largest error of x_1 ... x_N.
template <int Order, class S>
Real taylorError(const PathExpansion<S>& expansion, const Moves& moves) {
  Real worst(0);
  for (std::size_t k = 0; k < moves.steps.size(); ++k) {
    const auto moved = movedPath<Order>(expansion, converted<S>(moves.steps[k]));
    for (std::size_t i = 0; i < moved.size(); ++i) {
      const Real error = length(converted<Real>(moved[i]) - moves.paths[k][i].x);
      if (error > worst) worst = error;
    }
  }
  return worst;
}

struct Orders {
  double linear[2] = {10, -10};  ///< least and greatest seen
  double quadratic[2] = {10, -10};
  double doubleFloor = 0.0;  ///< greatest error of double beyond that of 50 digits and a millionth
};

/// Checks one path; adds to what has been seen.
void checkPath(TestPath& path, Orders& orders) {
  const Vector<Real> p = converted<Real>(path.p);
  std::vector<PathVertex<Real>> base;
  ASSERT_TRUE(path.solve<Real>(p, base));
  const Real last = path.index<Real>(path.points.size());
  const auto expansion = expandPath<Real>(p, base, converted<Real>(path.q), last);
  ASSERT_EQ(expansion.status, PathStatus::Regular);
  constexpr int kFirstDecade = 8;
  Real before[2];
  for (int decade = kFirstDecade; decade <= kFirstDecade + 5; ++decade) {
    const Moves moves = exactMoves(path, base, p, pow(Real(10), -decade));
    ASSERT_TRUE(moves.solved);
    const Real errors[2] = {taylorError<1>(expansion, moves), taylorError<2>(expansion, moves)};
    if (decade > kFirstDecade) {
      const auto update = [&](double(&range)[2], int k) {
        const double slope = static_cast<double>(log10(before[k] / errors[k]));
        range[0] = std::min(range[0], slope);
        range[1] = std::max(range[1], slope);
      };
      update(orders.linear, 0);
      update(orders.quadratic, 1);
    }
    before[0] = errors[0];
    before[1] = errors[1];
  }
  // Double: the same error, and rounding.
  std::vector<PathVertex<double>> vertices;
  for (const PathVertex<Real>& v : base) {
    const Vector<double> x = converted<double>(v.x);
    vertices.push_back({x, jetAt<double>(path.surfaces[path.hit[vertices.size()]], x),
                        static_cast<double>(v.index)});
  }
  const auto rough =
      expandPath<double>(path.p, vertices, path.q, path.index<double>(path.points.size()));
  ASSERT_EQ(rough.status, PathStatus::Regular);
  for (const double h : {1e-3, 1e-4, 1e-5, 1e-6, 1e-7}) {
    const Moves moves = exactMoves(path, base, p, Real(h));
    const Real exact = taylorError<2>(expansion, moves);
    const Real seen = taylorError<2>(rough, moves);
    orders.doubleFloor =
        std::max(orders.doubleFloor, static_cast<double>(seen - Real(1 + 1e-6) * exact));
  }
}

TEST(PathOrder, EverySurfaceAndNumberOfBounces) {
  const Surface room = implicit::ellipsoidSurface({5.0, 6.0, 5.5});
  for (const test::NamedSurface& named : catalogue()) {
    for (const std::size_t bounces : {1, 2, 3, 5}) {
      TestPath path;
      path.surfaces = {named.surface, room};
      path.q = {{2.9, 1.3, -1.9}};
      std::mt19937 random(static_cast<unsigned>(bounces));
      Orders orders;
      int found = 0;
      for (int attempt = 0; attempt < 500 && found < 2; ++attempt) {
        const Point aim = 0.8 * randomDirection(random);
        if (!tracePath(path, aim - pointOf(path.q), bounces)) continue;
        ++found;
        checkPath(path, orders);
        if (HasFatalFailure()) FAIL() << named.name << ", " << bounces << " bounces";
      }
      ASSERT_EQ(found, 2) << named.name << ", " << bounces << " bounces";
      const std::string what = named.name + ", " + std::to_string(bounces) + " bounces";
      EXPECT_NEAR(orders.linear[0], 2.0, 0.01) << what;
      EXPECT_NEAR(orders.linear[1], 2.0, 0.01) << what;
      EXPECT_NEAR(orders.quadratic[0], 3.0, 0.01) << what;
      EXPECT_NEAR(orders.quadratic[1], 3.0, 0.01) << what;
      EXPECT_LT(orders.doubleFloor, 1e-12) << what;
    }
  }
}

TEST(PathOrder, RefractionThroughALens) {
  // Into glass through a front surface and out through the back: p below, q above.
  const auto lens = [](const Surface& front, const Surface& back, double y0, double y1) {
    TestPath path;
    path.surfaces = {back, front};
    path.p = {{0.3, -2.5, 0.2}};
    path.q = {{-0.2, 3.0, 0.4}};
    path.hit = {0, 1};
    path.points = {{{0.1, y0, 0.2}}, {{0.05, y1, 0.25}}};
    path.indices = {1.0, 1.5, 1.0};
    return path;
  };
  using namespace implicit;
  std::vector<TestPath> paths{
      lens(sphereSurface(1.0), sphereSurface(1.0), -0.97, 0.97),
      lens(placed(sphereSurface(3.0), glm::dmat3(1.0), {0, -2.8, 0}),
           placed(ellipsoidSurface({2, 1, 3}), glm::dmat3(1.0), {0, 0.8, 0}), -0.2, 0.2),
      lens(planeSurface({0, 1, 0}, 0.5, test::kBox), planeSurface({0.1, 1, 0}, -0.5, test::kBox),
           -0.5, 0.5)};
  // Refraction at the front of a ball, reflection inside its back, and out again: a rainbow's path.
  TestPath rainbow;
  rainbow.surfaces = {sphereSurface(1.0)};
  rainbow.hit = {0, 0, 0};
  rainbow.p = {{-0.7, 4.0, 0.0}};
  rainbow.q = {{0.9, 4.0, 0.3}};
  rainbow.points = {{{-0.25, 0.97, 0.0}}, {{0.0, -1.0, 0.1}}, {{0.3, 0.95, 0.1}}};
  rainbow.indices = {1.0, 1.33, 1.33, 1.0};
  paths.push_back(rainbow);
  for (TestPath& path : paths) {
    std::vector<PathVertex<Real>> base;
    ASSERT_TRUE(path.solve<Real>(converted<Real>(path.p), base));
    for (std::size_t i = 0; i < base.size(); ++i) {
      // Snell: index times sine is the same on both sides.
      path.points[i] = converted<double>(base[i].x);
      const auto& g = base[i].g;
      const Vector<Real> n =
          normalized(Vector<Real>{{g.gradient(0), g.gradient(1), g.gradient(2)}});
      const Vector<Real> in =
          normalized(base[i].x - (i > 0 ? base[i - 1].x : converted<Real>(path.p)));
      const Vector<Real> out =
          normalized((i + 1 < base.size() ? base[i + 1].x : converted<Real>(path.q)) - base[i].x);
      const Real difference = length(path.index<Real>(i) * cross(in, n)) -
                              length(path.index<Real>(i + 1) * cross(out, n));
      EXPECT_LT(static_cast<double>(abs(difference)), 1e-40);
    }
    Orders orders;
    checkPath(path, orders);
    EXPECT_NEAR(orders.linear[0], 2.0, 0.01);
    EXPECT_NEAR(orders.linear[1], 2.0, 0.01);
    EXPECT_NEAR(orders.quadratic[0], 3.0, 0.01);
    EXPECT_NEAR(orders.quadratic[1], 3.0, 0.01);
    EXPECT_LT(orders.doubleFloor, 1e-12);
  }
}

}  // namespace
}  // namespace catoptric::methods::perturbation
