// Finds the sample rays nearest to a point [Chen2000] Sec. III-B.2, C.1. One octree per path type.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/lanes.h"
#include "core/math.h"

namespace catoptric::methods::perturbation {

/// The outer segment of a sampled path: from x_1 to its hit in the scene (or to infinity).
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

/// A ray's neighbours among the samples of the image; kNoRay where there is none.
using Neighbours = std::array<std::uint32_t, 8>;
inline constexpr std::uint32_t kNoRay = 0xffffffff;
/// The neighbours of rays that were sampled on a grid: `rayAt[y * width + x]` is a sample's ray, or
/// kNoRay. A ray may represent a square of the grid. If several rays lie along one side of its
/// square, the middle one is its neighbour.
std::vector<Neighbours> gridNeighbours(int width, int height, std::span<const std::uint32_t> rayAt);

struct NearRay {
  std::uint32_t ray = 0;
  double distance = 0.0;
};

/// Candidate sets serve one of two queries:
/// - the k nearest rays of a point, as in the paper; groupRepresentatives() then separates its
///   reflections;
/// - with `neighbours`: the rays that are nearer to the point than their neighbours in the image,
///   if the point lies in their beam. A beam ends at the farthest neighbour. Each reflection of
///   the point is such a minimum, however many samples show it, so no threshold is needed (not
///   from the paper; README.md compares both).
class RayOctree {
 public:
  struct Settings {
    std::size_t k = 5;  ///< number of nearest rays that cells guarantee [Chen2000: 5]
    int maxDepth = 9;   ///< not from the paper
    /// Cells with at most this many rays are not divided (not from the paper).
    std::size_t leafSize = 16;
    std::size_t maxLeaves = 8192;  ///< not from the paper
  };
  /// The Glances of four rays in floats: origins and bases, directions and growths.
  using FourGlances = std::array<Floats4, 8>;
  /// Where the last look-up ended. Look-ups of nearby points start there.
  struct Cursor {
    std::array<std::uint32_t, 32> nodes{};  ///< from the root to the leaf
    int depth = -1;
    std::array<std::uint32_t, 3> cell{};  ///< cell at the octree's greatest depth
    std::uint64_t steps = 0;              ///< number of visited nodes
    std::uint64_t outside = 0;        ///< points outside the box, for which all rays are candidates
    std::vector<std::uint32_t> near;  ///< scratch memory, also for callers
    std::vector<NearRay> found;
    /// By ray: the number of the last look-up that saw it, counted down, in the upper half; the
    /// bits of its squared distance in the lower half. The current look-up's values are thus
    /// smaller than those of earlier ones, and increase with distance.
    std::vector<std::uint64_t> seen;
    const std::uint32_t* packedFrom = nullptr;  ///< candidates that `packed` contains
    std::vector<FourGlances> packed;            ///< their Glances
    std::uint32_t lookUp = ~0u;
  };

  RayOctree() = default;
  /// Cells cover `min` to `max`. All coordinates of rays must be finite.
  RayOctree(std::vector<SampleRay> rays, const glm::dvec3& min, const glm::dvec3& max,
            const Settings& settings, std::vector<Neighbours> neighbours = {});

  /// Contains every ray that nearest() or reflections() can return for `point`, and others.
  std::span<const std::uint32_t> candidates(const glm::dvec3& point, Cursor& cursor) const;
  /// The k nearest rays, sorted by distance, then by number; all rays if there are fewer than k.
  void nearest(const glm::dvec3& point, Cursor& cursor, std::vector<NearRay>& result) const;

  /// The minima of the distance among neighbours, sorted by distance. Needs neighbours; a ray
  /// without neighbours has no beam and is never returned.
  void reflections(const glm::dvec3& point, Cursor& cursor, std::vector<NearRay>& result) const;

  const std::vector<SampleRay>& rays() const { return rays_; }

 private:
  struct Node {
    std::uint32_t child = 0;  ///< first of eight children; 0: a leaf
    std::uint32_t begin = 0;  ///< first of a leaf's candidates
    std::uint32_t end = 0;
  };
  void build();
  /// At parameter t no neighbour is farther from a ray than base + growth t.
  struct Beam {
    double base = 0.0;
    double growth = 0.0;
  };
  /// A ray and its beam relative to `min`, in floats, for a fast first test.
  struct alignas(32) Glance {
    std::array<float, 4> origin;     ///< w: the beam's base
    std::array<float, 4> direction;  ///< w: the beam's growth
  };
  FourGlances fourGlances(const std::array<std::uint32_t, 4>& rays) const;
  /// Sets `cursor.near` to the candidates in `from` whose beams may contain a point, in order.
  void beamsAt(const glm::dvec3& point, std::span<const std::uint32_t> from, Cursor& cursor) const;
  /// Whether a ray is certainly in the result of reflections() for a point (relative to `min`).
  /// `doubt`: error of the sum of squared distances in floats.
  bool surelyAnswer(const glm::vec3& p, const NearRay& near, float doubt) const;
  /// Whether the farthest neighbour of a ray at t is at least `distance` away from the ray.
  bool inBeam(std::uint32_t ray, double t, double distance) const;
  /// The rays of `from` that can be in a result for a point within `radius` of `centre`.
  std::vector<std::uint32_t> candidateSet(const glm::dvec3& centre, double radius,
                                          const std::vector<std::uint32_t>& from) const;

  std::vector<SampleRay> rays_;
  std::vector<Neighbours> neighbours_;
  std::vector<Neighbours> around_;  ///< neighbours, with the ray itself instead of kNoRay
  std::vector<Beam> beams_;
  std::vector<Glance> glances_;
  float farthest2_ = 0.0f;  ///< largest squared distance of an origin from `min`
  bool endless_ = true;     ///< all rays are infinitely long
  glm::dvec3 min_{0.0};
  glm::dvec3 size_{1.0};
  Settings settings_;
  std::vector<Node> nodes_;
  std::vector<std::uint32_t> candidates_;
  std::vector<std::uint32_t> all_;
};

/// Rays of one group show the same reflection of a point: their reflection points are at most
/// `distance` apart, their directions at most `angleRad`. Thresholds of the user: [Chen2000] Sec.
/// III-C.1
struct GroupLimits {
  double angleRad = 0.5;
  double distance = 0.1;  ///< metres
};
/// The nearest ray of each group, in the order of `nearest`, which must be sorted.
std::vector<std::uint32_t> groupRepresentatives(std::span<const SampleRay> rays,
                                                std::span<const NearRay> nearest,
                                                const GroupLimits& limits);

}  // namespace catoptric::methods::perturbation
