#include "methods/shared/sample_tiles.h"

#include <algorithm>

#include "methods/shared/sample_points.h"

namespace catoptric::methods {
namespace {

/// Order of a tile's samples: blocks of 4 x 2, so that a packet of 8 is compact.
const std::array<std::array<std::uint8_t, 2>, SampleTiles::kSamples>& tileOrder() {
  static const auto order = [] {
    constexpr int kTile = SampleTiles::kSize;
    std::array<std::array<std::uint8_t, 2>, SampleTiles::kSamples> o{};
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

/// Samples that memory is asked for before they are read. Ours.
constexpr std::size_t kAhead = 16;

}  // namespace

bool specularLevelsVary(const scene::Scene& scene, const frame::ObjectSet& own) {
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    const scene::Object& object = scene.objects[i];
    if (object.reflector != 0 && own.contains(static_cast<int>(i)) &&
        scene.materials[object.material].metallicRoughnessTexture.used())
      return true;
  }
  return false;
}

SampleTiles::SampleTiles(const SampleGrid& grid, const scene::Camera& camera,
                         const scene::Scene& scene, std::span<const float> extents,
                         const frame::ObjectSet& own)
    : camera_{camera.eye(), camera.nearMetres,
              scene::rayFromPixel(camera, grid.width, grid.height)},
      width_(grid.width),
      columns_((grid.width + kSize - 1) / kSize) {
  kinds_.assign(scene.objects.size() + 1, Kind::No);
  extents_.assign(scene.objects.size() + 1, 0.0f);
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    const scene::Object& object = scene.objects[i];
    if (object.reflector == 0 || !own.contains(static_cast<int>(i))) continue;
    kinds_[i + 1] = scene.materials[object.material].metallicRoughnessTexture.used()
                        ? Kind::ByTexture
                        : Kind::Yes;
    extents_[i + 1] = extents[i];
  }
}

void SampleTiles::find(const raster::GBufferCopy& source, int column, int row, Members& out) const {
  const int x0 = column * kSize;
  const int y0 = row * kSize;
  const bool whole = x0 + kSize <= width_ && y0 + kSize <= source.rows;
  std::size_t count = 0;
  bool mixed = false;
  for (const auto& [dx, dy] : tileOrder()) {
    const int x = x0 + dx;
    const int y = y0 + dy;
    if (!whole && (x >= width_ || y >= source.rows)) continue;
    const auto at = static_cast<std::uint32_t>(y * width_ + x);
    if (!reflects(source, at)) continue;
    out.at[count] = at;
    out.x[count] = static_cast<std::uint16_t>(x);
    out.y[count] = static_cast<std::uint16_t>(source.firstRow + y);
    ++count;
    mixed = mixed || source.object[at] != source.object[out.at[0]];
  }
  out.count = count;
  if (!mixed) return;
  // By object, and by their order here.
  std::array<std::uint64_t, kSamples> keys;
  const Members unsorted = out;
  for (std::size_t k = 0; k < count; ++k)
    keys[k] = static_cast<std::uint64_t>(source.object[out.at[k]]) << 16 | k;
  std::sort(keys.begin(), keys.begin() + static_cast<std::ptrdiff_t>(count));
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t from = keys[k] & 0xFFFF;
    out.at[k] = unsorted.at[from];
    out.x[k] = unsorted.x[from];
    out.y[k] = unsorted.y[from];
  }
}

void SampleTiles::place(const raster::GBufferCopy& source, const Members& members,
                        trace::PointLanes& points) const {
  static_assert(kSamples <= trace::SampleLanes::kMost);
  static thread_local trace::SampleLanes samples;
  points.count = members.count;
  for (std::size_t k = 0; k < members.count; ++k) {
    const std::size_t at = members.at[k];
    if (k + kAhead < members.count) {
      __builtin_prefetch(&source.normal[4 * std::size_t{members.at[k + kAhead]}]);
      __builtin_prefetch(&source.depth[members.at[k + kAhead]]);
    }
    const float* const normal = &source.normal[4 * at];
    samples.x[k] = static_cast<float>(members.x[k]) + 0.5f;
    samples.y[k] = static_cast<float>(members.y[k]) + 0.5f;
    samples.depth[k] = source.depth[at];
    points.normal.x[k] = normal[0];
    points.normal.y[k] = normal[1];
    points.normal.z[k] = normal[2];
    points.lobe[k] = raster::lobeOf(normal[3]).code;
    points.bent[k] = raster::isBent(normal[3]) ? 1 : 0;
    points.object[k] = static_cast<int>(source.object[at]);
    points.extent[k] = extents_[source.object[at]];
  }
  for (std::size_t k = 0; k < members.count; ++k) {
    const Vec3 normal = points.normal.at(k);
    points.lobeHorizon.set(k,
                           source.lobeHorizon.empty()
                               ? normal
                               : raster::lobeHorizonOf(source.lobeHorizon[members.at[k]], normal));
  }
  for (std::size_t k = 0; k < members.count; ++k) {
    const Vec2 shift = lobeShift(members.x[k], members.y[k]);
    points.shiftX[k] = shift.x;
    points.shiftY[k] = shift.y;
  }
  std::fill_n(points.refraction.begin(), members.count, 0.0f);
  trace::placePoints(camera_, samples, points);
}

}  // namespace catoptric::methods
