#include "methods/reference/places.h"

#include <array>
#include <cstddef>

#include "core/random.h"
#include "frame/shading.h"

namespace catoptric::methods {
namespace {

using Directions = std::array<std::uint32_t, 32>;

/// Direction numbers of a dimension from its primitive polynomial, of this degree and with these
/// inner coefficients, and its first numbers [Joe2008].
constexpr Directions directionsOf(std::size_t degree, std::uint32_t inner,
                                  const std::array<std::uint32_t, 3>& first) {
  Directions v{};
  for (std::size_t k = 0; k < v.size(); ++k) {
    if (k < degree) {
      v[k] = first[k] << (31 - k);
      continue;
    }
    v[k] = v[k - degree] ^ (v[k - degree] >> degree);
    for (std::size_t j = 1; j < degree; ++j) v[k] ^= (inner >> (degree - 1 - j) & 1u) * v[k - j];
  }
  return v;
}

constexpr Directions vanDerCorput() {
  Directions v{};
  for (std::size_t k = 0; k < v.size(); ++k) v[k] = 0x80000000u >> k;
  return v;
}

constexpr std::array<Directions, 4> kDirections = {vanDerCorput(), directionsOf(1, 0, {1, 0, 0}),
                                                   directionsOf(2, 1, {1, 3, 0}),
                                                   directionsOf(3, 1, {1, 3, 1})};

std::uint32_t sobolBits(std::size_t dimension, std::uint32_t index) {
  std::uint32_t bits = 0;
  for (std::size_t k = 0; index != 0; ++k, index >>= 1)
    if ((index & 1u) != 0) bits ^= kDirections[dimension][k];
  return bits;
}

}  // namespace

std::uint32_t pixelNoise(int x, int y, std::uint64_t seed) {
  return mixedBits(
      static_cast<std::uint32_t>(x) ^
      mixedBits(static_cast<std::uint32_t>(y) ^ mixedBits(static_cast<std::uint32_t>(seed))));
}

Place gridPlace(int x, int y, int index, int samples, std::uint32_t noise) {
  const auto cell = static_cast<float>(index);
  const int row = index / samples;
  return {{(static_cast<float>(index % samples) + 0.5f) / static_cast<float>(samples),
           (static_cast<float>(row) + 0.5f) / static_cast<float>(samples)},
          {glm::fract((cell + 0.5f) / static_cast<float>(samples * samples) + unitFloat(noise)),
           glm::fract(cell * 0.6180340f + unitFloat(mixedBits(noise)))},
          frame::scatterPlace(x * samples + index % samples, y * samples + row)};
}

Place sequencePlace(std::uint32_t index, std::uint32_t noise) {
  std::array<float, 4> values{};
  for (std::size_t d = 0; d < values.size(); ++d) {
    noise = mixedBits(noise);
    values[d] = unitFloat(sobolBits(d, index) ^ noise);
  }
  const std::uint32_t own = mixedBits(noise ^ index);
  return {
      {values[0], values[1]}, {values[2], values[3]}, {unitFloat(own), unitFloat(mixedBits(own))}};
}

}  // namespace catoptric::methods
