// Clusters of reflective samples with similar reflected rays [Wang2014, section 3.2]: bins over
// the normal's spherical coordinates, adapted to each object and frame. All positions are relative
// to the eye of the frame, so that rounding errors do not grow with the distance from the origin.
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

  /// Assigns the reflective samples of `gbuffer` to bins. A sample is reflective if its object's
  /// kind is not None and, if the diffuse image was read, its s is above 0. `retraced`, by object
  /// id: samples in no cluster are left to retrace; empty: none are. The result does not depend on
  /// the number of threads.
  void build(const raster::GBufferCopy& gbuffer, const scene::Camera& camera,
             std::span<const ReflectorKind> kinds, const ClusterOptions& options,
             const std::vector<bool>& retraced = {});

  const std::vector<Cluster>& clusters() const { return clusters_; }
  /// Sets Cluster::traced.
  void markRetraced(std::span<const std::uint8_t> retraced);
  /// Like markRetraced(). Also removes the samples of these clusters (kRetraced), so that no depth
  /// image shows them.
  void leaveToRetrace(std::span<const std::uint8_t> retraced);

  /// Per sample: 0 diffuse, 1 in no cluster (too small), kRetraced, otherwise cluster index + 2.
  const std::vector<std::uint16_t>& clusterOf() const { return clusterOf_; }
  std::span<const SampleBlock> blocks() const { return blocks_; }

  std::uint64_t reflectiveSamples() const { return reflective_; }
  std::uint64_t samplesInNoCluster() const { return unclustered_; }
  /// Samples that were left to retrace because they are in no cluster.
  std::uint64_t samplesAlone() const { return alone_; }
  int visibleObjects() const { return visibleObjects_; }  ///< n_v
  /// How often the bins along each angle were halved because there were more than kMostBins.
  int timesHalved() const { return halved_; }
  /// Number of clusters that k-means left unchanged because their object has too many.
  std::size_t binsKept() const { return binsKept_; }

  static constexpr int kRows = 16;  ///< rows of a block; sums of blocks are added in order
  static constexpr std::uint32_t kMostBins = 65536;    ///< exceeded only if there are more objects
  static constexpr std::size_t kMostClusters = 65000;  ///< limit of a 16-bit index
  static constexpr std::uint16_t kRetraced = second_order_shared::kTracedSample;

 private:
  struct Work;
  /// Makes a cluster of each part of a bin with enough samples, in the order of objects and bins.
  void makeClusters(int minSamples, const std::vector<bool>& retraced);
  /// Finds the runs of equal clusters in block b, which ends before row `bottom`, and each sample's
  /// cluster.
  void findClusterRuns(std::size_t b, int width, int bottom, std::span<const ReflectorKind> kinds);

  std::vector<Cluster> clusters_;
  std::vector<std::uint16_t> clusterOf_;
  std::vector<SampleBlock> blocks_;
  std::unique_ptr<Work> work_;  ///< data that several passes use
  std::size_t height_ = 0;      ///< height of the frame in samples
  std::uint64_t reflective_ = 0;
  std::uint64_t unclustered_ = 0;
  std::uint64_t alone_ = 0;
  int visibleObjects_ = 0;
  int halved_ = 0;
  std::size_t binsKept_ = 0;
};

}  // namespace catoptric::methods::second_order
