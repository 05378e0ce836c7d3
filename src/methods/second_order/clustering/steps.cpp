#include "methods/second_order/clustering/steps.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>

#include "core/parallel.h"
#include "methods/second_order/clustering/clusters.h"
#include "methods/second_order/clustering/sums.h"

namespace catoptric::methods::second_order {
namespace {

constexpr std::uint32_t kNoPart = 0xFFFFFFFFu;
constexpr std::uint32_t kLooked = 256;  ///< about so many samples say where the steps are
constexpr std::size_t kHeights = 64;    ///< of them, evenly spread
constexpr std::size_t kMostSteps = 4;   ///< of a cluster
constexpr double kLeastShare = 0.05;    ///< of a cluster's samples in each of its steps
/// A division leaves less than this share of what it would leave of an even slope's variance.
constexpr double kOfSlope = 0.45;

/// Heights at which a cluster is divided, ascending.
struct Steps {
  std::array<float, kMostSteps - 1> above{};
  std::size_t count = 0;

  std::size_t of(float height) const {
    std::size_t step = 0;
    while (step < count && height > above[step]) ++step;
    return step;
  }
};

/// The fewest steps of sorted heights, of at least `least` each, that say that they are no slope.
Steps findSteps(std::span<const float> heights, std::size_t least) {
  Steps steps;
  const std::size_t n = heights.size();
  if (n < 2 * least || n > kHeights) return steps;
  std::array<double, kHeights + 1> sums{};
  std::array<double, kHeights + 1> squares{};
  for (std::size_t i = 0; i < n; ++i) {
    const double height = heights[i] - heights[0];
    sums[i + 1] = sums[i] + height;
    squares[i + 1] = squares[i] + height * height;
  }
  const auto variance = [&](std::size_t i, std::size_t j) {
    const double sum = sums[j] - sums[i];
    return squares[j] - squares[i] - sum * sum / static_cast<double>(j - i);
  };
  // Least variance of the first j heights in k + 1 steps, and where the last one begins
  std::array<std::array<double, kHeights + 1>, kMostSteps> left{};
  std::array<std::array<std::size_t, kHeights + 1>, kMostSteps> begin{};
  for (std::size_t j = least; j <= n; ++j) left[0][j] = variance(0, j);
  for (std::size_t k = 1; k < kMostSteps && (k + 1) * least <= n; ++k) {
    for (std::size_t j = (k + 1) * least; j <= n; ++j) {
      left[k][j] = std::numeric_limits<double>::infinity();
      for (std::size_t i = k * least; i + least <= j; ++i) {
        const double all = left[k - 1][i] + variance(i, j);
        if (all < left[k][j]) {
          left[k][j] = all;
          begin[k][j] = i;
        }
      }
    }
  }
  // A slope in k + 1 steps leaves 1 / (k + 1)^2
  double best = kOfSlope * left[0][n];
  for (std::size_t k = 1; k < kMostSteps && (k + 1) * least <= n; ++k) {
    const double ofSlope = static_cast<double>((k + 1) * (k + 1)) * left[k][n];
    if (ofSlope < best) {
      best = ofSlope;
      steps.count = k;
    }
  }
  for (std::size_t k = steps.count, j = n; k > 0; --k) {
    j = begin[k][j];
    steps.above[k - 1] = 0.5f * (heights[j - 1] + heights[j]);
  }
  return steps;
}

float heightOf(const Cluster& cluster, const Vec3& position) {
  return glm::dot(position - cluster.centroid, cluster.meanNormal);
}

/// Heights of some samples of each cluster that is not planar, evenly spread over its samples.
std::vector<std::vector<float>> lookAtHeights(const std::vector<Cluster>& clusters,
                                              const std::vector<SampleBlock>& blocks) {
  struct Looked {
    std::uint32_t every = 1;  ///< so many samples, one is looked at
    std::uint32_t next = 0;   ///< samples until then
  };
  std::vector<Looked> looked(clusters.size());
  std::vector<std::vector<float>> heights(clusters.size());
  for (std::size_t c = 0; c < clusters.size(); ++c) {
    looked[c].every = std::max(1u, clusters[c].samples / kLooked);
  }
  for (const SampleBlock& block : blocks) {
    for (const SampleRun& run : block.runs) {
      const std::size_t c = block.slots[run.slot];
      Looked& of = looked[c];
      if (clusters[c].planar) continue;
      std::uint32_t i = of.next;
      for (; i < run.count; i += of.every) {
        heights[c].push_back(heightOf(clusters[c], block.position[run.first + i]));
      }
      of.next = i - run.count;
    }
  }
  return heights;
}

/// Where clusters are divided, and the numbers of what is divided off.
struct Division {
  std::vector<Steps> steps;        ///< by cluster
  std::vector<std::size_t> first;  ///< by cluster: of the new ones, less 1
  std::size_t made = 0;

  std::size_t numberOf(std::size_t c, std::size_t step) const {
    return step == 0 ? c : first[c] + step;
  }
};

Division divisionOf(const std::vector<Cluster>& clusters, std::vector<std::vector<float>> heightsOf,
                    int minSamples) {
  const std::size_t count = clusters.size();
  Division division;
  division.steps.resize(count);
  parallelFor(count, 8, [&](std::size_t begin, std::size_t end) {
    for (std::size_t c = begin; c < end; ++c) {
      std::vector<float>& heights = heightsOf[c];
      if (heights.empty()) continue;
      std::ranges::sort(heights);
      const std::size_t n = std::min(heights.size(), kHeights);
      for (std::size_t i = 0; i < n; ++i) {
        heights[i] = heights[(2 * i + 1) * heights.size() / (2 * n)];
      }
      heights.resize(n);
      const double share =
          std::max(kLeastShare, static_cast<double>(minSamples) / clusters[c].samples);
      division.steps[c] =
          findSteps(heights, static_cast<std::size_t>(std::ceil(share * static_cast<double>(n))));
    }
  });
  division.first.assign(count, 0);
  for (std::size_t c = 0; c < count; ++c) {
    Steps& steps = division.steps[c];
    if (count + division.made + steps.count > Clustering::kMostClusters) steps.count = 0;
    division.first[c] = count + division.made - 1;
    division.made += steps.count;
  }
  return division;
}

/// Deals the runs of block b out to the steps of their clusters: sums over the samples of each
/// divided cluster's part, by slot. Empty where no cluster of the block is divided.
std::vector<Sums> divideBlock(std::size_t b, std::size_t width, std::size_t undivided,
                              const Division& division, const std::vector<Cluster>& clusters,
                              SampleBlock& block, std::vector<std::uint16_t>& clusterOf) {
  std::vector<Sums> sums;
  const std::vector<Steps>& steps = division.steps;
  if (std::ranges::none_of(block.slots, [&](std::uint16_t c) { return steps[c].count > 0; })) {
    return sums;
  }
  std::vector<SampleRun> runs;
  std::vector<std::uint32_t> rows;
  sums.resize(block.slots.size());
  std::vector<std::uint32_t> slotOf(division.made, kNoPart);
  for (std::size_t row = 0; row + 1 < block.rows.size(); ++row) {
    rows.push_back(static_cast<std::uint32_t>(runs.size()));
    const std::size_t y = b * Clustering::kRows + row;
    for (std::size_t r = block.rows[row]; r < block.rows[row + 1]; ++r) {
      const SampleRun run = block.runs[r];
      const std::size_t c = block.slots[run.slot];
      if (steps[c].count == 0) {
        runs.push_back(run);
        continue;
      }
      const auto stepAt = [&](std::uint32_t k) {
        return steps[c].of(heightOf(clusters[c], block.position[run.first + k]));
      };
      for (std::uint32_t k = 0; k < run.count;) {
        const std::size_t step = stepAt(k);
        std::uint32_t last = k + 1;
        while (last < run.count && stepAt(last) == step) ++last;
        std::uint32_t slot = run.slot;
        if (step > 0) {
          const std::size_t number = division.numberOf(c, step);
          std::uint32_t& known = slotOf[number - undivided];
          if (known == kNoPart) {
            known = static_cast<std::uint32_t>(block.slots.size());
            block.slots.push_back(static_cast<std::uint16_t>(number));
            sums.emplace_back();
          }
          slot = known;
          std::fill_n(clusterOf.begin() + static_cast<std::ptrdiff_t>(y * width + run.x + k),
                      last - k, static_cast<std::uint16_t>(number + 2));
        }
        const SampleRun part{run.first + k, slot, static_cast<std::uint16_t>(run.x + k),
                             static_cast<std::uint16_t>(last - k)};
        runs.push_back(part);
        sums[slot].add(block.position, block.normal, part, static_cast<int>(y),
                       clusters[c].centroid);
        k = last;
      }
    }
  }
  rows.push_back(static_cast<std::uint32_t>(runs.size()));
  block.runs = std::move(runs);
  block.rows = std::move(rows);
  return sums;
}

}  // namespace

void divideAtSteps(std::size_t width, int minSamples, std::vector<Cluster>& clusters,
                   std::vector<SampleBlock>& blocks, std::vector<std::uint16_t>& clusterOf) {
  const std::size_t count = clusters.size();
  const Division division = divisionOf(clusters, lookAtHeights(clusters, blocks), minSamples);
  if (division.made == 0) return;

  clusters.resize(count + division.made);
  for (std::size_t c = 0; c < count; ++c) {
    for (std::size_t k = 1; k <= division.steps[c].count; ++k) {
      clusters[division.numberOf(c, k)] = clusters[c];
    }
  }
  std::vector<std::vector<Sums>> sums(blocks.size());
  parallelFor(blocks.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t b = begin; b < end; ++b) {
      sums[b] = divideBlock(b, width, count, division, clusters, blocks[b], clusterOf);
    }
  });
  std::vector<Sums> all(clusters.size());
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    for (std::size_t s = 0; s < sums[b].size(); ++s) all[blocks[b].slots[s]].add(sums[b][s]);
  }
  for (std::size_t c = 0; c < count; ++c) {
    if (division.steps[c].count == 0) continue;
    const Vec3 anchor = clusters[c].centroid;
    const float lobe = clusters[c].widestLobe.code;
    for (std::size_t k = 0; k <= division.steps[c].count; ++k) {
      const std::size_t number = division.numberOf(c, k);
      all[number].lobe = lobe;
      describe(all[number], anchor, clusters[number]);
    }
  }
}

}  // namespace catoptric::methods::second_order
