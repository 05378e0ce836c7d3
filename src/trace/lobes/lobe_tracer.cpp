#include "trace/lobes/lobe_tracer.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstring>
#include <mutex>
#include <span>

#include "core/clock.h"
#include "core/parallel.h"
#include "core/sampling.h"
#include "trace/lobes/environment_levels.h"
#include "trace/lobes/sky.h"

namespace catoptric::trace {

/// Directions of lobes about their axes, kept: samples of one lobe with the same shift have the
/// same. All GGX lobes share their points of the disk.
struct LobeTracer::LobeTables {
  static constexpr float kDisk = 2.0f;  ///< stands for every GGX lobe

  struct Table {
    float lobe = -1.0f;
    Vec2 shift{0.0f};
    int count = 0;
    LobeLanes lanes;
  };
  std::array<Table, kLobeSlots> tables;

  const LobeLanes& of(const PointLanes& points, std::size_t point, int count) {
    const float lobe = std::min(points.lobe[point], kDisk);
    const Vec2 shift(points.shiftX[point], points.shiftY[point]);
    Table& table = tables[lobeSlot(lobe, shift)];
    if (table.lobe != lobe || table.shift != shift || table.count != count) {
      table.lobe = lobe;
      table.shift = shift;
      table.count = count;
      for (int k = 0; k < count; ++k) {
        const auto at = static_cast<std::size_t>(k);
        const Vec3 made = lobe == kDisk ? Vec3(ggxSample(shift, k, count), 0.0f)
                                        : phongSample(lobe, shift, k, count);
        table.lanes.x[at] = made.x;
        table.lanes.y[at] = made.y;
        table.lanes.z[at] = made.z;
      }
    }
    return table.lanes;
  }
};

/// What the points of one bounce need.
struct LobeTracer::Level {
  PointLanes points;
  std::array<std::size_t, kMostLanes + 1> first{};  ///< ray of a block's point
  PointVectors origins, directions;                 ///< of rays that are not just their points'
  alignas(64) Lane weights{}, densities{};          ///< of rays, where a block is weighted
  Lane shares{};  ///< of points, see ReflectionOptions::leastShare
  RayLanes rays{};
  std::array<Hit, kMostLanes> hits;
  std::array<Vec3, kMostLanes> values;
  // Where paths go on
  std::vector<frame::SurfacePoint> surfaces;
  std::vector<std::size_t> onward;  ///< rays
  std::vector<Vec3> reflected;
};

/// Some of a level's points, whose rays are traced together.
struct LobeTracer::Block {
  std::size_t begin, end;  ///< points
  std::size_t rays;
  int raysPerLobe;
  bool mirrors;   ///< every point sends one ray along its axis
  bool weighted;  ///< some lobe is GGX'
};

LobeTracer::LobeTracer() = default;
LobeTracer::~LobeTracer() = default;

std::uint64_t LobeTracer::bytesOf(int bounces) {
  constexpr std::size_t kOnward = sizeof(frame::SurfacePoint) + sizeof(std::size_t) + sizeof(Vec3);
  return static_cast<std::uint64_t>(bounces) * (sizeof(Level) + kMostLanes * kOnward);
}

LobeTracer& LobeTracer::ofThread() {
  static thread_local LobeTracer tracer;
  return tracer;
}

void LobeTracer::begin(const TraceScene& trace, const frame::Lighting& lighting, float spreadRad,
                       const ReflectionOptions& options) {
  trace_ = &trace;
  lighting_ = &lighting;
  spreadRad_ = spreadRad;
  options_ = options;
  seconds_ = nullptr;
  oneBounce_ = nullptr;
  asked_ = nullptr;
  settles_ = !trace.geometry().surfaces.empty() || trace.refracts();
}

LobeTracer::Level& LobeTracer::level(std::size_t bounce) {
  while (levels_.size() <= bounce) levels_.push_back(std::make_unique<Level>());
  return *levels_[bounce];
}

PointLanes& LobeTracer::points() {
  return level(0).points;
}

void LobeTracer::run(Vec3* radiance, std::uint8_t* flags, FirstHit* hits,
                     ReflectionCounts& counts) {
  const std::int64_t start = nowNs();
  const double traceBefore = counts.traceSeconds;
  PointLanes& points = level(0).points;
  settlePoints(points, counts);
  if (options_.leastShare > 0.0f) std::fill_n(level(0).shares.begin(), points.count, 1.0f);
  runLevel(0, options_.bounces, radiance, flags, hits, counts);
  counts.resolveSeconds += secondsSince(start) - (counts.traceSeconds - traceBefore);
}

void LobeTracer::settlePoints(PointLanes& points, ReflectionCounts& counts) const {
  if (!settles_) return;
  for (std::size_t i = 0; i < points.count; ++i) {
    ReflectionPoint point = points.at(i);
    const Moved moved = settle(*trace_, point);
    counts.atOutline += moved == Moved::ToOutline ? 1 : 0;
    counts.offSurface += moved == Moved::Nowhere ? 1 : 0;
    const float coneDistance = points.coneDistance[i];
    points.set(i, point);
    points.coneDistance[i] = coneDistance;
  }
}

void LobeTracer::runLevel(std::size_t bounce, int bouncesLeft, Vec3* radiance, std::uint8_t* flags,
                          FirstHit* hits, ReflectionCounts& counts) {
  Level& here = level(bounce);
  const PointLanes& points = here.points;
  aim(here.points);
  // Lobes within lobes have one ray each.
  const int raysPerLobe = bounce == 0 ? options_.rays : 1;
  const bool follows = bouncesLeft > 1 || options_.leastShare > 0.0f;
  std::size_t done = 0;
  while (done < points.count) {
    const Block block = nextBlock(here, done, points.count, raysPerLobe);
    done = block.end;
    std::uint8_t* const blockFlags = flags == nullptr ? nullptr : flags + block.begin;
    makeRays(here, block, blockFlags, counts);
    intersect(here, block, counts);
    if (hits != nullptr) {
      for (std::size_t i = block.begin; i < block.end; ++i) {
        const std::size_t ray = here.first[i - block.begin];
        hits[i] = {here.hits[ray], here.rays.origin(ray), here.rays.direction(ray)};
      }
    }
    resolve(here, block, follows, blockFlags, counts);
    if (bounce == 0 && oneBounce_ != nullptr) meanOfLobes(here, block, oneBounce_);
    if (follows) continueReflective(bounce, block, bouncesLeft, counts);
    if (options_.fadeMetres > 0.0f) fade(here, block);
    meanOfLobes(here, block, radiance);
  }
}

void LobeTracer::meanOfLobes(const Level& level, const Block& block, Vec3* radiance) {
  // In the order of each lobe's rays
  for (std::size_t i = block.begin; i < block.end; ++i) {
    const std::size_t begin = level.first[i - block.begin];
    const std::size_t end = level.first[i - block.begin + 1];
    Vec3 sum(0.0f);
    for (std::size_t ray = begin; ray < end; ++ray)
      sum += block.weighted ? level.weights[ray] * level.values[ray] : level.values[ray];
    radiance[i] = sum / static_cast<float>(end - begin);
  }
}

LobeTracer::Block LobeTracer::nextBlock(Level& level, std::size_t begin, std::size_t end,
                                        int raysPerLobe) {
  const PointLanes& points = level.points;
  Block block{begin, begin, 0, raysPerLobe, true, false};
  for (; block.end < end; ++block.end) {
    const std::size_t i = block.end;
    const scene::Lobe lobe{points.lobe[i]};
    const auto rays = static_cast<std::size_t>(lobeRays(lobe, raysPerLobe));
    if (block.rays + rays > kMostLanes) break;
    level.first[i - block.begin] = block.rays;
    block.rays += rays;
    block.mirrors = block.mirrors && lobe.mirror() && points.bent[i] == 0 &&
                    !(points.refraction[i] > 0.0f) && !(points.above[i] < 0.0f);
    block.weighted = block.weighted || (lobe.ggx() && !lobe.mirror());
  }
  level.first[block.end - block.begin] = block.rays;
  return block;
}

LobeTracer::Lobes LobeTracer::makeRays(std::size_t begin, std::size_t end, int raysPerLobe,
                                       std::uint8_t* flags, ReflectionCounts& counts) {
  Level& here = level(0);
  if (begin == 0) aim(here.points);
  const Block block = nextBlock(here, begin, end, raysPerLobe);
  makeRays(here, block, flags == nullptr ? nullptr : flags + block.begin, counts);
  return {block.begin,
          block.end,
          here.first.data(),
          here.rays,
          block.weighted ? here.weights.data() : nullptr,
          block.weighted ? here.densities.data() : nullptr};
}

void LobeTracer::makeRays(Level& level, const Block& block, std::uint8_t* flags,
                          ReflectionCounts& counts) {
  const auto view = [](const PointVectors& origin, const PointVectors& direction,
                       std::size_t first) {
    return RayLanes{origin.x.data() + first,    origin.y.data() + first,
                    origin.z.data() + first,    direction.x.data() + first,
                    direction.y.data() + first, direction.z.data() + first};
  };
  const PointLanes& points = level.points;
  if (block.mirrors) {
    level.rays = view(points.origin, points.axis, block.begin);
    return;
  }
  if (block.weighted) {
    std::fill_n(level.weights.begin(), block.rays, 1.0f);
    std::fill_n(level.densities.begin(), block.rays, 0.0f);
  }
  for (std::size_t i = block.begin; i < block.end; ++i) copyRays(level, block, i, flags, counts);
  level.rays = view(level.origins, level.directions, 0);
}

void LobeTracer::copyRays(Level& level, const Block& block, std::size_t point, std::uint8_t* flags,
                          ReflectionCounts& counts) {
  const PointLanes& points = level.points;
  const std::size_t begin = level.first[point - block.begin];
  const std::size_t end = level.first[point - block.begin + 1];
  const int count = static_cast<int>(end - begin);
  std::uint8_t* const flag = flags == nullptr ? nullptr : flags + (point - block.begin);
  if (points.bent[point] != 0 || points.refraction[point] > 0.0f ||
      (count == 1 && points.above[point] < 0.0f)) {
    for (int k = 0; k < count; ++k)
      setRay(level, point, begin + static_cast<std::size_t>(k), k, count, flag, counts);
    return;
  }
  const Vec3 origin = points.origin.at(point);
  const scene::Lobe lobe{points.lobe[point]};
  if (lobe.mirror()) {
    level.origins.set(begin, origin);
    level.directions.set(begin, points.axis.at(point));
    return;
  }
  if (count == 1) {  // too many different ones to keep
    setRay(level, point, begin, 0, 1, flag, counts);
    return;
  }
  if (tables_ == nullptr) tables_ = std::make_unique<LobeTables>();
  const LobeLanes& lanes = tables_->of(points, point, count);
  for (std::size_t ray = begin; ray < end; ++ray) level.origins.set(ray, origin);
  const auto rays = static_cast<std::size_t>(count);
  if (lobe.ggx() ? aimGgx(points, point, lanes, rays, level.directions, level.weights,
                          level.densities, begin)
                 : aimPhong(points, point, lanes, rays, level.directions, begin))
    return;
  const Vec3 horizon = points.lobeHorizon.at(point);
  for (std::size_t ray = begin; ray < end; ++ray) {
    if (glm::dot(level.directions.at(ray), horizon) < 0.0f ||
        (lobe.ggx() && !(level.weights[ray] > 0.0f)))
      setRay(level, point, ray, static_cast<int>(ray - begin), count, flag, counts);
  }
}

void LobeTracer::setRay(Level& level, std::size_t point, std::size_t ray, int index, int count,
                        std::uint8_t* flag, ReflectionCounts& counts) const {
  const PointRay sent = lobeRay(level.points.at(point), index, count);
  level.origins.set(ray, sent.ray.origin);
  level.directions.set(ray, sent.ray.direction);
  level.weights[ray] = sent.made.weight;
  level.densities[ray] = sent.made.density;
  counts.totalReflections += sent.total ? 1 : 0;
  if (!sent.made.belowHorizon) return;
  ++counts.belowHorizon;
  if (flag != nullptr) *flag |= 2;
}

void LobeTracer::intersect(Level& level, const Block& block, ReflectionCounts& counts) const {
  const std::int64_t start = nowNs();
  const TraceCounts traced =
      trace_->intersectSerial(level.rays, std::span(level.hits).first(block.rays), true);
  counts.traceSeconds += secondsSince(start);
  counts.rays += traced.rays;
  counts.refused += traced.refused;
}

void LobeTracer::resolve(Level& level, const Block& block, bool keepSurfaces, std::uint8_t* flags,
                         ReflectionCounts& counts) {
  if (keepSurfaces) level.surfaces.resize(kMostLanes);
  const PointLanes& points = level.points;
  const int coneRays = options_.converges ? kConvergedRays : block.raysPerLobe;
  for (std::size_t i = block.begin; i < block.end; ++i) {
    const scene::Lobe lobe{points.lobe[i]};
    const bool weighted = lobe.ggx() && !lobe.mirror() && !(points.refraction[i] > 0.0f);
    const float lobeWide = weighted || lobe.mirror() ? 0.0f : lobeSpread(lobe, coneRays);
    const std::size_t begin = level.first[i - block.begin];
    const std::size_t end = level.first[i - block.begin + 1];
    if (asked_ != nullptr && options_.bounces == 1 && asked_[i] == 0) {
      std::fill(&level.values[begin], &level.values[end], Vec3(0.0f));
      continue;
    }
    for (std::size_t ray = begin; ray < end; ++ray) {
      const Hit& hit = level.hits[ray];
      const Vec3 origin = level.rays.origin(ray);
      const Vec3 direction = level.rays.direction(ray);
      if (hit.miss()) {
        const bool refused = !isTraceable({origin, direction});
        if (flags != nullptr) flags[i - block.begin] |= refused ? 1 : 4;
        counts.misses += refused ? 0 : 1;
        level.values[ray] = refused && !isFinite(direction)
                                ? Vec3(0.0f)
                                : environment(level, i, ray - begin, block, direction);
        if (keepSurfaces) level.surfaces[ray].object = 0;
        continue;
      }
      const float spread =
          weighted ? std::sqrt(solidAngleOf(level.densities[ray], coneRays)) : lobeWide;
      const float width =
          spreadRad_ * (points.coneDistance[i] + hit.distance) + spread * hit.distance;
      shadedRays_[shaded_.count] = ray;
      if (keepSurfaces)
        shaded_.scatter[shaded_.count] =
            nextShift({points.shiftX[i], points.shiftY[i]}, static_cast<int>(ray - begin));
      shaded_.add(hit.object, hit.primitive, hit.u, hit.v, origin + hit.distance * direction,
                  direction, width);
      if (shaded_.full()) shadeHits(level, keepSurfaces, counts);
    }
  }
  shadeHits(level, keepSurfaces, counts);
}

void LobeTracer::shadeHits(Level& level, bool keepSurfaces, ReflectionCounts& counts) {
  frame::shadeSurfaces(trace_->scene(), trace_->geometry(), *lighting_, shaded_,
                       keepSurfaces ? shadedPoints_.data() : nullptr);
  for (std::size_t k = 0; k < shaded_.count; ++k) {
    const std::size_t ray = shadedRays_[k];
    Vec3 value = shaded_.diffuse.at(k);
    if (!isFinite(value)) {
      value = Vec3(0.0f);
      ++counts.notFinite;
    }
    level.values[ray] = value;
    if (!keepSurfaces) continue;
    level.surfaces[ray] = shadedPoints_[k];
    level.surfaces[ray].diffuse = value;
  }
  shaded_.count = 0;
}

Vec3 LobeTracer::environment(const Level& level, std::size_t point, std::size_t index,
                             const Block& block, const Vec3& direction) const {
  if (options_.environment == nullptr) return lighting_->environment->radiance(direction);
  const PointLanes& points = level.points;
  const scene::Lobe lobe{points.lobe[point]};
  const int rays = lobeRays(lobe, block.raysPerLobe);
  // Of a mirror the sample's own cone.
  const float solidAngle =
      lobe.mirror() || points.refraction[point] > 0.0f ? spreadRad_ * spreadRad_
      : lobe.ggx() ? solidAngleOf(level.densities[level.first[point - block.begin] + index], rays)
                   : phongSolidAngle(lobe.code, {points.shiftX[point], points.shiftY[point]},
                                     static_cast<int>(index), rays);
  return options_.environment->radiance(direction, solidAngle);
}

void LobeTracer::fade(Level& level, const Block& block) const {
  for (std::size_t ray = 0; ray < block.rays; ++ray) {
    const Hit& hit = level.hits[ray];
    level.values[ray] *= std::exp(-(hit.miss() ? kSkyMetres : hit.distance) / options_.fadeMetres);
  }
}

float LobeTracer::shareOnward(const Level& level, std::size_t point, std::size_t ray) const {
  const frame::SurfacePoint& surface = level.surfaces[ray];
  const Vec3 weight =
      reflectionWeights(surface.specularLevel, surface.tint, surface.f90, surface.lobe,
                        level.rays.direction(ray), surface.normal, options_.fresnelSchlick)
          .reflection;
  const scene::Lobe lobe{level.points.lobe[point]};
  const float ofRay = lobe.ggx() && !lobe.mirror() ? level.weights[ray] : 1.0f;
  return level.shares[point] * ofRay * std::max({weight.x, weight.y, weight.z});
}

/// Replaces the values of reflective hits by diffuse and reflected light, weighted by s.
void LobeTracer::continueReflective(std::size_t bounce, const Block& block, int bouncesLeft,
                                    ReflectionCounts& counts) {
  Level& here = level(bounce);
  Level* const onward = bouncesLeft > 1 ? &level(bounce + 1) : nullptr;
  if (onward != nullptr) onward->points.count = 0;
  here.onward.clear();
  for (std::size_t i = block.begin; i < block.end; ++i) {
    const std::size_t begin = here.first[i - block.begin];
    const std::size_t end = here.first[i - block.begin + 1];
    for (std::size_t ray = begin; ray < end; ++ray) {
      const frame::SurfacePoint& surface = here.surfaces[ray];
      if (surface.object == 0 || !(surface.specularLevel > 0.0f)) continue;
      const bool shares = options_.leastShare > 0.0f;
      const float share = shares ? shareOnward(here, i, ray) : 0.0f;
      if (shares && !(share >= options_.leastShare)) continue;
      if (onward == nullptr) {
        ++counts.unfinished;
        continue;
      }
      here.onward.push_back(ray);
      ReflectionPoint from = here.points.at(i);
      from.distance = here.points.coneDistance[i];
      const int index = static_cast<int>(ray - begin);
      ReflectionPoint next =
          nextPoint(*trace_, from, index, here.rays.direction(ray), here.hits[ray], surface);
      // A mirror has not used its shift
      if (options_.converges && !from.lobe.mirror() && !(from.refraction > 0.0f))
        next.shift = independentShift(from.shift, index);
      onward->shares[onward->points.count] = share;
      onward->points.add(next);
    }
  }
  if (here.onward.empty()) return;
  here.reflected.resize(kMostLanes);
  runLevel(bounce + 1, bouncesLeft - 1, here.reflected.data(), nullptr, nullptr, counts);
  for (std::size_t k = 0; k < here.onward.size(); ++k) {
    const std::size_t ray = here.onward[k];
    const frame::SurfacePoint& surface = here.surfaces[ray];
    const ReflectionWeights weights =
        reflectionWeights(surface.specularLevel, surface.tint, surface.f90, surface.lobe,
                          here.rays.direction(ray), surface.normal, options_.fresnelSchlick);
    const Vec3 arriving =
        surface.highlight == Vec3(0.0f) ? here.reflected[k] : here.reflected[k] + surface.highlight;
    here.surfaces[ray].diffuse = weights.diffuse * surface.diffuse;
    here.reflected[k] = weights.reflection * arriving;
    here.values[ray] = here.surfaces[ray].diffuse + here.reflected[k];
  }
  if (bounce == 0 && seconds_ != nullptr) keepSeconds(block);
}

void LobeTracer::keepSeconds(const Block& block) {
  const Level& here = level(0);
  const Level& next = level(1);
  std::size_t k = 0;  // of those that go on
  for (std::size_t i = block.begin; i < block.end && k < here.onward.size(); ++i) {
    const std::size_t ray = here.first[i - block.begin];
    const std::size_t end = here.first[i - block.begin + 1];
    if (end == ray + 1 && here.onward[k] == ray) {
      // One ray each: those that go on are one block of the next level.
      seconds_[i] = {next.hits[k], next.rays.direction(k), here.surfaces[ray].normal,
                     here.surfaces[ray].diffuse, here.reflected[k]};
    }
    while (k < here.onward.size() && here.onward[k] < end) ++k;
  }
}

ReflectionCounts reflectedRadiance(const TraceScene& trace, const frame::Lighting& lighting,
                                   float spreadRad, std::span<const ReflectionPoint> points,
                                   const ReflectionOptions& options, bool parallel,
                                   std::span<Vec3> radiance, std::span<std::uint8_t> flags,
                                   std::span<FirstHit> hits, std::span<SecondHit> seconds,
                                   std::span<Vec3> oneBounce) {
  assert(radiance.size() >= points.size());
  constexpr std::size_t kTile = 256;  ///< points; ours
  ReflectionCounts counts;
  std::mutex mutex;
  const auto tiles = [&](std::size_t begin, std::size_t end) {
    ReflectionCounts mine;
    LobeTracer& tracer = LobeTracer::ofThread();
    tracer.begin(trace, lighting, spreadRad, options);
    for (std::size_t first = begin * kTile; first < std::min(end * kTile, points.size());
         first += kTile) {
      PointLanes& lanes = tracer.points();
      lanes.count = 0;
      for (const ReflectionPoint& point :
           points.subspan(first, std::min(kTile, points.size() - first)))
        lanes.add(point);
      tracer.keepSeconds(seconds.empty() ? nullptr : seconds.data() + first);
      tracer.keepOneBounce(oneBounce.empty() ? nullptr : oneBounce.data() + first);
      tracer.run(radiance.data() + first, flags.empty() ? nullptr : flags.data() + first,
                 hits.empty() ? nullptr : hits.data() + first, mine);
    }
    tracer.keepSeconds(nullptr);
    tracer.keepOneBounce(nullptr);
    const std::scoped_lock lock(mutex);
    counts.add(mine);
  };
  const std::size_t count = (points.size() + kTile - 1) / kTile;
  const std::int64_t start = nowNs();
  if (parallel) {
    parallelFor(count, 4, tiles);
    counts.shareTime(secondsSince(start));
  } else if (count > 0) {
    tiles(0, count);
  }
  return counts;
}

}  // namespace catoptric::trace
