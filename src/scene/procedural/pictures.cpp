// Pictures and ornaments: rugs, wallpaper, paintings, books, leaves.
#include <array>

#include "scene/procedural/canvas.h"

namespace catoptric::scene::procedural {
namespace {

/// 1 inside a shape whose signed distance is `d`, with a soft edge of `soft`.
float ink(float d, float soft) {
  return smoothstep(soft, -soft, d);
}

float diamond(Vec2 p, Vec2 size) {
  return (std::abs(p.x) / size.x + std::abs(p.y) / size.y - 1.0f) * std::min(size.x, size.y);
}

float box(Vec2 p, Vec2 half) {
  const Vec2 q = glm::abs(p) - half;
  return std::max(q.x, q.y);
}

/// A pointed leaf along +x from the origin.
float leaf(Vec2 p, float length, float width) {
  const float t = std::clamp(p.x / length, 0.0f, 1.0f);
  const float half = width * std::sin(kPi * std::sqrt(t)) * 0.9f;
  const float beyond = std::max(-p.x, p.x - length);
  return std::max(std::abs(p.y) - half, beyond);
}

Vec2 turned(Vec2 p, float angle) {
  const float c = std::cos(angle);
  const float s = std::sin(angle);
  return {c * p.x + s * p.y, c * p.y - s * p.x};
}

/// A rosette of `petals` around the origin.
float rosette(Vec2 p, float radius, int petals, float depth) {
  const float angle = std::atan2(p.y, p.x);
  return glm::length(p) -
         radius * (1.0f - depth + depth * std::cos(static_cast<float>(petals) * angle));
}

struct RugColors {
  Vec3 field, border, accent, ground;
  float soft;  ///< width of an edge
  std::uint32_t seed;
};

/// Small flowers all over the field, corner pieces, and a medallion with rings and a star.
Vec3 persianField(const RugColors& rug, Vec2 k, Vec2 p) {
  Vec3 color = rug.field;
  const Vec2 cell = k * 14.0f;
  const int ci = static_cast<int>(cell.x);
  const int cj = static_cast<int>(cell.y);
  const Vec2 local = glm::fract(cell) - 0.5f;
  const float flower = rosette(local, 0.3f, 4 + (ci + cj) % 3, 0.35f);
  color = glm::mix(color, (ci + cj) % 2 != 0 ? rug.border : rug.accent, ink(flower, 0.02f));
  color = glm::mix(color, rug.ground, ink(glm::length(local) - 0.09f, 0.02f));
  const Vec2 corner = Vec2(0.36f) - glm::abs(p);
  const float quarter = rosette(corner, 0.2f, 16, 0.06f);
  color = glm::mix(color, rug.border, ink(quarter, rug.soft));
  color = glm::mix(color, rug.accent, ink(std::abs(quarter) - 0.005f, rug.soft));
  color = glm::mix(color, rug.ground,
                   ink(std::abs(rosette(corner, 0.12f, 8, 0.15f)) - 0.008f, rug.soft));
  const Vec2 m(p.x * 1.25f, p.y);
  color = glm::mix(color, rug.border, ink(rosette(m, 0.25f, 16, 0.09f), rug.soft));
  color =
      glm::mix(color, rug.accent, ink(std::abs(rosette(m, 0.25f, 16, 0.09f)) - 0.006f, rug.soft));
  color = glm::mix(color, rug.ground, ink(rosette(m, 0.19f, 12, 0.12f), rug.soft));
  color = glm::mix(color, rug.field, ink(rosette(m, 0.165f, 12, 0.12f), rug.soft));
  const float angle = std::atan2(m.y, m.x);
  const float spoke = std::abs(fract(angle / (2.0f * kPi) * 12.0f) - 0.5f);
  const float r = glm::length(m);
  color = glm::mix(color, rug.accent,
                   ink(std::max(std::abs(r - 0.105f) - 0.035f, (0.3f - spoke) * 0.1f), rug.soft));
  color = glm::mix(color, rug.ground, ink(rosette(m, 0.065f, 8, 0.25f), rug.soft));
  color = glm::mix(color, rug.border, ink(r - 0.028f, rug.soft));
  return color;
}

/// Rows of stepped diamonds.
Vec3 kilimField(const RugColors& rug, Vec2 k) {
  const float rows = 7.0f;
  const Vec2 cell(k.x * 5.0f + (static_cast<int>(k.y * rows) % 2 != 0 ? 0.5f : 0.0f), k.y * rows);
  Vec2 local = glm::fract(cell) - 0.5f;
  local = glm::floor(local * 16.0f + 0.5f) / 16.0f;
  const int row = static_cast<int>(cell.y);
  const Vec3 bands[3] = {rug.field, rug.border, glm::mix(rug.field, rug.accent, 0.5f)};
  Vec3 color = bands[row % 3];
  color = glm::mix(color, rug.ground, ink(diamond(local, {0.48f, 0.46f}), 0.01f));
  color = glm::mix(color, bands[(row + 1) % 3], ink(diamond(local, {0.38f, 0.36f}), 0.01f));
  color = glm::mix(color, rug.accent, ink(diamond(local, {0.24f, 0.22f}), 0.01f));
  color = glm::mix(color, rug.ground, ink(diamond(local, {0.1f, 0.1f}), 0.01f));
  return color;
}

/// Large overlapping shapes.
Vec3 modernField(const RugColors& rug, Vec2 k) {
  Vec3 color = rug.field;
  for (int i = 0; i < 9; ++i) {
    const Vec2 centre(hash01(i, 1, rug.seed), hash01(i, 2, rug.seed));
    const float size = 0.1f + 0.2f * hash01(i, 3, rug.seed);
    const Vec3 tones[4] = {rug.border, rug.accent, rug.ground,
                           glm::mix(rug.field, rug.accent, 0.4f)};
    const Vec2 q = k - centre;
    const float d = i % 3 == 0 ? glm::length(q) - size
                    : i % 3 == 1
                        ? box(turned(q, 6.28f * hash01(i, 4, rug.seed)), Vec2(size, 0.35f * size))
                        : std::abs(glm::length(q) - size) - 0.012f;
    color = glm::mix(color, tones[i % 4], 0.9f * ink(d, rug.soft));
  }
  return color;
}

/// Guard stripes and a row of flowers between them.
Vec3 withBorder(Vec3 color, const RugColors& rug, Vec2 p, float rim) {
  const float along = std::abs(p.x) > std::abs(p.y) ? p.y : p.x;
  if (rim < 0.115f) {
    color = rug.border;
    const Vec2 local(fract(along * 18.0f + 0.5f) - 0.5f, (rim - 0.0625f) * 18.0f);
    color = glm::mix(color, rug.accent, ink(rosette(local, 0.38f, 6, 0.3f), 0.03f));
    color = glm::mix(color, rug.ground, ink(glm::length(local) - 0.13f, 0.03f));
    color = glm::mix(color, rug.ground, ink(std::abs(rim - 0.107f) - 0.006f, rug.soft));
    color = glm::mix(color, rug.field, ink(std::abs(rim - 0.02f) - 0.009f, rug.soft));
    color = glm::mix(color, rug.ground, ink(rim - 0.008f, rug.soft));
  }
  return color;
}

void rug(Canvas& canvas) {
  const std::string style = canvas.word("style");
  const bool modern = style == "modern";
  const std::uint32_t seed = canvas.seed();
  const RugColors rug{.field = canvas.color(0, modern ? "#cfc8ba" : "#7d1f24"),
                      .border = canvas.color(1, modern ? "#3d4a57" : "#1f2a48"),
                      .accent = canvas.color(2, modern ? "#b5673d" : "#c89b4f"),
                      .ground = canvas.color(3, modern ? "#8d9a94" : "#e6d8b8"),
                      .soft = 1.2f / static_cast<float>(canvas.size()),
                      .seed = seed};
  const Field wool = fbm(canvas.size(), 160, 160, 1, seed + 1u);
  const Field slow = fbm(canvas.size(), 5, 9, 3, seed + 2u);
  canvas.paint([&](int x, int y, float u, float v, Vec3& color, float& height) {
    // Knots: the drawing is made of small squares.
    const float knots = 160.0f;
    const Vec2 k((std::floor(u * knots) + 0.5f) / knots, (std::floor(v * knots) + 0.5f) / knots);
    const Vec2 p = k - 0.5f;
    const float rim = 0.5f - std::max(std::abs(p.x), std::abs(p.y));  // distance to the border
    color = style == "persian" ? persianField(rug, k, p)
            : style == "kilim" ? kilimField(rug, k)
                               : modernField(rug, k);
    color = modern ? glm::mix(color, rug.border, ink(rim - 0.02f, rug.soft))
                   : withBorder(color, rug, p, rim);
    const float pile = wool.at(x, y);
    const float knot =
        0.5f + 0.5f * std::cos(2.0f * kPi * u * knots) * std::cos(2.0f * kPi * v * knots);
    color *= 0.93f + 0.1f * pile + 0.06f * slow.at(x, y) + 0.05f * knot;
    height = 0.0012f * knot + 0.001f * pile;
  });
}

void wallpaper(Canvas& canvas) {
  const glm::ivec2 count = canvas.pair("count");
  const std::string style = canvas.word("style");
  const Vec3 ground = canvas.color(0, "#dfd8c6");
  const Vec3 motif = canvas.color(1, "#b7ae94");
  const Field paper = fbm(canvas.size(), 128, 128, 1, canvas.seed() + 1u);
  const float soft = 1.5f * static_cast<float>(count.x) / static_cast<float>(canvas.size());
  canvas.paint([&](int x, int y, float u, float v, Vec3& color, float& height) {
    // Two interleaved grids: motifs at the cells' middles and at their corners.
    float cover = 0.0f;
    for (int layer = 0; layer < 2; ++layer) {
      const float shift = layer == 0 ? 0.0f : 0.5f;
      const Vec2 cell(u * static_cast<float>(count.x) + shift,
                      v * static_cast<float>(count.y) + shift);
      Vec2 p = glm::fract(cell) - 0.5f;
      if (style == "dots") {
        cover = std::max(cover, ink(glm::length(p) - 0.12f, soft));
      } else if (style == "leaves") {
        p = turned(p, layer == 0 ? 0.6f : -0.6f);
        const float side = std::abs(p.y);
        float d = leaf({p.x + 0.33f, p.y}, 0.66f, 0.13f);
        d = std::max(d, 0.012f - side);  // the middle rib stays free
        for (int i = 0; i < 4; ++i) {
          const float at = -0.16f + 0.11f * static_cast<float>(i);
          d = std::max(d, 0.006f - std::abs(p.x - at - 0.6f * side));
        }
        cover = std::max(cover, ink(d, soft));
      } else {
        // Damask: a palmette of mirrored leaves on a stem, in a frame.
        p.x = std::abs(p.x);
        float d = 1.0f;
        for (int i = 0; i < 5; ++i) {
          const float angle = kPi * (0.5f - 0.19f * static_cast<float>(i));
          const Vec2 q = turned(Vec2(p.x, 0.06f - p.y), angle);
          d = std::min(d, std::max(leaf(q, 0.3f - 0.035f * static_cast<float>(i), 0.05f),
                                   0.007f - std::abs(q.y)));
        }
        d = std::min(d, leaf(turned(Vec2(p.x, p.y - 0.08f), 0.9f), 0.26f, 0.05f));
        d = std::min(d, glm::length(Vec2(p.x, p.y - 0.1f)) - 0.035f);
        d = std::min(d, std::abs(glm::length(Vec2(p.x - 0.2f, p.y - 0.24f)) - 0.07f) - 0.014f);
        d = std::min(d, std::abs(p.x - 0.33f - 0.1f * std::cos(2.0f * kPi * p.y)) - 0.012f);
        cover = std::max(cover, ink(d, soft));
      }
    }
    color = glm::mix(ground, motif, cover) * (1.0f + 0.02f * paper.at(x, y));
    height = 0.0008f * cover + 0.0001f * paper.at(x, y);
  });
}

Vec3 sky(float v, const Vec3& top, const Vec3& low) {
  return glm::mix(top, low, smoothstep(0.0f, 1.0f, v));
}

/// What all paintings are made of.
struct Painting {
  Field cloud, ridge, brush, fine;
  std::uint32_t seed;
  float soft;

  /// Height at which a row of hills meets the sky.
  float skyline(float us, float base, float roughness, int row) const {
    return base - roughness * ridge.sample(us, 0.137f * static_cast<float>(row));
  }
};

Vec3 trees(Vec3 color, const Painting& p, float us, float vs, float stroke) {
  for (int i = 0; i < 7; ++i) {
    const float foot = 0.66f + 0.24f * hash01(i, 1, p.seed);
    const float scale = 0.5f + 2.2f * (foot - 0.62f);
    const Vec2 at(us - hash01(i, 2, p.seed), vs - foot);
    const float trunk = box(at - Vec2(0.0f, -0.05f * scale), Vec2(0.006f, 0.06f) * scale);
    color = glm::mix(color, Vec3(hex("#4a3524")), ink(trunk, p.soft));
    const float crown = glm::length((at - Vec2(0.0f, -0.14f * scale)) / Vec2(0.8f, 1.1f)) -
                        scale * (0.075f + 0.04f * p.fine.sample(us * 2.0f, vs * 2.0f));
    const Vec3 leaves = glm::mix(
        Vec3(hex("#34502a")), Vec3(hex("#7f9440")),
        smoothstep(0.1f, -0.2f, at.y / scale + 0.14f + 0.3f * at.x / scale) + 0.3f * stroke);
    color = glm::mix(color, leaves, ink(crown, 0.004f));
  }
  return color;
}

Vec3 landscape(const Painting& p, float us, float vs, float stroke) {
  Vec3 color = sky(vs / 0.55f, Vec3(hex("#5f8fc0")), Vec3(hex("#f0dcc0")));
  const float c =
      smoothstep(0.02f, 0.5f, p.cloud.sample(us, vs * 1.5f)) * smoothstep(0.5f, 0.2f, vs);
  color = glm::mix(color, Vec3(hex("#fbf3e6")), 0.8f * c);
  const Vec3 hills[4] = {Vec3(hex("#8fa7b5")), Vec3(hex("#7c9a7c")), Vec3(hex("#6f8c4d")),
                         Vec3(hex("#8f9a45"))};
  for (int i = 0; i < 4; ++i) {
    const float line = p.skyline(us, 0.45f + 0.1f * static_cast<float>(i),
                                 0.12f - 0.015f * static_cast<float>(i), i + 1);
    const Vec3 tone = hills[i] * (0.9f + 0.3f * (vs - line) + 0.12f * stroke);
    color = glm::mix(color, tone, ink(line - vs, 2.0f * p.soft));
  }
  // A path towards the hills.
  const float path =
      std::abs(us - 0.5f - 0.12f * std::sin(9.0f * vs)) - 0.16f * std::max(vs - 0.68f, 0.0f);
  color = glm::mix(color, Vec3(hex("#d9c08a")),
                   0.85f * ink(path, 0.004f) * smoothstep(0.69f, 0.73f, vs));
  return trees(color, p, us, vs, stroke);
}

Vec3 mountains(const Painting& p, float us, float vs, float stroke) {
  Vec3 color = sky(vs / 0.6f, Vec3(hex("#28406e")), Vec3(hex("#f2b486")));
  const float sun = glm::length(Vec2(us - 0.66f, vs - 0.36f));
  color = glm::mix(color, Vec3(hex("#fff0c8")),
                   std::max(ink(sun - 0.05f, 0.006f), 0.5f * std::exp(-9.0f * sun)));
  for (int i = 0; i < 5; ++i) {
    const float t = static_cast<float>(i) / 4.0f;
    const float line =
        p.skyline(us, 0.38f + 0.13f * static_cast<float>(i), 0.24f * (1.0f - 0.5f * t), i + 1);
    Vec3 tone = glm::mix(Vec3(hex("#a98fa6")), Vec3(hex("#1c2436")), t);
    const float snow =
        i < 2 ? smoothstep(0.045f, 0.02f,
                           vs - line + 0.05f * p.ridge.sample(us * 3.0f, 0.4f) + 0.012f * stroke)
              : 0.0f;
    tone = glm::mix(tone, Vec3(hex("#f6e6dc")), 0.7f * snow);
    tone = glm::mix(tone, Vec3(hex("#d9a58c")),
                    0.35f * (1.0f - t) * smoothstep(0.0f, 0.25f, vs - line));
    color = glm::mix(color, tone * (1.0f + 0.1f * stroke), ink(line - vs, 2.0f * p.soft));
  }
  return color;
}

Vec3 seascape(const Painting& p, float us, float vs, float /*stroke*/) {
  const float horizon = 0.48f;
  Vec3 color = sky(vs / horizon, Vec3(hex("#7fa3bf")), Vec3(hex("#f3e3cd")));
  const float c = smoothstep(-0.05f, 0.45f, p.cloud.sample(us, vs * 1.8f));
  color = glm::mix(color, Vec3(hex("#fdf6ee")), 0.75f * c * smoothstep(horizon, 0.3f, vs));
  if (vs > horizon) {
    const float depth = (vs - horizon) / (1.0f - horizon);
    const float wave =
        p.ridge.sample(us * (0.6f + 0.4f * (1.0f - depth)), 0.35f / (0.1f + depth) * 0.6f);
    color = glm::mix(Vec3(hex("#6f9db0")), Vec3(hex("#123c52")), std::pow(depth, 0.6f));
    color = glm::mix(color, Vec3(hex("#e8f0ee")), 0.7f * smoothstep(0.28f, 0.5f, wave));
    color = glm::mix(
        color, Vec3(hex("#f6e6c6")),
        0.6f * std::exp(-60.0f * (us - 0.6f) * (us - 0.6f)) * smoothstep(0.1f, 0.4f, wave + 0.2f));
  }
  // A sail.
  const Vec2 s(us - 0.34f, vs - 0.5f);
  const float sail =
      std::max({s.y, -0.2f - s.y, std::abs(s.x - 0.01f) - 0.3f * (0.2f + s.y) * 0.9f});
  color = glm::mix(color, Vec3(hex("#fbf7ee")), ink(sail, p.soft));
  const float hull =
      std::max(std::abs(s.y - 0.015f) - 0.015f, std::abs(s.x) - 0.08f + 1.2f * (s.y - 0.0f));
  color = glm::mix(color, Vec3(hex("#5a2d22")), ink(hull, p.soft));
  return color;
}

/// A table with a bowl of fruit and a bottle before a dark wall.
Vec3 stillLife(const Painting& p, float us, float vs, float stroke) {
  Vec3 color = glm::mix(Vec3(hex("#4a3d33")), Vec3(hex("#1e1a19")),
                        smoothstep(0.0f, 0.9f, glm::length(Vec2(us - 0.35f, vs - 0.3f))));
  color *= 1.0f + 0.1f * p.cloud.sample(us, vs);
  const float table = 0.68f;
  if (vs > table) color = Vec3(hex("#8a5e3a")) * (1.0f + 0.25f * stroke - 0.5f * (vs - table));
  const Vec2 b(us - 0.72f, vs - 0.45f);
  const float neck = smoothstep(-0.16f, -0.05f, b.y);
  const float bottle = std::max(std::abs(b.x) - (0.022f + 0.05f * neck), std::abs(b.y) - 0.27f);
  color = glm::mix(
      color, glm::mix(Vec3(hex("#16291c")), Vec3(hex("#4f7a55")), smoothstep(0.02f, -0.05f, b.x)),
      ink(bottle, p.soft));
  color = glm::mix(color, Vec3(hex("#dff0dc")),
                   0.8f * ink(box(b - Vec2(-0.035f, 0.05f), {0.006f, 0.12f}), 0.004f));
  const Vec3 fruit[3] = {Vec3(hex("#c8402c")), Vec3(hex("#e09a2e")), Vec3(hex("#9bb03c"))};
  for (int i = 0; i < 7; ++i) {
    const Vec2 centre(0.2f + 0.055f * static_cast<float>(i) + 0.02f * hash01(i, 1, p.seed),
                      0.57f - (i % 2 == 0 ? 0.0f : 0.06f) + 0.02f * hash01(i, 2, p.seed));
    const float radius = 0.055f + 0.02f * hash01(i, 3, p.seed);
    const Vec2 q = Vec2(us, vs) - centre;
    const float light = std::clamp(0.55f - 4.0f * (q.x + q.y) + 0.15f * stroke, 0.15f, 1.2f);
    color = glm::mix(color, fruit[i % 3] * light, ink(glm::length(q) - radius, p.soft));
    color =
        glm::mix(color, Vec3(1.0f), 0.6f * ink(glm::length(q + 0.35f * radius) - 0.012f, 0.01f));
  }
  const Vec2 c(us - 0.38f, vs - 0.6f);
  const float bowl = std::max(glm::length(c / Vec2(1.7f, 1.0f)) - 0.135f, -c.y);
  color = glm::mix(
      color, glm::mix(Vec3(hex("#5b7fa6")), Vec3(hex("#c9d8e6")), smoothstep(0.2f, -0.2f, c.x)),
      ink(bowl, p.soft));
  color = glm::mix(color, color * 0.5f,
                   0.7f * ink(glm::length(Vec2((us - 0.45f) / 3.0f, vs - 0.745f)) - 0.05f, 0.03f));
  return color;
}

/// A grid of coloured fields between dark bars, and one circle.
Vec3 abstractFields(const Painting& p, float us, float vs, float /*stroke*/) {
  float x0 = 0.0f, x1 = 1.0f, y0 = 0.0f, y1 = 1.0f;
  int id = 1;
  for (int level = 0; level < 5; ++level) {
    const float cut = 0.3f + 0.4f * hash01(id, level, p.seed);
    const bool upright = (x1 - x0) > (y1 - y0);
    if (upright) {
      const float at = mix(x0, x1, cut);
      us < at ? x1 = at : x0 = at;
      id = 2 * id + (us < at ? 0 : 1);
    } else {
      const float at = mix(y0, y1, cut);
      vs < at ? y1 = at : y0 = at;
      id = 2 * id + (vs < at ? 0 : 1);
    }
    if (hash01(id, 77, p.seed) < 0.18f && level > 1) break;
  }
  const Vec3 tones[8] = {Vec3(hex("#f1ece0")), Vec3(hex("#d8412f")), Vec3(hex("#f1ece0")),
                         Vec3(hex("#f0bb3a")), Vec3(hex("#2b4c8c")), Vec3(hex("#e6dfd0")),
                         Vec3(hex("#7ba39a")), Vec3(hex("#f4efe6"))};
  Vec3 color = tones[hash(static_cast<std::uint32_t>(id), 5u, p.seed) % 8u];
  const float ring = glm::length(Vec2(us - 0.62f, vs - 0.38f));
  color = glm::mix(color, Vec3(hex("#d8412f")), 0.85f * ink(ring - 0.16f, p.soft));
  color = glm::mix(color, Vec3(hex("#222226")), ink(std::abs(ring - 0.21f) - 0.006f, p.soft));
  const float bar = std::min(std::min(us - x0, x1 - us), std::min(vs - y0, y1 - vs));
  color = glm::mix(color, Vec3(hex("#1d1d20")), ink(bar - 0.008f, p.soft));
  return color;
}

void painting(Canvas& canvas) {
  using Motif = Vec3 (*)(const Painting&, float us, float vs, float stroke);
  const std::string style = canvas.word("style");
  const Motif motif = style == "landscape"    ? landscape
                      : style == "mountains"  ? mountains
                      : style == "seascape"   ? seascape
                      : style == "still_life" ? stillLife
                                              : abstractFields;
  const std::uint32_t seed = canvas.seed();
  const int size = canvas.size();
  const Painting p{.cloud = fbm(size, 3, 5, 5, seed + 1u, 0.55f),
                   .ridge = fbm(size, 4, 4, 6, seed + 2u),
                   .brush = fbm(size, 16, 90, 2, seed + 3u),
                   .fine = fbm(size, 48, 48, 2, seed + 4u),
                   .seed = seed,
                   .soft = 1.5f / static_cast<float>(size)};
  canvas.paint([&](int x, int y, float u, float v, Vec3& color, float& height) {
    const float stroke = p.brush.at(x, y);
    // Strokes tear the drawing a little.
    const float us = u + 0.006f * p.fine.at(x, y);
    const float vs = v + 0.006f * stroke;
    color = motif(p, us, vs, stroke);
    color *= 1.0f + 0.07f * stroke + 0.03f * p.fine.at(x, y);
    height = 0.0008f * stroke + 0.0004f * p.fine.at(x, y);
  });
}

void books(Canvas& canvas) {
  const int count = canvas.integer("count");
  const std::uint32_t seed = canvas.seed();
  std::vector<Vec3> colors;
  for (std::size_t i = 0; i < canvas.colorCount(); ++i)
    colors.push_back(canvas.color(i, "#000000"));
  if (colors.empty()) {
    for (const char* tone :
         {"#7a2e2a", "#2e4a62", "#c7b48a", "#3f5a45", "#8a6a3c", "#e2dccb", "#4a3a4f", "#a8553a"}) {
      colors.push_back(hexColor(tone));
    }
  }
  // Spines of different widths that fill the tile.
  std::vector<float> edges{0.0f};
  for (int i = 0; i < count; ++i) edges.push_back(edges.back() + 0.6f + hash01(i, 0, seed));
  const float total = edges.back();
  for (float& edge : edges) edge /= total;
  const Field cloth = fbm(canvas.size(), 100, 100, 1, seed + 1u);
  const float soft = 1.0f / static_cast<float>(canvas.size());
  canvas.paint([&](int x, int y, float u, float v, Vec3& color, float& height) {
    const auto above = std::upper_bound(edges.begin(), edges.end(), u);
    const int i = std::min(static_cast<int>(above - edges.begin()) - 1, count - 1);
    const float left = edges[static_cast<std::size_t>(i)];
    const float right = edges[static_cast<std::size_t>(i) + 1];
    const float a = (u - left) / (right - left);
    const float top = 0.02f + 0.16f * hash01(i, 1, seed);
    const float round = std::sqrt(std::max(0.0f, 1.0f - (2.0f * a - 1.0f) * (2.0f * a - 1.0f)));
    if (v < top) {  // the shelf's dark back
      color = Vec3(hex("#1a1512"));
      height = 0.0f;
      return;
    }
    const Vec3 base = colors[hash(static_cast<std::uint32_t>(i), 2u, seed) % colors.size()];
    color = base * (0.62f + 0.38f * round + 0.05f * cloth.at(x, y));
    const Vec3 gold = Vec3(hex("#d8bd7a"));
    const float h = (v - top) / (1.0f - top);
    // Bands, and a label with lines for letters.
    const float band = std::min(std::abs(h - 0.08f), std::abs(h - 0.92f)) - 0.006f;
    color = glm::mix(color, gold, 0.8f * ink(band, soft));
    if (hash01(i, 3, seed) > 0.35f) {
      const float label = box({a - 0.5f, h - 0.28f}, {0.36f, 0.09f});
      const float lines = std::abs(fract(h * 40.0f) - 0.5f) - 0.22f;
      const bool inverse = hash01(i, 4, seed) > 0.5f;
      if (inverse) color = glm::mix(color, Vec3(hex("#e8dfc8")), 0.85f * ink(label, 0.01f));
      const float letters = std::max(
          {box({a - 0.5f, h - 0.28f}, {0.28f, 0.065f}), lines * 0.02f,
           hash01(static_cast<int>(a * 14.0f), static_cast<int>(h * 40.0f) + 100 * i, seed) > 0.75f
               ? 1.0f
               : -1.0f});
      color = glm::mix(color, inverse ? Vec3(hex("#3a2a20")) : gold, 0.8f * ink(letters, 0.004f));
    }
    height = 0.02f * round + 0.0002f * cloth.at(x, y);
  });
}

void foliage(Canvas& canvas) {
  const Vec3 light = canvas.color(0, "#7fa648");
  const Vec3 dark = canvas.color(1, "#1f3a18");
  const std::uint32_t seed = canvas.seed();
  const Field slow = fbm(canvas.size(), 5, 5, 3, seed + 9u);
  // Four layers of leaves, the lower ones darker and smaller.
  struct Leaf {
    Vec2 centre;
    float cosine, sine, tone;
  };
  struct Layer {
    int cells;
    float depth;
    std::vector<Leaf> leaves;
  };
  std::array<Layer, 4> layers{{{11, 0.15f, {}}, {9, 0.45f, {}}, {8, 0.75f, {}}, {7, 1.0f, {}}}};
  for (std::uint32_t l = 0; l < layers.size(); ++l) {
    Layer& layer = layers[l];
    const std::uint32_t s = seed + 31u * l;
    for (int j = 0; j < layer.cells; ++j) {
      for (int i = 0; i < layer.cells; ++i) {
        const float angle = 2.0f * kPi * hash01(i, j, s + 3u);
        layer.leaves.push_back({{hash01(i, j, s + 1u), hash01(i, j, s + 2u)},
                                std::cos(angle),
                                std::sin(angle),
                                layer.depth * (0.7f + 0.3f * hash01(i, j, s + 4u))});
      }
    }
  }
  canvas.paint([&](int x, int y, float u, float v, Vec3& color, float& height) {
    color = dark * 0.55f;
    height = 0.0f;
    for (const Layer& layer : layers) {
      const int n = layer.cells;
      const Vec2 at(u * static_cast<float>(n), v * static_cast<float>(n));
      const auto ci = static_cast<int>(at.x);
      const auto cj = static_cast<int>(at.y);
      for (int j = -1; j <= 1; ++j) {
        for (int i = -1; i <= 1; ++i) {
          const Leaf& one =
              layer.leaves[static_cast<std::size_t>(wrapNear(cj + j, n) * n + wrapNear(ci + i, n))];
          const Vec2 away = at - Vec2(ci + i, cj + j) - one.centre;
          if (glm::dot(away, away) > 0.36f) continue;
          const Vec2 q(one.cosine * away.x + one.sine * away.y,
                       one.cosine * away.y - one.sine * away.x);
          if (std::abs(q.y) > 0.31f) continue;
          const float d = leaf(q + Vec2(0.55f, 0.0f), 1.1f, 0.3f);
          if (d > 0.03f) continue;
          const float rib = std::min(1.0f, std::abs(q.y) * 30.0f);
          const float veins =
              0.85f +
              0.15f * smoothstep(0.1f, 0.3f, std::abs(fract(6.0f * (q.x - std::abs(q.y))) - 0.5f));
          const Vec3 paint = glm::mix(dark, light, one.tone) * (0.8f + 0.2f * rib) * veins *
                             (q.y > 0.0f ? 1.0f : 0.88f);
          const float cover = ink(d, 0.012f);
          color = glm::mix(color, paint, cover);
          height = mix(height, 0.01f * layer.depth + 0.004f * (1.0f - std::abs(q.y) * 3.0f), cover);
        }
      }
    }
    color *= 1.0f + 0.15f * slow.at(x, y);
  });
}

}  // namespace

std::vector<Texture> pictureTextures() {
  return {
      {"rug",
       {fields::choice("style", "How the rug is drawn.", "\"persian\"",
                       {"persian", "modern", "kilim"})},
       rug},
      {"wallpaper",
       {pairField("count", "How many motifs there are in u and v.", "[4, 4]"),
        fields::choice("style", "The motif.", "\"damask\"", {"damask", "dots", "leaves"})},
       wallpaper},
      {"painting",
       {fields::choice("style", "What is painted.", "\"landscape\"",
                       {"landscape", "seascape", "abstract", "still_life", "mountains"})},
       painting},
      {"books", {fields::integer("count", "How many spines a tile has.", "24", 1, 256)}, books},
      {"foliage", {}, foliage},
  };
}

}  // namespace catoptric::scene::procedural
