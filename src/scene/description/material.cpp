// Materials of scene descriptions and the textures they name.
#include <algorithm>
#include <cmath>
#include <exception>

#include "core/error.h"
#include "core/file.h"
#include "core/parallel.h"
#include "core/text.h"
#include "image/image.h"
#include "scene/description/description.h"
#include "scene/finish.h"
#include "scene/procedural/procedural.h"
#include "scene/reflectance.h"
#include "scene/texture.h"

namespace catoptric::scene {
namespace {

using config::Value;

Wrap wrapOf(const std::string& name) {
  return name == "clamp"    ? Wrap::ClampToEdge
         : name == "mirror" ? Wrap::MirroredRepeat
                            : Wrap::Repeat;
}

/// uv' = offset + rotation * (scale * uv), counter-clockwise with v pointing up in the picture.
glm::mat3x2 uvTransform(const Value& material) {
  Vec2 scale(1.0f);
  if (material.has("uv_scale")) {
    const Value value = material.get("uv_scale");
    if (value.kind() == Value::Kind::Array) {
      const std::vector<float> v = value.asFloats(2);
      scale = {v[0], v[1]};
    } else {
      scale = Vec2(static_cast<float>(value.asNumber()));
    }
  }
  Vec2 offset(0.0f);
  if (material.has("uv_offset")) {
    const std::vector<float> v = material.get("uv_offset").asFloats(2);
    offset = {v[0], v[1]};
  }
  const double angle = material.has("uv_rotate")
                           ? material.get("uv_rotate").asNumber() * std::numbers::pi / 180.0
                           : 0.0;
  const auto c = static_cast<float>(std::cos(angle));
  const auto s = static_cast<float>(std::sin(angle));
  return {c * scale.x, -s * scale.x, s * scale.y, c * scale.y, offset.x, offset.y};
}

}  // namespace

MaterialLibrary::MaterialLibrary(Scene& scene, Value definitions, std::filesystem::path folder,
                                 const LoadLimits& limits, config::Errors& errors)
    : scene_(scene),
      definitions_(std::move(definitions)),
      folder_(std::move(folder)),
      limits_(limits) {
  // All definitions are checked, those that nothing uses too.
  if (definitions_.kind() != Value::Kind::Object) return;
  for (const std::string& name : definitions_.keys())
    errors.add(config::check(definitions_.get(name), materialSchema()));
}

int MaterialLibrary::plain() {
  const auto [entry, isNew] =
      byKey_.try_emplace("plain", static_cast<int>(scene_.materials.size()));
  if (isNew) {
    Material material;
    material.name = "plain";
    material.baseColor = Vec3(0.8f);
    scene_.materials.push_back(material);
  }
  return entry->second;
}

void MaterialLibrary::requireDefined(const Value& nameValue) const {
  const std::string& name = nameValue.asString();
  std::vector<std::string> names;
  if (definitions_.kind() == Value::Kind::Object) names = definitions_.keys();
  if (std::find(names.begin(), names.end(), name) != names.end()) return;
  nameValue.fail(
      "there is no material \"" + name + "\"" + didYouMean(name, names) +
      (names.empty() ? "; \"materials\" defines none" : "; defined: " + joined(names, ", ")));
}

int MaterialLibrary::materialOf(const Value& nameOrInline, int base) {
  Value definition = nameOrInline;
  std::string name = "inline";
  if (nameOrInline.kind() == Value::Kind::String) {
    name = nameOrInline.asString();
    requireDefined(nameOrInline);
    definition = definitions_.get(name);
  } else {
    config::require(definition, materialSchema());
  }
  const bool keep = definition.has("keep") && definition.get("keep").asBool();
  if (keep && base == kNone) {
    definition.get("keep").fail("\"keep\" is only for \"materials\" of an asset");
  }
  // Named materials are one each; inline ones are shared when their text and base are the same.
  const std::string key = (keep ? std::to_string(base) + " " : std::string()) +
                          (name == "inline" ? "inline " + definition.dump() : "name " + name);
  if (const auto found = byKey_.find(key); found != byKey_.end()) return found->second;

  Material start;
  if (keep) {
    start = scene_.materials[static_cast<std::size_t>(base)];
  } else {
    start.name = name;
  }
  Material material = read(definition, start);
  const int index = static_cast<int>(scene_.materials.size());
  scene_.materials.push_back(std::move(material));
  byKey_.emplace(key, index);
  return index;
}

namespace {

/// g from "g", its other name "roughness", or "n"; `otherwise` without them.
float roughnessOf(const Value& value, float otherwise) {
  std::string first;
  float g = otherwise;
  for (const std::string name : {"g", "roughness", "n"}) {
    if (!value.has(name)) continue;
    if (!first.empty()) value.fail("has both \"" + first + "\" and \"" + name + "\"; remove one");
    first = name;
    const auto number = static_cast<float>(value.get(name).asNumber());
    g = name == "n" ? phongRoughnessFromExponent(number) : number;
  }
  return g;
}

/// Of a material of s and g.
void setRefraction(Material& m, const Value& value, float s, float g) {
  const Value index = value.get("refraction");
  m.refraction = static_cast<float>(index.asNumber());
  if (!(s > 0.0f))
    index.fail("a material that refracts needs an \"s\" above 0, the part that is refracted");
  if (g > kMirrorPhongRoughness)
    index.fail("a refractive material must not be glossy: \"g\" may be at most 0.05");
}

}  // namespace

Material MaterialLibrary::read(const Value& value, Material m) {
  const auto number = [&](const char* name) {
    return static_cast<float>(config::valueOr(value, materialSchema(), name).asNumber());
  };
  if (value.has("base_color")) m.baseColor = colorOf(value.get("base_color"));

  // Textures; one transform for all.
  const glm::mat3x2 transform = uvTransform(value);
  const bool moves = value.has("uv_scale") || value.has("uv_offset") || value.has("uv_rotate");
  const auto place = [&](TextureSlot& slot, int index) { slot = {index, 0, transform}; };
  if (value.has("texture")) {
    const Value source = value.get("texture");
    place(m.baseColorTexture, texture(source, true, value));
  } else if (moves) {
    m.baseColorTexture.transform = transform;
  }
  if (value.has("normal_map")) {
    place(m.normalTexture, normalTexture(value, value.get("texture")));
  } else if (moves) {
    m.normalTexture.transform = transform;
  }
  if (value.has("normal_scale")) m.normalScale = number("normal_scale");
  if (value.has("emissive_texture")) {
    place(m.emissiveTexture, texture(value.get("emissive_texture"), true, value));
  }

  // Reflection: s and g (or roughness), or metallic and roughness
  const bool papers = value.has("s") || value.has("g") || value.has("n") || value.has("tint") ||
                      value.has("refraction");
  const bool gltf = value.has("metallic") || (value.has("roughness") && !value.has("s")) ||
                    value.has("ior") || value.has("specular") ||
                    value.has("metallic_roughness_map");
  if (papers && gltf) {
    value.fail(
        "mixes \"s\", \"g\", \"n\", \"tint\", \"refraction\" with \"metallic\", \"ior\", "
        "\"specular\", \"metallic_roughness_map\" (\"roughness\" goes with these, or with \"s\"); "
        "remove those of one kind");
  }
  if (gltf) {
    if (value.has("metallic")) m.metallicFactor = number("metallic");
    if (value.has("roughness")) m.roughnessFactor = number("roughness");
    if (value.has("ior") || value.has("specular")) {
      m.dielectricF90 = number("specular");
      m.dielectricF0 = dielectricF0(number("ior"), m.dielectricF90);
    }
    if (value.has("metallic_roughness_map")) {
      if (!value.has("metallic")) m.metallicFactor = 1.0f;
      place(m.metallicRoughnessTexture, texture(value.get("metallic_roughness_map"), false, value));
    }
    setMetallicTint(m);
    m.lobe = LobeModel::Ggx;
  }
  if (papers) {
    const bool keep = value.has("keep") && value.get("keep").asBool();
    float s = keep ? specularLevel(m.metallicFactor, m.dielectricF0) : 0.0f;
    float g = keep && !value.has("s") ? m.roughnessFactor : 0.0f;
    if (value.has("s")) s = number("s");
    g = roughnessOf(value, g);
    setReflectance(m, s, g);
    if (!keep || value.has("tint")) {
      m.reflectionTint = value.has("tint") ? colorOf(value.get("tint")) : Vec3(1.0f);
      m.albedoTint = 0.0f;
    }
    if (value.has("refraction")) setRefraction(m, value, s, g);
  }

  if (value.has("lobe"))
    m.lobe = value.get("lobe").asString() == "ggx" ? LobeModel::Ggx : LobeModel::Phong;

  if (value.has("emissive")) m.emissive = colorOf(value.get("emissive"));
  if (value.has("emissive_texture") && !value.has("emissive")) m.emissive = Vec3(1.0f);
  if (value.has("emissive_strength")) m.emissive *= number("emissive_strength");
  if (value.has("alpha_cutoff")) {
    m.alphaMode = AlphaMode::Mask;
    m.alphaCutoff = number("alpha_cutoff");
  }
  if (value.has("unlit")) m.unlit = value.get("unlit").asBool();
  return m;
}

int MaterialLibrary::reflectiveOf(int index, const Value& reflective) {
  const Material& original = scene_.materials[static_cast<std::size_t>(index)];
  float s = 0.0f;
  float g = original.roughnessFactor;
  if (reflective.kind() == Value::Kind::Object) {
    for (const std::string& key : reflective.keys()) {
      if (key != "s" && key != "g" && key != "roughness" && key != "n") {
        reflective.get(key).fail("unknown name \"" + key + "\"; allowed: s, g, roughness, n");
      }
      const double number = reflective.get(key).asNumber();
      if (number < 0.0 || (key != "n" && number > 1.0)) {
        reflective.get(key).fail(reflective.get(key).dump() + " is out of range");
      }
    }
    s = reflective.has("s") ? static_cast<float>(reflective.get("s").asNumber())
                            : specularLevel(original.metallicFactor, original.dielectricF0);
    g = roughnessOf(reflective, g);
  }
  // Without any of them the lobe stays the material's own
  const bool own = reflective.kind() == Value::Kind::Object && reflective.keys().empty();
  const std::string key = "reflective " + std::to_string(index) + " " + std::to_string(s) + " " +
                          std::to_string(g) + (own ? " own" : "");
  const auto [entry, isNew] = byKey_.try_emplace(key, static_cast<int>(scene_.materials.size()));
  if (isNew) {
    Material copy = original;
    setReflectance(copy, s, g);
    if (own) copy.lobe = original.lobe;
    scene_.materials.push_back(std::move(copy));
  }
  return entry->second;
}

int MaterialLibrary::addJob(const std::string& key, TextureJob job) {
  const auto [entry, isNew] = textures_.try_emplace(key, static_cast<int>(scene_.textures.size()));
  if (isNew) {
    scene_.textures.emplace_back();
    job.texture = entry->second;
    jobs_.push_back(std::move(job));
  }
  return entry->second;
}

int MaterialLibrary::texture(const Value& source, bool srgb, const Value& material) {
  TextureJob job;
  job.source = source;
  const std::string filter = config::valueOr(material, materialSchema(), "filter").asString();
  const std::string wrap = config::valueOr(material, materialSchema(), "wrap").asString();
  std::string key = std::string(srgb ? "srgb " : "linear ") + filter + " " + wrap + " ";
  if (source.kind() == Value::Kind::Object) {
    job.kind = TextureJob::Kind::Procedural;
    // Checked at once, made later.
    const std::string name = source.get("procedural").asString();
    const std::vector<std::string>& names = proceduralNames();
    if (std::find(names.begin(), names.end(), name) == names.end()) {
      source.get("procedural")
          .fail("there is no procedural texture \"" + name + "\"" + didYouMean(name, names) +
                "; known: " + joined(names, ", "));
    }
    config::require(source, proceduralSchema(name));
    key += "procedural " + source.dump();
  } else {
    job.kind = TextureJob::Kind::File;
    job.file = describedFile(source, folder_, limits_);
    key += "file " + job.file.string();
  }
  const int index = addJob(key, job);
  Texture& texture = scene_.textures[static_cast<std::size_t>(index)];
  texture.name = job.kind == TextureJob::Kind::Procedural ? source.get("procedural").asString()
                                                          : source.asString();
  texture.srgb = srgb;
  texture.nearest = filter == "nearest";
  texture.wrapS = wrapOf(wrap);
  texture.wrapT = wrapOf(wrap);
  return index;
}

int MaterialLibrary::normalTexture(const Value& material, const Value& colorSource) {
  const Value value = material.get("normal_map");
  if (value.kind() == Value::Kind::String && value.asString() != "match") {
    return texture(value, false, material);
  }
  TextureJob job;
  job.kind = TextureJob::Kind::NormalMap;
  if (value.kind() == Value::Kind::String) {
    if (colorSource.kind() != Value::Kind::Object) {
      value.fail(
          "\"match\" needs a procedural \"texture\", from whose heights it makes the normal map");
    }
    job.source = colorSource;
  } else {
    job.source = value;
    if (value.has("strength")) job.strength = static_cast<float>(value.get("strength").asNumber());
  }
  const std::string name = job.source.get("procedural").asString();
  const std::vector<std::string>& names = proceduralNames();
  if (std::find(names.begin(), names.end(), name) == names.end()) {
    job.source.get("procedural")
        .fail("there is no procedural texture \"" + name + "\"" + didYouMean(name, names) +
              "; known: " + joined(names, ", "));
  }
  config::require(job.source, proceduralSchema(name));
  const int index =
      addJob("normals " + std::to_string(job.strength) + " " + job.source.dump(), job);
  Texture& texture = scene_.textures[static_cast<std::size_t>(index)];
  texture.name = name + " normals";
  texture.srgb = false;
  return index;
}

void MaterialLibrary::finish() {
  // A procedural texture that serves as colour and as normals is made once.
  struct Picture {
    std::vector<std::size_t> jobs;
    std::exception_ptr error;
  };
  std::map<std::string, std::size_t> bySource;
  std::vector<Picture> pictures;
  for (std::size_t j = 0; j < jobs_.size(); ++j) {
    const std::string key = jobs_[j].kind == TextureJob::Kind::File
                                ? "file " + jobs_[j].file.string()
                                : "procedural " + jobs_[j].source.dump();
    const auto [entry, isNew] = bySource.try_emplace(key, pictures.size());
    if (isNew) pictures.emplace_back();
    pictures[entry->second].jobs.push_back(j);
  }
  const auto make = [&](const Picture& picture) {
    const TextureJob& first = jobs_[picture.jobs.front()];
    image::Image8 image;
    std::vector<float> height;
    if (first.kind == TextureJob::Kind::File) {
      std::vector<std::byte> bytes;
      try {
        bytes = readFile(first.file, limits_.maxFileBytes);
      } catch (const Error& e) {
        first.source.fail(std::string(e.what()) + kAssetHint);
      }
      image = image::decodeImage8(bytes, first.source.place().text() + ": " + first.file.string(),
                                  limits_.maxTexturePixels);
    } else {
      ProceduralImage made = makeProcedural(first.source);
      image = {made.size, made.size, std::move(made.rgba)};
      height = std::move(made.height);
    }
    for (const std::size_t j : picture.jobs) {
      const TextureJob& job = jobs_[j];
      Texture& texture = scene_.textures[static_cast<std::size_t>(job.texture)];
      std::vector<std::uint8_t> rgba = job.kind == TextureJob::Kind::NormalMap
                                           ? normalMapFromHeight(height, image.width, job.strength)
                                           : image.rgba;
      texture.levels = makeMipChain(image.width, image.height, std::move(rgba), texture.srgb);
    }
  };
  parallelFor(pictures.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t p = begin; p < end; ++p) {
      try {
        make(pictures[p]);
      } catch (...) {
        pictures[p].error = std::current_exception();
      }
    }
  });
  config::Errors errors;
  for (const Picture& picture : pictures) {
    if (picture.error) errors.collect([&] { std::rethrow_exception(picture.error); });
  }
  errors.throwIfAny();
  jobs_.clear();
}

}  // namespace catoptric::scene
