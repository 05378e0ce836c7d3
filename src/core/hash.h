// Fingerprints of contents, which caches and `--existing resume` compare.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace catoptric {

/// A 64-bit fingerprint of a sequence of pieces. Not cryptographic.
class Fingerprint {
 public:
  void add(std::span<const std::byte> bytes);
  void add(
      std::string_view text) {  // with its length first, so that "ab","c" differs from "a","bc"
    addValue(text.size());
    add(std::as_bytes(std::span(text.data(), text.size())));
  }
  template <class T>
  void addValue(const T& value) {
    static_assert(std::is_trivially_copyable_v<T>);
    add(std::as_bytes(std::span(&value, 1)));
  }
  template <class T>
  void addArray(std::span<const T> values) {
    static_assert(std::is_trivially_copyable_v<T>);
    addValue(values.size());
    add(std::as_bytes(values));
  }
  std::uint64_t value() const;
  /// The value as 16 hexadecimal digits.
  std::string text() const;

 private:
  std::uint64_t state_ = 0x9E3779B97F4A7C15ull;
};

}  // namespace catoptric
