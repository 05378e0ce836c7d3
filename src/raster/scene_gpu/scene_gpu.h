// The scene on the GPU, and the data that the CPU needs to draw it. Passes receive this object.
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

/// The properties of an object that drawing needs, besides its triangles.
struct DeviceObject {
  int material = 0;
  SampleClass sampleClass = SampleClass::Diffuse;
  std::uint32_t features = 0;  ///< bits of Feature, from the material and the vertices
  bool opaque = true;
  bool moving = false;    ///< whether it moves in any frame
  float emission = 0.0f;  ///< largest emitted radiance
  Box3 bounds;
  float uvPerMetre = 0.0f;
  float levelExtent = 0.0f;  ///< diameter at the time when its levels of detail were built, metres
};

/// The largest colour components over the whole scene, which bound the radiance of surfaces.
struct Brightest {
  float irradiance = 0.0f;  ///< baked, W/m^2
  float albedo = 0.0f;
  float emission = 0.0f;
};

/// The bytes of a scene's triangles in SceneGpu without levels of detail: in OpenGL's buffers and
/// in memory.
std::uint64_t uploadedGeometryBytes(const scene::Scene& scene);

class SceneGpu {
 public:
  /// Uploads geometry, textures and materials.
  SceneGpu(const scene::Scene& scene, const frame::Geometry& geometry);
  SceneGpu(const SceneGpu&) = delete;
  SceneGpu& operator=(const SceneGpu&) = delete;

  /// Re-uploads the vertices of changed objects (indices into geometry.objects).
  void update(const frame::Geometry& geometry, std::span<const int> changedObjects);
  /// Builds coarser levels of the objects, or reads them from `cache`. Call once, at first.
  void buildDetailLevels(const scene::Scene& scene, const frame::Geometry& geometry,
                         const frame::Lighting& lighting, const std::filesystem::path& cache);

  std::span<const DeviceObject> objects() const { return objects_; }  ///< indexed by id - 1
  const Materials& materials() const { return materials_; }
  const Meshlets& meshlets() const { return meshlets_; }
  const DetailLevels& levels() const { return levels_; }  ///< empty until they are built
  /// The indices that meshlets and levels refer to; those of the meshlets come first.
  std::span<const std::uint32_t> indices() const {
    return levels_.indices.empty() ? meshlets_.indices : levels_.indices;
  }
  /// The positions that these indices refer to: the geometry's vertices, then the levels' own.
  std::span<const Vec3> positions(const frame::Geometry& geometry) const {
    return positionsOfAll_.empty() ? geometry.positions : positionsOfAll_;
  }
  const Brightest& brightest() const { return brightest_; }
  float diameter() const { return diameter_; }

  /// Binds the vertices of all objects, with the indices of the meshlets.
  void bindVertices() const { vertices_.bind(); }
  /// Sets the vertices of all objects, from `firstVertex` on, as attributes of another vertex
  /// array.
  void describeVertices(gl::VertexArray& array, std::uint32_t firstVertex = 0) const;

  FrameResources& frame() { return frame_; }
  SurfacePrograms& programs() { return programs_; }

  std::size_t bytes() const;  ///< size of geometry, textures and materials

 private:
  Materials materials_;
  Meshlets meshlets_;
  DetailLevels levels_;
  std::vector<Vec3> positionsOfAll_;  ///< set if levels have vertices of their own
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

/// Sets the vertex attributes at the locations that vertex.glsl declares.
void describeVertices(gl::VertexArray& array, const gl::Buffer& positions,
                      const gl::Buffer& attributes, std::uint32_t firstVertex = 0);

}  // namespace catoptric::raster
