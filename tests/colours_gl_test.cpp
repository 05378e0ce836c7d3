// Scenes whose colours are known on paper, by every method: reflections of surroundings of radiance
// 1 everywhere show what the surface makes of light.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <vector>

#include "furnace_plane.h"

namespace catoptric {
namespace {

using namespace furnace;
using test::rotation;

constexpr float kTolerance = 2e-4f;

/// A texture without filtering: texels in rows. Linear: llvmpipe decodes sRGB to 1e-3 only.
int addTexture(scene::Scene& scene, int width, const std::vector<glm::u8vec4>& texels) {
  scene::Texture texture;
  texture.srgb = false;
  texture.nearest = true;
  scene::MipLevel level{width, static_cast<int>(texels.size()) / width, {}};
  for (const glm::u8vec4& texel : texels) {
    for (int c = 0; c < 4; ++c) level.rgba.push_back(texel[c]);
  }
  texture.levels.push_back(std::move(level));
  scene.textures.push_back(std::move(texture));
  return static_cast<int>(scene.textures.size()) - 1;
}

constexpr std::array<glm::u8vec4, 4> kPaints = {
    {{250, 200, 40, 255}, {60, 120, 240, 255}, {200, 80, 60, 255}, {30, 210, 110, 255}}};

Vec3 linearOf(const glm::u8vec4& texel) {
  return Vec3(texel) / 255.0f;
}

/// glTF's material: what a reader of the specification expects in surroundings of radiance 1.
Vec3 inFurnace(const Vec3& albedo, float metallic, bool gltf = false) {
  const float s = metallic + (1.0f - metallic) * 0.04f;
  // Below the threshold Phong lobes are left out
  if (s < 0.05f && !gltf) return albedo;
  return (1.0f - s) * albedo + glm::mix(Vec3(0.04f), albedo, metallic);
}

/// Of 2 x 2 texels, as the plane shows them.
const glm::u8vec4& paintAt(const Vec2& place) {
  return kPaints[(place.x > 0.0f ? 1u : 0u) + (place.y < 0.0f ? 2u : 0u)];
}

TEST(Colours, TexturedMetalReflectsByItsTexels) {
  scene::Material m = metal();
  m.baseColor = Vec3(0.9f, 0.8f, 0.7f);
  SceneBuilder builder = furnacePlane(m, plane());
  scene::Scene& scene = builder.scene();
  scene.materials[0].baseColorTexture.texture =
      addTexture(scene, 2, {kPaints.begin(), kPaints.end()});
  scene::finishScene(scene);
  EXPECT_TRUE(scene.materials[0].tintVaries());
  expectOnPlane(scene, 2, kTolerance, [](const Vec2& place) {
    return Vec3(0.9f, 0.8f, 0.7f) * linearOf(paintAt(place));
  });
}

TEST(Colours, DielectricTexelsOfAMixedMaterialAreNotTinted) {
  scene::Material m = metal();
  SceneBuilder builder = furnacePlane(m, plane());
  scene::Scene& scene = builder.scene();
  scene.materials[0].baseColorTexture.texture =
      addTexture(scene, 2, {kPaints.begin(), kPaints.end()});
  // Blue is metallic: a metal, a dielectric, and what is between
  const std::array<std::uint8_t, 4> metallic = {255, 0, 128, 13};
  std::vector<glm::u8vec4> texels;
  for (const std::uint8_t b : metallic) texels.emplace_back(0, 0, b, 255);
  scene.materials[0].metallicRoughnessTexture.texture = addTexture(scene, 2, texels);
  for (const bool gltf : {false, true}) {
    scene.materials[0].lobe = gltf ? scene::LobeModel::Ggx : scene::LobeModel::Phong;
    scene::finishScene(scene);
    expectOnPlane(scene, 2, kTolerance, [&](const Vec2& place) {
      const auto i = static_cast<std::size_t>(&paintAt(place) - kPaints.data());
      return inFurnace(linearOf(kPaints[i]), static_cast<float>(metallic[i]) / 255.0f, gltf);
    });
  }
}

scene::Material dielectric(const Vec3& albedo, float roughness) {
  scene::Material m;
  m.baseColor = albedo;
  m.roughnessFactor = roughness;
  m.lobe = scene::LobeModel::Ggx;
  return m;
}

/// A plane of glTF's material whose metallic factor is multiplied by `texel` / 255.
scene::Scene largePlane(scene::Material m, std::uint8_t texel = 255) {
  scene::setMetallicTint(m);
  SceneBuilder builder =
      furnacePlane(m, scene::makePlane({4.0f, 4.0f}, {1, 1}, scene::UvMode::Unit));
  scene::Scene& scene = builder.scene();
  if (texel < 255)
    scene.materials[0].metallicRoughnessTexture.texture =
        addTexture(scene, 1, {{0, 255, texel, 255}});
  scene::letDielectricsReflect(scene);
  scene::finishScene(scene);
  return scene;
}

/// A pixel of that plane.
struct SideView {
  double cosine;  ///< of the view to the plane's normal
  Vec3 radiance;
};

/// That plane from the side, by every method.
void fromTheSide(const scene::Scene& scene,
                 const std::function<void(const std::vector<SideView>&)>& check) {
  const scene::Camera camera =
      scene::lookAt({2.0f, 0.0f, 0.9f}, {0.3f, 0.0f, 0.0f}, {0.0f, 0.0f, 1.0f}, 1.5f);
  const Mat3 rayFromPixel = scene::rayFromPixel(camera, kSize, kSize);
  byEveryMethod(scene, camera, 1, [&](const methods::MethodEntry&, const Frame& frame) {
    std::vector<SideView> seen;
    for (int y = 0; y < kSize; ++y)
      for (int x = 0; x < kSize; ++x) {
        if (frame.pixels[4 * static_cast<std::size_t>(y * kSize + x) + 3] < 1.0f) continue;
        const Vec3 ray = rayFromPixel * Vec3(Vec2(x, y) + 0.5f, 1.0f);
        seen.push_back({-glm::normalize(ray).z, frame.at(x, y)});
      }
    EXPECT_GT(seen.size(), 1000u);
    check(seen);
  });
}

TEST(Colours, PolishedDielectricReflectsByFresnelsEquations) {
  fromTheSide(largePlane(dielectric(Vec3(0.0f), 0.0f)), [](const std::vector<SideView>& seen) {
    double offSchlick = 0.0;
    double offFresnel = 0.0;
    for (const auto& [cosine, radiance] : seen) {
      const double schlick = 0.04 + 0.96 * std::pow(1.0 - cosine, 5.0);
      offSchlick = std::max(offSchlick, std::abs(radiance.x - schlick));
      const double inside = std::sqrt(1.0 - (1.0 - cosine * cosine) / (1.5 * 1.5));
      const double s = (cosine - 1.5 * inside) / (cosine + 1.5 * inside);
      const double p = (1.5 * cosine - inside) / (1.5 * cosine + inside);
      offFresnel = std::max(offFresnel, std::abs(radiance.x - 0.5 * (s * s + p * p)));
    }
    EXPECT_LT(offSchlick, 1e-3);
    EXPECT_LT(offFresnel, 0.026);  // the error of Schlick's formula, without polarization
    EXPECT_LT(std::ranges::min(seen, {}, &SideView::cosine).cosine, 0.3);
    EXPECT_GT(std::ranges::max(seen, {}, &SideView::cosine).cosine, 0.85);
  });
}

/// What glTF's extensions say of a polished surface in surroundings of radiance 1.
struct Layers {
  float ior;
  float factor;  ///< specularFactor, or clearcoatFactor
  Vec3 color;    ///< specularColorFactor
  float metallic = 0.0f;
  std::uint8_t texel = 255;

  Vec3 radiance(const Vec3& albedo, float cosine) const {
    const float p = std::pow(1.0f - cosine, 5.0f);
    const float r = (ior - 1.0f) / (ior + 1.0f);
    const Vec3 f0 = glm::min(r * r * color, Vec3(1.0f));
    const Vec3 f = f0 + (1.0f - f0) * p;
    const Vec3 layered = (1.0f - factor * std::max({f.x, f.y, f.z})) * albedo + factor * f;
    const Vec3 metal = albedo + (1.0f - albedo) * p;
    return glm::mix(layered, metal, metallic * static_cast<float>(texel) / 255.0f);
  }
};

TEST(Colours, IorAndSpecularFactorsScaleTheReflectionUpToTheRim) {
  const Vec3 white(1.0f);
  for (const Layers& layers :
       std::vector<Layers>{{1.9f, 1.0f, white},
                           {1.5f, 0.6f, white},                      // the rim, too: a thin coat
                           {1.8f, 0.7f, {1.0f, 0.5f, 0.2f}},         // coloured
                           {2.5f, 0.8f, {9.0f, 1.0f, 0.2f}},         // F0 is at most 1
                           {0.0f, 0.9f, {0.6f, 0.3f, 0.1f}},         // ior 0: F0 is the colour
                           {1.5f, 0.4f, {1.0f, 0.6f, 0.2f}, 0.35f},  // partly metallic
                           {1.5f, 0.4f, {1.0f, 0.6f, 0.2f}, 0.7f, 100}}) {  // by a texture
    const Vec3 albedo(0.7f, 0.2f, 0.4f);
    scene::Material m = dielectric(albedo, 0.0f);
    m.metallicFactor = layers.metallic;
    m.dielectricF90 = layers.factor;
    m.dielectricF0 = scene::dielectricF0(layers.ior, layers.factor, layers.color);
    SCOPED_TRACE(layers.ior);
    fromTheSide(largePlane(m, layers.texel), [&](const std::vector<SideView>& seen) {
      float off = 0.0f;
      for (const auto& [cosine, radiance] : seen) {
        const Vec3 difference =
            glm::abs(radiance - layers.radiance(albedo, static_cast<float>(cosine)));
        off = std::max({off, difference.x, difference.y, difference.z});
      }
      EXPECT_LT(off, 1e-3f);
    });
  }
}

TEST(Colours, DielectricsGainNoLight) {
  for (const float roughness : {0.0f, 0.2f, 0.35f, 1.0f}) {
    SCOPED_TRACE(roughness);
    const scene::Scene white = largePlane(dielectric(Vec3(1.0f), roughness));
    fromTheSide(white, [&](const std::vector<SideView>& seen) {
      double sum = 0.0;
      for (const SideView& pixel : seen) {
        EXPECT_LE(pixel.radiance.x, 1.0f + 1e-3f);
        sum += pixel.radiance.x;
      }
      // A white one loses what scatters twice between the bumps of its surface
      EXPECT_GE(sum / static_cast<double>(seen.size()), roughness > 0.35f ? 0.9 : 0.99);
    });
  }
}

TEST(Colours, VertexColoursTintMetals) {
  scene::Mesh mesh = plane();
  for (const Vec3& p : mesh.positions) mesh.colors.emplace_back(0.5f + 0.5f * p.x, 0.3f, 0.6f);
  SceneBuilder builder = furnacePlane(metal(), mesh);
  scene::finishScene(builder.scene());
  expectOnPlane(builder.scene(), 0, kTolerance,
                [](const Vec2& place) { return Vec3(0.5f + 0.5f * place.x, 0.3f, 0.6f); });
}

TEST(Colours, PartlyMetallicSurfaceHasOneTint) {
  scene::Material m;
  m.baseColor = Vec3(0.9f, 0.5f, 0.1f);
  m.metallicFactor = 0.6f;
  m.roughnessFactor = 0.0f;
  scene::setMetallicTint(m);
  SceneBuilder builder = furnacePlane(m, plane());
  scene::finishScene(builder.scene());
  EXPECT_FALSE(builder.scene().materials[0].tintVaries());
  expectOnPlane(builder.scene(), 0, kTolerance,
                [&](const Vec2&) { return inFurnace(Vec3(0.9f, 0.5f, 0.1f), 0.6f); });
}

TEST(Colours, GivenSpecularLevelKeepsTheTextureOfAMetal) {
  scene::Material m = metal();
  scene::setReflectance(m, 0.5f, 0.0f);
  SceneBuilder builder = furnacePlane(m, plane());
  scene::Scene& scene = builder.scene();
  scene.materials[0].baseColorTexture.texture =
      addTexture(scene, 2, {kPaints.begin(), kPaints.end()});
  scene::finishScene(scene);
  // Half of it is diffuse
  expectOnPlane(scene, 2, kTolerance, [](const Vec2& place) { return linearOf(paintAt(place)); });
}

TEST(Colours, MetalsInMetalsMultiply) {
  // The plane shows what is behind the eye: another such plane, 6 m wide, and it alone
  scene::Material m = metal();
  SceneBuilder builder = furnacePlane(m, plane());
  scene::Scene& scene = builder.scene();
  scene.materials[0].baseColorTexture.texture =
      addTexture(scene, 2, {kPaints.begin(), kPaints.end()});
  const std::vector<glm::u8vec4> behind = {{240, 180, 120, 255}, {90, 160, 220, 255}};
  m.baseColorTexture.texture = addTexture(scene, 1, behind);
  scene.materials.push_back(m);
  builder.add(scene::makePlane({6.0f, 6.0f}, {1, 1}, scene::UvMode::Unit), 1,
              test::translation({0.0f, 0.0f, 3.0f}) * rotation(-90.0f, {1.0f, 0.0f, 0.0f}));
  scene::finishScene(scene);
  expectOnPlane(
      scene, 8, kTolerance,
      [&](const Vec2& place) {
        // 2 m to the plane and 3 m back
        const Vec3 seen = linearOf(paintAt(place)) * linearOf(behind[place.y > 0.0f ? 1 : 0]);
        // The first one again, 3 m on, where the path ends with its diffuse light
        const bool again = std::max(std::abs(place.x), std::abs(place.y)) < 0.25f;
        return again ? seen * linearOf(paintAt(place)) : seen;
      },
      2);
}

// ---- Mirrored rays below the surface ----

/// A reflector whose own diffuse light is none: rays that meet it itself are dark.
scene::Material darkMirror(float s, float g = 0.0f) {
  scene::Material m;
  m.baseColor = Vec3(0.0f);
  scene::setReflectance(m, s, g);
  return m;
}

/// Every pixel that shows an object is `level`, and bent normals are counted and marked.
void expectEvenAndCounted(const scene::Scene& scene, const scene::Camera& camera, float level) {
  byEveryMethod(scene, camera, 1, [&](const methods::MethodEntry&, const Frame& frame) {
    int shown = 0;
    int wrong = 0;
    for (std::size_t i = 0; i < frame.pixels.size(); i += 4) {
      if (frame.pixels[i + 3] < 1.0f) continue;
      ++shown;
      wrong += std::abs(frame.pixels[i] - level) > 1e-3f ? 1 : 0;
    }
    EXPECT_GT(shown, 800);
    EXPECT_EQ(wrong, 0);
    const auto bent = frame.counters.find("below_horizon");
    if (bent == frame.counters.end()) return;  // methods of impostors do not count them
    EXPECT_GT(bent->second, 20u);
    const scene::Material& material = scene.materials[0];
    if (material.roughness > scene::kMirrorPhongRoughness) return;  // rays are counted, not samples
    if (frame.masks.empty()) return;
    const auto marked = std::ranges::count_if(
        frame.masks, [](std::uint16_t mask) { return (mask & raster::kMaskBelowHorizon) != 0; });
    EXPECT_EQ(static_cast<std::uint64_t>(marked), bent->second);
  });
}

TEST(Colours, FewTrianglesWithSmoothNormalsAreWhiteInAWhiteFurnace) {
  SceneBuilder builder;
  builder.constantEnvironment(Vec3(1.0f));
  builder.scene().materials.push_back(darkMirror(1.0f));
  builder.add(scene::makeIcosphere(1.0f, 1, scene::UvMode::Unit), 0);
  scene::finishScene(builder.scene());
  expectEvenAndCounted(builder.scene(),
                       scene::lookAt({0.3f, 0.5f, 3.0f}, {}, {0.0f, 1.0f, 0.0f}, 0.8f), 1.0f);
}

TEST(Colours, RoughMeshOfFewTrianglesIsWhiteInAWhiteFurnace) {
  for (const float g : {0.2f, 0.6f, 1.0f}) {
    SceneBuilder builder;
    builder.constantEnvironment(Vec3(1.0f));
    builder.scene().materials.push_back(darkMirror(1.0f, g));
    builder.add(scene::makeIcosphere(1.0f, 1, scene::UvMode::Unit), 0);
    scene::finishScene(builder.scene());
    SCOPED_TRACE(g);
    expectEvenAndCounted(builder.scene(),
                         scene::lookAt({0.3f, 0.5f, 3.0f}, {}, {0.0f, 1.0f, 0.0f}, 0.8f), 1.0f);
  }
}

/// A floor of a normal map's six texels.
scene::Scene mappedFloor(float g) {
  SceneBuilder builder;
  builder.constantEnvironment(Vec3(1.0f));
  scene::Scene& scene = builder.scene();
  scene.materials.push_back(darkMirror(0.7f, g));
  scene.materials[0].normalTexture.texture = addTexture(scene, 3,
                                                        {{128, 128, 255, 255},
                                                         {230, 128, 200, 255},
                                                         {20, 128, 200, 255},
                                                         {128, 235, 190, 255},
                                                         {128, 30, 190, 255},
                                                         {190, 190, 218, 255}});
  builder.add(scene::makePlane({40.0f, 40.0f}, {1, 1}, scene::UvMode::Metres), 0);
  scene::finishScene(scene);
  return scene;
}

TEST(Colours, NormalMappedFloorReflectsByItsLevelAlone) {
  for (const float g : {0.0f, 0.4f}) {
    SCOPED_TRACE(g);
    expectEvenAndCounted(mappedFloor(g),
                         scene::lookAt({0.0f, 1.0f, 4.0f}, {}, {0.0f, 1.0f, 0.0f}, 0.8f), 0.7f);
  }
}

TEST(Colours, BentNormalsAreTheSameInGlAndEmbree) {
  SceneBuilder builder;
  scene::Scene& scene = builder.scene();
  scene.environment.type = scene::EnvironmentType::Gradient;
  scene.environment.color = Vec3(0.2f, 0.4f, 0.9f);
  scene.environment.horizon = Vec3(0.8f);
  scene.environment.ground = Vec3(0.3f, 0.2f, 0.1f);
  scene.materials.push_back(darkMirror(1.0f));
  builder.add(scene::makeIcosphere(1.0f, 1, scene::UvMode::Unit), 0);
  scene::finishScene(scene);
  const scene::Camera camera = scene::lookAt({0.3f, 0.5f, 3.0f}, {}, {0.0f, 1.0f, 0.0f}, 0.8f);
  const methods::MethodEntry& reference = test::methodNamed("reference");
  const image::Image truth =
      test::renderOnCpu(reference, R"({"max_standard_error": 0, "samples": 1})",
                        test::Moment(scene), camera, kSettings)
          .image.value();
  test::GlStage stage(scene, kSettings);
  test::GlMethod(stage, test::methodNamed("traced")).render(camera);
  const std::vector<float> pixels = stage.composite(camera);
  int different = 0;
  for (int y = 0; y < kSize; ++y) {
    for (int x = 0; x < kSize; ++x) {
      const float* p = &pixels[4 * static_cast<std::size_t>(y * kSize + x)];
      float worst = 0.0f;
      for (int c = 0; c < 4; ++c) worst = std::max(worst, std::abs(p[c] - truth.at(x, y, c)));
      different += worst > 2e-3f ? 1 : 0;
    }
  }
  EXPECT_LE(different, 2);  // on the silhouette
}

}  // namespace
}  // namespace catoptric
