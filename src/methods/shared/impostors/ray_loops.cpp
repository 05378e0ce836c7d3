// The bodies below are plain loops over arrays that the compiler turns into vector code, once for
// each level of the machine (CMakeLists.txt: no errno, no traps). They do what the functions of the
// same names in shaders/ do.
#include <algorithm>
#include <bit>
#include <cmath>

#include "core/lanes.h"
#include "core/minmax.h"
#include "methods/shared/impostors/ray_batch.h"

namespace catoptric::methods::impostors {

bool RayBounds::mayMeet(const Vec3& centre, float radius) const {
  const Vec3 middle = 0.5f * (least + most);
  const Vec3 way = centre - middle;
  const float distance = glm::length(way);
  const float reach = radius + 0.5f * glm::length(most - least);
  if (!(distance > reach) || !(cosine > 0.0f)) return true;
  const float sine = reach / distance;
  const float limit = cosine * std::sqrt(1.0f - sine * sine) -
                      sine * std::sqrt(std::max(0.0f, 1.0f - cosine * cosine));
  constexpr float kRounding = 1e-4f;  ///< of cosines; ours
  return glm::dot(axis, way) >= (limit - kRounding) * distance;
}

namespace {

constexpr float kFar = 1e30f;

static_assert(kMostRays % kWidestVector == 0);

CATOPTRIC_INLINE void aimBody(const trace::SampleCamera& camera, const Samples& samples,
                              RayBatch& rays) {
  const Mat3& m = camera.rayFromPixel;
  const float m00 = m[0][0], m01 = m[0][1], m02 = m[0][2];
  const float m10 = m[1][0], m11 = m[1][1], m12 = m[1][2];
  const float m20 = m[2][0], m21 = m[2][1], m22 = m[2][2];
  const Vec3 eye = camera.eye;
  const float nearMetres = camera.nearMetres;
  const std::size_t count = wholeVectors(rays.count);
  CATOPTRIC_INDEPENDENT
  for (std::size_t i = 0; i < count; ++i) {
    const float x = m00 * samples.x[i] + m10 * samples.y[i] + m20;
    const float y = m01 * samples.x[i] + m11 * samples.y[i] + m21;
    const float z = m02 * samples.x[i] + m12 * samples.y[i] + m22;
    const float scale = nearMetres / larger(samples.depth[i], 1e-30f);
    const float length = std::sqrt(x * x + y * y + z * z);
    rays.origin.x[i] = eye.x + scale * x;
    rays.origin.y[i] = eye.y + scale * y;
    rays.origin.z[i] = eye.z + scale * z;
    rays.distance[i] = scale * length;
    const float inverse = 1.0f / length;
    const float nx = samples.normal.x[i], ny = samples.normal.y[i], nz = samples.normal.z[i];
    const float twice = 2.0f * (x * inverse * nx + y * inverse * ny + z * inverse * nz);
    const float rx = x * inverse - twice * nx;
    const float ry = y * inverse - twice * ny;
    const float rz = z * inverse - twice * nz;
    const float unit = 1.0f / std::sqrt(rx * rx + ry * ry + rz * rz);
    rays.direction.x[i] = rx * unit;
    rays.direction.y[i] = ry * unit;
    rays.direction.z[i] = rz * unit;
  }
}

/// Extremes of a lane's first values, by halves so that vectors can be compared.
CATOPTRIC_INLINE void extremes(const Lane& values, std::size_t count, float& least, float& most) {
  constexpr std::size_t kWide = 16;
  alignas(64) std::array<float, kWide> low;
  alignas(64) std::array<float, kWide> high;
  low.fill(values[0]);
  high.fill(values[0]);
  std::size_t i = 0;
  for (; i + kWide <= count; i += kWide) {
    for (std::size_t k = 0; k < kWide; ++k) {
      low[k] = smaller(low[k], values[i + k]);
      high[k] = larger(high[k], values[i + k]);
    }
  }
  for (; i < count; ++i) {
    low[0] = smaller(low[0], values[i]);
    high[0] = larger(high[0], values[i]);
  }
  for (std::size_t k = 1; k < kWide; ++k) {
    low[0] = smaller(low[0], low[k]);
    high[0] = larger(high[0], high[k]);
  }
  least = low[0];
  most = high[0];
}

CATOPTRIC_INLINE RayBounds boundBody(const RayBatch& rays) {
  RayBounds bounds;
  extremes(rays.origin.x, rays.count, bounds.least.x, bounds.most.x);
  extremes(rays.origin.y, rays.count, bounds.least.y, bounds.most.y);
  extremes(rays.origin.z, rays.count, bounds.least.z, bounds.most.z);
  Vec3 least, most;
  extremes(rays.direction.x, rays.count, least.x, most.x);
  extremes(rays.direction.y, rays.count, least.y, most.y);
  extremes(rays.direction.z, rays.count, least.z, most.z);
  bounds.axis = normalizedOr(least + most, Vec3(0, 0, 1));
  alignas(64) Lane cosines;
  const std::size_t count = wholeVectors(rays.count);
  for (std::size_t i = 0; i < count; ++i)
    cosines[i] = rays.direction.x[i] * bounds.axis.x + rays.direction.y[i] * bounds.axis.y +
                 rays.direction.z[i] * bounds.axis.z;
  float largest = 0.0f;
  extremes(cosines, rays.count, bounds.cosine, largest);
  // A ray that is none is compared with nothing: it must not hide the others' bounds
  if (!(bounds.cosine <= 1.1f) || !isFinite(bounds.least) || !isFinite(bounds.most))
    bounds.cosine = -1.0f;
  return bounds;
}

CATOPTRIC_INLINE float farthestBody(const RayBatch& rays) {
  float least = 0.0f, most = 0.0f;
  extremes(rays.t, rays.count, least, most);
  return most;
}

/// Whether any of the first values is not 0.
CATOPTRIC_INLINE bool anyOf(const std::array<std::int32_t, kMostRays>& on, std::size_t count) {
  std::int32_t any = 0;
  for (std::size_t i = 0; i < count; ++i) any |= on[i];
  return any != 0;
}

CATOPTRIC_INLINE bool meetQuadBody(const QuadLines& quad, const RayBatch& rays, Meetings& met) {
  const Vec4 p = quad.plane, a = quad.rowU, b = quad.rowV;
  const std::size_t count = wholeVectors(rays.count);
  CATOPTRIC_INDEPENDENT
  for (std::size_t i = 0; i < count; ++i) {
    const float ox = rays.origin.x[i], oy = rays.origin.y[i], oz = rays.origin.z[i];
    const float dx = rays.direction.x[i], dy = rays.direction.y[i], dz = rays.direction.z[i];
    const float t = -(p.x * ox + p.y * oy + p.z * oz + p.w) / (p.x * dx + p.y * dy + p.z * dz);
    const float x = ox + t * dx, y = oy + t * dy, z = oz + t * dz;
    const float u = a.x * x + a.y * y + a.z * z + a.w;
    const float v = b.x * x + b.y * y + b.z * z + b.w;
    met.t[i] = t;
    met.u[i] = u;
    met.v[i] = v;
    met.on[i] =
        (t > 0.0f) & (t < rays.t[i]) & (u >= 0.0f) & (u <= 1.0f) & (v >= 0.0f) & (v <= 1.0f);
  }
  return anyOf(met.on, rays.count);
}

CATOPTRIC_INLINE bool meetBoxBody(const QuadLines& quad, float height, const RayBatch& rays,
                                  Meetings& met) {
  const Vec4 p = quad.plane / height, a = quad.rowU, b = quad.rowV;
  const std::size_t count = wholeVectors(rays.count);
  CATOPTRIC_INDEPENDENT
  for (std::size_t i = 0; i < count; ++i) {
    const float ox = rays.origin.x[i], oy = rays.origin.y[i], oz = rays.origin.z[i];
    const float dx = rays.direction.x[i], dy = rays.direction.y[i], dz = rays.direction.z[i];
    const float startU = a.x * ox + a.y * oy + a.z * oz + a.w;
    const float startV = b.x * ox + b.y * oy + b.z * oz + b.w;
    const float startH = p.x * ox + p.y * oy + p.z * oz + p.w;
    const float stepU = a.x * dx + a.y * dy + a.z * dz;
    const float stepV = b.x * dx + b.y * dy + b.z * dz;
    const float stepH = p.x * dx + p.y * dy + p.z * dz;
    const float lowU = -startU / stepU, highU = (1.0f - startU) / stepU;
    const float lowV = -startV / stepV, highV = (1.0f - startV) / stepV;
    const float lowH = -startH / stepH, highH = (1.0f - startH) / stepH;
    const float from =
        larger(larger(smaller(lowU, highU), smaller(lowV, highV)), smaller(lowH, highH));
    const float leavesH = larger(lowH, highH);
    const float t = smaller(smaller(larger(lowU, highU), larger(lowV, highV)), leavesH);
    const float u = startU + t * stepU, v = startV + t * stepV, h = startH + t * stepH;
    const bool across = leavesH <= t;
    met.t[i] = t;
    met.u[i] = smaller(larger(u, 0.0f), 1.0f);
    met.v[i] = smaller(larger(v, 0.0f), 1.0f);
    met.share[i] = across ? 0.0f : smaller(larger(h, 0.0f), 1.0f);
    met.on[i] = (from <= t) & (t > 0.0f) & (t < rays.t[i]) & !(across & (stepH > 0.0f));
  }
  return anyOf(met.on, rays.count);
}

CATOPTRIC_INLINE void projectBody(const std::array<Vec4, 4>& rows, float size, const RayBatch& rays,
                                  MapRays& map) {
  const Vec4 a = rows[0], b = rows[1], g = rows[2], w = rows[3];
  const std::size_t count = wholeVectors(rays.count);
  CATOPTRIC_INDEPENDENT
  for (std::size_t i = 0; i < count; ++i) {
    const float ox = rays.origin.x[i], oy = rays.origin.y[i], oz = rays.origin.z[i];
    const float dx = rays.direction.x[i], dy = rays.direction.y[i], dz = rays.direction.z[i];
    const float startU = a.x * ox + a.y * oy + a.z * oz + a.w,
                stepU = a.x * dx + a.y * dy + a.z * dz;
    const float startV = b.x * ox + b.y * oy + b.z * oz + b.w,
                stepV = b.x * dx + b.y * dy + b.z * dz;
    const float startG = g.x * ox + g.y * oy + g.z * oz + g.w,
                stepG = g.x * dx + g.y * dy + g.z * dz;
    const float startW = w.x * ox + w.y * oy + w.z * oz + w.w,
                stepW = w.x * dx + w.y * dy + w.z * dz;
    float tFrom = 0.0f;
    float tTo = kFar;
    // All six are start + t step >= 0; u, v, g: and w minus them
    const auto clip = [&](float start, float step) {
      const float t = -start / step;
      const float never = start < 0.0f ? -1.0f : kFar;
      const float leaves = step < 0.0f ? t : kFar;
      tFrom = larger(tFrom, step > 0.0f ? t : 0.0f);
      tTo = smaller(tTo, step == 0.0f ? never : leaves);
    };
    clip(startU, stepU);
    clip(startW - startU, stepW - stepU);
    clip(startV, stepV);
    clip(startW - startV, stepW - stepV);
    clip(startG, stepG);
    clip(startW - startG, stepW - stepG);
    const float wFrom = startW + tFrom * stepW;
    const float wTo = startW + tTo * stepW;
    const float perFrom = size / wFrom;
    const float perTo = size / wTo;
    map.fromX[i] = (startU + tFrom * stepU) * perFrom;
    map.fromY[i] = (startV + tFrom * stepV) * perFrom;
    map.fromG[i] = (startG + tFrom * stepG) / wFrom;
    map.toX[i] = (startU + tTo * stepU) * perTo;
    map.toY[i] = (startV + tTo * stepV) * perTo;
    map.toG[i] = (startG + tTo * stepG) / wTo;
    map.tFrom[i] = tFrom;
    map.tTo[i] = tTo;
    map.wFrom[i] = wFrom;
    map.wTo[i] = wTo;
    map.on[i] = (tFrom < tTo) & (tTo < 1e29f) & (wFrom > 0.0f) & (wTo > 0.0f) & (tFrom < rays.t[i]);
  }
}

/// To 2e-5.
CATOPTRIC_INLINE float log2Of(float x) {
  const auto bits = std::bit_cast<std::int32_t>(x);
  const auto exponent = static_cast<float>((bits >> 23) - 127);
  const auto mantissa = std::bit_cast<float>((bits & 0x7FFFFF) | 0x3F800000);
  const float s = (mantissa - 1.0f) / (mantissa + 1.0f);
  const float s2 = s * s;
  return exponent + 2.8853901f * s * (1.0f + s2 * (0.33333333f + s2 * (0.2f + s2 * 0.14285714f)));
}

CATOPTRIC_INLINE void levelsBody(float spreadPerTexel, const Lane& width, const Lane& slant,
                                 LookUps& at) {
  const std::size_t count = wholeVectors(at.count);
  CATOPTRIC_INDEPENDENT
  for (std::size_t i = 0; i < count; ++i) {
    const float wide = spreadPerTexel * width[i];
    const float s = larger(0.05f, std::abs(slant[i]));
    at.level[i] = larger(0.0f, 0.5f * log2Of(larger(1e-30f, wide * wide / s)));
  }
}

using Floats8 = Lanes<float, 8>;

/// Two texels of four half floats. What is no normal half float becomes 0 (denormals are,
/// parallelFor()).
CATOPTRIC_INLINE Floats8 halves(const std::uint16_t* from) {
  const auto raw = load<Lanes<std::int16_t, 8>>(from);
  const auto bits = (__builtin_convertvector(raw, Lanes<std::int32_t, 8>) << 13) &
                    static_cast<std::int32_t>(0x8FFFE000);
  return load<Floats8>(&bits) * 0x1p112f;
}

/// At a place in texels of a level with its border.
CATOPTRIC_INLINE Floats4 bilinear(const std::uint16_t* level, std::size_t side, float x, float y) {
  const auto column = static_cast<int>(x);
  const auto row = static_cast<int>(y);
  const float fx = x - static_cast<float>(column);
  const float fy = y - static_cast<float>(row);
  const std::uint16_t* const upper =
      level + 4 * (static_cast<std::size_t>(row) * side + static_cast<std::size_t>(column));
  const Floats8 above = halves(upper);
  const Floats8 below = halves(upper + 4 * side);
  const Floats8 left = __builtin_shufflevector(above, below, 0, 1, 2, 3, 8, 9, 10, 11);
  const Floats8 right = __builtin_shufflevector(above, below, 4, 5, 6, 7, 12, 13, 14, 15);
  const Floats8 rows = left + fx * (right - left);
  const Floats4 top = __builtin_shufflevector(rows, rows, 0, 1, 2, 3);
  const Floats4 bottom = __builtin_shufflevector(rows, rows, 4, 5, 6, 7);
  return top + fy * (bottom - top);
}

CATOPTRIC_INLINE Floats4 ofLevel(const HalfImage& image, std::size_t k, float u, float v) {
  const HalfLevel& level = image.levels()[k];
  const auto size = static_cast<float>(level.size);
  // u and v are in 0..1: the border is never left
  return bilinear(image.values() + level.first, static_cast<std::size_t>(level.size) + 2,
                  u * size + 0.5f, v * size + 0.5f);
}

/// Asks for the texels of a look-up before they are used.
CATOPTRIC_INLINE void prefetch(const HalfImage& image, std::size_t k, float u, float v) {
  const HalfLevel& level = image.levels()[k];
  const auto size = static_cast<float>(level.size);
  const std::size_t side = static_cast<std::size_t>(level.size) + 2;
  const auto column = static_cast<std::size_t>(static_cast<int>(u * size + 0.5f));
  const auto row = static_cast<std::size_t>(static_cast<int>(v * size + 0.5f));
  const std::uint16_t* const upper = image.values() + level.first + 4 * (row * side + column);
  __builtin_prefetch(upper);
  __builtin_prefetch(upper + 4 * side);
}

CATOPTRIC_INLINE void lookUpBody(const HalfImage& image, LookUps& at) {
  const std::size_t last = image.levels().size() - 1;
  const auto levelOf = [&](std::size_t i) {
    return smaller(at.level[i], static_cast<float>(last));
  };
  constexpr std::size_t kAhead = 32;  ///< look-ups; ours
  const auto prefetchOf = [&](std::size_t i) {
    if (i >= at.count) return;
    const auto k = static_cast<std::size_t>(static_cast<int>(levelOf(i)));
    prefetch(image, k, at.u[i], at.v[i]);
    prefetch(image, k < last ? k + 1 : last, at.u[i], at.v[i]);
  };
  for (std::size_t i = 0; i < kAhead; ++i) prefetchOf(i);
  for (std::size_t i = 0; i < at.count; ++i) {
    prefetchOf(i + kAhead);
    const float level = levelOf(i);
    const auto k = static_cast<std::size_t>(static_cast<int>(level));
    const float f = level - static_cast<float>(k);
    Floats4 color = ofLevel(image, k, at.u[i], at.v[i]);
    if (f > 0.0f) color += f * (ofLevel(image, k + 1, at.u[i], at.v[i]) - color);
    at.color.x[i] = color[0];
    at.color.y[i] = color[1];
    at.color.z[i] = color[2];
    at.alpha[i] = color[3];
  }
}

/// Where a direction meets a cube: face, and place in texels of a level with its border.
struct CubePlaces {
  alignas(64) Lane face, x, y;
};
CATOPTRIC_INLINE void placeOnCube(const EnvironmentLookUps& at, const Vec3& centre, int size,
                                  bool leaving, CubePlaces& places) {
  const float half = 0.5f * static_cast<float>(size);
  const std::size_t count = wholeVectors(at.count);
  CATOPTRIC_INDEPENDENT
  for (std::size_t i = 0; i < count; ++i) {
    const float closed = leaving ? 1.0f : at.closed[i];
    const float ahead = at.t[i] > 0.0f ? at.t[i] : kFar;
    const float t = closed > 0.999f ? ahead : kFar;
    const float dx = at.direction.x[i], dy = at.direction.y[i], dz = at.direction.z[i];
    const float placeX = at.origin.x[i] + t * dx - centre.x;
    const float placeY = at.origin.y[i] + t * dy - centre.y;
    const float placeZ = at.origin.z[i] + t * dz - centre.z;
    const float x = t < kFar ? placeX : dx;
    const float y = t < kFar ? placeY : dy;
    const float z = t < kFar ? placeZ : dz;
    const float ax = std::abs(x), ay = std::abs(y), az = std::abs(z);
    const float longest = larger(ax, larger(ay, az));
    const float notX = ay >= longest ? y : z;
    const float major = ax >= longest ? x : notX;
    const float sign = major < 0.0f ? -1.0f : 1.0f;
    const float sideS = ay >= longest ? x : x * sign;
    const float sideV = ay >= longest ? z * sign : -y;
    const float sideBase = ay >= longest ? 2.0f : 4.0f;
    const float s = ax >= longest ? -z * sign : sideS;
    const float v = ax >= longest ? -y : sideV;
    const float base = ax >= longest ? 0.0f : sideBase;
    const float inverse = half / larger(std::abs(major), 1e-30f);
    const float limit = 2.0f * half + 0.5f;
    places.face[i] = base + (0.5f - 0.5f * sign);
    places.x[i] = smaller(larger(s * inverse + half + 0.5f, 0.5f), limit);
    places.y[i] = smaller(larger(v * inverse + half + 0.5f, 0.5f), limit);
  }
}

CATOPTRIC_INLINE Floats4 ofCube(const HalfCube& cube, const HalfLevel& level,
                                const CubePlaces& places, std::size_t i) {
  const auto side = static_cast<std::size_t>(level.size) + 2;
  const auto face = static_cast<std::size_t>(static_cast<int>(places.face[i]));
  return bilinear(cube.values() + level.first + 4 * face * side * side, side, places.x[i],
                  places.y[i]);
}

CATOPTRIC_INLINE void environmentBody(const Surroundings& around, EnvironmentLookUps& at) {
  const Vec3 least = around.least, most = around.most;
  const std::size_t count = wholeVectors(at.count);
  CATOPTRIC_INDEPENDENT
  for (std::size_t i = 0; i < count; ++i) {
    const float ox = at.origin.x[i], oy = at.origin.y[i], oz = at.origin.z[i];
    const float dx = at.direction.x[i], dy = at.direction.y[i], dz = at.direction.z[i];
    const float x = larger((least.x - ox) / dx, (most.x - ox) / dx);
    const float y = larger((least.y - oy) / dy, (most.y - oy) / dy);
    const float z = larger((least.z - oz) / dz, (most.z - oz) / dz);
    at.t[i] = smaller(smaller(x, y), z);
    at.closed[i] = 0.0f;
  }
  const HalfCube& cube = *around.cube;
  CubePlaces places;
  if (cube.mostCoverage() > 0.999f) {
    placeOnCube(at, around.centre, cube.coarse().size, true, places);
    for (std::size_t i = 0; i < at.count; ++i)
      at.closed[i] = ofCube(cube, cube.coarse(), places, i)[3];
  }
  placeOnCube(at, around.centre, cube.fine().size, false, places);
  for (std::size_t i = 0; i < at.count; ++i) {
    const Floats4 color = ofCube(cube, cube.fine(), places, i);
    at.color.x[i] = color[0];
    at.color.y[i] = color[1];
    at.color.z[i] = color[2];
  }
}

}  // namespace

void aim(const trace::SampleCamera& camera, const Samples& samples, RayBatch& rays) {
  atVectorLevel<aimBody>(camera, samples, rays);
}
RayBounds bound(const RayBatch& rays) {
  return atVectorLevel<boundBody>(rays);
}
float farthest(const RayBatch& rays) {
  return atVectorLevel<farthestBody>(rays);
}
bool meetQuad(const QuadLines& quad, const RayBatch& rays, Meetings& met) {
  return atVectorLevel<meetQuadBody>(quad, rays, met);
}
bool meetBox(const QuadLines& quad, float height, const RayBatch& rays, Meetings& met) {
  return atVectorLevel<meetBoxBody>(quad, height, rays, met);
}
void project(const std::array<Vec4, 4>& rows, float size, const RayBatch& rays, MapRays& map) {
  atVectorLevel<projectBody>(rows, size, rays, map);
}
void levels(float spreadPerTexel, const Lane& width, const Lane& slant, LookUps& at) {
  atVectorLevel<levelsBody>(spreadPerTexel, width, slant, at);
}
void lookUp(const HalfImage& image, LookUps& at) {
  atVectorLevel<lookUpBody>(image, at);
}
void environment(const Surroundings& around, EnvironmentLookUps& at) {
  atVectorLevel<environmentBody>(around, at);
}

}  // namespace catoptric::methods::impostors
