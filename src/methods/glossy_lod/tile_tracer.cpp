#include "methods/glossy_lod/tile_tracer.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "core/clock.h"
#include "methods/glossy_lod/mesh_surface.h"

namespace catoptric::methods::glossy_lod {
namespace {

/// Exponent above which a lobe is sharp [Yu2008, section 4]; rays and alpha of sharp ones, of
/// others.
constexpr float kSharpExponent = 3000.0f;
constexpr int kSharpRays = 20;
constexpr float kSharpAlpha = 3.0f;
constexpr int kBroadRays = 40;
constexpr float kBroadAlpha = 10.0f;

/// How far axes of lobes may turn, in a packet that all of them share, over the mean of 1 - cosine
/// within a lobe. Ours: 0.5 to 16 take as many steps within 5 %.
constexpr float kTurn = 2.0f;

bool isSharp(scene::Lobe lobe) {
  return scene::coneExponent(lobe) > kSharpExponent;
}

}  // namespace

void TraceCounts::add(const TraceCounts& other) {
  rays += other.rays;
  misses += other.misses;
  belowHorizon += other.belowHorizon;
  visits.nodes += other.visits.nodes;
  visits.quads += other.visits.quads;
  visits.stopped += other.visits.stopped;
  visits.ownBacks += other.visits.ownBacks;
  sidesShaded += other.sidesShaded;
  traceSeconds += other.traceSeconds;
  shadeSeconds += other.shadeSeconds;
  resolveSeconds += other.resolveSeconds;
}

TileTracer& TileTracer::ofThread() {
  static thread_local TileTracer tracer;
  return tracer;
}

void TileTracer::run(const Traced& scene, Vec3* radiance, std::uint8_t* flags,
                     TraceCounts& counts) {
  const trace::PointLanes& points = lobes_.points();
  trace::ReflectionCounts made;
  for (std::size_t begin = 0; begin < points.count;) {
    const Group group = nextGroup(scene.options, begin);
    makePackets(scene, group, flags, made);
    const auto rays = static_cast<std::size_t>(group.rays);
    const std::size_t packets = (rays + group.perPacket() - 1) / group.perPacket();
    for (std::size_t packet = 0; packet < packets; ++packet)
      tracePacket(scene, group, packet, flags, counts);
    if (!onward_.empty()) traceOnward(scene, counts);
    // Mean over each lobe, in the order of its rays
    for (std::size_t i = 0; i < group.points; ++i) {
      Vec3 sum(0.0f);
      for (std::size_t k = 0; k < rays; ++k) {
        const std::size_t packet = k / group.perPacket();
        const std::size_t lane = k % group.perPacket() * group.points + i;
        sum += weights_[packet][lane] * values_[packet][lane];
      }
      radiance[begin + i] = sum / static_cast<float>(group.rays);
    }
    begin += group.points;
  }
  counts.belowHorizon += made.belowHorizon;
}

TileTracer::Group TileTracer::nextGroup(const Options& options, std::size_t begin) {
  const trace::PointLanes& points = lobes_.points();
  const auto groupOf = [&](std::size_t i) {
    const bool sharp = options.automatic && isSharp({points.lobe[i]});
    // Lobes within lobes have one ray each
    const int rays = bounce_ > 0          ? 1
                     : !options.automatic ? options.rays
                     : sharp              ? kSharpRays
                                          : kBroadRays;
    const float alpha = !options.automatic ? options.alpha : sharp ? kSharpAlpha : kBroadAlpha;
    return Group{i, 1, trace::lobeRays({points.lobe[i]}, rays), alpha};
  };
  Group group = groupOf(begin);
  for (; group.points < RayPacket::kMost; ++group.points) {
    const std::size_t i = begin + group.points;
    if (i == points.count) break;
    const Group next = groupOf(i);
    if (next.rays != group.rays || next.alpha != group.alpha) break;
  }
  // Where lobes turn faster than they are wide, the rays of a few are closer to parallel
  const float exponent = scene::coneExponent({points.lobe[begin]});
  const float leastCosine = 1.0f - kTurn / (exponent + 2.0f);
  const auto axisOf = [&](std::size_t i) {
    return glm::reflect(points.direction.at(i), points.normal.at(i));
  };
  const Vec3 axis = axisOf(begin);
  std::size_t alike = 1;
  while (alike < group.points && glm::dot(axis, axisOf(begin + alike)) >= leastCosine) ++alike;
  const auto halved = [&] { return (group.points + 1) / 2; };
  while (group.points > alike &&
         halved() * static_cast<std::size_t>(group.rays) >= RayPacket::kMost)
    group.points = halved();
  return group;
}

/// A packet holds rays of one number, or a few, in the lobes of all points: they are nearly
/// parallel.
void TileTracer::makePackets(const Traced& scene, const Group& group, std::uint8_t* flags,
                             trace::ReflectionCounts& counts) {
  const trace::PointLanes& points = lobes_.points();
  const std::size_t perPacket = group.perPacket();
  const float share = std::sqrt(1.0f / static_cast<float>(paths_));  // of a lobe, along an edge
  const std::size_t end = group.begin + group.points;
  for (std::size_t begin = group.begin; begin < end;) {
    const trace::LobeTracer::Lobes lobes = lobes_.makeRays(begin, end, group.rays, flags, counts);
    for (std::size_t i = lobes.begin; i < lobes.end; ++i) {
      // DEVIATION: a mirror's ray stands for what the sample's cone covers
      const scene::Lobe lobe{points.lobe[i]};
      const bool mirror = lobe.mirror();
      const bool ggx = lobe.ggx() && !mirror;
      const bool first = bounce_ == 0;
      const float base = !first   ? arrivingBase_[i]
                         : mirror ? scene.spreadRad * points.coneDistance[i]
                                  : 0.0f;
      const float* const slopes = mirror ? &scene.spreadRad
                                  : ggx  ? nullptr
                                         : slopesOf(i, group.rays);
      const std::size_t from = lobes.first[i - lobes.begin];
      for (std::size_t k = 0; k < static_cast<std::size_t>(group.rays); ++k) {
        RayPacket& packet = packets_[k / perPacket];
        const std::size_t lane = k % perPacket * group.points + (i - group.begin);
        packet.origin[0][lane] = lobes.rays.originX[from + k];
        packet.origin[1][lane] = lobes.rays.originY[from + k];
        packet.origin[2][lane] = lobes.rays.originZ[from + k];
        packet.direction[0][lane] = lobes.rays.directionX[from + k];
        packet.direction[1][lane] = lobes.rays.directionY[from + k];
        packet.direction[2][lane] = lobes.rays.directionZ[from + k];
        packet.base[lane] = base;
        const float slope =
            ggx ? std::sqrt(trace::solidAngleOf(lobes.densities[from + k], group.rays)) : slopes[k];
        packet.slope[lane] =
            first ? slope : glm::length(Vec2(arrivingSlope_[i], mirror ? 0.0f : share * slope));
        weights_[k / perPacket][lane] = lobes.weights == nullptr ? 1.0f : lobes.weights[from + k];
        packet.own[lane] = static_cast<std::uint32_t>(points.object[i]);
        packet.leaves[0][lane] = points.lobeHorizon.x[i];
        packet.leaves[1][lane] = points.lobeHorizon.y[i];
        packet.leaves[2][lane] = points.lobeHorizon.z[i];
        packet.count = lane + 1;
      }
    }
    begin = lobes.end;
  }
}

void TileTracer::tracePacket(const Traced& scene, const Group& group, std::size_t number,
                             std::uint8_t* flags, TraceCounts& counts) {
  RayPacket& packet = packets_[number];
  packet.steepest = scene.options.coarsest > 0.0f && group.alpha > 0.0f
                        ? radians(scene.options.coarsest) / group.alpha
                        : kAnySlope;
  const bool filter = scene.options.filter;
  const std::int64_t start = nowNs();
  traverse(scene.tree, packet, group.alpha, scene.options.levels, hits_, counts.visits);
  counts.traceSeconds += secondsSince(start);
  counts.rays += packet.count;
  const auto directionOf = [&](std::size_t lane) {
    return Vec3(packet.direction[0][lane], packet.direction[1][lane], packet.direction[2][lane]);
  };
  // All look-ups are found first, so that their loads overlap
  const bool shaded = scene.radiance.allShaded();
  for (std::size_t lane = 0; lane < packet.count; ++lane) {
    if (hits_.node[lane] == kNothing) continue;
    if (!shaded) ensureShaded(scene, lane, counts);
    const QuadHit found{hits_.node[lane], {hits_.u[lane], hits_.v[lane]}, hits_.back[lane] != 0};
    const float width = packet.base[lane] + packet.slope[lane] * hits_.metres[lane];
    footprints_[lane] =
        footprint(scene.images, scene.radiance, found, directionOf(lane), width, filter);
  }
  for (std::size_t lane = 0; lane < packet.count; ++lane) {
    Vec3& value = values_[number][lane];
    if (hits_.node[lane] != kNothing) {
      value = mean(footprints_[lane]);
      if (bounce_ + 1 < scene.options.bounces) goOn(scene, group, number, lane, counts);
      continue;
    }
    ++counts.misses;
    if (flags != nullptr) flags[group.begin + lane % group.points] |= 4;
    const float slope = packet.slope[lane];
    value = filter ? scene.environment.radiance(directionOf(lane), slope * slope)
                   : scene.shading.lighting->environment->radiance(directionOf(lane));
  }
}

void TileTracer::goOn(const Traced& scene, const Group& group, std::size_t number, std::size_t lane,
                      TraceCounts& counts) {
  const int object = scene.images.charts()[scene.tree.quads[hits_.node[lane]].chart].object;
  if (scene.shading.scene->objects[static_cast<std::size_t>(object)].reflector == 0) return;
  const RayPacket& packet = packets_[number];
  const auto vectorOf = [&](const std::array<RayPacket::Lane, 3>& of) {
    return Vec3(of[0][lane], of[1][lane], of[2][lane]);
  };
  const Vec3 direction = vectorOf(packet.direction);
  const float metres = hits_.metres[lane];
  const float width = packet.base[lane] + packet.slope[lane] * metres;
  Onward onward{
      &values_[number][lane], direction,
      meshSurface(scene.shading,
                  {hits_.node[lane], {hits_.u[lane], hits_.v[lane]}, hits_.back[lane] != 0},
                  vectorOf(packet.origin) + metres * direction, direction, width)};
  if (!(onward.surface.specularLevel > 0.0f)) return;
  if (!next_) {
    next_ = std::make_unique<TileTracer>();
    next_->bounce_ = bounce_ + 1;
  }
  trace::PointLanes& points = next_->points();
  if (onward_.empty()) {
    points.count = 0;
    next_->paths_ = paths_ * group.rays;
    next_->arrivingBase_.clear();
    next_->arrivingSlope_.clear();
  }
  const std::size_t point = group.begin + lane % group.points;
  trace::ReflectionPoint from;
  from.shift = {lobes_.points().shiftX[point], lobes_.points().shiftY[point]};
  from.distance = lobes_.points().coneDistance[point];
  const std::size_t index = number * group.perPacket() + lane / group.points;
  trace::ReflectionPoint next =
      trace::nextPoint(from, static_cast<int>(index), direction, metres, onward.surface,
                       scene.extents[static_cast<std::size_t>(object)]);
  next.object = object + 1;
  points.add(next);
  next_->arrivingBase_.push_back(width);
  next_->arrivingSlope_.push_back(packet.slope[lane]);
  onward_.push_back(onward);
  if (points.count == trace::kMostLanes) traceOnward(scene, counts);
}

void TileTracer::traceOnward(const Traced& scene, TraceCounts& counts) {
  reflected_.resize(onward_.size());
  next_->run(scene, reflected_.data(), nullptr, counts);
  for (std::size_t i = 0; i < onward_.size(); ++i) {
    const Onward& onward = onward_[i];
    const frame::SurfacePoint& surface = onward.surface;
    const trace::ReflectionWeights weights =
        trace::reflectionWeights(surface.specularLevel, surface.tint, surface.lobe,
                                 onward.direction, surface.normal, scene.fresnelSchlick);
    *onward.value =
        weights.diffuse * *onward.value + weights.reflection * (reflected_[i] + surface.highlight);
  }
  onward_.clear();
}

void TileTracer::ensureShaded(const Traced& scene, std::size_t lane, TraceCounts& counts) {
  const std::uint32_t chart = scene.images.tree().quads()[hits_.node[lane]].chart;
  const int side = hits_.back[lane] != 0 ? 1 : 0;
  if (scene.radiance.isShaded(chart, side)) return;
  const std::int64_t start = nowNs();
  counts.sidesShaded += scene.radiance.ensure(chart, side) ? 1 : 0;
  counts.shadeSeconds += secondsSince(start);
}

const float* TileTracer::slopesOf(std::size_t point, int count) {
  const trace::PointLanes& points = lobes_.points();
  const float g = points.lobe[point];
  const Vec2 shift(points.shiftX[point], points.shiftY[point]);
  const std::uint32_t bits = std::bit_cast<std::uint32_t>(g) * 0x9E3779B1u ^
                             std::bit_cast<std::uint32_t>(shift.x) * 0x85EBCA77u;
  Widths& widths = widths_[bits >> 24];
  if (widths.g != g || widths.shift != shift || widths.count != count) {
    widths.g = g;
    widths.shift = shift;
    widths.count = count;
    for (int k = 0; k < count; ++k)
      widths.slopes[static_cast<std::size_t>(k)] =
          std::sqrt(trace::phongSolidAngle(g, shift, k, count));
  }
  return widths.slopes.data();
}

}  // namespace catoptric::methods::glossy_lod
