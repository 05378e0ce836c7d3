// The canvas on which procedural textures are painted, and their parameters.
#pragma once

#include <string>
#include <vector>

#include "config/fields.h"
#include "scene/procedural/noise.h"
#include "scene/procedural/procedural.h"

namespace catoptric::scene::procedural {

namespace fields = config::fields;

/// Colours are mixed as sRGB-encoded values 0..1. The steps are then visually even, and no power is
/// computed per texel.
class Canvas {
 public:
  Canvas(const config::Value& settings, const config::Schema& schema);

  int size() const { return size_; }
  std::uint32_t seed() const { return seed_; }
  float number(const char* name) const;
  int integer(const char* name) const;
  std::string word(const char* name) const;
  glm::ivec2 pair(const char* name) const;  ///< two whole numbers, each at least 1
  /// Colour i of "colors" (encoded); `standard`, "#rrggbb", if there is none.
  Vec3 color(std::size_t i, const char* standard) const;
  std::size_t colorCount() const { return colors_.size(); }

  /// Calls texel(x, y, u, v, color, height) for every texel, in parallel. u and v are the
  /// coordinates of its centre. Heights are in units of the tile's width.
  template <class F>
  void paint(const F& texel) {
    forRows(size_, [&](int y) {
      const float v = (static_cast<float>(y) + 0.5f) / static_cast<float>(size_);
      for (int x = 0; x < size_; ++x) {
        const float u = (static_cast<float>(x) + 0.5f) / static_cast<float>(size_);
        Vec3 color(0.0f);
        float height = 0.0f;
        texel(x, y, u, v, color, height);
        const std::size_t at = static_cast<std::size_t>(y) * size_ + x;
        for (std::size_t c = 0; c < 3; ++c) {
          image.rgba[4 * at + c] = static_cast<std::uint8_t>(
              std::clamp(color[static_cast<int>(c)], 0.0f, 1.0f) * 255.0f + 0.5f);
        }
        image.rgba[4 * at + 3] = 255;
        image.height[at] = height;
      }
    });
  }

  ProceduralImage image;

 private:
  const config::Value& settings_;
  const config::Schema& schema_;
  int size_;
  std::uint32_t seed_;
  std::vector<Vec3> colors_;
};

/// "#rrggbb" as encoded values 0..1, parsed at compile time.
struct EncodedColor {
  float r = 0.0f, g = 0.0f, b = 0.0f;
  operator Vec3() const { return {r, g, b}; }
};
consteval float hexPair(const char* text) {
  int value = 0;
  for (int i = 0; i < 2; ++i) {
    const char c = text[i];
    value = 16 * value + (c <= '9' ? c - '0' : c - 'a' + 10);
  }
  return static_cast<float>(value) / 255.0f;
}
consteval EncodedColor hex(const char* text) {
  return {hexPair(text + 1), hexPair(text + 3), hexPair(text + 5)};
}

/// The same, parsed at run time.
Vec3 hexColor(const char* text);

struct Texture {
  std::string name;
  std::vector<config::Field> fields;
  void (*paint)(Canvas&);
};

/// Textures of surfaces are in procedural_materials.cpp, pictures and patterns in
/// procedural_pictures.cpp.
std::vector<Texture> materialTextures();
std::vector<Texture> pictureTextures();

inline config::Field pairField(const char* name, const char* help, const char* standard) {
  return fields::numbers(name, help, standard, 1.0, 1024.0);
}

}  // namespace catoptric::scene::procedural
