// Where a point shows by way of a sequence of reflectors: paths near it moved, or traced anew.
#include <algorithm>
#include <cmath>
#include <limits>

#include "methods/perturbation/reflector.h"
#include "scene/implicit/gradient.h"

namespace catoptric::methods::perturbation {
namespace {

/// Steps of retrace(), and the longest one as a share of the reflector's size (ours).
constexpr int kMaxSteps = 8;
constexpr double kLongestStep = 0.25;
/// A step that leads beyond what the first reflector shows of the others is halved so many times
/// (ours).
constexpr int kMaxShortenings = 2;
/// Where a point has no reflection, steps go to and fro: so many of them that miss it by no less
/// than one before end the search, unless the path refracts (ours; experiments.md).
constexpr int kMostRetreats = 2;
/// Quadratic moves of exact paths are taken instead of another step, or of a path that was traced
/// for another point, where the estimate is below this part of the error allowed (ours).
constexpr double kSmallRemainder = 0.1;
/// ... and where that point shows nearer than this, pixels (ours).
constexpr double kTracedReach = 12.0;
/// Reflections of one point nearer to each other than this part of the way between their paths are
/// one (ours): what converges does so from both sides.
constexpr double kSameReflection = 0.25;
/// Without retrace(): the mirrored ray may miss the point by this angle's sine (ours).
constexpr double kWildPerturbation = 0.05;
/// The normal where a path was moved to is known well enough from where it was (ours) when it turns
/// by less than this there, rad, and both segments leave the surface by more, cosines.
constexpr double kSmallTurn = 0.3;
constexpr double kSteep = 0.1;

}  // namespace

bool Reflector::movable(const Bounce<double>* bounces, double rho) const {
  // The bounces before the last were when the path was expanded
  return statusOf(bounces[lastTurn()], rho) == PathStatus::Regular;
}

void Reflector::move(const Bounce<double>* bounces, const double* distances, double rho,
                     const glm::dvec3& step, Places& first, Places& second) const {
  // [Chen2000] (15), (16)
  const std::size_t last = lastTurn();
  const Move<double> moved = moveOf(bounces[last], rho, vectorOf(step));
  Vector<double> linear = moved.linear;
  Vector<double> quadratic = moved.linear + moved.second;
  first[last] = pointOf(bounces[last].x + linear);
  second[last] = pointOf(bounces[last].x + quadratic);
  for (std::size_t i = last; i-- > 0;) {
    linear = moveOf(bounces[i], distances[i], linear).linear;
    const Move<double> next = moveOf(bounces[i], distances[i], quadratic);
    quadratic = next.linear + next.second;
    first[i] = pointOf(bounces[i].x + linear);
    second[i] = pointOf(bounces[i].x + quadratic);
  }
}

double Reflector::pixels(const glm::dvec3& x, double metres) const {
  return metres / (spread_ * glm::distance(x, eye_));
}

bool Reflector::retrace(const glm::dvec3& point, Places& places, Traced* traced) const {
  const std::size_t last = lastTurn();
  glm::dvec3 x = places[0];
  Path path;
  Places first;
  Places second;
  // pathBy() makes one step to the surface; guesses may need two
  if (const auto gradient = implicit::gradientAt(*turns_[0].surface, x))
    x -= implicit::valueAt(*turns_[0].surface, x) / glm::dot(*gradient, *gradient) * *gradient;
  glm::dvec3 from = x;
  int shortenings = 0;
  int retreats = 0;
  double least = std::numeric_limits<double>::infinity();
  for (int step = 0; step < kMaxSteps; ++step) {
    if (pathBy(x, path) != PathSearch::Path) {
      // A step beyond what the first reflector shows of the others
      if (last == 0 || step == 0 || shortenings++ == kMaxShortenings) return false;
      x = 0.5 * (x + from);
      continue;
    }
    from = x = path.place(0);
    shortenings = 0;
    const glm::dvec3 leaves = path.place(last);
    const double rho = std::max(0.0, glm::dot(point - leaves, path.direction));
    if (!movable(path.bounces.data(), rho)) return false;
    const glm::dvec3 away = point - (leaves + rho * path.direction);
    const double missed2 = glm::dot(away, away);
    const double sine2 = missed2 / (rho * rho + missed2);
    if (!(sine2 < least) && !refracts() && ++retreats == kMostRetreats) return false;
    least = std::min(least, sine2);
    move(path.bounces.data(), path.distances.data(), rho, away, first, second);
    // Far off, the second order makes it worse
    const double d1 = glm::distance(first[0], x);
    const double d2 = glm::distance(second[0], first[0]);
    const bool far = d2 > 0.5 * d1;
    places = far ? first : second;
    glm::dvec3 way = places[0] - x;
    const double length = glm::length(way);
    if (!std::isfinite(length)) return false;
    const double longest = kLongestStep * sizes_[0];
    if (length > longest) way *= longest / length;
    x += way;
    const auto allowed = static_cast<double>(options_.errorPixels);
    if (far ||
        !(pixels(x, length) < allowed ||
          (length <= longest && !refracts() &&
           pixels(x, remainderOf(d1, d2, rho, glm::length(away))) < kSmallRemainder * allowed)))
      continue;
    if (traced) {
      if (traced->paths_.size() < Traced::kCount) {
        traced->paths_.push_back(path);
      } else {
        traced->paths_[traced->next_] = path;
        traced->next_ = (traced->next_ + 1) % Traced::kCount;
      }
    }
    return accept(point, places, path.bounces.data());
  }
  return false;
}

const Reflector::Path* Reflector::moveTraced(const glm::dvec3& point, const Traced& traced,
                                             Places& places) const {
  // The nearest one
  const Path* path = nullptr;
  double least = kTracedReach;
  for (const Path& other : traced.paths_) {
    const double apart = pixels(places[0], glm::distance(other.place(0), places[0]));
    if (!(apart < least)) continue;
    least = apart;
    path = &other;
  }
  if (!path) return nullptr;
  const glm::dvec3 leaves = path->place(lastTurn());
  const double rho = std::max(0.0, glm::dot(point - leaves, path->direction));
  if (!movable(path->bounces.data(), rho)) return nullptr;
  const glm::dvec3 step = point - (leaves + rho * path->direction);
  Places first;
  Places second;
  move(path->bounces.data(), path->distances.data(), rho, step, first, second);
  const double d1 = glm::distance(first[0], path->place(0));
  const double d2 = glm::distance(second[0], first[0]);
  const double allowed = kSmallRemainder * static_cast<double>(options_.errorPixels);
  const bool near = pixels(places[0], glm::distance(second[0], places[0])) < kTracedReach;
  if (!near || d2 > 0.5 * d1 ||
      !(pixels(path->place(0), remainderOf(d1, d2, rho, glm::length(step))) < allowed))
    return nullptr;
  places = second;
  return path;
}

bool Reflector::surelyTurns(std::size_t turn, const Bounce<double>& bounce, const glm::dvec3& x,
                            const glm::dvec3& back, const glm::dvec3& ahead) const {
  const Vector<double> way = vectorOf(x) - bounce.x;
  const std::array<double, 2> y{dot(bounce.e1, way), dot(bounce.e2, way)};
  const std::array<double, 2> turned = times(bounce.b, y);
  if (turned[0] * turned[0] + turned[1] * turned[1] > kSmallTurn * kSmallTurn) return false;
  const glm::dvec3 normal =
      glm::normalize(pointOf(bounce.n + turned[0] * bounce.e1 + turned[1] * bounce.e2));
  const glm::dvec3 arrives = -glm::normalize(back);
  const glm::dvec3 leaves = glm::normalize(ahead);
  const double before = -glm::dot(normal, arrives);
  const double after = glm::dot(normal, leaves) * (turns_[turn].through ? -1.0 : 1.0);
  if (!(std::min(std::abs(before), std::abs(after)) > kSteep && before * after > 0.0 &&
        (before > 0.0 || turns_[turn].inside)))
    return false;
  const glm::dvec3 onward = onwards(turns_[turn], arrives, normal);
  return onward != glm::dvec3(0.0) && glm::length(glm::cross(onward, leaves)) < kWildPerturbation;
}

bool Reflector::accept(const glm::dvec3& point, const Places& places,
                       const Bounce<double>* bounces) const {
  for (std::size_t i = 0; i < turns_.size(); ++i) {
    const glm::dvec3& x = places[i];
    const glm::dvec3 from = i > 0 ? places[i - 1] : eye_;
    const glm::dvec3 back = from - x;
    const glm::dvec3 ahead = (i == lastTurn() ? point : places[i + 1]) - x;
    if (glm::length(ahead) < kOffSurface * sizes_[i]) return false;
    if (options_.order == Order::Auto && smooth_[i] && surelyTurns(i, bounces[i], x, back, ahead))
      continue;
    const auto normal = implicit::normalAt(*turns_[i].surface, x);
    if (!normal) return false;
    const Turn& turn = turns_[i];
    const double towardsFrom = glm::dot(*normal, back);
    if (!(towardsFrom * glm::dot(*normal, ahead) * (turn.through ? -1.0 : 1.0) > 0.0)) return false;
    // What is seen of the inside is seen through an opening
    if (!turn.inside && towardsFrom < 0.0 && !insideShows(i, from, x)) return false;
    if (options_.order == Order::Nearest) continue;  // is where it is, however wrong
    const glm::dvec3 onward = onwards(turn, glm::normalize(-back), *normal);
    if (onward == glm::dvec3(0.0) ||
        !(glm::length(glm::cross(onward, glm::normalize(ahead))) < kWildPerturbation))
      return false;
  }
  return true;
}

void Reflector::add(const glm::dvec3& point, const Places& places, const glm::dvec3& from,
                    Starts& starts, Reflections& result, PathCounts& counts) const {
  const glm::dvec3& x = places[0];
  for (std::uint32_t i = 0; i < result.count; ++i) {
    const double apart = glm::distance(result.at[i].x, x);
    if (apart <= kSameReflection * glm::distance(starts[i], from) ||
        pixels(x, apart) < 10.0 * static_cast<double>(options_.errorPixels))
      return;
  }
  if (result.count == kMaxReflections) {
    ++counts.leftOut;
    return;
  }
  starts[result.count] = from;
  // The virtual vertex [Chen2000] Fig. 7: at the optical length of the path, so that depths keep
  // their order
  Reflection& reflection = result.at[result.count++];
  reflection.x = x;
  reflection.last = places[lastTurn()];
  const double seen = glm::distance(x, eye_);
  double reflected = 0.0;
  for (std::size_t i = 0; i < lastTurn(); ++i)
    reflected += turns_[i].indexAfter * glm::distance(places[i], places[i + 1]);
  const double ahead = turns_.back().indexAfter * glm::distance(reflection.last, point);
  reflection.image = x + (reflected + ahead) / seen * (x - eye_);
  reflection.share = (seen + reflected) / (seen + reflected + ahead);
}

bool Reflector::trace(const glm::dvec3& point, Places& places, PathCounts& counts,
                      Traced* traced) const {
  // In a lens' focus neighbouring points have far other paths
  if (refracts()) traced = nullptr;
  if (const Path* path = traced ? moveTraced(point, *traced, places) : nullptr) {
    ++counts.quadratic;
    return accept(point, places, path->bounces.data());
  }
  ++counts.retraced;
  return retrace(point, places, traced);
}

Reflections Reflector::reflectionsOf(const glm::dvec3& point, bool own, RayOctree::Cursor& cursor,
                                     PathCounts& counts, Traced* traced) const {
  Reflections result;
  const std::vector<std::uint32_t>& numbers = own ? selfRays_ : rays_;
  if (numbers.empty()) return result;
  std::vector<NearRay>& nearest = cursor.found;
  const RayOctree& octree = own ? selfOctree_ : octree_;
  if (options_.groups) {
    octree.nearest(point, cursor, nearest);
  } else {
    octree.reflections(point, cursor, nearest);
  }
  const GroupLimits limits{static_cast<double>(radians(options_.groupAngleDegrees)),
                           static_cast<double>(options_.groupDistance) * size_};
  std::vector<std::uint32_t>& tried = cursor.near;
  if (options_.groups) {
    tried = groupRepresentatives(octree.rays(), nearest, limits);
  } else {
    tried.clear();
    for (const NearRay& near : nearest) tried.push_back(near.ray);
  }
  Starts starts;
  for (const std::uint32_t ray : tried) {
    const std::size_t number = numbers[ray] * turns_.size();
    const Bounce<double>* bounces = &bounces_[number];
    const double* distances = &distances_[number];
    const glm::dvec3 direction = octree.rays()[ray].direction;
    const glm::dvec3 leaves = pointOf(bounces[lastTurn()].x);
    const double rho = std::max(0.0, glm::dot(point - leaves, direction));
    Places places;
    for (std::size_t i = 0; i < turns_.size(); ++i) places[i] = pointOf(bounces[i].x);
    const glm::dvec3 start = places[0];
    bool found = true;
    bool accepted = false;
    if (options_.order != Order::Nearest) {
      found = movable(bounces, rho);
      const glm::dvec3 step = point - (leaves + rho * direction);
      Places first = places;
      Places second = places;
      if (found) move(bounces, distances, rho, step, first, second);
      if (options_.order == Order::Auto) {
        // The remainder as the next term of a geometric series
        const double d1 = glm::distance(first[0], start);
        const double d2 = glm::distance(second[0], first[0]);
        const double allowed = static_cast<double>(options_.errorPixels) / pixels(start, 1.0);
        if (found && d2 < allowed) {
          places = first;
          ++counts.linear;
        } else if (found && d2 * d2 < allowed * d1) {
          places = second;
          ++counts.quadratic;
        } else {
          const double longest = kLongestStep * sizes_[0];
          if (found && d1 < longest && d2 < 0.5 * d1) places = second;
          accepted = found = trace(point, places, counts, traced);
        }
      } else {
        places = options_.order == Order::Linear ? first : second;
      }
    }
    if (found && (accepted || accept(point, places, bounces))) {
      add(point, places, start, starts, result, counts);
    } else {
      ++counts.notConverged;
    }
  }
  return result;
}

void Reflector::addReflectionsNear(const glm::dvec3& point, const Reflections& known,
                                   Reflections& result, PathCounts& counts, Traced* traced) const {
  Starts starts;
  for (std::uint32_t i = 0; i < result.count; ++i) starts[i] = result.at[i].x;
  for (std::uint32_t i = 0; i < known.count; ++i) {
    const glm::dvec3 start = known.at[i].x;
    Places places;
    places[0] = start;
    if (trace(point, places, counts, traced)) {
      add(point, places, start, starts, result, counts);
    } else {
      ++counts.notConverged;
    }
  }
}

std::optional<Reflection> Reflector::hidden(const glm::dvec3& point, RayOctree::Cursor& cursor,
                                            PathCounts& counts, Traced* traced) const {
  if (!hides()) return std::nullopt;
  if (!before_) {
    const double share = hiddenAt(0, eye_, point);
    if (!(share < 1.0)) return std::nullopt;
    return Reflection{point, point, point, share};
  }
  const Reflections seen = before_->reflectionsOf(point, false, cursor, counts, traced);
  for (std::uint32_t i = 0; i < seen.count; ++i) {
    Reflection reflection = seen.at[i];
    const double share = hiddenAt(lastTurn(), reflection.last, point);
    if (!(share < 1.0)) continue;
    reflection.share += share * (1.0 - reflection.share);
    return reflection;
  }
  return std::nullopt;
}

}  // namespace catoptric::methods::perturbation
