// Rectangles and regions of an image, and the rectangle in which a camera may see some points: used
// to find what may have changed between two frames.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "core/math.h"
#include "gl/draw_state.h"
#include "scene/camera.h"

namespace catoptric::raster {

/// Columns x0 .. x1 - 1 and rows y0 .. y1 - 1, row 0 on top. Initially empty.
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

/// The intersection of two rectangles.
inline Rectangle intersection(const Rectangle& a, const Rectangle& b) {
  return {std::max(a.x0, b.x0), std::max(a.y0, b.y0), std::min(a.x1, b.x1), std::min(a.y1, b.y1)};
}
/// The smallest rectangle that contains both.
inline Rectangle bounding(const Rectangle& a, const Rectangle& b) {
  if (a.empty()) return b;
  if (b.empty()) return a;
  return {std::min(a.x0, b.x0), std::min(a.y0, b.y0), std::max(a.x1, b.x1), std::max(a.y1, b.y1)};
}
/// The pixels that contain the samples of `r`, with `samples` samples per pixel and axis.
inline Rectangle pixelsOf(const Rectangle& r, int samples) {
  return {r.x0 / samples, r.y0 / samples, (r.x1 + samples - 1) / samples,
          (r.y1 + samples - 1) / samples};
}

/// A set of tiles of an image.
class Region {
 public:
  Region(int width, int height);
  /// Adds all tiles that a rectangle touches, or all tiles of another region of an image of the
  /// same size.
  void add(const Rectangle& rectangle);
  void add(const Region& other);
  /// Removes the tiles that the rectangle does not touch.
  void clip(const Rectangle& rectangle);
  /// Removes the tiles of another region of an image of the same size.
  void remove(const Region& other);
  bool touches(const Rectangle& rectangle) const;
  bool empty() const;
  /// Disjoint rectangles that cover the region. If there would be too many, tiles are merged, so
  /// that texels outside the region may be covered too.
  std::vector<Rectangle> rectangles() const;

 private:
  /// The columns and rows of the tiles that a rectangle touches.
  Rectangle tilesOf(const Rectangle& rectangle) const;

  Rectangle image_;
  int columns_;
  int rows_;
  std::vector<std::uint8_t> tiles_;  ///< row by row, 0 or 1
};

/// The rectangle of an image of width x height that may show any part of the convex hull of
/// `points`, with a margin of one texel for rounding. The whole image if a point is not beyond the
/// near plane.
Rectangle shownRectangle(const scene::Camera& camera, int width, int height,
                         std::span<const Vec3> points);
Rectangle shownRectangle(const scene::Camera& camera, int width, int height, const Box3& box);

/// `state` with its scissor set to a rectangle.
gl::DrawState within(const Rectangle& rectangle, gl::DrawState state = {});

}  // namespace catoptric::raster
