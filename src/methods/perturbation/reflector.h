// A sequence of reflectors as seen from the eye (a path type): its sampled paths, and the
// reflections of any point, which are found by perturbing these paths [Chen2000] Sec. III.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "methods/perturbation/bounce.h"
#include "methods/perturbation/ray_octree.h"
#include "methods/perturbation/turn.h"
#include "scene/camera.h"
#include "scene/implicit/surface.h"

namespace catoptric::methods::perturbation {

enum class Order : std::uint8_t { Nearest, Linear, Quadratic, Auto };

struct PathOptions {
  Order order = Order::Auto;
  int sampleSpacing = 16;  ///< pixels [Chen2000: 8 to 32]
  int fewestPaths = 64;    ///< the spacing is halved until there are this many
  /// How several reflections of a point are found: as minima among neighbouring rays, or (true) as
  /// groups of the k nearest rays, as in the paper.
  bool groups = false;
  int candidates = 5;               ///< k [Chen2000: 5]
  float groupAngleDegrees = 30.0f;  ///< maximum angle between reflected directions
  float groupDistance = 0.1f;       ///< fraction of the reflector's diameter
  float errorPixels = 0.1f;         ///< order auto: allowed error estimate
};

/// The view for which paths are sampled.
struct View {
  scene::Camera camera;
  int width = 0;  ///< in pixels
  int height = 0;
};

struct PathCounts {
  std::uint64_t paths = 0;
  /// For order auto: reflections found to first order, to second order, and by exact paths.
  std::uint64_t linear = 0;
  std::uint64_t quadratic = 0;
  std::uint64_t retraced = 0;
  std::uint64_t notConverged = 0;  ///< candidates that led to no reflection
  std::uint64_t leftOut = 0;       ///< reflections of a point beyond kMaxReflections
  void add(const PathCounts& other);
};

/// One reflection of a point.
struct Reflection {
  glm::dvec3 x{0.0};      ///< reflection point on the first reflector
  glm::dvec3 last{0.0};   ///< reflection point on the last reflector
  glm::dvec3 image{0.0};  ///< the virtual point, behind x at the path's optical length
  double share = 1.0;     ///< fraction of that length between the eye and `last`
};

/// Maximum number of reflections of a point (not from the paper; a wavy mirror with 20 crests has
/// shown 49).
inline constexpr std::size_t kMaxReflections = 64;

/// Up to kMaxReflections reflections. The first two are stored in place, because few points have
/// more and objects have many points.
class ReflectionList {
 public:
  /// Access beyond the end creates the elements up to `i`.
  Reflection& operator[](std::size_t i) {
    if (i < kInPlace) return few_[i];
    if (i - kInPlace >= more_.size()) more_.resize(i - kInPlace + 1);
    return more_[i - kInPlace];
  }
  const Reflection& operator[](std::size_t i) const {
    return i < kInPlace ? few_[i] : more_[i - kInPlace];
  }

 private:
  static constexpr std::size_t kInPlace = 2;
  std::array<Reflection, kInPlace> few_;
  std::vector<Reflection> more_;
};

/// All reflections of a point that were found.
struct Reflections {
  ReflectionList at;
  std::uint32_t count = 0;
};

class Reflector {
  /// An exact path that starts at the eye. bounces[i]: how its reflection point on reflector i
  /// moves with the one on reflector i + 1, or with the shown point.
  struct Path {
    std::array<Bounce<double>, kMaxTurns> bounces;
    std::array<double, kMaxTurns> distances{};  ///< metres from reflection point i to i + 1
    glm::dvec3 direction{0.0};                  ///< leaving the last reflector
    glm::dvec3 place(std::size_t i) const {
      const auto& x = bounces[i].x;
      return {x[0], x[1], x[2]};
    }
  };

 public:
  /// The most recently traced paths, from which reflections of nearby points are found.
  class Traced {
    friend class Reflector;
    static constexpr std::size_t kCount = 8;  ///< not from the paper
    std::vector<Path> paths_;
    std::size_t next_ = 0;
  };

  /// `turns`: 1 to kMaxTurns, in the order from the eye; keeps references to their surfaces.
  /// `scene`: bounds of everything that is reflected. `before`: the same sequence without the last
  /// turn, which must outlive this; null for one turn.
  Reflector(std::span<const Turn> turns, const Reflector* before, const Box3& scene,
            const View& view, const PathOptions& options);

  /// 0: no sampled path hits these reflectors in this order.
  std::size_t pathCount() const { return pathCount_; }
  /// Number of rays that were not sampled because the last surface reflects them totally.
  std::uint64_t totalReflections() const { return totalReflections_; }
  /// Whether the last reflector is visible in the preceding ones, but only between sampled paths.
  bool missed() const { return missed_; }
  /// Whether any path hits the last reflector again.
  bool seesItself() const { return !selfRays_.empty(); }
  /// The same sequence without the last turn; null for one turn.
  const Reflector* before() const { return before_; }
  /// Whether the last turn can hide points, see hidden(). Refractive objects cannot.
  bool hides() const { return !turns_.back().through && !turns_.back().total(); }
  bool refracts() const { return turns_[0].through || turns_.back().inside; }
  /// Diameter of the last reflector.
  double size() const { return size_; }
  double distanceFrom(const glm::dvec3& point) const { return glm::distance(point, centre_); }

  /// All reflections of a point, found from its nearest rays. `own`: the point lies on the last
  /// reflector itself. `traced`: paths of earlier points (order auto).
  Reflections reflectionsOf(const glm::dvec3& point, bool own, RayOctree::Cursor& cursor,
                            PathCounts& counts, Traced* traced = nullptr) const;
  /// Adds the exact reflections of a point that lie near the known reflections of a nearby point.
  void addReflectionsNear(const glm::dvec3& point, const Reflections& known, Reflections& result,
                          PathCounts& counts, Traced* traced = nullptr) const;
  /// For a point that the last reflector hides: its view without that reflector, directly or in the
  /// preceding reflectors. `share`: fraction up to the hiding surface. `cursor` and `traced` belong
  /// to the preceding sequence. At a mirror's silhouette the reflection merges with this view.
  /// Refractive objects have no such points.
  std::optional<Reflection> hidden(const glm::dvec3& point, RayOctree::Cursor& cursor,
                                   PathCounts& counts, Traced* traced = nullptr) const;

 private:
  class Sampling;  ///< samples the paths; path_sampling.cpp
  using Places = std::array<glm::dvec3, kMaxTurns>;
  /// start of the search that found each reflection
  using Starts = std::array<glm::dvec3, kMaxReflections>;

  std::size_t lastTurn() const { return turns_.size() - 1; }
  /// Samples the paths at every n-th pixel, denser for reflectors that look small.
  void samplePaths(const View& view, const Box3& scene);
  /// Result of the search for a path from the eye towards x, near the first surface.
  enum class PathSearch { Path, Nothing, TotalReflection };
  PathSearch pathBy(glm::dvec3 x, Path& path) const;
  /// Whether two neighbouring paths are too different to interpolate: their direction turns by
  /// another angle at the end than at the start.
  bool unlike(const Path& a, const Path& b) const;
  /// Whether the last surface would transmit a path that it should reflect totally.
  bool wouldLeave(const Path& path) const;
  /// Whether a path may be perturbed if its point has distance `rho` from the last turn.
  bool movable(const Bounce<double>* bounces, double rho) const;
  /// Perturbs a path's reflection points, to first and second order, for a step of its point.
  void move(const Bounce<double>* bounces, const double* distances, double rho,
            const glm::dvec3& step, Places& first, Places& second) const;
  /// Newton's iteration over exact paths, each of which is expanded again. `places[0]` is the
  /// start. Returns whether it converged to a reflection.
  bool retrace(const glm::dvec3& point, Places& places, Traced* traced) const;
  /// Perturbs one of the traced paths that leads near places[0], if its error estimate is within a
  /// fraction of the allowed error. Returns that path, or null.
  const Path* moveTraced(const glm::dvec3& point, const Traced& traced, Places& places) const;
  /// moveTraced(); if it fails, retrace(). Returns whether a reflection was found.
  bool trace(const glm::dvec3& point, Places& places, PathCounts& counts, Traced* traced) const;
  /// Whether the perturbed reflection points of a path with these bounces form a valid reflection.
  bool accept(const glm::dvec3& point, const Places& places, const Bounce<double>* bounces) const;
  /// Whether a reflection at turn `turn` certainly turns direction `-back` into `ahead`, given the
  /// curvature at its bounce.
  bool surelyTurns(std::size_t turn, const Bounce<double>& bounce, const glm::dvec3& x,
                   const glm::dvec3& back, const glm::dvec3& ahead) const;
  /// The fraction of the way from `from` (the eye or the previous reflection point) to a point at
  /// which reflector `turn` hides it; at least 1: not hidden.
  double hiddenAt(std::size_t turn, const glm::dvec3& from, const glm::dvec3& point) const;
  /// Whether the inside of reflector `turn` at x is visible from `from`, through an opening. Beyond
  /// the silhouette of a closed object the inside is not visible, however close x is to the
  /// silhouette.
  bool insideShows(std::size_t turn, const glm::dvec3& from, const glm::dvec3& x) const;
  void add(const glm::dvec3& point, const Places& places, const glm::dvec3& from, Starts& starts,
           Reflections& result, PathCounts& counts) const;
  double pixels(const glm::dvec3& x, double metres) const;
  /// The part of the image in which the preceding reflectors show the last one: x0, y0, x1, y1.
  /// nullopt: none.
  std::optional<std::array<float, 4>> imageOfLast(const View& view) const;

  std::vector<Turn> turns_;
  const Reflector* before_;
  PathOptions options_;
  glm::dvec3 eye_;
  glm::dvec3 centre_;
  std::array<double, kMaxTurns> sizes_{};  ///< diagonals of the bounds, metres
  double size_ = 0.0;                      ///< size of the last reflector
  std::array<bool, kMaxTurns> smooth_{};   ///< surfaces without edges (discontinuous normals)
  double spread_ = 0.0;                    ///< angle of a pixel in radians
  std::size_t pathCount_ = 0;
  std::uint64_t totalReflections_ = 0;
  bool missed_ = false;
  // Per path one entry for each turn, starting at the eye
  std::vector<Bounce<double>> bounces_;
  std::vector<double> distances_;
  std::vector<std::uint32_t> rays_;  ///< path of each ray of the octree
  RayOctree octree_;
  std::vector<std::uint32_t> selfRays_;  ///< path of each ray that hits the last reflector again
  RayOctree selfOctree_;
};

}  // namespace catoptric::methods::perturbation
