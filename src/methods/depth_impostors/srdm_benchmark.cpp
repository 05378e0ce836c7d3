// Times of building simplified rotated depth maps over directions n and points m, of one bumpy ball.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <vector>

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
      texels[static_cast<std::size_t>(y * kSize + x)] = (1.0f / z - 1.0f / 11.0f) / (1.0f / 9.0f - 1.0f / 11.0f);
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

}  // namespace

int main() {
  const std::vector<float> texels = bumpyBall();
  std::printf("| n | m | CPU ms | wall ms |\n|---|---|---|---|\n");
  for (const int n : {9, 15, 30, 60, 90, 120}) measure(texels, n, 8);
  for (const int m : {4, 8, 16, 32, 64}) measure(texels, 60, m);
  return 0;
}
