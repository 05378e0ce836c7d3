// The octree's guarantee against brute force, its coherent look-up, and the paper's groups.
#include "methods/perturbation/ray_octree.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

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
std::vector<SampleRay> vaseRays(int width, int height) {
  const implicit::Surface vase = implicit::vaseSurface();
  const dvec3 eye(0.5, 1.6, 4.0);
  std::vector<SampleRay> rays;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const dvec3 target(2.4 * (x + 0.5) / width - 1.2, 2.2 * (y + 0.5) / height - 0.1, 0.0);
      const dvec3 d = glm::normalize(target - eye);
      const auto hit = implicit::firstHit(vase, {eye, d});
      if (hit.status != implicit::HitStatus::Hit) continue;
      const dvec3 p = eye + hit.t * d;
      implicit::Jet3<double> g;
      if (implicit::derivativesAt(vase, p, g) != implicit::PointStatus::Smooth) continue;
      rays.push_back({p, glm::reflect(d, glm::normalize(dvec3(g.c[1], g.c[2], g.c[3])))});
    }
  }
  return rays;
}

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
  const auto rays = vaseRays(80, 60);
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
