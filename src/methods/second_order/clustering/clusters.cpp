#include "methods/second_order/clustering/clusters.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include "core/parallel.h"
#include "methods/second_order/clustering/bins.h"
#include "methods/second_order/clustering/means.h"
#include "methods/second_order/clustering/planes.h"
#include "methods/second_order/clustering/steps.h"
#include "methods/second_order/clustering/sums.h"

namespace catoptric::methods::second_order {
namespace {

constexpr std::uint64_t kLeastPlane = 64;  ///< samples of a planar cluster; ours
/// A step of a cluster is divided off if it has this part of the frame's samples: another cluster
/// is another image of all that it sees. Ours.
constexpr std::size_t kLeastStep = 8192;
constexpr std::uint32_t kNoSlot = 0xFFFFFFFFu;

/// The frame that is clustered.
struct FrameSamples {
  const raster::GBufferCopy& gbuffer;
  const scene::Camera& camera;
  std::span<const ReflectorKind> kinds;  ///< by object id
  int width = 0;                         ///< samples
  int height = 0;

  std::size_t rowStart(int y) const { return static_cast<std::size_t>(y) * width; }
  std::size_t count() const { return rowStart(height); }
};

/// Rows of a block: top <= y < bottom.
struct Rows {
  int top = 0;
  int bottom = 0;
};

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
  BinPlanes planes;
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

/// The bins of all objects: those of object i are firstBin[i] <= bin < firstBin[i + 1].
struct ObjectBins {
  std::vector<BinScale> scales;
  std::vector<std::uint32_t> firstBin;
  std::uint32_t count() const { return firstBin.back(); }
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

/// Reflective samples: runs of one object in a row, and every object's area.
void findObjectRuns(const FrameSamples& frame, Rows rows, BlockWork& work) {
  const raster::GBufferCopy& gbuffer = frame.gbuffer;
  const bool levels = !gbuffer.diffuse.empty();
  const int width = frame.width;
  work.objectRuns.clear();
  work.objectRows.clear();
  work.area.assign(frame.kinds.size(), 0);
  for (int y = rows.top; y < rows.bottom; ++y) {
    work.objectRows.push_back(static_cast<std::uint32_t>(work.objectRuns.size()));
    const std::uint32_t* object = gbuffer.object.data() + frame.rowStart(y);
    const float* depth = gbuffer.depth.data() + frame.rowStart(y);
    const float* diffuse = levels ? gbuffer.diffuse.data() + 4 * frame.rowStart(y) : nullptr;
    const auto shown = [&](int x) {
      return depth[x] > 0.0f && (!levels || diffuse[4 * x + 3] > 0.0f);
    };
    for (int x = 0; x < width;) {
      const int begin = x;
      const std::uint32_t id = object[x];
      if (frame.kinds[id] == ReflectorKind::None) {
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
}

/// Bins of every visible object; halved along each angle until they are not too many. Returns how
/// often.
int chooseBins(std::span<const std::uint64_t> area, std::size_t samples, int visibleObjects,
               const ClusterOptions& options, ObjectBins& bins) {
  ClusterOptions coarser = options;
  for (int halved = 0;; ++halved) {
    bins.firstBin.assign(1, 0);
    bins.scales.assign(area.size(), {});
    for (std::size_t i = 0; i < area.size(); ++i) {
      if (area[i] > 0) {
        bins.scales[i] = binScale(static_cast<float>(area[i]) / static_cast<float>(samples),
                                  visibleObjects, coarser);
      }
      const BinScale& scale = bins.scales[i];
      const int count = area[i] > 0 ? scale.thetaBins * scale.phiBins : 0;
      bins.firstBin.push_back(bins.firstBin.back() + static_cast<std::uint32_t>(count));
    }
    if (bins.count() <= Clustering::kMostBins || coarser.maxThetaBins * coarser.maxPhiBins == 1) {
      return halved;
    }
    coarser.maxThetaBins = std::max(1, coarser.maxThetaBins / 2);
    coarser.maxPhiBins = std::max(1, coarser.maxPhiBins / 2);
  }
}

/// Positions and normals of a run's samples, at index `first` of the block. Whether the normals
/// differ.
bool readSamples(const FrameSamples& frame, const Mat3& rayFromPixel, const ObjectRun& run, int y,
                 std::uint32_t first, SampleBlock& block) {
  const Vec3 rowRay = rayFromPixel * Vec3(0.5f, static_cast<float>(y) + 0.5f, 1.0f);
  const Vec3 step = rayFromPixel[0];
  const float nearMetres = frame.camera.nearMetres;
  const float* depth = frame.gbuffer.depth.data() + frame.rowStart(y) + run.x;
  const float* normal = frame.gbuffer.normal.data() + 4 * (frame.rowStart(y) + run.x);
  float* const px = block.position.x.data() + first;
  float* const py = block.position.y.data() + first;
  float* const pz = block.position.z.data() + first;
  float* const nx = block.normal.x.data() + first;
  float* const ny = block.normal.y.data() + first;
  float* const nz = block.normal.z.data() + first;
  for (int k = 0; k < run.count; ++k) {
    const float scale = nearMetres / depth[k];
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
  return uneven;
}

/// Positions, normals, runs of one bin, and each bin's vote for a plane.
void findBinRuns(const FrameSamples& frame, const ObjectBins& bins, Rows rows, SampleBlock& block,
                 BlockWork& work) {
  std::size_t count = 0;
  for (const ObjectRun& run : work.objectRuns) count += run.count;
  block.position.resize(count);
  block.normal.resize(count);
  work.ofSample.resize(static_cast<std::size_t>(frame.width) + kLanes);
  work.bins.clear();
  work.binRuns.clear();
  work.binRows.clear();
  const Mat3 rayFromPixel = scene::rayFromPixel(frame.camera, frame.width, frame.height);
  std::vector<std::uint32_t> slotOf(bins.count(), kNoSlot);
  std::uint32_t first = 0;
  for (int y = rows.top; y < rows.bottom; ++y) {
    work.binRows.push_back(static_cast<std::uint32_t>(work.binRuns.size()));
    const auto row = static_cast<std::size_t>(y - rows.top);
    for (std::size_t r = work.objectRows[row]; r < work.objectRows[row + 1]; ++r) {
      const ObjectRun& run = work.objectRuns[r];
      const bool uneven = readSamples(frame, rayFromPixel, run, y, first, block);
      const auto addRun = [&](std::size_t begin, std::size_t end, int bin) {
        const std::uint32_t number = bins.firstBin[run.object] + static_cast<std::uint32_t>(bin);
        std::uint32_t& slot = slotOf[number];
        const auto from = first + static_cast<std::uint32_t>(begin);
        const auto to = first + static_cast<std::uint32_t>(end);
        if (slot == kNoSlot) {
          slot = static_cast<std::uint32_t>(work.bins.size());
          BlockBin& made = work.bins.emplace_back();
          made.bin = number;
          made.anchor = block.position[from];
        }
        work.binRuns.push_back({from, slot, static_cast<std::uint16_t>(run.x + begin),
                                static_cast<std::uint16_t>(end - begin)});
        vote(block, from + 1, to, work.bins[slot].planes);
      };
      std::int32_t* const ofSample = work.ofSample.data();
      binsOf(block.normal.x.data() + first, block.normal.y.data() + first,
             block.normal.z.data() + first, uneven ? run.count : 1, bins.scales[run.object],
             ofSample);
      if (uneven) {
        forEqual({ofSample, run.count}, addRun);
      } else {
        addRun(0, run.count, ofSample[0]);
      }
      first += run.count;
    }
  }
  work.binRows.push_back(static_cast<std::uint32_t>(work.binRuns.size()));
}

/// Numbers of the parts of a bin's run to `ofSample`: 0 on no plane, else 1 + that of the first
/// candidate that holds the sample. Whether all samples have the same.
bool findParts(const SampleBlock& block, const SampleRun& run, const BinPlanes& candidates,
               std::int32_t* ofSample) {
  std::fill_n(ofSample, run.count, 0);
  std::size_t left = run.count;
  bool together = true;
  for (std::size_t p = 0; p < kPlanes && left > 0; ++p) {
    const SamplePlane plane = candidates.of[p];
    if (plane.votes == 0) continue;
    const auto part = static_cast<std::int32_t>(p + 1);
    Mask4 taken{};
    for (std::size_t k = 0; k < run.count; k += kLanes) {
      const std::size_t there = run.count - k;
      Mask4 parts;
      std::memcpy(&parts, ofSample + k, sizeof parts);
      const Mask4 held = plane.holds(block.position.load(run.first + k, there),
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
  return together;
}

/// What lies on a plane of its bin is a part of its own: runs of one part, and sums over them.
void findPartRuns(const FrameSamples& frame, std::span<const BinPlanes> planes,
                  std::span<const Vec3> anchors, Rows rows, SampleBlock& block, BlockWork& work) {
  work.partRuns.clear();
  work.partRows.clear();
  for (int y = rows.top; y < rows.bottom; ++y) {
    work.partRows.push_back(static_cast<std::uint32_t>(work.partRuns.size()));
    const auto row = static_cast<std::size_t>(y - rows.top);
    for (std::size_t r = work.binRows[row]; r < work.binRows[row + 1]; ++r) {
      const SampleRun& run = work.binRuns[r];
      BlockBin& bin = work.bins[run.slot];
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
      if (findParts(block, run, planes[bin.bin], ofSample)) {
        addPart(0, run.count, ofSample[0]);
      } else {
        forEqual({ofSample, run.count}, addPart);
      }
    }
    // Lobes matter where they may be none of a mirror
    for (std::size_t r = work.partRows.back(); r < work.partRuns.size(); ++r) {
      const SampleRun& run = work.partRuns[r];
      const std::size_t at = frame.rowStart(y) + run.x;
      if (frame.kinds[frame.gbuffer.object[at]] != ReflectorKind::Glossy) continue;
      float& most = work.bins[run.slot / kParts].sums[run.slot % kParts].lobe;
      for (std::size_t k = at; k < at + run.count; ++k) {
        most = std::max(most, raster::lobeOf(frame.gbuffer.normal[4 * k + 3]).code);
      }
    }
  }
  work.partRows.push_back(static_cast<std::uint32_t>(work.partRuns.size()));
}

/// Directions of the mirror rays of a block's samples.
void reflectRays(SampleBlock& block) {
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
}

}  // namespace

/// What lives from pass to pass.
struct Clustering::Work {
  std::vector<BlockWork> blocks;
  std::vector<std::uint64_t> area;  ///< by object, samples
  ObjectBins bins;
  std::vector<BinPlanes> planes;  ///< by bin
  std::vector<Vec3> anchors;      ///< by bin
  std::vector<Sums> sums;         ///< by kParts * bin + part
  std::vector<std::uint16_t> clusterOfPart;

  /// Adds up every object's area.
  void sumArea(std::size_t objects) {
    area.assign(objects, 0);
    for (const BlockWork& work : blocks) {
      for (std::size_t i = 0; i < objects; ++i) area[i] += work.area[i];
    }
  }
  /// Counts the blocks' votes for planes.
  void choosePlanes() {
    planes.assign(bins.count(), {});
    anchors.assign(bins.count(), Vec3(0.0f));
    for (const BlockWork& work : blocks) {
      for (const BlockBin& b : work.bins) {
        if (anchors[b.bin] == Vec3(0.0f)) anchors[b.bin] = b.anchor;
        for (const SamplePlane& plane : b.planes.of) {
          if (plane.votes > 0) planes[b.bin].vote(plane);
        }
      }
    }
  }
  /// Adds up the blocks' sums over parts.
  void sumParts() {
    sums.assign(kParts * bins.count(), {});
    for (const BlockWork& work : blocks) {
      for (const BlockBin& b : work.bins) {
        for (std::size_t part = 0; part < kParts; ++part) {
          sums[kParts * b.bin + part].add(b.sums[part]);
        }
      }
    }
  }
};

Clustering::Clustering() : work_(std::make_unique<Work>()) {}
Clustering::Clustering(Clustering&&) noexcept = default;
Clustering::~Clustering() = default;

void Clustering::makeClusters(int minSamples, const std::vector<bool>& retraced) {
  clusters_.clear();
  unclustered_ = 0;
  alone_ = 0;
  work_->sumParts();
  const ObjectBins& bins = work_->bins;
  std::vector<std::uint16_t>& clusterOfPart = work_->clusterOfPart;
  clusterOfPart.assign(kParts * bins.count(), 1);
  for (std::size_t object = 0; object < bins.scales.size(); ++object) {
    for (std::uint32_t bin = bins.firstBin[object]; bin < bins.firstBin[object + 1]; ++bin) {
      // A plane of few samples is a facet of something curved
      Sums* const ofBin = work_->sums.data() + kParts * bin;
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
        if (all.samples < static_cast<std::uint32_t>(minSamples) ||
            clusters_.size() == kMostClusters) {
          if (!retraced.empty() && retraced[object]) {
            clusterOfPart[kParts * bin + part] = kRetraced;
            alone_ += all.samples;
          } else {
            unclustered_ += all.samples;
          }
          continue;
        }
        Cluster cluster;
        cluster.object = static_cast<int>(object);
        const int number = static_cast<int>(bin - bins.firstBin[object]);
        cluster.thetaBin = number % bins.scales[object].thetaBins;
        cluster.phiBin = number / bins.scales[object].thetaBins;
        cluster.planar = part > 0;
        describe(all, work_->anchors[bin], cluster);
        clusters_.push_back(cluster);
        clusterOfPart[kParts * bin + part] = static_cast<std::uint16_t>(clusters_.size() + 1);
      }
    }
  }
}

void Clustering::findClusterRuns(std::size_t b, int width, int bottom,
                                 std::span<const ReflectorKind> kinds) {
  SampleBlock& block = blocks_[b];
  const BlockWork& work = work_->blocks[b];
  const int top = static_cast<int>(b) * kRows;
  const auto start = [&](int y) {
    return clusterOf_.begin() + static_cast<std::ptrdiff_t>(y) * width;
  };
  block.runs.clear();
  block.rows.clear();
  block.slots.clear();
  std::fill(start(top), start(bottom), 0);
  std::vector<std::uint32_t> slotOf(clusters_.size(), kNoSlot);
  for (int y = top; y < bottom; ++y) {
    block.rows.push_back(static_cast<std::uint32_t>(block.runs.size()));
    const auto row = static_cast<std::size_t>(y - top);
    for (std::size_t r = work.partRows[row]; r < work.partRows[row + 1]; ++r) {
      SampleRun run = work.partRuns[r];
      const std::uint16_t known =
          work_->clusterOfPart[kParts * work.bins[run.slot / kParts].bin + run.slot % kParts];
      std::fill_n(start(y) + run.x, run.count, known);
      if (known < 2 || known == kRetraced) continue;
      // Of planar mirrors the plane says it all
      const std::size_t cluster = known - 2u;
      if (clusters_[cluster].planar &&
          kinds[static_cast<std::size_t>(clusters_[cluster].object)] == ReflectorKind::Mirror) {
        continue;
      }
      if (slotOf[cluster] == kNoSlot) {
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
}

void Clustering::markRetraced(std::span<const std::uint8_t> retraced) {
  for (std::size_t c = 0; c < clusters_.size(); ++c) clusters_[c].retraced = retraced[c] != 0;
}

void Clustering::leaveToRetrace(std::span<const std::uint8_t> retraced) {
  markRetraced(retraced);
  const std::size_t width = clusterOf_.size() / std::max<std::size_t>(1, height_);
  parallelFor(blocks_.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t b = begin; b < end; ++b) {
      const SampleBlock& block = blocks_[b];
      for (std::size_t row = 0; row + 1 < block.rows.size(); ++row) {
        std::uint16_t* const line = &clusterOf_[(b * kRows + row) * width];
        for (std::size_t r = block.rows[row]; r < block.rows[row + 1]; ++r) {
          const SampleRun& run = block.runs[r];
          if (retraced[block.slots[run.slot]] != 0) std::fill_n(line + run.x, run.count, kRetraced);
        }
      }
    }
  });
}

void Clustering::build(const raster::GBufferCopy& gbuffer, const scene::Camera& camera,
                       std::span<const ReflectorKind> kinds, const ClusterOptions& options,
                       const std::vector<bool>& retraced) {
  const FrameSamples frame{gbuffer, camera, kinds, gbuffer.sampleWidth(), gbuffer.sampleHeight()};
  const auto width = static_cast<std::size_t>(frame.width);
  const std::size_t blockCount = static_cast<std::size_t>((frame.height + kRows - 1) / kRows);
  height_ = static_cast<std::size_t>(frame.height);
  blocks_.resize(blockCount);
  work_->blocks.resize(blockCount);
  clusterOf_.resize(frame.count());
  const auto forBlocks = [&](auto&& body) {
    parallelFor(blockCount, 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t b = begin; b < end; ++b) {
        const int top = static_cast<int>(b) * kRows;
        body(b, Rows{top, std::min(frame.height, top + kRows)});
      }
    });
  };

  // Objects and their bins
  forBlocks([&](std::size_t b, Rows rows) { findObjectRuns(frame, rows, work_->blocks[b]); });
  work_->sumArea(kinds.size());
  reflective_ = 0;
  visibleObjects_ = 0;
  for (const std::uint64_t samples : work_->area) {
    reflective_ += samples;
    visibleObjects_ += samples > 0 ? 1 : 0;
  }
  halved_ = chooseBins(work_->area, frame.count(), visibleObjects_, options, work_->bins);

  // Bins and the planes in them
  forBlocks([&](std::size_t b, Rows rows) {
    findBinRuns(frame, work_->bins, rows, blocks_[b], work_->blocks[b]);
  });
  work_->choosePlanes();
  forBlocks([&](std::size_t b, Rows rows) {
    findPartRuns(frame, work_->planes, work_->anchors, rows, blocks_[b], work_->blocks[b]);
  });

  // Clusters, their samples and rays
  makeClusters(options.minSamples, retraced);
  forBlocks([&](std::size_t b, Rows rows) {
    findClusterRuns(b, frame.width, rows.bottom, kinds);
    reflectRays(blocks_[b]);
  });
  binsKept_ = 0;
  if (options.kMeans) {
    binsKept_ = moveToNearestMeans(width, options.minSamples, clusters_, blocks_, clusterOf_);
  } else {
    const auto least = static_cast<int>(frame.count() / kLeastStep);
    divideAtSteps(width, std::max(options.minSamples, least), clusters_, blocks_, clusterOf_);
  }
}

}  // namespace catoptric::methods::second_order
