#include "methods/second_order/clusters.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <mutex>

#include "core/parallel.h"

namespace catoptric::methods {
namespace {

constexpr float kPoleSine = 1.75e-3f;  ///< sine of 0.1 degrees; ours
/// Samples are on one plane when no normal leaves the plane's by more (radians) and none the plane
/// by more than this share of its distance from the eye: a pixel's reflection moves by less than a
/// tenth of a texel of a 1024 pixel frame. Ours.
constexpr float kPlanarNormal = 1e-4f;
constexpr float kPlanarOffset = 5e-5f;
constexpr std::uint64_t kLeastPlane = 64;     ///< samples of a planar cluster; ours
constexpr std::size_t kMostClusters = 65000;  ///< of a 16-bit index
constexpr std::uint32_t kNone = 0xFFFFFFFFu;
constexpr int kMeansSteps = 4;            ///< of k-means; ours
constexpr float kMeansUnit = 1048576.0f;  ///< of its sums, integers: their order does not matter

/// Sums over samples. Positions are taken from a point near them, so that floats keep the shape of
/// small clusters far from the eye.
struct Sums {
  std::uint32_t samples = 0;
  float glossiness = 0.0f;  ///< the largest
  glm::dvec3 position{0.0};
  glm::dvec3 normal{0.0};
  glm::dvec3 squares{0.0};   ///< of positions: xx, yy, zz
  glm::dvec3 products{0.0};  ///< likewise: xy, yz, zx
  double dot = 0.0;          ///< of position and normal
  int left = 1 << 30, top = 1 << 30, right = 0, bottom = 0;

  void add(const Sums& s) {
    samples += s.samples;
    glossiness = std::max(glossiness, s.glossiness);
    position += s.position;
    normal += s.normal;
    squares += s.squares;
    products += s.products;
    dot += s.dot;
    left = std::min(left, s.left);
    right = std::max(right, s.right);
    top = std::min(top, s.top);
    bottom = std::max(bottom, s.bottom);
  }
  void add(const VectorArrays& positions, const VectorArrays& normals, const SampleRun& run, int y,
           const Vec3& anchor) {
    Lanes3 p{}, n{}, pp{}, pq{};
    Lanes pn{};
    for (std::size_t k = 0; k < run.count; k += kLanes) {
      const std::size_t there = run.count - k;
      Lanes3 at = minus(positions.load(run.first + k, there), anchor);
      Lanes3 turned = normals.load(run.first + k, there);
      if (there < kLanes) {
        for (Lanes* values : {&at.x, &at.y, &at.z, &turned.x, &turned.y, &turned.z}) {
          *values = valid(there) ? *values : Lanes{};
        }
      }
      p = {p.x + at.x, p.y + at.y, p.z + at.z};
      n = {n.x + turned.x, n.y + turned.y, n.z + turned.z};
      pp = {pp.x + at.x * at.x, pp.y + at.y * at.y, pp.z + at.z * at.z};
      pq = {pq.x + at.x * at.y, pq.y + at.y * at.z, pq.z + at.z * at.x};
      pn += methods::dot(at, turned);
    }
    const auto sum = [](const Lanes3& v) { return glm::dvec3(sumOf(v.x), sumOf(v.y), sumOf(v.z)); };
    samples += run.count;
    position += sum(p);
    normal += sum(n);
    squares += sum(pp);
    products += sum(pq);
    dot += static_cast<double>(sumOf(pn));
    left = std::min(left, static_cast<int>(run.x));
    right = std::max(right, run.x + run.count);
    top = std::min(top, y);
    bottom = std::max(bottom, y + 1);
  }
};

/// The plane that most samples of a bin lie on, if any does: candidate and weight of a majority
/// vote [Boyer1991].
struct Plane {
  Vec3 normal{0.0f};
  float offset = 0.0f;  ///< dot(normal, P), relative to the frame's eye
  std::int64_t votes = 0;

  bool holds(const Vec3& position, const Vec3& sampleNormal) const {
    const Vec3 turned = sampleNormal - normal;
    const float off = glm::dot(normal, position) - offset;
    return glm::dot(turned, turned) <= kPlanarNormal * kPlanarNormal &&
           off * off <= kPlanarOffset * kPlanarOffset * glm::dot(position, position);
  }
  void vote(const Vec3& position, const Vec3& sampleNormal) {
    if (votes > 0) {
      votes += holds(position, sampleNormal) ? 1 : -1;
    } else {
      *this = {sampleNormal, glm::dot(sampleNormal, position), 1};
    }
  }
  void vote(const Plane& other) {
    const Vec3 turned = other.normal - normal;
    const bool same =
        glm::dot(turned, turned) <= kPlanarNormal * kPlanarNormal &&
        std::abs(other.offset - offset) <= kPlanarOffset * std::max(std::abs(offset), 1e-30f);
    if (same) {
      votes += other.votes;
    } else if (other.votes > votes) {
      const std::int64_t left = other.votes - votes;
      *this = other;
      votes = left;
    } else {
      votes -= other.votes;
    }
  }
};

/// Direction of the least variance; `normal` where samples are (nearly) one point or on a line.
Vec3 planeNormal(const glm::dmat3& covariance, const Vec3& normal) {
  Eigen::Matrix3d matrix;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) matrix(i, j) = covariance[i][j];
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(matrix);
  const Eigen::Vector3d& values = solver.eigenvalues();
  if (solver.info() != Eigen::Success || !(values[1] > 1e-4 * values[2])) return normal;
  const Eigen::Vector3d v = solver.eigenvectors().col(0);
  const Vec3 found = normalizedOr(Vec3(v[0], v[1], v[2]), normal);
  return glm::dot(found, normal) < 0.0f ? -found : found;
}

/// What the sums over a cluster's samples say of it.
void describe(const Sums& all, const Vec3& anchor, Cluster& cluster) {
  const double n = all.samples;
  const glm::dvec3 offset = all.position / n;
  const glm::dvec3 mean = all.normal / n;
  cluster.samples = all.samples;
  cluster.centroid = Vec3(glm::dvec3(anchor) + offset);
  cluster.concave = !cluster.planar && all.dot - n * glm::dot(offset, mean) < 0.0;
  cluster.normalsCancel = glm::length(mean) < 1e-3;
  cluster.meanNormal = cluster.normalsCancel
                           ? normalizedOr(-cluster.centroid, Vec3(0.0f, 1.0f, 0.0f))
                           : Vec3(glm::normalize(mean));
  const glm::dmat3 moment(all.squares.x, all.products.x, all.products.z,  //
                          all.products.x, all.squares.y, all.products.y,  //
                          all.products.z, all.products.y, all.squares.z);
  cluster.planeNormal = cluster.planar ? cluster.meanNormal
                                       : planeNormal(moment / n - glm::outerProduct(offset, offset),
                                                     cluster.meanNormal);
  cluster.maxGlossiness = all.glossiness;
  cluster.left = all.left;
  cluster.right = all.right;
  cluster.top = all.top;
  cluster.bottom = all.bottom;
}

/// Angle of (x, y) from +x in turns, 0..1; without branches, so that loops become vector
/// instructions. [Abramowitz1964] 4.4.49.
inline float turnOf(float x, float y) {
  const float ax = std::abs(x);
  const float ay = std::abs(y);
  const float t = std::min(ax, ay) / std::max(std::max(ax, ay), 1e-30f);
  const float s = t * t;
  const float angle =
      t * (0.9998660f + s * (-0.3302995f + s * (0.1801410f + s * (-0.0851330f + s * 0.0208351f))));
  float turn = angle * (0.5f / kPi);
  turn = ay > ax ? 0.25f - turn : turn;
  turn = x < 0.0f ? 0.5f - turn : turn;
  return y < 0.0f ? 1.0f - turn : turn;
}

inline int binOfNormal(float x, float y, float z, const BinScale& scale) {
  const float across = x * x + z * z;
  float turn = across > kPoleSine * kPoleSine ? turnOf(x, z) + kBinOffset : 0.0f;
  turn = turn < 1.0f ? turn : turn - 1.0f;
  const float fall = 2.0f * turnOf(y, std::sqrt(across)) + kBinOffset;
  const auto last = [](int bins) { return static_cast<float>(bins) - 0.5f; };
  const float theta = std::min(turn * scale.theta, last(scale.thetaBins));
  const float phi = std::min(fall * scale.phi, last(scale.phiBins));
  return static_cast<int>(phi) * scale.thetaBins + static_cast<int>(theta);
}

/// A ray as k-means sees it: where distances are squared, metres count as radians do at the
/// distance of the object.
struct MeanRay {
  Vec3 direction{0.0f};
  Vec3 origin{0.0f};      ///< times `perMetre`
  float perMetre = 0.0f;  ///< of the object
};

/// What a step of k-means adds up for each mean, in units of 1 / kMeansUnit.
struct MeanSums {
  std::array<std::int64_t, 6> values{};
  std::int64_t samples = 0;
};

/// The nearest of the means first..last for up to four samples.
LaneMask nearestMeans(std::span<const MeanRay> means, std::size_t first, std::size_t last,
                      std::int32_t own, const Lanes3& direction, const Lanes3& position) {
  Lanes smallest = lanes(std::numeric_limits<float>::infinity());
  LaneMask nearest{own, own, own, own};
  for (std::size_t m = first; m < last; ++m) {
    const MeanRay& mean = means[m];
    if (mean.perMetre == 0.0f) continue;
    const Lanes3 turned = minus(direction, mean.direction);
    const Lanes3 moved =
        minus({position.x * mean.perMetre, position.y * mean.perMetre, position.z * mean.perMetre},
              mean.origin);
    const Lanes distance = dot(turned, turned) + dot(moved, moved);
    const auto number = static_cast<std::int32_t>(m);
    nearest = distance < smallest ? LaneMask{number, number, number, number} : nearest;
    smallest = least(distance, smallest);
  }
  return nearest;
}

/// Samples of one object beside each other in a row.
struct ObjectRun {
  std::uint32_t object = 0;
  std::uint16_t x = 0;
  std::uint16_t count = 0;
};

/// A bin that has samples in a block.
struct BlockBin {
  std::uint32_t bin = 0;
  Vec3 anchor{0.0f};  ///< position of its first sample
  Plane plane;
  std::array<Sums, 2> sums;  ///< of what is beside the plane, and on it
};

/// What a block keeps from pass to pass. Rows are indices of their first runs, and the number of
/// runs.
struct BlockWork {
  std::vector<ObjectRun> objectRuns;
  std::vector<std::uint32_t> objectRows;
  std::vector<std::uint32_t> area;  ///< by object
  VectorArrays normal;
  std::vector<BlockBin> bins;
  std::vector<SampleRun> binRuns;  ///< by bin: their slots are indices of `bins`
  std::vector<std::uint32_t> binRows;
  std::vector<SampleRun> partRuns;  ///< likewise, 2 * slot + (on the plane)
  std::vector<std::uint32_t> partRows;
  std::vector<std::int32_t> ofSample;
};

/// Calls run(begin, end, value) for each longest range of equal values.
template <class Run>
void forEqual(std::span<const std::int32_t> values, const Run& run) {
  for (std::size_t begin = 0; begin < values.size();) {
    std::size_t end = begin + 1;
    while (end < values.size() && values[end] == values[begin]) ++end;
    run(begin, end, values[begin]);
    begin = end;
  }
}

}  // namespace

/// The frame that is clustered, and what lives from pass to pass.
struct Clustering::Work {
  std::vector<BlockWork> blocks;
  std::vector<BinScale> scales;         ///< by object
  std::vector<std::uint32_t> firstBin;  ///< by object, and the number of bins
  std::vector<Plane> planes;            ///< by bin
  std::vector<Vec3> anchors;            ///< by bin
  std::vector<Sums> sums;               ///< by part: 2 bin (beside its plane) and 2 bin + 1
  std::vector<std::uint16_t> clusterOfPart;
};

Clustering::Clustering() : work_(std::make_unique<Work>()) {}
Clustering::Clustering(Clustering&&) noexcept = default;
Clustering::~Clustering() = default;

BinScale binScale(float areaFraction, int visibleObjects, const ClusterOptions& options) {
  const float scale = std::min(1.0f, options.binDensity * 100.0f * areaFraction /
                                         static_cast<float>(std::max(1, visibleObjects)));
  BinScale bins;
  bins.theta = std::max(1.0f, scale * static_cast<float>(options.maxThetaBins));
  bins.phi = std::max(1.0f, scale * static_cast<float>(options.maxPhiBins));
  bins.thetaBins = static_cast<int>(std::ceil(bins.theta));
  bins.phiBins = static_cast<int>(std::ceil(bins.phi));
  return bins;
}

int binOf(const Vec3& normal, const BinScale& scale) {
  return binOfNormal(normal.x, normal.y, normal.z, scale);
}

void Clustering::build(const raster::GBufferCopy& gbuffer, const scene::Camera& camera,
                       std::span<const ReflectorKind> kinds, const ClusterOptions& options) {
  const int width = gbuffer.sampleWidth();
  const int height = gbuffer.sampleHeight();
  const std::size_t total = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  const std::size_t blockCount = static_cast<std::size_t>((height + kRows - 1) / kRows);
  const std::size_t objects = kinds.size();
  blocks_.resize(blockCount);
  work_->blocks.resize(blockCount);
  clusterOf_.resize(total);
  const auto rowStart = [&](int y) { return static_cast<std::size_t>(y) * width; };
  const auto forBlocks = [&](auto&& body) {
    parallelFor(blockCount, 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t b = begin; b < end; ++b) {
        const int top = static_cast<int>(b) * kRows;
        body(blocks_[b], work_->blocks[b], top, std::min(height, top + kRows));
      }
    });
  };

  // Reflective samples: runs of one object in a row, and every object's area
  const bool levels = !gbuffer.diffuse.empty();
  forBlocks([&](SampleBlock&, BlockWork& work, int top, int bottom) {
    work.objectRuns.clear();
    work.objectRows.clear();
    work.area.assign(objects, 0);
    for (int y = top; y < bottom; ++y) {
      work.objectRows.push_back(static_cast<std::uint32_t>(work.objectRuns.size()));
      const std::uint32_t* object = gbuffer.object.data() + rowStart(y);
      const float* depth = gbuffer.depth.data() + rowStart(y);
      const float* diffuse = levels ? gbuffer.diffuse.data() + 4 * rowStart(y) : nullptr;
      const auto shown = [&](int x) {
        return depth[x] > 0.0f && (!levels || diffuse[4 * x + 3] > 0.0f);
      };
      for (int x = 0; x < width;) {
        const int begin = x;
        const std::uint32_t id = object[x];
        if (kinds[id] == ReflectorKind::None) {
          while (x < width && object[x] == id) ++x;
          continue;
        }
        while (x < width && object[x] == id && shown(x)) ++x;
        if (x == begin) {
          ++x;
          continue;
        }
        work.objectRuns.push_back(
            {id, static_cast<std::uint16_t>(begin), static_cast<std::uint16_t>(x - begin)});
        work.area[id] += static_cast<std::uint32_t>(x - begin);
      }
    }
    work.objectRows.push_back(static_cast<std::uint32_t>(work.objectRuns.size()));
  });
  std::vector<std::uint64_t> area(objects, 0);
  for (const BlockWork& work : work_->blocks) {
    for (std::size_t i = 0; i < objects; ++i) area[i] += work.area[i];
  }
  reflective_ = 0;
  visibleObjects_ = 0;
  for (const std::uint64_t samples : area) {
    reflective_ += samples;
    visibleObjects_ += samples > 0 ? 1 : 0;
  }

  // Bins of every visible object
  std::vector<std::uint32_t>& firstBin = work_->firstBin;
  ClusterOptions coarser = options;
  for (halved_ = 0;; ++halved_) {
    firstBin.assign(1, 0);
    work_->scales.assign(objects, {});
    for (std::size_t i = 0; i < objects; ++i) {
      if (area[i] > 0) {
        work_->scales[i] = binScale(static_cast<float>(area[i]) / static_cast<float>(total),
                                    visibleObjects_, coarser);
      }
      const BinScale& scale = work_->scales[i];
      const int bins = area[i] > 0 ? scale.thetaBins * scale.phiBins : 0;
      firstBin.push_back(firstBin.back() + static_cast<std::uint32_t>(bins));
    }
    if (firstBin.back() <= kMostBins || coarser.maxThetaBins * coarser.maxPhiBins == 1) break;
    coarser.maxThetaBins = std::max(1, coarser.maxThetaBins / 2);
    coarser.maxPhiBins = std::max(1, coarser.maxPhiBins / 2);
  }
  const std::uint32_t bins = firstBin.back();

  // Positions, normals, runs of one bin, and each bin's vote for a plane
  const Mat3 rayFromPixel = scene::rayFromPixel(camera, width, height);
  forBlocks([&](SampleBlock& block, BlockWork& work, int top, int bottom) {
    std::size_t count = 0;
    for (const ObjectRun& run : work.objectRuns) count += run.count;
    block.position.resize(count);
    work.normal.resize(count);
    work.ofSample.resize(static_cast<std::size_t>(width));
    work.bins.clear();
    work.binRuns.clear();
    work.binRows.clear();
    std::vector<std::uint32_t> slotOf(bins, kNone);
    std::uint32_t first = 0;
    for (int y = top; y < bottom; ++y) {
      work.binRows.push_back(static_cast<std::uint32_t>(work.binRuns.size()));
      const Vec3 rowRay = rayFromPixel * Vec3(0.5f, static_cast<float>(y) + 0.5f, 1.0f);
      const auto row = static_cast<std::size_t>(y - top);
      for (std::size_t r = work.objectRows[row]; r < work.objectRows[row + 1]; ++r) {
        const ObjectRun& run = work.objectRuns[r];
        const float* depth = gbuffer.depth.data() + rowStart(y) + run.x;
        const float* normal = gbuffer.normal.data() + 4 * (rowStart(y) + run.x);
        float* const px = block.position.x.data() + first;
        float* const py = block.position.y.data() + first;
        float* const pz = block.position.z.data() + first;
        float* const nx = work.normal.x.data() + first;
        float* const ny = work.normal.y.data() + first;
        float* const nz = work.normal.z.data() + first;
        const Vec3 step = rayFromPixel[0];
        for (int k = 0; k < run.count; ++k) {
          const float scale = camera.nearMetres / depth[k];
          const auto x = static_cast<float>(run.x + k);
          px[k] = scale * (rowRay.x + x * step.x);
          py[k] = scale * (rowRay.y + x * step.y);
          pz[k] = scale * (rowRay.z + x * step.z);
        }
        bool uneven = false;
        for (int k = 0; k < run.count; ++k) {
          nx[k] = normal[4 * k];
          ny[k] = normal[4 * k + 1];
          nz[k] = normal[4 * k + 2];
          uneven |= (nx[k] != normal[0]) | (ny[k] != normal[1]) | (nz[k] != normal[2]);
        }

        const BinScale& scale = work_->scales[run.object];
        const auto addRun = [&](std::size_t begin, std::size_t end, int bin) {
          const std::uint32_t number = firstBin[run.object] + static_cast<std::uint32_t>(bin);
          std::uint32_t& slot = slotOf[number];
          const auto from = first + static_cast<std::uint32_t>(begin);
          const auto to = first + static_cast<std::uint32_t>(end);
          if (slot == kNone) {
            slot = static_cast<std::uint32_t>(work.bins.size());
            BlockBin& made = work.bins.emplace_back();
            made.bin = number;
            made.anchor = block.position[from];
          }
          work.binRuns.push_back({from, slot, static_cast<std::uint16_t>(run.x + begin),
                                  static_cast<std::uint16_t>(end - begin)});
          Plane& plane = work.bins[slot].plane;
          for (std::uint32_t i = from; i < to; ++i) {
            plane.vote(block.position[i], work.normal[i]);
          }
        };
        if (uneven) {
          std::int32_t* const ofSample = work.ofSample.data();
          for (int k = 0; k < run.count; ++k) {
            ofSample[k] = binOfNormal(nx[k], ny[k], nz[k], scale);
          }
          forEqual({ofSample, run.count}, addRun);
        } else {
          addRun(0, run.count, binOfNormal(nx[0], ny[0], nz[0], scale));
        }
        first += run.count;
      }
    }
    work.binRows.push_back(static_cast<std::uint32_t>(work.binRuns.size()));
  });
  std::vector<Plane>& planes = work_->planes;
  std::vector<Vec3>& anchors = work_->anchors;
  planes.assign(bins, {});
  anchors.assign(bins, Vec3(0.0f));
  for (const BlockWork& work : work_->blocks) {
    for (const BlockBin& b : work.bins) {
      if (anchors[b.bin] == Vec3(0.0f)) anchors[b.bin] = b.anchor;
      planes[b.bin].vote(b.plane);
    }
  }

  // What lies on a bin's plane is a part of its own
  forBlocks([&](SampleBlock& block, BlockWork& work, int top, int bottom) {
    work.partRuns.clear();
    work.partRows.clear();
    for (int y = top; y < bottom; ++y) {
      work.partRows.push_back(static_cast<std::uint32_t>(work.partRuns.size()));
      const auto row = static_cast<std::size_t>(y - top);
      for (std::size_t r = work.binRows[row]; r < work.binRows[row + 1]; ++r) {
        const SampleRun& run = work.binRuns[r];
        BlockBin& bin = work.bins[run.slot];
        const Plane plane = planes[bin.bin];
        const auto addPart = [&](std::size_t begin, std::size_t end, int part) {
          const SampleRun made{run.first + static_cast<std::uint32_t>(begin),
                               2 * run.slot + static_cast<std::uint32_t>(part),
                               static_cast<std::uint16_t>(run.x + begin),
                               static_cast<std::uint16_t>(end - begin)};
          work.partRuns.push_back(made);
          bin.sums[static_cast<std::size_t>(part)].add(block.position, work.normal, made, y,
                                                       anchors[bin.bin]);
        };
        std::int32_t* const ofSample = work.ofSample.data();
        int onPlane = 0;
        if (plane.votes > 0) {
          for (std::size_t k = 0; k < run.count; ++k) {
            ofSample[k] =
                plane.holds(block.position[run.first + k], work.normal[run.first + k]) ? 1 : 0;
            onPlane += ofSample[k];
          }
        }
        if (onPlane == 0 || onPlane == run.count) {
          addPart(0, run.count, onPlane == 0 ? 0 : 1);
        } else {
          forEqual({ofSample, run.count}, addPart);
        }
      }
      // Glossiness matters where it may exceed a mirror's
      for (std::size_t r = work.partRows.back(); r < work.partRuns.size(); ++r) {
        const SampleRun& run = work.partRuns[r];
        const std::size_t at = rowStart(y) + run.x;
        if (kinds[gbuffer.object[at]] != ReflectorKind::Glossy) continue;
        float& most = work.bins[run.slot / 2].sums[run.slot % 2].glossiness;
        for (std::size_t k = at; k < at + run.count; ++k) {
          most = std::max(most, gbuffer.normal[4 * k + 3]);
        }
      }
    }
    work.partRows.push_back(static_cast<std::uint32_t>(work.partRuns.size()));
  });

  // Parts that are full enough become clusters, in the order of objects and bins
  clusters_.clear();
  unclustered_ = 0;
  std::vector<Sums>& sums = work_->sums;
  sums.assign(2 * std::size_t{bins}, {});
  for (const BlockWork& work : work_->blocks) {
    for (const BlockBin& b : work.bins) {
      sums[2 * std::size_t{b.bin}].add(b.sums[0]);
      sums[2 * std::size_t{b.bin} + 1].add(b.sums[1]);
    }
  }
  std::vector<std::uint16_t>& clusterOfPart = work_->clusterOfPart;
  clusterOfPart.assign(2 * std::size_t{bins}, 1);
  for (std::size_t object = 0; object < objects; ++object) {
    for (std::uint32_t bin = firstBin[object]; bin < firstBin[object + 1]; ++bin) {
      Sums& rest = sums[2 * std::size_t{bin}];
      Sums& onPlane = sums[2 * std::size_t{bin} + 1];
      // A plane of few samples is a facet of something curved
      const bool flat = onPlane.samples >= kLeastPlane;
      if (!flat) {
        rest.add(onPlane);
        onPlane = {};
      }
      for (const std::uint32_t part : {2 * bin, 2 * bin + 1}) {
        const Sums& all = sums[part];
        if (all.samples == 0) continue;
        if (all.samples < static_cast<std::uint32_t>(options.minSamples) ||
            clusters_.size() == kMostClusters) {
          unclustered_ += all.samples;
          continue;
        }
        Cluster cluster;
        cluster.object = static_cast<int>(object);
        const int number = static_cast<int>(bin - firstBin[object]);
        cluster.thetaBin = number % work_->scales[object].thetaBins;
        cluster.phiBin = number / work_->scales[object].thetaBins;
        cluster.planar = part % 2 == 1;
        describe(all, anchors[bin], cluster);
        clusters_.push_back(cluster);
        clusterOfPart[part] = static_cast<std::uint16_t>(clusters_.size() + 1);
      }
      if (!flat) clusterOfPart[2 * bin + 1] = clusterOfPart[2 * bin];
    }
  }

  // Runs of one cluster; of planar mirrors the plane says it all
  forBlocks([&](SampleBlock& block, BlockWork& work, int top, int bottom) {
    block.runs.clear();
    block.rows.clear();
    block.slots.clear();
    std::fill(clusterOf_.begin() + static_cast<std::ptrdiff_t>(rowStart(top)),
              clusterOf_.begin() + static_cast<std::ptrdiff_t>(rowStart(bottom)), 0);
    std::vector<std::uint32_t> slotOf(clusters_.size(), kNone);
    for (int y = top; y < bottom; ++y) {
      block.rows.push_back(static_cast<std::uint32_t>(block.runs.size()));
      const auto row = static_cast<std::size_t>(y - top);
      for (std::size_t r = work.partRows[row]; r < work.partRows[row + 1]; ++r) {
        SampleRun run = work.partRuns[r];
        const std::uint16_t known =
            clusterOfPart[2 * std::size_t{work.bins[run.slot / 2].bin} + run.slot % 2];
        std::fill_n(clusterOf_.begin() + static_cast<std::ptrdiff_t>(rowStart(y) + run.x),
                    run.count, known);
        if (known < 2) continue;
        const std::size_t cluster = known - 2u;
        if (clusters_[cluster].planar &&
            kinds[static_cast<std::size_t>(clusters_[cluster].object)] == ReflectorKind::Mirror) {
          continue;
        }
        if (slotOf[cluster] == kNone) {
          slotOf[cluster] = static_cast<std::uint32_t>(block.slots.size());
          block.slots.push_back(static_cast<std::uint16_t>(cluster));
        }
        run.slot = slotOf[cluster];
        SampleRun* last = block.runs.size() > block.rows.back() ? &block.runs.back() : nullptr;
        if (last != nullptr && last->slot == run.slot && last->x + last->count == run.x) {
          last->count = static_cast<std::uint16_t>(last->count + run.count);
        } else {
          block.runs.push_back(run);
        }
      }
    }
    block.rows.push_back(static_cast<std::uint32_t>(block.runs.size()));

    // The mirror rays
    block.direction.resize(block.position.x.size());
    for (const SampleRun& run : block.runs) {
      for (std::size_t i = run.first; i < run.first + run.count; ++i) {
        const Vec3 position = block.position[i];
        const Vec3 normal = work.normal[i];
        const Vec3 incoming = position / std::sqrt(glm::dot(position, position));
        const Vec3 direction = incoming - 2.0f * glm::dot(incoming, normal) * normal;
        block.direction.x[i] = direction.x;
        block.direction.y[i] = direction.y;
        block.direction.z[i] = direction.z;
      }
    }
  });
  if (options.kMeans) moveToNearestMeans(static_cast<std::size_t>(width), options.minSamples);
}

void Clustering::moveToNearestMeans(std::size_t width, int minSamples) {
  // Means of one object beside each other: first and last of every cluster's. A mean without scale
  // is left out: planar clusters, and those that became too small.
  const std::size_t count = clusters_.size();
  std::vector<MeanRay> means(count);
  std::vector<std::size_t> first(count), last(count);
  for (std::size_t c = 0; c < count; ++c) {
    first[c] = c > 0 && clusters_[c].object == clusters_[c - 1].object ? first[c - 1] : c;
    const float away = glm::length(clusters_[first[c]].centroid);
    if (!clusters_[c].planar) means[c].perMetre = away > 0.0f ? 1.0f / away : 1.0f;
  }
  for (std::size_t c = count; c-- > 0;) {
    last[c] = c + 1 < count && first[c + 1] == first[c] ? last[c + 1] : c + 1;
  }

  // Calls body(number of the nearest mean, k) for each sample of a run, or of its own when `bins`
  const auto forSamples = [&](const SampleBlock& block, const SampleRun& run, bool bins,
                              auto&& body) {
    const std::size_t own = block.slots[run.slot];
    for (std::size_t k = 0; k < run.count; k += kLanes) {
      const std::size_t there = std::min<std::size_t>(kLanes, run.count - k);
      LaneMask nearest{};
      if (!bins && !clusters_[own].planar) {
        nearest = nearestMeans(means, first[own], last[own], static_cast<std::int32_t>(own),
                               block.direction.load(run.first + k, there),
                               block.position.load(run.first + k, there));
      }
      for (std::size_t i = 0; i < there; ++i) {
        body(bins || clusters_[own].planar ? own : static_cast<std::size_t>(nearest[i]), k + i);
      }
    }
  };
  const auto sumUp = [&](bool bins) {
    std::vector<MeanSums> sums(count);
    std::mutex mutex;
    parallelFor(blocks_.size(), 1, [&](std::size_t begin, std::size_t end) {
      std::vector<MeanSums> mine(count);
      for (std::size_t b = begin; b < end; ++b) {
        for (const SampleRun& run : blocks_[b].runs) {
          forSamples(blocks_[b], run, bins, [&](std::size_t mean, std::size_t k) {
            const Vec3 direction = kMeansUnit * blocks_[b].direction[run.first + k];
            const Vec3 origin =
                kMeansUnit * means[mean].perMetre * blocks_[b].position[run.first + k];
            for (int axis = 0; axis < 3; ++axis) {
              mine[mean].values[axis] += static_cast<std::int64_t>(direction[axis]);
              mine[mean].values[axis + 3] += static_cast<std::int64_t>(origin[axis]);
            }
            ++mine[mean].samples;
          });
        }
      }
      const std::lock_guard lock(mutex);
      for (std::size_t c = 0; c < count; ++c) {
        for (std::size_t i = 0; i < 6; ++i) sums[c].values[i] += mine[c].values[i];
        sums[c].samples += mine[c].samples;
      }
    });
    return sums;
  };

  // Means of the bins, and then of what is nearest to the last means
  for (int step = 0; step <= kMeansSteps; ++step) {
    const std::vector<MeanSums> sums = sumUp(step == 0);
    for (std::size_t c = 0; c < count; ++c) {
      if (sums[c].samples == 0) continue;
      const double unit = 1.0 / (static_cast<double>(sums[c].samples) * double{kMeansUnit});
      for (int axis = 0; axis < 3; ++axis) {
        means[c].direction[axis] =
            static_cast<float>(static_cast<double>(sums[c].values[axis]) * unit);
        means[c].origin[axis] =
            static_cast<float>(static_cast<double>(sums[c].values[axis + 3]) * unit);
      }
    }
  }
  for (bool again = true; again;) {
    again = false;
    const std::vector<MeanSums> sums = sumUp(false);
    for (std::size_t c = 0; c < count; ++c) {
      if (means[c].perMetre > 0.0f && sums[c].samples < minSamples) {
        means[c].perMetre = 0.0f;
        again = true;
      }
    }
  }

  // Clusters of what is left
  std::vector<Cluster> kept;
  std::vector<std::uint16_t> numberOf(count, 0);
  std::vector<Vec3> anchors;
  for (std::size_t c = 0; c < count; ++c) {
    if (!clusters_[c].planar && means[c].perMetre == 0.0f) continue;
    numberOf[c] = static_cast<std::uint16_t>(kept.size());
    anchors.push_back(clusters_[c].centroid);
    kept.push_back(clusters_[c]);
  }
  std::vector<std::vector<Sums>> sums(blocks_.size());
  parallelFor(blocks_.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t b = begin; b < end; ++b) {
      SampleBlock& block = blocks_[b];
      std::vector<SampleRun> runs;
      std::vector<std::uint32_t> rows;
      std::vector<std::uint16_t> slots;
      std::vector<std::uint32_t> slotOf(kept.size(), kNone);
      // What has no runs has its number alone
      for (std::size_t at = b * kRows * width;
           at < std::min((b + 1) * kRows * width, clusterOf_.size()); ++at) {
        if (clusterOf_[at] >= 2 && clusters_[clusterOf_[at] - 2u].planar) {
          clusterOf_[at] = static_cast<std::uint16_t>(numberOf[clusterOf_[at] - 2u] + 2);
        }
      }
      for (std::size_t row = 0; row + 1 < block.rows.size(); ++row) {
        rows.push_back(static_cast<std::uint32_t>(runs.size()));
        const std::size_t y = b * kRows + row;
        for (std::size_t r = block.rows[row]; r < block.rows[row + 1]; ++r) {
          const SampleRun& run = block.runs[r];
          forSamples(block, run, false, [&](std::size_t mean, std::size_t k) {
            const std::uint16_t number = numberOf[mean];
            if (slotOf[number] == kNone) {
              slotOf[number] = static_cast<std::uint32_t>(slots.size());
              slots.push_back(number);
              sums[b].emplace_back();
            }
            clusterOf_[y * width + run.x + k] = static_cast<std::uint16_t>(number + 2);
            if (runs.size() > rows.back() && runs.back().slot == slotOf[number] &&
                runs.back().x + runs.back().count == run.x + static_cast<int>(k)) {
              ++runs.back().count;
            } else {
              runs.push_back({run.first + static_cast<std::uint32_t>(k), slotOf[number],
                              static_cast<std::uint16_t>(run.x + k), 1});
            }
          });
        }
        for (std::size_t r = rows.back(); r < runs.size(); ++r) {
          sums[b][runs[r].slot].add(block.position, work_->blocks[b].normal, runs[r],
                                    static_cast<int>(y), anchors[slots[runs[r].slot]]);
        }
      }
      rows.push_back(static_cast<std::uint32_t>(runs.size()));
      block.runs = std::move(runs);
      block.rows = std::move(rows);
      block.slots = std::move(slots);
    }
  });
  std::vector<Sums> all(kept.size());
  for (std::size_t b = 0; b < blocks_.size(); ++b) {
    for (std::size_t s = 0; s < sums[b].size(); ++s) all[blocks_[b].slots[s]].add(sums[b][s]);
  }
  for (std::size_t c = 0; c < kept.size(); ++c) {
    if (kept[c].planar) continue;
    // Samples were dealt out anew: any may have the object's largest
    for (const Cluster& other : clusters_) {
      if (other.object == kept[c].object && !other.planar)
        all[c].glossiness = std::max(all[c].glossiness, other.maxGlossiness);
    }
    describe(all[c], anchors[c], kept[c]);
  }
  clusters_ = std::move(kept);
}

}  // namespace catoptric::methods
