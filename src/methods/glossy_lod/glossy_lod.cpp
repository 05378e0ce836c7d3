#include "methods/glossy_lod/glossy_lod.h"

#include <algorithm>
#include <array>
#include <memory>
#include <numeric>
#include <optional>
#include <string>
#include <vector>

#include "gl/shader.h"
#include "methods/contract/method.h"
#include "methods/glossy_lod/options.h"
#include "methods/glossy_lod/radiance.h"
#include "methods/glossy_lod/scene_images.h"
#include "methods/glossy_lod/shaders/constants.h"
#include "methods/shared/reflectors.h"
#include "raster/passes/refractive_samples.h"

namespace catoptric::methods {
namespace {

using namespace glossy_lod;
namespace shared = glossy_lod_shared;

/// Counted by shaders/trace.frag, in the order of its kCount... constants.
constexpr std::array<const char*, shared::kCounts> kCountNames = {
    "rays", "misses", "below_horizon", "visits", "quads_tested", "stopped"};

class GlossyLod : public Method {
 public:
  explicit GlossyLod(const Options& options) : options_(options) {}

  MethodPlan plan(const scene::Scene& scene, const RunSettings& settings) const override {
    MethodPlan plan;
    plan.gbuffer = true;
    plan.masks = raster::kMaskBelowHorizon | raster::kMaskSky;
    const Reflectors reflectors = findReflectors(scene, settings.reflectors);
    if (!reflectors.any()) return plan;
    const std::string all = options_.objects == Objects::All ? "all" : "diffuse";
    plan.items = {
        {"precomputation", "geometry_images",
         "charts of " + all + " objects as grids of vertices, " + std::to_string(options_.size) +
             " x " + std::to_string(options_.size) + " quads an object, and the tree over them",
         0},
        {"precomputation", "radiance", "their diffuse radiance, on both sides", 0},
        {"pass", "trace",
         std::to_string(reflectors.count()) + " reflective objects, " +
             (options_.automatic ? "20 or 40" : std::to_string(options_.rays)) +
             " rays for each sample of a lobe",
         0},
    };
    if (scene.animated())
      plan.items.push_back({"pass", "geometry_images", "vertices and boxes of what has moved", 0});
    return plan;
  }

  void prepare(Services& services, const RunSettings& settings) override {
    masks_ = settings.masks;
    clearsMasks_ = settings.masks && settings.reflectors.all();
    reflectors_ = findReflectors(services.scene, settings.reflectors);
    if (!reflectors_.any()) return;
    refractive_ = raster::RefractiveSamples(services.scene);
    services.timer.measure("geometry_images",
                           [&] { images_.make(services.scene, services.geometry, options_); });
    shadeAll(services);
    if (reflectors_.mirrors()) mirror_ = makeProgram("rays of mirrors", services, false);
    if (reflectors_.glossy) glossy_ = makeProgram("rays of lobes", services, true);
    counts_ = gl::Buffer("counts of rays", 2 * kCountNames.size() * sizeof(std::uint32_t));
  }

  void render(const FrameInput& input, Services& services, FrameOutput& output) override {
    if (clearsMasks_) services.gbuffer->reflectionFramebuffer.clearColorUint(1, 0);
    if (!reflectors_.any()) {
      for (const char* name : kCountNames) output.counters[name] = 0;
      output.counters["refraction_mirrored"] = 0;
      report(output);
      return;
    }
    follow(input, services);
    services.timer.measure("trace", [&] { trace(input, services); });
    std::array<std::uint32_t, 2 * kCountNames.size()> counts{};
    counts_.read(0, sizeof counts, counts.data());
    for (std::size_t i = 0; i < kCountNames.size(); ++i)
      output.counters[kCountNames[i]] = counts[2 * i] | std::uint64_t{counts[2 * i + 1]} << 32;
    output.counters["refraction_mirrored"] = refractive_.count(*services.gbuffer);
    report(output);
  }

 private:
  void report(FrameOutput& output) const {
    output.counters["charts"] = images_.counts().charts;
    output.counters["quads"] = images_.counts().quads;
    output.counters["plain_triangles"] = images_.counts().plainTriangles;
    output.counters["degenerate_triangles"] = images_.counts().degenerateTriangles;
    output.counters["not_flattened"] = images_.counts().notFlattened;
    output.counters["reduced_objects"] = images_.counts().reducedObjects;
    output.counters["not_finite"] = radiance_.notFinite();
  }

  void shadeAll(Services& services) {
    services.timer.measure("radiance", [&] {
      std::vector<int> objects(services.scene.objects.size());
      std::iota(objects.begin(), objects.end(), 0);
      radiance_.shade(services.scene, services.geometry, services.lighting, images_, objects);
      lighting_ = services.lighting;
    });
  }

  void follow(const FrameInput& input, Services& services) {
    const std::vector<int>& changed = input.changedObjects;
    const bool moved =
        std::any_of(changed.begin(), changed.end(), [&](int i) { return images_.reflects(i); });
    if (moved)
      services.timer.measure("geometry_images",
                             [&] { images_.follow(services.geometry, changed); });
    if (!(lighting_ == services.lighting)) {
      shadeAll(services);
    } else if (moved) {
      services.timer.measure("radiance", [&] {
        radiance_.shade(services.scene, services.geometry, services.lighting, images_, changed);
      });
    }
  }

  gl::Program makeProgram(const char* label, const Services& services, bool lobes) const {
    std::vector<gl::Define> defines = raster::SceneRaster::shadingDefines(services.lighting);
    const bool masked =
        std::any_of(services.scene.materials.begin(), services.scene.materials.end(),
                    [](const scene::Material& m) { return m.alphaMode == scene::AlphaMode::Mask; });
    const auto define = [&](const char* name, bool on) {
      defines.push_back({name, on ? "1" : "0"});
    };
    define("LOBES", lobes);
    define("MASKS", masks_);
    define("LEVELS", options_.levels == Levels::Adaptive);
    define("FILTER", options_.filter);
    define("AUTOMATIC", options_.automatic);
    define("MASKED", masked);
    return gl::Program::fullScreen(label, "methods/glossy_lod/shaders/trace.frag",
                                   std::move(defines));
  }

  void trace(const FrameInput& input, Services& services) {
    const raster::GBuffer& gbuffer = *services.gbuffer;
    const std::vector<std::uint32_t> zeros(2 * kCountNames.size(), 0);
    counts_.write(0, zeros.size() * sizeof(std::uint32_t), zeros.data());
    counts_.bindStorage(shared::kCountsBinding);
    gbuffer.reflectionFramebuffer.bind();
    if (reflectors_.mirrors()) pass(mirror_, input, services, raster::onMirrors());
    if (reflectors_.glossy)
      pass(glossy_, input, services, raster::onSamplesOf(raster::SampleClass::Glossy));
  }

  void pass(gl::Program& program, const FrameInput& input, Services& services,
            gl::DrawState state) const {
    const raster::GBuffer& gbuffer = *services.gbuffer;
    const scene::Camera& camera = input.frame.camera;
    program.use();
    services.raster->bindShadingResources(program.id(), services.lighting);
    gbuffer.normal.bind(shared::kNormalsUnit);
    gbuffer.depth.bind(shared::kDepthsUnit);
    images_.bind(program);
    radiance_.bind();
    program.set("rayFromPixel",
                scene::rayFromPixel(camera, gbuffer.sampleWidth(), gbuffer.sampleHeight()));
    program.set("eye", camera.eye());
    program.set("nearMetres", camera.nearMetres);
    program.set("spread", scene::pixelSpreadRad(camera, gbuffer.sampleHeight()));
    program.set("samplesPerPixel", gbuffer.samples);
    program.set("raysOfLobe", options_.rays);
    program.set("alphaOfAll", options_.alpha);
    state.depth.write = false;  // it is read
    const gl::DrawScope scope(state);
    gl::drawFullScreenTriangle();
  }

  Options options_;
  bool masks_ = false;
  bool clearsMasks_ = false;  ///< the whole frame is its own
  Reflectors reflectors_;
  raster::RefractiveSamples refractive_;
  SceneImages images_;
  Radiance radiance_;
  frame::Lighting lighting_;  ///< that the radiance is of
  gl::Program mirror_;
  gl::Program glossy_;
  gl::Buffer counts_;
};

}  // namespace

const MethodEntry& glossyLodEntry() {
  static const MethodEntry entry{
      .id = "glossy_lod",
      .summary = "ray tracing in geometry images, as coarse as each ray is wide",
      .paper = "[Yu2008] glossy_lod",
      .steps = {{"geometry_images", "start, frames",
                 "geometry images and their tree are made; what has moved follows"},
                {"radiance", "start, frames",
                 "their diffuse radiance is computed, again when lights or objects change"},
                {"trace", "frames", "rays are traced and filtered"}},
      .counters = {{"rays", "rays that were traced"},
                   {"misses", "rays that left the scene"},
                   {"below_horizon", "rays below the shading normal's plane, folded up"},
                   {"visits", "nodes of the tree that were looked at"},
                   {"quads_tested", "quads whose two triangles were tested"},
                   {"stopped", "of these those of coarser levels"},
                   {"charts", "charts of all objects that are reflected"},
                   {"quads", "quads of their finest level"},
                   {"plain_triangles", "triangles that no chart holds: traced as they are"},
                   {"degenerate_triangles", "triangles without area: left out"},
                   {"not_flattened", "charts that could not be flattened, and were cut"},
                   {"reduced_objects",
                    "objects that have fewer quads than `size` asks for: all of them, where all "
                    "together would be more than 6 million"},
                   {"not_finite", "radiances that were no number: taken as 0", true},
                   {"refraction_mirrored",
                    "samples of materials that refract: they are mirrored instead"}},
      .tests = {.small = R"({"size": 32, "rays": 4})"},
      .options = optionTable().schema(),
      .make = [](const config::Value& options) -> std::unique_ptr<Method> {
        return std::make_unique<GlossyLod>(optionTable().parse(options));
      }};
  return entry;
}

}  // namespace catoptric::methods
