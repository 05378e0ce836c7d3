#include "methods/glossy_lod/tile_tracer.h"

#include <algorithm>
#include <cmath>
#include <span>

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

/// Points that share packets, if their lobes have enough rays to fill these. Ours: for lobes of 8
/// to 40 rays, 32 points take 16 to 38 % more steps, and 4 points 2 to 11 % more.
constexpr std::size_t kPoints = 8;
/// Rays of such a point in a packet.
constexpr std::size_t kPart = RayPacket::kMost / kPoints;

/// How far axes of lobes may turn, in a packet that all of them share, over the mean of 1 - cosine
/// within a lobe. Ours: 0.5 to 16 take as many steps within 5 %.
constexpr float kTurn = 2.0f;

bool isSharp(scene::Lobe lobe) {
  return scene::coneExponent(lobe) > kSharpExponent;
}

/// The place of a lobe's ray in the unit disk of its directions.
struct RayPlace {
  Vec2 at;
  std::uint8_t ray;
};

/// Sorts rays into parts of kPart neighbours: halves by x, quarters by y, eighths by x and so on.
/// Lobes with other shifts have almost the same parts.
void splitByPlace(std::span<RayPlace> rays, int axis) {
  if (rays.size() <= kPart) return;
  const std::size_t half = (rays.size() / kPart + 1) / 2 * kPart;
  std::nth_element(rays.begin(), rays.begin() + static_cast<std::ptrdiff_t>(half), rays.end(),
                   [&](const RayPlace& a, const RayPlace& b) { return a.at[axis] < b.at[axis]; });
  splitByPlace(rays.first(half), 1 - axis);
  splitByPlace(rays.subspan(half), 1 - axis);
}

}  // namespace

void TraceCounts::add(const TraceCounts& other) {
  rays += other.rays;
  misses += other.misses;
  belowHorizon += other.belowHorizon;
  visits.nodes += other.visits.nodes;
  visits.quads += other.visits.quads;
  visits.stopped += other.visits.stopped;
  visits.lifted += other.visits.lifted;
  visits.selfHits += other.visits.selfHits;
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
  trace::PointLanes& points = lobes_.points();
  trace::ReflectionCounts made;
  const std::int64_t start = nowNs();
  liftOntoImages(scene.images, scene.tree, points, left_.data(), counts.visits);
  counts.traceSeconds += secondsSince(start);
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
      for (std::size_t k = 0; k < rays; ++k) sum += weights_[k][i] * values_[k][i];
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
  const std::size_t most =
      std::max(kPoints, RayPacket::kMost / static_cast<std::size_t>(group.rays));
  for (; group.points < most; ++group.points) {
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

void TileTracer::makePackets(const Traced& scene, const Group& group, std::uint8_t* flags,
                             trace::ReflectionCounts& counts) {
  const trace::PointLanes& points = lobes_.points();
  const std::size_t perPacket = group.perPacket();
  const float share = std::sqrt(1.0f / static_cast<float>(paths_));  // of a lobe, along an edge
  const std::size_t end = group.begin + group.points;
  for (std::size_t number = 0; number * perPacket < static_cast<std::size_t>(group.rays); ++number)
    packets_[number].count = 0;
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
      const std::uint8_t* const ranks = ranksOf(i, group.rays);
      const std::size_t from = lobes.first[i - lobes.begin];
      for (std::size_t k = 0; k < static_cast<std::size_t>(group.rays); ++k) {
        const std::size_t number = ranks[k] / perPacket;
        RayPacket& packet = packets_[number];
        const std::size_t lane = ranks[k] % perPacket * group.points + (i - group.begin);
        rays_[number][lane] = static_cast<std::uint8_t>(k);
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
        weights_[k][i - group.begin] = lobes.weights == nullptr ? 1.0f : lobes.weights[from + k];
        packet.own[lane] = static_cast<std::uint32_t>(points.object[i]);
        packet.count = std::max(packet.count, lane + 1);
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
  std::array<LeftPoint, RayPacket::kMost> left;
  for (std::size_t lane = 0; lane < packet.count; ++lane)
    left[lane] = left_[group.begin + lane % group.points];
  traverseFrom(left, scene.images, *scene.shading.geometry, scene.tree, packet, group.alpha,
               scene.options.levels, hits_, counts.visits);
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
    Vec3& value = values_[rays_[number][lane]][lane % group.points];
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
  const std::size_t index = rays_[number][lane];
  const auto vectorOf = [&](const std::array<RayPacket::Lane, 3>& of) {
    return Vec3(of[0][lane], of[1][lane], of[2][lane]);
  };
  const QuadHit found{hits_.node[lane], {hits_.u[lane], hits_.v[lane]}, hits_.back[lane] != 0};
  const Vec3 way = vectorOf(packet.direction);
  const Vec3 direction = towardsSide(*scene.shading.geometry, scene.images, found, way);
  const float metres = hits_.metres[lane];
  const float width = packet.base[lane] + packet.slope[lane] * metres;
  const std::size_t point = group.begin + lane % group.points;
  trace::ReflectionPoint from;
  from.shift = {lobes_.points().shiftX[point], lobes_.points().shiftY[point]};
  from.distance = lobes_.points().coneDistance[point];
  Onward onward{&values_[index][lane % group.points], direction,
                meshSurface(scene.shading, found, vectorOf(packet.origin) + metres * way, direction,
                            width, trace::nextShift(from.shift, static_cast<int>(index)))};
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
        trace::reflectionWeights(surface.specularLevel, surface.tint, surface.f90, surface.lobe,
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
  Widths& widths = widths_[trace::lobeSlot(g, shift)];
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

const std::uint8_t* TileTracer::ranksOf(std::size_t point, int count) {
  static constexpr std::uint8_t kSingle = 0;
  if (count == 1) return &kSingle;  // their shifts are too many to keep
  const trace::PointLanes& points = lobes_.points();
  const Vec2 shift(points.shiftX[point], points.shiftY[point]);
  Ranks& ranks = ranks_[trace::lobeSlot(0.0f, shift)];
  if (ranks.shift != shift || ranks.count != count) {
    ranks.shift = shift;
    ranks.count = count;
    std::array<RayPlace, 256> places;
    const auto used = std::span(places).first(static_cast<std::size_t>(count));
    for (int k = 0; k < count; ++k)
      used[static_cast<std::size_t>(k)] = {trace::ggxSample(shift, k, count),
                                           static_cast<std::uint8_t>(k)};
    splitByPlace(used, 0);
    for (std::size_t rank = 0; rank < used.size(); ++rank)
      ranks.of[used[rank].ray] = static_cast<std::uint8_t>(rank);
  }
  return ranks.of.data();
}

}  // namespace catoptric::methods::glossy_lod
