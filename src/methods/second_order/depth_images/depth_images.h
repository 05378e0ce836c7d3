// All depth images of a frame on the layers of one atlas, drawn by the renderer's rasterizer.
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
  /// Allowed error of levels of detail for a reflection of full weight; 0: always the finest level.
  float levelErrorTexels = 0.75f;
  std::uint64_t memoryBytes = 512ull << 20;  ///< limit for all layers
  bool compound = true;                      ///< one draw for all images of a layer
  int depthLayers = 1;                       ///< depth layers of images of curved clusters
  std::vector<float> weight = {};  ///< indexed by object id: maximum weight of its reflections
  /// Indexed by object id: maximum length of its rays in metres, 0: unlimited. Empty: all are
  /// unlimited.
  std::vector<float> reach = {};
};

/// Textures are kept from frame to frame and grow when needed.
class DepthImages {
 public:
  /// Chooses the size of layers for frames of this size; no layer exceeds the memory limit.
  DepthImages(int sampleWidth, int sampleHeight, float depthImageScale,
              const DepthImageOptions& options);

  /// The bytes that most frames need: those of two layers, or the memory limit if that is less.
  static std::uint64_t usualBytes(int sampleWidth, int sampleHeight, float depthImageScale,
                                  const DepthImageOptions& options);

  int layerWidth() const { return layerWidth_; }
  int layerHeight() const { return layerHeight_; }

  /// Places the images of these cameras. Returns whether they fit into the memory.
  bool fits(std::span<const ClusterCamera> cameras);

  /// Draws the images that the last fits() has placed. `triangles[i]` is set to the number of
  /// triangles drawn for cluster i. `skipOwn`: indexed by object id; true for flat objects, which
  /// are not drawn in the images of their own clusters. `samplesOnGrids`: the cluster of each
  /// sample (Clustering::clusterOf()) if mirrored grids of flat objects are only read at their own
  /// samples, so that nothing else need be drawn; otherwise empty.
  DetailCounts draw(std::span<const Cluster> clusters, std::span<const ClusterCamera> cameras,
                    const std::vector<bool>& skipOwn, std::span<const std::uint16_t> samplesOnGrids,
                    const Vec3& frameEye, const frame::Geometry& geometry,
                    const frame::Lighting& lighting, raster::SceneGpu& scene,
                    std::span<std::uint64_t> triangles);

  /// Binds the colour and depth images and the table of clusters, which depth_image.glsl declares.
  void bind() const;
  /// Offset from an image's layer to the layer of the surfaces behind it; 0: there is none.
  int secondLayer() const { return options_.depthLayers > 1 ? color_.layers() / 2 : 0; }
  /// Size of the layers that the last fits() has used.
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
  /// Excludes texels of a mirrored grid that belong to no sample of its cluster, whose value in
  /// `clusterOf` is `known`: their depth is set so near that nothing is drawn.
  void maskGrid(const Cluster& cluster, const AtlasPlace& place, std::uint16_t known,
                std::span<const std::uint16_t> clusterOf);
  /// Writes the table with which rays find their image.
  void writeTable(std::span<const Cluster> clusters, std::span<const ClusterCamera> cameras,
                  std::span<const std::uint64_t> triangles);
  /// Clears the images' depth, and masks texels that draw() can skip. `onGrids`: by object id,
  /// whether its mirrored grids are read as grids; `order`: the clusters, sorted by layer.
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
  gl::Texture color_;  ///< RGBA16F; the second half: surfaces behind the first ones
  gl::Texture depth_;
  std::vector<gl::Framebuffer> targets_;
  gl::Buffer tableBuffer_;
  gl::Texture table_;
};

}  // namespace catoptric::methods::second_order
