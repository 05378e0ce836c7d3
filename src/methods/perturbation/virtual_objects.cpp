#include "methods/perturbation/virtual_objects.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <mutex>
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
/// Edges on which an image through a lens ends are halved down to this length without the lens,
/// pixels (ours: half of it brings L1_8bit from 0.39 to 0.37 in a third more time).
constexpr float kShortThrough = 0.5f;
/// Reflections are that near to the straight view of a hidden point there, pixels (ours).
constexpr float kRimReach = 6.0f;
/// Edges without any reflection are halved when longer than this part of their distance from the
/// reflector: their middle may have one (ours).
constexpr float kBlindEdge = 0.7f;
/// The same through a lens, where they are halved whatever their middle has (ours).
constexpr float kBlindThrough = 0.25f;
/// Pixels around the frame in which edges are looked at (ours).
constexpr float kMargin = 8.0f;
/// Edges that miss their middle after all halvings are torn when longer than this, pixels (ours).
constexpr float kTornEdge = 6.0f;
/// Two reflections about a caustic are joined up to this distance, of the image's height (ours).
constexpr float kWidestFold = 1.0f / 12.0f;
/// Halvings of the edge on which a reflection ends (ours).
constexpr int kBorderSteps = 5;
/// Edges that a thread looks at in one go.
constexpr std::size_t kGrain = 1024;
/// Over how many edges reflections are looked for in a round of halvings (ours).
constexpr int kSpreadRounds = 2;

struct Node {
  glm::dvec3 position;
  frame::VertexAttributes attributes;
  Reflections reflections;
  bool hidden = false;       ///< no reflection, and the reflector stands before it
  Reflection straight;       ///< where it would show without the reflector, if hidden
  std::array<Vec2, 2> seen;  ///< pixels of the first reflections; x NaN: behind the camera
};

using Triangle = std::array<std::uint32_t, 3>;

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
              glm::dmat4(scene::cameraFromWorld(view.camera))) {}

  float height() const { return size_.y; }

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

/// counterpart() of all reflections of `a`.
using Counterparts = std::array<std::size_t, kMaxReflections>;
Counterparts counterparts(const Reflections& a, const Reflections& b) {
  Counterparts result;
  if (a.count == 2 && b.count == 2) {
    // Most often the first belong together, and the second
    const auto apart2 = [&](std::size_t i, std::size_t j) {
      const glm::dvec3 way = a.at[i].x - b.at[j].x;
      return glm::dot(way, way);
    };
    const double same = std::max(apart2(0, 0), apart2(1, 1));
    if (same < apart2(0, 1) && same < apart2(1, 0)) {
      result[0] = 0;
      result[1] = 1;
      return result;
    }
  }
  for (std::size_t i = 0; i < a.count; ++i) result[i] = counterpart(a, i, b);
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
/// only one end is.
Reflections between(const Reflections& a, const Reflections& b) {
  Reflections guess = b;
  for (std::size_t i = 0; i < a.count; ++i) {
    const std::size_t j = counterpart(a, i, b);
    if (j != kMaxReflections) {
      guess.at[j].x = 0.5 * (a.at[i].x + b.at[j].x);
    } else if (guess.count < kMaxReflections) {
      guess.at[guess.count++] = a.at[i];
    }
  }
  return guess;
}

class Builder {
 public:
  Builder(const Reflector& reflector, const View& view, Order order, const TriangleOptions& options,
          TriangleCounts& counts)
      : reflector_(reflector),
        projection_(view),
        exactMiddles_(order == Order::Auto),
        jumps_(order == Order::Nearest),
        options_(options),
        counts_(counts) {}

  raster::VirtualTriangles build(const frame::Geometry& geometry, int object, bool own) {
    own_ = own;
    const frame::ObjectRange& range = geometry.objects[static_cast<std::size_t>(object)];
    // Room for middles: most objects are fine enough, and moving all nodes costs much
    nodes_.reserve(2 * std::size_t{range.vertexCount});
    nodes_.resize(range.vertexCount);
    for (std::uint32_t i = 0; i < range.vertexCount; ++i) {
      nodes_[i].position = glm::dvec3(geometry.positions[range.firstVertex + i]);
      nodes_[i].attributes = geometry.attributes[range.firstVertex + i];
    }
    lookUp(0, {});
    std::vector<Triangle> triangles(range.indexCount / 3);
    for (std::size_t t = 0; t < triangles.size(); ++t) {
      for (std::size_t c = 0; c < 3; ++c)
        triangles[t][c] = geometry.indices[range.firstIndex + 3 * t + c] - range.firstVertex;
    }
    // Nearest paths jump from sample to sample however short the edges are
    const int halvings = jumps_ || options_.errorPixels <= 0.0f ? 0 : options_.maxHalvings;
    for (int level = 0; !triangles.empty(); ++level) triangles = halve(triangles, level < halvings);
    putMixed();
    counts_.vertices += nodes_.size();
    counts_.triangles += result_.indices.size() / 3;
    result_.object = object + 1;
    return std::move(result_);
  }

 private:
  struct Edge {
    std::uint64_t ends;  ///< smaller number in the upper half
    std::uint32_t a() const { return static_cast<std::uint32_t>(ends >> 32); }
    std::uint32_t b() const { return static_cast<std::uint32_t>(ends); }
  };
  static std::uint64_t endsOf(std::uint32_t a, std::uint32_t b) {
    return static_cast<std::uint64_t>(std::min(a, b)) << 32 | std::max(a, b);
  }

  /// Reflections of the nodes from `first` on; `edges[i]` is what node first + i is the middle of.
  void lookUp(std::size_t first, std::span<const std::uint64_t> edges) {
    std::mutex mutex;
    parallelFor(nodes_.size() - first, 64, [&](std::size_t begin, std::size_t end) {
      TriangleCounts own;
      RayOctree::Cursor cursor;
      RayOctree::Cursor cursorBefore;
      Reflector::Traced traced;
      for (std::size_t i = begin; i < end; ++i) {
        Node& node = nodes_[first + i];
        if (!edges.empty() && exactMiddles_) {
          const Edge edge{edges[i]};
          const Reflections guess =
              between(nodes_[edge.a()].reflections, nodes_[edge.b()].reflections);
          reflector_.addReflectionsNear(node.position, guess, node.reflections, own.paths, &traced);
        }
        if (node.reflections.count == 0)
          node.reflections =
              reflector_.reflectionsOf(node.position, own_, cursor, own.paths, &traced);
        if (node.reflections.count == 0) {
          const auto straight = reflector_.hidden(node.position, cursorBefore, own.paths);
          node.hidden = straight.has_value();
          if (straight) node.straight = *straight;
        }
        project(node);
      }
      own.outside = cursor.outside;
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

  /// What one end of an edge found, the other is looked for at: the nearest rays need not lead to
  /// all reflections.
  void spread(const std::vector<std::uint64_t>& edges) {
    std::vector<bool> changed(nodes_.size(), true);
    for (int round = 0; round < kSpreadRounds; ++round) {
      std::vector<std::uint8_t> lacking(edges.size());  // 1: the first end, 2: the second
      parallelFor(edges.size(), kGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
          const Edge edge{edges[i]};
          const Node& a = nodes_[edge.a()];
          const Node& b = nodes_[edge.b()];
          if ((!changed[edge.a()] && !changed[edge.b()]) || a.hidden || b.hidden) continue;
          // Those that belong together do so both ways
          const bool lacksOne = lacks(a.reflections, b.reflections);
          if (lacksOne) lacking[i] |= 1;
          if (!lacksOne && a.reflections.count == b.reflections.count) continue;
          if (lacks(b.reflections, a.reflections)) lacking[i] |= 2;
        }
      });
      std::vector<std::pair<std::uint32_t, std::uint32_t>> wanted;  // node, neighbour
      for (std::size_t i = 0; i < edges.size(); ++i) {
        const Edge edge{edges[i]};
        if ((lacking[i] & 1) != 0) wanted.emplace_back(edge.a(), edge.b());
        if ((lacking[i] & 2) != 0) wanted.emplace_back(edge.b(), edge.a());
      }
      std::sort(wanted.begin(), wanted.end());
      std::vector<std::size_t> firsts;  // of each node's neighbours
      for (std::size_t i = 0; i < wanted.size(); ++i) {
        if (i == 0 || wanted[i].first != wanted[i - 1].first) firsts.push_back(i);
      }
      std::vector<Reflections> found(firsts.size());
      std::mutex mutex;
      parallelFor(firsts.size(), 32, [&](std::size_t begin, std::size_t end) {
        TriangleCounts own;
        for (std::size_t k = begin; k < end; ++k) {
          const Node& node = nodes_[wanted[firsts[k]].first];
          const std::size_t last = k + 1 < firsts.size() ? firsts[k + 1] : wanted.size();
          found[k] = node.reflections;
          for (std::size_t i = firsts[k]; i < last; ++i) {
            const Reflections more = news(nodes_[wanted[i].second].reflections, found[k]);
            reflector_.addReflectionsNear(node.position, more, found[k], own.paths);
          }
        }
        const std::lock_guard lock(mutex);
        counts_.add(own);
      });
      std::fill(changed.begin(), changed.end(), false);
      bool any = false;
      for (std::size_t k = 0; k < firsts.size(); ++k) {
        const std::uint32_t number = wanted[firsts[k]].first;
        if (found[k].count == nodes_[number].reflections.count) continue;
        nodes_[number].reflections = found[k];
        project(nodes_[number]);
        changed[number] = true;
        any = true;
      }
      if (!any) break;
    }
  }

  /// Where a node shows without the last reflector, pixels, as far as that is known: what shows by
  /// way of others before it may be hidden from those.
  std::optional<Vec2> straightOf(const Node& node) const {
    if (!reflector_.hides()) return std::nullopt;
    if (!reflector_.before()) return projection_(node.position);
    if (node.reflections.count > 0) return projection_(node.reflections.at[0].x);
    return node.hidden ? projection_(node.straight.x) : std::nullopt;
  }

  /// Whether an edge must be looked at in its middle, and whether it must be halved without.
  enum class Look { No, Middle, Halve };
  Look lookAt(const Edge& edge) const {
    const Node& a = nodes_[edge.a()];
    const Node& b = nodes_[edge.b()];
    const std::uint32_t most = std::max(a.reflections.count, b.reflections.count);
    if (most == 0) {
      if (a.hidden || b.hidden) return Look::No;
      const glm::dvec3 centre = 0.5 * (a.position + b.position);
      const double length = glm::distance(a.position, b.position);
      const double away = std::max(0.5 * reflector_.size(), reflector_.distanceFrom(centre));
      // A lens shows a part of what is behind it alone: it may lie between all middles
      if (!reflector_.hides())
        return length > static_cast<double>(kBlindThrough) * away ? Look::Halve : Look::No;
      return length > static_cast<double>(kBlindEdge) * away ? Look::Middle : Look::No;
    }
    if (a.reflections.count != b.reflections.count) {
      // At the rim an image comes to lie where the point itself is seen
      const auto pa = straightOf(a);
      const auto pb = straightOf(b);
      if (pa && pb && (glm::distance(*pa, *pb) < kShortRim || !projection_.inFrame({*pa, *pb}))) {
        const Node& one = a.reflections.count > 0 ? a : b;
        const auto seen = projection_(one.reflections.at[0].x);
        if (!seen || !projection_.inFrame({*seen}) || glm::distance(*pa, *pb) < kShortRim)
          return Look::No;
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
    for (std::size_t i = 0; i < a.reflections.count; ++i) {
      const std::size_t j = ofB[i];
      if (j == kMaxReflections) return Look::Halve;
      const auto xa = seen(a, i);
      const auto xb = seen(b, j);
      if (!xa || !xb) continue;
      if (projection_.inFrame({*xa, *xb}) &&
          glm::distance(*xa, *xb) > kShortEdge * options_.errorPixels)
        return Look::Middle;
    }
    return Look::No;
  }

  /// Where the camera shows a node's reflection.
  std::optional<Vec2> seen(const Node& node, std::size_t i) const {
    if (i >= node.seen.size()) return projection_(node.reflections.at[i].x);
    if (std::isnan(node.seen[i].x)) return std::nullopt;
    return node.seen[i];
  }
  void project(Node& node) const {
    for (std::size_t i = 0; i < std::min<std::size_t>(node.seen.size(), node.reflections.count);
         ++i)
      node.seen[i] = projection_(node.reflections.at[i].x)
                         .value_or(Vec2(std::numeric_limits<float>::quiet_NaN()));
  }

  /// Whether the middle of an edge shows where its ends say.
  bool misses(const Edge& edge, const Node& middle) const {
    const Reflections& a = nodes_[edge.a()].reflections;
    const Reflections& b = nodes_[edge.b()].reflections;
    if (a.count == 0 && b.count == 0) return middle.reflections.count > 0;
    for (std::size_t i = 0; i < a.count; ++i) {
      const std::size_t j = counterpart(a, i, b);
      if (j == kMaxReflections) return true;
      const glm::dvec3 image = 0.5 * (a.at[i].image + b.at[j].image);
      const std::size_t k = nearestTo(middle.reflections, 0.5 * (a.at[i].x + b.at[j].x));
      if (k == kMaxReflections) return true;
      const auto expected = projection_(image);
      const auto seen = projection_(middle.reflections.at[k].x);
      if (!expected || !seen) continue;
      if (projection_.inFrame({*expected, *seen}) &&
          glm::distance(*expected, *seen) > options_.errorPixels)
        return true;
    }
    return false;
  }

  /// Whether the images of a triangle's ends are apart by far more than the point itself is when it
  /// moves from one to the other: they are different reflections.
  bool torn(const Triangle& t) const {
    for (std::size_t c = 0; c < 3; ++c) {
      const Node& a = nodes_[t[c]];
      const Node& b = nodes_[t[(c + 1) % 3]];
      for (std::size_t i = 0; i < a.reflections.count; ++i) {
        const std::size_t j = counterpart(a.reflections, i, b.reflections);
        if (j == kMaxReflections) continue;
        const auto xa = projection_(a.reflections.at[i].x);
        const auto xb = projection_(b.reflections.at[j].x);
        if (xa && xb && glm::distance(*xa, *xb) > kTornEdge) return true;
      }
    }
    return false;
  }

  /// One round: what need not be halved is put out, the rest comes back in pieces.
  std::vector<Triangle> halve(const std::vector<Triangle>& triangles, bool mayHalve) {
    // All edges, each once
    std::vector<std::uint64_t> edges;
    edges.reserve(3 * triangles.size());
    for (const Triangle& t : triangles) {
      for (std::size_t c = 0; c < 3; ++c) edges.push_back(endsOf(t[c], t[(c + 1) % 3]));
    }
    std::sort(edges.begin(), edges.end());
    edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
    if (exactMiddles_) spread(edges);

    // Middles of those that may be too long
    std::vector<Look> looks(edges.size());
    parallelFor(edges.size(), kGrain, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) looks[i] = lookAt({edges[i]});
    });
    std::vector<std::uint64_t> looked;
    for (std::size_t i = 0; i < edges.size(); ++i) {
      if (looks[i] == Look::No) continue;
      looks[looked.size()] = looks[i];
      looked.push_back(edges[i]);
    }
    const std::size_t first = nodes_.size();
    nodes_.resize(first + looked.size());
    for (std::size_t i = 0; i < looked.size(); ++i) {
      const Edge edge{looked[i]};
      Node& node = nodes_[first + i];
      node.position = 0.5 * (nodes_[edge.a()].position + nodes_[edge.b()].position);
      node.attributes = mixed(nodes_[edge.a()].attributes, nodes_[edge.b()].attributes);
    }
    lookUp(first, looked);
    std::vector<std::uint8_t> halved(looked.size());
    parallelFor(looked.size(), kGrain, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i)
        halved[i] = looks[i] == Look::Halve || misses({looked[i]}, nodes_[first + i]) ? 1 : 0;
    });
    constexpr std::uint32_t kWhole = ~0u;
    const auto middleOf = [&](std::uint32_t a, std::uint32_t b) {
      const std::uint64_t ends = endsOf(a, b);
      const auto found = std::lower_bound(looked.begin(), looked.end(), ends);
      if (found == looked.end() || *found != ends) return kWhole;
      const auto i = static_cast<std::size_t>(found - looked.begin());
      return halved[i] != 0 ? static_cast<std::uint32_t>(first + i) : kWhole;
    };

    std::vector<Triangle> pieces;
    for (const Triangle& t : triangles) {
      const std::array<std::uint32_t, 3> m{middleOf(t[0], t[1]), middleOf(t[1], t[2]),
                                           middleOf(t[2], t[0])};
      const auto count = 3 - std::count(m.begin(), m.end(), kWhole);
      if (!mayHalve && !jumps_ && count > 0 && torn(t)) {
        ++counts_.dropped;
      } else if (count == 0 || !mayHalve) {
        put(t);
      } else if (count == 3) {
        pieces.push_back({t[0], m[0], m[2]});
        pieces.push_back({m[0], t[1], m[1]});
        pieces.push_back({m[2], m[1], t[2]});
        pieces.push_back({m[0], m[1], m[2]});
      } else {
        // Turned so that edge 0 is halved, and where two are edge 1 too
        std::size_t c = 0;
        while (m[c] == kWhole || (count == 2 && m[(c + 1) % 3] == kWhole)) ++c;
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
    return pieces;
  }

  /// The number of a node's reflection among the vertices that are put out; kMaxReflections: the
  /// point itself, at the rim where reflection and straight view meet.
  std::uint32_t vertexOf(std::uint32_t node, std::size_t reflection) {
    if (vertexOf_.size() < nodes_.size()) vertexOf_.resize(nodes_.size());
    std::uint32_t& vertex = vertexOf_[node][reflection];
    if (vertex > 0) return vertex - 1;
    const Node& n = nodes_[node];
    result_.positions.emplace_back(n.position);
    result_.attributes.push_back(n.attributes);
    const Reflection& r = reflection == kMaxReflections ? n.straight : n.reflections.at[reflection];
    result_.images.emplace_back(r.image, r.share);
    seenVertices_.push_back(projection_(r.image));
    if (reflector_.before()) result_.places.emplace_back(r.last);
    vertex = static_cast<std::uint32_t>(result_.positions.size());
    return vertex - 1;
  }

  /// Whether a reflection is about to become the straight view of a hidden point.
  bool atRim(const Reflection& reflection, const Reflection& straight) const {
    const auto seen = projection_(reflection.x);
    const auto hidden = projection_(straight.x);
    return seen && hidden && glm::distance(*seen, *hidden) < kRimReach;
  }

  /// One triangle for each reflection that its vertices share; where some lack one, what there is
  /// of it later, by putMixed().
  void put(const Triangle& t) {
    std::size_t seen = 0;
    for (std::size_t c = 1; c < 3; ++c) {
      if (nodes_[t[c]].reflections.count > nodes_[t[seen]].reflections.count) seen = c;
    }
    const Reflections& a = nodes_[t[seen]].reflections;
    const std::array<std::uint32_t, 2> others{t[(seen + 1) % 3], t[(seen + 2) % 3]};
    std::array<Counterparts, 2> of;
    for (std::size_t c = 0; c < 2; ++c) of[c] = counterparts(a, nodes_[others[c]].reflections);
    std::array<std::array<std::uint32_t, 3>, kMaxReflections> whole;
    std::size_t wholes = 0;
    bool all = true;
    for (std::size_t i = 0; i < a.count; ++i) {
      std::array<std::size_t, 2> number{};
      for (std::size_t c = 0; c < 2; ++c) number[c] = of[c][i];
      // The rim, as near as the order lets one see
      const auto rim = [&](std::size_t c) {
        const Node& other = nodes_[others[c]];
        return number[c] == kMaxReflections && !exactMiddles_ && other.reflections.count == 0 &&
               other.hidden && atRim(a.at[i], other.straight);
      };
      if ((number[0] == kMaxReflections && !rim(0)) || (number[1] == kMaxReflections && !rim(1))) {
        all = false;
        continue;
      }
      whole[wholes++] = {vertexOf(t[seen], i), vertexOf(others[0], number[0]),
                         vertexOf(others[1], number[1])};
    }
    if (exactMiddles_ && !all) {
      mixed_.push_back(t);
      return;
    }
    for (std::size_t i = 0; i < wholes; ++i) putCorners(whole[i]);
    counts_.dropped += a.count - wholes;
  }

  /// A reflection that node `have` has and `lacking` does not: it ends between them.
  struct Border {
    std::uint32_t have = 0;
    std::uint32_t number = 0;
    std::uint32_t lacking = 0;
    bool operator==(const Border&) const = default;
    bool operator<(const Border& other) const {
      return std::tie(have, number, lacking) < std::tie(other.have, other.number, other.lacking);
    }
  };

  /// Where a reflection ends: halving what is left of the edge, from exact path to exact path.
  Node endOf(const Border& border, PathCounts& counts) const {
    const Node& from = nodes_[border.have];
    const Node& to = nodes_[border.lacking];
    Reflections known;
    known.count = 1;
    known.at[0] = from.reflections.at[border.number];
    double low = 0.0;
    double high = 1.0;
    for (int step = 0; step < kBorderSteps; ++step) {
      const double t = 0.5 * (low + high);
      Reflections found;
      reflector_.addReflectionsNear(glm::mix(from.position, to.position, t), known, found, counts);
      const bool goesOn =
          found.count > 0 && near(found.at[0], known.at[0], kWidestFold * projection_.height());
      if (goesOn) known = found;
      (goesOn ? low : high) = t;
    }
    Node end;
    end.position = glm::mix(from.position, to.position, low);
    end.attributes = mixed(from.attributes, to.attributes, static_cast<float>(low));
    end.reflections = known;
    return end;
  }

  bool near(const Reflection& a, const Reflection& b, float pixels) const {
    const auto at = projection_(a.x);
    const auto other = projection_(b.x);
    return at && other && glm::distance(*at, *other) < pixels;
  }

  /// What there is of each reflection of the triangles whose vertices do not share it.
  void putMixed() {
    borders_.clear();
    for (const Triangle& t : mixed_) {
      forPieces(t, [&](std::span<const Corner> corners) {
        for (const Corner& c : corners) {
          if (c.isBorder) borders_.push_back(c.border);
        }
      });
    }
    std::sort(borders_.begin(), borders_.end());
    borders_.erase(std::unique(borders_.begin(), borders_.end()), borders_.end());
    const std::size_t first = nodes_.size();
    nodes_.resize(first + borders_.size());
    std::mutex mutex;
    parallelFor(borders_.size(), 64, [&](std::size_t begin, std::size_t end) {
      TriangleCounts own;
      for (std::size_t i = begin; i < end; ++i) nodes_[first + i] = endOf(borders_[i], own.paths);
      const std::lock_guard lock(mutex);
      counts_.add(own);
    });
    const auto nodeOf = [&](const Corner& c) {
      if (!c.isBorder) return c.border.have;
      const auto found = std::lower_bound(borders_.begin(), borders_.end(), c.border);
      return static_cast<std::uint32_t>(first + static_cast<std::size_t>(found - borders_.begin()));
    };
    const auto numberOf = [](const Corner& c) { return c.isBorder ? 0 : c.border.number; };
    const auto vertex = [&](const Corner& c) { return vertexOf(nodeOf(c), numberOf(c)); };
    const auto reflection = [&](const Corner& c) -> const Reflection& {
      return nodes_[nodeOf(c)].reflections.at[numberOf(c)];
    };
    for (const Triangle& t : mixed_) {
      std::vector<std::vector<Corner>> pieces;
      forPieces(t, [&](std::span<const Corner> corners) {
        for (std::size_t c = 2; c < corners.size(); ++c)
          putCorners({vertex(corners[0]), vertex(corners[c - 1]), vertex(corners[c])});
        pieces.emplace_back(corners.begin(), corners.end());
      });
      // Two reflections that end together merge there: what is left between them is a strip
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
            const auto& from = nodes_[x.border.have].reflections.at;
            const auto xf = projection_(from[x.border.number].x);
            const auto yf = projection_(from[y.border.number].x);
            return xs && ys && xf && yf &&
                   glm::distance(*xs, *ys) < kWidestFold * projection_.height() &&
                   glm::distance(*xs, *ys) < 0.5f * glm::distance(*xf, *yf);
          };
          if (!merge(a[0], b[0]) || !merge(a[1], b[1])) continue;
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
    std::array<std::uint32_t, 3> done{};
    for (std::size_t k = 0; k < 3; ++k) {
      const Reflections& mine = nodes_[t[k]].reflections;
      for (std::size_t i = 0; i < mine.count; ++i) {
        if ((done[k] >> i & 1) != 0) continue;
        std::array<std::size_t, 3> number{};
        for (std::size_t c = 0; c < 3; ++c) {
          number[c] = c == k ? i : counterpart(mine, i, nodes_[t[c]].reflections);
          if (number[c] == kMaxReflections) continue;
          if ((done[c] >> number[c] & 1) != 0) {
            number[c] = kMaxReflections;
          } else {
            done[c] |= 1u << number[c];
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
    std::array<Vec2, 3> at;
    for (std::size_t c = 0; c < 3; ++c) {
      const auto& seen = seenVertices_[corners[c]];
      if (!seen) return true;
      at[c] = *seen;
    }
    return projection_.inFrame({at[0], at[1], at[2]});
  }

  const Reflector& reflector_;
  Projection projection_;
  bool exactMiddles_;
  bool jumps_;
  bool own_ = false;
  TriangleOptions options_;
  TriangleCounts& counts_;
  std::vector<Node> nodes_;
  std::vector<std::array<std::uint32_t, kMaxReflections + 1>> vertexOf_;  ///< number + 1
  std::vector<Triangle> mixed_;  ///< whose vertices do not share all reflections
  std::vector<Border> borders_;  ///< sorted
  raster::VirtualTriangles result_;
  std::vector<std::optional<Vec2>> seenVertices_;
};

}  // namespace

void TriangleCounts::add(const TriangleCounts& other) {
  paths.add(other.paths);
  vertices += other.vertices;
  triangles += other.triangles;
  dropped += other.dropped;
  outside += other.outside;
}

raster::VirtualTriangles virtualTriangles(const frame::Geometry& geometry, int object,
                                          const Reflector& reflector, bool own, const View& view,
                                          Order order, const TriangleOptions& options,
                                          TriangleCounts& counts) {
  return Builder(reflector, view, order, options, counts).build(geometry, object, own);
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
  for (std::uint32_t i = range.firstIndex; i < range.firstIndex + range.indexCount; ++i)
    result.indices.push_back(geometry.indices[i] - range.firstVertex);
  counts.vertices += range.vertexCount;
  counts.triangles += range.indexCount / 3;
  return result;
}

}  // namespace catoptric::methods::perturbation
