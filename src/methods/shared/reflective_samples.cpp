#include "methods/shared/reflective_samples.h"

#include <algorithm>
#include <array>

#include "core/parallel.h"
#include "methods/shared/sample_points.h"

namespace catoptric::methods {
namespace {

constexpr int kTile = 16;  ///< samples; ours

/// Order of a tile's samples: blocks of 4 x 2, so that a packet of 8 is compact.
const std::array<std::array<std::uint8_t, 2>, kTile * kTile>& tileOrder() {
  static const auto order = [] {
    std::array<std::array<std::uint8_t, 2>, kTile * kTile> o{};
    std::size_t n = 0;
    for (int by = 0; by < kTile; by += 2) {
      for (int bx = 0; bx < kTile; bx += 4) {
        for (int y = by; y < by + 2; ++y) {
          for (int x = bx; x < bx + 4; ++x) {
            o[n++] = {static_cast<std::uint8_t>(x), static_cast<std::uint8_t>(y)};
          }
        }
      }
    }
    return o;
  }();
  return order;
}

}  // namespace

ReflectiveSamples collectReflective(const raster::GBufferCopy& source, const scene::Camera& camera,
                                    const trace::TraceScene& trace, const frame::ObjectSet& own) {
  const int width = source.sampleWidth();
  const int height = source.sampleHeight();
  const int tilesX = (width + kTile - 1) / kTile;
  const int tilesY = (height + kTile - 1) / kTile;
  const std::size_t tiles = static_cast<std::size_t>(tilesX) * static_cast<std::size_t>(tilesY);
  const auto reflects = [&](std::size_t at) {
    return source.object[at] != 0 && source.diffuse[4 * at + 3] > 0.0f && source.depth[at] > 0.0f &&
           own.contains(static_cast<int>(source.object[at]) - 1);
  };

  // Count per tile, so that every tile knows where it writes.
  std::vector<std::size_t> first(tiles + 1, 0);
  parallelFor(tiles, 32, [&](std::size_t begin, std::size_t end) {
    for (std::size_t tile = begin; tile < end; ++tile) {
      const int x0 = static_cast<int>(tile % static_cast<std::size_t>(tilesX)) * kTile;
      const int y0 = static_cast<int>(tile / static_cast<std::size_t>(tilesX)) * kTile;
      std::size_t count = 0;
      for (int y = y0; y < std::min(height, y0 + kTile); ++y) {
        for (int x = x0; x < std::min(width, x0 + kTile); ++x) {
          count += reflects(static_cast<std::size_t>(y) * width + x) ? 1 : 0;
        }
      }
      first[tile + 1] = count;
    }
  });
  for (std::size_t tile = 0; tile < tiles; ++tile) first[tile + 1] += first[tile];

  ReflectiveSamples result;
  result.points.resize(first[tiles]);
  result.places.resize(first[tiles]);
  const SamplePoints pointAt(source, camera, trace);
  parallelFor(tiles, 32, [&](std::size_t begin, std::size_t end) {
    std::array<std::uint32_t, kTile * kTile> members;
    for (std::size_t tile = begin; tile < end; ++tile) {
      if (first[tile] == first[tile + 1]) continue;
      const int x0 = static_cast<int>(tile % static_cast<std::size_t>(tilesX)) * kTile;
      const int y0 = static_cast<int>(tile / static_cast<std::size_t>(tilesX)) * kTile;
      std::size_t count = 0;
      bool mixed = false;
      for (const auto& [dx, dy] : tileOrder()) {
        const int x = x0 + dx;
        const int y = y0 + dy;
        if (x >= width || y >= height) continue;
        const std::size_t at = static_cast<std::size_t>(y) * width + x;
        if (!reflects(at)) continue;
        members[count++] = static_cast<std::uint32_t>(at);
        mixed = mixed || source.object[at] != source.object[members[0]];
      }
      if (mixed) {
        std::stable_sort(
            members.begin(), members.begin() + static_cast<std::ptrdiff_t>(count),
            [&](std::uint32_t a, std::uint32_t b) { return source.object[a] < source.object[b]; });
      }
      for (std::size_t k = 0; k < count; ++k) {
        const std::uint32_t at = members[k];
        const int x = static_cast<int>(at % static_cast<std::uint32_t>(width));
        const int y = static_cast<int>(at / static_cast<std::uint32_t>(width));
        result.points[first[tile] + k] = pointAt(x, y);
        result.places[first[tile] + k] = at;
      }
    }
  });
  return result;
}

void ReflectionUpload::scatter(const raster::GBuffer& gbuffer, bool beside,
                               std::span<const std::uint32_t> places,
                               std::span<const Vec3> radiance,
                               std::span<const std::uint8_t> flags) {
  const std::size_t total = static_cast<std::size_t>(gbuffer.sampleWidth()) *
                            static_cast<std::size_t>(gbuffer.sampleHeight());
  if (beside) {
    image_ = raster::readRgba(gbuffer.reflection);
  } else {
    image_.assign(4 * total, 0.0f);
  }
  parallelFor(places.size(), 16384, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) {
      float* texel = &image_[4 * static_cast<std::size_t>(places[k])];
      texel[0] = radiance[k].x;
      texel[1] = radiance[k].y;
      texel[2] = radiance[k].z;
      texel[3] = 1.0f;
    }
  });
  masks_.clear();
  if (flags.empty()) return;
  if (beside) {
    masks_ = raster::readMasks(gbuffer.masks);
  } else {
    masks_.assign(total, 0);
  }
  for (std::size_t k = 0; k < places.size(); ++k) {
    std::uint16_t bits = 0;
    if ((flags[k] & 1) != 0) bits |= raster::kMaskEnvironment;
    if ((flags[k] & 2) != 0) bits |= raster::kMaskBelowHorizon;
    if ((flags[k] & 4) != 0) bits |= raster::kMaskSky;
    masks_[places[k]] = bits;
  }
}

void ReflectionUpload::mark(std::uint32_t place, std::uint16_t bits) {
  masks_[place] |= bits;
}

void ReflectionUpload::upload(raster::GBuffer& gbuffer) const {
  gbuffer.reflection.upload(0, 0, GL_RGBA, GL_FLOAT, image_.data());
  if (!masks_.empty()) raster::writeMasks(gbuffer.masks, masks_);
}

}  // namespace catoptric::methods
