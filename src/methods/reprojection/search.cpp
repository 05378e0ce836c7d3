#include "methods/reprojection/search.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/basis.h"

namespace catoptric::methods::reprojection {
namespace {

/// Longest step of the descent, in samples: reflections are linear over less than that (ours).
constexpr float kLongestStep = 24.0f;
/// A step as short as that ends the descent: the linear model is about its own sample then.
constexpr float kShortStep = 0.75f;
/// Two directions across a ray, in which misses are measured.
struct Across {
  Vec3 a, b;
  explicit Across(const Vec3& direction) : a(0.0f), b(0.0f) {
    const Basis basis(direction);
    a = basis.x;
    b = basis.y;
  }
};

/// The tangents of the angle between the ray and a place, in two directions; none behind it.
bool angleOff(const MirrorRay& ray, const Across& across, const Vec4& place, Vec2& off) {
  const Vec3 way = place.w > 0.0f ? Vec3(place) - ray.origin : Vec3(place);
  const float along = glm::dot(ray.direction, way);
  if (!(along > 0.0f)) return false;
  off = Vec2(glm::dot(across.a, way), glm::dot(across.b, way)) / along;
  return true;
}

/// The side, 1 or -1, on which sample (x, y) has a neighbour along an axis that shows the same
/// surface; 0: on neither.
int besideOf(const KeyFrame& key, int x, int y, int axis, float epsilon) {
  for (const int side : {1, -1}) {
    const int nx = x + (axis == 0 ? side : 0);
    const int ny = y + (axis == 1 ? side : 0);
    if (key.inside(nx, ny) && key.continuous(key.index(x, y), key.index(nx, ny), epsilon))
      return side;
  }
  return 0;
}

/// d(off)/dk about sample (x, y), by one neighbour along each axis that shows the same surface.
bool slopes(const KeyFrame& key, const MirrorRay& ray, const Across& across, int x, int y,
            const Vec2& off, float epsilon, glm::mat2& jacobian) {
  // All four samples of a cell have such neighbours; else they are looked for.
  const bool inCell = key.cells()[key.index(x, y)] != 0;
  for (int axis = 0; axis < 2; ++axis) {
    const int side = inCell ? 1 : besideOf(key, x, y, axis, epsilon);
    Vec2 there;
    if (side == 0 ||
        !angleOff(ray, across,
                  key.place(key.index(x + (axis == 0 ? side : 0), y + (axis == 1 ? side : 0))),
                  there))
      return false;
    jacobian[axis] = static_cast<float>(side) * (there - off);
  }
  const float determinant = glm::determinant(jacobian);
  const float size =
      std::max(glm::dot(jacobian[0], jacobian[0]), glm::dot(jacobian[1], jacobian[1]));
  return std::isfinite(determinant) && std::abs(determinant) > 1e-6f * size && size > 0.0f;
}

/// (x, y) of the sample nearest to a place that is not farther than half a sample outside.
bool nearestSample(const KeyFrame& key, const Vec2& place, int& x, int& y) {
  if (!(place.x > -0.5f && place.y > -0.5f && place.x < static_cast<float>(key.width()) - 0.5f &&
        place.y < static_cast<float>(key.height()) - 0.5f))
    return false;
  x = static_cast<int>(std::floor(place.x + 0.5f));
  y = static_cast<int>(std::floor(place.y + 0.5f));
  return key.inside(x, y);
}

/// The paper's step [Xie2017] Alg. 2, where a sample has no neighbour to take a slope from: to the
/// best of the eight around it, if that is better.
bool stepDown(const KeyFrame& key, const MirrorRay& ray, const Across& across, float miss, int& x,
              int& y) {
  const int fromX = x;
  const int fromY = y;
  bool better = false;
  for (int ny = fromY - 1; ny <= fromY + 1; ++ny)
    for (int nx = fromX - 1; nx <= fromX + 1; ++nx) {
      Vec2 off;
      if (!key.inside(nx, ny) || key.reflector(key.index(nx, ny)) != ray.reflector ||
          !angleOff(ray, across, key.place(key.index(nx, ny)), off) || !(glm::dot(off, off) < miss))
        continue;
      miss = glm::dot(off, off);
      x = nx;
      y = ny;
      better = true;
    }
  return better;
}

/// The four samples about a place, and their bilinear weights.
struct Taps {
  bool inside = false;
  std::array<std::size_t, 4> at{};
  std::array<float, 4> weight{};
};
Taps tapsOf(const KeyFrame& key, const Vec2& place) {
  Taps taps;
  const Vec2 corner = glm::floor(place);
  const int x = static_cast<int>(corner.x);
  const int y = static_cast<int>(corner.y);
  taps.inside = key.inside(x, y) && key.inside(x + 1, y + 1);
  if (!taps.inside) return taps;
  const Vec2 f = place - corner;
  taps.at = {key.index(x, y), key.index(x + 1, y), key.index(x, y + 1), key.index(x + 1, y + 1)};
  taps.weight = {(1.0f - f.x) * (1.0f - f.y), f.x * (1.0f - f.y), (1.0f - f.x) * f.y, f.x * f.y};
  return taps;
}

/// Whether all four show one continuous surface in the reflector.
bool continuousTaps(const KeyFrame& key, std::uint32_t reflector, const Taps& taps) {
  return key.cells()[taps.at[0]] >> 1U == reflector;
}

/// One more step, from what is shown between the samples: the first one took a line through two of
/// them for the truth. Beyond a rim, where the way goes on as a parabola, two.
void refine(const KeyFrame& key, const MirrorRay& ray, const Across& across,
            const glm::mat2& jacobian, const Options& options, Match& match) {
  Vec2& place = match.place;
  int turns = 1;
  for (int turn = 0; turn < turns; ++turn) {
    const Taps taps = tapsOf(key, place);
    if (!taps.inside) return;
    Vec4 shown(0.0f);
    if (continuousTaps(key, ray.reflector, taps)) {
      for (int i = 0; i < 4; ++i) shown += taps.weight[i] * key.place(taps.at[i]);
    } else {
      const Lookup lookup = lookUp(key, ray.reflector, place, options);
      if (lookup.outcome != Outcome::Found) return;
      shown = lookup.place;
      turns = 2;
    }
    Vec2 off;
    if (!angleOff(ray, across, shown, off)) return;
    const Vec2 move = -(glm::inverse(jacobian) * off);
    if (!(std::max(std::abs(move.x), std::abs(move.y)) <= kShortStep)) return;
    match.miss = glm::length(move);
    place += move;
  }
}

}  // namespace

Match search(const KeyFrame& key, const MirrorRay& ray, const Vec2& start, const Options& options) {
  const Across across(ray.direction);
  Match match{start, Outcome::NotFound};
  int x = 0;
  int y = 0;
  if (!nearestSample(key, start, x, y)) return match;
  float best = std::numeric_limits<float>::infinity();
  float longest = kLongestStep;
  for (int step = 0; step < kMostSearchSteps; ++step) {
    const std::size_t at = key.index(x, y);
    Vec2 off;
    glm::mat2 jacobian;
    if (key.reflector(at) != ray.reflector || !angleOff(ray, across, key.place(at), off))
      return match;
    // Stop on a plateau: the print would go round in circles there (Algorithm 2, line 11).
    const float miss = glm::dot(off, off);
    if (!(miss < best)) {
      if (longest < 1.0f) return match;
      longest *= 0.5f;
    }
    best = std::min(best, miss);
    if (!slopes(key, ray, across, x, y, off, options.epsilon, jacobian)) {
      if (!stepDown(key, ray, across, miss, x, y)) return match;
      continue;
    }
    Vec2 move = -(glm::inverse(jacobian) * off);
    const float length = std::max(std::abs(move.x), std::abs(move.y));
    if (length <= kShortStep) {
      match = {Vec2(static_cast<float>(x), static_cast<float>(y)) + move, Outcome::Found,
               key.shown(at) != 0 ? key.length(at) : std::numeric_limits<float>::infinity()};
      if (options.refine) refine(key, ray, across, jacobian, options, match);
      return match;
    }
    if (!(length <= longest)) move *= longest / length;
    const Vec2 next = Vec2(static_cast<float>(x), static_cast<float>(y)) + move;
    if (!std::isfinite(next.x) || !std::isfinite(next.y) || !nearestSample(key, next, x, y))
      return match;
  }
  return match;
}

namespace {

/// What is shown at a place beside its nearest sample, from that one's neighbours on the side where
/// they show the same surface: by a parabola along each axis where there are two of them. A line is
/// off by three times as much beyond the rim as between samples.
bool goOn(const KeyFrame& key, const Vec2& at, float epsilon, Vec4& place) {
  const int x = static_cast<int>(std::floor(at.x + 0.5f));
  const int y = static_cast<int>(std::floor(at.y + 0.5f));
  const Vec2 beside = at - Vec2(static_cast<float>(x), static_cast<float>(y));
  const Vec4 here = key.place(key.index(x, y));
  place = here;
  std::array<int, 2> side{};
  for (int axis = 0; axis < 2; ++axis) {
    side[axis] = besideOf(key, x, y, axis, epsilon);
    if (side[axis] == 0) return false;
    const int dx = axis == 0 ? side[axis] : 0;
    const int dy = axis == 1 ? side[axis] : 0;
    const std::size_t next = key.index(x + dx, y + dy);
    const float t = static_cast<float>(side[axis]) * beside[axis];
    place += t * (key.place(next) - here);
    if (key.inside(x + 2 * dx, y + 2 * dy)) {
      const std::size_t after = key.index(x + 2 * dx, y + 2 * dy);
      if (key.continuous(next, after, epsilon))
        place += 0.5f * t * (t - 1.0f) * (key.place(after) - 2.0f * key.place(next) + here);
    }
  }
  const std::size_t nextX = key.index(x + side[0], y);
  const std::size_t nextY = key.index(x, y + side[1]);
  const std::size_t corner = key.index(x + side[0], y + side[1]);
  if (key.continuous(nextX, corner, epsilon) && key.continuous(nextY, corner, epsilon))
    place += static_cast<float>(side[0] * side[1]) * beside.x * beside.y *
             (key.place(corner) - key.place(nextX) - key.place(nextY) + here);
  return true;
}

/// Of four samples about a place some may show nothing of the reflector: they lie off its rim, or
/// are glossy. Less than half a sample beyond the others they stand for
/// the place. Where one of them shows that a surface ends there, that is left to Options::edges.
Lookup beyondRim(const KeyFrame& key, std::uint32_t reflector, const Vec2& place,
                 const std::array<std::size_t, 4>& at, const std::array<float, 4>& weight,
                 const Options& options) {
  const Lookup none;
  const int nearest =
      static_cast<int>(std::max_element(weight.begin(), weight.end()) - weight.begin());
  if (key.reflector(at[nearest]) != reflector) return none;
  Lookup result;
  float sum = 0.0f;
  for (int i = 0; i < 4; ++i) {
    if (key.reflector(at[i]) != reflector) continue;
    if (!key.continuous(at[nearest], at[i], options.epsilon)) {
      if (options.edges == Edges::Nearest) continue;
      return none;
    }
    sum += weight[i];
    result.radiance += weight[i] * key.radiance(at[i]);
  }
  result.radiance /= sum;
  if (!goOn(key, place, options.epsilon, result.place)) return none;
  result.outcome = Outcome::Found;
  return result;
}

}  // namespace

Lookup lookUp(const KeyFrame& key, std::uint32_t reflector, const Vec2& place,
              const Options& options) {
  Lookup result;
  const Vec2 rounded = glm::floor(place + 0.5f);
  const Vec2 beside = glm::abs(place - rounded);
  if (std::max(beside.x, beside.y) <= kSnap) {
    const int x = static_cast<int>(rounded.x);
    const int y = static_cast<int>(rounded.y);
    if (!key.inside(x, y) || key.reflector(key.index(x, y)) != reflector) return result;
    const std::size_t at = key.index(x, y);
    return {key.radiance(at), key.place(at), Outcome::Found};
  }
  const Taps taps = tapsOf(key, place);
  if (!taps.inside) return result;
  if (!continuousTaps(key, reflector, taps))
    return beyondRim(key, reflector, place, taps.at, taps.weight, options);
  for (int i = 0; i < 4; ++i) {
    result.radiance += taps.weight[i] * key.radiance(taps.at[i]);
    result.place += taps.weight[i] * key.place(taps.at[i]);
  }
  result.outcome = Outcome::Found;
  return result;
}

float missBy(const KeyFrame& key, const MirrorRay& ray, const Vec2& at, const Vec4& place,
             const Options& options) {
  constexpr float kFar = std::numeric_limits<float>::infinity();
  const Across across(ray.direction);
  int x = 0;
  int y = 0;
  Vec2 off;
  Vec2 here;
  glm::mat2 jacobian;
  if (!nearestSample(key, at, x, y) || !angleOff(ray, across, place, off) ||
      !angleOff(ray, across, key.place(key.index(x, y)), here) ||
      !slopes(key, ray, across, x, y, here, options.epsilon, jacobian))
    return kFar;
  const Vec2 miss = glm::inverse(jacobian) * off;
  const float length = glm::length(miss);
  return std::isfinite(length) ? length : kFar;
}

}  // namespace catoptric::methods::reprojection
