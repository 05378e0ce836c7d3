#include "methods/second_order/clustering/means.h"

#include <algorithm>
#include <array>
#include <limits>
#include <mutex>
#include <span>
#include <utility>

#include "core/parallel.h"
#include "methods/second_order/clustering/clusters.h"
#include "methods/second_order/clustering/sums.h"

namespace catoptric::methods::second_order {
namespace {

constexpr std::uint32_t kNoCluster = 0xFFFFFFFFu;
constexpr int kMeansSteps = 4;            ///< of k-means; ours
constexpr float kMeansUnit = 1048576.0f;  ///< of its sums, integers: their order does not matter

/// A ray as k-means sees it: where distances are squared, metres count as radians do at the
/// distance of the object.
struct MeanRay {
  Vec3 direction{0.0f};
  Vec3 origin{0.0f};      ///< times `perMetre`
  float perMetre = 0.0f;  ///< of the object
};

/// Of an object; the time of a step grows with means times samples. Ours.
constexpr std::size_t kMostMeans = 256;

/// What a step of k-means adds up for each mean, in units of 1 / kMeansUnit.
struct MeanSums {
  std::array<std::int64_t, 6> values{};
  std::int64_t samples = 0;
};

/// The nearest of the means first..last for up to four samples.
Mask4 nearestMeans(std::span<const MeanRay> means, std::size_t first, std::size_t last,
                   std::int32_t own, const Lanes3& direction, const Lanes3& position) {
  Floats4 smallest = floats4(std::numeric_limits<float>::infinity());
  Mask4 nearest{own, own, own, own};
  for (std::size_t m = first; m < last; ++m) {
    const MeanRay& mean = means[m];
    if (mean.perMetre == 0.0f) continue;
    const Lanes3 turned = minus(direction, mean.direction);
    const Lanes3 moved =
        minus({position.x * mean.perMetre, position.y * mean.perMetre, position.z * mean.perMetre},
              mean.origin);
    const Floats4 distance = dot(turned, turned) + dot(moved, moved);
    const auto number = static_cast<std::int32_t>(m);
    nearest = distance < smallest ? Mask4{number, number, number, number} : nearest;
    smallest = least(distance, smallest);
  }
  return nearest;
}

/// The means of all clusters. Those of one object are beside each other: first[c] <= m < last[c].
struct Means {
  std::vector<MeanRay> rays;  ///< without scale: left out, as planar clusters and those too small
  std::vector<std::size_t> first, last;
  std::vector<std::uint8_t> stays;  ///< whether the cluster keeps its samples
  std::size_t tooMany = 0;          ///< clusters that keep them since their object has too many

  explicit Means(const std::vector<Cluster>& clusters)
      : rays(clusters.size()),
        first(clusters.size()),
        last(clusters.size()),
        stays(clusters.size(), 0) {
    const std::size_t count = clusters.size();
    for (std::size_t c = 0; c < count; ++c) {
      first[c] = c > 0 && clusters[c].object == clusters[c - 1].object ? first[c - 1] : c;
    }
    for (std::size_t c = count; c-- > 0;) {
      last[c] = c + 1 < count && first[c + 1] == first[c] ? last[c + 1] : c + 1;
    }
    for (std::size_t c = 0; c < count; ++c) {
      const bool many = last[c] - first[c] > kMostMeans;
      stays[c] = clusters[c].planar || many ? 1 : 0;
      tooMany += !clusters[c].planar && many ? 1 : 0;
      const float away = glm::length(clusters[first[c]].centroid);
      if (stays[c] == 0) rays[c].perMetre = away > 0.0f ? 1.0f / away : 1.0f;
    }
  }

  bool leftOut(std::size_t c) const { return stays[c] == 0 && rays[c].perMetre == 0.0f; }

  /// Calls body(number of the nearest mean, k) for each sample of a run, or of its own when `bins`.
  template <class Body>
  void forSamples(const SampleBlock& block, const SampleRun& run, bool bins, Body&& body) const {
    const std::size_t own = block.slots[run.slot];
    for (std::size_t k = 0; k < run.count; k += kLanes) {
      const std::size_t there = std::min<std::size_t>(kLanes, run.count - k);
      Mask4 nearest{};
      if (!bins && stays[own] == 0) {
        nearest = nearestMeans(rays, first[own], last[own], static_cast<std::int32_t>(own),
                               block.direction.load(run.first + k, there),
                               block.position.load(run.first + k, there));
      }
      for (std::size_t i = 0; i < there; ++i) {
        body(bins || stays[own] != 0 ? own : static_cast<std::size_t>(nearest[i]), k + i);
      }
    }
  }
};

/// Sums over the samples that are nearest to each mean, or of each bin.
std::vector<MeanSums> sumUp(const Means& means, const std::vector<SampleBlock>& blocks, bool bins) {
  const std::size_t count = means.rays.size();
  std::vector<MeanSums> sums(count);
  std::mutex mutex;
  parallelFor(blocks.size(), 1, [&](std::size_t begin, std::size_t end) {
    std::vector<MeanSums> mine(count);
    for (std::size_t b = begin; b < end; ++b) {
      for (const SampleRun& run : blocks[b].runs) {
        means.forSamples(blocks[b], run, bins, [&](std::size_t mean, std::size_t k) {
          const Vec3 direction = kMeansUnit * blocks[b].direction[run.first + k];
          const Vec3 origin =
              kMeansUnit * means.rays[mean].perMetre * blocks[b].position[run.first + k];
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
}

/// Means of the bins, then of what is nearest to the last means; those of fewer than `minSamples`
/// are left out.
void findMeans(const std::vector<SampleBlock>& blocks, int minSamples, Means& means) {
  const std::size_t count = means.rays.size();
  for (int step = 0; step <= kMeansSteps; ++step) {
    const std::vector<MeanSums> sums = sumUp(means, blocks, step == 0);
    for (std::size_t c = 0; c < count; ++c) {
      if (sums[c].samples == 0) continue;
      const double unit = 1.0 / (static_cast<double>(sums[c].samples) * double{kMeansUnit});
      for (int axis = 0; axis < 3; ++axis) {
        means.rays[c].direction[axis] =
            static_cast<float>(static_cast<double>(sums[c].values[axis]) * unit);
        means.rays[c].origin[axis] =
            static_cast<float>(static_cast<double>(sums[c].values[axis + 3]) * unit);
      }
    }
  }
  for (bool again = true; again;) {
    again = false;
    const std::vector<MeanSums> sums = sumUp(means, blocks, false);
    for (std::size_t c = 0; c < count; ++c) {
      if (means.rays[c].perMetre > 0.0f && sums[c].samples < minSamples) {
        means.rays[c].perMetre = 0.0f;
        again = true;
      }
    }
  }
}

/// The clusters whose means are not left out.
struct Kept {
  std::vector<Cluster> clusters;
  std::vector<std::uint16_t> numberOf;  ///< by cluster before
  std::vector<Vec3> anchors;
};

Kept keep(const Means& means, const std::vector<Cluster>& clusters) {
  Kept kept;
  kept.numberOf.assign(clusters.size(), 0);
  for (std::size_t c = 0; c < clusters.size(); ++c) {
    if (means.leftOut(c)) continue;
    kept.numberOf[c] = static_cast<std::uint16_t>(kept.clusters.size());
    kept.anchors.push_back(clusters[c].centroid);
    kept.clusters.push_back(clusters[c]);
  }
  return kept;
}

/// Deals the samples of block b out to the nearest means: sums over each cluster's, by slot.
std::vector<Sums> dealBlock(std::size_t b, std::size_t width, const Means& means, const Kept& kept,
                            const std::vector<Cluster>& clusters, SampleBlock& block,
                            std::vector<std::uint16_t>& clusterOf) {
  std::vector<Sums> sums;
  std::vector<SampleRun> runs;
  std::vector<std::uint32_t> rows;
  std::vector<std::uint16_t> slots;
  std::vector<std::uint32_t> slotOf(kept.clusters.size(), kNoCluster);
  // What has no runs has its number alone
  for (std::size_t at = b * Clustering::kRows * width;
       at < std::min((b + 1) * Clustering::kRows * width, clusterOf.size()); ++at) {
    if (clusterOf[at] >= 2 && clusterOf[at] != Clustering::kRetraced &&
        clusters[clusterOf[at] - 2u].planar) {
      clusterOf[at] = static_cast<std::uint16_t>(kept.numberOf[clusterOf[at] - 2u] + 2);
    }
  }
  for (std::size_t row = 0; row + 1 < block.rows.size(); ++row) {
    rows.push_back(static_cast<std::uint32_t>(runs.size()));
    const std::size_t y = b * Clustering::kRows + row;
    for (std::size_t r = block.rows[row]; r < block.rows[row + 1]; ++r) {
      const SampleRun& run = block.runs[r];
      means.forSamples(block, run, false, [&](std::size_t mean, std::size_t k) {
        const std::uint16_t number = kept.numberOf[mean];
        if (slotOf[number] == kNoCluster) {
          slotOf[number] = static_cast<std::uint32_t>(slots.size());
          slots.push_back(number);
          sums.emplace_back();
        }
        clusterOf[y * width + run.x + k] = static_cast<std::uint16_t>(number + 2);
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
      sums[runs[r].slot].add(block.position, block.normal, runs[r], static_cast<int>(y),
                             kept.anchors[slots[runs[r].slot]]);
    }
  }
  rows.push_back(static_cast<std::uint32_t>(runs.size()));
  block.runs = std::move(runs);
  block.rows = std::move(rows);
  block.slots = std::move(slots);
  return sums;
}

}  // namespace

std::size_t moveToNearestMeans(std::size_t width, int minSamples, std::vector<Cluster>& clusters,
                               std::vector<SampleBlock>& blocks,
                               std::vector<std::uint16_t>& clusterOf) {
  Means means(clusters);
  findMeans(blocks, minSamples, means);
  Kept kept = keep(means, clusters);
  std::vector<std::vector<Sums>> sums(blocks.size());
  parallelFor(blocks.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t b = begin; b < end; ++b) {
      sums[b] = dealBlock(b, width, means, kept, clusters, blocks[b], clusterOf);
    }
  });
  std::vector<Sums> all(kept.clusters.size());
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    for (std::size_t s = 0; s < sums[b].size(); ++s) all[blocks[b].slots[s]].add(sums[b][s]);
  }
  for (std::size_t c = 0; c < kept.clusters.size(); ++c) {
    if (kept.clusters[c].planar) continue;
    // Samples were dealt out anew: any may have the object's largest
    for (const Cluster& other : clusters) {
      if (other.object == kept.clusters[c].object && !other.planar)
        all[c].lobe = std::max(all[c].lobe, other.widestLobe.code);
    }
    describe(all[c], kept.anchors[c], kept.clusters[c]);
  }
  clusters = std::move(kept.clusters);
  return means.tooMany;
}

}  // namespace catoptric::methods::second_order
