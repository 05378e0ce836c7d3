#include "methods/shared/impostors/processor.h"

#include <algorithm>
#include <mutex>
#include <span>

#include "core/clock.h"
#include "core/parallel.h"
#include "methods/shared/band_steps.h"
#include "methods/shared/impostors/shaders/constants.h"
#include "methods/shared/impostors/tile_rays.h"
#include "methods/shared/sample_tiles.h"

namespace catoptric::methods::impostors {
namespace {

constexpr int kTile = SampleTiles::kSize;
constexpr std::size_t kTilesPerTask = 4;  ///< ours

using raster::Rectangle;

/// Rectangles of a band's size, that cover `parts`.
std::vector<Rectangle> bandsOf(const std::vector<Rectangle>& parts) {
  std::vector<Rectangle> bands;
  for (const Rectangle& part : parts) {
    if (part.empty()) continue;
    const int rows = rowsOfBand(part.width());
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
  clamped += other.clamped;
  disoccluded += other.disoccluded;
  work += other.work;
  clipped += other.clipped;
  searched += other.searched;
  texels += other.texels;
  culled += other.culled;
}

void ProcessorCounts::addMarks(std::uint32_t marks) {
  environment += marks & raster::kMaskEnvironment;
  clamped += (marks & raster::kMaskClamped) != 0 ? 1 : 0;
  disoccluded += (marks & raster::kMaskDisoccluded) != 0 ? 1 : 0;
  bent += (marks & raster::kMaskBelowHorizon) != 0 ? 1 : 0;
  transition += (marks & raster::kMaskTransition) != 0 ? 1 : 0;
}

ProcessorCounts Processor::run(const ProcessorFrame& frame) {
  const std::vector<Rectangle> bands = bandsOf(frame.parts);
  ProcessorCounts counts;
  const auto band = [&](std::size_t b) -> Band& { return bands_[b % bands_.size()]; };
  const BandSteps steps{[&](std::size_t b) { read(frame, bands[b], band(b)); },
                        [&](std::size_t b) { counts.add(intersect(frame, band(b))); },
                        [&](std::size_t b) { upload(frame, band(b)); }};
  const BandSeconds seconds = runBands(bands.size(), steps, frame.timer);
  frame.timer.add("readback", seconds.read);
  frame.timer.add("intersect", seconds.work);
  frame.timer.add("upload", seconds.upload);
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

/// Samples of a tile that are to be filled.
struct Members {
  std::size_t count = 0;
  std::array<std::uint32_t, kMostRays> at;  ///< index in the band
  std::array<std::uint16_t, kMostRays> x, y;
};

}  // namespace

/// The tiles of a band, one by one.
class Processor::Tiles {
 public:
  Tiles(const ProcessorFrame& frame, Band& band)
      : frame_(frame),
        band_(band),
        width_(band.place.width()),
        columns_(static_cast<std::size_t>((width_ + kTile - 1) / kTile)) {}

  std::size_t count() const {
    return columns_ * static_cast<std::size_t>((band_.place.height() + kTile - 1) / kTile);
  }

  void fill(std::size_t index, TileRays& rays, ProcessorCounts& counts) {
    find(index);
    std::array<bool, kMostRays> done{};
    for (std::size_t begin = 0; begin < members_.count; ++begin) {
      if (done[begin]) continue;
      gather(begin, rays, done);
      rays.run();
      write(rays.batch(), counts);
    }
  }

 private:
  /// Samples of mirrors; what else the tile shows is cleared.
  void find(std::size_t index) {
    const int x0 = static_cast<int>(index % columns_) * kTile;
    const int y0 = static_cast<int>(index / columns_) * kTile;
    const int x1 = std::min(width_, x0 + kTile);
    members_.count = 0;
    for (int y = y0; y < std::min(band_.place.height(), y0 + kTile); ++y) {
      const auto row = static_cast<std::size_t>(y) * static_cast<std::size_t>(width_);
      if (!frame_.beside) {
        const std::size_t first = row + static_cast<std::size_t>(x0);
        const auto columns = static_cast<std::size_t>(x1 - x0);
        std::fill_n(&band_.image[4 * first], 4 * columns, 0.0f);
        if (frame_.masks) std::fill_n(&band_.masks[first], columns, std::uint16_t{0});
      }
      for (int x = x0; x < x1; ++x) {
        const std::size_t at = row + static_cast<std::size_t>(x);
        if (frame_.mirror[band_.object[at]] == 0 || !(band_.depth[at] > 0.0f)) continue;
        members_.at[members_.count] = static_cast<std::uint32_t>(at);
        members_.x[members_.count] = static_cast<std::uint16_t>(x);
        members_.y[members_.count] = static_cast<std::uint16_t>(y);
        ++members_.count;
      }
    }
  }

  /// All samples from `begin` on that show that one's object.
  void gather(std::size_t begin, TileRays& rays, std::array<bool, kMostRays>& done) const {
    RayBatch& batch = rays.batch();
    Samples& samples = rays.samples();
    const std::uint32_t object = band_.object[members_.at[begin]];
    batch.object = static_cast<int>(object);
    batch.count = 0;
    for (std::size_t m = begin; m < members_.count; ++m) {
      const std::size_t at = members_.at[m];
      if (band_.object[at] != object) continue;
      done[m] = true;
      const std::size_t k = batch.count++;
      const float* const normal = &band_.normal[4 * at];
      samples.x[k] = static_cast<float>(band_.place.x0 + members_.x[m]) + 0.5f;
      samples.y[k] = static_cast<float>(band_.place.y0 + members_.y[m]) + 0.5f;
      samples.depth[k] = band_.depth[at];
      samples.normal.set(k, {normal[0], normal[1], normal[2]});
      batch.sample[k] = members_.at[m];
    }
  }

  void write(const RayBatch& batch, ProcessorCounts& counts) {
    for (std::size_t k = 0; k < batch.count; ++k) {
      const std::size_t at = batch.sample[k];
      std::uint32_t marks = batch.marks[k];
      if (raster::isBent(band_.normal[4 * at + 3])) marks |= raster::kMaskBelowHorizon;
      const float most = std::max(batch.color.x[k], std::max(batch.color.y[k], batch.color.z[k]));
      if (most >= shared::kClampedRadiance) marks |= raster::kMaskClamped;
      counts.addMarks(marks);
      float* const texel = &band_.image[4 * at];
      texel[0] = batch.color.x[k];
      texel[1] = batch.color.y[k];
      texel[2] = batch.color.z[k];
      texel[3] = 1.0f;
      if (frame_.masks) band_.masks[at] = static_cast<std::uint16_t>(marks);
    }
  }

  const ProcessorFrame& frame_;
  Band& band_;
  int width_;
  std::size_t columns_;
  Members members_;
};

ProcessorCounts Processor::intersect(const ProcessorFrame& frame, Band& band) {
  ProcessorCounts counts;
  std::mutex mutex;
  parallelFor(Tiles(frame, band).count(), kTilesPerTask, [&](std::size_t begin, std::size_t end) {
    ProcessorCounts mine;
    TileRays& rays = TileRays::ofThread();
    rays.begin(frame, mine);
    Tiles tiles(frame, band);
    for (std::size_t t = begin; t < end; ++t) tiles.fill(t, rays, mine);
    const std::scoped_lock lock(mutex);
    counts.add(mine);
  });
  return counts;
}

}  // namespace catoptric::methods::impostors
