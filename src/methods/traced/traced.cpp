#include "methods/traced/traced.h"

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "config/options.h"
#include "methods/shared/reflectors.h"
#include "methods/shared/shared_options.h"
#include "methods/shared/traced_samples.h"
#include "trace/lobes/environment_levels.h"

namespace catoptric::methods {
namespace {

constexpr auto kObjects = config::names<bool>({{"all", false}, {"diffuse", true}});
constexpr auto kEnvironments = config::names<bool>({{"unfiltered", false}, {"filtered", true}});

struct Options {
  trace::BvhPolicy bvh = trace::BvhPolicy::Static;
  bool diffuseOnly = false;
  bool filtersEnvironment = false;
  trace::ReflectionOptions reflection{.rays = 8};
};

const config::OptionTable<Options>& optionTable() {
  using config::atLeast, config::field, config::in, config::range, trace::ReflectionOptions;
  static const config::OptionTable<Options> table(
      "traced", "Options of the method traced.",
      {field(&Options::bvh, "bvh", kBvhPolicies, kBvhHelp),
       field(in(&Options::reflection, &ReflectionOptions::rays), "rays", range(1, 256), kRaysHelp)
           .trade("2,4,8,16,32"),
       field(&Options::diffuseOnly, "objects", kObjects, kObjectsHelp),
       field(&Options::filtersEnvironment, "environment", kEnvironments,
             "radiance of rays that leave the scene. unfiltered: the environment's radiance in "
             "the ray's direction; filtered: its mean over the ray's solid angle"),
       field(in(&Options::reflection, &ReflectionOptions::fadeMetres), "attenuation", atLeast(0.0),
             kAttenuationHelp),
       field(in(&Options::reflection, &ReflectionOptions::bounces), "bounces", range(1, 16),
             kBouncesHelp)});
  return table;
}

class Traced : public Method {
 public:
  explicit Traced(const Options& options) : options_(options) {}

  MethodPlan plan(const scene::Scene& scene, const RunSettings& settings) const override {
    MethodPlan plan;
    plan.gbuffer = true;
    plan.masks = raster::kMaskEnvironment | raster::kMaskBelowHorizon | raster::kMaskSky;
    plan.gl = true;
    const auto reflectors = findReflectors(scene, settings.reflectors).count();
    if (reflectors == 0) return plan;
    plan.trace = !options_.diffuseOnly;
    plan.bvh = options_.bvh;
    plan.bounces = options_.reflection.bounces;
    const std::uint64_t samples = settings.sampleCount();
    const std::string why = std::to_string(reflectors) + " reflective objects";
    plan.items = {
        {"pass", "readback", "Embree traces on the CPU: normal, s, g, depth and ids are read back",
         0},
        {"pass", "trace", why + ", bvh " + kBvhPolicies.of(options_.bvh), 0},
        {"pass", "resolve", "rays are made, hits shaded", 0},
        {"pass", "upload", "the composite takes the reflection as a texture", 0},
        {"resource", "bands", "two, for what is read back and uploaded",
         2 * std::min(samples, Bands::largest(settings.width * settings.samples)) *
             (16 + 16 + 4 + 4 + 16)},
    };
    if (options_.diffuseOnly)
      plan.items.push_back({"resource", "bvh", "of the objects that do not reflect", 0});
    return plan;
  }

  void prepare(Services& services, const RunSettings& settings) override {
    options_.reflection.fresnelSchlick = settings.fresnelSchlick;
    masks_ = settings.masks;
    reflectors_ = settings.reflectors;
    if (findReflectors(services.scene, reflectors_).count() == 0) return;
    if (options_.filtersEnvironment) {
      levels_ = std::make_unique<trace::EnvironmentLevels>(services.lighting.environment);
      options_.reflection.environment = levels_.get();
    }
    if (options_.diffuseOnly)
      services.timer.measure("bvh", [&] {
        diffuse_ = std::make_unique<trace::TraceScene>(
            services.scene, services.geometry, options_.bvh,
            trace::TraceOptions{.objects = diffuseObjects(services.scene)});
      });
  }

  void render(const FrameInput& input, Services& services, FrameOutput& output) override {
    frame::StepTimer& timer = services.timer;
    trace::ReflectionCounts counts;
    if (diffuse_) followMotion(input, timer);
    const trace::TraceScene* const trace = diffuse_ ? diffuse_.get() : services.trace;
    if (trace == nullptr) {  // no reflectors: nothing was planned
      report(counts, output);
      return;
    }

    const std::uint64_t unresolvedBefore = trace->unresolvedRays();
    counts = traceSamples({*trace, options_.reflection, reflectors_, masks_}, input.frame.camera,
                          services, bands_);
    if (!services.geometry.surfaces.empty()) {
      output.counters["at_outline"] = counts.atOutline;
      output.counters["off_surface"] = counts.offSurface;
      output.counters["unresolved"] = trace->unresolvedRays() - unresolvedBefore;
    }
    report(counts, output);
  }

 private:
  static std::vector<int> diffuseObjects(const scene::Scene& scene) {
    std::vector<int> objects;
    for (std::size_t i = 0; i < scene.objects.size(); ++i)
      if (scene.objects[i].reflector == 0) objects.push_back(static_cast<int>(i));
    if (objects.empty()) objects.push_back(scene::kNone);  // an empty list would mean all
    return objects;
  }

  void followMotion(const FrameInput& input, frame::StepTimer& timer) {
    const bool rebuilds = options_.bvh == trace::BvhPolicy::RebuildLow ||
                          options_.bvh == trace::BvhPolicy::RebuildMedium;
    if (rebuilds || !input.changedObjects.empty())
      timer.measure("bvh", [&] { diffuse_->update(input.changedObjects); });
  }

  static void report(const trace::ReflectionCounts& counts, FrameOutput& output) {
    output.counters["rays"] = counts.rays;
    output.counters["misses"] = counts.misses;
    output.counters["refused"] = counts.refused;
    output.counters["not_finite"] = counts.notFinite;
    output.counters["below_horizon"] = counts.belowHorizon;
    output.counters["total_reflection"] = counts.totalReflections;
  }

  Options options_;
  bool masks_ = false;
  frame::ObjectSet reflectors_;
  std::unique_ptr<trace::EnvironmentLevels> levels_;  ///< where the environment is filtered
  std::unique_ptr<trace::TraceScene> diffuse_;        ///< where only diffuse objects are met
  Bands bands_;
};

}  // namespace

const MethodEntry& tracedEntry() {
  constexpr const char* kSurfaces = "implicit surfaces in the scene";
  static const MethodEntry entry{
      .id = "traced",
      .summary = "traces reflected rays from the G-buffer with Embree: the baseline",
      .paper = "",
      .steps = {{"bvh", "start, frames",
                 "Embree's BVH is built; in a frame: it is updated as the option `bvh` says"},
                {"readback", "frames", "the G-buffer is read back"},
                {"trace", "frames", "rays are traced by Embree"},
                {"resolve", "frames", "rays are generated; hits are shaded"},
                {"upload", "frames", "reflections are uploaded"}},
      .counters =
          {{"rays", "traced rays"},
           {"misses", "rays that left the scene"},
           {"refused", "invalid rays, which Embree cannot trace; they return the environment",
            true},
           {"not_finite", "radiances that were NaN or infinite, replaced by 0", true},
           {"below_horizon",
            "rays that would enter the surface: the normal was corrected, or the lobe's ray was "
            "mirrored back"},
           {"total_reflection", "rays that are totally reflected inside a refractive object"},
           {"at_outline",
            "samples whose camera ray misses the implicit surface; the nearest point was taken",
            false, kSurfaces},
           {"off_surface", "samples without a point of the implicit surface nearby", false,
            kSurfaces},
           {"unresolved", "rays whose intersection with an implicit surface is undecided", false,
            kSurfaces}},
      .tests = {.refracting = R"({"bounces": 2})", .planeMirrorPercent = 0.1},
      .options = optionTable().schema(),
      .make = [](const config::Value& options) -> std::unique_ptr<Method> {
        return std::make_unique<Traced>(optionTable().parse(options));
      },
      .fallbackOptions = "{}"};
  return entry;
}

}  // namespace catoptric::methods
