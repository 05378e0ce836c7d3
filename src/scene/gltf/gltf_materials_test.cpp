// What loadGltf makes of materials and textures, against values known on paper.
#include <set>

#include "core/error.h"
#include "image/image.h"
#include "scene/gltf/test_fixture.h"
#include "scene/reflectance.h"

namespace catoptric::scene {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using namespace catoptric::scene::testing;

std::string pngBytes(int width, const std::vector<std::uint8_t>& rgba) {
  const std::vector<std::byte> png = image::encodePng(width, 1, 4, rgba);
  return {reinterpret_cast<const char*>(png.data()), png.size()};
}

TEST_F(Gltf, MetallicRoughnessAndExtensionsGiveSAndG) {
  Material m = materialOf(
      R"({"name":"gold","pbrMetallicRoughness":{"baseColorFactor":[0.8,0.6,0.2,1],"metallicFactor":0.5,"roughnessFactor":0.3}})");
  EXPECT_EQ(m.name, "gold");
  EXPECT_NEAR(m.specularLevel, 0.5f + 0.5f * 0.04f, 1e-6f);
  EXPECT_FLOAT_EQ(m.roughness, 0.3f);
  expectNear(m.baseColor, Vec3(0.8f, 0.6f, 0.2f));
  // glTF's F0 is mix(0.04, base colour, metallic)
  expectNear(m.specularLevel * m.reflectionTint, Vec3(0.42f, 0.32f, 0.12f));

  // A plastic is diffuse: 4% is below the threshold.
  m = materialOf(R"({"pbrMetallicRoughness":{"metallicFactor":0}})");
  EXPECT_EQ(m.specularLevel, 0.0f);

  // ((2 - 1) / (2 + 1))^2 * colour, times the factor, which is F90
  m = materialOf(
      R"({"pbrMetallicRoughness":{"metallicFactor":0},"extensions":{"KHR_materials_ior":{"ior":2},"KHR_materials_specular":{"specularFactor":0.99,"specularColorFactor":[1,0.5,0]}}})");
  expectNear(m.dielectricF0, Vec3(0.11f, 0.055f, 0.0f));
  EXPECT_FLOAT_EQ(m.dielectricF90, 0.99f);
  EXPECT_NEAR(m.specularLevel, 0.11f, 1e-6f);
  expectNear(m.reflectionTint, Vec3(1.0f, 0.5f, 0.0f));
  m = materialOf(
      R"({"pbrMetallicRoughness":{"metallicFactor":0},"extensions":{"KHR_materials_ior":{"ior":9},"KHR_materials_specular":{"specularFactor":0}}})");
  EXPECT_EQ(m.specularLevel, 0.0f);

  m = materialOf(
      R"({"emissiveFactor":[1,0.5,0.25],"extensions":{"KHR_materials_emissive_strength":{"emissiveStrength":8}}})");
  expectNear(m.emissive, Vec3(8, 4, 2));
  EXPECT_EQ(m.specularLevel, 0.0f);  // metallic is 1 by default, but metals would hide the light
  m = materialOf(
      R"({"emissiveFactor":[1,0.5,0.25],"pbrMetallicRoughness":{"roughnessFactor":0.25}})");
  EXPECT_EQ(m.specularLevel, 1.0f);  // a mirror shows little else

  m = materialOf(R"({"extensions":{"KHR_materials_unlit":{}}})");
  EXPECT_TRUE(m.unlit);
  EXPECT_EQ(m.specularLevel, 0.0f);

  m = materialOf(R"({"alphaMode":"MASK","alphaCutoff":0.25})");
  EXPECT_EQ(m.alphaMode, AlphaMode::Mask);
  EXPECT_FLOAT_EQ(m.alphaCutoff, 0.25f);
  m = materialOf(
      R"({"alphaMode":"BLEND","alphaCutoff":0.25,"pbrMetallicRoughness":{"baseColorFactor":[1,1,1,0.7]}})");
  EXPECT_EQ(m.alphaMode, AlphaMode::Mask);
  EXPECT_FLOAT_EQ(m.alphaCutoff, 0.5f);
  EXPECT_FLOAT_EQ(m.baseAlpha, 0.7f);
}

TEST_F(Gltf, LayersOfAMaterialBecomeOneLobe) {
  const auto layered = [&](const std::string& pbr, const std::string& name,
                           const std::string& values) {
    return materialOf(R"({"pbrMetallicRoughness":{)" + pbr + R"(},"extensions":{"KHR_materials_)" +
                      name + "\":{" + values + "}}}");
  };
  const std::string paint = R"("metallicFactor":0,"roughnessFactor":0.6)";
  Material m = layered(paint, "clearcoat", R"("clearcoatFactor":1,"clearcoatRoughnessFactor":0.1)");
  expectNear(m.dielectricF0, Vec3(0.04f));
  EXPECT_FLOAT_EQ(m.roughnessFactor, 0.1f);
  expectNear(m.baseColor, Vec3(1.0f));
  EXPECT_TRUE(hasNote(load(), "clear coat reflects in place of its base"));
  m = layered(paint + R"(,"baseColorFactor":[0.5,0,0,1])", "clearcoat", R"("clearcoatFactor":1)");
  expectNear(m.baseColor, Vec3(0.52f, 0.04f, 0.04f));
  // Its share scales it at all angles; what the base reflects has a colour
  m = layered(
      paint, "specular",
      R"("specularFactor":0.5,"specularColorFactor":[5,2,1]},"KHR_materials_clearcoat":{"clearcoatFactor":0.7)");
  expectNear(m.dielectricF0, Vec3(0.028f));
  EXPECT_FLOAT_EQ(m.dielectricF90, 0.7f);
  expectNear(m.baseColor, Vec3(1.0f, 0.94f, 0.92f));
  m = layered(paint, "clearcoat", R"("clearcoatFactor":0.3)");
  EXPECT_FLOAT_EQ(m.roughnessFactor, 0.6f);
  EXPECT_TRUE(hasNote(load(), "clear coat is left out"));
  m = layered(R"("roughnessFactor":0.4)", "clearcoat", R"("clearcoatFactor":1)");
  EXPECT_FLOAT_EQ(m.roughness, 0.4f);
  EXPECT_TRUE(hasNote(load(), "that of the metal"));
  m = layered(paint, "clearcoat", R"("clearcoatRoughnessFactor":0.1)");  // its factor is 0
  EXPECT_FLOAT_EQ(m.roughnessFactor, 0.6f);

  m = layered(R"("metallicFactor":0,"baseColorFactor":[0.2,0.9,0.4,1])", "transmission",
              R"("transmissionFactor":0.75)");
  EXPECT_EQ(m.refraction, 1.0f);
  EXPECT_EQ(m.specularLevel, 0.75f);
  EXPECT_EQ(m.roughness, 0.0f);
  expectNear(m.reflectionTint, Vec3(0.2f, 0.9f, 0.4f));
  EXPECT_TRUE(hasNote(load(), "without bending"));
  m = layered(paint, "transmission", R"("transmissionFactor":0.2)");
  EXPECT_EQ(m.refraction, 0.0f);
  EXPECT_TRUE(hasNote(load(), "transmission is left out"));

  // Areas of ellipses: alpha is 0.25 across, 0.25 + 0.75 * 0.64 along
  m = layered(R"("roughnessFactor":0.5)", "anisotropy", R"("anisotropyStrength":0.8)");
  EXPECT_NEAR(std::pow(m.roughness, 4.0f), 0.25f * 0.73f, 1e-5f);
  EXPECT_TRUE(hasNote(load(), "drawn round"));
}

TEST_F(Gltf, TexturesOfAClearCoatSayWhereAndHowRoughItIs) {
  std::vector<int> red;  // of the base colour, from the same file
  float scale = 0.0f;    // of the roughness, in x
  const auto roughnessOf = [&](const std::string& before, const std::string& roughness,
                               const std::string& after) {
    w = triangleFile();
    w.arrays["meshes"] = {R"({"primitives":[{"attributes":{"POSITION":0,"TEXCOORD_0":)" +
                          std::to_string(w.floats({0, 0, 1, 0, 0, 1}, "VEC2")) +
                          R"(},"indices":2,"material":0}]})"};
    // Shares of 1, 0.6 and 0.2, whose other channels mean nothing; roughness of the coat, the base
    for (const std::vector<std::uint8_t>& pixels :
         {std::vector<std::uint8_t>{255, 7, 9, 255, 153, 7, 9, 255, 51, 7, 9, 255},
          std::vector<std::uint8_t>{7, 255, 9, 255, 7, 51, 9, 255, 7, 51, 9, 255},
          std::vector<std::uint8_t>{7, 128, 255, 255}}) {
      w.add("textures", "{\"source\":" + std::to_string(w.arrays["images"].size()) + "}");
      w.add("images", R"({"uri":"data:image/png;base64,)" +
                          base64(pngBytes(static_cast<int>(pixels.size() / 4), pixels)) + "\"}");
    }
    w.add("materials", R"({"pbrMetallicRoughness":{"metallicFactor":0,"roughnessFactor":0.8)" +
                           before + R"(},"extensions":{"KHR_materials_clearcoat":{)" +
                           R"("clearcoatFactor":1,"clearcoatRoughnessFactor":0.4)" + roughness +
                           "}" + after + "}}");
    const Scene scene = load();
    const Material& m = scene.materials.at(0);
    red.clear();
    if (m.baseColorTexture.used()) {
      expectNear(m.baseColor, Vec3(1.0f));
      const Texture& color =
          scene.textures.at(static_cast<std::size_t>(m.baseColorTexture.texture));
      EXPECT_TRUE(color.srgb);
      for (std::size_t i = 0; i < color.levels[0].rgba.size(); i += 4)
        red.push_back(color.levels[0].rgba[i]);
    }
    std::vector<int> green;
    if (!m.metallicRoughnessTexture.used()) return green;
    scale = m.metallicRoughnessTexture.transform[0][0];
    expectNear(m.dielectricF0, Vec3(0.04f));
    const MipLevel& level =
        scene.textures.at(static_cast<std::size_t>(m.metallicRoughnessTexture.texture)).levels[0];
    for (std::size_t i = 0; i < level.rgba.size(); i += 4)
      green.push_back(
          static_cast<int>(std::lround(static_cast<float>(level.rgba[i + 1]) * m.roughnessFactor)));
    return green;
  };
  const std::string shares = R"(,"clearcoatTexture":{"index":0})";
  const std::string coat = R"(,"clearcoatRoughnessTexture":{"index":1})";
  const std::string base = R"(,"metallicRoughnessTexture":{"index":2})";
  EXPECT_THAT(roughnessOf("", shares, ""), ElementsAre(102, 102, 204));
  EXPECT_THAT(roughnessOf("", shares + coat, ""), ElementsAre(102, 20, 204));
  EXPECT_THAT(roughnessOf(base, shares + coat, ""), ElementsAre(102, 20, 102));
  EXPECT_TRUE(hasNote(load(), "where it covers at least half"));
  EXPECT_THAT(roughnessOf(base, coat, ""), ElementsAre(102, 20, 20));
  // What the base reflects is added below the coat alone: sRGB's codes of 0.232 and 0.2
  const std::string dark = R"(,"baseColorFactor":[0.2,0,0,1])";
  EXPECT_THAT(roughnessOf(dark, shares, ""), ElementsAre(102, 102, 204));
  EXPECT_THAT(red, ElementsAre(132, 132, 124));
  const std::string quarter = R"(,"baseColorFactor":[0.25,0,0,1],"baseColorTexture":{"index":)";
  roughnessOf(quarter + "2}", shares, "");
  EXPECT_THAT(red, ElementsAre(57, 57, 2));
  roughnessOf(quarter + "0}", "", "");
  EXPECT_THAT(red, ElementsAre(144, 96, 62));
  const std::string moved =
      R"(,"clearcoatTexture":{"index":0,"extensions":{"KHR_texture_transform":{"scale":[2,2]}}})";
  EXPECT_THAT(roughnessOf("", moved + coat, ""), ElementsAre(102, 20, 20));
  EXPECT_TRUE(hasNote(load(), "clearcoatTexture is ignored"));
  EXPECT_THAT(roughnessOf("", moved, ""), ElementsAre(102, 102, 204));
  EXPECT_EQ(scale, 2.0f);
  EXPECT_THAT(roughnessOf("", shares, R"(,"KHR_materials_transmission":{"transmissionFactor":1})"),
              ElementsAre());
}

TEST_F(Gltf, ExtrasSetReflectanceOfMaterialAndNode) {
  Material m = materialOf(
      R"({"pbrMetallicRoughness":{"metallicFactor":0},"extras":{"catoptric":{"s":0.05,"n":1000}}})");
  EXPECT_EQ(m.specularLevel, 0.05f);  // exactly: it is the threshold
  EXPECT_NEAR(m.roughness, phongRoughnessFromExponent(1000.0f), 1e-6f);

  w.arrays["nodes"] = {R"({"mesh":0})", R"({"mesh":0,"extras":{"catoptric":{"s":0.75,"g":0.125}}})",
                       R"({"mesh":0,"extras":{"catoptric":{"s":0}}})"};
  w.arrays["scenes"] = {R"({"nodes":[0,1,2]})"};
  Scene scene = load();
  finishScene(scene);
  const auto materialAt = [&](std::size_t i) {
    return scene.materials[static_cast<std::size_t>(scene.objects[i].material)];
  };
  EXPECT_EQ(materialAt(0).specularLevel, 0.05f);
  EXPECT_EQ(materialAt(1).specularLevel, 0.75f);
  EXPECT_EQ(materialAt(1).roughness, 0.125f);
  EXPECT_EQ(materialAt(2).specularLevel, 0.0f);
  EXPECT_EQ(scene.objects[0].reflector, 1);
  EXPECT_EQ(scene.objects[1].reflector, 2);
  EXPECT_EQ(scene.objects[2].reflector, 0);
  EXPECT_EQ(scene.reflectorCount(), 2);
  EXPECT_EQ(scene.reflectiveTriangleCount(), 2u);
}

TEST_F(Gltf, PrimitivesWithoutMaterialAreDiffuseWhite) {
  w = triangleFile();
  Scene scene = load();
  finishScene(scene);
  ASSERT_EQ(scene.materials.size(), 1u);
  EXPECT_EQ(scene.materials[0].baseColor, Vec3(1.0f));
  EXPECT_EQ(scene.materials[0].specularLevel, 0.0f);
  EXPECT_TRUE(hasNote(scene, "without material"));
}

TEST_F(Gltf, TexturesSamplersAndTransforms) {
  const std::vector<std::uint8_t> pixels = {255, 0, 0, 255, 0, 255, 0, 255};
  const std::string bytes = pngBytes(2, pixels);
  folder.write("colour #1.png", bytes);
  w = triangleFile();
  w.add("images",
        "{\"bufferView\":" + std::to_string(w.view(bytes)) + R"(,"mimeType":"image/png"})");
  w.add("images", "{\"uri\":\"data:image/png;base64," + base64(bytes) + "\"}");
  w.add("images", R"({"uri":"colour%20%231.png"})");
  w.add("samplers", R"({"magFilter":9728,"minFilter":9728,"wrapS":33071,"wrapT":33648})");
  w.add("textures", R"({"source":0,"sampler":0})");
  w.add("textures", R"({"source":1})");
  w.add("textures", R"({"source":2})");
  w.add(
      "materials",
      R"({"pbrMetallicRoughness":{"baseColorTexture":{"index":0,"texCoord":1,"extensions":{"KHR_texture_transform":{"offset":[0,1],"rotation":1.5707963267948966,"scale":[0.5,0.5]}}},"metallicRoughnessTexture":{"index":1}},"emissiveTexture":{"index":2,"texCoord":0,"extensions":{"KHR_texture_transform":{"texCoord":1}}},"normalTexture":{"index":2,"scale":0.5}})");
  const Scene scene = load();
  ASSERT_EQ(scene.textures.size(), 4u);  // image 2 as colour and as data
  const Material& m = scene.materials[0];
  const auto textureOf = [&](const TextureSlot& slot) {
    return scene.textures[static_cast<std::size_t>(slot.texture)];
  };
  const Texture base = textureOf(m.baseColorTexture);
  EXPECT_TRUE(base.srgb);
  EXPECT_TRUE(base.nearest);
  EXPECT_EQ(base.wrapS, Wrap::ClampToEdge);
  EXPECT_EQ(base.wrapT, Wrap::MirroredRepeat);
  EXPECT_FALSE(textureOf(m.metallicRoughnessTexture).srgb);
  EXPECT_FALSE(textureOf(m.normalTexture).srgb);
  EXPECT_TRUE(textureOf(m.emissiveTexture).srgb);
  EXPECT_FALSE(textureOf(m.emissiveTexture).nearest);
  EXPECT_EQ(textureOf(m.emissiveTexture).wrapS, Wrap::Repeat);
  for (const Texture& t : scene.textures) {
    ASSERT_EQ(t.levels.size(), 2u);
    EXPECT_EQ(t.levels[0].width, 2);
    EXPECT_EQ(t.levels[0].height, 1);
    EXPECT_EQ(t.levels[0].rgba, pixels);
  }
  EXPECT_EQ(m.baseColorTexture.uvSet, 1);
  EXPECT_EQ(m.emissiveTexture.uvSet, 1);
  EXPECT_FLOAT_EQ(m.normalScale, 0.5f);
  // The extension's own example: "utilizes only the lower left quadrant of the source image".
  for (const Vec2 uv : {Vec2(0, 0), Vec2(1, 0), Vec2(0, 1), Vec2(0.5f, 0.25f)}) {
    const Vec2 t = m.baseColorTexture.transform * Vec3(uv, 1.0f);
    EXPECT_NEAR(t.x, 0.5f * uv.y, 1e-6f);
    EXPECT_NEAR(t.y, 1.0f - 0.5f * uv.x, 1e-6f);
  }
}

TEST_F(Gltf, MissingTexturesShowACheckerboardWhereThatIsAskedFor) {
  w = triangleFile();
  w.arrays["meshes"] = {R"({"primitives":[{"attributes":{"POSITION":0,"TEXCOORD_0":)" +
                        std::to_string(w.floats({0, 0, 1, 0, 0, 1}, "VEC2")) +
                        R"(},"indices":2,"material":0}]})"};
  w.add("images", R"({"uri":"none.png"})");
  w.add("textures", R"({"source":0})");
  w.add("materials", R"({"pbrMetallicRoughness":{"baseColorTexture":{"index":0},
        "metallicRoughnessTexture":{"index":0}},"normalTexture":{"index":0}})");
  EXPECT_THROW(load(), SceneError);
  const Scene scene = loadGltf(w.gltf(folder), {.showMissingTextures = true});
  EXPECT_THAT(scene.warnings, ElementsAre(HasSubstr("/images/0: \"none.png\" is missing")));
  const Material& m = scene.materials.at(0);
  const auto levels = [&](const TextureSlot& slot) {
    return scene.textures.at(static_cast<std::size_t>(slot.texture)).levels;
  };
  // Light and dark squares are seen, in a 64th of the image as well as over the whole
  const std::vector<MipLevel>& board = levels(m.baseColorTexture);
  EXPECT_GE(board.front().width, 512);
  for (const MipLevel& level : board) {
    if (level.width < 2) continue;
    const int part = level.width >= 256 ? level.width / 64 : level.width;
    std::set<int> lights;
    for (int y = 0; y < part; ++y)
      for (int x = 0; x < part; ++x)
        lights.insert(level.rgba[4 * static_cast<std::size_t>(y * level.width + x)]);
    EXPECT_GT(*lights.rbegin(), *lights.begin() + 30) << level.width;
  }
  EXPECT_EQ(levels(m.normalTexture).front().rgba, (std::vector<std::uint8_t>{128, 128, 255, 255}));
}

TEST_F(Gltf, ImagesOfOtherKindsAreRefusedWhereAMaterialNeedsThem) {
  const auto use = [&](const std::string& texture, const std::string& material) {
    w = triangleFile();
    w.members["extensionsUsed"] = w.members["extensionsRequired"] = R"(["KHR_texture_basisu"])";
    w.arrays["meshes"] = {R"({"primitives":[{"attributes":{"POSITION":0,"TEXCOORD_0":)" +
                          std::to_string(w.floats({0, 0, 1, 0, 0, 1}, "VEC2")) +
                          R"(},"indices":2,"material":0}]})"};
    w.add("images", R"({"uri":"data:image/ktx2;base64,q0tUWCAyMLs=","mimeType":"image/ktx2"})");
    w.add("images",
          R"({"uri":"data:image/png;base64,)" + base64(pngBytes(1, {9, 9, 9, 255})) + "\"}");
    w.add("textures", texture);
    w.add("materials", material);
  };
  const std::string only = R"({"extensions":{"KHR_texture_basisu":{"source":0}}})";
  const std::string base = R"({"pbrMetallicRoughness":{"baseColorTexture":{"index":0}}})";
  use(only, base);
  try {
    load();
    ADD_FAILURE() << "loaded";
  } catch (const SceneError& e) {
    EXPECT_THAT(e.what(), HasSubstr("/images/0: is an image of KHR_texture_basisu, which is not "
                                    "supported; PNG and JPEG are"));
  }
  const Scene shown = loadGltf(w.gltf(folder), {.showMissingTextures = true});
  EXPECT_THAT(shown.warnings, ElementsAre(HasSubstr("an image of KHR_texture_basisu")));

  use(R"({"source":1,"extensions":{"KHR_texture_basisu":{"source":0}}})", base);
  EXPECT_EQ(load().textures.at(0).levels.front().width, 1);
  use(only, R"({"occlusionTexture":{"index":0}})");
  EXPECT_TRUE(load().textures.empty());
}

}  // namespace
}  // namespace catoptric::scene
