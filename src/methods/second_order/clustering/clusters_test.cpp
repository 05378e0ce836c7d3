#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <utility>
#include <vector>

#include "core/parallel.h"
#include "methods/second_order/cameras/cluster_camera.h"
#include "methods/second_order/clustering/clusters.h"
#include "methods/second_order/depth_images/atlas.h"

namespace catoptric::methods {
namespace {

constexpr int kSize = 96;

scene::Camera cameraAt(const Vec3& eye, const Vec3& target) {
  return scene::lookAt(eye, target, Vec3(0.0f, 1.0f, 0.0f), radians(50.0f));
}

using Hit = bool(const Vec3& eye, const Vec3& direction, Vec3& position, Vec3& normal);

/// A G-buffer of one object, hit(origin, direction, position, normal) for each ray.
raster::GBufferCopy rasterized(const scene::Camera& camera, float glossiness, Hit* hit) {
  raster::GBufferCopy copy;
  copy.width = copy.height = kSize;
  copy.samples = 1;
  const Mat3 rays = scene::rayFromPixel(camera, kSize, kSize);
  for (int y = 0; y < kSize; ++y) {
    for (int x = 0; x < kSize; ++x) {
      const Vec3 ray =
          rays * Vec3(static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f, 1.0f);
      Vec3 position(0.0f);
      Vec3 normal(0.0f);
      const bool found = hit(camera.eye(), glm::normalize(ray), position, normal);
      copy.object.push_back(found ? 1 : 0);
      const float along = glm::dot(position - camera.eye(), camera.forward());
      copy.depth.push_back(found ? camera.nearMetres / along : 0.0f);
      for (int k = 0; k < 3; ++k) copy.normal.push_back(normal[k]);
      copy.normal.push_back(glossiness);
    }
  }
  return copy;
}

bool hitFloor(const Vec3& eye, const Vec3& d, Vec3& position, Vec3& normal) {
  if (d.y >= -0.02f) return false;
  position = eye - d * (eye.y / d.y);
  normal = Vec3(0.0f, 1.0f, 0.0f);
  return std::abs(position.x) < 2.0f && std::abs(position.z) < 2.0f;
}

bool hitSphere(const Vec3& eye, const Vec3& d, Vec3& position, Vec3& normal) {
  const float b = glm::dot(eye, d);
  const float c = glm::dot(eye, eye) - 1.0f;
  if (b * b - c < 0.0f) return false;
  position = eye + d * (-b - std::sqrt(b * b - c));
  normal = glm::normalize(position);
  return true;
}

CameraOptions roomAround(const scene::Camera& camera) {
  CameraOptions options;
  options.sceneBounds.min = Vec3(-5.0f, -2.0f, -5.0f) - camera.eye();
  options.sceneBounds.max = Vec3(5.0f, 4.0f, 5.0f) - camera.eye();
  return options;
}

Clustering clustersOf(const raster::GBufferCopy& gbuffer, const scene::Camera& camera,
                      ReflectorKind kind = ReflectorKind::Mirror) {
  Clustering clustering;
  const std::vector<ReflectorKind> kinds = {ReflectorKind::None, kind};
  clustering.build(gbuffer, camera, kinds, {});
  return clustering;
}

Vec3 projected(const ClusterCamera& camera, const Vec3& p) {
  const float w = glm::dot(camera.rowW, Vec4(p, 1.0f));
  return {glm::dot(camera.rowX, Vec4(p, 1.0f)) / w, glm::dot(camera.rowY, Vec4(p, 1.0f)) / w,
          glm::dot(camera.rowZ, Vec4(p, 1.0f)) / w};
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

TEST(EyeDistance, HasADefinedAnswerForEveryBundle) {
  EXPECT_FLOAT_EQ(eyeDistance(1.0f, 3.0f, 10.0f), 5.0f);  // spreads to 3 over 10 m
  EXPECT_TRUE(std::isinf(eyeDistance(1.0f, 1.0f, 10.0f)));
  EXPECT_LT(eyeDistance(1.0f, 0.5f, 10.0f), 0.0f);   // converges
  EXPECT_LT(eyeDistance(1.0f, -2.0f, 10.0f), 0.0f);  // has crossed
}

TEST(Clusters, APlaneIsOnePlanarClusterOnTheMirroredFramesGrid) {
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

TEST(Clusters, EquationOneLeavesTheEyeOfAPlaneInItsPlace) {
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

TEST(Clusters, RaysOfASphereStayInTheirFramesAndSpread) {
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

TEST(Clusters, LowSamplesAtABorderLetInNothingFromBehindTheOthers) {
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

/// A sphere beside a floor: planar and curved clusters, in one object.
bool hitSphereOrFloor(const Vec3& eye, const Vec3& d, Vec3& position, Vec3& normal) {
  return hitSphere(eye, d, position, normal) || hitFloor(eye, d, position, normal);
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
    EXPECT_FLOAT_EQ(cluster.maxGlossiness, 0.2f);
    EXPECT_EQ(cluster.left, left[c]);
    EXPECT_EQ(cluster.right, right[c]);
    EXPECT_EQ(cluster.top, top[c]);
    EXPECT_EQ(cluster.bottom, bottom[c]);
  }

  // Runs hold every sample of a cluster once, with its ray
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
  for (std::size_t c = 0; c < count; ++c) EXPECT_EQ(inRuns[c], positions[c].size());
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
  EXPECT_TRUE(isFinite(cameras[0].eye));
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
  for (const ClusterCamera& made :
       makeClusterCameras(clustering, camera, kSize, kSize, roomAround(camera))) {
    EXPECT_TRUE(isFinite(made.eye));
    EXPECT_GT(made.width, 0);
    EXPECT_GT(made.height, 0);
  }
}

TEST(Atlas, PlacesDoNotOverlapAndStayInside) {
  std::vector<AtlasSize> sizes;
  for (int i = 0; i < 200; ++i) sizes.push_back({1 + i * 7919 % 120, 1 + i * 104729 % 90});
  const AtlasSize layer{256, 200};
  const Atlas atlas = packAtlas(sizes, layer);
  ASSERT_EQ(atlas.places.size(), sizes.size());
  std::vector<int> covered(static_cast<std::size_t>(atlas.layers) * 256 * 200, 0);
  for (std::size_t i = 0; i < sizes.size(); ++i) {
    const AtlasPlace& p = atlas.places[i];
    ASSERT_LE(p.x + sizes[i].width, layer.width);
    ASSERT_LE(p.y + sizes[i].height, layer.height);
    for (int y = p.y; y < p.y + sizes[i].height; ++y) {
      for (int x = p.x; x < p.x + sizes[i].width; ++x) {
        ++covered[(static_cast<std::size_t>(p.layer) * 200 + static_cast<std::size_t>(y)) * 256 +
                  static_cast<std::size_t>(x)];
      }
    }
  }
  EXPECT_EQ(std::count_if(covered.begin(), covered.end(), [](int n) { return n > 1; }), 0);
  std::int64_t area = 0;
  for (const AtlasSize& size : sizes) area += size.width * size.height;
  EXPECT_EQ(std::count(covered.begin(), covered.end(), 1), area);
}

}  // namespace
}  // namespace catoptric::methods
