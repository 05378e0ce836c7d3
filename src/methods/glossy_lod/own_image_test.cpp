// Rays that leave a body's true surface, against what is known of the body.
#include "methods/glossy_lod/own_image.h"

#include <gtest/gtest.h>

#include <array>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "frame/test_scenes.h"
#include "methods/testing/cpu_harness.h"
#include "scene/shapes/shapes.h"

namespace catoptric::methods::glossy_lod {
namespace {

constexpr float kSlope = 0.02f;  ///< width of a ray per metre

scene::Scene sceneOf(const scene::Mesh& body) {
  test::SceneBuilder builder;
  builder.add(scene::Mesh(body), builder.reflective(1.0f, 0.2f));
  return builder.scene();
}

/// A reflective body and its image.
class Body {
 public:
  Body(const scene::Mesh& mesh, int size) : scene_(sceneOf(mesh)), moment_(scene_) {
    const Options options{.size = size};
    images_.make(scene_, moment_.geometry, options, findSizes(scene_, {}, options));
  }

  struct Seen {
    std::size_t rays = 0, nothing = 0, fronts = 0, backs = 0;
  };
  /// Sends rays from points of the surface into the half-space over it, with `inwards` over its
  /// back. Every other ray is grazing.
  Seen send(std::size_t packets, bool inwards, float alpha) {
    std::mt19937 random(5);
    Seen seen;
    for (std::size_t i = 0; i < packets; ++i) {
      PacketHits hits;
      sendPacket(random, inwards, alpha, hits);
      for (std::size_t lane = 0; lane < RayPacket::kMost; ++lane) {
        ++seen.rays;
        ++(hits.node[lane] == kNothing ? seen.nothing
           : hits.back[lane] != 0      ? seen.backs
                                       : seen.fronts);
      }
    }
    return seen;
  }

  Visits visits;

 private:
  void sendPacket(std::mt19937& random, bool inwards, float alpha, PacketHits& hits) {
    std::uniform_real_distribution<float> unit(0.0f, 1.0f);
    std::normal_distribution<float> any(0.0f, 1.0f);
    trace::PointLanes& points = *points_;
    points.count = 0;
    const std::vector<std::uint32_t>& index = moment_.geometry.indices;
    const std::vector<Vec3>& corner = moment_.geometry.positions;
    while (points.count < RayPacket::kMost) {
      const std::size_t first = 3 * (random() % (index.size() / 3));
      const Vec3 p0 = corner[index[first]];
      const Vec3 e1 = corner[index[first + 1]] - p0;
      const Vec3 e2 = corner[index[first + 2]] - p0;
      const Vec3 normal = normalizedOr(glm::cross(e1, e2), Vec3(0.0f));
      if (normal == Vec3(0.0f)) continue;
      const float u = unit(random);
      const float v = unit(random) * (1.0f - u);
      trace::ReflectionPoint point;
      point.position = p0 + u * e1 + v * e2;
      point.normal = point.lobeHorizon = inwards ? -normal : normal;
      point.direction = -point.normal;
      point.object = 1;
      points.add(point);
    }
    std::array<LeftPoint, RayPacket::kMost> left;
    RayPacket packet;
    packet.count = points.count;
    liftOntoImages(images_, images_.view(), points, left.data(), visits);
    trace::aim(points);
    for (std::size_t i = 0; i < points.count; ++i) {
      const Vec3 normal = points.normal.at(i);
      const Vec3 to = glm::normalize(Vec3(any(random), any(random), any(random)));
      const Vec3 along = normalizedOr(to - glm::dot(to, normal) * normal, Vec3(1, 0, 0));
      const float up = i % 2 == 0 ? 0.05f : 1.0f;
      const Vec3 direction = glm::normalize(along + up * unit(random) * normal);
      for (int axis = 0; axis < 3; ++axis) {
        packet.origin[static_cast<std::size_t>(axis)][i] = points.origin.at(i)[axis];
        packet.direction[static_cast<std::size_t>(axis)][i] = direction[axis];
      }
      packet.base[i] = 0.0f;
      packet.slope[i] = kSlope;
      packet.own[i] = 1;
    }
    traverseFrom(left, images_, moment_.geometry, images_.view(), packet, alpha, Levels::Stitched,
                 hits, visits);
  }

  scene::Scene scene_;
  test::Moment moment_;
  SceneImages images_;
  std::unique_ptr<trace::PointLanes> points_ = std::make_unique<trace::PointLanes>();
};

std::vector<scene::Mesh> convexBodies() {
  return {scene::makeIcosphere(1.0f, 4, scene::UvMode::Unit),
          scene::makeSphere(1.0f, 97, 53, scene::UvMode::Unit),
          scene::makeRoundedBox(Vec3(2.0f), 0.3f, 4, scene::UvMode::Unit)};
}

std::string named(const scene::Mesh& mesh, int size, float alpha) {
  return std::to_string(mesh.positions.size()) + " vertices, size " + std::to_string(size) +
         ", alpha " + std::to_string(alpha);
}

// Whatever is inside a closed body sees its inside.
TEST(GlossyLodOwnImage, LetsNoRayOutOfAClosedBody) {
  std::size_t count = 0;
  for (const scene::Mesh& mesh : convexBodies()) {
    for (const int size : {32, 128}) {
      Body body(mesh, size);
      for (const float alpha : {0.0f, 3.0f}) {
        const Body::Seen seen = body.send(2700, true, alpha);
        count += seen.rays;
        EXPECT_EQ(seen.nothing, 0u) << named(mesh, size, alpha);
        // Where the image folds over, it may show its other side from afar
        EXPECT_LE(seen.fronts, seen.rays / 2000) << named(mesh, size, alpha);
        EXPECT_GT(body.visits.lifted, 0u) << named(mesh, size, alpha);
      }
    }
  }
  EXPECT_GE(count, 1'000'000u);
}

TEST(GlossyLodOwnImage, LetsHardlyARayOutOfATorus) {
  const scene::Mesh mesh = scene::makeTorus(1.0f, 0.4f, 60, 30, scene::UvMode::Unit);
  for (const int size : {16, 32, 128}) {
    const Body::Seen seen = Body(mesh, size).send(1400, true, 3.0f);
    EXPECT_LE(seen.nothing, seen.rays / 10000) << size;
    EXPECT_LE(seen.fronts, seen.rays / 1000) << size;
  }
}

// A convex body sees nothing of itself.
TEST(GlossyLodOwnImage, IsNotSeenFromOutsideAConvexBody) {
  for (const scene::Mesh& mesh : convexBodies()) {
    for (const int size : {32, 128}) {
      Body body(mesh, size);
      for (const float alpha : {0.0f, 3.0f}) {
        const Body::Seen seen = body.send(600, false, alpha);
        // Grazing rays over folds of the rounded box
        EXPECT_LE(seen.fronts + seen.backs, seen.rays / 250) << named(mesh, size, alpha);
      }
    }
  }
}

}  // namespace
}  // namespace catoptric::methods::glossy_lod
