#include "raster/scene_gpu/level_cache.h"

#include <meshoptimizer.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <type_traits>
#include <utility>
#include <vector>

#include "core/disk_cache.h"
#include "core/hash.h"

namespace catoptric::raster {
namespace {

constexpr std::uint32_t kCacheVersion = 3;  ///< raise it when results change
constexpr CacheKind kCache{"levels",
                           {'c', 'a', 't', 'l', 'e', 'v', 'e', '1'},
                           "the levels of detail are made again",
                           "the cache of levels of detail is not used",
                           "the levels of detail are not cached"};
constexpr std::size_t kWord = sizeof(std::uint32_t);  ///< all that a file has are such

std::uint64_t keyOf(const frame::Geometry& geometry, std::span<const LevelSource> sources,
                    const frame::Lighting& lighting) {
  Fingerprint f;
  f.addValue(kCacheVersion);
  f.addValue(int{MESHOPTIMIZER_VERSION});
  f.addValue(lighting.ambient);
  if (lighting.environment) f.addArray(std::span<const Vec3>(lighting.environment->irradianceSh()));
  for (const frame::WorldLight& light : lighting.lights) {
    f.addValue(static_cast<int>(light.type));
    for (const Vec3& v : {light.position, light.direction, light.intensity}) f.addValue(v);
    f.addValue(std::array{light.range, light.cosInner, light.cosOuter});
  }
  f.addValue(geometry.bounds.diameter());
  f.addArray(std::span(geometry.positions));
  f.addArray(std::span(geometry.attributes));
  f.addArray(std::span(geometry.indices));
  for (const frame::ObjectRange& range : geometry.objects) {
    f.addValue(
        std::array{range.firstVertex, range.vertexCount, range.firstIndex, range.indexCount});
    f.addValue(range.uvPerMetre);
  }
  for (const LevelSource& source : sources) {
    f.addValue(std::array{source.whole, source.moving, source.textured});
    f.addValue(source.albedo);
  }
  return f.value();
}

/// Arrays one after the other, their lengths before them.
class Writer {
 public:
  template <class T>
  void add(const std::vector<T>& values) {
    static_assert(std::is_trivially_copyable_v<T> && sizeof(T) % kWord == 0 && alignof(T) == kWord);
    append(std::array{static_cast<std::uint32_t>(values.size())});
    append(values);
  }
  std::span<const std::byte> bytes() const { return bytes_; }

 private:
  template <class Values>
  void append(const Values& values) {
    const auto added = std::as_bytes(std::span(values));
    bytes_.insert(bytes_.end(), added.begin(), added.end());
  }
  std::vector<std::byte> bytes_;
};

class Reader {
 public:
  explicit Reader(std::span<const std::byte> bytes) : rest_(bytes) {}
  /// False where fewer bytes are left than the array should have.
  template <class T>
  bool take(std::vector<T>& values) {
    std::uint32_t count = 0;
    if (rest_.size() < kWord) return false;
    std::memcpy(&count, rest_.data(), kWord);
    rest_ = rest_.subspan(kWord);
    if (rest_.size() / sizeof(T) < count) return false;
    values.resize(count);
    if (count > 0) std::memcpy(values.data(), rest_.data(), count * sizeof(T));
    rest_ = rest_.subspan(count * sizeof(T));
    return true;
  }
  bool atEnd() const { return rest_.empty(); }

 private:
  std::span<const std::byte> rest_;
};

std::optional<DetailLevels> readLevels(const CacheEntry& entry) {
  const auto bytes = entry.readAll(kWord);
  if (!bytes) return std::nullopt;
  Reader reader(*bytes);
  DetailLevels levels;
  const bool whole = reader.take(levels.indices) && reader.take(levels.meshlets) &&
                     reader.take(levels.levels) && reader.take(levels.firstOfObject) &&
                     reader.take(levels.places) && reader.take(levels.attributes) && reader.atEnd();
  return whole ? std::optional(std::move(levels)) : std::nullopt;
}

}  // namespace

DetailLevels cachedDetailLevels(const frame::Geometry& geometry,
                                std::span<const LevelSource> sources,
                                const frame::Lighting& lighting,
                                const std::filesystem::path& cache) {
  if (cache.empty()) return buildDetailLevels(geometry, sources, lighting);
  const CacheEntry entry(kCache, cache, keyOf(geometry, sources, lighting));
  if (auto cached = readLevels(entry)) return std::move(*cached);
  DetailLevels levels = buildDetailLevels(geometry, sources, lighting);
  Writer writer;
  writer.add(levels.indices);
  writer.add(levels.meshlets);
  writer.add(levels.levels);
  writer.add(levels.firstOfObject);
  writer.add(levels.places);
  writer.add(levels.attributes);
  entry.write(writer.bytes(), writer.bytes().size() / kWord);
  return levels;
}

}  // namespace catoptric::raster
