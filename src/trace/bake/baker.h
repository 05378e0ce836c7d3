// Private to src/trace/bake: the passes of a bake and what they share.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <mutex>
#include <span>
#include <vector>

#include "frame/geometry.h"
#include "frame/shading.h"
#include "scene/scene.h"
#include "trace/bake/bake.h"
#include "trace/bake/emitters.h"
#include "trace/bake/lattice.h"
#include "trace/bake/points.h"
#include "trace/embree/trace_scene.h"

namespace catoptric::trace {

// All thresholds are ours, chosen by looking at rooms.
inline constexpr float kEnclosedShare = 0.75f;  ///< of rays on back faces: inside something
inline constexpr int kEnclosedRays = 32;        ///< closest hits that decide it (occlusion only)
inline constexpr int kShadowRays = 32;          ///< per light with a radius, in penumbrae
inline constexpr int kRimRays = 8;              ///< to the rim of a light: all alike, no penumbra
inline constexpr int kGlanceRays = 2;           ///< the same where neighbours agree
inline constexpr int kEmitterRays = 16;         ///< towards emissive surfaces, by the most rays
inline constexpr int kLeastEmitterRays = 4;     ///< by gathers with fewer rays
inline constexpr int kEarlierRaysDivisor = 8;   ///< gathers before the last take fewer rays
/// The last gather's share of rays from points that agree with their neighbours, whose mean they
/// take afterwards.
inline constexpr int kAgreeingRaysDivisor = 4;
/// They agree where values differ by no more than so many standard errors, which are no more than
/// so much of the value themselves.
inline constexpr float kAgreeingErrors = 3.0f;
inline constexpr float kAgreeingNoise = 0.25f;
inline constexpr int kSmoothIterations = 6;
inline constexpr std::size_t kPointsPerTask = 32;

/// Everything that the passes of a bake share.
class Baker {
 public:
  Baker(const scene::Scene& scene, const frame::Geometry& geometry,
        const frame::EnvironmentLight& environment, const std::string& isa,
        const BakeCallbacks& callbacks);

  const BakePoints& points() const { return points_; }
  std::uint64_t rays() const { return rays_; }
  std::size_t enclosed() const { return enclosed_; }
  std::uint64_t refused() const { return refused_; }
  /// The values of a stopped bake mean nothing.
  bool stopped() const { return callbacks_.stopRequested && callbacks_.stopRequested(); }

  std::vector<Vec4> ambientOcclusion();
  std::vector<Vec4> full();

 private:
  /// What one thread of a gather needs for its rays.
  struct Buffers {
    std::vector<Ray> rays;
    std::vector<Hit> hits;
    std::vector<std::uint8_t> free;
  };
  /// What a point's rays have gathered, in kGroups interleaved groups.
  struct Gathered {
    std::array<Vec3, kGroups> parts{};
    int back = 0;  ///< rays on back faces
    int open = 0;  ///< rays that are free within the distance
  };

  std::vector<Vec3> directLight();
  std::vector<Vec3> radiosity(const std::vector<Vec3>& irradiance) const;
  /// One gather: rgb irradiance of sky, surfaces and emitters; a = free share within the distance.
  /// With `adaptive`, fewer rays from points that agree with their neighbours.
  std::vector<Vec4> gather(const std::vector<Vec3>& leaving, int rays, bool adaptive);
  /// What a gather knows of all points.
  struct Gather {
    std::vector<Vec4> values;
    std::vector<float> back;   ///< share of rays on back faces
    std::vector<float> noise;  ///< standard error of each value's brightness
  };
  /// Rays of a gather from one point.
  struct GatherRays {
    std::vector<Vec2> lattice;
    int toEmitters = 0;
    float share = 1.0f;  ///< of the value; the rest is what is known already
  };
  GatherRays gatherRays(int count, int first = 0) const;
  /// Gathers at some points alone.
  void gatherAt(std::span<const std::uint32_t> points, const std::vector<Vec3>& leaving,
                const GatherRays& rays, Gather& all);
  /// Points whose value or validity is not that of their neighbours.
  std::vector<std::uint32_t> disagreeing(const Gather& all) const;
  /// Shoots a ray for each point of the lattice and sums the light of what they meet.
  Gathered gatherPoint(std::size_t point, const GatherRays& gather, const Vec2& shift,
                       const std::vector<Vec3>& leaving, Buffers& buffers);
  /// An emitter's light that a gather's ray sees, by its share beside emitterLight().
  Vec3 seenEmitter(std::size_t point, const Hit& hit, const Vec3& direction,
                   const GatherRays& gather) const;
  Vec3 emitterLight(std::size_t point, const Vec2& shift, const GatherRays& gather,
                    Buffers& buffers);
  bool facesRay(const Hit& hit, const Vec3& direction, Vec3& normal) const;
  void fillAndSmooth(const std::vector<std::uint8_t>& valid, const std::vector<float>& noise,
                     std::vector<Vec4>& values);
  /// Counts `rays` of all that the bake will need, and tells the caller.
  void advance(std::uint64_t rays);

  const scene::Scene& scene_;
  const frame::Geometry& geometry_;
  const frame::EnvironmentLight& environment_;
  const BakeCallbacks& callbacks_;
  BakePoints points_;
  std::vector<int> castsLight_;
  frame::Geometry surfaces_;  ///< what rays meet
  TraceScene trace_;
  Emitters emitters_;
  float occlusionDistance_ = 0.0f;
  std::atomic<std::uint64_t> rays_{0};
  mutable std::atomic<std::uint64_t> refused_{0};
  std::mutex progressMutex_;
  std::uint64_t plannedRays_ = 0;
  std::atomic<std::uint64_t> doneRays_{0};
  std::size_t enclosed_ = 0;
  std::vector<std::uint8_t> valid_;  ///< per point, by the last gather: 0 inside something
};

}  // namespace catoptric::trace
