// Highlights of lamps on rough surfaces, by every method, against the lobes' closed forms and rays.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "furnace_plane.h"

namespace catoptric {
namespace {

using namespace furnace;

scene::Light lampAt(const Vec3& position, float intensity) {
  scene::Light light;
  light.position = position;
  light.intensity = Vec3(intensity);
  return light;
}

/// A plane of rough metal under a lamp in the dark.
scene::Scene lampOnMetal(float roughness) {
  scene::Material m = metal();
  m.baseColor = Vec3(0.9f, 0.6f, 0.3f);
  m.roughnessFactor = roughness;
  SceneBuilder builder = furnacePlane(m, plane());
  builder.constantEnvironment(Vec3(0.0f));
  builder.scene().lights.push_back(lampAt({0.3f, 0.2f, 1.5f}, 2.0f));
  builder.scene().highlights = true;
  scene::finishScene(builder.scene());
  return builder.scene();
}

TEST(Highlights, LampShowsOnRoughMetalByTheLobe) {
  const scene::Scene scene = lampOnMetal(0.4f);
  const double exponent = 2.0 / std::pow(0.4, 4.0) - 2.0;
  expectOnPlane(scene, 0, 5e-3f, [&](const Vec2& place) {
    const glm::dvec3 x(place, 0.0);
    const glm::dvec3 toLamp = glm::dvec3(0.3, 0.2, 1.5) - x;
    const glm::dvec3 incoming = glm::normalize(x - glm::dvec3(0.0, 0.0, 2.0));
    const glm::dvec3 mirror(incoming.x, incoming.y, -incoming.z);
    const glm::dvec3 l = glm::normalize(toLamp);
    const auto lobe = [&](const glm::dvec3& w) {
      return (exponent + 1.0) / (2.0 * std::numbers::pi) *
             std::pow(std::max(0.0, glm::dot(mirror, w)), exponent);
    };
    // What leaves below the plane is folded up
    const double density = lobe(l) + lobe({l.x, l.y, -l.z});
    return Vec3(0.9f, 0.6f, 0.3f) * static_cast<float>(2.0 / glm::dot(toLamp, toLamp) * density);
  });
}

TEST(Highlights, LampShowsOnRoughGltfMetalByGgx) {
  scene::Scene scene = lampOnMetal(0.4f);
  for (scene::Material& m : scene.materials) m.lobe = scene::LobeModel::Ggx;
  scene::finishScene(scene);
  expectOnPlane(scene, 0, 5e-3f, [&](const Vec2& place) {
    const glm::dvec3 x(place, 0.0);
    const glm::dvec3 toLamp = glm::dvec3(0.3, 0.2, 1.5) - x;
    const glm::dvec3 v = glm::normalize(glm::dvec3(0.0, 0.0, 2.0) - x);
    const glm::dvec3 l = glm::normalize(toLamp);
    const glm::dvec3 h = glm::normalize(v + l);
    // glTF 2.0, appendix B: D G2 / (4 n.v n.l) times n.l, Schlick's Fresnel
    const double a2 = std::pow(0.4, 4.0);
    const double spread = h.z * h.z * (a2 - 1.0) + 1.0;
    const double normals = a2 / (std::numbers::pi * spread * spread);
    const double visibility = 0.5 / (l.z * std::sqrt(v.z * v.z * (1.0 - a2) + a2) +
                                     v.z * std::sqrt(l.z * l.z * (1.0 - a2) + a2));
    const glm::dvec3 f0(0.9, 0.6, 0.3);
    const glm::dvec3 fresnel = f0 + (1.0 - f0) * std::pow(1.0 - glm::dot(v, h), 5.0);
    return Vec3(fresnel * (2.0 / glm::dot(toLamp, toLamp) * normals * visibility * l.z));
  });
}

TEST(Highlights, LampsShowOnNoMirrorAndOnlyWhereAskedFor) {
  scene::Scene off = lampOnMetal(0.4f);
  off.highlights = false;
  for (const scene::Scene& scene : {lampOnMetal(0.03f), off})
    expectOnPlane(scene, 0, 0.0f, [](const Vec2&) { return Vec3(0.0f); });
}

class HighlightModels : public testing::TestWithParam<scene::LobeModel> {};
INSTANTIATE_TEST_SUITE_P(Models, HighlightModels,
                         testing::Values(scene::LobeModel::Phong, scene::LobeModel::Ggx));

TEST_P(HighlightModels, AreWhatTheLobeTracesOfASmallLight) {
  // At this angle GGX changes faster from direction to direction: a cap of 1 degree, not of 3
  const bool ggx = GetParam() == scene::LobeModel::Ggx;
  const int rayCount = ggx ? 1 << 21 : 1 << 18;
  const float capCosine = ggx ? 0.99985f : 0.9986f;
  for (const float g : {0.35f, 0.6f, 0.9f, -0.6f}) {
    trace::ReflectionPoint point;
    point.normal = Vec3(0.0f, 0.0f, 1.0f);
    // Of the last one, that of a triangle
    point.lobeHorizon = g > 0.0f ? point.normal : glm::normalize(Vec3(-0.1f, 0.1f, 1.0f));
    point.direction = glm::normalize(Vec3(1.0f, 0.2f, -0.35f));  // half of Phong's lobe is folded
    point.lobe = scene::Lobe::of(GetParam(), std::abs(g));
    frame::WorldLight light;
    light.type = scene::LightType::Directional;
    light.intensity = Vec3(1.0f);
    const Vec3 l = glm::normalize(Vec3(1.0f, 0.1f, 0.25f));
    light.direction = -l;
    float inCap = 0.0f;
    for (int k = 0; k < rayCount; ++k) {
      const trace::LobeRay ray = trace::lobeDirection(point, k, rayCount);
      inCap += glm::dot(ray.direction, l) > capCosine ? ray.weight : 0.0f;
    }
    const float solidAngle = 2.0f * kPi * (1.0f - capCosine);
    const float traced = inCap / (static_cast<float>(rayCount) * solidAngle);
    const Vec3 shown = frame::lightHighlights({light}, Vec3(0.0f), point.normal, point.lobeHorizon,
                                              point.direction, point.lobe);
    EXPECT_NEAR(shown.x / traced, 1.0f, 0.03f) << g;
  }
}

TEST_P(HighlightModels, AreTheSameInGlAndEmbree) {
  SceneBuilder builder;
  scene::Scene& scene = builder.scene();
  builder.constantEnvironment(Vec3(0.0f));
  scene::Material m;
  m.baseColor = Vec3(0.0f);  // of itself it shows nothing to rays of the lobe
  scene::setReflectance(m, 1.0f, 0.45f);
  m.lobe = GetParam();
  scene.materials.push_back(m);
  builder.add(scene::makeIcosphere(1.0f, 2, scene::UvMode::Unit), 0);
  scene.lights.push_back(lampAt({1.5f, 1.0f, 2.0f}, 3.0f));
  scene::Light sun;
  sun.type = scene::LightType::Directional;
  sun.direction = glm::normalize(Vec3(1.0f, -0.5f, -0.4f));
  scene.lights.push_back(sun);
  scene::Light spot = lampAt({-0.5f, 2.5f, 2.0f}, 8.0f);
  spot.type = scene::LightType::Spot;
  spot.direction = glm::normalize(-spot.position);
  spot.innerConeRad = 0.1f;
  spot.outerConeRad = 0.4f;
  spot.range = 9.0f;
  scene.lights.push_back(spot);
  scene.highlights = true;
  scene::finishScene(scene);
  const scene::Camera camera = scene::lookAt({0.3f, 0.5f, 3.0f}, {}, {0.0f, 1.0f, 0.0f}, 0.8f);
  const image::Image truth =
      test::renderOnCpu(test::methodNamed("reference"),
                        R"({"max_standard_error": 0, "samples": 1, "rays": 1})",
                        test::Moment(scene), camera, kSettings)
          .image.value();
  test::GlStage stage(scene, kSettings);
  test::GlMethod(stage, test::methodNamed("environment_map"), R"({"source": "environment"})")
      .render(camera);
  const std::vector<float> pixels = stage.composite(camera);
  int bright = 0;
  int different = 0;
  for (int y = 0; y < kSize; ++y) {
    for (int x = 0; x < kSize; ++x) {
      const float shown = pixels[4 * static_cast<std::size_t>(y * kSize + x)];
      const float expected = truth.at(x, y, 0);
      bright += expected > 0.05f ? 1 : 0;
      different += std::abs(shown - expected) > 2e-3f + 0.01f * expected ? 1 : 0;
    }
  }
  EXPECT_GT(bright, 300);
  EXPECT_LE(different, bright / 50);
}

}  // namespace
}  // namespace catoptric
