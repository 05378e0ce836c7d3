// The virtual triangles of one object as they are put out.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include "methods/perturbation/vertex_table.h"
#include "methods/perturbation/virtual_objects.h"

namespace catoptric::methods::perturbation {

class VirtualOutput {
 public:
  /// `places`: the place of a vertex' last reflection is kept too. Writes `result` anew; the memory
  /// it has is used.
  VirtualOutput(const VertexTable& table, bool places, VirtualTriangles& result)
      : table_(table), keepsPlaces_(places), result_(result) {
    std::swap(scratch_, kept());
    numbers.clear();
    result_.indices.clear();
  }
  ~VirtualOutput() { std::swap(scratch_, kept()); }
  VirtualOutput(const VirtualOutput&) = delete;
  VirtualOutput& operator=(const VirtualOutput&) = delete;

  /// The reflections of a vertex among those that are put out.
  struct Numbers {
    std::uint32_t first = 0;
    std::uint32_t count = 0;
  };

  /// Puts out all reflections of the vertices that are new, and numbers them.
  void numberVertices();
  bool allNumbered(const Connectivity::Triangle& t) const {
    return std::all_of(t.begin(), t.end(), [&](std::uint32_t vertex) {
      return numbers[vertex].count == table_.glimpses[table_.placeOf(vertex)].count;
    });
  }
  /// The number of a vertex' reflection among those that are put out; kMaxReflections: the point
  /// itself, at the rim where reflection and straight view meet.
  std::uint32_t put(std::uint32_t vertex, std::size_t reflection);
  void putCorners(const std::array<std::uint32_t, 3>& corners) {
    if (shows(corners))
      result_.indices.insert(result_.indices.end(), corners.begin(), corners.end());
  }

  /// Whether a triangle may be in the frame.
  bool shows(const std::array<std::uint32_t, 3>& corners) const {
    const Vec2& a = seenVertices_[corners[0]];
    const Vec2& b = seenVertices_[corners[1]];
    const Vec2& c = seenVertices_[corners[2]];
    return std::isnan(a.x + b.x + c.x) || table_.projection.inFrame({a, b, c});
  }
  /// Indices that were put together elsewhere: from one of them up to another.
  void putIndices(const std::vector<std::uint32_t>& indices, std::size_t begin, std::size_t end) {
    result_.indices.insert(result_.indices.end(),
                           indices.begin() + static_cast<std::ptrdiff_t>(begin),
                           indices.begin() + static_cast<std::ptrdiff_t>(end));
  }
  std::size_t triangleCount() const { return result_.indices.size() / 3; }
  /// At last.
  void finish(int object);

 private:
  /// Memory of one update for the next, as VertexTable has it.
  struct Scratch {
    std::vector<Numbers> numbers;
    std::vector<Vec2> seenVertices;
  };
  static Scratch& kept() {
    static thread_local Scratch scratch;
    return scratch;
  }
  /// Room for so many vertices; that of updates before is not given back.
  void makeRoom(std::size_t vertices);
  void putOut(std::size_t number, std::uint32_t vertex, const Reflection& r, const Vec2& seen);

  Scratch scratch_;

 public:
  std::vector<Numbers>& numbers = scratch_.numbers;  ///< by vertex

 private:
  const VertexTable& table_;
  bool keepsPlaces_;
  VirtualTriangles& result_;
  std::size_t putOut_ = 0;  ///< of its vertices
  /// What was found or asked for after its vertex was numbered.
  std::map<std::pair<std::uint32_t, std::size_t>, std::uint32_t> putMore_;
  std::vector<Vec2>& seenVertices_ = scratch_.seenVertices;  ///< pixels; x NaN: behind the camera
};

}  // namespace catoptric::methods::perturbation
