// A cache of files for values that are expensive to compute and can be recomputed at any time. A
// key of the inputs identifies a file. Damaged files are refused. One process computes a value
// while the others wait for it.
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

/// The names that a kind of cached value has in files and messages.
struct CacheKind {
  const char* prefix;          ///< prefix of the file names, e.g. "bake"
  std::array<char, 8> magic;   ///< first bytes of each file
  const char* whenDamaged;     ///< message, e.g. "the light is baked anew"
  const char* whenUnreadable;  ///< message, e.g. "the bake's cache is not used"
  const char* whenUnwritable;  ///< message, e.g. "the baked light is not cached"
};

/// One value of a cache. A file consists of a header (magic, key, number of elements, checksum of
/// the contents) and the contents.
///
/// If read() or readAll() returns nothing, the caller must compute the value and write() it. Until
/// the caller has done so, or this object is destroyed, other processes that use the folder wait in
/// their read(). If the folder allows no lock, each process computes the value for itself.
class CacheEntry {
 public:
  /// The value lies in `folder`; an empty folder means that nothing is cached. `stopRequested` ends
  /// a wait, and read() then returns nothing.
  CacheEntry(const CacheKind& kind, const std::filesystem::path& folder, std::uint64_t key,
             std::function<bool()> stopRequested = {});

  /// The contents if the file exists and is intact: `count` elements of `elementBytes` bytes. Logs
  /// a warning if the file is damaged or unreadable.
  std::optional<std::vector<std::byte>> read(std::size_t count, std::size_t elementBytes) const;
  /// As read(), for as many elements as the file has.
  std::optional<std::vector<std::byte>> readAll(std::size_t elementBytes) const;
  /// Writes the whole file or nothing. Logs a warning on failure.
  void write(std::span<const std::byte> contents, std::size_t count) const;
  const std::filesystem::path& path() const { return file_; }

 private:
  using Contents = std::optional<std::vector<std::byte>>;
  /// Tells whether a file exists, and whether it has changed.
  struct Identity {
    bool there = false;
    std::uintmax_t bytes = 0;
    std::filesystem::file_time_type written;
    bool operator==(const Identity&) const = default;
  };
  /// Without a count: reads as many elements as the file has. Logs faults if `warns` is set.
  Contents readNow(std::optional<std::size_t> count, std::size_t elementBytes, bool warns) const;
  Contents readOrClaim(std::optional<std::size_t> count, std::size_t elementBytes) const;
  Identity identity() const;

  const CacheKind& kind_;
  std::filesystem::path file_;
  std::uint64_t key_;
  std::function<bool()> stopRequested_;
  std::unique_ptr<FileClaim> claim_;  ///< null if nothing is cached
};

}  // namespace catoptric
