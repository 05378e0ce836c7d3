#include "trace/bake/bake.h"

#include <cstring>
#include <span>
#include <string>
#include <vector>

#include "core/clock.h"
#include "core/disk_cache.h"
#include "core/hash.h"
#include "core/log.h"
#include "trace/bake/baker.h"

namespace catoptric::trace {
namespace {

constexpr std::uint32_t kCacheVersion = 9;  ///< raise it when results change
constexpr CacheKind kCache{"bake",
                           {'c', 'a', 't', 'b', 'a', 'k', 'e', '1'},
                           "the light is baked again",
                           "the cache of baked light is not used",
                           "the baked light is not cached"};

/// Embree's instruction sets differ in the last bits: one of them, which every machine has, bakes
/// the same light everywhere. The environment variable is for tests of what others would bake.
std::string bakeIsa() {
  const std::string forced = forcedEmbreeIsa("CATOPTRIC_BAKE_ISA");
  return forced.empty() ? "sse4.2" : forced;
}

std::uint64_t cacheKey(const scene::Scene& scene, const frame::Geometry& geometry,
                       const std::string& isa) {
  Fingerprint f;
  f.addValue(kCacheVersion);
  f.add(isa);
  f.addValue(scene.fingerprint);
  f.addValue(static_cast<int>(scene.bake.mode));
  f.addValue(scene.bake.rays);
  f.addValue(scene.bake.bounces);
  f.addValue(scene.bake.ambientOcclusionDistance);
  if (scene.bake.skyApart) f.addValue(scene.bake.skyApart);
  f.addArray(std::span(geometry.positions));
  f.addArray(std::span(geometry.indices));
  return f.value();
}

}  // namespace

BakeReport bakeVertices(const scene::Scene& scene, frame::Geometry& geometry,
                        const frame::EnvironmentLight& environment,
                        const std::filesystem::path& cache, const BakeCallbacks& callbacks) {
  BakeReport report;
  if (scene.bake.mode == scene::BakeMode::None || geometry.vertexCount() == 0) return report;
  const std::int64_t start = nowNs();
  const std::string isa = bakeIsa();
  const CacheEntry entry(kCache, cache, cacheKey(scene, geometry, isa), callbacks.stopRequested);
  if (const auto cached = entry.read(geometry.vertexCount(), sizeof(Vec4))) {
    for (std::size_t v = 0; v < geometry.vertexCount(); ++v)
      std::memcpy(&geometry.attributes[v].bake, cached->data() + v * sizeof(Vec4), sizeof(Vec4));
    report.fromCache = true;
  }
  if (!report.fromCache) {
    Baker baker(scene, geometry, environment, isa, callbacks);
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
                   std::to_string(report.rays) +
                   " rays were not finite or beyond 1e18 m, and count as misses");
    std::vector<Vec4> light;
    light.reserve(geometry.vertexCount());
    for (const frame::VertexAttributes& vertex : geometry.attributes) light.push_back(vertex.bake);
    entry.write(std::as_bytes(std::span(light)), light.size());
  }
  report.seconds = secondsSince(start);
  return report;
}

}  // namespace catoptric::trace
