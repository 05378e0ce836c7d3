#include "methods/perturbation/plane_culling.h"

#include <array>
#include <cmath>

namespace catoptric::methods::perturbation {
namespace {

/// Behind a mirror by this share of the coordinates: beyond all rounding. Ours.
constexpr double kBehind = 1e-6;

std::array<Vector<double>, 8> cornersOf(const Box3& box) {
  std::array<Vector<double>, 8> corners;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    corners[i] = {{(i & 1) != 0 ? box.max.x : box.min.x, (i & 2) != 0 ? box.max.y : box.min.y,
                   (i & 4) != 0 ? box.max.z : box.min.z}};
  }
  return corners;
}

/// Whether all of the points are on the other side of the plane than the eye.
bool isBehind(const Plane<double>& plane, const Vec3& eye, std::span<const Vector<double>> points) {
  const double side = dot(plane.normal, Vector<double>{{eye.x, eye.y, eye.z}}) - plane.offset;
  for (const Vector<double>& p : points) {
    const double height = dot(plane.normal, p) - plane.offset;
    const double slack = kBehind * (std::sqrt(dot(p, p)) + std::abs(plane.offset));
    if ((side < 0.0 ? -height : height) > -slack) return false;
  }
  return true;
}

}  // namespace

const raster::Rectangle& PlaneCulling::rectangleOf(int mirror) {
  const auto known = rectangles_.find(mirror);
  if (known != rectangles_.end()) return known->second;
  const Box3& bounds = geometry_.objects[static_cast<std::size_t>(mirror)].bounds;
  return rectangles_.emplace(mirror, raster::shownRectangle(camera_, width_, height_, bounds))
      .first->second;
}

bool PlaneCulling::hides(std::span<const Plane<double>> planes, int first, int object) {
  const raster::Rectangle& mirror = rectangleOf(first);
  if (mirror.empty()) return true;
  const frame::ObjectRange& range = geometry_.objects[static_cast<std::size_t>(object)];
  if (range.bounds.empty()) return true;
  std::array<Vector<double>, 8> corners = cornersOf(range.bounds);
  // Its image would be before the mirror, where nothing of it is drawn
  if (planes.size() == 1 && isBehind(planes[0], camera_.eye(), corners)) return true;
  std::array<Vec3, 8> images;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    for (std::size_t plane = planes.size(); plane-- > 0;)
      corners[i] = mirrored(planes[plane], corners[i]);
    images[i] = Vec3(corners[i][0], corners[i][1], corners[i][2]);
  }
  return intersection(mirror, raster::shownRectangle(camera_, width_, height_, images)).empty();
}

}  // namespace catoptric::methods::perturbation
