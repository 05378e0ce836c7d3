// The loaded scene as plain data, complete and checked (all indices are in range, all floats
// finite), before animation or upload. glTF files and scene descriptions are both loaded into it.
// frame/geometry.h builds its world-space triangles for one time.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/math.h"
#include "scene/lobe.h"

namespace catoptric::implicit {
struct Surface;
}

namespace catoptric::scene {

inline constexpr int kNone = -1;

enum class Wrap : std::uint8_t { Repeat, MirroredRepeat, ClampToEdge };

/// One mip level, RGBA8. Row 0 is v = 0, the top row of the image file. Rows are tightly packed.
struct MipLevel {
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> rgba;
};

/// A texture with its whole mip chain. The chain is made once at load, by box filtering of linear
/// values, so that GL and the CPU sample the same texels. `srgb` textures are decoded to linear
/// when sampled.
struct Texture {
  std::string name;
  bool srgb = true;
  bool nearest = false;  ///< sample without interpolation, from the base level only
  Wrap wrapS = Wrap::Repeat;
  Wrap wrapT = Wrap::Repeat;
  std::vector<MipLevel> levels;  ///< levels[0] is the image itself
};

/// A material's reference to a texture; uv' = transform * (u, v, 1) (KHR_texture_transform).
struct TextureSlot {
  int texture = kNone;
  int uvSet = 0;  ///< 0 or 1
  glm::mat3x2 transform{1.0f, 0.0f, 0.0f, 1.0f, 0.0f, 0.0f};
  bool used() const { return texture != kNone; }
};

enum class AlphaMode : std::uint8_t { Opaque, Mask };

/// A material. scene/reflectance.h derives s, g and the Phong exponent n once at load.
/// Surfaces are two-sided for all rays: the shading normal is turned towards the viewer.
struct Material {
  std::string name;
  Vec3 baseColor{1.0f};  ///< scene-linear Rec.709; albedo = baseColor * texture * vertex colour
  TextureSlot baseColorTexture;
  Vec3 emissive{0.0f};  ///< emitted radiance, including its strength factor
  TextureSlot emissiveTexture;
  TextureSlot normalTexture;  ///< tangent space, linear
  float normalScale = 1.0f;
  float specularLevel = 0.0f;  ///< s: weight of the reflection, 0 (diffuse) .. 1 (perfect mirror)
  float roughness = 0.0f;      ///< Phong: g, GGX: glTF's roughness; 0 (mirror) .. 1 (widest)
  LobeModel lobe = LobeModel::Phong;
  /// glTF texture of metallic (b) and roughness (g); each texel is mapped to s and g. The following
  /// factors multiply the texels.
  TextureSlot metallicRoughnessTexture;
  float metallicFactor = 0.0f;
  float roughnessFactor = 1.0f;
  Vec3 dielectricF0{0.04f};    ///< F0 of the non-metallic part, from ior and specular factors
  float dielectricF90 = 1.0f;  ///< GGX: F90 of that part, scene::rimLevel()
  /// The reflection is multiplied by reflectionTint + albedoTint * albedo (frame/shading.h).
  /// finishScene() leaves albedoTint above 0 only where this tint or F90 varies over the surface.
  Vec3 reflectionTint{1.0f};
  float albedoTint = 0.0f;
  /// Index of refraction of the solid that the surface bounds. If above 0, s is the weight of the
  /// refracted ray instead of the reflected one. 0: the surface reflects.
  float refraction = 0.0f;
  AlphaMode alphaMode = AlphaMode::Opaque;
  float alphaCutoff = 0.5f;
  float baseAlpha = 1.0f;
  bool unlit = false;  ///< KHR_materials_unlit: radiance = albedo, independent of lights

  bool tintVaries() const { return albedoTint > 0.0f; }
};

struct MorphTarget {
  std::vector<Vec3> positions;  ///< offsets; empty, or one per vertex
  std::vector<Vec3> normals;
  std::vector<Vec3> tangents;
};

/// An indexed triangle list in object space. Normals are always present and have unit length. uv
/// and colour arrays are empty or have one entry per vertex. Tangents are present if the material
/// needs them.
struct Mesh {
  std::string name;
  std::vector<Vec3> positions;
  std::vector<Vec3> normals;
  std::vector<Vec4> tangents;  ///< w is the sign of the bitangent
  std::array<std::vector<Vec2>, 2> uv;
  std::vector<Vec3> colors;  ///< scene-linear
  std::vector<glm::u16vec4> joints;
  std::vector<Vec4> weights;
  std::vector<MorphTarget> morphTargets;
  std::vector<std::uint32_t> indices;  ///< three per triangle
  /// The implicit surface, in object space, that the triangles approximate; rays are intersected
  /// with it. Null for meshes without one, and for meshes that deform.
  std::shared_ptr<const implicit::Surface> surface;
};

/// A node of a forest. Parents come before their children.
struct Node {
  std::string name;
  int parent = kNone;
  bool hasMatrix = false;  ///< `matrix` replaces translation, rotation and scale
  Mat4 matrix{1.0f};
  Vec3 translation{0.0f};
  Quat rotation{1.0f, 0.0f, 0.0f, 0.0f};
  Vec3 scale{1.0f};
  int skin = kNone;
  std::vector<float> morphWeights;
};

struct Skin {
  std::vector<int> joints;  ///< indices of nodes
  std::vector<Mat4> inverseBind;
};

/// An object: one primitive at one node (or one instance of it). Its id is its index in
/// Scene::objects plus 1; 0 is the background. Ids never change.
struct Object {
  std::string name;
  int mesh = kNone;
  int node = kNone;
  int material = kNone;
  Mat4 nodeFromInstance{1.0f};  ///< for EXT_mesh_gpu_instancing; otherwise identity
  /// 1, 2, ... in loading order for reflective objects; 0 for diffuse objects.
  int reflector = 0;
  bool planar =
      false;  ///< all vertices and their normals belong to one plane, and there is no normal map
};

enum class LightType : std::uint8_t { Directional, Point, Spot };

/// A light of KHR_lights_punctual: point and spot intensity in W/sr, directional irradiance in
/// W/m^2, along the node's -z. `baked` lights contribute only through the baked irradiance of
/// vertices (with shadows and interreflection). Other lights are evaluated at run time, without
/// shadows.
struct Light {
  std::string name;
  LightType type = LightType::Point;
  Vec3 intensity{1.0f};  ///< colour times intensity
  float range = 0.0f;    ///< metres; 0 means unlimited
  float innerConeRad = 0.0f;
  float outerConeRad = kPi / 4.0f;
  float radius = 0.0f;  ///< metres; size of the emitter for soft baked shadows
  bool baked = false;
  int node = kNone;  ///< kNone: `position` and `direction` are used
  Vec3 position{0.0f};
  Vec3 direction{0.0f, -1.0f, 0.0f};
};

enum class EnvironmentType : std::uint8_t { Constant, Gradient, File };

/// The radiance of the surroundings at infinite distance.
struct Environment {
  EnvironmentType type = EnvironmentType::Constant;
  Vec3 color{0.0f};  ///< constant radiance; for a gradient: radiance at the zenith
  Vec3 horizon{0.0f};
  Vec3 ground{0.0f};
  std::filesystem::path file;  ///< latitude-longitude image, EXR or HDR
  float scale = 1.0f;
  float rotationRad = 0.0f;  ///< about +y
  bool isDefault = false;    ///< the loader added it because the file has no light
};

struct CameraDefinition {
  std::string name;
  int node = kNone;
  float verticalFovRad = kPi / 4.0f;
  float nearMetres = 0.0f;  ///< 0: the camera path's value
};

enum class Interpolation : std::uint8_t { Step, Linear, CubicSpline };
enum class Target : std::uint8_t { Translation, Rotation, Scale, Weights };

/// An animated property. Floats per key: 3 (translation, scale), 4 (rotation, xyzw), or the number
/// of weights. CubicSpline has in-tangent, value and out-tangent per key.
struct AnimationChannel {
  int node = kNone;
  Target target = Target::Translation;
  Interpolation interpolation = Interpolation::Linear;
  std::vector<float> times;  ///< seconds, strictly increasing
  std::vector<float> values;
};

enum class BakeMode : std::uint8_t { None, AmbientOcclusion, Full };

/// Settings of the light that Embree bakes per vertex at load (cached): ambient occlusion; with
/// Full also the irradiance of baked lights, of the environment through openings, and of
/// interreflection.
struct BakeSettings {
  BakeMode mode = BakeMode::None;
  int rays = 256;                         ///< hemisphere rays per vertex
  int bounces = 2;                        ///< gathers of interreflection (Full)
  float ambientOcclusionDistance = 0.0f;  ///< metres; 0: a tenth of the scene's diameter
  /// Full: the light that arrives from the environment itself stays a share of its unoccluded
  /// light, so that normal maps change it.
  bool skyApart = false;
};

struct Scene {
  std::string name;
  std::filesystem::path source;  ///< the file that was loaded
  /// The origin of world space in the file's coordinates. It is 0 except for scenes far away from
  /// 0, whose float coordinates would be coarse. finishScene and loadPath have subtracted it (in
  /// double) from poses, lights and cameras. Code that reads or writes positions in file
  /// coordinates must do the same.
  glm::dvec3 origin{0.0};
  std::vector<Mesh> meshes;
  std::vector<Material> materials;
  std::vector<Texture> textures;
  std::vector<Node> nodes;
  std::vector<Skin> skins;
  std::vector<Object> objects;
  std::vector<Light> lights;
  std::vector<CameraDefinition> cameras;
  int ground = kNone;  ///< object that addGround() added; cameras that fit the scene leave it out
  std::vector<AnimationChannel> animation;
  Environment environment;
  BakeSettings bake;
  /// Adds the irradiance pi * ambient * occlusion everywhere. It lights rooms that receive no light
  /// from the sky.
  Vec3 ambient{0.0f};
  /// Whether unbaked lights cause highlights on glossy surfaces: true for glTF files, an option of
  /// scene descriptions.
  bool highlights = false;
  std::vector<std::string> notes;     ///< data that the loader ignored or approximated, for `info`
  std::vector<std::string> warnings;  ///< problems that will be visible; runs report them too
  std::uint64_t fingerprint = 0;      ///< of all contents

  int reflectorCount() const;
  bool hasGgxLobes() const;                     ///< whether any reflective object has one
  std::size_t triangleCount() const;            ///< over all objects (instances counted)
  std::size_t reflectiveTriangleCount() const;  ///< over the reflective objects
  std::size_t memoryBytes() const;              ///< size of this structure's arrays
  bool animated() const { return !animation.empty(); }
  /// Time of the last key in seconds; 0 without animation.
  float duration() const;
};

}  // namespace catoptric::scene
