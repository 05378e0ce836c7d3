#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <utility>
#include <vector>

#include "core/parallel.h"
#include "methods/second_order/test_samples.h"

namespace catoptric::methods::second_order {
namespace {

/// Three steps: y = 0, 0.1 and 0.2, one normal.
bool hitStairs(const Vec3& eye, const Vec3& d, Vec3& position, Vec3& normal) {
  normal = Vec3(0.0f, 1.0f, 0.0f);
  for (const float step : {2.0f, 1.0f, 0.0f}) {
    position = eye + d * ((0.1f * step - eye.y) / d.y);
    const bool on =
        position.x > -1.0f + 0.5f * step && (step == 2.0f || position.x < -0.5f + 0.5f * step);
    if (d.y < 0.0f && on) return true;
  }
  return false;
}

TEST(Clusters, ParallelPlanesOfABinAreAClusterEach) {
  const scene::Camera camera = cameraAt({0.3f, 1.6f, 3.0f}, {0.0f, 0.0f, 0.0f});
  const raster::GBufferCopy gbuffer = rasterized(camera, 0.0f, hitStairs);
  const Clustering clustering = clustersOf(gbuffer, camera);
  ASSERT_EQ(clustering.clusters().size(), 3u);
  std::uint64_t samples = 0;
  std::set<int> heights;
  for (const Cluster& cluster : clustering.clusters()) {
    EXPECT_TRUE(cluster.planar);
    samples += cluster.samples;
    heights.insert(static_cast<int>(std::lround(10.0f * (camera.eye().y + cluster.centroid.y))));
  }
  EXPECT_EQ(samples, clustering.reflectiveSamples());
  EXPECT_EQ(heights, (std::set<int>{0, 1, 2}));
}

constexpr std::array<float, 3> kWavyStairs = {0.4f, 0.0f, -0.4f};  ///< metres

/// Three steps of a floor that is not quite flat, down along +x.
bool hitWavyStairs(const Vec3& eye, const Vec3& d, Vec3& position, Vec3& normal) {
  normal = Vec3(0.0f);
  for (std::size_t step = 0; step < kWavyStairs.size() && normal.y == 0.0f; ++step) {
    const Vec3 raised(0.0f, kWavyStairs[step], 0.0f);
    if (!hitFloor(eye - raised, d, position, normal)) return false;
    position += raised;
    if (position.x < 1.0f * static_cast<float>(step) - 1.0f ||
        position.x > 1.0f * static_cast<float>(step)) {
      normal = Vec3(0.0f);
    }
  }
  if (normal.y == 0.0f) return false;
  normal = glm::normalize(Vec3(0.02f + 0.002f * std::sin(40.0f * position.x), 1.0f, 0.004f));
  return true;
}

TEST(Clusters, AreDividedAtStepsButNotOnSlopes) {
  const scene::Camera camera = cameraAt({0.2f, 2.5f, 3.0f}, {0.5f, 0.0f, 0.0f});
  const Clustering stairs = clustersOf(rasterized(camera, 0.0f, hitWavyStairs), camera);
  ASSERT_EQ(stairs.clusters().size(), kWavyStairs.size());
  std::set<float> heights;
  for (const SampleBlock& block : stairs.blocks()) {
    for (const SampleRun& run : block.runs) {
      const Cluster& cluster = stairs.clusters()[block.slots[run.slot]];
      EXPECT_FALSE(cluster.planar);
      heights.insert(std::round(10.0f * (cluster.centroid.y + camera.eye().y)));
      for (std::uint32_t i = run.first; i < run.first + run.count; ++i) {
        EXPECT_NEAR(block.position.y[i], cluster.centroid.y, 1e-4f);
      }
    }
  }
  EXPECT_EQ(heights, (std::set<float>{-4.0f, 0.0f, 4.0f}));

  const Clustering sphere = clustersOf(rasterized(camera, 0.0f, hitSphere), camera);
  std::set<std::pair<int, int>> bins;
  for (const Cluster& cluster : sphere.clusters()) bins.emplace(cluster.thetaBin, cluster.phiBin);
  EXPECT_EQ(bins.size(), sphere.clusters().size());
}

class ClustersOf : public testing::TestWithParam<Hit*> {};

TEST_P(ClustersOf, SayWhatTheirSamplesAre) {
  const scene::Camera camera = cameraAt({0.5f, 1.9f, 4.0f}, {0.3f, 0.3f, 0.0f});
  const raster::GBufferCopy gbuffer = rasterized(camera, 0.2f, GetParam());
  const Clustering clustering = clustersOf(gbuffer, camera, ReflectorKind::Glossy);
  const std::size_t count = clustering.clusters().size();
  ASSERT_GE(count, 3u);

  // Sums of the samples of each cluster, in double
  const Mat3 rays = scene::rayFromPixel(camera, kSize, kSize);
  std::vector<std::vector<glm::dvec3>> positions(count);
  std::vector<std::vector<glm::dvec3>> normals(count);
  std::vector<int> left(count, kSize), right(count, 0), top(count, kSize), bottom(count, 0);
  std::uint64_t unclustered = 0;
  for (int y = 0; y < kSize; ++y) {
    for (int x = 0; x < kSize; ++x) {
      const auto at = static_cast<std::size_t>(y * kSize + x);
      const std::uint16_t known = clustering.clusterOf()[at];
      EXPECT_EQ(known == 0, gbuffer.object[at] == 0);
      unclustered += known == 1 ? 1 : 0;
      if (known < 2) continue;
      const std::size_t c = known - 2u;
      const Vec3 ray =
          rays * Vec3(static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f, 1.0f);
      positions[c].emplace_back(ray * (camera.nearMetres / gbuffer.depth[at]));
      normals[c].emplace_back(gbuffer.normal[4 * at], gbuffer.normal[4 * at + 1],
                              gbuffer.normal[4 * at + 2]);
      left[c] = std::min(left[c], x);
      right[c] = std::max(right[c], x + 1);
      top[c] = std::min(top[c], y);
      bottom[c] = std::max(bottom[c], y + 1);
    }
  }
  EXPECT_EQ(unclustered, clustering.samplesInNoCluster());
  for (std::size_t c = 0; c < count; ++c) {
    const Cluster& cluster = clustering.clusters()[c];
    ASSERT_EQ(cluster.samples, positions[c].size());
    const double n = cluster.samples;
    glm::dvec3 centroid(0.0);
    glm::dvec3 normal(0.0);
    for (std::size_t i = 0; i < positions[c].size(); ++i) {
      centroid += positions[c][i] / n;
      normal += normals[c][i] / n;
    }
    double bend = 0.0;
    for (std::size_t i = 0; i < positions[c].size(); ++i) {
      bend += glm::dot(positions[c][i] - centroid, normals[c][i] - normal);
    }
    EXPECT_LT(glm::distance(glm::dvec3(cluster.centroid), centroid), 2e-6);
    EXPECT_LT(glm::distance(glm::dvec3(cluster.meanNormal), glm::normalize(normal)), 1e-6);
    EXPECT_EQ(cluster.concave, !cluster.planar && bend < 0.0);
    EXPECT_FLOAT_EQ(cluster.widestLobe.code, 0.2f);
    EXPECT_EQ(cluster.left, left[c]);
    EXPECT_EQ(cluster.right, right[c]);
    EXPECT_EQ(cluster.top, top[c]);
    EXPECT_EQ(cluster.bottom, bottom[c]);
  }
}

TEST_P(ClustersOf, HaveEverySampleInOneRunWithItsRay) {
  const scene::Camera camera = cameraAt({0.5f, 1.9f, 4.0f}, {0.3f, 0.3f, 0.0f});
  const raster::GBufferCopy gbuffer = rasterized(camera, 0.2f, GetParam());
  const Clustering clustering = clustersOf(gbuffer, camera, ReflectorKind::Glossy);
  const Mat3 rays = scene::rayFromPixel(camera, kSize, kSize);
  const std::size_t count = clustering.clusters().size();
  std::vector<std::size_t> inRuns(count, 0);
  for (std::size_t b = 0; b < clustering.blocks().size(); ++b) {
    const SampleBlock& block = clustering.blocks()[b];
    for (std::size_t row = 0; row + 1 < block.rows.size(); ++row) {
      const std::size_t y = b * Clustering::kRows + row;
      for (std::size_t r = block.rows[row]; r < block.rows[row + 1]; ++r) {
        const SampleRun& run = block.runs[r];
        const std::uint16_t cluster = block.slots[run.slot];
        inRuns[cluster] += run.count;
        for (std::size_t k = 0; k < run.count; ++k) {
          const std::size_t at = y * kSize + run.x + k;
          ASSERT_EQ(clustering.clusterOf()[at], cluster + 2);
          const Vec3 ray = glm::normalize(rays * Vec3(static_cast<float>(run.x + k) + 0.5f,
                                                      static_cast<float>(y) + 0.5f, 1.0f));
          const Vec3 normal(gbuffer.normal[4 * at], gbuffer.normal[4 * at + 1],
                            gbuffer.normal[4 * at + 2]);
          EXPECT_LT(glm::distance(block.direction[run.first + k], glm::reflect(ray, normal)),
                    1e-6f);
          EXPECT_LT(glm::distance(glm::normalize(block.position[run.first + k]), ray), 1e-6f);
        }
      }
    }
  }
  for (std::size_t c = 0; c < count; ++c) EXPECT_EQ(inRuns[c], clustering.clusters()[c].samples);
}

TEST_P(ClustersOf, AreTheSameForAnyNumberOfThreads) {
  const scene::Camera camera = cameraAt({0.5f, 1.9f, 4.0f}, {0.3f, 0.3f, 0.0f});
  const raster::GBufferCopy gbuffer = rasterized(camera, 0.2f, GetParam());
  std::vector<std::vector<ClusterCamera>> made;
  std::vector<std::vector<std::uint16_t>> clusterOf;
  for (const int threads : {1, 4}) {
    setThreadCount(threads);
    const Clustering clustering = clustersOf(gbuffer, camera, ReflectorKind::Glossy);
    made.push_back(makeClusterCameras(clustering, camera, kSize, kSize, roomAround(camera)));
    clusterOf.push_back(clustering.clusterOf());
  }
  setThreadCount(0);
  EXPECT_EQ(clusterOf[0], clusterOf[1]);
  ASSERT_EQ(made[0].size(), made[1].size());
  for (std::size_t c = 0; c < made[0].size(); ++c) {
    EXPECT_EQ(made[0][c].rowX, made[1][c].rowX);
    EXPECT_EQ(made[0][c].rowY, made[1][c].rowY);
    EXPECT_EQ(made[0][c].rowZ, made[1][c].rowZ);
    EXPECT_EQ(made[0][c].eye, made[1][c].eye);
    EXPECT_EQ(made[0][c].texelSpreadRad, made[1][c].texelSpreadRad);
  }
}

INSTANTIATE_TEST_SUITE_P(Scenes, ClustersOf, testing::Values(&hitSphereOrFloor, &hitWavyStairs));

TEST(Clusters, SamplesInNoClusterAreLeftToRetrace) {
  const scene::Camera camera = cameraAt({0.5f, 1.9f, 4.0f}, {0.3f, 0.3f, 0.0f});
  const raster::GBufferCopy gbuffer = rasterized(camera, 0.0f, hitSphereOrFloor);
  const std::vector<ReflectorKind> kinds(3, ReflectorKind::Mirror);
  for (const bool kMeans : {false, true}) {
    const ClusterOptions options{.minSamples = 400, .kMeans = kMeans};
    Clustering plain;
    plain.build(gbuffer, camera, kinds, options);
    Clustering left;
    left.build(gbuffer, camera, kinds, options, {false, true, true});
    ASSERT_GT(plain.samplesInNoCluster(), 0u);
    EXPECT_EQ(left.samplesInNoCluster(), 0u);
    EXPECT_EQ(left.samplesAlone(), plain.samplesInNoCluster());
    EXPECT_EQ(left.clusters().size(), plain.clusters().size());
    std::vector<std::uint16_t> expected = plain.clusterOf();
    std::ranges::replace(expected, std::uint16_t{1}, Clustering::kRetraced);
    EXPECT_EQ(left.clusterOf(), expected);
    // Not those of other objects
    left.build(gbuffer, camera, kinds, options, {false, false, false});
    EXPECT_EQ(left.clusterOf(), plain.clusterOf());
    EXPECT_EQ(left.samplesAlone(), 0u);
  }
}

TEST(Clusters, HaveABoundedNumberOfBins) {
  // Rough surfaces, a hundred objects, the most bins that options allow
  const scene::Camera camera = cameraAt({0.5f, 1.9f, 4.0f}, {0.3f, 0.3f, 0.0f});
  raster::GBufferCopy gbuffer = rasterized(camera, 0.0f, hitFloor);
  std::uint32_t random = 1;
  std::uint64_t reflective = 0;
  for (std::size_t at = 0; at < gbuffer.object.size(); ++at) {
    if (gbuffer.object[at] == 0) continue;
    ++reflective;
    gbuffer.object[at] = 1 + static_cast<std::uint32_t>(at / kSize);
    Vec3 normal(0.0f);
    for (int k = 0; k < 3; ++k) {
      random = random * 1664525u + 1013904223u;
      normal[k] = static_cast<float>(random >> 8) / 8388608.0f - 1.0f;
    }
    normal = normalizedOr(normal, Vec3(0.0f, 1.0f, 0.0f));
    for (std::size_t k = 0; k < 3; ++k) gbuffer.normal[4 * at + k] = normal[static_cast<int>(k)];
  }
  const std::vector<ReflectorKind> kinds(kSize + 1, ReflectorKind::Mirror);
  Clustering clustering;
  ClusterOptions options{.maxThetaBins = 128, .maxPhiBins = 64, .binDensity = 1000.0f};
  options.minSamples = 1;
  clustering.build(gbuffer, camera, kinds, options);
  EXPECT_EQ(clustering.timesHalved(), 2);
  EXPECT_LE(clustering.clusters().size(), Clustering::kMostBins);
  std::uint64_t samples = clustering.samplesInNoCluster();
  for (const Cluster& cluster : clustering.clusters()) samples += cluster.samples;
  EXPECT_EQ(samples, reflective);
  for (const ClusterCamera& made :
       makeClusterCameras(clustering, camera, kSize, kSize, roomAround(camera))) {
    EXPECT_TRUE(isFinite(made.eye) && isFinite(Vec3(made.rowX)) && isFinite(Vec3(made.rowZ)));
  }
  // The plain bins need no halving
  clustering.build(gbuffer, camera, kinds, {});
  EXPECT_EQ(clustering.timesHalved(), 0);
}

TEST(Clusters, OfNormalsThatCancelFaceTheEye) {
  // Columns of opposite normals across the view, in one bin
  const scene::Camera camera = cameraAt({0.0f, 0.0f, 3.0f}, {0.0f, 0.0f, 0.0f});
  raster::GBufferCopy gbuffer =
      rasterized(camera, 0.0f, [](const Vec3& eye, const Vec3& d, Vec3& position, Vec3& normal) {
        position = eye - d * (eye.z / d.z);
        normal = Vec3(1.0f, 0.0f, 0.0f);
        return d.z < 0.0f;
      });
  for (std::size_t at = 0; at < gbuffer.object.size(); at += 2) gbuffer.normal[4 * at] = -1.0f;
  Clustering clustering;
  const std::vector<ReflectorKind> kinds = {ReflectorKind::None, ReflectorKind::Mirror};
  clustering.build(gbuffer, camera, kinds, {.maxThetaBins = 1, .maxPhiBins = 1});
  ASSERT_EQ(clustering.clusters().size(), 1u);
  EXPECT_TRUE(clustering.clusters()[0].normalsCancel);
  EXPECT_GT(glm::dot(clustering.clusters()[0].meanNormal, Vec3(0.0f, 0.0f, 1.0f)), 0.99f);
  const std::vector<ClusterCamera> cameras =
      makeClusterCameras(clustering, camera, kSize, kSize, roomAround(camera));
  EXPECT_LT(samplesOutside(clustering, cameras), clustering.reflectiveSamples() / 100);
}

TEST(Clusters, AConcaveSphereIsFoundConcave) {
  // From inside: normals turned to the viewer point to the centre
  const scene::Camera camera = cameraAt({0.0f, 0.0f, 0.2f}, {0.0f, 0.0f, -1.0f});
  const raster::GBufferCopy gbuffer =
      rasterized(camera, 0.0f, [](const Vec3& eye, const Vec3& d, Vec3& position, Vec3& normal) {
        const float b = glm::dot(eye, d);
        position = eye + d * (-b + std::sqrt(b * b - glm::dot(eye, eye) + 1.0f));
        normal = -glm::normalize(position);
        return true;
      });
  const Clustering clustering = clustersOf(gbuffer, camera);
  ASSERT_FALSE(clustering.clusters().empty());
  for (const Cluster& cluster : clustering.clusters()) {
    EXPECT_TRUE(cluster.concave || cluster.samples <= 30);
  }
  const std::vector<ClusterCamera> cameras =
      makeClusterCameras(clustering, camera, kSize, kSize, roomAround(camera));
  EXPECT_LT(samplesOutside(clustering, cameras), clustering.reflectiveSamples() / 100);
}

}  // namespace
}  // namespace catoptric::methods::second_order
