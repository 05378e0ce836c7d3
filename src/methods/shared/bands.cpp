#include "methods/shared/bands.h"

#include <algorithm>
#include <cstring>
#include <span>

#include "core/parallel.h"
#include "methods/shared/band_steps.h"
#include "methods/shared/reflective_samples.h"

namespace catoptric::methods {
namespace {

constexpr std::size_t kTilesPerTask = 4;  ///< ours

/// One tile's place in a band.
struct TileRows {
  std::size_t x0, y0, columns, rows, width;
};

/// Removes the members that `only` has not marked.
void keepMarked(const std::vector<std::uint8_t>& only, SampleTiles::Members& members) {
  std::size_t kept = 0;
  for (std::size_t k = 0; k < members.count; ++k) {
    if (only[members.at[k]] == 0) continue;
    members.at[kept] = members.at[k];
    members.x[kept] = members.x[k];
    members.y[kept] = members.y[k];
    ++kept;
  }
  members.count = kept;
}

/// Reflection 0 and no mask where nothing reflects.
template <class T>
void clear(const TileRows& tile, std::size_t perSample, std::vector<T>& values) {
  for (std::size_t y = tile.y0; y < tile.y0 + tile.rows; ++y)
    std::fill_n(
        values.begin() + static_cast<std::ptrdiff_t>((y * tile.width + tile.x0) * perSample),
        tile.columns * perSample, T{0});
}

}  // namespace

std::uint64_t Bands::largest(int sampleWidth) {
  return static_cast<std::uint64_t>(sampleWidth) *
         static_cast<std::uint64_t>(rowsOfBand(sampleWidth));
}

double Bands::run(const BandFrame& frame, const TraceTile& traceTile) {
  const int width = frame.gbuffer.sampleWidth();
  const int height = frame.gbuffer.sampleHeight();
  readsLevels_ = specularLevelsVary(frame.scene, frame.own);
  const int rows = rowsOfBand(width);
  const auto band = [&](std::size_t b) -> Band& { return bands_[b % bands_.size()]; };
  const BandSteps steps{[&](std::size_t b) {
                          const int first = static_cast<int>(b) * rows;
                          read(frame, first, std::min(rows, height - first), band(b));
                        },
                        [&](std::size_t b) { traceBand(frame, traceTile, band(b)); },
                        [&](std::size_t b) { upload(frame, band(b)); }};
  const auto count = static_cast<std::size_t>((height + rows - 1) / rows);
  const BandSeconds seconds = runBands(count, steps, frame.timer);
  frame.timer.add("readback", seconds.read);
  frame.timer.add("upload", seconds.upload);
  return seconds.work;
}

void Bands::read(const BandFrame& frame, int firstRow, int rows, Band& band) const {
  raster::readRows(frame.gbuffer, firstRow, rows, readsLevels_, band.samples);
  const std::size_t count =
      static_cast<std::size_t>(frame.gbuffer.sampleWidth()) * static_cast<std::size_t>(rows);
  band.image.resize(4 * count);
  band.masks.resize(frame.masks ? count : 0);
  if (frame.only != nullptr) {
    band.only.resize(count);
    frame.only->readRows(firstRow, rows, GL_RED_INTEGER, GL_UNSIGNED_BYTE,
                         std::as_writable_bytes(std::span(band.only)));
  } else if (frame.own.all()) {
    return;
  }
  // What others have filled stays.
  frame.gbuffer.reflection.readRows(firstRow, rows, GL_RGBA, GL_FLOAT,
                                    std::as_writable_bytes(std::span(band.image)));
  if (frame.masks)
    frame.gbuffer.masks.readRows(firstRow, rows, GL_RED_INTEGER, GL_UNSIGNED_SHORT,
                                 std::as_writable_bytes(std::span(band.masks)));
}

void Bands::upload(const BandFrame& frame, const Band& band) {
  const raster::GBufferCopy& samples = band.samples;
  frame.gbuffer.reflection.uploadRows(samples.firstRow, samples.rows, GL_RGBA, GL_FLOAT,
                                      band.image.data());
  if (frame.masks)
    frame.gbuffer.masks.uploadRows(samples.firstRow, samples.rows, GL_RED_INTEGER,
                                   GL_UNSIGNED_SHORT, band.masks.data());
}

void Bands::traceBand(const BandFrame& frame, const TraceTile& traceTile, Band& band) {
  const SampleTiles& tiles = frame.tiles;
  const raster::GBufferCopy& samples = band.samples;
  const auto columns = static_cast<std::size_t>(tiles.columns());
  const std::size_t count = columns * static_cast<std::size_t>(SampleTiles::rowsOf(samples.rows));
  const auto width = static_cast<std::size_t>(samples.sampleWidth());
  constexpr std::size_t kSize = SampleTiles::kSize;
  parallelFor(count, kTilesPerTask, [&](std::size_t begin, std::size_t end) {
    SampleTiles::Members members;
    std::array<Vec3, SampleTiles::kSamples> radiance;
    std::array<std::uint8_t, SampleTiles::kSamples> flags;
    for (std::size_t tile = begin; tile < end; ++tile) {
      const std::size_t column = tile % columns;
      const std::size_t row = tile / columns;
      tiles.find(samples, static_cast<int>(column), static_cast<int>(row), members);
      if (frame.only != nullptr) {
        keepMarked(band.only, members);
      } else if (frame.own.all()) {
        const TileRows place{column * kSize, row * kSize, std::min(kSize, width - column * kSize),
                             std::min(kSize, static_cast<std::size_t>(samples.rows) - row * kSize),
                             width};
        clear(place, 4, band.image);
        if (frame.masks) clear(place, 1, band.masks);
      }
      if (members.count == 0) continue;
      if (frame.masks) std::fill_n(flags.begin(), members.count, std::uint8_t{0});
      traceTile(samples, members, radiance.data(), frame.masks ? flags.data() : nullptr);
      for (std::size_t k = 0; k < members.count; ++k) {
        float* const texel = &band.image[4 * static_cast<std::size_t>(members.at[k])];
        texel[0] = radiance[k].x;
        texel[1] = radiance[k].y;
        texel[2] = radiance[k].z;
        texel[3] = 1.0f;
        if (!frame.masks) continue;
        std::uint16_t& mask = band.masks[members.at[k]];
        mask = (frame.only != nullptr ? mask : 0) | maskBits(flags[k]) | frame.mark;
      }
    }
  });
}

}  // namespace catoptric::methods
