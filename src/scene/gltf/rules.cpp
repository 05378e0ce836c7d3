#include "scene/gltf/rules.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "core/text.h"

namespace catoptric::scene::gltf {
namespace {

using config::Value;

constexpr double kMaxIndex = 2147483646.0;
/// Byte counts and offsets: exact in a double.
constexpr double kMaxBytes = 9007199254740991.0;
constexpr double kFirstWrapped = 2147483648.0;  // 2^31

Rule index(std::string_view key, std::string_view refers, bool required = false) {
  return {.key = key,
          .kind = Kind::Integer,
          .required = required,
          .refers = refers,
          .minimum = 0,
          .maximum = kMaxIndex};
}
Rule indices(std::string_view key, std::string_view refers, bool required = false) {
  return {.key = key,
          .kind = Kind::Indices,
          .required = required,
          .refers = refers,
          .minimum = 0,
          .maximum = kMaxIndex,
          .nonEmpty = required};
}
Rule integer(std::string_view key, double minimum, double maximum, bool required = false) {
  return {.key = key,
          .kind = Kind::Integer,
          .required = required,
          .minimum = minimum,
          .maximum = maximum};
}
Rule code(std::string_view key, std::vector<double> allowed, bool required = false) {
  return {.key = key, .kind = Kind::Integer, .required = required, .allowed = std::move(allowed)};
}
Rule number(std::string_view key, double minimum = -1e18, double maximum = 1e18,
            bool required = false) {
  return {.key = key,
          .kind = Kind::Number,
          .required = required,
          .minimum = minimum,
          .maximum = maximum};
}
Rule numbers(std::string_view key, std::size_t size, double minimum = -1e18,
             double maximum = 1e18) {
  return {.key = key, .kind = Kind::Numbers, .minimum = minimum, .maximum = maximum, .size = size};
}
Rule boolean(std::string_view key) {
  return {.key = key, .kind = Kind::Bool};
}
Rule text(std::string_view key, bool required = false) {
  return {.key = key, .kind = Kind::String, .required = required};
}
Rule word(std::string_view key, std::vector<std::string> words, bool required = false) {
  return {.key = key, .kind = Kind::String, .required = required, .words = std::move(words)};
}
Rule object(std::string_view key, const Table& table, bool required = false) {
  return {.key = key, .kind = Kind::Object, .required = required, .table = &table};
}
Rule array(std::string_view key, const Table& table, bool required = false) {
  return {
      .key = key, .kind = Kind::Array, .required = required, .table = &table, .nonEmpty = required};
}

// glTF 2.0, appendix B (JSON schema), and the extensions that the loader reads. Extras may be
// anything; only "catoptric" in them is ours.
struct Tables {
  Table asset{{text("version", true), text("minVersion"), text("generator"), text("copyright")}};
  Table fallback{{boolean("fallback")}};
  Table bufferExtensions{{object("EXT_meshopt_compression", fallback)}};
  Table buffer{{integer("byteLength", 1, kMaxBytes, true), text("uri"), text("name"),
                object("extensions", bufferExtensions)}};
  Table meshopt{{index("buffer", "buffers", true), integer("byteOffset", 0, kMaxBytes),
                 integer("byteLength", 1, kMaxBytes, true), integer("byteStride", 1, 256, true),
                 integer("count", 1, kMaxBytes, true),
                 word("mode", {"ATTRIBUTES", "TRIANGLES", "INDICES"}, true),
                 word("filter", {"NONE", "OCTAHEDRAL", "QUATERNION", "EXPONENTIAL"})}};
  Table viewExtensions{{object("EXT_meshopt_compression", meshopt)}};
  Table bufferView{{index("buffer", "buffers", true), integer("byteOffset", 0, kMaxBytes),
                    integer("byteLength", 1, kMaxBytes, true), integer("byteStride", 4, 252),
                    code("target", {34962, 34963}), object("extensions", viewExtensions)}};
  Table sparseIndices{{index("bufferView", "bufferViews", true),
                       integer("byteOffset", 0, kMaxIndex),
                       code("componentType", {5121, 5123, 5125}, true)}};
  Table sparseValues{
      {index("bufferView", "bufferViews", true), integer("byteOffset", 0, kMaxIndex)}};
  Table sparse{{integer("count", 1, kMaxIndex, true), object("indices", sparseIndices, true),
                object("values", sparseValues, true)}};
  Table accessor{{index("bufferView", "bufferViews"), integer("byteOffset", 0, kMaxBytes),
                  code("componentType", {5120, 5121, 5122, 5123, 5125, 5126}, true),
                  boolean("normalized"), integer("count", 1, kMaxBytes, true),
                  word("type", {"SCALAR", "VEC2", "VEC3", "VEC4", "MAT2", "MAT3", "MAT4"}, true),
                  object("sparse", sparse)}};
  Table draco{{index("bufferView", "bufferViews", true),
               {.key = "attributes",
                .kind = Kind::IndexMap,
                .required = true,
                .minimum = 0,
                .maximum = kMaxIndex}}};
  Table primitiveExtensions{{object("KHR_draco_mesh_compression", draco)}};
  Table primitive{{accessorMap("attributes", true), index("indices", "accessors"),
                   index("material", "materials"), code("mode", {0, 1, 2, 3, 4, 5, 6}),
                   object("extensions", primitiveExtensions)}};
  Table mesh{{text("name"), array("primitives", primitive, true), numbers("weights", 0)}};
  Table instancing{{accessorMap("attributes", true)}};
  Table nodeLight{{integer("light", 0, kMaxIndex, true)}};
  Table nodeExtensions{
      {object("EXT_mesh_gpu_instancing", instancing), object("KHR_lights_punctual", nodeLight)}};
  Table catoptric{{number("s", 0, 1), number("g", 0, 1), number("n", 0, 1e12)}};
  Table catoptricLight{{number("radius", 0, 1e6), boolean("baked")}};
  Table extras{{object("catoptric", catoptric)}};
  Table lightExtras{{object("catoptric", catoptricLight)}};
  Table node{{text("name"), indices("children", "nodes"), index("mesh", "meshes"),
              index("skin", "skins"), index("camera", "cameras"), numbers("matrix", 16),
              numbers("translation", 3), numbers("rotation", 4), numbers("scale", 3),
              numbers("weights", 0), object("extensions", nodeExtensions)}};
  Table scene{{text("name"), indices("nodes", "nodes")}};
  Table transform{{numbers("offset", 2, -1e6, 1e6), number("rotation", -1e6, 1e6),
                   numbers("scale", 2, -1e6, 1e6), integer("texCoord", 0, 255)}};
  Table textureExtensions{{object("KHR_texture_transform", transform)}};
  Table textureInfo{{index("index", "textures", true), integer("texCoord", 0, 255),
                     number("scale", -1e6, 1e6), number("strength", 0, 1),
                     object("extensions", textureExtensions)}};
  Table pbr{{numbers("baseColorFactor", 4, 0, 1), object("baseColorTexture", textureInfo),
             number("metallicFactor", 0, 1), number("roughnessFactor", 0, 1),
             object("metallicRoughnessTexture", textureInfo)}};
  Table specular{{number("specularFactor", 0, 1), numbers("specularColorFactor", 3, 0, 1e6),
                  object("specularTexture", textureInfo),
                  object("specularColorTexture", textureInfo)}};
  Table ior{{number("ior", 0, 1e6)}};
  Table emissiveStrength{{number("emissiveStrength", 0, 1e30)}};
  Table clearCoat{{number("clearcoatFactor", 0, 1), number("clearcoatRoughnessFactor", 0, 1),
                   object("clearcoatTexture", textureInfo),
                   object("clearcoatRoughnessTexture", textureInfo),
                   object("clearcoatNormalTexture", textureInfo)}};
  Table transmission{
      {number("transmissionFactor", 0, 1), object("transmissionTexture", textureInfo)}};
  Table anisotropy{{number("anisotropyStrength", 0, 1), object("anisotropyTexture", textureInfo)}};
  Table materialExtensions{{object("KHR_materials_specular", specular),
                            object("KHR_materials_clearcoat", clearCoat),
                            object("KHR_materials_transmission", transmission),
                            object("KHR_materials_anisotropy", anisotropy),
                            object("KHR_materials_ior", ior),
                            object("KHR_materials_emissive_strength", emissiveStrength),
                            {.key = "KHR_materials_unlit", .kind = Kind::Object}}};
  Table material{{text("name"), object("pbrMetallicRoughness", pbr),
                  object("normalTexture", textureInfo), object("occlusionTexture", textureInfo),
                  object("emissiveTexture", textureInfo), numbers("emissiveFactor", 3, 0, 1e6),
                  word("alphaMode", {"OPAQUE", "MASK", "BLEND"}), number("alphaCutoff", 0, 1e6),
                  boolean("doubleSided"), object("extensions", materialExtensions)}};
  Table otherImage{{index("source", "images", true)}};
  Table imageExtensions{
      {object("KHR_texture_basisu", otherImage), object("EXT_texture_webp", otherImage),
       object("EXT_texture_avif", otherImage), object("MSFT_texture_dds", otherImage)}};
  Table texture{{text("name"), index("sampler", "samplers"), index("source", "images"),
                 object("extensions", imageExtensions)}};
  Table sampler{{code("magFilter", {9728, 9729}),
                 code("minFilter", {9728, 9729, 9984, 9985, 9986, 9987}),
                 code("wrapS", {33071, 33648, 10497}), code("wrapT", {33071, 33648, 10497})}};
  Table image{{text("name"), text("uri"), text("mimeType"), index("bufferView", "bufferViews")}};
  Table skin{{text("name"), index("inverseBindMatrices", "accessors"), index("skeleton", "nodes"),
              indices("joints", "nodes", true)}};
  Table perspective{{number("yfov", 1e-6, 3.14159, true), number("znear", 1e-12, 1e18, true),
                     number("zfar", 1e-12), number("aspectRatio", 1e-6)}};
  Table orthographic{{number("xmag"), number("ymag"), number("znear"), number("zfar")}};
  Table camera{{text("name"), word("type", {"perspective", "orthographic"}, true),
                object("perspective", perspective), object("orthographic", orthographic)}};
  Table channelTarget{{index("node", "nodes"), text("path", true)}};
  Table channel{{integer("sampler", 0, kMaxIndex, true), object("target", channelTarget, true)}};
  Table animationSampler{{index("input", "accessors", true), index("output", "accessors", true),
                          word("interpolation", {"LINEAR", "STEP", "CUBICSPLINE"})}};
  Table animation{
      {text("name"), array("channels", channel, true), array("samplers", animationSampler, true)}};
  Table spot{{number("innerConeAngle", 0, 1.5707964), number("outerConeAngle", 0, 1.5707964)}};
  Table light{{text("name"), word("type", {"directional", "point", "spot"}, true),
               numbers("color", 3, 0, 1e9), number("intensity", 0, 1e30), number("range", 0, 1e18),
               object("spot", spot), object("extras", lightExtras)}};
  Table lights{{array("lights", light, true)}};
  Table rootExtensions{{object("KHR_lights_punctual", lights)}};
  Table root{{object("asset", asset, true), integer("scene", 0, kMaxIndex),
              array("buffers", buffer), array("bufferViews", bufferView),
              array("accessors", accessor), array("meshes", mesh), array("nodes", node),
              array("scenes", scene), array("materials", material), array("textures", texture),
              array("samplers", sampler), array("images", image), array("skins", skin),
              array("cameras", camera), array("animations", animation),
              object("extensions", rootExtensions)}};
};

const Tables& tables() {
  static const Tables instance;
  return instance;
}

const char* nameOf(Value::Kind kind) {
  switch (kind) {
    case Value::Kind::Null:
      return "null";
    case Value::Kind::Bool:
      return "a boolean";
    case Value::Kind::Number:
      return "a number";
    case Value::Kind::String:
      return "a string";
    case Value::Kind::Array:
      return "an array";
    case Value::Kind::Object:
      return "an object";
  }
  return "?";
}

}  // namespace

Rule accessorMap(std::string_view key, bool required) {
  return {.key = key,
          .kind = Kind::IndexMap,
          .required = required,
          .refers = "accessors",
          .minimum = 0,
          .maximum = kMaxIndex};
}

const Table& ownExtras() {
  return tables().catoptric;
}

std::string formatted(double value) {
  return fmt::format("{:.9g}", value);
}

std::string quoted(const std::string& value) {
  constexpr std::size_t kShown = 80;
  return '"' + (value.size() > kShown ? value.substr(0, kShown) + "..." : value) + '"';
}

void Checker::checkRoot() const {
  checkObject(root_, tables().root, "");
}

void Checker::failAt(const std::string& place, const std::string& message) const {
  fail(file_, place, message);
}

std::size_t Checker::countOf(std::string_view array) const {
  const Value value = root_.get(std::string(array));
  return value.kind() == Value::Kind::Array ? value.asArray().size() : 0;
}

void Checker::checkObject(const Value& value, const Table& table, const std::string& place) const {
  require(value, Value::Kind::Object, place);
  for (const Rule& rule : table.rules) {
    const std::string key(rule.key);
    if (!value.has(key)) {
      if (rule.required) failAt(place.empty() ? "/" : place, "\"" + key + "\" is missing");
      continue;
    }
    checkMember(value.get(key), rule, place + "/" + key);
  }
  if (value.has("extensions")) {
    require(value.get("extensions"), Value::Kind::Object, place + "/extensions");
  }
}

void Checker::checkIndexMap(const Value& value, const Rule& rule, const std::string& place) const {
  require(value, Value::Kind::Object, place);
  for (const std::string& key : value.keys()) {
    checkInteger(value.get(key), rule, place + "/" + key);
  }
}

void Checker::require(const Value& value, Value::Kind kind, const std::string& place) const {
  if (value.kind() != kind) {
    failAt(place.empty() ? "/" : place,
           std::string("must be ") + nameOf(kind) + ", is " + nameOf(value.kind()));
  }
}

const std::vector<Value>& Checker::items(const Value& value, const Rule& rule,
                                         const std::string& place) const {
  require(value, Value::Kind::Array, place);
  const std::vector<Value>& items = value.asArray();
  if (rule.size > 0 && items.size() != rule.size) {
    failAt(place, "has " + std::to_string(items.size()) + " numbers, " + std::to_string(rule.size) +
                      " are needed");
  }
  if (rule.nonEmpty && items.empty()) failAt(place, "is empty");
  return items;
}

void Checker::checkString(const Value& value, const Rule& rule, const std::string& place) const {
  require(value, Value::Kind::String, place);
  const std::string& word = value.asString();
  if (!rule.words.empty() &&
      std::find(rule.words.begin(), rule.words.end(), word) == rule.words.end()) {
    failAt(place, quoted(word) + " is not one of " + joined(rule.words, ", ") +
                      didYouMean(word, rule.words));
  }
}

void Checker::checkMember(const Value& value, const Rule& rule, const std::string& place) const {
  const auto forEach = [&](const auto& body) {
    const std::vector<Value>& list = items(value, rule, place);
    for (std::size_t i = 0; i < list.size(); ++i) body(list[i], place + "/" + std::to_string(i));
  };
  switch (rule.kind) {
    case Kind::Bool:
      require(value, Value::Kind::Bool, place);
      break;
    case Kind::Integer:
      checkInteger(value, rule, place);
      break;
    case Kind::Number:
      checkNumber(value, rule, place);
      break;
    case Kind::String:
      checkString(value, rule, place);
      break;
    case Kind::Numbers:
      forEach([&](const Value& item, const std::string& at) { checkNumber(item, rule, at); });
      break;
    case Kind::Indices:
      forEach([&](const Value& item, const std::string& at) { checkInteger(item, rule, at); });
      break;
    case Kind::IndexMap:
      checkIndexMap(value, rule, place);
      break;
    case Kind::Object:
      if (rule.table != nullptr) {
        checkObject(value, *rule.table, place);
      } else {
        require(value, Value::Kind::Object, place);
      }
      break;
    case Kind::Array:
      forEach(
          [&](const Value& item, const std::string& at) { checkObject(item, *rule.table, at); });
      break;
  }
}

void Checker::checkNumber(const Value& value, const Rule& rule, const std::string& place) const {
  require(value, Value::Kind::Number, place);
  const double x = value.asNumber();
  if (!std::isfinite(x) || x < rule.minimum || x > rule.maximum) {
    failAt(place, formatted(x) + " is out of range: " + formatted(rule.minimum) + " to " +
                      formatted(rule.maximum) + " is allowed");
  }
  // Of extensions and extras tinygltf keeps integers as int.
  if (x == std::floor(x) && std::abs(x) >= kFirstWrapped) rewrite(value, fmt::format("{:.17e}", x));
}

void Checker::rewrite(const Value& value, std::string text) const {
  const auto [begin, end] = value.textRange();
  if (json_.substr(begin, end - begin) != text) rewrites_.push_back({begin, end, std::move(text)});
}

void Checker::checkInteger(const Value& value, const Rule& rule, const std::string& place) const {
  require(value, Value::Kind::Number, place);
  const double x = value.asNumber();
  if (x != std::floor(x) || !std::isfinite(x)) {
    failAt(place, formatted(x) + " is not an integer");
  }
  checkWholeNumber(x, rule, place);
  rewrite(value, std::to_string(static_cast<std::int64_t>(x)));
}

void Checker::checkWholeNumber(double x, const Rule& rule, const std::string& place) const {
  if (!rule.allowed.empty()) {
    if (std::find(rule.allowed.begin(), rule.allowed.end(), x) == rule.allowed.end()) {
      std::vector<std::string> names;
      for (const double a : rule.allowed) names.push_back(formatted(a));
      failAt(place, formatted(x) + " is not one of " + joined(names, ", "));
    }
    return;
  }
  if (!rule.refers.empty()) {
    const std::size_t count = countOf(rule.refers);
    if (x < 0 || x >= static_cast<double>(count)) {
      failAt(place, "index " + formatted(x) + " is out of range: the file has " +
                        std::to_string(count) + " " + std::string(rule.refers));
    }
    return;
  }
  if (x < rule.minimum || x > rule.maximum) {
    failAt(place, formatted(x) + " is out of range: " + formatted(rule.minimum) + " to " +
                      formatted(rule.maximum) + " is allowed");
  }
}

}  // namespace catoptric::scene::gltf
