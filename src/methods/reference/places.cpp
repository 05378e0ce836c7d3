#include "methods/reference/places.h"

#include <array>
#include <cstddef>

#include "core/random.h"
#include "core/vector_versions.h"
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

CATOPTRIC_INLINE std::uint32_t reversedBits(std::uint32_t v) {
  v = (v >> 1 & 0x55555555u) | (v & 0x55555555u) << 1;
  v = (v >> 2 & 0x33333333u) | (v & 0x33333333u) << 2;
  v = (v >> 4 & 0x0F0F0F0Fu) | (v & 0x0F0F0F0Fu) << 4;
  v = (v >> 8 & 0x00FF00FFu) | (v & 0x00FF00FFu) << 8;
  return v >> 16 | v << 16;
}

/// Scrambles by the hash of [Burley2020], with Vegdahl's constants: bits depend on lower ones
/// alone.
CATOPTRIC_INLINE void scrambleBody(const std::array<std::uint32_t, SobolSamples::kMost>& reversed,
                                   std::uint32_t noise,
                                   std::array<float, SobolSamples::kMost>& values) {
  CATOPTRIC_INDEPENDENT
  for (std::size_t k = 0; k < SobolSamples::kMost; ++k) {
    std::uint32_t v = reversed[k];
    v ^= v * 0x3D20ADEAu;
    v += noise;
    v *= noise >> 16 | 1u;
    v ^= v * 0x05526C56u;
    v ^= v * 0x53A22864u;
    values[k] =
        static_cast<float>(static_cast<std::int32_t>(reversedBits(v) >> 8)) * (1.0f / 16777216.0f);
  }
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

SobolSamples::SobolSamples(std::uint32_t first, std::size_t count) : first_(first), count_(count) {
  for (std::size_t d = 0; d < reversed_.size(); ++d)
    for (std::size_t k = 0; k < count; ++k)
      reversed_[d][k] = reversedBits(sobolBits(d, first + static_cast<std::uint32_t>(k)));
}

void SobolSamples::place(std::uint32_t noise, Place* places) const {
  std::array<std::array<float, kMost>, 4> values;
  for (std::size_t d = 0; d < values.size(); ++d) {
    noise = mixedBits(noise);
    atVectorLevel<scrambleBody>(reversed_[d], noise, values[d]);
  }
  for (std::size_t k = 0; k < count_; ++k) {
    const std::uint32_t own = mixedBits(noise ^ (first_ + static_cast<std::uint32_t>(k)));
    places[k] = {{values[0][k], values[1][k]},
                 {values[2][k], values[3][k]},
                 {unitFloat(own), unitFloat(mixedBits(own))}};
  }
}

}  // namespace catoptric::methods
