// All depth images of a frame on the layers of one atlas, drawn by the scene's own raster path.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "frame/shading.h"
#include "gl/objects.h"
#include "gl/shader.h"
#include "methods/second_order/cameras/cluster_camera.h"
#include "methods/second_order/clustering/types.h"
#include "methods/second_order/depth_images/atlas.h"
#include "methods/second_order/depth_images/diffuse_views.h"
#include "raster/scene_gpu/scene_gpu.h"

namespace catoptric::methods::second_order {

struct DepthImageOptions {
  /// Of levels of detail, where all is reflected; 0: always the finest.
  float levelErrorTexels = 0.75f;
  std::uint64_t memoryBytes = 512ull << 20;  ///< of all layers
  bool compound = true;                      ///< one draw for all images of a layer
  int depthLayers = 1;                       ///< of the images of what is not a planar mirror
  std::vector<float> weight = {};            ///< by object id: of its reflections, at most
  /// By object id: metres that its rays go at most, 0: as far as the scene; or empty.
  std::vector<float> reach = {};
};

/// Textures are kept from frame to frame and grow when a frame needs more.
class DepthImages {
 public:
  /// Side lengths of a layer for frames of this size; no layer is larger than the memory.
  DepthImages(int sampleWidth, int sampleHeight, float depthImageScale,
              const DepthImageOptions& options);

  int layerWidth() const { return layerWidth_; }
  int layerHeight() const { return layerHeight_; }

  /// Whether the images of these cameras fit into the memory; the layers they need.
  bool fits(std::span<const ClusterCamera> cameras);

  /// Draws the images that the last fits() has placed. `triangles[i]`: drawn for cluster i.
  /// `skipOwn`: by object id, whether it is flat. `samplesOnGrids`: the cluster of each sample
  /// (Clustering::clusterOf()) where mirrored grids of flat objects are looked up at their
  /// own samples alone, so that nothing else is drawn; or nothing.
  DetailCounts draw(std::span<const Cluster> clusters, std::span<const ClusterCamera> cameras,
                    const std::vector<bool>& skipOwn, std::span<const std::uint16_t> samplesOnGrids,
                    const Vec3& frameEye, const frame::Geometry& geometry,
                    const frame::Lighting& lighting, raster::SceneGpu& scene,
                    std::span<std::uint64_t> triangles);

  /// Binds colour and depth images and the table of clusters, as depth_image.glsl names them.
  void bind() const;
  /// From an image's layer of the atlas to that of what lies behind; 0: there is none.
  int secondLayer() const { return options_.depthLayers > 1 ? color_.layers() / 2 : 0; }
  /// Of the layers that the last fits() has filled.
  std::uint64_t bytes() const {
    return layerBytes() * static_cast<std::uint64_t>(atlas_.layers * options_.depthLayers);
  }

 private:
  /// A rectangle of a layer.
  struct Texels {
    int layer, x, y, width, height;
  };

  std::uint64_t layerBytes() const;
  void clearDepth(const Texels& texels, float depth);
  /// Sets the depth of texels of a mirrored grid without a sample of its cluster, which is `known`
  /// in `clusterOf`: so near that nothing is drawn.
  void maskGrid(const Cluster& cluster, const AtlasPlace& place, std::uint16_t known,
                std::span<const std::uint16_t> clusterOf);
  /// Writes the table that rays find their image by.
  void writeTable(std::span<const Cluster> clusters, std::span<const ClusterCamera> cameras,
                  std::span<const std::uint64_t> triangles);
  /// Clears the images' depth, and masks what draw() need not draw. `onGrids`: by object id,
  /// whether its mirrored grids are looked up as such; `order`: of clusters, by layers.
  void prepareDepth(std::span<const Cluster> clusters, std::span<const ClusterCamera> cameras,
                    const std::vector<bool>& onGrids, std::span<const std::size_t> order,
                    std::span<const std::uint16_t> samplesOnGrids);

  DepthImageOptions options_;
  float frameSamples_ = 1.0f;

  int sampleWidth_ = 1;
  int layerWidth_ = 1;
  int layerHeight_ = 1;
  Atlas atlas_;
  DiffuseViews diffuse_;
  gl::Texture color_;  ///< RGBA16F; of two depth layers the second half
  gl::Texture depth_;
  std::vector<gl::Framebuffer> targets_;
  gl::Buffer tableBuffer_;
  gl::Texture table_;
};

}  // namespace catoptric::methods::second_order
