#include "scene/procedural/procedural.h"

#include <cassert>
#include <cmath>
#include <map>

#include "core/error.h"
#include "core/text.h"
#include "scene/loader.h"
#include "scene/procedural/canvas.h"

namespace catoptric::scene {
namespace procedural {

namespace {

/// Encoded values of "#rrggbb"; false when it is none.
bool parseHex(const std::string& text, Vec3& color) {
  if (text.size() != 7 || text[0] != '#') return false;
  for (std::size_t c = 0; c < 3; ++c) {
    const int high = hexDigit(text[1 + 2 * c]);
    const int low = hexDigit(text[2 + 2 * c]);
    if (high < 0 || low < 0) return false;
    color[static_cast<int>(c)] = static_cast<float>(16 * high + low) / 255.0f;
  }
  return true;
}

float decoded(float value) {
  return value <= 0.04045f ? value / 12.92f : std::pow((value + 0.055f) / 1.055f, 2.4f);
}
float encoded(float value) {
  const float v = std::clamp(value, 0.0f, 1.0f);
  return v <= 0.0031308f ? 12.92f * v : 1.055f * std::pow(v, 1.0f / 2.4f) - 0.055f;
}

struct Entry {
  Texture texture;
  config::Schema schema;
};

const std::vector<Entry>& entries() {
  static const std::vector<Entry> all = [] {
    std::vector<Texture> textures = materialTextures();
    for (Texture& texture : pictureTextures()) textures.push_back(std::move(texture));
    std::vector<Entry> made;
    for (Texture& texture : textures) {
      config::Schema schema{"procedural texture " + texture.name, "", {}};
      schema.fields = {
          fields::required(fields::text("procedural", "Which texture it is.")),
          fields::integer("size", "How many texels a side has.", "512", 8, 8192),
          fields::integer("seed", "Another seed makes another texture of the same kind.", "1", 0,
                          4294967295.0),
          {.name = "colors",
           .type = config::FieldType::Array,
           .help = "Colours in place of the built-in ones, each [r, g, b] in linear values or "
                   "\"#rrggbb\"."},
          fields::number("strength", "Of normal maps: multiplies the slopes.", "1", -100.0, 100.0),
      };
      schema.fields.insert(schema.fields.end(), texture.fields.begin(), texture.fields.end());
      made.push_back({std::move(texture), std::move(schema)});
    }
    return made;
  }();
  return all;
}

const Entry& entryOf(const std::string& name) {
  for (const Entry& entry : entries()) {
    if (entry.texture.name == name) return entry;
  }
  assert(false && "no such procedural texture");
  return entries().front();
}

}  // namespace

Vec3 hexColor(const char* text) {
  Vec3 color(0.0f);
  [[maybe_unused]] const bool valid = parseHex(text, color);
  assert(valid);
  return color;
}

Canvas::Canvas(const config::Value& settings, const config::Schema& schema)
    : settings_(settings),
      schema_(schema),
      size_(integer("size")),
      seed_(static_cast<std::uint32_t>(config::valueOr(settings, schema, "seed").asInteger()) *
            2654435761u) {
  if (settings.has("colors")) {
    for (const config::Value& value : settings.get("colors").asArray()) {
      const Vec3 linear = colorOf(value);
      colors_.emplace_back(encoded(linear.x), encoded(linear.y), encoded(linear.z));
    }
  }
  image.size = size_;
  image.rgba.resize(static_cast<std::size_t>(size_) * size_ * 4);
  image.height.resize(static_cast<std::size_t>(size_) * size_);
}

float Canvas::number(const char* name) const {
  return static_cast<float>(config::valueOr(settings_, schema_, name).asNumber());
}
int Canvas::integer(const char* name) const {
  return static_cast<int>(config::valueOr(settings_, schema_, name).asInteger());
}
std::string Canvas::word(const char* name) const {
  return config::valueOr(settings_, schema_, name).asString();
}
glm::ivec2 Canvas::pair(const char* name) const {
  const config::Value value = config::valueOr(settings_, schema_, name);
  if (value.asArray().size() != 2) value.fail(value.dump() + " is not an array of 2 whole numbers");
  return {static_cast<int>(value.asArray()[0].asInteger()),
          static_cast<int>(value.asArray()[1].asInteger())};
}
Vec3 Canvas::color(std::size_t i, const char* standard) const {
  return i < colors_.size() ? colors_[i] : hexColor(standard);
}

}  // namespace procedural

const std::vector<std::string>& proceduralNames() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> all;
    for (const auto& entry : procedural::entries()) all.push_back(entry.texture.name);
    return all;
  }();
  return names;
}

const config::Schema& proceduralSchema(const std::string& name) {
  return procedural::entryOf(name).schema;
}

ProceduralImage makeProcedural(const config::Value& settings) {
  const procedural::Entry& entry = procedural::entryOf(settings.get("procedural").asString());
  config::require(settings, entry.schema);
  procedural::Canvas canvas(settings, entry.schema);
  entry.texture.paint(canvas);
  return std::move(canvas.image);
}

std::vector<std::uint8_t> normalMapFromHeight(const std::vector<float>& height, int size,
                                              float strength) {
  std::vector<std::uint8_t> rgba(static_cast<std::size_t>(size) * size * 4);
  const float scale = 0.5f * strength * static_cast<float>(size);
  procedural::forRows(size, [&](int y) {
    const auto at = [&](int px, int py) {
      return height[static_cast<std::size_t>(procedural::wrap(py, size)) * size +
                    procedural::wrap(px, size)];
    };
    for (int x = 0; x < size; ++x) {
      // Rows go down, the map's y goes up.
      const Vec3 n = glm::normalize(
          Vec3((at(x - 1, y) - at(x + 1, y)) * scale, (at(x, y + 1) - at(x, y - 1)) * scale, 1.0f));
      std::uint8_t* texel = rgba.data() + 4 * (static_cast<std::size_t>(y) * size + x);
      for (int c = 0; c < 3; ++c) {
        texel[c] = static_cast<std::uint8_t>((0.5f * n[c] + 0.5f) * 255.0f + 0.5f);
      }
      texel[3] = 255;
    }
  });
  return rgba;
}

Vec3 colorOf(const config::Value& value) {
  if (value.kind() == config::Value::Kind::String) {
    Vec3 color(0.0f);
    if (!procedural::parseHex(value.asString(), color)) {
      value.fail(value.dump() + " is not a colour; write [r, g, b] or \"#rrggbb\"");
    }
    return {procedural::decoded(color.x), procedural::decoded(color.y),
            procedural::decoded(color.z)};
  }
  const Vec3 color = value.asVec3();
  if (color.x < 0.0f || color.y < 0.0f || color.z < 0.0f) {
    value.fail(value.dump() + " has a component below 0");
  }
  if (glm::any(glm::greaterThan(color, Vec3(kMaxColor)))) {
    value.fail(value.dump() + " is out of range: components from 0 to 1e9 are allowed");
  }
  return color;
}

}  // namespace catoptric::scene
