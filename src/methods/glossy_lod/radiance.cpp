#include "methods/glossy_lod/radiance.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "core/parallel.h"
#include "frame/surfaces.h"

namespace catoptric::methods::glossy_lod {
namespace {

/// Rows of a chart that a thread shades at a time. Ours.
constexpr std::uint32_t kRows = 16;

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
  const std::uint32_t last = (1u << finer) - 1;
  const bool inLower = (x & last) + (y & last) < last && lower > 0.0f;
  return 2.0f * (inLower ? lower : upper) / n;
}

}  // namespace

void Radiance::shadeRows(const PlacedChart& chart, int side, std::uint32_t first,
                         std::uint32_t end) {
  const auto& [scene, geometry, lighting, images] = shading_;
  const frame::ObjectRange& range = geometry->objects[static_cast<std::size_t>(chart.object)];
  const std::uint32_t n = 1u << chart.image.texelLevel;
  std::uint64_t notFinite = 0;
  Vec4* const texels = texels_[static_cast<std::size_t>(side)].get();
  const std::uint32_t* const indices = &geometry->indices[range.firstIndex];
  const auto triangleOf = [indices](const TrianglePlace& place) {
    return indices + std::size_t{3} * place.triangle;
  };
  static thread_local frame::SurfaceLanes lanes;
  for (std::uint32_t y = first; y < end; ++y) {
    const TrianglePlace* const places = &chart.source->texels[chart.image.firstTexel + y * n];
    std::array<float, frame::SurfaceLanes::kMost> areas;
    for (std::uint32_t x0 = 0; x0 < n; x0 += frame::SurfaceLanes::kMost) {
      const std::uint32_t count = std::min<std::uint32_t>(n - x0, frame::SurfaceLanes::kMost);
      for (std::uint32_t k = 0; k < count; ++k) __builtin_prefetch(triangleOf(places[x0 + k]));
      for (std::uint32_t k = 0; k < count; ++k)
        frame::prefetchTriangle(*geometry, triangleOf(places[x0 + k]));
      lanes.count = 0;
      for (std::uint32_t k = 0; k < count; ++k) {
        const TrianglePlace& place = places[x0 + k];
        const std::uint32_t* v = triangleOf(place);
        const Vec3& p0 = geometry->positions[v[0]];  // a copy would go by way of the stack
        const Vec3 e1 = geometry->positions[v[1]] - p0;
        const Vec3 e2 = geometry->positions[v[2]] - p0;
        const Vec3 front = normalizedOr(glm::cross(e1, e2), Vec3(0.0f, 1.0f, 0.0f));
        areas[k] = texelArea(chart, images->vertices(), x0 + k, y);
        lanes.add(chart.object, place.triangle, place.b1, place.b2,
                  p0 + place.b1 * e1 + place.b2 * e2, side == 0 ? -front : front,
                  std::sqrt(areas[k]));
      }
      frame::shadeSurfaces(*scene, *geometry, *lighting, lanes, nullptr);
      for (std::uint32_t k = 0; k < count; ++k) {
        const TrianglePlace& place = places[x0 + k];
        const bool cut =
            frame::isCutOut(*scene, *geometry, chart.object, place.triangle, place.b1, place.b2);
        Vec3 radiance = lanes.diffuse.at(k);
        if (!isFinite(radiance)) {
          radiance = Vec3(0.0f);
          ++notFinite;
        }
        texels[at(0, chart.x + x0 + k, chart.y + y)] = Vec4(radiance, cut ? -1.0f : areas[k]);
      }
    }
  }
  if (notFinite > 0) notFinite_ += notFinite;
}

void Radiance::average(const PlacedChart& chart, int side) {
  Vec4* const texels = texels_[static_cast<std::size_t>(side)].get();
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
          const Vec4& finer = texels[at(level - 1, 2 * (x0 + x) + k % 2, 2 * (y0 + y) + k / 2)];
          if (finer.w < 0.0f) continue;
          sum += finer.w * Vec3(finer);
          area += finer.w;
          ++shown;
        }
        texels[at(level, x0 + x, y0 + y)] =
            Vec4(area > 0.0f ? sum / area : Vec3(0.0f),
                 shown > 0 ? area / static_cast<float>(shown) : -1.0f);
      }
    }
  }
}

void Radiance::allocate() {
  if (states_) return;
  size_ = shading_.images->atlasSize();
  for (auto& texels : texels_) texels = std::make_unique_for_overwrite<Vec4[]>(width() * size_.y);
  states_ = std::make_unique<std::atomic<State>[]>(2 * shading_.images->charts().size());
  stale_ = 0;
}

void Radiance::shade(const Shading& shading, std::span<const int> objects) {
  shadeLater(shading, objects);
  struct Rows {
    std::uint32_t chart, first, end;
  };
  std::vector<std::uint32_t> charts;
  std::vector<Rows> parts;
  for (const int object : objects) {
    for (const PlacedChart& chart : shading.images->chartsOf(object)) {
      const auto number = static_cast<std::uint32_t>(&chart - shading.images->charts().data());
      const std::uint32_t n = 1u << chart.image.texelLevel;
      charts.push_back(number);
      for (std::uint32_t y = 0; y < n; y += kRows)
        parts.push_back({number, y, std::min(n, y + kRows)});
    }
  }
  const std::vector<PlacedChart>& all = shading.images->charts();
  parallelFor(parts.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t p = begin; p < end; ++p)
      shadeRows(all[parts[p].chart], 0, parts[p].first, parts[p].end);
  });
  parallelFor(charts.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t c = begin; c < end; ++c) {
      average(all[charts[c]], 0);
      setShaded(charts[c], 0);
    }
  });
}

void Radiance::shadeLater(const Shading& shading, std::span<const int> objects) {
  shading_ = shading;
  allocate();
  for (const int object : objects) {
    for (const PlacedChart& chart : shading.images->chartsOf(object)) {
      const auto first = 2 * static_cast<std::size_t>(&chart - shading.images->charts().data());
      for (std::size_t side = 0; side < 2; ++side)
        if (states_[first + side].exchange(State::Stale) == State::Shaded) ++stale_;
    }
  }
}

bool Radiance::ensure(std::uint32_t chart, int side) {
  std::atomic<State>& state = states_[2 * std::size_t{chart} + static_cast<std::size_t>(side)];
  State found = State::Stale;
  if (!state.compare_exchange_strong(found, State::Shading)) {
    state.wait(State::Shading);  // no longer so where it is shaded
    return false;
  }
  const PlacedChart& placed = shading_.images->charts()[chart];
  shadeRows(placed, side, 0, 1u << placed.image.texelLevel);
  average(placed, side);
  setShaded(chart, side);
  state.notify_all();
  return true;
}

void Radiance::setShaded(std::uint32_t chart, int side) {
  std::atomic<State>& state = states_[2 * std::size_t{chart} + static_cast<std::size_t>(side)];
  if (state.exchange(State::Shaded) != State::Shaded) --stale_;
}

}  // namespace catoptric::methods::glossy_lod
