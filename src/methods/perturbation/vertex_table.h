// The vertices of one object while its virtual triangles are made: their positions, and the
// reflections of each position.
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

/// A position of one or more vertices, with its reflections.
struct VertexPlace {
  glm::dvec3 position;
  Reflections reflections;
  /// For a position behind the reflector, which has no reflection: where it would appear if the
  /// reflector did not hide it. Otherwise null.
  std::unique_ptr<Reflection> straight;
};

/// The part of a position's data that most edges need, a tenth of its bytes.
struct Glimpse {
  std::array<Vec2, 2> seen;  ///< pixels of the first two reflections; x is NaN behind the camera
  std::uint32_t count = 0;   ///< number of reflections
};

/// A vertex that is not in the mesh: the middle of an edge, or the point of an edge beyond
/// which it has no reflection.
struct Node {
  std::uint32_t place = 0;
  frame::VertexAttributes attributes;
};

/// Attributes at fraction `t` of the edge from a to b.
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

  /// Starts with an object's vertices. Vertices at the same position share its reflections: meshes
  /// repeat vertices for different normals and at texture seams.
  void begin(const frame::Geometry& geometry, const frame::ObjectRange& range);
  /// Adds positions that are not in the mesh.
  void addPlaces(std::size_t count) {
    places.resize(places.size() + count);
    glimpses.resize(places.size());
  }
  /// Index of each mesh vertex's position.
  const std::vector<std::uint32_t>& meshPlaces() const { return placeOf_; }
  /// The coordinates of a position of the mesh.
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

  /// The pixel at which a reflection of a position appears; x is NaN behind the camera.
  Vec2 seen(std::size_t place, std::size_t i) const {
    const Glimpse& glimpse = glimpses[place];
    return i < glimpse.seen.size() ? glimpse.seen[i] : seenAt(places[place].reflections.at[i]);
  }
  /// A virtual point appears at its reflection point.
  Vec2 seenAt(const Reflection& reflection) const {
    return projection(reflection.x).value_or(Vec2(std::numeric_limits<float>::quiet_NaN()));
  }
  /// Updates the projections after a position's reflections have changed.
  void project(std::size_t place);
  bool near(const Reflection& a, const Reflection& b, float pixels) const {
    const auto at = projection(a.x);
    const auto other = projection(b.x);
    return at && other && glm::distance(*at, *other) < pixels;
  }

  /// Angle between two points as seen from the reflector, in radians.
  double angleBetween(const glm::dvec3& a, const glm::dvec3& b) const {
    const double away = std::max(0.5 * reflector_.size(), reflector_.distanceFrom(0.5 * (a + b)));
    return glm::distance(a, b) / away;
  }
  /// The same angle in pixels.
  float apparent(const VertexPlace& a, const VertexPlace& b) const {
    return static_cast<float>(angleBetween(a.position, b.position) / projection.spread());
  }

 private:
  /// Memory that the next update reuses, because allocating it takes long.
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
  std::vector<Glimpse>& glimpses = scratch_.glimpses;  ///< indexed by position

 private:
  const Reflector& reflector_;
  // Vertices: those of the mesh, then added ones
  std::span<const Vec3> positions_;
  std::span<const frame::VertexAttributes> attributes_;
  std::vector<std::uint32_t>& placeOf_ = scratch_.welding.numbers;
  std::vector<std::uint32_t>& firstAt_ =
      scratch_.welding.firsts;  ///< indexed by position of the mesh: its first vertex
  std::vector<Node> more_;
};

}  // namespace catoptric::methods::perturbation
