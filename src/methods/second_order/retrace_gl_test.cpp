// Clusters that err are told by their probes, and traced.
#include <gtest/gtest.h>

#include "methods/second_order/test_comparison.h"

namespace catoptric::methods {
namespace {

constexpr const char* kProbed = R"({"probes": 16})";

TEST(Retrace, EveryClusterThatIsTracedEqualsItsRays) {
  const Comparison frame(
      roomWith(scene::makeSphere(1.0f, 96, 48, scene::UvMode::Metres), Mat4(1.0f)),
      cameraAt({0.4f, 0.8f, 3.6f}, {0.0f, 0.0f, 0.0f}),
      R"({"probes": 1, "least_image_rays": 100000000, "min_cluster_samples": 1})");
  EXPECT_GT(frame.samples, 10000u);
  EXPECT_EQ(frame.output.counters.at("retraced"), frame.samples);
  EXPECT_EQ(frame.output.counters.at("small_clusters"), frame.output.counters.at("clusters"));
  EXPECT_EQ(frame.output.counters.at("triangles"), 0u);
  EXPECT_EQ(marked(frame, raster::kMaskRetraced), frame.output.counters.at("retraced"));
  EXPECT_EQ(frame.meanDifference, 0.0);
}

TEST(Retrace, BowlsThatSeeThemselvesAreTold) {
  const scene::Camera camera = cameraAt({0.3f, 0.4f, 3.0f}, {0.0f, 0.0f, -0.5f});
  const Comparison plain(roomWithBowl(-0.2f, 0.5f), camera);
  const Comparison probed(roomWithBowl(-0.2f, 0.5f), camera, kProbed);
  EXPECT_LT(probed.l1Of8Bit, 0.25 * plain.l1Of8Bit);
  EXPECT_LT(probed.l1Of8Bit, 2.0);
  EXPECT_GT(probed.output.counters.at("retraced"), 0u);
  EXPECT_EQ(plain.output.counters.at("retraced"), 0u);
  EXPECT_EQ(plain.output.counters.at("probes"), 0u);
  EXPECT_EQ(marked(probed, raster::kMaskRetraced), probed.output.counters.at("retraced"));
}

TEST(Retrace, FlatMirrorsAreNotProbed) {
  const Comparison frame(
      roomWith(scene::makePlane({4.0f, 4.0f}, {1, 1}, scene::UvMode::Metres), Mat4(1.0f)),
      cameraAt({0.7f, 1.5f, 3.2f}, {0.0f, 0.0f, 0.0f}), kProbed);
  EXPECT_EQ(frame.output.counters.at("probes"), 0u);
  EXPECT_EQ(frame.output.counters.at("retraced"), 0u);
}

}  // namespace
}  // namespace catoptric::methods
