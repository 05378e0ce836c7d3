// Rays and implicit surfaces in scenes: against closed forms and implicit::firstHit itself.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "frame/test_scenes.h"
#include "scene/animate.h"
#include "scene/implicit/gradient.h"
#include "trace/embree/trace_scene.h"
#include "trace/lobes/reflect.h"
#include "trace/test_rays.h"

namespace catoptric {
namespace {

using test::rotation;
using test::SceneBuilder;
using test::translation;
using trace::BvhPolicy;
using trace::Hit;
using trace::Ray;
using trace::TraceScene;

/// The surface as a coarse mesh: whoever meets the triangles is far off.
scene::Mesh coarse(const implicit::Surface& surface) {
  return scene::makeImplicit(surface, 12, scene::UvMode::Unit);
}

frame::Geometry geometryOf(SceneBuilder& builder, double time = 0.0) {
  return frame::makeGeometry(builder.scene(), scene::poseAt(builder.scene(), time));
}

TEST(Implicit, RaysMeetTheSphereItselfUnderAllPolicies) {
  for (const BvhPolicy policy :
       {BvhPolicy::Static, BvhPolicy::Refit, BvhPolicy::RebuildLow, BvhPolicy::RebuildMedium}) {
    SceneBuilder builder;
    builder.add(scene::makeSphere(0.4f, 32, 16, scene::UvMode::Unit), builder.diffuse(Vec3(1.0f)),
                translation({0.0f, -5.0f, 0.0f}));
    const int ball = builder.add(coarse(implicit::sphereSurface(0.5)), builder.reflective(1.0f),
                                 translation({1.0f, 0.5f, 0.0f}));
    builder.move(ball, {0.5f, 0.0f, 0.0f}, 2.0f);
    frame::Geometry geometry = geometryOf(builder);
    TraceScene trace(builder.scene(), geometry, policy);
    for (const double time : {0.0, 1.0, 2.0}) {
      const Vec3 centre(1.0f + 0.5f * static_cast<float>(time), 0.5f, 0.0f);
      trace.update(
          frame::updateGeometry(geometry, builder.scene(), scene::poseAt(builder.scene(), time)));
      std::mt19937 random(11);
      std::vector<Ray> rays;
      for (int i = 0; i < 4000; ++i) {
        const float distance = i % 2 == 0 ? 3.0f : 0.3f;  // from outside, and from inside
        rays.push_back({centre + distance * randomDirection(random), randomDirection(random)});
        if (i % 4 == 0) {
          rays.back().direction =
              glm::normalize(centre + 0.6f * randomDirection(random) - rays.back().origin);
        }
      }
      std::vector<Hit> hits(rays.size());
      std::vector<std::uint8_t> free(rays.size());
      trace.intersect(rays, hits, false);
      trace.visible(rays, free);
      int checked = 0;
      for (std::size_t i = 0; i < rays.size(); ++i) {
        const glm::dvec3 o = glm::dvec3(rays[i].origin) - glm::dvec3(centre);
        const glm::dvec3 d(rays[i].direction);
        const double b = glm::dot(o, d);
        const double root = b * b - glm::dot(d, d) * (glm::dot(o, o) - 0.25);
        if (std::abs(root) < 1e-4 || hits[i].object == 0) continue;
        const double t = root < 0.0   ? -1.0
                         : i % 2 == 0 ? -b - std::sqrt(root)
                                      : -b + std::sqrt(root);
        ASSERT_EQ(hits[i].miss(), t < 0.0) << i;
        ASSERT_EQ(free[i] != 0, t < 0.0) << i;
        if (t < 0.0) continue;
        ++checked;
        EXPECT_NEAR(hits[i].distance, t, 4e-5 * std::max(1e-2, 1e-2 / std::sqrt(root)));
      }
      EXPECT_GT(checked, 1500);
    }
    EXPECT_EQ(trace.unresolvedRays(), 0u);
  }
}

TEST(Implicit, AScaleOfZeroHidesAndLaterFramesShow) {
  const std::vector<double> times{0.0, 1.0, 2.0, 3.0, 4.0};
  for (const BvhPolicy policy :
       {BvhPolicy::Static, BvhPolicy::Refit, BvhPolicy::RebuildLow, BvhPolicy::RebuildMedium}) {
    SceneBuilder builder;
    const int torus = builder.add(coarse(implicit::torusSurface(0.5, 0.2)),
                                  builder.reflective(1.0f), translation({1.0f, 0.5f, 0.0f}));
    builder.scaleUniformly(torus, {{0.0f, 0.0f}, {2.0f, 1.0f}, {3.0f, 0.0f}, {4.0f, -1.0f}});
    frame::Geometry geometry = geometryOf(builder);
    TraceScene trace(builder.scene(), geometry, policy);
    std::mt19937 random(7);
    std::vector<Ray> rays;
    for (int i = 0; i < 4000; ++i) {
      const Vec3 from = Vec3(1.0f, 0.5f, 0.0f) + 2.0f * randomDirection(random);
      const Vec3 to = Vec3(1.0f, 0.5f, 0.0f) + 0.7f * randomDirection(random);
      rays.push_back({from, glm::normalize(to - from)});
    }
    for (const double time : times) {
      const scene::Pose pose = scene::poseAt(builder.scene(), time);
      trace.update(frame::updateGeometry(geometry, builder.scene(), pose));
      const frame::Geometry again = frame::makeGeometry(builder.scene(), pose);
      const TraceScene fresh(builder.scene(), again, BvhPolicy::RebuildMedium);
      std::vector<Hit> hits(rays.size());
      std::vector<Hit> expected(rays.size());
      trace.intersect(rays, hits, false);
      fresh.intersect(rays, expected, false);
      int met = 0;
      for (std::size_t i = 0; i < rays.size(); ++i) {
        ASSERT_EQ(hits[i].miss(), expected[i].miss()) << time;
        if (hits[i].miss()) continue;
        ++met;
        ASSERT_EQ(hits[i].distance, expected[i].distance) << time;
      }
      const bool hidden = time == 0.0 || time == 3.0;
      EXPECT_EQ(met == 0, hidden) << time;
    }
  }
}

TEST(Implicit, PiecesHoldTheWholeSurface) {
  // Turned, stretched, mirrored: what the structure finds is what one look along the ray finds.
  const std::vector<implicit::Surface> surfaces{
      implicit::torusSurface(0.5, 0.2),
      implicit::vaseSurface(),
      implicit::metaballsSurface({{-0.3, 0, 0, 0.3}, {0.3, 0.1, 0, 0.3}}, 2.0),
      implicit::superquadricSurface({0.5, 0.4, 0.5}, 0.4, 1.5),
      scene::heartSurface(),
      scene::gyroidSurface(1.0, 0.2, 0.8),
  };
  for (std::size_t s = 0; s < surfaces.size(); ++s) {
    SCOPED_TRACE(s);
    SceneBuilder builder;
    const Mat4 place = translation({0.3f, -0.2f, 0.5f}) * rotation(35.0f, {1.0f, 2.0f, 0.5f}) *
                       glm::scale(Mat4(1.0f), Vec3(1.5f, -1.0f, 0.7f));
    builder.add(coarse(surfaces[s]), builder.reflective(1.0f), place);
    const frame::Geometry geometry = geometryOf(builder);
    ASSERT_EQ(geometry.surfaces.size(), 1u);
    const implicit::Surface& placed = geometry.surfaces[0].surface;
    const TraceScene trace(builder.scene(), geometry, BvhPolicy::Static);
    const Vec3 centre = geometry.bounds.centre();
    const float size = geometry.bounds.diameter();
    std::mt19937 random(5);
    std::vector<Ray> rays;
    for (int i = 0; i < 3000; ++i) {
      const Vec3 origin = centre + (i % 3 == 0 ? 0.1f : 1.0f) * size * randomDirection(random);
      const Vec3 target = centre + 0.4f * size * randomDirection(random);
      rays.push_back({origin, glm::normalize(target - origin)});
    }
    std::vector<Hit> hits(rays.size());
    trace.intersect(rays, hits, false);
    int found = 0;
    int grazing = 0;
    for (std::size_t i = 0; i < rays.size(); ++i) {
      const glm::dvec3 o(rays[i].origin);
      const glm::dvec3 d(rays[i].direction);
      const implicit::SurfaceHit whole = implicit::firstHit(placed, {o, d});
      const bool hit = whole.status == implicit::HitStatus::Hit;
      if (hits[i].miss() == hit || (hit && std::abs(hits[i].distance - whole.t) > 1e-5 * size)) {
        ++grazing;  // the two looks divide the ray at other places: a touch can go either way
        continue;
      }
      found += hit ? 1 : 0;
    }
    EXPECT_GT(found, 600);
    EXPECT_LE(grazing, 1);
    EXPECT_EQ(trace.unresolvedRays(), 0u);
  }
}

TEST(Implicit, ShadingTakesTheGradientAndTheNearestTrianglesAttributes) {
  SceneBuilder builder;
  scene::Mesh mesh = coarse(implicit::sphereSurface(0.5));
  for (const Vec3& p : mesh.positions) mesh.colors.push_back(p + Vec3(0.5f));
  builder.add(mesh, builder.diffuse(Vec3(1.0f)));
  builder.scene().materials[0].unlit = true;
  const frame::Geometry geometry = geometryOf(builder);
  const TraceScene trace(builder.scene(), geometry, BvhPolicy::Static);
  const frame::Lighting lighting =
      frame::makeLighting(builder.scene(), scene::poseAt(builder.scene(), 0.0),
                          std::make_shared<frame::EnvironmentLight>(builder.scene().environment));
  std::mt19937 random(3);
  std::vector<Ray> rays;
  for (int i = 0; i < 500; ++i) {
    const Vec3 from = 2.0f * randomDirection(random);
    rays.push_back({from, -0.5f * from});
  }
  std::vector<Hit> hits(rays.size());
  trace.intersect(rays, hits, false);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    ASSERT_FALSE(hits[i].miss());
    const Vec3 position = rays[i].origin + hits[i].distance * rays[i].direction;
    const frame::SurfacePoint point =
        frame::shadeSurface(builder.scene(), geometry, lighting, hits[i].object, hits[i].primitive,
                            hits[i].u, hits[i].v, position, rays[i].direction, 0.0f);
    EXPECT_LT(glm::length(point.normal - 2.0f * position), 1e-5f);
    // Colours are the positions: linear over triangles, so off by the chords' sag at most.
    EXPECT_LT(glm::length(point.diffuse - (position + Vec3(0.5f))), 0.01f);
  }
}

TEST(Implicit, CutOutObjectsStayTriangles) {
  SceneBuilder builder;
  builder.add(coarse(implicit::sphereSurface(0.5)), builder.diffuse(Vec3(1.0f)));
  builder.scene().materials[0].alphaMode = scene::AlphaMode::Mask;
  EXPECT_TRUE(geometryOf(builder).surfaces.empty());
}

TEST(Implicit, RaysThatLeaveASurfaceDoNotMeetItAtTheirStart) {
  for (const float scale : {1e-3f, 1.0f, 1e3f}) {
    SceneBuilder builder;
    const Mat4 place = translation(scale * Vec3(3.0f, 1.0f, -2.0f)) *
                       rotation(20.0f, {0.3f, 1.0f, 0.0f}) * glm::scale(Mat4(1.0f), Vec3(scale));
    builder.add(coarse(implicit::sphereSurface(0.5)), builder.reflective(1.0f), place);
    builder.add(coarse(implicit::ellipsoidSurface({0.5, 0.2, 0.3})), builder.reflective(1.0f),
                translation(scale * Vec3(0.0f, 4.0f, 0.0f)) * place);
    // A convex surface that no closed form serves.
    builder.add(coarse(implicit::superquadricSurface({0.5, 0.5, 0.5}, 0.8, 0.8)),
                builder.reflective(1.0f), translation(scale * Vec3(0.0f, -4.0f, 0.0f)) * place);
    const frame::Geometry geometry = geometryOf(builder);
    const TraceScene trace(builder.scene(), geometry, BvhPolicy::Static);
    std::mt19937 random(9);
    std::vector<Ray> rays;
    for (int i = 0; i < 30'000; ++i) {
      const frame::ObjectRange& range = geometry.objects[static_cast<std::size_t>(i) % 3];
      const Vec3 centre = range.bounds.centre();
      const Vec3 from = centre + 2.0f * scale * randomDirection(random);
      const Vec3 to = centre + 0.45f * range.bounds.diameter() * 0.5f * randomDirection(random);
      rays.push_back({from, glm::normalize(to - from)});
    }
    std::vector<Hit> hits(rays.size());
    trace.intersect(rays, hits, false);
    std::vector<Ray> leaving;
    for (std::size_t i = 0; i < rays.size(); ++i) {
      if (hits[i].miss()) continue;
      const Vec3 position = rays[i].origin + hits[i].distance * rays[i].direction;
      const implicit::Surface& surface =
          geometry.surfaces[geometry.objects[hits[i].object].surface].surface;
      const auto gradient = implicit::normalAt(surface, glm::dvec3(position));
      ASSERT_TRUE(gradient);
      const Vec3 normal(*gradient);
      trace::ReflectionPoint point;
      point.position = position;
      point.distance = hits[i].distance;
      point.extent = trace.extentOf(hits[i].object);
      const float offset = trace::surfaceOffset(point);
      leaving.push_back({position + offset * normal, glm::reflect(rays[i].direction, normal)});
    }
    ASSERT_GT(leaving.size(), 5'000u);
    std::vector<Hit> again(leaving.size());
    trace.intersect(leaving, again, false);
    std::size_t self = 0;
    for (const Hit& hit : again) self += !hit.miss() && hit.distance < 0.5f * scale ? 1 : 0;
    EXPECT_EQ(self, 0u) << "of " << leaving.size() << " at scale " << scale;
  }
}

TEST(Implicit, SamplesOfTrianglesReflectFromTheSurfaceItself) {
  // A coarse ball in a gradient: radiance is linear in the reflected direction's height.
  SceneBuilder builder;
  builder.add(coarse(implicit::sphereSurface(1.0)), builder.reflective(1.0f));
  scene::Environment& sky = builder.scene().environment;
  sky.type = scene::EnvironmentType::Gradient;
  sky.color = Vec3(1.0f);
  sky.horizon = Vec3(0.5f);
  sky.ground = Vec3(0.0f);
  const frame::Geometry geometry = geometryOf(builder);
  const TraceScene trace(builder.scene(), geometry, BvhPolicy::Static);
  const frame::Lighting lighting =
      frame::makeLighting(builder.scene(), scene::poseAt(builder.scene(), 0.0),
                          std::make_shared<frame::EnvironmentLight>(sky));

  // Samples as a G-buffer gives them: rays at the triangles, their interpolated normals.
  scene::Mesh plain = coarse(implicit::sphereSurface(1.0));
  plain.surface = nullptr;
  SceneBuilder triangles;
  triangles.add(plain, triangles.reflective(1.0f));
  const frame::Geometry flat = geometryOf(triangles);
  const TraceScene seen(triangles.scene(), flat, BvhPolicy::Static);
  const Vec3 eye(0.5f, 1.0f, 4.0f);
  std::mt19937 random(2);
  std::vector<Ray> rays;
  for (int i = 0; i < 20'000; ++i)
    rays.push_back({eye, glm::normalize(1.2f * randomDirection(random) - eye)});
  std::vector<Hit> hits(rays.size());
  seen.intersect(rays, hits, false);
  std::vector<trace::ReflectionPoint> points;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    if (hits[i].miss()) continue;
    const Vec3 position = eye + hits[i].distance * rays[i].direction;
    const frame::SurfacePoint surface =
        frame::shadeSurface(triangles.scene(), flat, lighting, 0, hits[i].primitive, hits[i].u,
                            hits[i].v, position, rays[i].direction, 0.0f);
    trace::ReflectionPoint point{position, surface.normal, rays[i].direction, 0.0f,
                                 hits[i].distance};
    point.object = 1;
    points.push_back(point);
  }
  ASSERT_GT(points.size(), 4'000u);
  std::vector<Vec3> radiance(points.size());
  const trace::ReflectionCounts counts =
      trace::reflectedRadiance(trace, lighting, 0.0f, points, {}, true, radiance);
  EXPECT_EQ(counts.offSurface, 0u);
  EXPECT_EQ(counts.atOutline, 0u);  // the chords of a ball lie inside it
  EXPECT_EQ(counts.misses, counts.rays);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const glm::dvec3 o(eye);
    const glm::dvec3 d(points[i].direction);
    const double b = glm::dot(o, d);
    const double t = -b - std::sqrt(b * b - glm::dot(o, o) + 1.0);
    const glm::dvec3 n = o + t * d;
    const double height = glm::reflect(d, n).y;
    ASSERT_NEAR(radiance[i].x, 0.5 + 0.5 * height, 2e-5) << i;
  }

  // Beside the outline the nearest place of the ball, its normal across the ray.
  trace::ReflectionPoint beside{
      {1.01f, 0.0f, 0.0f}, {1.0f, 0.0f, 0.0f}, {0.0f, 0.0f, -1.0f}, 0.0f, 4.0f};
  beside.object = 1;
  EXPECT_EQ(trace::moveOntoSurface(trace, beside), trace::Moved::ToOutline);
  EXPECT_LT(glm::length(beside.position - Vec3(1.0f, 0.0f, 0.0f)), 1e-6f);
  EXPECT_LT(glm::length(beside.normal - Vec3(1.0f, 0.0f, 0.0f)), 1e-6f);
  trace::ReflectionPoint away{
      {9.0f, 0.0f, 0.0f}, {1.0f, 0.0f, 0.0f}, {0.0f, 0.0f, -1.0f}, 0.0f, 4.0f};
  away.object = 1;
  EXPECT_EQ(trace::moveOntoSurface(trace, away), trace::Moved::Nowhere);
  EXPECT_EQ(away.position, Vec3(9.0f, 0.0f, 0.0f));
}

TEST(Implicit, ABallOfGlassRefractsByItsClosedForm) {
  SceneBuilder builder;
  const int glass = builder.reflective(1.0f);
  constexpr double kIndex = 1.5;
  builder.scene().materials[glass].refraction = static_cast<float>(kIndex);
  builder.add(coarse(implicit::sphereSurface(1.0)), glass);
  scene::Environment& sky = builder.scene().environment;
  sky.type = scene::EnvironmentType::Gradient;  // linear in the direction's height
  sky.color = Vec3(1.0f);
  sky.horizon = Vec3(0.5f);
  sky.ground = Vec3(0.0f);
  const frame::Geometry geometry = geometryOf(builder);
  const TraceScene trace(builder.scene(), geometry, BvhPolicy::Static);
  const frame::Lighting lighting =
      frame::makeLighting(builder.scene(), scene::poseAt(builder.scene(), 0.0),
                          std::make_shared<frame::EnvironmentLight>(sky));
  std::mt19937 random(4);
  std::vector<trace::ReflectionPoint> points;
  std::vector<glm::dvec3> expected;
  const auto add = [&](const glm::dvec3& n, const glm::dvec3& d) {
    trace::ReflectionPoint point{Vec3(n), Vec3(n), Vec3(d), 0.0f, 2.0f};
    point.object = 1;
    points.push_back(point);
    // Turned by twice the difference of the angles of incidence and of refraction, to the centre
    const double cosine = -glm::dot(n, d);
    const double incidence = std::acos(cosine);
    const double turn = 2.0 * (incidence - std::asin(std::sin(incidence) / kIndex));
    const glm::dvec3 inwards = glm::normalize(-n - cosine * d);
    expected.push_back(std::cos(turn) * d + std::sin(turn) * inwards);
  };
  while (points.size() < 2'000u) {
    const glm::dvec3 n(randomDirection(random));
    const glm::dvec3 d(randomDirection(random));
    if (glm::dot(n, d) < -0.1 && glm::dot(n, d) > -0.999) add(n, d);
  }
  // The lensmaker's focus of a ball: a ray at height h to the axis is turned by h / f
  constexpr double kHeight = 0.02;
  add({0.0, kHeight, std::sqrt(1.0 - kHeight * kHeight)}, {0.0, 0.0, -1.0});
  std::vector<Vec3> radiance(points.size());
  const trace::ReflectionCounts counts =
      trace::reflectedRadiance(trace, lighting, 0.0f, points, {.bounces = 2}, true, radiance);
  EXPECT_EQ(counts.totalReflections, 0u);
  EXPECT_EQ(counts.misses, points.size());
  for (std::size_t i = 0; i < points.size(); ++i)
    ASSERT_NEAR(radiance[i].x, 0.5 + 0.5 * expected[i].y, 1e-4) << i;
  const double focus = kIndex / (2.0 * (kIndex - 1.0));
  EXPECT_NEAR((0.5 - radiance.back().x) / 0.5, kHeight / focus, 0.01 * kHeight);
}

TEST(Implicit, LightLeavesGlassUpToTheCriticalAngle) {
  const double critical = std::asin(1.0 / 1.5);
  for (const double angle : {0.0, 0.3, critical - 1e-3, critical + 1e-3, 1.3}) {
    trace::ReflectionPoint point;
    point.refraction = 1.5f;
    point.direction =
        Vec3(static_cast<float>(std::sin(angle)), -static_cast<float>(std::cos(angle)), 0.0f);
    bool total = false;
    const Vec3 direction = trace::specularDirection(point, total);
    EXPECT_EQ(total, angle > critical) << angle;
    EXPECT_NEAR(direction.x, total ? std::sin(angle) : 1.5 * std::sin(angle), 1e-6) << angle;
    EXPECT_EQ(direction.y > 0.0f, total) << angle;
  }
}

}  // namespace
}  // namespace catoptric
