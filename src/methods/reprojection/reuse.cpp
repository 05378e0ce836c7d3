#include "methods/reprojection/reuse.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/parallel.h"

namespace catoptric::methods::reprojection {
namespace {

constexpr std::size_t kSamplesPerTask = 2048;

/// Whether a key frame keeps a reflection of `reflector` at a place.
bool keeps(const KeyFrame& key, std::uint32_t reflector, const Vec2& place) {
  return key.surfaceAt(place) >> 32U == reflector;
}

const Vec2 kNowhere(std::numeric_limits<float>::quiet_NaN());

}  // namespace

void Reuse::begin(const MirrorSamples& samples, Services& services,
                  std::span<const MirrorRay> rays) {
  samples_ = &samples;
  width_ = samples.source().sampleWidth();
  height_ = samples.source().sampleHeight();
  rays_ = rays;
  moving_.update(services.scene, services.geometry);
  const std::size_t count = samples.count();
  services.timer.measure("search", [&] {
    indexOf_.resize(samples.source().object.size());
    parallelFor(indexOf_.size(), 16 * kSamplesPerTask, [&](std::size_t begin, std::size_t end) {
      std::fill(indexOf_.begin() + static_cast<std::ptrdiff_t>(begin),
                indexOf_.begin() + static_cast<std::ptrdiff_t>(end), -1);
    });
    attached_.resize(count);
    matches_.resize(count);
    changed_.resize(count);
    places_.resize(count);
    shown_.resize(count);
    outcomes_.resize(count);
    parallelFor(count, kSamplesPerTask, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        indexOf_[samples.places()[i]] = static_cast<std::int32_t>(i);
        outcomes_[i] = rays_[i].reflector != 0 ? Outcome::NotAsked : Outcome::NotSearched;
      }
    });
  });
}

void Reuse::attach(const KeyFrame& key, const Services& services) {
  const auto isAsked = [this](std::size_t i) { return outcomes_[i] != Outcome::NotSearched; };
  pending_.resize(outcomes_.size());
  std::size_t asked = 0;
  for (std::size_t i = 0; i < outcomes_.size(); ++i) {
    pending_[asked] = static_cast<std::uint32_t>(i);
    asked += isAsked(i) ? 1U : 0U;
  }
  pending_.resize(asked);
  parallelFor(matches_.size(), kSamplesPerTask, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      if (!isAsked(i)) {
        matches_[i] = {kNowhere, Outcome::NotAsked};
        continue;
      }
      const auto place = key.project(samples_->positions()[i],
                                     static_cast<int>(rays_[i].reflector) - 1, services.geometry);
      attached_[i] = place ? *place : kNowhere;
      matches_[i] = {kNowhere, Outcome::NotFound};
      changed_[i] = 0;
      shown_[i] = Shown::Unknown;
    }
  });
}

Match Reuse::searchFrom(const KeyFrame& key, std::size_t i, std::span<const Vec2> starts) const {
  Match match{kNowhere, Outcome::NotFound};
  Vec2 before = kNowhere;
  for (const Vec2& start : starts) {
    // From the same place it comes to the same end.
    if (std::isnan(start.x) || glm::floor(start + 0.5f) == before) continue;
    before = glm::floor(start + 0.5f);
    match = search(key, rays_[i], start, options_);
    if (match.outcome == Outcome::Found) break;
  }
  // What has not moved over its reflector stays exactly where it was.
  const Vec2 offset = glm::abs(match.place - attached_[i]);
  if (std::max(offset.x, offset.y) <= kSnap) match.place = attached_[i];
  return match;
}

bool Reuse::holds(const KeyFrame& key, std::size_t i, const Match& match) const {
  const Lookup lookup = lookUp(key, rays_[i].reflector, match.place, options_);
  return lookup.outcome == Outcome::Found &&
         missBy(key, rays_[i], match.place, lookup.place, options_) <= options_.fidelity;
}

bool Reuse::showsSky(const KeyFrame& key, std::size_t i) const {
  return !movesLight(options_.mapping) && outcomes_[i] == Outcome::Found &&
         matches_[i].outcome == Outcome::Found &&
         static_cast<std::uint32_t>(key.surfaceAt(matches_[i].place)) == 0;
}

Vec2 Reuse::like(std::int32_t i, std::int32_t n) const {
  if (n < 0 || rays_[n].reflector != rays_[i].reflector ||
      (matches_[n].outcome != Outcome::Found && matches_[n].outcome != Outcome::Hidden))
    return kNowhere;
  return matches_[n].place + attached_[i] - attached_[n];
}

bool Reuse::lead(const KeyFrame& key, std::int32_t n, std::int32_t i, Match& match) const {
  const bool found = match.outcome == Outcome::Found;
  if (found ? !isNearer(matches_[n].length, match) : match.outcome != Outcome::NotFound)
    return false;
  const Vec2 start = like(i, n);
  if (std::isnan(start.x)) return false;
  const Match next = searchFrom(key, i, {&start, 1});
  // A ray that meets several things that the key frame shows sees the nearest one.
  if (next.outcome == Outcome::Found &&
      (!found || (isNearer(next.length, match) && holds(key, i, next))))
    match = next;
  else if (found && !keeps(key, rays_[i].reflector, start))
    match = {start, Outcome::Hidden, matches_[n].length};
  else
    return false;
  return true;
}

bool Reuse::findFrom(const KeyFrame& key, int sweep, std::int32_t i,
                     const std::array<std::int32_t, 2>& beside, std::int32_t last) {
  // Neighbours' reflections move alike; else it starts where the surface was.
  std::array<Vec2, 3> starts{like(i, beside[0]), like(i, beside[1]), kNowhere};
  if (sweep == 0)
    starts[2] = keeps(key, rays_[i].reflector, attached_[i]) ? attached_[i] : like(i, last);
  const Match match = searchFrom(key, i, starts);
  if (match.outcome != Outcome::Found) return false;
  accept(i, match, sweep);
  return true;
}

bool Reuse::searchSample(const KeyFrame& key, int sweep, std::int32_t i,
                         const std::array<std::int32_t, 2>& beside, std::int32_t last) {
  bool changed = matches_[i].outcome == Outcome::NotFound && findFrom(key, sweep, i, beside, last);
  for (const std::int32_t n : beside) {
    if (n < 0 || matches_[i].outcome != Outcome::Found ||
        !isNearer(matches_[n].length, matches_[i]))
      continue;
    Match match = matches_[i];
    if (!lead(key, n, i, match)) continue;
    accept(i, match, sweep);
    changed = true;
  }
  return changed;
}

bool Reuse::sweepTile(const KeyFrame& key, int sweep, const Tile& tile, TileState& state) {
  std::int32_t last = -1;  // the last one found
  // From the left and from above, then from the other side
  const int back = sweep == 0 ? 1 : -1;
  bool lacks = false;
  float nearest = std::numeric_limits<float>::infinity();
  float farthest = 0.0f;
  const auto at = [&](int x, int y) {
    if (x < tile.left || y < tile.top || x >= tile.right || y >= tile.bottom) return -1;
    return sampleAt(x, y);
  };
  const int firstX = back > 0 ? tile.left : tile.right - 1;
  const int firstY = back > 0 ? tile.top : tile.bottom - 1;
  for (int y = firstY; y >= tile.top && y < tile.bottom; y += back)
    for (int x = firstX; x >= tile.left && x < tile.right; x += back) {
      const std::int32_t i = sampleAt(x, y);
      if (i < 0 || matches_[i].outcome == Outcome::NotAsked) continue;
      const std::array<std::int32_t, 2> beside{at(x - back, y), at(x, y - back)};
      if (sweep > 0 && beside[0] < 0 && beside[1] < 0) continue;
      if (searchSample(key, sweep, i, beside, last)) state.stirred = sweep > 0;
      const Match& match = matches_[i];
      if (match.outcome == Outcome::Found)
        last = i;
      else
        lacks = true;
      nearest = std::min(nearest, match.length);
      farthest = std::max(farthest, match.length);
    }
  return lacks || nearest < farthest * (1.0f - options_.epsilon);
}

bool Reuse::isAskedIn(std::size_t tile) const {
  const auto [first, end] = samples_->ofTile(tile);
  return std::any_of(matches_.begin() + static_cast<std::ptrdiff_t>(first),
                     matches_.begin() + static_cast<std::ptrdiff_t>(end),
                     [](const Match& match) { return match.outcome != Outcome::NotAsked; });
}

void Reuse::forTiles(const std::function<void(const Tile&, std::size_t)>& body) const {
  const int columns = tileColumns();
  parallelFor(tiles_.size(), 8, [&](std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t) {
      const int left = static_cast<int>(t) % columns * kTile;
      const int top = static_cast<int>(t) / columns * kTile;
      body({left, top, std::min(width_, left + kTile), std::min(height_, top + kTile)}, t);
    }
  });
}

void Reuse::warpInPlace(const KeyFrame& key, const Services& services) {
  parallelFor(pending_.size(), kSamplesPerTask, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) {
      const std::size_t i = pending_[k];
      const Vec2 place = attached_[i];
      if (std::isnan(place.x)) continue;
      if (!keeps(key, rays_[i].reflector, place)) continue;
      const auto x = static_cast<int>(std::floor(place.x + 0.5f));
      const auto y = static_cast<int>(std::floor(place.y + 0.5f));
      const float distance =
          glm::distance(key.formerly(samples_->positions()[i],
                                     static_cast<int>(rays_[i].reflector) - 1, services.geometry),
                        key.camera().eye());
      const float kept = key.distance(key.index(x, y));
      if (std::abs(kept - distance) <= options_.epsilon * distance)
        matches_[i] = {place, Outcome::Found};
    }
  });
}

float Reuse::keyArea(std::size_t at) const {
  const auto width = static_cast<std::size_t>(width_);
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

bool Reuse::atRim(std::size_t i) const {
  const auto at = static_cast<int>(samples_->places()[i]);
  const int x = at % width_;
  const int y = at / width_;
  const std::array<std::array<int, 2>, 4> beside{{{x - 1, y}, {x + 1, y}, {x, y - 1}, {x, y + 1}}};
  return std::ranges::any_of(beside, [&](const std::array<int, 2>& next) {
    if (next[0] < 0 || next[1] < 0 || next[0] >= width_ || next[1] >= height_) return false;
    const std::int32_t n = sampleAt(next[0], next[1]);
    return n < 0 || rays_[n].reflector != rays_[i].reflector;
  });
}

void Reuse::shift(const KeyFrame& key, std::vector<Vec3>& radiance) {
  // Written apart from what neighbours still read: their matches.
  parallelFor(pending_.size(), kSamplesPerTask, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) {
      const std::size_t i = pending_[k];
      Outcome outcome = matches_[i].outcome;
      if (outcome == Outcome::Found && shown_[i] == Shown::Unknown) {
        const Lookup lookup = lookUp(key, rays_[i].reflector, matches_[i].place, options_);
        outcome = lookup.outcome;
        radiance[i] = lookup.radiance;
        places_[i] = lookup.place;
      }
      if (outcome == Outcome::Found && shown_[i] != Shown::Measured &&
          keyArea(samples_->places()[i]) * options_.magnification < 1.0f)
        outcome = Outcome::Magnified;
      if (outcome == Outcome::Found && options_.edges == Edges::Rims && atRim(i) &&
          matches_[i].place != attached_[i])
        outcome = Outcome::Discontinuity;
      outcomes_[i] = outcome;
      if (outcome != Outcome::Found) radiance[i] = Vec3(0.0f);
    }
  });
}

void Reuse::warp(const KeyFrame& key, const frame::Geometry& geometry,
                 std::vector<Vec3>& radiance) {
  const auto crossed = [&](std::size_t i) {
    if (moving_.empty()) return false;
    const auto shown = static_cast<std::uint32_t>(key.surfaceAt(matches_[i].place));
    const Vec3& from = rays_[i].origin;
    const float farthest = 2.0f * geometry.bounds.diameter();
    const Vec3 to = places_[i].w > 0.0f ? Vec3(places_[i]) : from + farthest * rays_[i].direction;
    return moving_.cross(from, to, rays_[i].reflector, shown);
  };
  parallelFor(pending_.size(), kSamplesPerTask, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) {
      const std::size_t i = pending_[k];
      if (outcomes_[i] != Outcome::Found) continue;
      // What had so little to correct, by the same measure, is nearer still after it.
      if (!(matches_[i].miss <= 0.5f * options_.fidelity) &&
          !(missBy(key, rays_[i], matches_[i].place, places_[i], options_) <= options_.fidelity))
        outcomes_[i] = Outcome::Unfaithful;
      else if (crossed(i))
        outcomes_[i] = Outcome::Crossed;
      else
        continue;
      radiance[i] = Vec3(0.0f);
    }
  });
}

void Reuse::findByGrid(const KeyFrame& key, Services& services, std::vector<Vec3>& radiance) {
  services.timer.measure("search",
                         [&] { grid_.search(key, services.geometry, samples_->camera()); });
  services.timer.measure("shift", [&] { grid_.shift(key); });
  services.timer.measure("warp", [&] {
    grid_.warp(key, samples_->camera());
    const Vec3 eye = samples_->camera().eye();
    for (std::size_t i = 0; i < outcomes_.size(); ++i)
      if (outcomes_[i] != Outcome::NotSearched)
        outcomes_[i] = grid_.found(samples_->places()[i], rays_[i].reflector,
                                   glm::distance(samples_->positions()[i], eye), radiance[i]);
  });
}

void Reuse::findIn(const KeyFrame& key, Services& services, std::vector<Vec3>& radiance) {
  if (movesLight(options_.mapping)) {
    findByGrid(key, services, radiance);
    return;
  }
  services.timer.measure("search", [&] {
    attach(key, services);
    if (options_.mapping == Mapping::Surface) {
      warpInPlace(key, services);
      return;
    }
    tiles_.resize(static_cast<std::size_t>(tileColumns() * ((height_ + kTile - 1) / kTile)));
    forTiles([&](const Tile& tile, std::size_t at) {
      TileState& state = tiles_[at];
      // Where nothing is to be found all is.
      state = {!isAskedIn(at)};
      if (!state.all) state = fillTile(key, tile, radiance);
      // Forth and back
      if (!settled(state) && sweepTile(key, 0, tile, state)) sweepTile(key, 1, tile, state);
    });
    findNearer(key, services.geometry);
    spread(key);
    markEdges(key);
  });
  // What the key frame shows there, if it shows one surface there and is not stretched too far.
  services.timer.measure("shift", [&] { shift(key, radiance); });
  // Whether it lies where this frame's mirrored ray goes.
  if (options_.mapping == Mapping::Gather)
    services.timer.measure("warp", [&] { warp(key, services.geometry, radiance); });
}

}  // namespace catoptric::methods::reprojection
