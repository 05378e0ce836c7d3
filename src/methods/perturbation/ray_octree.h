// Which sample rays pass nearest to a point [Chen2000] Sec. III-B.2, C.1. One octree per path type.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/lanes.h"
#include "core/math.h"

namespace catoptric::methods::perturbation {

/// The outer segment of a sampled path: from x_1 on, to where it meets the scene (or infinity).
struct SampleRay {
  glm::dvec3 origin;
  glm::dvec3 direction;  ///< unit
  double length = std::numeric_limits<double>::infinity();
};

/// The nearest point of a ray is origin + t direction.
inline double nearestParameter(const SampleRay& ray, const glm::dvec3& point) {
  return glm::clamp(glm::dot(point - ray.origin, ray.direction), 0.0, ray.length);
}
inline double distanceTo(const SampleRay& ray, const glm::dvec3& point) {
  return glm::length(ray.origin + nearestParameter(ray, point) * ray.direction - point);
}

/// A ray's neighbours among the samples of the image, kNoRay where there is none.
using Neighbours = std::array<std::uint32_t, 8>;
inline constexpr std::uint32_t kNoRay = 0xffffffff;
/// Of rays that were sampled on a grid: `rayAt[y * width + x]` is a sample's ray, or kNoRay. A ray
/// may stand for a square of the grid; of several rays along its side it knows the middle one.
std::vector<Neighbours> gridNeighbours(int width, int height, std::span<const std::uint32_t> rayAt);

struct NearRay {
  std::uint32_t ray = 0;
  double distance = 0.0;
};

/// Candidate sets are made for one of two questions:
/// - the k nearest rays of a point, as in the paper; groupRepresentatives() then tells its
/// reflections
///   apart;
/// - with `neighbours`, the rays that are nearer to the point than their neighbours in the image,
/// no
///   farther than the farthest of these is from them. Each reflection of the point is such a
///   minimum however many samples fall on it, and no threshold is needed. (ours; README.md
///   compares)
class RayOctree {
 public:
  struct Settings {
    std::size_t k = 5;             ///< nearest rays that cells guarantee [Chen2000: 5]
    int maxDepth = 9;              ///< ours
    std::size_t leafSize = 16;     ///< cells with fewer candidates are not divided (ours)
    std::size_t maxLeaves = 8192;  ///< ours
  };
  /// Four rays at a time, in floats: their Glances' origins and bases, directions and growths.
  using FourGlances = std::array<Floats4, 8>;
  /// Where the last look-up ended: points near to each other find their cells from there.
  struct Cursor {
    std::array<std::uint32_t, 32> nodes{};  ///< from the root to the leaf
    int depth = -1;
    std::array<std::uint32_t, 3> cell{};  ///< at the octree's greatest depth
    std::uint64_t steps = 0;              ///< nodes that were visited
    std::uint64_t outside = 0;            ///< points outside the box: all rays are candidates
    std::vector<std::uint32_t> near;      ///< scratch, and that of callers
    std::vector<NearRay> found;
    /// By ray: the last look-up that met it, counted down in the upper half, and the bits of its
    /// squared distance there. So what this one met is less than what others did, and less the
    /// nearer it is.
    std::vector<std::uint64_t> seen;
    const std::uint32_t* packedFrom = nullptr;  ///< candidates
    std::vector<FourGlances> packed;            ///< of theirs
    std::uint32_t lookUp = ~0u;
  };

  RayOctree() = default;
  /// Cells cover `min` to `max`. Rays with coordinates that are not finite are a bug of the caller.
  RayOctree(std::vector<SampleRay> rays, const glm::dvec3& min, const glm::dvec3& max,
            const Settings& settings, std::vector<Neighbours> neighbours = {});

  /// Every ray that nearest() or reflections() can return for `point`, and others.
  std::span<const std::uint32_t> candidates(const glm::dvec3& point, Cursor& cursor) const;
  /// The k nearest rays in the order of distance, then of number; fewer when there are fewer.
  void nearest(const glm::dvec3& point, Cursor& cursor, std::vector<NearRay>& result) const;

  /// The minima of the distance among neighbours, in the order of distance. Needs neighbours; a ray
  /// without any has no beam and is nobody's answer.
  void reflections(const glm::dvec3& point, Cursor& cursor, std::vector<NearRay>& result) const;

  const std::vector<SampleRay>& rays() const { return rays_; }

 private:
  struct Node {
    std::uint32_t child = 0;  ///< of eight; 0: a leaf
    std::uint32_t begin = 0;  ///< of a leaf's candidates
    std::uint32_t end = 0;
  };
  void build();
  /// At t no neighbour is farther from a ray than base + growth t.
  struct Beam {
    double base = 0.0;
    double growth = 0.0;
  };
  /// A ray and its beam from `min` on, for a first look at many.
  struct alignas(32) Glance {
    std::array<float, 4> origin;     ///< w: beam's base
    std::array<float, 4> direction;  ///< w: its growth
  };
  FourGlances fourGlances(const std::array<std::uint32_t, 4>& rays) const;
  /// Lists those of some candidates whose beams may hold a point, in their order, in `cursor.near`.
  void beamsAt(const glm::dvec3& point, std::span<const std::uint32_t> from, Cursor& cursor) const;
  /// Whether a ray is one of reflections()' answers for a point (relative to `min`) for sure:
  /// squared distances in floats are off by `doubt` together.
  bool surelyAnswer(const glm::vec3& p, const NearRay& near, float doubt) const;
  /// Whether the farthest neighbour of a ray is at least `distance` from its point at t.
  bool inBeam(std::uint32_t ray, double t, double distance) const;
  /// Those of `from` that can be an answer for a point within `radius` of `centre`.
  std::vector<std::uint32_t> candidateSet(const glm::dvec3& centre, double radius,
                                          const std::vector<std::uint32_t>& from) const;

  std::vector<SampleRay> rays_;
  std::vector<Neighbours> neighbours_;
  std::vector<Neighbours> around_;  ///< the same with the ray itself in place of kNoRay
  std::vector<Beam> beams_;
  std::vector<Glance> glances_;
  float farthest2_ = 0.0f;  ///< squared distance of an origin from `min`
  bool endless_ = true;     ///< all rays
  glm::dvec3 min_{0.0};
  glm::dvec3 size_{1.0};
  Settings settings_;
  std::vector<Node> nodes_;
  std::vector<std::uint32_t> candidates_;
  std::vector<std::uint32_t> all_;
};

/// Rays in one group see the same reflection of a point: their reflection points are at most
/// `distance` apart, their directions at most `angleRad`. [Chen2000] Sec. III-C.1: thresholds of
/// the user
struct GroupLimits {
  double angleRad = 0.5;
  double distance = 0.1;  ///< metres
};
/// The nearest ray of each group, in the order of `nearest`, which is sorted.
std::vector<std::uint32_t> groupRepresentatives(std::span<const SampleRay> rays,
                                                std::span<const NearRay> nearest,
                                                const GroupLimits& limits);

}  // namespace catoptric::methods::perturbation
