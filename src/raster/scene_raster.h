// The scene on the GPU, with the passes that all methods share: the G-buffer, diffuse draws and
// cube maps from any viewpoint, and the composite. The geometry is defined in frame/geometry.h, the
// shading in frame/shading.h. A method's own passes are in the method's folder and receive scene().
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

/// The number of texels (RGBA, half floats) with a clamped, infinite or NaN colour component. Signs
/// are ignored: interpolation may store black as -0.
std::uint64_t clampedTexels(std::span<const std::uint16_t> texels);
/// The same count for level 0 of all layers of a texture (RGBA16F).
std::uint64_t clampedTexels(const gl::Texture& texture);

/// The OpenGL side of one scene. It must not outlive its context.
class SceneRaster {
 public:
  /// Uploads geometry, textures and materials. Compiles programs only for features in use.
  SceneRaster(const scene::Scene& scene, const frame::Geometry& geometry);
  ~SceneRaster();
  SceneRaster(const SceneRaster&) = delete;
  SceneRaster& operator=(const SceneRaster&) = delete;

  /// The scene that methods' own passes draw, and the view of the last G-buffer.
  SceneGpu& scene();
  const FrameView& gbufferView() const;

  /// Re-uploads the vertices of changed objects (indices into geometry.objects).
  void update(const frame::Geometry& geometry, std::span<const int> changedObjects);
  /// The folder in which buildDetailLevels() stores its results. Default: none.
  void cacheLevelsIn(std::filesystem::path folder);
  /// Builds coarser levels of the objects, for passes that draw them. Call once, before the first
  /// frame.
  void buildDetailLevels(const scene::Scene& scene, const frame::Geometry& geometry,
                         const frame::Lighting& lighting);

  GBuffer makeGBuffer(const GBufferSize& size) const;

  /// Fills diffuse, normal, object, depth and stencil. With `part`, in samples, only samples within
  /// its rectangles are drawn; elsewhere `target` keeps its contents, which must come from a whole
  /// drawGBuffer() with this camera and lighting. The samples are bit-identical to a whole draw.
  /// `geometry`: that of the last update(); required with `part`.
  DrawStatistics drawGBuffer(GBuffer& target, const scene::Camera& camera,
                             const frame::Lighting& lighting,
                             const std::optional<Region>& part = std::nullopt,
                             const frame::Geometry* geometry = nullptr);

  /// The G-buffer of the still objects alone, valid at least in the tiles of `part`. Each tile is
  /// drawn once and kept until the next whole drawGBuffer(). Camera, lighting and size must be
  /// those of the last whole drawGBuffer().
  const GBuffer& drawStill(const GBuffer& like, const scene::Camera& camera,
                           const frame::Lighting& lighting, const Region& part,
                           const frame::Geometry& geometry, DrawStatistics* statistics = nullptr);

  /// Draws a set of objects with any view projection (reversed-Z, origin at the upper left) into
  /// the bound framebuffer. The outputs go to its colour attachments in order. The caller has
  /// cleared the depth attachment and set the viewport. The scissor is that of the current
  /// gl::DrawScope.
  DrawStatistics drawDiffuse(const Mat4& clipFromWorld, const Vec3& eye, float pixelSpreadRad,
                             const frame::Lighting& lighting, const DiffuseDraw& what = {});

  /// A cube map of the diffuse scene as seen from `centre`, RGBA16F with mip levels. Still objects
  /// that enclose the centre are left out. `earlier`: a map that this function returned before; it
  /// is reused if it has the same size.
  gl::Texture drawCubeMap(const Vec3& centre, int faceSize, const frame::Lighting& lighting,
                          const ObjectSet& objects = {}, gl::Texture earlier = {});

  /// Resolves samples to pixels in `frame` (RGBA32F, width x height, row 0 on top). rgb is the mean
  /// over the samples of (1 - s) diffuse + s tint reflection. a is the fraction of samples that are
  /// not background. With `part`, in samples, only the pixels of its rectangles are written.
  void composite(const GBuffer& source, const scene::Camera& camera,
                 const CompositeOptions& options, gl::Texture& frame,
                 const std::optional<Region>& part = std::nullopt);

  /// Makes `program` current and binds what the shading functions need: the frame block, with the
  /// view of the last G-buffer, and the environment.
  void bindShadingResources(std::uint32_t program, const frame::Lighting& lighting) const;
  /// The defines for programs that include raster/shaders/shading.glsl.
  static std::vector<gl::Define> shadingDefines(const frame::Lighting& lighting);

  std::size_t memoryBytes() const;  ///< size of geometry, textures and materials on the OpenGL side

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace catoptric::raster
