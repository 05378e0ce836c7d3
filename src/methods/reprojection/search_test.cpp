// The search against closed forms: reflections of a wall in a plane and in a sphere, both ways of
// light solved exactly.
#include "methods/reprojection/search.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <random>
#include <utility>
#include <vector>

#include "core/vector_level.h"
#include "frame/test_scenes.h"
#include "methods/reprojection/cell_lanes.h"
#include "methods/reprojection/reuse.h"
#include "methods/testing/cpu_harness.h"

namespace catoptric::methods::reprojection {
namespace {

constexpr int kSize = 128;

/// Where a ray meets a wall across z; it goes on for ever sideways.
std::optional<Vec3> wallHit(float wallZ, const Vec3& origin, const Vec3& direction) {
  const float t = (wallZ - origin.z) / direction.z;
  if (!(t > 0.0f)) return std::nullopt;
  return origin + t * direction;
}

Vec3 wallColour(const Vec3& p) {
  return Vec3(0.5f + 0.4f * std::sin(1.3f * p.x), 0.5f + 0.4f * std::cos(1.1f * p.y), 0.25f);
}

/// A reflector with its normal; none where the ray misses it.
struct Surface {
  Vec3 position{0.0f};
  Vec3 normal{0.0f, 1.0f, 0.0f};
};
struct Setting {
  std::function<std::optional<Surface>(const Vec3&, const Vec3&)> reflector;
  float wallZ = 0.0f;
  float barsZ = 0.0f;  ///< of upright bars before the wall, one a metre
  float barWidth = 0.0f;
};

std::optional<Surface> floorHit(const Vec3& origin, const Vec3& direction) {
  if (!(direction.y < 0.0f)) return std::nullopt;
  return Surface{origin - origin.y / direction.y * direction, Vec3(0.0f, 1.0f, 0.0f)};
}

const Setting kFloor{floorHit, -6.0f};

const Vec3 kCentre(0.0f, 1.0f, -3.0f);
constexpr float kRadius = 1.0f;
std::optional<Surface> sphereHit(const Vec3& origin, const Vec3& direction) {
  const Vec3 d = glm::normalize(direction);
  const Vec3 to = origin - kCentre;
  const float b = glm::dot(to, d);
  const float root = b * b - glm::dot(to, to) + kRadius * kRadius;
  if (!(root > 0.0f)) return std::nullopt;
  const Vec3 p = origin + (-b - std::sqrt(root)) * d;
  return Surface{p, (p - kCentre) / kRadius};
}

const Setting kSphere{sphereHit, 5.0f};

frame::Geometry stillGeometry() {
  frame::Geometry geometry;
  geometry.objects.resize(3);
  return geometry;
}

/// What camera sees in the reflector at sample (x, y).
struct Seen {
  Surface surface;
  Vec3 direction{0.0f};  ///< mirrored
  Vec3 place{0.0f};
  bool bar = false;
  Vec3 colour() const { return bar ? Vec3(2.0f) : wallColour(place); }
};
std::optional<Seen> see(const Setting& setting, const scene::Camera& camera, float x, float y) {
  const Vec3 ray = scene::rayDirection(camera, kSize, kSize, x + 0.5f, y + 0.5f);
  const auto surface = setting.reflector(camera.eye(), ray);
  if (!surface) return std::nullopt;
  const Vec3 mirrored = glm::reflect(ray, surface->normal);
  const auto hit = wallHit(setting.wallZ, surface->position, mirrored);
  if (!hit) return std::nullopt;
  const auto bar = wallHit(setting.barsZ, surface->position, mirrored);
  if (bar && std::abs(bar->x - std::round(bar->x)) < 0.5f * setting.barWidth)
    return Seen{*surface, mirrored, *bar, true};
  return Seen{*surface, mirrored, *hit};
}

/// `jitterMetres`: by how much the places that are kept lie beside those that are seen, at most.
void fill(KeyFrame& key, const Setting& setting, const scene::Camera& camera,
          float jitterMetres = 0.0f) {
  const frame::Geometry geometry = stillGeometry();
  std::mt19937 random(3);
  std::uniform_real_distribution<float> any(-jitterMetres, jitterMetres);
  key.begin(kSize, kSize, camera, {}, geometry);
  for (int y = 0; y < kSize; ++y)
    for (int x = 0; x < kSize; ++x) {
      auto seen = see(setting, camera, static_cast<float>(x), static_cast<float>(y));
      if (!seen) continue;
      if (jitterMetres > 0.0f) seen->place += Vec3(any(random), any(random), 0.0f);
      trace::ReflectionPoint point;
      point.object = 1;
      point.position = seen->surface.position;
      point.distance = glm::distance(camera.eye(), point.position);
      trace::FirstHit hit;
      hit.hit.object = seen->bar ? 2 : 1;
      hit.hit.distance = glm::distance(point.position, seen->place);
      hit.origin = point.position;
      hit.direction = glm::normalize(seen->place - point.position);
      key.keep(key.index(x, y), point, hit, seen->colour());
    }
  key.finish(geometry, Options{}.epsilon);
}
KeyFrame keyOf(const Setting& setting, const scene::Camera& camera) {
  KeyFrame key;
  fill(key, setting, camera);
  return key;
}

/// The point of the unit normal's surface about kCentre over which light goes from a to b: where
/// the way is shortest, by Newton's method on two angles. [Hero; Alhazen's problem]
Vec3 shortestOnSphere(const Vec3& a, const Vec3& b, const Vec3& begin) {
  Vec3 normal = glm::normalize(begin - kCentre);
  for (int i = 0; i < 60; ++i) {
    const Vec3 p = kCentre + kRadius * normal;
    const Vec3 half = glm::normalize(a - p) + glm::normalize(b - p);
    // At the solution the half vector is the normal: a damped fixed point converges to 1e-7.
    normal = glm::normalize(normal + 0.3f * glm::normalize(half));
  }
  return kCentre + kRadius * normal;
}

/// Compares every place that would be used with the exact one, and its colour (which the sphere
/// shows coarsely near its rim); returns how many were compared.
int compare(const Setting& setting, const scene::Camera& before, const scene::Camera& now,
            const std::function<Vec3(const Seen&)>& keySurface, float bound, float colourBound,
            const Options& options = {}) {
  const KeyFrame key = keyOf(setting, before);
  const frame::Geometry geometry = stillGeometry();
  int compared = 0;
  for (int y = 0; y < kSize; ++y)
    for (int x = 0; x < kSize; ++x) {
      const auto seen = see(setting, now, static_cast<float>(x), static_cast<float>(y));
      if (!seen) continue;
      const MirrorRay ray{seen->surface.position, glm::normalize(seen->direction), 1};
      const auto start = key.project(seen->surface.position, 0, geometry);
      if (!start) continue;
      const Match match = search(key, ray, *start, options);
      if (match.outcome != Outcome::Found) continue;
      const auto exact = key.project(keySurface(*seen), 0, geometry);
      if (!exact) {
        ADD_FAILURE() << "the exact place lies behind the camera";
        return compared;
      }
      // What lies at an edge, or misses the ray, is traced anew: it need not be exact.
      const Lookup lookup = lookUp(key, 1, match.place, options);
      if (lookup.outcome != Outcome::Found ||
          !(missBy(key, ray, match.place, lookup.place, options) <= options.fidelity))
        continue;
      EXPECT_LT(glm::distance(match.place, *exact), bound) << x << ", " << y;
      EXPECT_LT(glm::distance(lookup.radiance, wallColour(seen->place)), colourBound);
      ++compared;
    }
  return compared;
}

TEST(Search, FindsPlanarReflectionsAtTheirClosedForm) {
  const auto before = scene::lookAt({0.0f, 1.5f, 3.0f}, {0.0f, 0.0f, -1.0f}, {0, 1, 0}, 0.9f);
  const auto now = scene::lookAt({0.35f, 1.7f, 2.8f}, {0.1f, 0.0f, -1.0f}, {0, 1, 0}, 0.9f);
  // The floor's mirror image of a place is seen in the direction of its reflection.
  const auto mirrorImage = [](const Seen& seen) {
    return Vec3(seen.place.x, -seen.place.y, seen.place.z);
  };
  EXPECT_GT(compare(kFloor, before, now, mirrorImage, 0.05f, 0.03f), 8000);
  Options coarse;
  coarse.refine = false;
  EXPECT_GT(compare(kFloor, before, now, mirrorImage, 0.5f, 0.05f, coarse), 8000);
}

TEST(Search, FindsSphericalReflectionsOfAlhazensProblem) {
  const auto before = scene::lookAt({0.0f, 1.2f, 2.0f}, kCentre, {0, 1, 0}, 0.7f);
  const auto now = scene::lookAt({0.25f, 1.3f, 1.9f}, kCentre, {0, 1, 0}, 0.7f);
  const auto onSphere = [&](const Seen& seen) {
    return shortestOnSphere(before.eye(), seen.place, seen.surface.position);
  };
  EXPECT_GT(compare(kSphere, before, now, onSphere, 0.5f, 0.1f), 500);
}

/// Samples of both settings as lanes, somewhat beside the places that search() finds.
std::size_t lanesOf(const Setting& setting, const KeyFrame& key, const scene::Camera& now,
                    CellLanes& lanes, std::vector<Match>& matches) {
  const frame::Geometry geometry = stillGeometry();
  lanes.count = 0;
  for (int y = 0; y < kSize; y += 3)
    for (int x = 0; x < kSize && lanes.count < CellLanes::kMost; x += 5) {
      const auto seen = see(setting, now, static_cast<float>(x), static_cast<float>(y));
      const auto start = seen ? key.project(seen->surface.position, 0, geometry) : std::nullopt;
      if (!start) continue;
      const MirrorRay ray{seen->surface.position, glm::normalize(seen->direction), 1};
      const Match match = search(key, ray, *start, {});
      if (match.outcome != Outcome::Found) continue;
      const std::size_t lane = lanes.count++;
      lanes.sample[lane] = static_cast<std::int32_t>(lane);
      lanes.reflector[lane] = 1;
      lanes.origin.set(lane, ray.origin);
      lanes.direction.set(lane, ray.direction);
      lanes.attachedX[lane] = start->x;
      lanes.attachedY[lane] = start->y;
      lanes.x[lane] = match.place.x + (x % 2 == 0 ? 0.1f : -0.07f);
      lanes.y[lane] = match.place.y + (y % 2 == 0 ? -0.09f : 0.06f);
      matches.push_back(match);
    }
  return lanes.count;
}

TEST(CellLanes, FindWhatTheSearchFindsAtEveryVectorLevel) {
  const auto before = scene::lookAt({0.0f, 1.5f, 3.0f}, {0.0f, 0.0f, -1.0f}, {0, 1, 0}, 0.9f);
  const auto now = scene::lookAt({0.05f, 1.52f, 2.97f}, {0.0f, 0.0f, -1.0f}, {0, 1, 0}, 0.9f);
  for (const Setting& setting : {kFloor, kSphere}) {
    const KeyFrame key = keyOf(setting, before);
    std::vector<CellLanes> results;
    for (const VectorLevel level :
         {VectorLevel::Base, VectorLevel::V2, VectorLevel::V3, VectorLevel::V4}) {
      limitVectorLevel(level);
      CellLanes lanes;
      std::vector<Match> matches;
      ASSERT_GT(lanesOf(setting, key, now, lanes, matches), 15u);
      correct(key, 0.5f, lanes);
      std::size_t found = 0;
      for (std::size_t i = 0; i < lanes.count; ++i) {
        if (lanes.found[i] == 0) continue;
        ++found;
        const Vec2 place(lanes.x[i], lanes.y[i]);
        EXPECT_LT(glm::distance(place, matches[i].place), 0.05f);
        const Lookup lookup = lookUp(key, 1, place, {});
        ASSERT_EQ(lookup.outcome, Outcome::Found);
        EXPECT_EQ(lanes.light.at(i), lookup.radiance);
        EXPECT_NEAR(lanes.length[i], matches[i].length, 0.05f * matches[i].length);
      }
      EXPECT_GT(found, lanes.count / 2);
      results.push_back(lanes);
    }
    limitVectorLevel(VectorLevel::V4);
    for (const CellLanes& other : results)
      for (std::size_t i = 0; i < other.count; ++i) {
        EXPECT_EQ(other.found[i], results[0].found[i]);
        EXPECT_EQ(other.x[i], results[0].x[i]);
        EXPECT_EQ(other.y[i], results[0].y[i]);
        EXPECT_EQ(other.light.x[i], results[0].light.x[i]);
      }
  }
}

TEST(CellLanes, FindNothingWhereThereIsNoCell) {
  // A key frame of one sample, and one of the wrong reflector
  const auto camera = scene::lookAt({0.0f, 1.5f, 3.0f}, {0.0f, 0.0f, -1.0f}, {0, 1, 0}, 0.9f);
  KeyFrame small;
  small.begin(1, 1, camera, {}, stillGeometry());
  small.finish(stillGeometry(), 0.05f);
  const KeyFrame key = keyOf(kFloor, camera);
  CellLanes lanes;
  std::vector<Match> matches;
  ASSERT_GT(lanesOf(kFloor, key, camera, lanes, matches), 15u);
  lanes.reflector.fill(2);
  for (const KeyFrame* other : {&key, &std::as_const(small)}) {
    lanes.found.fill(1);
    correct(*other, 0.5f, lanes);
    for (std::size_t i = 0; i < lanes.count; ++i) EXPECT_EQ(lanes.found[i], 0);
  }
}

// Else what a chunk finds, which begins with a key frame, would not be what the whole run finds.
TEST(KeyFrame, ForgetsTheOneBefore) {
  const auto camera = scene::lookAt({0.0f, 1.5f, 3.0f}, {0.0f, 0.5f, -1.0f}, {0, 1, 0}, 0.9f);
  KeyFrame key = keyOf(kFloor, camera);
  fill(key, kSphere, camera);
  const KeyFrame fresh = keyOf(kSphere, camera);
  EXPECT_TRUE(std::ranges::equal(key.places(), fresh.places()));
  EXPECT_TRUE(std::ranges::equal(key.cells(), fresh.cells()));
}

/// Looks for what a camera sees in the floor in a key frame.
struct FloorFrame {
  test::SceneBuilder builder;
  test::Moment moment;
  trace::TraceScene trace;
  raster::GBufferCopy frame;
  MirrorSamples samples;
  frame::StepTimer timer;
  Services services{moment.scene, moment.geometry, moment.lighting, nullptr, nullptr, &trace,
                    timer};
  Reuse reuse{{}};
  std::vector<Vec3> radiance;

  explicit FloorFrame(const scene::Camera& now)
      : builder(withFloor()),
        moment(builder.scene()),
        trace(moment.scene, moment.geometry, trace::BvhPolicy::Static) {
    frame.width = frame.height = frame.rows = kSize;
    for (int y = 0; y < kSize; ++y)
      for (int x = 0; x < kSize; ++x) {
        const auto seen = see(kFloor, now, static_cast<float>(x), static_cast<float>(y));
        frame.object.push_back(seen ? 1 : 0);
        frame.normal.insert(frame.normal.end(), {0.0f, 1.0f, 0.0f, 0.0f});
        frame.depth.push_back(seen ? now.nearMetres /
                                         glm::dot(seen->surface.position - now.eye(), now.forward())
                                   : 0.0f);
      }
    samples.find(frame, now, trace, {});
    samples.aim();
    radiance.resize(samples.count());
  }
  static test::SceneBuilder withFloor() {
    test::SceneBuilder builder;
    builder.add(scene::makePlane({100.0f, 100.0f}, {1, 1}, scene::UvMode::Unit),
                builder.reflective(1.0f));
    return builder;
  }
  void findIn(const KeyFrame& key) {
    reuse.begin(samples, services);
    reuse.findIn(key, services, radiance);
  }
};

TEST(Reuse, TakesWhatLiesWithinTheFidelityOfTheRay) {
  const auto before = scene::lookAt({0.0f, 1.5f, 3.0f}, {0.0f, 0.0f, -1.0f}, {0, 1, 0}, 0.9f);
  const auto now = scene::lookAt({0.05f, 1.52f, 2.97f}, {0.0f, 0.0f, -1.0f}, {0, 1, 0}, 0.9f);
  KeyFrame key;
  fill(key, kFloor, before, 0.03f);
  FloorFrame frame(now);
  frame.findIn(key);
  const Options options;
  int within = 0;
  int beyond = 0;
  for (std::size_t i = 0; i < frame.samples.count(); ++i) {
    const Outcome outcome = frame.reuse.outcome(i);
    const Match& match = frame.reuse.match(i);
    if (outcome != Outcome::Found && outcome != Outcome::Unfaithful) continue;
    // As near as half of it before the last correction, it is not measured again.
    if (match.miss <= 0.5f * options.fidelity) continue;
    const MirrorRay& ray = frame.samples.rays()[i];
    const Lookup lookup = lookUp(key, 1, match.place, options);
    const float miss = missBy(key, ray, match.place, lookup.place, options);
    EXPECT_EQ(outcome == Outcome::Found, miss <= options.fidelity) << miss;
    ++(outcome == Outcome::Found ? within : beyond);
  }
  EXPECT_GT(within, 100);
  EXPECT_GT(beyond, 100);
}

// A mirror shows bars before a wall. What moves over more samples than it is wide between the
// frames is as good as new where the key frame showed the wall.
TEST(Reuse, FindsThinThingsWhereverTheKeyFrameShowsThem) {
  const auto before = scene::lookAt({0.0f, 1.5f, 3.0f}, {0.0f, 0.0f, -1.0f}, {0, 1, 0}, 0.9f);
  const auto now = scene::lookAt({0.6f, 1.6f, 2.9f}, {0.1f, 0.0f, -1.0f}, {0, 1, 0}, 0.9f);
  const frame::Geometry geometry = stillGeometry();
  for (const float width : {0.07f, 0.12f, 0.2f}) {
    Setting setting = kFloor;
    setting.barsZ = -2.0f;
    setting.barWidth = width;
    const KeyFrame key = keyOf(setting, before);
    FloorFrame frame(now);
    frame.findIn(key);
    int bars = 0;
    int whole = 0;
    int found = 0;
    for (std::size_t i = 0; i < frame.samples.count(); ++i) {
      const int at = static_cast<int>(frame.samples.places()[i]);
      const auto seen =
          see(setting, now, static_cast<float>(at % kSize), static_cast<float>(at / kSize));
      ASSERT_TRUE(seen);
      // The floor's mirror image of a place is seen in the direction of its reflection.
      const auto there = key.project({seen->place.x, -seen->place.y, seen->place.z}, 0, geometry);
      const Vec2 nearest = glm::floor(there.value_or(Vec2(-1.0f)) + 0.5f);
      const int x = static_cast<int>(nearest.x);
      const int y = static_cast<int>(nearest.y);
      if (!seen->bar || !key.inside(x, y) || key.shown(key.index(x, y)) != 3) continue;
      ++bars;
      const bool taken = frame.reuse.outcome(i) == Outcome::Found;
      // At its edges it may be traced anew.
      if (taken) {
        EXPECT_NEAR(frame.radiance[i].x, 2.0f, 1e-3f) << width << " " << at;
      }
      if (lookUp(key, 1, *there, {}).outcome != Outcome::Found) continue;
      ++whole;
      found += taken ? 1 : 0;
    }
    EXPECT_GT(static_cast<float>(found), 0.95f * static_cast<float>(whole)) << width;
    EXPECT_GT(bars, 200);
    EXPECT_GT(whole, 100);
  }
}

TEST(Search, StaysWhereNothingHasMoved) {
  const auto camera = scene::lookAt({0.0f, 1.5f, 3.0f}, {0.0f, 0.0f, -1.0f}, {0, 1, 0}, 0.9f);
  const KeyFrame key = keyOf(kFloor, camera);
  const auto seen = see(kFloor, camera, 40.0f, 100.0f);
  ASSERT_TRUE(seen);
  const Match match = search(key, {seen->surface.position, glm::normalize(seen->direction), 1},
                             {40.0f, 100.0f}, {});
  ASSERT_EQ(match.outcome, Outcome::Found);
  EXPECT_LT(glm::distance(match.place, Vec2(40.0f, 100.0f)), kSnap);
}

TEST(Search, SaysWhatItCannotFind) {
  const auto camera = scene::lookAt({0.0f, 1.5f, 3.0f}, {0.0f, 0.0f, -1.0f}, {0, 1, 0}, 0.9f);
  const KeyFrame key = keyOf(kFloor, camera);
  const MirrorRay up{{0.0f, 0.0f, 0.0f}, {0.0f, 1.0f, 0.0f}, 1};
  EXPECT_EQ(search(key, up, {64.0f, 100.0f}, {}).outcome, Outcome::NotFound);
  const MirrorRay other{{0.0f, 0.0f, 0.0f}, glm::normalize(Vec3(0.0f, 0.3f, -1.0f)), 2};
  EXPECT_EQ(search(key, other, {64.0f, 100.0f}, {}).outcome, Outcome::NotFound);
  const Vec2 outside(-400.0f, 1e9f);
  EXPECT_EQ(search(key, up, outside, {}).outcome, Outcome::NotFound);
  EXPECT_EQ(lookUp(key, 1, {-7.3f, 2.0f}, {}).outcome, Outcome::Discontinuity);
}

}  // namespace
}  // namespace catoptric::methods::reprojection
