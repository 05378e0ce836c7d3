// Welds vertices: vertices with equal values get the same number.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/math.h"

namespace catoptric {

/// Numbers vertices in order of appearance; equal ones get the same number. The memory is kept from
/// one call of weld() to the next.
class Welding {
 public:
  std::vector<std::uint32_t> numbers;  ///< indexed by vertex
  std::vector<std::uint32_t> firsts;   ///< indexed by number: the first vertex that has it

  /// Numbers the vertices 0 .. count - 1. Two are equal if their `valuesOf(vertex)` are (arrays of
  /// Vec3); -0 equals 0.
  template <class ValuesOf>
  void weld(std::size_t count, const ValuesOf& valuesOf) {
    constexpr std::uint32_t kFree = ~0u;
    numbers.resize(count);
    firsts.clear();
    slots_.assign(std::bit_ceil(2 * count + 1), kFree);
    for (std::size_t v = 0; v < count; ++v) {
      const auto key = keyOf(valuesOf(v));
      std::uint64_t hash = 0;
      for (const std::uint32_t bits : key) hash = hash * 0x9E3779B97F4A7C15u + bits;
      std::size_t slot = (hash * 0x9E3779B97F4A7C15u) >> 32 & (slots_.size() - 1);
      while (slots_[slot] != kFree && keyOf(valuesOf(firsts[slots_[slot]])) != key)
        slot = (slot + 1) & (slots_.size() - 1);
      if (slots_[slot] == kFree) {
        slots_[slot] = static_cast<std::uint32_t>(firsts.size());
        firsts.push_back(static_cast<std::uint32_t>(v));
      }
      numbers[v] = slots_[slot];
    }
  }

 private:
  template <std::size_t N>
  static std::array<std::uint32_t, 3 * N> keyOf(std::array<Vec3, N> values) {
    for (Vec3& value : values) value += 0.0f;  // -0 becomes 0
    return std::bit_cast<std::array<std::uint32_t, 3 * N>>(values);
  }

  std::vector<std::uint32_t> slots_;
};

}  // namespace catoptric
