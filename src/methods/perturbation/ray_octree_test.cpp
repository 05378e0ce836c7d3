// The octree's guarantee against brute force, its coherent look-up, and the paper's groups.
#include "methods/perturbation/ray_octree.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "methods/perturbation/test_path_calculus.h"
#include "scene/implicit/surface.h"

namespace catoptric::methods::perturbation {
namespace {

using glm::dvec3;

std::vector<SampleRay> randomRays(std::size_t count, double scale, std::mt19937& random) {
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  std::vector<SampleRay> rays;
  while (rays.size() < count) {
    const dvec3 d(unit(random), unit(random), unit(random));
    if (glm::length(d) < 0.1) continue;
    SampleRay ray{scale * dvec3(unit(random), unit(random), unit(random)), glm::normalize(d)};
    if (rays.size() % 3 == 0) ray.length = scale * (0.2 + std::abs(unit(random)));
    rays.push_back(ray);
  }
  return rays;
}

/// The mirror rays of a vase seen by a camera of width x height samples.
struct VaseSamples {
  implicit::Surface vase = implicit::vaseSurface();
  dvec3 eye{0.5, 1.6, 4.0};
  std::vector<SampleRay> rays;
  std::vector<Neighbours> neighbours;
  std::vector<Bounce<double>> bounces;

  VaseSamples(int width, int height) {
    std::vector<std::uint32_t> rayAt;
    for (int i = 0; i < width * height; ++i) {
      rayAt.push_back(kNoRay);
      const dvec3 target(2.4 * (i % width + 0.5) / width - 1.2,
                         2.2 * (0.5 + i / width) / height - 0.1, 0.0);
      const dvec3 d = glm::normalize(target - eye);
      const auto hit = implicit::firstHit(vase, {eye, d});
      if (hit.status != implicit::HitStatus::Hit) continue;
      const dvec3 x = eye + hit.t * d;
      PathVertex<double> vertex{vectorOf(x), {}, 1.0};
      if (implicit::derivativesAt(vase, x, vertex.g) != implicit::PointStatus::Smooth) continue;
      const dvec3 out = glm::reflect(d, normalOf(vertex.g));
      const auto e = expandPath<double>(vectorOf(x + out), {vertex}, vectorOf(eye));
      if (e.status != PathStatus::Regular) continue;
      rayAt.back() = static_cast<std::uint32_t>(rays.size());
      const auto next = implicit::firstHit(vase, {x, out, 1e-6});
      rays.push_back({x, out});
      if (next.status == implicit::HitStatus::Hit) rays.back().length = next.t;
      bounces.push_back(e.bounces[0]);
    }
    neighbours = gridNeighbours(width, height, rayAt);
  }
  static Vector<double> vectorOf(const dvec3& p) { return {{p.x, p.y, p.z}}; }
  static dvec3 normalOf(const Jet3<double>& g) {
    return glm::normalize(dvec3(g.c[1], g.c[2], g.c[3]));
  }
  /// Where a ray says that the reflection of `point` is.
  dvec3 predicted(std::uint32_t ray, const dvec3& point) const {
    const double t = nearestParameter(rays[ray], point);
    const dvec3 step = point - (rays[ray].origin + t * rays[ray].direction);
    const auto x = movedPoint<2>(bounces[ray], t, vectorOf(step));
    return {x[0], x[1], x[2]};
  }
  /// All reflections of `point` that the eye sees: Newton's method from a ray near each of them.
  std::vector<dvec3> exact(const dvec3& point) const {
    std::vector<dvec3> found;
    for (std::uint32_t ray = 0; ray < rays.size(); ++ray) {
      const double distance = distanceTo(rays[ray], point);
      bool minimum = distance < 0.3;
      for (const std::uint32_t other : neighbours[ray])
        minimum = minimum && (other == kNoRay || distanceTo(rays[other], point) >= distance);
      if (!minimum) continue;
      std::vector<PathVertex<double>> path{{vectorOf(rays[ray].origin), {}, 1.0}};
      const auto surfaceAt = [&](std::size_t, const Vector<double>& x, Jet3<double>& jet) {
        return implicit::derivativesAt(vase, {x[0], x[1], x[2]}, jet) ==
               implicit::PointStatus::Smooth;
      };
      if (!solvePath<double>(vectorOf(point), vectorOf(eye), surfaceAt, 1.0, 1e-12, path)) continue;
      const dvec3 x(path[0].x[0], path[0].x[1], path[0].x[2]);
      const dvec3 n = normalOf(path[0].g);
      const auto seen = implicit::firstHit(vase, {eye, x - eye});
      const bool visible =
          vase.domain.contains(x) && glm::dot(n, point - x) > 0.0 && glm::dot(n, eye - x) > 0.0 &&
          seen.status == implicit::HitStatus::Hit && std::abs(seen.t - 1.0) < 1e-6 &&
          implicit::firstHit(vase, {x, point - x, 1e-6, 1.0}).status == implicit::HitStatus::Miss;
      const bool known = std::any_of(found.begin(), found.end(),
                                     [&](const dvec3& f) { return glm::distance(f, x) < 1e-6; });
      if (visible && !known) found.push_back(x);
    }
    return found;
  }
};

std::vector<NearRay> bruteForce(const std::vector<SampleRay>& rays, const dvec3& p, std::size_t k) {
  std::vector<NearRay> all;
  for (std::uint32_t i = 0; i < rays.size(); ++i) all.push_back({i, distanceTo(rays[i], p)});
  std::sort(all.begin(), all.end(), [](const NearRay& a, const NearRay& b) {
    return a.distance < b.distance || (a.distance == b.distance && a.ray < b.ray);
  });
  all.resize(std::min(all.size(), k));
  return all;
}

TEST(RayOctree, NeverMissesOneOfTheNearest) {
  std::mt19937 random(7);
  for (const double scale : {1e-4, 1.0, 1e5}) {
    for (const std::size_t count : {0, 1, 4, 5, 6, 300}) {
      for (const std::size_t k : {1, 5}) {
        RayOctree::Settings settings;
        settings.k = k;
        settings.maxDepth = 4;
        settings.leafSize = 8;
        const auto rays = randomRays(count, scale, random);
        const RayOctree tree(rays, dvec3(-scale), dvec3(scale), settings);
        RayOctree::Cursor cursor;
        std::vector<NearRay> found;
        std::uniform_real_distribution<double> wide(-1.2 * scale, 1.2 * scale);
        for (int i = 0; i < 400; ++i) {
          const dvec3 p(wide(random), wide(random), wide(random));
          tree.nearest(p, cursor, found);
          const auto expected = bruteForce(rays, p, k);
          ASSERT_EQ(found.size(), expected.size());
          for (std::size_t j = 0; j < found.size(); ++j) ASSERT_EQ(found[j].ray, expected[j].ray);
        }
        EXPECT_GT(cursor.outside, 50u);
        // The box has its own corners: scenes' floors lie there
        const std::uint64_t outside = cursor.outside;
        for (int corner = 0; corner < 8; ++corner) {
          const dvec3 p((corner & 1) != 0 ? scale : -scale, (corner & 2) != 0 ? scale : -scale,
                        (corner & 4) != 0 ? scale : -scale);
          tree.nearest(p, cursor, found);
          const auto expected = bruteForce(rays, p, k);
          ASSERT_EQ(found.size(), expected.size());
          for (std::size_t j = 0; j < found.size(); ++j) ASSERT_EQ(found[j].ray, expected[j].ray);
        }
        EXPECT_EQ(cursor.outside, outside);
      }
    }
  }
}

TEST(RayOctree, CellsOnTheirBordersAndRaysAtOnePoint) {
  // All rays through one point, which is a corner of cells; equal rays.
  std::mt19937 random(8);
  std::vector<SampleRay> rays = randomRays(100, 1.0, random);
  for (SampleRay& ray : rays) ray.origin = dvec3(0.0);
  rays.insert(rays.end(), rays.begin(), rays.begin() + 50);
  const RayOctree tree(rays, dvec3(-1), dvec3(1), {});
  RayOctree::Cursor cursor;
  std::vector<NearRay> found;
  for (const dvec3& p : {dvec3(0.0), dvec3(-1.0), dvec3(0.5, 0.25, 0.125), dvec3(0, 0, 1 - 1e-16),
                         dvec3(1e-300, -1e-300, 0)}) {
    tree.nearest(p, cursor, found);
    const auto expected = bruteForce(rays, p, 5);
    for (std::size_t j = 0; j < 5; ++j) EXPECT_EQ(found[j].ray, expected[j].ray);
  }
}

TEST(RayOctree, ServesTheVaseWithFewCandidatesAndSteps) {
  const auto rays = VaseSamples(80, 60).rays;
  ASSERT_GT(rays.size(), 800u);
  const RayOctree tree(rays, {-3, -1, -1}, {3, 4, 5}, {});
  RayOctree::Cursor along;
  RayOctree::Cursor fresh;
  std::vector<NearRay> found;
  std::uint64_t candidates = 0;
  std::uint64_t freshSteps = 0;
  constexpr int kPoints = 2000;
  for (int i = 0; i < kPoints; ++i) {
    // A curve of near points.
    const double t = 2.0 * std::numbers::pi * i / kPoints;
    const dvec3 p(1.5 * std::cos(t), 1.0 + 0.5 * std::sin(3 * t), 2.0 + std::sin(t));
    fresh = {};
    candidates += tree.candidates(p, fresh).size();
    freshSteps += fresh.steps;
    tree.nearest(p, along, found);
    const auto expected = bruteForce(rays, p, 5);
    for (std::size_t j = 0; j < 5; ++j) ASSERT_EQ(found[j].ray, expected[j].ray);
  }
  // A tenth of the rays and a third of the steps, or better.
  EXPECT_LT(candidates, kPoints * rays.size() / 10);
  EXPECT_LT(along.steps, freshSteps / 3);
}

TEST(RayOctree, ARayMayStandForASquareOfTheGrid) {
  // 0 in the middle of nine squares, beside it a column of three, below nothing
  const std::vector<std::uint32_t> rayAt{0, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0, 3};
  const std::vector<Neighbours> neighbours = gridNeighbours(4, 3, rayAt);
  constexpr std::uint32_t kNone = kNoRay;
  ASSERT_EQ(neighbours.size(), 4u);
  EXPECT_EQ(neighbours[0], (Neighbours{kNone, kNone, kNone, kNone, 2, kNone, kNone, kNone}));
  EXPECT_EQ(neighbours[1], (Neighbours{kNone, kNone, kNone, 0, kNone, 0, 2, kNone}));
  EXPECT_EQ(neighbours[2], (Neighbours{0, 1, kNone, 0, kNone, 0, 3, kNone}));
}

TEST(RayOctree, FindsEveryMinimumAmongNeighbours) {
  const VaseSamples samples(40, 30);
  const RayOctree tree(samples.rays, {-3, -1, -1}, {3, 4, 5}, {}, samples.neighbours);
  // One cell is brute force.
  RayOctree::Settings oneCell;
  oneCell.maxDepth = 0;
  const RayOctree all(samples.rays, {-3, -1, -1}, {3, 4, 5}, oneCell, samples.neighbours);
  std::mt19937 random(10);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  RayOctree::Cursor a;
  RayOctree::Cursor b;
  std::vector<NearRay> found;
  std::vector<NearRay> expected;
  std::size_t minima = 0;
  std::size_t candidates = 0;
  constexpr int kPoints = 3000;
  for (int i = 0; i < kPoints; ++i) {
    const dvec3 p(7.0 * unit(random) - 3.5, 6.0 * unit(random) - 1.5, 6.5 * unit(random) - 1.5);
    tree.reflections(p, a, found);
    all.reflections(p, b, expected);
    ASSERT_EQ(found.size(), expected.size());
    for (std::size_t k = 0; k < found.size(); ++k) ASSERT_EQ(found[k].ray, expected[k].ray);
    minima += found.size();
    if (a.outside == 0) candidates += tree.candidates(p, a).size();
  }
  EXPECT_GT(minima, 1000u);
  EXPECT_LT(candidates, samples.rays.size() * kPoints / 8);
}

/// How well a choice of rays finds the reflections of points before the vase.
struct Score {
  std::size_t reflections = 0;  ///< that there are
  std::size_t found = 0;        ///< predicted within 0.05
  std::size_t extra = 0;        ///< predictions of none, or of one twice
};

TEST(RayOctree, MinimaFindTheReflectionsThatTheNearestRaysMiss) {
  const VaseSamples dense(160, 120);
  const VaseSamples samples(40, 30);
  const RayOctree nearest(samples.rays, {-3, -1, -1}, {3, 4, 5}, {});
  const RayOctree minima(samples.rays, {-3, -1, -1}, {3, 4, 5}, {}, samples.neighbours);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  Score paper;
  Score ours;
  int points = 0;
  RayOctree::Cursor a;
  RayOctree::Cursor b;
  std::vector<NearRay> near;
  for (int i = 0; i < 200; ++i) {
    const dvec3 p(4.0 * unit(random) - 2.0, 2.2 * unit(random) - 0.1, 0.2 + 2.8 * unit(random));
    if (implicit::valueAt(samples.vase, p) < 0.1) continue;
    ++points;
    const std::vector<dvec3> exact = dense.exact(p);
    const auto judge = [&](const std::vector<std::uint32_t>& rays, Score& score) {
      std::vector<bool> seen(exact.size(), false);
      for (const std::uint32_t ray : rays) {
        const dvec3 x = samples.predicted(ray, p);
        const auto match = std::find_if(exact.begin(), exact.end(),
                                        [&](const dvec3& e) { return glm::distance(e, x) < 0.05; });
        if (match == exact.end() || seen[static_cast<std::size_t>(match - exact.begin())]) {
          ++score.extra;
        } else {
          seen[static_cast<std::size_t>(match - exact.begin())] = true;
          ++score.found;
        }
      }
      score.reflections += exact.size();
    };
    // The best thresholds that we found for this vase.
    nearest.nearest(p, a, near);
    judge(groupRepresentatives(samples.rays, near, {0.7, 0.4}), paper);
    minima.reflections(p, b, near);
    std::vector<std::uint32_t> rays;
    for (const NearRay& n : near) rays.push_back(n.ray);
    judge(rays, ours);
  }
  // Almost every point has two: at the neck and at the belly.
  EXPECT_EQ(points, 192);
  EXPECT_GT(ours.reflections, 300u);
  EXPECT_EQ(ours.found, ours.reflections);
  EXPECT_LT(ours.extra, ours.reflections / 25);
  EXPECT_LT(paper.found, 9 * paper.reflections / 10);
}

TEST(RayGroups, SplitByReflectionPointAndDirection) {
  const std::vector<SampleRay> rays{{{0, 0, 0}, {1, 0, 0}},
                                    {{0.05, 0, 0}, {1, 0, 0}},
                                    {{0, 1, 0}, {1, 0, 0}},
                                    {{0, 0, 0}, {0, 1, 0}},
                                    {{0, 1.05, 0}, {1, 0, 0}}};
  std::vector<NearRay> nearest;
  for (std::uint32_t i = 0; i < 5; ++i) nearest.push_back({i, 0.1 * i});
  EXPECT_THAT(groupRepresentatives(rays, nearest, {}), testing::ElementsAre(0, 2, 3));
  EXPECT_THAT(groupRepresentatives(rays, nearest, {4.0, 10.0}), testing::ElementsAre(0));
  EXPECT_THAT(groupRepresentatives(rays, {}, {}), testing::IsEmpty());
}

}  // namespace
}  // namespace catoptric::methods::perturbation
