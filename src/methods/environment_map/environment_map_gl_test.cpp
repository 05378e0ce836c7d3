#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "frame/test_scenes.h"
#include "methods/environment_map/cube_map.h"
#include "methods/environment_map/test_rig.h"

namespace catoptric::methods {
namespace {

void gradientEnvironment(scene::Scene& scene) {
  scene.environment.type = scene::EnvironmentType::Gradient;
  scene.environment.color = Vec3(0.2f, 0.4f, 2.0f);
  scene.environment.horizon = Vec3(1.0f, 0.9f, 0.8f);
  scene.environment.ground = Vec3(0.3f, 0.1f, 0.05f);
}

TEST(EnvironmentMap, MirrorInAConstantEnvironmentIsThatConstant) {
  // Values that half floats hold exactly.
  const Vec3 radiance(0.5f, 1.25f, 8.0f);
  for (const char* options : {R"({"source": "environment"})",
                              R"({"source": "scene", "center": [0, 0, 5], "face_size": 16})"}) {
    for (const float roughness : {0.0f, 0.4f, 1.0f}) {
      SCOPED_TRACE(std::string(options) + " g = " + std::to_string(roughness));
      test::SceneBuilder builder;
      builder.constantEnvironment(radiance);
      scene::Material material;
      // The scene's own map must show the constant too: an unlit sphere of that radiance.
      material.unlit = true;
      material.baseColor = radiance;
      material.specularLevel = 1.0f;
      material.roughness = roughness;
      builder.scene().materials.push_back(material);
      builder.add(scene::makeSphere(1.0f, 48, 24, scene::UvMode::Unit), 0);
      Rig rig(builder.scene(), options);
      const FrameOutput output = rig.render(cameraAt(Vec3(0, 0, 4), Vec3(0)));
      std::uint64_t reflective = 0;
      float worst = 0;
      for (const Rig::Sample& sample : rig.samples()) {
        if (sample.object == 0) {
          EXPECT_EQ(sample.mask, 0);
          continue;
        }
        ++reflective;
        worst = std::max(worst, glm::length((sample.radiance - radiance) / radiance));
        // Normals are bent along the outline
        EXPECT_EQ(sample.mask & ~raster::kMaskBelowHorizon, raster::kMaskEnvironment);
      }
      EXPECT_GT(reflective, 1000u);
      // Filtering equal texels rounds.
      EXPECT_LT(worst, 1e-6f);
      EXPECT_EQ(output.counters.at("environment"), reflective);
    }
  }
}

// A room whose six walls shine in six colours, with a mirror sphere and a small plane mirror.
constexpr float kWallDistance = 2.0f;
constexpr float kSphereRadius = 0.4f;
const Vec3 kSphereCentre(0.0f, -0.6f, -0.7f);
const Vec3 kSphereColor(0.25f, 0.5f, 0.125f);

scene::Scene sixColours() {
  test::SceneBuilder builder;
  addRoom(builder, kWallDistance);
  const int mirror = unlit(builder, kSphereColor);
  builder.scene().materials.back().specularLevel = 0.8f;
  builder.add(scene::makeIcosphere(kSphereRadius, 5, scene::UvMode::Unit), mirror,
              test::translation(kSphereCentre));
  return builder.scene();
}

// What is seen from the origin, in closed form; nothing near an edge, `margin` as a tangent.
std::optional<Vec3> seenFromOrigin(const Vec3& direction, float margin) {
  // The sphere's silhouette is a cone around its centre.
  const float distance = glm::length(kSphereCentre);
  const float angle = std::acos(glm::dot(direction, kSphereCentre) / distance);
  const float silhouette = std::asin(kSphereRadius / distance);
  if (angle < silhouette - margin) return kSphereColor;
  if (angle < silhouette + margin) return std::nullopt;
  // The wall is the axis of the largest component.
  const Vec3 a = glm::abs(direction);
  const int axis = a.x > a.y ? (a.x > a.z ? 0 : 2) : (a.y > a.z ? 1 : 2);
  for (int other = 0; other < 3; ++other) {
    if (other != axis && a[other] > (1.0f - margin) * a[axis]) return std::nullopt;
  }
  return wallColor(2 * axis + (direction[axis] < 0 ? 1 : 0));
}

TEST(EnvironmentMap, ShowsTheWallInTheReflectedDirection) {
  constexpr int kFaceSize = 128;
  Rig rig(sixColours(), R"({"center": [0, 0, 0], "face_size": 128})");
  std::array<int, 7> seen{};
  const Vec3 eyes[] = {
      {0.0f, 1.2f, -0.7f}, {1.6f, -0.3f, -0.9f}, {-0.4f, -0.8f, 1.0f}, {-1.4f, -1.2f, -1.3f}};
  for (const Vec3& eye : eyes) {
    rig.render(scene::lookAt(eye, kSphereCentre, eye.x == 0.0f ? Vec3(0, 0, -1) : Vec3(0, 1, 0),
                             radians(50.0f)));
    int checked = 0;
    for (const Rig::Sample& sample : rig.samples()) {
      if (sample.object != 7) continue;
      // A texel and its neighbour in the filter, as a tangent.
      const std::optional<Vec3> expected =
          seenFromOrigin(sample.reflected, 2.0f * 2.0f / kFaceSize);
      if (!expected) continue;
      ++checked;
      ASSERT_LT(glm::length(sample.radiance - *expected), 1e-3f)
          << "reflected direction " << sample.reflected.x << " " << sample.reflected.y << " "
          << sample.reflected.z;
      for (int face = 0; face < 6; ++face) {
        if (*expected == wallColor(face)) ++seen[static_cast<std::size_t>(face)];
      }
      if (*expected == kSphereColor) ++seen[6];
    }
    EXPECT_GT(checked, 500);
  }
  for (const int count : seen) EXPECT_GT(count, 20);
}

// In a room that is a box, a proxy of that box is exact wherever the map shows walls.
TEST(EnvironmentMap, ProxyOfABoxShowsTheWallThatTheRayHits) {
  constexpr int kFaceSize = 256;
  Rig rig(sixColours(), R"({"center": [0, 0, 0], "face_size": 256, "proxy": "box"})");
  Rig plain(sixColours(), R"({"center": [0, 0, 0], "face_size": 256})");
  const scene::Camera camera = cameraAt({1.6f, -0.3f, -0.9f}, kSphereCentre);
  rig.render(camera);
  plain.render(camera);
  const std::vector<Rig::Sample> samples = rig.samples();
  const std::vector<Rig::Sample> without = plain.samples();
  int checked = 0;
  int wrong = 0;  // without a proxy
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const Rig::Sample& sample = samples[i];
    if (sample.object != 7) continue;
    // Where the ray leaves the room, as seen from the map's centre
    float metres = 1e30f;
    for (int axis = 0; axis < 3; ++axis) {
      const float wall = std::copysign(kWallDistance, sample.reflected[axis]);
      metres = std::min(metres, (wall - sample.place[axis]) / sample.reflected[axis]);
    }
    const Vec3 hit = sample.place + metres * sample.reflected;
    const std::optional<Vec3> expected =
        seenFromOrigin(glm::normalize(hit), 2.0f * 2.0f / kFaceSize);
    if (!expected || *expected == kSphereColor) continue;
    ++checked;
    ASSERT_LT(glm::length(sample.radiance - *expected), 1e-3f);
    wrong += glm::length(without[i].radiance - *expected) > 1e-3f ? 1 : 0;
  }
  EXPECT_GT(checked, 400);
  EXPECT_GT(wrong, checked / 10);
}

// In a room that is a ball, so is a proxy of a sphere. Its colour is its place.
TEST(EnvironmentMap, ProxyOfASphereShowsThePlaceThatTheRayHits) {
  constexpr float kRadius = 2.0f;
  test::SceneBuilder builder;
  scene::Mesh room = scene::makeIcosphere(kRadius, 6, scene::UvMode::Unit);
  // Seen from within: a closed ball would be left out of the map
  for (Vec3& normal : room.normals) normal = -normal;
  for (std::size_t i = 0; i < room.indices.size(); i += 3)
    std::swap(room.indices[i], room.indices[i + 1]);
  room.colors.clear();
  for (const Vec3& position : room.positions) room.colors.push_back(0.5f + 0.25f * position);
  scene::Material unlit;
  unlit.unlit = true;
  unlit.baseColor = Vec3(1.0f);
  builder.scene().materials.push_back(unlit);
  builder.add(std::move(room), 0);
  builder.add(scene::makeIcosphere(0.3f, 5, scene::UvMode::Unit), builder.reflective(1.0f),
              test::translation({0.9f, 0.2f, -0.4f}));
  Rig rig(builder.scene(), R"({"center": [0, 0, 0], "face_size": 256, "proxy": "sphere"})");
  rig.render(cameraAt({-0.3f, 0.5f, 1.0f}, {0.9f, 0.2f, -0.4f}));
  int checked = 0;
  for (const Rig::Sample& sample : rig.samples()) {
    if (sample.object != 2) continue;
    const float b = glm::dot(sample.place, sample.reflected);
    const float metres =
        -b + std::sqrt(b * b + kRadius * kRadius - glm::dot(sample.place, sample.place));
    const Vec3 hit = sample.place + metres * sample.reflected;
    // The mirror hides a part of the room from the map
    if (glm::dot(glm::normalize(hit), glm::normalize(Vec3(0.9f, 0.2f, -0.4f))) > 0.9f) continue;
    ++checked;
    EXPECT_LT(glm::length(sample.radiance - (0.5f + 0.25f * hit)), 0.01f);
  }
  EXPECT_GT(checked, 400);
}

TEST(EnvironmentMap, FollowsAMovingSceneAndOnlyThat) {
  test::SceneBuilder builder;
  builder.constantEnvironment(Vec3(0.25f));
  builder.add(scene::makeIcosphere(0.5f, 4, scene::UvMode::Unit), builder.reflective(1.0f));
  scene::Material bright;
  bright.unlit = true;
  bright.baseColor = Vec3(4.0f);
  builder.scene().materials.push_back(bright);
  // A bright box above at first, below in the end.
  scene::BoxShape box;
  const int moving =
      builder.add(scene::makeBox(box, scene::UvMode::Unit), 1, test::translation(Vec3(0, 3, 1)));
  builder.move(moving, Vec3(0, -6, 0), 1.0f);
  Rig rig(builder.scene(), R"({"center": [0, 0, 1], "face_size": 32})");
  EXPECT_EQ(rig.timesRun("cube_map"), 0);
  const scene::Camera camera = cameraAt(Vec3(0, 0, 3), Vec3(0));
  const auto brightest = [&] {
    Rig::Sample best;
    for (const Rig::Sample& sample : rig.samples()) {
      if (sample.object == 1 && sample.radiance.x > best.radiance.x) best = sample;
    }
    return best;
  };
  rig.render(camera);
  EXPECT_GT(brightest().reflected.y, 0.8f);
  EXPECT_EQ(rig.timesRun("cube_map"), 1);
  // Nothing moved: drawn no second time.
  rig.render(camera);
  EXPECT_EQ(rig.timesRun("cube_map"), 1);
  rig.render(camera, rig.stage.moveTo(1.0));
  EXPECT_LT(brightest().reflected.y, -0.8f);
  EXPECT_EQ(rig.timesRun("cube_map"), 2);
  EXPECT_EQ(rig.timesRun("resolve"), 3);
}

TEST(EnvironmentMap, FollowsALightThatMovesAlone) {
  test::SceneBuilder builder;
  builder.add(scene::makeIcosphere(0.5f, 4, scene::UvMode::Unit), builder.reflective(1.0f));
  scene::BoxShape box;
  box.size = Vec3(4.0f);
  box.inward = true;
  builder.add(scene::makeBox(box, scene::UvMode::Unit), builder.diffuse(Vec3(0.5f)));
  // The light goes from above to below; its node is no object's.
  scene::Scene& scene = builder.scene();
  scene::Light& light = scene.lights.emplace_back();
  light.node = static_cast<int>(scene.nodes.size());
  scene.nodes.emplace_back();
  scene::AnimationChannel& channel = scene.animation.emplace_back();
  channel.node = light.node;
  channel.times = {0.0f, 1.0f};
  channel.values = {0.0f, 1.5f, 0.0f, 0.0f, -1.5f, 0.0f};
  Rig rig(scene, R"({"face_size": 16})");
  const scene::Camera camera = cameraAt(Vec3(0, 0, 1.8f), Vec3(0));
  const auto brightness = [&](float side) {
    float sum = 0.0f;
    for (const Rig::Sample& sample : rig.samples())
      if (sample.object == 1 && side * sample.reflected.y > 0.0f) sum += sample.radiance.x;
    return sum;
  };
  rig.render(camera);
  EXPECT_GT(brightness(1.0f), 2.0f * brightness(-1.0f));
  const std::vector<int> changed = rig.stage.moveTo(1.0);
  EXPECT_TRUE(changed.empty());
  rig.render(camera, changed);
  EXPECT_GT(brightness(-1.0f), 2.0f * brightness(1.0f));
  rig.render(camera);
  EXPECT_EQ(rig.timesRun("cube_map"), 2);
}

TEST(EnvironmentMap, AStaticSceneIsDrawnOnceBeforeTheFirstFrame) {
  Rig rig(sixColours(), R"({"face_size": 16})", false);
  EXPECT_EQ(rig.timesRun("cube_map"), 1);
  const scene::Camera camera = cameraAt(Vec3(0, 0, 1), kSphereCentre);
  rig.render(camera);
  rig.render(camera);
  EXPECT_EQ(rig.timesRun("cube_map"), 1);
  for (const frame::StepSample& sample : rig.stage.timer.samples()) {
    if (sample.step == "cube_map") {
      EXPECT_EQ(sample.frame, 0);
    }
  }
}

// From within an object nothing else would be seen: a moving ball about the map's centre.
TEST(EnvironmentMap, LeavesOutWhatEnclosesItsCentre) {
  const Vec3 sky(0.25f, 0.5f, 1.0f);
  test::SceneBuilder builder;
  builder.constantEnvironment(sky);
  builder.add(scene::makePlane(Vec2(4), glm::ivec2(1), scene::UvMode::Unit),
              builder.reflective(1.0f), test::translation({0.0f, -0.5f, 0.0f}));
  const int ball = builder.add(scene::makeIcosphere(0.5f, 4, scene::UvMode::Unit),
                               builder.diffuse(Vec3(0.5f), Vec3(4.0f)));
  builder.move(ball, Vec3(0.0f, 0.1f, 0.0f), 1.0f);
  Rig rig(builder.scene(), R"({"face_size": 16})");
  rig.render(cameraAt(Vec3(0, 1, 3), Vec3(0, -0.5f, 0)));
  int checked = 0;
  for (const Rig::Sample& sample : rig.samples()) {
    if (sample.object != 1) continue;
    ++checked;
    ASSERT_LT(glm::length(sample.radiance - sky), 1e-3f);
  }
  EXPECT_GT(checked, 1000);
}

TEST(EnvironmentMap, GradientIsLookedUpByDirection) {
  test::SceneBuilder builder;
  gradientEnvironment(builder.scene());
  builder.add(scene::makeIcosphere(1.0f, 5, scene::UvMode::Unit), builder.reflective(1.0f));
  Rig rig(builder.scene(), R"({"source": "environment", "face_size": 256})");
  rig.render(cameraAt(Vec3(0, 0.5f, 4), Vec3(0)));
  float largest = 0;
  for (const Rig::Sample& sample : rig.samples()) {
    if (sample.object == 0) continue;
    const Vec3 difference =
        sample.radiance - rig.stage.moment.lighting.environment->radiance(sample.reflected);
    largest = std::max(largest, glm::length(difference));
  }
  // Half a texel of 256 at the horizon's kink: gradient about 2 per unit of y.
  EXPECT_LT(largest, 0.01f);
}

// Mean of the environment over the Phong lobe cos^n around an axis, by quadrature.
Vec3 lobeMean(const frame::EnvironmentLight& environment, const Vec3& axis, float n) {
  const Vec3 helper = std::abs(axis.y) < 0.9f ? Vec3(0, 1, 0) : Vec3(1, 0, 0);
  const Vec3 t = glm::normalize(glm::cross(helper, axis));
  const Vec3 b = glm::cross(axis, t);
  constexpr int kRings = 64;
  constexpr int kSpokes = 64;
  Vec3 sum(0.0f);
  for (int i = 0; i < kRings; ++i) {
    // Equal shares of the lobe: cos = u^(1 / (n + 1)).
    const float u = (static_cast<float>(i) + 0.5f) / kRings;
    const float cosine = std::pow(u, 1.0f / (n + 1.0f));
    const float sine = std::sqrt(std::max(0.0f, 1.0f - cosine * cosine));
    for (int k = 0; k < kSpokes; ++k) {
      const float phi = 2.0f * kPi * (static_cast<float>(k) + 0.5f) / kSpokes;
      sum += environment.radiance(cosine * axis + sine * (std::cos(phi) * t + std::sin(phi) * b));
    }
  }
  return sum / static_cast<float>(kRings * kSpokes);
}

TEST(EnvironmentMap, GlossyLookUpIsNearTheLobesMean) {
  for (const float roughness : {0.2f, 0.4f, 0.6f, 0.8f}) {
    SCOPED_TRACE(roughness);
    test::SceneBuilder builder;
    gradientEnvironment(builder.scene());
    builder.add(scene::makeIcosphere(1.0f, 5, scene::UvMode::Unit),
                builder.reflective(1.0f, roughness));
    Rig rig(builder.scene(), R"({"source": "environment", "face_size": 128})");
    rig.render(cameraAt(Vec3(0, 0.5f, 4), Vec3(0)));
    const float n = scene::phongExponentFromRoughness(roughness);
    double ours = 0;
    double unfiltered = 0;
    int count = 0;
    const std::vector<Rig::Sample> samples = rig.samples();
    for (std::size_t i = 0; i < samples.size(); i += 13) {
      const Rig::Sample& sample = samples[i];
      if (sample.object == 0) continue;
      const Vec3 truth = lobeMean(*rig.stage.moment.lighting.environment, sample.reflected, n);
      ours += glm::length(sample.radiance - truth);
      unfiltered +=
          glm::length(rig.stage.moment.lighting.environment->radiance(sample.reflected) - truth);
      ++count;
    }
    ours /= count;
    unfiltered /= count;
    // Where the environment bends within the lobe, filtering must help.
    EXPECT_LT(ours, 0.06);
    if (roughness >= 0.4f) {
      EXPECT_LT(ours, 0.85 * unfiltered);
    }
  }
}

TEST(EnvironmentMap, LeavesASceneWithoutReflectorsAlone) {
  test::SceneBuilder builder;
  builder.add(scene::makeIcosphere(1.0f, 3, scene::UvMode::Unit), builder.diffuse(Vec3(0.5f)));
  Rig rig(builder.scene(), "{}");
  const FrameOutput output = rig.render(cameraAt(Vec3(0, 0, 4), Vec3(0)));
  EXPECT_EQ(output.counters.at("environment"), 0u);
  EXPECT_EQ(rig.timesRun("cube_map"), 0);
  EXPECT_EQ(rig.timesRun("resolve"), 0);
  for (const Rig::Sample& sample : rig.samples()) EXPECT_EQ(sample.mask, 0);
}

}  // namespace
}  // namespace catoptric::methods
