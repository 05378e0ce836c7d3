#include <gtest/gtest.h>

#include <cmath>

#include "methods/second_order/atlas.h"
#include "methods/second_order/cluster_camera.h"
#include "methods/second_order/clusters.h"

namespace catoptric::methods {
namespace {

constexpr int kSize = 96;

scene::Camera cameraAt(const Vec3& eye, const Vec3& target) {
  return scene::lookAt(eye, target, Vec3(0.0f, 1.0f, 0.0f), radians(50.0f));
}

/// A G-buffer of one object, hit(origin, direction, position, normal) for each ray.
template <class Hit>
raster::GBufferCopy rasterized(const scene::Camera& camera, float glossiness, const Hit& hit) {
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
}

TEST(Bins, NormalsNextToAPoleAreOneBin) {
  const BinScale all{13.0f, 8.0f, 13, 8};
  for (float turn = 0.0f; turn < 6.2f; turn += 0.3f) {
    EXPECT_EQ(binOf(Vec3(1e-4f * std::cos(turn), 1.0f, 1e-4f * std::sin(turn)), all), 0);
  }
  EXPECT_EQ(binOf(Vec3(0.0f, -1.0f, 0.0f), all), 7 * 13);
  EXPECT_NE(binOf(Vec3(1.0f, 0.0f, 0.0f), all), binOf(Vec3(-1.0f, 0.0f, 0.0f), all));
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
  std::size_t all = 0;
  for (std::size_t b = 0; b < clustering.blocks(); ++b) {
    for (const ClusterSample& sample : clustering.samples(b)) {
      const ClusterCamera& made = cameras[sample.cluster];
      for (const float t : {0.0f, 0.5f, 2.0f}) {
        const Vec3 at = projected(made, sample.position + t * sample.direction);
        const bool inside = at.x > 0.0f && at.y > 0.0f && at.x < static_cast<float>(made.width) &&
                            at.y < static_cast<float>(made.height) && at.z > 0.0f && at.z <= 1.0f;
        outside += inside ? 0 : 1;
        ++all;
      }
    }
  }
  // All but grazing rays at the silhouette, which run beside the frame
  EXPECT_LT(static_cast<double>(outside), 0.01 * static_cast<double>(all));
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
