// The scene on the device with the passes that all methods share: the G-buffer, diffuse draws and
// cube maps from anywhere, the composite. Geometry is that of frame/geometry.h, shading that of
// frame/shading.h. Methods' own passes stand with the methods and are given scene().
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "frame/geometry.h"
#include "frame/shading.h"
#include "gl/shader.h"
#include "raster/draw.h"
#include "raster/gbuffer.h"
#include "raster/passes/composite_pass.h"
#include "raster/regions/rectangle.h"
#include "scene/camera.h"
#include "scene/scene.h"

namespace catoptric::raster {

class SceneGpu;
struct FrameView;

/// Texels (RGBA, half floats) of which a colour is clamped, infinite or no number, of either sign:
/// black is -0 where interpolation gave less than nothing.
std::uint64_t clampedTexels(std::span<const std::uint16_t> texels);
/// ... of level 0 of all layers of a texture (RGBA16F).
std::uint64_t clampedTexels(const gl::Texture& texture);

/// GL side of one scene; lives as long as its context.
class SceneRaster {
 public:
  /// Uploads geometry, textures and materials. Only programs for the features that the scene's
  /// materials use are compiled.
  SceneRaster(const scene::Scene& scene, const frame::Geometry& geometry);
  ~SceneRaster();
  SceneRaster(const SceneRaster&) = delete;
  SceneRaster& operator=(const SceneRaster&) = delete;

  /// What methods' own passes draw, and the view of the last G-buffer.
  SceneGpu& scene();
  const FrameView& gbufferView() const;

  /// Re-uploads the vertices of changed objects (indices into geometry.objects).
  void update(const frame::Geometry& geometry, std::span<const int> changedObjects);
  /// Where buildDetailLevels() keeps what it makes; nowhere without it.
  void cacheLevelsIn(std::filesystem::path folder);
  /// Makes coarser levels of the objects for passes that draw them; once, before the first frame.
  void buildDetailLevels(const scene::Scene& scene, const frame::Geometry& geometry,
                         const frame::Lighting& lighting);

  GBuffer makeGBuffer(const GBufferSize& size) const;

  /// Fills diffuse, normal, object, depth and stencil; with `part`, in samples, nothing outside its
  /// rectangles: there `target` keeps what it has, which the whole drawn with this camera and
  /// lighting came before. The samples are the same, bit for bit. `geometry`: of the last
  /// update(), needed with `part`.
  DrawStatistics drawGBuffer(GBuffer& target, const scene::Camera& camera,
                             const frame::Lighting& lighting,
                             const std::optional<Region>& part = std::nullopt,
                             const frame::Geometry* geometry = nullptr);

  /// The G-buffer of what stands still alone, in the tiles of `part` at least. It is drawn there
  /// once, until the next whole drawGBuffer(), whose camera, lighting and size these are.
  const GBuffer& drawStill(const GBuffer& like, const scene::Camera& camera,
                           const frame::Lighting& lighting, const Region& part,
                           const frame::Geometry& geometry, DrawStatistics* statistics = nullptr);

  /// Draws a set of objects with any view projection (reversed-Z, upper left) into the bound
  /// framebuffer: the outputs to its colours in order, depth to its depth, which the caller has
  /// cleared; within the viewport set by the caller and the scissor of the current gl::DrawScope.
  DrawStatistics drawDiffuse(const Mat4& clipFromWorld, const Vec3& eye, float pixelSpreadRad,
                             const frame::Lighting& lighting, const DiffuseDraw& what = {});

  /// Cube map of the diffuse scene seen from `centre`, RGBA16F with mip levels. What is closed
  /// about the centre, and does not move, is left out. `earlier`: a map that this has drawn, which
  /// is drawn over if it has that size.
  gl::Texture drawCubeMap(const Vec3& centre, int faceSize, const frame::Lighting& lighting,
                          const ObjectSet& objects = {}, gl::Texture earlier = {});

  /// Resolves samples to pixels into `frame` (RGBA32F, width x height, row 0 on top): mean over the
  /// samples of (1 - s) diffuse + s tint reflection; a = share of samples that are not background.
  /// With `part`, in samples, nothing outside the pixels of its rectangles.
  void composite(const GBuffer& source, const scene::Camera& camera,
                 const CompositeOptions& options, gl::Texture& frame,
                 const std::optional<Region>& part = std::nullopt);

  /// Radiance of the environment is drawn and looked up by this GLSL-side state; methods that need
  /// the materials' table, the environment or the shading functions bind them here.
  void bindShadingResources(std::uint32_t program, const frame::Lighting& lighting) const;
  /// Defines that programs which include raster/shaders/shading.glsl are compiled with.
  static std::vector<gl::Define> shadingDefines(const frame::Lighting& lighting);

  std::size_t memoryBytes() const;  ///< of geometry, textures and materials on the GL side

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace catoptric::raster
