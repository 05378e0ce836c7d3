// The data of clusters and of their samples. All positions are relative to the eye of the frame,
// so that rounding errors do not grow with the distance from the origin.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/math.h"
#include "methods/second_order/lanes.h"
#include "scene/lobe.h"

namespace catoptric::methods::second_order {

struct ClusterOptions {
  int maxThetaBins = 13;  ///< bins over 360 degrees
  int maxPhiBins = 8;     ///< bins over 180 degrees
  /// Factor on the paper's number of bins: with 1, small reflectors of an interior get one bin
  /// each. Not from the paper.
  float binDensity = 10.0f;
  /// Samples of smaller clusters are traced or show the cube map. Not an option and not in the
  /// paper.
  int minSamples = 16;
  /// Whether k-means with one mean per bin reassigns the samples of an object's curved clusters
  /// (the paper's future work).
  bool kMeans = false;
};

/// How an object reflects. Lists of these have one entry per object id; [0] is the background.
enum class ReflectorKind : std::uint8_t { None, Mirror, Glossy };

struct Cluster {
  int object = 0;  ///< id
  int thetaBin = 0;
  int phiBin = 0;
  std::uint32_t samples = 0;
  Vec3 centroid{0.0f};    ///< P_c, metres from the eye
  Vec3 meanNormal{0.0f};  ///< n_c, unit length; the direction to the eye if the normals cancel
  /// Normal of the plane closest to all samples, unit length, on the side of the mean normal.
  /// Shading normals may differ from it.
  Vec3 planeNormal{0.0f, 1.0f, 0.0f};
  scene::Lobe widestLobe;
  bool planar = false;   ///< one plane with one normal: all rays meet in the mirrored eye
  bool concave = false;  ///< sum of (P_i - P_c).(n_i - n_c) < 0
  bool normalsCancel = false;
  bool retraced = false;  ///< traced by Embree: it has no depth image
  int left = 0;           ///< bounding box in samples: left <= x < right, top <= y < bottom
  int top = 0;
  int right = 0;
  int bottom = 0;
};

/// Adjacent samples of one cluster in a row.
struct SampleRun {
  std::uint32_t first = 0;  ///< index in the block's arrays; the others follow
  std::uint32_t slot = 0;   ///< index of the cluster in the block's list
  std::uint16_t x = 0;      ///< column of the first sample
  std::uint16_t count = 0;
};

/// One vector per sample, as one array per coordinate.
struct VectorArrays {
  std::vector<float> x, y, z;

  Vec3 operator[](std::size_t i) const { return {x[i], y[i], z[i]}; }
  /// Up to four vectors from i on; if fewer are left, the last one is repeated.
  Lanes3 load(std::size_t i, std::size_t left) const {
    return {methods::load(&x[i], left), methods::load(&y[i], left), methods::load(&z[i], left)};
  }
  void resize(std::size_t count) {
    for (std::vector<float>* values : {&x, &y, &z}) values->resize(count);
  }
};

/// The samples of kRows rows, without those of planar mirrors.
struct SampleBlock {
  VectorArrays position;             ///< P_i, metres from the eye
  VectorArrays normal;               ///< shading normal, unit length
  VectorArrays direction;            ///< direction of the mirror ray, unit length
  std::vector<SampleRun> runs;       ///< row by row, from left to right
  std::vector<std::uint32_t> rows;   ///< first run of each row, and the number of runs
  std::vector<std::uint16_t> slots;  ///< clusters with runs in this block
};

}  // namespace catoptric::methods::second_order
