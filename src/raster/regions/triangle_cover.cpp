#include "raster/regions/triangle_cover.h"

#include <cmath>

#include "gl/api.h"

namespace catoptric::raster {
namespace {

/// Over more samples than that a triangle's bounding box will do (ours).
constexpr int kFewSamples = 64;
/// Rounding of a driver's clip coordinates in floats, in units of their terms (ours: four times
/// what one evaluation may err).
constexpr double kCoverRounding = 16.0 * std::numeric_limits<float>::epsilon();

}  // namespace

TriangleCover::TriangleCover(const scene::Camera& camera, int width, int height)
    : all_{0, 0, width, height}, size_(width, height), nearMetres_(camera.nearMetres) {
  const float aspect = static_cast<float>(width) / static_cast<float>(height);
  const glm::dmat4 rows = glm::transpose(glm::dmat4(scene::clipFromCamera(camera, aspect)) *
                                         glm::dmat4(scene::cameraFromWorld(camera)));
  rows_ = {rows[0], rows[1], rows[3]};
  GLint subpixelBits = 0;
  glGetIntegerv(GL_SUBPIXEL_BITS, &subpixelBits);
  snap_ = std::ldexp(1.0, -subpixelBits);
}

TriangleCover::Corner TriangleCover::corner(const Vec3& point) const {
  const glm::dvec4 p(glm::dvec3(point), 1.0);
  const double w = glm::dot(rows_[2], p);
  Corner corner;
  corner.seen = w > nearMetres_;
  if (!corner.seen) return corner;
  corner.at = size_ * (0.5 + 0.5 * glm::dvec2(glm::dot(rows_[0], p), -glm::dot(rows_[1], p)) / w);
  // The driver's snap, and what rounding of clip coordinates and of samples may err
  const glm::dvec4 terms = glm::max(glm::abs(rows_[0]), glm::abs(rows_[1])) + glm::abs(rows_[2]);
  const double clip = glm::dot(terms, glm::abs(p)) / w;
  corner.margin = 2.0 * snap_ + kCoverRounding * ((clip + 1.0) * std::max(size_.x, size_.y) +
                                                  glm::length(corner.at));
  return corner;
}

Rectangle TriangleCover::covered(const std::array<Corner, 3>& corners) const {
  glm::dvec2 low(std::numeric_limits<double>::infinity());
  glm::dvec2 high = -low;
  double margin = 0.0;
  for (const Corner& corner : corners) {
    if (!corner.seen) return all_;
    low = glm::min(low, corner.at);
    high = glm::max(high, corner.at);
    margin = std::max(margin, corner.margin);
  }
  if (!(low.x <= high.x && low.y <= high.y)) return {};
  // Far outside, int would overflow
  low = glm::clamp(glm::ceil(low - margin - 0.5), glm::dvec2(0.0), size_);
  high = glm::clamp(glm::floor(high + margin - 0.5) + 1.0, glm::dvec2(0.0), size_);
  const Rectangle box{static_cast<int>(low.x), static_cast<int>(low.y), static_cast<int>(high.x),
                      static_cast<int>(high.y)};
  if (box.empty() || box.width() > kFewSamples || box.width() * box.height() > kFewSamples)
    return box;

  // Centres on the inner side of all edges, as far as the margin lets one know
  const glm::dvec2 ab = corners[1].at - corners[0].at;
  const glm::dvec2 ac = corners[2].at - corners[0].at;
  const double area = ab.x * ac.y - ab.y * ac.x;
  const auto sum = [](const glm::dvec2& v) { return std::abs(v.x) + std::abs(v.y); };
  if (!(std::abs(area) > 2.0 * margin * (sum(ab) + sum(ac) + 4.0 * margin))) return box;
  Rectangle covered;
  for (int y = box.y0; y < box.y1; ++y) {
    for (int x = box.x0; x < box.x1; ++x) {
      bool inside = true;
      for (std::size_t c = 0; c < 3; ++c) {
        const glm::dvec2 edge = corners[(c + 1) % 3].at - corners[c].at;
        const glm::dvec2 from = glm::dvec2(x + 0.5, y + 0.5) - corners[c].at;
        const double side = std::copysign(1.0, area) * (edge.x * from.y - edge.y * from.x);
        inside = inside && side >= -margin * (2.0 * sum(from) + sum(edge) + 4.0 * margin);
      }
      if (inside) covered = bounding(covered, {x, y, x + 1, y + 1});
    }
  }
  return covered;
}

}  // namespace catoptric::raster
