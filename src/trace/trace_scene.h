// Rays by Embree over the geometry of frame/geometry.h.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "core/math.h"
#include "frame/geometry.h"
#include "frame/shading.h"
#include "scene/scene.h"

namespace catoptric::trace {

/// How the acceleration structure follows moving geometry; the papers rebuild it every frame.
enum class BvhPolicy { Static, Refit, RebuildLow, RebuildMedium };

struct Ray {
  Vec3 origin{0.0f};
  Vec3 direction{0.0f, 0.0f, -1.0f};  ///< need not be of unit length
  float near = 0.0f;
  float far = std::numeric_limits<float>::infinity();
};

struct Hit {
  int object = -1;              ///< index into geometry.objects; -1: a miss
  std::uint32_t primitive = 0;  ///< within the object
  float u = 0.0f;
  float v = 0.0f;
  float distance = std::numeric_limits<float>::infinity();  ///< in units of the ray's direction
  bool miss() const { return object < 0; }
};

struct TraceCounts {
  std::uint64_t rays = 0;
  std::uint64_t refused = 0;  ///< not finite, beyond 1e18, near < 0: never given to Embree; misses
};

class TraceScene {
 public:
  /// Builds with the policy's quality (Static and Refit: high-quality enough for many frames).
  /// Checks after the build that Embree has kept every triangle (counts and bounds); what it had
  /// to drop is in droppedTriangles(). The scene and the geometry must outlive this.
  TraceScene(const scene::Scene& scene, const frame::Geometry& geometry, BvhPolicy policy);
  ~TraceScene();
  TraceScene(const TraceScene&) = delete;
  TraceScene& operator=(const TraceScene&) = delete;

  /// Follows the geometry by the policy. RebuildLow and RebuildMedium rebuild everything each call,
  /// even when nothing moved: that is what the papers' ray tracers did.
  void update(std::span<const int> changedObjects);

  /// Closest hits, in packets; hits[i] belongs to rays[i]. `coherent`: neighbours in the array
  /// point to similar directions. Deterministic for any thread count.
  TraceCounts intersect(std::span<const Ray> rays, std::span<Hit> hits, bool coherent) const;

  /// 1 where the segment of a ray is free, 0 where something blocks it.
  TraceCounts visible(std::span<const Ray> rays, std::span<std::uint8_t> free) const;

  const scene::Scene& scene() const;
  const frame::Geometry& geometry() const;
  std::size_t droppedTriangles() const;
  std::size_t memoryBytes() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Distance by which a reflected ray starts off its surface, for a point at `position` reached over
/// `distance` metres: a few ulps of the largest coordinate. One definition for all methods.
float rayOffset(const Vec3& position, float distance);

}  // namespace catoptric::trace
