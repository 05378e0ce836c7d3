#include "methods/depth_impostors/srdm.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "core/vector_level.h"
#include "methods/depth_impostors/columns.h"

namespace catoptric::methods::depth_impostors {
namespace {

constexpr float kNear = 9.0f;
constexpr float kFar = 11.0f;

/// A map's value at a depth.
float valueOf(float z) {
  return (1.0f / z - 1.0f / kFar) / (1.0f / kNear - 1.0f / kFar);
}

/// A bumpy ball before nothing, as a depth map.
std::vector<float> bumpyBall(int size) {
  std::vector<float> texels(static_cast<std::size_t>(size) * static_cast<std::size_t>(size), 0.0f);
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) {
      const Vec2 p = (2.0f * (Vec2(x, y) + 0.5f) / static_cast<float>(size) - 1.0f) * 1.1f;
      const float r2 = glm::dot(p, p);
      if (r2 >= 0.81f) continue;
      const float z =
          10.0f - std::sqrt(0.81f - r2) + 0.05f * std::sin(9.0f * p.x) * std::cos(7.0f * p.y);
      texels[static_cast<std::size_t>(y * size + x)] = valueOf(z);
    }
  }
  return texels;
}

struct Simplified {
  std::vector<Domain> domains;
  std::vector<Point> points;
  Simplification done;
};

Simplified simplified(const std::vector<float>& texels, int size, int n, int m) {
  Simplified made{makeDomains(n, size), {}, {}};
  const Domain& last = made.domains.back();
  made.points.resize(static_cast<std::size_t>((last.offset + last.count) * m));
  buildSrdm(texels, size, made.domains, m, made.points, made.done);
  return made;
}

/// Depth of a map's value.
float metresOf(float g) {
  return 1.0f / (g * (1.0f / kNear - 1.0f / kFar) + 1.0f / kFar);
}

struct Errors {
  double ofRange = 0.0;  ///< sum of |z - z'| / (far - near) over all samples
  double ofDepth = 0.0;  ///< of |z - z'| / z
};

Errors errorsOf(const Simplified& made, const std::vector<float>& texels, int size, int m) {
  Errors errors;
  for (const Domain& domain : made.domains) {
    const Columns columns(texels, size, domain.alongX);
    for (int j = 0; j < domain.count; ++j) {
      const Point* const line = &made.points[static_cast<std::size_t>((domain.offset + j) * m)];
      for (int p = 1; p < m; ++p) {
        if (line[p].x < 0.0f) continue;
        const float from = std::abs(line[p - 1].x);
        const float to = line[p].x;
        // Each sample once: the segment's last one belongs to the next segment of its span
        const bool last = p + 1 == m || line[p + 1].x < 0.0f;
        for (int k = static_cast<int>(std::ceil(from - 0.5f));
             static_cast<float>(k) + 0.5f < to + (last ? 0.001f : -0.001f); ++k) {
          const float major = static_cast<float>(k) + 0.5f;
          const float minor = domain.slope * major + static_cast<float>(domain.first + j) + 0.5f;
          const float share = (major - from) / (to - from);
          const float kept = line[p - 1].y + share * (line[p].y - line[p - 1].y);
          const float z = metresOf(columns.at(k, minor));
          const float error = std::abs(z - metresOf(kept));
          errors.ofRange += static_cast<double>(error / (kFar - kNear));
          errors.ofDepth += static_cast<double>(error / z);
        }
      }
    }
  }
  return errors;
}

TEST(Srdm, LinesOfEveryDirectionCoverTheSquare) {
  constexpr int size = 64;
  std::size_t domains = 0;
  for (const Domain& domain : makeDomains(60, size)) {
    ++domains;
    EXPECT_LE(std::abs(domain.slope), 1.0f + 1e-6f);
    for (const float minor : {0.0f, size / 3.0f, static_cast<float>(size)}) {
      for (const float major : {0.0f, size / 2.0f, static_cast<float>(size)}) {
        const int line = static_cast<int>(std::floor(minor - domain.slope * major)) - domain.first;
        EXPECT_GE(line, 0);
        EXPECT_LT(line, domain.count);
      }
    }
  }
  EXPECT_EQ(domains, 60u);
}

TEST(Srdm, APlaneIsItsTwoPoints) {
  constexpr int size = 128;
  std::vector<float> texels(size * size);
  const auto plane = [](float x, float y) { return 0.2f + 0.003f * x + 0.0015f * y; };
  for (int y = 0; y < size; ++y)
    for (int x = 0; x < size; ++x)
      texels[static_cast<std::size_t>(y * size + x)] =
          plane(static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f);
  const Simplified made = simplified(texels, size, 12, 2);
  EXPECT_EQ(made.done.lostSpans, 0u);
  float worst = 0.0f;
  int points = 0;
  for (const Domain& domain : made.domains) {
    for (int j = 0; j < domain.count; ++j) {
      for (int k = 0; k < 2; ++k) {
        const Point p = made.points[static_cast<std::size_t>((domain.offset + j) * 2 + k)];
        if (p == kUnused) continue;
        // A span of one texel is as wide as that
        const Point other = made.points[static_cast<std::size_t>((domain.offset + j) * 2 + 1 - k)];
        if (std::abs(std::abs(p.x) - std::abs(other.x)) < 1.0f) continue;
        const float major = std::abs(p.x);
        const float minor = static_cast<float>(domain.first + j) + 0.5f + domain.slope * major;
        // Beside the outermost texels' centres there is nothing to interpolate
        if (minor < 0.5f || minor > size - 0.5f) continue;
        ++points;
        const float truth = domain.alongX ? plane(major, minor) : plane(minor, major);
        worst = std::max(worst, std::abs(p.y - truth));
      }
    }
  }
  EXPECT_GT(points, 12 * size);
  EXPECT_LT(worst, 1e-6f);
}

TEST(Srdm, ErrorFallsWithPointsAndIsSmall) {
  constexpr int size = 256;
  const std::vector<float> texels = bumpyBall(size);
  double before = 2.0;
  for (const int m : {6, 8, 10, 12, 14, 16}) {
    const Simplified made = simplified(texels, size, 20, m);
    const Errors errors = errorsOf(made, texels, size, m);
    const double percent = 100.0 * errors.ofRange / static_cast<double>(made.done.samples);
    std::printf("m %d: z error %.3f %%, relative to z %.4f %%\n", m, percent,
                100.0 * errors.ofDepth / static_cast<double>(made.done.samples));
    EXPECT_LT(percent, before);
    before = percent;
    if (m == 8) {
      EXPECT_LT(percent, 1.2);
    }
    if (m == 16) {
      EXPECT_LT(percent, 0.4);
    }
  }
}

TEST(Srdm, WithPointsEnoughEverySampleIsKept) {
  constexpr int size = 48;
  const std::vector<float> texels = bumpyBall(size);
  const Simplified made = simplified(texels, size, 4, 2 * size);
  EXPECT_EQ(made.done.lostSamples, 0u);
  // The first domain's lines are the rows of texels themselves
  int compared = 0;
  for (int j = 0; j < made.domains[0].count; ++j) {
    const int row = made.domains[0].first + j;
    if (row < 0 || row >= size) continue;
    for (int k = 0; k < 2 * size; ++k) {
      const Point p = made.points[static_cast<std::size_t>(j * 2 * size + k)];
      if (p == kUnused) continue;
      const int x = static_cast<int>(std::abs(p.x));
      EXPECT_EQ(p.y, texels[static_cast<std::size_t>(row * size + x)]);
      ++compared;
    }
  }
  EXPECT_GT(compared, size * size / 4);
}

TEST(Srdm, EveryVectorLevelGivesTheSamePoints) {
  constexpr int size = 96;
  const std::vector<float> texels = bumpyBall(size);
  const VectorLevel best = vectorLevel();
  limitVectorLevel(VectorLevel::Base);
  const Simplified truth = simplified(texels, size, 12, 8);
  for (const VectorLevel level : {VectorLevel::V2, VectorLevel::V3, VectorLevel::V4}) {
    limitVectorLevel(level);
    EXPECT_EQ(simplified(texels, size, 12, 8).points, truth.points);
  }
  limitVectorLevel(best);
}

TEST(Srdm, ShortestSpansAreLostAndCounted) {
  constexpr int size = 32;
  constexpr int row = 5;
  std::vector<float> texels(size * size, 0.0f);
  for (const int k : {2, 3, 4, 8, 12, 13, 20, 21, 22, 23})
    texels[static_cast<std::size_t>(row * size + k)] = 0.5f;
  // The lines of a single direction are the rows of texels themselves
  const Simplified made = simplified(texels, size, 1, 6);
  EXPECT_EQ(made.done.spans, 4u);
  EXPECT_EQ(made.done.lostSpans, 1u);
  EXPECT_EQ(made.done.lostSamples, 1u);
  EXPECT_EQ(made.done.samples, 10u);
  const Point* const points =
      &made.points[static_cast<std::size_t>(6 * (row - made.domains[0].first))];
  EXPECT_EQ(points[0], Point(-2.5f, 0.5f));
  EXPECT_EQ(points[1], Point(4.5f, 0.5f));
  EXPECT_EQ(points[4], Point(-20.5f, 0.5f));
  EXPECT_EQ(points[5], Point(23.5f, 0.5f));
}

}  // namespace
}  // namespace catoptric::methods::depth_impostors
