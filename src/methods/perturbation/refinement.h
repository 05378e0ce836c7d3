// Splits the edges of an object until its virtual triangles follow its reflection.
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

  /// `own`: the object is itself the last reflector.
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

  /// Finds the reflections of the mesh's positions.
  void lookUpMesh() { lookUp(0, {}, {}); }
  /// Sets hasBlind_: whether any edge of the object may hide reflections that its ends do not have.
  void findBlindEdges(const Box3& bounds, const std::vector<Edge>& edges);
  /// Maximum number of successive splits; 0 without a bound on the error. Also 0 for order nearest:
  /// its reflections jump from one sampled path to another, however short the edges are.
  int halvings() const { return jumps_ || options_.errorPixels <= 0.0f ? 0 : options_.maxHalvings; }
  /// One round: triangles that need no split are emitted; the others are returned as pieces.
  std::vector<Triangle> halve(const std::vector<Triangle>& triangles, const Edges& edges,
                              bool mayHalve);
  /// The remaining triangles, whose vertices do not all have the same reflections.
  const std::vector<Triangle>& mixedTriangles() const { return mixed_; }

 private:
  struct Round;      ///< state of a round of splits
  struct WholePart;  ///< some triangles that are emitted unchanged
  /// Edges are split if they are longer than this fraction of their distance from the reflector:
  /// concave and wavy reflectors and lenses may show a part of the object that contains no vertex
  /// (not from the paper).
  static constexpr double kBlindEdge = 0.25;
  /// Number of edges in a thread's work item.
  static constexpr std::size_t kGrain = 1024;
  /// Flags of an edge, which spread() sets and lookAt() reads.
  static constexpr std::uint8_t kFirstLacks = 1;   ///< end a lacks a reflection that b has
  static constexpr std::uint8_t kSecondLacks = 2;  ///< end b lacks a reflection that a has
  static constexpr std::uint8_t kInOrder = 4;      ///< inOrder()
  /// Whether the middle of an edge must be examined, or whether the edge must be split anyway.
  /// Blind: it must be split, and its middle may have reflections that its ends do not have.
  enum class Look : std::uint8_t { No, Middle, Halve, Blind };
  /// What ends on the edge from `a` to `b` within the frame: nothing, reflections that graze the
  /// reflector, or others (at the silhouette of a concave reflector).
  enum class Ends { None, Grazing, Steep };

  // Reflections of positions: look_up.cpp
  /// Finds the reflections of the positions from `first` on; position first + i is the middle of
  /// `edges[i]`, which is split as looks[i] says.
  void lookUp(std::size_t first, std::span<const Edge> edges, std::span<const Look> looks);
  /// The reflections of `a` without a close counterpart in `b`.
  Reflections unmatched(const Reflections& a, const Reflections& b) const;
  /// Whether the images of an edge's two ends, with one reflection each, are so far apart that they
  /// may be different reflections.
  bool stretched(const Edge& edge) const;
  /// Updates the flags of edges whose ends have changed. The other edges keep theirs, but a search
  /// that failed in an earlier call is not repeated. `first`: this is the first round of spread().
  void relate(const std::vector<Edge>& edges, bool first, std::vector<std::uint8_t>& states) const;
  /// Searches each end of an edge for the reflections of the other end, because the nearest rays do
  /// not lead to all reflections. Returns the flags of the edges.
  std::vector<std::uint8_t> spread(const std::vector<Edge>& edges);
  /// Whether there may be reflections between the ends of an edge that neither of them has.
  bool isBlind(const Edge& edge) const;
  /// Edges shorter than this, as seen from the reflector, are not split, pixels.
  float shortest() const;
  /// Whether an image of an edge, within the frame, is longer than this many pixels.
  bool isLonger(const Edge& edge, float pixels) const;

  // The choice of edges to split: refinement.cpp
  /// The pixel at which a position appears without the last reflector, if known. Earlier reflectors
  /// may hide the position.
  std::optional<Vec2> straightOf(const VertexPlace& place) const;
  Ends endsOn(const VertexPlace& a, const VertexPlace& b) const;
  Look lookAt(const Edge& edge, bool ordered) const;
  /// Whether an image ends on an edge where a straight line may miss the end between two edges.
  bool endsInCurve(const Edge& edge) const;
  /// Sets the looks of long edges in triangles in which an image ends to Blind.
  void lookBesideEnds(const Round& round, std::vector<Look>& looks) const;
  /// lookAt() for an edge whose ends have different numbers of reflections.
  Look lookAtEnd(const VertexPlace& a, const VertexPlace& b) const;
  /// Whether an edge's virtual image, from reflection `i` of its first end to `j` of the other, is
  /// long enough to miss its true middle. False behind the camera.
  bool mayMiss(const Edge& edge, std::size_t i, std::size_t j) const;
  /// Whether the middle of an edge appears too far from where the edge's ends predict it.
  bool misses(const Edge& edge, std::size_t place) const;
  /// Whether the images of a triangle's vertices are much farther apart than the vertices: they are
  /// then different reflections.
  bool torn(const Triangle& t) const;
  /// Whether a reflection is about to merge with the straight view of a hidden point.
  bool atRim(const Reflection& reflection, const Reflection& straight) const;
  /// Examines the middles of edges that may be too long, and chooses the edges to split.
  void lookAtMiddles(Round& round, bool mayHalve);
  /// Emits the unchanged triangles of one part, in their order.
  void putWhole(const Round& round, std::size_t part, WholePart& result) const;
  bool isWhole(const Round& round, std::size_t i) const;
  /// Emits a triangle that is not whole, or splits it into `pieces`.
  void putRest(Round& round, std::size_t i, std::vector<Triangle>& pieces);
  /// The vertex in the middle of an edge from vertex a to b; kNone if the edge is not split.
  std::uint32_t middleOf(Round& round, std::uint32_t a, std::uint32_t b, std::uint32_t edge);
  /// Emits one triangle for each reflection that all its vertices have. If some vertices lack a
  /// reflection, the triangle is added to mixedTriangles(). `ordered`: all vertices have the same
  /// reflections in the same order.
  void put(const Triangle& t, bool ordered);

  const Reflector& reflector_;
  bool exactMiddles_;
  bool jumps_;
  bool own_;
  bool hasBlind_ = false;  ///< see findBlindEdges()
  TriangleOptions options_;
  VertexTable& table_;
  VirtualOutput& output_;
  TriangleCounts& counts_;
  std::vector<Triangle> mixed_;
  /// Indexed by position (also beyond the end): whether spread() has not yet seen its reflections.
  std::vector<bool> changed_;
};

}  // namespace catoptric::methods::perturbation
