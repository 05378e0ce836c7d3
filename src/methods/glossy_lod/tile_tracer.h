// The rays of a tile of samples on one thread, from their directions to the mean of their light:
// all data of a tile stay in the core's cache.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

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
  std::uint64_t sidesShaded = 0;
  Visits visits;
  double traceSeconds = 0.0;    ///< traversal
  double shadeSeconds = 0.0;    ///< radiance of what has moved, when it is first seen
  double resolveSeconds = 0.0;  ///< making rays, filtering

  void add(const TraceCounts& other);
};

/// What rays meet.
struct Traced {
  TreeView tree;
  const SceneImages& images;
  Radiance& radiance;
  const trace::EnvironmentLevels& environment;
  const Shading& shading;
  float spreadRad;                 ///< of a sample's ray cone
  std::span<const float> extents;  ///< trace::reflectorExtent() by object
  bool fresnelSchlick;             ///< of bounces after the first
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
    float g = -1.0f;
    Vec2 shift{0.0f};
    int count = 0;
    std::array<float, 256> slopes{};
  };
  /// Neighbouring points with the same number of rays.
  struct Group {
    std::size_t begin, points;
    int rays;  ///< of each
    float alpha;
    /// Numbers of rays that a packet holds, of all points each.
    std::size_t perPacket() const { return RayPacket::kMost / points; }
  };

  /// A hit from which a ray goes on.
  struct Onward {
    Vec3* value;  ///< what its ray sees: the surface's own light, and then what it reflects
    Vec3 direction;
    frame::SurfacePoint surface;
  };

  Group nextGroup(const Options& options, std::size_t begin);
  void makePackets(const Traced& scene, const Group& group, std::uint8_t* flags,
                   trace::ReflectionCounts& counts);
  void tracePacket(const Traced& scene, const Group& group, std::size_t packet, std::uint8_t* flags,
                   TraceCounts& counts);
  /// Adds what a hit on a reflective object reflects to what is still to be traced.
  void goOn(const Traced& scene, const Group& group, std::size_t packet, std::size_t lane,
            TraceCounts& counts);
  /// Traces that.
  void traceOnward(const Traced& scene, TraceCounts& counts);
  void ensureShaded(const Traced& scene, std::size_t lane, TraceCounts& counts);
  const float* slopesOf(std::size_t point, int count);

  trace::LobeTracer lobes_;
  std::array<Widths, 256> widths_;  ///< a power of two; ours
  std::array<RayPacket, 256> packets_;
  std::array<std::array<Vec3, RayPacket::kMost>, 256> values_;    ///< of their rays
  std::array<std::array<float, RayPacket::kMost>, 256> weights_;  ///< likewise
  std::array<Footprint, RayPacket::kMost> footprints_;
  PacketHits hits_;

  int bounce_ = 0;
  int paths_ = 1;                     ///< of a sample, that come by here: they share lobes
  std::unique_ptr<TileTracer> next_;  ///< of the next bounce
  std::vector<Onward> onward_;
  std::vector<Vec3> reflected_;
  /// Of points after the first bounce: how wide the rays are that come, and how fast they widen.
  std::vector<float> arrivingBase_;
  std::vector<float> arrivingSlope_;
};

}  // namespace catoptric::methods::glossy_lod
