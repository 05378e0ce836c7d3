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

/// Stencil values that classify samples, so that full-screen passes only run on the samples they
/// need (on llvmpipe a pass over no samples takes 4 ms, without the stencil test 104 ms).
enum class SampleClass : std::uint8_t {
  Background = shared::kClassBackground,
  Diffuse = shared::kClassDiffuse,
  PlanarMirror = shared::kClassPlanarMirror,
  CurvedMirror = shared::kClassCurvedMirror,
  Glossy = shared::kClassGlossy,  ///< any object whose lobe may be wider than that of a mirror
};

/// The state for drawing only on samples of one class, by the G-buffer's stencil.
gl::DrawState onSamplesOf(SampleClass sampleClass);
/// The state for drawing only on samples of planar and curved mirrors.
gl::DrawState onMirrors();

/// Decodes the lobe from the alpha of GBuffer::normal: its code, or -1 - code where the normal was
/// corrected so that mirrored rays leave above the surface (frame::aboveSurface). The shader
/// version is in lobe.glsl.
inline scene::Lobe lobeOf(float alpha) {
  return {alpha < 0.0f ? -1.0f - alpha : alpha};
}
inline bool isBent(float alpha) {
  return alpha < 0.0f;
}
/// frame::SurfacePoint::lobeHorizon of a sample with this `normal`, decoded from
/// GBuffer::lobeHorizon.
Vec3 lobeHorizonOf(std::uint32_t packed, const Vec3& normal);

/// All textures are width * samples by height * samples; row 0 is the top of the image
/// (glClipControl upper left). Sample (i, j) is centred at ((i + .5) / samples, (j + .5) / samples)
/// pixels.
struct GBuffer {
  int width = 0;  ///< width of the frame in pixels
  int height = 0;
  int samples = 1;  ///< per axis
  gl::Texture
      diffuse;  ///< RGBA32F: diffuse radiance (before any factor 1 - s), s; -1 on the background
  /// RGBA32F: world-space normal of the reflection, turned to the viewer; lobe (see lobeOf())
  gl::Texture normal;
  gl::Texture object;  ///< R32UI: object id, 0 background
  /// RGBA32F: factor of the reflection besides s, and F90; empty if each object has a single tint
  gl::Texture tint;
  gl::Texture highlight;  ///< RGBA32F: lights' highlights; empty if there are none
  /// R32UI: the triangle's normal, turned to the viewer, if it bounds the rays of the lobe,
  /// otherwise 0; see lobeHorizonOf(). Empty if no sample needs it.
  gl::Texture lobeHorizon;
  gl::Texture depth;  ///< DEPTH32F_STENCIL8: reversed-Z depth (near / distance along -z)
  gl::Framebuffer framebuffer;
  /// Output of methods: incoming radiance along the reflected ray (tint and s are not applied).
  gl::Texture reflection;  ///< RGBA32F, a = 1
  gl::Texture masks;       ///< R16UI: bits of raster::MaskBit, per sample; only if requested
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

/// The bytes of one sample in the textures of makeSurfaceSamples(), and in those of makeGBuffer().
std::uint64_t surfaceBytesPerSample(const GBufferSize& size);
std::uint64_t bytesPerSample(const GBufferSize& size);

/// Allocates all textures. Throws UsageError if the device's maximum texture size is too small.
GBuffer makeGBuffer(const GBufferSize& size);
/// As makeGBuffer(), without `reflection` and `masks`.
GBuffer makeSurfaceSamples(const GBufferSize& size);

/// Copies texels of level 0 (also depth and stencil) between textures of the same size and format.
void copyTexels(const gl::Texture& from, const gl::Texture& to,
                std::span<const Rectangle> rectangles);

/// The contents of a G-buffer in memory, row 0 on top: sampleWidth x sampleHeight, or some rows.
struct GBufferCopy {
  int width = 0;  ///< width of the frame in pixels
  int height = 0;
  int samples = 1;
  int firstRow = 0;            ///< first row of samples in the arrays
  int rows = 0;                ///< number of rows in the arrays
  std::vector<float> diffuse;  ///< 4 per sample: rgb, s; -1 on the background
  std::vector<float> normal;   ///< 4 per sample: xyz, lobe (see lobeOf())
  std::vector<std::uint32_t> object;
  std::vector<std::uint32_t> lobeHorizon;  ///< empty if the G-buffer has none
  std::vector<float> depth;                ///< reversed-Z

  int sampleWidth() const { return width * samples; }
  int sampleHeight() const { return height * samples; }
};

/// Reads a G-buffer back into `copy`, whose memory is reused. `withDiffuse`: also diffuse radiance
/// and s (otherwise empty).
void readBack(const GBuffer& source, bool withDiffuse, GBufferCopy& copy);
/// As readBack(), for some rows of samples.
void readRows(const GBuffer& source, int firstRow, int rows, bool withDiffuse, GBufferCopy& copy);

/// Reads an RGBA32F texture back, row 0 on top: 4 floats per texel.
std::vector<float> readRgba(const gl::Texture& texture);
/// Reads some rectangles of the texture into `values`, which contain an earlier result.
void readRgba(const gl::Texture& texture, std::span<const Rectangle> parts,
              std::span<float> values);
std::vector<std::uint32_t> readIds(const gl::Texture& texture);
std::vector<float> readDepth(const gl::Texture& texture);
std::vector<std::uint16_t> readMasks(const gl::Texture& texture);
void writeMasks(gl::Texture& texture, std::span<const std::uint16_t> masks);

/// Reasons for fallbacks, as bits of GBuffer::masks; also the names of counters and mask layers.
enum MaskBit : std::uint16_t {
  kMaskEnvironment = shared::kMaskEnvironment,
  kMaskDisoccluded = shared::kMaskDisoccluded,
  kMaskClamped = shared::kMaskClamped,
  kMaskRetraced = shared::kMaskRetraced,
  kMaskBelowHorizon = shared::kMaskBelowHorizon,
  kMaskSky = shared::kMaskSky,
  kMaskTransition = shared::kMaskTransition,
  kMaskOffscreen = shared::kMaskOffscreen,
  kMaskBehind = shared::kMaskBehind,
  kMaskBackface = shared::kMaskBackface,
  kMaskTowardCamera = shared::kMaskTowardCamera,
  kMaskSteps = shared::kMaskSteps,
  kMaskViewColour = shared::kMaskViewColour,
  kMaskFallback = shared::kMaskFallback,
};

}  // namespace catoptric::raster
