// Materials and textures on the GPU, and the shader variant that each object needs.
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

/// The features with which a variant of surface.glsl is compiled. Only needed variants are
/// compiled.
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
  kSky = 1u << 13,  ///< receives light of the environment or ambient light, where visible
  kRadianceOutput = 1u << 14,     ///< output of a pass: diffuse radiance
  kNormalOutput = 1u << 15,       ///< output of a pass: the shading normal
  kSpecularOutput = 1u << 16,     ///< output of a pass: s and the lobe
  kTintOutput = 1u << 17,         ///< output of a pass: the reflection's tint
  kBend = 1u << 18,               ///< see frame::bendsNormals()
  kHighlightOutput = 1u << 19,    ///< output of a pass: highlights of the lights
  kLobeHorizonOutput = 1u << 20,  ///< output of a pass: the normal that bounds the rays of lobes
  kGgx = 1u << 21,                ///< highlights of the lights are those of GGX lobes
};

/// The features that follow from the material alone.
std::uint32_t materialFeatures(const scene::Material& material);
/// `features` without those that the lighting does not need. `sky`: hasSky() of the lighting.
std::uint32_t litFeatures(std::uint32_t features, bool sky);
/// The features that a pass with these outputs (bits of Feature) needs, together with the outputs.
std::uint32_t passFeatures(std::uint32_t features, std::uint32_t outputs);
/// The features that follow from an object's vertex attributes: colours that are not white, and
/// baked light. kSky is set if any vertex sees the sky.
std::uint32_t vertexFeatures(const frame::Geometry& geometry, const frame::ObjectRange& range);
/// The defines of vertex.glsl and surface.glsl for a set of features.
std::vector<gl::Define> featureDefines(std::uint32_t features);

/// Diffuse, CurvedMirror or Glossy, according to the largest values of the material's textures.
SampleClass materialClass(const scene::Scene& scene, const scene::Material& material);
/// The classes of all materials. A class may need a scan of a texture.
std::vector<SampleClass> materialClasses(const scene::Scene& scene);
/// `size` with the optional textures that the G-buffer of this scene needs: tints, highlights, lobe
/// horizons. Lobe horizons are needed if any object with lobes has shading normals that may be
/// corrected (frame::bendsNormals()): its triangles' normals then bound the rays of the lobes.
GBufferSize withTexturesFor(const scene::Scene& scene, GBufferSize size);
/// Size in bytes, on the OpenGL side, of the textures that materials use.
std::uint64_t textureBytes(const scene::Scene& scene);
/// The class of an object: as materialClass(), with planar mirrors distinguished from curved ones.
inline SampleClass objectClass(SampleClass material, const scene::Object& object) {
  return material == SampleClass::CurvedMirror && object.planar ? SampleClass::PlanarMirror
                                                                : material;
}

/// The textures, with the mip chains that the scene stores, and the uniform blocks of the
/// materials.
class Materials {
 public:
  Materials() = default;
  /// Uploads the textures that materials use. Throws SceneError, which names the texture, if a
  /// texture exceeds the limits of the context or has no pixels.
  explicit Materials(const scene::Scene& scene);

  /// Binds the block and the textures of a material, at the units that surface.glsl names.
  void bind(int material) const;
  /// Reflection tints, and F90 in a, indexed by object id (0: background): an RGBA32F texel buffer.
  const gl::Texture& tints() const { return tints_; }
  bool tinted() const {
    return tinted_;
  }  ///< whether a reflective object has a tint or F90 other than 1
  /// Which optional textures of the G-buffer the scene needs: see withTexturesFor().
  bool tintVaries() const { return gbuffer_.tints; }
  bool highlights() const { return gbuffer_.highlights; }
  bool lobeHorizons() const { return gbuffer_.lobeHorizons; }
  bool reflective() const { return reflective_; }  ///< whether any object reflects
  bool ggx() const { return ggx_; }                ///< whether any reflective object has a GGX lobe
  SampleClass classOf(int material) const { return classes_[material]; }
  std::size_t bytes() const;

 private:
  struct Slots {
    int base = scene::kNone;
    int normal = scene::kNone;
    int specular = scene::kNone;
    int emissive = scene::kNone;
  };
  std::vector<gl::Texture> textures_;  ///< empty for textures that are not used
  std::vector<Slots> slots_;
  std::vector<SampleClass> classes_;
  gl::Buffer blocks_;
  gl::Buffer tintBuffer_;
  gl::Texture tints_;
  std::size_t blockStride_ = 0;
  bool tinted_ = false;
  GBufferSize gbuffer_;  ///< says which optional textures are needed
  bool reflective_ = false;
  bool ggx_ = false;
};

}  // namespace catoptric::raster
