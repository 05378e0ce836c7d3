// What is clustered and what clusters are. All positions are relative to the eye of the frame, so
// that rounding does not grow with the distance from the origin.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/math.h"
#include "methods/second_order/lanes.h"
#include "scene/lobe.h"

namespace catoptric::methods::second_order {

struct ClusterOptions {
  int maxThetaBins = 13;  ///< of 360 degrees
  int maxPhiBins = 8;     ///< of 180 degrees
  /// Factor on the paper's scale of the bins: 1 gives a room's small reflectors one bin each. Ours.
  float binDensity = 10.0f;
  /// Smaller clusters are not searched: they see the environment map. No option; ours.
  int minSamples = 16;
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
  scene::Lobe widestLobe;
  bool planar = false;   ///< one plane, one normal: all rays meet in the mirrored eye; what else
                         ///< is in the bin is another cluster
  bool concave = false;  ///< sum of (P_i - P_c).(n_i - n_c) < 0
  bool normalsCancel = false;
  bool retraced = false;  ///< by Embree: it has no depth image
  int left = 0;           ///< bounding box in samples: left <= x < right, top <= y < bottom
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

}  // namespace catoptric::methods::second_order
