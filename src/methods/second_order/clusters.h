// Clusters of reflective samples with similar reflected rays [Wang2014, section 3.2]: bins over the
// normal's spherical coordinates, adapted per object and frame. All positions here are relative to
// the eye of the frame, so that rounding does not grow with the distance from the origin.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/math.h"
#include "raster/gbuffer.h"
#include "scene/camera.h"

namespace catoptric::methods {

struct ClusterOptions {
  int maxThetaBins = 13;  ///< of 360 degrees
  int maxPhiBins = 8;     ///< of 180 degrees
  /// Factor on the paper's scale of the bins: 1 gives a room's small reflectors one bin each. Ours.
  float binDensity = 10.0f;
  int minSamples = 16;  ///< smaller clusters are not searched: they see the environment map
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

/// A reflective sample of a cluster that is not a planar mirror.
struct ClusterSample {
  Vec3 position{0.0f};   ///< P_i, metres from the eye
  Vec3 direction{0.0f};  ///< of the mirror ray, unit length
  std::uint16_t cluster = 0;
  std::uint16_t x = 0;
};

/// All such samples of one row, from left to right.
struct SampleRow {
  std::size_t first = 0;
  std::size_t last = 0;
};

/// The clusters of one frame. Memory is kept from frame to frame.
class Clustering {
 public:
  /// Bins the samples of `gbuffer` that reflect (kinds[object id], and s > 0 where its diffuse
  /// image was read). The result does not depend on the number of threads.
  void build(const raster::GBufferCopy& gbuffer, const scene::Camera& camera,
             std::span<const ReflectorKind> kinds, const ClusterOptions& options);

  const std::vector<Cluster>& clusters() const { return clusters_; }
  /// Per sample: 0 diffuse, 1 in no cluster (too small), else index of its cluster + 2.
  const std::vector<std::uint16_t>& clusterOf() const { return clusterOf_; }
  /// Samples in blocks of kRows rows; rows(b)[r] are ranges of samples(b).
  std::size_t blocks() const { return blocks_.size(); }
  std::span<const ClusterSample> samples(std::size_t block) const { return blocks_[block].samples; }
  std::span<const SampleRow> rows(std::size_t block) const { return blocks_[block].rows; }

  std::uint64_t reflectiveSamples() const { return reflective_; }
  std::uint64_t samplesInNoCluster() const { return unclustered_; }
  int visibleObjects() const { return visibleObjects_; }  ///< n_v

  static constexpr int kRows = 16;  ///< of a block: the unit of work, whose sums are added in order

 private:
  struct Block {
    std::vector<ClusterSample> samples;
    std::vector<SampleRow> rows;
    std::vector<std::uint32_t> counts;  ///< by object, then by bin
  };
  std::vector<Cluster> clusters_;
  std::vector<std::uint16_t> clusterOf_;
  std::vector<std::uint32_t> binOf_;
  std::vector<Block> blocks_;
  std::uint64_t reflective_ = 0;
  std::uint64_t unclustered_ = 0;
  int visibleObjects_ = 0;
};

/// Bins of an object over theta (360 degrees) and phi (180 degrees): scale = min(1, density * 100 *
/// its share of the frame / number of visible objects), at least one bin each. The paper's formula
/// with the area in percent (its print with a fraction gives one bin per object).
struct BinScale {
  float theta = 1.0f;  ///< bins, not rounded: i = floor(theta / 360 * this)
  float phi = 1.0f;
  int thetaBins = 1;
  int phiBins = 1;
};
BinScale binScale(float areaFraction, int visibleObjects, const ClusterOptions& options);

/// Bin of a unit normal: theta about +y from +x, phi from +y. Within 0.1 degrees of a pole theta
/// means nothing and is taken as 0.
int binOf(const Vec3& normal, const BinScale& scale);

}  // namespace catoptric::methods
