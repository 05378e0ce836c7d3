// Files of what is expensive to make and can be made again at any time: found by a key of what it
// was made from, refused when damaged, made by one process while the others wait for it.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/file_claim.h"

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
///
/// Where read() or readAll() give nothing the caller is to make the value and to write() it, and
/// until then, or until this object goes, other processes that see the folder wait for it in their
/// read(). Of a folder in which no lock can be had each process makes its own.
class CacheEntry {
 public:
  /// In `folder`; empty: nothing is cached. `stopRequested` ends a wait, with nothing read.
  CacheEntry(const CacheKind& kind, const std::filesystem::path& folder, std::uint64_t key,
             std::function<bool()> stopRequested = {});

  /// The contents, if the file is there and whole: `count` elements of `elementBytes`. A damaged or
  /// unreadable file is warned of.
  std::optional<std::vector<std::byte>> read(std::size_t count, std::size_t elementBytes) const;
  /// The same of as many elements as the file has.
  std::optional<std::vector<std::byte>> readAll(std::size_t elementBytes) const;
  /// Writes the file whole or not at all; what cannot be written is warned of.
  void write(std::span<const std::byte> contents, std::size_t count) const;
  const std::filesystem::path& path() const { return file_; }

 private:
  using Contents = std::optional<std::vector<std::byte>>;
  /// How a file is known again, and that it is there.
  struct Identity {
    bool there = false;
    std::uintmax_t bytes = 0;
    std::filesystem::file_time_type written;
    bool operator==(const Identity&) const = default;
  };
  /// No count: as many elements as the file has. Says what is wrong with it where `warns`.
  Contents readNow(std::optional<std::size_t> count, std::size_t elementBytes, bool warns) const;
  Contents readOrClaim(std::optional<std::size_t> count, std::size_t elementBytes) const;
  Identity identity() const;

  const CacheKind& kind_;
  std::filesystem::path file_;
  std::uint64_t key_;
  std::function<bool()> stopRequested_;
  std::unique_ptr<FileClaim> claim_;  ///< null without a file
};

}  // namespace catoptric
