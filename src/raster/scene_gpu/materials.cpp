#include "raster/scene_gpu/materials.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "core/error.h"
#include "frame/shading.h"
#include "gl/context.h"
#include "scene/reflectance.h"

namespace catoptric::raster {
namespace {

/// The slot of surface.glsl, std140.
struct SlotBlock {
  Vec4 linear{1.0f, 0.0f, 0.0f, 1.0f};
  Vec4 offset{0.0f};
};

/// The material block of surface.glsl, std140.
struct MaterialBlock {
  Vec4 baseColor{1.0f};
  Vec4 emissive{0.0f};
  Vec4 specular{0.0f};
  Vec4 dielectric{0.0f};
  Vec4 more{0.0f};
  Vec4 tint{1.0f, 1.0f, 1.0f, 0.0f};
  SlotBlock base;
  SlotBlock emissiveSlot;
  SlotBlock normal;
  SlotBlock specularSlot;
};

SlotBlock slotBlock(const scene::Scene& scene, const scene::TextureSlot& slot) {
  SlotBlock block;
  if (!slot.used()) return block;
  const scene::Texture& texture = scene.textures[slot.texture];
  const glm::mat3x2& m = slot.transform;
  block.linear = Vec4(m[0], m[1]);
  const std::size_t levels = texture.nearest ? 1 : texture.levels.size();
  block.offset = Vec4(m[2], frame::textureScale(scene, slot), static_cast<float>(levels - 1));
  return block;
}

GLenum wrapMode(scene::Wrap wrap) {
  switch (wrap) {
    case scene::Wrap::Repeat:
      return GL_REPEAT;
    case scene::Wrap::MirroredRepeat:
      return GL_MIRRORED_REPEAT;
    case scene::Wrap::ClampToEdge:
      break;
  }
  return GL_CLAMP_TO_EDGE;
}

/// Nearest textures are sampled at the base level only.
std::size_t uploadedLevels(const scene::Texture& texture) {
  return texture.nearest ? std::min<std::size_t>(1, texture.levels.size()) : texture.levels.size();
}

/// By index of the scene's textures.
std::vector<bool> usedTextures(const scene::Scene& scene) {
  std::vector<bool> used(scene.textures.size(), false);
  for (const scene::Material& m : scene.materials) {
    for (const scene::TextureSlot* slot :
         {&m.baseColorTexture, &m.normalTexture, &m.metallicRoughnessTexture, &m.emissiveTexture}) {
      if (slot->used()) used[static_cast<std::size_t>(slot->texture)] = true;
    }
  }
  return used;
}

gl::Texture uploadTexture(const scene::Texture& source, std::size_t number) {
  const std::string name = "texture " + std::to_string(number) + " (\"" + source.name + "\")";
  if (source.levels.empty()) throw SceneError(name + ": has no pixels");
  const int limit = gl::Context::current().info().limits.maxTextureSize;
  const scene::MipLevel& base = source.levels[0];
  if (base.width > limit || base.height > limit) {
    throw SceneError(name + ": is " + std::to_string(base.width) + " x " +
                     std::to_string(base.height) + " pixels; this GL device allows " +
                     std::to_string(limit) + " x " + std::to_string(limit));
  }
  const int levels = static_cast<int>(uploadedLevels(source));
  gl::Texture texture = gl::Texture::make2D(name, source.srgb ? GL_SRGB8_ALPHA8 : GL_RGBA8,
                                            base.width, base.height, levels);
  for (int level = 0; level < levels; ++level) {
    const scene::MipLevel& pixels = source.levels[level];
    if (pixels.width != texture.levelWidth(level) || pixels.height != texture.levelHeight(level)) {
      throw SceneError(name + ": mip level " + std::to_string(level) + " is " +
                       std::to_string(pixels.width) + " x " + std::to_string(pixels.height) +
                       "; it must be " + std::to_string(texture.levelWidth(level)) + " x " +
                       std::to_string(texture.levelHeight(level)));
    }
    texture.upload(level, 0, GL_RGBA, GL_UNSIGNED_BYTE, pixels.rgba.data());
  }
  if (source.nearest) {
    texture.setFilter(GL_NEAREST, GL_NEAREST);
  } else {
    texture.setFilter(levels > 1 ? GL_LINEAR_MIPMAP_LINEAR : GL_LINEAR, GL_LINEAR);
  }
  texture.setWrap(wrapMode(source.wrapS), wrapMode(source.wrapT));
  return texture;
}

/// Largest roughness factor times texel.
float largestRoughness(const scene::Scene& scene, const scene::Material& material) {
  if (!material.metallicRoughnessTexture.used()) return material.roughness;
  const scene::Texture& texture = scene.textures[material.metallicRoughnessTexture.texture];
  if (texture.levels.empty()) return material.roughnessFactor;
  const std::vector<std::uint8_t>& rgba = texture.levels[0].rgba;
  std::uint8_t largest = 0;
  for (std::size_t i = 1; i < rgba.size(); i += 4) largest = std::max(largest, rgba[i]);
  return material.roughnessFactor * static_cast<float>(largest) / 255.0f;
}

}  // namespace

std::uint32_t materialFeatures(const scene::Material& material) {
  std::uint32_t features = 0;
  const auto slot = [&](const scene::TextureSlot& s, std::uint32_t used, std::uint32_t uv1) {
    if (!s.used()) return;
    features |= used;
    if (s.uvSet == 1) features |= uv1;
  };
  slot(material.baseColorTexture, kBaseTexture, kBaseUv1);
  slot(material.normalTexture, kNormalMap, kNormalUv1);
  slot(material.metallicRoughnessTexture, kSpecularTexture, kSpecularUv1);
  slot(material.emissiveTexture, kEmissiveTexture, kEmissiveUv1);
  if (material.alphaMode == scene::AlphaMode::Mask) features |= kAlphaMask;
  if (material.lobe == scene::LobeModel::Ggx) features |= kGgx;
  if (material.unlit) {
    features |= kUnlit;
    features &= ~(kEmissiveTexture | kEmissiveUv1);  // unlit surfaces show their albedo alone
  }
  return features;
}

std::uint32_t litFeatures(std::uint32_t features, bool sky) {
  if (!sky) features &= ~kSky;
  if ((features & kUnlit) != 0) features &= ~(kSky | kBakeIrradiance);
  if ((features & kSky) == 0) features &= ~kBakeVisibility;
  return features;
}

std::uint32_t passFeatures(std::uint32_t features, std::uint32_t outputs) {
  if ((outputs & kSpecularOutput) == 0) features &= ~(kSpecularTexture | kSpecularUv1 | kBend);
  if ((outputs & kHighlightOutput) == 0) features &= ~kGgx;
  if ((features & kUnlit) != 0 && (outputs & kNormalOutput) == 0) {
    features &= ~(kNormalMap | kNormalUv1);
  }
  return features | outputs;
}

std::uint32_t vertexFeatures(const frame::Geometry& geometry, const frame::ObjectRange& range) {
  std::uint32_t features = 0;
  for (std::uint32_t i = 0; i < range.vertexCount; ++i) {
    const frame::VertexAttributes& v = geometry.attributes[range.firstVertex + i];
    if (v.color != Vec3(1.0f)) features |= kVertexColor;
    if (Vec3(v.bake) != Vec3(0.0f)) features |= kBakeIrradiance;
    if (v.bake.w != 1.0f) features |= kBakeVisibility;
    if (v.bake.w > 0.0f) features |= kSky;
  }
  return features;
}

std::vector<gl::Define> featureDefines(std::uint32_t features) {
  const auto has = [&](std::uint32_t bit) { return (features & bit) != 0; };
  const auto flag = [&](std::uint32_t bit) { return std::string(has(bit) ? "1" : "0"); };
  // Which uv sets any slot reads
  bool uv0 = false;
  bool uv1 = false;
  const auto slot = [&](std::uint32_t used, std::uint32_t second) {
    if (has(used)) (has(second) ? uv1 : uv0) = true;
  };
  slot(kBaseTexture, kBaseUv1);
  slot(kNormalMap, kNormalUv1);
  slot(kSpecularTexture, kSpecularUv1);
  slot(kEmissiveTexture, kEmissiveUv1);
  return {{"RADIANCE_OUTPUT", flag(kRadianceOutput)},
          {"NORMAL_OUTPUT", flag(kNormalOutput)},
          {"SPECULAR_OUTPUT", flag(kSpecularOutput)},
          {"TINT_OUTPUT", flag(kTintOutput)},
          {"BASE_TEXTURE", flag(kBaseTexture)},
          {"NORMAL_MAP", flag(kNormalMap)},
          {"SPECULAR_TEXTURE", flag(kSpecularTexture)},
          {"EMISSIVE_TEXTURE", flag(kEmissiveTexture)},
          {"BEND", flag(kBend)},
          {"HIGHLIGHT_OUTPUT", flag(kHighlightOutput)},
          {"LOBE_HORIZON_OUTPUT", flag(kLobeHorizonOutput)},
          {"GGX_HIGHLIGHTS", flag(kGgx)},
          {"ALPHA_MASK", flag(kAlphaMask)},
          {"VERTEX_COLOR", flag(kVertexColor)},
          {"UNLIT", flag(kUnlit)},
          {"BAKE_IRRADIANCE", flag(kBakeIrradiance)},
          {"BAKE_VISIBILITY", flag(kBakeVisibility)},
          {"BASE_UV", flag(kBaseUv1)},
          {"NORMAL_UV", flag(kNormalUv1)},
          {"SPECULAR_UV", flag(kSpecularUv1)},
          {"EMISSIVE_UV", flag(kEmissiveUv1)},
          {"SKY", flag(kSky)},
          {"UV0", uv0 ? "1" : "0"},
          {"UV1", uv1 ? "1" : "0"}};
}

SampleClass materialClass(const scene::Scene& scene, const scene::Material& material) {
  if (!(material.specularLevel > 0.0f)) return SampleClass::Diffuse;
  return scene::Lobe::of(material.lobe, largestRoughness(scene, material)).mirror()
             ? SampleClass::CurvedMirror
             : SampleClass::Glossy;
}

std::vector<SampleClass> materialClasses(const scene::Scene& scene) {
  std::vector<SampleClass> classes;
  for (const scene::Material& material : scene.materials)
    classes.push_back(materialClass(scene, material));
  return classes;
}

namespace {

/// withTexturesFor(), with the class of each material.
GBufferSize withTexturesFor(const scene::Scene& scene, const std::vector<SampleClass>& classes,
                            GBufferSize size) {
  const bool highlights = scene.highlights && frame::hasUnbakedLights(scene);
  for (const scene::Object& object : scene.objects) {
    const scene::Material& material = scene.materials[object.material];
    const SampleClass found = classes[object.material];
    size.tints = size.tints || (found != SampleClass::Diffuse && material.tintVaries());
    if (found != SampleClass::Glossy || material.refraction > 0.0f) continue;
    size.highlights = size.highlights || highlights;
    size.lobeHorizons = size.lobeHorizons || material.normalTexture.used() || !object.planar;
  }
  return size;
}

}  // namespace

GBufferSize withTexturesFor(const scene::Scene& scene, GBufferSize size) {
  return withTexturesFor(scene, materialClasses(scene), size);
}

std::uint64_t textureBytes(const scene::Scene& scene) {
  const std::vector<bool> used = usedTextures(scene);
  std::uint64_t bytes = 0;
  for (std::size_t i = 0; i < used.size(); ++i) {
    if (!used[i]) continue;
    const std::vector<scene::MipLevel>& levels = scene.textures[i].levels;
    for (std::size_t l = 0; l < uploadedLevels(scene.textures[i]); ++l)
      bytes += 4u * static_cast<std::uint64_t>(levels[l].width) * levels[l].height;
  }
  return bytes;
}

Materials::Materials(const scene::Scene& scene) {
  // Blocks at the stride that uniform bindings need
  GLint alignment = 256;
  glGetIntegerv(GL_UNIFORM_BUFFER_OFFSET_ALIGNMENT, &alignment);
  const std::size_t step = static_cast<std::size_t>(std::max(1, alignment));
  blockStride_ = (sizeof(MaterialBlock) + step - 1) / step * step;
  std::vector<std::byte> blocks(blockStride_ * std::max<std::size_t>(1, scene.materials.size()));
  for (std::size_t i = 0; i < scene.materials.size(); ++i) {
    const scene::Material& m = scene.materials[i];
    MaterialBlock block;
    block.baseColor = Vec4(m.baseColor, m.baseAlpha);
    block.emissive = Vec4(m.emissive, m.alphaCutoff);
    block.specular = Vec4(m.specularLevel, m.roughness, m.metallicFactor, m.roughnessFactor);
    block.dielectric = Vec4(m.dielectricF0, m.dielectricF90);
    block.more = Vec4(m.normalScale, scene::Lobe::of(m.lobe, 0.0f).code, 0.0f, 0.0f);
    block.tint = Vec4(m.reflectionTint, m.albedoTint);
    block.base = slotBlock(scene, m.baseColorTexture);
    block.emissiveSlot = slotBlock(scene, m.emissiveTexture);
    block.normal = slotBlock(scene, m.normalTexture);
    block.specularSlot = slotBlock(scene, m.metallicRoughnessTexture);
    std::memcpy(&blocks[i * blockStride_], &block, sizeof block);

    classes_.push_back(materialClass(scene, m));
    slots_.push_back({m.baseColorTexture.texture, m.normalTexture.texture,
                      m.metallicRoughnessTexture.texture, m.emissiveTexture.texture});
  }
  blocks_ = gl::Buffer("materials", blocks.size(), blocks.data());

  const std::vector<bool> used = usedTextures(scene);
  for (std::size_t i = 0; i < scene.textures.size(); ++i) {
    textures_.push_back(used[i] ? uploadTexture(scene.textures[i], i) : gl::Texture());
  }

  gbuffer_ = withTexturesFor(scene, classes_, {});
  ggx_ = scene.hasGgxLobes();
  // Tints and F90 by object id
  std::vector<Vec4> tints{Vec4(1.0f)};
  for (const scene::Object& object : scene.objects) {
    const scene::Material& material = scene.materials[object.material];
    tints.emplace_back(material.reflectionTint,
                       scene::rimLevel(material.metallicFactor, material.dielectricF90));
    if (classes_[object.material] == SampleClass::Diffuse) continue;
    reflective_ = true;
    tinted_ = tinted_ || tints.back() != Vec4(1.0f);
  }
  tintBuffer_ = gl::Buffer("reflection tints", std::span<const Vec4>(tints));
  tints_ = gl::Texture::makeBuffer("reflection tints", GL_RGBA32F, tintBuffer_);
}

void Materials::bind(int material) const {
  glBindBufferRange(GL_UNIFORM_BUFFER, shared::kMaterialBlock, blocks_.id(),
                    static_cast<GLintptr>(blockStride_ * static_cast<std::size_t>(material)),
                    sizeof(MaterialBlock));
  const Slots& slots = slots_[material];
  if (slots.base != scene::kNone) textures_[slots.base].bind(shared::kBaseTextureUnit);
  if (slots.normal != scene::kNone) textures_[slots.normal].bind(shared::kNormalTextureUnit);
  if (slots.specular != scene::kNone) textures_[slots.specular].bind(shared::kSpecularTextureUnit);
  if (slots.emissive != scene::kNone) textures_[slots.emissive].bind(shared::kEmissiveTextureUnit);
}

std::size_t Materials::bytes() const {
  std::size_t sum = blocks_.size() + tintBuffer_.size();
  for (const gl::Texture& texture : textures_) sum += texture.bytes();
  return sum;
}

}  // namespace catoptric::raster
