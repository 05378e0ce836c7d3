#include "methods/impostors/processor.h"

#include <algorithm>
#include <mutex>
#include <span>

#include "core/clock.h"
#include "core/parallel.h"
#include "methods/impostors/tile_rays.h"

namespace catoptric::methods::impostors {
namespace {

constexpr int kTile = 16;                 ///< samples a side
constexpr int kBandSamples = 1 << 16;     ///< of what is read at once, as traced's
constexpr std::size_t kTilesPerTask = 4;  ///< ours

using raster::Rectangle;

/// Rectangles of a band's size, that cover `parts`.
std::vector<Rectangle> bandsOf(const std::vector<Rectangle>& parts) {
  std::vector<Rectangle> bands;
  for (const Rectangle& part : parts) {
    if (part.empty()) continue;
    const int rows = std::max(1, kBandSamples / (part.width() * kTile)) * kTile;
    for (int y = part.y0; y < part.y1; y += rows)
      bands.push_back({part.x0, y, part.x1, std::min(part.y1, y + rows)});
  }
  return bands;
}

}  // namespace

void ProcessorCounts::add(const ProcessorCounts& other) {
  environment += other.environment;
  secondOrder += other.secondOrder;
  transition += other.transition;
  bent += other.bent;
  work += other.work;
  clipped += other.clipped;
  culled += other.culled;
}

ProcessorCounts Processor::run(const ProcessorFrame& frame) {
  const std::int64_t start = nowNs();
  double readSeconds = 0.0;
  double uploadSeconds = 0.0;
  const auto timed = [](double& seconds, auto&& body) {
    const std::int64_t begin = nowNs();
    body();
    seconds += secondsSince(begin);
  };
  const std::vector<Rectangle> bands = bandsOf(frame.parts);
  ProcessorCounts counts;
  const auto band = [&](std::size_t b) -> Band& { return bands_[b % bands_.size()]; };
  Background background;
  for (std::size_t b = 0; b < bands.size(); ++b) {
    if (b == 0) timed(readSeconds, [&] { read(frame, bands[0], band(0)); });
    background.start([&, b] { counts.add(intersect(frame, band(b))); });
    if (b > 0) timed(uploadSeconds, [&] { upload(frame, band(b - 1)); });
    if (b + 1 < bands.size()) timed(readSeconds, [&] { read(frame, bands[b + 1], band(b + 1)); });
    background.wait();
  }
  if (!bands.empty()) {
    timed(uploadSeconds, [&] {
      upload(frame, band(bands.size() - 1));
      frame.timer.finish();
    });
  }
  frame.timer.add("readback", readSeconds);
  frame.timer.add("intersect", secondsSince(start) - readSeconds - uploadSeconds);
  frame.timer.add("upload", uploadSeconds);
  return counts;
}

void Processor::read(const ProcessorFrame& frame, const Rectangle& place, Band& band) const {
  band.place = place;
  const auto count =
      static_cast<std::size_t>(place.width()) * static_cast<std::size_t>(place.height());
  const auto get = [&](const gl::Texture& texture, GLenum format, GLenum type, auto& values,
                       std::size_t perSample) {
    values.resize(count * perSample);
    texture.readPart(place.x0, place.y0, place.width(), place.height(), format, type,
                     std::as_writable_bytes(std::span(values)));
  };
  get(frame.gbuffer.object, GL_RED_INTEGER, GL_UNSIGNED_INT, band.object, 1);
  get(frame.gbuffer.normal, GL_RGBA, GL_FLOAT, band.normal, 4);
  get(frame.gbuffer.depth, GL_DEPTH_COMPONENT, GL_FLOAT, band.depth, 1);
  band.image.resize(4 * count);
  band.masks.resize(frame.masks ? count : 0);
  // What other methods have filled stays
  if (frame.beside) get(frame.gbuffer.reflection, GL_RGBA, GL_FLOAT, band.image, 4);
  if (frame.beside && frame.masks)
    get(frame.gbuffer.masks, GL_RED_INTEGER, GL_UNSIGNED_SHORT, band.masks, 1);
}

void Processor::upload(const ProcessorFrame& frame, const Band& band) {
  const Rectangle& place = band.place;
  frame.gbuffer.reflection.uploadPart(place.x0, place.y0, place.width(), place.height(), GL_RGBA,
                                      GL_FLOAT, band.image.data());
  if (frame.masks)
    frame.gbuffer.masks.uploadPart(place.x0, place.y0, place.width(), place.height(),
                                   GL_RED_INTEGER, GL_UNSIGNED_SHORT, band.masks.data());
}

namespace {

/// Samples of a tile that are to be filled, by object.
struct Members {
  std::size_t count = 0;
  std::array<std::uint32_t, kMostRays> at;  ///< index in the band
  std::array<std::uint16_t, kMostRays> x, y;
};

}  // namespace

ProcessorCounts Processor::intersect(const ProcessorFrame& frame, Band& band) {
  const int width = band.place.width();
  const int height = band.place.height();
  const int columns = (width + kTile - 1) / kTile;
  const int rows = (height + kTile - 1) / kTile;
  ProcessorCounts counts;
  std::mutex mutex;
  const auto fill = [&](TileRays& rays, const Members& tile, ProcessorCounts& mine) {
    std::array<bool, kMostRays> done{};
    for (std::size_t begin = 0; begin < tile.count; ++begin) {
      if (done[begin]) continue;
      RayBatch& batch = rays.batch();
      Samples& samples = rays.samples();
      const std::uint32_t object = band.object[tile.at[begin]];
      batch.object = static_cast<int>(object);
      batch.count = 0;
      for (std::size_t m = begin; m < tile.count; ++m) {
        const std::size_t at = tile.at[m];
        if (band.object[at] != object) continue;
        done[m] = true;
        const std::size_t k = batch.count++;
        const float* const normal = &band.normal[4 * at];
        samples.x[k] = static_cast<float>(band.place.x0 + tile.x[m]) + 0.5f;
        samples.y[k] = static_cast<float>(band.place.y0 + tile.y[m]) + 0.5f;
        samples.depth[k] = band.depth[at];
        samples.normalX[k] = normal[0];
        samples.normalY[k] = normal[1];
        samples.normalZ[k] = normal[2];
        batch.sample[k] = tile.at[m];
      }
      rays.run();
      for (std::size_t k = 0; k < batch.count; ++k) {
        const std::size_t at = batch.sample[k];
        const bool bent = raster::isBent(band.normal[4 * at + 3]);
        std::uint32_t marks = batch.marks[k];
        if (bent) marks |= raster::kMaskBelowHorizon;
        mine.environment += marks & raster::kMaskEnvironment;
        mine.transition += (marks & raster::kMaskTransition) != 0 ? 1 : 0;
        mine.bent += bent ? 1 : 0;
        float* const texel = &band.image[4 * at];
        texel[0] = batch.red[k];
        texel[1] = batch.green[k];
        texel[2] = batch.blue[k];
        texel[3] = 1.0f;
        if (frame.masks) band.masks[at] = static_cast<std::uint16_t>(marks);
      }
    }
  };
  parallelFor(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows), kTilesPerTask,
              [&](std::size_t begin, std::size_t end) {
                ProcessorCounts mine;
                TileRays& rays = TileRays::ofThread();
                rays.begin(frame, mine);
                Members tile;
                for (std::size_t t = begin; t < end; ++t) {
                  const int x0 = static_cast<int>(t % static_cast<std::size_t>(columns)) * kTile;
                  const int y0 = static_cast<int>(t / static_cast<std::size_t>(columns)) * kTile;
                  const int x1 = std::min(width, x0 + kTile);
                  tile.count = 0;
                  for (int y = y0; y < std::min(height, y0 + kTile); ++y) {
                    const auto row = static_cast<std::uint32_t>(y * width);
                    if (!frame.beside) {
                      std::fill(band.image.begin() + 4 * (row + static_cast<std::uint32_t>(x0)),
                                band.image.begin() + 4 * (row + static_cast<std::uint32_t>(x1)),
                                0.0f);
                      if (frame.masks)
                        std::fill(band.masks.begin() + row + static_cast<std::uint32_t>(x0),
                                  band.masks.begin() + row + static_cast<std::uint32_t>(x1),
                                  std::uint16_t{0});
                    }
                    for (int x = x0; x < x1; ++x) {
                      const std::uint32_t at = row + static_cast<std::uint32_t>(x);
                      if (frame.mirror[band.object[at]] == 0 || !(band.depth[at] > 0.0f)) continue;
                      tile.at[tile.count] = at;
                      tile.x[tile.count] = static_cast<std::uint16_t>(x);
                      tile.y[tile.count] = static_cast<std::uint16_t>(y);
                      ++tile.count;
                    }
                  }
                  if (tile.count > 0) fill(rays, tile, mine);
                }
                const std::scoped_lock lock(mutex);
                counts.add(mine);
              });
  return counts;
}

}  // namespace catoptric::methods::impostors
