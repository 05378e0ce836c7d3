#include "methods/glossy_lod/filter.h"

#include <algorithm>
#include <cmath>

#include "core/lanes.h"

namespace catoptric::methods::glossy_lod {
namespace {

/// Least cosine of the angle at which a ray meets a surface, that its footprint is computed with.
constexpr float kLeastCosine = 0.02f;

const Vec4& nearestRadiance(const Radiance& radiance, const PlacedChart& chart, const Vec2& place,
                            int side) {
  const glm::uvec2 texel = nearestTexel(chart, place);
  return radiance.texel(side, chart.x + texel.x, chart.y + texel.y);
}

/// Bilinear within the chart; beyond the outer texels' centres as it goes on from there.
Footprint::Square squareOn(const Radiance& radiance, const PlacedChart& chart, const Vec2& place,
                           int level, int side) {
  const int size = (1 << chart.image.texelLevel) >> level;
  const float x = place.x * static_cast<float>(size) - 0.5f;
  const float y = place.y * static_cast<float>(size) - 0.5f;
  const int x0 = std::clamp(static_cast<int>(x), 0, std::max(0, size - 2));
  const int y0 = std::clamp(static_cast<int>(y), 0, std::max(0, size - 2));
  Footprint::Square square;
  square.corner = radiance.onLevel(side, level, (chart.x >> level) + static_cast<std::uint32_t>(x0),
                                   (chart.y >> level) + static_cast<std::uint32_t>(y0));
  square.right = x0 + 1 < size ? 1 : 0;
  square.up = y0 + 1 < size ? radiance.row() : 0;
  square.at = {x - static_cast<float>(x0), y - static_cast<float>(y0)};
  __builtin_prefetch(square.corner);
  __builtin_prefetch(square.corner + square.up + square.right);
  return square;
}

Floats4 mix(const Floats4& a, const Floats4& b, float share) {
  return a + share * (b - a);
}

Floats4 meanOf(const Footprint::Square& square) {
  const auto at = [&](std::size_t texel) { return load<Floats4>(&square.corner[texel]); };
  return mix(mix(at(0), at(square.right), square.at.x),
             mix(at(square.up), at(square.up + square.right), square.at.x), square.at.y);
}

float levelAt(const SceneImages& images, const Quad& quad, const PlacedChart& chart, const Vec2& at,
              const Vec3& direction, float width) {
  const std::uint32_t stride = 1u << (quad.place >> 24);
  const bool upper = at.x + at.y > 1.0f;
  const Vec4* const v = &images.vertices()[quad.first];
  const Vec3 p(v[upper ? quad.up + stride : 0]);
  const Vec3 normal = glm::cross(Vec3(v[stride]) - p, Vec3(v[quad.up]) - p);
  const float square = std::max(glm::dot(normal, normal), 1e-38f);
  const float twice = std::sqrt(square);  // the triangle's area: that of the quad, if it were flat
  const float cosine = std::max(std::abs(glm::dot(normal, direction)) / twice, kLeastCosine);
  // Eq. (8), and texels of the finest level in it
  const int finer = chart.image.texelLevel - chart.image.level + static_cast<int>(quad.place >> 24);
  const float texels = width * width / cosine * static_cast<float>(1u << (2 * finer)) / twice;
  return std::clamp(0.5f * std::log2(std::max(texels, 1e-38f)), 0.0f,
                    static_cast<float>(chart.image.texelLevel));  // Eq. (9)
}

}  // namespace

Vec2 placeInChart(const Quad& quad, const PlacedChart& chart, const Vec2& at) {
  const Vec2 corner(static_cast<float>(quad.place & 0xFFFu),
                    static_cast<float>(quad.place >> 12 & 0xFFFu));
  return (corner + at * static_cast<float>(1u << (quad.place >> 24))) /
         static_cast<float>(1u << chart.image.level);
}

glm::uvec2 nearestTexel(const PlacedChart& chart, const Vec2& place) {
  const int size = 1 << chart.image.texelLevel;
  return {std::clamp(static_cast<int>(place.x * static_cast<float>(size)), 0, size - 1),
          std::clamp(static_cast<int>(place.y * static_cast<float>(size)), 0, size - 1)};
}

float levelOf(const SceneImages& images, const QuadHit& found, const Vec3& direction, float width) {
  const Quad& quad = images.tree().quads()[found.node];
  return levelAt(images, quad, images.charts()[quad.chart], found.at, direction, width);
}

Footprint footprint(const SceneImages& images, const Radiance& radiance, const QuadHit& found,
                    const Vec3& direction, float width, bool filter) {
  const Quad& quad = images.tree().quads()[found.node];
  const PlacedChart& chart = images.charts()[quad.chart];
  const Vec2 place = placeInChart(quad, chart, found.at);
  const int side = found.back ? 1 : 0;
  Footprint result;
  if (!filter) {
    result.fine.corner = &nearestRadiance(radiance, chart, place, side);
    return result;
  }
  // Bilinear on both levels next to it
  const float level = levelAt(images, quad, chart, found.at, direction, width);
  const int fine = static_cast<int>(level);
  result.share = level - static_cast<float>(fine);
  result.fine = squareOn(radiance, chart, place, fine, side);
  if (result.share > 0.0f) result.coarse = squareOn(radiance, chart, place, fine + 1, side);
  return result;
}

Vec3 mean(const Footprint& footprint) {
  Floats4 value = meanOf(footprint.fine);
  if (footprint.share > 0.0f) value = mix(value, meanOf(footprint.coarse), footprint.share);
  return glm::max(Vec3(value[0], value[1], value[2]), 0.0f);
}

bool isCutAway(const void* sceneTexels, std::uint32_t node, Vec2 at) {
  const auto& [images, radiance] = *static_cast<const SceneTexels*>(sceneTexels);
  const Quad& quad = images.tree().quads()[node];
  const PlacedChart& chart = images.charts()[quad.chart];
  return nearestRadiance(radiance, chart, placeInChart(quad, chart, at), 0).w < 0.0f;
}

}  // namespace catoptric::methods::glossy_lod
