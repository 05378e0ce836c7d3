// Draws the scene's triangles with GL: the G-buffer pass, diffuse images from any camera (cube
// maps, impostors, clusters' depth images), and the composite. Geometry is that of
// frame/geometry.h, shading that of frame/shading.h.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "frame/geometry.h"
#include "frame/shading.h"
#include "gl/shader.h"
#include "raster/gbuffer.h"
#include "raster/regions/rectangle.h"
#include "raster/virtual_objects.h"
#include "scene/camera.h"
#include "scene/scene.h"

namespace catoptric::raster {

/// Counts of one G-buffer pass.
struct DrawStatistics {
  std::uint64_t triangles = 0;  ///< submitted after culling
  std::uint64_t culledTriangles = 0;
};

/// What the composite makes of a G-buffer.
struct CompositeOptions {
  bool fresnelSchlick = false;  ///< s + (1 - s)(1 - cos)^5 instead of s
};

/// How much of drawing is done. Less than all of it makes no picture: it shows what the triangles
/// of a picture cost at least.
enum class DrawCost : std::uint8_t {
  Whole,
  SeenOnce,  ///< over the depth of the same picture, drawn before: each sample is shaded once
  Constant,  ///< without shading
};

/// One of many diffuse images that are drawn together.
struct DiffuseView {
  Mat4 clipFromWorld{1.0f};  ///< right-handed, reversed-Z without a far plane, upper left
  Vec3 eye{0.0f};
  float texelSpreadRad = 0.0f;  ///< angle that one texel subtends
  float nearestMetres = 0.0f;   ///< nothing is drawn nearer to the eye
  /// What lies wholly beyond dot(farClip, (p, 1)) = 0 need not be drawn.
  Vec4 farClip{0.0f, 0.0f, 0.0f, 1.0f};
  /// Of levels of detail, where all of an object's light is shown; 0: always the finest. Objects of
  /// less than half as much are left out.
  float levelErrorTexels = 0.0f;
  float shown = 1.0f;  ///< share of its light that is shown; levels of what is dim err by more
  int layer = 0;       ///< which framebuffer, and the rectangle in it, row 0 on top
  int x = 0;
  int y = 0;
  int width = 1;
  int height = 1;
  /// Id of the object behind which the eye is: only its faces turned to the eye are drawn (0:
  /// none); and whether it is left out altogether.
  int ownObject = 0;
  bool skipOwn = false;
  bool ownBacks = false;                 ///< draw its faces that are turned away, too
  bool peel = false;                     ///< draw a second layer, too
  Vec4 ownClip{0.0f, 0.0f, 0.0f, 1.0f};  ///< ... and only where dot(ownClip, (p, 1)) > 0
};

/// GL side of one scene; lives as long as its context.
/// Texels of level 0 of a cube map (RGBA16F) that half floats have clamped.
std::uint64_t clampedTexels(const gl::Texture& cube);

class SceneRaster {
 public:
  /// Uploads geometry, textures and materials. Only programs for the features that the scene's
  /// materials use are compiled.
  SceneRaster(const scene::Scene& scene, const frame::Geometry& geometry);
  ~SceneRaster();
  SceneRaster(const SceneRaster&) = delete;
  SceneRaster& operator=(const SceneRaster&) = delete;

  /// Re-uploads the vertices of changed objects (indices into geometry.objects).
  void update(const frame::Geometry& geometry, std::span<const int> changedObjects);

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

  /// Draws diffuse radiance (rgb, a = 1; environment where nothing is, a = 0) with any view
  /// projection (reversed-Z, upper left) into the bound framebuffer's colour 0 and depth, within
  /// the viewport set by the caller. `skipObject`: an id left out, 0 for none. `insides`: whether
  /// closed opaque objects about the eye show their insides.
  DrawStatistics drawDiffuse(const Mat4& clipFromWorld, const Vec3& eye, float pixelSpreadRad,
                             const frame::Lighting& lighting, int skipObject = 0,
                             bool insides = true);

  /// Makes coarser levels of the objects for drawDiffuseViews(); once, before the first frame.
  void buildDetailLevels(const scene::Scene& scene, const frame::Geometry& geometry,
                         const frame::Lighting& lighting);

  /// Draws diffuse radiance (colour 0) and depth of all views, each into its rectangle of
  /// `layers[view.layer]`, whose depth the caller has cleared there (where it stays, nothing was
  /// drawn). Triangles that certainly show nothing and levels of detail finer than a view asks for
  /// are not drawn. `geometry`: of the last update(). `triangles[i]`: drawn for views[i].
  /// `compound`: one draw sends an object's triangles to all views of a layer. `peeled`: the array
  /// whose layers are the depth of `layers`, the second half of them for the nearest surfaces
  /// behind those of the first, where views ask for it; or null. Returns how many objects the views
  /// left out for their size, in all.
  std::uint64_t drawDiffuseViews(std::span<const DiffuseView> views,
                                 std::span<const gl::Framebuffer> layers,
                                 const frame::Geometry& geometry, const frame::Lighting& lighting,
                                 std::span<std::uint64_t> triangles, bool compound = false,
                                 const gl::Texture* peeled = nullptr);

  /// Draws the diffuse radiance of virtual objects into the bound framebuffer's colour 0 and depth
  /// (reversed-Z, cleared by the caller), each on the samples of its reflector. drawGBuffer() with
  /// this camera came before. Nothing is drawn outside the rectangles `parts`, in samples; the
  /// stencil test is the caller's.
  void drawVirtualObjects(std::span<const VirtualObject* const> objects, const VirtualPass& pass,
                          const scene::Camera& camera, const frame::Lighting& lighting,
                          std::span<const Rectangle> parts);

  /// Cube map of the diffuse scene seen from `centre`, RGBA16F with mip levels. What is closed
  /// about the centre, and does not move, is left out.
  gl::Texture drawCubeMap(const Vec3& centre, int faceSize, const frame::Lighting& lighting,
                          int skipObject = 0);

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

  /// For benchmarks; DrawCost::Whole by default.
  void setDrawCost(DrawCost cost);
  DrawCost drawCost() const;

  std::size_t memoryBytes() const;  ///< of geometry, textures and materials on the GL side

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace catoptric::raster
