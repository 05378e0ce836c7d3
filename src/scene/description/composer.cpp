#include "scene/description/composer.h"

#include <algorithm>

#include "core/error.h"
#include "core/nearest_file.h"
#include "core/text.h"
#include "scene/finish.h"

namespace catoptric::scene {
namespace {

using config::Value;

constexpr int kMaxDepth = 32;  ///< of children

bool visible(const Value& object) {
  return !object.has("visible") || object.get("visible").asBool();
}

/// What a shape's vertices and triangles take; its morph targets have arrays like its own.
std::size_t meshBytes(const Mesh& mesh) {
  return mesh.positions.size() * (2 * sizeof(Vec3) + sizeof(Vec2)) *
             (1 + mesh.morphTargets.size()) +
         mesh.indices.size() * sizeof(std::uint32_t);
}

}  // namespace

Scene Composer::compose() {
  // All is checked that can be before anything is made
  config::Errors errors;
  errors.add(config::check(root_, sceneSchema()));
  if (root_.kind() != Value::Kind::Object || root_.get("objects").kind() != Value::Kind::Array)
    errors.throwIfAny();
  materials_ = std::make_unique<MaterialLibrary>(scene_, root_.get("materials"),
                                                 file_.parent_path(), limits_, errors);
  checkObjects(root_.get("objects").asArray(), 0, errors);
  addMissingAssets(errors);
  if (errors.any())  // names of materials are looked up later: not reached
    for (const Value& used : usedMaterials_)
      if (used.kind() == Value::Kind::String)
        errors.collect([&] { materials_->requireDefined(used); });
  errors.throwIfAny();

  scene_.source = file_;
  scene_.name = root_.has("name") ? root_.get("name").asString() : file_.stem().string();
  loadAssets();
  addAll(root_.get("objects").asArray(), kNone, errors);
  errors.throwIfAny();
  // An empty list is a scene of the environment alone
  if (scene_.objects.empty() && !root_.get("objects").asArray().empty()) {
    root_.get("objects").fail("the scene has no visible object");
  }
  addLights(errors);
  addCameras(errors);
  addAnimations(errors);
  errors.collect([&] { setSurroundings(); });
  errors.throwIfAny();
  materials_->finish();
  if (config::valueOr(root_, sceneSchema(), "dielectrics").asString() == "on")
    letDielectricsReflect(scene_);
  checkSize();
  return std::move(scene_);
}

void Composer::checkObjects(const std::vector<Value>& objects, int depth, config::Errors& errors) {
  for (const Value& object : objects) {
    if (depth > kMaxDepth)
      object.fail("children are nested deeper than " + std::to_string(kMaxDepth) + " levels");
    errors.collect([&] { checkObject(object, errors); });
    if (object.has("children") && object.get("children").kind() == Value::Kind::Array)
      checkObjects(object.get("children").asArray(), depth + 1, errors);
  }
}

void Composer::checkObject(const Value& object, config::Errors& errors) {
  std::string shape;
  if (object.has("shape")) {
    shape = object.get("shape").asString();
    const std::vector<std::string>& names = shapeNames();
    if (std::find(names.begin(), names.end(), shape) == names.end()) {
      object.get("shape").fail("there is no shape \"" + shape + "\"" + didYouMean(shape, names) +
                               "; known: " + joined(names, ", "));
    }
    if (object.has("asset")) object.fail("has both \"asset\" and \"shape\"; remove one");
  }
  config::require(object, objectSchema(shape));
  const Value material = object.get("material");
  if (material.kind() == Value::Kind::Object) errors.add(config::check(material, materialSchema()));
  if (visible(object)) {
    if (object.has("material")) usedMaterials_.push_back(material);
    if (object.has("materials"))
      for (const std::string& pattern : object.get("materials").keys())
        usedMaterials_.push_back(object.get("materials").get(pattern));
  }
  if (object.has("asset") && visible(object)) {
    const std::filesystem::path relative(object.get("asset").asString());
    const std::filesystem::path path =
        describedFile(object.get("asset"), file_.parent_path(), limits_);
    const auto [entry, isNew] = assets_.try_emplace(path.string());
    if (isNew) {
      entry->second.file = path;
      // What is made by a script may not be made yet.
      if (!std::filesystem::exists(path)) {
        if (*relative.begin() == "assets" && nearestFile(path).empty())
          missingAssets_.push_back(object.get("asset"));
        else
          errors.add(object.get("asset"), noFileText(path) + kAssetHint);
      }
    }
  }
}

/// Missing assets are one error, with what to do about all of them; installed, the folder may
/// belong to root.
void Composer::addMissingAssets(config::Errors& errors) const {
  if (missingAssets_.empty()) return;
  const Value& first = missingAssets_.front();
  const std::size_t others = missingAssets_.size() - 1;
  const std::filesystem::path root =
      std::filesystem::absolute(file_).lexically_normal().parent_path().parent_path();
  errors.add(
      first,
      "there is no file " + (file_.parent_path() / first.asString()).string() +
          (others > 1   ? ", and " + std::to_string(others) + " more files of assets/ are missing"
           : others > 0 ? ", and one more file of assets/ is missing"
                        : "") +
          "; run " + (root / "scripts/prepare_assets").string() + ", which makes the assets (if " +
          root.string() + " is read-only, in a copy of that folder)");
}

void Composer::checkSize() const {
  if (scene_.memoryBytes() > limits_.maxBytes) {
    root_.fail("the scene takes " + std::to_string(scene_.memoryBytes()) +
               " bytes in memory, more than CATOPTRIC_SCENE_MIB allows: " +
               std::to_string(limits_.maxBytes));
  }
}

void Composer::addAll(const std::vector<Value>& objects, int parent, config::Errors& errors) {
  for (const Value& object : objects) {
    if (!visible(object)) continue;
    errors.collect([&] { add(object, parent, errors); });
    // Beyond the limits nothing more is made
    if (errors.any() && (scene_.nodes.size() >= limits_.maxNodes || shapeBytes_ > limits_.maxBytes))
      return;
  }
}

int Composer::addNode(Node node, const Value& place) {
  if (scene_.nodes.size() >= limits_.maxNodes) {
    place.fail("the scene has more than the " + std::to_string(limits_.maxNodes) +
               " nodes allowed");
  }
  scene_.nodes.push_back(std::move(node));
  return static_cast<int>(scene_.nodes.size()) - 1;
}

std::string Composer::nameOf(const Value& object) const {
  if (object.has("name")) return object.get("name").asString();
  if (object.has("asset"))
    return std::filesystem::path(object.get("asset").asString()).stem().string();
  return object.has("shape") ? object.get("shape").asString() : "group";
}

int Composer::meshOf(const Value& object) {
  const std::string key = shapeKey(object);
  const auto [entry, isNew] = shapes_.try_emplace(key, static_cast<int>(scene_.meshes.size()));
  if (isNew) {
    Mesh mesh = makeShape(object);
    mesh.name = object.get("shape").asString();
    forEachMorph(object, [&](const Value& morph) { addMorphTargets(mesh, morphOf(morph)); });
    if (!mesh.morphTargets.empty()) mesh.surface = nullptr;  // it deforms
    scene_.meshes.push_back(std::move(mesh));
    shapeBytes_ += meshBytes(scene_.meshes.back());
    if (shapeBytes_ > limits_.maxBytes) {
      object.fail("the shapes up to this one take " + std::to_string(shapeBytes_) +
                  " bytes in memory, more than CATOPTRIC_SCENE_MIB allows: " +
                  std::to_string(limits_.maxBytes));
    }
  }
  return entry->second;
}

int Composer::addShape(const Value& object, int self, const std::string& name) {
  const int meshIndex = meshOf(object);
  Box3 bounds;
  for (const Vec3& p : scene_.meshes[static_cast<std::size_t>(meshIndex)].positions)
    bounds.extend(p);
  const int node = fitted(object, self, bounds);
  const std::size_t targets =
      scene_.meshes[static_cast<std::size_t>(meshIndex)].morphTargets.size();
  scene_.nodes[static_cast<std::size_t>(node)].morphWeights.assign(targets, 0.0f);
  if (object.has("materials")) {
    object.get("materials")
        .fail("has both \"shape\" and \"materials\", which is only for assets; use \"material\"");
  }
  const int material = object.has("material")
                           ? materials_->materialOf(object.get("material"), kNone)
                           : materials_->plain();
  Object result;
  result.name = name;
  result.mesh = meshIndex;
  result.node = node;
  result.material = marked(object, material);
  scene_.objects.push_back(std::move(result));
  checkMark(object, scene_.objects.size() - 1);
  addLoop(object, node, targets);
  return node;
}

int Composer::marked(const Value& object, int material) {
  if (!object.has("reflective")) return material;
  const Value mark = object.get("reflective");
  if (mark.kind() == Value::Kind::Bool && mark.asBool()) return material;
  if (mark.kind() != Value::Kind::Bool && mark.kind() != Value::Kind::Object) {
    mark.fail(mark.dump() + " is not true, false or {\"s\", \"g\" or \"n\"}");
  }
  return materials_->reflectiveOf(material, mark);
}

void Composer::checkMark(const Value& object, std::size_t firstObject) {
  if (!object.has("reflective")) return;
  const Value mark = object.get("reflective");
  if (mark.kind() != Value::Kind::Bool || !mark.asBool()) return;
  for (std::size_t i = firstObject; i < scene_.objects.size(); ++i) {
    const Material& m = scene_.materials[static_cast<std::size_t>(scene_.objects[i].material)];
    if (m.metallicFactor > 0.0f || specularLevel(0.0f, m.dielectricF0) > 0.05f) return;
  }
  mark.fail(
      "none of the object's materials reflects; give one of them \"s\" or write "
      "\"reflective\": {\"s\": 0.5, \"g\": 0}");
}

std::filesystem::path describedFile(const Value& name, const std::filesystem::path& folder,
                                    const LoadLimits& limits) {
  const std::filesystem::path named(name.asString());
  if (named.empty()) name.fail("\"\" names no file");
  std::filesystem::path file = assetFile(folder, named, limits);
  if (file.empty()) {
    name.fail(name.dump() +
              " is outside the folder of the scene; copy the file into that folder, or name its "
              "own by --asset-path");
  }
  return file;
}

Scene loadDescription(const std::filesystem::path& file, const LoadLimits& limits) {
  try {
    return Composer(file, limits).compose();
  } catch (const UsageError& error) {
    // What is wrong in a description is wrong with the scene.
    throw SceneError(error.what());
  }
}

}  // namespace catoptric::scene
