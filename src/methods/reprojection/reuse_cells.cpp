// The search in cells: few samples of a tile are searched, and where those about a cell agree, the
// others in it start from offsets between theirs, which one correction makes good.
#include <algorithm>
#include <cmath>

#include "methods/reprojection/reuse.h"

namespace catoptric::methods::reprojection {
namespace {

/// Samples from a node to the next, and nodes of a tile's edge: those at its end too. Ours.
constexpr int kCell = 8;
constexpr int kMostNodes = Reuse::kTile / kCell + 1;

/// Corrections of what a cell's corners tell, and the farthest that a first one may move a place,
/// in samples: what is shown between four samples is flat over no more. Ours.
constexpr int kCorrections = 2;
constexpr float kMostCorrected = 1.5f;

/// Where the nodes of a tile's edge lie.
struct Nodes {
  std::array<int, kMostNodes> at{};
  int count = 0;
  Nodes(int begin, int end) {
    for (int x = begin; x < end - 1; x += kCell) at[count++] = x;
    at[count++] = end - 1;
  }
};

}  // namespace

Reuse::Corners Reuse::corners(const KeyFrame& key, const Cell& cell) const {
  Corners result;
  const float area = static_cast<float>((cell.right - cell.left) * (cell.bottom - cell.top));
  float nearest = std::numeric_limits<float>::infinity();
  float farthest = 0.0f;
  std::uint64_t surface = 0;
  bool one = area > 0.0f;
  for (std::size_t k = 0; k < 4; ++k) {
    const std::int32_t n = cell.node[k];
    if (n < 0 || matches_[n].outcome != Outcome::Found) {
      one = false;
      continue;
    }
    const std::uint64_t shown = key.surfaceAt(matches_[n].place);
    one = one && shown != 0 && (surface == 0 || shown == surface);
    surface = shown;
    result.known[k] = true;
    result.offset[k] = matches_[n].place - attached_[n];
    nearest = std::min(nearest, matches_[n].length);
    farthest = std::max(farthest, matches_[n].length);
  }
  if (!one) return result;
  const Vec2 x = matches_[cell.node[1]].place - matches_[cell.node[0]].place;
  const Vec2 y = matches_[cell.node[2]].place - matches_[cell.node[0]].place;
  result.agree = nearest >= farthest * (1.0f - options_.epsilon) &&
                 std::abs(x.x * y.y - x.y * y.x) * options_.magnification >= area;
  return result;
}

bool Reuse::expect(const Cell& cell, const Corners& corners, CellLanes& lanes) {
  const auto width = static_cast<float>(std::max(1, cell.right - cell.left));
  const auto height = static_cast<float>(std::max(1, cell.bottom - cell.top));
  bool all = true;
  for (int y = cell.top; y <= cell.bottom; ++y) {
    const float v = static_cast<float>(y - cell.top) / height;
    const Vec2 left = corners.offset[0] + v * (corners.offset[2] - corners.offset[0]);
    const Vec2 right = corners.offset[1] + v * (corners.offset[3] - corners.offset[1]);
    for (int x = cell.left; x <= cell.right; ++x) {
      const std::int32_t i = indexOf_[static_cast<std::size_t>(y * width_ + x)];
      if (i < 0 || matches_[i].outcome != Outcome::NotFound) continue;
      const float u = static_cast<float>(x - cell.left) / width;
      const std::size_t nearest = (u > 0.5f ? 1U : 0U) + (v > 0.5f ? 2U : 0U);
      if (!corners.known[nearest] || rays_[i].reflector != rays_[cell.node[nearest]].reflector) {
        all = false;
        continue;
      }
      const Vec2 place =
          attached_[i] + (corners.agree ? left + u * (right - left) : corners.offset[nearest]);
      const std::size_t lane = lanes.count++;
      lanes.sample[lane] = i;
      lanes.reflector[lane] = rays_[i].reflector;
      lanes.origin.set(lane, rays_[i].origin);
      lanes.direction.set(lane, rays_[i].direction);
      lanes.attachedX[lane] = attached_[i].x;
      lanes.attachedY[lane] = attached_[i].y;
      lanes.x[lane] = place.x;
      lanes.y[lane] = place.y;
      shown_[i] = corners.agree ? Shown::Measured : Shown::Known;
      // Not once more by the next cell, which shares an edge with this one
      matches_[i].outcome = Outcome::Found;
    }
  }
  return all;
}

std::size_t Reuse::take(const KeyFrame& key, CellLanes& lanes, std::vector<Vec3>& radiance) {
  // What had so little to correct, by the measure of warp(), is nearer still after it.
  correct(key, 0.5f * options_.fidelity, lanes);
  std::size_t left = 0;
  for (std::size_t lane = 0; lane < lanes.count; ++lane) {
    const std::int32_t i = lanes.sample[lane];
    if (lanes.found[lane] != 0) {
      matches_[i] = {
          {lanes.x[lane], lanes.y[lane]}, Outcome::Found, lanes.length[lane], lanes.miss[lane]};
      radiance[i] = lanes.light.at(lane);
      if (!moving_.empty())
        places_[i] = lookUp(key, rays_[i].reflector, matches_[i].place, options_).place;
      continue;
    }
    if (lanes.miss[lane] <= kMostCorrected)
      lanes.copy(lane, left++);
    else
      matches_[i].outcome = Outcome::NotFound;
  }
  const std::size_t lost = lanes.count - left;
  lanes.count = left;
  return lost;
}

Reuse::TileState Reuse::fillTile(const KeyFrame& key, const Tile& tile,
                                 std::vector<Vec3>& radiance) {
  TileState state;
  const Nodes columns(tile.left, tile.right);
  const Nodes rows(tile.top, tile.bottom);
  std::array<std::array<std::int32_t, kMostNodes>, kMostNodes> nodes{};
  std::int32_t last = -1;
  for (int r = 0; r < rows.count; ++r)
    for (int c = 0; c < columns.count; ++c) {
      const std::int32_t i =
          indexOf_[static_cast<std::size_t>(rows.at[r] * width_ + columns.at[c])];
      nodes[r][c] = i;
      if (i < 0 || matches_[i].outcome != Outcome::NotFound) continue;
      findFrom(key, 0, i, {c > 0 ? nodes[r][c - 1] : -1, r > 0 ? nodes[r - 1][c] : -1}, last);
      if (matches_[i].outcome != Outcome::Found) continue;
      last = i;
      state.nearest = std::min(state.nearest, matches_[i].length);
      state.farthest = std::max(state.farthest, matches_[i].length);
    }
  if (last < 0) return state;
  thread_local CellLanes lanes;
  lanes.count = 0;
  bool all = rows.count > 1 && columns.count > 1;
  for (int r = 0; r + 1 < rows.count; ++r)
    for (int c = 0; c + 1 < columns.count; ++c) {
      const Cell cell{columns.at[c],
                      rows.at[r],
                      columns.at[c + 1],
                      rows.at[r + 1],
                      {nodes[r][c], nodes[r][c + 1], nodes[r + 1][c], nodes[r + 1][c + 1]}};
      const Corners found = corners(key, cell);
      all = expect(cell, found, lanes) && found.agree && all;
    }
  for (int turn = 0; turn < kCorrections && lanes.count > 0; ++turn)
    all = take(key, lanes, radiance) == 0 && all;
  for (std::size_t lane = 0; lane < lanes.count; ++lane)
    matches_[lanes.sample[lane]].outcome = Outcome::NotFound;
  state.all = all && lanes.count == 0;
  return state;
}

}  // namespace catoptric::methods::reprojection
