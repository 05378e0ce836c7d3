#include <gtest/gtest.h>

#include <cmath>

#include "methods/second_order/clustering/bins.h"

namespace catoptric::methods::second_order {
namespace {

int binOf(const Vec3& normal, const BinScale& scale) {
  std::int32_t bin = 0;
  binsOf(&normal.x, &normal.y, &normal.z, 1, scale, &bin);
  return bin;
}

TEST(Bins, FollowThePapersFormulaWithTheAreaInPercent) {
  ClusterOptions paper;
  paper.binDensity = 1.0f;
  // A sphere that covers the frame alone: all 13 x 8 bins
  EXPECT_EQ(binScale(1.0f, 1, paper).thetaBins, 13);
  EXPECT_EQ(binScale(1.0f, 1, paper).phiBins, 8);
  // 1% of the frame among 15 objects: 13 / 15 of a bin, but at least one
  EXPECT_EQ(binScale(0.01f, 15, paper).thetaBins, 1);
  EXPECT_EQ(binScale(0.01f, 15, paper).phiBins, 1);
  // 5% among 10: half of the bins
  EXPECT_FLOAT_EQ(binScale(0.05f, 10, paper).theta, 6.5f);
  EXPECT_EQ(binScale(0.05f, 10, paper).thetaBins, 7);
  EXPECT_EQ(binScale(0.05f, 10, paper).phiBins, 4);
  // Ours: at ten times its density, 0.4 of the bins even among many, where an object shows much
  const ClusterOptions ours;
  EXPECT_FLOAT_EQ(binScale(0.001f, 2, ours).theta, 0.5f * 13.0f);
  EXPECT_FLOAT_EQ(binScale(0.001f, 64, ours).theta, 0.4f * 13.0f);
  EXPECT_EQ(binScale(0.001f, 64, ours).phiBins, 4);
  EXPECT_EQ(binScale(0.0009f, 64, ours).thetaBins, 1);
  EXPECT_EQ(binScale(0.001f, 64, paper).thetaBins, 1);
}

TEST(Bins, NormalsNextToAPoleAreOneBin) {
  const BinScale all{13.0f, 8.0f, 13, 8};
  for (float turn = 0.0f; turn < 6.2f; turn += 0.3f) {
    EXPECT_EQ(binOf(Vec3(1e-4f * std::cos(turn), 1.0f, 1e-4f * std::sin(turn)), all), 0);
  }
  EXPECT_EQ(binOf(Vec3(0.0f, -1.0f, 0.0f), all), 7 * 13);
  EXPECT_NE(binOf(Vec3(1.0f, 0.0f, 0.0f), all), binOf(Vec3(-1.0f, 0.0f, 0.0f), all));
}

TEST(Bins, FollowTheAnglesOfNormals) {
  const BinScale scale{12.7f, 7.3f, 13, 8};
  for (int i = 0; i < 20000; ++i) {
    // A spiral over the sphere
    const double y = 1.0 - (2.0 * i + 1.0) / 20000.0;
    const double across = std::sqrt(1.0 - y * y);
    const double turn = std::fmod(0.618034 * i, 1.0);
    const double angle = 2.0 * glm::pi<double>() * turn;
    const double offset = static_cast<double>(kBinOffset);
    const double theta = std::fmod(turn + offset, 1.0) * static_cast<double>(scale.theta);
    const double phi = (std::acos(y) / glm::pi<double>() + offset) * static_cast<double>(scale.phi);
    const auto border = [](double at) { return std::abs(at - std::round(at)) < 1e-4; };
    if (border(theta) || border(phi) || across < 2e-3) continue;
    EXPECT_EQ(binOf(Vec3(across * std::cos(angle), y, across * std::sin(angle)), scale),
              13 * static_cast<int>(phi) + static_cast<int>(theta));
  }
}

TEST(Bins, HaveNoBorderAlongTheAxes) {
  for (const float bins : {1.0f, 2.0f, 4.0f, 8.0f}) {
    const BinScale scale{bins, bins, static_cast<int>(bins), static_cast<int>(bins)};
    for (const Vec3& axis : {Vec3(1.0f, 0.0f, 0.0f), Vec3(-1.0f, 0.0f, 0.0f),
                             Vec3(0.0f, 0.0f, 1.0f), Vec3(0.0f, 0.0f, -1.0f)}) {
      for (const Vec3& off : {Vec3(1e-6f), Vec3(-1e-6f), Vec3(1e-6f, -1e-6f, -1e-6f)}) {
        EXPECT_EQ(binOf(axis + off, scale), binOf(axis, scale));
      }
    }
  }
}

}  // namespace
}  // namespace catoptric::methods::second_order
