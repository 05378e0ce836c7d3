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

/// Bilinear within the chart.
Footprint::Square squareOn(const Radiance& radiance, const PlacedChart& chart, const Vec2& place,
                           int level, int side) {
  const int size = (1 << chart.image.texelLevel) >> level;
  const float last = static_cast<float>(size - 1);
  const float x = std::clamp(place.x * static_cast<float>(size) - 0.5f, 0.0f, last);
  const float y = std::clamp(place.y * static_cast<float>(size) - 0.5f, 0.0f, last);
  const int x0 = static_cast<int>(x);
  const int y0 = static_cast<int>(y);
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

/// Bilinear on both levels next to `level`.
Footprint onLevels(const Radiance& radiance, const PlacedChart& chart, const Vec2& place,
                   float level, int side) {
  const int fine = static_cast<int>(level);
  Footprint result;
  result.share = level - static_cast<float>(fine);
  result.fine = squareOn(radiance, chart, place, fine, side);
  if (result.share > 0.0f) result.coarse = squareOn(radiance, chart, place, fine + 1, side);
  return result;
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

float levelOf(const SceneImages& images, const Found& found, const Vec3& direction, float width) {
  const Quad& quad = images.tree().quads()[found.node];
  return levelAt(images, quad, images.charts()[quad.chart], found.at, direction, width);
}

Footprint footprint(const SceneImages& images, const Radiance& radiance, const Found& found,
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
  return onLevels(radiance, chart, place, levelAt(images, quad, chart, found.at, direction, width),
                  side);
}

Ellipse ellipseOf(const SceneImages& images, const Found& found, const Vec3& direction,
                  float width) {
  const Quad& quad = images.tree().quads()[found.node];
  const ChartImage& image = images.charts()[quad.chart].image;
  const std::uint32_t stride = 1u << (quad.place >> 24);
  const Vec4* const v = &images.vertices()[quad.first];
  const Vec3 corner(v[found.at.x + found.at.y > 1.0f ? quad.up + stride : 0]);
  const Vec3 right = Vec3(v[stride]) - corner;
  const Vec3 up = Vec3(v[quad.up]) - corner;
  const Vec3 normal = normalizedOr(glm::cross(right, up), Vec3(0.0f));
  const float cosine = glm::dot(normal, direction);
  // The circle about the ray on the triangle's plane
  const Vec3 tilted = normalizedOr(direction - cosine * normal, Vec3(0.0f));
  const Vec3 level =
      tilted == Vec3(0.0f) ? normalizedOr(right, Vec3(0.0f)) : glm::cross(normal, tilted);
  const Vec3 steep = glm::cross(level, normal);
  // In texels: by the dual basis of the triangle's edges
  const Vec3 area = glm::cross(right, up);
  const float square = glm::dot(area, area);
  const int finer = image.texelLevel - image.level + static_cast<int>(quad.place >> 24);
  const float texels = width * static_cast<float>(1u << finer) / std::max(square, 1e-38f);
  const Vec3 toRight = glm::dot(up, up) * right - glm::dot(right, up) * up;
  const Vec3 toUp = glm::dot(right, right) * up - glm::dot(right, up) * right;
  const Vec2 a = texels * Vec2(glm::dot(level, toRight), glm::dot(level, toUp));
  const Vec2 b = texels / std::max(std::abs(cosine), kLeastCosine) *
                 Vec2(glm::dot(steep, toRight), glm::dot(steep, toUp));
  // Its axes: those of the matrix a a' + b b'
  const float xx = a.x * a.x + b.x * b.x;
  const float yy = a.y * a.y + b.y * b.y;
  const float xy = a.x * a.y + b.x * b.y;
  const float half = 0.5f * (xx - yy);
  const float root = std::sqrt(half * half + xy * xy);
  const float longest = std::sqrt(0.5f * (xx + yy) + root);
  const Vec2 axis = half >= 0.0f ? Vec2(half + root, xy) : Vec2(xy, root - half);
  const float length = glm::length(axis);
  return {length > 0.0f ? longest / length * axis : Vec2(longest, 0.0f),
          std::abs(a.x * b.y - a.y * b.x) / std::max(longest, 1e-38f)};
}

Vec3 anisotropicMean(const SceneImages& images, const Radiance& radiance, const Found& found,
                     const Vec3& direction, float width, int most) {
  const Quad& quad = images.tree().quads()[found.node];
  const PlacedChart& chart = images.charts()[quad.chart];
  const Ellipse ellipse = ellipseOf(images, found, direction, width);
  const float longest = glm::length(ellipse.along);
  const float ratio =
      std::clamp(longest / std::max(ellipse.across, 1.0f), 1.0f, static_cast<float>(most));
  const float level = std::clamp(std::log2(std::max(longest / ratio, 1e-38f)), 0.0f,
                                 static_cast<float>(chart.image.texelLevel));
  const int places = static_cast<int>(std::ceil(ratio));
  const Vec2 middle = placeInChart(quad, chart, found.at);
  const Vec2 step = ellipse.along / static_cast<float>(places << chart.image.texelLevel);
  Vec3 sum(0.0f);
  for (int i = 0; i < places; ++i) {
    const float from = static_cast<float>(i) - 0.5f * static_cast<float>(places - 1);
    sum += mean(onLevels(radiance, chart, middle + from * step, level, found.back ? 1 : 0));
  }
  return sum / static_cast<float>(places);
}

Vec3 mean(const Footprint& footprint) {
  Floats4 value = meanOf(footprint.fine);
  if (footprint.share > 0.0f) value = mix(value, meanOf(footprint.coarse), footprint.share);
  return {value[0], value[1], value[2]};
}

bool isCutAway(const void* sceneTexels, std::uint32_t node, Vec2 at) {
  const auto& [images, radiance] = *static_cast<const SceneTexels*>(sceneTexels);
  const Quad& quad = images.tree().quads()[node];
  const PlacedChart& chart = images.charts()[quad.chart];
  return nearestRadiance(radiance, chart, placeInChart(quad, chart, at), 0).w < 0.0f;
}

}  // namespace catoptric::methods::glossy_lod
