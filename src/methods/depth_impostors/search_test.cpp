#include "methods/depth_impostors/search.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>
#include <random>
#include <vector>

#include "core/vector_level.h"

namespace catoptric::methods::depth_impostors {
namespace {

using impostors::MapRays;

constexpr int kSize = 64;

/// Bumps with holes between them.
std::vector<float> bumps() {
  std::vector<float> texels(kSize * kSize, 0.0f);
  for (int y = 0; y < kSize; ++y) {
    for (int x = 0; x < kSize; ++x) {
      const float g =
          std::sin(0.21f * static_cast<float>(x)) * std::cos(0.17f * static_cast<float>(y));
      if (g > -0.6f) texels[static_cast<std::size_t>(y * kSize + x)] = 0.5f + 0.4f * g;
    }
  }
  return texels;
}

std::unique_ptr<MapRays> randomRays(bool alongRows) {
  std::mt19937 random(11);
  std::uniform_real_distribution<float> any(0.0f, 1.0f);
  auto rays = std::make_unique<MapRays>();
  rays->count = impostors::kMostRays;
  for (std::size_t i = 0; i < rays->count; ++i) {
    const float row = std::floor(any(random) * kSize) + 0.5f;
    rays->fromX[i] = any(random) * kSize;
    rays->toX[i] = any(random) * kSize;
    rays->fromY[i] = alongRows ? row : any(random) * kSize;
    rays->toY[i] = alongRows ? row : any(random) * kSize;
    rays->fromG[i] = any(random);
    rays->toG[i] = any(random);
  }
  return rays;
}

MapTexels texelsOf(const std::vector<float>& map) {
  return {Columns(map, kSize, true), Columns(map, kSize, false)};
}

/// The nearest crossing with all segments of the line that the ray lies over: no walk, no end.
double exhaustive(const Columns& columns, Vec2 from, Vec2 to, float gFrom, float gTo) {
  const float slope = (to.y - from.y) / (to.x - from.x);
  std::vector<double> g;
  for (int k = 0; k < kSize; ++k)
    g.push_back(columns.at(k, from.y + slope * (static_cast<float>(k) + 0.5f - from.x)));
  double nearest = 2.0;
  const auto cross = [&](double px, double pg, double qx, double qg) {
    const double dx = to.x - from.x, dg = gTo - gFrom, ex = qx - px, eg = qg - pg;
    const double det = dx * eg - dg * ex;
    const double share = ((px - from.x) * eg - (pg - gFrom) * ex) / det;
    const double other = ((px - from.x) * dg - (pg - gFrom) * dx) / det;
    if (share >= 0.0 && share <= 1.0 && other >= 0.0 && other <= 1.0)
      nearest = std::min(nearest, share);
  };
  for (int k = 0; k < kSize; ++k) {
    const auto here = static_cast<std::size_t>(k);
    if (!(g[here] > 0.0)) continue;
    const bool next = k + 1 < kSize && g[here + 1] > 0.0;
    const bool last = k > 0 && g[here - 1] > 0.0;
    if (next) cross(k + 0.5, g[here], k + 1.5, g[here + 1]);
    if (!next && !last) cross(k + 0.001, g[here], k + 0.999, g[here]);
  }
  return nearest;
}

TEST(Search, AWalkFindsWhatAllTexelsShow) {
  const MapTexels texels = texelsOf(bumps());
  const auto rays = randomRays(false);
  const std::uint64_t walked = walkTexels(texels, *rays);
  EXPECT_GT(walked, 0u);
  EXPECT_LT(walked, rays->texels);
  // Without hits all are tested
  EXPECT_EQ(walkTexels(texelsOf(std::vector<float>(kSize * kSize, 0.0f)), *randomRays(false)),
            rays->texels);
  int hits = 0;
  int off = 0;
  for (std::size_t i = 0; i < rays->count; ++i) {
    const Vec2 from(rays->fromX[i], rays->fromY[i]);
    const Vec2 to(rays->toX[i], rays->toY[i]);
    const bool alongX = std::abs(to.x - from.x) >= std::abs(to.y - from.y);
    const double truth = alongX ? exhaustive(texels.across, from, to, rays->fromG[i], rays->toG[i])
                                : exhaustive(texels.down, Vec2(from.y, from.x), Vec2(to.y, to.x),
                                             rays->fromG[i], rays->toG[i]);
    hits += truth <= 1.0 ? 1 : 0;
    off += std::abs(truth - static_cast<double>(rays->at[i])) > 1e-3 ? 1 : 0;
  }
  EXPECT_GT(hits, 80);
  // At ends of segments rounding decides
  EXPECT_LE(off, 2);
}

struct Made {
  std::vector<Domain> domains;
  std::vector<Point> points;
};

Made make(const std::vector<float>& map, int n, int m) {
  Made made{makeDomains(n, kSize), {}};
  const auto count =
      static_cast<std::size_t>((made.domains.back().offset + made.domains.back().count) * m);
  made.points.assign(count + kSpare, kUnused);
  Simplification done;
  buildSrdm(map, kSize, made.domains, m, std::span(made.points).first(count), done);
  return made;
}

TEST(Search, LinesWithAllSamplesAreTheWalkAlongRows) {
  const std::vector<float> map = bumps();
  const auto walked = randomRays(true);
  walkTexels(texelsOf(map), *walked);
  for (const bool twoRows : {false, true}) {
    const Made made = make(map, 12, 2 * kSize);
    const auto searched = randomRays(true);
    searchLines({made.domains, 2 * kSize, made.points.data()}, twoRows, *searched);
    int hits = 0;
    for (std::size_t i = 0; i < walked->count; ++i) {
      hits += walked->at[i] <= 1.0f ? 1 : 0;
      EXPECT_NEAR(walked->at[i], searched->at[i], 1e-3f) << i;
    }
    EXPECT_GT(hits, 80);
  }
}

TEST(Search, RefinedHitsAreThoseOfTheWalk) {
  const std::vector<float> map = bumps();
  const MapTexels texels = texelsOf(map);
  const Made made = make(map, 60, 8);
  const auto truth = randomRays(false);
  walkTexels(texels, *truth);
  int rough = 0;
  int refined = 0;
  for (const int reach : {0, 8}) {
    const auto rays = randomRays(false);
    searchLines({made.domains, 8, made.points.data()}, false, *rays);
    if (reach > 0) {
      EXPECT_GT(refineHits(texels, reach, *rays), 0u);
    }
    int& close = reach > 0 ? refined : rough;
    for (std::size_t i = 0; i < rays->count; ++i)
      close += truth->at[i] <= 1.0f && std::abs(truth->at[i] - rays->at[i]) < 1e-5f ? 1 : 0;
  }
  const auto hits = std::ranges::count_if(truth->at, [](float at) { return at <= 1.0f; });
  std::printf("%d hits of the walk, %d found exactly, %d refined\n", static_cast<int>(hits), rough,
              refined);
  EXPECT_GT(refined, static_cast<int>(hits) * 3 / 5);
  EXPECT_LT(rough, static_cast<int>(hits) / 10);
}

// All the way refined is the walk, wherever a line has found something
TEST(Search, RefinedAllTheWayIsTheWalk) {
  const std::vector<float> map = bumps();
  const MapTexels texels = texelsOf(map);
  const Made made = make(map, 60, 8);
  const auto truth = randomRays(false);
  walkTexels(texels, *truth);
  const auto rays = randomRays(false);
  searchLines({made.domains, 8, made.points.data()}, false, *rays);
  const std::vector<float> found(rays->at.begin(), rays->at.end());
  refineHits(texels, kSize, *rays);
  for (std::size_t i = 0; i < rays->count; ++i)
    if (found[i] <= 1.0f && truth->at[i] <= 1.0f) {
      EXPECT_EQ(rays->at[i], truth->at[i]) << i;
    }
}

TEST(Search, EveryVectorLevelGivesTheSameBits) {
  const std::vector<float> map = bumps();
  const Made made = make(map, 60, 8);
  const VectorLevel best = vectorLevel();
  std::vector<std::vector<float>> results;
  for (const VectorLevel level :
       {VectorLevel::Base, VectorLevel::V2, VectorLevel::V3, VectorLevel::V4}) {
    limitVectorLevel(level);
    std::vector<float>& values = results.emplace_back();
    for (const bool twoRows : {false, true}) {
      const auto rays = randomRays(false);
      searchLines({made.domains, 8, made.points.data()}, twoRows, *rays);
      values.insert(values.end(), rays->at.begin(), rays->at.end());
    }
    const auto rays = randomRays(false);
    walkTexels(texelsOf(map), *rays);
    values.insert(values.end(), rays->at.begin(), rays->at.end());
    searchLines({made.domains, 8, made.points.data()}, false, *rays);
    refineHits(texelsOf(map), 4, *rays);
    values.insert(values.end(), rays->at.begin(), rays->at.end());
  }
  limitVectorLevel(best);
  for (const std::vector<float>& values : results)
    EXPECT_EQ(std::memcmp(values.data(), results[0].data(), values.size() * sizeof(float)), 0);
}

}  // namespace
}  // namespace catoptric::methods::depth_impostors
