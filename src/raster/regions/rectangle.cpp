#include "raster/regions/rectangle.h"

#include <cassert>
#include <utility>

#include "gl/api.h"
#include "raster/regions/screen.h"

namespace catoptric::raster {
namespace {

/// Texels a side (ours: smaller ones cost more rectangles).
constexpr int kTile = 16;
/// From so many on larger tiles are taken (ours).
constexpr std::size_t kManyRectangles = 48;
/// A rectangle costs passes as much as so many texels (ours).
constexpr int kRectangleCost = 1024;

/// Disjoint rectangles that cover the tiles of a grid: runs of a row, those of like runs in one.
std::vector<Rectangle> coverOf(const std::vector<std::uint8_t>& tiles, int columns, int rows) {
  std::vector<Rectangle> cover;
  constexpr std::size_t kNone = static_cast<std::size_t>(-1);
  // By its first column: the last rectangle that begins there
  std::vector<std::size_t> lastAt(static_cast<std::size_t>(columns), kNone);
  for (int y = 0; y < rows; ++y) {
    const auto row = tiles.begin() + static_cast<std::ptrdiff_t>(y) * columns;
    for (int x = 0; x < columns; ++x) {
      if (row[x] == 0) continue;
      const int x0 = x;
      while (x < columns && row[x] != 0) ++x;
      std::size_t& last = lastAt[static_cast<std::size_t>(x0)];
      if (last != kNone && cover[last].x1 == x && cover[last].y1 == y) {
        cover[last].y1 = y + 1;
      } else {
        last = cover.size();
        cover.push_back({x0, y, x, y + 1});
      }
    }
  }
  return cover;
}

/// Joins rectangles where that leaves fewer for few texels more; they stay disjoint.
void join(std::vector<Rectangle>& cover) {
  const auto area = [](const Rectangle& r) { return r.width() * r.height(); };
  // Pairs that are not worth it, until what is joined elsewhere touches their bounds
  const std::size_t numbers = 2 * cover.size();
  std::vector<std::size_t> numberOf(cover.size());
  for (std::size_t i = 0; i < cover.size(); ++i) numberOf[i] = i;
  std::size_t next = cover.size();
  struct Pair {
    std::size_t at;
    Rectangle bounds;
  };
  std::vector<Pair> refused;
  std::vector<std::uint8_t> isRefused(numbers * numbers);
  for (bool joined = true; joined;) {
    joined = false;
    int all = 0;
    for (const Rectangle& r : cover) all += area(r);
    // No pair gains more than if it took all of them with it
    const int most = all + kRectangleCost * (static_cast<int>(cover.size()) - 1);
    for (std::size_t i = 0; i < cover.size() && !joined; ++i) {
      for (std::size_t j = i + 1; j < cover.size() && !joined; ++j) {
        const std::size_t pair = numberOf[i] * numbers + numberOf[j];
        if (isRefused[pair] != 0) continue;
        // With all that their bounds touch
        Rectangle bounds = bounding(cover[i], cover[j]);
        if (area(bounds) >= most) continue;
        int before = 0;
        int count = 0;
        for (std::size_t k = 0; k < cover.size(); ++k) {
          if (intersection(bounds, cover[k]).empty()) continue;
          const Rectangle larger = bounding(bounds, cover[k]);
          if (larger == bounds) {
            before += area(cover[k]);
            ++count;
            continue;
          }
          bounds = larger;
          before = count = 0;
          k = static_cast<std::size_t>(-1);
        }
        joined = area(bounds) - before < kRectangleCost * (count - 1);
        if (!joined) {
          refused.push_back({pair, bounds});
          isRefused[pair] = 1;
          continue;
        }
        for (std::size_t k = cover.size(); k-- > 0;) {
          if (intersection(bounds, cover[k]).empty()) continue;
          cover.erase(cover.begin() + static_cast<std::ptrdiff_t>(k));
          numberOf.erase(numberOf.begin() + static_cast<std::ptrdiff_t>(k));
        }
        cover.push_back(bounds);
        numberOf.push_back(next++);
        std::erase_if(refused, [&](const Pair& other) {
          const bool touched = !intersection(bounds, other.bounds).empty();
          if (touched) isRefused[other.at] = 0;
          return touched;
        });
      }
    }
  }
}

}  // namespace

Rectangle shownRectangle(const scene::Camera& camera, int width, int height,
                         std::span<const Vec3> points) {
  return Screen(camera, width, height).shows(points);
}

Rectangle shownRectangle(const scene::Camera& camera, int width, int height, const Box3& box) {
  return Screen(camera, width, height).shows(box);
}

Region::Region(int width, int height)
    : image_{0, 0, width, height},
      columns_((width + kTile - 1) / kTile),
      rows_((height + kTile - 1) / kTile),
      tiles_(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_)) {}

Rectangle Region::tilesOf(const Rectangle& rectangle) const {
  const Rectangle r = intersection(rectangle, image_);
  return r.empty() ? Rectangle() : pixelsOf(r, kTile);
}

void Region::add(const Rectangle& rectangle) {
  const Rectangle t = tilesOf(rectangle);
  for (int y = t.y0; y < t.y1; ++y)
    std::fill_n(tiles_.begin() + y * columns_ + t.x0, t.width(), std::uint8_t{1});
}

void Region::add(const Region& other) {
  assert(other.image_ == image_);
  for (std::size_t i = 0; i < tiles_.size(); ++i) tiles_[i] |= other.tiles_[i];
}

void Region::clip(const Rectangle& rectangle) {
  Region inside(image_.x1, image_.y1);
  inside.add(rectangle);
  for (std::size_t i = 0; i < tiles_.size(); ++i) tiles_[i] &= inside.tiles_[i];
}

void Region::remove(const Region& other) {
  assert(other.image_ == image_);
  for (std::size_t i = 0; i < tiles_.size(); ++i) {
    if (other.tiles_[i] != 0) tiles_[i] = 0;
  }
}

bool Region::touches(const Rectangle& rectangle) const {
  const Rectangle t = tilesOf(rectangle);
  for (int y = t.y0; y < t.y1; ++y) {
    const auto row = tiles_.begin() + y * columns_;
    if (std::find(row + t.x0, row + t.x1, 1) != row + t.x1) return true;
  }
  return false;
}

bool Region::empty() const {
  return std::find(tiles_.begin(), tiles_.end(), 1) == tiles_.end();
}

std::vector<Rectangle> Region::rectangles() const {
  std::vector<std::uint8_t> tiles = tiles_;
  int columns = columns_;
  int rows = rows_;
  int size = kTile;
  std::vector<Rectangle> cover = coverOf(tiles, columns, rows);
  while (cover.size() > kManyRectangles) {
    // Two by two
    const int halfColumns = (columns + 1) / 2;
    const int halfRows = (rows + 1) / 2;
    std::vector<std::uint8_t> larger(static_cast<std::size_t>(halfColumns) *
                                     static_cast<std::size_t>(halfRows));
    for (int y = 0; y < rows; ++y) {
      for (int x = 0; x < columns; ++x)
        larger[static_cast<std::size_t>(y / 2 * halfColumns + x / 2)] |=
            tiles[static_cast<std::size_t>(y * columns + x)];
    }
    tiles = std::move(larger);
    columns = halfColumns;
    rows = halfRows;
    size *= 2;
    cover = coverOf(tiles, columns, rows);
  }
  for (Rectangle& r : cover)
    r = intersection(image_, {size * r.x0, size * r.y0, size * r.x1, size * r.y1});
  join(cover);
  return cover;
}

gl::DrawState within(const Rectangle& rectangle, gl::DrawState state) {
  state.scissor = gl::Scissor{rectangle.x0, rectangle.y0, rectangle.width(), rectangle.height()};
  return state;
}

}  // namespace catoptric::raster
