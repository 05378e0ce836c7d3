#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "methods/second_order/cameras/window.h"
#include "methods/second_order/test_samples.h"

namespace catoptric::methods::second_order {
namespace {

TEST(EyeDistance, HasADefinedAnswerForEveryBundle) {
  EXPECT_FLOAT_EQ(eyeDistance(1.0f, 3.0f, 10.0f), 5.0f);  // spreads to 3 over 10 m
  EXPECT_TRUE(std::isinf(eyeDistance(1.0f, 1.0f, 10.0f)));
  EXPECT_LT(eyeDistance(1.0f, 0.5f, 10.0f), 0.0f);   // converges
  EXPECT_LT(eyeDistance(1.0f, -2.0f, 10.0f), 0.0f);  // has crossed
}

TEST(ClusterCameras, APlaneIsOnePlanarClusterOnTheMirroredFramesGrid) {
  const scene::Camera camera = cameraAt({1.0f, 1.6f, 3.0f}, {0.0f, 0.0f, 0.0f});
  const raster::GBufferCopy gbuffer = rasterized(camera, 0.0f, hitFloor);
  const Clustering clustering = clustersOf(gbuffer, camera);
  ASSERT_EQ(clustering.clusters().size(), 1u);
  EXPECT_TRUE(clustering.clusters()[0].planar);
  EXPECT_FALSE(clustering.clusters()[0].concave);
  EXPECT_EQ(clustering.clusters()[0].samples, clustering.reflectiveSamples());
  const std::vector<ClusterCamera> cameras =
      makeClusterCameras(clustering, camera, kSize, kSize, roomAround(camera));
  ASSERT_TRUE(cameras[0].mirrorGrid);
  // e_c is the mirrored eye, and every sample of the floor is at its own texel's centre
  EXPECT_NEAR(glm::distance(cameras[0].eye + camera.eye(), Vec3(1.0f, -1.6f, 3.0f)), 0.0f, 1e-5f);
  const Mat3 rays = scene::rayFromPixel(camera, kSize, kSize);
  std::size_t samples = 0;
  for (int y = 0; y < kSize; ++y) {
    for (int x = 0; x < kSize; ++x) {
      if (clustering.clusterOf()[static_cast<std::size_t>(y * kSize + x)] != 2) continue;
      ++samples;
      const Vec2 centre(static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f);
      const Vec3 incoming = glm::normalize(rays * Vec3(centre, 1.0f));
      const Vec3 position = incoming * (-camera.eye().y / incoming.y);
      const Vec3 direction = incoming * Vec3(1.0f, -1.0f, 1.0f);
      for (const float t : {0.0f, 0.5f, 4.0f}) {
        const Vec3 at = projected(cameras[0], position + t * direction);
        EXPECT_NEAR(at.x, cameras[0].mirrorRight - centre.x, 2e-3f);
        EXPECT_NEAR(at.y, centre.y - cameras[0].mirrorTop, 2e-3f);
        EXPECT_LE(at.z, 1.001f);
        EXPECT_GT(at.z, 0.0f);
      }
    }
  }
  EXPECT_EQ(samples, clustering.clusters()[0].samples);
}

TEST(ClusterCameras, EquationOneLeavesTheEyeOfAPlaneInItsPlace) {
  // A glossy plane goes the way of curved clusters: f = 1, e_c = e_0
  const scene::Camera camera = cameraAt({1.0f, 1.6f, 3.0f}, {0.0f, 0.0f, 0.0f});
  const raster::GBufferCopy gbuffer = rasterized(camera, 0.3f, hitFloor);
  const Clustering clustering = clustersOf(gbuffer, camera, ReflectorKind::Glossy);
  const CameraOptions options = roomAround(camera);
  const std::vector<ClusterCamera> cameras =
      makeClusterCameras(clustering, camera, kSize, kSize, options);
  ASSERT_EQ(cameras.size(), 1u);
  EXPECT_FALSE(cameras[0].mirrorGrid);
  EXPECT_NEAR(cameras[0].displacement, 1.0f, 1e-4f);
  EXPECT_LT(glm::distance(cameras[0].eye + camera.eye(), Vec3(1.0f, -1.6f, 3.0f)),
            1e-5f * options.sceneBounds.diameter());
  EXPECT_FALSE(cameras[0].parallel || cameras[0].crossing || cameras[0].pushedBack);
}

// Spacing and pairs decide how many texels an image has.
TEST(ClusterCameras, WindowsAddUpNeighboursInRowsAndColumns) {
  const scene::Camera camera = cameraAt({0.5f, 1.0f, 4.0f}, {0.0f, 0.0f, 0.0f});
  const raster::GBufferCopy gbuffer = rasterized(camera, 0.0f, hitSphere);
  const Clustering clustering = clustersOf(gbuffer, camera);
  const std::size_t count = clustering.clusters().size();
  const std::vector<ClusterCamera> cameras =
      makeClusterCameras(clustering, camera, kSize, kSize, roomAround(camera));
  std::vector<ClusterFrame> frames;
  for (const Cluster& cluster : clustering.clusters())
    frames.push_back(frameOf(cluster, camera, 1));
  const std::vector<std::uint8_t> curved(count, 1);
  const std::vector<ClusterWindow> windows =
      findWindows(clustering, curved, frames, cameras, roomAround(camera).sceneBounds);
  struct Sums {
    std::uint64_t pairs = 0;
    double spacing = 0.0;
    float nearest = 1e30f;
    float farthest = 0.0f;
  };
  std::vector<Sums> sums(count);
  for (const SampleBlock& block : clustering.blocks()) {
    using Row = std::map<int, std::pair<std::size_t, Vec2>>;  // cluster and tangents by column
    Row above;
    for (std::size_t row = 0; row + 1 < block.rows.size(); ++row) {
      Row here;
      for (std::size_t r = block.rows[row]; r < block.rows[row + 1]; ++r) {
        const SampleRun& run = block.runs[r];
        const std::size_t c = block.slots[run.slot];
        for (std::uint32_t i = 0; i < run.count; ++i) {
          const Vec3 p = block.position[run.first + i] - cameras[c].eye;
          const float z = glm::dot(p, frames[c].axis);
          here[run.x + static_cast<int>(i)] = {
              c, Vec2(glm::dot(p, frames[c].right), glm::dot(p, frames[c].down)) / z};
          sums[c].nearest = std::min(sums[c].nearest, z);
          sums[c].farthest = std::max(sums[c].farthest, z);
        }
      }
      for (const auto& [x, sample] : here)
        for (const auto& [samples, place] : {std::pair(&here, x - 1), {&above, x}}) {
          const auto other = samples->find(place);
          if (other == samples->end() || other->second.first != sample.first) continue;
          ++sums[sample.first].pairs;
          sums[sample.first].spacing +=
              static_cast<double>(glm::distance(sample.second, other->second.second));
        }
      above = std::move(here);
    }
  }
  for (std::size_t c = 0; c < count; ++c) {
    EXPECT_EQ(windows[c].pairs, sums[c].pairs) << c;
    EXPECT_NEAR(windows[c].spacing, sums[c].spacing, 1e-4 * sums[c].spacing) << c;
    EXPECT_NEAR(windows[c].nearest, sums[c].nearest, 1e-5f * sums[c].nearest) << c;
    EXPECT_NEAR(windows[c].farthest, sums[c].farthest, 1e-5f * sums[c].farthest) << c;
  }
}

TEST(ClusterCameras, RaysOfASphereStayInTheirFramesAndSpread) {
  const scene::Camera camera = cameraAt({0.5f, 1.0f, 4.0f}, {0.0f, 0.0f, 0.0f});
  const raster::GBufferCopy gbuffer = rasterized(camera, 0.0f, hitSphere);
  const Clustering clustering = clustersOf(gbuffer, camera);
  // 13 x 8 / 2 bins at most are visible
  EXPECT_GT(clustering.clusters().size(), 20u);
  EXPECT_LE(clustering.clusters().size(), 60u);
  const std::vector<ClusterCamera> cameras =
      makeClusterCameras(clustering, camera, kSize, kSize, roomAround(camera));
  std::uint64_t inClusters = 0;
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    inClusters += clustering.clusters()[c].samples;
    EXPECT_FALSE(clustering.clusters()[c].planar);
    EXPECT_FALSE(clustering.clusters()[c].concave);
    EXPECT_FALSE(cameras[c].crossing);
    EXPECT_GT(cameras[c].displacement, 0.0f);
    EXPECT_LT(cameras[c].displacement, 1.0f);
  }
  EXPECT_EQ(inClusters + clustering.samplesInNoCluster(), clustering.reflectiveSamples());
  std::size_t outside = 0;
  std::size_t below = 0;
  std::size_t all = 0;
  for (const SampleBlock& block : clustering.blocks()) {
    for (const SampleRun& run : block.runs) {
      const ClusterCamera& made = cameras[block.slots[run.slot]];
      for (std::size_t i = run.first; i < run.first + run.count; ++i) {
        for (const float t : {0.0f, 0.5f, 2.0f}) {
          const Vec3 at = projected(made, block.position[i] + t * block.direction[i]);
          const bool inside = at.x > 0.0f && at.y > 0.0f && at.x < static_cast<float>(made.width) &&
                              at.y < static_cast<float>(made.height) && at.z > 0.0f;
          outside += inside ? 0 : 1;
          below += at.z > 1.0f ? 1 : 0;
          ++all;
        }
      }
    }
  }
  // All but grazing rays at the silhouette, which run beside the frame
  EXPECT_LT(static_cast<double>(outside), 0.01 * static_cast<double>(all));
  // A tenth of a cluster's samples may begin below the plane that cuts off what lies behind it
  EXPECT_GT(below, 0u);
  EXPECT_LT(static_cast<double>(below), 0.1 * static_cast<double>(all) / 3.0);
}

/// A floor that is not quite flat, with a step down along its border.
bool hitSteppedFloor(const Vec3& eye, const Vec3& d, Vec3& position, Vec3& normal) {
  bool found = hitFloor(eye, d, position, normal);
  if (found && position.x > 1.5f) {
    found = hitFloor(eye + Vec3(0.0f, 0.3f, 0.0f), d, position, normal);
    position.y -= 0.3f;
  }
  normal = glm::normalize(Vec3(0.3f + 0.002f * std::sin(40.0f * position.x), 1.0f, 0.1f));
  return found;
}

TEST(ClusterCameras, LowSamplesAtABorderLetInNothingFromBehindTheOthers) {
  const scene::Camera camera = cameraAt({0.0f, 1.6f, 3.0f}, {0.0f, 0.0f, 0.0f});
  const raster::GBufferCopy gbuffer = rasterized(camera, 0.0f, hitSteppedFloor);
  const Clustering clustering = clustersOf(gbuffer, camera);
  ASSERT_EQ(clustering.clusters().size(), 1u);
  EXPECT_FALSE(clustering.clusters()[0].planar);
  float lowest = 0.0f;
  for (const SampleBlock& block : clustering.blocks()) {
    for (const float y : block.position.y) lowest = std::min(lowest, y + camera.eye().y);
  }
  EXPECT_NEAR(lowest, -0.3f, 1e-3f);
  const ClusterCamera made =
      makeClusterCameras(clustering, camera, kSize, kSize, roomAround(camera)).at(0);
  EXPECT_GT(projected(made, Vec3(0.0f, -0.1f, 0.0f) - camera.eye()).z, 1.0f);
  EXPECT_LT(projected(made, Vec3(0.0f, 0.1f, 0.0f) - camera.eye()).z, 1.0f);
}

}  // namespace
}  // namespace catoptric::methods::second_order
