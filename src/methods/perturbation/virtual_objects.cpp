#include "methods/perturbation/virtual_objects.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <mutex>
#include <optional>
#include <span>
#include <utility>

#include "core/parallel.h"

namespace catoptric::methods::perturbation {
namespace {

/// Edges whose image is shorter than this many times the error allowed cannot miss their middle by
/// it (a circle's arc of a right angle misses its chord by a fifth of it; ours).
constexpr float kShortEdge = 6.0f;
/// Edges at the rim of what is reflected are halved down to this length, pixels (ours).
constexpr float kShortRim = 2.0f;
/// Reflections are that near to the straight view of a hidden point there, pixels (ours).
constexpr float kRimReach = 6.0f;
/// Edges without any reflection are halved when longer than this part of their distance from the
/// reflector: their middle may have one (ours).
constexpr float kBlindEdge = 0.7f;
/// Pixels around the frame in which edges are looked at (ours).
constexpr float kMargin = 8.0f;
/// Edges that miss their middle after all halvings are torn when longer than this, pixels (ours).
constexpr float kTornEdge = 6.0f;
/// Two reflections about a caustic are joined up to this distance, pixels (ours).
constexpr float kWidestFold = 40.0f;
/// Edges that a thread looks at in one go.
constexpr std::size_t kGrain = 1024;
/// Over how many edges reflections are looked for in a round of halvings (ours).
constexpr int kSpreadRounds = 2;

struct Node {
  glm::dvec3 position;
  frame::VertexAttributes attributes;
  Reflections reflections;
  bool hidden = false;  ///< no reflection, and the reflector stands before it
  Reflection straight;  ///< where it would show without the reflector, if hidden
};

using Triangle = std::array<std::uint32_t, 3>;

frame::VertexAttributes middle(const frame::VertexAttributes& a, const frame::VertexAttributes& b) {
  const auto mean = [](const auto& u, const auto& v) { return 0.5f * (u + v); };
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
    const double apart = glm::distance(reflections.at[i].x, x);
    if (apart < least) {
      least = apart;
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

/// Whether one end of an edge may have more reflections than were found: the other has others. One
/// at each end is the same.
bool lacks(const Reflections& mine, const Reflections& others) {
  if (mine.count == others.count && mine.count < 2) return false;
  for (std::size_t i = 0; i < others.count; ++i) {
    if (counterpart(others, i, mine) == kMaxReflections) return true;
  }
  return false;
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
      for (std::size_t i = begin; i < end; ++i) {
        Node& node = nodes_[first + i];
        if (!edges.empty() && exactMiddles_) {
          const Edge edge{edges[i]};
          const Reflections guess =
              between(nodes_[edge.a()].reflections, nodes_[edge.b()].reflections);
          reflector_.addReflectionsNear(node.position, guess, node.reflections, own.paths);
        }
        if (node.reflections.count == 0)
          node.reflections = reflector_.reflectionsOf(node.position, own_, cursor, own.paths);
        if (node.reflections.count == 0) {
          const auto straight = reflector_.hidden(node.position, cursorBefore, own.paths);
          node.hidden = straight.has_value();
          if (straight) node.straight = *straight;
        }
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
          if (lacks(a.reflections, b.reflections)) lacking[i] |= 1;
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
      return length > static_cast<double>(kBlindEdge) *
                          std::max(0.5 * reflector_.size(), reflector_.distanceFrom(centre))
                 ? Look::Middle
                 : Look::No;
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
      return Look::Halve;
    }
    for (std::size_t i = 0; i < a.reflections.count; ++i) {
      const std::size_t j = counterpart(a.reflections, i, b.reflections);
      if (j == kMaxReflections) return Look::Halve;
      const auto xa = projection_(a.reflections.at[i].x);
      const auto xb = projection_(b.reflections.at[j].x);
      if (!xa || !xb) continue;
      if (projection_.inFrame({*xa, *xb}) &&
          glm::distance(*xa, *xb) > kShortEdge * options_.errorPixels)
        return Look::Middle;
    }
    return Look::No;
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
      node.attributes = middle(nodes_[edge.a()].attributes, nodes_[edge.b()].attributes);
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
    if (reflector_.before()) result_.places.emplace_back(r.last);
    vertex = static_cast<std::uint32_t>(result_.positions.size());
    return vertex - 1;
  }

  /// Whether a reflection is about to become the straight view of a hidden point.
  bool atRim(const Reflection& reflection, const Node& hidden) const {
    const auto seen = projection_(reflection.x);
    const auto straight = projection_(hidden.straight.x);
    return seen && straight && glm::distance(*seen, *straight) < kRimReach;
  }

  /// One triangle for each reflection that its vertices share.
  void put(const Triangle& t) {
    std::size_t seen = 0;
    for (std::size_t c = 1; c < 3; ++c) {
      if (nodes_[t[c]].reflections.count > nodes_[t[seen]].reflections.count) seen = c;
    }
    const Reflections& a = nodes_[t[seen]].reflections;
    const std::array<std::uint32_t, 2> others{t[(seen + 1) % 3], t[(seen + 2) % 3]};
    std::vector<Loose> loose;
    for (std::size_t i = 0; i < a.count; ++i) {
      std::array<std::uint32_t, 3> corners{vertexOf(t[seen], i), 0, 0};
      bool whole = true;
      std::array<std::size_t, 2> number{kMaxReflections, kMaxReflections};
      for (std::size_t c = 0; c < 2; ++c) {
        const Node& other = nodes_[others[c]];
        number[c] = counterpart(a, i, other.reflections);
        const bool rim = other.reflections.count == 0 && other.hidden && atRim(a.at[i], other);
        whole = whole && (rim || number[c] != kMaxReflections);
        if (whole) corners[c + 1] = vertexOf(others[c], number[c]);
      }
      if (!whole) {
        ++counts_.dropped;
        for (std::size_t c = 0; c < 2; ++c) {
          if (number[c] != kMaxReflections && number[1 - c] == kMaxReflections)
            loose.push_back({i, others[c], number[c]});
        }
        continue;
      }
      putCorners(corners);
    }
    if (exactMiddles_) joinFold(t[seen], loose);
  }

  /// A reflection that a node shares with another but not with the triangle's third.
  struct Loose {
    std::size_t number = 0;
    std::uint32_t other = 0;
    std::size_t otherNumber = 0;
  };

  /// Where a caustic has taken two reflections from the third node they merge between: the edges
  /// that they leave behind are the two sides of one strip.
  void joinFold(std::uint32_t node, const std::vector<Loose>& loose) {
    for (std::size_t p = 0; p < loose.size(); ++p) {
      for (std::size_t q = p + 1; q < loose.size(); ++q) {
        if (loose[p].other != loose[q].other || loose[p].otherNumber == loose[q].otherNumber)
          continue;
        const auto at = [&](std::uint32_t n, std::size_t number) {
          return projection_(nodes_[n].reflections.at[number].x);
        };
        const auto a = at(node, loose[p].number);
        const auto b = at(node, loose[q].number);
        const auto c = at(loose[p].other, loose[p].otherNumber);
        const auto d = at(loose[q].other, loose[q].otherNumber);
        if (!a || !b || !c || !d || glm::distance(*a, *b) > kWidestFold ||
            glm::distance(*c, *d) > kWidestFold)
          continue;
        const std::uint32_t first = vertexOf(node, loose[p].number);
        const std::uint32_t last = vertexOf(loose[q].other, loose[q].otherNumber);
        putCorners({first, vertexOf(loose[p].other, loose[p].otherNumber), last});
        putCorners({first, last, vertexOf(node, loose[q].number)});
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
      const auto seen = projection_(glm::dvec3(Vec3(result_.images[corners[c]])));
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
  raster::VirtualTriangles result_;
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
