// Of one bumpy ball: times of building simplified rotated depth maps over directions n and points
// m, and of intersecting rays with them and texel by texel over the length of the rays'
// projections.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <memory>
#include <random>
#include <vector>

#include "methods/depth_impostors/search.h"
#include "methods/depth_impostors/srdm.h"

namespace {

using namespace catoptric;
using methods::depth_impostors::Domain;
using methods::depth_impostors::Point;

constexpr int kSize = 256;
constexpr int kRounds = 24;

std::vector<float> bumpyBall() {
  std::vector<float> texels(static_cast<std::size_t>(kSize) * kSize, 0.0f);
  for (int y = 0; y < kSize; ++y) {
    for (int x = 0; x < kSize; ++x) {
      const Vec2 p = (2.0f * (Vec2(x, y) + 0.5f) / static_cast<float>(kSize) - 1.0f) * 1.1f;
      const float r2 = glm::dot(p, p);
      if (r2 >= 0.81f) continue;
      const float z =
          10.0f - std::sqrt(0.81f - r2) + 0.05f * std::sin(9.0f * p.x) * std::cos(7.0f * p.y);
      texels[static_cast<std::size_t>(y * kSize + x)] =
          (1.0f / z - 1.0f / 11.0f) / (1.0f / 9.0f - 1.0f / 11.0f);
    }
  }
  return texels;
}

double seconds(clockid_t clock) {
  timespec now{};
  clock_gettime(clock, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

void measure(const std::vector<float>& texels, int n, int m) {
  const std::vector<Domain> domains = methods::depth_impostors::makeDomains(n, kSize);
  std::vector<Point> points(static_cast<std::size_t>(domains.back().offset + domains.back().count) *
                            static_cast<std::size_t>(m));
  std::vector<double> wall;
  std::vector<double> processor;
  for (int i = 0; i < kRounds; ++i) {
    methods::depth_impostors::Simplification done;
    const double wallBefore = seconds(CLOCK_MONOTONIC);
    const double before = seconds(CLOCK_PROCESS_CPUTIME_ID);
    methods::depth_impostors::buildSrdm(texels, kSize, domains, m, points, done);
    processor.push_back(1e3 * (seconds(CLOCK_PROCESS_CPUTIME_ID) - before));
    wall.push_back(1e3 * (seconds(CLOCK_MONOTONIC) - wallBefore));
  }
  std::ranges::sort(wall);
  std::ranges::sort(processor);
  std::printf("| %d | %d | %.2f | %.2f |\n", n, m, processor[kRounds / 2], wall[kRounds / 2]);
}

/// Rays of a length in texels, through the whole range of depths, anywhere on the map.
std::unique_ptr<methods::impostors::MapRays> raysOf(float length) {
  auto rays = std::make_unique<methods::impostors::MapRays>();
  std::mt19937 random(7);
  std::uniform_real_distribution<float> any(0.0f, 1.0f);
  rays->count = methods::impostors::kMostRays;
  for (std::size_t i = 0; i < rays->count; ++i) {
    const float angle = 2.0f * kPi * any(random);
    const Vec2 reach = 0.5f * length * Vec2(std::cos(angle), std::sin(angle));
    const Vec2 middle = static_cast<float>(kSize) * (0.25f + 0.5f * Vec2(any(random), any(random)));
    rays->fromX[i] = middle.x - reach.x;
    rays->fromY[i] = middle.y - reach.y;
    rays->fromG[i] = 1.0f;
    rays->toX[i] = middle.x + reach.x;
    rays->toY[i] = middle.y + reach.y;
    rays->toG[i] = 0.0f;
  }
  return rays;
}

void compareWays(const std::vector<float>& texels) {
  namespace maps = methods::depth_impostors;
  constexpr int kPoints = 8;
  const std::vector<Domain> domains = maps::makeDomains(60, kSize);
  const std::size_t count =
      static_cast<std::size_t>(domains.back().offset + domains.back().count) * kPoints;
  std::vector<Point> points(count + maps::kSpare, maps::kUnused);
  maps::Simplification done;
  maps::buildSrdm(texels, kSize, domains, kPoints, std::span(points).first(count), done);
  const maps::MapTexels map{maps::Columns(texels, kSize, true),
                            maps::Columns(texels, kSize, false)};
  const maps::MapLines lines{domains, kPoints, points.data()};
  std::printf(
      "\n| texels of a ray | walk, ns | srdm, ns | srdm and refine 4, ns |\n|---|---|---|---|\n");
  for (const float length : {4.0f, 8.0f, 12.0f, 16.0f, 24.0f, 32.0f, 48.0f, 64.0f, 96.0f, 120.0f}) {
    const auto rays = raysOf(length);
    const auto nanoseconds = [&](const auto& way) {
      constexpr int kTimes = 400;
      const double before = seconds(CLOCK_PROCESS_CPUTIME_ID);
      for (int i = 0; i < kTimes; ++i) way();
      return 1e9 * (seconds(CLOCK_PROCESS_CPUTIME_ID) - before) / kTimes /
             static_cast<double>(rays->count);
    };
    const double walk = nanoseconds([&] { maps::walkTexels(map, *rays); });
    const double rows = nanoseconds([&] { maps::searchLines(lines, false, *rays); });
    const double refined = nanoseconds([&] {
      maps::searchLines(lines, false, *rays);
      maps::refineHits(map, 4, *rays);
    });
    std::printf("| %g | %.0f | %.0f | %.0f |\n", static_cast<double>(length), walk, rows, refined);
  }
}

}  // namespace

int main() {
  const std::vector<float> texels = bumpyBall();
  std::printf("| n | m | CPU ms | wall ms |\n|---|---|---|---|\n");
  for (const int n : {9, 15, 30, 60, 90, 120}) measure(texels, n, 8);
  for (const int m : {4, 8, 16, 32, 64}) measure(texels, 60, m);
  compareWays(texels);
  return 0;
}
