// Clusters of reflective samples with similar reflected rays [Wang2014, section 3.2]: bins over the
// normal's spherical coordinates, adapted per object and frame. All positions here are relative to
// the eye of the frame, so that rounding does not grow with the distance from the origin.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "core/math.h"
#include "methods/second_order/lanes.h"
#include "raster/gbuffer.h"
#include "scene/camera.h"

namespace catoptric::methods {

struct ClusterOptions {
  int maxThetaBins = 13;  ///< of 360 degrees
  int maxPhiBins = 8;     ///< of 180 degrees
  /// Factor on the paper's scale of the bins: 1 gives a room's small reflectors one bin each. Ours.
  float binDensity = 10.0f;
  int minSamples = 16;  ///< smaller clusters are not searched: they see the environment map
  /// Samples of an object's curved clusters go to the cluster of the nearest mean ray, by as many
  /// means as bins made (the paper's outlook).
  bool kMeans = false;
};

/// What an object is to the clustering; one entry per object id, [0] is the background.
enum class ReflectorKind : std::uint8_t { None, Mirror, Glossy };

struct Cluster {
  int object = 0;  ///< id
  int thetaBin = 0;
  int phiBin = 0;
  std::uint32_t samples = 0;
  Vec3 centroid{0.0f};    ///< P_c, metres from the eye
  Vec3 meanNormal{0.0f};  ///< n_c, unit length; turned to the eye when the normals cancel
  /// Of the plane closest to all samples, unit length, on the side of the mean normal. Shading
  /// normals may say otherwise.
  Vec3 planeNormal{0.0f, 1.0f, 0.0f};
  float maxGlossiness = 0.0f;
  bool planar = false;   ///< one plane, one normal: all rays meet in the mirrored eye; what else
                         ///< is in the bin is another cluster
  bool concave = false;  ///< sum of (P_i - P_c).(n_i - n_c) < 0
  bool normalsCancel = false;
  int left = 0;  ///< bounding box in samples: left <= x < right, top <= y < bottom
  int top = 0;
  int right = 0;
  int bottom = 0;
};

/// Samples of one cluster beside each other in a row.
struct SampleRun {
  std::uint32_t first = 0;  ///< index in the block's arrays; the others follow
  std::uint32_t slot = 0;   ///< of the cluster in the block's list
  std::uint16_t x = 0;      ///< of the first sample
  std::uint16_t count = 0;
};

/// A vector of each sample, one array for each coordinate.
struct VectorArrays {
  std::vector<float> x, y, z;

  Vec3 operator[](std::size_t i) const { return {x[i], y[i], z[i]}; }
  /// Up to four vectors from i on; the last of `left` again where there are fewer.
  Lanes3 load(std::size_t i, std::size_t left) const {
    return {methods::load(&x[i], left), methods::load(&y[i], left), methods::load(&z[i], left)};
  }
  void resize(std::size_t count) {
    for (std::vector<float>* values : {&x, &y, &z}) values->resize(count);
  }
};

/// The samples of kRows rows that are in clusters other than planar mirrors.
struct SampleBlock {
  VectorArrays position;             ///< P_i, metres from the eye
  VectorArrays normal;               ///< as shaded, unit length
  VectorArrays direction;            ///< of the mirror ray, unit length
  std::vector<SampleRun> runs;       ///< by row, from left to right
  std::vector<std::uint32_t> rows;   ///< first run of each row, and the number of runs
  std::vector<std::uint16_t> slots;  ///< clusters that have runs here
};

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
  /// Per sample: 0 diffuse, 1 in no cluster (too small), else index of its cluster + 2.
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

 private:
  struct Work;
  std::vector<Cluster> clusters_;
  std::vector<std::uint16_t> clusterOf_;
  std::vector<SampleBlock> blocks_;
  std::unique_ptr<Work> work_;  ///< what lives from pass to pass
  std::uint64_t reflective_ = 0;
  std::uint64_t unclustered_ = 0;
  int visibleObjects_ = 0;
  int halved_ = 0;
  std::size_t binsKept_ = 0;
};

/// Bins of an object over theta (360 degrees) and phi (180 degrees): scale = min(1, density * 100 *
/// its share of the frame / number of visible objects), at least one bin each and 0.04 * density
/// where the share is at least 1/1000. The paper's formula with the area in percent (its print with
/// a fraction gives one bin per object).
struct BinScale {
  float theta = 1.0f;  ///< bins, not rounded: i = floor(theta / 360 * this)
  float phi = 1.0f;
  int thetaBins = 1;
  int phiBins = 1;
};
BinScale binScale(float areaFraction, int visibleObjects, const ClusterOptions& options);

/// Bins begin this share of 360 or 180 degrees early: rooms are full of normals along the axes, and
/// on a border rounding would deal them out to both sides. Ours.
inline constexpr float kBinOffset = 1e-5f;

/// Bin of a unit normal: theta about +y from +x, phi from +y, both to 2e-6 of a turn. Within 0.1
/// degrees of a pole theta means nothing and is taken as 0.
int binOf(const Vec3& normal, const BinScale& scale);

}  // namespace catoptric::methods
