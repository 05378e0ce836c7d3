// Rays by Embree over the geometry of frame/geometry.h: its triangles, and where objects have an
// implicit surface that surface itself, by implicit::firstHit with its guarantee.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/math.h"
#include "frame/geometry.h"
#include "frame/shading.h"
#include "scene/scene.h"
#include "trace/embree/ray_lanes.h"

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
  int object = -1;  ///< index into geometry.objects; -1: a miss
  /// Within the object. On implicit surfaces primitive, u and v are those of the nearest point of
  /// the triangles, whose texture coordinates, colours and baked light it has (0 without any).
  std::uint32_t primitive = 0;
  float u = 0.0f;
  float v = 0.0f;
  float distance = std::numeric_limits<float>::infinity();  ///< in units of the ray's direction
  bool miss() const { return object < 0; }
};

struct TraceCounts {
  std::uint64_t rays = 0;
  std::uint64_t refused = 0;  ///< not finite, beyond 1e18, near < 0: never given to Embree; misses
};

struct TraceOptions {
  /// Embree's robust mode against rays that slip through the edge between two triangles: without
  /// it about one random ray in a million does, with it none (trace_test counts them; rays aimed
  /// exactly at edges still can). Rays take 15-45% longer (trace_benchmark).
  bool robust = false;
  /// Only these objects (indices into geometry.objects) are hit; empty: all.
  std::vector<int> objects;
  /// Embree's instruction set, as its setting `isa` names it. Empty: the machine's best, or what
  /// the environment variable CATOPTRIC_EMBREE_ISA says. The machine must have it.
  std::string isa = {};
};

/// What an environment variable forces Embree to use; empty where it is not set. Throws UsageError
/// for a name that Embree does not know, which it would take for sse2.
std::string forcedEmbreeIsa(const char* variable);

class TraceScene {
 public:
  /// Builds with the policy's quality. Static is one structure over all objects, built once; where
  /// objects move it works as Refit does (hits are never stale). Refit keeps a structure per
  /// object. Alpha masks are honoured: cut-away places are not hit.
  /// Checks after the build that Embree has kept every triangle (counts and bounds); what it had
  /// to drop is in droppedTriangles(). The scene and the geometry must outlive this.
  /// Throws Error (internal) when Embree fails, with its message.
  TraceScene(const scene::Scene& scene, const frame::Geometry& geometry, BvhPolicy policy,
             const TraceOptions& options = {});
  ~TraceScene();
  TraceScene(const TraceScene&) = delete;
  TraceScene& operator=(const TraceScene&) = delete;

  /// Follows the geometry by the policy. RebuildLow and RebuildMedium rebuild everything each call,
  /// even when nothing moved: that is what the papers' ray tracers did.
  void update(std::span<const int> changedObjects);

  /// Closest hits, in packets; hits[i] belongs to rays[i]. `coherent`: neighbours in the array
  /// point to similar directions. Deterministic for any thread count.
  TraceCounts intersect(std::span<const Ray> rays, std::span<Hit> hits, bool coherent) const;

  /// 1 where the segment of a ray is free, 0 where something blocks it; 1 for refused rays.
  TraceCounts visible(std::span<const Ray> rays, std::span<std::uint8_t> free,
                      bool coherent = false) const;

  /// The same on the calling thread alone, for callers that are parallel themselves. A single ray
  /// and a ray in a packet hit the same triangle (but for exact ties in distance).
  TraceCounts intersectSerial(std::span<const Ray> rays, std::span<Hit> hits, bool coherent) const;
  TraceCounts intersectSerial(const RayLanes& rays, std::span<Hit> hits, bool coherent) const;
  TraceCounts visibleSerial(std::span<const Ray> rays, std::span<std::uint8_t> free,
                            bool coherent = false) const;

  /// Rays that a packet holds on this machine: 16, 8 or 4.
  int packetSize() const;

  /// reflectorExtent() of each object.
  std::span<const float> extents() const { return extents_; }
  float extentOf(int object) const { return extents_[static_cast<std::size_t>(object)]; }

  /// Whether any material refracts.
  bool refracts() const { return refracts_; }

  const scene::Scene& scene() const;
  const frame::Geometry& geometry() const;
  std::size_t droppedTriangles() const;
  /// Since the start: pieces of rays near an implicit surface that were given up on, and missed.
  std::uint64_t unresolvedRays() const;
  std::size_t memoryBytes() const;

 private:
  struct State;

  std::unique_ptr<State> state_;
  std::vector<float> extents_;
  bool refracts_ = false;
};

/// Metres over which hits on a reflective object (index in geometry.objects) are rounded: the
/// longest edge of its triangles; of an implicit surface the diameter of its box. 0 of others.
float reflectorExtent(const scene::Scene& scene, const frame::Geometry& geometry, int object);

/// Whether Embree can take a ray: finite, origin and direction below 1e18, near >= 0, far a number.
bool isTraceable(const Ray& ray);

/// Of the largest coordinate of a point: 32 ulps, as positions rebuilt from 32-bit depth or from a
/// hit are off by a few. Ours.
inline constexpr float kRayOffset = 32.0f * std::numeric_limits<float>::epsilon();
inline constexpr float kLeastRayOffset = 1e-12f;  ///< metres; ours

/// Distance by which a reflected ray starts off its surface, for a point at `position` reached over
/// `distance` metres: a few ulps of the largest coordinate. One definition for all methods.
float rayOffset(const Vec3& position, float distance);

}  // namespace catoptric::trace
