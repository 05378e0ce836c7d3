// Implicit surfaces: derivatives against finite differences in 50 digits, statuses, bounds.
#include "scene/implicit/surface.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "core/error.h"
#include "scene/implicit/multiprecision_test.h"
#include "scene/implicit/test_surfaces.h"

namespace catoptric::implicit {
namespace {

using test::kBox;
using test::NamedSurface;

std::vector<NamedSurface> catalogue() {
  std::vector<NamedSurface> all = test::namedSurfaces();
  all.push_back({"vase", vaseSurface()});
  all.push_back({"formula", formulaSurface("sin(2*x)*cos(y) + atan(z)*exp(0.3*x) + log(4 + y) - "
                                           "max(x*y, z^3/5)^2 - tan(0.2*z) - 1.2",
                                           {}, kBox)});
  return all;
}

/// A point of space near the surface, seeded.
Point pointNear(const Surface& s, std::mt19937& random) {
  std::uniform_real_distribution<double> unit(0.05, 0.95);
  return s.domain.min +
         (s.domain.max - s.domain.min) * Point(unit(random), unit(random), unit(random));
}

using RealPoint = std::array<Real, 3>;

Real realValue(const Surface& s, const RealPoint& world) {
  const auto seeds = seedsAt<Real>(s.localFromWorld, world);
  return Evaluator<Real>(s.tape)(seeds[0].c[0], seeds[1].c[0], seeds[2].c[0]);
}
/// The derivative by the axes in `by`: nested central differences of values, in 50 digits.
Real difference(const Surface& s, RealPoint p, std::vector<std::size_t> by) {
  if (by.empty()) return realValue(s, p);
  const Real h("1e-10");
  const std::size_t axis = by.back();
  by.pop_back();
  RealPoint a = p;
  RealPoint b = p;
  a[axis] -= h;
  b[axis] += h;
  return (difference(s, b, by) - difference(s, a, by)) / (2 * h);
}

TEST(ImplicitSurface, JetsAreExactToRounding) {
  std::mt19937 random(3);
  for (NamedSurface& named : catalogue()) {
    const Surface s = placed(named.surface, glm::dmat3(1.1, 0.2, 0, -0.3, 0.9, 0.1, 0.2, 0, 1.3),
                             {0.1, -0.2, 0.3});
    double worst = 0.0;
    double worstReal = 0.0;
    for (int sample = 0; sample < 8; ++sample) {
      const Point inside = pointNear(named.surface, random);
      const Point world =
          glm::inverse(s.localFromWorld.linear) * (inside - s.localFromWorld.offset);
      Jet3<double> jet;
      ASSERT_EQ(derivativesAt(s, world, jet), PointStatus::Smooth) << named.name;
      const RealPoint p{Real(world.x), Real(world.y), Real(world.z)};
      const auto seeds = seedsAt<Real>(s.localFromWorld, p);
      const Jet3<Real> real = Evaluator<Jet3<Real>>(s.tape)(seeds[0], seeds[1], seeds[2]);
      // Against differences: their error is h^2 = 1e-20 times fifth derivatives.
      Jet3<Real> differences;
      differences.c[0] = difference(s, p, {});
      for (std::size_t i = 0; i < 3; ++i) {
        differences.c[1 + i] = difference(s, p, {i});
        for (std::size_t j = i; j < 3; ++j) {
          differences.c[kHessianIndex[i][j]] = difference(s, p, {i, j});
          for (std::size_t k = j; k < 3; ++k)
            differences.c[kThirdIndex[i][j][k]] = difference(s, p, {i, j, k});
        }
      }
      double scale = 0.0;
      for (const Real& v : real.c) scale = std::max(scale, std::abs(static_cast<double>(v)));
      for (std::size_t i = 0; i < 20; ++i) {
        worst = std::max(worst, static_cast<double>(abs(real.c[i] - Real(jet.c[i]))) / scale);
        worstReal =
            std::max(worstReal, static_cast<double>(abs(real.c[i] - differences.c[i])) / scale);
      }
    }
    EXPECT_LT(worst, 3e-15) << named.name;
    EXPECT_LT(worstReal, 1e-16) << named.name;
  }
}

TEST(ImplicitSurface, CatalogueIsWhereItShouldBe) {
  const auto zero = [](const Surface& s, const Point& p) {
    EXPECT_NEAR(valueAt(s, p), 0.0, 1e-14);
    EXPECT_TRUE(s.domain.contains(p));
  };
  zero(planeSurface({0, 2, 0}, 1.0, kBox), {1.3, 0.5, -0.7});
  zero(sphereSurface(1.5), {0.9, 0, -1.2});
  zero(ellipsoidSurface({1, 2, 3}), {0, 1.2, 2.4});
  zero(cylinderSurface(1.0, 4.0), {0.6, 1.7, 0.8});
  zero(coneSurface(1.0, 2.0), {0.3, -1.0, 0.4});
  zero(torusSurface(2.0, 0.5), {1.2, 0.5, 1.6});
  zero(superquadricSurface({1, 2, 3}, 1.0, 1.0), {0, 1.2, 2.4});
  zero(metaballsSurface({{0, 1, 0, 0.5}}, 3.0), {0.3, 1.4, 0});
  // The paper's vase at t = 1/2: 0.725 - 2.445 + 1.95 + 0.47
  zero(vaseSurface(), {0.0, 1.0, -0.7});
}

TEST(ImplicitSurface, PointsWithoutAUsefulGradientAreNamed) {
  Jet3<double> jet;
  EXPECT_EQ(derivativesAt(vaseSurface(), {0, 1, 0}, jet), PointStatus::NoGradient);
  EXPECT_EQ(derivativesAt(torusSurface(1, 0.3), {0, 0.1, 0}, jet), PointStatus::NoGradient);
  EXPECT_EQ(derivativesAt(coneSurface(1, 2), {0, 0, 0}, jet), PointStatus::ZeroGradient);
  EXPECT_EQ(derivativesAt(coneSurface(1, 2), {0, -1e-13, 0}, jet), PointStatus::ZeroGradient);
  EXPECT_EQ(derivativesAt(coneSurface(1, 2), {0.005, -0.01, 0}, jet), PointStatus::Smooth);
  EXPECT_EQ(derivativesAt(sphereSurface(1), {0, 0, 0}, jet), PointStatus::ZeroGradient);
  const auto status = [&](const std::string& f, const Point& p) {
    return derivativesAt(formulaSurface(f, {}, kBox), p, jet);
  };
  EXPECT_EQ(status("abs(x) - y", {0, 0, 0}), PointStatus::NoGradient);
  EXPECT_EQ(status("abs(x) - y", {0.1, 0, 0}), PointStatus::Smooth);
  EXPECT_EQ(status("min(x, y)", {1, 1, 0}), PointStatus::NoGradient);
  EXPECT_EQ(status("max(x, x) - y", {1, 1, 0}), PointStatus::Smooth);
  EXPECT_EQ(status("abs(x)^2.5 - y", {0, 0, 0}), PointStatus::NoGradient);
  EXPECT_EQ(status("abs(x)^3.5 - y", {0, 0, 0}), PointStatus::Smooth);
  EXPECT_EQ(status("sqrt(x) - y", {-1, 0, 0}), PointStatus::NotFinite);
  EXPECT_EQ(status("1/x - y", {0, 0, 0}), PointStatus::NotFinite);
  EXPECT_EQ(status("x*y*z", {0, 0, 0}), PointStatus::ZeroGradient);
  EXPECT_EQ(status("0*x", {1, 1, 1}), PointStatus::ZeroGradient);
  // The same in scenes of any size.
  for (const double scale : {1e-4, 1e5}) {
    const Surface cone = placed(coneSurface(1, 2), glm::dmat3(scale), {scale, 0, 0});
    EXPECT_EQ(derivativesAt(cone, {scale, 0, 0}, jet), PointStatus::ZeroGradient);
    EXPECT_EQ(derivativesAt(cone, {1.01 * scale, -0.02 * scale, 0}, jet), PointStatus::Smooth);
  }
}

TEST(ImplicitSurface, BoundsHoldTheSurfaceTightly) {
  const Domain ball = boundsOf(formulaSurface("x^2 + y^2 + z^2 - 1", {}, kBox));
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_LE(ball.min[axis], -1.0);
    EXPECT_GE(ball.min[axis], -1.0 - 4.0 / 32);
    EXPECT_GE(ball.max[axis], 1.0);
    EXPECT_LE(ball.max[axis], 1.0 + 4.0 / 32);
  }
  EXPECT_TRUE(boundsOf(formulaSurface("x^2 + y^2 + z^2 + 0.1", {}, kBox)).empty());
  EXPECT_TRUE(boundsOf(formulaSurface("sqrt(x - 5)", {}, kBox)).empty());
  const Domain everywhere = boundsOf(formulaSurface("0*x", {}, kBox));
  EXPECT_EQ(everywhere.min, kBox.min);
  const Domain moved = boundsOf(placed(sphereSurface(1.0), glm::dmat3(1e-4), {5, 0, 0}));
  EXPECT_NEAR(moved.min.x, 5 - 1e-4, 1e-5);
  EXPECT_NEAR(moved.max.y, 1e-4, 1e-5);
}

TEST(ImplicitSurface, SizesAreChecked) {
  EXPECT_THROW(sphereSurface(0.0), SceneError);
  EXPECT_THROW(sphereSurface(std::nan("")), SceneError);
  EXPECT_THROW(ellipsoidSurface({1, -1, 1}), SceneError);
  EXPECT_THROW(planeSurface({0, 0, 0}, 1, kBox), SceneError);
  EXPECT_THROW(torusSurface(1, std::numeric_limits<double>::infinity()), SceneError);
  EXPECT_THROW(superquadricSurface({1, 1, 1}, 0.0, 1.0), SceneError);
  EXPECT_THROW(metaballsSurface({}, 1.0), SceneError);
  EXPECT_THROW(revolutionSurface({1.0}, 1.0, 1.0), SceneError);
  EXPECT_THROW(revolutionSurface({-1.0}, 0.0, 1.0), SceneError);
  EXPECT_THROW(quadricSurface({}, kBox), SceneError);
  EXPECT_THROW(formulaSurface("x", {}, Domain{}), SceneError);
  EXPECT_THROW(placed(sphereSurface(1.0), glm::dmat3(0.0), {}), SceneError);
}

}  // namespace
}  // namespace catoptric::implicit
