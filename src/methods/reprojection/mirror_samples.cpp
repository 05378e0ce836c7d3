#include "methods/reprojection/mirror_samples.h"

#include <algorithm>
#include <array>

#include "core/parallel.h"
#include "methods/shared/sample_points.h"
#include "trace/lobes/lobe_tracer.h"
#include "trace/lobes/point_lanes.h"

namespace catoptric::methods::reprojection {
namespace {

constexpr std::size_t kTilesPerTask = 32;
constexpr std::size_t kPlacesPerTask = 2048;

}  // namespace

bool isMirror(scene::Lobe lobe, int object, const scene::Scene& scene) {
  const scene::Object& shown = scene.objects[static_cast<std::size_t>(object - 1)];
  return lobe.mirror() && !(scene.materials[shown.material].refraction > 0.0f);
}

void MirrorSamples::find(const raster::GBufferCopy& source, const scene::Camera& camera,
                         const trace::TraceScene& trace, const frame::ObjectSet& own) {
  source_ = &source;
  camera_ = &camera;
  trace_ = &trace;
  own_ = own;
  const SampleTiles tiles({source.sampleWidth(), source.sampleHeight()}, camera, trace.scene(),
                          trace.extents(), own);
  const auto columns = static_cast<std::size_t>(tiles.columns());
  tiles_.resize(columns * static_cast<std::size_t>(SampleTiles::rowsOf(source.sampleHeight())));
  parallelFor(tiles_.size(), kTilesPerTask, [&](std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t)
      tiles.find(source, static_cast<int>(t % columns), static_cast<int>(t / columns), tiles_[t]);
  });
  first_.assign(1, 0);
  for (const SampleTiles::Members& members : tiles_)
    first_.push_back(first_.back() + members.count);
  places_.resize(first_.back());
  parallelFor(tiles_.size(), kTilesPerTask, [&](std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t)
      std::copy_n(tiles_[t].at.begin(), tiles_[t].count,
                  places_.begin() + static_cast<std::ptrdiff_t>(first_[t]));
  });
}

void MirrorSamples::eachTile(
    const std::function<void(std::size_t, trace::PointLanes&)>& body) const {
  const SampleTiles tiles({source_->sampleWidth(), source_->sampleHeight()}, *camera_,
                          trace_->scene(), trace_->extents(), own_);
  parallelFor(tiles_.size(), kTilesPerTask, [&](std::size_t begin, std::size_t end) {
    trace::PointLanes& lanes = trace::LobeTracer::ofThread().points();
    for (std::size_t t = begin; t < end; ++t) {
      if (tiles_[t].count == 0) continue;
      tiles.place(*source_, tiles_[t], lanes);
      body(first_[t], lanes);
    }
  });
}

bool MirrorSamples::isSplit(const SampleTiles::Members& members,
                            const trace::ReflectionOptions& options) const {
  if (options.bounces > 1) return false;
  if (options.rays == 1) return true;
  const auto places = members.places();
  return std::all_of(places.begin(), places.end(), [&](std::uint32_t at) {
    return trace::lobeRays(raster::lobeOf(source_->normal[4 * std::size_t{at} + 3]),
                           options.rays) == 1;
  });
}

void MirrorSamples::eachPacketOf(
    std::span<const std::uint32_t> slots, const trace::ReflectionOptions& options,
    const std::function<void(std::span<const std::uint32_t>, trace::PointLanes&)>& body) const {
  const SampleTiles tiles({source_->sampleWidth(), source_->sampleHeight()}, *camera_,
                          trace_->scene(), trace_->extents(), own_);
  parallelFor(tiles_.size(), kTilesPerTask, [&](std::size_t begin, std::size_t end) {
    trace::PointLanes& lanes = trace::LobeTracer::ofThread().points();
    SampleTiles::Members some;
    std::array<std::uint32_t, SampleTiles::kSamples> someSlots;
    for (std::size_t t = begin; t < end; ++t) {
      const SampleTiles::Members& members = tiles_[t];
      const auto tileSlots = slots.subspan(first_[t], members.count);
      const auto wanted = [](std::span<const std::uint32_t> of) {
        return std::any_of(of.begin(), of.end(), [](std::uint32_t slot) { return slot != 0; });
      };
      if (!wanted(tileSlots)) continue;
      if (!isSplit(members, options)) {
        tiles.place(*source_, members, lanes);
        body(tileSlots, lanes);
        continue;
      }
      some.count = 0;
      for (std::size_t from = 0; from < members.count; from += trace::kMostPacket) {
        const std::size_t count = std::min(trace::kMostPacket, members.count - from);
        if (!wanted(tileSlots.subspan(from, count))) continue;
        for (std::size_t k = from; k < from + count; ++k, ++some.count) {
          some.at[some.count] = members.at[k];
          some.x[some.count] = members.x[k];
          some.y[some.count] = members.y[k];
          someSlots[some.count] = tileSlots[k];
        }
      }
      tiles.place(*source_, some, lanes);
      body(std::span(someSlots).first(some.count), lanes);
    }
  });
}

void MirrorSamples::aim() {
  rays_.resize(count());
  positions_.resize(count());
  belowHorizon_.assign(count(), 0);
  const scene::Scene& scene = trace_->scene();
  eachTile([&](std::size_t first, trace::PointLanes& lanes) {
    trace::aim(lanes);
    for (std::size_t k = 0; k < lanes.count; ++k) {
      MirrorRay& ray = rays_[first + k];
      positions_[first + k] = lanes.position.at(k);
      ray.reflector = 0;
      const int object = lanes.object[k];
      if (!isMirror({lanes.lobe[k]}, object, scene)) continue;
      ray.reflector = static_cast<std::uint32_t>(object);
      ray.origin = lanes.origin.at(k);
      ray.direction = lanes.axis.at(k);
      const bool implicit = trace_->geometry().objects[ray.reflector - 1].surface >= 0;
      if (!implicit && lanes.bent[k] == 0 && !(lanes.above[k] < 0.0f)) continue;
      trace::ReflectionPoint point = lanes.at(k);
      trace::settle(*trace_, point);
      const trace::PointRay settled = trace::lobeRay(point, 0, 1);
      ray.origin = settled.ray.origin;
      ray.direction = settled.ray.direction;
      belowHorizon_[first + k] = settled.made.belowHorizon ? 1 : 0;
    }
  });
}

void MirrorSamples::points(std::span<const std::uint32_t> places,
                           std::vector<trace::ReflectionPoint>& result) const {
  const SamplePoints pointAt(*source_, *camera_, *trace_);
  const auto width = static_cast<std::uint32_t>(source_->sampleWidth());
  result.resize(places.size());
  parallelFor(places.size(), kPlacesPerTask, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k)
      result[k] = pointAt(static_cast<int>(places[k] % width), static_cast<int>(places[k] / width));
  });
}

}  // namespace catoptric::methods::reprojection
