#include "methods/second_order/clustering/clusters.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include "core/parallel.h"
#include "methods/second_order/clustering/means.h"
#include "methods/second_order/clustering/steps.h"
#include "methods/second_order/clustering/sums.h"

namespace catoptric::methods {
namespace {

constexpr float kPoleSine = 1.75e-3f;  ///< sine of 0.1 degrees; ours
/// Samples are on one plane when no normal leaves the plane's by more (radians) and none the plane
/// by more than this share of its distance from the eye: a pixel's reflection moves by less than a
/// tenth of a texel of a 1024 pixel frame. Ours.
constexpr float kPlanarNormal = 1e-4f;
constexpr float kPlanarOffset = 5e-5f;
constexpr std::uint64_t kLeastPlane = 64;    ///< samples of a planar cluster; ours
constexpr std::size_t kPlanes = 4;           ///< planar clusters of a bin, at most; ours
constexpr std::size_t kParts = kPlanes + 1;  ///< of a bin: what is on no plane, and the planes
/// A step of a cluster is divided off if it has this part of the frame's samples: another cluster
/// is another image of all that it sees. Ours.
constexpr std::size_t kLeastStep = 8192;
/// Among many objects, too, those of at least this share of the frame have this share of the bins
/// at a density of 1: the rays of half a sphere do not fit one camera. Ours.
constexpr float kLeastArea = 1e-3f;
constexpr float kLeastBins = 0.04f;
constexpr std::uint32_t kNone = 0xFFFFFFFFu;

/// A plane that samples may lie on, and its weight in a vote.
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
  LaneMask holds(const Lanes3& position, const Lanes3& sampleNormal) const {
    const Lanes3 turned = minus(sampleNormal, normal);
    const Lanes off = dot(position, normal) - offset;
    return (dot(turned, turned) <= kPlanarNormal * kPlanarNormal) &
           (off * off <= kPlanarOffset * kPlanarOffset * dot(position, position));
  }
  bool sameAs(const Plane& other) const {
    const Vec3 turned = other.normal - normal;
    return glm::dot(turned, turned) <= kPlanarNormal * kPlanarNormal &&
           std::abs(other.offset - offset) <= kPlanarOffset * std::max(std::abs(offset), 1e-30f);
  }
};

/// The planes that most samples of a bin lie on: every plane with more than 1 / (kPlanes + 1) of
/// them is among these [Misra1982].
struct Planes {
  std::array<Plane, kPlanes> of;

  void vote(const Vec3& position, const Vec3& sampleNormal) {
    Plane* free = nullptr;
    for (Plane& plane : of) {
      if (plane.votes == 0) {
        free = &plane;
      } else if (plane.holds(position, sampleNormal)) {
        ++plane.votes;
        return;
      }
    }
    if (free != nullptr) {
      *free = {sampleNormal, glm::dot(sampleNormal, position), 1};
    } else {
      for (Plane& plane : of) --plane.votes;
    }
  }
  /// Whether all samples have voted for one plane; if not, none has voted.
  bool voteAll(const Lanes3& position, const Lanes3& sampleNormal) {
    for (Plane& plane : of) {
      if (plane.votes == 0) continue;
      const LaneMask held = plane.holds(position, sampleNormal);
      if (noneOf(held)) continue;
      if (!allOf(held)) return false;
      plane.votes += static_cast<std::int64_t>(kLanes);
      return true;
    }
    return false;
  }
  void vote(Plane other) {
    for (Plane& plane : of) {
      if (plane.votes > 0 && plane.sameAs(other)) {
        plane.votes += other.votes;
        return;
      }
    }
    const auto least = std::ranges::min_element(of, {}, &Plane::votes);
    const std::int64_t taken = std::min(least->votes, other.votes);
    for (Plane& plane : of) plane.votes -= taken;
    other.votes -= taken;
    if (least->votes == 0) *least = other;
  }
};

/// Votes of the samples from `first` on whose normal is the one before's: where neighbours' normals
/// differ there is no plane.
void vote(const SampleBlock& block, std::uint32_t first, std::uint32_t last, Planes& planes) {
  constexpr auto kStep = static_cast<std::uint32_t>(kLanes);
  for (std::uint32_t i = first; i < last;) {
    const std::uint32_t next = std::min(last, i + kStep);
    if (next - i == kStep) {
      const Lanes3 normal = block.normal.load(i, kLanes);
      const Lanes3 before = block.normal.load(i - 1, kLanes);
      const Lanes3 turned{normal.x - before.x, normal.y - before.y, normal.z - before.z};
      const LaneMask same = dot(turned, turned) <= kPlanarNormal * kPlanarNormal;
      if (noneOf(same) || (allOf(same) && planes.voteAll(block.position.load(i, kLanes), normal))) {
        i = next;
        continue;
      }
    }
    for (; i < next; ++i) {
      const Vec3 turned = block.normal[i] - block.normal[i - 1];
      if (glm::dot(turned, turned) <= kPlanarNormal * kPlanarNormal) {
        planes.vote(block.position[i], block.normal[i]);
      }
    }
  }
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
  Planes planes;
  std::array<Sums, kParts> sums;
};

/// What a block keeps from pass to pass. Rows are indices of their first runs, and the number of
/// runs.
struct BlockWork {
  std::vector<ObjectRun> objectRuns;
  std::vector<std::uint32_t> objectRows;
  std::vector<std::uint32_t> area;  ///< by object
  std::vector<BlockBin> bins;
  std::vector<SampleRun> binRuns;  ///< by bin: their slots are indices of `bins`
  std::vector<std::uint32_t> binRows;
  std::vector<SampleRun> partRuns;  ///< likewise, kParts * slot + part
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
  std::vector<Planes> planes;           ///< by bin
  std::vector<Vec3> anchors;            ///< by bin
  std::vector<Sums> sums;               ///< by kParts * bin + part
  std::vector<std::uint16_t> clusterOfPart;
};

Clustering::Clustering() : work_(std::make_unique<Work>()) {}
Clustering::Clustering(Clustering&&) noexcept = default;
Clustering::~Clustering() = default;

BinScale binScale(float areaFraction, int visibleObjects, const ClusterOptions& options) {
  float scale =
      options.binDensity * 100.0f * areaFraction / static_cast<float>(std::max(1, visibleObjects));
  if (areaFraction >= kLeastArea) scale = std::max(scale, kLeastBins * options.binDensity);
  scale = std::min(1.0f, scale);
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
    block.normal.resize(count);
    work.ofSample.resize(static_cast<std::size_t>(width) + kLanes);
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
        float* const nx = block.normal.x.data() + first;
        float* const ny = block.normal.y.data() + first;
        float* const nz = block.normal.z.data() + first;
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
          vote(block, from + 1, to, work.bins[slot].planes);
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
  std::vector<Planes>& planes = work_->planes;
  std::vector<Vec3>& anchors = work_->anchors;
  planes.assign(bins, {});
  anchors.assign(bins, Vec3(0.0f));
  for (const BlockWork& work : work_->blocks) {
    for (const BlockBin& b : work.bins) {
      if (anchors[b.bin] == Vec3(0.0f)) anchors[b.bin] = b.anchor;
      for (const Plane& plane : b.planes.of) {
        if (plane.votes > 0) planes[b.bin].vote(plane);
      }
    }
  }

  // What lies on a plane of its bin is a part of its own
  forBlocks([&](SampleBlock& block, BlockWork& work, int top, int bottom) {
    work.partRuns.clear();
    work.partRows.clear();
    for (int y = top; y < bottom; ++y) {
      work.partRows.push_back(static_cast<std::uint32_t>(work.partRuns.size()));
      const auto row = static_cast<std::size_t>(y - top);
      for (std::size_t r = work.binRows[row]; r < work.binRows[row + 1]; ++r) {
        const SampleRun& run = work.binRuns[r];
        BlockBin& bin = work.bins[run.slot];
        const Planes& candidates = planes[bin.bin];
        const auto addPart = [&](std::size_t begin, std::size_t end, int part) {
          const SampleRun made{
              run.first + static_cast<std::uint32_t>(begin),
              static_cast<std::uint32_t>(kParts) * run.slot + static_cast<std::uint32_t>(part),
              static_cast<std::uint16_t>(run.x + begin), static_cast<std::uint16_t>(end - begin)};
          work.partRuns.push_back(made);
          bin.sums[static_cast<std::size_t>(part)].add(block.position, block.normal, made, y,
                                                       anchors[bin.bin]);
        };
        std::int32_t* const ofSample = work.ofSample.data();
        std::fill_n(ofSample, run.count, 0);
        std::size_t left = run.count;
        bool together = true;
        for (std::size_t p = 0; p < kPlanes && left > 0; ++p) {
          const Plane plane = candidates.of[p];
          if (plane.votes == 0) continue;
          const auto part = static_cast<std::int32_t>(p + 1);
          LaneMask taken{};
          for (std::size_t k = 0; k < run.count; k += kLanes) {
            const std::size_t there = run.count - k;
            LaneMask parts;
            std::memcpy(&parts, ofSample + k, sizeof parts);
            const LaneMask held = plane.holds(block.position.load(run.first + k, there),
                                              block.normal.load(run.first + k, there)) &
                                  (parts == 0) & valid(there);
            parts |= held & part;
            std::memcpy(ofSample + k, &parts, sizeof parts);
            taken -= held;
          }
          const auto count = static_cast<std::size_t>(taken[0] + taken[1] + taken[2] + taken[3]);
          together = together && (count == 0 || count == run.count);
          left -= count;
        }
        if (together) {
          addPart(0, run.count, ofSample[0]);
        } else {
          forEqual({ofSample, run.count}, addPart);
        }
      }
      // Glossiness matters where it may exceed a mirror's
      for (std::size_t r = work.partRows.back(); r < work.partRuns.size(); ++r) {
        const SampleRun& run = work.partRuns[r];
        const std::size_t at = rowStart(y) + run.x;
        if (kinds[gbuffer.object[at]] != ReflectorKind::Glossy) continue;
        float& most = work.bins[run.slot / kParts].sums[run.slot % kParts].glossiness;
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
  sums.assign(kParts * bins, {});
  for (const BlockWork& work : work_->blocks) {
    for (const BlockBin& b : work.bins) {
      for (std::size_t part = 0; part < kParts; ++part) {
        sums[kParts * b.bin + part].add(b.sums[part]);
      }
    }
  }
  std::vector<std::uint16_t>& clusterOfPart = work_->clusterOfPart;
  clusterOfPart.assign(kParts * bins, 1);
  for (std::size_t object = 0; object < objects; ++object) {
    for (std::uint32_t bin = firstBin[object]; bin < firstBin[object + 1]; ++bin) {
      // A plane of few samples is a facet of something curved
      Sums* const ofBin = sums.data() + kParts * bin;
      std::array<bool, kParts> facet{};
      for (std::size_t part = 1; part < kParts; ++part) {
        facet[part] = ofBin[part].samples < kLeastPlane;
        if (facet[part]) ofBin[0].add(ofBin[part]);
      }
      for (std::size_t part = 0; part < kParts; ++part) {
        const Sums& all = ofBin[part];
        if (facet[part]) {
          clusterOfPart[kParts * bin + part] = clusterOfPart[kParts * bin];
          continue;
        }
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
        cluster.planar = part > 0;
        describe(all, anchors[bin], cluster);
        clusters_.push_back(cluster);
        clusterOfPart[kParts * bin + part] = static_cast<std::uint16_t>(clusters_.size() + 1);
      }
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
            clusterOfPart[kParts * work.bins[run.slot / kParts].bin + run.slot % kParts];
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
        const Vec3 normal = block.normal[i];
        const Vec3 incoming = position / std::sqrt(glm::dot(position, position));
        const Vec3 direction = incoming - 2.0f * glm::dot(incoming, normal) * normal;
        block.direction.x[i] = direction.x;
        block.direction.y[i] = direction.y;
        block.direction.z[i] = direction.z;
      }
    }
  });
  binsKept_ = 0;
  if (options.kMeans) {
    binsKept_ = moveToNearestMeans(static_cast<std::size_t>(width), options.minSamples, clusters_,
                                   blocks_, clusterOf_);
  } else {
    const auto least = static_cast<int>(total / kLeastStep);
    divideAtSteps(static_cast<std::size_t>(width), std::max(options.minSamples, least), clusters_,
                  blocks_, clusterOf_);
  }
}

}  // namespace catoptric::methods
