#include "scene/gltf/check.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <vector>

#include "config/json.h"
#include "core/error.h"
#include "core/text.h"

namespace catoptric::scene::gltf {
namespace {

using config::Value;

/// Deeper nesting than any real file has (glTF itself needs 7; extras may go on); ours.
constexpr int kMaxNesting = 100;
constexpr double kMaxIndex = 2147483646.0;
/// Byte counts and offsets: exact in a double.
constexpr double kMaxBytes = 9007199254740991.0;

// ---- One table says what members each object may have ----

enum class Kind { Bool, Integer, Number, String, Numbers, Indices, IndexMap, Object, Array };

struct Table;

struct Rule {
  std::string_view key;
  Kind kind = Kind::Number;
  bool required = false;
  const Table* table = nullptr;  ///< members of an Object or of an Array's items
  std::string_view refers = {};  ///< index into this root array
  double minimum = -1e18;
  double maximum = 1e18;
  std::vector<double> allowed = {};
  std::vector<std::string> words = {};
  std::size_t size = 0;  ///< exact length of Numbers
  bool nonEmpty = false;
};

struct Table {
  std::vector<Rule> rules;
};

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

// glTF 2.0, appendix B (JSON schema), and the extensions that the loader reads.
struct Tables {
  Table asset{{text("version", true), text("minVersion"), text("generator"), text("copyright")}};
  Table buffer{{integer("byteLength", 1, kMaxBytes, true), text("uri"), text("name")}};
  Table bufferView{{index("buffer", "buffers", true), integer("byteOffset", 0, kMaxBytes),
                    integer("byteLength", 1, kMaxBytes, true), integer("byteStride", 4, 252),
                    code("target", {34962, 34963})}};
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
  Table primitive{{{.key = "attributes",
                    .kind = Kind::IndexMap,
                    .required = true,
                    .refers = "accessors",
                    .minimum = 0,
                    .maximum = kMaxIndex},
                   index("indices", "accessors"),
                   index("material", "materials"),
                   code("mode", {0, 1, 2, 3, 4, 5, 6})}};
  Table mesh{{text("name"), array("primitives", primitive, true), numbers("weights", 0)}};
  Table instancing{{{.key = "attributes",
                     .kind = Kind::IndexMap,
                     .required = true,
                     .refers = "accessors",
                     .minimum = 0,
                     .maximum = kMaxIndex}}};
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
  Table materialExtensions{{object("KHR_materials_specular", specular),
                            object("KHR_materials_ior", ior),
                            object("KHR_materials_emissive_strength", emissiveStrength),
                            {.key = "KHR_materials_unlit", .kind = Kind::Object}}};
  Table material{{text("name"), object("pbrMetallicRoughness", pbr),
                  object("normalTexture", textureInfo), object("occlusionTexture", textureInfo),
                  object("emissiveTexture", textureInfo), numbers("emissiveFactor", 3, 0, 1e6),
                  word("alphaMode", {"OPAQUE", "MASK", "BLEND"}), number("alphaCutoff", 0, 1e6),
                  boolean("doubleSided"), object("extensions", materialExtensions)}};
  Table texture{{text("name"), index("sampler", "samplers"), index("source", "images")}};
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

  Tables() {
    // Extras may be anything; only an object's "catoptric" is ours, see checkExtras().
  }
};

const Tables& tables() {
  static const Tables instance;
  return instance;
}

const std::array kKnownExtensions = {
    std::string("KHR_mesh_quantization"), std::string("EXT_mesh_gpu_instancing"),
    std::string("KHR_texture_transform"), std::string("KHR_materials_specular"),
    std::string("KHR_materials_ior"),     std::string("KHR_materials_emissive_strength"),
    std::string("KHR_materials_unlit"),   std::string("KHR_lights_punctual")};

std::string formatted(double value) {
  char out[40];
  std::snprintf(out, sizeof out, "%.9g", value);
  return out;
}

std::string quoted(const std::string& value) {
  constexpr std::size_t kShown = 80;
  return '"' + (value.size() > kShown ? value.substr(0, kShown) + "..." : value) + '"';
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

class Checker {
 public:
  Checker(const Value& root, const std::string& file) : root_(root), file_(file) {}

  void checkRoot() { checkObject(root_, tables().root, ""); }

  [[noreturn]] void failAt(const std::string& place, const std::string& message) const {
    fail(file_, place, message);
  }

  /// Number of elements of a root array.
  std::size_t countOf(std::string_view array) const {
    const Value value = root_.get(std::string(array));
    return value.kind() == Value::Kind::Array ? value.asArray().size() : 0;
  }

  void checkObject(const Value& value, const Table& table, const std::string& place) const {
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

  void checkIndexMap(const Value& value, const Rule& rule, const std::string& place) const {
    require(value, Value::Kind::Object, place);
    for (const std::string& key : value.keys()) {
      checkInteger(value.get(key), rule, place + "/" + key);
    }
  }

  void require(const Value& value, Value::Kind kind, const std::string& place) const {
    if (value.kind() != kind) {
      failAt(place.empty() ? "/" : place,
             std::string("must be ") + nameOf(kind) + ", is " + nameOf(value.kind()));
    }
  }

 private:
  void checkMember(const Value& value, const Rule& rule, const std::string& place) const {
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
      case Kind::String: {
        require(value, Value::Kind::String, place);
        const std::string& word = value.asString();
        if (!rule.words.empty() &&
            std::find(rule.words.begin(), rule.words.end(), word) == rule.words.end()) {
          failAt(place, quoted(word) + " is not one of " + joined(rule.words, ", ") +
                            didYouMean(word, rule.words));
        }
        break;
      }
      case Kind::Numbers: {
        require(value, Value::Kind::Array, place);
        const std::vector<Value>& items = value.asArray();
        if (rule.size > 0 && items.size() != rule.size) {
          failAt(place, "has " + std::to_string(items.size()) + " numbers, " +
                            std::to_string(rule.size) + " are needed");
        }
        for (std::size_t i = 0; i < items.size(); ++i) {
          checkNumber(items[i], rule, place + "/" + std::to_string(i));
        }
        break;
      }
      case Kind::Indices: {
        require(value, Value::Kind::Array, place);
        const std::vector<Value>& items = value.asArray();
        if (rule.nonEmpty && items.empty()) failAt(place, "is empty");
        for (std::size_t i = 0; i < items.size(); ++i) {
          checkInteger(items[i], rule, place + "/" + std::to_string(i));
        }
        break;
      }
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
      case Kind::Array: {
        require(value, Value::Kind::Array, place);
        const std::vector<Value>& items = value.asArray();
        if (rule.nonEmpty && items.empty()) failAt(place, "is empty");
        for (std::size_t i = 0; i < items.size(); ++i) {
          checkObject(items[i], *rule.table, place + "/" + std::to_string(i));
        }
        break;
      }
    }
  }

  void checkNumber(const Value& value, const Rule& rule, const std::string& place) const {
    require(value, Value::Kind::Number, place);
    const double x = value.asNumber();
    if (!std::isfinite(x) || x < rule.minimum || x > rule.maximum) {
      failAt(place, formatted(x) + " is out of range: " + formatted(rule.minimum) + " to " +
                        formatted(rule.maximum) + " is allowed");
    }
  }

  void checkInteger(const Value& value, const Rule& rule, const std::string& place) const {
    require(value, Value::Kind::Number, place);
    const double x = value.asNumber();
    if (x != std::floor(x) || !std::isfinite(x)) {
      failAt(place, formatted(x) + " is not an integer");
    }
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

  const Value& root_;
  const std::string& file_;
};

/// Refuses nesting that would exhaust a recursive parser's stack, before any parser runs.
void checkNesting(std::string_view json, const std::string& file) {
  int depth = 0;
  bool inString = false;
  for (std::size_t i = 0; i < json.size(); ++i) {
    const char c = json[i];
    if (inString) {
      if (c == '\\') ++i;
      if (c == '"') inString = false;
    } else if (c == '"') {
      inString = true;
    } else if (c == '{' || c == '[') {
      if (++depth > kMaxNesting) {
        fail(file, "byte " + std::to_string(i),
             "JSON nested deeper than the " + std::to_string(kMaxNesting) + " levels allowed");
      }
    } else if (c == '}' || c == ']') {
      --depth;
    }
  }
}

void checkExtensions(const Checker& check, const Value& root) {
  for (const char* key : {"extensionsUsed", "extensionsRequired"}) {
    const std::string place = std::string("/") + key;
    const Value list = root.get(key);
    if (list.isNull()) continue;
    check.require(list, Value::Kind::Array, place);
    const std::vector<Value>& items = list.asArray();
    for (std::size_t i = 0; i < items.size(); ++i) {
      const std::string itemPlace = place + "/" + std::to_string(i);
      check.require(items[i], Value::Kind::String, itemPlace);
      const std::string& name = items[i].asString();
      if (!isKnownExtension(name) && std::string_view(key) == "extensionsRequired") {
        check.failAt(itemPlace, "extension " + quoted(name) +
                                    " is required but not supported; supported are " +
                                    joined(kKnownExtensions, ", "));
      }
    }
  }
}

/// asset.version must be 2.x, asset.minVersion at most 2.0.
void checkVersion(const Checker& check, const Value& root) {
  const Value asset = root.get("asset");
  const std::string version = asset.get("version").asString();
  if (version.rfind("2.", 0) != 0) {
    check.failAt("/asset/version", quoted(version) + " is not supported: 2.0 is" +
                                       (version == "1.0" || version == "1"
                                            ? " (convert it: assimp export IN OUT.glb -fglb2)"
                                            : ""));
  }
  if (asset.has("minVersion") && asset.get("minVersion").asString() != "2.0") {
    check.failAt("/asset/minVersion",
                 quoted(asset.get("minVersion").asString()) + " is not supported: 2.0 is");
  }
}

void checkExtras(const Checker& check, const Value& owner, const std::string& place) {
  const Value extras = owner.get("extras");
  if (extras.kind() != Value::Kind::Object || !extras.has("catoptric")) return;
  const std::string ours = place + "/extras/catoptric";
  const Value values = extras.get("catoptric");
  check.checkObject(values, tables().catoptric, ours);
  if (values.has("g") && values.has("n")) {
    check.failAt(ours, "\"g\" and \"n\" are both given; they exclude each other");
  }
  for (const std::string& key : values.keys()) {
    if (key != "s" && key != "g" && key != "n") {
      check.failAt(ours + "/" + key, "unknown; s, g and n are allowed");
    }
  }
}

void checkNodes(const Checker& check, const Value& root, const LoadLimits& limits) {
  const std::vector<Value> none;
  const Value list = root.get("nodes");
  const std::vector<Value>& nodes = list.isNull() ? none : list.asArray();
  if (nodes.size() > limits.maxNodes) {
    check.failAt("/nodes", std::to_string(nodes.size()) + " nodes, more than the " +
                               std::to_string(limits.maxNodes) + " allowed");
  }
  const Value extensions = root.get("extensions");
  std::size_t lightCount = 0;
  if (!extensions.isNull() && extensions.has("KHR_lights_punctual")) {
    lightCount = extensions.get("KHR_lights_punctual").get("lights").asArray().size();
  }
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const Value& node = nodes[i];
    const std::string place = "/nodes/" + std::to_string(i);
    if (node.has("matrix") &&
        (node.has("translation") || node.has("rotation") || node.has("scale"))) {
      check.failAt(place, "has both \"matrix\" and translation, rotation or scale");
    }
    if (node.has("skin") && !node.has("mesh")) check.failAt(place, "has a skin but no mesh");
    checkExtras(check, node, place);
    const Value own = node.get("extensions");
    if (!own.isNull() && own.has("KHR_lights_punctual")) {
      const double light = own.get("KHR_lights_punctual").get("light").asNumber();
      if (light >= static_cast<double>(lightCount)) {
        check.failAt(place + "/extensions/KHR_lights_punctual/light",
                     "index " + formatted(light) + " is out of range: the file has " +
                         std::to_string(lightCount) + " lights");
      }
    }
  }
}

void checkMeshes(const Checker& check, const Value& root) {
  static const Rule targetRule{.key = "targets",
                               .kind = Kind::IndexMap,
                               .refers = "accessors",
                               .minimum = 0,
                               .maximum = kMaxIndex};
  const Value list = root.get("meshes");
  if (list.isNull()) return;
  for (std::size_t m = 0; m < list.asArray().size(); ++m) {
    const Value& mesh = list.asArray()[m];
    const std::vector<Value>& primitives = mesh.get("primitives").asArray();
    std::size_t targetCount = 0;
    for (std::size_t p = 0; p < primitives.size(); ++p) {
      const std::string place = "/meshes/" + std::to_string(m) + "/primitives/" + std::to_string(p);
      std::size_t count = 0;
      if (primitives[p].has("targets")) {
        const Value targets = primitives[p].get("targets");
        check.require(targets, Value::Kind::Array, place + "/targets");
        count = targets.asArray().size();
        for (std::size_t t = 0; t < count; ++t) {
          check.checkIndexMap(targets.asArray()[t], targetRule,
                              place + "/targets/" + std::to_string(t));
        }
      }
      if (p == 0) targetCount = count;
      if (count != targetCount) {
        check.failAt(place + "/targets", "has " + std::to_string(count) +
                                             " morph targets, the mesh's first primitive " +
                                             std::to_string(targetCount));
      }
      // The parser refuses this case with less to go by.
      if (primitives[p].has("indices")) {
        const auto accessor = static_cast<std::size_t>(primitives[p].get("indices").asNumber());
        if (!root.get("accessors").asArray()[accessor].has("bufferView")) {
          check.failAt("/accessors/" + std::to_string(accessor),
                       "holds indices but has no bufferView");
        }
      }
    }
    if (mesh.has("weights") && mesh.get("weights").asArray().size() != targetCount) {
      check.failAt("/meshes/" + std::to_string(m) + "/weights",
                   "has " + std::to_string(mesh.get("weights").asArray().size()) +
                       " numbers, the mesh has " + std::to_string(targetCount) + " morph targets");
    }
  }
}

void checkRest(const Checker& check, const Value& root) {
  if (root.has("scene") &&
      root.get("scene").asNumber() >= static_cast<double>(check.countOf("scenes"))) {
    check.failAt("/scene", "index " + formatted(root.get("scene").asNumber()) +
                               " is out of range: the file has " +
                               std::to_string(check.countOf("scenes")) + " scenes");
  }
  const Value views = root.get("bufferViews");
  for (std::size_t i = 0; !views.isNull() && i < views.asArray().size(); ++i) {
    const Value& view = views.asArray()[i];
    if (!view.has("byteStride")) continue;
    const double stride = view.get("byteStride").asNumber();
    if (std::fmod(stride, 4.0) != 0.0) {
      check.failAt("/bufferViews/" + std::to_string(i) + "/byteStride",
                   formatted(stride) + " is not a multiple of 4");
    }
  }
  const Value materials = root.get("materials");
  for (std::size_t i = 0; !materials.isNull() && i < materials.asArray().size(); ++i) {
    checkExtras(check, materials.asArray()[i], "/materials/" + std::to_string(i));
  }
  const Value cameras = root.get("cameras");
  for (std::size_t i = 0; !cameras.isNull() && i < cameras.asArray().size(); ++i) {
    const Value& camera = cameras.asArray()[i];
    if (!camera.has(camera.get("type").asString())) {
      check.failAt("/cameras/" + std::to_string(i),
                   "\"" + camera.get("type").asString() + "\" is missing");
    }
  }
  const Value animations = root.get("animations");
  for (std::size_t i = 0; !animations.isNull() && i < animations.asArray().size(); ++i) {
    const std::vector<Value>& channels = animations.asArray()[i].get("channels").asArray();
    const std::size_t samplers = animations.asArray()[i].get("samplers").asArray().size();
    for (std::size_t c = 0; c < channels.size(); ++c) {
      if (channels[c].get("sampler").asNumber() >= static_cast<double>(samplers)) {
        check.failAt(
            "/animations/" + std::to_string(i) + "/channels/" + std::to_string(c) + "/sampler",
            "index " + formatted(channels[c].get("sampler").asNumber()) +
                " is out of range: the animation has " + std::to_string(samplers) + " samplers");
      }
    }
  }
}

// ---- URIs ----

int hexDigit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return -1;
}

/// The name under which tinygltf 2.7.0 asks for a URI: it turns '+' into a space, and decodes
/// what is no hexadecimal number to anything. Names only need to be found again.
std::string parserName(const std::string& uri) {
  const auto digit = [](char c) {
    // tinygltf's from_hex
    if (c <= '9' && c >= '0') return static_cast<unsigned char>(c - '0');
    if (c <= 'f' && c >= 'a') return static_cast<unsigned char>(c - 'a' + 10);
    if (c <= 'F' && c >= 'A') return static_cast<unsigned char>(c - 'A' + 10);
    return static_cast<unsigned char>(0);
  };
  std::string result;
  for (std::size_t i = 0; i < uri.size(); ++i) {
    if (uri[i] == '+') {
      result += ' ';
    } else if (uri[i] == '%' && uri.size() > i + 2) {
      result += static_cast<char>((digit(uri[i + 1]) << 4) | digit(uri[i + 2]));
      i += 2;
    } else {
      result += uri[i];
    }
  }
  return result;
}

bool isDataUri(std::string_view uri) {
  return uri.rfind("data:", 0) == 0;
}

External checkUris(const Checker& check, const Value& root, const Container& container,
                   const std::string& file, const LoadLimits& limits) {
  External external;
  const Value buffers = root.get("buffers");
  for (std::size_t i = 0; !buffers.isNull() && i < buffers.asArray().size(); ++i) {
    const Value& buffer = buffers.asArray()[i];
    const std::string place = "/buffers/" + std::to_string(i);
    const auto length = static_cast<std::size_t>(buffer.get("byteLength").asNumber());
    if (length > limits.maxFileBytes) {
      check.failAt(place + "/byteLength", std::to_string(length) + " bytes, more than the " +
                                              std::to_string(limits.maxFileBytes) + " allowed");
    }
    if (!buffer.has("uri")) {
      if (!container.binary || i != 0) {
        check.failAt(place, "has no uri (only the first buffer of a .glb file may do without)");
      }
      if (length > container.bin.size()) {
        check.failAt(place + "/byteLength", std::to_string(length) +
                                                " bytes, but the BIN chunk has " +
                                                std::to_string(container.bin.size()));
      }
      continue;
    }
    const std::string& uri = buffer.get("uri").asString();
    if (isDataUri(uri)) {
      const std::size_t have = decodeDataUri(uri, file, place + "/uri").size();
      if (have != length) {
        check.failAt(place, "byteLength is " + std::to_string(length) + ", but the data URI has " +
                                std::to_string(have) + " bytes");
      }
    } else {
      relativePath(uri, file, place + "/uri");
    }
    // The same file as two buffers of different length: the parser asks by name only.
    const auto [entry, isNew] = external.byParserName.try_emplace(
        parserName(uri), External::Entry{uri, place + "/uri", true, length});
    if (!isNew && !isDataUri(uri) && entry->second.byteLength != length) {
      check.failAt(place + "/byteLength",
                   "two buffers with the uri " + quoted(uri) + " differ in byteLength");
    }
  }
  const Value images = root.get("images");
  for (std::size_t i = 0; !images.isNull() && i < images.asArray().size(); ++i) {
    const Value& image = images.asArray()[i];
    const std::string place = "/images/" + std::to_string(i);
    if (image.has("uri") == image.has("bufferView")) {
      check.failAt(place, image.has("uri") ? "has both a uri and a bufferView"
                                           : "has neither a uri nor a bufferView");
    }
    if (!image.has("uri")) continue;
    const std::string& uri = image.get("uri").asString();
    if (!isDataUri(uri)) {
      relativePath(uri, file, place + "/uri");
    } else if (decodeDataUri(uri, file, place + "/uri").empty()) {
      check.failAt(place + "/uri", "holds no data");
    }
    external.byParserName.try_emplace(parserName(uri),
                                      External::Entry{uri, place + "/uri", false, 0});
  }
  return external;
}

std::uint32_t littleEndian32(std::span<const std::byte> bytes, std::size_t at) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    value |= std::to_integer<std::uint32_t>(bytes[at + i]) << (8 * i);
  }
  return value;
}

}  // namespace

bool isKnownExtension(std::string_view name) {
  return std::find(kKnownExtensions.begin(), kKnownExtensions.end(), name) !=
         kKnownExtensions.end();
}

void fail(const std::string& file, const std::string& place, const std::string& message) {
  throw SceneError(file + ": " + (place.empty() ? "" : place + ": ") + message);
}

Container splitContainer(std::span<const std::byte> bytes, const std::string& file) {
  constexpr std::uint32_t kMagic = 0x46546C67;  // "glTF"
  constexpr std::uint32_t kJson = 0x4E4F534A;
  constexpr std::uint32_t kBin = 0x004E4942;
  const auto textOf = [&](std::size_t offset, std::size_t size) {
    return std::string_view(reinterpret_cast<const char*>(bytes.data()) + offset, size);
  };
  if (bytes.size() < 4 || littleEndian32(bytes, 0) != kMagic) {
    if (bytes.size() < 4) fail(file, "", "is empty or too short for a glTF file");
    return {false, textOf(0, bytes.size()), {}};
  }

  if (bytes.size() < 20) fail(file, "byte 0", "GLB header is cut short");
  const std::uint32_t version = littleEndian32(bytes, 4);
  if (version != 2) {
    fail(file, "byte 4",
         "GLB version " + std::to_string(version) + " is not supported: 2 is" +
             (version == 1 ? " (convert it: assimp export IN OUT.glb -fglb2)" : ""));
  }
  const std::size_t length = littleEndian32(bytes, 8);
  if (length > bytes.size()) {
    fail(file, "byte 8",
         "GLB length says " + std::to_string(length) + " bytes, the file has " +
             std::to_string(bytes.size()));
  }

  Container container;
  container.binary = true;
  std::size_t at = 12;
  for (int chunk = 0; at < length; ++chunk) {
    if (length - at < 8) fail(file, "byte " + std::to_string(at), "GLB chunk header is cut short");
    const std::size_t size = littleEndian32(bytes, at);
    const std::uint32_t type = littleEndian32(bytes, at + 4);
    if (size > length - at - 8) {
      fail(file, "byte " + std::to_string(at),
           "GLB chunk of " + std::to_string(size) + " bytes reaches past the end of the file");
    }
    if (size % 4 != 0) {
      fail(file, "byte " + std::to_string(at),
           "GLB chunk length " + std::to_string(size) + " is not a multiple of 4");
    }
    if (chunk == 0) {
      if (type != kJson) fail(file, "byte " + std::to_string(at), "first GLB chunk is not JSON");
      container.json = textOf(at + 8, size);
    } else if (chunk == 1 && type == kBin) {
      container.bin = bytes.subspan(at + 8, size);
    }
    at += 8 + size;
  }
  if (container.json.empty()) fail(file, "byte 12", "GLB file has no JSON");
  return container;
}

External checkJson(const Container& container, const std::string& file, const LoadLimits& limits) {
  checkNesting(container.json, file);
  Value root;
  try {
    root = config::parseText(std::string(container.json), file);
  } catch (const Error& e) {
    throw SceneError(e.what());
  }
  Checker check(root, file);
  // The version first: an older file fails every other test too, with worse messages.
  check.require(root, Value::Kind::Object, "");
  if (root.get("asset").kind() != Value::Kind::Object ||
      root.get("asset").get("version").kind() != Value::Kind::String) {
    check.failAt("/asset/version", "is missing or not a string: this is no glTF 2.0 file");
  }
  checkVersion(check, root);
  checkExtensions(check, root);
  check.checkRoot();
  checkNodes(check, root, limits);
  checkMeshes(check, root);
  checkRest(check, root);
  return checkUris(check, root, container, file, limits);
}

std::filesystem::path relativePath(const std::string& uri, const std::string& file,
                                   const std::string& place) {
  if (uri.empty()) fail(file, place, "is empty");
  std::string decoded;
  for (std::size_t i = 0; i < uri.size(); ++i) {
    if (uri[i] != '%') {
      decoded += uri[i];
      continue;
    }
    const int high = i + 2 < uri.size() ? hexDigit(uri[i + 1]) : -1;
    const int low = i + 2 < uri.size() ? hexDigit(uri[i + 2]) : -1;
    if (high < 0 || low < 0) fail(file, place, quoted(uri) + ": bad percent encoding");
    decoded += static_cast<char>(high * 16 + low);
    i += 2;
  }
  if (decoded.find('\0') != std::string::npos) fail(file, place, "contains a zero byte");
  const std::size_t colon = decoded.find(':');
  if (colon != std::string::npos && decoded.find('/') > colon) {
    fail(file, place, quoted(uri) + ": only relative paths and data: URIs are supported");
  }
  std::filesystem::path path = std::filesystem::path(decoded).lexically_normal();
  if (path.is_absolute() || path.empty() || *path.begin() == "..") {
    fail(file, place, quoted(uri) + " leaves the folder of the file; copy it there");
  }
  return path;
}

std::string decodeDataUri(std::string_view uri, const std::string& file, const std::string& place) {
  const std::size_t comma = uri.find(',');
  constexpr std::string_view kBase64 = ";base64";
  if (!isDataUri(uri) || comma == std::string_view::npos ||
      uri.substr(0, comma).size() < kBase64.size() ||
      uri.substr(comma - kBase64.size(), kBase64.size()) != kBase64) {
    fail(file, place, "data URIs must be data:TYPE;base64,...");
  }
  std::string_view body = uri.substr(comma + 1);
  while (!body.empty() && body.back() == '=') body.remove_suffix(1);
  if (body.size() % 4 == 1) fail(file, place, "base64 data is cut short");

  std::array<int, 256> digit{};
  digit.fill(-1);
  constexpr std::string_view kDigits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  for (std::size_t i = 0; i < kDigits.size(); ++i) {
    digit[static_cast<unsigned char>(kDigits[i])] = static_cast<int>(i);
  }
  std::string result;
  result.reserve(body.size() / 4 * 3 + 2);
  std::uint32_t bits = 0;
  int count = 0;
  for (std::size_t i = 0; i < body.size(); ++i) {
    const int d = digit[static_cast<unsigned char>(body[i])];
    if (d < 0) {
      fail(file, place, "base64 data has a character that is no base64 at " + std::to_string(i));
    }
    bits = (bits << 6) | static_cast<std::uint32_t>(d);
    if (++count == 4) {
      result += static_cast<char>(bits >> 16);
      result += static_cast<char>((bits >> 8) & 0xFF);
      result += static_cast<char>(bits & 0xFF);
      bits = 0;
      count = 0;
    }
  }
  if (count == 2) result += static_cast<char>((bits >> 4) & 0xFF);
  if (count == 3) {
    result += static_cast<char>((bits >> 10) & 0xFF);
    result += static_cast<char>((bits >> 2) & 0xFF);
  }
  return result;
}

}  // namespace catoptric::scene::gltf
