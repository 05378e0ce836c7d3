#include "scene/description/description.h"

#include <algorithm>
#include <cmath>
#include <exception>
#include <memory>

#include "core/error.h"
#include "core/parallel.h"
#include "core/text.h"
#include "scene/animate.h"
#include "scene/procedural/procedural.h"

namespace catoptric::scene {
namespace {

using config::Value;

constexpr int kMaxDepth = 32;  ///< of children
constexpr int kLoopKeys = 16;  ///< cubic keys per cycle of a morph loop; error below 1e-4
constexpr int kMaxLoopKeys = 100'000;

/// A loaded asset, and where its meshes, materials and textures stand in the composed scene.
struct Asset {
  std::filesystem::path file;
  Scene scene;  ///< meshes, materials and textures move out at first use
  std::exception_ptr error;
  bool appended = false;
  int firstMesh = 0;
  int firstMaterial = 0;
  bool bounded = false;
  std::vector<Box3> bounds;  ///< per object, at rest
};

/// Nodes that animations of a described object act on.
struct Handle {
  int node = kNone;
  int meshNode = kNone;  ///< of a shape
  Value description;
};

class Composer {
 public:
  Composer(const std::filesystem::path& file, const LoadLimits& limits)
      : file_(file), limits_(limits), root_(config::parseFile(file)) {}

  Scene compose() {
    // All is checked that can be before anything is made
    config::Errors errors;
    errors.add(config::check(root_, sceneSchema()));
    if (root_.kind() != Value::Kind::Object || root_.get("objects").kind() != Value::Kind::Array)
      errors.throwIfAny();
    materials_ = std::make_unique<MaterialLibrary>(scene_, root_.get("materials"),
                                                   file_.parent_path(), limits_, errors);
    checkObjects(root_.get("objects").asArray(), 0, errors);
    errors.throwIfAny();

    scene_.source = file_;
    scene_.name = root_.has("name") ? root_.get("name").asString() : file_.stem().string();
    loadAssets();
    addAll(root_.get("objects").asArray(), kNone, errors);
    errors.throwIfAny();
    // An empty list is a scene of the environment alone
    if (scene_.objects.empty() && !root_.get("objects").asArray().empty()) {
      root_.get("objects").fail("nothing visible is in the scene");
    }
    addLights(errors);
    addCameras(errors);
    addAnimations(errors);
    errors.collect([&] { setSurroundings(); });
    errors.throwIfAny();
    materials_->finish();
    if (scene_.memoryBytes() > limits_.maxBytes) {
      root_.fail("the scene takes " + std::to_string(scene_.memoryBytes()) +
                 " bytes in memory; the limit is " + std::to_string(limits_.maxBytes));
    }
    return std::move(scene_);
  }

 private:
  // ---- objects ----

  /// Checks all objects' members and collects the assets, before anything is made.
  void checkObjects(const std::vector<Value>& objects, int depth, config::Errors& errors) {
    for (const Value& object : objects) {
      if (depth > kMaxDepth) object.fail("children are nested too deeply");
      errors.collect([&] { checkObject(object, errors); });
      if (object.has("children") && object.get("children").kind() == Value::Kind::Array)
        checkObjects(object.get("children").asArray(), depth + 1, errors);
    }
  }

  void checkObject(const Value& object, config::Errors& errors) {
    std::string shape;
    if (object.has("shape")) {
      shape = object.get("shape").asString();
      const std::vector<std::string>& names = shapeNames();
      if (std::find(names.begin(), names.end(), shape) == names.end()) {
        object.get("shape").fail("there is no shape \"" + shape + "\"" + didYouMean(shape, names) +
                                 "; known: " + joined(names, ", "));
      }
      if (object.has("asset")) object.fail("an object has either \"asset\" or \"shape\"");
    }
    config::require(object, objectSchema(shape));
    if (object.has("material") && object.get("material").kind() == Value::Kind::Object)
      errors.add(config::check(object.get("material"), materialSchema()));
    if (object.has("asset") && visible(object)) {
      const std::filesystem::path relative(object.get("asset").asString());
      const std::filesystem::path path = fileBeside(object.get("asset"), file_.parent_path());
      const auto [entry, isNew] = assets_.try_emplace(path.string());
      if (isNew) {
        entry->second.file = path;
        if (!std::filesystem::exists(path)) {
          object.get("asset").fail("there is no file " + path.string() +
                                   (*relative.begin() == "assets" ? assetAdvice() : ""));
        }
      }
    }
  }

  /// What to do without assets; installed, the folder may belong to root.
  std::string assetAdvice() const {
    const std::filesystem::path root =
        std::filesystem::absolute(file_).lexically_normal().parent_path().parent_path();
    return "; run " + (root / "scripts/prepare_assets").string() +
           ", which makes the assets (where " + root.string() +
           " cannot be written, in a copy of that folder)";
  }

  static bool visible(const Value& object) {
    return !object.has("visible") || object.get("visible").asBool();
  }

  void loadAssets() {
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

  int addNode(Node node, const Value& place) {
    if (scene_.nodes.size() >= limits_.maxNodes) {
      place.fail("the scene has more than the " + std::to_string(limits_.maxNodes) +
                 " nodes allowed");
    }
    scene_.nodes.push_back(std::move(node));
    return static_cast<int>(scene_.nodes.size()) - 1;
  }

  void addAll(const std::vector<Value>& objects, int parent, config::Errors& errors) {
    for (const Value& object : objects) {
      errors.collect([&] { add(object, parent, errors); });
      // Beyond the limits nothing more is made
      if (errors.any() &&
          (scene_.nodes.size() >= limits_.maxNodes || shapeBytes_ > limits_.maxBytes))
        return;
    }
  }

  /// An object with its copies.
  void add(const Value& object, int parent, config::Errors& errors) {
    if (!visible(object)) return;
    if (!object.has("repeat")) {
      addOne(object, parent, "", errors);
      return;
    }
    const Value repeat = object.get("repeat");
    for (const std::string& key : repeat.keys()) {
      if (key != "count" && key != "step" && key != "rotate_step" && key != "around") {
        repeat.get(key).fail("unknown name \"" + key +
                             "\"; allowed: count, step, rotate_step, around");
      }
    }
    const Vec3 at = object.has("translate") ? object.get("translate").asVec3() : Vec3(0.0f);
    const auto place = [&](const Vec3& offset, const Quat& rotation, std::size_t index) {
      // Turned about the object's own position, then moved.
      Node node;
      node.name = nameOf(object) + " copy";
      node.parent = parent;
      node.rotation = rotation;
      node.translation = at + offset - rotation * at;
      addOne(object, addNode(std::move(node), repeat), " " + std::to_string(index + 1), errors);
    };
    if (repeat.has("around")) {
      const Value around = repeat.get("around");
      const int count = countOf(around.get("count"));
      const auto radius = static_cast<float>(around.get("radius").asNumber());
      for (int i = 0; i < count; ++i) {
        const Quat turn = glm::angleAxis(
            2.0f * kPi * static_cast<float>(i) / static_cast<float>(count), Vec3(0.0f, 1.0f, 0.0f));
        place(turn * Vec3(0.0f, 0.0f, radius), turn, static_cast<std::size_t>(i));
      }
      return;
    }
    const Value count = repeat.get("count");
    const Vec3 step = repeat.has("step") ? repeat.get("step").asVec3() : Vec3(0.0f);
    const Vec3 turn = repeat.has("rotate_step") ? repeat.get("rotate_step").asVec3() : Vec3(0.0f);
    std::size_t index = 0;
    if (count.kind() != Value::Kind::Array) {
      const int n = countOf(count);
      for (int i = 0; i < n; ++i) {
        place(static_cast<float>(i) * step, rotationOf(static_cast<float>(i) * turn), index++);
      }
      return;
    }
    if (count.asArray().size() != 3) count.fail(count.dump() + " is not a number or 3 numbers");
    const glm::ivec3 n(countOf(count.asArray()[0]), countOf(count.asArray()[1]),
                       countOf(count.asArray()[2]));
    if (std::int64_t{n.x} * n.y > static_cast<std::int64_t>(limits_.maxNodes) / n.z) {
      count.fail(count.dump() + " asks for more than the " + std::to_string(limits_.maxNodes) +
                 " nodes allowed");
    }
    for (int z = 0; z < n.z; ++z) {
      for (int y = 0; y < n.y; ++y) {
        for (int x = 0; x < n.x; ++x) {
          const Vec3 i(x, y, z);
          place(i * step, rotationOf((i.x + i.y + i.z) * turn), index++);
        }
      }
    }
  }

  int countOf(const Value& value) const {
    const std::int64_t n = value.asInteger();
    if (n < 1 || n > static_cast<std::int64_t>(limits_.maxNodes)) {
      value.fail(std::to_string(n) + " is out of range; allowed: 1 to " +
                 std::to_string(limits_.maxNodes));
    }
    return static_cast<int>(n);
  }

  std::string nameOf(const Value& object) const {
    if (object.has("name")) return object.get("name").asString();
    if (object.has("asset"))
      return std::filesystem::path(object.get("asset").asString()).stem().string();
    return object.has("shape") ? object.get("shape").asString() : "group";
  }

  void addOne(const Value& object, int parent, const std::string& suffix, config::Errors& errors) {
    Node node;
    node.name = nameOf(object) + suffix;
    node.parent = parent;
    if (object.has("translate")) node.translation = object.get("translate").asVec3();
    if (object.has("rotate") && object.has("quaternion")) {
      object.fail("an object has either \"rotate\" or \"quaternion\"");
    }
    if (object.has("rotate")) node.rotation = rotationOf(object.get("rotate").asVec3());
    if (object.has("quaternion")) node.rotation = quaternionOf(object.get("quaternion"));
    if (object.has("scale")) node.scale = scaleOf(object.get("scale"));
    const std::string name = node.name;
    const int self = addNode(std::move(node), object);
    Handle handle{self, kNone, object};
    if (object.has("shape")) {
      handle.meshNode = addShape(object, self, name);
    } else if (object.has("asset")) {
      addAsset(object, self, name);
    } else {
      for (const char* key :
           {"fit", "anchor", "material", "materials", "reflective", "morph", "nodes"}) {
        if (object.has(key)) {
          object.get(key).fail(std::string("\"") + key + "\" needs a \"shape\" or an \"asset\"");
        }
      }
    }
    handles_[nameOf(object)].push_back(handle);
    if (object.has("children")) addAll(object.get("children").asArray(), self, errors);
  }

  static Quat quaternionOf(const Value& value) {
    const std::vector<float> q = value.asFloats(4);
    const Quat rotation(q[3], q[0], q[1], q[2]);
    if (!(glm::length(rotation) > 1e-6f)) value.fail("the quaternion has no length");
    return glm::normalize(rotation);
  }

  static Vec3 scaleOf(const Value& value) {
    const Vec3 scale = value.kind() == Value::Kind::Array
                           ? value.asVec3()
                           : Vec3(static_cast<float>(value.asNumber()));
    if (scale.x == 0.0f || scale.y == 0.0f || scale.z == 0.0f) {
      value.fail("a scale of 0 leaves nothing");
    }
    return scale;
  }

  /// A node that gives `bounds` the size of "fit" and puts "anchor" at the origin; `self` itself
  /// when neither is wanted.
  int fitted(const Value& object, int self, const Box3& bounds) {
    if (!object.has("fit") && !object.has("anchor")) return self;
    const Vec3 size = bounds.max - bounds.min;
    Vec3 scale(1.0f);
    if (object.has("fit")) {
      const Value fit = object.get("fit");
      if (fit.asArray().size() != 3)
        fit.fail(fit.dump() + " is not an array of 3 numbers or nulls");
      double logSum = 0.0;
      int given = 0;
      for (int a = 0; a < 3; ++a) {
        const Value wanted = fit.asArray()[static_cast<std::size_t>(a)];
        if (wanted.isNull()) continue;
        const double metres = wanted.asNumber();
        if (!(metres > 0.0)) wanted.fail("a size must be above 0");
        if (!(size[a] > 0.0f)) {
          wanted.fail(std::string("the object is flat along ") + "xyz"[a] + "; write null here");
        }
        scale[a] = static_cast<float>(metres / static_cast<double>(size[a]));
        logSum += std::log(static_cast<double>(scale[a]));
        ++given;
      }
      if (given == 0) fit.fail("\"fit\" needs at least one number");
      for (int a = 0; a < 3; ++a) {
        if (fit.asArray()[static_cast<std::size_t>(a)].isNull()) {
          scale[a] = static_cast<float>(std::exp(logSum / given));
        }
      }
    }
    Vec3 pivot(0.0f);
    const std::string anchor =
        object.has("anchor") ? object.get("anchor").asString() : std::string("origin");
    if (anchor != "origin") {
      pivot = bounds.centre();
      if (anchor == "bottom") pivot.y = bounds.min.y;
      if (anchor == "top") pivot.y = bounds.max.y;
      if (anchor == "back") pivot.z = bounds.min.z;
    }
    Node node;
    node.name = scene_.nodes[static_cast<std::size_t>(self)].name + " fit";
    node.parent = self;
    node.scale = scale;
    node.translation = -scale * pivot;
    return addNode(std::move(node), object);
  }

  /// Applies "reflective" to a material.
  int marked(const Value& object, int material) {
    if (!object.has("reflective")) return material;
    const Value mark = object.get("reflective");
    if (mark.kind() == Value::Kind::Bool && mark.asBool()) return material;
    if (mark.kind() != Value::Kind::Bool && mark.kind() != Value::Kind::Object) {
      mark.fail(mark.dump() + " is not true, false or {\"s\", \"g\" or \"n\"}");
    }
    return materials_->reflectiveOf(material, mark);
  }

  /// "reflective": true promises that something of the object reflects.
  void checkMark(const Value& object, std::size_t firstObject) {
    if (!object.has("reflective")) return;
    const Value mark = object.get("reflective");
    if (mark.kind() != Value::Kind::Bool || !mark.asBool()) return;
    for (std::size_t i = firstObject; i < scene_.objects.size(); ++i) {
      const Material& m = scene_.materials[static_cast<std::size_t>(scene_.objects[i].material)];
      if (m.metallicFactor > 0.0f || m.dielectricF0 > 0.05f) return;
    }
    mark.fail(
        "none of the object's materials reflects; give one of them \"s\" or write "
        "\"reflective\": {\"s\": 0.5, \"g\": 0}");
  }

  /// What a shape's vertices and triangles take; its morph targets have arrays like its own.
  static std::size_t meshBytes(const Mesh& mesh) {
    return mesh.positions.size() * (2 * sizeof(Vec3) + sizeof(Vec2)) *
               (1 + mesh.morphTargets.size()) +
           mesh.indices.size() * sizeof(std::uint32_t);
  }

  int addShape(const Value& object, int self, const std::string& name) {
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
                    " bytes in memory; the limit is " + std::to_string(limits_.maxBytes));
      }
    }
    const int meshIndex = entry->second;
    Box3 bounds;
    for (const Vec3& p : scene_.meshes[static_cast<std::size_t>(meshIndex)].positions)
      bounds.extend(p);
    const int node = fitted(object, self, bounds);
    const std::size_t targets =
        scene_.meshes[static_cast<std::size_t>(meshIndex)].morphTargets.size();
    scene_.nodes[static_cast<std::size_t>(node)].morphWeights.assign(targets, 0.0f);
    if (object.has("materials")) {
      object.get("materials").fail("a shape has one \"material\"; \"materials\" is for assets");
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

  template <class F>
  static void forEachMorph(const Value& object, const F& body) {
    if (!object.has("morph")) return;
    const Value morph = object.get("morph");
    if (morph.kind() == Value::Kind::Array) {
      for (const Value& item : morph.asArray()) body(item);
    } else {
      body(morph);
    }
  }

  /// Weights of morphs with a "cycle": sine and cosine, or a sine, by cubic keys.
  void addLoop(const Value& object, int node, std::size_t targets) {
    if (targets == 0) return;
    struct Part {
      double cycle = 0.0;
      std::size_t targets = 1;
    };
    std::vector<Part> parts;
    double duration = 0.0;
    double shortest = 1e30;
    forEachMorph(object, [&](const Value& morph) {
      Part part;
      const MorphType type = morphOf(morph).type;
      part.targets = type == MorphType::Wave || type == MorphType::Flag ? 2 : 1;
      if (morph.has("cycle")) {
        part.cycle = morph.get("cycle").asNumber();
        duration = std::max(duration, config::valueOr(morph, morphSchema(), "duration").asNumber());
        shortest = std::min(shortest, part.cycle);
      }
      parts.push_back(part);
    });
    if (duration <= 0.0) return;
    const double keys = std::ceil(duration / shortest * kLoopKeys);
    if (keys > kMaxLoopKeys) object.get("morph").fail("\"duration\" holds too many cycles");
    const int count = static_cast<int>(keys);
    AnimationChannel channel;
    channel.node = node;
    channel.target = Target::Weights;
    channel.interpolation = Interpolation::CubicSpline;
    for (int k = 0; k <= count; ++k) {
      const double t = duration * k / count;
      channel.times.push_back(static_cast<float>(t));
      std::vector<float> values;
      std::vector<float> tangents;
      for (const Part& part : parts) {
        const double w = part.cycle > 0.0 ? 2.0 * std::numbers::pi / part.cycle : 0.0;
        if (part.targets == 2) {
          values.push_back(static_cast<float>(part.cycle > 0.0 ? std::cos(w * t) : 0.0));
          tangents.push_back(static_cast<float>(-w * std::sin(w * t)));
          values.push_back(static_cast<float>(-std::sin(w * t)));
          tangents.push_back(static_cast<float>(-w * std::cos(w * t)));
        } else {
          values.push_back(static_cast<float>(std::sin(w * t)));
          tangents.push_back(static_cast<float>(w * std::cos(w * t)));
        }
      }
      channel.values.insert(channel.values.end(), tangents.begin(), tangents.end());
      channel.values.insert(channel.values.end(), values.begin(), values.end());
      channel.values.insert(channel.values.end(), tangents.begin(), tangents.end());
    }
    scene_.animation.push_back(std::move(channel));
  }

  // ---- assets ----

  /// Bounds of an asset's objects at rest.
  static void measure(Asset& asset) {
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
        const Mat4 world =
            (object.node == kNone ? Mat4(1.0f) : at(pose.worldFromNode, object.node)) *
            object.nodeFromInstance;
        for (const Vec3& p : mesh.positions) box.extend(Vec3(world * Vec4(p, 1.0f)));
      }
      asset.bounds.push_back(box);
    }
  }

  /// Which objects of an asset the "nodes" patterns keep.
  std::vector<bool> wantedObjects(const Value& object, const Asset& asset) const {
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
                     "; it has: " + joined(names, ", "));
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

  static void shift(TextureSlot& slot, int by) {
    if (slot.used()) slot.texture += by;
  }

  /// Moves the asset's meshes, textures and materials into the scene, once.
  void append(Asset& asset) {
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

  /// The material that each of the asset's materials becomes for this object.
  std::vector<int> overriddenMaterials(const Value& object, const Asset& asset) {
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
      result[m] =
          object.has("material") ? materials_->materialOf(object.get("material"), own) : own;
    }
    return result;
  }

  void addAsset(const Value& object, int self, const std::string& name) {
    Asset& asset = assets_.at((file_.parent_path() / object.get("asset").asString()).string());
    if (object.has("morph")) object.get("morph").fail("\"morph\" needs a \"shape\"");
    const std::vector<bool> wanted = wantedObjects(object, asset);
    if (!asset.appended) measureIfNeededLater(asset);
    int root = self;
    if (object.has("fit") || object.has("anchor")) {
      Box3 bounds;
      for (std::size_t i = 0; i < wanted.size(); ++i) {
        if (wanted[i]) bounds.extend(asset.bounds[i]);
      }
      root = fitted(object, self, bounds);
    }
    append(asset);
    const std::vector<int> materials = overriddenMaterials(object, asset);

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
      copy.material = marked(object, copy.material == kNone
                                         ? materials_->plain()
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

  /// An asset's bounds need its meshes, which move away at first use: take them while they are
  /// there if any object of the description wants to fit or anchor it.
  void measureIfNeededLater(Asset& asset) {
    if (anyFits(root_.get("objects").asArray(), asset.file)) measure(asset);
  }

  bool anyFits(const std::vector<Value>& objects, const std::filesystem::path& file) const {
    return std::any_of(objects.begin(), objects.end(), [&](const Value& object) {
      if ((object.has("fit") || object.has("anchor")) && object.has("asset") &&
          file_.parent_path() / object.get("asset").asString() == file) {
        return true;
      }
      return object.has("children") && anyFits(object.get("children").asArray(), file);
    });
  }

  // ---- the rest ----

  const std::vector<Handle>& handlesOf(const Value& name) const {
    const auto found = handles_.find(name.asString());
    if (found != handles_.end()) return found->second;
    std::vector<std::string> names;
    for (const auto& [known, handles] : handles_) names.push_back(known);
    name.fail("there is no object " + name.dump() + didYouMean(name.asString(), names));
  }

  void addLights(config::Errors& errors) {
    if (!root_.has("lights")) return;
    for (const Value& value : root_.get("lights").asArray())
      errors.collect([&] { addLight(value); });
  }

  void addLight(const Value& value) {
    const auto get = [&](const char* name) { return config::valueOr(value, lightSchema(), name); };
    const auto number = [&](const char* name) { return static_cast<float>(get(name).asNumber()); };
    const std::string type = value.get("type").asString();
    Light light;
    light.name = value.has("name") ? value.get("name").asString() : type;
    light.type = type == "directional" ? LightType::Directional
                 : type == "spot"      ? LightType::Spot
                                       : LightType::Point;
    if (type == "sphere" && !value.has("radius")) value.fail("a sphere light needs a \"radius\"");
    light.intensity = colorOf(get("color")) * number("intensity");
    light.range = number("range");
    light.innerConeRad = radians(number("inner_cone"));
    light.outerConeRad = radians(number("outer_cone"));
    if (light.type == LightType::Spot && light.innerConeRad >= light.outerConeRad) {
      value.fail("\"inner_cone\" must be smaller than \"outer_cone\"");
    }
    light.radius = number("radius");
    light.baked = get("baked").asBool();
    light.position = get("position").asVec3();
    Vec3 direction = get("direction").asVec3();
    if (value.has("target")) {
      if (value.has("direction")) value.fail("a light has either \"direction\" or \"target\"");
      direction = value.get("target").asVec3() - light.position;
    }
    if (!(glm::length(direction) > 1e-6f)) value.fail("the light's direction has no length");
    light.direction = glm::normalize(direction);
    if (value.has("object")) {
      // Nodes shine along their -z.
      Node node;
      node.name = light.name;
      node.parent = handlesOf(value.get("object")).front().node;
      node.hasMatrix = true;
      const Vec3 back = -light.direction;
      Vec3 right = glm::cross(Vec3(0.0f, 1.0f, 0.0f), back);
      if (glm::length(right) < 1e-4f) right = Vec3(1.0f, 0.0f, 0.0f);
      right = glm::normalize(right);
      node.matrix = Mat4(Vec4(right, 0.0f), Vec4(glm::cross(back, right), 0.0f), Vec4(back, 0.0f),
                         Vec4(light.position, 1.0f));
      light.node = addNode(std::move(node), value);
    }
    if (light.baked && bakeMode() != "full") {
      value.get("baked").fail("a baked light needs \"bake\": {\"mode\": \"full\"}");
    }
    scene_.lights.push_back(std::move(light));
  }

  std::string bakeMode() const {
    return root_.has("bake") && root_.get("bake").has("mode")
               ? root_.get("bake").get("mode").asString()
               : std::string("none");
  }

  void addCameras(config::Errors& errors) {
    if (!root_.has("cameras")) return;
    // The description's own cameras come before its assets'.
    std::vector<CameraDefinition> own;
    for (const Value& value : root_.get("cameras").asArray())
      errors.collect([&] { own.push_back(cameraOf(value)); });
    scene_.cameras.insert(scene_.cameras.begin(), own.begin(), own.end());
  }

  CameraDefinition cameraOf(const Value& value) {
    const Vec3 position = value.get("position").asVec3();
    const Vec3 target = value.get("target").asVec3();
    if (position == target) value.fail("position and target are the same point");
    Vec3 back = glm::normalize(position - target);
    Vec3 right = glm::cross(Vec3(0.0f, 1.0f, 0.0f), back);
    if (glm::length(right) < 1e-5f) right = Vec3(1.0f, 0.0f, 0.0f);
    right = glm::normalize(right);
    Node node;
    node.name = value.has("name") ? value.get("name").asString() : "camera";
    node.hasMatrix = true;
    node.matrix = Mat4(Vec4(right, 0.0f), Vec4(glm::cross(back, right), 0.0f), Vec4(back, 0.0f),
                       Vec4(position, 1.0f));
    CameraDefinition camera;
    camera.name = node.name;
    camera.node = addNode(std::move(node), value);
    camera.verticalFovRad =
        radians(value.has("fov") ? static_cast<float>(value.get("fov").asNumber()) : 60.0f);
    return camera;
  }

  void addAnimations(config::Errors& errors) {
    if (!root_.has("animation")) return;
    for (const Value& value : root_.get("animation").asArray()) {
      errors.collect([&] {
        for (const Handle& handle : handlesOf(value.get("object"))) addAnimation(value, handle);
      });
    }
  }

  void addAnimation(const Value& value, const Handle& handle) {
    const std::string name = value.get("channel").asString();
    AnimationChannel channel;
    channel.node = handle.node;
    std::size_t given = 3;
    channel.target = Target::Translation;
    if (name == "scale") channel.target = Target::Scale;
    if (name == "rotate" || name == "quaternion") channel.target = Target::Rotation;
    if (name == "quaternion") given = 4;
    if (name == "morph") {
      channel.target = Target::Weights;
      channel.node = handle.meshNode;
      given = handle.meshNode == kNone
                  ? 0
                  : scene_.nodes[static_cast<std::size_t>(handle.meshNode)].morphWeights.size();
      if (given == 0) value.get("object").fail("the object has no \"morph\"");
    }
    for (const AnimationChannel& other : scene_.animation) {
      if (other.node == channel.node && other.target == channel.target) {
        value.fail("the channel " + name + " of this object is animated already");
      }
    }

    std::vector<std::vector<float>> keys;
    Vec3 lastEuler(0.0f);
    for (const Value& key : value.get("keys").asArray()) {
      std::vector<float> k = key.asFloats(given + 1);
      if (!channel.times.empty() && k[0] <= channel.times.back()) {
        key.fail("times must increase");
      }
      channel.times.push_back(k[0]);
      k.erase(k.begin());
      if (channel.target == Target::Rotation) {
        Quat q;
        if (name == "rotate") {
          const Vec3 euler(k[0], k[1], k[2]);
          const Vec3 step = glm::abs(euler - lastEuler);
          if (!keys.empty() && std::max({step.x, step.y, step.z}) >= 180.0f) {
            key.fail("from key to key an angle changes by less than 180 degrees; add keys between");
          }
          lastEuler = euler;
          q = rotationOf(euler);
        } else {
          q = glm::length(Quat(k[3], k[0], k[1], k[2])) > 1e-6f
                  ? glm::normalize(Quat(k[3], k[0], k[1], k[2]))
                  : (key.fail("the quaternion has no length"), Quat());
        }
        // Neighbouring keys on the same side, so that cubic interpolation takes the short way.
        if (!keys.empty()) {
          const std::vector<float>& last = keys.back();
          if (q.x * last[0] + q.y * last[1] + q.z * last[2] + q.w * last[3] < 0.0f) q = -q;
        }
        k = {q.x, q.y, q.z, q.w};
      }
      keys.push_back(std::move(k));
    }
    const std::string interpolation =
        config::valueOr(value, *animationItem(), "interpolation").asString();
    channel.interpolation = interpolation == "step"     ? Interpolation::Step
                            : interpolation == "smooth" ? Interpolation::CubicSpline
                                                        : Interpolation::Linear;
    writeKeys(channel, keys);
    scene_.animation.push_back(std::move(channel));
  }

  static const config::Schema* animationItem() {
    for (const config::Field& field : sceneSchema().fields) {
      if (field.name == "animation") return field.object;
    }
    return nullptr;
  }

  /// Values of a channel; smooth ones with Catmull-Rom tangents per second. Where the first and
  /// the last key agree, the motion is a loop and its tangents go round.
  static void writeKeys(AnimationChannel& channel, const std::vector<std::vector<float>>& keys) {
    const std::size_t n = keys.size();
    const auto& times = channel.times;
    for (std::size_t i = 0; i < n; ++i) {
      if (channel.interpolation != Interpolation::CubicSpline) {
        channel.values.insert(channel.values.end(), keys[i].begin(), keys[i].end());
        continue;
      }
      std::vector<float> tangent(keys[i].size(), 0.0f);
      const bool loop = n > 2 && keys.front() == keys.back();
      const bool end = i == 0 || i + 1 == n;
      if (n > 1 && (!end || loop)) {
        const std::size_t before = end ? n - 2 : i - 1;
        const std::size_t after = end ? 1 : i + 1;
        const float span = end ? (times[n - 1] - times[n - 2]) + (times[1] - times[0])
                               : times[after] - times[before];
        for (std::size_t c = 0; c < tangent.size(); ++c) {
          tangent[c] = (keys[after][c] - keys[before][c]) / span;
        }
      }
      channel.values.insert(channel.values.end(), tangent.begin(), tangent.end());
      channel.values.insert(channel.values.end(), keys[i].begin(), keys[i].end());
      channel.values.insert(channel.values.end(), tangent.begin(), tangent.end());
    }
  }

  void setSurroundings() {
    if (root_.has("ambient")) scene_.ambient = colorOf(root_.get("ambient"));
    if (root_.has("bake")) {
      const Value bake = root_.get("bake");
      const std::string mode = bakeMode();
      scene_.bake.mode = mode == "full"   ? BakeMode::Full
                         : mode == "none" ? BakeMode::None
                                          : BakeMode::AmbientOcclusion;
      if (bake.has("rays")) scene_.bake.rays = static_cast<int>(bake.get("rays").asInteger());
      if (bake.has("bounces"))
        scene_.bake.bounces = static_cast<int>(bake.get("bounces").asInteger());
      if (bake.has("distance")) {
        scene_.bake.ambientOcclusionDistance = static_cast<float>(bake.get("distance").asNumber());
      }
    }
    if (!root_.has("environment")) return;
    const Value value = root_.get("environment");
    const std::string type = value.get("type").asString();
    Environment& environment = scene_.environment;
    if (value.has("scale")) environment.scale = static_cast<float>(value.get("scale").asNumber());
    if (type == "constant") {
      environment.type = EnvironmentType::Constant;
      environment.color = colorOf(value.get("color"));
    } else if (type == "gradient") {
      environment.type = EnvironmentType::Gradient;
      environment.color = colorOf(value.get("zenith"));
      environment.horizon = colorOf(value.get("horizon"));
      environment.ground = colorOf(value.get("ground"));
    } else {
      environment.type = EnvironmentType::File;
      environment.file = fileBeside(value.get("file"), file_.parent_path());
      if (!std::filesystem::is_regular_file(environment.file)) {
        value.get("file").fail("there is no file " + environment.file.string());
      }
      if (value.has("rotate")) {
        environment.rotationRad = radians(static_cast<float>(value.get("rotate").asNumber()));
      }
    }
  }

  std::filesystem::path file_;
  LoadLimits limits_;
  Value root_;
  Scene scene_;
  std::unique_ptr<MaterialLibrary> materials_;
  std::map<std::string, Asset> assets_;
  std::map<std::string, int> shapes_;
  std::size_t shapeBytes_ = 0;
  std::map<std::string, std::vector<Handle>> handles_;
};

}  // namespace

std::filesystem::path fileBeside(const Value& name, const std::filesystem::path& folder) {
  const std::filesystem::path relative(name.asString());
  if (relative.empty() || relative.is_absolute()) {
    name.fail(name.dump() + " is not a path relative to the description");
  }
  if (*relative.lexically_normal().begin() == "..") {
    name.fail(name.dump() + " leaves the folder of the description; copy it there");
  }
  return folder / relative;
}

bool matchesPattern(const std::string& text, const std::string& pattern) {
  // Greedy matching with one point to come back to.
  std::size_t t = 0;
  std::size_t p = 0;
  std::size_t star = std::string::npos;
  std::size_t resume = 0;
  while (t < text.size()) {
    if (p < pattern.size() && pattern[p] == '*') {
      star = p++;
      resume = t;
    } else if (p < pattern.size() && pattern[p] == text[t]) {
      ++p;
      ++t;
    } else if (star != std::string::npos) {
      p = star + 1;
      t = ++resume;
    } else {
      return false;
    }
  }
  while (p < pattern.size() && pattern[p] == '*') ++p;
  return p == pattern.size();
}

Quat rotationOf(const Vec3& d) {
  const Quat x = glm::angleAxis(radians(d.x), Vec3(1.0f, 0.0f, 0.0f));
  const Quat y = glm::angleAxis(radians(d.y), Vec3(0.0f, 1.0f, 0.0f));
  const Quat z = glm::angleAxis(radians(d.z), Vec3(0.0f, 0.0f, 1.0f));
  return glm::normalize(y * x * z);
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
