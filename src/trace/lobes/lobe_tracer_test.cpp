#include "trace/lobes/lobe_tracer.h"

#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <cstdint>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "core/test_vector_levels.h"
#include "frame/test_scenes.h"
#include "scene/animate.h"
#include "scene/implicit/surface.h"
#include "scene/scene.h"
#include "scene/texture.h"
#include "trace/lobes/reflect.h"

namespace catoptric {
namespace {

using test::SceneBuilder;
using test::translation;
using trace::ReflectionPoint;

constexpr float kSpread = 1e-3f;

/// A room with mirrors (one an implicit surface), wide and narrow lobes, and a glass ball, under a
/// sky with a gradient.
class World {
 public:
  World() {
    SceneBuilder builder;
    scene::BoxShape box;
    box.size = Vec3(10.0f, 4.0f, 10.0f);
    box.inward = true;
    // Noise of texels about as wide as the rays' cones: every change of a cone shows.
    const int walls = builder.diffuse(Vec3(0.5f, 0.7f, 0.2f));
    std::mt19937 random(11);
    std::vector<std::uint8_t> noise(4 * 256 * 256);
    for (std::uint8_t& texel : noise) texel = static_cast<std::uint8_t>(random());
    builder.scene().textures.emplace_back().levels =
        scene::makeMipChain(256, 256, std::move(noise), true);
    builder.scene().materials[static_cast<std::size_t>(walls)].baseColorTexture.texture = 0;
    builder.add(scene::makeBox(box, scene::UvMode::Metres), walls);
    const int glass = builder.reflective(1.0f);
    builder.scene().materials[static_cast<std::size_t>(glass)].refraction = 1.5f;
    const std::vector<int> materials = {
        builder.reflective(1.0f),
        builder.reflective(0.6f, 0.3f, Vec3(0.2f), Vec3(0.9f, 0.5f, 0.1f)),
        builder.reflective(0.8f, 0.9f), glass};
    builder.scene().materials[static_cast<std::size_t>(materials[2])].lobe = scene::LobeModel::Ggx;
    for (std::size_t i = 0; i < materials.size(); ++i)
      builder.add(i == 0
                      ? scene::makeImplicit(implicit::sphereSurface(0.7), 24, scene::UvMode::Unit)
                      : scene::makeSphere(0.7f, 48, 24, scene::UvMode::Unit),
                  materials[i], translation({1.7f * static_cast<float>(i) - 2.5f, 0.3f, -1.0f}));
    scene_ = builder.scene();
    scene_.environment.type = scene::EnvironmentType::Gradient;
    scene_.environment.color = Vec3(0.2f, 0.4f, 0.9f);
    scene_.environment.ground = Vec3(0.3f, 0.2f, 0.1f);
    scene_.ambient = Vec3(0.4f);
    const scene::Pose pose = scene::poseAt(scene_, 0.0);
    geometry_ = frame::makeGeometry(scene_, pose);
    lighting_ = frame::makeLighting(scene_, pose,
                                    std::make_shared<frame::EnvironmentLight>(scene_.environment));
    trace_ = std::make_unique<trace::TraceScene>(scene_, geometry_, trace::BvhPolicy::Static);
  }

  /// What random rays from an eye meet of the reflective objects; more than two tiles.
  std::vector<ReflectionPoint> points() const {
    std::mt19937 random(5);
    std::uniform_real_distribution<float> uniform(-1.0f, 1.0f);
    const Vec3 eye(0.0f, 1.2f, 3.0f);
    std::vector<ReflectionPoint> points;
    while (points.size() < 700) {
      const Vec3 target(3.5f * uniform(random), 0.3f + 0.8f * uniform(random), -1.0f);
      const Vec3 direction = glm::normalize(target - eye);
      trace::Hit hit;
      trace_->intersectSerial(std::vector<trace::Ray>{{eye, direction}}, {&hit, 1}, true);
      if (hit.miss() || scene_.objects[static_cast<std::size_t>(hit.object)].reflector == 0)
        continue;
      const frame::SurfacePoint surface =
          frame::shadeSurface(scene_, geometry_, lighting_, hit.object, hit.primitive, hit.u, hit.v,
                              eye + hit.distance * direction, direction, kSpread * hit.distance);
      ReflectionPoint point{surface.position, surface.normal, direction, surface.lobe,
                            hit.distance};
      // As normal maps bend it, so that some rays would leave below the surface.
      point.normal =
          glm::normalize(point.normal + 0.3f * Vec3(uniform(random), uniform(random), 0.0f));
      point.object = surface.object;
      // As a triangle of the implicit ball has it: it is settled first, and its cone stays.
      if (geometry_.objects[static_cast<std::size_t>(hit.object)].surface >= 0)
        point.position -= 0.01f * direction;
      point.extent = trace_->extentOf(hit.object);
      if (points.size() % 3 != 0) point.lobeHorizon = surface.geometricNormal;
      point.shift = {0.125f + 0.25f * static_cast<float>(points.size() % 4), 0.0f};
      points.push_back(point);
    }
    return points;
  }

  const trace::TraceScene& traceScene() const { return *trace_; }
  const frame::Lighting& lighting() const { return lighting_; }

  /// The light along one lobe, ray by ray, by the functions that define it.
  Vec3 plainly(const ReflectionPoint& seen, const trace::ReflectionOptions& options, int rays,
               int bounces) const {
    ReflectionPoint point = seen;
    trace::settle(*trace_, point);
    const int count = trace::lobeRays(point.lobe, rays);
    Vec3 sum(0.0f);
    for (int k = 0; k < count; ++k) {
      const auto [ray, made, total] = trace::lobeRay(point, k, count);
      trace::Hit hit;
      trace_->intersectSerial(std::vector<trace::Ray>{ray}, {&hit, 1}, true);
      if (hit.miss()) {
        sum += made.weight * lighting_.environment->radiance(ray.direction);
        continue;
      }
      const float width =
          kSpread * (seen.distance + hit.distance) + spreadOf(seen.lobe, made, rays) * hit.distance;
      const frame::SurfacePoint surface =
          frame::shadeSurface(scene_, geometry_, lighting_, hit.object, hit.primitive, hit.u, hit.v,
                              ray.origin + hit.distance * ray.direction, ray.direction, width);
      Vec3 value = surface.diffuse;
      if (bounces > 1 && surface.specularLevel > 0.0f) {
        const ReflectionPoint next =
            trace::nextPoint(*trace_, seen, k, ray.direction, hit, surface);
        const trace::ReflectionWeights weights =
            trace::reflectionWeights(surface.specularLevel, surface.tint, surface.f90, surface.lobe,
                                     ray.direction, surface.normal, options.fresnelSchlick);
        value =
            weights.diffuse * value + weights.reflection * plainly(next, options, 1, bounces - 1);
      }
      sum += made.weight * value;
    }
    return sum / static_cast<float>(count);
  }

 private:
  static float spreadOf(scene::Lobe lobe, const trace::LobeRay& made, int rays) {
    return lobe.ggx() && !lobe.mirror() ? std::sqrt(trace::solidAngleOf(made.density, rays))
                                        : trace::lobeSpread(lobe, rays);
  }

  scene::Scene scene_;
  frame::Geometry geometry_;
  frame::Lighting lighting_;
  std::unique_ptr<trace::TraceScene> trace_;
};

bool sameVector(const Vec3& a, const Vec3& b) {
  using Bits = std::array<std::uint32_t, 3>;
  return std::bit_cast<Bits>(a) == std::bit_cast<Bits>(b);
}

using Levels = VectorLevels;

TEST_P(Levels, GiveTheBitsOfThePlainDefinition) {
  const World world;
  const std::vector<ReflectionPoint> points = world.points();
  const std::vector<trace::ReflectionOptions> cases = {
      {.rays = 1},
      {.rays = 8},
      {.rays = 49},
      {.rays = 256},
      {.rays = 8, .bounces = 3, .fresnelSchlick = true}};
  for (const trace::ReflectionOptions& options : cases) {
    std::vector<Vec3> radiance(points.size());
    std::vector<std::uint8_t> flags(points.size(), 0);
    std::vector<trace::FirstHit> hits(points.size());
    std::vector<trace::SecondHit> seconds(points.size());
    const trace::ReflectionCounts counts =
        trace::reflectedRadiance(world.traceScene(), world.lighting(), kSpread, points, options,
                                 true, radiance, flags, hits, seconds);
    EXPECT_GT(counts.belowHorizon, 0u) << options.rays;
    std::uint64_t rays = 0;
    for (std::size_t i = 0; i<points.size(); i += options.rays> 8 ? 7 : 1) {
      const Vec3 expected = world.plainly(points[i], options, options.rays, options.bounces);
      ASSERT_TRUE(sameVector(radiance[i], expected))
          << options.rays << " rays, point " << i << ": " << radiance[i].x << " instead of "
          << expected.x;
    }
    for (const ReflectionPoint& point : points)
      rays += static_cast<std::uint64_t>(trace::lobeRays(point.lobe, options.rays));
    std::size_t gone = 0;  // on, from mirrors
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (seconds[i].direction == Vec3(0.0f)) continue;
      ++gone;
      ASSERT_TRUE(sameVector(radiance[i], seconds[i].surface + seconds[i].arrived)) << i;
      ASSERT_FALSE(hits[i].hit.miss()) << i;
    }
    if (options.bounces == 1) {
      EXPECT_EQ(counts.rays, rays);
      EXPECT_EQ(gone, 0u);
    } else {
      EXPECT_GT(gone, 10u);
    }
  }
}

TEST_P(Levels, PlaceSamplesAsTheFirstLevelDoes) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> uniform(0.0f, 1.0f);
  const trace::SampleCamera camera{
      {0.3f, 1.7f, -2.0f},
      0.05f,
      Mat3(0.0021f, 0.0003f, -0.0001f, 0.0f, -0.002f, 0.0007f, -1.1f, 0.9f, -1.3f)};
  trace::SampleLanes samples;
  auto points = std::make_unique<trace::PointLanes>();
  points->count = 253;
  for (std::size_t i = 0; i < points->count; ++i) {
    samples.x[i] = 1024.0f * uniform(random);
    samples.y[i] = 1024.0f * uniform(random);
    samples.depth[i] = uniform(random);
  }
  trace::placePoints(camera, samples, *points);
  for (std::size_t i = 0; i < points->count; ++i) {
    // The operations of methods/shared/sample_points.h
    const Vec3 ray = camera.rayFromPixel * Vec3(samples.x[i], samples.y[i], 1.0f);
    const float scale = camera.nearMetres / samples.depth[i];
    const float length = glm::length(ray);
    ASSERT_TRUE(sameVector(points->position.at(i), camera.eye + scale * ray)) << i;
    ASSERT_TRUE(sameVector(points->direction.at(i), ray / length)) << i;
    ASSERT_EQ(points->distance[i], scale * length) << i;
  }
}

TEST(NextPoint, GoesOnWhereTheRayArrives) {
  ReflectionPoint point;
  point.distance = 3.0f;
  frame::SurfacePoint surface;
  surface.position = Vec3(1, 2, 3);
  surface.normal = Vec3(0, 1, 0);
  surface.lobe = {0.3f};
  surface.lobeHorizon = Vec3(1, 0, 0);
  surface.bent = true;
  const Vec3 direction(0, 0, -1);
  const ReflectionPoint next = trace::nextPoint(point, 0, direction, 2.0f, surface, 0.7f);
  EXPECT_EQ(next.position, surface.position);
  EXPECT_EQ(next.normal, surface.normal);
  EXPECT_EQ(next.direction, direction);
  EXPECT_EQ(next.lobe.code, surface.lobe.code);
  EXPECT_EQ(next.distance, 5.0f);  // the cone goes on
  EXPECT_EQ(next.refraction, 0.0f);
  EXPECT_EQ(next.extent, 0.7f);
  EXPECT_TRUE(next.bent);
  EXPECT_EQ(next.lobeHorizon, surface.lobeHorizon);
}

INSTANTIATE_TEST_SUITE_P(Vector, Levels,
                         testing::Values(VectorLevel::Base, VectorLevel::V2, VectorLevel::V3,
                                         VectorLevel::V4),
                         [](const testing::TestParamInfo<VectorLevel>& level) {
                           return "Level" + std::to_string(static_cast<int>(level.param) + 1);
                         });

}  // namespace
}  // namespace catoptric
