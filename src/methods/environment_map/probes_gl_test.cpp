// Several probes against frames of a single map, and against closed forms.
#include <fmt/core.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numeric>
#include <optional>

#include "frame/test_scenes.h"
#include "methods/environment_map/probes.h"
#include "methods/environment_map/test_rig.h"

namespace catoptric::methods {
namespace {

constexpr float kRadius = 0.4f;
const std::array<Vec3, 3> kBalls = {Vec3(-0.9f, -0.3f, 0.0f), Vec3(0.9f, -0.2f, -0.3f),
                                    Vec3(0.1f, 0.7f, -0.8f)};

/// So many mirror balls (objects 1, ...), of radiance `own` without their reflection.
test::SceneBuilder mirrorBalls(std::size_t count, const Vec3& own = Vec3(0.25f)) {
  test::SceneBuilder builder;
  const int mirror = unlit(builder, own);
  builder.scene().materials.back().specularLevel = 0.8f;
  for (std::size_t i = 0; i < count; ++i)
    builder.add(scene::makeIcosphere(kRadius, 5, scene::UvMode::Unit), mirror,
                test::translation(kBalls[i]));
  return builder;
}

/// The mirrors among 20 small balls of many colours.
scene::Scene mirrorsAmongBalls(std::size_t count) {
  test::SceneBuilder builder = mirrorBalls(count);
  builder.constantEnvironment(Vec3(0.1f, 0.2f, 0.3f));
  for (int i = 0; i < 20; ++i) {
    const auto t = static_cast<float>(i);
    const Vec3 way(std::cos(2.4f * t), 0.1f * t - 0.95f, std::sin(2.4f * t));
    builder.add(scene::makeIcosphere(0.35f, 3, scene::UvMode::Unit),
                unlit(builder, Vec3(0.2f + 0.1f * t, 1.0f - 0.04f * t, std::fmod(0.3f * t, 1.0f))),
                test::translation(2.5f * way));
  }
  return builder.scene();
}

scene::Camera camera() {
  return cameraAt(Vec3(0.1f, 0.3f, 2.0f), Vec3(0.0f, 0.1f, -0.3f));
}

/// Samples of a frame of one map around the middle of ball `i`.
std::vector<Rig::Sample> framesOfOneMap(const scene::Scene& scene, std::size_t i,
                                        const std::string& proxy) {
  const frame::Geometry geometry = frame::makeGeometry(scene, scene::poseAt(scene, 0.0));
  const Vec3 centre = geometry.objects[i].bounds.centre();
  Rig rig(scene, fmt::format(R"({{"face_size": 64, "proxy": "{}", "center": [{}, {}, {}]}})", proxy,
                             centre.x, centre.y, centre.z));
  rig.render(camera());
  return rig.samples();
}

TEST(Probes, EachReflectorsMapIsTheSingleMapAroundItAlone) {
  const scene::Scene scene = mirrorsAmongBalls(2);
  for (const std::string proxy : {"none", "box", "sphere"}) {
    Rig rig(scene, R"({"face_size": 64, "probes": 2, "proxy": ")" + proxy + "\"}");
    EXPECT_EQ(rig.render(camera()).counters.at("probes"), 2u);
    const std::vector<Rig::Sample> samples = rig.samples();
    for (std::size_t ball = 0; ball < 2; ++ball) {
      const std::vector<Rig::Sample> alone = framesOfOneMap(scene, ball, proxy);
      int checked = 0;
      for (std::size_t i = 0; i < samples.size(); ++i) {
        if (samples[i].object != static_cast<int>(ball) + 1) continue;
        ++checked;
        ASSERT_EQ(samples[i].radiance, alone[i].radiance) << proxy << ", sample " << i;
      }
      EXPECT_GT(checked, 400);
    }
  }
}

/// The share of each of three maps at distances d: inverse distances less the farthest's, which
/// has none.
std::array<double, 3> sharesAt(const std::array<double, 3>& d) {
  const double farthest = std::max({d[0], d[1], d[2]});
  std::array<double, 3> shares{};
  for (std::size_t i = 0; i < 3; ++i) shares[i] = 1.0 / d[i] - 1.0 / farthest;
  const double sum = std::accumulate(shares.begin(), shares.end(), 0.0);
  for (double& share : shares) share /= sum;
  return shares;
}

TEST(Probes, BlendingMixesTheTwoNearestMaps) {
  const scene::Scene scene = mirrorsAmongBalls(3);
  Rig rig(scene, R"({"face_size": 64, "probes": 3, "blend": "distance"})");
  EXPECT_EQ(rig.render(camera()).counters.at("probes"), 3u);
  const std::vector<Rig::Sample> samples = rig.samples();
  std::array<std::vector<Rig::Sample>, 3> single;
  for (std::size_t ball = 0; ball < 3; ++ball) single[ball] = framesOfOneMap(scene, ball, "none");
  int checked = 0;
  int mixed = 0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (samples[i].object < 1 || samples[i].object > 3) continue;
    std::array<double, 3> d{};
    for (std::size_t ball = 0; ball < 3; ++ball)
      d[ball] = glm::distance(samples[i].place, kBalls[ball]);
    const std::array<double, 3> shares = sharesAt(d);
    glm::dvec3 expected(0.0);
    for (std::size_t ball = 0; ball < 3; ++ball)
      expected += shares[ball] * glm::dvec3(single[ball][i].radiance);
    ++checked;
    mixed += std::ranges::max(shares) < 0.9 ? 1 : 0;
    ASSERT_LT(glm::length(glm::dvec3(samples[i].radiance) - expected), 2e-3);
  }
  EXPECT_GT(checked, 1000);
  EXPECT_GT(mixed, 100);
}

TEST(Probes, SharesSumToOne) {
  // All surroundings have one radiance
  const Vec3 radiance(0.5f, 1.25f, 8.0f);
  test::SceneBuilder builder = mirrorBalls(3, radiance);
  builder.constantEnvironment(radiance);
  Rig rig(builder.scene(), R"({"face_size": 16, "probes": 3, "blend": "distance"})");
  rig.render(camera());
  for (const Rig::Sample& sample : rig.samples()) {
    if (sample.object == 0) continue;
    ASSERT_LT(glm::length((sample.radiance - radiance) / radiance), 1e-6f);
  }
}

constexpr float kWall = 2.0f;

/// Whether the way between two points passes near a mirror ball that does not enclose its start.
bool nearABall(const Vec3& from, const Vec3& to, float margin) {
  const Vec3 way = to - from;
  return std::ranges::any_of(kBalls, [&](const Vec3& ball) {
    if (glm::distance(from, ball) < kRadius + 1e-3f) return false;
    const float t = glm::clamp(glm::dot(ball - from, way) / glm::dot(way, way), 0.0f, 1.0f);
    return glm::distance(from + t * way, ball) < kRadius + margin;
  });
}

/// The wall that a reflected ray hits in the room of `kWall`; none near edges, and where a ball is
/// in the way of the ray or of a map's view.
std::optional<Vec3> wallSeen(const Rig::Sample& sample, const std::vector<Vec3>& maps) {
  int axis = 0;
  float metres = 1e30f;
  for (int a = 0; a < 3; ++a) {
    const float exit =
        (std::copysign(kWall, sample.reflected[a]) - sample.place[a]) / sample.reflected[a];
    if (exit < metres) {
      metres = exit;
      axis = a;
    }
  }
  const Vec3 hit = sample.place + metres * sample.reflected;
  constexpr float kMargin = 0.1f;  // several texels
  for (int a = 0; a < 3; ++a)
    if (a != axis && std::abs(hit[a]) > kWall - kMargin) return std::nullopt;
  if (nearABall(sample.place, hit, kMargin)) return std::nullopt;
  for (const Vec3& map : maps)
    if (nearABall(map, hit, kMargin)) return std::nullopt;
  return wallColor(2 * axis + (sample.reflected[axis] < 0 ? 1 : 0));
}

TEST(Probes, ABoxAsProxyIsExactInARoomThatIsABox) {
  test::SceneBuilder builder = mirrorBalls(3);
  addRoom(builder, kWall);
  const scene::Scene& scene = builder.scene();
  const frame::Geometry geometry = frame::makeGeometry(scene, scene::poseAt(scene, 0.0));
  for (const int probes : {1, 2, 3, 8}) {
    for (const std::string blend : {"nearest", "distance"}) {
      std::vector<Vec3> maps{geometry.bounds.centre()};
      if (probes > 1) {
        maps.clear();
        for (const auto& group : groupReflectors({0, 1, 2}, geometry, probes))
          maps.push_back(probeCentre(group, geometry));
      }
      Rig rig(scene, R"({"face_size": 256, "proxy": "box", "blend": ")" + blend +
                         R"(", "probes": )" + std::to_string(probes) + "}");
      rig.render(cameraAt(Vec3(0.2f, 0.4f, 1.9f), Vec3(0.0f, 0.1f, -0.3f)));
      int checked = 0;
      for (const Rig::Sample& sample : rig.samples()) {
        if (sample.object < 1 || sample.object > 3) continue;
        const std::optional<Vec3> expected = wallSeen(sample, maps);
        if (!expected) continue;
        ++checked;
        ASSERT_LT(glm::length(sample.radiance - *expected), 1.0f / 255.0f)
            << probes << " probes, " << blend;
      }
      EXPECT_GT(checked, 300) << probes << " probes, " << blend;
    }
  }
}

TEST(Probes, OnlyMapsThatAreReadAreDrawn) {
  for (const std::string blend : {"nearest", "distance"}) {
    test::SceneBuilder builder;
    builder.constantEnvironment(Vec3(0.25f));
    const int mirror = builder.reflective(1.0f);
    for (const float x : {-10.0f, 0.0f, 10.0f})
      builder.add(scene::makeIcosphere(0.5f, 3, scene::UvMode::Unit), mirror,
                  test::translation({x, 0, 0}));
    Rig rig(builder.scene(), R"({"face_size": 16, "probes": 3, "blend": ")" + blend + "\"}");
    EXPECT_EQ(rig.timesRun("cube_map"), 0);
    const int ofBall = blend == "nearest" ? 1 : 2;
    const auto looksAt = [&](float x) {
      return rig.render(cameraAt(Vec3(x, 0, 3), Vec3(x, 0, 0))).counters.at("probes");
    };
    EXPECT_EQ(looksAt(-10.0f), static_cast<std::uint64_t>(ofBall));
    EXPECT_EQ(rig.timesRun("cube_map"), ofBall);
    EXPECT_EQ(looksAt(-10.0f), static_cast<std::uint64_t>(ofBall));
    EXPECT_EQ(rig.timesRun("cube_map"), ofBall);
    looksAt(10.0f);
    EXPECT_EQ(rig.timesRun("cube_map"), ofBall + 1);
    // No reflector is in view
    EXPECT_EQ(looksAt(50.0f), 0u);
    EXPECT_EQ(rig.timesRun("resolve"), 3);
  }
}

// What moves while no sample reads a map must show in it afterwards.
TEST(Probes, AMapThatWasNotReadFollowsWhatHasMoved) {
  test::SceneBuilder builder = mirrorBalls(2);
  builder.constantEnvironment(Vec3(0.1f));
  const int moving = builder.add(scene::makeIcosphere(0.4f, 3, scene::UvMode::Unit),
                                 unlit(builder, Vec3(2.0f)), test::translation({0.9f, 1.2f, 0.8f}));
  builder.move(moving, Vec3(0.0f, -2.0f, 0.0f), 1.0f);
  const std::string options = R"({"face_size": 32, "probes": 2})";
  const auto lookAtBall = [](std::size_t i) {
    return cameraAt(kBalls[i] + Vec3(0, 0, 1.2f), kBalls[i]);
  };
  Rig rig(builder.scene(), options);
  rig.render(lookAtBall(1));
  rig.render(lookAtBall(0), rig.stage.moveTo(1.0));
  rig.render(lookAtBall(1));
  const std::vector<Rig::Sample> late = rig.samples();
  Rig fresh(builder.scene(), options);
  fresh.render(lookAtBall(1), fresh.stage.moveTo(1.0));
  const std::vector<Rig::Sample> expected = fresh.samples();
  int bright = 0;
  for (std::size_t i = 0; i < late.size(); ++i) {
    ASSERT_EQ(late[i].radiance, expected[i].radiance);
    bright += late[i].object == 2 && late[i].radiance.x > 1.0f ? 1 : 0;
  }
  EXPECT_GT(bright, 10);
}

}  // namespace
}  // namespace catoptric::methods
