// Traces the lobes of a tile of points in one thread, from their rays to their mean radiance. A
// tile is completed before the next one begins, so that its data stay in the core's cache.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "core/math.h"
#include "frame/shading.h"
#include "frame/surfaces.h"
#include "trace/embree/trace_scene.h"
#include "trace/lobes/point_lanes.h"
#include "trace/lobes/reflect.h"

namespace catoptric::trace {

class LobeTracer {
 public:
  LobeTracer();
  ~LobeTracer();
  LobeTracer(const LobeTracer&) = delete;
  LobeTracer& operator=(const LobeTracer&) = delete;

  /// Memory that paths of so many reflections need in each thread.
  static std::uint64_t bytesOf(int bounces);

  /// The tracer of the calling thread, whose memory is reused.
  static LobeTracer& ofThread();

  /// Sets the inputs of the next runs; all of them must outlive these runs.
  void begin(const TraceScene& trace, const frame::Lighting& lighting, float spreadRad,
             const ReflectionOptions& options);

  /// The points, which the caller fills before run() or makeRays().
  PointLanes& points();

  /// Rays of whole lobes, for tracing elsewhere. The rays of point i have the numbers first[i -
  /// begin] to first[i - begin + 1].
  struct Lobes {
    std::size_t begin, end;  ///< points
    const std::size_t* first;
    RayLanes rays;
    const float* weights;    ///< weights of the rays in the mean of their lobe; null: all 1
    const float* densities;  ///< densities of GGX rays, per steradian; null: there are none
  };
  /// Makes the rays of as many of the points begin..end as fit into the buffers. The first call
  /// after points() were filled must start at point 0. If begin() was not called, no point may need
  /// settle(), that is, lie on an implicit surface or a refractive object. Sets only the bit of
  /// rays reflected upwards in `flags`; counts only these rays and total reflections.
  Lobes makeRays(std::size_t begin, std::size_t end, int raysPerLobe, std::uint8_t* flags,
                 ReflectionCounts& counts);

  /// Sets `radiance` to the mean over the lobe of each point. `flags` and `hits`: as in
  /// reflectedRadiance(), one per point, or null. Adds to `counts`.
  void run(Vec3* radiance, std::uint8_t* flags, FirstHit* hits, ReflectionCounts& counts);
  /// The array for the second hits of the next run(), one per point; null: not stored.
  void keepSeconds(SecondHit* seconds) { seconds_ = seconds; }
  /// The array for the points' radiance along paths with one bounce, without attenuation, in the
  /// next run(); null: not stored.
  void keepOneBounce(Vec3* radiance) { oneBounce_ = radiance; }
  /// For each point of the next run() with one bounce: whether its radiance is requested; it is
  /// otherwise 0. Null: all are requested. All rays are traced nevertheless, because Embree's
  /// results at edges depend on the other rays of a packet.
  void only(const std::uint32_t* asked) { asked_ = asked; }

 private:
  struct Level;
  struct Block;
  struct LobeTables;

  Level& level(std::size_t bounce);
  void settlePoints(PointLanes& points, ReflectionCounts& counts) const;
  void runLevel(std::size_t bounce, int bouncesLeft, Vec3* radiance, std::uint8_t* flags,
                FirstHit* hits, ReflectionCounts& counts);
  /// A block of points from `begin` on: as many as have room for their rays in the buffers.
  static Block nextBlock(Level& level, std::size_t begin, std::size_t end, int raysPerLobe);
  void makeRays(Level& level, const Block& block, std::uint8_t* flags, ReflectionCounts& counts);
  void copyRays(Level& level, const Block& block, std::size_t point, std::uint8_t* flags,
                ReflectionCounts& counts);
  void setRay(Level& level, std::size_t point, std::size_t ray, int index, int count,
              std::uint8_t* flags, ReflectionCounts& counts) const;
  void intersect(Level& level, const Block& block, ReflectionCounts& counts) const;
  void resolve(Level& level, const Block& block, bool keepSurfaces, std::uint8_t* flags,
               ReflectionCounts& counts);
  /// Shades the collected hits, and empties shaded_.
  void shadeHits(Level& level, bool keepSurfaces, ReflectionCounts& counts);
  void fade(Level& level, const Block& block) const;
  /// The radiance that ray number `index` of a point receives if it leaves the scene.
  Vec3 environment(const Level& level, std::size_t point, std::size_t index, const Block& block,
                   const Vec3& direction) const;
  void continueReflective(std::size_t bounce, const Block& block, int bouncesLeft,
                          ReflectionCounts& counts);
  /// The largest share of the radiance along the path's first ray that the reflection at a ray's
  /// hit can add.
  float shareOnward(const Level& level, std::size_t point, std::size_t ray) const;
  /// Sets radiance[point] for a block's points.
  static void meanOfLobes(const Level& level, const Block& block, Vec3* radiance);

  /// Sets seconds_ for a block's points.
  void keepSeconds(const Block& block);

  const TraceScene* trace_ = nullptr;
  const frame::Lighting* lighting_ = nullptr;
  float spreadRad_ = 0.0f;
  ReflectionOptions options_;
  bool settles_ = false;  ///< settle() may have to move points onto implicit surfaces
  SecondHit* seconds_ = nullptr;
  Vec3* oneBounce_ = nullptr;
  const std::uint32_t* asked_ = nullptr;
  frame::SurfaceLanes shaded_;
  std::array<std::size_t, frame::SurfaceLanes::kMost> shadedRays_{};  ///< their rays
  std::array<frame::SurfacePoint, frame::SurfaceLanes::kMost> shadedPoints_;
  std::vector<std::unique_ptr<Level>> levels_;
  std::unique_ptr<LobeTables> tables_;
};

}  // namespace catoptric::trace
