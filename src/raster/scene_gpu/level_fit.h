// What the levels of one object show in place of its own surface: where each point of the surface
// is found on a level, the vertex attributes that show it best there, and how far they are off.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "frame/geometry.h"
#include "frame/shading.h"

namespace catoptric::raster {

/// What levels of an object must know of it beside its geometry.
struct LevelSource {
  bool whole = false;     ///< gets no levels (of what deforms their error would not hold)
  bool moving = false;    ///< its levels keep the attributes of its own vertices
  bool textured = false;  ///< texture coordinates show
  Vec3 albedo{1.0f};      ///< mean over its texture
};

/// How far a level is off, root mean square over the object's own surface.
struct LevelError {
  float metres = 0.0f;  ///< of places, and of what texture coordinates show there
  float steps = 0.0f;   ///< of diffuse radiance, in display steps of 1/255 (sRGB)
};

class LevelFit {
 public:
  /// Points of the surface are the vertices of its triangles, each with its share of their area.
  LevelFit(const frame::Geometry& geometry, const frame::ObjectRange& range,
           const LevelSource& source, const frame::Lighting& lighting);

  /// Goes on to a coarser level: triangles between some of the vertices that the one before had
  /// (counted from the object's first). Each point is sought about the triangle where it was.
  void follow(std::span<const std::uint32_t> indices);

  /// Of the level as it is, with its vertices' own attributes.
  LevelError error() const;
  /// Fits attributes of the level's vertices to the points, by least squares.
  void fit();
  /// Of a vertex of the level (counted from the object's first).
  const frame::VertexAttributes& attributes(std::uint32_t vertex) const { return now_[vertex]; }

 private:
  /// A point of the surface, and its place on the level.
  struct Point {
    std::uint32_t vertex = 0;
    float weight = 0.0f;         ///< m^2
    std::uint32_t triangle = 0;  ///< of the level
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
  float area(std::size_t triangle) const;  ///< of the level, in m^2
  void listIncident();
  void thin();  ///< leaves half of the points, with twice their weight
  std::vector<std::uint32_t> survivors(std::span<const std::uint32_t> indices) const;
  void seek(Point& point, std::uint32_t vertex) const;
  void seekFarther();
  Vec3 display(const Vec3& position, const frame::VertexAttributes& at) const;

  const frame::Geometry& geometry_;
  const frame::ObjectRange& range_;
  const LevelSource& source_;
  const frame::Lighting& lighting_;
  std::vector<Point> points_;
  std::vector<Vec3> shown_;    ///< of each point, in display steps
  std::uint32_t thinned_ = 0;  ///< how often
  std::vector<std::uint32_t> indices_;
  std::vector<std::uint32_t> firstIncident_;
  std::vector<std::uint32_t> incident_;  ///< triangles of each vertex
  std::vector<frame::VertexAttributes> now_;
};

}  // namespace catoptric::raster
