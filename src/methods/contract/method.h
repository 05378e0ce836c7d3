// The contract between a method and the rest. A method lives in a folder of its own (C++, shaders,
// tests, README), never includes another method, and is known to the program by one line in
// registry.cpp. The runner knows only this interface.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "config/json.h"
#include "frame/cluster_row.h"
#include "frame/geometry.h"
#include "frame/shading.h"
#include "frame/steps.h"
#include "image/image.h"
#include "raster/gbuffer.h"
#include "raster/scene_raster.h"
#include "scene/camera.h"
#include "scene/scene.h"
#include "trace/embree/trace_scene.h"

namespace catoptric::methods {

/// What a run asks of every method.
struct RunSettings {
  int width = 512;
  int height = 512;
  int samples = 2;  ///< per axis and pixel
  std::uint64_t seed = 1;
  bool masks = false;  ///< fill fallback masks
  bool fresnelSchlick = false;
  std::vector<std::string> layers;  ///< asked-for layers: "Z", "N", "reflection", "diffuse", "id",
                                    ///< "s", "cluster"
};

/// One line of a plan: something that will be built, compiled, allocated or run, and why.
struct PlanItem {
  std::string kind;  ///< "pass", "resource", "precomputation"
  std::string name;  ///< a step's name for passes
  std::string reason;
  std::uint64_t bytes = 0;  ///< of resources, where known beforehand
};

/// What a method needs from the shared pipeline for this scene and these settings.
struct MethodPlan {
  bool gbuffer = false;  ///< G-buffer, reflection target and composite (needs GL)
  bool gl = false;       ///< a GL context (implied by gbuffer)
  bool trace = false;    ///< an Embree scene
  trace::BvhPolicy bvh = trace::BvhPolicy::Static;
  /// Reflections and refractions that a path may have, and the option that says so; 0: none does.
  int bounces = 0;
  const char* bouncesOption = "";
  std::vector<PlanItem> items;  ///< the method's own passes, resources, precomputations
};

/// A reflector or scene that a method cannot do; the run ends with exit 2 and names it.
struct Unsupported {
  int object = 0;  ///< id; 0: the scene as a whole
  std::string reason;
};

/// Named counts of one frame: rays, fallbacks, clamps, clusters. Keys are snake_case and stable.
using Counters = std::map<std::string, std::uint64_t>;

/// The shared state that a method works with. Pointers are null when the plan did not ask.
struct Services {
  const scene::Scene& scene;
  const frame::Geometry& geometry;  ///< of the current frame's moment
  const frame::Lighting& lighting;
  raster::SceneRaster* raster = nullptr;
  raster::GBuffer* gbuffer = nullptr;  ///< filled before render()
  trace::TraceScene* trace = nullptr;  ///< follows the geometry before render(), as step `bvh`
  frame::StepTimer& timer;
};

/// One frame, as the sequence hands it to a method.
struct FrameInput {
  scene::PathFrame frame;
  std::vector<int> changedObjects;  ///< indices whose geometry differs from the last rendered frame
  bool firstOfSequence = true;      ///< no state of earlier frames may be used
  /// Samples of the G-buffer that may differ from the last frame's, whose camera and lights were
  /// the same; none: all.
  std::optional<raster::Region> changedSamples;
};

struct FrameOutput {
  Counters counters;
  /// Samples of gbuffer->reflection that may differ from the last frame's; none: all.
  std::optional<raster::Region> changedReflection;
  std::vector<frame::ClusterRow> clusters;  ///< of methods that cluster rays
  /// Where the layer "cluster" is asked for: per sample 0 in no cluster, else index in `clusters`
  /// + 1.
  std::vector<std::uint16_t> clusterOf;
  /// A method that renders whole images (MethodPlan::gbuffer false) puts the frame here: R G B A
  /// and the asked-for layers that it has.
  std::optional<image::Image> image;
};

class Method {
 public:
  virtual ~Method() = default;

  /// Scenes and reflectors that this method cannot do; empty when it accepts all.
  virtual std::vector<Unsupported> unsupported(const scene::Scene&) const { return {}; }

  /// What will be built and run for this scene; pure, called before anything is built.
  virtual MethodPlan plan(const scene::Scene& scene, const RunSettings& settings) const = 0;

  /// Precomputation, once, before the first frame; steps timed through services.timer.
  virtual void prepare(Services&, const RunSettings&) {}

  /// Fills gbuffer->reflection (and masks) for every reflective sample, or output.image.
  virtual void render(const FrameInput& input, Services& services, FrameOutput& output) = 0;

  /// Whether a chunk may start at frame `number` and still give the undivided run's pixels: always
  /// for methods without state over frames.
  virtual bool mayStartAt(int /*number*/) const { return true; }
};

/// A method as the program lists it.
struct MethodEntry {
  std::string id;
  std::string summary;  ///< one line
  std::string paper;    ///< "[Wang2014] second_order"; empty for the common ones
  std::vector<std::string> steps;
  const config::Schema& options;  ///< schema of its options in a run config
  std::unique_ptr<Method> (*make)(const config::Value& options);
};

/// All methods, in the order of `catoptric list`.
const std::vector<MethodEntry>& registry();
/// The entry of `id`; throws UsageError with the nearest name.
const MethodEntry& findMethod(const std::string& id);

}  // namespace catoptric::methods
