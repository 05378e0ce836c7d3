// Composes a scene from its description; for the sources of this room only. The members stand by
// their stories in composer.cpp, placement.cpp, assets.cpp, lights_cameras.cpp and animation.cpp.
#pragma once

#include <exception>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "scene/description/description.h"

namespace catoptric::scene {

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
};

class Composer {
 public:
  Composer(const std::filesystem::path& file, const LoadLimits& limits)
      : file_(file), limits_(limits), root_(config::parseFile(file)) {}

  /// Throws UsageError with all that is wrong.
  Scene compose();

 private:
  using Value = config::Value;

  // ---- Checks, before anything is made; they collect the assets ----
  void checkObjects(const std::vector<Value>& objects, int depth, config::Errors& errors);
  void checkObject(const Value& object, config::Errors& errors);
  void addMissingAssets(config::Errors& errors) const;
  void checkSize() const;

  // ---- Objects ----
  void addAll(const std::vector<Value>& objects, int parent, config::Errors& errors);
  /// An object with its copies.
  void add(const Value& object, int parent, config::Errors& errors);
  void addOne(const Value& object, int parent, const std::string& suffix, config::Errors& errors);
  int addNode(Node node, const Value& place);
  int addShape(const Value& object, int self, const std::string& name);
  /// The mesh of a shape; objects with the same shape share it.
  int meshOf(const Value& object);
  int countOf(const Value& value) const;
  std::string nameOf(const Value& object) const;
  /// A node that gives `bounds` the size of "fit" and puts "anchor" at the origin; `self` itself
  /// when neither is wanted.
  int fitted(const Value& object, int self, const Box3& bounds);
  /// Applies "reflective" to a material.
  int marked(const Value& object, int material);
  /// "reflective": true promises that something of the object reflects.
  void checkMark(const Value& object, std::size_t firstObject);

  // ---- Assets ----
  void loadAssets();
  void addAsset(const Value& object, int self, const std::string& name);
  /// Adds the asset's nodes, skins, wanted objects, lights, cameras and motions under `root`.
  void copyAsset(const Value& object, const Asset& asset, int root, const std::string& name,
                 const std::vector<bool>& wanted, const std::vector<int>& materials);
  /// Which objects of an asset the "nodes" patterns keep.
  std::vector<bool> wantedObjects(const Value& object, const Asset& asset) const;
  /// Moves the asset's meshes, textures and materials into the scene, once.
  void append(Asset& asset);
  /// The material that each of the asset's materials becomes for this object.
  std::vector<int> overriddenMaterials(const Value& object, const Asset& asset);
  /// Whether one of the objects with this asset has "fit" or "anchor".
  bool anyFits(const std::vector<Value>& objects, const std::filesystem::path& file) const;

  // ---- Lights, cameras, surroundings ----
  void addLights(config::Errors& errors);
  void addLight(const Value& value);
  void addCameras(config::Errors& errors);
  CameraDefinition cameraOf(const Value& value);
  void setSurroundings();
  void setEnvironment();
  std::string bakeMode() const;
  /// The objects of a name.
  const std::vector<Handle>& handlesOf(const Value& name) const;

  // ---- Animation ----
  /// Weights of morphs with a "cycle": sine and cosine, or a sine, by cubic keys.
  void addLoop(const Value& object, int node, std::size_t targets);
  void addAnimations(config::Errors& errors);
  void addAnimation(const Value& value, const Handle& handle);

  std::filesystem::path file_;
  LoadLimits limits_;
  Value root_;
  Scene scene_;
  std::unique_ptr<MaterialLibrary> materials_;
  std::map<std::string, Asset> assets_;
  std::vector<Value> missingAssets_;  ///< one "asset" for each file of assets/ that is not there
  std::map<std::string, int> shapes_;
  std::size_t shapeBytes_ = 0;
  std::map<std::string, std::vector<Handle>> handles_;
};

/// Runs `body` with each of an object's morphs.
template <class F>
void forEachMorph(const config::Value& object, const F& body) {
  if (!object.has("morph")) return;
  const config::Value morph = object.get("morph");
  if (morph.kind() == config::Value::Kind::Array) {
    for (const config::Value& item : morph.asArray()) body(item);
  } else {
    body(morph);
  }
}

}  // namespace catoptric::scene
