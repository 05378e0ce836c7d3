#include "methods/glossy_lod/glossy_lod.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <mutex>
#include <numeric>
#include <string>
#include <vector>

#include "core/clock.h"
#include "methods/contract/method.h"
#include "methods/glossy_lod/image_layers.h"
#include "methods/glossy_lod/options.h"
#include "methods/glossy_lod/radiance.h"
#include "methods/glossy_lod/scene_images.h"
#include "methods/glossy_lod/tile_tracer.h"
#include "methods/shared/bands.h"
#include "methods/shared/reflectors.h"
#include "raster/passes/refractive_samples.h"

namespace catoptric::methods {
namespace {

using namespace glossy_lod;

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
    const Sizes sizes = findSizes(scene, settings, options_);
    plan.items = {
        {"precomputation", "geometry_images",
         "charts of " + all + " objects as grids of vertices, and the tree over them", 0},
        {"resource", "geometry images", sizesText(sizes), sizes.bytes},
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
    fresnelSchlick_ = settings.fresnelSchlick;
    own_ = settings.reflectors;
    layers_ = settings.layers;
    reflectors_ = findReflectors(services.scene, settings.reflectors);
    if (!reflectors_.any()) return;
    refractive_ = raster::RefractiveSamples(services.scene);
    services.timer.measure("geometry_images", [&] {
      const Sizes sizes = findSizes(services.scene, settings, options_);
      images_.make(services.scene, services.geometry, options_, sizes);
    });
    objects_.resize(services.scene.objects.size());
    std::iota(objects_.begin(), objects_.end(), 0);
    shade(services, objects_, true);
    masked_ = std::ranges::any_of(services.scene.materials, [](const scene::Material& material) {
      return material.alphaMode == scene::AlphaMode::Mask;
    });
    for (std::size_t i = 0; i < services.geometry.objects.size(); ++i)
      extents_.push_back(
          trace::reflectorExtent(services.scene, services.geometry, static_cast<int>(i)));
  }

  void render(const FrameInput& input, Services& services, FrameOutput& output) override {
    TraceCounts counts;
    output.counters["refraction_mirrored"] = 0;
    if (reflectors_.any()) {
      follow(input, services);
      counts = trace(input, services);
      showImages(images_, input.frame.camera, services.gbuffer->sampleWidth(),
                 services.gbuffer->sampleHeight(), layers_, output.sampleLayers);
      output.counters["refraction_mirrored"] = refractive_.count(*services.gbuffer);
    }
    output.counters["rays"] = counts.rays;
    output.counters["misses"] = counts.misses;
    output.counters["below_horizon"] = counts.belowHorizon;
    output.counters["visits"] = counts.visits.nodes;
    output.counters["quads_tested"] = counts.visits.quads;
    output.counters["stopped"] = counts.visits.stopped;
    output.counters["lifted"] = counts.visits.lifted;
    output.counters["self_hits"] = counts.visits.selfHits;
    output.counters["sides_shaded"] = counts.sidesShaded;
    report(output);
  }

 private:
  std::string sizesText(const Sizes& sizes) const {
    const auto thousands = [](double n) { return std::to_string(std::llround(n / 1000.0)); };
    return "about " + thousands(sizes.quads) + " thousand quads and " + thousands(sizes.texels) +
           " thousand texels, " +
           (options_.size > 0 ? "by size" : "by triangles and by pixels in reflectors") +
           (sizes.reduced == 0  ? ""
            : options_.size > 0 ? ", fewer than asked for"
                                : ", fewer than wanted, by memory_mib");
  }

  void report(FrameOutput& output) const {
    output.counters["charts"] = images_.counts().charts;
    output.counters["quads"] = images_.counts().quads;
    output.counters["plain_triangles"] = images_.counts().plainTriangles;
    output.counters["degenerate_triangles"] = images_.counts().degenerateTriangles;
    output.counters["not_flattened"] = images_.counts().notFlattened;
    output.counters["mean_stretch_percent"] = images_.counts().meanStretchPercent;
    output.counters["most_stretch_percent"] = images_.counts().mostStretchPercent;
    output.counters["reduced_objects"] = images_.counts().reducedObjects;
    output.counters["not_finite"] = radiance_.notFinite();
  }

  /// What is cut by alpha masks is shaded at once: rays look at its texels on their way.
  void shade(Services& services, std::span<const int> objects, bool atOnce) {
    const Shading shading{&services.scene, &services.geometry, &lighting_, &images_};
    services.timer.measure("radiance", [&] {
      if (!environment_ || lighting_.environment != services.lighting.environment)
        environment_ = std::make_unique<trace::EnvironmentLevels>(services.lighting.environment);
      lighting_ = services.lighting;
      if (atOnce || masked_)
        radiance_.shade(shading, objects);
      else
        radiance_.shadeLater(shading, objects);
    });
  }

  void follow(const FrameInput& input, Services& services) {
    const std::vector<int>& changed = input.changedObjects;
    for (const int i : changed)
      extents_[static_cast<std::size_t>(i)] =
          trace::reflectorExtent(services.scene, services.geometry, i);
    const bool moved =
        std::any_of(changed.begin(), changed.end(), [&](int i) { return images_.reflects(i); });
    if (moved)
      services.timer.measure("geometry_images",
                             [&] { images_.follow(services.geometry, changed); });
    if (!(lighting_ == services.lighting)) {
      shade(services, objects_, false);
    } else if (moved) {
      shade(services, changed, false);
    }
  }

  TraceCounts trace(const FrameInput& input, Services& services) {
    raster::GBuffer& gbuffer = *services.gbuffer;
    const scene::Camera& camera = input.frame.camera;
    const SampleTiles tiles({gbuffer.sampleWidth(), gbuffer.sampleHeight()}, camera, services.scene,
                            extents_, own_);
    const SceneTexels texels{images_, radiance_};
    const Shading shading{&services.scene, &services.geometry, &services.lighting, &images_};
    Traced scene{
        images_.view(), images_,         radiance_,
        *environment_,  shading,         scene::pixelSpreadRad(camera, gbuffer.sampleHeight()),
        extents_,       fresnelSchlick_, options_};
    if (masked_) scene.tree.alphaTest = {isCutAway, &texels};
    TraceCounts counts;
    std::mutex mutex;
    const double seconds = bands_.run(
        {gbuffer, tiles, services.timer, services.scene, own_, masks_},
        [&](const raster::GBufferCopy& samples, const SampleTiles::Members& members, Vec3* radiance,
            std::uint8_t* flags) {
          TraceCounts mine;
          const std::int64_t start = nowNs();
          TileTracer& tracer = TileTracer::ofThread();
          tiles.place(samples, members, tracer.points());
          tracer.run(scene, radiance, flags, mine);
          mine.resolveSeconds = secondsSince(start) - mine.traceSeconds - mine.shadeSeconds;
          const std::scoped_lock lock(mutex);
          counts.add(mine);
        });
    // Both are sums over threads
    const double sum =
        std::max(counts.traceSeconds + counts.shadeSeconds + counts.resolveSeconds, 1e-12);
    services.timer.add("trace", seconds * counts.traceSeconds / sum);
    if (counts.sidesShaded > 0) services.timer.add("radiance", seconds * counts.shadeSeconds / sum);
    services.timer.add("resolve", seconds * counts.resolveSeconds / sum);
    return counts;
  }

  Options options_;
  bool masks_ = false;
  bool fresnelSchlick_ = false;
  std::vector<std::string> layers_;
  Reflectors reflectors_;
  raster::RefractiveSamples refractive_;
  SceneImages images_;
  Radiance radiance_;
  frame::Lighting lighting_;  ///< that the radiance is of
  frame::ObjectSet own_;
  std::vector<int> objects_;  ///< all of the scene
  std::vector<float> extents_;
  bool masked_ = false;  ///< some surfaces are cut by alpha masks
  std::unique_ptr<trace::EnvironmentLevels> environment_;
  Bands bands_;
};

}  // namespace

const MethodEntry& glossyLodEntry() {
  static const MethodEntry entry{
      .id = "glossy_lod",
      .summary =
          "traces rays in geometry images, at a level of detail that fits each ray's solid angle",
      .paper = "[Yu2008] glossy_lod",
      .steps = {{"geometry_images", "start, frames",
                 "geometry images and their tree are built; updated after motion"},
                {"radiance", "start, frames",
                 "their diffuse radiance is computed; again after lights or objects have changed"},
                {"readback", "frames", "the G-buffer is read back"},
                {"trace", "frames", "rays are traced"},
                {"resolve", "frames", "rays are generated; radiance at the hits is filtered"},
                {"upload", "frames", "reflections are uploaded"}},
      .counters =
          {{"rays", "traced rays"},
           {"misses", "rays that left the scene"},
           {"below_horizon",
            "rays that would enter the surface: the normal was corrected, or the lobe's ray was "
            "mirrored back"},
           {"visits", "visited nodes of the tree"},
           {"quads_tested", "tested quads (two triangles each)"},
           {"stopped", "of these, quads of coarser levels"},
           {"lifted",
            "points whose rays start on the image of their own object, because it lies above them"},
           {"self_hits",
            "hits that a ray passed because only the image of its own object is there, not the "
            "object"},
           {"sides_shaded", "sides of charts whose radiance was computed in this frame"},
           {"charts", "charts of all reflected objects"},
           {"quads", "quads of the charts' finest level"},
           {"plain_triangles", "triangles in no chart, which are traced directly"},
           {"degenerate_triangles", "triangles without area, which are left out"},
           {"not_flattened", "charts that could not be flattened and were cut"},
           {"mean_stretch_percent",
            "stretch of the charts' maps onto squares, in percent (100: no distortion); mean over "
            "the meshes"},
           {"most_stretch_percent", "the largest stretch of a chart, in percent"},
           {"reduced_objects",
            "objects whose images were made coarser, because all together exceeded `memory_mib` "
            "(with `size`: 6 million quads)"},
           {"not_finite", "radiances that were NaN or infinite, replaced by 0", true},
           {"refraction_mirrored", "samples of refractive materials, which are mirrored instead"}},
      .sampleLayers = imageLayers(),
      .tests = {.small = R"({"size": 32, "rays": 4})"},
      .options = optionTable().schema(),
      .make = [](const config::Value& options) -> std::unique_ptr<Method> {
        return std::make_unique<GlossyLod>(optionTable().parse(options));
      }};
  return entry;
}

}  // namespace catoptric::methods
