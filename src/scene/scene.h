// The scene as loaded: plain data, complete and checked (every index in range, every float
// finite), before anything is animated, flattened or uploaded. Both glTF files and scene
// descriptions load into it; frame/geometry.h makes the world-space triangles of one moment.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/math.h"

namespace catoptric::implicit {
struct Surface;
}

namespace catoptric::scene {

inline constexpr int kNone = -1;

enum class Wrap : std::uint8_t { Repeat, MirroredRepeat, ClampToEdge };

/// One mip level, RGBA8, row 0 is v = 0 (the top row of the image file), rows tightly packed.
struct MipLevel {
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> rgba;
};

/// A texture with its whole mip chain, made once at load by box filtering of linear values, so
/// that GL and the CPU sample the same texels. `srgb` textures decode to linear when sampled.
struct Texture {
  std::string name;
  bool srgb = true;
  bool nearest = false;  ///< magnification and minification without interpolation, base level only
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

/// What shading needs; methods.md's s, g, n are derived once at load by scene/reflectance.h.
/// Surfaces are two-sided for all rays: the shading normal is turned to the viewer.
struct Material {
  std::string name;
  Vec3 baseColor{1.0f};  ///< scene-linear Rec.709; albedo = baseColor * texture * vertex colour
  TextureSlot baseColorTexture;
  Vec3 emissive{0.0f};  ///< radiance, strength included
  TextureSlot emissiveTexture;
  TextureSlot normalTexture;  ///< tangent space, linear
  float normalScale = 1.0f;
  float specularLevel = 0.0f;  ///< s: weight of the reflection, 0 (diffuse) .. 1 (pure mirror)
  float glossiness = 0.0f;     ///< g: 0 mirror .. 1 widest lobe
  /// glTF metallic (b) and roughness (g) texture; per texel s and g by the mapping. The factors
  /// kept here are what the texels are multiplied with.
  TextureSlot metallicRoughnessTexture;
  float metallicFactor = 0.0f;
  float roughnessFactor = 1.0f;
  float dielectricF0 = 0.04f;  ///< of the non-metallic part: ior and specular factor
  /// The reflection is multiplied with reflectionTint + albedoTint * albedo (frame/shading.h).
  /// finishScene() leaves albedoTint above 0 only where that differs from place to place.
  Vec3 reflectionTint{1.0f};
  float albedoTint = 0.0f;
  /// Index of refraction of the body that the surface bounds: the weight s goes to the refracted
  /// ray instead of the mirrored one. 0: mirrors.
  float refraction = 0.0f;
  AlphaMode alphaMode = AlphaMode::Opaque;
  float alphaCutoff = 0.5f;
  float baseAlpha = 1.0f;
  bool unlit = false;  ///< KHR_materials_unlit: radiance = albedo, no lights

  bool tintVaries() const { return albedoTint > 0.0f; }
};

struct MorphTarget {
  std::vector<Vec3> positions;  ///< deltas; empty or one per vertex
  std::vector<Vec3> normals;
  std::vector<Vec3> tangents;
};

/// An indexed triangle list in object space. Normals always present and of unit length,
/// uv/colour arrays empty or one per vertex, tangents present when the material needs them.
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
  /// The implicit surface, in object space, that the triangles approximate: rays meet the surface
  /// itself. Null for what is made of triangles, and for what deforms.
  std::shared_ptr<const implicit::Surface> surface;
};

/// Node of a forest; parents stand before their children.
struct Node {
  std::string name;
  int parent = kNone;
  bool hasMatrix = false;  ///< matrix instead of translation, rotation, scale
  Mat4 matrix{1.0f};
  Vec3 translation{0.0f};
  Quat rotation{1.0f, 0.0f, 0.0f, 0.0f};
  Vec3 scale{1.0f};
  int skin = kNone;
  std::vector<float> morphWeights;
};

struct Skin {
  std::vector<int> joints;  ///< nodes
  std::vector<Mat4> inverseBind;
};

/// A natural part of the scene: one primitive at one node (or one instance of it).
/// Its id is its index in Scene::objects plus 1; 0 is the background. Ids never change.
struct Object {
  std::string name;
  int mesh = kNone;
  int node = kNone;
  int material = kNone;
  Mat4 nodeFromInstance{1.0f};  ///< EXT_mesh_gpu_instancing; identity otherwise
  /// 1, 2, ... in order of load for reflective objects; 0 for diffuse ones.
  int reflector = 0;
  bool planar = false;  ///< all vertices in one plane with its normal, and no normal map
};

enum class LightType : std::uint8_t { Directional, Point, Spot };

/// KHR_lights_punctual: point and spot intensity in W/sr, directional irradiance in W/m^2, along
/// the node's -z. `baked` lights act through the baked irradiance of vertices (with shadows and
/// interreflection) instead of being evaluated, unshadowed, at run time.
struct Light {
  std::string name;
  LightType type = LightType::Point;
  Vec3 intensity{1.0f};  ///< colour times intensity
  float range = 0.0f;    ///< metres; 0 means unlimited
  float innerConeRad = 0.0f;
  float outerConeRad = kPi / 4.0f;
  float radius = 0.0f;  ///< metres; size of the emitter for soft baked shadows
  bool baked = false;
  int node = kNone;  ///< kNone: use position and direction
  Vec3 position{0.0f};
  Vec3 direction{0.0f, -1.0f, 0.0f};
};

enum class EnvironmentType : std::uint8_t { Constant, Gradient, File };

/// Radiance from infinitely far away.
struct Environment {
  EnvironmentType type = EnvironmentType::Constant;
  Vec3 color{0.0f};  ///< constant radiance; for a gradient: at the zenith
  Vec3 horizon{0.0f};
  Vec3 ground{0.0f};
  std::filesystem::path file;  ///< latitude-longitude image, EXR or HDR
  float scale = 1.0f;
  float rotationRad = 0.0f;  ///< about +y
  bool isDefault = false;    ///< stands in for the light that the file does not have
};

struct CameraDefinition {
  std::string name;
  int node = kNone;
  float verticalFovRad = kPi / 4.0f;
};

enum class Interpolation : std::uint8_t { Step, Linear, CubicSpline };
enum class Target : std::uint8_t { Translation, Rotation, Scale, Weights };

/// values: per key 3 (translation, scale), 4 (rotation, xyzw) or weights' count floats; for
/// CubicSpline in-tangent, value, out-tangent.
struct AnimationChannel {
  int node = kNone;
  Target target = Target::Translation;
  Interpolation interpolation = Interpolation::Linear;
  std::vector<float> times;  ///< seconds, strictly increasing
  std::vector<float> values;
};

enum class BakeMode : std::uint8_t { None, AmbientOcclusion, Full };

/// What Embree bakes per vertex at load (cached): ambient occlusion, or with Full also the
/// irradiance of baked lights, of the environment through openings, and of interreflection.
struct BakeSettings {
  BakeMode mode = BakeMode::None;
  int rays = 256;                         ///< hemisphere rays per vertex
  int bounces = 2;                        ///< gathers of interreflection (Full)
  float ambientOcclusionDistance = 0.0f;  ///< metres; 0: a tenth of the scene's diameter
};

struct Scene {
  std::string name;
  std::filesystem::path source;  ///< the file that was loaded
  /// Where the origin of "world space" lies in the file's coordinates: 0 but for scenes far away
  /// from 0, whose floats would be coarse. Poses, lights and cameras (finishScene, loadPath) have
  /// it taken off already, in double; whoever reads or writes positions of the file's must do so
  /// too.
  glm::dvec3 origin{0.0};
  std::vector<Mesh> meshes;
  std::vector<Material> materials;
  std::vector<Texture> textures;
  std::vector<Node> nodes;
  std::vector<Skin> skins;
  std::vector<Object> objects;
  std::vector<Light> lights;
  std::vector<CameraDefinition> cameras;
  std::vector<AnimationChannel> animation;
  Environment environment;
  BakeSettings bake;
  /// Radiance added as irradiance pi * ambient * occlusion everywhere; lights rooms that no sky
  /// sees.
  Vec3 ambient{0.0f};
  /// Lights that are not baked show in glossy surfaces: true for glTF files, an option of scene
  /// descriptions.
  bool highlights = false;
  std::vector<std::string> notes;     ///< what the loader ignored or approximated, for `info`
  std::vector<std::string> warnings;  ///< what will look wrong; runs say it, too
  std::uint64_t fingerprint = 0;      ///< of all contents

  int reflectorCount() const;
  std::size_t triangleCount() const;            ///< of all objects (instances counted)
  std::size_t reflectiveTriangleCount() const;  ///< of reflective objects
  std::size_t memoryBytes() const;              ///< of this structure's arrays
  bool animated() const { return !animation.empty(); }
  /// Last key's time in seconds; 0 without animation.
  float duration() const;
};

}  // namespace catoptric::scene
