// Traces the rays of one tile of samples in one thread, from their directions to the mean of their
// radiance. All data of a tile stay in the core's cache.
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
#include "methods/glossy_lod/own_image.h"
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
  double shadeSeconds = 0.0;    ///< radiance of moved objects, when a ray first hits them
  double resolveSeconds = 0.0;  ///< generation of rays, filtering

  void add(const TraceCounts& other);
};

/// The scene data that rays need.
struct Traced {
  TreeView tree;
  const SceneImages& images;
  Radiance& radiance;
  const trace::EnvironmentLevels& environment;
  const Shading& shading;
  float spreadRad;                 ///< cone angle of a sample's ray
  std::span<const float> extents;  ///< trace::reflectorExtent(), indexed by object
  bool fresnelSchlick;             ///< whether bounces after the first follow Schlick's formula
  const Options& options;
};

class TileTracer {
 public:
  /// The tracer of the calling thread, whose memory is reused.
  static TileTracer& ofThread();

  /// The points, which the caller fills before run().
  trace::PointLanes& points() { return lobes_.points(); }

  /// Sets `radiance` to the mean over the lobe of each point. `flags`: as for
  /// trace::reflectedRadiance(), or null.
  void run(const Traced& scene, Vec3* radiance, std::uint8_t* flags, TraceCounts& counts);

 private:
  /// Cached widths of a lobe's rays, by ray index. Samples with the same roughness and shift have
  /// the same widths.
  struct Widths {
    float g = -1.0f;
    Vec2 shift{0.0f};
    int count = 0;
    std::array<float, 256> slopes{};
  };
  /// Cached ranks of a lobe's rays, by ray index.
  struct Ranks {
    Vec2 shift{0.0f};
    int count = 0;
    std::array<std::uint8_t, 256> of{};
  };
  /// Neighbouring points with the same number of rays.
  struct Group {
    std::size_t begin, points;
    int rays;  ///< rays per point
    float alpha;
    /// Rays of each point in a packet.
    std::size_t perPacket() const { return RayPacket::kMost / points; }
  };

  /// A hit from which a reflected ray continues.
  struct Onward {
    /// Radiance of the ray that has hit: at first the surface's own, to which the reflection is
    /// added.
    Vec3* value;
    Vec3 direction;
    frame::SurfacePoint surface;
  };

  Group nextGroup(const Options& options, std::size_t begin);
  void makePackets(const Traced& scene, const Group& group, std::uint8_t* flags,
                   trace::ReflectionCounts& counts);
  void tracePacket(const Traced& scene, const Group& group, std::size_t packet, std::uint8_t* flags,
                   TraceCounts& counts);
  /// Queues the reflection at a hit on a reflective object.
  void goOn(const Traced& scene, const Group& group, std::size_t packet, std::size_t lane,
            TraceCounts& counts);
  /// Traces the queued reflections.
  void traceOnward(const Traced& scene, TraceCounts& counts);
  void ensureShaded(const Traced& scene, std::size_t lane, TraceCounts& counts);
  const float* slopesOf(std::size_t point, int count);
  /// The rank of each of `count` rays of a point's lobe. Rays of neighbouring ranks point into the
  /// same part of the lobe, whichever point they belong to.
  const std::uint8_t* ranksOf(std::size_t point, int count);

  trace::LobeTracer lobes_;
  std::array<LeftPoint, trace::kMostLanes> left_;  ///< by point
  std::array<Widths, trace::kLobeSlots> widths_;
  std::array<Ranks, trace::kLobeSlots> ranks_;
  std::array<RayPacket, 256> packets_;
  std::array<std::array<std::uint8_t, RayPacket::kMost>, 256> rays_;  ///< ray index in its lobe
  std::array<std::array<Vec3, RayPacket::kMost>, 256> values_;        ///< radiance by ray and point
  std::array<std::array<float, RayPacket::kMost>, 256> weights_;      ///< weight by ray and point
  std::array<Footprint, RayPacket::kMost> footprints_;
  PacketHits hits_;

  int bounce_ = 0;
  int paths_ =
      1;  ///< number of a sample's paths that reach this bounce; they share the lobe's rays
  std::unique_ptr<TileTracer> next_;  ///< tracer of the next bounce
  std::vector<Onward> onward_;
  std::vector<Vec3> reflected_;
  /// For points after the first bounce: width of the arriving rays, and its growth per metre.
  std::vector<float> arrivingBase_;
  std::vector<float> arrivingSlope_;
};

}  // namespace catoptric::methods::glossy_lod
