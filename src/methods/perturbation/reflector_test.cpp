// Where vertices appear in the paper's vase, in pixels, against exact paths.
#include "methods/perturbation/reflector.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <limits>
#include <mutex>
#include <numeric>
#include <tuple>
#include <vector>

#include "methods/perturbation/test_ball.h"
#include "methods/perturbation/virtual_objects.h"
#include "scene/animate.h"
#include "scene/loader.h"
#include "scene/shapes/shapes.h"

namespace catoptric::methods::perturbation {
namespace {

/// The lizard's vertices at eight times of its way, before the vase of Fig. 8.
struct Lizard {
  scene::Scene scene =
      scene::loadScene(std::filesystem::path(CATOPTRIC_SOURCE_DIR) / "scenes/vase_lizard.json");
  implicit::Surface vase = implicit::vaseSurface();
  View view;
  Box3 bounds;
  Box3 around;
  std::vector<glm::dvec3> vertices;

  Lizard() {
    const auto path = scene::loadPath(
        std::filesystem::path(CATOPTRIC_SOURCE_DIR) / "paths/vase_lizard.json", scene);
    view = {path->frame(1).camera, 640, 480};
    bounds.extend(Vec3(-1.0f, 0.0f, -1.0f));
    bounds.extend(Vec3(1.0f, 2.0f, 1.0f));
    around.extend(Vec3(-6.0f, 0.0f, -6.0f));
    around.extend(Vec3(6.0f, 4.0f, 6.0f));
    const auto object = std::find_if(scene.objects.begin(), scene.objects.end(),
                                     [](const auto& o) { return o.name == "lizard"; });
    for (int frame = 1; frame <= path->count(); frame += 3) {
      const scene::Pose pose = scene::poseAt(scene, path->frame(frame).timeSeconds);
      for (const Vec3& v : scene::worldVertices(scene, *object, pose).positions)
        vertices.emplace_back(v);
    }
  }

  /// Distances in pixels of the reflections of an order from the nearest exact one.
  std::vector<double> errors(Order order) const {
    PathOptions exact;
    exact.errorPixels = 1e-6f;
    PathOptions options;
    options.order = order;
    const std::array<Turn, 1> turns{{{&vase, bounds}}};
    const Reflector truth(turns, nullptr, around, view, exact);
    const Reflector ours(turns, nullptr, around, view, options);
    RayOctree::Cursor cursors[2];
    PathCounts counts;
    std::vector<double> result;
    for (const glm::dvec3& vertex : vertices) {
      const Reflections true_ = truth.reflectionsOf(vertex, false, cursors[0], counts);
      const Reflections found = ours.reflectionsOf(vertex, false, cursors[1], counts);
      for (std::uint32_t i = 0; i < found.count; ++i) {
        double nearest = std::numeric_limits<double>::infinity();
        for (std::uint32_t k = 0; k < true_.count; ++k)
          nearest = std::min(nearest, glm::distance(pixel(found.at[i].x), pixel(true_.at[k].x)));
        result.push_back(nearest);
      }
    }
    std::sort(result.begin(), result.end());
    return result;
  }

  glm::dvec2 pixel(const glm::dvec3& x) const {
    const Vec4 clip = scene::clipFromCamera(view.camera, 4.0f / 3.0f) *
                      scene::cameraFromWorld(view.camera) * Vec4(Vec3(x), 1.0f);
    return {320.0 * static_cast<double>(clip.x / clip.w),
            240.0 * static_cast<double>(clip.y / clip.w)};
  }
};

TEST(Reflector, VerticesInTheVaseAreATenthOfAPixelOff) {
  const Lizard lizard;
  for (const auto& [order, name, median, mean] : {std::tuple{Order::Nearest, "nearest", 10.0, 10.0},
                                                  {Order::Linear, "linear", 1.0, 2.0},
                                                  {Order::Quadratic, "quadratic", 0.1, 0.5},
                                                  {Order::Auto, "auto", 0.05, 0.1}}) {
    const std::vector<double> errors = lizard.errors(order);
    ASSERT_GT(errors.size(), 800u);
    const double sum = std::accumulate(errors.begin(), errors.end(), 0.0);
    const double count = static_cast<double>(errors.size());
    std::printf(
        "%-9s: %zu reflections; pixels off: median %.4f, mean %.4f, 95%% below %.3f, most %.2f\n",
        name, errors.size(), errors[errors.size() / 2], sum / count,
        errors[errors.size() * 95 / 100], errors.back());
    EXPECT_LE(errors[errors.size() / 2], median) << name;
    EXPECT_LE(sum / count, mean) << name;
  }
}

Box3 boxOf(const Vec3& min, const Vec3& max) {
  Box3 box;
  box.extend(min);
  box.extend(max);
  return box;
}

TEST(Reflector, SeesABowlInItselfTwice) {
  implicit::Surface bowl = implicit::sphereSurface(1.0);
  bowl.domain.max.y = -0.2;
  const Turn turn{&bowl, boxOf(Vec3(-1.0f), Vec3(1.0f, -0.2f, 1.0f))};
  const std::array<Turn, 2> turns{turn, turn};
  const Vec3 eye(0.9f, 2.5f, 0.3f);
  const View view{scene::lookAt(eye, Vec3(0.0f, -0.6f, 0.0f), {0.0f, 0.0f, 1.0f}, radians(45.0f)),
                  256, 256};
  const Box3 around = boxOf(Vec3(-3.0f), Vec3(3.0f));
  const Reflector once({turns.data(), 1}, nullptr, around, view, {});
  const Reflector twice(turns, &once, around, view, {});
  ASSERT_GT(twice.pathCount(), 0u);
  RayOctree::Cursor cursor;
  PathCounts counts;
  std::uint32_t found = 0;
  for (int i = 0; i < 200; ++i) {
    const double angle = 2.399963 * i;
    const glm::dvec3 point(0.008 * i * std::cos(angle), 0.8, 0.008 * i * std::sin(angle));
    const Reflections seen = twice.reflectionsOf(point, false, cursor, counts);
    for (std::uint32_t k = 0; k < seen.count; ++k) {
      ++found;
      // The law of reflection, twice; the sphere's normals point to its centre
      const glm::dvec3& x = seen.at[k].x;
      const glm::dvec3& y = seen.at[k].last;
      const glm::dvec3 between = glm::normalize(y - x);
      const glm::dvec3 first = glm::reflect(glm::normalize(x - glm::dvec3(eye)), glm::normalize(x));
      const glm::dvec3 second = glm::reflect(between, glm::normalize(y));
      EXPECT_LT(glm::distance(first, between), 0.01) << i;
      EXPECT_LT(glm::distance(second, glm::normalize(point - y)), 0.05) << i;
    }
  }
  EXPECT_GT(found, 200u);
}

TEST(Reflector, FindsASmallReflectorInAnotherOne) {
  const implicit::Surface large = implicit::sphereSurface(1.0);
  for (const double radius : {0.1, 0.02, 0.002}) {
    const glm::dvec3 centre(1.3, 1.1, 1.2);
    const implicit::Surface small =
        implicit::placed(implicit::sphereSurface(radius), glm::dmat3(1.0), centre);
    std::vector<Vec3> points;
    Box3 bounds;
    for (int i = 0; i < 100; ++i) {
      // Evenly over the sphere
      const double z = 1.0 - 0.02 * i;
      const double r = std::sqrt(std::max(0.0, 1.0 - z * z));
      points.emplace_back(centre +
                          radius * glm::dvec3(r * std::cos(2.4 * i), r * std::sin(2.4 * i), z));
      bounds.extend(points.back());
    }
    const std::array<Turn, 2> turns{
        {{&large, boxOf(Vec3(-1.0f), Vec3(1.0f))}, {.surface = &small, .bounds = bounds}}};
    std::array<Turn, 2> withPoints = turns;
    withPoints[1].points = points;
    const View view{scene::lookAt({0.0f, 0.5f, 5.0f}, Vec3(0.0f), {0.0f, 1.0f, 0.0f}, 0.6f), 256,
                    256};
    const Box3 around = boxOf(Vec3(-3.0f), Vec3(3.0f));
    const Reflector once({turns.data(), 1}, nullptr, around, view, {});
    const Reflector without(turns, &once, around, view, {});
    const Reflector with(withPoints, &once, around, view, {});
    EXPECT_GE(with.pathCount(), radius > 0.01 ? 20u : 1u) << radius;
    EXPECT_FALSE(with.missed());
    if (radius < 0.05) {
      EXPECT_EQ(without.pathCount(), 0u) << radius;
    }
  }
}

TEST(Reflector, CountsTotalReflectionsOfTheSampledPathsAlone) {
  // From a corner of a block of glass its sides reflect much of what has entered
  const implicit::Surface block = implicit::superquadricSurface(glm::dvec3(0.5), 0.1, 0.1);
  Turn in{&block, boxOf(Vec3(-0.5f), Vec3(0.5f))};
  in.through = true;
  in.indexAfter = 1.5;
  Turn out = in;
  out.inside = true;
  out.indexBefore = 1.5;
  out.indexAfter = 1.0;
  const std::array<Turn, 2> turns{in, out};
  const View view{scene::lookAt({1.5f, 1.0f, 2.0f}, Vec3(0.0f), {0.0f, 1.0f, 0.0f}, radians(30.0f)),
                  256, 256};
  const Box3 around = boxOf(Vec3(-3.0f), Vec3(3.0f));
  PathOptions options;
  options.sampleSpacing = 32;
  options.fewestPaths = 1;
  const Reflector once({turns.data(), 1}, nullptr, around, view, options);
  const Reflector twice(turns, &once, around, view, options);
  // Every 8th pixel, a quarter of the spacing, is sampled; those that show the block:
  std::uint64_t shown = 0;
  for (int y = 4; y < 256; y += 8) {
    for (int x = 4; x < 256; x += 8) {
      const glm::dvec3 ray(
          scene::rayDirection(view.camera, 256, 256, static_cast<float>(x), static_cast<float>(y)));
      if (implicit::firstHit(block, {glm::dvec3(view.camera.eye()), ray}).status ==
          implicit::HitStatus::Hit)
        ++shown;
    }
  }
  EXPECT_GT(twice.totalReflections(), shown / 10);
  EXPECT_LT(twice.totalReflections(), shown);
}

TEST(Reflector, IsFiniteWhereverThePointIs) {
  const implicit::Surface sphere = implicit::sphereSurface(1.0);
  const std::array<Turn, 1> turns{{{&sphere, boxOf(Vec3(-1.0f), Vec3(1.0f))}}};
  const Box3 around = boxOf(Vec3(-3.0f), Vec3(3.0f));
  for (const Vec3& eye : {Vec3(0.0f, 0.0f, 3.0f), Vec3(0.0f, 0.0f, 1.0f), Vec3(0.1f, 0.2f, 0.3f)}) {
    const View view{scene::lookAt(eye, Vec3(0.0f), {0.0f, 1.0f, 0.0f}, 0.8f), 64, 64};
    for (const Order order : {Order::Nearest, Order::Linear, Order::Quadratic, Order::Auto}) {
      PathOptions options;
      options.order = order;
      const Reflector reflector(turns, nullptr, around, view, options);
      RayOctree::Cursor cursor;
      PathCounts counts;
      // The eye, on and in the surface, on the axis, on sampled rays' places, far off
      std::vector<glm::dvec3> points{glm::dvec3(eye),        glm::dvec3(0.0), {0.0, 0.0, 1.0},
                                     {0.0, 0.0, 1.0 + 1e-9}, {0.0, 0.0, 2.0}, {1e9, 2e9, 3e9},
                                     {1e17, 1e17, 1e17},     {0.0, 1.0, 0.0}};
      for (int i = 0; i < 50; ++i)
        points.push_back((0.5 + 0.02 * i) *
                         glm::normalize(glm::dvec3(std::sin(i), std::cos(i), 1)));
      for (const glm::dvec3& point : points) {
        const Reflections found = reflector.reflectionsOf(point, false, cursor, counts);
        for (std::uint32_t i = 0; i < found.count; ++i) {
          const Reflection& r = found.at[i];
          EXPECT_TRUE(isFinite(Vec3(r.x)) && isFinite(Vec3(r.image)) && std::isfinite(r.share))
              << point.x << " " << point.y << " " << point.z;
        }
        const auto hidden = reflector.hidden(point, cursor, counts);
        EXPECT_TRUE(!hidden || std::isfinite(hidden->share));
      }
    }
  }
}

TEST(Reflector, CountsReflectionsBeyondTheMostThatAPointHas) {
  // Each of some hundred crests and hollows shows the point above them
  const implicit::Surface waves = implicit::formulaSurface(
      "y - 0.01*sin(40*x)*sin(40*z)", {}, {{-0.5, -0.1, -0.5}, {0.5, 0.1, 0.5}}, "waves");
  const std::array<Turn, 1> turns{{{&waves, boxOf({-0.5f, -0.1f, -0.5f}, {0.5f, 0.1f, 0.5f})}}};
  const View view{scene::lookAt({0.1f, 2.0f, 0.2f}, Vec3(0.0f), {0.0f, 0.0f, -1.0f}, 0.6f), 480,
                  480};
  PathOptions options;
  options.sampleSpacing = 2;
  const Reflector reflector(turns, nullptr, boxOf(Vec3(-3.0f), Vec3(3.0f)), view, options);
  RayOctree::Cursor cursor;
  PathCounts counts;
  const Reflections found = reflector.reflectionsOf({0.0, 2.5, 0.1}, false, cursor, counts);
  EXPECT_EQ(found.count, kMaxReflections);
  EXPECT_GT(counts.leftOut, 20u);
  // One that is near shows in the crests below it alone
  PathCounts few;
  EXPECT_LT(reflector.reflectionsOf({0.0, 0.03, 0.1}, false, cursor, few).count, kMaxReflections);
  EXPECT_EQ(few.leftOut, 0u);
}

/// Edges of a ball before the vase are halved until so many paths were traced, and then put out as
/// they are.
TEST(VirtualTriangles, BoundTracedPaths) {
  const BallBeforeVase stage(12);
  const Reflector reflector({&stage.turn, 1}, nullptr, stage.around, stage.view, {});
  Connectivity known;
  VirtualTriangles made;
  const auto make = [&](std::size_t maxTraced) {
    TriangleCounts counts;
    TriangleOptions options;
    options.maxTraced = maxTraced;
    std::uint64_t heard = 0;
    std::mutex mutex;
    options.lookedUp = [&](std::size_t places) {
      const std::scoped_lock lock(mutex);
      heard += places;
    };
    virtualTriangles(stage.geometry, 0, reflector, false, stage.view, Order::Auto, options, known,
                     counts, made);
    EXPECT_LE(heard, counts.vertices);
    EXPECT_EQ(made.positions.size(), made.images.size());
    for (const std::uint32_t i : made.indices) EXPECT_LT(i, made.positions.size());
    return counts;
  };
  const TriangleCounts all = make(kFewestTraced);
  const std::vector<std::uint32_t> indices = made.indices;
  EXPECT_EQ(all.coarse, 0u);
  EXPECT_GT(all.paths.retraced, 200u);
  const TriangleCounts few = make(all.paths.retraced / 4);
  EXPECT_EQ(few.coarse, 1u);
  EXPECT_LT(few.paths.retraced, all.paths.retraced);
  EXPECT_GT(few.triangles, 100u);
  EXPECT_LT(few.triangles, all.triangles);
  // The memory of an update does not show in the next
  EXPECT_EQ(make(kFewestTraced).paths.retraced, all.paths.retraced);
  EXPECT_EQ(made.indices, indices);
}

}  // namespace
}  // namespace catoptric::methods::perturbation
