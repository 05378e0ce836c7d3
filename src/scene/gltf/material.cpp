// Materials.
#include <algorithm>
#include <array>
#include <cmath>

#include "core/srgb.h"
#include "scene/finish.h"
#include "scene/gltf/textures.h"
#include "scene/reflectance.h"
#include "scene/texture.h"

namespace catoptric::scene::gltf {
namespace {

/// A clear coat or transmission of a smaller share is left out. Ours: what is left shows more.
constexpr float kLeastShare = 0.5f;

float of255(std::uint8_t code) {
  return static_cast<float>(code) / 255.0f;
}

/// The colour of a base whose reflection, of this F0, is added to its diffuse part.
Vec3 belowCoat(const Vec3& color, const Vec3& f0) {
  return (1.0f - specularLevel(0.0f, f0)) * color + f0;
}

class MaterialReader {
 public:
  explicit MaterialReader(Reader& reader) : reader_(reader), textures_(reader) {}

  void read(bool needDefault) {
    const std::vector<tinygltf::Material>& sources = reader_.model.materials;
    for (std::size_t i = 0; i < sources.size(); ++i) {
      reader_.scene.materials.push_back(material(sources[i], elementPlace("materials", i), i));
    }
    if (needDefault) {
      // DEVIATION: glTF's default is a rough metal, whose reflection would cover everything
      // that its author left unpainted; diffuse white is what other renderers show.
      Material plain;
      plain.name = "default";
      reader_.scene.materials.push_back(plain);
      reader_.scene.notes.push_back("primitives without material are diffuse white");
    }
    textures_.decode();
    for (const Coat& coat : coats_) drawCoat(coat);
  }

 private:
  /// A lobe's roughness: green of a texture, times a factor.
  struct Roughness {
    TextureSlot slot;
    float factor = 0.0f;
  };
  /// A clear coat, whose share may be a texture's red. Where it covers less than half, the base
  /// reflects.
  struct Coat {
    std::size_t material = 0;
    float share = 0.0f;
    TextureSlot cover;  ///< empty: it covers all
    Roughness own;
    Roughness base;
    Vec3 baseColor{1.0f};  ///< and F0, of the base
    Vec3 baseF0{0.0f};
    bool covers(std::uint8_t red) const { return share * of255(red) >= kLeastShare; }
  };

  void note(const std::string& text) { reader_.scene.notes.push_back(text); }

  void noteIgnored(const tinygltf::Value& extension, std::initializer_list<const char*> keys,
                   const std::string& place) {
    for (const char* key : keys) {
      if (member(extension, key).IsObject()) note(place + ": " + key + " is ignored");
    }
  }

  /// A sample has one lobe and one normal. A coat's take the place of a dielectric's own, which is
  /// rougher: what that reflects is added to its diffuse part. A metal reflects more than its coat.
  /// KHR_materials_clearcoat weighs a coat as a dielectric of ior 1.5 with its share as factor.
  void setClearCoat(const tinygltf::Value& coat, const std::string& place, std::size_t index,
                    Material& m) {
    const auto share = static_cast<float>(numberOr(coat, "clearcoatFactor", 0.0));
    if (!(share > 0.0f)) return;
    if (share < kLeastShare || m.metallicFactor > 0.0f) {
      note(place + ": the clear coat is left out, because a sample has one lobe: that of the " +
           (m.metallicFactor > 0.0f ? "metal" : "base, which the coat covers by less than half"));
      return;
    }
    Coat result;
    result.material = index;
    result.share = share;
    result.baseColor = m.baseColor;
    result.baseF0 = m.dielectricF0;
    m.baseColor = belowCoat(m.baseColor, m.dielectricF0);
    m.dielectricF0 = dielectricF0(1.5f, share);
    m.dielectricF90 = share;
    result.own = {textures_.slot(coat, "clearcoatRoughnessTexture", place),
                  static_cast<float>(numberOr(coat, "clearcoatRoughnessFactor", 0.0))};
    result.base = {m.metallicRoughnessTexture, m.roughnessFactor};
    const TextureSlot cover = textures_.slot(coat, "clearcoatTexture", place);
    const bool partial =
        cover.used() && mappedAlike(cover, result.own.slot) && mappedAlike(cover, result.base.slot);
    if (partial) result.cover = cover;
    coats_.push_back(result);
    m.roughnessFactor = result.own.factor;
    m.metallicRoughnessTexture = result.own.slot;
    if (m.normalTexture.used()) note(place + ": normalTexture is ignored below the clear coat");
    m.normalTexture = textures_.slot(coat, "clearcoatNormalTexture", place);
    m.normalScale =
        static_cast<float>(numberOr(member(coat, "clearcoatNormalTexture"), "scale", 1.0));
    note(place + ": the clear coat reflects in place of its base" +
         (partial ? " where it covers at least half" : "") + "; the base is diffuse");
    if (cover.used() && !partial)
      note(place +
           ": clearcoatTexture is ignored, because the textures of roughness have other "
           "coordinates");
  }

  /// Whether both textures show a point at the same place, or one of them is missing.
  static bool mappedAlike(const TextureSlot& a, const TextureSlot& b) {
    return !a.used() || !b.used() || (a.uvSet == b.uvSet && a.transform == b.transform);
  }

  /// The finest level of a texture; null for an empty slot.
  const MipLevel* finest(const TextureSlot& slot) const {
    return slot.used()
               ? &reader_.scene.textures[static_cast<std::size_t>(slot.texture)].levels.front()
               : nullptr;
  }

  /// Adds a texture named `name`, which is mapped and sampled like that of `like`, as large as the
  /// largest of `levels` (null ones are left out). `texelAt(at)` gives its texels; `at(level,
  /// channel)` is there what a level has at the same place, or white.
  template <class TexelAt>
  TextureSlot addTexture(const TextureSlot& like, const std::string& name, std::size_t material,
                         bool srgb, std::initializer_list<const MipLevel*> levels,
                         TexelAt&& texelAt) {
    int width = 0;
    int height = 0;
    for (const MipLevel* const level : levels) {
      width = std::max(width, level != nullptr ? level->width : 0);
      height = std::max(height, level != nullptr ? level->height : 0);
    }
    reader_.reserveBytes(mipChainBytes(width, height), elementPlace("materials", material));
    std::vector<std::uint8_t> rgba;
    rgba.reserve(4 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) {
        const auto at = [&](const MipLevel* level, std::size_t channel) {
          if (level == nullptr) return kWhite;
          const auto column = static_cast<std::size_t>(std::int64_t{x} * level->width / width);
          const auto row = static_cast<std::size_t>(std::int64_t{y} * level->height / height);
          const std::size_t texel = row * static_cast<std::size_t>(level->width) + column;
          return level->rgba[4 * texel + channel];
        };
        const std::array<std::uint8_t, 4> texel = texelAt(at);
        rgba.insert(rgba.end(), texel.begin(), texel.end());
      }
    const Texture& sampled = reader_.scene.textures[static_cast<std::size_t>(like.texture)];
    Texture texture;
    texture.name = name;
    texture.nearest = sampled.nearest;
    texture.wrapS = sampled.wrapS;
    texture.wrapT = sampled.wrapT;
    texture.srgb = srgb;
    texture.levels = makeMipChain(width, height, std::move(rgba), srgb);
    reader_.scene.textures.push_back(std::move(texture));
    TextureSlot slot = like;
    slot.texture = static_cast<int>(reader_.scene.textures.size()) - 1;
    return slot;
  }

  /// Makes the textures of a coat and its base, unless the material has got another lobe since.
  void drawCoat(const Coat& coat) {
    const Material& m = reader_.scene.materials[coat.material];
    if (m.lobe != LobeModel::Ggx) return;
    if (coat.cover.used()) drawRoughness(coat);
    if ((coat.cover.used() || m.baseColorTexture.used()) &&
        mappedAlike(m.baseColorTexture, coat.cover))
      drawColor(coat);
  }

  void drawRoughness(const Coat& coat) {
    const MipLevel* const cover = finest(coat.cover);
    const MipLevel* const own = finest(coat.own.slot);
    const MipLevel* const base = finest(coat.base.slot);
    Material& m = reader_.scene.materials[coat.material];
    m.metallicRoughnessTexture = addTexture(
        coat.cover, m.name + ": roughness", coat.material, false, {cover, own, base},
        [&](const auto& at) -> std::array<std::uint8_t, 4> {
          const float g = coat.covers(at(cover, 0)) ? coat.own.factor * of255(at(own, 1))
                                                    : coat.base.factor * of255(at(base, 1));
          return {0, static_cast<std::uint8_t>(std::lround(255.0f * g)), 0, kWhite};
        });
    m.roughnessFactor = 1.0f;
  }

  /// Below the coat the base's reflection is added to each texel, elsewhere it is the lobe's.
  void drawColor(const Coat& coat) {
    using Codes = std::array<std::array<std::uint8_t, 256>, 3>;
    Codes bare{};
    Codes covered{};
    for (std::size_t c = 0; c < 3; ++c)
      for (std::size_t code = 0; code < 256; ++code) {
        const int channel = static_cast<int>(c);
        const float color = coat.baseColor[channel] * linearOfSrgb8()[code];
        const auto encoded = [](float value) {
          return static_cast<std::uint8_t>(
              std::lround(255.0 * srgbFromLinear(std::min(value, 1.0f))));
        };
        bare[c][code] = encoded(color);
        covered[c][code] = encoded(belowCoat(Vec3(color), coat.baseF0)[channel]);
      }
    Material& m = reader_.scene.materials[coat.material];
    const MipLevel* const cover = finest(coat.cover);
    const MipLevel* const base = finest(m.baseColorTexture);
    m.baseColorTexture = addTexture(
        m.baseColorTexture.used() ? m.baseColorTexture : coat.cover, m.name + ": colour",
        coat.material, true, {cover, base}, [&](const auto& at) -> std::array<std::uint8_t, 4> {
          const Codes& codes = coat.covers(at(cover, 0)) ? covered : bare;
          return {codes[0][at(base, 0)], codes[1][at(base, 1)], codes[2][at(base, 2)], at(base, 3)};
        });
    m.baseColor = Vec3(1.0f);
  }

  /// Light goes straight on through a thin surface, coloured by it.
  void setTransmission(const tinygltf::Value& transmission, const std::string& place, Material& m) {
    const auto share = static_cast<float>(numberOr(transmission, "transmissionFactor", 0.0));
    if (!(share > 0.0f)) return;
    noteIgnored(transmission, {"transmissionTexture"}, place);
    if (share < kLeastShare || m.metallicFactor > 0.0f) {
      note(place + ": the transmission is left out, because a sample has one lobe: that of the " +
           (m.metallicFactor > 0.0f ? "metal" : "reflection"));
      return;
    }
    m.lobe = LobeModel::Phong;
    m.refraction = 1.0f;
    m.specularLevel = share;
    m.metallicRoughnessTexture = {};
    m.reflectionTint = Vec3(0.0f);
    m.albedoTint = 1.0f;
    note(place + ": transmits light without bending or scattering it, and mirrors nothing");
  }

  /// A round lobe of the same area stands for one that is stretched.
  void setAnisotropy(const tinygltf::Value& anisotropy, const std::string& place, Material& m) {
    const auto strength = static_cast<float>(numberOr(anisotropy, "anisotropyStrength", 0.0));
    if (!(strength > 0.0f)) return;
    note(place + ": the anisotropic lobe is drawn round, of the same area" +
         (m.metallicRoughnessTexture.used() ? " where the roughness texture is 1" : ""));
    noteIgnored(anisotropy, {"anisotropyTexture"}, place);
    const float alpha = m.roughnessFactor * m.roughnessFactor;
    const float along = glm::mix(alpha, 1.0f, strength * strength);
    m.roughnessFactor = std::pow(alpha * along, 0.25f);
  }

  /// The share of light that metals reflect takes the place of what they emit, too. Files that say
  /// nothing of metal mean rough metals.
  void setEmittingMetal(const std::string& place, Material& m) {
    constexpr float kRough = 0.5f;  // looks much the same as diffuse
    if (m.emissive == Vec3(0.0f) || !(m.metallicFactor > 0.0f)) return;
    const bool plain = !m.emissiveTexture.used() && !m.metallicRoughnessTexture.used();
    if (plain && m.roughnessFactor >= kRough) {
      m.metallicFactor = 0.0f;
      note(place + ": emits light, and so is drawn as no metal");
    } else {
      note(place + ": the light that it emits is left out where it is a metal");
    }
  }

  Material material(const tinygltf::Material& source, const std::string& place, std::size_t index) {
    Material m;
    m.lobe = LobeModel::Ggx;
    m.name = source.name.empty() ? "material " + std::to_string(index) : source.name;
    const tinygltf::PbrMetallicRoughness& pbr = source.pbrMetallicRoughness;
    const std::vector<double>& base = pbr.baseColorFactor;
    m.baseColor =
        Vec3(static_cast<float>(base[0]), static_cast<float>(base[1]), static_cast<float>(base[2]));
    m.baseAlpha = static_cast<float>(base[3]);
    m.metallicFactor = static_cast<float>(pbr.metallicFactor);
    m.roughnessFactor = static_cast<float>(pbr.roughnessFactor);

    const std::string pbrPlace = place + "/pbrMetallicRoughness";
    m.baseColorTexture =
        textures_.slot(pbr.baseColorTexture.index, pbr.baseColorTexture.texCoord,
                       pbr.baseColorTexture.extensions, true, pbrPlace + "/baseColorTexture");
    m.metallicRoughnessTexture = textures_.slot(
        pbr.metallicRoughnessTexture.index, pbr.metallicRoughnessTexture.texCoord,
        pbr.metallicRoughnessTexture.extensions, false, pbrPlace + "/metallicRoughnessTexture");
    m.normalTexture =
        textures_.slot(source.normalTexture.index, source.normalTexture.texCoord,
                       source.normalTexture.extensions, false, place + "/normalTexture");
    m.normalScale = static_cast<float>(source.normalTexture.scale);
    m.emissiveTexture =
        textures_.slot(source.emissiveTexture.index, source.emissiveTexture.texCoord,
                       source.emissiveTexture.extensions, true, place + "/emissiveTexture");
    if (source.occlusionTexture.index >= 0) {
      note(place + ": the occlusion texture is ignored (ambient occlusion comes from the bake)");
    }

    const tinygltf::Value& strength =
        extension(source.extensions, "KHR_materials_emissive_strength");
    const auto emissiveStrength = static_cast<float>(numberOr(strength, "emissiveStrength", 1.0));
    for (int c = 0; c < 3; ++c) {
      m.emissive[c] =
          static_cast<float>(source.emissiveFactor[static_cast<std::size_t>(c)]) * emissiveStrength;
    }

    setEmittingMetal(place, m);

    // Reflectance at normal incidence of the part that is no metal.
    const double ior = numberOr(extension(source.extensions, "KHR_materials_ior"), "ior", 1.5);
    if (ior != 0.0 && ior < 1.0) {
      reader_.fail(place + "/extensions/KHR_materials_ior/ior",
                   std::to_string(ior) + " is not allowed: 0, or 1 and more");
    }
    const tinygltf::Value& specular = extension(source.extensions, "KHR_materials_specular");
    m.dielectricF90 = static_cast<float>(numberOr(specular, "specularFactor", 1.0));
    m.dielectricF0 = dielectricF0(static_cast<float>(ior), m.dielectricF90,
                                  vec3Or(specular, "specularColorFactor", Vec3(1.0f)));
    noteIgnored(specular, {"specularTexture", "specularColorTexture"}, place);
    setAnisotropy(extension(source.extensions, "KHR_materials_anisotropy"), place, m);
    setClearCoat(extension(source.extensions, "KHR_materials_clearcoat"), place, index, m);
    setMetallicTint(m);
    setTransmission(extension(source.extensions, "KHR_materials_transmission"), place, m);
    m.unlit = source.extensions.count("KHR_materials_unlit") > 0;

    if (source.alphaMode == "MASK") {
      m.alphaMode = AlphaMode::Mask;
      m.alphaCutoff = static_cast<float>(source.alphaCutoff);
    } else if (source.alphaMode == "BLEND") {
      m.alphaMode = AlphaMode::Mask;
      m.alphaCutoff = 0.5f;
      note(place + ": alphaMode BLEND is drawn as MASK with cutoff 0.5");
    }
    applyReflectanceExtras(source.extras, m);
    return m;
  }

  Reader& reader_;
  Textures textures_;
  std::vector<Coat> coats_;
};

}  // namespace

bool applyReflectanceExtras(const tinygltf::Value& extras, Material& base) {
  const tinygltf::Value& values = member(extras, "catoptric");
  if (!values.IsObject()) return false;
  float s = specularLevel(base.metallicFactor, base.dielectricF0);
  float g = base.roughnessFactor;
  s = static_cast<float>(numberOr(values, "s", s));
  g = static_cast<float>(numberOr(values, "g", g));
  if (member(values, "n").IsNumber()) {
    g = phongRoughnessFromExponent(static_cast<float>(numberOr(values, "n", 0.0)));
  }
  setReflectance(base, s, g);
  return true;
}

void readMaterials(Reader& reader, bool needDefault) {
  MaterialReader(reader).read(needDefault);
}

}  // namespace catoptric::scene::gltf
