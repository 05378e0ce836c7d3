// Private to src/raster: what SceneRaster keeps, shared by its passes.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "raster/frame_block.h"
#include "raster/scene_gpu/materials.h"
#include "raster/scene_gpu/meshlets.h"
#include "raster/scene_raster.h"

namespace catoptric::raster {

/// llvmpipe bins triangles on one thread and rasterizes on others, a batch at a time: a flush after
/// so many lets both work at once. Ours; the living room's 157k triangles make four batches.
inline constexpr std::uint64_t kTrianglesPerBatch = 40'000;
/// The same of depth images, whose triangles are small: the rooms' 35k to 90k.
inline constexpr std::uint64_t kTrianglesPerViewBatch = 4'000;

/// A compiled variant of scene.frag.
struct Variant {
  gl::Program program;
  GLint uvPerMetre = -1;
  GLint objectId = -1;
  GLint reflector = -1;  ///< of virtual objects
  GLint depthSlack = -1;
  GLint fresnel = -1;
  GLint frontLayer = -1;  ///< of what lies behind
  GLint refraction = -1;
  GLint nextTotal = -1;
};

/// What drawing needs of an object beside its triangles.
struct ObjectInfo {
  int material = 0;
  SampleClass sampleClass = SampleClass::Diffuse;
  std::uint32_t features = 0;  ///< of material and vertices, without passes
  bool opaque = true;
  bool moving = false;    ///< in some frame
  float emission = 0.0f;  ///< largest radiance that it emits
};

/// Which objects are drawn.
enum class Which : std::uint8_t { All, Still, Moving };

/// One object's visible index ranges in the lists of a pass.
struct VisibleObject {
  int object = 0;
  /// Mean distance of its visible meshlets from the eye, by their size: a room's shell, whose box
  /// holds the eye, comes after what stands before it.
  float order = 0.0f;
  std::size_t firstRange = 0;
  std::size_t rangeCount = 0;
  std::uint64_t triangles = 0;
  bool cullBacks = false;
  std::size_t part = 0;  ///< of what is drawn in several
};

/// Samples that an object's triangles may cover.
struct CoveredSamples {
  std::vector<Rectangle> triangles;  ///< in the order of the meshlets; empty: not known
  std::vector<Rectangle> meshlets;
};

/// Index ranges of a pass, as glMultiDrawElements takes them.
struct DrawList {
  std::vector<VisibleObject> objects;
  std::vector<GLsizei> counts;
  std::vector<const void*> offsets;
  void clear() {
    objects.clear();
    counts.clear();
    offsets.clear();
  }
};

/// Whether the whole box lies beyond the near plane (z <= w).
bool beyondNear(const Mat4& clipFromWorld, const Box3& box);
bool contains(const Box3& box, const Vec3& p);
void describeVertices(gl::VertexArray& array, const gl::Buffer& positions,
                      const gl::Buffer& attributes);

struct SceneRaster::State {
  Materials materials;
  gl::Buffer positions;
  gl::Buffer attributes;
  gl::Buffer indices;
  gl::VertexArray vertices;
  gl::VertexArray noVertices;
  Meshlets meshlets;
  std::vector<ObjectInfo> objects;
  std::vector<Box3> bounds;
  std::vector<float> uvPerMetre;
  float diameter = 0.0f;

  std::map<std::string, std::map<std::uint32_t, Variant>> variants;  ///< by lights, by features
  std::map<std::string, gl::Program> backgrounds;
  std::map<std::uint32_t, gl::Program> composites;
  FrameResources frame;

  /// Largest components of anything in the scene: what bounds the radiance of surfaces.
  float brightestIrradiance = 0.0f;  ///< baked, W/m^2
  float brightestAlbedo = 0.0f;
  float brightestEmission = 0.0f;

  // Of drawDiffuseViews()
  DetailLevels levels;
  std::vector<float> levelExtent;  ///< of objects when their levels were made, metres
  gl::VertexArray viewVertices;
  gl::Buffer viewBlocks;
  gl::Buffer viewIndices;
  gl::Buffer commands;     ///< of compound views, and the two below
  gl::Buffer viewNumbers;  ///< 0, 1, 2, ... for an attribute that counts instances
  gl::VertexArray compoundVertices;
  DrawCost cost = DrawCost::Whole;
  std::vector<CoveredSamples> covered;  ///< by object, seen by one camera
  scene::Camera coveredCamera;
  Rectangle coveredImage;
  FrameView gbufferView;  ///< of the last G-buffer, for methods' own passes
  /// What stands still as the last whole G-buffer's camera sees it, in tiles that were asked for.
  struct StillSamples {
    GBuffer samples;
    Region drawn;
  };
  std::optional<StillSamples> still;
  std::optional<Region> moving;  ///< where the last G-buffer may show what moves
  DrawList list;

  void describeVertices(gl::VertexArray& array) const {
    raster::describeVertices(array, positions, attributes);
  }
  /// Lists what is seen, nearest objects first; with `parts`, an object once in each of them that
  /// it may show in (`covered` is known).
  void cull(const FrameView& view, std::span<const Rectangle> parts, int skipObject, Which which,
            DrawStatistics& statistics);
  /// Fills in what is missing of `covered`, of what stands still.
  void findCovered(const scene::Camera& camera, const Rectangle& image,
                   const frame::Geometry& geometry);
  Variant& variant(std::uint32_t features, const frame::Lighting& lighting);
  /// Within `parts` where there are any.
  DrawStatistics drawObjects(const FrameView& view, std::span<const Rectangle> parts,
                             const frame::Lighting& lighting, bool gbuffer, int skipObject,
                             Which which = Which::All);
  /// Notes `moving`.
  void findMoving(const scene::Camera& camera, const Rectangle& image);
  /// A G-buffer's samples; within `parts` where there are any.
  DrawStatistics drawSamples(const GBuffer& target, const FrameView& view,
                             std::span<const Rectangle> parts, const frame::Lighting& lighting,
                             Which which);
  /// The same over what is there.
  DrawStatistics drawSurfaces(const FrameView& view, std::span<const Rectangle> parts,
                              const frame::Lighting& lighting, Which which);
  /// Culls one view for drawDiffuseViews(), objects in this order.
  void listView(const DiffuseView& view, std::span<const std::uint32_t> order,
                const frame::Geometry& geometry, float snap, struct ViewList& seen) const;
  void updateLevelBounds(const frame::Geometry& geometry, int object);
  void drawBackground(const frame::Lighting& lighting, bool gbuffer,
                      std::span<const Rectangle> parts);
};

}  // namespace catoptric::raster
