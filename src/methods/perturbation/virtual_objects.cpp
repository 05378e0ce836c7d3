#include "methods/perturbation/virtual_objects.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <map>
#include <memory>
#include <mutex>
#include <numeric>
#include <optional>
#include <span>
#include <tuple>
#include <utility>

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
/// Reflections are that near to the straight view of a hidden point there, pixels (ours).
constexpr float kRimReach = 6.0f;
/// Edges are halved when longer than this part of their distance from the reflector: what concave
/// and waved reflectors and lenses show may lie between all vertices (ours).
constexpr double kBlindEdge = 0.25;
/// Pixels around the frame in which edges are looked at (ours).
constexpr float kMargin = 8.0f;
/// Edges are halved no more when shorter than this as seen from the reflector's place, pixels
/// (ours).
constexpr float kShortest = 0.5f;
/// Ends of such edges that show farther apart than this are two reflections, pixels (ours).
constexpr float kTornEdge = 6.0f;
/// Ends of an edge that show farther apart than so many times its length as seen from the
/// reflector's place may be two reflections (ours).
constexpr float kStretch = 4.0f;
/// Two reflections about a caustic are joined up to this distance, of the image's height (ours).
constexpr float kWidestFold = 1.0f / 12.0f;
/// Halvings of the edge on which a reflection ends (ours).
constexpr int kBorderSteps = 5;
/// Edges that a thread looks at in one go, and triangles or vertices that it puts out.
constexpr std::size_t kGrain = 1024;
constexpr std::size_t kPutGrain = 4096;
/// A part of the triangles that meets fewer than one place in so many is sorted by comparisons
/// (ours).
constexpr std::size_t kFewTriangles = 16;
/// Over how many edges reflections are looked for in a round of halvings (ours).
constexpr int kSpreadRounds = 2;

/// What is reflected, once for all vertices that lie there.
struct Place {
  glm::dvec3 position;
  Reflections reflections;
  /// No reflection, and the reflector stands before it: where it would show without. Else null.
  std::unique_ptr<Reflection> straight;
};

/// What most edges ask of a place: a tenth of its bytes.
struct Glimpse {
  std::array<Vec2, 2> seen;  ///< pixels of the first reflections; x NaN: behind the camera
  std::uint32_t count = 0;   ///< of its reflections
};

/// The reflections of a vertex among those that are put out.
struct Numbers {
  std::uint32_t first = 0;
  std::uint32_t count = 0;
};

/// Memory of one update for the next: the kernel takes as long to give it as look-ups do.
struct Scratch {
  std::vector<Place> places;
  std::vector<Glimpse> glimpses;
  std::vector<Numbers> numbers;
  std::vector<Vec2> seenVertices;
  std::vector<std::uint32_t> slots;
  std::vector<std::uint32_t> placeOf;
  std::vector<std::uint32_t> firstAt;
};

/// A vertex that is no mesh's: the middle of an edge, or the end of a reflection on it.
struct Node {
  std::uint32_t place = 0;
  frame::VertexAttributes attributes;
};

using Triangle = Connectivity::Triangle;
using Edge = Connectivity::Edge;

/// At `t` of the way from a to b.
frame::VertexAttributes mixed(const frame::VertexAttributes& a, const frame::VertexAttributes& b,
                              float t = 0.5f) {
  const auto mean = [&](const auto& u, const auto& v) { return (1.0f - t) * u + t * v; };
  frame::VertexAttributes m;
  m.normal = mean(a.normal, b.normal);
  m.tangent = mean(a.tangent, b.tangent);
  m.uv0 = mean(a.uv0, b.uv0);
  m.uv1 = mean(a.uv1, b.uv1);
  m.color = mean(a.color, b.color);
  m.bake = mean(a.bake, b.bake);
  return m;
}

/// Where the camera shows points, pixels.
class Projection {
 public:
  explicit Projection(const View& view)
      : size_(static_cast<float>(view.width), static_cast<float>(view.height)),
        clip_(glm::dmat4(scene::clipFromCamera(view.camera, size_.x / size_.y)) *
              glm::dmat4(scene::cameraFromWorld(view.camera))),
        eye_(view.camera.eye()),
        spread_(scene::pixelSpreadRad(view.camera, view.height)) {}

  const glm::dvec3& eye() const { return eye_; }
  float height() const { return size_.y; }
  double spread() const { return spread_; }

  std::optional<Vec2> operator()(const glm::dvec3& p) const {
    const glm::dvec4 c = clip_ * glm::dvec4(p, 1.0);
    if (!(c.w > 0.0)) return std::nullopt;
    return Vec2(glm::dvec2(0.5 + 0.5 * c.x / c.w, 0.5 - 0.5 * c.y / c.w) * glm::dvec2(size_));
  }
  /// Whether the box around some points meets the frame.
  bool inFrame(std::initializer_list<Vec2> points) const {
    Vec2 low(std::numeric_limits<float>::infinity());
    Vec2 high = -low;
    for (const Vec2& p : points) {
      low = glm::min(low, p);
      high = glm::max(high, p);
    }
    return low.x < size_.x + kMargin && low.y < size_.y + kMargin && high.x > -kMargin &&
           high.y > -kMargin;
  }

 private:
  Vec2 size_;
  glm::dmat4 clip_;
  glm::dvec3 eye_;
  double spread_;  ///< rad, of a pixel
};

/// The reflection nearest to x; none: kMaxReflections.
std::size_t nearestTo(const Reflections& reflections, const glm::dvec3& x) {
  std::size_t best = kMaxReflections;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < reflections.count; ++i) {
    const glm::dvec3 way = reflections.at[i].x - x;
    const double apart2 = glm::dot(way, way);
    if (apart2 < least) {
      least = apart2;
      best = i;
    }
  }
  return best;
}

/// The reflection of `b` that continues number `i` of `a`: each is the nearest of the other.
std::size_t counterpart(const Reflections& a, std::size_t i, const Reflections& b) {
  if (a.count == 1 && b.count == 1) return 0;
  const std::size_t j = nearestTo(b, a.at[i].x);
  if (j == kMaxReflections || nearestTo(a, b.at[j].x) != i) return kMaxReflections;
  return j;
}

/// Whether there are one or two of each, and number i of one continues number i of the other:
/// most often.
bool inOrder(const Reflections& a, const Reflections& b) {
  if (a.count != b.count || a.count == 0 || a.count > 2) return false;
  if (a.count == 1) return true;
  const auto apart2 = [&](std::size_t i, std::size_t j) {
    const glm::dvec3 way = a.at[i].x - b.at[j].x;
    return glm::dot(way, way);
  };
  const double same = std::max(apart2(0, 0), apart2(1, 1));
  return same < apart2(0, 1) && same < apart2(1, 0);
}

/// counterpart() of all reflections of `a`.
using Counterparts = std::array<std::size_t, kMaxReflections>;
Counterparts counterparts(const Reflections& a, const Reflections& b) {
  Counterparts result;
  const bool ordered = inOrder(a, b);
  for (std::size_t i = 0; i < a.count; ++i) result[i] = ordered ? i : counterpart(a, i, b);
  return result;
}

/// Whether one end of an edge may have more reflections than were found: the other has others. One
/// at each end is the same.
bool lacks(const Reflections& mine, const Reflections& others) {
  if (mine.count == others.count && mine.count < 2) return false;
  const Counterparts mineOf = counterparts(others, mine);
  return std::find(mineOf.begin(), mineOf.begin() + others.count, kMaxReflections) !=
         mineOf.begin() + others.count;
}

/// Where the middle of an edge may be reflected: between what continues from end to end, and where
/// only one end is. More than kMaxReflections where the ends have others.
Reflections between(const Reflections& a, const Reflections& b) {
  Reflections guess = b;
  for (std::size_t i = 0; i < a.count; ++i) {
    const std::size_t j = counterpart(a, i, b);
    if (j != kMaxReflections) {
      guess.at[j].x = 0.5 * (a.at[i].x + b.at[j].x);
    } else {
      guess.at[guess.count++] = a.at[i];
    }
  }
  return guess;
}

class Builder {
 public:
  Builder(const Reflector& reflector, const View& view, Order order, const TriangleOptions& options,
          TriangleCounts& counts, raster::VirtualTriangles& result)
      : reflector_(reflector),
        projection_(view),
        exactMiddles_(order == Order::Auto),
        jumps_(order == Order::Nearest),
        options_(options),
        counts_(counts),
        result_(result) {
    std::swap(scratch_, kept());
  }
  ~Builder() { std::swap(scratch_, kept()); }
  Builder(const Builder&) = delete;
  Builder& operator=(const Builder&) = delete;

  void build(const frame::Geometry& geometry, int object, bool own, Connectivity& known) {
    own_ = own;
    const frame::ObjectRange& range = geometry.objects[static_cast<std::size_t>(object)];
    attributes_ = std::span(geometry.attributes).subspan(range.firstVertex, range.vertexCount);
    positions_ = std::span(geometry.positions).subspan(range.firstVertex, range.vertexCount);
    result_.indices.clear();
    numbers_.clear();
    listPlaces();
    lookUp(0, {});
    if (known.placeOf != placeOf_) {
      known.triangles.resize(range.indexCount / 3);
      for (std::size_t t = 0; t < known.triangles.size(); ++t) {
        for (std::size_t c = 0; c < 3; ++c) {
          known.triangles[t][c] =
              geometry.indices[range.firstIndex + 3 * t + c] - range.firstVertex;
        }
      }
      known.edges = edgesOf(known.triangles);
      known.placeOf = placeOf_;
    }
    const double diameter = range.bounds.diameter();
    const double away = reflector_.distanceFrom(range.bounds.centre()) - 0.5 * diameter;
    hasBlind_ =
        exactMiddles_ && diameter > kBlindEdge * std::max(0.5 * reflector_.size(), away) &&
        std::any_of(known.edges.ends.begin(), known.edges.ends.end(), [&](const Edge& e) {
          return angleBetween(positions_[firstAt_[e.a]], positions_[firstAt_[e.b]]) > kBlindEdge;
        });
    // Nearest paths jump from sample to sample however short the edges are
    const int halvings = jumps_ || options_.errorPixels <= 0.0f ? 0 : options_.maxHalvings;
    std::vector<Triangle> pieces = halve(known.triangles, known.edges, halvings > 0);
    for (int level = 1; !pieces.empty(); ++level)
      pieces = halve(pieces, edgesOf(pieces), level < halvings);
    putMixed();
    counts_.vertices += places_.size();
    counts_.triangles += result_.indices.size() / 3;
    result_.object = object + 1;
    result_.positions.resize(putOut_);
    result_.attributes.resize(putOut_);
    result_.images.resize(putOut_);
    result_.places.resize(reflector_.before() ? putOut_ : 0);
  }

 private:
  using Edges = Connectivity::Edges;
  static Scratch& kept() {
    static thread_local Scratch scratch;
    return scratch;
  }
  static constexpr std::uint32_t kNone = ~0u;
  /// What spread() and lookAt() know of an edge.
  static constexpr std::uint8_t kFirstLacks = 1;   ///< end a, a reflection that b has
  static constexpr std::uint8_t kSecondLacks = 2;  ///< and the other way round
  static constexpr std::uint8_t kInOrder = 4;      ///< inOrder()

  /// Vertices that lie in the same place have the same reflections: meshes repeat a corner for each
  /// normal and at seams of textures.
  void listPlaces() {
    const std::size_t count = positions_.size();
    placeOf_.resize(count);
    firstAt_.clear();
    std::vector<std::uint32_t>& slots = scratch_.slots;
    slots.assign(std::bit_ceil(2 * count + 1), kNone);
    for (std::size_t i = 0; i < count; ++i) {
      const Vec3 p = positions_[i] + 0.0f;  // -0 is 0
      const auto bits = std::bit_cast<std::array<std::uint32_t, 3>>(p);
      std::uint64_t hash = bits[0];
      hash = hash * 0x9e3779b97f4a7c15u + bits[1];
      hash = hash * 0x9e3779b97f4a7c15u + bits[2];
      std::size_t slot = (hash * 0x9e3779b97f4a7c15u) >> 32 & (slots.size() - 1);
      while (slots[slot] != kNone && positions_[firstAt_[slots[slot]]] != p)
        slot = (slot + 1) & (slots.size() - 1);
      if (slots[slot] == kNone) {
        slots[slot] = static_cast<std::uint32_t>(firstAt_.size());
        firstAt_.push_back(static_cast<std::uint32_t>(i));
      }
      placeOf_[i] = slots[slot];
    }
    // What they hold is of an update before
    places_.resize(firstAt_.size());
    glimpses_.resize(firstAt_.size());
  }
  void addPlaces(std::size_t count) {
    places_.resize(places_.size() + count);
    glimpses_.resize(places_.size());
  }

  std::uint32_t placeOf(std::uint32_t vertex) const {
    return vertex < placeOf_.size() ? placeOf_[vertex] : more_[vertex - placeOf_.size()].place;
  }
  const Place& placeAt(std::uint32_t vertex) const { return places_[placeOf(vertex)]; }
  const frame::VertexAttributes& attributesOf(std::uint32_t vertex) const {
    return vertex < placeOf_.size() ? attributes_[vertex]
                                    : more_[vertex - placeOf_.size()].attributes;
  }
  std::uint32_t addVertex(std::uint32_t place, const frame::VertexAttributes& attributes) {
    more_.push_back({place, attributes});
    return static_cast<std::uint32_t>(placeOf_.size() + more_.size() - 1);
  }

  Edges edgesOf(const std::vector<Triangle>& triangles) const {
    std::vector<Edge> sides(3 * triangles.size());
    for (std::size_t t = 0; t < triangles.size(); ++t) {
      const std::array<std::uint32_t, 3> at{placeOf(triangles[t][0]), placeOf(triangles[t][1]),
                                            placeOf(triangles[t][2])};
      for (std::size_t c = 0; c < 3; ++c) {
        const auto [a, b] = std::minmax(at[c], at[(c + 1) % 3]);
        sides[3 * t + c] = {a, b};
      }
    }
    std::vector<std::uint32_t> sorted(sides.size());
    if (kFewTriangles * triangles.size() < places_.size()) {
      std::iota(sorted.begin(), sorted.end(), 0u);
      std::sort(sorted.begin(), sorted.end(), [&](std::uint32_t i, std::uint32_t j) {
        return std::tie(sides[i].a, sides[i].b, i) < std::tie(sides[j].a, sides[j].b, j);
      });
    } else {
      // By counting, by their second ends and then, in that order, by their first
      std::vector<std::uint32_t> firsts(places_.size());
      std::vector<std::uint32_t> seconds(places_.size());
      for (const Edge& side : sides) {
        ++firsts[side.a];
        ++seconds[side.b];
      }
      const auto addUp = [](std::vector<std::uint32_t>& counts) {
        std::uint32_t sum = 0;
        for (std::uint32_t& count : counts) sum += std::exchange(count, sum);
      };
      addUp(firsts);
      addUp(seconds);
      std::vector<std::uint32_t> bySecond(sides.size());
      for (std::uint32_t i = 0; i < sides.size(); ++i) bySecond[seconds[sides[i].b]++] = i;
      for (const std::uint32_t i : bySecond) sorted[firsts[sides[i].a]++] = i;
    }
    Edges edges;
    edges.ends.reserve(sides.size() / 2 + 64);
    edges.of.resize(sides.size());
    for (const std::uint32_t i : sorted) {
      const auto [a, b] = sides[i];
      if (edges.ends.empty() || edges.ends.back().a != a || edges.ends.back().b != b)
        edges.ends.push_back({a, b});
      edges.of[i] = static_cast<std::uint32_t>(edges.ends.size() - 1);
    }
    return edges;
  }

  /// Reflections of the places from `first` on; `edges[i]` is what place first + i is the middle
  /// of.
  void lookUp(std::size_t first, std::span<const Edge> edges) {
    std::mutex mutex;
    parallelFor(places_.size() - first, 64, [&](std::size_t begin, std::size_t end) {
      TriangleCounts own;
      RayOctree::Cursor cursor;
      RayOctree::Cursor cursorBefore;
      Reflector::Traced traced;
      Reflector::Traced tracedBefore;
      for (std::size_t i = begin; i < end; ++i) {
        Place& place = places_[first + i];
        if (first == 0) {
          place.position = glm::dvec3(positions_[firstAt_[i]]);
          place.reflections.count = 0;
          place.straight.reset();
        }
        const bool blind = !edges.empty() && isBlind(places_[edges[i].a], places_[edges[i].b]);
        if (blind)
          place.reflections =
              reflector_.reflectionsOf(place.position, own_, cursor, own.paths, &traced);
        if (!edges.empty() && exactMiddles_) {
          const Reflections guess =
              between(places_[edges[i].a].reflections, places_[edges[i].b].reflections);
          reflector_.addReflectionsNear(place.position, guess, place.reflections, own.paths,
                                        &traced);
        }
        if (place.reflections.count == 0 && !blind)
          place.reflections =
              reflector_.reflectionsOf(place.position, own_, cursor, own.paths, &traced);
        if (place.reflections.count == 0) {
          const auto straight =
              reflector_.hidden(place.position, cursorBefore, own.paths, &tracedBefore);
          if (straight) place.straight = std::make_unique<Reflection>(*straight);
        }
        project(first + i);
      }
      if (options_.lookedUp) options_.lookedUp(end - begin);
      const std::lock_guard lock(mutex);
      counts_.add(own);
    });
  }

  /// Those of `a` that nothing of `b` continues, or nothing near.
  Reflections news(const Reflections& a, const Reflections& b) const {
    Reflections rest;
    for (std::size_t i = 0; i < a.count; ++i) {
      const std::size_t j = counterpart(a, i, b);
      if (j != kMaxReflections) {
        const auto xa = projection_(a.at[i].x);
        const auto xb = projection_(b.at[j].x);
        if (!xa || !xb || glm::distance(*xa, *xb) < kTornEdge) continue;
      }
      rest.at[rest.count++] = a.at[i];
    }
    return rest;
  }

  /// Whether the ends of an edge, of one reflection each, show so far apart that they may be two.
  bool stretched(const Edge& edge) const {
    const float apart = glm::distance(glimpses_[edge.a].seen[0], glimpses_[edge.b].seen[0]);
    return apart > kTornEdge && apart > kStretch * apparent(places_[edge.a], places_[edge.b]);
  }

  /// What is known of edges; of those without a place that has changed, as before.
  void relate(const std::vector<Edge>& edges, const std::vector<bool>& changed,
              std::vector<std::uint8_t>& states) const {
    parallelFor(edges.size(), kGrain, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const auto [a, b] = edges[i];
        if (!changed[a] && !changed[b]) {
          states[i] &= kInOrder;
          continue;
        }
        const Place& pa = places_[a];
        const Place& pb = places_[b];
        // Most have one reflection at both ends
        if (glimpses_[a].count == 1 && glimpses_[b].count == 1) {
          states[i] =
              !exactMiddles_ || !stretched(edges[i]) ? kInOrder : kFirstLacks | kSecondLacks;
          continue;
        }
        states[i] = inOrder(pa.reflections, pb.reflections) ? kInOrder : 0;
        if (states[i] != 0 || !exactMiddles_ || pa.straight || pb.straight) continue;
        // Those that belong together do so both ways
        const bool lacksOne = lacks(pa.reflections, pb.reflections);
        if (lacksOne) states[i] |= kFirstLacks;
        if (!lacksOne && pa.reflections.count == pb.reflections.count) continue;
        if (lacks(pb.reflections, pa.reflections)) states[i] |= kSecondLacks;
      }
    });
  }

  /// What one end of an edge found, the other is looked for at: the nearest rays need not lead to
  /// all reflections. What is known of the edges then.
  std::vector<std::uint8_t> spread(const std::vector<Edge>& edges) {
    std::vector<bool> changed(places_.size(), true);
    std::vector<std::uint8_t> states(edges.size());
    for (int round = 0;; ++round) {
      relate(edges, changed, states);
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
          const Place& place = places_[wanted[firsts[k]].first];
          const std::size_t last = k + 1 < firsts.size() ? firsts[k + 1] : wanted.size();
          found[k] = place.reflections;
          for (std::size_t i = firsts[k]; i < last; ++i) {
            const Reflections more = news(places_[wanted[i].second].reflections, found[k]);
            reflector_.addReflectionsNear(place.position, more, found[k], own.paths);
          }
        }
        const std::lock_guard lock(mutex);
        counts_.add(own);
      });
      std::fill(changed.begin(), changed.end(), false);
      bool any = false;
      for (std::size_t k = 0; k < firsts.size(); ++k) {
        const std::uint32_t number = wanted[firsts[k]].first;
        if (found[k].count == places_[number].reflections.count) continue;
        places_[number].reflections = std::move(found[k]);
        project(number);
        changed[number] = true;
        any = true;
      }
      if (!any) return states;
    }
  }

  /// Where a place shows without the last reflector, pixels, as far as that is known: what shows by
  /// way of others before it may be hidden from those.
  std::optional<Vec2> straightOf(const Place& place) const {
    if (!reflector_.hides()) return std::nullopt;
    if (!reflector_.before()) return projection_(place.position);
    if (place.reflections.count > 0) return projection_(place.reflections.at[0].x);
    return place.straight ? projection_(place.straight->x) : std::nullopt;
  }

  /// What ends on the edge from `a` to `b` within the frame: nothing, reflections that graze the
  /// reflector, or others, at the rim of a concave one.
  enum class Ends { None, Grazing, Steep };
  Ends endsOn(const Place& a, const Place& b) const {
    Ends ends = Ends::None;
    const Counterparts ofB = counterparts(a.reflections, b.reflections);
    for (std::size_t i = 0; i < a.reflections.count; ++i) {
      if (ofB[i] != kMaxReflections) continue;
      const glm::dvec3& x = a.reflections.at[i].x;
      const auto seen = projection_(x);
      if (!seen || !projection_.inFrame({*seen})) continue;
      const glm::dvec3 to = x - projection_.eye();
      const glm::dvec3 onward = a.position - x;
      const bool steep = !reflector_.before() &&
                         glm::dot(to, onward) < kGrazing * glm::length(to) * glm::length(onward);
      ends = std::max(ends, steep ? Ends::Steep : Ends::Grazing);
    }
    return ends;
  }

  /// How far apart points are as seen from the reflector's place, rad.
  double angleBetween(const glm::dvec3& a, const glm::dvec3& b) const {
    const double away = std::max(0.5 * reflector_.size(), reflector_.distanceFrom(0.5 * (a + b)));
    return glm::distance(a, b) / away;
  }
  /// ... in pixels
  float apparent(const Place& a, const Place& b) const {
    return static_cast<float>(angleBetween(a.position, b.position) / projection_.spread());
  }
  /// Whether there may be reflections between two places that neither has.
  bool isBlind(const Place& a, const Place& b) const {
    return hasBlind_ && angleBetween(a.position, b.position) > kBlindEdge;
  }

  /// Whether an edge must be looked at in its middle, and whether it must be halved without.
  enum class Look { No, Middle, Halve };
  Look lookAt(const Edge& edge, bool ordered) const {
    const std::uint32_t countA = glimpses_[edge.a].count;
    const std::uint32_t countB = glimpses_[edge.b].count;
    if (isBlind(places_[edge.a], places_[edge.b])) return Look::Halve;
    if (ordered) {
      for (std::size_t i = 0; i < countA; ++i) {
        if (mayMiss(edge, i, i)) return Look::Middle;
      }
      return Look::No;
    }
    const Place& a = places_[edge.a];
    const Place& b = places_[edge.b];
    if (countA == 0 && countB == 0) {
      if (a.straight || b.straight) return Look::No;
      return angleBetween(a.position, b.position) > kBlindEdge ? Look::Halve : Look::No;
    }
    if (countA != countB) {
      // At the rim of a convex reflector an image comes to lie where the point itself is seen; a
      // concave one's ends anywhere
      const auto pa = straightOf(a);
      const auto pb = straightOf(b);
      if (pa && pb && (glm::distance(*pa, *pb) < kShortRim || !projection_.inFrame({*pa, *pb}))) {
        const Ends ends = std::max(endsOn(a, b), endsOn(b, a));
        if (ends == Ends::None ||
            glm::distance(*pa, *pb) < (ends == Ends::Steep ? kShortSteep : kShortRim))
          return Look::No;
      } else if (reflector_.hides() && apparent(a, b) < kShortRim) {
        // Behind the camera
        const Ends ends = std::max(endsOn(a, b), endsOn(b, a));
        if (ends != Ends::Steep || apparent(a, b) < kShortSteep) return Look::No;
      }
      // ... and nothing tells how near the end of an image through a lens is
      if (exactMiddles_ && !reflector_.hides()) {
        const auto seenA = projection_(a.position);
        const auto seenB = projection_(b.position);
        if (seenA && seenB && glm::distance(*seenA, *seenB) < kShortThrough) return Look::No;
      }
      return Look::Halve;
    }
    const Counterparts ofB = counterparts(a.reflections, b.reflections);
    for (std::size_t i = 0; i < countA; ++i) {
      if (ofB[i] == kMaxReflections) return Look::Halve;
      if (mayMiss(edge, i, ofB[i])) return Look::Middle;
    }
    return Look::No;
  }

  /// Whether reflection `i` of an edge's first end may miss its middle on the way to `j` of the
  /// other: not what is behind the camera.
  bool mayMiss(const Edge& edge, std::size_t i, std::size_t j) const {
    const Vec2 xa = seen(edge.a, i);
    const Vec2 xb = seen(edge.b, j);
    return glm::distance(xa, xb) > kShortEdge * options_.errorPixels &&
           projection_.inFrame({xa, xb});
  }

  /// Where the camera shows a place's reflection; x NaN: behind it.
  Vec2 seen(std::size_t place, std::size_t i) const {
    const Glimpse& glimpse = glimpses_[place];
    return i < glimpse.seen.size() ? glimpse.seen[i] : seenAt(places_[place].reflections.at[i]);
  }
  /// A virtual point is seen where its reflection is.
  Vec2 seenAt(const Reflection& reflection) const {
    return projection_(reflection.x).value_or(Vec2(std::numeric_limits<float>::quiet_NaN()));
  }
  /// After a place's reflections have changed.
  void project(std::size_t place) {
    const Reflections& reflections = places_[place].reflections;
    Glimpse& glimpse = glimpses_[place];
    glimpse.count = reflections.count;
    for (std::size_t i = 0; i < std::min<std::size_t>(glimpse.seen.size(), glimpse.count); ++i)
      glimpse.seen[i] = seenAt(reflections.at[i]);
  }

  /// Whether the middle of an edge shows where its ends say.
  bool misses(const Edge& edge, std::size_t place) const {
    const Place& middle = places_[place];
    const Reflections& a = places_[edge.a].reflections;
    const Reflections& b = places_[edge.b].reflections;
    if (a.count == 0 && b.count == 0) return middle.reflections.count > 0;
    for (std::size_t i = 0; i < a.count; ++i) {
      const std::size_t j = counterpart(a, i, b);
      if (j == kMaxReflections) return true;
      const glm::dvec3 image = 0.5 * (a.at[i].image + b.at[j].image);
      const std::size_t k = nearestTo(middle.reflections, 0.5 * (a.at[i].x + b.at[j].x));
      if (k == kMaxReflections) return true;
      const auto expected = projection_(image);
      const Vec2 is = seen(place, k);
      if (!expected || std::isnan(is.x)) continue;
      if (projection_.inFrame({*expected, is}) &&
          glm::distance(*expected, is) > options_.errorPixels)
        return true;
    }
    return false;
  }

  /// Whether the images of a triangle's ends are apart by far more than the point itself is when it
  /// moves from one to the other: they are different reflections.
  bool torn(const Triangle& t) const {
    for (std::size_t c = 0; c < 3; ++c) {
      const Place& a = placeAt(t[c]);
      const Place& b = placeAt(t[(c + 1) % 3]);
      for (std::size_t i = 0; i < a.reflections.count; ++i) {
        const std::size_t j = counterpart(a.reflections, i, b.reflections);
        if (j != kMaxReflections &&
            glm::distance(seen(placeOf(t[c]), i), seen(placeOf(t[(c + 1) % 3]), j)) > kTornEdge)
          return true;
      }
    }
    return false;
  }

  /// One round: what need not be halved is put out, the rest comes back in pieces.
  std::vector<Triangle> halve(const std::vector<Triangle>& triangles, const Edges& edges,
                              bool mayHalve) {
    const std::vector<std::uint8_t> states = spread(edges.ends);

    // Middles of those that may be too long
    std::vector<Look> looks(edges.ends.size());
    parallelFor(looks.size(), kGrain, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i)
        looks[i] = lookAt(edges.ends[i], (states[i] & kInOrder) != 0);
    });
    std::vector<std::uint32_t> numbers;
    std::vector<Edge> looked;
    for (std::uint32_t i = 0; i < looks.size(); ++i) {
      if (looks[i] == Look::No) continue;
      numbers.push_back(i);
      looked.push_back(edges.ends[i]);
    }
    const std::size_t first = places_.size();
    // What they will trace at least: what one of their ends shows
    std::uint64_t traced = counts_.paths.retraced;
    for (const Edge& edge : looked)
      traced += std::max({1u, glimpses_[edge.a].count, glimpses_[edge.b].count});
    if (exactMiddles_ && !looked.empty() && traced > options_.maxTraced) {
      counts_.coarse = 1;
      looked.clear();
    }
    addPlaces(looked.size());
    for (std::size_t i = 0; i < looked.size(); ++i)
      places_[first + i].position =
          0.5 * (places_[looked[i].a].position + places_[looked[i].b].position);
    lookUp(first, looked);
    std::vector<std::uint8_t> halved(looked.size());
    parallelFor(looked.size(), kGrain, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i)
        halved[i] = looks[numbers[i]] == Look::Halve || misses(looked[i], first + i) ? 1 : 0;
    });

    // The middles' places, and the vertices there: one for each pair of vertices
    struct Middle {
      std::uint32_t a;
      std::uint32_t b;
      std::uint32_t vertex;
      std::uint32_t next;
    };
    std::vector<std::uint32_t> places(edges.ends.size(), kNone);
    std::vector<std::uint32_t> firsts(edges.ends.size(), kNone);
    std::vector<Middle> middles;
    std::vector<bool> ended(edges.ends.size());  // that miss their middle and stay as they are
    for (std::size_t i = 0; i < looked.size(); ++i) {
      if (halved[i] == 0) continue;
      ended[numbers[i]] =
          !mayHalve || apparent(places_[looked[i].a], places_[looked[i].b]) < kShortest;
      if (!ended[numbers[i]]) places[numbers[i]] = static_cast<std::uint32_t>(first + i);
    }
    const auto middleOf = [&](std::uint32_t a, std::uint32_t b, std::uint32_t edge) {
      if (places[edge] == kNone) return kNone;
      if (a > b) std::swap(a, b);
      for (std::uint32_t i = firsts[edge]; i != kNone; i = middles[i].next) {
        if (middles[i].a == a && middles[i].b == b) return middles[i].vertex;
      }
      const std::uint32_t vertex = addVertex(places[edge], mixed(attributesOf(a), attributesOf(b)));
      middles.push_back({a, b, vertex, firsts[edge]});
      firsts[edge] = static_cast<std::uint32_t>(middles.size() - 1);
      return vertex;
    };

    // Most triangles are put out as they are: in parts, each in their order
    numberVertices();
    const auto isWhole = [&](std::size_t i) {
      const std::uint32_t* of = &edges.of[3 * i];
      const Triangle& t = triangles[i];
      return places[of[0]] == kNone && places[of[1]] == kNone && places[of[2]] == kNone &&
             !ended[of[0]] && !ended[of[1]] && !ended[of[2]] &&
             (states[of[0]] & states[of[2]] & kInOrder) != 0 && allNumbered(t);
    };
    struct Part {
      std::vector<std::uint32_t> indices;
      struct Rest {
        std::size_t triangle;
        std::size_t before;  ///< indices that come before it
      };
      std::vector<Rest> rest;
    };
    std::vector<Part> parts((triangles.size() + kPutGrain - 1) / kPutGrain);
    parallelFor(parts.size(), 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t p = begin; p < end; ++p) {
        Part& part = parts[p];
        const std::size_t last = std::min(triangles.size(), (p + 1) * kPutGrain);
        part.indices.reserve(3 * (last - p * kPutGrain));
        for (std::size_t i = p * kPutGrain; i < last; ++i) {
          if (!isWhole(i)) {
            part.rest.push_back({i, part.indices.size()});
            continue;
          }
          const Triangle& t = triangles[i];
          for (std::uint32_t k = 0; k < numbers_[t[0]].count; ++k) {
            const std::array<std::uint32_t, 3> corners{
                numbers_[t[0]].first + k, numbers_[t[1]].first + k, numbers_[t[2]].first + k};
            if (shows(corners))
              part.indices.insert(part.indices.end(), corners.begin(), corners.end());
          }
        }
      }
    });

    std::vector<Triangle> pieces;
    const auto putRest = [&](std::size_t i) {
      const Triangle& t = triangles[i];
      const std::uint32_t* of = &edges.of[3 * i];
      const auto count = (places[of[0]] != kNone ? 1 : 0) + (places[of[1]] != kNone ? 1 : 0) +
                         (places[of[2]] != kNone ? 1 : 0);
      if (count == 0) {
        if (!jumps_ && (ended[of[0]] || ended[of[1]] || ended[of[2]]) && torn(t)) {
          if (exactMiddles_) {
            mixed_.push_back(t);
          } else {
            ++counts_.dropped;
          }
        } else {
          put(t, (states[of[0]] & states[of[2]] & kInOrder) != 0);
        }
        return;
      }
      const std::array<std::uint32_t, 3> m{middleOf(t[0], t[1], of[0]), middleOf(t[1], t[2], of[1]),
                                           middleOf(t[2], t[0], of[2])};
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
    };
    for (const Part& part : parts) {
      std::size_t done = 0;
      const auto copyUpTo = [&](std::size_t end) {
        result_.indices.insert(result_.indices.end(),
                               part.indices.begin() + static_cast<std::ptrdiff_t>(done),
                               part.indices.begin() + static_cast<std::ptrdiff_t>(end));
        done = end;
      };
      for (const auto& [triangle, before] : part.rest) {
        copyUpTo(before);
        putRest(triangle);
      }
      copyUpTo(part.indices.size());
    }
    return pieces;
  }

  /// Puts out all reflections of the vertices that are new, and numbers them.
  void numberVertices() {
    const std::size_t old = numbers_.size();
    numbers_.resize(placeOf_.size() + more_.size());
    std::size_t end = putOut_;
    for (std::size_t v = old; v < numbers_.size(); ++v) {
      numbers_[v] = {static_cast<std::uint32_t>(end),
                     glimpses_[placeOf(static_cast<std::uint32_t>(v))].count};
      end += numbers_[v].count;
    }
    makeRoom(end);
    parallelFor(numbers_.size() - old, kPutGrain, [&](std::size_t begin, std::size_t last) {
      for (std::size_t v = old + begin; v < old + last; ++v) {
        const auto vertex = static_cast<std::uint32_t>(v);
        for (std::uint32_t i = 0; i < numbers_[v].count; ++i) {
          putOut(numbers_[v].first + i, vertex, placeAt(vertex).reflections.at[i],
                 seen(placeOf(vertex), i));
        }
      }
    });
    putOut_ = end;
  }
  bool allNumbered(const Triangle& t) const {
    return std::all_of(t.begin(), t.end(), [&](std::uint32_t vertex) {
      return numbers_[vertex].count == glimpses_[placeOf(vertex)].count;
    });
  }

  /// Room for so many vertices; that of updates before is not given back.
  void makeRoom(std::size_t vertices) {
    if (result_.positions.size() < vertices) {
      result_.positions.resize(vertices);
      result_.attributes.resize(vertices);
      result_.images.resize(vertices);
    }
    if (seenVertices_.size() < vertices) seenVertices_.resize(vertices);
    if (reflector_.before() && result_.places.size() < vertices) result_.places.resize(vertices);
  }
  void putOut(std::size_t number, std::uint32_t vertex, const Reflection& r, const Vec2& seen) {
    result_.positions[number] = Vec3(placeAt(vertex).position);
    result_.attributes[number] = attributesOf(vertex);
    result_.images[number] = Vec4(r.image, r.share);
    if (reflector_.before()) result_.places[number] = Vec3(r.last);
    seenVertices_[number] = seen;
  }

  /// The number of a vertex' reflection among those that are put out; kMaxReflections: the point
  /// itself, at the rim where reflection and straight view meet.
  std::uint32_t put(std::uint32_t vertex, std::size_t reflection) {
    if (vertex < numbers_.size() && reflection < numbers_[vertex].count)
      return numbers_[vertex].first + static_cast<std::uint32_t>(reflection);
    const auto [known, isNew] =
        putMore_.try_emplace({vertex, reflection}, static_cast<std::uint32_t>(putOut_));
    if (!isNew) return known->second;
    const bool straight = reflection == kMaxReflections;
    const Place& place = placeAt(vertex);
    const Reflection& r = straight ? *place.straight : place.reflections.at[reflection];
    makeRoom(putOut_ + 1);
    putOut(putOut_++, vertex, r, straight ? seenAt(r) : seen(placeOf(vertex), reflection));
    return known->second;
  }

  /// Whether a reflection is about to become the straight view of a hidden point.
  bool atRim(const Reflection& reflection, const Reflection& straight) const {
    const auto seen = projection_(reflection.x);
    const auto hidden = projection_(straight.x);
    return seen && hidden && glm::distance(*seen, *hidden) < kRimReach;
  }

  /// One triangle for each reflection that its vertices share, `ordered`: all, in the same order;
  /// where some lack one, what there is of it later, by putMixed().
  void put(const Triangle& t, bool ordered) {
    if (ordered) {
      for (std::size_t i = 0; i < placeAt(t[0]).reflections.count; ++i)
        putCorners({put(t[0], i), put(t[1], i), put(t[2], i)});
      return;
    }
    std::size_t seen = 0;
    for (std::size_t c = 1; c < 3; ++c) {
      if (placeAt(t[c]).reflections.count > placeAt(t[seen]).reflections.count) seen = c;
    }
    const Reflections& a = placeAt(t[seen]).reflections;
    const std::array<std::uint32_t, 2> others{t[(seen + 1) % 3], t[(seen + 2) % 3]};
    std::array<Counterparts, 2> of;
    for (std::size_t c = 0; c < 2; ++c) of[c] = counterparts(a, placeAt(others[c]).reflections);
    std::array<std::array<std::uint32_t, 3>, kMaxReflections> whole;
    std::size_t wholes = 0;
    bool all = true;
    for (std::size_t i = 0; i < a.count; ++i) {
      std::array<std::size_t, 2> number{};
      for (std::size_t c = 0; c < 2; ++c) number[c] = of[c][i];
      // The rim, as near as the order lets one see
      const auto rim = [&](std::size_t c) {
        const Place& other = placeAt(others[c]);
        return number[c] == kMaxReflections && !exactMiddles_ && other.straight &&
               atRim(a.at[i], *other.straight);
      };
      if ((number[0] == kMaxReflections && !rim(0)) || (number[1] == kMaxReflections && !rim(1))) {
        all = false;
        continue;
      }
      whole[wholes++] = {put(t[seen], i), put(others[0], number[0]), put(others[1], number[1])};
    }
    if (exactMiddles_ && !all) {
      mixed_.push_back(t);
      return;
    }
    for (std::size_t i = 0; i < wholes; ++i) putCorners(whole[i]);
    counts_.dropped += a.count - wholes;
  }

  /// A reflection that vertex (or place) `have` has and `lacking` does not: it ends between them.
  struct Border {
    std::uint32_t have = 0;
    std::uint32_t number = 0;
    std::uint32_t lacking = 0;
    bool operator==(const Border&) const = default;
    bool operator<(const Border& other) const {
      return std::tie(have, number, lacking) < std::tie(other.have, other.number, other.lacking);
    }
  };
  Border placesOf(const Border& border) const {
    return {placeOf(border.have), border.number, placeOf(border.lacking)};
  }
  static void sortOnce(std::vector<Border>& borders) {
    std::sort(borders.begin(), borders.end());
    borders.erase(std::unique(borders.begin(), borders.end()), borders.end());
  }
  static std::size_t numberIn(const std::vector<Border>& borders, const Border& border) {
    return static_cast<std::size_t>(std::lower_bound(borders.begin(), borders.end(), border) -
                                    borders.begin());
  }

  /// Where a reflection ends between two places, and the part of the way there: halving what is
  /// left of the edge, from exact path to exact path.
  std::pair<Place, double> endOf(const Border& border, PathCounts& counts) const {
    const Place& from = places_[border.have];
    const Place& to = places_[border.lacking];
    Reflections known;
    known.count = 1;
    known.at[0] = from.reflections.at[border.number];
    double low = 0.0;
    double high = 1.0;
    for (int step = 0; step < kBorderSteps; ++step) {
      const double t = 0.5 * (low + high);
      Reflections found;
      reflector_.addReflectionsNear(glm::mix(from.position, to.position, t), known, found, counts);
      const bool goesOn = found.count > 0 && near(found.at[0], known.at[0], kTornEdge);
      if (goesOn) known = found;
      (goesOn ? low : high) = t;
    }
    Place end;
    end.position = glm::mix(from.position, to.position, low);
    end.reflections = std::move(known);
    return {std::move(end), low};
  }

  bool near(const Reflection& a, const Reflection& b, float pixels) const {
    const auto at = projection_(a.x);
    const auto other = projection_(b.x);
    return at && other && glm::distance(*at, *other) < pixels;
  }

  /// What there is of each reflection of the triangles whose vertices do not share it.
  void putMixed() {
    std::vector<Border> borders;
    for (const Triangle& t : mixed_) {
      forPieces(t, [&](std::span<const Corner> corners) {
        for (const Corner& c : corners) {
          if (c.isBorder) borders.push_back(c.border);
        }
      });
    }
    sortOnce(borders);
    std::vector<Border> between;  // the same of places
    for (const Border& border : borders) between.push_back(placesOf(border));
    sortOnce(between);
    const std::size_t first = places_.size();
    addPlaces(between.size());
    std::vector<double> shares(between.size());
    std::mutex mutex;
    parallelFor(between.size(), 64, [&](std::size_t begin, std::size_t end) {
      TriangleCounts own;
      for (std::size_t i = begin; i < end; ++i) {
        std::tie(places_[first + i], shares[i]) = endOf(between[i], own.paths);
        project(first + i);
      }
      const std::lock_guard lock(mutex);
      counts_.add(own);
    });
    const std::size_t firstEnd = placeOf_.size() + more_.size();
    for (const Border& border : borders) {
      const std::size_t i = numberIn(between, placesOf(border));
      addVertex(static_cast<std::uint32_t>(first + i),
                mixed(attributesOf(border.have), attributesOf(border.lacking),
                      static_cast<float>(shares[i])));
    }
    numberVertices();
    const auto vertexOf = [&](const Corner& c) {
      return c.isBorder ? static_cast<std::uint32_t>(firstEnd + numberIn(borders, c.border))
                        : c.border.have;
    };
    const auto shareOf = [&](const Corner& c) {
      return shares[numberIn(between, placesOf(c.border))];
    };
    const auto numberOf = [](const Corner& c) { return c.isBorder ? 0 : c.border.number; };
    const auto vertex = [&](const Corner& c) { return put(vertexOf(c), numberOf(c)); };
    const auto reflection = [&](const Corner& c) -> const Reflection& {
      return placeAt(vertexOf(c)).reflections.at[numberOf(c)];
    };
    for (const Triangle& t : mixed_) {
      std::vector<std::vector<Corner>> pieces;
      forPieces(t, [&](std::span<const Corner> corners) {
        for (std::size_t c = 2; c < corners.size(); ++c)
          putCorners({vertex(corners[0]), vertex(corners[c - 1]), vertex(corners[c])});
        pieces.emplace_back(corners.begin(), corners.end());
      });
      // Two reflections that end in one place of an edge merge there: what is left between them is
      // a strip. At rims each ends for itself.
      for (std::size_t p = 0; p < pieces.size(); ++p) {
        for (std::size_t q = p + 1; q < pieces.size(); ++q) {
          const auto ends = [&](std::size_t piece) {
            std::vector<Corner> border;
            for (const Corner& c : pieces[piece]) {
              if (c.isBorder) border.push_back(c);
            }
            return border;
          };
          const std::vector<Corner> a = ends(p);
          const std::vector<Corner> b = ends(q);
          if (a.size() != 2 || b.size() != 2) continue;
          const auto same = [](const Corner& x, const Corner& y) {
            return x.border.have == y.border.have && x.border.lacking == y.border.lacking;
          };
          if (!same(a[0], b[0]) || !same(a[1], b[1])) continue;
          const auto merge = [&](const Corner& x, const Corner& y) {
            const auto xs = projection_(reflection(x).x);
            const auto ys = projection_(reflection(y).x);
            const double apart = std::abs(shareOf(x) - shareOf(y));
            if (!xs || !ys || apart > std::ldexp(1.0, -kBorderSteps) ||
                !(glm::distance(*xs, *ys) < kWidestFold * projection_.height()))
              return false;
            // They come nearer to each other ...
            const auto start = [&](const Corner& corner) {
              return seen(placeOf(corner.border.have), corner.border.number);
            };
            return glm::distance(*xs, *ys) <= glm::distance(start(x), start(y));
          };
          if (!merge(a[0], b[0]) || !merge(a[1], b[1])) continue;
          // ... and are each other's mirror images
          const auto turnsLeft = [&](std::size_t piece) {
            float twice = 0.0f;
            const std::vector<Corner>& corners = pieces[piece];
            for (std::size_t c = 0; c < corners.size(); ++c) {
              const Vec2 from = seenAt(reflection(corners[c]));
              const Vec2 to = seenAt(reflection(corners[(c + 1) % corners.size()]));
              twice += from.x * to.y - from.y * to.x;
            }
            return twice > 0.0f;
          };
          if (turnsLeft(p) == turnsLeft(q)) continue;
          putCorners({vertex(a[0]), vertex(a[1]), vertex(b[1])});
          putCorners({vertex(a[0]), vertex(b[1]), vertex(b[0])});
        }
      }
    }
  }

  /// A vertex of a piece: a reflection of a node, or the end of it towards another node.
  struct Corner {
    Border border;
    bool isBorder = false;
  };
  /// What there is of each reflection of a triangle, three to four corners.
  template <class Put>
  void forPieces(const Triangle& t, const Put& putPiece) const {
    std::array<std::uint64_t, 3> done{};
    for (std::size_t k = 0; k < 3; ++k) {
      const Reflections& mine = placeAt(t[k]).reflections;
      for (std::size_t i = 0; i < mine.count; ++i) {
        if ((done[k] >> i & 1) != 0) continue;
        std::array<std::size_t, 3> number{};
        for (std::size_t c = 0; c < 3; ++c) {
          number[c] = c == k ? i : counterpart(mine, i, placeAt(t[c]).reflections);
          if (number[c] == kMaxReflections) continue;
          // The nearest one need not be the same
          const float apart = glm::distance(seen(placeOf(t[k]), i), seen(placeOf(t[c]), number[c]));
          if (apart > std::max(kTornEdge, kStretch * apparent(placeAt(t[k]), placeAt(t[c])))) {
            number[c] = kMaxReflections;
            continue;
          }
          if ((done[c] >> number[c] & 1) != 0) {
            number[c] = kMaxReflections;
          } else {
            done[c] |= std::uint64_t{1} << number[c];
          }
        }
        // Around the triangle, with the ends of its edges that leave the reflection
        std::array<Corner, 4> corners;
        std::size_t count = 0;
        for (std::size_t c = 0; c < 3; ++c) {
          const std::size_t next = (c + 1) % 3;
          const auto at = [&](std::size_t x) { return static_cast<std::uint32_t>(number[x]); };
          const bool has = number[c] != kMaxReflections;
          const bool hasNext = number[next] != kMaxReflections;
          if (has) corners[count++] = {{t[c], at(c), 0}, false};
          if (has && !hasNext) corners[count++] = {{t[c], at(c), t[next]}, true};
          if (!has && hasNext) corners[count++] = {{t[next], at(next), t[c]}, true};
        }
        putPiece(std::span<const Corner>(corners.data(), count));
      }
    }
  }

  void putCorners(const std::array<std::uint32_t, 3>& corners) {
    if (shows(corners))
      result_.indices.insert(result_.indices.end(), corners.begin(), corners.end());
  }

  /// Whether a triangle may be in the frame.
  bool shows(const std::array<std::uint32_t, 3>& corners) const {
    const Vec2& a = seenVertices_[corners[0]];
    const Vec2& b = seenVertices_[corners[1]];
    const Vec2& c = seenVertices_[corners[2]];
    return std::isnan(a.x + b.x + c.x) || projection_.inFrame({a, b, c});
  }

  const Reflector& reflector_;
  Projection projection_;
  bool exactMiddles_;
  bool jumps_;
  bool own_ = false;
  bool hasBlind_ = false;  ///< edges of the mesh that isBlind()
  TriangleOptions options_;
  TriangleCounts& counts_;
  Scratch scratch_;
  std::vector<Place>& places_ = scratch_.places;
  std::vector<Glimpse>& glimpses_ = scratch_.glimpses;  ///< by place
  // Vertices: the mesh's, then more
  std::span<const Vec3> positions_;
  std::span<const frame::VertexAttributes> attributes_;
  std::vector<std::uint32_t>& placeOf_ = scratch_.placeOf;
  std::vector<std::uint32_t>& firstAt_ = scratch_.firstAt;  ///< by place of the mesh: a vertex
  std::vector<Node> more_;
  std::vector<Triangle> mixed_;  ///< whose vertices do not share all reflections
  // What is put out: by vertex, and what was found or asked for after its vertex was numbered
  raster::VirtualTriangles& result_;
  std::size_t putOut_ = 0;  ///< of its vertices
  std::vector<Numbers>& numbers_ = scratch_.numbers;
  std::map<std::pair<std::uint32_t, std::size_t>, std::uint32_t> putMore_;
  std::vector<Vec2>& seenVertices_ = scratch_.seenVertices;  ///< pixels; x NaN: behind the camera
};

}  // namespace

void TriangleCounts::add(const TriangleCounts& other) {
  paths.add(other.paths);
  vertices += other.vertices;
  triangles += other.triangles;
  dropped += other.dropped;
  coarse += other.coarse;
}

void virtualTriangles(const frame::Geometry& geometry, int object, const Reflector& reflector,
                      bool own, const View& view, Order order, const TriangleOptions& options,
                      Connectivity& known, TriangleCounts& counts,
                      raster::VirtualTriangles& result) {
  Builder(reflector, view, order, options, counts, result).build(geometry, object, own, known);
}

raster::VirtualTriangles mirroredTriangles(const frame::Geometry& geometry, int object,
                                           std::span<const Plane<double>> planes,
                                           const glm::dvec3& eye, TriangleCounts& counts) {
  const frame::ObjectRange& range = geometry.objects[static_cast<std::size_t>(object)];
  raster::VirtualTriangles result;
  result.object = object + 1;
  for (std::uint32_t i = range.firstVertex; i < range.firstVertex + range.vertexCount; ++i) {
    const Vec3& p = geometry.positions[i];
    Vector<double> image{{p.x, p.y, p.z}};
    for (std::size_t plane = planes.size(); plane-- > 0;) image = mirrored(planes[plane], image);
    result.positions.push_back(p);
    result.attributes.push_back(geometry.attributes[i]);
    result.images.emplace_back(image[0], image[1], image[2], 1.0f);
  }
  if (planes.size() > 1) {
    // Whatever shows a vertex, it does as from the eye's mirror image
    Vector<double> seen{{eye.x, eye.y, eye.z}};
    for (const Plane<double>& plane : planes) seen = mirrored(plane, seen);
    result.places.assign(range.vertexCount, Vec3(seen[0], seen[1], seen[2]));
  }
  // What lies in the mirror that would show it is never seen there: its image, in the mirror too,
  // would be in front of the mirror's surface or behind it as rounding has it
  constexpr double kInPlane = 5e-7;  // of the coordinates: a few roundings of floats. Ours
  const Plane<double>& last = planes.back();
  const auto inPlane = [&](std::uint32_t vertex) {
    const Vec3& p = geometry.positions[vertex];
    const Vector<double> v{{p.x, p.y, p.z}};
    const double size = std::sqrt(dot(v, v)) + std::abs(last.offset);
    return std::abs(dot(last.normal, v) - last.offset) <= kInPlane * size;
  };
  for (std::uint32_t i = range.firstIndex; i < range.firstIndex + range.indexCount; i += 3) {
    const std::uint32_t* corner = &geometry.indices[i];
    if (inPlane(corner[0]) && inPlane(corner[1]) && inPlane(corner[2])) continue;
    for (int k = 0; k < 3; ++k) result.indices.push_back(corner[k] - range.firstVertex);
  }
  counts.vertices += range.vertexCount;
  counts.triangles += result.indices.size() / 3;
  return result;
}

}  // namespace catoptric::methods::perturbation
