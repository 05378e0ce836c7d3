// Hits, and what is seen there, against what is known of them.

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "core/error.h"
#include "core/vector_level.h"
#include "frame/test_scenes.h"
#include "methods/glossy_lod/filter.h"
#include "methods/glossy_lod/scene_images.h"
#include "methods/glossy_lod/tree/traversal.h"
#include "methods/testing/gl_harness.h"

namespace catoptric::methods {
namespace {

using namespace glossy_lod;
using test::SceneBuilder;

/// What the traversal finds along a ray.
struct Met {
  float metres;
  std::uint64_t visits;
  bool back;
  float level;
  std::uint32_t node;  ///< kNothing: none
};

/// A scene's images and the traversal alone.
class Rays {
 public:
  Rays(test::GlStage& stage, const Options& options, Levels levels = Levels::Adaptive)
      : levels_(levels) {
    images.make(stage.scene, stage.moment.geometry, options, findSizes(stage.scene, {}, options));
  }

  /// `origins`: a is the slope of the ray's width. In packets of `together`.
  std::vector<Met> meet(const std::vector<Vec4>& origins, const std::vector<Vec4>& directions,
                        float alpha, std::size_t together = RayPacket::kMost,
                        float steepest = kAnySlope) {
    std::vector<Met> met;
    for (std::size_t first = 0; first < origins.size(); first += together) {
      RayPacket packet;
      packet.count = std::min(together, origins.size() - first);
      packet.steepest = steepest;
      for (std::size_t i = 0; i < packet.count; ++i) {
        for (int axis = 0; axis < 3; ++axis) {
          packet.origin[static_cast<std::size_t>(axis)][i] = origins[first + i][axis];
          packet.direction[static_cast<std::size_t>(axis)][i] = directions[first + i][axis];
        }
        packet.base[i] = 0.0f;
        packet.slope[i] = origins[first + i].w;
      }
      PacketHits hits;
      Visits visits;
      traverse(images.view(), packet, alpha, levels_, hits, visits);
      for (std::size_t i = 0; i < packet.count; ++i) {
        const bool missed = hits.node[i] == kNothing;
        const QuadHit found{hits.node[i], {hits.u[i], hits.v[i]}, hits.back[i] != 0};
        met.push_back({missed ? -1.0f : hits.metres[i], i == 0 ? visits.nodes : 0, found.back,
                       missed ? -1.0f
                              : levelOf(images, found, Vec3(directions[first + i]),
                                        packet.slope[i] * hits.metres[i]),
                       hits.node[i]});
      }
    }
    return met;
  }

  SceneImages images;

 private:
  Levels levels_;
};

/// Rays from within half a metre of 0 into all directions.
void raysWithin(std::size_t count, std::vector<Vec4>& origins, std::vector<Vec4>& directions) {
  std::mt19937 random(11);
  std::normal_distribution<float> any(0.0f, 1.0f);
  for (std::size_t i = 0; i < count; ++i) {
    const Vec3 o(any(random), any(random), any(random));
    const Vec3 d(any(random), any(random), any(random));
    origins.emplace_back(0.4f * glm::normalize(o), 0.0f);
    directions.emplace_back(glm::normalize(d), 0.0f);
  }
}

/// The nearest of all finest triangles, in double.
double nearest(const Tree& tree, const std::vector<Vec4>& vertices, const Vec3& o, const Vec3& d) {
  double best = -1.0;
  for (std::size_t i = 0; i < tree.nodes().size(); ++i) {
    if ((tree.nodes()[i].flags & kIsLeaf) == 0) continue;
    const Quad& q = tree.quads()[i];
    const std::uint32_t v[4] = {q.first, q.first + 1, q.first + q.up, q.first + q.up + 1};
    for (const auto& t : {std::array{v[0], v[1], v[2]}, {v[3], v[2], v[1]}}) {
      const glm::dvec3 a(vertices[t[0]]);
      const glm::dvec3 e1 = glm::dvec3(vertices[t[1]]) - a;
      const glm::dvec3 e2 = glm::dvec3(vertices[t[2]]) - a;
      const glm::dvec3 p = glm::cross(glm::dvec3(d), e2);
      const double det = glm::dot(e1, p);
      if (det == 0.0) continue;
      const glm::dvec3 s = glm::dvec3(o) - a;
      const double u = glm::dot(s, p) / det;
      const glm::dvec3 r = glm::cross(s, e1);
      const double w = glm::dot(glm::dvec3(d), r) / det;
      const double t1 = glm::dot(e2, r) / det;
      if (u < 0.0 || w < 0.0 || u + w > 1.0 || t1 <= 0.0) continue;
      if (best < 0.0 || t1 < best) best = t1;
    }
  }
  return best;
}

scene::Scene manyBodies() {
  SceneBuilder builder;
  const int white = builder.diffuse(Vec3(0.7f));
  builder.add(scene::makeTorus(0.8f, 0.25f, 40, 20, scene::UvMode::Unit), white,
              test::rotation(30.0f, {1, 0, 0}));
  builder.add(scene::makeBox({.size = Vec3(0.4f)}, scene::UvMode::Unit), white,
              test::translation({0.9f, 0.6f, -0.3f}));
  builder.add(scene::makeIcosphere(0.5f, 3, scene::UvMode::Unit), white,
              test::translation({-1.2f, 0.1f, 0.4f}));
  builder.constantEnvironment(Vec3(0.5f, 0.4f, 0.3f));
  return builder.scene();
}

TEST(GlossyLodHits, EqualBruteForceOverTheFinestTriangles) {
  test::GlStage stage(manyBodies());
  for (const Levels levels : {Levels::Off, Levels::Adaptive, Levels::Stitched}) {
    Rays rays(stage, {.size = 16}, levels);
    std::vector<Vec4> origins;
    std::vector<Vec4> directions;
    raysWithin(3000, origins, directions);
    const std::vector<Met> met = rays.meet(origins, directions, 0.0f);
    int hits = 0;
    int wrong = 0;
    for (std::size_t i = 0; i < met.size(); ++i) {
      const double truth = nearest(rays.images.tree(), rays.images.vertices(), Vec3(origins[i]),
                                   Vec3(directions[i]));
      hits += truth > 0.0 ? 1 : 0;
      wrong += std::abs(truth - static_cast<double>(met[i].metres)) > 2e-5 ? 1 : 0;
    }
    EXPECT_GT(hits, 800);
    EXPECT_EQ(wrong, 0);
  }
}

TEST(GlossyLodHits, AreTheSameInPacketsOfAnyMakeUpAndOnEveryMachine) {
  test::GlStage stage(manyBodies());
  Rays rays(stage, {.size = 32});
  std::vector<Vec4> origins;
  std::vector<Vec4> directions;
  raysWithin(3000, origins, directions);
  for (std::size_t i = 0; i < origins.size(); ++i) origins[i].w = i % 3 == 0 ? 0.05f : 0.002f;
  // Along axes too, and with zeros of both signs
  directions[0] = Vec4(0.0f, 1.0f, 0.0f, 0.0f);
  directions[1] = Vec4(-0.0f, -1.0f, 0.0f, 0.0f);
  const std::vector<Met> alone = rays.meet(origins, directions, 3.0f, 1);
  std::uint64_t visits = 0;
  for (const Met& m : alone) visits += m.visits;
  const VectorLevel machine = vectorLevel();
  for (const VectorLevel level : {VectorLevel::Base, VectorLevel::V3, VectorLevel::V4}) {
    limitVectorLevel(level);
    for (const std::size_t together : {1u, 5u, 32u}) {
      const std::vector<Met> met = rays.meet(origins, directions, 3.0f, together);
      std::uint64_t sum = 0;
      std::size_t wrong = 0;
      for (std::size_t i = 0; i < met.size(); ++i) {
        sum += met[i].visits;
        wrong += met[i].metres != alone[i].metres || met[i].back != alone[i].back ||
                         met[i].level != alone[i].level
                     ? 1
                     : 0;
      }
      EXPECT_EQ(wrong, 0u) << together;
      EXPECT_EQ(sum, visits) << together;
    }
  }
  limitVectorLevel(machine);
}

/// Closed bodies about 0 whose charts meet at corners, in jags and along creases.
std::vector<scene::Mesh> closedBodies() {
  scene::BoxShape box;
  box.size = Vec3(2.0f);
  box.segments = {9, 9, 9};
  return {scene::makeIcosphere(1.0f, 4, scene::UvMode::Unit),
          scene::makeSphere(1.0f, 97, 53, scene::UvMode::Unit),
          scene::makeBox(box, scene::UvMode::Unit),
          scene::makeRoundedBox(Vec3(2.0f), 0.3f, 4, scene::UvMode::Unit)};
}

// From outside rays meet the front, before they are within; from within they meet the back.
TEST(GlossyLodHits, NeverPassThroughAClosedObjectAtAnyLevel) {
  for (const scene::Mesh& body : closedBodies()) {
    SceneBuilder builder;
    builder.add(scene::Mesh(body), builder.diffuse(Vec3(1.0f)));
    test::GlStage stage(builder.scene());
    for (const int size : {8, 32, 128}) {
      Rays rays(stage, {.size = size}, Options{}.levels);
      std::vector<Vec4> within;
      std::vector<Vec4> directions;
      raysWithin(20000, within, directions);
      std::vector<Vec4> outside;
      for (std::size_t i = 0; i < within.size(); ++i)
        outside.push_back(0.5f * within[i] - 4.0f * directions[i]);
      for (const float alpha : {0.0f, 1.0f, 3.0f, 10.0f}) {
        std::size_t wrong = 0;
        for (std::size_t i = 0; i < within.size(); ++i) within[i].w = outside[i].w = 0.02f;
        for (const Met& m : rays.meet(within, directions, alpha))
          wrong += m.metres > 0.0f && m.back ? 0 : 1;
        for (const Met& m : rays.meet(outside, directions, alpha))
          wrong += m.metres > 0.0f && m.metres < 4.0f && !m.back ? 0 : 1;
        // Boxes of 0.8 m about a body of 2 m: two of 40,000 rays see another side
        // side
        EXPECT_LE(wrong, alpha > 3.0f ? 2u : 0u)
            << "body of " << body.positions.size() << " vertices, size " << size << ", alpha "
            << alpha;
      }
    }
  }
}

TEST(GlossyLodHits, DoNotLeakThroughSeams) {
  std::size_t count = 0;
  for (const scene::Mesh& body : closedBodies()) {
    SceneBuilder builder;
    builder.add(scene::Mesh(body), builder.diffuse(Vec3(1.0f)));
    test::GlStage stage(builder.scene());
    Rays rays(stage, {.size = 32});
    std::vector<Vec4> origins;
    std::vector<Vec4> directions;
    raysWithin(260000, origins, directions);
    for (const Met& m : rays.meet(origins, directions, 0.0f)) {
      if (m.metres < 0.0f) ADD_FAILURE() << "body of " << body.positions.size() << " vertices";
      EXPECT_TRUE(m.back);
      ++count;
    }
  }
  EXPECT_GE(count, 1'000'000u);
}

// n.y of a unit sphere below a light, where its charts meet, too.
TEST(GlossyLodHits, SeeTheSurfacesOwnRadianceAtBorders) {
  SceneBuilder builder;
  builder.add(scene::makeSphere(1.0f, 64, 32, scene::UvMode::Unit), builder.diffuse(Vec3(1.0f)));
  scene::Light light;
  light.type = scene::LightType::Directional;
  light.direction = Vec3(0.0f, -1.0f, 0.0f);
  light.intensity = Vec3(kPi);
  scene::Scene lit = builder.scene();
  lit.lights.push_back(light);
  test::GlStage stage(std::move(lit));
  std::vector<Vec4> directions;
  std::vector<Vec4> origins;
  raysWithin(50000, origins, directions);
  for (const int size : {32, 64, 128}) {
    Rays rays(stage, {.size = size}, Levels::Off);
    const Shading shading{&stage.scene, &stage.moment.geometry, &stage.moment.lighting,
                          &rays.images};
    Radiance radiance;
    radiance.shade(shading, std::vector<int>{0});
    for (std::size_t i = 0; i < origins.size(); ++i) origins[i] = -4.0f * directions[i];
    PacketHits hits;
    Visits visits;
    float most = 0.0f;
    for (std::size_t i = 0; i < origins.size(); ++i) {
      RayPacket packet;
      packet.count = 1;
      for (int axis = 0; axis < 3; ++axis) {
        packet.origin[static_cast<std::size_t>(axis)][0] = origins[i][axis];
        packet.direction[static_cast<std::size_t>(axis)][0] = directions[i][axis];
      }
      packet.base[0] = packet.slope[0] = 0.0f;
      traverse(rays.images.view(), packet, 0.0f, Levels::Off, hits, visits);
      ASSERT_NE(hits.node[0], kNothing);
      const QuadHit found{hits.node[0], {hits.u[0], hits.v[0]}, hits.back[0] != 0};
      ASSERT_FALSE(found.back);
      const Vec3 seen =
          mean(footprint(rays.images, radiance, found, Vec3(directions[i]), 0.0f, true));
      most = std::max(most, std::abs(seen.x - std::max(0.0f, -directions[i].y)));
    }
    EXPECT_LT(most, 0.2f) << size;  // a back of the light's side, or a front of the other, is 1 off
  }
}

TEST(GlossyLodHits, VisitsFallWithAlpha) {
  test::GlStage stage(manyBodies());
  Rays rays(stage, {.size = 64});
  std::vector<Vec4> origins;
  std::vector<Vec4> directions;
  raysWithin(4000, origins, directions);
  for (Vec4& o : origins) o.w = 0.02f;
  double before = 1e30;
  for (const float alpha : {0.0f, 1.0f, 3.0f, 10.0f}) {
    double visits = 0.0;
    for (const Met& m : rays.meet(origins, directions, alpha))
      visits += static_cast<double>(m.visits);
    EXPECT_LE(visits, before);
    before = visits;
  }
}

TEST(GlossyLodHits, OfStitchedLevelsAreNeverLost) {
  test::GlStage stage(manyBodies());
  Rays off(stage, {.size = 64}, Levels::Off);
  Rays adaptive(stage, {.size = 64});
  Rays stitched(stage, {.size = 64}, Levels::Stitched);
  std::vector<Vec4> origins;
  std::vector<Vec4> directions;
  raysWithin(20000, origins, directions);
  for (Vec4& o : origins) o.w = 0.1f;
  const std::vector<Met> truth = off.meet(origins, directions, 0.0f);
  const auto countLost = [&](Rays& rays, float alpha) {
    const std::vector<Met> met = rays.meet(origins, directions, alpha);
    int lost = 0;
    for (std::size_t i = 0; i < met.size(); ++i)
      lost += truth[i].node != kNothing && met[i].node == kNothing ? 1 : 0;
    return lost;
  };
  for (const float alpha : {3.0f, 10.0f, 30.0f}) EXPECT_EQ(countLost(stitched, alpha), 0) << alpha;
  EXPECT_GT(countLost(adaptive, 30.0f), 100);
}

TEST(GlossyLodHits, TakeNoBoxThatLooksLargerThanTheCoarsest) {
  test::GlStage stage(manyBodies());
  Rays rays(stage, {.size = 64});
  std::vector<Vec4> origins;
  std::vector<Vec4> directions;
  raysWithin(4000, origins, directions);
  for (Vec4& o : origins) o.w = 0.2f;
  const float alpha = 5.0f;
  // Slope of the largest box's disc, of all that are no finest ones [Yu2008] Eqs. (6), (7)
  const auto largest = [&](float steepest) {
    float most = 0.0f;
    const std::vector<Met> met = rays.meet(origins, directions, alpha, RayPacket::kMost, steepest);
    for (std::size_t i = 0; i < met.size(); ++i) {
      if (met[i].node == kNothing) continue;
      const Node& box = rays.images.tree().nodes()[met[i].node];
      if ((box.flags & kIsLeaf) != 0) continue;
      const float size = std::sqrt(0.25f * kPi) * glm::distance(box.least, box.most);
      most = std::max(most, size / glm::distance(0.5f * (box.least + box.most), Vec3(origins[i])));
    }
    return most;
  };
  EXPECT_GT(largest(kAnySlope), 0.5f);
  EXPECT_LE(largest(0.1f / alpha), 0.10001f);
  EXPECT_GT(largest(0.1f / alpha), 0.05f);
}

TEST(GlossyLodImages, FitTheirMemoryOrSayWhatTheyNeed) {
  SceneBuilder builder;
  const int white = builder.diffuse(Vec3(0.7f));
  for (int i = 0; i < 20; ++i)
    builder.add(scene::makeIcosphere(0.4f, 4, scene::UvMode::Unit), white,
                test::translation({static_cast<float>(i), 0.0f, 0.0f}));
  builder.constantEnvironment(Vec3(1.0f));
  test::GlStage stage(builder.scene());
  const auto quadsWithin = [&](std::uint64_t memoryBytes) {
    const Options options{.memoryBytes = memoryBytes};
    SceneImages images;
    images.make(stage.scene, stage.moment.geometry, options, findSizes(stage.scene, {}, options));
    const auto charts = static_cast<double>(images.charts().size());
    double texels = 0.0;
    for (const PlacedChart& chart : images.charts())
      texels += std::exp2(2 * chart.image.texelLevel);
    EXPECT_LE(imageBytes(static_cast<double>(images.counts().quads) + charts, texels), memoryBytes);
    EXPECT_EQ(images.counts().reducedObjects, memoryBytes < std::uint64_t{64} << 20 ? 20u : 0u);
    return images.counts().quads;
  };
  const std::uint64_t all = quadsWithin(std::uint64_t{64} << 20);
  const std::uint64_t few = quadsWithin(std::uint64_t{4} << 20);
  EXPECT_LT(few, all);
  try {
    quadsWithin(std::uint64_t{1} << 12);
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ExitCode::OutOfMemory);
    EXPECT_NE(std::string(error.what()).find("Raise memory_mib"), std::string::npos);
  }
}

TEST(GlossyLodRadiance, IsTheSameWhenItIsShadedLater) {
  test::GlStage stage(manyBodies());
  SceneImages images;
  images.make(stage.scene, stage.moment.geometry, {}, findSizes(stage.scene, {}, {.size = 32}));
  const Shading shading{&stage.scene, &stage.moment.geometry, &stage.moment.lighting, &images};
  const std::vector<int> objects = {0, 1, 2};
  Radiance atOnce;
  atOnce.shade(shading, objects);
  for (std::uint32_t chart = 0; chart < images.charts().size(); ++chart) {
    EXPECT_TRUE(atOnce.isShaded(chart, 0));
    EXPECT_TRUE(atOnce.ensure(chart, 1));
  }
  Radiance later;
  later.shadeLater(shading, objects);
  // Every side is asked for by two threads
  const std::size_t sides = 2 * images.charts().size();
  std::atomic<std::size_t> shaded{0};
  const auto ask = [&] {
    for (std::size_t s = 0; s < sides; ++s)
      shaded += later.ensure(static_cast<std::uint32_t>(s / 2), static_cast<int>(s % 2)) ? 1 : 0;
  };
  std::thread other(ask);
  ask();
  other.join();
  EXPECT_EQ(shaded, sides);
  float brightest = 0.0f;
  for (const PlacedChart& chart : images.charts()) {
    for (int side = 0; side < 2; ++side) {
      for (int level = 0; level <= chart.image.texelLevel; ++level) {
        const std::uint32_t n = 1u << (chart.image.texelLevel - level);
        for (std::uint32_t i = 0; i < n * n; ++i) {
          const std::size_t x = (chart.x >> level) + i % n;
          const std::size_t y = (chart.y >> level) + i / n;
          ASSERT_EQ(*atOnce.onLevel(side, level, x, y), *later.onLevel(side, level, x, y));
          brightest = std::max(brightest, later.onLevel(side, level, x, y)->x);
        }
      }
    }
  }
  EXPECT_GT(brightest, 0.0f);
}

TEST(GlossyLodHits, AverageOverThePerpendicularFootprint) {
  // A square of 1 m in 64 x 64 texels; of one square and of many, by fine and by coarse quads
  for (const int cells : {1, 32}) {
    SceneBuilder builder;
    builder.add(scene::makePlane(Vec2(1.0f), {cells, cells}, scene::UvMode::Unit),
                builder.diffuse(Vec3(0.0f), Vec3(1.0f)));
    test::GlStage stage(builder.scene());
    Rays rays(stage, {.size = 64});
    const float side = 1.0f / 64.0f;
    for (const float alpha : {0.0f, 10.0f})
      for (const float level : {0.0f, 1.0f, 2.5f, 6.0f}) {
        // [Yu2008] Eqs. (8), (9): from d metres above, d^2 Omega = 4^l texels
        const float metres = 2.0f;
        const float slope = std::exp2(level) * side / metres;
        const Met met = rays.meet({Vec4(0.1f, metres, 0.2f, slope)}, {Vec4(0, -1, 0, 0)}, alpha)[0];
        EXPECT_NEAR(met.metres, metres, 1e-5f) << cells << ' ' << alpha;
        EXPECT_NEAR(met.level, level, 1e-3f) << cells << ' ' << alpha;
      }
  }
}

}  // namespace
}  // namespace catoptric::methods
