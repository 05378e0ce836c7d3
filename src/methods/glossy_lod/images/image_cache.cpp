#include "methods/glossy_lod/images/image_cache.h"

#include <array>
#include <cstring>
#include <optional>
#include <span>
#include <vector>

#include "core/disk_cache.h"
#include "core/hash.h"

namespace catoptric::methods::glossy_lod {
namespace {

constexpr std::uint32_t kVersion = 11;  ///< raise it when results change
/// Triangles of a mesh from which on a file is faster than making its image again. Ours.
constexpr std::size_t kLeastTriangles = 2000;

constexpr std::size_t kValueBytes = sizeof(std::uint32_t);

constexpr CacheKind kKind{"geometry-image",
                          {'c', 'a', 't', 'g', 'e', 'o', 'm', '2'},
                          "the geometry image is made again",
                          "the cache of geometry images is not used",
                          "the geometry image is not cached"};

/// What an image has beside its arrays, and how long these are: before them in the file.
struct Head {
  std::array<std::uint64_t, 4> lengths{};  ///< samples, grid, texels, charts
  std::array<std::uint64_t, 3> counts{};
  std::array<double, 2> stretch{};
};

/// Members of an array, each on its own, so that no padding is written.
template <class Visit>
void eachValue(ObjectImage& image, Visit&& visit) {
  for (Sample& s : image.samples) {
    for (std::uint32_t& v : s.vertex) visit(v);
    visit(s.w1);
    visit(s.w2);
  }
  for (std::uint32_t& g : image.grid) visit(g);
  for (TrianglePlace& p : image.texels) {
    visit(p.triangle);
    visit(p.b1);
    visit(p.b2);
  }
  for (ChartImage& c : image.charts) {
    std::uint32_t packed = static_cast<std::uint32_t>(c.level) |
                           static_cast<std::uint32_t>(c.texelLevel) << 8 | (c.plain ? 1u << 16 : 0);
    visit(packed);
    visit(c.firstGrid);
    visit(c.firstTexel);
    c.level = static_cast<int>(packed & 0xFF);
    c.texelLevel = static_cast<int>(packed >> 8 & 0xFF);
    c.plain = packed >> 16 != 0;
  }
}

/// Of 4 bytes, as all that follow the head.
std::size_t valuesOf(const Head& head) {
  return 5 * head.lengths[0] + head.lengths[1] + 3 * head.lengths[2] + 3 * head.lengths[3];
}

std::uint64_t keyOf(const MeshView& mesh, const ImageSize& size) {
  Fingerprint f;
  f.addValue(kVersion);
  f.addArray(mesh.positions);
  f.addArray(mesh.normals);
  f.addArray(std::span<const std::uint32_t>(mesh.indices));
  f.addValue(size.quads);
  f.addValue(size.texels);
  f.addValue(size.most);
  return f.value();
}

std::optional<ObjectImage> read(const CacheEntry& entry) {
  const auto bytes = entry.readAll(kValueBytes);
  Head head;
  if (!bytes || bytes->size() < sizeof(head)) return std::nullopt;
  std::memcpy(&head, bytes->data(), sizeof(head));
  if (bytes->size() != sizeof(head) + kValueBytes * valuesOf(head)) return std::nullopt;
  ObjectImage image;
  image.samples.resize(head.lengths[0]);
  image.grid.resize(head.lengths[1]);
  image.texels.resize(head.lengths[2]);
  image.charts.resize(head.lengths[3]);
  image.plainTriangles = head.counts[0];
  image.degenerateTriangles = head.counts[1];
  image.notFlattened = head.counts[2];
  image.meanStretch = head.stretch[0];
  image.mostStretch = head.stretch[1];
  const std::byte* at = bytes->data() + sizeof(head);
  eachValue(image, [&](auto& value) {
    std::memcpy(&value, at, sizeof(value));
    at += sizeof(value);
  });
  return image;
}

void write(ObjectImage& image, const CacheEntry& entry) {
  Head head;
  head.lengths = {image.samples.size(), image.grid.size(), image.texels.size(),
                  image.charts.size()};
  head.counts = {image.plainTriangles, image.degenerateTriangles, image.notFlattened};
  head.stretch = {image.meanStretch, image.mostStretch};
  const auto headBytes = std::as_bytes(std::span(&head, 1));
  std::vector<std::byte> bytes;
  bytes.reserve(sizeof(head) + kValueBytes * valuesOf(head));
  bytes.assign(headBytes.begin(), headBytes.end());
  eachValue(image, [&](auto& value) {
    const auto* from = reinterpret_cast<const std::byte*>(&value);
    bytes.insert(bytes.end(), from, from + sizeof(value));
  });
  entry.write(bytes, bytes.size() / kValueBytes);
}

}  // namespace

ObjectImage cachedObjectImage(const MeshView& mesh, const ImageSize& size,
                              const std::filesystem::path& folder) {
  if (folder.empty() || mesh.triangles() < kLeastTriangles) return makeObjectImage(mesh, size);
  const std::uint64_t key = keyOf(mesh, size);
  const CacheEntry entry(kKind, folder, key);
  if (std::optional<ObjectImage> known = read(entry)) return std::move(*known);
  ObjectImage image = makeObjectImage(mesh, size);
  write(image, entry);
  return image;
}

}  // namespace catoptric::methods::glossy_lod
