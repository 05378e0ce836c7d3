// The G-buffer and the composite: sample-resolution textures that every rasterizing method reads
// and writes, and their reduction to the frame.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "gl/draw_state.h"
#include "gl/objects.h"
#include "raster/constants.h"
#include "raster/regions/rectangle.h"
#include "scene/lobe.h"

namespace catoptric::raster {

/// Stencil values that classify samples, so that full-screen passes run on the live ones only
/// (on llvmpipe a pass without live tiles costs 4 ms with, 104 ms without a stencil test).
enum class SampleClass : std::uint8_t {
  Background = shared::kClassBackground,
  Diffuse = shared::kClassDiffuse,
  PlanarMirror = shared::kClassPlanarMirror,
  CurvedMirror = shared::kClassCurvedMirror,
  Glossy = shared::kClassGlossy,  ///< any object whose lobe can be none of a mirror
};

/// Draws on the samples of one class alone, by the G-buffer's stencil.
gl::DrawState onSamplesOf(SampleClass sampleClass);
/// Draws on the samples of planar and curved mirrors.
gl::DrawState onMirrors();

/// The lobe as the alpha of GBuffer::normal has it: its code, or -1 - code where the normal was
/// bent, so that mirrored rays leave above the surface (frame::aboveSurface). In shaders:
/// lobe.glsl.
inline scene::Lobe lobeOf(float alpha) {
  return {alpha < 0.0f ? -1.0f - alpha : alpha};
}
inline bool isBent(float alpha) {
  return alpha < 0.0f;
}
/// frame::SurfacePoint::lobeHorizon of a sample with this `normal` by what GBuffer::lobeHorizon has
/// of it.
Vec3 lobeHorizonOf(std::uint32_t packed, const Vec3& normal);

/// All textures are width * samples by height * samples; row 0 is the top of the image
/// (glClipControl upper left). Sample (i, j) is centred at ((i + .5) / samples, (j + .5) / samples)
/// pixels.
struct GBuffer {
  int width = 0;  ///< of the frame, pixels
  int height = 0;
  int samples = 1;  ///< per axis
  gl::Texture
      diffuse;  ///< RGBA32F: diffuse radiance (before any factor 1 - s), s; -1 on the background
  /// RGBA32F: world-space normal of the reflection turned to the viewer, lobe; by lobeOf()
  gl::Texture normal;
  gl::Texture object;  ///< R32UI: object id, 0 background
  /// RGBA32F: what the reflection is multiplied with beside s; empty where each object has one.
  gl::Texture tint;
  gl::Texture highlight;  ///< RGBA32F: of lights, beside the reflection; empty where there is none
  /// R32UI: the triangle's normal, turned to the viewer, where it bounds the rays of a lobe, else
  /// 0; by lobeHorizonOf(); empty where it is so nowhere.
  gl::Texture lobeHorizon;
  gl::Texture depth;  ///< DEPTH32F_STENCIL8: reversed-Z depth (near / distance along -z)
  gl::Framebuffer framebuffer;
  /// What methods write: incoming radiance along the reflected ray (tint and s not applied).
  gl::Texture reflection;  ///< RGBA32F, a = 1
  gl::Texture masks;       ///< R16UI: bits of raster::MaskBit, per sample; only when asked for
  gl::Framebuffer reflectionFramebuffer;  ///< reflection (+ masks) + depth's stencil

  int sampleWidth() const { return width * samples; }
  int sampleHeight() const { return height * samples; }
};

struct GBufferSize {
  int width = 512;
  int height = 512;
  int samples = 2;
  bool masks = false;
  bool tints = false;         ///< Materials::tintVaries()
  bool highlights = false;    ///< Materials::highlights()
  bool lobeHorizons = false;  ///< Materials::lobeHorizons()
};

/// Allocates all textures. Throws UsageError when the device's largest texture is smaller.
GBuffer makeGBuffer(const GBufferSize& size);
/// The same without `reflection` and `masks`.
GBuffer makeSurfaceSamples(const GBufferSize& size);

/// Copies texels of level 0, depth and stencil alike, between textures of one size and format.
void copyTexels(const gl::Texture& from, const gl::Texture& to,
                std::span<const Rectangle> rectangles);

/// What is read back of a G-buffer, row 0 on top: sampleWidth x sampleHeight, or some rows of it.
struct GBufferCopy {
  int width = 0;  ///< of the frame, pixels
  int height = 0;
  int samples = 1;
  int firstRow = 0;            ///< of samples, which the arrays begin with
  int rows = 0;                ///< that they hold
  std::vector<float> diffuse;  ///< 4 a sample: rgb, s; -1 on the background
  std::vector<float> normal;   ///< 4 a sample: xyz, lobe by lobeOf()
  std::vector<std::uint32_t> object;
  std::vector<std::uint32_t> lobeHorizon;  ///< where the G-buffer has it
  std::vector<float> depth;                ///< reversed-Z

  int sampleWidth() const { return width * samples; }
  int sampleHeight() const { return height * samples; }
};

/// Reads a G-buffer back into `copy`, whose memory is used again. `withDiffuse`: diffuse radiance
/// and s too (empty otherwise).
void readBack(const GBuffer& source, bool withDiffuse, GBufferCopy& copy);
/// The same of some rows of samples.
void readRows(const GBuffer& source, int firstRow, int rows, bool withDiffuse, GBufferCopy& copy);

/// Reads a texture back, row 0 on top. RGBA32F: 4 floats a texel.
std::vector<float> readRgba(const gl::Texture& texture);
/// Some rectangles of it, into what was read before.
void readRgba(const gl::Texture& texture, std::span<const Rectangle> parts,
              std::span<float> values);
std::vector<std::uint32_t> readIds(const gl::Texture& texture);
std::vector<float> readDepth(const gl::Texture& texture);
std::vector<std::uint16_t> readMasks(const gl::Texture& texture);
void writeMasks(gl::Texture& texture, std::span<const std::uint16_t> masks);

/// Where a method fell back, as bits of GBuffer::masks; also the names of counters and mask layers.
enum MaskBit : std::uint16_t {
  kMaskEnvironment = shared::kMaskEnvironment,
  kMaskDisoccluded = shared::kMaskDisoccluded,
  kMaskClamped = shared::kMaskClamped,
  kMaskRetraced = shared::kMaskRetraced,
  kMaskBelowHorizon = shared::kMaskBelowHorizon,
  kMaskSky = shared::kMaskSky,
  kMaskTransition = shared::kMaskTransition,
};

}  // namespace catoptric::raster
