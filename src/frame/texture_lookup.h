// Private to src/frame: reads textures, all four channels at once. The functions are compiled for
// the level of their caller (core/vector_versions.h) and give the same bits at each.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "core/lanes.h"
#include "core/math.h"
#include "core/srgb.h"
#include "scene/scene.h"

namespace catoptric::frame {

using Ints4 = Mask4;

/// `uv` brought near the base period, so that conversion to integers is defined for any uv.
CATOPTRIC_INLINE float reduced(float u, scene::Wrap wrap) {
  if (!std::isfinite(u)) return 0.0f;
  if (wrap == scene::Wrap::ClampToEdge) return std::clamp(u, -1.0f, 2.0f);
  return u - 2.0f * std::floor(0.5f * u);
}

/// The texel for place `i` of a row, which reduced() has brought into -size..2 size.
CATOPTRIC_INLINE int wrapped(int i, int size, scene::Wrap wrap) {
  if (wrap == scene::Wrap::ClampToEdge) return std::clamp(i, 0, size - 1);
  const bool mirrored = wrap == scene::Wrap::MirroredRepeat;
  if (i < 0) return mirrored ? -1 - i : i + size;
  if (i < size) return i;
  if (i == 2 * size) return 0;
  return mirrored ? 2 * size - 1 - i : i - size;
}

/// The four texels of a bilinear look-up in one level, and the place between them.
struct TexelPlaces {
  std::array<std::size_t, 4> at{};  ///< numbers in the level: two of a row, two of the next row
  float x = 0.0f;
  float y = 0.0f;
};

/// A look-up in a texture, whose texels are found before they are read.
struct TexturePlace {
  const scene::MipLevel* fine = nullptr;  ///< null: the texture has no levels
  const scene::MipLevel* coarse = nullptr;
  float fraction = 0.0f;  ///< of the coarse level; 0: it is not read
  TexelPlaces inFine, inCoarse;
};

/// `u` and `v`: reduced().
CATOPTRIC_INLINE TexelPlaces placeTexels(const scene::Texture& texture,
                                         const scene::MipLevel& level, float u, float v) {
  const int w = level.width;
  const int h = level.height;
  const Floats4 place =
      Floats4{u, v, u, v} * __builtin_convertvector((Ints4{w, h, w, h}), Floats4) - 0.5f;
  // std::floor()
  Ints4 whole = __builtin_convertvector(place, Ints4);
  whole += __builtin_convertvector(whole, Floats4) > place;
  const Floats4 within = place - __builtin_convertvector(whole, Floats4);
  whole += Ints4{0, 0, 1, 1};
  if (texture.wrapS == scene::Wrap::Repeat && texture.wrapT == scene::Wrap::Repeat) {
    const Ints4 size{w, h, w, h};
    whole += (whole < 0) & size;
    whole -= (whole >= size) & size;
    whole -= (whole >= size) & size;
  } else {
    whole = Ints4{wrapped(whole[0], w, texture.wrapS), wrapped(whole[1], h, texture.wrapT),
                  wrapped(whole[2], w, texture.wrapS), wrapped(whole[3], h, texture.wrapT)};
  }
  const auto width = static_cast<std::size_t>(w);
  const auto left = static_cast<std::size_t>(whole[0]);
  const auto right = static_cast<std::size_t>(whole[2]);
  const std::size_t upper = width * static_cast<std::size_t>(whole[1]);
  const std::size_t lower = width * static_cast<std::size_t>(whole[3]);
  return {{upper + left, upper + right, lower + left, lower + right}, within[0], within[1]};
}

CATOPTRIC_INLINE void placeLookUp(const scene::Texture& texture, const Vec2& uv, float lod,
                                  TexturePlace& place) {
  place.fraction = 0.0f;
  place.fine = texture.levels.empty() ? nullptr : &texture.levels[0];
  if (place.fine == nullptr) return;
  const float u = reduced(uv.x, texture.wrapS);
  const float v = reduced(uv.y, texture.wrapT);
  if (texture.nearest) {
    const scene::MipLevel& level = *place.fine;
    const auto column = static_cast<int>(std::floor(u * static_cast<float>(level.width)));
    const auto row = static_cast<int>(std::floor(v * static_cast<float>(level.height)));
    const std::size_t at = static_cast<std::size_t>(wrapped(row, level.height, texture.wrapT)) *
                               static_cast<std::size_t>(level.width) +
                           static_cast<std::size_t>(wrapped(column, level.width, texture.wrapS));
    place.inFine = {{at, at, at, at}, 0.0f, 0.0f};
    return;
  }
  const float last = static_cast<float>(texture.levels.size() - 1);
  const float clamped = lod > 0.0f ? std::min(lod, last) : 0.0f;
  const int below = static_cast<int>(clamped);
  place.fraction = clamped - static_cast<float>(below);
  place.fine += below;
  place.inFine = placeTexels(texture, *place.fine, u, v);
  if (!(place.fraction > 0.0f)) return;
  place.coarse = place.fine + 1;
  place.inCoarse = placeTexels(texture, *place.coarse, u, v);
}

/// Asks memory for the texels before they are read.
CATOPTRIC_INLINE void prefetch(const TexturePlace& place) {
  if (place.fine == nullptr) return;
  __builtin_prefetch(&place.fine->rgba[4 * place.inFine.at[0]]);
  __builtin_prefetch(&place.fine->rgba[4 * place.inFine.at[2]]);
  if (!(place.fraction > 0.0f)) return;
  __builtin_prefetch(&place.coarse->rgba[4 * place.inCoarse.at[0]]);
  __builtin_prefetch(&place.coarse->rgba[4 * place.inCoarse.at[2]]);
}

/// `linear`: linearOfSrgb8().
CATOPTRIC_INLINE Floats4 texel(const std::uint8_t* p, bool srgb, const float* linear) {
  constexpr float kStep = 1.0f / 255.0f;
  if (srgb)
    return Floats4{linear[p[0]], linear[p[1]], linear[p[2]], static_cast<float>(p[3]) * kStep};
  // Byte k times 2^(8 k), which its factor takes out again: exact
  using Bits = Lanes<std::uint32_t, 4>;
  const Bits all = Bits{} + load<std::uint32_t>(p);
  const Bits bytes = (all & Bits{0xFF, 0xFF00, 0xFF0000, 0}) | (all >> 24 & Bits{0, 0, 0, 0xFF});
  return __builtin_convertvector(std::bit_cast<Ints4>(bytes), Floats4) *
         Floats4{kStep, kStep * 0x1p-8f, kStep * 0x1p-16f, kStep};
}

/// glm::mix(a, b, f).
CATOPTRIC_INLINE Floats4 mixed(const Floats4& a, const Floats4& b, float f) {
  return a * (1.0f - f) + b * f;
}

CATOPTRIC_INLINE Floats4 bilinear(const scene::MipLevel& level, const TexelPlaces& places,
                                  bool srgb, const float* linear) {
  const std::uint8_t* const rgba = level.rgba.data();
  const Floats4 top = mixed(texel(rgba + 4 * places.at[0], srgb, linear),
                            texel(rgba + 4 * places.at[1], srgb, linear), places.x);
  const Floats4 bottom = mixed(texel(rgba + 4 * places.at[2], srgb, linear),
                               texel(rgba + 4 * places.at[3], srgb, linear), places.x);
  return mixed(top, bottom, places.y);
}

CATOPTRIC_INLINE Floats4 lookUp(const scene::Texture& texture, const TexturePlace& place,
                                const float* linear) {
  if (place.fine == nullptr) return floats4(1.0f);
  const Floats4 fine = bilinear(*place.fine, place.inFine, texture.srgb, linear);
  if (!(place.fraction > 0.0f)) return fine;
  return mixed(fine, bilinear(*place.coarse, place.inCoarse, texture.srgb, linear), place.fraction);
}

}  // namespace catoptric::frame
