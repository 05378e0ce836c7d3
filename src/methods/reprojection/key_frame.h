// The reflection buffers [Xie2017] Sec. 3.1: what the reflective samples of a key frame have met,
// kept so that later frames find their reflections in them.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/math.h"
#include "frame/geometry.h"
#include "frame/shading.h"
#include "scene/camera.h"
#include "trace/lobes/reflect.h"

namespace catoptric::methods::reprojection {

/// Maps a point of world space to samples: (x, y) = (X / W, Y / W), centres at whole numbers; W is
/// the distance along the camera's axis.
Mat4 sampleFromWorldOf(const scene::Camera& camera, int width, int height);

/// By sample, row 0 on top; of mirrors alone.
class KeyFrame {
 public:
  /// Of width x height samples as `camera` sees them; nothing is kept of reflections yet.
  /// `normals`: they are kept too.
  void begin(int width, int height, const scene::Camera& camera, const frame::Lighting& lighting,
             const frame::Geometry& geometry, bool normals = false);
  /// Keeps what the sample `at` reflects: a mirror's first hit and the light from there. Threads
  /// may keep different samples at once.
  void keep(std::size_t at, const trace::ReflectionPoint& point, const trace::FirstHit& hit,
            const Vec3& radiance);
  /// After the last keep(). `epsilon`: that of continuous().
  void finish(const frame::Geometry& geometry, float epsilon);

  /// Brings what has been met on moving objects to where it is now.
  void follow(const frame::Geometry& geometry);

  bool empty() const { return width_ == 0; }
  /// Counts the calls of begin().
  int number() const { return number_; }
  int width() const { return width_; }
  int height() const { return height_; }
  const scene::Camera& camera() const { return camera_; }
  const frame::Lighting& lighting() const { return lighting_; }

  bool inside(int x, int y) const { return x >= 0 && y >= 0 && x < width_ && y < height_; }
  std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) +
           static_cast<std::size_t>(x);
  }

  /// Id of the reflector whose reflection is kept; 0: none is.
  std::uint32_t reflector(std::size_t at) const {
    return static_cast<std::uint32_t>(surface_[at] >> 32U);
  }
  /// The id of what it shows; 0: the sky.
  std::uint32_t shown(std::size_t at) const { return static_cast<std::uint32_t>(surface_[at]); }
  /// Equal where reflector() and shown() are.
  std::uint64_t surface(std::size_t at) const { return surface_[at]; }
  /// R: its place, w = 1; or the direction to the sky, w = 0.
  Vec4 place(std::size_t at) const { return Vec4(Vec3(place_[at]), shown(at) != 0 ? 1.0f : 0.0f); }
  const Vec3& radiance(std::size_t at) const { return radiance_[at]; }
  /// s.d + s.r, Euclidean metres from the eye by way of the reflector; of the sky s.d.
  float length(std::size_t at) const { return place_[at].w; }
  /// s.d of a sample whose reflection is kept: metres from the eye.
  float distance(std::size_t at) const { return distance_[at]; }

  /// Whether two samples show one continuous surface in one reflector: their lengths differ by no
  /// more than `epsilon`, relatively.
  bool continuous(std::size_t a, std::size_t b, float epsilon) const {
    return surface_[a] == surface_[b] &&
           std::abs(place_[a].w - place_[b].w) <= epsilon * std::min(place_[a].w, place_[b].w);
  }
  /// By sample: where it and the three to its right and below show one continuous surface twice the
  /// reflector's id, and 1 more of the sky; else 0.
  std::span<const std::uint32_t> cells() const { return cells_; }
  /// By sample: place() and length().
  std::span<const Vec4> places() const { return place_; }
  std::span<const Vec3> radiances() const { return radiance_; }

  /// s.n, where begin() was told to keep them.
  const Vec3& normal(std::size_t at) const { return normal_[at]; }

  /// Where the key frame's camera sees a point of object `object` (index) that is at `position`
  /// now: in samples, centres at whole numbers. Nothing behind the camera.
  std::optional<Vec2> project(const Vec3& position, int object,
                              const frame::Geometry& geometry) const;
  /// The same point where it was, world space.
  Vec3 formerly(const Vec3& position, int object, const frame::Geometry& geometry) const;

 private:
  void findCells(float epsilon);
  /// A hit on an object that moves, by which it is found again.
  struct MovingHit {
    std::size_t at = 0;
    trace::Hit hit;
  };

  int number_ = 0;
  int width_ = 0;
  int height_ = 0;
  scene::Camera camera_;
  frame::Lighting lighting_;
  Mat4 sampleFromWorld_{1.0f};  ///< x, y and w in rows 0, 1 and 3
  std::vector<Mat4> worldFromObject_;
  // By sample. What the search reads lies in two arrays: it waits for memory most of its time.
  std::vector<std::uint64_t> surface_;  ///< reflector and what it shows
  std::vector<Vec4> place_;             ///< place or direction, and length
  std::vector<Vec3> radiance_;
  std::vector<std::uint32_t> cells_;
  std::vector<float> distance_;
  std::vector<Vec3> normal_;
  std::vector<MovingHit> moving_;
  std::vector<std::uint8_t> hitObjectMoves_;
  std::vector<trace::Hit> hits_;  ///< by sample, until finish(); empty when nothing moves
};

}  // namespace catoptric::methods::reprojection
