// A sequence of reflectors as the eye sees it, a path type: the sampled paths, and where any point
// appears by way of them by perturbing them [Chen2000] Sec. III.
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
  int fewestPaths = 64;    ///< halves the spacing until there are as many
  /// Several reflections of a point: by minima among neighbouring rays, or as in the paper by
  /// groups of the k nearest.
  bool groups = false;
  int candidates = 5;               ///< k [Chen2000: 5]
  float groupAngleDegrees = 30.0f;  ///< between reflected directions, at most
  float groupDistance = 0.1f;       ///< share of the reflector's diameter
  float errorPixels = 0.1f;         ///< order auto: what the estimate allows
};

/// The view that paths start from.
struct View {
  scene::Camera camera;
  int width = 0;  ///< pixels
  int height = 0;
};

struct PathCounts {
  std::uint64_t paths = 0;
  std::uint64_t linear = 0;  ///< reflections by order, of order auto
  std::uint64_t quadratic = 0;
  std::uint64_t retraced = 0;
  std::uint64_t notConverged = 0;  ///< candidates that lead to no reflection
  std::uint64_t leftOut = 0;       ///< reflections beyond the kMaxReflections-th of a point
  void add(const PathCounts& other);
};

/// Where a point shows.
struct Reflection {
  glm::dvec3 x{0.0};      ///< place of the reflection on the first reflector, which the eye sees
  glm::dvec3 last{0.0};   ///< that on the last one, which the point sees
  glm::dvec3 image{0.0};  ///< the virtual point, behind x at the path's optical length
  double share = 1.0;     ///< of that length, from the eye to `last`
};

/// Of one point, at most (ours: a waved mirror of 20 crests has shown 49).
inline constexpr std::size_t kMaxReflections = 64;

/// Up to kMaxReflections; the first two in place, since few points have more and objects have many
/// points.
class ReflectionList {
 public:
  /// Those beyond the last one asked for so far are made.
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

/// All reflections of one point that were found.
struct Reflections {
  ReflectionList at;
  std::uint32_t count = 0;
};

class Reflector {
  /// An exact path from the eye on. bounces[i]: how its place on reflector i moves with the one on
  /// reflector i + 1, or with the point that it shows.
  struct Path {
    std::array<Bounce<double>, kMaxTurns> bounces;
    std::array<double, kMaxTurns> distances{};  ///< metres from place i to place i + 1
    glm::dvec3 direction{0.0};                  ///< leaving the last reflector
    glm::dvec3 place(std::size_t i) const {
      const auto& x = bounces[i].x;
      return {x[0], x[1], x[2]};
    }
  };

 public:
  /// The last paths that look-ups had to trace: points near to each other are found by them.
  class Traced {
    friend class Reflector;
    static constexpr std::size_t kCount = 8;  ///< ours
    std::vector<Path> paths_;
    std::size_t next_ = 0;
  };

  /// `turns` in the order in which they are met from the eye, 1 to kMaxTurns; keeps references to
  /// their surfaces. `scene`: bounds of whatever is reflected. `before`: the same sequence without
  /// the last turn, kept too; null for one turn.
  Reflector(std::span<const Turn> turns, const Reflector* before, const Box3& scene,
            const View& view, const PathOptions& options);

  /// 0: no sampled path meets these reflectors one after the other.
  std::size_t pathCount() const { return pathCount_; }
  /// Rays that would have been sampled, but the last surface reflects them totally.
  std::uint64_t totalReflections() const { return totalReflections_; }
  /// The reflectors before show the last one, but no path between its sampled ones.
  bool missed() const { return missed_; }
  /// Whether any path meets the last reflector again.
  bool seesItself() const { return !selfRays_.empty(); }
  /// The same without the last turn; null for one turn.
  const Reflector* before() const { return before_; }
  /// Whether the last turn has hidden() points: not of bodies that refract.
  bool hides() const { return !turns_.back().through && !turns_.back().total(); }
  bool refracts() const { return turns_[0].through || turns_.back().inside; }
  /// Of the last reflector.
  double size() const { return size_; }
  double distanceFrom(const glm::dvec3& point) const { return glm::distance(point, centre_); }

  /// All reflections of a point, from the groups of its nearest rays; `own`: the point lies on the
  /// last reflector itself. `traced`: of other points before (order auto).
  Reflections reflectionsOf(const glm::dvec3& point, bool own, RayOctree::Cursor& cursor,
                            PathCounts& counts, Traced* traced = nullptr) const;
  /// Adds to a point's exact reflections those near the known ones of another point near to it.
  void addReflectionsNear(const glm::dvec3& point, const Reflections& known, Reflections& result,
                          PathCounts& counts, Traced* traced = nullptr) const;
  /// Where a point that the last reflector hides would show without it: itself, or its reflection
  /// in the reflectors before. `share`: up to where it is hidden. `cursor` and `traced` of the
  /// sequence before. At a mirror's rim it shows there too; what refracts has no such places.
  std::optional<Reflection> hidden(const glm::dvec3& point, RayOctree::Cursor& cursor,
                                   PathCounts& counts, Traced* traced = nullptr) const;

 private:
  class Sampling;  ///< of the paths, path_sampling.cpp
  using Places = std::array<glm::dvec3, kMaxTurns>;
  using Starts = std::array<glm::dvec3, kMaxReflections>;  ///< from where each was found

  std::size_t lastTurn() const { return turns_.size() - 1; }
  /// Samples the paths: one every n-th pixel, more where the reflector is small in the frame.
  void samplePaths(const View& view, const Box3& scene);
  /// The path that leaves the eye towards x, near the first surface.
  enum class PathSearch { Path, Nothing, TotalReflection };
  PathSearch pathBy(glm::dvec3 x, Path& path) const;
  /// Whether neighbouring paths tell too little of what lies between them: the direction turns from
  /// one to the other by another angle than where it begins.
  bool unlike(const Path& a, const Path& b) const;
  /// Whether the last turn's surface would let a path out that it should reflect totally.
  bool wouldLeave(const Path& path) const;
  /// Whether a path may be moved where its point is at `rho` from the last place; where its places
  /// come to lie when that point moves by `step`.
  bool movable(const Bounce<double>* bounces, double rho) const;
  /// To first and to second order.
  void move(const Bounce<double>* bounces, const double* distances, double rho,
            const glm::dvec3& step, Places& first, Places& second) const;
  /// Newton's iteration over exact paths: each is expanded again. `places[0]` is where it starts.
  /// Whether it leads to a reflection.
  bool retrace(const glm::dvec3& point, Places& places, Traced* traced) const;
  /// Where one of the paths that were traced leads near places[0], with a part of the error
  /// allowed. Which one; null: none.
  const Path* moveTraced(const glm::dvec3& point, const Traced& traced, Places& places) const;
  /// moveTraced(), or retrace() and its path for others. Whether that is a reflection.
  bool trace(const glm::dvec3& point, Places& places, PathCounts& counts, Traced* traced) const;
  /// Whether places that a path with these bounces was moved to are a reflection.
  bool accept(const glm::dvec3& point, const Places& places, const Bounce<double>* bounces) const;
  /// Whether one of them turns `-back` into `ahead` for sure, by the curvature at its bounce.
  bool surelyTurns(std::size_t turn, const Bounce<double>& bounce, const glm::dvec3& x,
                   const glm::dvec3& back, const glm::dvec3& ahead) const;
  /// How far towards a point from `from`, the eye or the place of the turn before, one sees before
  /// reflector `turn` hides it; at least 1: not hidden.
  double hiddenAt(std::size_t turn, const glm::dvec3& from, const glm::dvec3& point) const;
  /// Whether the inside of reflector `turn` at x is what one sees there from `from`: through an
  /// opening. Beyond the rim of a body it is not, however near.
  bool insideShows(std::size_t turn, const glm::dvec3& from, const glm::dvec3& x) const;
  void add(const glm::dvec3& point, const Places& places, const glm::dvec3& from, Starts& starts,
           Reflections& result, PathCounts& counts) const;
  double pixels(const glm::dvec3& x, double metres) const;
  /// The part of the image in which the reflectors before show the last one: x0, y0, x1, y1;
  /// nullopt where they do not.
  std::optional<std::array<float, 4>> imageOfLast(const View& view) const;

  std::vector<Turn> turns_;
  const Reflector* before_;
  PathOptions options_;
  glm::dvec3 eye_;
  glm::dvec3 centre_;
  std::array<double, kMaxTurns> sizes_{};  ///< metres, of bounds' diagonals
  double size_ = 0.0;                      ///< that of the last
  std::array<bool, kMaxTurns> smooth_{};   ///< have no edges, across which no normal tells another
  double spread_ = 0.0;                    ///< rad, of a pixel
  std::size_t pathCount_ = 0;
  std::uint64_t totalReflections_ = 0;
  bool missed_ = false;
  // Per path as many as there are turns, from the eye on
  std::vector<Bounce<double>> bounces_;
  std::vector<double> distances_;
  std::vector<std::uint32_t> rays_;  ///< the octree's rays' paths
  RayOctree octree_;
  std::vector<std::uint32_t> selfRays_;  ///< likewise those that meet the last reflector again
  RayOctree selfOctree_;
};

}  // namespace catoptric::methods::perturbation
