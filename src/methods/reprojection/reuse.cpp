#include "methods/reprojection/reuse.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/parallel.h"
#include "scene/reflectance.h"

namespace catoptric::methods::reprojection {
namespace {

constexpr int kTile = 16;  ///< samples along an edge; a sample starts from its neighbours in it
constexpr std::size_t kSamplesPerTask = 2048;

const Vec2 kNowhere(std::numeric_limits<float>::quiet_NaN());

}  // namespace

bool isMirror(const trace::ReflectionPoint& point, const scene::Scene& scene) {
  const scene::Object& object = scene.objects[static_cast<std::size_t>(point.object - 1)];
  return point.glossiness <= scene::kMirrorGlossiness &&
         !(scene.materials[object.material].refraction > 0.0f);
}

void Reuse::makeRays(const KeyFrame& key, const ReflectiveSamples& samples,
                     const Services& services) {
  rays_.resize(samples.points.size());
  attached_.resize(samples.points.size());
  matches_.assign(samples.points.size(), {});
  places_.resize(samples.points.size());
  parallelFor(samples.points.size(), kSamplesPerTask, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      trace::ReflectionPoint point = samples.points[i];
      rays_[i].reflector = 0;
      attached_[i] = kNowhere;
      if (!isMirror(point, services.scene)) {
        matches_[i].outcome = Outcome::NotSearched;
        continue;
      }
      trace::settle(*services.trace, point);
      bool belowHorizon = false;
      bool total = false;
      const trace::Ray ray = trace::lobeRay(point, 0, 1, belowHorizon, total);
      rays_[i] = {ray.origin, ray.direction, static_cast<std::uint32_t>(point.object)};
      matches_[i].outcome = Outcome::NotFound;
      const auto place = key.project(point.position, point.object - 1, services.geometry);
      if (place) attached_[i] = *place;
    }
  });
}

void Reuse::searchTile(const KeyFrame& key, const raster::GBufferCopy& current, int tileX,
                       int tileY) {
  const int width = current.sampleWidth();
  const int right = std::min(width, tileX + kTile);
  const int bottom = std::min(current.sampleHeight(), tileY + kTile);
  for (int y = tileY; y < bottom; ++y) {
    for (int x = tileX; x < right; ++x) {
      const std::int32_t i = indexOf_[static_cast<std::size_t>(y * width + x)];
      if (i < 0 || rays_[i].reflector == 0) continue;
      // Neighbours' reflections move alike; else it starts where the surface was.
      std::array<Vec2, 3> starts{kNowhere, kNowhere, attached_[i]};
      const auto from = [&](int nx, int ny) {
        if (nx < tileX || ny < tileY) return kNowhere;
        const std::int32_t n = indexOf_[static_cast<std::size_t>(ny * width + nx)];
        if (n < 0 || matches_[n].outcome != Outcome::Found ||
            rays_[n].reflector != rays_[i].reflector)
          return kNowhere;
        return matches_[n].place + attached_[i] - attached_[n];
      };
      starts[0] = from(x - 1, y);
      starts[1] = from(x, y - 1);
      for (const Vec2& start : starts) {
        if (std::isnan(start.x)) continue;
        matches_[i] = search(key, rays_[i], start, options_);
        if (matches_[i].outcome == Outcome::Found) break;
      }
      // What has not moved over its reflector stays exactly where it was.
      const Vec2 offset = glm::abs(matches_[i].place - attached_[i]);
      if (std::max(offset.x, offset.y) <= kSnap) matches_[i].place = attached_[i];
    }
  }
}

void Reuse::warpInPlace(const KeyFrame& key, const ReflectiveSamples& samples,
                        const Services& services) {
  parallelFor(samples.points.size(), kSamplesPerTask, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Vec2 place = attached_[i];
      if (rays_[i].reflector == 0 || std::isnan(place.x)) continue;
      const int x = static_cast<int>(std::floor(std::clamp(place.x, -1e6f, 1e6f) + 0.5f));
      const int y = static_cast<int>(std::floor(std::clamp(place.y, -1e6f, 1e6f) + 0.5f));
      if (!key.inside(x, y) || key.reflector(key.index(x, y)) != rays_[i].reflector) continue;
      const trace::ReflectionPoint& point = samples.points[i];
      const float distance = glm::distance(
          key.formerly(point.position, point.object - 1, services.geometry), key.camera().eye());
      const float kept = key.distance(key.index(x, y));
      if (std::abs(kept - distance) <= options_.epsilon * distance)
        matches_[i] = {place, Outcome::Found};
    }
  });
}

float Reuse::keyArea(const raster::GBufferCopy& current, std::size_t at) const {
  const auto width = static_cast<std::size_t>(current.sampleWidth());
  const std::size_t x = at % width;
  const std::size_t y = at / width;
  const std::int32_t i = indexOf_[at];
  std::array<Vec2, 2> steps;
  const std::array<std::array<std::size_t, 2>, 2> neighbours{
      {{at - 1, at + 1}, {at - width, at + width}}};
  const std::array<std::array<bool, 2>, 2> there{
      {{x > 0, x + 1 < width}, {y > 0, at + width < indexOf_.size()}}};
  for (int axis = 0; axis < 2; ++axis) {
    bool known = false;
    for (int side = 0; side < 2 && !known; ++side) {
      if (!there[axis][side]) continue;
      const std::int32_t n = indexOf_[neighbours[axis][side]];
      if (n < 0 || rays_[n].reflector != rays_[i].reflector || std::isnan(matches_[n].place.x) ||
          matches_[n].outcome == Outcome::NotFound)
        continue;
      steps[axis] = matches_[n].place - matches_[i].place;
      known = true;
    }
    if (!known) return 1.0f;
  }
  return std::abs(steps[0].x * steps[1].y - steps[0].y * steps[1].x);
}

void Reuse::run(const KeyFrame& key, const raster::GBufferCopy& current,
                const ReflectiveSamples& samples, Services& services, std::vector<Vec3>& radiance) {
  const std::size_t count = samples.points.size();
  services.timer.measure("search", [&] {
    indexOf_.assign(current.object.size(), -1);
    for (std::size_t i = 0; i < count; ++i)
      indexOf_[samples.places[i]] = static_cast<std::int32_t>(i);
    makeRays(key, samples, services);
    if (!searches_) {
      warpInPlace(key, samples, services);
      return;
    }
    const int tilesX = (current.sampleWidth() + kTile - 1) / kTile;
    const int tilesY = (current.sampleHeight() + kTile - 1) / kTile;
    parallelFor(static_cast<std::size_t>(tilesX * tilesY), 8,
                [&](std::size_t begin, std::size_t end) {
                  for (std::size_t tile = begin; tile < end; ++tile)
                    searchTile(key, current, static_cast<int>(tile % tilesX) * kTile,
                               static_cast<int>(tile / tilesX) * kTile);
                });
  });
  // What the key frame shows there, if it shows one surface there and is not stretched too far.
  std::vector<Outcome> outcomes(count);
  services.timer.measure("shift", [&] {
    parallelFor(count, kSamplesPerTask, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        radiance[i] = Vec3(0.0f);
        outcomes[i] = matches_[i].outcome;
        if (outcomes[i] != Outcome::Found) continue;
        const Lookup lookup = lookUp(key, rays_[i].reflector, matches_[i].place, options_);
        outcomes[i] = lookup.outcome;
        if (lookup.outcome != Outcome::Found) continue;
        if (keyArea(current, samples.places[i]) * options_.magnification < 1.0f) {
          outcomes[i] = Outcome::Magnified;
          continue;
        }
        radiance[i] = lookup.radiance;
        places_[i] = lookup.place;
      }
    });
  });
  // Whether it lies where this frame's mirrored ray goes.
  services.timer.measure("warp", [&] {
    parallelFor(count, kSamplesPerTask, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        if (searches_ && outcomes[i] == Outcome::Found &&
            !(missBy(key, rays_[i], matches_[i].place, places_[i], options_) <=
              options_.fidelity)) {
          outcomes[i] = Outcome::Unfaithful;
          radiance[i] = Vec3(0.0f);
        }
        matches_[i].outcome = outcomes[i];
      }
    });
  });
}

}  // namespace catoptric::methods::reprojection
