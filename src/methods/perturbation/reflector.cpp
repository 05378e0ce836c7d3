#include "methods/perturbation/reflector.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "scene/implicit/gradient.h"

namespace catoptric::methods::perturbation {
namespace {

/// Whether a surface has no edges, as far as its formula's operations tell.
bool isSmooth(const implicit::Surface& surface) {
  using implicit::Code;
  return std::none_of(surface.tape.begin(), surface.tape.end(),
                      [](const implicit::Operation& operation) {
                        const Code code = operation.code;
                        return code == Code::Min || code == Code::Max || code == Code::Abs ||
                               code == Code::AbsPower;
                      });
}

}  // namespace

void PathCounts::add(const PathCounts& other) {
  paths += other.paths;
  linear += other.linear;
  quadratic += other.quadratic;
  retraced += other.retraced;
  notConverged += other.notConverged;
  leftOut += other.leftOut;
}

Reflector::Reflector(std::span<const Turn> turns, const Reflector* before, const Box3& scene,
                     const View& view, const PathOptions& options)
    : turns_(turns.begin(), turns.end()),
      before_(before),
      options_(options),
      eye_(view.camera.eye()),
      centre_(turns.back().bounds.centre()),
      size_(turns.back().bounds.diameter()),
      spread_(scene::pixelSpreadRad(view.camera, view.height)) {
  assert(turns_.size() <= kMaxTurns && (turns_.size() == 1) == (before == nullptr));
  for (std::size_t i = 0; i < turns_.size(); ++i) {
    sizes_[i] = turns_[i].bounds.diameter();
    smooth_[i] = isSmooth(*turns_[i].surface);
  }
  samplePaths(view, scene);
}

Reflector::PathSearch Reflector::pathBy(glm::dvec3 x, Path& path) const {
  std::array<Jet3<double>, kMaxTurns> jets;
  Places places;
  glm::dvec3 direction = x - eye_;
  for (std::size_t i = 0; i < turns_.size(); ++i) {
    if (i > 0) {
      // Away from a surface that it has just left
      const double start = turns_[i].surface == turns_[i - 1].surface ? kOffSurface * sizes_[i] : 0;
      const implicit::SurfaceHit hit =
          implicit::firstHit(*turns_[i].surface, {places[i - 1], direction, start});
      if (hit.status != implicit::HitStatus::Hit) return PathSearch::Nothing;
      x = places[i - 1] + hit.t * direction;
    }
    if (implicit::derivativesAt(*turns_[i].surface, x, jets[i]) != implicit::PointStatus::Smooth)
      return PathSearch::Nothing;
    const glm::dvec3 gradient = gradientOf(jets[i]);
    const double steepness2 = glm::dot(gradient, gradient);
    x -= jets[i].value() / steepness2 * gradient;
    places[i] = x;
    const glm::dvec3 arrives = x - (i > 0 ? places[i - 1] : eye_);
    if (!(glm::length(arrives) > 0.0)) return PathSearch::Nothing;
    direction = onwards(turns_[i], glm::normalize(arrives), gradient / std::sqrt(steepness2));
    if (direction == glm::dvec3(0.0)) return PathSearch::TotalReflection;
  }
  path.direction = direction;
  Eikonal<double> rest = straightTo(vectorOf(eye_), vectorOf(places[0]), 1.0);
  for (std::size_t i = 0; i < turns_.size(); ++i) {
    const bool end = i == lastTurn();
    const glm::dvec3 next = end ? places[i] + direction : places[i + 1];
    path.bounces[i] =
        makeBounce(vectorOf(next), vectorOf(places[i]), jets[i], rest, turns_[i].indexAfter);
    if (end) break;
    path.distances[i] = glm::distance(next, places[i]);
    if (!(path.distances[i] > 0.0) ||
        statusOf(path.bounces[i], path.distances[i]) != PathStatus::Regular)
      return PathSearch::Nothing;
    rest = perturbation::before(path.bounces[i], path.distances[i]);
  }
  return PathSearch::Path;
}

bool Reflector::wouldLeave(const Path& path) const {
  const auto normal = implicit::normalAt(*turns_.back().surface, path.place(lastTurn()));
  const glm::dvec3 arrives =
      path.place(lastTurn()) - (lastTurn() > 0 ? path.place(lastTurn() - 1) : eye_);
  Turn out = turns_.back();
  out.through = true;
  out.indexAfter = 1.0;
  return normal && onwards(out, glm::normalize(arrives), *normal) != glm::dvec3(0.0);
}

bool Reflector::insideShows(std::size_t turn, const glm::dvec3& from, const glm::dvec3& x) const {
  const glm::dvec3 way = x - from;
  const double hit = hiddenAt(turn, from, from + (1.0 + kOffSurface) * way) * (1.0 + kOffSurface);
  if (!(hit > 1.0 - kOffSurface && hit < 1.0 + kOffSurface)) return false;
  const auto normal = implicit::normalAt(*turns_[turn].surface, from + hit * way);
  return normal && glm::dot(*normal, way) > 0.0;
}

double Reflector::hiddenAt(std::size_t turn, const glm::dvec3& from,
                           const glm::dvec3& point) const {
  const glm::dvec3 way = point - from;
  // Away from a surface that it has just left, as in pathBy()
  const bool leaves = turn > 0 && turns_[turn].surface == turns_[turn - 1].surface;
  const double start = leaves ? kOffSurface * sizes_[turn] / glm::length(way) : 0.0;
  if (!(start < 1.0)) return 1.0;
  const implicit::SurfaceHit hit =
      implicit::firstHit(*turns_[turn].surface, {from, way, start, 1.0});
  return hit.status == implicit::HitStatus::Hit ? hit.t : 1.0;
}

}  // namespace catoptric::methods::perturbation
