// The geometry images of all reflected objects, in world space at one time.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <vector>

#include "methods/contract/method.h"
#include "methods/glossy_lod/images/geometry_image.h"
#include "methods/glossy_lod/options.h"
#include "methods/glossy_lod/sizes.h"
#include "methods/glossy_lod/tree/traversal.h"
#include "methods/glossy_lod/tree/tree.h"

namespace catoptric::methods::glossy_lod {

/// A chart of an object, with its position among the charts of all objects.
struct PlacedChart {
  int object = 0;  ///< index in the scene
  ChartImage image;
  const ObjectImage* source = nullptr;
  std::uint32_t firstVertex = 0;
  std::uint32_t x = 0;  ///< position of its texels in the atlas
  std::uint32_t y = 0;
};

/// Sums over all objects, for counters.
struct ImageCounts {
  std::uint64_t charts = 0;
  std::uint64_t quads = 0;
  std::uint64_t plainTriangles = 0;
  std::uint64_t degenerateTriangles = 0;
  std::uint64_t notFlattened = 0;
  std::uint64_t meanStretchPercent = 0;  ///< mean over meshes
  std::uint64_t mostStretchPercent = 0;
  std::uint64_t reducedObjects = 0;  ///< objects with fewer quads than requested
};

class SceneImages {
 public:
  /// Makes the geometry images of all reflected objects, one per mesh. Without the option `size`,
  /// images that would need more than `memory_mib` are made coarser than `sizes`. Throws an error
  /// if even the coarsest images need more.
  void make(const scene::Scene& scene, const frame::Geometry& geometry, const Options& options,
            const Sizes& sizes);
  /// Moves the vertices of these objects and updates the tree.
  void follow(const frame::Geometry& geometry, std::span<const int> changedObjects);

  const std::vector<PlacedChart>& charts() const { return charts_; }
  const std::vector<Vec4>& vertices() const { return vertices_; }
  const Tree& tree() const { return tree_; }
  TreeView view() const;
  const ImageCounts& counts() const { return counts_; }
  glm::uvec2 atlasSize() const { return atlasSize_; }
  bool reflects(int object) const { return firstChart_[object] < firstChart_[object + 1]; }
  /// The nodes of all charts of an object, and some of others between them.
  const NodeRange& nodesOf(int object) const { return nodes_[static_cast<std::size_t>(object)]; }
  std::span<const PlacedChart> chartsOf(int object) const {
    return std::span(charts_).subspan(firstChart_[object],
                                      firstChart_[object + 1] - firstChart_[object]);
  }

 private:
  using MeshImages = std::map<int, std::shared_ptr<const ObjectImage>>;
  /// Sets charts_, firstChart_ and counts_. The images have `share` times the quads and texels of
  /// `sizes`.
  MeshImages makeCharts(const scene::Scene& scene, const frame::Geometry& geometry,
                        const Sizes& sizes, double share);
  /// As makeCharts(), with the largest share that fits the memory.
  MeshImages makeChartsThatFit(const scene::Scene& scene, const frame::Geometry& geometry,
                               const Options& options, const Sizes& sizes);
  void place(const frame::Geometry& geometry, int object);
  void packAtlas();

  std::vector<std::shared_ptr<const ObjectImage>> images_;  ///< indexed by mesh
  std::vector<PlacedChart> charts_;
  std::vector<std::size_t> firstChart_;  ///< indexed by object, with one more entry at the end
  std::vector<Vec4> vertices_;
  std::vector<Grid> grids_;
  std::vector<std::uint32_t> objects_;  ///< TreeView::objects, indexed by chart
  Tree tree_;
  std::vector<NodeRange> nodes_;  ///< indexed by object
  ImageCounts counts_;
  glm::uvec2 atlasSize_{2};
};

}  // namespace catoptric::methods::glossy_lod
