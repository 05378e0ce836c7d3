// Collects the virtual triangles of one object.
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
  /// `places`: also store the last reflection point of each vertex. Overwrites `result`.
  VirtualOutput(const VertexTable& table, bool places, VirtualTriangles& result)
      : table_(table), keepsPlaces_(places), result_(result) {
    std::swap(scratch_, kept());
    numbers.clear();
    result_.indices.clear();
  }
  ~VirtualOutput() { std::swap(scratch_, kept()); }
  VirtualOutput(const VirtualOutput&) = delete;
  VirtualOutput& operator=(const VirtualOutput&) = delete;

  /// The range of a vertex's reflections among the emitted vertices.
  struct Numbers {
    std::uint32_t first = 0;
    std::uint32_t count = 0;
  };

  /// Emits all reflections of new vertices and numbers them.
  void numberVertices();
  bool allNumbered(const Connectivity::Triangle& t) const {
    return std::all_of(t.begin(), t.end(), [&](std::uint32_t vertex) {
      return numbers[vertex].count == table_.glimpses[table_.placeOf(vertex)].count;
    });
  }
  /// Returns the number of an emitted reflection. If `reflection` is kMaxReflections, emits the
  /// point itself, with which the reflection merges at a silhouette.
  std::uint32_t put(std::uint32_t vertex, std::size_t reflection);
  void putCorners(const std::array<std::uint32_t, 3>& corners) {
    if (shows(corners))
      result_.indices.insert(result_.indices.end(), corners.begin(), corners.end());
  }

  /// Whether a triangle may be visible in the frame.
  bool shows(const std::array<std::uint32_t, 3>& corners) const {
    const Vec2& a = seenVertices_[corners[0]];
    const Vec2& b = seenVertices_[corners[1]];
    const Vec2& c = seenVertices_[corners[2]];
    return std::isnan(a.x + b.x + c.x) || table_.projection.inFrame({a, b, c});
  }
  /// Appends the indices from `begin` up to `end` of a list that was made elsewhere.
  void putIndices(const std::vector<std::uint32_t>& indices, std::size_t begin, std::size_t end) {
    result_.indices.insert(result_.indices.end(),
                           indices.begin() + static_cast<std::ptrdiff_t>(begin),
                           indices.begin() + static_cast<std::ptrdiff_t>(end));
  }
  std::size_t triangleCount() const { return result_.indices.size() / 3; }
  /// Call this last.
  void finish(int object);

 private:
  /// Memory that the next update reuses, like VertexTable::Scratch.
  struct Scratch {
    std::vector<Numbers> numbers;
    std::vector<Vec2> seenVertices;
  };
  static Scratch& kept() {
    static thread_local Scratch scratch;
    return scratch;
  }
  /// Reserves memory for this many vertices. Memory of earlier updates is kept.
  void makeRoom(std::size_t vertices);
  void putOut(std::size_t number, std::uint32_t vertex, const Reflection& r, const Vec2& seen);

  Scratch scratch_;

 public:
  std::vector<Numbers>& numbers = scratch_.numbers;  ///< indexed by vertex

 private:
  const VertexTable& table_;
  bool keepsPlaces_;
  VirtualTriangles& result_;
  std::size_t putOut_ = 0;  ///< number of vertices
  /// Reflections that were found or requested after their vertex had been numbered.
  std::map<std::pair<std::uint32_t, std::size_t>, std::uint32_t> putMore_;
  std::vector<Vec2>& seenVertices_ = scratch_.seenVertices;  ///< pixels; x is NaN behind the camera
};

}  // namespace catoptric::methods::perturbation
