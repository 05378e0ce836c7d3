#include "methods/glossy_lod/filter.h"

#include <algorithm>
#include <cmath>

namespace catoptric::methods::glossy_lod {
namespace {

/// Least cosine of the angle at which a ray meets a surface, that its footprint is computed with.
constexpr float kLeastCosine = 0.02f;

/// The place of a hit in its chart, 0..1.
Vec2 placeInChart(const Quad& quad, const PlacedChart& chart, const Vec2& at) {
  const Vec2 corner(static_cast<float>(quad.place & 0xFFFu),
                    static_cast<float>(quad.place >> 12 & 0xFFFu));
  return (corner + at * static_cast<float>(1u << (quad.place >> 24))) /
         static_cast<float>(1u << chart.image.level);
}

const Vec4& nearestTexel(const Radiance& radiance, const PlacedChart& chart, const Vec2& place,
                         int side) {
  const int size = 1 << chart.image.texelLevel;
  const int x = std::clamp(static_cast<int>(place.x * static_cast<float>(size)), 0, size - 1);
  const int y = std::clamp(static_cast<int>(place.y * static_cast<float>(size)), 0, size - 1);
  return radiance.texel(side, chart.x + static_cast<std::uint32_t>(x),
                        chart.y + static_cast<std::uint32_t>(y));
}

/// Bilinear within the chart.
Vec4 onLevel(const Radiance& radiance, const PlacedChart& chart, const Vec2& place, int level,
             int side) {
  const int size = (1 << chart.image.texelLevel) >> level;
  const float last = static_cast<float>(size - 1);
  const float x = std::clamp(place.x * static_cast<float>(size) - 0.5f, 0.0f, last);
  const float y = std::clamp(place.y * static_cast<float>(size) - 0.5f, 0.0f, last);
  const int x0 = static_cast<int>(x);
  const int y0 = static_cast<int>(y);
  const std::size_t row = radiance.row();
  const Vec4* const corner =
      radiance.onLevel(side, level, (chart.x >> level) + x0, (chart.y >> level) + y0);
  const std::size_t right = x0 + 1 < size ? 1 : 0;
  const std::size_t up = y0 + 1 < size ? row : 0;
  const float fx = x - static_cast<float>(x0);
  const float fy = y - static_cast<float>(y0);
  const Vec4 low = corner[0] + fx * (corner[right] - corner[0]);
  const Vec4 high = corner[up] + fx * (corner[up + right] - corner[up]);
  return low + fy * (high - low);
}

float levelAt(const SceneImages& images, const Quad& quad, const PlacedChart& chart,
              const Vec4& texel, const Found& found, const Vec3& direction, float width) {
  const std::uint32_t stride = 1u << (quad.place >> 24);
  const bool upper = found.at.x + found.at.y > 1.0f;
  const Vec4* const v = &images.vertices()[quad.first];
  const Vec3 p(v[upper ? quad.up + stride : 0]);
  const Vec3 normal = glm::cross(Vec3(v[stride]) - p, Vec3(v[quad.up]) - p);
  const float cosine =
      std::abs(glm::dot(normal, direction)) / std::sqrt(std::max(glm::dot(normal, normal), 1e-38f));
  const float area = width * width / std::max(cosine, kLeastCosine);  // Eq. (8)
  const float texels = area / std::max(texel.w, 1e-38f);
  return std::clamp(0.5f * std::log2(std::max(texels, 1e-38f)), 0.0f,
                    static_cast<float>(chart.image.texelLevel));  // Eq. (9)
}

}  // namespace

float levelOf(const SceneImages& images, const Radiance& radiance, const Found& found,
              const Vec3& direction, float width) {
  const Quad& quad = images.tree().quads()[found.node];
  const PlacedChart& chart = images.charts()[quad.chart];
  const Vec4& texel =
      nearestTexel(radiance, chart, placeInChart(quad, chart, found.at), found.back ? 1 : 0);
  return levelAt(images, quad, chart, texel, found, direction, width);
}

Vec3 seen(const SceneImages& images, const Radiance& radiance, const Found& found,
          const Vec3& direction, float width, bool filter) {
  const Quad& quad = images.tree().quads()[found.node];
  const PlacedChart& chart = images.charts()[quad.chart];
  const Vec2 place = placeInChart(quad, chart, found.at);
  const int side = found.back ? 1 : 0;
  const Vec4& texel = nearestTexel(radiance, chart, place, side);
  if (!filter) return Vec3(texel);
  const float level = levelAt(images, quad, chart, texel, found, direction, width);
  const int fine = static_cast<int>(level);
  const Vec4 low = onLevel(radiance, chart, place, fine, side);
  const float share = level - static_cast<float>(fine);
  if (!(share > 0.0f)) return Vec3(low);
  return Vec3(low + share * (onLevel(radiance, chart, place, fine + 1, side) - low));
}

bool isCutAway(const void* sceneTexels, std::uint32_t node, Vec2 at) {
  const auto& [images, radiance] = *static_cast<const SceneTexels*>(sceneTexels);
  const Quad& quad = images.tree().quads()[node];
  const PlacedChart& chart = images.charts()[quad.chart];
  return nearestTexel(radiance, chart, placeInChart(quad, chart, at), 0).w < 0.0f;
}

}  // namespace catoptric::methods::glossy_lod
