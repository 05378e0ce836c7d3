// What stands in front of what the sweeps have found: from the key frame's near edges forwards, and
// from neighbour to neighbour until nothing changes.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/basis.h"
#include "core/parallel.h"
#include "methods/reprojection/reuse.h"

namespace catoptric::methods::reprojection {
namespace {

constexpr std::size_t kEdgesPerTask = 256;
/// Steps to the sample that shows a place now, and the longest one, in samples. Ours.
constexpr int kStepsForwards = 6;
constexpr float kLongestForwards = 24.0f;
/// A step as short as that ends there.
constexpr float kShortForwards = 1.0f;

/// Numbers of what changes matches, after sweep 0: sweep 1, findNearer(), rounds of spread().
constexpr int kSweepBack = 1;
constexpr int kSeeds = 2;
constexpr int kFirstRound = 3;

const Vec2 kNone(std::numeric_limits<float>::quiet_NaN());

}  // namespace

bool Reuse::hides(const KeyFrame& key, std::size_t at, std::int32_t i) const {
  const Match& match = matches_[i];
  if (match.outcome != Outcome::Found || !(key.length(at) < match.length)) return false;
  return isNearer(key.length(at), match) || key.surface(at) != key.surfaceAt(match.place);
}

Vec2 Reuse::goesTo(const KeyFrame& key, std::size_t at, const Vec2& start) const {
  const std::uint32_t reflector = key.reflector(at);
  const Vec3 place(key.place(at));
  const Vec2 last(static_cast<float>(width_ - 1), static_cast<float>(height_ - 1));
  Vec2 here = start;
  Vec2 before = kNone;
  for (int step = 0; step < kStepsForwards; ++step) {
    // Not beyond the frame, where the way to what comes into it may begin
    const Vec2 nearest = glm::floor(glm::clamp(here, Vec2(0.0f), last) + 0.5f);
    const int x = static_cast<int>(nearest.x);
    const int y = static_cast<int>(nearest.y);
    const std::int32_t i = nearest != before ? reflecting(x, y, reflector) : -1;
    if (i < 0) break;
    before = nearest;
    // Tangents of the angles from the sample's ray, of which the place's are to be those of a ray
    const Basis basis(rays_[i].direction);
    const auto tangents = [&](const Vec3& way) {
      return Vec2(glm::dot(basis.x, way), glm::dot(basis.y, way)) / glm::dot(basis.z, way);
    };
    const Vec3 way = place - rays_[i].origin;
    if (!(glm::dot(basis.z, way) > 0.0f)) break;
    const Vec2 off = tangents(way);
    glm::mat2 slopes(0.0f);
    for (int axis = 0; axis < 2; ++axis) {
      const std::int32_t after = reflecting(x + 1 - axis, y + axis, reflector);
      const std::int32_t n = after >= 0 ? after : reflecting(x - 1 + axis, y - axis, reflector);
      if (n >= 0)
        slopes[axis] = (after >= 0 ? 1.0f : -1.0f) *
                       (tangents(place - rays_[n].origin) - tangents(rays_[n].direction) - off);
    }
    const Vec2 move = -(glm::inverse(slopes) * off);
    const float length = std::max(std::abs(move.x), std::abs(move.y));
    if (!std::isfinite(length)) break;
    if (length <= kShortForwards) return nearest + move;
    here = nearest + move * std::min(1.0f, kLongestForwards / length);
  }
  return kNone;
}

void Reuse::findNearer(const KeyFrame& key, const frame::Geometry& geometry) {
  const Mat4 sampleFromWorld = sampleFromWorldOf(samples_->camera(), width_, height_);
  const std::span<const std::uint32_t> near = key.nearEdges();
  const auto width = static_cast<std::size_t>(key.width());
  if (edgesOf_ != key.number()) edges_.assign(near.size(), {});
  edgesOf_ = key.number();
  parallelFor(near.size(), kEdgesPerTask, [&](std::size_t begin, std::size_t end) {
    for (std::size_t e = begin; e < end; ++e) {
      const std::size_t at = near[e];
      NearEdge& edge = edges_[e];
      edge.sample = -1;
      // From where it was a frame ago, or from its reflector's point
      Vec2 from = edge.goesTo;
      if (std::isnan(from.x)) {
        const Vec4 seen = sampleFromWorld * Vec4(key.reflectorNow(at, geometry), 1.0f);
        if (!(seen.w > 0.0f)) continue;
        from = Vec2(seen) / seen.w;
      }
      edge.goesTo = goesTo(key, at, from);
      if (std::isnan(edge.goesTo.x)) continue;
      const Vec2 nearest = glm::floor(edge.goesTo + 0.5f);
      const std::int32_t i =
          reflecting(static_cast<int>(nearest.x), static_cast<int>(nearest.y), key.reflector(at));
      if (i < 0 || !hides(key, at, i)) continue;
      const std::size_t row = at / width;
      const Vec2 start(static_cast<float>(at % width), static_cast<float>(row));
      edge.match = searchFrom(key, i, {&start, 1});
      if (edge.match.outcome == Outcome::Found && holds(key, i, edge.match)) edge.sample = i;
    }
  });
  for (const NearEdge& edge : edges_) {
    if (edge.sample < 0 || !(edge.match.length < matches_[edge.sample].length)) continue;
    accept(edge.sample, edge.match, kSeeds);
    const auto at = static_cast<int>(samples_->places()[edge.sample]);
    tiles_[at / width_ / kTile * tileColumns() + at % width_ / kTile].stirred = true;
  }
}

bool Reuse::mayChange(std::size_t tile, int round) const {
  const auto columns = static_cast<std::size_t>(tileColumns());
  TileState about{true};
  for (const std::size_t at : {tile, tile - 1, tile + 1, tile - columns, tile + columns}) {
    if (at >= tiles_.size()) continue;
    const TileState& part = tiles_[at];
    about.all = about.all && part.all;
    about.nearest = std::min(about.nearest, part.nearest);
    about.farthest = std::max(about.farthest, part.farthest);
    about.stirred = about.stirred || part.stirred;
  }
  return about.stirred || (round == kFirstRound && !settled(about));
}

void Reuse::spread(const KeyFrame& key) {
  found_.resize(tiles_.size());
  bool goesOn = true;
  for (int round = kFirstRound; goesOn; ++round) {
    // All of a round see what the one before has left, so that no order counts.
    forTiles([&](const Tile& tile, std::size_t at) {
      found_[at].clear();
      if (!mayChange(at, round)) return;
      for (int y = tile.top; y < tile.bottom; ++y)
        for (int x = tile.left; x < tile.right; ++x) {
          const bool inside =
              x > tile.left && y > tile.top && x + 1 < tile.right && y + 1 < tile.bottom;
          const std::int32_t i = sampleAt(x, y);
          if (i < 0 || (inside && !tiles_[at].stirred)) continue;
          Match match = matches_[i];
          bool changed = false;
          // Where it has led before it need not lead again: sweep 1 came from right and below.
          const auto ask = [&](int besideX, int besideY, int news) {
            if (besideX < 0 || besideY < 0 || besideX >= width_ || besideY >= height_) return;
            const std::int32_t n = sampleAt(besideX, besideY);
            const bool other = besideX < tile.left || besideY < tile.top || besideX >= tile.right ||
                               besideY >= tile.bottom;
            const int since = round > kFirstRound ? round - 1 : other ? 0 : news;
            if (n >= 0 && changed_[n] >= since) changed = lead(key, n, i, match) || changed;
          };
          ask(x - 1, y, kSweepBack);
          ask(x, y - 1, kSweepBack);
          ask(x + 1, y, kSeeds);
          ask(x, y + 1, kSeeds);
          if (changed) found_[at].emplace_back(i, match);
        }
    });
    goesOn = false;
    for (std::size_t at = 0; at < tiles_.size(); ++at) {
      tiles_[at].stirred = !found_[at].empty();
      goesOn = goesOn || tiles_[at].stirred;
      for (const auto& [i, match] : found_[at]) accept(i, match, round);
    }
  }
}

void Reuse::markEdges(const KeyFrame& key) {
  if (options_.edges == Edges::Nearest) return;
  for (std::size_t e = 0; e < edges_.size(); ++e) {
    const Vec2& goesTo = edges_[e].goesTo;
    if (std::isnan(goesTo.x)) continue;
    const std::uint32_t at = key.nearEdges()[e];
    const Vec2 corner = glm::floor(goesTo);
    const Vec2 off = goesTo - corner;
    for (int k = 0; k < 4; ++k) {
      const int right = k % 2;
      const int below = k / 2;
      const float farther =
          std::max(right != 0 ? 1.0f - off.x : off.x, below != 0 ? 1.0f - off.y : off.y);
      if (!(farther < 1.0f - kSnap)) continue;
      const std::int32_t i = reflecting(static_cast<int>(corner.x) + right,
                                        static_cast<int>(corner.y) + below, key.reflector(at));
      if (i >= 0 && hides(key, at, i)) matches_[i].outcome = Outcome::Discontinuity;
    }
  }
}

}  // namespace catoptric::methods::reprojection
