#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>
#include <random>
#include <vector>

#include "core/vector_level.h"
#include "methods/shared/impostors/ray_batch.h"

namespace catoptric::methods::impostors {
namespace {

/// A square of 2 m about the origin, its normal upwards.
QuadLines square() {
  return {{0, 1, 0, 0}, {0.5f, 0, 0, 0.5f}, {0, 0, 0.5f, 0.5f}};
}

std::unique_ptr<RayBatch> raysFrom(const std::vector<Vec3>& origins,
                                   const std::vector<Vec3>& directions) {
  auto rays = std::make_unique<RayBatch>();
  rays->count = origins.size();
  for (std::size_t i = 0; i < origins.size(); ++i) {
    rays->origin.set(i, origins[i]);
    rays->direction.set(i, directions[i]);
    rays->distance[i] = 1.0f;
    rays->t[i] = 1e30f;
  }
  return rays;
}

std::unique_ptr<RayBatch> randomRays(std::size_t count) {
  std::mt19937 random(7);
  std::uniform_real_distribution<float> any(-1.0f, 1.0f);
  std::vector<Vec3> origins;
  std::vector<Vec3> directions;
  for (std::size_t i = 0; i < count; ++i) {
    origins.push_back(0.8f * Vec3(any(random), 0.1f + std::abs(any(random)), any(random)));
    directions.push_back(normalizedOr(Vec3(any(random), any(random), any(random)), {0, -1, 0}));
  }
  return raysFrom(origins, directions);
}

// A ray that meets the foot of a wall sees the quad's edge, one that meets its top the environment:
// no step of more than 1/255 between black and white [Popescu2006, Sec. 3.2].
TEST(RayLoops, WallsBeginAsTheQuadAndEndAsTheEnvironment) {
  constexpr float kHeight = 0.5f;
  constexpr float kStep = 1e-4f;
  const Vec3 from(0.0f, 0.3f, 0.1f);
  for (const float height : {0.0f, kHeight}) {
    std::vector<Vec3> directions;
    for (const float step : {-kStep, kStep})
      directions.push_back(glm::normalize(Vec3(1.0f, height + step, 0.4f) - from));
    const auto rays = raysFrom({from, from}, directions);
    const auto met = std::make_unique<Meetings>();
    meetBox(square(), kHeight, *rays, *met);
    const auto environment = [&](std::size_t i) { return met->on[i] == 0 ? 1.0f : met->share[i]; };
    EXPECT_NEAR(environment(0), environment(1), 1.0f / 255.0f) << height;
    EXPECT_NEAR(environment(1), height / kHeight, 1.0f / 255.0f) << height;
    if (height > 0.0f) continue;
    EXPECT_EQ(met->on[0], 1);
    EXPECT_EQ(met->on[1], 1);
    EXPECT_NEAR(met->u[0], met->u[1], 1e-3f);
    EXPECT_NEAR(met->v[0], met->v[1], 1e-3f);
    EXPECT_NEAR(met->t[0], met->t[1], 1e-3f);
  }
}

TEST(RayLoops, BoundsHoldAllThatRaysMeet) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> any(-1.0f, 1.0f);
  int culled = 0;
  int met = 0;
  for (int n = 0; n < 2000; ++n) {
    std::vector<Vec3> origins;
    std::vector<Vec3> directions;
    const Vec3 origin(any(random), any(random), any(random));
    const Vec3 axis(any(random), any(random), any(random));
    for (int i = 0; i < 20; ++i) {
      const Vec3 jitter(any(random), any(random), any(random));
      origins.push_back(origin + 0.1f * jitter);
      directions.push_back(normalizedOr(axis + 0.3f * jitter, {0, 0, 1}));
    }
    const auto rays = raysFrom(origins, directions);
    const Vec3 centre = 4.0f * Vec3(any(random), any(random), any(random));
    const float radius = 0.7f * std::abs(any(random));
    bool any_ = false;
    for (std::size_t i = 0; i < origins.size(); ++i) {
      const float along = std::max(0.0f, glm::dot(centre - origins[i], directions[i]));
      any_ = any_ || glm::length(origins[i] + along * directions[i] - centre) <= radius;
    }
    const bool may = bound(*rays).mayMeet(centre, radius);
    culled += may ? 0 : 1;
    met += any_ ? 1 : 0;
    EXPECT_TRUE(may || !any_);
  }
  EXPECT_GT(culled, 1000);
  EXPECT_GT(met, 50);
}

TEST(RayLoops, EveryVectorLevelGivesTheSameBits) {
  const VectorLevel best = vectorLevel();
  std::vector<std::vector<float>> results;
  for (const VectorLevel level :
       {VectorLevel::Base, VectorLevel::V2, VectorLevel::V3, VectorLevel::V4}) {
    limitVectorLevel(level);
    const auto rays = randomRays(251);
    const auto met = std::make_unique<Meetings>();
    const auto map = std::make_unique<MapRays>();
    const auto looks = std::make_unique<LookUps>();
    meetQuad(square(), *rays, *met);
    std::vector<float> values(met->t.begin(), met->t.begin() + 251);
    values.insert(values.end(), met->on.begin(), met->on.begin() + 251);
    meetBox(square(), 0.5f, *rays, *met);
    values.insert(values.end(), met->share.begin(), met->share.begin() + 251);
    project({{{0.5f, 0, 0, 0.5f}, {0, 0, 0.5f, 0.5f}, {0, 0.5f, 0, 0.5f}, {0, 0.1f, 0, 1}}}, 64.0f,
            *rays, *map);
    for (const Lane* lane : {&map->fromX, &map->fromG, &map->toY, &map->tTo, &map->wTo})
      for (std::size_t i = 0; i < 251; ++i) values.push_back(map->on[i] != 0 ? (*lane)[i] : 0.0f);
    looks->count = 251;
    levels(0.1f, met->t, met->u, *looks);
    values.insert(values.end(), looks->level.begin(), looks->level.begin() + 251);
    results.push_back(values);
  }
  limitVectorLevel(best);
  for (const std::vector<float>& values : results)
    EXPECT_EQ(std::memcmp(values.data(), results[0].data(), values.size() * sizeof(float)), 0);
}

}  // namespace
}  // namespace catoptric::methods::impostors
