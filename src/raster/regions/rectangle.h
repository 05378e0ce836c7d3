// Parts of an image, and where a camera may show a part of space: what may have changed from one
// frame to the next.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "core/math.h"
#include "gl/draw_state.h"
#include "scene/camera.h"

namespace catoptric::raster {

/// Columns x0 .. x1 - 1 of rows y0 .. y1 - 1, row 0 on top; starts empty.
struct Rectangle {
  int x0 = 0;
  int y0 = 0;
  int x1 = 0;
  int y1 = 0;

  bool empty() const { return x0 >= x1 || y0 >= y1; }
  int width() const { return empty() ? 0 : x1 - x0; }
  int height() const { return empty() ? 0 : y1 - y0; }
  bool operator==(const Rectangle&) const = default;
};

/// What two have in common.
inline Rectangle intersection(const Rectangle& a, const Rectangle& b) {
  return {std::max(a.x0, b.x0), std::max(a.y0, b.y0), std::min(a.x1, b.x1), std::min(a.y1, b.y1)};
}
/// The least one that holds both.
inline Rectangle bounding(const Rectangle& a, const Rectangle& b) {
  if (a.empty()) return b;
  if (b.empty()) return a;
  return {std::min(a.x0, b.x0), std::min(a.y0, b.y0), std::max(a.x1, b.x1), std::max(a.y1, b.y1)};
}
/// The pixels of some samples, `samples` a pixel and axis.
inline Rectangle pixelsOf(const Rectangle& r, int samples) {
  return {r.x0 / samples, r.y0 / samples, (r.x1 + samples - 1) / samples,
          (r.y1 + samples - 1) / samples};
}

/// A part of an image in tiles.
class Region {
 public:
  Region(int width, int height);
  /// All tiles that a rectangle touches, or another region of an image of this size has.
  void add(const Rectangle& rectangle);
  void add(const Region& other);
  /// Without what lies in no tile of a rectangle.
  void clip(const Rectangle& rectangle);
  /// Without the tiles of another region of an image of this size.
  void remove(const Region& other);
  bool touches(const Rectangle& rectangle) const;
  bool empty() const;
  /// Disjoint rectangles that cover it, joined to fewer at the price of some texels more.
  std::vector<Rectangle> rectangles() const;

 private:
  /// Columns and rows of the tiles that a rectangle touches.
  Rectangle tilesOf(const Rectangle& rectangle) const;

  Rectangle image_;
  int columns_;
  int rows_;
  std::vector<std::uint8_t> tiles_;  ///< rows of 0 or 1
};

/// Where an image of width x height may show anything of the convex hull of `points`, a texel of
/// rounding included; all of it where one of them is not beyond the near plane.
Rectangle shownRectangle(const scene::Camera& camera, int width, int height,
                         std::span<const Vec3> points);
Rectangle shownRectangle(const scene::Camera& camera, int width, int height, const Box3& box);

/// `state` within a rectangle.
gl::DrawState within(const Rectangle& rectangle, gl::DrawState state = {});

}  // namespace catoptric::raster
