#include "methods/perturbation/refinement.h"

#include <algorithm>
#include <cmath>

#include "core/parallel.h"

namespace catoptric::methods::perturbation {
namespace {

/// Edges whose image is shorter than this many times the error allowed cannot miss their middle by
/// it (a circle's arc of a right angle misses its chord by a fifth of it; ours).
constexpr float kShortEdge = 6.0f;
/// Edges at the rim of what is reflected are halved down to this length, pixels (ours: with 8 and 2
/// user_formula has L1_8bit 0.45 and 0.37 instead of 0.39 in 0.75 and 1.5 times the CPU time).
constexpr float kShortRim = 4.0f;
/// The same where reflections end that do not graze the reflector, whose images are apart from
/// there: at the rim of a concave one. Cosine of the angle that grazing ones are turned by at most.
/// Ours.
constexpr float kShortSteep = 1.0f;
constexpr double kGrazing = 0.5;
/// Edges on which an image through a lens ends are halved down to this length without the lens,
/// pixels (ours: half of it brings L1_8bit from 0.39 to 0.37 in a third more time).
constexpr float kShortThrough = 0.5f;
/// Edges whose image through a lens is longer than this are halved, pixels. What is near the focus
/// has further images, and may lie within a triangle whose corners do not have them (ours: with 4
/// lens.json's L1_8bit is 0.37 instead of 0.46 in twice the time). In mirrors only the edges beside
/// the end of an image are halved, where a part of it may lie beyond the line between two ends
/// (ours: user_formula's L1_8bit is 0.30 instead of 0.38 with 2 % more traced paths, and 0.25 with
/// 15 % if all are).
constexpr float kLongImage = 8.0f;
/// The same beside the end of an image through a lens (ours: lens.json, frame 5: 0.30 instead of
/// 0.41 with a fifth more traced paths).
constexpr float kLongAtEnd = 2.0f;
/// Reflections are that near to the straight view of a hidden point there, pixels (ours).
constexpr float kRimReach = 6.0f;
/// Edges are halved no more when shorter than this as seen from the reflector's place, pixels. A
/// lens's focus enlarges what is shorter (ours: lens.json, frame 5: L1_8bit 0.30 instead of 0.44
/// with a quarter more traced paths).
constexpr float kShortest = 0.5f;
constexpr float kShortestThrough = 0.125f;
/// Triangles that a thread puts out in one go.
constexpr std::size_t kPutGrain = 4096;
constexpr std::uint32_t kNone = ~0u;

}  // namespace

struct Refinement::Round {
  const std::vector<Triangle>& triangles;
  const Edges& edges;
  std::vector<std::uint8_t> states;  ///< what is known of the edges
  /// The middles' places, and the vertices there: one for each pair of vertices.
  struct Middle {
    std::uint32_t a;
    std::uint32_t b;
    std::uint32_t vertex;
    std::uint32_t next;
  };
  std::vector<std::uint32_t> places;  ///< by edge; kNone: it is not halved
  std::vector<std::uint32_t> firsts;  ///< likewise of its middles
  std::vector<Middle> middles;
  std::vector<bool> ended;  ///< edges that miss their middle and stay as they are
};

struct Refinement::WholePart {
  std::vector<std::uint32_t> indices;
  struct Rest {
    std::size_t triangle;
    std::size_t before;  ///< indices that come before it
  };
  std::vector<Rest> rest;
};

void Refinement::findBlindEdges(const Box3& bounds, const std::vector<Edge>& edges) {
  const double diameter = bounds.diameter();
  const double away = reflector_.distanceFrom(bounds.centre()) - 0.5 * diameter;
  hasBlind_ =
      exactMiddles_ && diameter > kBlindEdge * std::max(0.5 * reflector_.size(), away) &&
      std::any_of(edges.begin(), edges.end(), [&](const Edge& e) {
        return table_.angleBetween(table_.meshPosition(e.a), table_.meshPosition(e.b)) > kBlindEdge;
      });
}

std::optional<Vec2> Refinement::straightOf(const VertexPlace& place) const {
  if (!reflector_.hides()) return std::nullopt;
  if (!reflector_.before()) return table_.projection(place.position);
  if (place.reflections.count > 0) return table_.projection(place.reflections.at[0].x);
  return place.straight ? table_.projection(place.straight->x) : std::nullopt;
}

Refinement::Ends Refinement::endsOn(const VertexPlace& a, const VertexPlace& b) const {
  Ends ends = Ends::None;
  const Counterparts ofB = counterparts(a.reflections, b.reflections);
  for (std::size_t i = 0; i < a.reflections.count; ++i) {
    if (ofB[i] != kMaxReflections) continue;
    const glm::dvec3& x = a.reflections.at[i].x;
    const auto seen = table_.projection(x);
    if (!seen || !table_.projection.inFrame({*seen})) continue;
    const glm::dvec3 to = x - table_.projection.eye();
    const glm::dvec3 onward = a.position - x;
    const bool steep = !reflector_.before() &&
                       glm::dot(to, onward) < kGrazing * glm::length(to) * glm::length(onward);
    ends = std::max(ends, steep ? Ends::Steep : Ends::Grazing);
  }
  return ends;
}

Refinement::Look Refinement::lookAt(const Edge& edge, bool ordered) const {
  const std::uint32_t countA = table_.glimpses[edge.a].count;
  const std::uint32_t countB = table_.glimpses[edge.b].count;
  if (isBlind(edge)) return Look::Blind;
  if (ordered) {
    for (std::size_t i = 0; i < countA; ++i) {
      if (mayMiss(edge, i, i)) return Look::Middle;
    }
    return Look::No;
  }
  const VertexPlace& a = table_.places[edge.a];
  const VertexPlace& b = table_.places[edge.b];
  if (countA == 0 && countB == 0) {
    if (a.straight || b.straight) return Look::No;
    return table_.angleBetween(a.position, b.position) > kBlindEdge ? Look::Halve : Look::No;
  }
  if (countA != countB) return lookAtEnd(a, b);
  const Counterparts ofB = counterparts(a.reflections, b.reflections);
  for (std::size_t i = 0; i < countA; ++i) {
    if (ofB[i] == kMaxReflections) return Look::Halve;
    if (mayMiss(edge, i, ofB[i])) return Look::Middle;
  }
  return Look::No;
}

Refinement::Look Refinement::lookAtEnd(const VertexPlace& a, const VertexPlace& b) const {
  // At the rim of a convex reflector an image comes to lie where the point itself is seen; a
  // concave one's ends anywhere
  const auto pa = straightOf(a);
  const auto pb = straightOf(b);
  if (pa && pb && (glm::distance(*pa, *pb) < kShortRim || !table_.projection.inFrame({*pa, *pb}))) {
    const Ends ends = std::max(endsOn(a, b), endsOn(b, a));
    if (ends == Ends::None ||
        glm::distance(*pa, *pb) < (ends == Ends::Steep ? kShortSteep : kShortRim))
      return Look::No;
  } else if (reflector_.hides() && table_.apparent(a, b) < kShortRim) {
    // Behind the camera
    const Ends ends = std::max(endsOn(a, b), endsOn(b, a));
    if (ends != Ends::Steep || table_.apparent(a, b) < kShortSteep) return Look::No;
  }
  // ... and nothing tells how near the end of an image through a lens is
  if (exactMiddles_ && !reflector_.hides()) {
    const auto seenA = table_.projection(a.position);
    const auto seenB = table_.projection(b.position);
    if (seenA && seenB && glm::distance(*seenA, *seenB) < kShortThrough) return Look::No;
  }
  return Look::Halve;
}

bool Refinement::isBlind(const Edge& edge) const {
  const VertexPlace& a = table_.places[edge.a];
  const VertexPlace& b = table_.places[edge.b];
  if (hasBlind_ && table_.angleBetween(a.position, b.position) > kBlindEdge) return true;
  return exactMiddles_ && !reflector_.hides() && isLonger(edge, kLongImage);
}

float Refinement::shortest() const {
  return reflector_.hides() ? kShortest : kShortestThrough;
}

bool Refinement::isLonger(const Edge& edge, float pixels) const {
  const VertexPlace& a = table_.places[edge.a];
  const VertexPlace& b = table_.places[edge.b];
  if (table_.apparent(a, b) < 2.0f * shortest()) return false;
  for (std::size_t i = 0; i < a.reflections.count; ++i) {
    const std::size_t j = counterpart(a.reflections, i, b.reflections);
    if (j == kMaxReflections) continue;
    const Vec2 xa = table_.seen(edge.a, i);
    const Vec2 xb = table_.seen(edge.b, j);
    if (glm::distance(xa, xb) > pixels && table_.projection.inFrame({xa, xb})) return true;
  }
  return false;
}

bool Refinement::endsInCurve(const Edge& edge) const {
  if (table_.glimpses[edge.a].count == table_.glimpses[edge.b].count) return false;
  const VertexPlace& a = table_.places[edge.a];
  const VertexPlace& b = table_.places[edge.b];
  return !reflector_.hides() || std::max(endsOn(a, b), endsOn(b, a)) == Ends::Steep;
}

void Refinement::lookBesideEnds(const Round& round, std::vector<Look>& looks) const {
  const float longest = reflector_.hides() ? kLongImage : kLongAtEnd;
  std::vector<std::uint8_t> ends(looks.size());
  parallelFor(looks.size(), kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) ends[i] = endsInCurve(round.edges.ends[i]) ? 1 : 0;
  });
  for (std::size_t t = 0; t < round.triangles.size(); ++t) {
    const std::span<const std::uint32_t> of(&round.edges.of[3 * t], 3);
    if (std::ranges::none_of(of, [&](std::uint32_t e) { return ends[e] != 0; })) continue;
    for (const std::uint32_t e : of)
      if (looks[e] != Look::Blind && isLonger(round.edges.ends[e], longest)) looks[e] = Look::Blind;
  }
}

bool Refinement::mayMiss(const Edge& edge, std::size_t i, std::size_t j) const {
  const Vec2 xa = table_.seen(edge.a, i);
  const Vec2 xb = table_.seen(edge.b, j);
  return glm::distance(xa, xb) > kShortEdge * options_.errorPixels &&
         table_.projection.inFrame({xa, xb});
}

bool Refinement::misses(const Edge& edge, std::size_t place) const {
  const VertexPlace& middle = table_.places[place];
  const Reflections& a = table_.places[edge.a].reflections;
  const Reflections& b = table_.places[edge.b].reflections;
  if (a.count == 0 && b.count == 0) return middle.reflections.count > 0;
  for (std::size_t i = 0; i < a.count; ++i) {
    const std::size_t j = counterpart(a, i, b);
    if (j == kMaxReflections) return true;
    const glm::dvec3 image = 0.5 * (a.at[i].image + b.at[j].image);
    const std::size_t k = nearestBetween(middle.reflections, a.at[i], b.at[j]);
    if (k == kMaxReflections) return true;
    const auto expected = table_.projection(image);
    const Vec2 is = table_.seen(place, k);
    if (!expected || std::isnan(is.x)) continue;
    if (table_.projection.inFrame({*expected, is}) &&
        glm::distance(*expected, is) > options_.errorPixels)
      return true;
  }
  return false;
}

bool Refinement::torn(const Triangle& t) const {
  for (std::size_t c = 0; c < 3; ++c) {
    const VertexPlace& a = table_.placeAt(t[c]);
    const VertexPlace& b = table_.placeAt(t[(c + 1) % 3]);
    for (std::size_t i = 0; i < a.reflections.count; ++i) {
      const std::size_t j = counterpart(a.reflections, i, b.reflections);
      if (j != kMaxReflections &&
          glm::distance(table_.seen(table_.placeOf(t[c]), i),
                        table_.seen(table_.placeOf(t[(c + 1) % 3]), j)) > kTornEdge)
        return true;
    }
  }
  return false;
}

void Refinement::lookAtMiddles(Round& round, bool mayHalve) {
  // Middles of those that may be too long
  std::vector<Look> looks(round.edges.ends.size());
  parallelFor(looks.size(), kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      looks[i] = lookAt(round.edges.ends[i], (round.states[i] & kInOrder) != 0);
  });
  if (exactMiddles_) lookBesideEnds(round, looks);
  std::vector<std::uint32_t> numbers;
  std::vector<Edge> looked;
  std::vector<Look> lookedAs;
  for (std::uint32_t i = 0; i < looks.size(); ++i) {
    if (looks[i] == Look::No) continue;
    numbers.push_back(i);
    looked.push_back(round.edges.ends[i]);
    lookedAs.push_back(looks[i]);
  }
  const std::size_t first = table_.places.size();
  // What they will trace at least: what one of their ends shows
  std::uint64_t traced = counts_.paths.retraced;
  for (const Edge& edge : looked)
    traced += std::max({1u, table_.glimpses[edge.a].count, table_.glimpses[edge.b].count});
  if (exactMiddles_ && !looked.empty() && traced > options_.maxTraced) {
    counts_.coarse = 1;
    looked.clear();
  }
  table_.addPlaces(looked.size());
  for (std::size_t i = 0; i < looked.size(); ++i)
    table_.places[first + i].position =
        0.5 * (table_.places[looked[i].a].position + table_.places[looked[i].b].position);
  lookUp(first, looked, lookedAs);
  std::vector<std::uint8_t> halved(looked.size());
  parallelFor(looked.size(), kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      halved[i] = lookedAs[i] != Look::Middle || misses(looked[i], first + i) ? 1 : 0;
  });

  for (std::size_t i = 0; i < looked.size(); ++i) {
    if (halved[i] == 0) continue;
    round.ended[numbers[i]] = !mayHalve || table_.apparent(table_.places[looked[i].a],
                                                           table_.places[looked[i].b]) < shortest();
    if (!round.ended[numbers[i]]) round.places[numbers[i]] = static_cast<std::uint32_t>(first + i);
  }
}

std::uint32_t Refinement::middleOf(Round& round, std::uint32_t a, std::uint32_t b,
                                   std::uint32_t edge) {
  if (round.places[edge] == kNone) return kNone;
  if (a > b) std::swap(a, b);
  for (std::uint32_t i = round.firsts[edge]; i != kNone; i = round.middles[i].next) {
    if (round.middles[i].a == a && round.middles[i].b == b) return round.middles[i].vertex;
  }
  const std::uint32_t vertex =
      table_.addVertex(round.places[edge], mixed(table_.attributesOf(a), table_.attributesOf(b)));
  round.middles.push_back({a, b, vertex, round.firsts[edge]});
  round.firsts[edge] = static_cast<std::uint32_t>(round.middles.size() - 1);
  return vertex;
}

bool Refinement::isWhole(const Round& round, std::size_t i) const {
  const std::uint32_t* of = &round.edges.of[3 * i];
  const Triangle& t = round.triangles[i];
  return round.places[of[0]] == kNone && round.places[of[1]] == kNone &&
         round.places[of[2]] == kNone && !round.ended[of[0]] && !round.ended[of[1]] &&
         !round.ended[of[2]] && (round.states[of[0]] & round.states[of[2]] & kInOrder) != 0 &&
         output_.allNumbered(t);
}

void Refinement::putWhole(const Round& round, std::size_t part, WholePart& result) const {
  const std::size_t last = std::min(round.triangles.size(), (part + 1) * kPutGrain);
  result.indices.reserve(3 * (last - part * kPutGrain));
  for (std::size_t i = part * kPutGrain; i < last; ++i) {
    if (!isWhole(round, i)) {
      result.rest.push_back({i, result.indices.size()});
      continue;
    }
    const Triangle& t = round.triangles[i];
    const std::vector<VirtualOutput::Numbers>& numbers = output_.numbers;
    for (std::uint32_t k = 0; k < numbers[t[0]].count; ++k) {
      const std::array<std::uint32_t, 3> corners{numbers[t[0]].first + k, numbers[t[1]].first + k,
                                                 numbers[t[2]].first + k};
      if (output_.shows(corners))
        result.indices.insert(result.indices.end(), corners.begin(), corners.end());
    }
  }
}

void Refinement::putRest(Round& round, std::size_t i, std::vector<Triangle>& pieces) {
  const Triangle& t = round.triangles[i];
  const std::uint32_t* of = &round.edges.of[3 * i];
  const auto count = (round.places[of[0]] != kNone ? 1 : 0) +
                     (round.places[of[1]] != kNone ? 1 : 0) +
                     (round.places[of[2]] != kNone ? 1 : 0);
  if (count == 0) {
    if (!jumps_ && (round.ended[of[0]] || round.ended[of[1]] || round.ended[of[2]]) && torn(t)) {
      if (exactMiddles_) {
        mixed_.push_back(t);
      } else {
        ++counts_.dropped;
      }
    } else {
      put(t, (round.states[of[0]] & round.states[of[2]] & kInOrder) != 0);
    }
    return;
  }
  const std::array<std::uint32_t, 3> m{middleOf(round, t[0], t[1], of[0]),
                                       middleOf(round, t[1], t[2], of[1]),
                                       middleOf(round, t[2], t[0], of[2])};
  if (count == 3) {
    pieces.push_back({t[0], m[0], m[2]});
    pieces.push_back({m[0], t[1], m[1]});
    pieces.push_back({m[2], m[1], t[2]});
    pieces.push_back({m[0], m[1], m[2]});
  } else {
    // Turned so that edge 0 is halved, and where two are edge 1 too
    std::size_t c = 0;
    while (m[c] == kNone || (count == 2 && m[(c + 1) % 3] == kNone)) ++c;
    const std::uint32_t p0 = t[c];
    const std::uint32_t p1 = t[(c + 1) % 3];
    const std::uint32_t p2 = t[(c + 2) % 3];
    const std::uint32_t m0 = m[c];
    if (count == 1) {
      pieces.push_back({p0, m0, p2});
      pieces.push_back({m0, p1, p2});
    } else {
      const std::uint32_t m1 = m[(c + 1) % 3];
      pieces.push_back({m0, p1, m1});
      pieces.push_back({p0, m0, m1});
      pieces.push_back({p0, m1, p2});
    }
  }
}

std::vector<Refinement::Triangle> Refinement::halve(const std::vector<Triangle>& triangles,
                                                    const Edges& edges, bool mayHalve) {
  Round round{triangles,
              edges,
              spread(edges.ends),
              std::vector<std::uint32_t>(edges.ends.size(), kNone),
              std::vector<std::uint32_t>(edges.ends.size(), kNone),
              {},
              std::vector<bool>(edges.ends.size())};
  lookAtMiddles(round, mayHalve);
  output_.numberVertices();
  std::vector<WholePart> parts((triangles.size() + kPutGrain - 1) / kPutGrain);
  parallelFor(parts.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t p = begin; p < end; ++p) putWhole(round, p, parts[p]);
  });
  std::vector<Triangle> pieces;
  for (const WholePart& part : parts) {
    std::size_t done = 0;
    for (const auto& [triangle, before] : part.rest) {
      output_.putIndices(part.indices, done, before);
      done = before;
      putRest(round, triangle, pieces);
    }
    output_.putIndices(part.indices, done, part.indices.size());
  }
  return pieces;
}

bool Refinement::atRim(const Reflection& reflection, const Reflection& straight) const {
  const auto seen = table_.projection(reflection.x);
  const auto hidden = table_.projection(straight.x);
  return seen && hidden && glm::distance(*seen, *hidden) < kRimReach;
}

void Refinement::put(const Triangle& t, bool ordered) {
  if (ordered) {
    for (std::size_t i = 0; i < table_.placeAt(t[0]).reflections.count; ++i)
      output_.putCorners({output_.put(t[0], i), output_.put(t[1], i), output_.put(t[2], i)});
    return;
  }
  std::size_t seen = 0;
  for (std::size_t c = 1; c < 3; ++c) {
    if (table_.placeAt(t[c]).reflections.count > table_.placeAt(t[seen]).reflections.count)
      seen = c;
  }
  const Reflections& a = table_.placeAt(t[seen]).reflections;
  const std::array<std::uint32_t, 2> others{t[(seen + 1) % 3], t[(seen + 2) % 3]};
  std::array<Counterparts, 2> of;
  for (std::size_t c = 0; c < 2; ++c)
    of[c] = counterparts(a, table_.placeAt(others[c]).reflections);
  std::array<std::array<std::uint32_t, 3>, kMaxReflections> whole;
  std::size_t wholes = 0;
  bool all = true;
  for (std::size_t i = 0; i < a.count; ++i) {
    std::array<std::size_t, 2> number{};
    for (std::size_t c = 0; c < 2; ++c) number[c] = of[c][i];
    // The rim, as near as the order lets one see
    const auto rim = [&](std::size_t c) {
      const VertexPlace& other = table_.placeAt(others[c]);
      return number[c] == kMaxReflections && !exactMiddles_ && other.straight &&
             atRim(a.at[i], *other.straight);
    };
    if ((number[0] == kMaxReflections && !rim(0)) || (number[1] == kMaxReflections && !rim(1))) {
      all = false;
      continue;
    }
    whole[wholes++] = {output_.put(t[seen], i), output_.put(others[0], number[0]),
                       output_.put(others[1], number[1])};
  }
  if (exactMiddles_ && !all) {
    mixed_.push_back(t);
    return;
  }
  for (std::size_t i = 0; i < wholes; ++i) output_.putCorners(whole[i]);
  counts_.dropped += a.count - wholes;
}

}  // namespace catoptric::methods::perturbation
