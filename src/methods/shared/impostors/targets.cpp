#include "methods/shared/impostors/targets.h"

#include <algorithm>
#include <cmath>

namespace catoptric::methods::impostors {
namespace {

constexpr float kFlatness = 1e-5f;  ///< of the scene's diameter: distance from a plane; ours

struct Triangle {
  Vec3 a, b, c;
  /// Twice the area, along the normal.
  Vec3 cross() const { return glm::cross(b - a, c - a); }
};

template <class Visit>
void forTriangles(const frame::Geometry& geometry, int object, Visit&& visit) {
  const frame::ObjectRange& range = geometry.objects[static_cast<std::size_t>(object)];
  for (std::uint32_t i = range.firstIndex; i < range.firstIndex + range.indexCount; i += 3) {
    const auto at = [&](std::uint32_t k) { return geometry.positions[geometry.indices[i + k]]; };
    if (!visit(Triangle{at(0), at(1), at(2)})) return;
  }
}

bool liesIn(const Triangle& t, const Plane& plane, float tolerance) {
  const auto near = [&](const Vec3& p) {
    return std::abs(glm::dot(plane.normal, p) - plane.offset) <= tolerance;
  };
  return near(t.a) && near(t.b) && near(t.c);
}

}  // namespace

std::vector<Vec3> verticesOf(const frame::Geometry& geometry, int object) {
  const frame::ObjectRange& range = geometry.objects[static_cast<std::size_t>(object)];
  const auto first = geometry.positions.begin() + range.firstVertex;
  return {first, first + range.vertexCount};
}

std::vector<Vec3> verticesIn(const frame::Geometry& geometry, int object, const Plane& plane,
                             float sceneMetres) {
  std::vector<Vec3> found;
  forTriangles(geometry, object, [&](const Triangle& t) {
    if (liesIn(t, plane, kFlatness * sceneMetres)) found.insert(found.end(), {t.a, t.b, t.c});
    return true;
  });
  return found;
}

std::vector<SurfacePoint> pointsOn(const frame::Geometry& geometry, int object, int count) {
  double all = 0.0;
  forTriangles(geometry, object, [&](const Triangle& t) {
    all += glm::length(t.cross());
    return true;
  });
  std::vector<SurfacePoint> points;
  if (!(all > 0.0)) return points;
  double sum = 0.0;
  forTriangles(geometry, object, [&](const Triangle& t) {
    const Vec3 cross = t.cross();
    sum += glm::length(cross);
    while (points.size() < static_cast<std::size_t>(count) &&
           sum * count >= (static_cast<double>(points.size()) + 0.5) * all) {
      // Powers of the plastic number spread points evenly; folded onto the triangle
      const auto n = static_cast<float>(points.size());
      Vec2 at = glm::fract(Vec2(0.7548777f, 0.5698403f) * n + 0.5f);
      if (at.x + at.y > 1.0f) at = 1.0f - at;
      points.push_back(
          {t.a + at.x * (t.b - t.a) + at.y * (t.c - t.a), normalizedOr(cross, Vec3(0, 1, 0))});
    }
    return true;
  });
  return points;
}

Shape shapeOf(const frame::Geometry& geometry, int object, float sceneMetres) {
  Shape shape;
  const float tolerance = kFlatness * sceneMetres;
  glm::dvec3 sum(0.0);
  double area = 0.0;
  bool manyPlanes = false;
  forTriangles(geometry, object, [&](const Triangle& t) {
    const Vec3 cross = t.cross();
    const double twice = glm::length(cross);
    area += twice;
    sum += twice * (glm::dvec3(t.a) + glm::dvec3(t.b) + glm::dvec3(t.c)) / 3.0;
    if (manyPlanes || !(twice > 0.0)) return true;
    // The plane before last: neighbours are often in one
    const auto holds = [&](const Plane& plane) { return liesIn(t, plane, tolerance); };
    if (std::any_of(shape.planes.rbegin(), shape.planes.rend(), holds)) return true;
    manyPlanes = shape.planes.size() == kMostPlanes;
    const Vec3 normal = normalizedOr(cross, Vec3(0, 1, 0));
    shape.planes.push_back({normal, glm::dot(normal, t.a)});
    return true;
  });
  if (manyPlanes) shape.planes.clear();
  const frame::ObjectRange& range = geometry.objects[static_cast<std::size_t>(object)];
  shape.centroid = area > 0.0 ? Vec3(sum / area) : range.bounds.centre();
  shape.area = static_cast<float>(0.5 * area);
  float radius2 = 0.0f;
  for (std::uint32_t i = 0; i < range.vertexCount; ++i) {
    const Vec3 q = geometry.positions[range.firstVertex + i] - shape.centroid;
    radius2 = std::max(radius2, glm::dot(q, q));
  }
  shape.radius = std::sqrt(radius2);
  return shape;
}

std::vector<Shape> shapesOf(const frame::Geometry& geometry) {
  std::vector<Shape> shapes;
  for (std::size_t o = 0; o < geometry.objects.size(); ++o)
    shapes.push_back(shapeOf(geometry, static_cast<int>(o), geometry.bounds.diameter()));
  return shapes;
}

}  // namespace catoptric::methods::impostors
