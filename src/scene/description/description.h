// Parts of the loader of scene descriptions. docs/scenes.md describes the format.
#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

#include "config/json.h"
#include "scene/loader.h"
#include "scene/shapes/shapes.h"

namespace catoptric::scene {

/// The schemas, for validation, configs/schema/scene.schema.json and docs.
const config::Schema& sceneSchema();
const config::Schema& materialSchema();
const config::Schema& lightSchema();
const config::Schema& morphSchema();
/// The members of an object with this shape; "" for assets and groups.
const config::Schema& objectSchema(const std::string& shape);
const std::vector<std::string>& shapeNames();

/// The mesh of an object's "shape". Throws UsageError with the place of a wrong parameter.
Mesh makeShape(const config::Value& object);
/// The mesh of the shape "implicit".
Mesh makeImplicitShape(const config::Value& object, UvMode uv);
/// A text that is equal for objects with equal meshes.
std::string shapeKey(const config::Value& object);
MorphShape morphOf(const config::Value& morph);

/// Reads materials and the names of their textures. finish() then makes the textures, in parallel.
class MaterialLibrary {
 public:
  /// `definitions`: the description's "materials"; their errors are added to `errors`. File names
  /// are relative to `folder`.
  MaterialLibrary(Scene& scene, config::Value definitions, std::filesystem::path folder,
                  const LoadLimits& limits, config::Errors& errors);

  /// Throws UsageError, with the nearest name, if no material has this name.
  void requireDefined(const config::Value& nameValue) const;
  /// The index in scene.materials of a named or inline material. `base`: the material of the asset
  /// from which an inline material with "keep" starts; kNone: none.
  int materialOf(const config::Value& nameOrInline, int base);
  /// The white diffuse material of objects that name none.
  int plain();
  /// A copy of material `index`, changed according to an object's "reflective".
  int reflectiveOf(int index, const config::Value& reflective);
  /// Makes all requested textures.
  void finish();

 private:
  /// A texture that was requested and is not made yet.
  struct TextureJob {
    enum class Kind { File, Procedural, NormalMap } kind = Kind::File;
    config::Value source;
    std::filesystem::path file;
    float strength = 1.0f;
    int texture = kNone;
  };
  int texture(const config::Value& source, bool srgb, const config::Value& material);
  int normalTexture(const config::Value& material, const config::Value& colorSource);
  int addJob(const std::string& key, TextureJob job);
  Material read(const config::Value& value, Material material);

  Scene& scene_;
  config::Value definitions_;
  std::filesystem::path folder_;
  LoadLimits limits_;
  std::map<std::string, int> byKey_;
  std::map<std::string, int> textures_;
  std::vector<TextureJob> jobs_;
};

/// The file that a description in `folder` names, as assetFile() finds it. Throws UsageError if it
/// lies outside all folders.
std::filesystem::path describedFile(const config::Value& name, const std::filesystem::path& folder,
                                    const LoadLimits& limits);

/// The rotation of "rotate", given as degrees [r, p, h]: about z first, then x, then y.
Quat rotationOf(const Vec3& degreesXyz);

}  // namespace catoptric::scene
