// Measures how well the levels of detail of one object approximate its surface: finds each point of
// the surface on the level, fits the level's vertex attributes, and computes the error.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "frame/geometry.h"
#include "frame/shading.h"

namespace catoptric::raster {

/// The properties of an object, besides its geometry, that its levels depend on.
struct LevelSource {
  bool whole = false;     ///< no levels are built (errors are not valid for deforming objects)
  bool moving = false;    ///< its levels keep the attributes of its own vertices
  bool textured = false;  ///< whether texture coordinates affect its appearance
  Vec3 albedo{1.0f};      ///< mean over its texture
};

/// The error of a level, as a root mean square over the object's own surface.
struct LevelError {
  float metres = 0.0f;  ///< error of positions, also of those at which the texture appears
  float steps = 0.0f;   ///< error of diffuse radiance, in display steps of 1/255 (sRGB)
};

class LevelFit {
 public:
  /// The points of the surface are its vertices. Each represents a part of the area of its
  /// triangles.
  LevelFit(const frame::Geometry& geometry, const frame::ObjectRange& range,
           const LevelSource& source, const frame::Lighting& lighting);

  /// Proceeds to a coarser level. `indices` are triangles between some of the vertices of the level
  /// before, counted from the object's first vertex. Each point is searched for near the triangle
  /// on which it lay.
  void follow(std::span<const std::uint32_t> indices);

  /// The error of the current level, with its vertices' current attributes.
  LevelError error() const;
  /// Fits the attributes of the level's vertices to the points, by least squares.
  void fit();
  /// The attributes of a vertex of the level, counted from the object's first vertex.
  const frame::VertexAttributes& attributes(std::uint32_t vertex) const { return now_[vertex]; }

 private:
  /// A point of the surface, and its position on the level.
  struct Point {
    std::uint32_t vertex = 0;
    float weight = 0.0f;         ///< m^2
    std::uint32_t triangle = 0;  ///< index of a triangle of the level
    Vec3 barycentric{1.0f, 0.0f, 0.0f};
    float distance2 = 0.0f;
  };

  std::span<const std::uint32_t> trianglesOf(std::uint32_t vertex) const {
    return {incident_.data() + firstIncident_[vertex],
            incident_.data() + firstIncident_[vertex + 1]};
  }
  const Vec3& position(std::uint32_t vertex) const {
    return geometry_.positions[range_.firstVertex + vertex];
  }
  float area(std::size_t triangle) const;  ///< area of a triangle of the level, m^2
  void listIncident();
  void thin();  ///< keeps half of the points and doubles their weight
  std::vector<std::uint32_t> survivors(std::span<const std::uint32_t> indices) const;
  void seek(Point& point, std::uint32_t vertex) const;
  void seekFarther();
  Vec3 display(const Vec3& position, const frame::VertexAttributes& at) const;

  const frame::Geometry& geometry_;
  const frame::ObjectRange& range_;
  const LevelSource& source_;
  const frame::Lighting& lighting_;
  std::vector<Point> points_;
  std::vector<Vec3> shown_;    ///< display value of each point, in display steps
  std::uint32_t thinned_ = 0;  ///< how many times thin() was called
  std::vector<std::uint32_t> indices_;
  std::vector<std::uint32_t> firstIncident_;
  std::vector<std::uint32_t> incident_;  ///< the triangles of each vertex
  std::vector<frame::VertexAttributes> now_;
};

}  // namespace catoptric::raster
