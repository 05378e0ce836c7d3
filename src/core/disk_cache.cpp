#include "core/disk_cache.h"

#include <algorithm>
#include <chrono>
#include <cstring>
#include <exception>
#include <thread>
#include <utility>

#include "core/clock.h"
#include "core/error.h"
#include "core/file.h"
#include "core/hash.h"
#include "core/log.h"

namespace catoptric {
namespace {

// Of a wait for another process, in seconds; ours.
constexpr double kFirstWord = 2.0;  ///< until the wait is spoken of
constexpr double kNextWord = 60.0;
constexpr double kShortestPause = 0.05;
constexpr double kLongestPause = 2.0;
constexpr double kPauseShare = 0.05;  ///< of the time waited

struct Header {
  std::array<char, 8> magic{};
  std::uint64_t key = 0;
  std::uint64_t count = 0;
  std::uint64_t checksum = 0;
};

std::uint64_t checksumOf(std::span<const std::byte> contents, std::uint64_t count) {
  Fingerprint f;
  f.addValue(count);
  f.add(contents);
  return f.value();
}

std::string fileName(const CacheKind& kind, std::uint64_t key) {
  Fingerprint name;
  name.addValue(key);
  return std::string(kind.prefix) + "-" + name.text() + ".bin";
}

}  // namespace

CacheEntry::CacheEntry(const CacheKind& kind, const std::filesystem::path& folder,
                       std::uint64_t key, std::function<bool()> stopRequested)
    : kind_(kind),
      file_(folder.empty() ? std::filesystem::path() : folder / fileName(kind, key)),
      key_(key),
      stopRequested_(std::move(stopRequested)),
      claim_(folder.empty() ? nullptr : std::make_unique<FileClaim>(file_)) {}

CacheEntry::Identity CacheEntry::identity() const {
  std::error_code failed;
  Identity found;
  found.bytes = std::filesystem::file_size(file_, failed);
  if (!failed) found.written = std::filesystem::last_write_time(file_, failed);
  return failed ? Identity{} : Identity{true, found.bytes, found.written};
}

CacheEntry::Contents CacheEntry::read(std::size_t count, std::size_t elementBytes) const {
  return readOrClaim(count, elementBytes);
}

CacheEntry::Contents CacheEntry::readAll(std::size_t elementBytes) const {
  return readOrClaim(std::nullopt, elementBytes);
}

CacheEntry::Contents CacheEntry::readNow(std::optional<std::size_t> count, std::size_t elementBytes,
                                         bool warns) const {
  const auto refuse = [&](const std::string& why) {
    if (warns) log::warning(why);
    return std::nullopt;
  };
  const std::string damaged = file_.string() + " is damaged: " + kind_.whenDamaged;
  const Identity found = identity();
  if (!found.there) return std::nullopt;
  Header header;
  const std::size_t size = found.bytes < sizeof(header) ? 0 : found.bytes - sizeof(header);
  if (!count) count = size / elementBytes;
  if (size != *count * elementBytes) return refuse(damaged);
  std::vector<std::byte> bytes;
  try {
    bytes = readFile(file_, sizeof(header) + size);
  } catch (const Error& error) {
    return refuse(std::string(kind_.whenUnreadable) + ": " + error.what());
  }
  if (bytes.size() != sizeof(header) + size) return refuse(damaged);
  std::memcpy(&header, bytes.data(), sizeof(header));
  bytes.erase(bytes.begin(), bytes.begin() + sizeof(header));
  if (header.magic != kind_.magic || header.key != key_ || header.count != *count ||
      header.checksum != checksumOf(bytes, *count))
    return refuse(damaged);
  return bytes;
}

CacheEntry::Contents CacheEntry::readOrClaim(std::optional<std::size_t> count,
                                             std::size_t elementBytes) const {
  if (!claim_) return std::nullopt;
  Identity known = identity();
  if (Contents contents = readNow(count, elementBytes, false)) return contents;
  const std::int64_t start = nowNs();
  double sayAfter = kFirstWord;
  for (;;) {
    if (claim_->take() != FileClaim::State::Taken) break;
    if (const Identity now = identity(); now != known) {
      known = now;
      if (Contents contents = readNow(count, elementBytes, false)) return contents;
    }
    if (stopRequested_ && stopRequested_()) return std::nullopt;
    const double waited = secondsSince(start);
    if (waited > sayAfter) {
      log::info(claim_->holder() + " is writing " + file_.string() +
                "; waiting for it. To stop waiting, delete " + claim_->lockFile().string());
      sayAfter = waited + kNextWord;
    }
    // Many that wait long ask seldom
    std::this_thread::sleep_for(std::chrono::duration<double>(
        std::clamp(waited * kPauseShare, kShortestPause, kLongestPause)));
  }
  // It may have been made between the look and the claim
  Contents contents = readNow(count, elementBytes, true);
  if (contents) claim_->release();
  return contents;
}

void CacheEntry::write(std::span<const std::byte> contents, std::size_t count) const {
  if (!claim_) return;
  if (claim_->lost() && identity().there) {
    log::warning(
        file_.string() +
        ": another process has written this file of the cache, too, because this one was " +
        "suspended for long; the two may use slightly different data");
    return;
  }
  const Header header{kind_.magic, key_, count, checksumOf(contents, count)};
  std::vector<std::byte> bytes(sizeof(header) + contents.size());
  std::memcpy(bytes.data(), &header, sizeof(header));
  std::memcpy(bytes.data() + sizeof(header), contents.data(), contents.size());
  try {
    std::filesystem::create_directories(file_.parent_path());
    writeFileAtomically(file_, bytes);
  } catch (const std::exception& error) {
    log::warning(std::string(kind_.whenUnwritable) + ": " + error.what());
  }
  claim_->release();
}

}  // namespace catoptric
