#include "trace/bake/baker.h"

#include <algorithm>
#include <cmath>

#include "core/parallel.h"
#include "scene/reflectance.h"
#include "trace/bake/surfaces.h"

namespace catoptric::trace {
namespace {

std::vector<int> castersOf(const frame::Geometry& geometry) {
  std::vector<int> casters;
  for (std::size_t o = 0; o < geometry.objects.size(); ++o) {
    if (!geometry.objects[o].moving) casters.push_back(static_cast<int>(o));
  }
  return casters;
}
/// By the share of its rays on back faces.
bool isEnclosed(float back) {
  return back >= kEnclosedShare;
}
/// Whether a ray hits the front of a triangle. Computes the hit's place on the triangle and its
/// distance from the corners: Embree's own differ from processor to processor in the last bits.
bool locate(const frame::Geometry& geometry, const Ray& ray, Hit& hit) {
  const frame::ObjectRange& object = geometry.objects[hit.object];
  const std::uint32_t* t = &geometry.indices[object.firstIndex + 3 * hit.primitive];
  const glm::dvec3 corner = geometry.positions[t[0]];
  const glm::dvec3 direction = ray.direction;
  const glm::dvec3 toCorner = corner - glm::dvec3(ray.origin);
  const glm::dvec3 ab = glm::dvec3(geometry.positions[t[1]]) - corner;
  const glm::dvec3 ac = glm::dvec3(geometry.positions[t[2]]) - corner;
  const glm::dvec3 normal = glm::cross(ab, ac);
  const double along = glm::dot(normal, direction);
  if (object.surface >= 0 || along == 0.0) return along < 0.0;
  const glm::dvec3 across = glm::cross(direction, toCorner);
  hit.distance = static_cast<float>(std::max(0.0, glm::dot(normal, toCorner) / along));
  hit.u = static_cast<float>(std::clamp(-glm::dot(across, ac) / along, 0.0, 1.0));
  hit.v = static_cast<float>(std::clamp(glm::dot(across, ab) / along, 0.0, 1.0));
  return along < 0.0;
}
TraceOptions casterOptions(const std::vector<int>& casters, const std::string& isa) {
  TraceOptions options;
  options.isa = isa;
  options.robust = true;  // no ray slips through an edge that two triangles share
  // An empty list would mean all: name an object that does not exist instead.
  options.objects = casters.empty() ? std::vector<int>{-1} : casters;
  return options;
}

}  // namespace

Baker::Baker(const scene::Scene& scene, const frame::Geometry& geometry,
             const frame::EnvironmentLight& environment, const std::string& isa,
             const BakeCallbacks& callbacks)
    : scene_(scene),
      geometry_(geometry),
      environment_(environment),
      callbacks_(callbacks),
      points_(makeBakePoints(geometry)),
      castsLight_(castersOf(geometry)),
      surfaces_(insetSurfaces(geometry, points_)),
      trace_(scene, surfaces_, BvhPolicy::Static, casterOptions(castsLight_, isa)) {
  occlusionDistance_ = scene.bake.ambientOcclusionDistance > 0.0f
                           ? scene.bake.ambientOcclusionDistance
                           : 0.1f * geometry.bounds.diameter();
}

void Baker::advance(std::uint64_t rays) {
  const std::uint64_t done = doneRays_ += rays;
  // A thread that finds another one telling has nothing to add
  const std::unique_lock lock(progressMutex_, std::try_to_lock);
  if (lock.owns_lock() && callbacks_.progress && plannedRays_ > 0)
    callbacks_.progress(static_cast<double>(done) / static_cast<double>(plannedRays_));
}

void Baker::fillAndSmooth(const std::vector<std::uint8_t>& valid, const ValueErrors& errors,
                          std::vector<Vec4>& values) {
  enclosed_ = static_cast<std::size_t>(std::count(valid.begin(), valid.end(), 0));
  valid_ = valid;
  fillInvalid(points_, valid, values);
  smoothValues(points_, errors, values);
}

std::vector<Vec4> Baker::ambientOcclusion() {
  const int count = scene_.bake.rays;
  const std::vector<Vec2> lattice = latticePoints(count);
  const std::vector<Vec2> few = latticePoints(std::min(count, kEnclosedRays));
  plannedRays_ = points_.size() * (lattice.size() + few.size());
  std::vector<Vec4> values(points_.size());
  std::vector<std::uint8_t> valid(points_.size(), 1);
  ValueErrors errors(points_.size());
  parallelFor(points_.size(), kPointsPerTask, [&](std::size_t begin, std::size_t end) {
    if (stopped()) return;
    std::vector<Ray> rays(lattice.size());
    std::vector<std::uint8_t> free(lattice.size());
    std::vector<Hit> hits(few.size());
    for (std::size_t i = begin; i < end; ++i) {
      const Basis basis(points_.normals[i]);
      const Vec2 shift = sequenceShift(std::uint64_t{points_.ranks[i]} * lattice.size());

      // A point whose rays end on back faces lies inside something.
      for (std::size_t k = 0; k < few.size(); ++k) {
        rays[k] = {points_.positions[i], cosineDirection(basis, shifted(few[k], shift))};
      }
      refused_ += trace_.intersectSerial(std::span(rays).first(few.size()), hits, false).refused;
      int back = 0;
      for (std::size_t k = 0; k < few.size(); ++k) {
        if (hits[k].miss()) continue;
        if (!locate(surfaces_, rays[k], hits[k])) ++back;
        if (hits[k].distance < occlusionDistance_)
          errors.nearness[i] += 1.0f / (std::max(hits[k].distance, points_.offsets[i]) *
                                        static_cast<float>(few.size()));
      }
      if (static_cast<float>(back) >= kEnclosedShare * static_cast<float>(few.size())) valid[i] = 0;

      for (std::size_t k = 0; k < lattice.size(); ++k) {
        rays[k] = {points_.positions[i], cosineDirection(basis, shifted(lattice[k], shift)), 0.0f,
                   occlusionDistance_};
      }
      refused_ += trace_.visibleSerial(rays, free, false).refused;
      int open = 0;
      std::array<float, kGroups> groups{};
      for (std::size_t k = 0; k < free.size(); ++k) {
        open += free[k];
        groups[k % kGroups] += static_cast<float>(free[k]);
      }
      errors.noise[i] = standardError(groups, 1.0f / static_cast<float>(count));
      values[i] = Vec4(0.0f, 0.0f, 0.0f, static_cast<float>(open) / static_cast<float>(count));
    }
    rays_ += (end - begin) * (lattice.size() + few.size());
    advance((end - begin) * (lattice.size() + few.size()));
  });
  if (!stopped()) fillAndSmooth(valid, errors, values);
  return values;
}

std::vector<Vec3> Baker::radiosity(const std::vector<Vec3>& irradiance) const {
  std::vector<Vec3> leaving(geometry_.vertexCount());
  for (std::size_t o = 0; o < geometry_.objects.size(); ++o) {
    const frame::ObjectRange& range = geometry_.objects[o];
    const scene::Material& material = scene_.materials[scene_.objects[o].material];
    parallelFor(range.vertexCount, 4096, [&](std::size_t begin, std::size_t end) {
      for (std::size_t k = begin; k < end; ++k) {
        const std::size_t v = range.firstVertex + k;
        const frame::VertexAttributes& vertex = geometry_.attributes[v];
        const Vec3 albedo = material.baseColor * vertex.color *
                            coarseTexel(scene_, material.baseColorTexture, vertex);
        if (material.unlit) {
          leaving[v] = albedo;
          continue;
        }
        // What mirrors reflect is spread as if they were diffuse.
        float s = material.specularLevel;
        float metallic = material.metallicFactor;
        if (material.tintVaries() && material.metallicRoughnessTexture.used()) {
          metallic *= coarseTexel(scene_, material.metallicRoughnessTexture, vertex).b;
          s = scene::specularLevel(metallic, material.dielectricF0);
        }
        const Vec3 tint = frame::reflectionTint(material, metallic, albedo);
        const Vec3 reflected = (1.0f - s) * albedo + s * tint;
        leaving[v] = reflected * (1.0f / kPi) * irradiance[points_.pointOfVertex[v]];
      }
    });
  }
  return leaving;
}

Baker::GatherRays Baker::gatherRays(int count, int first) const {
  // As many in each group, for the standard error
  const double wanted = std::min(kMostEmitterRays, emitters_.share) * count / kGroups;
  return {.lattice = latticePoints(count, first),
          .toEmitters = emitters_.triangles.empty()
                            ? 0
                            : kGroups * std::max(1, static_cast<int>(std::lround(wanted))),
          .step = first > 0 ? first : count,
          .share = static_cast<float>(count) / static_cast<float>(first + count)};
}

float Baker::skyShare(std::size_t point, const Vec3& arriving) const {
  const float whole = luminance(environment_.irradiance(points_.normals[point]));
  return whole > 0.0f ? std::min(1.0f, luminance(arriving) / whole) : 0.0f;
}

std::array<Vec3, kGroups> Baker::emitterLight(std::size_t point, const Vec2& shift,
                                              const GatherRays& gather, Buffers& buffers) {
  std::vector<Ray>& rays = buffers.rays;
  std::vector<std::uint8_t>& free = buffers.free;
  const Vec3 position = points_.positions[point];
  const Vec3 normal = points_.normals[point];
  const int count = gather.toEmitters;
  const auto counted = static_cast<float>(count);
  int used = 0;
  for (int k = 0; k < count; ++k) {
    // A triangle by its power; on each triangle the points are a Hammersley set.
    const auto [t, b] = emitters_.pick((k + static_cast<double>(shift.x)) / count);
    const float a = std::sqrt(fraction(shift.y + k * kGolden));
    const float u = a * (1.0f - b);
    const float v = a * b;
    const Vec3 target = t.corners[0] * (1.0f - u - v) + t.corners[1] * u + t.corners[2] * v;
    const Vec3 to = target - position;
    const float squared = glm::dot(to, to);
    if (!(squared > 0.0f)) continue;
    const Vec3 direction = to / std::sqrt(squared);
    const float here = glm::dot(normal, direction);
    const float there = -glm::dot(t.normal, direction);
    const float density = emitters_.density(t);
    if (!(here > 0.0f) || !(there > 0.0f) || !(density > 0.0f)) continue;
    // Balance heuristic with the gather's cosine-distributed rays [Veach1995].
    const float perSolidAngle = density * squared / there;
    const float weight =
        counted * perSolidAngle /
        (counted * perSolidAngle + static_cast<float>(gather.lattice.size()) * here / kPi);
    buffers.group[used] = k % kGroups;
    buffers.arriving[used] = t.radianceAt(u, v) * (weight * here / (perSolidAngle * counted));
    rays[used] = {position, to, 0.0f, 0.999f};
    ++used;
  }
  refused_ +=
      trace_.visibleSerial(std::span(rays).first(used), std::span(free).first(used), false).refused;
  std::array<Vec3, kGroups> sums{};
  for (int k = 0; k < used; ++k) {
    if (free[k] != 0) sums[buffers.group[k]] += buffers.arriving[k];
  }
  return sums;
}

float Baker::hitWeight(std::size_t point, const Hit& hit, const Emitters::Triangle& emitter,
                       const Vec3& direction, const GatherRays& gather) const {
  const float there = -glm::dot(emitter.normal, direction);
  const float here = glm::dot(points_.normals[point], direction);
  if (!(there > 0.0f)) return 0.0f;
  const float own = static_cast<float>(gather.lattice.size()) * here / kPi;
  const float other = static_cast<float>(gather.toEmitters) * emitters_.density(emitter) *
                      hit.distance * hit.distance / there;
  return own > 0.0f ? own / (own + other) : 0.0f;
}

Baker::Gathered Baker::gatherPoint(std::size_t point, const GatherRays& gather, const Vec2& shift,
                                   const std::vector<Vec3>& leaving, Buffers& buffers) {
  const std::vector<Vec2>& lattice = gather.lattice;
  const Basis basis(points_.normals[point]);
  std::vector<Ray>& rays = buffers.rays;
  for (std::size_t k = 0; k < lattice.size(); ++k) {
    rays[k] = {points_.positions[point], cosineDirection(basis, shifted(lattice[k], shift))};
  }
  refused_ +=
      trace_.intersectSerial(std::span(rays).first(lattice.size()), buffers.hits, false).refused;
  Gathered gathered;
  for (std::size_t k = 0; k < lattice.size(); ++k) {
    Hit& hit = buffers.hits[k];
    const bool front = !hit.miss() && locate(surfaces_, rays[k], hit);
    Vec3& sum = gathered.parts[k % kGroups];
    if (hit.distance > occlusionDistance_) ++gathered.open;
    if (!hit.miss()) gathered.nearness += 1.0f / std::max(hit.distance, points_.offsets[point]);
    if (hit.miss()) {
      const Vec3 radiance = environment_.radiance(rays[k].direction);
      sum += radiance;
      gathered.sky += radiance;
      continue;
    }
    if (!front) {
      ++gathered.back;
      continue;
    }
    const std::uint32_t first = geometry_.objects[hit.object].firstIndex + 3 * hit.primitive;
    const std::int32_t emitter = emitters_.ofTriangle[first / 3];
    if (emitter >= 0) {
      const Emitters::Triangle& bright = emitters_.triangles[static_cast<std::size_t>(emitter)];
      sum += bright.radianceAt(hit.u, hit.v) *
             hitWeight(point, hit, bright, rays[k].direction, gather);
      continue;
    }
    const std::uint32_t* t = &geometry_.indices[first];
    sum += (1.0f - hit.u - hit.v) * leaving[t[0]] + hit.u * leaving[t[1]] + hit.v * leaving[t[2]];
  }
  return gathered;
}

void Baker::gatherAt(std::span<const std::uint32_t> points, const std::vector<Vec3>& leaving,
                     const GatherRays& rays, Gather& all) {
  const std::size_t count = rays.lattice.size();
  const auto counted = static_cast<float>(count);
  parallelFor(points.size(), kPointsPerTask, [&](std::size_t begin, std::size_t end) {
    if (stopped()) return;
    Buffers buffers;
    const auto toEmitters = static_cast<std::size_t>(rays.toEmitters);
    buffers.rays.resize(std::max(count, toEmitters));
    buffers.hits.resize(count);
    buffers.free.resize(toEmitters);
    buffers.arriving.resize(toEmitters);
    buffers.group.resize(toEmitters);
    for (const std::uint32_t i : points.subspan(begin, end - begin)) {
      const Vec2 shift =
          sequenceShift(std::uint64_t{points_.ranks[i]} * static_cast<std::uint64_t>(rays.step));
      const Gathered gathered = gatherPoint(i, rays, shift, leaving, buffers);
      std::array<Vec3, kGroups> emitted{};
      if (rays.toEmitters > 0) {
        const Vec2 aside = sequenceShift(points_.ranks[i]);
        emitted =
            emitterLight(i, rays.share < 1.0f ? shifted(aside, Vec2(0.5f)) : aside, rays, buffers);
      }
      const float scale = kPi / counted;
      Vec3 irradiance(0.0f);
      std::array<float, kGroups> groups{};
      for (int k = 0; k < kGroups; ++k) {
        const Vec3 part = gathered.parts[k] * scale + emitted[k];
        irradiance += part;
        groups[k] = (part.x + part.y + part.z) / 3.0f;
      }
      const float own = rays.share;
      const float noise = own * standardError(groups, 1.0f);
      const float noiseBefore = (1.0f - own) * all.errors.noise[i];
      all.errors.noise[i] = std::sqrt(noise * noise + noiseBefore * noiseBefore);
      all.errors.nearness[i] =
          own * gathered.nearness / counted + (1.0f - own) * all.errors.nearness[i];
      all.back[i] = own * static_cast<float>(gathered.back) / counted + (1.0f - own) * all.back[i];
      const float open = scene_.bake.skyApart ? skyShare(i, gathered.sky * scale)
                                              : static_cast<float>(gathered.open) / counted;
      all.values[i] = own * Vec4(irradiance, open) + (1.0f - own) * all.values[i];
    }
    rays_ += (end - begin) * (count + static_cast<std::size_t>(rays.toEmitters));
    advance((end - begin) * count);
  });
}

std::vector<std::uint32_t> Baker::disagreeing(std::span<const std::uint32_t> among,
                                              const Gather& all) const {
  std::vector<std::uint32_t> points;
  for (const std::uint32_t i : among) {
    const std::span<const std::uint32_t> neighbours = points_.neighboursOf(i);
    if (all.back[i] > kSurelyEnclosed) continue;
    // The standard error of one point is an estimate by few groups itself
    float variance = all.errors.noise[i] * all.errors.noise[i];
    for (const std::uint32_t n : neighbours) variance += all.errors.noise[n] * all.errors.noise[n];
    variance /= static_cast<float>(neighbours.size() + 1);
    const float own = brightness(all.values[i]);
    bool agrees = !neighbours.empty() && variance <= kAgreeingNoise * kAgreeingNoise * own * own;
    for (const std::uint32_t n : neighbours) {
      const float difference = brightness(all.values[n]) - own;
      const float allowed = kAgreeingErrors * kAgreeingErrors * 2.0f * variance;
      agrees = agrees && isEnclosed(all.back[n]) == isEnclosed(all.back[i]) &&
               difference * difference <= allowed;
    }
    if (!agrees) points.push_back(i);
  }
  return points;
}

std::vector<Vec4> Baker::gather(const std::vector<Vec3>& leaving, int count, bool adaptive,
                                Gather& all) {
  // In the order of the ranks: neighbours' rays visit the same parts of the BVH.
  std::vector<std::uint32_t> every(points_.size());
  for (std::size_t i = 0; i < every.size(); ++i)
    every[points_.ranks[i]] = static_cast<std::uint32_t>(i);
  std::erase_if(every, [&](std::uint32_t i) { return all.back[i] > kSurelyEnclosed; });
  const int few = std::max(kFewestRays, count / kAgreeingRaysDivisor);
  if (adaptive && few < count) {
    gatherAt(every, leaving, gatherRays(few), all);
    const std::vector<std::uint32_t> rest = disagreeing(every, all);
    plannedRays_ -= (points_.size() - rest.size()) * static_cast<std::uint64_t>(count - few);
    gatherAt(rest, leaving, gatherRays(count - few, few), all);
  } else {
    gatherAt(every, leaving, gatherRays(count), all);
  }
  if (stopped()) return all.values;
  std::vector<std::uint8_t> valid(points_.size());
  for (std::size_t i = 0; i < valid.size(); ++i) valid[i] = isEnclosed(all.back[i]) ? 0 : 1;
  fillAndSmooth(valid, all.errors, all.values);
  return all.values;
}

std::vector<Vec4> Baker::full() {
  const int gathers = std::max(1, scene_.bake.bounces);
  const int earlierRays = std::max(16, scene_.bake.rays / kEarlierRaysDivisor);
  plannedRays_ = points_.size() * static_cast<std::uint64_t>(kShadowRays + scene_.bake.rays +
                                                             (gathers - 1) * earlierRays);
  const std::vector<Vec3> direct = directLight();
  Gather all{.values = std::vector<Vec4>(points_.size()),
             .back = std::vector<float>(points_.size(), 0.0f),
             .errors = ValueErrors(points_.size())};

  // Each gather sees all light that the one before has found; the last one is the finest.
  std::vector<Vec3> irradiance = direct;
  std::vector<Vec4> values(points_.size(), Vec4(0.0f));
  for (int g = 0; g < gathers; ++g) {
    const bool last = g + 1 == gathers;
    const int rays = last ? scene_.bake.rays : earlierRays;
    const std::vector<Vec3> leaving = scene_.bake.bounces > 0
                                          ? radiosity(irradiance)
                                          : std::vector<Vec3>(geometry_.vertexCount(), Vec3(0.0f));
    emitters_ = findEmitters(scene_, geometry_, leaving);
    const std::vector<Vec4> indirect = gather(leaving, rays, last, all);
    if (stopped()) return values;
    for (std::size_t i = 0; i < points_.size(); ++i) {
      values[i] = Vec4(direct[i] + Vec3(indirect[i]) + kPi * scene_.ambient * indirect[i].w,
                       scene_.bake.skyApart ? indirect[i].w : 0.0f);
    }
    // Lights do not reach into walls either: what lies there takes its neighbours' light.
    fillInvalid(points_, valid_, values);
    for (std::size_t i = 0; i < points_.size(); ++i) irradiance[i] = Vec3(values[i]);
  }
  // What shading adds again, with the normals of its normal maps
  for (std::size_t i = 0; scene_.bake.skyApart && i < points_.size(); ++i) {
    const Vec3 apart = values[i].w * environment_.irradiance(points_.normals[i]);
    values[i] = Vec4(glm::max(Vec3(values[i]) - apart, Vec3(0.0f)), values[i].w);
  }
  return values;
}

}  // namespace catoptric::trace
