// The rays of a tile of samples on one thread, from their directions to the mean of their light:
// all data of a tile stay in the core's cache.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "frame/shading.h"
#include "methods/glossy_lod/filter.h"
#include "methods/glossy_lod/options.h"
#include "methods/glossy_lod/tree/traversal.h"
#include "trace/lobes/environment_levels.h"
#include "trace/lobes/lobe_tracer.h"

namespace catoptric::methods::glossy_lod {

struct TraceCounts {
  std::uint64_t rays = 0;
  std::uint64_t misses = 0;
  std::uint64_t belowHorizon = 0;
  Visits visits;
  double traceSeconds = 0.0;    ///< traversal
  double resolveSeconds = 0.0;  ///< making rays, filtering

  void add(const TraceCounts& other);
};

/// What rays meet.
struct Traced {
  TreeView tree;
  const SceneImages& images;
  const Radiance& radiance;
  const trace::EnvironmentLevels& environment;
  const frame::Lighting& lighting;
  float spreadRad;  ///< of a sample's ray cone
  const Options& options;
};

class TileTracer {
 public:
  /// That of the calling thread: its memory is used again.
  static TileTracer& ofThread();

  /// For the caller to fill before run().
  trace::PointLanes& points() { return lobes_.points(); }

  /// Mean radiance along the lobe of each point; `flags` as of trace::reflectedRadiance(), or null.
  void run(const Traced& scene, Vec3* radiance, std::uint8_t* flags, TraceCounts& counts);

 private:
  /// Widths of the rays of a lobe, by index, kept: samples of one glossiness at the same place in
  /// their pixels have the same.
  struct Widths {
    float glossiness = -1.0f;
    Vec2 shift{0.0f};
    int count = 0;
    std::array<float, 256> slopes{};
  };
  struct Ray {
    std::uint16_t number, point;
  };

  void runBlock(const Traced& scene, const trace::LobeTracer::Lobes& lobes, float alpha,
                std::uint8_t* flags, TraceCounts& counts);
  void orderRays(const trace::LobeTracer::Lobes& lobes);
  void fill(const Traced& scene, const trace::LobeTracer::Lobes& lobes, std::size_t first,
            std::size_t count);
  const std::array<float, 256>& slopesOf(std::size_t point, int count);

  trace::LobeTracer lobes_;
  std::array<Widths, 64> widths_;  ///< a power of two; ours
  std::array<Ray, trace::kMostLanes> order_;
  std::array<Vec3, trace::kMostLanes> values_;
  RayPacket packet_;
  PacketHits hits_;
};

}  // namespace catoptric::methods::glossy_lod
