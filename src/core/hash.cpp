#include "core/hash.h"

#include <fmt/core.h>

#include <cstring>

namespace catoptric {
namespace {

// The finalizer of MurmurHash3 (public domain): every input bit reaches every output bit.
std::uint64_t mix(std::uint64_t x) {
  x ^= x >> 33;
  x *= 0xFF51AFD7ED558CCDull;
  x ^= x >> 33;
  x *= 0xC4CEB9FE1A85EC53ull;
  x ^= x >> 33;
  return x;
}

}  // namespace

void Fingerprint::add(std::span<const std::byte> bytes) {
  std::size_t i = 0;
  for (; i + 8 <= bytes.size(); i += 8) {
    std::uint64_t word;
    std::memcpy(&word, bytes.data() + i, 8);
    state_ = mix(state_ ^ word) + 0x9E3779B97F4A7C15ull;
  }
  std::uint64_t tail = 0;
  const std::size_t rest = bytes.size() - i;
  if (rest > 0) std::memcpy(&tail, bytes.data() + i, rest);
  state_ = mix(state_ ^ tail ^ (static_cast<std::uint64_t>(rest) << 56));
}

std::uint64_t Fingerprint::value() const {
  return mix(state_);
}

std::string Fingerprint::text() const {
  return fmt::format("{:016x}", value());
}

}  // namespace catoptric
