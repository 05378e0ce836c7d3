// glTF files as parts of a described scene.
#include <algorithm>

#include "core/parallel.h"
#include "core/text.h"
#include "scene/animate.h"
#include "scene/description/composer.h"

namespace catoptric::scene {
namespace {

using config::Value;

/// Bounds of an asset's objects at rest.
void measure(Asset& asset) {
  if (asset.bounded) return;
  asset.bounded = true;
  const Scene& scene = asset.scene;
  const Pose pose = poseAt(scene, 0.0);
  const auto at = [](const auto& items, int i) -> const auto& {
    return items[static_cast<std::size_t>(i)];
  };
  for (const Object& object : scene.objects) {
    const Mesh& mesh = at(scene.meshes, object.mesh);
    Box3 box;
    const int skinIndex = object.node == kNone ? kNone : at(scene.nodes, object.node).skin;
    if (skinIndex != kNone && !mesh.joints.empty()) {
      const Skin& skin = at(scene.skins, skinIndex);
      for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
        Vec3 sum(0.0f);
        for (int k = 0; k < 4; ++k) {
          const std::size_t joint = mesh.joints[v][k];
          const Mat4 m = at(pose.worldFromNode, skin.joints[joint]) * skin.inverseBind[joint];
          sum += mesh.weights[v][k] * Vec3(m * Vec4(mesh.positions[v], 1.0f));
        }
        box.extend(sum);
      }
    } else {
      const Mat4 world = (object.node == kNone ? Mat4(1.0f) : at(pose.worldFromNode, object.node)) *
                         object.nodeFromInstance;
      for (const Vec3& p : mesh.positions) box.extend(Vec3(world * Vec4(p, 1.0f)));
    }
    asset.bounds.push_back(box);
  }
}

void shift(TextureSlot& slot, int by) {
  if (slot.used()) slot.texture += by;
}

}  // namespace

void Composer::loadAssets() {
  std::vector<Asset*> assets;
  for (auto& [path, asset] : assets_) assets.push_back(&asset);
  parallelFor(assets.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      try {
        assets[i]->scene = loadGltf(assets[i]->file, limits_);
      } catch (...) {
        assets[i]->error = std::current_exception();
      }
    }
  });
  config::Errors errors;
  for (const Asset* asset : assets) {
    if (asset->error) errors.collect([&] { std::rethrow_exception(asset->error); });
  }
  errors.throwIfAny();
}

std::vector<bool> Composer::wantedObjects(const Value& object, const Asset& asset) const {
  std::vector<bool> wanted(asset.scene.objects.size(), true);
  if (!object.has("nodes")) return wanted;
  std::vector<bool> nodes(asset.scene.nodes.size(), false);
  for (const Value& pattern : object.get("nodes").asArray()) {
    bool matched = false;
    for (std::size_t n = 0; n < nodes.size(); ++n) {
      if (!matchesPattern(asset.scene.nodes[n].name, pattern.asString())) continue;
      nodes[n] = true;
      matched = true;
    }
    if (!matched) {
      std::vector<std::string> names;
      for (const Node& node : asset.scene.nodes) names.push_back(node.name);
      pattern.fail("no node of " + asset.file.string() + " matches " + pattern.dump() +
                   didYouMean(pattern.asString(), names) + "; it has: " + joined(names, ", "));
    }
  }
  for (std::size_t n = 0; n < nodes.size(); ++n) {
    const int parent = asset.scene.nodes[n].parent;
    if (parent != kNone && nodes[static_cast<std::size_t>(parent)]) nodes[n] = true;
  }
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    const int node = asset.scene.objects[i].node;
    wanted[i] = node != kNone && nodes[static_cast<std::size_t>(node)];
  }
  return wanted;
}

void Composer::append(Asset& asset) {
  if (asset.appended) return;
  asset.appended = true;
  asset.firstMesh = static_cast<int>(scene_.meshes.size());
  asset.firstMaterial = static_cast<int>(scene_.materials.size());
  const int firstTexture = static_cast<int>(scene_.textures.size());
  std::move(asset.scene.meshes.begin(), asset.scene.meshes.end(),
            std::back_inserter(scene_.meshes));
  std::move(asset.scene.textures.begin(), asset.scene.textures.end(),
            std::back_inserter(scene_.textures));
  for (Material material : asset.scene.materials) {
    shift(material.baseColorTexture, firstTexture);
    shift(material.emissiveTexture, firstTexture);
    shift(material.normalTexture, firstTexture);
    shift(material.metallicRoughnessTexture, firstTexture);
    scene_.materials.push_back(std::move(material));
  }
  for (const std::string& note : asset.scene.notes) {
    scene_.notes.push_back(asset.file.filename().string() + ": " + note);
  }
}

std::vector<int> Composer::overriddenMaterials(const Value& object, const Asset& asset) {
  const std::size_t count = asset.scene.materials.size();
  std::vector<int> result(count, kNone);
  if (object.has("materials")) {
    const Value overrides = object.get("materials");
    for (const std::string& pattern : overrides.keys()) {
      bool matched = false;
      for (std::size_t m = 0; m < count; ++m) {
        if (!matchesPattern(asset.scene.materials[m].name, pattern)) continue;
        matched = true;
        if (result[m] == kNone) {
          result[m] = materials_->materialOf(overrides.get(pattern),
                                             asset.firstMaterial + static_cast<int>(m));
        }
      }
      if (!matched) {
        std::vector<std::string> names;
        for (const Material& material : asset.scene.materials) names.push_back(material.name);
        overrides.get(pattern).fail("no material of " + asset.file.string() + " matches \"" +
                                    pattern + "\"" + didYouMean(pattern, names) +
                                    "; it has: " + joined(names, ", "));
      }
    }
  }
  for (std::size_t m = 0; m < count; ++m) {
    if (result[m] != kNone) continue;
    const int own = asset.firstMaterial + static_cast<int>(m);
    result[m] = object.has("material") ? materials_->materialOf(object.get("material"), own) : own;
  }
  return result;
}

void Composer::addAsset(const Value& object, int self, const std::string& name) {
  Asset& asset =
      assets_.at(describedFile(object.get("asset"), file_.parent_path(), limits_).string());
  if (object.has("morph")) object.get("morph").fail("\"morph\" needs a \"shape\"");
  const std::vector<bool> wanted = wantedObjects(object, asset);
  // Bounds need the meshes, which move away at first use: taken now for any object that needs them
  if (!asset.appended && anyFits(root_.get("objects").asArray(), asset.file)) measure(asset);
  int root = self;
  if (object.has("fit") || object.has("anchor")) {
    Box3 bounds;
    for (std::size_t i = 0; i < wanted.size(); ++i) {
      if (wanted[i]) bounds.extend(asset.bounds[i]);
    }
    root = fitted(object, self, bounds);
  }
  append(asset);
  copyAsset(object, asset, root, name, wanted, overriddenMaterials(object, asset));
}

void Composer::copyAsset(const Value& object, const Asset& asset, int root, const std::string& name,
                         const std::vector<bool>& wanted, const std::vector<int>& materials) {
  const int firstNode = static_cast<int>(scene_.nodes.size());
  const int firstSkin = static_cast<int>(scene_.skins.size());
  for (Node node : asset.scene.nodes) {
    node.parent = node.parent == kNone ? root : node.parent + firstNode;
    if (node.skin != kNone) node.skin += firstSkin;
    addNode(std::move(node), object);
  }
  for (Skin skin : asset.scene.skins) {
    for (int& joint : skin.joints) joint += firstNode;
    scene_.skins.push_back(std::move(skin));
  }
  const std::size_t firstObject = scene_.objects.size();
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    if (!wanted[i]) continue;
    Object copy = asset.scene.objects[i];
    copy.name = name + "/" + copy.name;
    copy.mesh += asset.firstMesh;
    copy.node = copy.node == kNone ? root : copy.node + firstNode;
    copy.material =
        marked(object, copy.material == kNone ? materials_->plain()
                                              : materials[static_cast<std::size_t>(copy.material)]);
    scene_.objects.push_back(std::move(copy));
  }
  checkMark(object, firstObject);
  if (!object.has("lights") || object.get("lights").asBool()) {
    for (Light light : asset.scene.lights) {
      light.node = light.node == kNone ? root : light.node + firstNode;
      scene_.lights.push_back(std::move(light));
    }
  }
  for (CameraDefinition camera : asset.scene.cameras) {
    camera.node = camera.node == kNone ? root : camera.node + firstNode;
    scene_.cameras.push_back(std::move(camera));
  }
  if (!object.has("animated") || object.get("animated").asBool()) {
    for (AnimationChannel channel : asset.scene.animation) {
      channel.node += firstNode;
      scene_.animation.push_back(std::move(channel));
    }
  }
}

bool Composer::anyFits(const std::vector<Value>& objects, const std::filesystem::path& file) const {
  return std::any_of(objects.begin(), objects.end(), [&](const Value& object) {
    if ((object.has("fit") || object.has("anchor")) && object.has("asset") &&
        describedFile(object.get("asset"), file_.parent_path(), limits_) == file) {
      return true;
    }
    return object.has("children") && anyFits(object.get("children").asArray(), file);
  });
}

}  // namespace catoptric::scene
