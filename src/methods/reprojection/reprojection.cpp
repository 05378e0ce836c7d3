#include "methods/reprojection/reprojection.h"

#include <algorithm>
#include <array>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "core/parallel.h"
#include "methods/contract/keeps.h"
#include "methods/contract/restarts.h"
#include "methods/reprojection/border.h"
#include "methods/reprojection/key_frame.h"
#include "methods/reprojection/mirror_samples.h"
#include "methods/reprojection/options.h"
#include "methods/reprojection/reuse.h"
#include "methods/reprojection/second_bounce.h"
#include "methods/shared/reflective_samples.h"
#include "methods/shared/reflectors.h"
#include "methods/shared/sample_tiles.h"
#include "trace/lobes/lobe_tracer.h"
#include "trace/lobes/reflect.h"

namespace catoptric::methods {
namespace {

using reprojection::Border;
using reprojection::KeyFrame;
using reprojection::Options;
using reprojection::Outcome;
using reprojection::Reuse;

const TableInfo kKeyFrames{
    "keyframes",
    "a frame, with the key frame that its reflections come from",
    {{"key", ColumnType::Integer, "the key frame's number"},
     {"reason", ColumnType::Text,
      "why this frame is a key frame: first, restart, every, lights, threshold; empty: it is not "
      "one"},
     {"reflective", ColumnType::Integer, "reflective samples"},
     {"missing", ColumnType::Integer,
      "of these, samples without a match in the key frame (a first key frame: all)"}}};

constexpr std::size_t kFilledPerTask = 4096;
/// Memory of a reflective sample besides the key frame: match, outcome, position. Ours, measured.
constexpr std::uint64_t kMatchBytes = 96;
constexpr const char* kSampleOptions = "image.width, image.height, image.samples";
/// Bits of LobeTracer::run()'s flags.
constexpr std::uint8_t kBelowHorizon = 2;
constexpr std::uint8_t kSky = 4;

/// What becomes of reflective samples, for the counters.
struct OutcomeCounts {
  std::array<std::uint64_t, 10> of{};
  std::uint64_t operator[](Outcome outcome) const { return of[static_cast<std::size_t>(outcome)]; }
};

class Reprojection : public Method, public KeepsFrames {
 public:
  explicit Reprojection(const Options& options)
      : options_(options), reuse_(options), second_(options) {}

  MethodPlan plan(const scene::Scene& scene, const RunSettings& settings) const override {
    MethodPlan plan;
    plan.gbuffer = true;
    plan.masks = raster::kMaskEnvironment | raster::kMaskBelowHorizon | raster::kMaskRetraced |
                 raster::kMaskDisoccluded;
    // Meshes and points move light, not what it comes from.
    if (!movesLight(options_.mapping)) plan.masks |= raster::kMaskSky;
    plan.gl = true;
    const auto reflectors = findReflectors(scene, settings.reflectors).count();
    if (reflectors == 0) return plan;
    plan.trace = true;
    plan.bvh = options_.bvh;
    plan.bounces = options_.bounces;
    const std::uint64_t samples = settings.sampleCount();
    const std::string why = std::to_string(reflectors) + " reflective objects";
    plan.items = {
        {"pass", "readback", "samples are compared on the CPU: the G-buffer is read back", 0},
        {"pass", "search", why + ": each sample searches the key frame (option mapping)", 0},
        {"pass", "shift", "the key frame is interpolated at the matches", 0},
        {"pass", "warp", "matches that do not lie on this frame's mirrored rays are rejected", 0},
        {"pass", "recompute", "Embree traces samples without a match, and key frames", 0},
        {"pass", "upload", "the composite takes the reflection as a texture", 0},
        {"resource", "G-buffer copy", "what is read back", samples * (16 + 16 + 4 + 4),
         kSampleOptions},
        {"resource", "key frame", "hits of its reflective samples", samples * (8 + 16 + 12 + 4),
         kSampleOptions},
        {"resource", "matches", "of its reflective samples, where they fill the frame",
         samples * kMatchBytes, kSampleOptions},
        {"resource", "reflection image", "what is uploaded", samples * 16, kSampleOptions},
    };
    return plan;
  }

  bool restartsAt(const scene::CameraPath& path, int number) const override {
    return onRestartGrid(number, options_.restartEvery) || cutsBefore(path, number);
  }
  std::string keeps() const override { return "a key frame"; }

  void prepare(Services&, const RunSettings& settings) override {
    reflection_.rays = options_.rays;
    reflection_.bounces = options_.bounces;
    reflection_.fresnelSchlick = settings.fresnelSchlick;
    masks_ = settings.masks;
    reflectors_ = settings.reflectors;
  }

  void render(const FrameInput& input, Services& services, FrameOutput& output) override {
    counts_ = {};
    blended_ = 0;
    if (services.trace == nullptr) {  // no reflectors: nothing was planned
      report({}, 0, 0, false, output);
      return;
    }
    services.timer.measure("readback", [&] {
      raster::readBack(*services.gbuffer, specularLevelsVary(services.scene, reflectors_), copy_);
      samples_.find(copy_, input.frame.camera, *services.trace, reflectors_);
    });
    const std::size_t count = samples_.count();
    radiance_.assign(count, Vec3(0.0f));
    flags_.assign(masks_ ? count : 0, 0);

    std::string reason = keyReason(input, services);
    OutcomeCounts outcomes;
    std::vector<std::uint32_t> missing;
    if (reason.empty()) {
      findAll(services, outcomes, missing);
      // A new key frame helps only those that it can be searched for.
      const std::uint64_t never = outcomes[Outcome::NotSearched];
      reason = shareReason(missing.size() - never, count - never);
    }
    const std::uint64_t missed = outcomes.of == OutcomeCounts{}.of ? count : missing.size();
    const bool isKey = !reason.empty();
    if (isKey) {
      makeKey(input, services);
      outcomes = {};
      missing.clear();
    } else if (input.kept) {
      retrace(input, services, missing);
    }
    if (input.kept) show(services, missing);
    report(outcomes, missing.size(), isKey ? count : 0, isKey, output);
    Table table(kKeyFrames);
    table.add(keyNumber_, reason, count, missed);
    output.tables.push_back(std::move(table));
  }

 private:
  /// Why a frame has to be a key frame before anything was searched; empty: it need not.
  std::string keyReason(const FrameInput& input, const Services& services) const {
    // By the path alone: a chunk may begin at any restart frame. Beside another method, which then
    // has its own grid, all warm up from where both restart.
    if (input.restarts || onRestartGrid(input.frame.number, options_.restartEvery))
      return input.frame.number == 1 ? "first" : "restart";
    if (key_.empty()) return "first";
    if (options_.keyframeEvery > 0 && input.frame.number - keyNumber_ >= options_.keyframeEvery)
      return "every";
    // Kept radiance holds the light of its moment.
    if (!(key_.lighting() == services.lighting)) return "lights";
    return "";
  }

  /// Why a frame becomes a key frame by what it misses: `missing` of `count` samples of mirrors.
  std::string shareReason(std::uint64_t missing, std::uint64_t count) const {
    const double share = count > 0 ? static_cast<double>(missing) / static_cast<double>(count) : 0;
    return share > static_cast<double>(options_.keyframeThreshold) ? "threshold" : "";
  }

  /// Looks for all samples in the key frame.
  void findAll(Services& services, OutcomeCounts& outcomes, std::vector<std::uint32_t>& missing) {
    services.timer.measure("search", [&] { samples_.aim(); });
    reuse_.begin(samples_, services);
    key_.follow(services.geometry);
    reuse_.findIn(key_, services, radiance_);
    second_.find(samples_, key_, reuse_, services, radiance_);
    flag();
    missing.resize(samples_.count());
    std::size_t count = 0;
    for (std::size_t i = 0; i < samples_.count(); ++i) {
      missing[count] = static_cast<std::uint32_t>(i);
      count += reuse_.outcome(i) != Outcome::Found ? 1 : 0;
    }
    missing.resize(count);
    for (const std::uint32_t i : missing)
      ++outcomes.of[static_cast<std::size_t>(reuse_.outcome(i))];
    outcomes.of[static_cast<std::size_t>(Outcome::Found)] = samples_.count() - count;
  }

  /// For the masks: what LobeTracer would say of the samples that were found.
  void flag() {
    for (std::size_t i = 0; i < flags_.size(); ++i) {
      if (reuse_.outcome(i) != Outcome::Found) continue;
      if (samples_.belowHorizon()[i] != 0) flags_[i] |= kBelowHorizon;
      if (reuse_.showsSky(key_, i)) flags_[i] |= kSky;
    }
  }

  /// Keeps what the samples have met, and what mirrors in mirrors show where seconds_ has it.
  void keep(const FrameInput& input, Services& services) {
    const std::span<const std::uint32_t> places = samples_.places();
    key_.begin(copy_.sampleWidth(), copy_.sampleHeight(), input.frame.camera, services.lighting,
               services.geometry, movesLight(options_.mapping));
    const scene::Scene& scene = services.scene;
    if (!seconds_.empty())
      second_.begin(copy_.sampleWidth(), copy_.sampleHeight(), input.frame.camera,
                    services.lighting, services.geometry);
    parallelFor(places.size(), kFilledPerTask, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const trace::FirstHit& hit = hits_[i];
        // One ray whose light depends on nothing but the place that it meets
        const bool shines = hit.hit.miss() || options_.bounces == 1 ||
                            scene.objects[static_cast<std::size_t>(hit.hit.object)].reflector == 0;
        if (!reprojection::isMirror(points_[i].lobe, points_[i].object, scene) ||
            !trace::isTraceable({hit.origin, hit.direction}))
          continue;
        if (shines)
          key_.keep(places[i], points_[i], hit, radiance_[i]);
        else if (!seconds_.empty() && second_.keep(places[i], points_[i], hit, seconds_[i], scene))
          key_.keep(places[i], points_[i], hit, seconds_[i].surface);
      }
    });
    if (!seconds_.empty()) second_.finish(services.geometry, options_.epsilon);
    key_.finish(services.geometry, options_.epsilon);
  }

  /// Traces all samples, as `traced` does, and keeps what they met.
  void makeKey(const FrameInput& input, Services& services) {
    services.timer.measure("recompute", [&] {
      samples_.points(samples_.places(), points_);
      hits_.resize(points_.size());
      seconds_.assign(second_.used(services.geometry) ? points_.size() : 0, {});
      std::fill(flags_.begin(), flags_.end(), std::uint8_t{0});
      traceAll(input, services);
      keep(input, services);
      keyNumber_ = input.frame.number;
    });
  }

  /// Traces what was not found, and what lies about it.
  void retrace(const FrameInput& input, Services& services,
               const std::vector<std::uint32_t>& missing) {
    services.timer.measure("recompute", [&] {
      const auto border = border_.find(samples_, reuse_, missing, options_.border);
      blended_ = border.size();
      std::vector<Border::Member> traced;
      traced.reserve(missing.size() + border.size());
      for (const std::uint32_t i : missing) traced.push_back({i, 1.0f});
      traced.insert(traced.end(), border.begin(), border.end());
      std::vector<Vec3> radiance(traced.size(), Vec3(0.0f));
      std::vector<std::uint8_t> flags(masks_ ? traced.size() : 0, 0);
      seconds_.clear();
      trace(input, services, traced, radiance, flags);
      for (std::size_t k = 0; k < traced.size(); ++k) {
        const auto [index, share] = traced[k];
        radiance_[index] =
            share < 1.0f ? glm::mix(radiance_[index], radiance[k], share) : radiance[k];
        if (masks_ && share == 1.0f) flags_[index] = flags[k];
      }
    });
  }

  /// All samples, in packets of the same rays as `traced`: of two surfaces that a ray meets at one
  /// distance, as along an edge, the one that Embree names depends on the other rays beside it.
  void traceAll(const FrameInput& input, Services& services) {
    const float spread = scene::pixelSpreadRad(input.frame.camera, copy_.sampleHeight());
    counts_ = {};
    std::mutex mutex;
    samples_.eachTile([&](std::size_t first, trace::PointLanes&) {
      trace::LobeTracer& tracer = trace::LobeTracer::ofThread();
      tracer.begin(*services.trace, services.lighting, spread, reflection_);
      tracer.keepSeconds(seconds_.empty() ? nullptr : seconds_.data() + first);
      trace::ReflectionCounts mine;
      tracer.run(radiance_.data() + first, flags_.empty() ? nullptr : flags_.data() + first,
                 hits_.data() + first, mine);
      tracer.keepSeconds(nullptr);
      const std::scoped_lock lock(mutex);
      counts_.add(mine);
    });
  }

  /// The samples `traced`, into radiance and flags in their order: in `traced`'s packets likewise,
  /// whose other rays are traced without their light.
  void trace(const FrameInput& input, Services& services, std::span<const Border::Member> traced,
             std::span<Vec3> radiance, std::span<std::uint8_t> flags) {
    const float spread = scene::pixelSpreadRad(input.frame.camera, copy_.sampleHeight());
    counts_ = {};
    slots_.assign(samples_.count(), 0);
    for (std::size_t k = 0; k < traced.size(); ++k)
      slots_[traced[k].index] = static_cast<std::uint32_t>(k) + 1;
    std::mutex mutex;
    samples_.eachPacketOf(slots_, reflection_,
                          [&](std::span<const std::uint32_t> slots, trace::PointLanes&) {
                            std::array<Vec3, SampleTiles::kSamples> light;
                            std::array<std::uint8_t, SampleTiles::kSamples> marks{};
                            trace::LobeTracer& tracer = trace::LobeTracer::ofThread();
                            tracer.begin(*services.trace, services.lighting, spread, reflection_);
                            tracer.only(slots.data());
                            trace::ReflectionCounts mine;
                            tracer.run(light.data(), marks.data(), nullptr, mine);
                            tracer.only(nullptr);
                            for (std::size_t k = 0; k < slots.size(); ++k) {
                              if (slots[k] == 0) continue;
                              radiance[slots[k] - 1] = light[k];
                              if (masks_) flags[slots[k] - 1] = marks[k];
                            }
                            const std::scoped_lock lock(mutex);
                            counts_.add(mine);
                          });
  }

  void show(Services& services, const std::vector<std::uint32_t>& missing) {
    services.timer.measure("upload", [&] {
      upload_.scatter(*services.gbuffer, !reflectors_.all(), samples_.places(), radiance_, flags_);
      if (masks_)
        for (const std::uint32_t i : missing)
          upload_.mark(
              samples_.places()[i],
              raster::kMaskRetraced |
                  (reuse_.outcome(i) == Outcome::NotSearched ? 0 : raster::kMaskDisoccluded));
      upload_.upload(*services.gbuffer);
    });
  }

  void report(const OutcomeCounts& outcomes, std::uint64_t retraced, std::uint64_t keyed,
              bool isKey, FrameOutput& output) const {
    output.counters["reused"] = outcomes[Outcome::Found];
    output.counters["retraced"] = retraced;
    output.counters["blended"] = blended_;
    output.counters["key_frame_samples"] = keyed;
    output.counters["key_frame"] = isKey ? 1 : 0;
    output.counters["not_searched"] = outcomes[Outcome::NotSearched];
    output.counters["not_found"] = outcomes[Outcome::NotFound];
    output.counters["hidden"] = outcomes[Outcome::Hidden];
    output.counters["discontinuity"] = outcomes[Outcome::Discontinuity];
    output.counters["magnified"] = outcomes[Outcome::Magnified];
    output.counters["crossed"] = outcomes[Outcome::Crossed];
    output.counters["second_bounce"] = outcomes[Outcome::SecondBounce];
    output.counters["unfaithful"] = outcomes[Outcome::Unfaithful];
    output.counters["rays"] = counts_.rays;
    output.counters["misses"] = counts_.misses;
    output.counters["refused"] = counts_.refused;
    output.counters["not_finite"] = counts_.notFinite;
    output.counters["below_horizon"] = counts_.belowHorizon;
    output.counters["total_reflection"] = counts_.totalReflections;
  }

  Options options_;
  Reuse reuse_;
  reprojection::SecondBounce second_;
  trace::ReflectionOptions reflection_;
  bool masks_ = false;
  frame::ObjectSet reflectors_;  ///< those that it fills
  KeyFrame key_;
  int keyNumber_ = 0;
  trace::ReflectionCounts counts_;
  std::uint64_t blended_ = 0;
  // Kept across frames, so that no frame allocates anew.
  raster::GBufferCopy copy_;
  reprojection::MirrorSamples samples_;
  std::vector<trace::ReflectionPoint> points_;  ///< those that are traced
  std::vector<std::uint32_t> slots_;            ///< by sample: place in points_, from 1 on; 0: none
  std::vector<Vec3> radiance_;
  std::vector<std::uint8_t> flags_;
  std::vector<trace::FirstHit> hits_;
  std::vector<trace::SecondHit> seconds_;  ///< of a key frame that keeps them
  Border border_;
  ReflectionUpload upload_;
};

const std::vector<StepInfo>& stepInfos() {
  static const std::vector<StepInfo> infos = {
      {"bvh", "start, frames",
       "Embree's BVH is built; in a frame: it is updated as the option `bvh` says"},
      {"readback", "frames", "the G-buffer is read back, and its reflective samples are listed"},
      {"search", "frames",
       "each sample searches the key frame for its reflection; with mapping: surface for its own "
       "surface point"},
      {"shift", "frames",
       "the key frame is interpolated at the matches; matches at edges are rejected"},
      {"warp", "frames", "matches that do not lie on this frame's mirrored rays are rejected"},
      {"recompute", "frames", "Embree traces samples without a match, and whole key frames"},
      {"upload", "frames", "reflections are uploaded"},
  };
  return infos;
}

const std::vector<CounterInfo>& counterInfos() {
  static const std::vector<CounterInfo> infos = {
      {"reused", "samples whose reflection comes from the key frame"},
      {.name = "retraced",
       .meaning = "samples that were traced in a frame that is not a key frame",
       .handedOn = true},
      {"blended",
       "of `reused`: samples at the border of retraced areas, which were also traced and then "
       "blended"},
      {"key_frame", "1 if the frame is a key frame"},
      {.name = "key_frame_samples",
       .meaning = "samples that were traced because the frame is a key frame",
       .handedOn = true},
      {"not_searched", "of `retraced`: glossy and refractive samples"},
      {"not_found",
       "of `retraced`: the search ended at a silhouette, outside the frame, or without a result"},
      {"hidden",
       "of `retraced`: a neighbouring sample reflects a nearer surface. Whether this sample "
       "reflects it, too, is unknown: that part of the reflection lies outside the reflector in "
       "the key frame"},
      {"discontinuity", "of `retraced`: the match lies at an edge of reflected surfaces"},
      {"magnified", "of `retraced`: a sample of the key frame would cover too many samples"},
      {"crossed", "of `retraced`: the mirrored ray hits the bounds of another moving object"},
      {"unfaithful", "of `retraced`: the match does not lie on the mirrored ray"},
      {"second_bounce", "of `retraced`: the second bounce of the match is no longer valid"},
      {"rays", "traced rays, including those that share a packet with a retraced one"},
      {"misses", "of `rays`: those that left the scene"},
      {"refused", "invalid rays, which Embree cannot trace; they return the environment", true},
      {"not_finite", "radiances that were NaN or infinite, replaced by 0", true},
      {"below_horizon",
       "rays that would enter the surface: the normal was corrected, or the lobe's ray was "
       "mirrored back"},
      {"total_reflection", "rays that are totally reflected inside a refractive object"},
  };
  return infos;
}

}  // namespace

const MethodEntry& reprojectionEntry() {
  static const MethodEntry entry{
      .id = "reprojection",
      .summary =
          "traces key frames, and reprojects their reflections into the following frames; "
          "the method name `image_warp` is short for it with `mapping: surface`",
      .paper = "[Xie2017] reprojection",
      .steps = stepInfos(),
      .counters = counterInfos(),
      .tables = {kKeyFrames},
      .tests = {.refracting = R"({"bounces": 2})", .variants = {R"({"mapping": "grid"})"}},
      .options = reprojection::optionTable().schema(),
      .make = [](const config::Value& options) -> std::unique_ptr<Method> {
        return std::make_unique<Reprojection>(reprojection::optionTable().parse(options));
      },
      .aliases = {{"image_warp", "mapping", "\"surface\""}}};
  return entry;
}

}  // namespace catoptric::methods
