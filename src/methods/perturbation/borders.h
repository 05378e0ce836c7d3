// Cuts triangles where a reflection ends between their vertices.
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

  /// For triangles in which only some vertices have a reflection: emits the part that has it.
  void put(std::span<const Connectivity::Triangle> triangles);

 private:
  using Triangle = Connectivity::Triangle;
  /// An edge on which a reflection ends: reflection `number` of the vertex `have`, which the vertex
  /// `lacking` does not have. In between_ these are positions instead of vertices.
  struct Border {
    std::uint32_t have = 0;
    std::uint32_t number = 0;
    std::uint32_t lacking = 0;
    bool operator==(const Border&) const = default;
    bool operator<(const Border& other) const {
      return std::tie(have, number, lacking) < std::tie(other.have, other.number, other.lacking);
    }
  };
  /// A corner of a piece: a reflection of a mesh vertex (Border::have and number), or the point of
  /// an edge at which such a reflection ends.
  struct Corner {
    Border border;
    bool isBorder = false;
  };
  using Piece = std::vector<Corner>;

  Border placesOf(const Border& border) const {
    return {table_.placeOf(border.have), border.number, table_.placeOf(border.lacking)};
  }
  /// Finds the ends of all reflections of these triangles.
  void findEnds(std::span<const Triangle> triangles);
  /// Where a reflection ends between two positions, and the fraction of the edge up to there. The
  /// edge is bisected. Each step searches an exact path near that of the step before.
  std::pair<VertexPlace, double> endOf(const Border& border, PathCounts& counts) const;
  void putTriangle(const Triangle& t);
  /// Joins two pieces by a strip where their reflections merge.
  void joinFold(const Piece& p, const Piece& q);
  /// Whether the ends of two reflections on an edge are so close that they merge there.
  bool merge(const Corner& x, const Corner& y) const;
  bool turnsLeft(const Piece& piece) const;
  /// Calls `putPiece` for each reflection of a triangle with its piece (3 or 4 corners).
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
  std::vector<Border> between_;  ///< borders_ with positions instead of vertices
  std::vector<double> shares_;   ///< fractions along between_'s edges
  std::size_t firstEnd_ = 0;     ///< number of the first end's vertex
};

}  // namespace catoptric::methods::perturbation
