// Halves the edges of an object until its virtual triangles show what the reflector shows of it.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "methods/perturbation/reflection_match.h"
#include "methods/perturbation/vertex_table.h"
#include "methods/perturbation/virtual_objects.h"
#include "methods/perturbation/virtual_output.h"

namespace catoptric::methods::perturbation {

class Refinement {
 public:
  using Triangle = Connectivity::Triangle;
  using Edge = Connectivity::Edge;
  using Edges = Connectivity::Edges;

  /// `own`: the object is the last reflector.
  Refinement(const Reflector& reflector, Order order, bool own, const TriangleOptions& options,
             VertexTable& table, VirtualOutput& output, TriangleCounts& counts)
      : reflector_(reflector),
        exactMiddles_(order == Order::Auto),
        jumps_(order == Order::Nearest),
        own_(own),
        options_(options),
        table_(table),
        output_(output),
        counts_(counts) {}

  /// Looks the mesh's places up.
  void lookUpMesh() { lookUp(0, {}); }
  /// Whether any of the object's edges may hide reflections that its ends do not have.
  void findBlindEdges(const Box3& bounds, const std::vector<Edge>& edges);
  /// Nearest paths jump from sample to sample however short the edges are.
  int halvings() const { return jumps_ || options_.errorPixels <= 0.0f ? 0 : options_.maxHalvings; }
  /// One round: what need not be halved is put out, the rest comes back in pieces.
  std::vector<Triangle> halve(const std::vector<Triangle>& triangles, const Edges& edges,
                              bool mayHalve);
  /// Triangles whose vertices do not share all reflections, as far as they were met.
  const std::vector<Triangle>& mixedTriangles() const { return mixed_; }

 private:
  struct Round;      ///< of halvings
  struct WholePart;  ///< triangles that are put out as they are
  /// Edges are halved when longer than this part of their distance from the reflector: what concave
  /// and waved reflectors and lenses show may lie between all vertices (ours).
  static constexpr double kBlindEdge = 0.25;
  /// Edges that a thread looks at in one go.
  static constexpr std::size_t kGrain = 1024;
  /// What spread() and lookAt() know of an edge.
  static constexpr std::uint8_t kFirstLacks = 1;   ///< end a, a reflection that b has
  static constexpr std::uint8_t kSecondLacks = 2;  ///< and the other way round
  static constexpr std::uint8_t kInOrder = 4;      ///< inOrder()
  /// Whether an edge must be looked at in its middle, and whether it must be halved without.
  enum class Look { No, Middle, Halve };
  /// What ends on the edge from `a` to `b` within the frame: nothing, reflections that graze the
  /// reflector, or others, at the rim of a concave one.
  enum class Ends { None, Grazing, Steep };

  // What shows where: look_up.cpp
  /// Reflections of the places from `first` on; `edges[i]` is what place first + i is the middle
  /// of.
  void lookUp(std::size_t first, std::span<const Edge> edges);
  /// Those of `a` that nothing of `b` continues, or nothing near.
  Reflections unmatched(const Reflections& a, const Reflections& b) const;
  /// Whether the ends of an edge, of one reflection each, show so far apart that they may be two.
  bool stretched(const Edge& edge) const;
  /// What is known of edges; of those without a place that has changed, as before. `first`: of
  /// spread()'s rounds; what was tried over an edge in a call before is not tried again.
  void relate(const std::vector<Edge>& edges, bool first, std::vector<std::uint8_t>& states) const;
  /// What one end of an edge found, the other is looked for at: the nearest rays need not lead to
  /// all reflections. What is known of the edges then.
  std::vector<std::uint8_t> spread(const std::vector<Edge>& edges);
  /// Whether there may be reflections between two places that neither has.
  bool isBlind(const VertexPlace& a, const VertexPlace& b) const {
    return hasBlind_ && table_.angleBetween(a.position, b.position) > kBlindEdge;
  }

  // Which edges are halved: refinement.cpp
  /// Where a place shows without the last reflector, pixels, as far as that is known: what shows by
  /// way of others before it may be hidden from those.
  std::optional<Vec2> straightOf(const VertexPlace& place) const;
  Ends endsOn(const VertexPlace& a, const VertexPlace& b) const;
  Look lookAt(const Edge& edge, bool ordered) const;
  /// ... whose ends have different numbers of reflections.
  Look lookAtEnd(const VertexPlace& a, const VertexPlace& b) const;
  /// Whether reflection `i` of an edge's first end may miss its middle on the way to `j` of the
  /// other: not what is behind the camera.
  bool mayMiss(const Edge& edge, std::size_t i, std::size_t j) const;
  /// Whether the middle of an edge shows where its ends say.
  bool misses(const Edge& edge, std::size_t place) const;
  /// Whether the images of a triangle's ends are apart by far more than the point itself is when it
  /// moves from one to the other: they are different reflections.
  bool torn(const Triangle& t) const;
  /// Whether a reflection is about to become the straight view of a hidden point.
  bool atRim(const Reflection& reflection, const Reflection& straight) const;
  /// Looks at the middles of edges that may be too long, and finds which of them to halve.
  void lookAtMiddles(Round& round, bool mayHalve);
  /// Puts out the triangles that stay as they are, in parts, each in their order.
  void putWhole(const Round& round, std::size_t part, WholePart& result) const;
  bool isWhole(const Round& round, std::size_t i) const;
  /// Puts out a triangle that is not whole, or halves it into `pieces`.
  void putRest(Round& round, std::size_t i, std::vector<Triangle>& pieces);
  /// The vertex in the middle of an edge from vertex a to b; kNone where it is not halved.
  std::uint32_t middleOf(Round& round, std::uint32_t a, std::uint32_t b, std::uint32_t edge);
  /// One triangle for each reflection that its vertices share, `ordered`: all, in the same order;
  /// where some lack one, what there is of it later: mixedTriangles().
  void put(const Triangle& t, bool ordered);

  const Reflector& reflector_;
  bool exactMiddles_;
  bool jumps_;
  bool own_;
  bool hasBlind_ = false;  ///< edges of the mesh that isBlind()
  TriangleOptions options_;
  VertexTable& table_;
  VirtualOutput& output_;
  TriangleCounts& counts_;
  std::vector<Triangle> mixed_;
  /// Places whose reflections are new to spread(): by place, those beyond the end too.
  std::vector<bool> changed_;
};

}  // namespace catoptric::methods::perturbation
