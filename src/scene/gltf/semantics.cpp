// What the JSON of a glTF file must hold beyond the types and ranges of its members.
#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "core/error.h"
#include "core/text.h"
#include "scene/gltf/check.h"
#include "scene/gltf/compressed.h"
#include "scene/gltf/rules.h"

namespace catoptric::scene::gltf {
namespace {

using config::Value;

const std::array kKnownExtensions = {
    std::string("KHR_mesh_quantization"),      std::string("EXT_mesh_gpu_instancing"),
    std::string("KHR_texture_transform"),      std::string("KHR_materials_specular"),
    std::string("KHR_materials_ior"),          std::string("KHR_materials_emissive_strength"),
    std::string("KHR_materials_unlit"),        std::string("KHR_materials_clearcoat"),
    std::string("KHR_materials_transmission"), std::string("KHR_materials_anisotropy"),
    std::string("KHR_lights_punctual"),        std::string("EXT_meshopt_compression"),
    std::string("KHR_draco_mesh_compression")};
const std::array kImageExtensions = {
    std::string("KHR_texture_basisu"), std::string("EXT_texture_webp"),
    std::string("EXT_texture_avif"), std::string("MSFT_texture_dds")};

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
      if (!isKnownExtension(name) && !isImageExtension(name) &&
          std::string_view(key) == "extensionsRequired") {
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
    check.failAt("/asset/version", quoted(version) + " is not supported; version 2.0 is" +
                                       (version == "1.0" || version == "1"
                                            ? " (convert it: assimp export IN OUT.glb -fglb2)"
                                            : ""));
  }
  if (asset.has("minVersion")) {
    check.require(asset.get("minVersion"), Value::Kind::String, "/asset/minVersion");
  }
  if (asset.has("minVersion") && asset.get("minVersion").asString() != "2.0") {
    check.failAt("/asset/minVersion",
                 quoted(asset.get("minVersion").asString()) + " is not supported; version 2.0 is");
  }
}

void checkExtras(const Checker& check, const Value& owner, const std::string& place) {
  const Value extras = owner.get("extras");
  if (extras.kind() != Value::Kind::Object || !extras.has("catoptric")) return;
  const std::string ours = place + "/extras/catoptric";
  const Value values = extras.get("catoptric");
  check.checkObject(values, ownExtras(), ours);
  if (values.has("g") && values.has("n")) {
    check.failAt(ours, "has both \"g\" and \"n\"; remove one");
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
  const Rule targetRule = accessorMap("targets", false);
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
      if (primitives[p].has("indices") &&
          !primitives[p].get("extensions").has("KHR_draco_mesh_compression")) {
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

void checkDefaultScene(const Checker& check, const Value& root) {
  if (root.has("scene") &&
      root.get("scene").asNumber() >= static_cast<double>(check.countOf("scenes"))) {
    check.failAt("/scene", "index " + formatted(root.get("scene").asNumber()) +
                               " is out of range: the file has " +
                               std::to_string(check.countOf("scenes")) + " scenes");
  }
}

void checkStrides(const Checker& check, const Value& root) {
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
}

void checkMaterials(const Checker& check, const Value& root) {
  const Value materials = root.get("materials");
  for (std::size_t i = 0; !materials.isNull() && i < materials.asArray().size(); ++i) {
    checkExtras(check, materials.asArray()[i], "/materials/" + std::to_string(i));
  }
}

void checkCameras(const Checker& check, const Value& root) {
  const Value cameras = root.get("cameras");
  for (std::size_t i = 0; !cameras.isNull() && i < cameras.asArray().size(); ++i) {
    const Value& camera = cameras.asArray()[i];
    if (!camera.has(camera.get("type").asString())) {
      check.failAt("/cameras/" + std::to_string(i),
                   "\"" + camera.get("type").asString() + "\" is missing");
    }
  }
}

void checkAnimations(const Checker& check, const Value& root) {
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

}  // namespace

bool isKnownExtension(std::string_view name) {
  return std::find(kKnownExtensions.begin(), kKnownExtensions.end(), name) !=
         kKnownExtensions.end();
}

bool isImageExtension(std::string_view name) {
  return std::ranges::find(kImageExtensions, name) != kImageExtensions.end();
}

Checked checkJson(const Container& container, const std::string& file,
                  const LoadLimits& limits) try {
  checkNesting(container.json, file);
  const Value root = config::parseText(std::string(container.json), file);
  Checked checked;
  Checker check(root, container.json, file, checked.rewrites);
  // The version first: an older file fails every other test too, with worse messages.
  check.require(root, Value::Kind::Object, "");
  if (root.get("asset").kind() != Value::Kind::Object ||
      root.get("asset").get("version").kind() != Value::Kind::String) {
    check.failAt("/asset/version", "is missing or not a string: this is not a glTF 2.0 file");
  }
  checkVersion(check, root);
  checkExtensions(check, root);
  check.checkRoot();
  checkNodes(check, root, limits);
  checkMeshes(check, root);
  checkDefaultScene(check, root);
  checkStrides(check, root);
  checkMaterials(check, root);
  checkCameras(check, root);
  checkAnimations(check, root);
  checkCompressed(check, root, checked.rewrites);
  checked.external = checkUris(root, container, file, limits);
  std::sort(checked.rewrites.begin(), checked.rewrites.end(),
            [](const Rewrite& a, const Rewrite& b) { return a.begin < b.begin; });
  checked.rewrites.erase(
      std::unique(checked.rewrites.begin(), checked.rewrites.end(),
                  [](const Rewrite& a, const Rewrite& b) { return a.begin == b.begin; }),
      checked.rewrites.end());
  return checked;
} catch (const UsageError& e) {
  throw SceneError(e.what());  // what JSON itself says is wrong is wrong with the scene
}

}  // namespace catoptric::scene::gltf
