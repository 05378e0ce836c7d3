// Private to src/trace/bake: the passes of a bake and their shared data.
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

// All thresholds are our choice, made by looking at interior scenes.
/// A point counts as inside an object if at least this fraction of its rays hits back faces.
inline constexpr float kEnclosedShare = 0.75f;
/// Number of rays that decide this in bakes of ambient occlusion alone.
inline constexpr int kEnclosedRays = 32;
/// Rays per light with a radius, at points in its penumbra.
inline constexpr int kShadowRays = 48;
/// Rays to the edge of a light; if all agree, the point is in no penumbra.
inline constexpr int kRimRays = 8;
/// Rays of a coarser test before that one. Where neighbours agree, it suffices.
inline constexpr int kGlanceRays = 2;
/// Rays towards emitters, at most, as a fraction of the other rays of a gather. It is as large as
/// the emitters' share of the light of all surfaces where that is less.
inline constexpr double kMostEmitterRays = 0.5;
inline constexpr int kEarlierRaysDivisor =
    8;  ///< gathers before the last one use this many times fewer rays
/// In the last gather, points that agree with their neighbours use this many times fewer rays, but
/// at least kFewestRays.
inline constexpr int kAgreeingRaysDivisor = 5;
inline constexpr int kFewestRays = 44;
/// Points agree if their values differ by at most kAgreeingErrors standard errors, and a standard
/// error is at most kAgreeingNoise times the value.
inline constexpr float kAgreeingErrors = 3.0f;
inline constexpr float kAgreeingNoise = 0.25f;
/// Points of which more than this fraction of rays hits back faces get no further rays.
inline constexpr float kSurelyEnclosed = 0.95f;
inline constexpr std::size_t kPointsPerTask = 32;

/// The state that all passes of a bake share.
class Baker {
 public:
  Baker(const scene::Scene& scene, const frame::Geometry& geometry,
        const frame::EnvironmentLight& environment, const std::string& isa,
        const BakeCallbacks& callbacks);

  const BakePoints& points() const { return points_; }
  std::uint64_t rays() const { return rays_; }
  std::size_t enclosed() const { return enclosed_; }
  std::uint64_t refused() const { return refused_; }
  /// The values of a stopped bake are invalid.
  bool stopped() const { return callbacks_.stopRequested && callbacks_.stopRequested(); }

  std::vector<Vec4> ambientOcclusion();
  std::vector<Vec4> full();

 private:
  /// The buffers of one thread for the rays of a gather.
  struct Buffers {
    std::vector<Ray> rays;
    std::vector<Hit> hits;
    std::vector<std::uint8_t> free;
    std::vector<Vec3> arriving;  ///< from emitters, by ray
    std::vector<int> group;      ///< of kGroups, by ray
  };
  /// The sums over a point's rays, in kGroups interleaved groups.
  struct Gathered {
    std::array<Vec3, kGroups> parts{};
    int back = 0;           ///< rays that hit back faces
    int open = 0;           ///< rays without a hit within the occlusion distance
    Vec3 sky{0.0f};         ///< from the environment
    float nearness = 0.0f;  ///< sum of 1 / distance of the hits
  };

  std::vector<Vec3> directLight();
  std::vector<Vec3> radiosity(const std::vector<Vec3>& irradiance) const;
  /// The state of a gather, for all points.
  struct Gather {
    std::vector<Vec4> values;
    std::vector<float> back;  ///< fraction of rays that hit back faces
    ValueErrors errors;
  };
  /// The rays of a gather from one point.
  struct GatherRays {
    std::vector<Vec2> lattice;
    int toEmitters = 0;  ///< rays to emitters, a multiple of kGroups
    /// Places in the sequence from one point to the next. A second pass follows its point's first
    /// pass directly, so it overlaps those of the next points. Parts of its own were no better.
    int step = 0;
    float share = 1.0f;  ///< weight in the point's value; the rest is the weight of earlier rays
  };
  GatherRays gatherRays(int count, int first = 0) const;
  /// One gather. rgb: irradiance from the sky, surfaces and emitters; a: fraction of rays without a
  /// hit within the occlusion distance, or, with BakeSettings::skyApart, skyShare(). `adaptive`:
  /// points that agree with their neighbours use fewer rays.
  /// `all`: the state of the gather before. Its points that are surely enclosed are left out.
  std::vector<Vec4> gather(const std::vector<Vec3>& leaving, int rays, bool adaptive, Gather& all);
  /// Gathers at the given points only.
  void gatherAt(std::span<const std::uint32_t> points, const std::vector<Vec3>& leaving,
                const GatherRays& rays, Gather& all);
  /// The points of `among` whose value or validity differs from that of their neighbours.
  std::vector<std::uint32_t> disagreeing(std::span<const std::uint32_t> among,
                                         const Gather& all) const;
  /// Traces a ray for each point of the lattice and sums the radiance of the surfaces that they
  /// hit.
  Gathered gatherPoint(std::size_t point, const GatherRays& gather, const Vec2& shift,
                       const std::vector<Vec3>& leaving, Buffers& buffers);
  /// The weight of what a ray of a gather finds at an emitter, by multiple importance sampling with
  /// emitterLight().
  float hitWeight(std::size_t point, const Hit& hit, const Emitters::Triangle& emitter,
                  const Vec3& direction, const GatherRays& gather) const;
  /// The irradiance that arrives from the environment, as a share of its unoccluded irradiance.
  float skyShare(std::size_t point, const Vec3& arriving) const;
  /// The irradiance from emitters by rays to them, in kGroups parts.
  std::array<Vec3, kGroups> emitterLight(std::size_t point, const Vec2& shift,
                                         const GatherRays& gather, Buffers& buffers);
  void fillAndSmooth(const std::vector<std::uint8_t>& valid, const ValueErrors& errors,
                     std::vector<Vec4>& values);
  /// Adds `rays` to the rays that are done, and reports the progress.
  void advance(std::uint64_t rays);

  const scene::Scene& scene_;
  const frame::Geometry& geometry_;
  const frame::EnvironmentLight& environment_;
  const BakeCallbacks& callbacks_;
  BakePoints points_;
  std::vector<int> castsLight_;
  frame::Geometry surfaces_;  ///< the surfaces that rays are intersected with
  TraceScene trace_;
  Emitters emitters_;
  float occlusionDistance_ = 0.0f;
  std::atomic<std::uint64_t> rays_{0};
  mutable std::atomic<std::uint64_t> refused_{0};
  std::mutex progressMutex_;
  std::uint64_t plannedRays_ = 0;
  std::atomic<std::uint64_t> doneRays_{0};
  std::size_t enclosed_ = 0;
  std::vector<std::uint8_t>
      valid_;  ///< per point, by the last gather: 0 if it lies inside an object
};

}  // namespace catoptric::trace
