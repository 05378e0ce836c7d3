#include "trace/bake/bake.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstring>
#include <string>
#include <vector>

#include "core/clock.h"
#include "core/error.h"
#include "core/file.h"
#include "core/hash.h"
#include "core/log.h"
#include "core/parallel.h"
#include "core/random.h"
#include "scene/animate.h"
#include "trace/bake/points.h"
#include "trace/embree/trace_scene.h"

namespace catoptric::trace {
namespace {

// All thresholds are ours, chosen by looking at rooms.
constexpr std::uint32_t kCacheVersion = 3;  ///< raise it when results change
constexpr float kEnclosedShare = 0.75f;     ///< of rays on back faces: inside something
constexpr int kEnclosedRays = 32;           ///< closest hits that decide it (occlusion only)
constexpr int kShadowRays = 32;             ///< per light with a radius, in penumbrae
constexpr int kRimRays = 8;                 ///< to the rim of a light: all alike means no penumbra
constexpr int kEmitterRays = 16;            ///< towards emissive surfaces
constexpr int kEarlierRaysDivisor = 4;      ///< gathers before the last take fewer rays
constexpr int kSmoothIterations = 6;
constexpr std::size_t kPointsPerTask = 32;

/// Steps of the two-dimensional R2 sequence [Roberts2018].
constexpr double kR2x = 0.7548776662466927;
constexpr double kR2y = 0.5698402909980532;

float fraction(double x) {
  return static_cast<float>(x - std::floor(x));
}

Vec2 shiftOf(std::size_t number) {
  const std::uint32_t a = mixedBits(static_cast<std::uint32_t>(number));
  const std::uint32_t b = mixedBits(a);
  return {unitFloat(a), unitFloat(b)};
}

/// Standard error of a mean from the sums of kGroups interleaved groups of its terms.
constexpr int kGroups = 4;
float standardError(const std::array<float, kGroups>& sums, float scale) {
  float mean = 0.0f;
  for (float s : sums) mean += s / kGroups;
  float squares = 0.0f;
  for (float s : sums) squares += (s - mean) * (s - mean);
  // The whole is kGroups times a group's mean; variance of the sum of groups, scaled.
  return scale * std::sqrt(squares * kGroups / (kGroups - 1));
}

Vec2 shifted(const Vec2& p, const Vec2& shift) {
  const Vec2 q = p + shift;
  return {q.x >= 1.0f ? q.x - 1.0f : q.x, q.y >= 1.0f ? q.y - 1.0f : q.y};
}

/// R2 points in the unit square, ordered along a Morton curve so that neighbours stay together.
std::vector<Vec2> latticePoints(int count) {
  std::vector<Vec2> points(count);
  for (int i = 0; i < count; ++i) points[i] = {fraction(0.5 + i * kR2x), fraction(0.5 + i * kR2y)};
  const auto morton = [](const Vec2& p) {
    const auto x = static_cast<std::uint32_t>(p.x * 256.0f);
    const auto y = static_cast<std::uint32_t>(p.y * 256.0f);
    std::uint32_t code = 0;
    for (int bit = 0; bit < 8; ++bit) {
      code |= (x >> bit & 1u) << (2 * bit) | (y >> bit & 1u) << (2 * bit + 1);
    }
    return code;
  };
  std::stable_sort(points.begin(), points.end(),
                   [&](const Vec2& a, const Vec2& b) { return morton(a) < morton(b); });
  return points;
}

/// Square to disk, area preserving and continuous [Shirley1997].
Vec2 concentricDisk(const Vec2& p) {
  const float a = 2.0f * p.x - 1.0f;
  const float b = 2.0f * p.y - 1.0f;
  if (a == 0.0f && b == 0.0f) return Vec2(0.0f);
  float radius = a;
  float angle = 0.0f;
  if (std::abs(a) > std::abs(b)) {
    angle = kPi / 4.0f * (b / a);
  } else {
    radius = b;
    angle = kPi / 2.0f - kPi / 4.0f * (a / b);
  }
  return {radius * std::cos(angle), radius * std::sin(angle)};
}

struct Basis {
  Vec3 x, y, z;
  explicit Basis(const Vec3& normal) : z(normal) {
    // [Duff2017]
    const float sign = std::copysign(1.0f, z.z);
    const float a = -1.0f / (sign + z.z);
    const float b = z.x * z.y * a;
    x = Vec3(1.0f + sign * z.x * z.x * a, sign * b, -sign * z.x);
    y = Vec3(b, sign + z.y * z.y * a, -z.y);
  }
  /// Cosine-distributed direction about z (Malley's method).
  Vec3 cosineDirection(const Vec2& p) const {
    const Vec2 d = concentricDisk(p);
    return x * d.x + y * d.y + z * std::sqrt(std::max(0.0f, 1.0f - d.x * d.x - d.y * d.y));
  }
};

float luminance(const Vec3& c) {
  return 0.2126f * c.x + 0.7152f * c.y + 0.0722f * c.z;
}

/// Emissive triangles of the objects that cast light, with the distribution to choose them by.
struct Emitters {
  struct Triangle {
    std::array<Vec3, 3> corners;
    Vec3 normal{0.0f};
    Vec3 radiance{0.0f};
  };
  std::vector<Triangle> triangles;
  std::vector<float> cumulative;  ///< of luminance times area, to 1
  double total = 0.0;             ///< W/sr-like: sum of luminance times area
  /// Index into `triangles` of an object's first triangle; -1 where it emits nothing.
  std::vector<std::int64_t> firstOfObject;

  /// Density over area with which a triangle's points are chosen, 1/m^2.
  float density(const Triangle& t) const {
    return static_cast<float>(static_cast<double>(luminance(t.radiance)) / total);
  }
};

/// Coarse texture colour at a vertex: the mip level of at most 8 x 8 texels.
Vec3 coarseTexel(const scene::Scene& scene, const scene::TextureSlot& slot,
                 const frame::VertexAttributes& vertex) {
  if (!slot.used()) return Vec3(1.0f);
  const scene::Texture& texture = scene.textures[slot.texture];
  const Vec2 uv = slot.transform * Vec3(slot.uvSet == 1 ? vertex.uv1 : vertex.uv0, 1.0f);
  const float lod = static_cast<float>(std::max<std::size_t>(texture.levels.size(), 4) - 4);
  return Vec3(frame::sampleTexture(texture, uv, lod));
}

Emitters findEmitters(const scene::Scene& scene, const frame::Geometry& geometry) {
  Emitters emitters;
  emitters.firstOfObject.assign(geometry.objects.size(), -1);
  for (std::size_t o = 0; o < geometry.objects.size(); ++o) {
    const scene::Material& material = scene.materials[scene.objects[o].material];
    const frame::ObjectRange& range = geometry.objects[o];
    if (range.moving || material.unlit || !(luminance(material.emissive) > 0.0f)) continue;
    emitters.firstOfObject[o] = static_cast<std::int64_t>(emitters.triangles.size());
    for (std::uint32_t i = range.firstIndex; i < range.firstIndex + range.indexCount; i += 3) {
      Emitters::Triangle t;
      Vec3 texels(0.0f);
      for (int k = 0; k < 3; ++k) {
        const std::uint32_t vertex = geometry.indices[i + k];
        t.corners[k] = geometry.positions[vertex];
        texels += coarseTexel(scene, material.emissiveTexture, geometry.attributes[vertex]) / 3.0f;
      }
      const Vec3 across = glm::cross(t.corners[1] - t.corners[0], t.corners[2] - t.corners[0]);
      t.normal = normalizedOr(across, Vec3(0.0f));
      t.radiance = material.emissive * texels;
      const float area = 0.5f * glm::length(across);
      emitters.total += static_cast<double>(luminance(t.radiance) * area);
      emitters.cumulative.push_back(static_cast<float>(emitters.total));
      emitters.triangles.push_back(t);
    }
  }
  for (float& c : emitters.cumulative) {
    c = static_cast<float>(static_cast<double>(c) / std::max(emitters.total, 1e-30));
  }
  return emitters;
}

/// Everything that the passes of a bake share.
class Baker {
 public:
  Baker(const scene::Scene& scene, const frame::Geometry& geometry,
        const frame::EnvironmentLight& environment, const std::function<bool()>& stopRequested)
      : scene_(scene),
        geometry_(geometry),
        environment_(environment),
        stopRequested_(stopRequested),
        points_(makeBakePoints(geometry)),
        castsLight_(castersOf(geometry)),
        trace_(scene, geometry, BvhPolicy::Static, casterOptions(castsLight_)) {
    occlusionDistance_ = scene.bake.ambientOcclusionDistance > 0.0f
                             ? scene.bake.ambientOcclusionDistance
                             : 0.1f * geometry.bounds.diameter();
  }

  const BakePoints& points() const { return points_; }
  std::uint64_t rays() const { return rays_; }
  std::size_t enclosed() const { return enclosed_; }
  std::uint64_t refused() const { return refused_; }
  /// The values of a stopped bake mean nothing.
  bool stopped() const { return stopRequested_ && stopRequested_(); }

  std::vector<Vec4> ambientOcclusion();
  std::vector<Vec4> full();

 private:
  static std::vector<int> castersOf(const frame::Geometry& geometry) {
    std::vector<int> casters;
    for (std::size_t o = 0; o < geometry.objects.size(); ++o) {
      if (!geometry.objects[o].moving) casters.push_back(static_cast<int>(o));
    }
    return casters;
  }
  static TraceOptions casterOptions(const std::vector<int>& casters) {
    TraceOptions options;
    // An empty list would mean all: name an object that does not exist instead.
    options.objects = casters.empty() ? std::vector<int>{-1} : casters;
    return options;
  }

  std::vector<Vec3> directLight();
  std::vector<Vec3> radiosity(const std::vector<Vec3>& irradiance) const;
  /// One gather: rgb irradiance of sky, surfaces and emitters; a = free share within the distance.
  std::vector<Vec4> gather(const std::vector<Vec3>& leaving, int rays);
  Vec3 emitterLight(const Emitters& emitters, std::size_t point, const Vec2& shift, int gatherRays,
                    std::vector<Ray>& rays, std::vector<std::uint8_t>& free);
  bool facesRay(const Hit& hit, const Vec3& direction, Vec3& normal) const;
  void fillAndSmooth(const std::vector<std::uint8_t>& valid, const std::vector<float>& noise,
                     std::vector<Vec4>& values);

  const scene::Scene& scene_;
  const frame::Geometry& geometry_;
  const frame::EnvironmentLight& environment_;
  const std::function<bool()>& stopRequested_;
  BakePoints points_;
  std::vector<int> castsLight_;
  TraceScene trace_;
  Emitters emitters_;
  float occlusionDistance_ = 0.0f;
  std::atomic<std::uint64_t> rays_{0};
  mutable std::atomic<std::uint64_t> refused_{0};
  std::size_t enclosed_ = 0;
  std::vector<std::uint8_t> valid_;  ///< per point, by the last gather: 0 inside something
};

bool Baker::facesRay(const Hit& hit, const Vec3& direction, Vec3& normal) const {
  const std::uint32_t* t =
      &geometry_.indices[geometry_.objects[hit.object].firstIndex + 3 * hit.primitive];
  const Vec3 p0 = geometry_.positions[t[0]];
  normal = glm::cross(geometry_.positions[t[1]] - p0, geometry_.positions[t[2]] - p0);
  return glm::dot(normal, direction) < 0.0f;
}

void Baker::fillAndSmooth(const std::vector<std::uint8_t>& valid, const std::vector<float>& noise,
                          std::vector<Vec4>& values) {
  enclosed_ = static_cast<std::size_t>(std::count(valid.begin(), valid.end(), 0));
  valid_ = valid;
  fillInvalid(points_, valid, values);
  smoothValues(points_, kSmoothIterations, noise, values);
}

std::vector<Vec4> Baker::ambientOcclusion() {
  const int count = scene_.bake.rays;
  const std::vector<Vec2> lattice = latticePoints(count);
  const std::vector<Vec2> few = latticePoints(std::min(count, kEnclosedRays));
  std::vector<Vec4> values(points_.size());
  std::vector<std::uint8_t> valid(points_.size(), 1);
  std::vector<float> noise(points_.size(), 0.0f);
  parallelFor(points_.size(), kPointsPerTask, [&](std::size_t begin, std::size_t end) {
    if (stopped()) return;
    std::vector<Ray> rays(lattice.size());
    std::vector<std::uint8_t> free(lattice.size());
    std::vector<Hit> hits(few.size());
    for (std::size_t i = begin; i < end; ++i) {
      const Basis basis(points_.normals[i]);
      const Vec2 shift = shiftOf(i);

      // A point whose rays end on back faces lies inside something.
      for (std::size_t k = 0; k < few.size(); ++k) {
        rays[k] = {points_.positions[i], basis.cosineDirection(shifted(few[k], shift))};
      }
      refused_ += trace_.intersectSerial(std::span(rays).first(few.size()), hits, true).refused;
      int back = 0;
      Vec3 normal;
      for (std::size_t k = 0; k < few.size(); ++k) {
        if (!hits[k].miss() && !facesRay(hits[k], rays[k].direction, normal)) ++back;
      }
      if (static_cast<float>(back) >= kEnclosedShare * static_cast<float>(few.size())) valid[i] = 0;

      for (std::size_t k = 0; k < lattice.size(); ++k) {
        rays[k] = {points_.positions[i], basis.cosineDirection(shifted(lattice[k], shift)), 0.0f,
                   occlusionDistance_};
      }
      refused_ += trace_.visibleSerial(rays, free, true).refused;
      int open = 0;
      std::array<float, kGroups> groups{};
      for (std::size_t k = 0; k < free.size(); ++k) {
        open += free[k];
        groups[k % kGroups] += static_cast<float>(free[k]);
      }
      noise[i] = standardError(groups, 1.0f / static_cast<float>(count));
      values[i] = Vec4(0.0f, 0.0f, 0.0f, static_cast<float>(open) / static_cast<float>(count));
    }
    rays_ += (end - begin) * (lattice.size() + few.size());
  });
  if (!stopped()) fillAndSmooth(valid, noise, values);
  return values;
}

std::vector<Vec3> Baker::directLight() {
  // Baked lights at the pose of the geometry.
  const scene::Pose pose = scene::poseAt(scene_, geometry_.timeSeconds);
  std::vector<frame::WorldLight> lights;
  std::vector<float> radii;
  for (const scene::Light& light : scene_.lights) {
    if (!light.baked) continue;
    lights.push_back(frame::worldLight(light, pose));
    radii.push_back(light.radius);
  }
  std::vector<Vec3> values(points_.size(), Vec3(0.0f));
  if (lights.empty()) return values;
  const float farAway = 2.0f * geometry_.bounds.diameter();
  const std::vector<Vec2> lattice = latticePoints(kShadowRays);

  parallelFor(points_.size(), kPointsPerTask, [&](std::size_t begin, std::size_t end) {
    if (stopped()) return;
    std::vector<Ray> rays(kShadowRays);
    std::vector<Vec3> arriving(kShadowRays);
    std::vector<std::uint8_t> free(kShadowRays);
    std::uint64_t traced = 0;
    for (std::size_t i = begin; i < end; ++i) {
      const Vec3 position = points_.positions[i];
      const Vec2 shift = shiftOf(i);
      for (std::size_t l = 0; l < lights.size(); ++l) {
        const bool directional = lights[l].type == scene::LightType::Directional;
        const Vec3 toLight = directional ? -lights[l].direction : lights[l].position - position;
        const float distance = glm::length(toLight);
        if (!(distance > 0.0f)) continue;
        const Basis basis(toLight / distance);

        // Samples over the emitter's disk as the point sees it; a directional light's radius is
        // that at one metre. Whatever lies within the emitter's radius casts no shadow.
        const auto aim = [&](int k, const Vec2& disk) {
          const Vec3 aside = radii[l] * (basis.x * disk.x + basis.y * disk.y);
          frame::WorldLight sample = lights[l];
          if (directional) {
            const Vec3 d = glm::normalize(toLight + aside);
            sample.direction = -d;
            rays[k] = {position, d, 0.0f, farAway};
          } else {
            sample.position += aside;
            const Vec3 to = sample.position - position;
            const float depth = radii[l] * std::sqrt(std::max(0.0f, 1.0f - glm::dot(disk, disk)));
            const float length = glm::length(to);
            rays[k] = {position, to, 0.0f,
                       length > 0.0f ? std::max(0.0f, 1.0f - depth / length) : 0.0f};
          }
          arriving[k] = frame::lightIrradiance(sample, position, points_.normals[i]);
        };
        const auto countFree = [&](int count) {
          refused_ +=
              trace_.visibleSerial(std::span(rays).first(count), std::span(free).first(count), true)
                  .refused;
          traced += static_cast<std::uint64_t>(count);
          return std::count(free.begin(), free.begin() + count, 1);
        };
        if (!(radii[l] > 0.0f)) {
          aim(0, Vec2(0.0f));
          if (glm::any(glm::greaterThan(arriving[0], Vec3(0.0f))) && countFree(1) == 1) {
            values[i] += arriving[0];
          }
          continue;
        }
        // Where the emitter's whole rim is seen, or none of it, there is no penumbra.
        for (int k = 0; k < kRimRays; ++k) {
          const float angle = 2.0f * kPi * (static_cast<float>(k) + shift.x) / kRimRays;
          aim(k, {std::cos(angle), std::sin(angle)});
        }
        const auto rim = countFree(kRimRays);
        if (rim == 0) continue;
        for (int k = 0; k < kShadowRays; ++k) aim(k, concentricDisk(shifted(lattice[k], shift)));
        if (rim < kRimRays) {
          countFree(kShadowRays);
        } else {
          std::fill(free.begin(), free.end(), std::uint8_t{1});
        }
        Vec3 sum(0.0f);
        for (int k = 0; k < kShadowRays; ++k) {
          if (free[k] != 0) sum += arriving[k];
        }
        values[i] += sum / static_cast<float>(kShadowRays);
      }
    }
    rays_ += traced;
  });
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
        const float s = material.specularLevel;
        const Vec3 reflected = (1.0f - s) * albedo + s * material.reflectionTint;
        leaving[v] = reflected * (1.0f / kPi) * irradiance[points_.pointOfVertex[v]];
      }
    });
  }
  return leaving;
}

Vec3 Baker::emitterLight(const Emitters& emitters, std::size_t point, const Vec2& shift,
                         int gatherRays, std::vector<Ray>& rays, std::vector<std::uint8_t>& free) {
  const Vec3 position = points_.positions[point];
  const Vec3 normal = points_.normals[point];
  std::array<Vec3, kEmitterRays> arriving;
  int used = 0;
  for (int k = 0; k < kEmitterRays; ++k) {
    // A triangle by its power, a point on it by two further dimensions of the shift.
    const float choice = fraction((k + static_cast<double>(shift.x)) / kEmitterRays);
    const auto place =
        std::upper_bound(emitters.cumulative.begin(), emitters.cumulative.end(), choice);
    const std::size_t index =
        std::min<std::size_t>(static_cast<std::size_t>(place - emitters.cumulative.begin()),
                              emitters.triangles.size() - 1);
    const Emitters::Triangle& t = emitters.triangles[index];
    const float a = std::sqrt(fraction(shift.y + k * kR2x));
    const float b = fraction(shift.x * 7.0 + k * kR2y);
    const Vec3 target =
        t.corners[0] * (1.0f - a) + t.corners[1] * (a * (1.0f - b)) + t.corners[2] * (a * b);
    const Vec3 to = target - position;
    const float squared = glm::dot(to, to);
    if (!(squared > 0.0f)) continue;
    const Vec3 direction = to / std::sqrt(squared);
    const float here = glm::dot(normal, direction);
    const float there = -glm::dot(t.normal, direction);
    const float density = emitters.density(t);
    if (!(here > 0.0f) || !(there > 0.0f) || !(density > 0.0f)) continue;
    // Balance heuristic with the gather's cosine-distributed rays [Veach1995].
    const float perSolidAngle = density * squared / there;
    const float weight =
        kEmitterRays * perSolidAngle /
        (kEmitterRays * perSolidAngle + static_cast<float>(gatherRays) * here / kPi);
    arriving[used] = t.radiance * (weight * here / (perSolidAngle * kEmitterRays));
    rays[used] = {position, to, 0.0f, 0.999f};
    ++used;
  }
  refused_ +=
      trace_.visibleSerial(std::span(rays).first(used), std::span(free).first(used), true).refused;
  Vec3 sum(0.0f);
  for (int k = 0; k < used; ++k) {
    if (free[k] != 0) sum += arriving[k];
  }
  return sum;
}

std::vector<Vec4> Baker::gather(const std::vector<Vec3>& leaving, int count) {
  const std::vector<Vec2> lattice = latticePoints(count);
  std::vector<Vec4> values(points_.size());
  std::vector<std::uint8_t> valid(points_.size(), 1);
  std::vector<float> noise(points_.size(), 0.0f);
  const bool emits = !emitters_.triangles.empty() && emitters_.total > 0.0;
  parallelFor(points_.size(), kPointsPerTask, [&](std::size_t begin, std::size_t end) {
    if (stopped()) return;
    std::vector<Ray> rays(std::max<std::size_t>(lattice.size(), kEmitterRays));
    std::vector<Hit> hits(lattice.size());
    std::vector<std::uint8_t> free(kEmitterRays);
    for (std::size_t i = begin; i < end; ++i) {
      const Basis basis(points_.normals[i]);
      const Vec2 shift = shiftOf(i);
      for (std::size_t k = 0; k < lattice.size(); ++k) {
        rays[k] = {points_.positions[i], basis.cosineDirection(shifted(lattice[k], shift))};
      }
      refused_ += trace_.intersectSerial(std::span(rays).first(lattice.size()), hits, true).refused;
      std::array<Vec3, kGroups> parts{};
      int back = 0;
      int open = 0;
      for (std::size_t k = 0; k < lattice.size(); ++k) {
        const Hit& hit = hits[k];
        Vec3& sum = parts[k % kGroups];
        if (hit.distance > occlusionDistance_) ++open;
        if (hit.miss()) {
          sum += environment_.radiance(rays[k].direction);
          continue;
        }
        Vec3 normal;
        if (!facesRay(hit, rays[k].direction, normal)) {
          ++back;
          continue;
        }
        const std::uint32_t* t =
            &geometry_.indices[geometry_.objects[hit.object].firstIndex + 3 * hit.primitive];
        sum +=
            (1.0f - hit.u - hit.v) * leaving[t[0]] + hit.u * leaving[t[1]] + hit.v * leaving[t[2]];
        if (emits && emitters_.firstOfObject[hit.object] >= 0) {
          const Emitters::Triangle& emitter =
              emitters_.triangles[static_cast<std::size_t>(emitters_.firstOfObject[hit.object]) +
                                  hit.primitive];
          const float there = -glm::dot(emitter.normal, rays[k].direction);
          const float here = glm::dot(points_.normals[i], rays[k].direction);
          if (there > 0.0f) {
            const float own = static_cast<float>(count) * here / kPi;
            const float other =
                kEmitterRays * emitters_.density(emitter) * hit.distance * hit.distance / there;
            if (own > 0.0f) sum += emitter.radiance * (own / (own + other));
          }
        }
      }
      if (static_cast<float>(back) >= kEnclosedShare * static_cast<float>(count)) valid[i] = 0;
      Vec3 sum(0.0f);
      std::array<float, kGroups> groups{};
      for (int k = 0; k < kGroups; ++k) {
        sum += parts[k];
        groups[k] = (parts[k].x + parts[k].y + parts[k].z) / 3.0f;
      }
      const float scale = kPi / static_cast<float>(count);
      noise[i] = standardError(groups, scale);
      Vec3 irradiance = sum * scale;
      if (emits) irradiance += emitterLight(emitters_, i, shift, count, rays, free);
      values[i] = Vec4(irradiance, static_cast<float>(open) / static_cast<float>(count));
    }
    rays_ += (end - begin) * (lattice.size() + (emits ? kEmitterRays : 0));
  });
  if (!stopped()) fillAndSmooth(valid, noise, values);
  return values;
}

std::vector<Vec4> Baker::full() {
  emitters_ = findEmitters(scene_, geometry_);
  const std::vector<Vec3> direct = directLight();

  // Each gather sees all light that the one before has found; the last one is the finest.
  std::vector<Vec3> irradiance = direct;
  std::vector<Vec4> values(points_.size(), Vec4(0.0f));
  const int gathers = std::max(1, scene_.bake.bounces);
  for (int g = 0; g < gathers; ++g) {
    const bool last = g + 1 == gathers;
    const int rays = last ? scene_.bake.rays : std::max(16, scene_.bake.rays / kEarlierRaysDivisor);
    const std::vector<Vec3> leaving = scene_.bake.bounces > 0
                                          ? radiosity(irradiance)
                                          : std::vector<Vec3>(geometry_.vertexCount(), Vec3(0.0f));
    const std::vector<Vec4> indirect = gather(leaving, rays);
    if (stopped()) return values;
    for (std::size_t i = 0; i < points_.size(); ++i) {
      values[i] = Vec4(direct[i] + Vec3(indirect[i]) + kPi * scene_.ambient * indirect[i].w, 0.0f);
    }
    // Lights do not reach into walls either: what lies there takes its neighbours' light.
    fillInvalid(points_, valid_, values);
    for (std::size_t i = 0; i < points_.size(); ++i) irradiance[i] = Vec3(values[i]);
  }
  return values;
}

// ---- Cache: header, then one Vec4 per vertex ----

struct CacheHeader {
  std::array<char, 8> magic{'c', 'a', 't', 'b', 'a', 'k', 'e', '1'};
  std::uint64_t key = 0;
  std::uint64_t vertices = 0;
  std::uint64_t checksum = 0;
};

std::uint64_t cacheKey(const scene::Scene& scene, const frame::Geometry& geometry) {
  Fingerprint f;
  f.addValue(kCacheVersion);
  f.addValue(scene.fingerprint);
  f.addValue(static_cast<int>(scene.bake.mode));
  f.addValue(scene.bake.rays);
  f.addValue(scene.bake.bounces);
  f.addValue(scene.bake.ambientOcclusionDistance);
  f.addArray(std::span(geometry.positions));
  f.addArray(std::span(geometry.indices));
  return f.value();
}

std::uint64_t checksumOf(std::span<const Vec4> values) {
  Fingerprint f;
  f.addArray(values);
  return f.value();
}

bool readCache(const std::filesystem::path& file, std::uint64_t key, frame::Geometry& geometry) {
  std::error_code ignored;
  const std::size_t count = geometry.vertexCount();
  const std::size_t wanted = sizeof(CacheHeader) + count * sizeof(Vec4);
  const std::uintmax_t size = std::filesystem::file_size(file, ignored);
  if (ignored) return false;
  const auto damaged = [&] {
    log::warning(file.string() + " is damaged: the light is baked anew");
    return false;
  };
  if (size != wanted) return damaged();
  std::vector<std::byte> bytes;
  try {
    bytes = readFile(file, wanted);
  } catch (const Error& error) {
    log::warning(std::string("the bake's cache is not used: ") + error.what());
    return false;
  }
  CacheHeader header;
  if (bytes.size() != wanted) return damaged();
  std::memcpy(&header, bytes.data(), sizeof(header));
  std::vector<Vec4> values(count);
  std::memcpy(values.data(), bytes.data() + sizeof(header), count * sizeof(Vec4));
  if (header.magic != CacheHeader{}.magic || header.key != key || header.vertices != count ||
      header.checksum != checksumOf(values)) {
    return damaged();
  }
  for (std::size_t v = 0; v < count; ++v) geometry.attributes[v].bake = values[v];
  return true;
}

void writeCache(const std::filesystem::path& file, std::uint64_t key,
                const frame::Geometry& geometry) {
  std::vector<Vec4> values;
  values.reserve(geometry.vertexCount());
  for (const frame::VertexAttributes& vertex : geometry.attributes) values.push_back(vertex.bake);
  CacheHeader header;
  header.key = key;
  header.vertices = values.size();
  header.checksum = checksumOf(values);
  std::vector<std::byte> bytes(sizeof(header) + values.size() * sizeof(Vec4));
  std::memcpy(bytes.data(), &header, sizeof(header));
  std::memcpy(bytes.data() + sizeof(header), values.data(), values.size() * sizeof(Vec4));
  try {
    std::filesystem::create_directories(file.parent_path());
    writeFileAtomically(file, bytes);
  } catch (const std::exception& error) {
    log::warning(std::string("the baked light is not cached: ") + error.what());
  }
}

}  // namespace

BakeReport bakeVertices(const scene::Scene& scene, frame::Geometry& geometry,
                        const frame::EnvironmentLight& environment,
                        const std::filesystem::path& cache,
                        const std::function<bool()>& stopRequested) {
  BakeReport report;
  if (scene.bake.mode == scene::BakeMode::None || geometry.vertexCount() == 0) return report;
  const std::int64_t start = nowNs();
  const std::uint64_t key = cacheKey(scene, geometry);
  std::filesystem::path file;
  if (!cache.empty()) {
    Fingerprint name;
    name.addValue(key);
    file = cache / ("bake-" + name.text() + ".bin");
    report.fromCache = readCache(file, key, geometry);
  }
  if (!report.fromCache) {
    Baker baker(scene, geometry, environment, stopRequested);
    const std::vector<Vec4> values = scene.bake.mode == scene::BakeMode::AmbientOcclusion
                                         ? baker.ambientOcclusion()
                                         : baker.full();
    if (baker.stopped()) {
      report.stopped = true;
      return report;
    }
    for (std::size_t v = 0; v < geometry.vertexCount(); ++v) {
      geometry.attributes[v].bake = values[baker.points().pointOfVertex[v]];
    }
    report.rays = baker.rays();
    report.points = baker.points().size();
    report.enclosed = baker.enclosed();
    report.refused = baker.refused();
    if (report.refused > 0)
      log::warning("baked light: " + std::to_string(report.refused) + " of " +
                   std::to_string(report.rays) + " rays could not be traced");
    if (!file.empty()) writeCache(file, key, geometry);
  }
  report.seconds = static_cast<double>(nowNs() - start) * 1e-9;
  return report;
}

}  // namespace catoptric::trace
