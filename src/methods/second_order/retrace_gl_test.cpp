// Clusters that err are told by their probes, and traced.
#include <gtest/gtest.h>

#include <map>

#include "methods/second_order/test_comparison.h"

namespace catoptric::methods::second_order {
namespace {

constexpr const char* kProbed = R"({"probes": 16})";

TEST(Retrace, EveryClusterThatIsTracedEqualsItsRays) {
  const Comparison frame(
      roomWith(scene::makeSphere(1.0f, 96, 48, scene::UvMode::Metres), Mat4(1.0f)),
      cameraAt({0.4f, 0.8f, 3.6f}, {0.0f, 0.0f, 0.0f}), R"({"probes": 1})", {[](Options& options) {
        options.leastImageRays = 100000000;
        options.cluster.minSamples = 1;
      }});
  EXPECT_GT(frame.samples, 10000u);
  EXPECT_EQ(frame.output.counters.at("retraced"), frame.samples);
  EXPECT_EQ(frame.output.counters.at("small_clusters"), frame.output.counters.at("clusters"));
  EXPECT_EQ(frame.output.counters.at("triangles"), 0u);
  EXPECT_EQ(marked(frame, raster::kMaskRetraced), frame.output.counters.at("retraced"));
  EXPECT_EQ(frame.meanDifference, 0.0);
}

TEST(Retrace, SamplesInNoClusterAreTraced) {
  const BesideOptions noClusters{[](Options& options) { options.cluster.minSamples = 1000000; }};
  const scene::Camera camera = cameraAt({0.4f, 0.8f, 3.6f}, {0.0f, 0.0f, 0.0f});
  scene::Scene scene = roomWith(scene::makeSphere(1.0f, 96, 48, scene::UvMode::Metres), Mat4(1.0f));
  const Comparison frame(scene, camera, kProbed, noClusters);
  EXPECT_GT(frame.samples, 10000u);
  EXPECT_EQ(frame.output.counters.at("clusters"), 0u);
  EXPECT_EQ(frame.output.counters.at("unclustered"), 0u);
  EXPECT_EQ(frame.output.counters.at("retraced"), frame.samples);
  EXPECT_EQ(marked(frame, raster::kMaskRetraced), frame.samples);
  EXPECT_EQ(marked(frame, raster::kMaskEnvironment), 0u);
  EXPECT_EQ(frame.meanDifference, 0.0);
  // A refractive object is mirrored: Embree would show what it refracts
  scene.materials[scene.objects[0].material].refraction = 1.5f;
  const Comparison glass(scene, camera, kProbed, noClusters);
  EXPECT_EQ(glass.output.counters.at("unclustered"), frame.samples);
  EXPECT_EQ(glass.output.counters.at("retraced"), 0u);
}

TEST(Retrace, ClustersWhoseProbesErrMoreThanProbeErrorAreTraced) {
  // Every sample is a probe and in a cluster, and every cluster has a depth image.
  const auto frameWith = [](const std::string& probeError) {
    return Comparison(roomWith(scene::makeSphere(1.0f, 96, 48, scene::UvMode::Metres), Mat4(1.0f)),
                      cameraAt({0.4f, 0.8f, 3.6f}, {0.0f, 0.0f, 0.0f}),
                      R"({"probes": 1024, "probe_error": )" + probeError + "}",
                      {[](Options& options) {
                        options.leastImageRays = 0;
                        options.selfHitShare = 1.0f;
                        options.cluster.minSamples = 1;
                      }});
  };
  constexpr double kProbeError = 1.5;
  const Comparison shown = frameWith("255");
  ASSERT_EQ(shown.output.counters.at("retraced"), 0u);
  const Comparison judged = frameWith(std::to_string(kProbeError));
  const std::vector<std::uint32_t>& clusterOf = shown.output.sampleLayers.at(0).numbers;
  struct Cluster {
    double steps = 0.0;
    int samples = 0;
    int traced = 0;
  };
  std::map<std::uint32_t, Cluster> clusters;
  for (std::size_t i = 0; i < clusterOf.size(); ++i) {
    if (clusterOf[i] == 0) continue;
    Cluster& cluster = clusters[clusterOf[i]];
    cluster.steps += shown.steps[i];
    ++cluster.samples;
    cluster.traced += (judged.masks[i] & raster::kMaskRetraced) != 0 ? 1 : 0;
  }
  int above = 0;  // by less than the limit again
  int below = 0;  // by less than half of it
  for (const auto& [number, cluster] : clusters) {
    const double mean = cluster.steps / cluster.samples;
    EXPECT_EQ(cluster.traced, mean > kProbeError ? cluster.samples : 0) << mean;
    above += mean > kProbeError && mean < 2.0 * kProbeError ? 1 : 0;
    below += mean <= kProbeError && mean > 0.5 * kProbeError ? 1 : 0;
  }
  EXPECT_GT(above, 0);
  EXPECT_GT(below, 0);
}

TEST(Retrace, BowlsThatSeeThemselvesAreTold) {
  const scene::Camera camera = cameraAt({0.3f, 0.4f, 3.0f}, {0.0f, 0.0f, -0.5f});
  const Comparison plain(roomWithBowl(-0.2f, 0.5f), camera, imagesAlone());
  const Comparison probed(roomWithBowl(-0.2f, 0.5f), camera);
  EXPECT_GT(plain.l1Of8Bit, 5.0);
  EXPECT_LT(probed.l1Of8Bit, 0.05);
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
}  // namespace catoptric::methods::second_order
