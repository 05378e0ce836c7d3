// Looks up where the places of an object show, and looks for what their neighbours have.
#include <algorithm>
#include <mutex>

#include "core/parallel.h"
#include "methods/perturbation/refinement.h"

namespace catoptric::methods::perturbation {
namespace {

/// Over how many edges reflections are looked for in a round of halvings (ours).
constexpr int kSpreadRounds = 2;

}  // namespace

void Refinement::lookUp(std::size_t first, std::span<const Edge> edges,
                        std::span<const Look> looks) {
  std::mutex mutex;
  parallelFor(table_.places.size() - first, 64, [&](std::size_t begin, std::size_t end) {
    TriangleCounts own;
    RayOctree::Cursor cursor;
    RayOctree::Cursor cursorBefore;
    Reflector::Traced traced;
    Reflector::Traced tracedBefore;
    for (std::size_t i = begin; i < end; ++i) {
      VertexPlace& place = table_.places[first + i];
      if (first == 0) {
        place.position = glm::dvec3(table_.meshPosition(i));
        place.reflections.count = 0;
        place.straight.reset();
      }
      const bool blind = !edges.empty() && looks[i] == Look::Blind;
      if (blind)
        place.reflections =
            reflector_.reflectionsOf(place.position, own_, cursor, own.paths, &traced);
      if (!edges.empty() && exactMiddles_) {
        const Reflections guess =
            between(table_.places[edges[i].a].reflections, table_.places[edges[i].b].reflections);
        reflector_.addReflectionsNear(place.position, guess, place.reflections, own.paths, &traced);
      }
      if (place.reflections.count == 0 && !blind)
        place.reflections =
            reflector_.reflectionsOf(place.position, own_, cursor, own.paths, &traced);
      if (place.reflections.count == 0) {
        const auto straight =
            reflector_.hidden(place.position, cursorBefore, own.paths, &tracedBefore);
        if (straight) place.straight = std::make_unique<Reflection>(*straight);
      }
      table_.project(first + i);
    }
    if (options_.lookedUp) options_.lookedUp(end - begin);
    const std::lock_guard lock(mutex);
    counts_.add(own);
  });
}

Reflections Refinement::unmatched(const Reflections& a, const Reflections& b) const {
  Reflections rest;
  for (std::size_t i = 0; i < a.count; ++i) {
    const std::size_t j = counterpart(a, i, b);
    if (j != kMaxReflections) {
      const auto xa = table_.projection(a.at[i].x);
      const auto xb = table_.projection(b.at[j].x);
      if (!xa || !xb || glm::distance(*xa, *xb) < kTornEdge) continue;
    }
    rest.at[rest.count++] = a.at[i];
  }
  return rest;
}

bool Refinement::stretched(const Edge& edge) const {
  const float apart =
      glm::distance(table_.glimpses[edge.a].seen[0], table_.glimpses[edge.b].seen[0]);
  return apart > kTornEdge &&
         apart > kStretch * table_.apparent(table_.places[edge.a], table_.places[edge.b]);
}

void Refinement::relate(const std::vector<Edge>& edges, bool first,
                        std::vector<std::uint8_t>& states) const {
  parallelFor(edges.size(), kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const auto [a, b] = edges[i];
      const bool tried = !changed_[a] && !changed_[b];
      if (tried && !first) {
        states[i] &= kInOrder;
        continue;
      }
      const VertexPlace& pa = table_.places[a];
      const VertexPlace& pb = table_.places[b];
      // Most have one reflection at both ends
      if (table_.glimpses[a].count == 1 && table_.glimpses[b].count == 1) {
        states[i] = !exactMiddles_ || !stretched(edges[i]) ? kInOrder
                    : tried                                ? 0
                                                           : kFirstLacks | kSecondLacks;
        continue;
      }
      states[i] = inOrder(pa.reflections, pb.reflections) ? kInOrder : 0;
      if (states[i] != 0 || tried || !exactMiddles_ || pa.straight || pb.straight) continue;
      // Those that belong together do so both ways
      const bool lacksOne = lacks(pa.reflections, pb.reflections);
      if (lacksOne) states[i] |= kFirstLacks;
      if (!lacksOne && pa.reflections.count == pb.reflections.count) continue;
      if (lacks(pb.reflections, pa.reflections)) states[i] |= kSecondLacks;
    }
  });
}

std::vector<std::uint8_t> Refinement::spread(const std::vector<Edge>& edges) {
  changed_.resize(table_.places.size(), true);
  std::vector<std::uint8_t> states(edges.size());
  for (int round = 0;; ++round) {
    relate(edges, round == 0, states);
    if (round == kSpreadRounds || !exactMiddles_) return states;
    std::vector<std::pair<std::uint32_t, std::uint32_t>> wanted;  // place, neighbour
    for (std::size_t i = 0; i < edges.size(); ++i) {
      const auto [a, b] = edges[i];
      if ((states[i] & kFirstLacks) != 0) wanted.emplace_back(a, b);
      if ((states[i] & kSecondLacks) != 0) wanted.emplace_back(b, a);
    }
    std::sort(wanted.begin(), wanted.end());
    std::vector<std::size_t> firsts;  // of each place's neighbours
    for (std::size_t i = 0; i < wanted.size(); ++i) {
      if (i == 0 || wanted[i].first != wanted[i - 1].first) firsts.push_back(i);
    }
    std::vector<Reflections> found(firsts.size());
    std::mutex mutex;
    parallelFor(firsts.size(), 32, [&](std::size_t begin, std::size_t end) {
      TriangleCounts own;
      for (std::size_t k = begin; k < end; ++k) {
        const VertexPlace& place = table_.places[wanted[firsts[k]].first];
        const std::size_t last = k + 1 < firsts.size() ? firsts[k + 1] : wanted.size();
        found[k] = place.reflections;
        for (std::size_t i = firsts[k]; i < last; ++i) {
          const Reflections more = unmatched(table_.places[wanted[i].second].reflections, found[k]);
          reflector_.addReflectionsNear(place.position, more, found[k], own.paths);
        }
      }
      const std::lock_guard lock(mutex);
      counts_.add(own);
    });
    std::fill(changed_.begin(), changed_.end(), false);
    bool any = false;
    for (std::size_t k = 0; k < firsts.size(); ++k) {
      const std::uint32_t number = wanted[firsts[k]].first;
      if (found[k].count == table_.places[number].reflections.count) continue;
      table_.places[number].reflections = std::move(found[k]);
      table_.project(number);
      changed_[number] = true;
      any = true;
    }
    if (!any) return states;
  }
}

}  // namespace catoptric::methods::perturbation
