// Files of what is expensive to make and can be made again at any time: found by a key of what it
// was made from, refused when damaged.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace catoptric {

/// What a kind of cached value is called in files and in messages.
struct CacheKind {
  const char* prefix;          ///< of the files' names, "bake"
  std::array<char, 8> magic;   ///< the files begin with it
  const char* whenDamaged;     ///< "the light is baked anew"
  const char* whenUnreadable;  ///< "the bake's cache is not used"
  const char* whenUnwritable;  ///< "the baked light is not cached"
};

/// One value of a cache. A file is a header (magic, key, count of elements, checksum of the
/// contents) and the contents.
class CacheEntry {
 public:
  /// In `folder`; empty: nothing is cached.
  CacheEntry(const CacheKind& kind, const std::filesystem::path& folder, std::uint64_t key);

  /// The contents, if the file is there and whole: `count` elements of `elementBytes`. A damaged or
  /// unreadable file is warned of.
  std::optional<std::vector<std::byte>> read(std::size_t count, std::size_t elementBytes) const;
  /// The same of as many elements as the file has.
  std::optional<std::vector<std::byte>> readAll(std::size_t elementBytes) const;
  /// Writes the file whole or not at all; what cannot be written is warned of.
  void write(std::span<const std::byte> contents, std::size_t count) const;

 private:
  /// Of the contents; none without a file.
  std::optional<std::size_t> contentBytes() const;
  std::nullopt_t damaged() const;

  const CacheKind& kind_;
  std::filesystem::path file_;
  std::uint64_t key_;
};

}  // namespace catoptric
