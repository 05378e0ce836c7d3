#include "core/disk_cache.h"

#include <cstring>
#include <exception>

#include "core/error.h"
#include "core/file.h"
#include "core/hash.h"
#include "core/log.h"

namespace catoptric {
namespace {

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
                       std::uint64_t key)
    : kind_(kind),
      file_(folder.empty() ? std::filesystem::path() : folder / fileName(kind, key)),
      key_(key) {}

std::optional<std::size_t> CacheEntry::contentBytes() const {
  if (file_.empty()) return std::nullopt;
  std::error_code failed;
  const std::uintmax_t size = std::filesystem::file_size(file_, failed);
  if (failed) return std::nullopt;
  return size < sizeof(Header) ? 0 : static_cast<std::size_t>(size) - sizeof(Header);
}

std::nullopt_t CacheEntry::damaged() const {
  log::warning(file_.string() + " is damaged: " + kind_.whenDamaged);
  return std::nullopt;
}

std::optional<std::vector<std::byte>> CacheEntry::readAll(std::size_t elementBytes) const {
  const std::optional<std::size_t> size = contentBytes();
  return size ? read(*size / elementBytes, elementBytes) : std::nullopt;
}

std::optional<std::vector<std::byte>> CacheEntry::read(std::size_t count,
                                                       std::size_t elementBytes) const {
  const std::optional<std::size_t> size = contentBytes();
  if (!size) return std::nullopt;
  if (*size != count * elementBytes) return damaged();
  const std::size_t wanted = sizeof(Header) + *size;
  std::vector<std::byte> bytes;
  try {
    bytes = readFile(file_, wanted);
  } catch (const Error& error) {
    log::warning(std::string(kind_.whenUnreadable) + ": " + error.what());
    return std::nullopt;
  }
  if (bytes.size() != wanted) return damaged();
  Header header;
  std::memcpy(&header, bytes.data(), sizeof(header));
  bytes.erase(bytes.begin(), bytes.begin() + sizeof(header));
  if (header.magic != kind_.magic || header.key != key_ || header.count != count ||
      header.checksum != checksumOf(bytes, count))
    return damaged();
  return bytes;
}

void CacheEntry::write(std::span<const std::byte> contents, std::size_t count) const {
  if (file_.empty()) return;
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
}

}  // namespace catoptric
