#include "methods/glossy_lod/tile_tracer.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "core/clock.h"
#include "scene/reflectance.h"

namespace catoptric::methods::glossy_lod {
namespace {

/// Exponent above which a lobe is sharp [Yu2008, section 4]; rays and alpha of sharp ones, of
/// others.
constexpr float kSharpExponent = 3000.0f;
constexpr int kSharpRays = 20;
constexpr float kSharpAlpha = 3.0f;
constexpr int kBroadRays = 40;
constexpr float kBroadAlpha = 10.0f;

bool isSharp(float glossiness) {
  return scene::phongExponentFromGlossiness(glossiness) > kSharpExponent;
}

}  // namespace

void TraceCounts::add(const TraceCounts& other) {
  rays += other.rays;
  misses += other.misses;
  belowHorizon += other.belowHorizon;
  visits.nodes += other.visits.nodes;
  visits.quads += other.visits.quads;
  visits.stopped += other.visits.stopped;
  traceSeconds += other.traceSeconds;
  resolveSeconds += other.resolveSeconds;
}

TileTracer& TileTracer::ofThread() {
  static thread_local TileTracer tracer;
  return tracer;
}

void TileTracer::run(const Traced& scene, Vec3* radiance, std::uint8_t* flags,
                     TraceCounts& counts) {
  const std::int64_t start = nowNs();
  const double traceBefore = counts.traceSeconds;
  const trace::PointLanes& points = lobes_.points();
  trace::ReflectionCounts made;
  const bool automatic = scene.options.automatic;
  for (std::size_t begin = 0; begin < points.count;) {
    // Points with the same number of rays
    int rays = scene.options.rays;
    float alpha = scene.options.alpha;
    std::size_t end = points.count;
    if (automatic) {
      const bool sharp = isSharp(points.glossiness[begin]);
      rays = sharp ? kSharpRays : kBroadRays;
      alpha = sharp ? kSharpAlpha : kBroadAlpha;
      end = begin + 1;
      while (end < points.count && isSharp(points.glossiness[end]) == sharp) ++end;
    }
    // Whole packets of neighbours, where as many lobes fit
    const std::size_t most = trace::kMostLanes / static_cast<std::size_t>(rays);
    if (most >= RayPacket::kMost && points.glossiness[begin] > scene::kMirrorGlossiness)
      end = std::min(end, begin + most / RayPacket::kMost * RayPacket::kMost);
    const trace::LobeTracer::Lobes lobes = lobes_.makeRays(begin, end, rays, flags, made);
    runBlock(scene, lobes, alpha, flags, counts);
    // Mean over each lobe, in the order of its rays
    for (std::size_t i = lobes.begin; i < lobes.end; ++i) {
      const std::size_t first = lobes.first[i - lobes.begin];
      const std::size_t last = lobes.first[i - lobes.begin + 1];
      Vec3 sum(0.0f);
      for (std::size_t ray = first; ray < last; ++ray) sum += values_[ray];
      radiance[i] = sum / static_cast<float>(last - first);
    }
    begin = lobes.end;
  }
  counts.belowHorizon += made.belowHorizon;
  counts.resolveSeconds += secondsSince(start) - (counts.traceSeconds - traceBefore);
}

/// By neighbours, of those by number in the lobe: rays of the same number are nearly parallel.
void TileTracer::orderRays(const trace::LobeTracer::Lobes& lobes) {
  std::size_t ordered = 0;
  for (std::size_t group = lobes.begin; group < lobes.end; group += RayPacket::kMost) {
    const std::size_t end = std::min(lobes.end, group + RayPacket::kMost);
    bool any = true;
    for (std::size_t k = 0; any; ++k) {
      any = false;
      for (std::size_t i = group; i < end; ++i) {
        const std::size_t ray = lobes.first[i - lobes.begin] + k;
        if (ray >= lobes.first[i - lobes.begin + 1]) continue;
        order_[ordered++] = {static_cast<std::uint16_t>(ray), static_cast<std::uint16_t>(i)};
        any = true;
      }
    }
  }
}

void TileTracer::runBlock(const Traced& scene, const trace::LobeTracer::Lobes& lobes, float alpha,
                          std::uint8_t* flags, TraceCounts& counts) {
  orderRays(lobes);
  const bool levels = scene.options.levels == Levels::Adaptive;
  const bool filter = scene.options.filter;
  const std::size_t rays = lobes.first[lobes.end - lobes.begin];
  counts.rays += rays;
  for (std::size_t first = 0; first < rays; first += RayPacket::kMost) {
    fill(scene, lobes, first, std::min(RayPacket::kMost, rays - first));
    const std::int64_t start = nowNs();
    traverse(scene.tree, packet_, alpha, levels, hits_, counts.visits);
    counts.traceSeconds += secondsSince(start);
    for (std::size_t lane = 0; lane < packet_.count; ++lane) {
      const Ray& ray = order_[first + lane];
      const Vec3 direction = lobes.rays.direction(ray.number);
      Vec3& value = values_[ray.number];
      if (hits_.node[lane] != kNothing) {
        value =
            seen(scene.images, scene.radiance,
                 {hits_.node[lane], {hits_.u[lane], hits_.v[lane]}, hits_.back[lane] != 0},
                 direction, packet_.base[lane] + packet_.slope[lane] * hits_.metres[lane], filter);
        continue;
      }
      ++counts.misses;
      if (flags != nullptr) flags[ray.point] |= 4;
      const float slope = packet_.slope[lane];
      value = filter ? scene.environment.radiance(direction, slope * slope)
                     : scene.lighting.environment->radiance(direction);
    }
  }
}

void TileTracer::fill(const Traced& scene, const trace::LobeTracer::Lobes& lobes, std::size_t first,
                      std::size_t count) {
  const trace::PointLanes& points = lobes_.points();
  packet_.count = count;
  for (std::size_t lane = 0; lane < count; ++lane) {
    const auto [number, point] = order_[first + lane];
    packet_.origin[0][lane] = lobes.rays.originX[number];
    packet_.origin[1][lane] = lobes.rays.originY[number];
    packet_.origin[2][lane] = lobes.rays.originZ[number];
    packet_.direction[0][lane] = lobes.rays.directionX[number];
    packet_.direction[1][lane] = lobes.rays.directionY[number];
    packet_.direction[2][lane] = lobes.rays.directionZ[number];
    if (points.glossiness[point] <= scene::kMirrorGlossiness) {
      // DEVIATION: a mirror's ray stands for what the sample's cone covers
      packet_.base[lane] = scene.spreadRad * points.coneDistance[point];
      packet_.slope[lane] = scene.spreadRad;
    } else {
      const std::size_t begin = lobes.first[point - lobes.begin];
      const auto rays = static_cast<int>(lobes.first[point - lobes.begin + 1] - begin);
      packet_.base[lane] = 0.0f;
      packet_.slope[lane] = slopesOf(point, rays)[number - begin];
    }
  }
}

const std::array<float, 256>& TileTracer::slopesOf(std::size_t point, int count) {
  const trace::PointLanes& points = lobes_.points();
  const float glossiness = points.glossiness[point];
  const Vec2 shift(points.shiftX[point], points.shiftY[point]);
  const std::uint32_t bits = std::bit_cast<std::uint32_t>(glossiness) * 0x9E3779B1u ^
                             std::bit_cast<std::uint32_t>(shift.x) * 0x85EBCA77u;
  Widths& widths = widths_[bits >> 26];
  if (widths.glossiness != glossiness || widths.shift != shift || widths.count != count) {
    widths.glossiness = glossiness;
    widths.shift = shift;
    widths.count = count;
    for (int k = 0; k < count; ++k)
      widths.slopes[static_cast<std::size_t>(k)] =
          std::sqrt(trace::lobeSolidAngle(glossiness, shift, k, count));
  }
  return widths.slopes;
}

}  // namespace catoptric::methods::glossy_lod
