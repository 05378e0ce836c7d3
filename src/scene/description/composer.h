// Composes a scene from its description; private to this folder. The member functions are defined
// in composer.cpp, placement.cpp, assets.cpp, lights_cameras.cpp and animation.cpp.
#pragma once

#include <exception>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "scene/description/description.h"

namespace catoptric::scene {

/// A loaded asset, and where its meshes, materials and textures are in the composed scene.
struct Asset {
  std::filesystem::path file;
  Scene scene;  ///< meshes, materials and textures are moved out of it at first use
  std::exception_ptr error;
  bool appended = false;
  int firstMesh = 0;
  int firstMaterial = 0;
  bool bounded = false;
  std::vector<Box3> bounds;  ///< per object, in the rest pose
};

/// The nodes that animations of a described object act on.
struct Handle {
  int node = kNone;
  int meshNode = kNone;  ///< the mesh's node, for a shape
};

class Composer {
 public:
  Composer(const std::filesystem::path& file, const LoadLimits& limits)
      : file_(file), limits_(limits), root_(config::parseFile(file)) {}

  /// Throws UsageError with all errors.
  Scene compose();

 private:
  using Value = config::Value;

  // ---- Checks, before anything is built; they also collect the assets ----
  void checkObjects(const std::vector<Value>& objects, int depth, config::Errors& errors);
  void checkObject(const Value& object, config::Errors& errors);
  void addMissingAssets(config::Errors& errors) const;
  void checkSize() const;

  // ---- Objects ----
  void addAll(const std::vector<Value>& objects, int parent, config::Errors& errors);
  /// Adds an object with its copies.
  void add(const Value& object, int parent, config::Errors& errors);
  void addOne(const Value& object, int parent, const std::string& suffix, config::Errors& errors);
  int addNode(Node node, const Value& place);
  int addShape(const Value& object, int self, const std::string& name);
  /// The mesh of a shape. Objects with the same shape share it.
  int meshOf(const Value& object);
  int countOf(const Value& value) const;
  std::string nameOf(const Value& object) const;
  /// A node that scales `bounds` to the size of "fit" and moves "anchor" to the origin; `self` if
  /// neither is given.
  int fitted(const Value& object, int self, const Box3& bounds);
  /// Applies "reflective" to a material; returns the resulting material.
  int marked(const Value& object, int material);
  /// Checks "reflective": true, which requires that some part of the object reflects.
  void checkMark(const Value& object, std::size_t firstObject);

  // ---- Assets ----
  void loadAssets();
  void addAsset(const Value& object, int self, const std::string& name);
  /// Adds the asset's nodes, skins, wanted objects, lights, cameras and animations under `root`.
  void copyAsset(const Value& object, const Asset& asset, int root, const std::string& name,
                 const std::vector<bool>& wanted, const std::vector<int>& materials);
  /// Tells which objects of an asset the "nodes" patterns keep.
  std::vector<bool> wantedObjects(const Value& object, const Asset& asset) const;
  /// Moves the asset's meshes, textures and materials into the scene, once.
  void append(Asset& asset);
  /// For each material of the asset, the material that replaces it in this object.
  std::vector<int> overriddenMaterials(const Value& object, const Asset& asset);
  /// Whether any object that uses this asset has "fit" or "anchor".
  bool anyFits(const std::vector<Value>& objects, const std::filesystem::path& file) const;

  // ---- Lights, cameras, environment ----
  void addLights(config::Errors& errors);
  void addLight(const Value& value);
  void addCameras(config::Errors& errors);
  CameraDefinition cameraOf(const Value& value);
  void setSurroundings();
  void setEnvironment();
  std::string bakeMode() const;
  /// The objects with this name.
  const std::vector<Handle>& handlesOf(const Value& name) const;

  // ---- Animation ----
  /// Animates the weights of morphs that have a "cycle", with cubic keys: two targets as sine and
  /// cosine, a single target as a sine.
  void addLoop(const Value& object, int node, std::size_t targets);
  void addAnimations(config::Errors& errors);
  void addAnimation(const Value& value, const Handle& handle);

  std::filesystem::path file_;
  LoadLimits limits_;
  Value root_;
  Scene scene_;
  std::unique_ptr<MaterialLibrary> materials_;
  std::map<std::string, Asset> assets_;
  std::vector<Value> usedMaterials_;  ///< "material" and values of "materials", of visible objects
  std::vector<Value> missingAssets_;  ///< one "asset" value for each missing file of assets/
  std::map<std::string, int> shapes_;
  std::size_t shapeBytes_ = 0;
  std::map<std::string, std::vector<Handle>> handles_;
};

/// Calls `body` with each of an object's morphs.
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
