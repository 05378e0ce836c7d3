// Parts of the scene description's loader; docs/scenes.md describes the format.
#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

#include "config/json.h"
#include "scene/loader.h"
#include "scene/shapes/shapes.h"

namespace catoptric::scene {

/// Tables: validation, configs/schema/scene.schema.json, docs.
const config::Schema& sceneSchema();
const config::Schema& materialSchema();
const config::Schema& lightSchema();
const config::Schema& morphSchema();
/// Members of an object with this shape; "" for assets and groups.
const config::Schema& objectSchema(const std::string& shape);
const std::vector<std::string>& shapeNames();

/// The mesh of an object's "shape". Throws UsageError with the place of a wrong parameter.
Mesh makeShape(const config::Value& object);
/// That of the shape "implicit".
Mesh makeImplicitShape(const config::Value& object, UvMode uv);
/// Text that is the same for objects with the same mesh.
std::string shapeKey(const config::Value& object);
MorphShape morphOf(const config::Value& morph);

/// Reads materials, and the textures they name; the textures are made by finish(), in parallel.
class MaterialLibrary {
 public:
  /// `definitions`: the description's "materials", whose errors are added; files are relative to
  /// `folder`.
  MaterialLibrary(Scene& scene, config::Value definitions, std::filesystem::path folder,
                  const LoadLimits& limits, config::Errors& errors);

  /// Index in scene.materials of a name or an inline material. `base` is the asset's material an
  /// inline material with "keep" starts from; kNone: there is none.
  int materialOf(const config::Value& nameOrInline, int base);
  /// The white diffuse material of objects that name none.
  int plain();
  /// A copy of material `index` as an object's "reflective" says.
  int reflectiveOf(int index, const config::Value& reflective);
  /// Makes all textures that were asked for.
  void finish();

 private:
  /// A texture that is asked for and not made yet.
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

/// The file that `name` names in a description in `folder`, which it must not leave. Throws
/// UsageError.
std::filesystem::path fileBeside(const config::Value& name, const std::filesystem::path& folder);

/// [r, p, h] degrees of "rotate": about z first, then x, then y.
Quat rotationOf(const Vec3& degreesXyz);

}  // namespace catoptric::scene
