// Surfaces: wood, tiles, stone, textiles.
#include "scene/procedural/canvas.h"

namespace catoptric::scene::procedural {
namespace {

/// Where a texel lies on its plank.
struct Plank {
  float along = 0.0f;   ///< 0..1 over its length
  float across = 0.0f;  ///< 0..1 over its width
  float edge = 0.0f;    ///< distance to its nearest edge, in tiles
  int id = 0;
  bool upright = false;  ///< grain along v
};

Plank stripPlank(float u, float v, glm::ivec2 planks, std::uint32_t seed) {
  const float row = v * static_cast<float>(planks.x);
  const auto r = static_cast<int>(row);
  const float shift = hash01(r, 0, seed) + (r % 2 == 0 ? 0.0f : 0.5f);
  const float at = fract(u + shift / static_cast<float>(planks.y)) * static_cast<float>(planks.y);
  Plank p;
  p.along = fract(at);
  p.across = fract(row);
  p.edge = std::min(edgeDistance(p.along) / static_cast<float>(planks.y),
                    edgeDistance(p.across) / static_cast<float>(planks.x));
  p.id = r * 64 + static_cast<int>(at);
  return p;
}

/// Planks of `ratio` cells length, one cell width, in steps; `repeats` per tile.
Plank herringbonePlank(float u, float v, int ratio, int repeats) {
  const int period = 2 * ratio;
  const int cells = period * repeats;
  const float x = u * static_cast<float>(cells);
  const float y = v * static_cast<float>(cells);
  const auto i = static_cast<int>(x);
  const auto j = static_cast<int>(y);
  const int d = wrap(i - j, period);
  Plank p;
  const auto length = static_cast<float>(ratio);
  float along = 0.0f;
  if (d < ratio) {  // a level plank starts where d = 0
    along = static_cast<float>(d) + fract(x);
    p.across = fract(y);
    p.id = wrap(i - d, cells) * 512 + j;
  } else {  // an upright one: going down a column, d falls
    const int k = period - 1 - d;
    along = static_cast<float>(k) + fract(y);
    p.across = fract(x);
    p.id = i * 512 + wrap(j - k, cells) + 1'000'003;
    p.upright = true;
  }
  p.along = along / length;
  p.edge =
      std::min(edgeDistance(p.along) * length, edgeDistance(p.across)) / static_cast<float>(cells);
  return p;
}

Plank basketPlank(float u, float v, glm::ivec2 planks) {
  const auto blocks = static_cast<float>(2 * planks.y);
  const float x = u * blocks;
  const float y = v * blocks;
  const auto i = static_cast<int>(x);
  const auto j = static_cast<int>(y);
  Plank p;
  p.upright = (i + j) % 2 != 0;
  p.along = p.upright ? fract(y) : fract(x);
  const float strips = (p.upright ? fract(x) : fract(y)) * static_cast<float>(planks.x);
  p.across = fract(strips);
  p.edge = std::min(edgeDistance(p.along), edgeDistance(p.across) / static_cast<float>(planks.x)) /
           blocks;
  p.id = (i * 64 + j) * 64 + static_cast<int>(strips);
  return p;
}

void wood(Canvas& canvas) {
  const std::string pattern = canvas.word("pattern");
  const glm::ivec2 planks = canvas.pair("planks");
  const float gap = pattern == "board" ? 0.0f : canvas.number("gap");
  const float grain = canvas.number("grain");
  const float vary = canvas.number("vary");
  const Vec3 light = canvas.color(0, "#b98a58");
  const Vec3 dark = canvas.color(1, "#8a5a32");
  const Vec3 joint = canvas.color(2, "#2e1c10");
  const std::uint32_t seed = canvas.seed();
  const int size = canvas.size();
  // Grain: fine fibres, slow waves that bend the year rings, pores.
  const Field fibre = fbm(size, 6, 96, 3, seed + 1u, 0.6f);
  const Field wave = fbm(size, 2, 3, 3, seed + 2u);
  const Field pores = fbm(size, 24, 256, 1, seed + 3u);
  const float rows = pattern == "strip" ? static_cast<float>(planks.x) : 6.0f;
  canvas.paint([&](int x, int y, float u, float v, Vec3& color, float& height) {
    Plank p;
    if (pattern == "strip") {
      p = stripPlank(u, v, planks, seed);
    } else if (pattern == "herringbone") {
      p = herringbonePlank(u, v, std::max(planks.x, 2), planks.y);
    } else if (pattern == "basket") {
      p = basketPlank(u, v, planks);
    } else {
      p.along = u;
      p.across = v;
      p.edge = 1.0f;
    }
    const float tone = hash01(p.id, 1, seed);
    // Each plank is cut from elsewhere.
    const int sx = static_cast<int>(hash01(p.id, 2, seed) * static_cast<float>(size));
    const int sy = static_cast<int>(hash01(p.id, 3, seed) * static_cast<float>(size));
    const int gx = (p.upright ? y : x) + (pattern == "board" ? 0 : sx);
    const int gy = (p.upright ? x : y) + (pattern == "board" ? 0 : sy);
    // Rings: distance from a heart that lies beside the plank, bent by the waves.
    const float bend = wave.at(gx, gy);
    float ring = 0.0f;
    if (pattern == "board") {
      // Twelve rings over the tile, drawn out along the grain.
      ring = fract(12.0f * v + 2.6f * bend);
    } else {
      const float centre = (hash01(p.id, 4, seed) - 0.5f) * 2.5f;
      const float distance = (p.across - 0.5f - centre) * (6.0f / rows) + 0.55f * bend;
      ring = fract(5.0f * std::abs(distance) + hash01(p.id, 5, seed));
    }
    const float late = ring * ring * ring;  // dark late wood ends a ring
    const float fibres = fibre.at(gx, gy);
    const float pore = smoothstep(0.35f, 0.75f, pores.at(gx, gy));
    float t = 0.35f + grain * (0.38f * late - 0.1f + 0.32f * fibres + 0.25f * pore);
    t += vary * (tone - 0.5f);
    color = glm::mix(light, dark, std::clamp(t, -0.25f, 1.4f));
    color *= 1.0f + 0.08f * vary * (hash01(p.id, 6, seed) - 0.5f);
    const float inside = gap > 0.0f ? smoothstep(0.25f * gap, gap, p.edge) : 1.0f;
    color = glm::mix(joint, color, inside);
    height = 0.0025f * inside - 0.0002f * grain * (pore + 0.5f * late);
  });
}

/// A rounded rectangle's place in a grid of tiles.
struct Tile {
  Vec2 local{0.0f};   ///< 0..1 over the tile
  float edge = 0.0f;  ///< distance to its border in units of the texture
  int column = 0;
  int row = 0;
};

Tile tileAt(float u, float v, glm::ivec2 count, float offset) {
  Tile t;
  const float y = v * static_cast<float>(count.y);
  t.row = static_cast<int>(y);
  const float x = fract(u + (t.row % 2 == 0 ? 0.0f : offset / static_cast<float>(count.x))) *
                  static_cast<float>(count.x);
  t.column = static_cast<int>(x) % count.x;
  t.local = {fract(x), fract(y)};
  t.edge = std::min(edgeDistance(t.local.x) / static_cast<float>(count.x),
                    edgeDistance(t.local.y) / static_cast<float>(count.y));
  return t;
}

void tiles(Canvas& canvas) {
  const glm::ivec2 count = canvas.pair("count");
  const float grout = std::max(
      0.5f * canvas.number("grout") / static_cast<float>(std::max(count.x, count.y)), 1e-5f);
  const float bevel =
      std::max(canvas.number("bevel") / static_cast<float>(std::max(count.x, count.y)), 1e-4f);
  const float offset = canvas.number("offset");
  const float vary = canvas.number("vary");
  const std::string pattern = canvas.word("pattern");
  const Vec3 first = canvas.color(0, "#e4e6e2");
  const Vec3 second = canvas.color(1, pattern == "checker" ? "#2b3136" : "#3d6f8e");
  const Vec3 joint = canvas.color(2, "#9a9890");
  const std::uint32_t seed = canvas.seed();
  const Field mottle = fbm(canvas.size(), 8, 8, 4, seed + 1u);
  const Field grit = fbm(canvas.size(), 128, 128, 1, seed + 2u);
  canvas.paint([&](int x, int y, float u, float v, Vec3& color, float& height) {
    const Tile t = tileAt(u, v, count, offset);
    const float tone = hash01(t.column, t.row, seed);
    color = first;
    if (pattern == "checker" && (t.column + t.row) % 2 != 0) color = second;
    if (pattern == "ornament") {
      // Quarter circles that join across tiles, and a star in the middle.
      const Vec2 q = glm::abs(t.local - 0.5f);
      const float corner = glm::length(Vec2(0.5f) - q);
      const float ring = std::abs(corner - 0.3f);
      const float angle = std::atan2(t.local.y - 0.5f, t.local.x - 0.5f);
      const float star = glm::length(q) - (0.13f + 0.05f * std::cos(8.0f * angle));
      const float ink = std::max(smoothstep(0.045f, 0.035f, ring), smoothstep(0.01f, -0.01f, star));
      const float dot = smoothstep(0.105f, 0.095f, corner);
      color = glm::mix(color, second, std::max(ink, dot));
    }
    color *= 1.0f + vary * (0.5f * (tone - 0.5f) + 0.25f * mottle.at(x, y));
    const float inside = smoothstep(0.8f * grout, 1.2f * grout, t.edge);
    const Vec3 mortar = joint * (1.0f + 0.12f * grit.at(x, y));
    color = glm::mix(mortar, color, inside);
    // Rounded edges; each tile leans a little.
    const float rounded = smoothstep(grout, grout + bevel, t.edge);
    const Vec2 lean =
        Vec2(hash01(t.column, t.row, seed + 3u), hash01(t.column, t.row, seed + 4u)) - 0.5f;
    height = inside * (0.004f * rounded + 0.0015f * vary * glm::dot(lean, t.local - 0.5f) +
                       0.0001f * vary * mottle.at(x, y)) +
             (1.0f - inside) * 0.0002f * grit.at(x, y);
  });
}

void bricks(Canvas& canvas) {
  const glm::ivec2 count = canvas.pair("count");
  const float grout = canvas.number("grout");
  const float vary = canvas.number("vary");
  const Vec3 brick = canvas.color(0, "#9c4f38");
  const Vec3 darkBrick = canvas.color(1, "#6d3326");
  const Vec3 mortar = canvas.color(2, "#b7ada0");
  const std::uint32_t seed = canvas.seed();
  const Field rough = fbm(canvas.size(), 32, 32, 4, seed + 1u, 0.6f);
  const Field slow = fbm(canvas.size(), 6, 6, 3, seed + 2u);
  canvas.paint([&](int x, int y, float u, float v, Vec3& color, float& height) {
    const Tile t = tileAt(u, v, count, 0.5f);
    const float tone = hash01(t.column, t.row, seed);
    const float noise = rough.at(x, y);
    float mixing = 0.5f + vary * (tone - 0.5f) * 1.6f + 0.3f * noise + 0.2f * slow.at(x, y);
    color = glm::mix(brick, darkBrick, std::clamp(mixing, 0.0f, 1.0f));
    const float edge = t.edge + 0.0025f * noise;
    const float inside = smoothstep(0.4f * grout, 0.62f * grout, edge);
    color = glm::mix(mortar * (1.0f + 0.15f * noise), color, inside);
    height = 0.006f * smoothstep(0.3f * grout, 0.9f * grout, edge) + 0.0012f * noise;
  });
}

void marble(Canvas& canvas) {
  const float veins = canvas.number("veins");
  const int scale = canvas.integer("scale");
  const Vec3 ground = canvas.color(0, "#e9e6e1");
  const Vec3 vein = canvas.color(1, "#8f9096");
  const Vec3 deep = canvas.color(2, "#5b5a60");
  const std::uint32_t seed = canvas.seed();
  const int size = canvas.size();
  const Field warpX = fbm(size, scale, scale, 4, seed + 1u);
  const Field warpY = fbm(size, scale, scale, 4, seed + 2u);
  const Field broad = fbm(size, scale, scale, 3, seed + 3u);
  const Field fine = fbm(size, 2 * scale, 2 * scale, 3, seed + 4u);
  const Field cloud = fbm(size, scale, scale, 5, seed + 5u, 0.55f);
  canvas.paint([&](int x, int y, float u, float v, Vec3& color, float& height) {
    // Veins: zero lines of noise, seen through a strong warp.
    const float wu = u + 0.16f * warpX.at(x, y);
    const float wv = v + 0.16f * warpY.at(x, y);
    const float a = std::abs(broad.sample(wu, wv));
    const float b = std::abs(fine.sample(wu, wv));
    const float patch = smoothstep(-0.25f, 0.45f, cloud.at(x, y));
    const float strong =
        std::pow(1.0f - smoothstep(0.0f, 0.11f, a), 2.0f) * (0.25f + 0.75f * patch);
    const float thin = std::pow(1.0f - smoothstep(0.0f, 0.06f, b), 2.0f) * patch;
    color = glm::mix(ground, vein, std::clamp(0.16f + 0.3f * cloud.at(x, y), 0.0f, 0.45f));
    color = glm::mix(color, vein, std::clamp(veins * 0.55f * thin, 0.0f, 1.0f));
    color = glm::mix(color, deep, std::clamp(veins * 0.8f * strong, 0.0f, 1.0f));
    height = 0.0f;
  });
}

void terrazzo(Canvas& canvas) {
  const int scale = canvas.integer("scale");
  const Vec3 ground = canvas.color(0, "#d9d4ca");
  const Vec3 chips[3] = {canvas.color(1, "#8c5a45"), canvas.color(2, "#4d5357"),
                         canvas.color(3, "#c9a36b")};
  const std::uint32_t seed = canvas.seed();
  const Cells large(scale, 0.9f, seed + 1u);
  const Cells small(scale * 5 / 2, 0.9f, seed + 2u);
  const Field grit = fbm(canvas.size(), 64, 64, 2, seed + 3u);
  canvas.paint([&](int x, int y, float u, float v, Vec3& color, float& height) {
    const float noise = grit.at(x, y);
    color = ground * (1.0f + 0.06f * noise);
    const auto put = [&](const Cell& cell, float share) {
      if (static_cast<float>(cell.id & 255u) / 255.0f > share) return;
      const float border = cell.second - cell.nearest + 0.06f * noise;
      const float radius = 0.28f + 0.2f * static_cast<float>((cell.id >> 8) & 255u) / 255.0f;
      const float cover =
          smoothstep(0.08f, 0.12f, border) * smoothstep(radius, radius - 0.04f, cell.nearest);
      color = glm::mix(color, chips[(cell.id >> 16) % 3u] * (1.0f + 0.1f * noise), cover);
    };
    put(small.at(u, v), 0.55f);
    put(large.at(u, v), 0.7f);
    height = 0.0f;
  });
}

void terry(Canvas& canvas) {
  const int loops = canvas.integer("loops");
  const Vec3 yarn = canvas.color(0, "#d8dde0");
  const std::uint32_t seed = canvas.seed();
  const Cells cells(loops, 0.85f, seed + 1u);
  const Field slow = fbm(canvas.size(), 6, 6, 3, seed + 2u);
  canvas.paint([&](int x, int y, float u, float v, Vec3& color, float& height) {
    const Cell cell = cells.at(u, v);
    // A loop: a little arch lying in a random direction.
    const float angle = 6.2831853f * static_cast<float>(cell.id & 1023u) / 1024.0f;
    const float along = cell.dx * std::cos(angle) + cell.dy * std::sin(angle);
    const float bump = std::clamp(1.0f - 1.5f * cell.nearest, 0.0f, 1.0f);
    const float strand = 0.5f + 0.5f * std::cos(9.0f * along);
    const float h = bump * (0.75f + 0.25f * strand);
    color = yarn * (0.66f + 0.34f * h + 0.05f * slow.at(x, y));
    height = 0.5f / static_cast<float>(loops) * h;
  });
}

void leather(Canvas& canvas) {
  const int scale = canvas.integer("scale");
  const Vec3 ground = canvas.color(0, "#5a3524");
  const Vec3 crease = canvas.color(1, "#2c1810");
  const std::uint32_t seed = canvas.seed();
  const Cells cells(scale, 0.95f, seed + 1u);
  const Field warp = fbm(canvas.size(), scale, scale, 3, seed + 2u);
  const Field slow = fbm(canvas.size(), 3, 3, 4, seed + 3u);
  canvas.paint([&](int x, int y, float u, float v, Vec3& color, float& height) {
    const float bend = 0.25f / static_cast<float>(scale) * warp.at(x, y);
    const Cell cell = cells.at(u + bend, v - bend);
    const float edge = cell.second - cell.nearest;
    const float flat = smoothstep(0.02f, 0.3f, edge);
    color = glm::mix(crease, ground, 0.35f + 0.65f * flat);
    color *=
        1.0f + 0.12f * slow.at(x, y) + 0.06f * (static_cast<float>(cell.id & 255u) / 255.0f - 0.5f);
    height = 0.12f / static_cast<float>(scale) * (flat + 0.15f * warp.at(x, y));
  });
}

void plaster(Canvas& canvas) {
  const int scale = canvas.integer("scale");
  const float rough = canvas.number("rough");
  const Vec3 paint = canvas.color(0, "#e6e1d6");
  const std::uint32_t seed = canvas.seed();
  const Field bumps = fbm(canvas.size(), scale, scale, 5, seed + 1u, 0.6f);
  const Field slow = fbm(canvas.size(), 3, 3, 3, seed + 2u);
  canvas.paint([&](int x, int y, float, float, Vec3& color, float& height) {
    const float n = bumps.at(x, y);
    color = paint * (1.0f + rough * (0.08f * n + 0.05f * slow.at(x, y)));
    height = rough * 0.12f / static_cast<float>(scale) * n;
  });
}

void checker(Canvas& canvas) {
  const glm::ivec2 count = canvas.pair("count");
  const Vec3 a = canvas.color(0, "#e8e8e8");
  const Vec3 b = canvas.color(1, "#202020");
  canvas.paint([&](int, int, float u, float v, Vec3& color, float& height) {
    const int i = static_cast<int>(u * static_cast<float>(count.x));
    const int j = static_cast<int>(v * static_cast<float>(count.y));
    color = (i + j) % 2 == 0 ? a : b;
    height = 0.0f;
  });
}

void stripes(Canvas& canvas) {
  const int count = canvas.integer("count");
  const float soft = std::max(canvas.number("soft"), 1e-4f);
  std::vector<Vec3> colors;
  for (std::size_t i = 0; i < canvas.colorCount(); ++i)
    colors.push_back(canvas.color(i, "#000000"));
  if (colors.size() < 2) colors = {canvas.color(0, "#d9d2c3"), Vec3(hex("#7c8f83"))};
  const auto n = static_cast<int>(colors.size());
  canvas.paint([&](int, int, float u, float, Vec3& color, float& height) {
    const float x = u * static_cast<float>(count * n);
    const auto i = static_cast<int>(x);
    const float f = fract(x);
    const Vec3& here = colors[static_cast<std::size_t>(i % n)];
    const Vec3& before = colors[static_cast<std::size_t>((i + n - 1) % n)];
    const Vec3& after = colors[static_cast<std::size_t>((i + 1) % n)];
    color = f < 0.5f ? glm::mix(before, here, smoothstep(-soft, soft, f))
                     : glm::mix(here, after, smoothstep(1.0f - soft, 1.0f + soft, f));
    height = 0.0f;
  });
}

void water(Canvas& canvas) {
  const int scale = canvas.integer("scale");
  const Vec3 deep = canvas.color(0, "#0d3b4a");
  const Vec3 light = canvas.color(1, "#3f8f9c");
  const Field a = fbm(canvas.size(), scale, scale, 4, canvas.seed() + 1u, 0.45f);
  const Field b = fbm(canvas.size(), scale, 2 * scale, 3, canvas.seed() + 2u, 0.45f);
  canvas.paint([&](int x, int y, float u, float v, Vec3& color, float& height) {
    const float n = a.sample(u + 0.1f * b.at(x, y), v) + 0.5f * b.at(x, y);
    color = glm::mix(deep, light, std::clamp(0.5f + 0.6f * n, 0.0f, 1.0f));
    height = 0.08f / static_cast<float>(scale) * n;
  });
}

}  // namespace

std::vector<Texture> materialTextures() {
  return {
      {"wood",
       {fields::choice("pattern", "How the planks lie.", "\"strip\"",
                       {"strip", "herringbone", "basket", "board"}),
        pairField("planks",
                  "How many planks lie across and along; of herringbone their length by their "
                  "width, and the repeats.",
                  "[6, 2]"),
        fields::number("gap", "The width of the gaps, as a share of the tile.", "0.004", 0.0, 0.1),
        fields::number("grain", "The contrast of the grain.", "1", 0.0, 3.0),
        fields::number("vary", "How much planks differ from one another.", "0.5", 0.0, 2.0)},
       wood},
      {"tiles",
       {pairField("count", "How many tiles there are in u and v.", "[4, 4]"),
        fields::number("grout", "The width of the joints, as a share of a tile's shorter side.",
                       "0.02", 0.0, 0.5),
        fields::number("offset", "By how many tiles every other row is moved.", "0", 0.0, 1.0),
        fields::number("bevel", "The width of the edges, as a share of a tile.", "0.02", 0.0, 0.5),
        fields::number("vary", "How much tiles differ from one another.", "0.15", 0.0, 2.0),
        fields::choice("pattern", "How the colours are spread.", "\"plain\"",
                       {"plain", "checker", "ornament"})},
       tiles},
      {"bricks",
       {pairField("count", "How many bricks there are in u and v.", "[4, 12]"),
        fields::number("grout", "The width of the joints, as a share of the texture.", "0.012", 0.0,
                       0.1),
        fields::number("vary", "How much bricks differ from one another.", "0.5", 0.0, 2.0)},
       bricks},
      {"marble",
       {fields::number("veins", "The contrast of the veins.", "1", 0.0, 3.0),
        fields::integer("scale", "How many veins a tile has.", "3", 1, 64)},
       marble},
      {"terrazzo",
       {fields::integer("scale", "How many chips a tile has.", "12", 2, 256)},
       terrazzo},
      {"terry", {fields::integer("loops", "How many loops a tile has.", "48", 2, 1024)}, terry},
      {"leather",
       {fields::integer("scale", "How many creases a tile has.", "24", 2, 512)},
       leather},
      {"plaster",
       {fields::integer("scale", "How many bumps a tile has.", "16", 1, 512),
        fields::number("rough", "How rough the plaster is; 0 is smooth.", "0.3", 0.0, 10.0)},
       plaster},
      {"checker",
       {pairField("count", "How many fields there are in u and v, even numbers.", "[8, 8]")},
       checker},
      {"stripes",
       {fields::integer("count", "How many stripes a tile has, of all colours in turn.", "8", 1,
                        512),
        fields::number("soft", "How soft the edges are.", "0.02", 0.0, 0.5)},
       stripes},
      {"water", {fields::integer("scale", "How many ripples a tile has.", "6", 1, 256)}, water},
  };
}

}  // namespace catoptric::scene::procedural
