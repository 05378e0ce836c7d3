#include "methods/glossy_lod/radiance.h"

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>

#include "core/parallel.h"

namespace catoptric::methods::glossy_lod {
namespace {

float triangleArea(const Vec4& a, const Vec4& b, const Vec4& c) {
  return 0.5f * glm::length(glm::cross(Vec3(b) - Vec3(a), Vec3(c) - Vec3(a)));
}

/// Square metres of texel (x, y), by the triangles of its quad.
float texelArea(const PlacedChart& chart, const std::vector<Vec4>& vertices, std::uint32_t x,
                std::uint32_t y) {
  const std::uint32_t finer = static_cast<std::uint32_t>(chart.image.texelLevel) -
                              static_cast<std::uint32_t>(chart.image.level);
  const std::uint32_t across = (1u << chart.image.level) + 1;
  const Vec4* v = &vertices[chart.firstVertex + (y >> finer) * across + (x >> finer)];
  const float lower = triangleArea(v[0], v[1], v[across]);
  const float upper = triangleArea(v[across + 1], v[across], v[1]);
  const auto n = static_cast<float>(1u << (2 * finer));
  if (finer == 0) return lower + upper;
  // A plain chart of one triangle has it in one half
  const bool inLower = x + y + 1 < (1u << finer) && lower > 0.0f;
  return 2.0f * (inLower ? lower : upper) / n;
}

}  // namespace

std::uint64_t Radiance::shadeChart(const scene::Scene& scene, const frame::Geometry& geometry,
                                   const frame::Lighting& lighting, const SceneImages& images,
                                   const PlacedChart& chart) {
  const frame::ObjectRange& range = geometry.objects[static_cast<std::size_t>(chart.object)];
  const std::uint32_t n = 1u << chart.image.texelLevel;
  std::uint64_t notFinite = 0;
  for (std::uint32_t y = 0; y < n; ++y) {
    for (std::uint32_t x = 0; x < n; ++x) {
      const Place& place = chart.source->texels[chart.image.firstTexel + y * n + x];
      const std::uint32_t* v = &geometry.indices[range.firstIndex + 3 * place.triangle];
      const Vec3 p0 = geometry.positions[v[0]];
      const Vec3 e1 = geometry.positions[v[1]] - p0;
      const Vec3 e2 = geometry.positions[v[2]] - p0;
      const Vec3 position = p0 + place.b1 * e1 + place.b2 * e2;
      const Vec3 front = normalizedOr(glm::cross(e1, e2), Vec3(0.0f, 1.0f, 0.0f));
      const float area = texelArea(chart, images.vertices(), x, y);
      const bool cut =
          frame::isCutOut(scene, geometry, chart.object, place.triangle, place.b1, place.b2);
      for (int s = 0; s < 2; ++s) {
        Vec3 radiance =
            frame::shadeSurface(scene, geometry, lighting, chart.object, place.triangle, place.b1,
                                place.b2, position, s == 0 ? -front : front, std::sqrt(area))
                .diffuse;
        if (!isFinite(radiance)) {
          radiance = Vec3(0.0f);
          ++notFinite;
        }
        texels_[s][at(0, chart.x + x, chart.y + y)] = Vec4(radiance, cut ? -1.0f : area);
      }
    }
  }
  return notFinite;
}

void Radiance::average(const PlacedChart& chart) {
  for (int s = 0; s < 2; ++s) {
    for (int level = 1; level <= chart.image.texelLevel; ++level) {
      const std::uint32_t n = 1u << (chart.image.texelLevel - level);
      const std::uint32_t x0 = chart.x >> level;
      const std::uint32_t y0 = chart.y >> level;
      for (std::uint32_t y = 0; y < n; ++y) {
        for (std::uint32_t x = 0; x < n; ++x) {
          // Means over the surface, which in the image is stretched
          Vec3 sum(0.0f);
          float area = 0.0f;
          int shown = 0;
          for (std::size_t k = 0; k < 4; ++k) {
            const Vec4& finer =
                texels_[s][at(level - 1, 2 * (x0 + x) + k % 2, 2 * (y0 + y) + k / 2)];
            if (finer.w < 0.0f) continue;
            sum += finer.w * Vec3(finer);
            area += finer.w;
            ++shown;
          }
          texels_[s][at(level, x0 + x, y0 + y)] =
              Vec4(area > 0.0f ? sum / area : Vec3(0.0f),
                   shown > 0 ? area / static_cast<float>(shown) : -1.0f);
        }
      }
    }
  }
}

void Radiance::shade(const scene::Scene& scene, const frame::Geometry& geometry,
                     const frame::Lighting& lighting, const SceneImages& images,
                     std::span<const int> objects) {
  if (side_ == 0) {
    side_ = images.atlasSide();
    for (auto& texels : texels_) texels.assign(width() * side_, Vec4(0.0f));
  }
  std::vector<const PlacedChart*> charts;
  for (const int object : objects)
    for (const PlacedChart& chart : images.chartsOf(object)) charts.push_back(&chart);
  if (charts.empty()) return;
  std::atomic<std::uint64_t> notFinite{0};
  parallelFor(charts.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t c = begin; c < end; ++c) {
      notFinite += shadeChart(scene, geometry, lighting, images, *charts[c]);
      average(*charts[c]);
    }
  });
  notFinite_ = notFinite;
}

}  // namespace catoptric::methods::glossy_lod
