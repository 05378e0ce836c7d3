// Rays and implicit surfaces: against closed forms, against dense sampling and roots in 50 digits.
#include <gtest/gtest.h>

#include <random>

#include "scene/implicit/multiprecision_test.h"
#include "scene/implicit/surface.h"
#include "scene/implicit/test_surfaces.h"

namespace catoptric::implicit {
namespace {

using test::kBox;

Point onSphere(std::mt19937& random) {
  std::normal_distribution<double> normal;
  return glm::normalize(Point(normal(random), normal(random), normal(random)));
}

/// The same surface with the general root finder.
Surface general(Surface s) {
  s.quadric.reset();
  return s;
}

TEST(ImplicitRay, GeneralSearchFindsWhatTheClosedFormsFind) {
  std::mt19937 random(5);
  const std::vector<Surface> surfaces{
      sphereSurface(1.0),
      ellipsoidSurface({1.0, 0.6, 1.5}),
      cylinderSurface(0.7, 2.0),
      coneSurface(1.0, 1.7),
      planeSurface({1, 2, 3}, 0.4, kBox),
      quadricSurface({1, -0.5, 0.7, 0.2, -0.3, 0.4, 0.1, -0.2, 0.3, -0.6}, kBox)};
  int hits = 0;
  for (const Surface& s : surfaces) {
    for (int i = 0; i < 500; ++i) {
      const Point o = 4.0 * onSphere(random);
      const SurfaceRay ray{o, glm::normalize(0.7 * onSphere(random) - o)};
      HitStatus a{};
      HitStatus b{};
      const auto closed = allHits(s, ray, a);
      const auto found = allHits(general(s), ray, b);
      ASSERT_EQ(a, b);
      ASSERT_EQ(closed.size(), found.size());
      for (std::size_t k = 0; k < closed.size(); ++k) {
        // Grazing rays lose digits; the value says how far off they are.
        EXPECT_NEAR(closed[k], found[k], 1e-11);
        ++hits;
      }
    }
  }
  EXPECT_GT(hits, 1500);
}

/// A zero of g along the ray near t, in 50 digits, by bisection.
Real exactRoot(const Surface& s, const SurfaceRay& ray, double t, double width) {
  const Evaluator<Real> start(s.tape);
  Evaluator<Real> evaluate = start;
  const auto value = [&](const Real& at) {
    std::array<Real, 3> p;
    for (std::size_t i = 0; i < 3; ++i)
      p[i] = Real(ray.origin[static_cast<int>(i)]) + at * Real(ray.direction[static_cast<int>(i)]);
    const auto seeds = seedsAt<Real>(s.localFromWorld, p);
    return evaluate(seeds[0].c[0], seeds[1].c[0], seeds[2].c[0]);
  };
  Real a = Real(t) - width;
  Real b = Real(t) + width;
  const bool negative = value(a) < 0;
  if (negative == (value(b) < 0)) return std::numeric_limits<Real>::quiet_NaN();
  for (int i = 0; i < 80; ++i) {
    const Real m = (a + b) / 2;
    ((value(m) < 0) == negative ? a : b) = m;
  }
  return a;
}

TEST(ImplicitRay, MissesNoneThatDenseSamplingSees) {
  std::mt19937 random(6);
  const std::vector<Surface> surfaces{
      torusSurface(1.0, 0.35),
      vaseSurface(),
      superquadricSurface({1.0, 0.8, 1.1}, 0.6, 0.45),
      metaballsSurface({{0, 0, 0, 0.7}, {0.8, 0.2, 0, 0.5}, {0.1, 0.9, 0.3, 0.4}}, 2.0),
      formulaSurface("sin(5*x)*cos(5*y) + sin(5*y)*cos(5*z) + sin(5*z)*cos(5*x)", {}, kBox),
      formulaSurface("max(x^2 + y^2 + z^2 - 1, 0.25 - abs(x)*y)", {}, kBox)};
  for (const double scale : {1.0, 1e-4, 1e5}) {
    int crossings = 0;
    int exact = 0;
    double worst = 0.0;
    for (const Surface& local : surfaces) {
      const Surface s = placed(local, glm::dmat3(scale), Point(0.3, -0.2, 0.1) * scale);
      for (int i = 0; i < 60; ++i) {
        const Point o = 4.0 * onSphere(random);
        const SurfaceRay ray{o * scale, glm::normalize(0.7 * onSphere(random) - o)};
        HitStatus status{};
        const auto found = allHits(s, ray, status);
        ASSERT_NE(status, HitStatus::Unresolved);
        // Signs on a fine grid inside the domain.
        constexpr int kSamples = 10'000;
        const double step = 8.0 * scale / glm::length(ray.direction) / kSamples;
        std::vector<double> seen;
        double before = 0.0;
        bool had = false;
        for (int k = 0; k <= kSamples; ++k) {
          const Point p = ray.origin + (k * step) * ray.direction;
          const bool inside = s.domain.contains(s.localFromWorld(p));
          const double v = inside ? valueAt(s, p) : 0.0;
          if (inside && had && (v < 0) != (before < 0)) seen.push_back((k - 0.5) * step);
          had = inside;
          before = v;
        }
        std::size_t matched = 0;
        for (const double t : seen) {
          for (const double f : found) {
            if (std::abs(f - t) <= 0.51 * step) {
              ++matched;
              break;
            }
          }
        }
        ASSERT_EQ(matched, seen.size());
        // What sampling did not see are pairs within a step, and hits in the domain's first and
        // last step.
        crossings += static_cast<int>(seen.size());
        if (found.empty() || i % 6 != 0) continue;
        const Real root = exactRoot(s, ray, found[0], 1e-5 * step);
        if (isnan(root)) continue;
        ++exact;
        worst = std::max(worst, std::abs(static_cast<double>(root - Real(found[0]))) / (4 * scale));
      }
    }
    EXPECT_GT(crossings, 300);
    EXPECT_GT(exact, 20);
    EXPECT_LT(worst, 2e-15) << scale;
  }
}

TEST(ImplicitRay, SignsOfAPolynomialFindWhatIntervalsFind) {
  const std::vector<std::string> formulas{
      "x^4 + y^4 + z^4 - 5*(x^2 + y^2 + z^2) + 11.6",
      "sqrt(x^2 + z^2) - (0.47 + (1.95 - (2.445 - 0.725*y)*y)*y)",
      "(sqrt(x^2 + z^2) - 1)^2 + y^2 - 0.1",
      "y/2 - x*sqrt(x^2 + y^2) + z^3",
      "0.3 + x - sqrt(1 - x^2 - z^2)",
      "(x^2 - 1)^2*(y + 2)/3 - z^2*(z - 1)^2"};
  std::mt19937 random(8);
  for (const std::string& formula : formulas) {
    const Surface polynomial = formulaSurface(formula, {}, kBox);
    // The same g, but no polynomial
    const Surface other = formulaSurface(formula + " + 0*exp(x)", {}, kBox);
    int hits = 0;
    int grazing = 0;
    for (int i = 0; i < 400; ++i) {
      const Point o = 4.0 * onSphere(random);
      SurfaceRay ray{o, glm::normalize(1.2 * onSphere(random) - o)};
      const SurfaceHit first = firstHit(polynomial, ray);
      if (i % 2 == 1 && first.status == HitStatus::Hit) {
        // From the surface, almost along it
        Jet3<double> jet;
        const Point x = ray.origin + first.t * ray.direction;
        if (derivativesAt(polynomial, x, jet) != PointStatus::Smooth) continue;
        const Point n = glm::normalize(Point(jet.c[1], jet.c[2], jet.c[3]));
        ray = {x, glm::normalize(glm::cross(n, onSphere(random)) + 1e-3 * n), 1e-3};
      }
      HitStatus a{};
      HitStatus b{};
      const auto found = allHits(polynomial, ray, a);
      const auto expected = allHits(other, ray, b);
      ASSERT_EQ(a, b) << formula << " " << i;
      ASSERT_EQ(found.size(), expected.size()) << formula << " " << i;
      for (std::size_t k = 0; k < found.size(); ++k) {
        Jet3<double> jet;
        const Point x = ray.origin + expected[k] * ray.direction;
        ASSERT_NE(derivativesAt(polynomial, x, jet), PointStatus::NotFinite);
        const double slope = std::abs(glm::dot(Point(jet.c[1], jet.c[2], jet.c[3]), ray.direction));
        EXPECT_NEAR(found[k], expected[k], 1e-14 * (1.0 + 1.0 / slope)) << formula << " " << i;
        ++hits;
      }
      if (firstHit(polynomial, ray).grazing) ++grazing;
    }
    EXPECT_GT(hits, 100) << formula;
    EXPECT_LT(grazing, 20) << formula;
  }
}

TEST(ImplicitRay, SphereToRoundingFromAnyDistanceAndSize) {
  for (const double scale : {1e-4, 1.0, 1e5}) {
    for (const bool closed : {true, false}) {
      const Surface ball = placed(closed ? sphereSurface(1.0) : general(sphereSurface(1.0)),
                                  glm::dmat3(scale), Point(0.0));
      for (const double offset : {0.0, 0.3, 0.999, 0.999999, 1.0 - 1e-12}) {
        const SurfaceHit hit = firstHit(ball, {{offset * scale, 0, 3 * scale}, {0, 0, -1}});
        ASSERT_EQ(hit.status, HitStatus::Hit) << offset << " " << closed;
        const double expected = 3.0 - std::sqrt((1 - offset) * (1 + offset));
        // A root's error is rounding / slope.
        const double slope = std::sqrt((1 - offset) * (1 + offset));
        EXPECT_NEAR(hit.t / scale, expected, 2e-15 * (3 + 1 / slope)) << offset << " " << closed;
      }
      for (const double offset : {1.0 + 1e-12, 1.0000001, 1.5}) {
        EXPECT_EQ(firstHit(ball, {{offset * scale, 0, 3 * scale}, {0, 0, -1}}).status,
                  HitStatus::Miss)
            << offset << " " << closed;
      }
    }
  }
}

TEST(ImplicitRay, FindsPairsDownToItsResolution) {
  // The ray is 4 long inside the box, so the stated resolution is 4e-9.
  for (const double gap : {1e-3, 1e-6, 1e-8}) {
    const Surface s = formulaSurface("(x - 0.3)*(x - 0.3 - d)*(y + 3)", {{"d", gap}}, kBox);
    HitStatus status{};
    const auto hits = allHits(s, {{-3, 0, 0}, {1, 0, 0}}, status);
    ASSERT_EQ(hits.size(), 2u) << gap;
    EXPECT_NEAR(hits[1] - hits[0], gap, 1e-14);
  }
}

TEST(ImplicitRay, TorusSeenThroughItsHole) {
  const Surface torus = torusSurface(1.0, 0.25);
  EXPECT_EQ(firstHit(torus, {{0, 3, 0}, {0, -1, 0}}).status, HitStatus::Miss);
  EXPECT_EQ(firstHit(torus, {{0.74999, 3, 0}, {0, -1, 0}}).status, HitStatus::Miss);
  const SurfaceHit inner = firstHit(torus, {{0.75001, 3, 0}, {0, -1, 0}});
  EXPECT_EQ(inner.status, HitStatus::Hit);
  EXPECT_NEAR(inner.t, 3 - std::sqrt(0.25 * 0.25 - 0.24999 * 0.24999), 1e-12);
  // Four crossings along the equator: 0.75, 1.25 on both sides.
  HitStatus status{};
  const auto hits = allHits(torus, {{-3, 0, 0}, {1, 0, 0}}, status);
  ASSERT_EQ(hits.size(), 4u);
  EXPECT_NEAR(hits[0], 1.75, 1e-14);
  EXPECT_NEAR(hits[1], 2.25, 1e-14);
  EXPECT_NEAR(hits[2], 3.75, 1e-14);
  EXPECT_NEAR(hits[3], 4.25, 1e-14);
  // Lying on its top plane: a touch on a circle's tangent is no crossing.
  const SurfaceHit touch = firstHit(torus, {{-3, 0.25, 0}, {1, 0, 0}});
  EXPECT_EQ(touch.status, HitStatus::Miss);
  EXPECT_TRUE(touch.grazing);
}

TEST(ImplicitRay, FormulasThatAreNoSurfacesGetAnAnswer) {
  const SurfaceRay ray{{-3, 0.1, 0.2}, {1, 0, 0}};
  const auto hit = [&](const std::string& f) { return firstHit(formulaSurface(f, {}, kBox), ray); };
  EXPECT_EQ(hit("x^2 + 1").status, HitStatus::Miss);
  EXPECT_FALSE(hit("x^2 + 1").grazing);
  EXPECT_EQ(hit("0*x").status, HitStatus::Unresolved);
  EXPECT_EQ(hit("x - x").status, HitStatus::Unresolved);
  EXPECT_EQ(hit("sqrt(x - 7)").status, HitStatus::Miss);
  EXPECT_EQ(hit("log(-1 - x^2)").status, HitStatus::Miss);
  EXPECT_EQ(hit("1/x").status, HitStatus::Miss) << "a pole is no crossing";
  EXPECT_EQ(hit("x/abs(x)").status, HitStatus::Miss) << "nor is a jump";
  EXPECT_EQ(hit("tan(x)").status, HitStatus::Hit);
  EXPECT_NEAR(hit("tan(x)").t, 3.0, 1e-14) << "poles at -pi/2 are passed over";
  EXPECT_EQ(hit("x^2").status, HitStatus::Miss);
  EXPECT_TRUE(hit("x^2").grazing);
  EXPECT_NEAR(hit("x^3").t, 3.0, 1e-5);
  EXPECT_NEAR(hit("sqrt(x + 1) - 1").t, 3.0, 1e-14) << "undefined before -1";
}

TEST(ImplicitRay, RaysThatAreNoneMiss) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  for (const Surface& s : {sphereSurface(1.0), general(sphereSurface(1.0)), vaseSurface()}) {
    for (const SurfaceRay& ray : std::vector<SurfaceRay>{{{nan, 0, 0}, {1, 0, 0}},
                                                         {{-3, 0.5, 0}, {nan, 0, 0}},
                                                         {{-3, 0.5, 0}, {0, 0, 0}},
                                                         {{0.1, 0.5, 0}, {0, 0, 0}, 0.0, 5.0},
                                                         {{-3, 0.5, 0}, {1, 0, 0}, nan},
                                                         {{-3, 0.5, 0}, {1, 0, 0}, 0.0, nan},
                                                         {{-infinity, 0, 0}, {1, 0, 0}},
                                                         {{-3, 0.5, 0}, {infinity, 0, 0}},
                                                         {{-3, 0.5, 0}, {1, 0, 0}, 5.0, 2.0}}) {
      const SurfaceHit hit = firstHit(s, ray);
      EXPECT_EQ(hit.status, HitStatus::Miss);
    }
  }
}

TEST(ImplicitRay, RespectsItsRangeAndTheDomain) {
  const Surface ball = sphereSurface(1.0);
  for (const Surface& s : {ball, general(ball)}) {
    EXPECT_NEAR(firstHit(s, {{-3, 0, 0}, {1, 0, 0}, 2.5}).t, 4.0, 1e-14);
    EXPECT_EQ(firstHit(s, {{-3, 0, 0}, {1, 0, 0}, 0.0, 1.9}).status, HitStatus::Miss);
    EXPECT_EQ(firstHit(s, {{-3, 0, 0}, {-1, 0, 0}}).status, HitStatus::Miss);
    EXPECT_NEAR(firstHit(s, {{-3, 0, 0}, {0.5, 0, 0}}).t, 4.0, 1e-14);
  }
  // A cylinder is open: rays pass through its ends.
  const Surface tube = cylinderSurface(1.0, 2.0);
  EXPECT_EQ(firstHit(tube, {{0.2, 5, 0}, {0, -1, 0}}).status, HitStatus::Miss);
  EXPECT_EQ(firstHit(tube, {{-5, 1.1, 0}, {1, 0, 0}}).status, HitStatus::Miss);
  EXPECT_NEAR(firstHit(tube, {{0, 0, 0}, {1, 0, 0}}).t, 1.0, 1e-14);
}

}  // namespace
}  // namespace catoptric::implicit
