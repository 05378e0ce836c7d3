// Lobes of a tile of points on one thread, from the rays to the mean of their light: every step of
// a tile is done before the next tile begins, so that its data stay in the core's cache.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "core/math.h"
#include "frame/shading.h"
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

  /// That of the calling thread: its memory is used again.
  static LobeTracer& ofThread();

  /// What the next runs trace in; everything must outlive them.
  void begin(const TraceScene& trace, const frame::Lighting& lighting, float spreadRad,
             const ReflectionOptions& options);

  /// For the caller to fill before run(), or makeRays().
  PointLanes& points();

  /// Rays of whole lobes, for others to trace: those of point i are number first[i - begin] to
  /// first[i - begin + 1].
  struct Lobes {
    std::size_t begin, end;  ///< points
    const std::size_t* first;
    RayLanes rays;
    const float* weights;    ///< of the rays in their lobe's mean; null: all 1
    const float* densities;  ///< of the rays of GGX lobes, per steradian; null: there are none
  };
  /// Those of as many of the points begin..end as fit at once; the first time since points() were
  /// filled from point 0. Without begin(): no point may have to move or refract. `flags` and
  /// `counts` as of run(), for rays that were folded up.
  Lobes makeRays(std::size_t begin, std::size_t end, int raysPerLobe, std::uint8_t* flags,
                 ReflectionCounts& counts);

  /// Mean radiance along the lobe of each point. `flags` and `hits` as of reflectedRadiance(), one
  /// for each point, or null. Adds to `counts`.
  void run(Vec3* radiance, std::uint8_t* flags, FirstHit* hits, ReflectionCounts& counts);
  /// Where the next run() puts second hits, one for each point; null: nowhere.
  void keepSeconds(SecondHit* seconds) { seconds_ = seconds; }
  /// Of each point of the next run() with one bounce whether its light is asked for, which is else
  /// 0; null: all. Rays of the others are traced, too: what Embree finds at edges depends on the
  /// rays beside.
  void only(const std::uint32_t* asked) { asked_ = asked; }

 private:
  struct Level;
  struct Block;
  struct LobeTables;

  Level& level(std::size_t bounce);
  void settlePoints(PointLanes& points, ReflectionCounts& counts) const;
  void runLevel(std::size_t bounce, int bouncesLeft, Vec3* radiance, std::uint8_t* flags,
                FirstHit* hits, ReflectionCounts& counts);
  /// The points from `begin` on whose rays fit at once.
  static Block nextBlock(Level& level, std::size_t begin, std::size_t end, int raysPerLobe);
  void makeRays(Level& level, const Block& block, std::uint8_t* flags, ReflectionCounts& counts);
  void copyRays(Level& level, const Block& block, std::size_t point, std::uint8_t* flags,
                ReflectionCounts& counts);
  void setRay(Level& level, std::size_t point, std::size_t ray, int index, int count,
              std::uint8_t* flags, ReflectionCounts& counts) const;
  void intersect(Level& level, const Block& block, ReflectionCounts& counts) const;
  void resolve(Level& level, const Block& block, bool keepSurfaces, std::uint8_t* flags,
               ReflectionCounts& counts) const;
  void fade(Level& level, const Block& block) const;
  /// What ray number `index` of a point sees where it leaves the scene.
  Vec3 environment(const Level& level, std::size_t point, std::size_t index, const Block& block,
                   const Vec3& direction) const;
  void continueReflective(std::size_t bounce, const Block& block, int bouncesLeft,
                          ReflectionCounts& counts);

  /// Fills seconds_ of a block's points.
  void keepSeconds(const Block& block);

  const TraceScene* trace_ = nullptr;
  const frame::Lighting* lighting_ = nullptr;
  float spreadRad_ = 0.0f;
  ReflectionOptions options_;
  bool settles_ = false;  ///< points of the scene may have to move, or refract
  SecondHit* seconds_ = nullptr;
  const std::uint32_t* asked_ = nullptr;
  std::vector<std::unique_ptr<Level>> levels_;
  std::unique_ptr<LobeTables> tables_;
};

}  // namespace catoptric::trace
