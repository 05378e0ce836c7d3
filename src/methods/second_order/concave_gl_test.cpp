#include <gtest/gtest.h>

#include "methods/second_order/test_comparison.h"

namespace catoptric::methods::second_order {
namespace {

TEST(SecondOrder, ConcaveMirrorsComeCloseToTheirRays) {
  const scene::Camera camera = cameraAt({0.9f, 0.7f, 2.6f}, {0.0f, 0.0f, -1.0f});
  for (const float distance : {0.5f, 1.0f, 1.8f})  // inside the focus, at it, outside
    for (const bool alone : {false, true}) {
      const std::string options = alone ? imagesAlone() : "{}";
      const Comparison shallow(roomWithBowl(-0.7f, distance), camera, options);
      EXPECT_TRUE(shallow.finite);
      EXPECT_EQ(shallow.output.counters.at("concave_clusters"),
                shallow.output.counters.at("clusters"));
      EXPECT_LT(shallow.l1Of8Bit, alone ? 5.0 : 0.05) << distance;
      const Comparison deep(roomWithBowl(-0.2f, distance), camera, options);
      EXPECT_TRUE(deep.finite);
      EXPECT_LT(deep.l1Of8Bit, alone ? 13.0 : 0.05) << distance;
    }
}

TEST(SecondOrder, ConcaveReflectorsCanMeetThemselves) {
  // A deep bowl, in one cluster and in many: rays from one side meet the other
  for (const bool one : {true, false}) {
    const std::string bins = one ? R"("max_theta_bins": 1, "max_phi_bins": 1, )" : "";
    const auto frame = [&](const std::string& concave) {
      return Comparison(roomWithBowl(0.3f, 1.0f),
                        cameraAt({2.0f, 0.1f, 3.0f}, {-0.2f, 0.0f, -0.4f}),
                        imagesAlone("{" + bins + "\"concave\": \"" + concave + "\"}"));
    };
    const Comparison ignored = frame("ignore");
    const Comparison met = frame("self_intersect");
    const Comparison all = frame("self_intersect_all");
    EXPECT_TRUE(met.finite && all.finite);
    EXPECT_EQ(ignored.output.counters.at("met_itself"), 0u);
    EXPECT_GT(met.output.counters.at("met_itself"), 1000u);
    EXPECT_GE(all.output.counters.at("met_itself"), met.output.counters.at("met_itself"));
    // Of many clusters each sees the bowl above it anyway
    EXPECT_LT(met.l1Of8Bit, (one ? 0.6 : 1.02) * ignored.l1Of8Bit);
    EXPECT_LE(all.l1Of8Bit, met.l1Of8Bit);
  }
  // A ball does not
  const Comparison ball(
      roomWith(scene::makeSphere(1.0f, 96, 48, scene::UvMode::Metres), Mat4(1.0f), 0.0f),
      cameraAt({0.4f, 0.8f, 3.6f}, {0.0f, 0.0f, 0.0f}), R"({"concave": "self_intersect_all"})");
  EXPECT_EQ(ball.output.counters.at("met_itself"), 0u);
}

}  // namespace
}  // namespace catoptric::methods::second_order
