#include "methods/depth_impostors/search.h"

#include <algorithm>
#include <cmath>

#include "core/minmax.h"
#include "core/vector_versions.h"
#include "methods/shared/impostors/shaders/constants.h"

// Plain loops that the compiler turns into vector code, as in ../shared/impostors/ray_loops.cpp.
namespace catoptric::methods::depth_impostors {
namespace {

using impostors::MapRays;

constexpr float kNone = 2.0f;    ///< a share that is none
constexpr float kSlack = 1e-4f;  ///< neighbouring segments leave no gap
constexpr std::size_t kBlock = 8;

/// Of half turns in 0..1, times `n`, to 1e-5 rad.
CATOPTRIC_INLINE float directionOf(float dx, float dy, float n) {
  const float ax = std::abs(dx), ay = std::abs(dy);
  const bool steep = ay > ax;
  const float most = steep ? ay : ax;
  const float r = (steep ? ax : ay) / (most > 1e-20f ? most : 1e-20f);
  const float r2 = r * r;
  const float angle =
      r * (0.99997726f +
           r2 * (-0.33262347f +
                 r2 * (0.19354346f + r2 * (-0.11643287f + r2 * (0.05265332f - r2 * 0.01172120f)))));
  const float quarter = steep ? 0.5f * kPi - angle : angle;
  const bool falls = (dx < 0.0f) != (dy < 0.0f);
  return (falls ? kPi - quarter : quarter) * (n / kPi);
}

/// The line of a domain that is nearest to the middle of a ray's projection.
CATOPTRIC_INLINE const Point* lineOf(const MapLines& lines, const Domain& domain,
                                     const MapRays& rays, std::size_t i) {
  const float middleX = 0.5f * (rays.fromX[i] + rays.toX[i]);
  const float middleY = 0.5f * (rays.fromY[i] + rays.toY[i]);
  const float minor =
      domain.alongX ? middleY - domain.slope * middleX : middleX - domain.slope * middleY;
  const int row =
      std::clamp(static_cast<int>(std::floor(minor)) - domain.first, 0, domain.count - 1);
  return lines.first +
         static_cast<std::size_t>(domain.offset + row) * static_cast<std::size_t>(lines.points);
}

/// The nearest place where a ray crosses a line, as a share of the ray's projection; of one of
/// `kSeveral` maps the nearest where it passes behind the line.
template <bool kSeveral>
CATOPTRIC_INLINE float crossesLine(const Point* line, int points, bool alongX, const MapRays& rays,
                                   std::size_t i) {
  const float az = rays.fromG[i];
  const float from = alongX ? rays.fromX[i] : rays.fromY[i];
  const float dx = (alongX ? rays.toX[i] : rays.toY[i]) - from;
  const float dz = rays.toG[i] - az;
  const int segments = points - 1;
  float nearest = kNone;
  float hidden = kNone;
  for (int block = 0; block < segments; block += static_cast<int>(kBlock)) {
    const float* const p = &line[block].x;
    alignas(32) std::array<float, kBlock> shares;
    alignas(32) std::array<float, kBlock> behind;
    CATOPTRIC_INDEPENDENT
    for (std::size_t k = 0; k < kBlock; ++k) {
      const float px = std::abs(p[2 * k]), pz = p[2 * k + 1];
      const float qx = p[2 * k + 2], qz = p[2 * k + 3];
      const float ex = qx - px, ez = qz - pz;
      const float fx = px - from, fz = pz - az;
      const float det = dx * ez - dz * ex;
      const float inverse = 1.0f / det;
      const float share = (fx * ez - fz * ex) * inverse;
      const float other = (fx * dz - fz * dx) * inverse;
      const bool meets = (qx > 0.0f) & (share >= 0.0f) & (share <= 1.0f) & (other >= -kSlack) &
                         (other <= 1.0f + kSlack) & (block + static_cast<int>(k) < segments);
      shares[k] = meets ? share : kNone;
      if constexpr (kSeveral) {
        // From the front a ray crosses what rises over it; else it is behind, as in the middle of
        // what the ray covers of a segment
        const bool front = (det > 0.0f) & (std::abs(ez) <= rays.steepest * ex);
        const float low = larger(px, smaller(from, from + dx));
        const float high = smaller(qx, larger(from, from + dx));
        const float middle = 0.5f * (low + high);
        const float s = (middle - from) / dx;
        const float above = (az + s * dz - pz) * ex - (middle - px) * ez;
        const bool under =
            (qx > 0.0f) & (low <= high) & (above < 0.0f) & (block + static_cast<int>(k) < segments);
        behind[k] = under ? s : kNone;
        behind[k] = (meets & !front & (share < behind[k])) ? share : behind[k];
        shares[k] = front ? shares[k] : kNone;
      }
    }
    for (std::size_t half = kBlock / 2; half > 0; half /= 2)
      for (std::size_t k = 0; k < half; ++k)
        shares[k] = shares[k + half] < shares[k] ? shares[k + half] : shares[k];
    nearest = shares[0] < nearest ? shares[0] : nearest;
    if constexpr (kSeveral)
      for (std::size_t k = 0; k < kBlock; ++k) hidden = behind[k] < hidden ? behind[k] : hidden;
  }
  if (kSeveral && hidden < nearest) return impostors::shared::kHidden + hidden;
  return nearest;
}

CATOPTRIC_INLINE void searchBody(const MapLines& lines, bool twoRows, MapRays& rays) {
  const auto n = static_cast<int>(lines.domains.size());
  alignas(64) impostors::Lane turns;
  CATOPTRIC_INDEPENDENT
  for (std::size_t i = 0; i < impostors::kMostRays; ++i)
    turns[i] = directionOf(rays.toX[i] - rays.fromX[i], rays.toY[i] - rays.fromY[i],
                           static_cast<float>(n));
  const auto domainOf = [&](std::size_t i, int more) -> const Domain& {
    const int d = static_cast<int>(twoRows ? turns[i] : turns[i] + 0.5f) + more;
    return lines.domains[static_cast<std::size_t>(d >= n ? d - n : d)];
  };
  // Lines lie anywhere in memory: all are asked for before the first is used
  for (int more = 0; more <= (twoRows ? 1 : 0); ++more) {
    std::array<const Point*, impostors::kMostRays> asked;
    for (std::size_t i = 0; i < rays.count; ++i) {
      asked[i] = lineOf(lines, domainOf(i, more), rays, i);
      __builtin_prefetch(asked[i]);
      __builtin_prefetch(asked[i] + kBlock - 1);
    }
    for (std::size_t i = 0; i < rays.count; ++i) {
      const bool alongX = domainOf(i, more).alongX;
      const float share = rays.steepest > 0.0f
                              ? crossesLine<true>(asked[i], lines.points, alongX, rays, i)
                              : crossesLine<false>(asked[i], lines.points, alongX, rays, i);
      if (more == 0) {
        rays.at[i] = share;
        continue;
      }
      // DEVIATION: the paper leaves it to the future and does not say how
      const float one = rays.at[i];
      const float f = turns[i] - static_cast<float>(static_cast<int>(turns[i]));
      const bool both = one <= 1.0f && share <= 1.0f;
      rays.at[i] = both ? one + f * (share - one) : f < 0.5f ? one : share;
    }
  }
}

/// Where two segments of a plane meet, as a share of the first; kNone where they do not.
CATOPTRIC_INLINE float crossing(const Vec2& a, const Vec2& b, const Vec2& p, const Vec2& q) {
  const Vec2 d = b - a, e = q - p, f = p - a;
  const float det = d.x * e.y - d.y * e.x;
  const float share = (f.x * e.y - f.y * e.x) / det;
  const float other = (f.x * d.y - f.y * d.x) / det;
  const bool meet = (det != 0.0f) & (share >= 0.0f) & (share <= 1.0f) & (other >= -kSlack) &
                    (other <= 1.0f + kSlack);
  return meet ? share : kNone;
}

/// Numbers of texels.
struct Texels {
  std::uint64_t walked = 0;
  std::uint64_t along = 0;  ///< on the whole stretches
};

/// A ray's way over texels: whole, or so many texels about a share of it.
struct Stretch {
  float around = 0.0f;
  int reach = -1;  ///< negative: whole
};

/// The first crossing on a stretch, as a share of the ray; kNone where there is none.
CATOPTRIC_INLINE float walkRay(const MapTexels& texels, const MapRays& rays, std::size_t i,
                               Stretch stretch, Texels& count, bool& seesAny) {
  const int size = texels.across.size();
  Vec2 from(rays.fromX[i], rays.fromY[i]);
  Vec2 to(rays.toX[i], rays.toY[i]);
  const bool alongX = std::abs(to.x - from.x) >= std::abs(to.y - from.y);
  const Columns& columns = alongX ? texels.across : texels.down;
  if (!alongX) {
    std::swap(from.x, from.y);
    std::swap(to.x, to.y);
  }
  const float slope = std::abs(to.x - from.x) > 1e-4f ? (to.y - from.y) / (to.x - from.x) : 0.0f;
  const bool onwards = to.x >= from.x;
  // Texels whose centres bracket the projection
  const auto texel = [&](float x, int more) {
    return std::clamp(static_cast<int>(std::floor(x - 0.5f)) + more, 0, size - 1);
  };
  int first = texel(std::min(from.x, to.x), 0);
  int last = texel(std::max(from.x, to.x), 1);
  if (stretch.reach >= 0) {
    const float middle = from.x + stretch.around * (to.x - from.x);
    first = std::max(first, texel(middle, -stretch.reach));
    last = std::min(last, texel(middle, stretch.reach + 1));
  }
  count.along += static_cast<std::uint64_t>(std::max(0, last - first + 1));
  int at = onwards ? first : last;
  const int end = onwards ? last : first;
  const int step = onwards ? 1 : -1;
  const Vec2 rayFrom(from.x, rays.fromG[i]);
  const Vec2 rayTo(to.x, rays.toG[i]);
  Vec2 before(0.0f);
  bool wasOn = false;
  bool alone = false;  // a span of one texel
  float share = kNone;
  const bool several = rays.steepest > 0.0f;
  seesAny = false;
  while (true) {
    const bool past = (at - end) * step > 0;
    const float place = static_cast<float>(at) + 0.5f;
    const float g = past ? 0.0f : columns.at(at, from.y + slope * (place - from.x));
    const bool on = g > 0.0f;
    seesAny |= on;
    if (wasOn && (on || alone)) {
      const Vec2 p = !on ? Vec2(before.x - 0.499f, before.y) : before;
      const Vec2 q = !on ? Vec2(before.x + 0.499f, before.y) : Vec2(place, g);
      share = crossing(rayFrom, rayTo, p, q);
      if (several && share <= 1.0f && std::abs(q.y - p.y) > rays.steepest)
        return impostors::shared::kHidden + share;
    }
    if (several && on && !(share <= 1.0f)) {
      const float s = std::clamp((place - from.x) / (to.x - from.x), 0.0f, 1.0f);
      if (rayFrom.y + s * (rayTo.y - rayFrom.y) < g) return impostors::shared::kHidden + s;
    }
    if (past || share <= 1.0f) return share;
    ++count.walked;
    alone = on && !wasOn;
    wasOn = on;
    before = Vec2(place, g);
    at += step;
  }
}

CATOPTRIC_INLINE std::uint64_t walkBody(const MapTexels& texels, MapRays& rays) {
  Texels count;
  bool seesAny = false;
  for (std::size_t i = 0; i < rays.count; ++i)
    rays.at[i] = walkRay(texels, rays, i, {}, count, seesAny);
  rays.texels = count.along;
  return count.walked;
}

CATOPTRIC_INLINE std::uint64_t refineBody(const MapTexels& texels, int reach, MapRays& rays) {
  Texels count;
  for (std::size_t i = 0; i < rays.count; ++i) {
    if (!(rays.at[i] <= 1.0f)) continue;
    bool seesAny = false;
    const float share = walkRay(texels, rays, i, {rays.at[i], reach}, count, seesAny);
    if (share <= 1.0f || share >= impostors::shared::kHidden || !seesAny) rays.at[i] = share;
  }
  return count.walked;
}

}  // namespace

std::uint64_t searchLines(const MapLines& lines, bool twoRows, MapRays& rays) {
  atVectorLevel<searchBody>(lines, twoRows, rays);
  return rays.count * static_cast<std::uint64_t>(lines.points - 1) * (twoRows ? 2 : 1);
}

std::uint64_t walkTexels(const MapTexels& texels, MapRays& rays) {
  return atVectorLevel<walkBody>(texels, rays);
}

std::uint64_t refineHits(const MapTexels& texels, int reach, MapRays& rays) {
  return atVectorLevel<refineBody>(texels, reach, rays);
}

}  // namespace catoptric::methods::depth_impostors
