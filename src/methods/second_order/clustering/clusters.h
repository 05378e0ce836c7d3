// Clusters of reflective samples with similar reflected rays [Wang2014, section 3.2]: bins over the
// normal's spherical coordinates, adapted per object and frame. All positions here are relative to
// the eye of the frame, so that rounding does not grow with the distance from the origin.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "methods/second_order/clustering/types.h"
#include "methods/second_order/shaders/constants.h"
#include "raster/gbuffer.h"
#include "scene/camera.h"

namespace catoptric::methods::second_order {

/// The clusters of one frame. Memory is kept from frame to frame.
class Clustering {
 public:
  Clustering();
  Clustering(Clustering&&) noexcept;
  ~Clustering();

  /// Bins the samples of `gbuffer` that reflect (kinds[object id], and s > 0 where its diffuse
  /// image was read). The result does not depend on the number of threads.
  void build(const raster::GBufferCopy& gbuffer, const scene::Camera& camera,
             std::span<const ReflectorKind> kinds, const ClusterOptions& options);

  const std::vector<Cluster>& clusters() const { return clusters_; }
  /// Sets Cluster::traced.
  void markRetraced(std::span<const std::uint8_t> retraced);
  /// The same, and leaves their samples out of their clusters (kRetraced): no image is drawn of
  /// them.
  void leaveToRetrace(std::span<const std::uint8_t> retraced);

  /// Per sample: 0 diffuse, 1 in no cluster (too small), kRetraced, else index of its cluster + 2.
  const std::vector<std::uint16_t>& clusterOf() const { return clusterOf_; }
  std::span<const SampleBlock> blocks() const { return blocks_; }

  std::uint64_t reflectiveSamples() const { return reflective_; }
  std::uint64_t samplesInNoCluster() const { return unclustered_; }
  int visibleObjects() const { return visibleObjects_; }  ///< n_v
  /// How often the bins along each angle were halved, since they were more than kMostBins in all.
  int timesHalved() const { return halved_; }
  /// Clusters that k-means left alone, for their object has too many.
  std::size_t binsKept() const { return binsKept_; }

  static constexpr int kRows = 16;  ///< of a block: the unit of work, whose sums are added in order
  static constexpr std::uint32_t kMostBins = 65536;    ///< of a frame, unless it has more objects
  static constexpr std::size_t kMostClusters = 65000;  ///< of a 16-bit index
  static constexpr std::uint16_t kRetraced = second_order_shared::kTracedSample;

 private:
  struct Work;
  /// Parts of bins that have enough samples become clusters, in the order of objects and bins.
  void makeClusters(int minSamples);
  /// Runs of one cluster in block b, whose last row is before `bottom`, and each sample's cluster.
  void findClusterRuns(std::size_t b, int width, int bottom, std::span<const ReflectorKind> kinds);

  std::vector<Cluster> clusters_;
  std::vector<std::uint16_t> clusterOf_;
  std::vector<SampleBlock> blocks_;
  std::unique_ptr<Work> work_;  ///< what lives from pass to pass
  std::size_t height_ = 0;      ///< of the frame, samples
  std::uint64_t reflective_ = 0;
  std::uint64_t unclustered_ = 0;
  int visibleObjects_ = 0;
  int halved_ = 0;
  std::size_t binsKept_ = 0;
};

}  // namespace catoptric::methods::second_order
