#include "methods/glossy_lod/images/outline.h"

#include <algorithm>
#include <map>
#include <unordered_map>
#include <utility>

namespace catoptric::methods::glossy_lod {
namespace {

/// The sides of a chart's triangles that are its border, as one loop; empty if they are none.
std::vector<std::size_t> borderLoop(const Topology& topology,
                                    const std::vector<std::int32_t>& chartOf, const Chart& chart) {
  std::unordered_map<std::uint32_t, std::size_t> sideFrom;
  std::size_t sides = 0;
  std::size_t first = 0;
  for (const std::uint32_t t : chart.triangles) {
    for (std::size_t c = 3 * std::size_t{t}; c < 3 * std::size_t{t} + 3; ++c) {
      const std::int32_t other = topology.across[c];
      if (other != kNobody && chartOf[static_cast<std::size_t>(other) / 3] == chartOf[t]) continue;
      if (!sideFrom.try_emplace(topology.vertex[c], c).second) return {};
      if (sides++ == 0) first = c;
    }
  }
  std::vector<std::size_t> loop;
  if (sides == 0) return loop;
  std::size_t at = first;
  do {
    loop.push_back(at);
    const auto next = sideFrom.find(topology.vertex[nextCorner(at)]);
    if (next == sideFrom.end() || loop.size() > sides) return {};
    at = next->second;
  } while (at != first);
  if (loop.size() != sides) loop.clear();
  return loop;
}

/// Which charts have an edge as their border, and at which vertices arcs end.
class Meetings {
 public:
  Meetings(const Topology& topology, const std::vector<std::int32_t>& chartOf,
           const std::vector<std::vector<std::size_t>>& loops,
           const std::vector<std::uint32_t>& ends)
      : topology_(topology), chartsAt_(topology.edges) {
    for (const auto& loop : loops)
      for (const std::size_t side : loop)
        chartsAt_[topology.edge[side]].push_back(chartOf[side / 3]);
    for (auto& charts : chartsAt_) std::sort(charts.begin(), charts.end());
    std::unordered_map<std::uint32_t, std::vector<std::uint32_t>> edgesAt;
    for (const auto& loop : loops)
      for (const std::size_t side : loop)
        for (const std::size_t c : {side, nextCorner(side)}) {
          auto& edges = edgesAt[topology.vertex[c]];
          if (std::find(edges.begin(), edges.end(), topology.edge[side]) == edges.end())
            edges.push_back(topology.edge[side]);
        }
    for (const auto& [vertex, edges] : edgesAt)
      ends_[vertex] = edges.size() != 2 || chartsAt_[edges[0]] != chartsAt_[edges[1]];
    for (const std::uint32_t vertex : ends) ends_[vertex] = true;
    // Where two charts meet along a closed loop it ends at its least vertex.
    for (const auto& loop : loops) {
      std::uint32_t least = ~0u;
      bool any = false;
      for (const std::size_t side : loop) {
        any = any || endsAt(side);
        least = std::min(least, topology.vertex[side]);
      }
      if (!any && !loop.empty()) ends_[least] = true;
    }
  }

  bool endsAt(std::size_t corner) const { return ends_.at(topology_.vertex[corner]); }

 private:
  const Topology& topology_;
  std::vector<std::vector<std::int32_t>> chartsAt_;
  std::unordered_map<std::uint32_t, bool> ends_;
};

/// Gives every arc a number, in whichever direction it is passed.
class ArcNumbers {
 public:
  explicit ArcNumbers(std::vector<Arc>& arcs) : arcs_(arcs) {}

  ArcUse use(std::vector<std::uint32_t> vertices) {
    const std::pair ahead{vertices.front(), vertices[1]};
    const std::pair back{vertices.back(), vertices[vertices.size() - 2]};
    const bool forward = ahead <= back;
    if (!forward) std::reverse(vertices.begin(), vertices.end());
    const auto [known, isNew] =
        numbers_.try_emplace(std::min(ahead, back), static_cast<std::uint32_t>(arcs_.size()));
    if (isNew) arcs_.push_back({std::move(vertices)});
    return {known->second, forward};
  }

 private:
  std::vector<Arc>& arcs_;
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> numbers_;
};

}  // namespace

Outlines findOutlines(const Topology& topology, const std::vector<std::int32_t>& chartOf,
                      std::int32_t charts, const std::vector<std::uint32_t>& ends) {
  Outlines outlines;
  outlines.charts.resize(static_cast<std::size_t>(charts));
  for (std::size_t t = 0; t < chartOf.size(); ++t)
    if (chartOf[t] != kNobody)
      outlines.charts[static_cast<std::size_t>(chartOf[t])].triangles.push_back(
          static_cast<std::uint32_t>(t));
  std::vector<std::vector<std::size_t>> loops;
  for (Chart& chart : outlines.charts) {
    loops.push_back(borderLoop(topology, chartOf, chart));
    chart.simple = !loops.back().empty();
  }
  const Meetings meetings(topology, chartOf, loops, ends);
  ArcNumbers numbers(outlines.arcs);
  for (std::size_t i = 0; i < loops.size(); ++i) {
    std::vector<std::size_t>& loop = loops[i];
    if (loop.empty()) continue;
    const auto start = std::find_if(loop.begin(), loop.end(),
                                    [&](std::size_t side) { return meetings.endsAt(side); });
    std::rotate(loop.begin(), start, loop.end());
    std::vector<std::uint32_t> vertices;
    for (const std::size_t side : loop) {
      vertices.push_back(topology.vertex[side]);
      const std::size_t next = nextCorner(side);
      if (!meetings.endsAt(next)) continue;
      vertices.push_back(topology.vertex[next]);
      outlines.charts[i].border.push_back(numbers.use(std::move(vertices)));
      vertices = {};
    }
  }
  return outlines;
}

}  // namespace catoptric::methods::glossy_lod
