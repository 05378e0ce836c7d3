#include "methods/reprojection/reprojection.h"

#include <algorithm>
#include <array>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "core/clock.h"
#include "methods/contract/restarts.h"
#include "methods/reprojection/key_frame.h"
#include "methods/reprojection/options.h"
#include "methods/reprojection/reuse.h"
#include "methods/shared/reflective_samples.h"
#include "methods/shared/reflectors.h"
#include "trace/lobes/reflect.h"

namespace catoptric::methods {
namespace {

using reprojection::KeyFrame;
using reprojection::Options;
using reprojection::Outcome;
using reprojection::Reuse;

const TableInfo kKeyFrames{
    "keyframes",
    "one row a frame: which key frame its reflections come from",
    {{"key", ColumnType::Integer, "the key frame's number"},
     {"reason", ColumnType::Text,
      "why this frame is a key frame: first, restart, every, lights, threshold; empty: it is none"},
     {"reflective", ColumnType::Integer, "reflective samples"},
     {"missing", ColumnType::Integer,
      "of them those that were not found in the key frame before (a first key frame: all)"}}};

/// What becomes of reflective samples, for the counters.
struct OutcomeCounts {
  std::array<std::uint64_t, 7> of{};
  std::uint64_t operator[](Outcome outcome) const { return of[static_cast<std::size_t>(outcome)]; }
};

class Reprojection : public Method {
 public:
  Reprojection(const Options& options, bool searches)
      : options_(options), searches_(searches), reuse_(options, searches) {}

  MethodPlan plan(const scene::Scene& scene, const RunSettings& settings) const override {
    MethodPlan plan;
    plan.gbuffer = true;
    plan.masks = raster::kMaskEnvironment | raster::kMaskBelowHorizon | raster::kMaskSky |
                 raster::kMaskRetraced | raster::kMaskDisoccluded;
    plan.gl = true;
    const auto reflectors = findReflectors(scene, settings.reflectors).count();
    if (reflectors == 0) return plan;
    plan.trace = true;
    plan.bvh = options_.bvh;
    plan.bounces = options_.bounces;
    plan.bouncesOption = "bounces";
    const auto samples = static_cast<std::uint64_t>(settings.width) * settings.height *
                         settings.samples * settings.samples;
    const std::string why = std::to_string(reflectors) + " reflective objects";
    plan.items = {
        {"pass", "readback", "samples are compared on the CPU: the G-buffer is read back", 0},
        {"pass", "search",
         searches_ ? why + ": each sample looks for its reflection in the key frame"
                   : why + ": each sample looks for its surface in the key frame",
         0},
        {"pass", "shift", "what the key frame shows there is interpolated", 0},
        {"pass", "warp", "what does not lie on this frame's mirrored rays is rejected", 0},
        {"pass", "recompute", "what was not found, and key frames, by Embree", 0},
        {"pass", "upload", "the composite takes the reflection as a texture", 0},
        {"resource", "G-buffer copy", "what is read back", samples * (16 + 16 + 4 + 4)},
        {"resource", "key frame", "what its reflective samples have met",
         samples * (4 + 4 + 16 + 12 + 4 + 4)},
        {"resource", "reflection image", "what is uploaded", samples * 16},
    };
    return plan;
  }

  bool restartsAt(const scene::CameraPath& path, int number) const override {
    return onRestartGrid(number, options_.restartEvery) || cutsBefore(path, number);
  }

  void prepare(Services&, const RunSettings& settings) override {
    reflection_.rays = options_.rays;
    reflection_.bounces = options_.bounces;
    reflection_.fresnelSchlick = settings.fresnelSchlick;
    masks_ = settings.masks;
    reflectors_ = settings.reflectors;
  }

  void render(const FrameInput& input, Services& services, FrameOutput& output) override {
    counts_ = {};
    if (services.trace == nullptr) {  // no reflectors: nothing was planned
      report({}, 0, 0, output);
      return;
    }
    const ReflectiveSamples samples = services.timer.measure("readback", [&] {
      raster::readBack(*services.gbuffer, true, copy_);
      return collectReflective(copy_, input.frame.camera, *services.trace, reflectors_);
    });
    const std::size_t count = samples.points.size();
    radiance_.assign(count, Vec3(0.0f));
    flags_.assign(masks_ ? count : 0, 0);

    std::string reason = keyReason(input, services);
    OutcomeCounts outcomes;
    std::vector<std::uint32_t> missing;
    if (reason.empty()) {
      key_.follow(services.geometry);
      reuse_.run(key_, copy_, samples, services, radiance_);
      for (std::size_t i = 0; i < count; ++i) {
        ++outcomes.of[static_cast<std::size_t>(reuse_.outcome(i))];
        if (reuse_.outcome(i) != Outcome::Found) missing.push_back(static_cast<std::uint32_t>(i));
      }
      // A new key frame helps only those that it can be searched for.
      const std::uint64_t never = outcomes[Outcome::NotSearched];
      if (static_cast<double>(missing.size() - never) >
          static_cast<double>(options_.keyframeThreshold) * static_cast<double>(count - never))
        reason = "threshold";
    }
    const std::uint64_t missed = reason == "threshold" || reason.empty() ? missing.size() : count;
    if (!reason.empty()) {
      makeKey(input, services, samples);
      outcomes = {};
      missing.clear();
    } else if (input.kept) {
      retrace(input, services, samples, missing);
    }
    if (input.kept) show(services, samples, missing);
    report(outcomes, missing.size(), reason.empty() ? 0 : count, output);
    Table table(kKeyFrames);
    table.add(keyNumber_, reason, count, missed);
    output.tables.push_back(std::move(table));
  }

 private:
  /// Why a frame has to be a key frame before anything was searched; empty: it need not.
  std::string keyReason(const FrameInput& input, const Services& services) const {
    if (key_.empty() || input.firstOfSequence) return "first";
    if (input.restarts) return "restart";
    if (options_.keyframeEvery > 0 && input.frame.number - keyNumber_ >= options_.keyframeEvery)
      return "every";
    // Kept radiance holds the light of its moment.
    if (!(key_.lighting() == services.lighting)) return "lights";
    return "";
  }

  /// Traces all samples, as `traced` does, and keeps what they met.
  void makeKey(const FrameInput& input, Services& services, const ReflectiveSamples& samples) {
    services.timer.measure("recompute", [&] {
      const std::size_t count = samples.points.size();
      hits_.resize(count);
      trace(input, services, samples.points, radiance_, flags_, hits_);
      key_.begin(copy_, input.frame.camera, services.lighting, services.geometry);
      const scene::Scene& scene = services.scene;
      for (std::size_t i = 0; i < count; ++i) {
        const trace::ReflectionPoint& point = samples.points[i];
        const trace::FirstHit& hit = hits_[i];
        // One ray whose light depends on nothing but the place that it meets
        const bool shines = hit.hit.miss() || options_.bounces == 1 ||
                            scene.objects[static_cast<std::size_t>(hit.hit.object)].reflector == 0;
        if (reprojection::isMirror(point, scene) && shines &&
            trace::isTraceable({hit.origin, hit.direction}))
          key_.keep(samples.places[i], point, hit, radiance_[i]);
      }
      key_.finish(services.geometry);
      keyNumber_ = input.frame.number;
    });
  }

  /// Traces what was not found.
  void retrace(const FrameInput& input, Services& services, const ReflectiveSamples& samples,
               const std::vector<std::uint32_t>& missing) {
    services.timer.measure("recompute", [&] {
      std::vector<trace::ReflectionPoint> points;
      points.reserve(missing.size());
      for (const std::uint32_t i : missing) points.push_back(samples.points[i]);
      std::vector<Vec3> radiance(points.size(), Vec3(0.0f));
      std::vector<std::uint8_t> flags(masks_ ? points.size() : 0, 0);
      trace(input, services, points, radiance, flags, {});
      for (std::size_t k = 0; k < missing.size(); ++k) {
        radiance_[missing[k]] = radiance[k];
        if (masks_) flags_[missing[k]] = flags[k];
      }
    });
  }

  void trace(const FrameInput& input, Services& services,
             std::span<const trace::ReflectionPoint> points, std::span<Vec3> radiance,
             std::span<std::uint8_t> flags, std::span<trace::FirstHit> hits) {
    const float spread = scene::pixelSpreadRad(input.frame.camera, copy_.sampleHeight());
    counts_ = trace::reflectedRadiance(*services.trace, services.lighting, spread, points,
                                       reflection_, true, radiance, flags, hits);
  }

  void show(Services& services, const ReflectiveSamples& samples,
            const std::vector<std::uint32_t>& missing) {
    services.timer.measure("upload", [&] {
      upload_.scatter(*services.gbuffer, !reflectors_.all(), samples.places, radiance_, flags_);
      if (masks_)
        for (const std::uint32_t i : missing)
          upload_.mark(
              samples.places[i],
              raster::kMaskRetraced |
                  (reuse_.outcome(i) == Outcome::NotSearched ? 0 : raster::kMaskDisoccluded));
      upload_.upload(*services.gbuffer);
    });
  }

  void report(const OutcomeCounts& outcomes, std::uint64_t retraced, std::uint64_t keyed,
              FrameOutput& output) const {
    output.counters["reused"] = outcomes[Outcome::Found];
    output.counters["retraced"] = retraced;
    output.counters["key_frame_samples"] = keyed;
    output.counters["key_frame"] = keyed > 0 ? 1 : 0;
    output.counters["not_searched"] = outcomes[Outcome::NotSearched];
    output.counters["not_found"] = outcomes[Outcome::NotFound];
    output.counters["discontinuity"] = outcomes[Outcome::Discontinuity];
    output.counters["magnified"] = outcomes[Outcome::Magnified];
    output.counters["unfaithful"] = outcomes[Outcome::Unfaithful];
    output.counters["rays"] = counts_.rays;
    output.counters["misses"] = counts_.misses;
    output.counters["refused"] = counts_.refused;
    output.counters["not_finite"] = counts_.notFinite;
    output.counters["below_horizon"] = counts_.belowHorizon;
    output.counters["total_reflection"] = counts_.totalReflections;
  }

  Options options_;
  bool searches_;
  Reuse reuse_;
  trace::ReflectionOptions reflection_;
  bool masks_ = false;
  frame::ObjectSet reflectors_;  ///< those that it fills
  KeyFrame key_;
  int keyNumber_ = 0;
  trace::ReflectionCounts counts_;
  // Kept across frames, so that no frame allocates anew.
  raster::GBufferCopy copy_;
  std::vector<Vec3> radiance_;
  std::vector<std::uint8_t> flags_;
  std::vector<trace::FirstHit> hits_;
  ReflectionUpload upload_;
};

std::vector<StepInfo> stepsOf(bool searches) {
  return {
      {"bvh", "start, frames", "Embree's tree is built, follows the geometry by the option bvh"},
      {"readback", "frames", "the G-buffer is read, its reflective samples are listed"},
      {"search", "frames",
       searches ? "each sample looks in the key frame for the place whose reflection it shows now"
                : "each sample looks in the key frame for the place of its surface"},
      {"shift", "frames", "what the key frame shows there is interpolated, edges are rejected"},
      {"warp", "frames", "what does not lie on this frame's mirrored rays is rejected"},
      {"recompute", "frames", "Embree traces what was not found, and key frames whole"},
      {"upload", "frames", "reflections go back to the device"},
  };
}

const std::vector<CounterInfo>& counterInfos() {
  static const std::vector<CounterInfo> infos = {
      {"reused", "samples whose reflection comes from the key frame"},
      {"retraced", "samples that were traced anew in a frame that is no key frame"},
      {"key_frame", "1 where the frame is a key frame"},
      {"key_frame_samples", "samples that were traced because the frame is a key frame"},
      {"not_searched", "of retraced: glossy samples and those of bodies that refract"},
      {"not_found", "of retraced: the search ended at a rim, outside, or nowhere"},
      {"discontinuity", "of retraced: found at an edge of what is reflected"},
      {"magnified", "of retraced: stretched over too many samples"},
      {"unfaithful", "of retraced: what was found does not lie on the mirrored ray"},
      {"rays", "rays that Embree traced"},
      {"misses", "of them those that left the scene and saw the environment"},
      {"refused", "rays that could not be traced; they see the environment", true},
      {"not_finite", "radiances that were no number: taken as 0", true},
      {"below_horizon", "rays below the shading normal's plane, folded up"},
      {"total_reflection", "rays that could not leave a body that refracts"},
  };
  return infos;
}

template <bool kSearches>
std::unique_ptr<Method> make(const config::Value& options) {
  const auto& table =
      kSearches ? reprojection::reprojectionOptions() : reprojection::imageWarpOptions();
  return std::make_unique<Reprojection>(table.parse(options), kSearches);
}

}  // namespace

const MethodEntry& reprojectionEntry() {
  static const MethodEntry entry{
      .id = "reprojection",
      .summary = "reflections of traced key frames, found again in the frames after them",
      .paper = "[Xie2017] reprojection",
      .steps = stepsOf(true),
      .counters = counterInfos(),
      .tables = {kKeyFrames},
      .tests = {.refracting = R"({"bounces": 2})"},
      .options = reprojection::reprojectionOptions().schema(),
      .make = make<true>};
  return entry;
}

const MethodEntry& imageWarpEntry() {
  static const MethodEntry entry{
      .id = "image_warp",
      .summary =
          "reflections of traced key frames, kept on their surfaces: the control of reprojection",
      .paper = "[Xie2017] naive depth-based warping",
      .steps = stepsOf(false),
      .counters = counterInfos(),
      .tables = {kKeyFrames},
      .tests = {.refracting = R"({"bounces": 2})"},
      .options = reprojection::imageWarpOptions().schema(),
      .make = make<false>};
  return entry;
}

}  // namespace catoptric::methods
