// Where a reflection ends between vertices of a triangle: what there is of it is cut out.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <tuple>
#include <utility>
#include <vector>

#include "methods/perturbation/vertex_table.h"
#include "methods/perturbation/virtual_objects.h"
#include "methods/perturbation/virtual_output.h"

namespace catoptric::methods::perturbation {

class Borders {
 public:
  Borders(const Reflector& reflector, VertexTable& table, VirtualOutput& output,
          TriangleCounts& counts)
      : reflector_(reflector), table_(table), output_(output), counts_(counts) {}

  /// Puts out what there is of each reflection of the triangles whose vertices do not share it.
  void put(std::span<const Connectivity::Triangle> triangles);

 private:
  using Triangle = Connectivity::Triangle;
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
  /// A vertex of a piece: a reflection of a node, or the end of it towards another node.
  struct Corner {
    Border border;
    bool isBorder = false;
  };
  using Piece = std::vector<Corner>;

  Border placesOf(const Border& border) const {
    return {table_.placeOf(border.have), border.number, table_.placeOf(border.lacking)};
  }
  /// Finds the ends of all reflections of some triangles.
  void findEnds(std::span<const Triangle> triangles);
  /// Where a reflection ends between two places, and the part of the way there: halving what is
  /// left of the edge, from exact path to exact path.
  std::pair<VertexPlace, double> endOf(const Border& border, PathCounts& counts) const;
  void putTriangle(const Triangle& t);
  /// Joins two pieces by a strip where their reflections merge.
  void joinFold(const Piece& p, const Piece& q);
  /// Whether the ends of two reflections in one place of an edge are so near that they merge there.
  bool merge(const Corner& x, const Corner& y) const;
  bool turnsLeft(const Piece& piece) const;
  /// What there is of each reflection of a triangle, three to four corners.
  template <class Put>
  void forPieces(const Triangle& t, const Put& putPiece) const;

  std::uint32_t vertexOf(const Corner& c) const;
  double shareOf(const Corner& c) const;
  static std::uint32_t numberOf(const Corner& c) { return c.isBorder ? 0 : c.border.number; }
  std::uint32_t vertex(const Corner& c) { return output_.put(vertexOf(c), numberOf(c)); }
  const Reflection& reflection(const Corner& c) const {
    return table_.placeAt(vertexOf(c)).reflections.at[numberOf(c)];
  }

  const Reflector& reflector_;
  VertexTable& table_;
  VirtualOutput& output_;
  TriangleCounts& counts_;
  std::vector<Border> borders_;  ///< sorted
  std::vector<Border> between_;  ///< the same of places
  std::vector<double> shares_;   ///< of the way along between_'s edges
  std::size_t firstEnd_ = 0;     ///< the first one's vertex
};

}  // namespace catoptric::methods::perturbation
