#include <gtest/gtest.h>

#include <utility>
#include <vector>

#include "core/parallel.h"
#include "methods/second_order/test_samples.h"

namespace catoptric::methods::second_order {
namespace {

/// Mean squared distance of the rays of clusters that are not planar to their cluster's mean ray,
/// origins over their distance from the eye; and the number of rays.
std::pair<double, std::uint64_t> spread(const Clustering& clustering) {
  const std::size_t count = clustering.clusters().size();
  std::vector<glm::dvec3> directions(count, glm::dvec3(0.0));
  std::vector<glm::dvec3> origins(count, glm::dvec3(0.0));
  std::vector<double> squares(count, 0.0);
  std::uint64_t rays = 0;
  double away = 0.0;
  for (std::size_t c = 0; c < count && away == 0.0; ++c) {
    if (!clustering.clusters()[c].planar) away = glm::length(clustering.clusters()[c].centroid);
  }
  for (const SampleBlock& block : clustering.blocks()) {
    for (const SampleRun& run : block.runs) {
      const std::size_t c = block.slots[run.slot];
      if (clustering.clusters()[c].planar) continue;
      rays += run.count;
      for (std::size_t i = run.first; i < run.first + run.count; ++i) {
        const glm::dvec3 direction(block.direction[i]);
        const glm::dvec3 origin = glm::dvec3(block.position[i]) / away;
        directions[c] += direction;
        origins[c] += origin;
        squares[c] += glm::dot(direction, direction) + glm::dot(origin, origin);
      }
    }
  }
  double sum = 0.0;
  for (std::size_t c = 0; c < count; ++c) {
    const double n = clustering.clusters()[c].samples;
    if (clustering.clusters()[c].planar) continue;
    sum += squares[c] -
           (glm::dot(directions[c], directions[c]) + glm::dot(origins[c], origins[c])) / n;
  }
  return {sum / static_cast<double>(rays), rays};
}

TEST(KMeans, BringsRaysCloserAndLeavesPlanesAlone) {
  const scene::Camera camera = cameraAt({0.5f, 1.9f, 4.0f}, {0.3f, 0.3f, 0.0f});
  const raster::GBufferCopy gbuffer = rasterized(camera, 0.0f, hitSphereOrFloor);
  const std::vector<ReflectorKind> kinds = {ReflectorKind::None, ReflectorKind::Mirror};
  ClusterOptions options;
  Clustering bins;
  bins.build(gbuffer, camera, kinds, options);
  options.kMeans = true;
  std::vector<std::vector<std::uint16_t>> made;
  for (const int threads : {1, 4}) {
    setThreadCount(threads);
    Clustering means;
    means.build(gbuffer, camera, kinds, options);
    made.push_back(means.clusterOf());
    const auto [before, raysBefore] = spread(bins);
    const auto [after, raysAfter] = spread(means);
    EXPECT_EQ(raysBefore, raysAfter);
    EXPECT_LT(after, 0.9 * before);
    EXPECT_LE(means.clusters().size(), bins.clusters().size());
    EXPECT_GT(means.clusters().size(), 0.9 * static_cast<double>(bins.clusters().size()));
    std::vector<std::uint64_t> counts(means.clusters().size() + 2, 0);
    for (const std::uint16_t known : means.clusterOf()) ++counts.at(known);
    EXPECT_EQ(counts[1], bins.samplesInNoCluster());
    const auto planes = [](const Clustering& clustering) {
      std::vector<std::pair<std::uint64_t, float>> found;
      for (const Cluster& c : clustering.clusters()) {
        if (c.planar) found.emplace_back(c.samples, c.centroid.x);
      }
      return found;
    };
    EXPECT_FALSE(planes(bins).empty());
    EXPECT_EQ(planes(bins), planes(means));
    for (std::size_t c = 0; c < means.clusters().size(); ++c) {
      EXPECT_EQ(counts[c + 2], means.clusters()[c].samples);
      EXPECT_GE(means.clusters()[c].samples, 16u);
    }
    // Samples of planes are where they were
    for (std::size_t at = 0; at < gbuffer.object.size(); ++at) {
      const auto planar = [&](const Clustering& clustering) {
        const std::uint16_t known = clustering.clusterOf()[at];
        return known >= 2 && clustering.clusters()[known - 2u].planar;
      };
      ASSERT_EQ(planar(bins), planar(means));
    }
  }
  setThreadCount(0);
  EXPECT_EQ(made[0], made[1]);
}

}  // namespace
}  // namespace catoptric::methods::second_order
