// Materials and textures on the GL side, and which program variant an object needs.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "frame/geometry.h"
#include "gl/objects.h"
#include "gl/shader.h"
#include "raster/gbuffer.h"
#include "scene/scene.h"

namespace catoptric::raster {

/// What a variant of surface.glsl is compiled with; only combinations that occur are compiled.
enum Feature : std::uint32_t {
  kBaseTexture = 1u << 0,
  kNormalMap = 1u << 1,
  kSpecularTexture = 1u << 2,
  kEmissiveTexture = 1u << 3,
  kAlphaMask = 1u << 4,
  kVertexColor = 1u << 5,
  kUnlit = 1u << 6,
  kBaseUv1 = 1u << 7,
  kNormalUv1 = 1u << 8,
  kSpecularUv1 = 1u << 9,
  kEmissiveUv1 = 1u << 10,
  kBakeIrradiance = 1u << 11,
  kBakeVisibility = 1u << 12,
  kSky = 1u << 13,                ///< light of the environment or ambient light, where visible
  kRadianceOutput = 1u << 14,     ///< what a pass writes: diffuse radiance,
  kNormalOutput = 1u << 15,       ///< the shading normal,
  kSpecularOutput = 1u << 16,     ///< s and g,
  kTintOutput = 1u << 17,         ///< the reflection's tint
  kBend = 1u << 18,               ///< frame::bendsNormals()
  kHighlightOutput = 1u << 19,    ///< lights' highlights
  kLobeHorizonOutput = 1u << 20,  ///< what bounds the rays of lobes
};

/// Features of a material by itself.
std::uint32_t materialFeatures(const scene::Material& material);
/// Those that the lighting does not need are removed; `sky`: hasSky() of the lighting.
std::uint32_t litFeatures(std::uint32_t features, bool sky);
/// Those that a pass with these outputs (bits of Feature) needs, and the outputs.
std::uint32_t passFeatures(std::uint32_t features, std::uint32_t outputs);
/// Features of an object's vertex attributes: colours that are not white, baked light; kSky where
/// any vertex sees the sky.
std::uint32_t vertexFeatures(const frame::Geometry& geometry, const frame::ObjectRange& range);
/// Defines of vertex.glsl and surface.glsl for a set of features.
std::vector<gl::Define> featureDefines(std::uint32_t features);

/// Diffuse, CurvedMirror or Glossy: what a material can show anywhere (a texture's largest values).
SampleClass materialClass(const scene::Scene& scene, const scene::Material& material);
/// Whether rays of some object's lobes may be bounded by another normal than their own
/// (frame::bendsNormals(), and lobes).
bool hasLobeHorizons(const scene::Scene& scene);
/// The class of an object: planar mirrors are told from curved ones.
inline SampleClass objectClass(SampleClass material, const scene::Object& object) {
  return material == SampleClass::CurvedMirror && object.planar ? SampleClass::PlanarMirror
                                                                : material;
}

/// Textures (with the mip chains that the scene holds) and the materials' uniform blocks.
class Materials {
 public:
  Materials() = default;
  /// Uploads the textures that materials use. Throws SceneError that names the texture when it
  /// exceeds the context's limits or has no pixels.
  explicit Materials(const scene::Scene& scene);

  /// Binds the block and the textures of a material, as surface.glsl names them.
  void bind(int material) const;
  /// Reflection tints by object id (0: background), RGBA32F texel buffer.
  const gl::Texture& tints() const { return tints_; }
  bool tinted() const { return tinted_; }          ///< any reflective object with a tint but 1
  bool tintVaries() const { return tintVaries_; }  ///< and one with a tint of its own everywhere
  bool highlights() const { return highlights_; }  ///< any object on which lights show
  bool lobeHorizons() const { return lobeHorizons_; }  ///< hasLobeHorizons()
  bool reflective() const { return reflective_; }      ///< any object that reflects
  SampleClass classOf(int material) const { return classes_[material]; }
  std::size_t bytes() const;

 private:
  struct Slots {
    int base = scene::kNone;
    int normal = scene::kNone;
    int specular = scene::kNone;
    int emissive = scene::kNone;
  };
  std::vector<gl::Texture> textures_;  ///< empty ones are not used
  std::vector<Slots> slots_;
  std::vector<SampleClass> classes_;
  gl::Buffer blocks_;
  gl::Buffer tintBuffer_;
  gl::Texture tints_;
  std::size_t blockStride_ = 0;
  bool tinted_ = false;
  bool tintVaries_ = false;
  bool highlights_ = false;
  bool lobeHorizons_ = false;
  bool reflective_ = false;
};

}  // namespace catoptric::raster
