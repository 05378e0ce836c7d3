#include "methods/second_order/cameras/window.h"

#include <algorithm>
#include <cmath>

#include "core/parallel.h"

namespace catoptric::methods::second_order {
namespace {

/// Half the frame's largest width on the plane 1 m before the eye: 80 degrees. Ours.
constexpr float kWidestTangent = 5.6f;
/// Least cosine between the clip plane's normal and a reflected ray. Ours.
constexpr float kClipCosine = 0.02f;

/// Where rays from inside leave a box, in units of their directions.
Floats4 boxExit(const Box3& box, const Lanes3& from, const Lanes3& direction) {
  Floats4 exit = floats4(std::numeric_limits<float>::infinity());
  const auto slab = [&](const Floats4& at, const Floats4& along, float low, float high) {
    const Floats4 wall = along > 0.0f ? floats4(high) : floats4(low);
    exit = along == 0.0f ? exit : least((wall - at) / along, exit);
  };
  slab(from.x, direction.x, box.min.x, box.max.x);
  slab(from.y, direction.y, box.min.y, box.max.y);
  slab(from.z, direction.z, box.min.z, box.max.z);
  return most(exit, Floats4{});
}

Floats4 withinFrame(const Floats4& tangent) {
  return most(least(tangent, floats4(kWidestTangent)), floats4(-kWidestTangent));
}

/// SampleTangents of sums of two angles, each given by its tangent, within the frame's largest.
Floats4 turned(const Floats4& tangent, const Floats4& by) {
  const Floats4 below = 1.0f - tangent * by;
  const Floats4 widest = by < 0.0f ? floats4(-kWidestTangent) : floats4(kWidestTangent);
  return below > 0.0f ? withinFrame((tangent + by) / below) : widest;
}

/// What image planes show of samples: tangents of the angles to the camera's axis.
struct SampleTangents {
  std::vector<float> x, y;
};

/// The part of one run in its cluster's window, but for the spacing; `tangents` of its samples are
/// set.
ClusterWindow windowOf(const SampleBlock& block, const SampleRun& run, const Cluster& cluster,
                       const ClusterFrame& frame, const Vec3& eye, const Box3& bounds,
                       SampleTangents& tangents) {
  constexpr std::size_t kTilts = kClipTilts.size();
  const float infinite = std::numeric_limits<float>::infinity();
  LanesRect rect;
  Floats4 nearest = floats4(infinite);
  Floats4 farthest{};
  std::array<Floats4, kTilts> lowest;
  std::array<Floats4, kTilts> highest{};
  std::array<Mask4, kTilts> passing{};
  lowest.fill(floats4(infinite));
  Floats4 lobeShare{};
  Floats4 walks{};
  const float lobeTangent = std::tan(frame.lobe);
  for (std::size_t k = 0; k < run.count; k += kLanes) {
    const std::size_t there = run.count - k;
    const Lanes3 position = block.position.load(run.first + k, there);
    const Lanes3 direction = block.direction.load(run.first + k, there);
    const Lanes3 fromEye = minus(position, eye);
    const Floats4 z = dot(fromEye, frame.axis);
    const Lanes3 ray{dot(direction, frame.right), dot(direction, frame.down),
                     dot(direction, frame.axis)};
    const Lanes2 across{dot(fromEye, frame.right), dot(fromEye, frame.down)};
    const Lanes2 tangent{across.x / z, across.y / z};
    store(tangent.x, &tangents.x[run.first + k], there);
    store(tangent.y, &tangents.y[run.first + k], there);
    rect.extend(tangent);
    nearest = least(z, nearest);
    farthest = most(z, farthest);
    const Floats4 height = dot(fromEye, cluster.planeNormal);
    const Floats4 rise = dot(direction, cluster.planeNormal);
    for (std::size_t i = 0; i < kTilts; ++i) {
      lowest[i] = least(lowest[i], height + kClipTilts[i] * z);
      highest[i] = most(highest[i], height + kClipTilts[i] * z);
      passing[i] -=
          (rise + kClipTilts[i] * ray.z <= kClipCosine * frame.tiltLength[i]) & valid(there);
    }

    // The far end: where the ray leaves the scene, not farther to the side than the frame may
    // reach
    Floats4 t = boxExit(bounds, position, direction);
    t = ray.z < 0.0f ? least(t, -0.75f * z / ray.z) : t;
    const Lanes3 end{across.x + t * ray.x, across.y + t * ray.y, z + t * ray.z};
    const Lanes2 far{end.x / end.z, end.y / end.z};
    if (frame.lobe > 0.0f) {
      // The lobe's width at the far end, seen from the eye: an eye far behind sees little of it
      const Floats4 share = least(floats4(4.0f), t / most(root(dot(end, end)), floats4(1e-30f)));
      lobeShare += valid(there) ? share : Floats4{};
      const Floats4 wider = share * lobeTangent;
      rect.extend({turned(far.x, -wider), turned(far.y, -wider)});
      rect.extend({turned(far.x, wider), turned(far.y, wider)});
    }
    const Lanes2 leaves{withinFrame(far.x), withinFrame(far.y)};
    rect.extend(leaves);
    const Floats4 walkX = leaves.x - withinFrame(tangent.x);
    const Floats4 walkY = leaves.y - withinFrame(tangent.y);
    walks += valid(there) ? root(walkX * walkX + walkY * walkY) : Floats4{};
  }
  ClusterWindow w;
  w.rect = rect.all();
  w.nearest = leastOf(nearest);
  w.farthest = mostOf(farthest);
  w.walks = static_cast<double>(sumOf(walks));
  w.lobeShare = static_cast<double>(sumOf(lobeShare));
  for (std::size_t i = 0; i < kTilts; ++i) {
    w.lowest[i] = leastOf(lowest[i]);
    w.highest[i] = mostOf(highest[i]);
    w.passing[i] =
        static_cast<std::uint32_t>(passing[i][0] + passing[i][1] + passing[i][2] + passing[i][3]);
  }
  return w;
}

/// Sum of the distances of `count` pairs of neighbours, from samples i and j on.
double spacing(const SampleTangents& tangents, std::size_t i, std::size_t j, std::size_t count) {
  Floats4 sum{};
  for (std::size_t k = 0; k < count; k += kLanes) {
    const auto across = [&](const std::vector<float>& values) {
      return load(&values[i + k], count - k) - load(&values[j + k], count - k);
    };
    const Floats4 x = across(tangents.x);
    const Floats4 y = across(tangents.y);
    sum += valid(count - k) ? root(x * x + y * y) : Floats4{};
  }
  return static_cast<double>(sumOf(sum));
}

/// Adds the spacing of a block's samples to the windows of its slots: pairs of neighbours in a row,
/// and in a column.
void addSpacing(const SampleBlock& block, std::span<const std::uint8_t> curved,
                const SampleTangents& tangents, std::span<ClusterWindow> windows) {
  for (std::size_t row = 0; row + 1 < block.rows.size(); ++row) {
    std::size_t above = row > 0 ? block.rows[row - 1] : block.rows[row];
    for (std::size_t r = block.rows[row]; r < block.rows[row + 1]; ++r) {
      const SampleRun& run = block.runs[r];
      if (curved[block.slots[run.slot]] == 0) continue;
      ClusterWindow& w = windows[run.slot];
      const int last = run.x + run.count;
      w.spacing += spacing(tangents, run.first, run.first + 1, run.count - 1u);
      w.pairs += run.count - 1u;
      while (above < block.rows[row] && block.runs[above].x + block.runs[above].count <= run.x) {
        ++above;
      }
      for (std::size_t q = above; q < block.rows[row] && block.runs[q].x < last; ++q) {
        const SampleRun& other = block.runs[q];
        if (other.slot != run.slot) continue;
        const int from = std::max(run.x, other.x);
        const int to = std::min(last, other.x + other.count);
        w.spacing += spacing(tangents, run.first + static_cast<std::uint32_t>(from - run.x),
                             other.first + static_cast<std::uint32_t>(from - other.x),
                             static_cast<std::size_t>(to - from));
        w.pairs += static_cast<std::uint64_t>(to - from);
      }
    }
  }
}

}  // namespace

std::vector<ClusterWindow> findWindows(const Clustering& clustering,
                                       std::span<const std::uint8_t> curved,
                                       std::span<const ClusterFrame> frames,
                                       std::span<const ClusterCamera> cameras,
                                       const Box3& sceneBounds) {
  const std::vector<Cluster>& clusters = clustering.clusters();
  const std::span<const SampleBlock> blocks = clustering.blocks();
  std::vector<std::vector<ClusterWindow>> windows(blocks.size());
  parallelFor(blocks.size(), 1, [&](std::size_t begin, std::size_t end) {
    SampleTangents tangents;
    for (std::size_t b = begin; b < end; ++b) {
      const SampleBlock& block = blocks[b];
      windows[b].resize(block.slots.size());
      tangents.x.resize(block.position.x.size());
      tangents.y.resize(block.position.x.size());
      for (const SampleRun& run : block.runs) {
        const std::size_t c = block.slots[run.slot];
        if (curved[c] == 0) continue;
        windows[b][run.slot].add(
            windowOf(block, run, clusters[c], frames[c], cameras[c].eye, sceneBounds, tangents));
      }
      addSpacing(block, curved, tangents, windows[b]);
    }
  });
  std::vector<ClusterWindow> all(clusters.size());
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    for (std::size_t s = 0; s < windows[b].size(); ++s) {
      all[blocks[b].slots[s]].add(windows[b][s]);
    }
  }
  return all;
}

}  // namespace catoptric::methods::second_order
