// Ray tracing by Embree over the geometry of frame/geometry.h. Rays are intersected with the
// triangles; for objects with an implicit surface, with that surface itself, by implicit::firstHit
// and with its guarantee.
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

/// How the BVH follows moving geometry. The papers rebuild it in every frame.
enum class BvhPolicy { Static, Refit, RebuildLow, RebuildMedium };

struct Ray {
  Vec3 origin{0.0f};
  Vec3 direction{0.0f, 0.0f, -1.0f};  ///< need not be of unit length
  float near = 0.0f;
  float far = std::numeric_limits<float>::infinity();
};

struct Hit {
  int object = -1;  ///< index into geometry.objects; -1: a miss
  /// Index of the triangle within the object. On an implicit surface, primitive, u and v belong to
  /// the nearest point of its triangles, which defines texture coordinates, colours and baked
  /// light. They are 0 if the surface has none of these.
  std::uint32_t primitive = 0;
  float u = 0.0f;
  float v = 0.0f;
  float distance =
      std::numeric_limits<float>::infinity();  ///< in units of the length of the ray's direction
  bool miss() const { return object < 0; }
};

struct TraceCounts {
  std::uint64_t rays = 0;
  std::uint64_t refused = 0;  ///< not finite, beyond 1e18, or near < 0; Embree does not get these
                              ///< rays, and they count as misses
};

struct TraceOptions {
  /// Embree's robust mode. Without it, about one random ray in a million passes through the edge
  /// between two triangles; with it, none did (counted by trace_test; rays aimed exactly at edges
  /// still can). Rays take 15-45% longer with it (trace_benchmark).
  bool robust = false;
  /// Only these objects (indices into geometry.objects) can be hit; empty: all.
  std::vector<int> objects;
  bool extents = true;  ///< whether extents() are needed
  /// Embree's instruction set, by the name of its setting `isa`. Empty: the environment variable
  /// CATOPTRIC_EMBREE_ISA decides, otherwise the best of the machine. The machine must support it.
  std::string isa = {};
};

/// The instruction set that an environment variable forces Embree to use; empty if the variable is
/// not set. Throws UsageError for a name that Embree does not know, because Embree would take it
/// for sse2.
std::string forcedEmbreeIsa(const char* variable);

class TraceScene {
 public:
  /// Builds the BVH with the quality of `policy`. Static uses one BVH over all objects, built once;
  /// for objects that move it works as Refit does, so hits are never outdated. Refit keeps one BVH
  /// per object. Parts that an alpha mask cuts away are not hit. After the build, it checks that
  /// Embree has kept every triangle (counts and bounds); droppedTriangles() returns how many it had
  /// to drop. The scene and the geometry must outlive this. Throws Error (internal) with Embree's
  /// message if Embree fails.
  TraceScene(const scene::Scene& scene, const frame::Geometry& geometry, BvhPolicy policy,
             const TraceOptions& options = {});
  ~TraceScene();
  TraceScene(const TraceScene&) = delete;
  TraceScene& operator=(const TraceScene&) = delete;

  /// Updates the BVH according to the policy. RebuildLow and RebuildMedium rebuild everything in
  /// each call, even if nothing moved, because the papers' ray tracers did so.
  void update(std::span<const int> changedObjects);

  /// Finds the closest hits, in packets; hits[i] belongs to rays[i]. `coherent`: whether neighbours
  /// in the array have similar directions. The result is the same for any thread count.
  TraceCounts intersect(std::span<const Ray> rays, std::span<Hit> hits, bool coherent) const;

  /// Sets free[i] to 1 if nothing blocks the segment of rays[i], otherwise to 0. Refused rays
  /// get 1.
  TraceCounts visible(std::span<const Ray> rays, std::span<std::uint8_t> free,
                      bool coherent = false) const;

  /// The same on the calling thread alone, for callers that are parallel themselves. A single ray
  /// hits the same triangle as in a packet, except for exact ties in distance.
  TraceCounts intersectSerial(std::span<const Ray> rays, std::span<Hit> hits, bool coherent) const;
  TraceCounts intersectSerial(const RayLanes& rays, std::span<Hit> hits, bool coherent) const;
  TraceCounts visibleSerial(std::span<const Ray> rays, std::span<std::uint8_t> free,
                            bool coherent = false) const;

  /// The number of rays in a packet on this machine: 16, 8 or 4.
  int packetSize() const;

  /// The reflectorExtent() of each object.
  std::span<const float> extents() const { return extents_; }
  float extentOf(int object) const { return extents_[static_cast<std::size_t>(object)]; }

  /// Whether any material refracts.
  bool refracts() const { return refracts_; }

  const scene::Scene& scene() const;
  const frame::Geometry& geometry() const;
  std::size_t droppedTriangles() const;
  /// The number of ray pieces near an implicit surface that were given up since the start. They
  /// count as misses.
  std::uint64_t unresolvedRays() const;
  std::size_t memoryBytes() const;

 private:
  struct State;

  std::unique_ptr<State> state_;
  std::vector<float> extents_;
  bool refracts_ = false;
};

/// Estimate of the largest number of bytes that Embree allocates while it builds the BVH of this
/// scene, by any policy. The finished static BVH has about half as many.
std::uint64_t bvhBuildBytes(const scene::Scene& scene);

/// The length in metres over which the positions of hits on a reflective object (index in
/// geometry.objects) may be rounded: the longest edge of its triangles; for an implicit surface,
/// the diameter of its box. 0 for other objects.
float reflectorExtent(const scene::Scene& scene, const frame::Geometry& geometry, int object);

/// Whether Embree can trace a ray: origin and direction are finite and below 1e18, near is finite
/// and >= 0, and far is not NaN.
bool isTraceable(const Ray& ray);

/// Ray offset relative to the largest coordinate of a point: 32 ulps. Positions that are rebuilt
/// from 32-bit depth or from a hit are wrong by a few ulps. Our choice.
inline constexpr float kRayOffset = 32.0f * std::numeric_limits<float>::epsilon();
inline constexpr float kLeastRayOffset = 1e-12f;  ///< metres; our choice

/// The distance by which the origin of a reflected ray is moved off its surface. `position` is the
/// point, `distance` the metres from which it was seen. The result is a few ulps of the largest
/// coordinate. All methods use this one definition.
float rayOffset(const Vec3& position, float distance);

}  // namespace catoptric::trace
