// The scene on the device, and what the CPU must know of it to draw: what passes are given.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

#include "frame/geometry.h"
#include "frame/shading.h"
#include "gl/objects.h"
#include "raster/gbuffer.h"
#include "raster/scene_gpu/detail_levels.h"
#include "raster/scene_gpu/frame_block.h"
#include "raster/scene_gpu/materials.h"
#include "raster/scene_gpu/meshlets.h"
#include "raster/scene_gpu/surface_programs.h"
#include "scene/scene.h"

namespace catoptric::raster {

/// What drawing needs of an object beside its triangles.
struct DeviceObject {
  int material = 0;
  SampleClass sampleClass = SampleClass::Diffuse;
  std::uint32_t features = 0;  ///< bits of Feature, of material and vertices
  bool opaque = true;
  bool moving = false;    ///< in some frame
  float emission = 0.0f;  ///< largest radiance that it emits
  Box3 bounds;
  float uvPerMetre = 0.0f;
  float levelExtent = 0.0f;  ///< diameter when its levels of detail were made, metres
};

/// Largest components of anything in the scene: what bounds the radiance of surfaces.
struct Brightest {
  float irradiance = 0.0f;  ///< baked, W/m^2
  float albedo = 0.0f;
  float emission = 0.0f;
};

class SceneGpu {
 public:
  /// Uploads geometry, textures and materials.
  SceneGpu(const scene::Scene& scene, const frame::Geometry& geometry);
  SceneGpu(const SceneGpu&) = delete;
  SceneGpu& operator=(const SceneGpu&) = delete;

  /// Re-uploads the vertices of changed objects (indices into geometry.objects).
  void update(const frame::Geometry& geometry, std::span<const int> changedObjects);
  /// Makes coarser levels of the objects, or takes them from `cache`; once, before the first frame.
  void buildDetailLevels(const scene::Scene& scene, const frame::Geometry& geometry,
                         const frame::Lighting& lighting, const std::filesystem::path& cache);

  std::span<const DeviceObject> objects() const { return objects_; }  ///< by id - 1
  const Materials& materials() const { return materials_; }
  const Meshlets& meshlets() const { return meshlets_; }
  const DetailLevels& levels() const { return levels_; }  ///< empty until they are built
  /// What meshlets and levels index: those of the meshlets come first.
  std::span<const std::uint32_t> indices() const {
    return levels_.indices.empty() ? meshlets_.indices : levels_.indices;
  }
  /// What these indices count: the geometry's vertices, then the levels' own.
  std::span<const Vec3> positions(const frame::Geometry& geometry) const {
    return positionsOfAll_.empty() ? geometry.positions : positionsOfAll_;
  }
  const Brightest& brightest() const { return brightest_; }
  float diameter() const { return diameter_; }

  /// Binds all objects' vertices, with the indices of the meshlets.
  void bindVertices() const { vertices_.bind(); }
  /// Describes all objects' vertices to another array.
  void describeVertices(gl::VertexArray& array) const;

  FrameResources& frame() { return frame_; }
  SurfacePrograms& programs() { return programs_; }

  std::size_t bytes() const;  ///< of geometry, textures and materials

 private:
  Materials materials_;
  Meshlets meshlets_;
  DetailLevels levels_;
  std::vector<Vec3> positionsOfAll_;  ///< where levels have vertices of their own
  std::vector<DeviceObject> objects_;
  Brightest brightest_;
  float diameter_ = 0.0f;
  gl::Buffer positions_;
  gl::Buffer attributes_;
  gl::Buffer indices_;
  gl::VertexArray vertices_;
  FrameResources frame_;
  SurfacePrograms programs_;
};

/// Describes vertices at the locations of vertex.glsl.
void describeVertices(gl::VertexArray& array, const gl::Buffer& positions,
                      const gl::Buffer& attributes);

}  // namespace catoptric::raster
