// A reflector as the eye sees it: the sampled paths, and where any point appears in it by
// perturbing them [Chen2000] Sec. III.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "methods/perturbation/bounce.h"
#include "methods/perturbation/path.h"
#include "methods/perturbation/ray_octree.h"
#include "scene/camera.h"
#include "scene/implicit/surface.h"

namespace catoptric::methods::perturbation {

enum class Order : std::uint8_t { Nearest, Linear, Quadratic, Auto };

struct PathOptions {
  Order order = Order::Auto;
  int sampleSpacing = 16;  ///< pixels [Chen2000: 8 to 32]
  /// Several reflections of a point: by minima among neighbouring rays, or as in the paper by
  /// groups of the k nearest.
  bool groups = false;
  int candidates = 5;  ///< k [Chen2000: 5]
  float groupAngleRad = 0.5f;
  float groupDistance = 0.1f;  ///< share of the reflector's diameter
  float errorPixels = 0.1f;    ///< order auto: what the estimate allows
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
  void add(const PathCounts& other);
};

/// Where a point shows.
struct Reflection {
  glm::dvec3 x{0.0};      ///< place of the reflection
  glm::dvec3 image{0.0};  ///< the virtual point, behind it at the optical length
};

inline constexpr std::size_t kMaxReflections = 12;

/// All reflections of one point that were found.
struct Reflections {
  std::array<Reflection, kMaxReflections> at;
  std::uint32_t count = 0;
};

class Reflector {
 public:
  /// Keeps a reference to `surface`. `bounds`: of the surface in world space; `scene`: of whatever
  /// is reflected.
  Reflector(const implicit::Surface& surface, const Box3& bounds, const Box3& scene,
            const View& view, const PathOptions& options);

  std::size_t pathCount() const { return bounces_.size(); }
  /// Whether any path meets the reflector again.
  bool seesItself() const { return !selfRays_.empty(); }
  double size() const { return size_; }
  double distanceFrom(const glm::dvec3& point) const { return glm::distance(point, centre_); }

  /// All reflections of a point, from the groups of its nearest rays; `own`: the point lies on the
  /// reflector itself.
  Reflections reflectionsOf(const glm::dvec3& point, bool own, RayOctree::Cursor& cursor,
                            PathCounts& counts) const;
  /// Those near the known reflections of other points near to it.
  Reflections reflectionsNear(const glm::dvec3& point,
                              std::initializer_list<const Reflections*> known,
                              PathCounts& counts) const;
  /// How far towards a point the eye sees before the surface hides it; at least 1: not hidden.
  double hiddenFrom(const glm::dvec3& point) const;

 private:
  /// Newton's iteration over exact paths: each is expanded again.
  bool retrace(const glm::dvec3& point, glm::dvec3& x) const;
  bool accept(const glm::dvec3& point, const glm::dvec3& x) const;
  void add(const glm::dvec3& point, const glm::dvec3& x, const glm::dvec3& from,
           std::vector<glm::dvec3>& starts, Reflections& result) const;
  double pixels(const glm::dvec3& x, double metres) const;

  const implicit::Surface& surface_;
  PathOptions options_;
  glm::dvec3 eye_;
  glm::dvec3 centre_;
  double size_ = 0.0;    ///< metres, its bounds' diagonal
  double spread_ = 0.0;  ///< rad, of a pixel
  std::vector<Bounce<double>> bounces_;
  std::vector<std::uint32_t> rays_;  ///< the octree's rays' bounces
  RayOctree octree_;
  std::vector<std::uint32_t> selfRays_;  ///< likewise those that meet the reflector again
  RayOctree selfOctree_;
};

}  // namespace catoptric::methods::perturbation
