// The reflection buffers [Xie2017] Sec. 3.1: the hits of a key frame's reflected rays, which later
// frames reproject.
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

/// Maps a point in world space to samples: (x, y) = (X / W, Y / W), with integer sample centres. W
/// is the distance along the camera's axis.
Mat4 sampleFromWorldOf(const scene::Camera& camera, int width, int height);

/// Indexed by sample, row 0 on top. Contains mirrors only.
class KeyFrame {
 public:
  /// Starts a key frame of width x height samples of `camera`, without any reflections. `normals`:
  /// normals are kept too.
  void begin(int width, int height, const scene::Camera& camera, const frame::Lighting& lighting,
             const frame::Geometry& geometry, bool normals = false);
  /// Stores the reflection of sample `at`: a mirror ray's first hit and its radiance. Threads may
  /// store different samples at the same time.
  void keep(std::size_t at, const trace::ReflectionPoint& point, const trace::FirstHit& hit,
            const Vec3& radiance);
  /// Call this after the last keep(). `epsilon`: as for continuous().
  void finish(const frame::Geometry& geometry, float epsilon);

  /// Moves the hits on moving objects to their current position.
  void follow(const frame::Geometry& geometry);

  bool empty() const { return width_ == 0; }
  /// Number of calls of begin().
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

  /// Id of the reflector whose reflection is stored; 0: none.
  std::uint32_t reflector(std::size_t at) const {
    return static_cast<std::uint32_t>(surface_[at] >> 32U);
  }
  /// Id of the reflected object; 0: the sky.
  std::uint32_t shown(std::size_t at) const { return static_cast<std::uint32_t>(surface_[at]); }
  /// reflector() and shown() combined in one number.
  std::uint64_t surface(std::size_t at) const { return surface_[at]; }
  /// surface() of the sample nearest to a position; 0 outside.
  std::uint64_t surfaceAt(const Vec2& place) const {
    const Vec2 nearest = glm::floor(place + 0.5f);
    if (!(nearest.x >= 0.0f && nearest.y >= 0.0f && nearest.x < static_cast<float>(width_) &&
          nearest.y < static_cast<float>(height_)))
      return 0;
    return surface_[index(static_cast<int>(nearest.x), static_cast<int>(nearest.y))];
  }
  /// R: the position of the hit, w = 1; or the direction to the sky, w = 0.
  Vec4 place(std::size_t at) const { return Vec4(Vec3(place_[at]), shown(at) != 0 ? 1.0f : 0.0f); }
  const Vec3& radiance(std::size_t at) const { return radiance_[at]; }
  /// s.d + s.r, the Euclidean path length in metres from the eye to the hit; s.d for the sky.
  float length(std::size_t at) const { return place_[at].w; }
  /// s.d of a sample with a stored reflection: metres from the eye.
  float distance(std::size_t at) const { return distance_[at]; }

  /// Whether two samples show one continuous surface in one reflector: the relative difference of
  /// their lengths is at most `epsilon`.
  bool continuous(std::size_t a, std::size_t b, float epsilon) const {
    return surface_[a] == surface_[b] &&
           std::abs(place_[a].w - place_[b].w) <= epsilon * std::min(place_[a].w, place_[b].w);
  }
  /// Per sample: if it and its three neighbours to the right and below show one continuous surface,
  /// twice the reflector's id, plus 1 for the sky; otherwise 0.
  std::span<const std::uint32_t> cells() const { return cells_; }
  /// Samples that reflect a nearer surface than one of their neighbours in the same reflector.
  std::span<const std::uint32_t> nearEdges() const { return nearEdges_; }
  /// Per sample: place() and length().
  std::span<const Vec4> places() const { return place_; }
  std::span<const Vec3> radiances() const { return radiance_; }

  /// s.n, if begin() was told to keep normals.
  const Vec3& normal(std::size_t at) const { return normal_[at]; }

  /// Where a point of object `object` (index), which is now at `position`, lies in the key frame:
  /// in samples with integer centres. nullopt behind the camera.
  std::optional<Vec2> project(const Vec3& position, int object,
                              const frame::Geometry& geometry) const;
  /// The world-space position of the same point at the key frame's time.
  Vec3 formerly(const Vec3& position, int object, const frame::Geometry& geometry) const;
  /// The present world-space position of the reflector's point at sample `at`.
  Vec3 reflectorNow(std::size_t at, const frame::Geometry& geometry) const;

 private:
  void findCells(float epsilon);
  void findNearEdges(float epsilon);
  /// A hit on a moving object, from which the hit's current position is computed.
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
  // Indexed by sample. The data that the search reads lie in two arrays, because the search waits
  // for memory most of the time.
  std::vector<std::uint64_t> surface_;  ///< ids of the reflector and of the reflected object
  std::vector<Vec4> place_;             ///< position or direction, and path length
  std::vector<Vec3> radiance_;
  std::vector<std::uint32_t> cells_;
  std::vector<std::uint32_t> nearEdges_;
  std::vector<float> distance_;
  std::vector<Vec3> normal_;
  std::vector<MovingHit> moving_;
  std::vector<std::uint8_t> hitObjectMoves_;
  std::vector<trace::Hit> hits_;  ///< indexed by sample, until finish(); empty if nothing moves
};

}  // namespace catoptric::methods::reprojection
