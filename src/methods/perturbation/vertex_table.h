// The vertices of one object while its virtual triangles are made: the places where they lie, and
// where each place shows.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "core/welding.h"
#include "frame/geometry.h"
#include "methods/perturbation/projection.h"
#include "methods/perturbation/reflector.h"

namespace catoptric::methods::perturbation {

/// What is reflected, once for all vertices that lie there.
struct VertexPlace {
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

/// A vertex that is no mesh's: the middle of an edge, or the end of a reflection on it.
struct Node {
  std::uint32_t place = 0;
  frame::VertexAttributes attributes;
};

/// At `t` of the way from a to b.
frame::VertexAttributes mixed(const frame::VertexAttributes& a, const frame::VertexAttributes& b,
                              float t = 0.5f);

class VertexTable {
 public:
  VertexTable(const Reflector& reflector, const View& view)
      : projection(view), reflector_(reflector) {
    std::swap(scratch_, kept());
  }
  ~VertexTable() { std::swap(scratch_, kept()); }
  VertexTable(const VertexTable&) = delete;
  VertexTable& operator=(const VertexTable&) = delete;

  /// Begins with an object's vertices. Those that lie in the same place have the same reflections:
  /// meshes repeat a corner for each normal and at seams of textures.
  void begin(const frame::Geometry& geometry, const frame::ObjectRange& range);
  /// Places that are no vertex' of the mesh.
  void addPlaces(std::size_t count) {
    places.resize(places.size() + count);
    glimpses.resize(places.size());
  }
  /// By vertex of the mesh.
  const std::vector<std::uint32_t>& meshPlaces() const { return placeOf_; }
  /// Where a place of the mesh lies.
  const Vec3& meshPosition(std::size_t place) const { return positions_[firstAt_[place]]; }
  std::size_t vertexCount() const { return placeOf_.size() + more_.size(); }

  std::uint32_t placeOf(std::uint32_t vertex) const {
    return vertex < placeOf_.size() ? placeOf_[vertex] : more_[vertex - placeOf_.size()].place;
  }
  const VertexPlace& placeAt(std::uint32_t vertex) const { return places[placeOf(vertex)]; }
  const frame::VertexAttributes& attributesOf(std::uint32_t vertex) const {
    return vertex < placeOf_.size() ? attributes_[vertex]
                                    : more_[vertex - placeOf_.size()].attributes;
  }
  std::uint32_t addVertex(std::uint32_t place, const frame::VertexAttributes& attributes) {
    more_.push_back({place, attributes});
    return static_cast<std::uint32_t>(placeOf_.size() + more_.size() - 1);
  }

  /// Where the camera shows a place's reflection; x NaN: behind it.
  Vec2 seen(std::size_t place, std::size_t i) const {
    const Glimpse& glimpse = glimpses[place];
    return i < glimpse.seen.size() ? glimpse.seen[i] : seenAt(places[place].reflections.at[i]);
  }
  /// A virtual point is seen where its reflection is.
  Vec2 seenAt(const Reflection& reflection) const {
    return projection(reflection.x).value_or(Vec2(std::numeric_limits<float>::quiet_NaN()));
  }
  /// After a place's reflections have changed.
  void project(std::size_t place);
  bool near(const Reflection& a, const Reflection& b, float pixels) const {
    const auto at = projection(a.x);
    const auto other = projection(b.x);
    return at && other && glm::distance(*at, *other) < pixels;
  }

  /// How far apart points are as seen from the reflector's place, rad.
  double angleBetween(const glm::dvec3& a, const glm::dvec3& b) const {
    const double away = std::max(0.5 * reflector_.size(), reflector_.distanceFrom(0.5 * (a + b)));
    return glm::distance(a, b) / away;
  }
  /// ... in pixels
  float apparent(const VertexPlace& a, const VertexPlace& b) const {
    return static_cast<float>(angleBetween(a.position, b.position) / projection.spread());
  }

 private:
  /// Memory of one update for the next: the kernel takes as long to give it as look-ups do.
  struct Scratch {
    std::vector<VertexPlace> places;
    std::vector<Glimpse> glimpses;
    Welding welding;
  };
  static Scratch& kept() {
    static thread_local Scratch scratch;
    return scratch;
  }
  Scratch scratch_;

 public:
  const Projection projection;
  std::vector<VertexPlace>& places = scratch_.places;
  std::vector<Glimpse>& glimpses = scratch_.glimpses;  ///< by place

 private:
  const Reflector& reflector_;
  // Vertices: the mesh's, then more
  std::span<const Vec3> positions_;
  std::span<const frame::VertexAttributes> attributes_;
  std::vector<std::uint32_t>& placeOf_ = scratch_.welding.numbers;
  std::vector<std::uint32_t>& firstAt_ =
      scratch_.welding.firsts;  ///< by place of the mesh: a vertex
  std::vector<Node> more_;
};

}  // namespace catoptric::methods::perturbation
