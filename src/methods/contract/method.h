// The contract between a method and the rest of the program. A method lives in a folder of its own
// (C++, shaders, tests, README) and never includes another method. One line in registry.cpp makes
// it known to the program. The runner knows only this interface.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "config/json.h"
#include "frame/geometry.h"
#include "frame/object_set.h"
#include "frame/shading.h"
#include "frame/steps.h"
#include "image/image.h"
#include "methods/contract/table.h"
#include "raster/gbuffer.h"
#include "raster/scene_raster.h"
#include "scene/camera.h"
#include "scene/scene.h"
#include "trace/embree/trace_scene.h"

namespace catoptric::methods {

/// Settings of a run, the same for every method.
struct RunSettings {
  int width = 512;
  int height = 512;
  int samples = 2;  ///< per axis and pixel
  std::uint64_t seed = 1;
  /// The reflective objects that this method shades. When other methods shade the rest of the
  /// frame, plan() and render() see only these objects. The masks are cleared before render() is
  /// called. render() must not write to samples of other reflectors: the stencil gives them no
  /// class (methods/shared/share.h).
  frame::ObjectSet reflectors = {};
  bool masks = false;  ///< fill the fallback masks
  /// Whether reflections are compared with Embree's rays: the method fills the mask and the counter
  /// `disoccluded`, if it can.
  bool countDisocclusions = false;
  bool fresnelSchlick = false;
  /// Whether another method renders the samples that this one leaves (MethodEntry::leavesSamples).
  bool leavesSamples = false;
  /// The run's camera path; null: none is known.
  const scene::CameraPath* path = nullptr;
  std::vector<std::string> layers;  ///< requested layers: "Z", "N", "reflection", "diffuse", "id",
                                    ///< "s", "motion", and names of MethodEntry::sampleLayers

  /// Number of samples of the frame.
  std::uint64_t sampleCount() const {
    return static_cast<std::uint64_t>(width) * height * samples * samples;
  }
};

/// One line of a plan: something that will be built, compiled, allocated or run, and why.
struct PlanItem {
  std::string kind;  ///< "pass", "resource" or "precomputation"
  std::string name;  ///< for a pass: the name of its step
  std::string reason;
  std::uint64_t bytes = 0;  ///< its memory, if known beforehand
  std::string lower = {};   ///< the options that lower it, as errors name them; empty: none
};

/// What a method needs from the shared pipeline for this scene and these settings.
struct MethodPlan {
  bool gbuffer = false;  ///< needs the G-buffer, reflection target and composite (these need GL)
  bool gl = false;       ///< needs a GL context (implied by gbuffer)
  bool trace = false;    ///< needs an Embree scene
  trace::BvhPolicy bvh = trace::BvhPolicy::Static;
  /// Maximum number of reflections and refractions of a path: the option `bounces`. 0: the method
  /// has no such option.
  int bounces = 0;
  /// The masks (bits of raster::MaskBit) that the method fills. No layer is written for the other
  /// masks: a missing layer means "not measured", not 0.
  std::uint16_t masks = 0;
  std::vector<PlanItem> items;  ///< the method's own passes, resources, precomputations

  void add(const std::vector<PlanItem>& more) {
    items.insert(items.end(), more.begin(), more.end());
  }
};

/// A reflector or scene that a method does not support. The run ends with exit code 2 and names it.
struct Unsupported {
  int object = 0;  ///< id; 0: the scene as a whole
  std::string reason;
};

/// Named counts of one frame: rays, fallbacks, clamps, clusters. Keys are snake_case and stable.
using Counters = std::map<std::string, std::uint64_t>;

/// The shared state that a method works with. Pointers are null unless the plan asked for them.
struct Services {
  const scene::Scene& scene;
  const frame::Geometry& geometry;  ///< at the time of the current frame
  const frame::Lighting& lighting;
  raster::SceneRaster* raster = nullptr;
  raster::GBuffer* gbuffer = nullptr;  ///< filled before render()
  trace::TraceScene* trace = nullptr;  ///< updated to the geometry before render(), in step `bvh`
  frame::StepTimer& timer;
};

/// One frame, as the sequence hands it to a method.
struct FrameInput {
  scene::PathFrame frame;
  std::vector<int>
      changedObjects;  ///< indices of objects whose geometry differs from the last rendered frame
  /// Whether the previous frame of the path was not the last one rendered. The method must then use
  /// nothing that it kept of earlier frames.
  bool firstOfSequence = true;
  /// Whether this is a restart frame (Method::restartsAt): its pixels must not depend on earlier
  /// frames. Always true for methods without state, and whenever firstOfSequence is true.
  bool restarts = true;
  /// False while warming up: the frame is discarded, only later frames need its state.
  bool kept = true;
  /// Samples of the G-buffer that may differ from the last frame. Set only if camera and lights are
  /// unchanged. nullopt: any sample may differ.
  std::optional<raster::Region> changedSamples;
};

/// One integer per sample of the frame, row 0 on top, written as layer id.NAME of the frame's file;
/// 0 means none. Or one vector per sample, written as layers NAME.X, NAME.Y and NAME.Z.
struct SampleLayer {
  std::string name;
  std::vector<std::uint32_t> numbers;
  std::vector<Vec3> vectors = {};
};

struct FrameOutput {
  Counters counters;
  /// Samples of gbuffer->reflection that may differ from the last frame; nullopt: any.
  std::optional<raster::Region> changedReflection;
  /// With RunSettings::leavesSamples: R32UI by sample, the object's id where the sample is left to
  /// the other method, else 0. Its masks say why. Null: there are no reflectors.
  gl::Texture* left = nullptr;
  std::vector<Table> tables;              ///< the tables of MethodEntry::tables that have rows
  std::vector<SampleLayer> sampleLayers;  ///< the requested layers of MethodEntry::sampleLayers
  /// The frame of a method that renders whole images (MethodPlan::gbuffer is false): R G B A, and
  /// the requested layers that the method has.
  std::optional<image::Image> image;
};

class Method {
 public:
  virtual ~Method() = default;

  /// The scenes and reflectors that this method does not support; empty if it supports all.
  virtual std::vector<Unsupported> unsupported(const scene::Scene&) const { return {}; }

  /// What will be built and run for this scene. A pure function, called before anything is built.
  virtual MethodPlan plan(const scene::Scene& scene, const RunSettings& settings) const = 0;

  /// Precomputation: called once, before the first frame. Timed through services.timer.
  virtual void prepare(Services&, const RunSettings&) {}

  /// Fills gbuffer->reflection (and the masks) for every reflective sample, or fills output.image.
  /// The reflection is incident radiance: the composite multiplies it by the sample's s and tint,
  /// which it reads from the G-buffer (GBuffer::tint, which may vary between samples). The method
  /// itself applies a tint only where one reflector is seen in another. That tint is the one of the
  /// reflected point: frame::SurfacePoint::tint, or TINT_OUTPUT of surface.glsl.
  virtual void render(const FrameInput& input, Services& services, FrameOutput& output) = 0;

  /// Whether frame `number` of the path is a restart frame: its pixels do not depend on earlier
  /// frames. The answer must depend on the path alone, never on the frames that were requested, so
  /// that chunks, resumed runs and lists of frames give the same pixels. A run that starts between
  /// two restart frames first renders all frames since the earlier one. Frame 1 is always a restart
  /// frame. For methods without state every frame is.
  virtual bool restartsAt(const scene::CameraPath& /*path*/, int /*number*/) const { return true; }
};

/// What the time of a step counts as.
enum class StepKind {
  Rendering,  ///< part of rendering the frame
  Extras,     ///< requested layers other than colour
  Rest,       ///< time that no step names
  Waiting,    ///< waiting for the writers; not part of rendering
  Check,      ///< a requested measurement; not part of rendering
};
/// Returns "rendering", "extras", "rest", "waiting" or "check".
const char* stepKindName(StepKind kind);

/// A row of the timing table that a method adds.
struct StepInfo {
  std::string name;
  std::string when;     ///< "start", "frames" or "start, frames"
  std::string meaning;  ///< one line
  StepKind kind = StepKind::Rendering;
};

/// A counter that is written for each frame.
struct CounterInfo {
  std::string name;
  std::string meaning;      ///< one line
  bool mustBeZero = false;  ///< any other value means that something is wrong or extreme
  /// The option that must be on, or the kind of scene that is needed, for this counter to exist.
  /// Empty: it always exists.
  std::string onlyWith = {};
  /// Whether it counts samples that rays or another method render in this one's place.
  bool handedOn = false;
};

/// A value of 0 for each counter that always exists.
Counters zeros(const std::vector<CounterInfo>& counters);

/// A layer with one value per sample that a method can add to the frame's file.
struct SampleLayerInfo {
  std::string name;
  std::string meaning;
};

/// Settings of one method for the tests that run every method. Each is a JSON object of options.
struct TestOptions {
  std::string small = "{}";       ///< suitable for frames of 64 pixels
  std::string refracting = "{}";  ///< added for scenes with refractive objects
  /// Options that choose another way of rendering. Each element has a test of its own, which adds
  /// it to `small`.
  std::vector<std::string> variants = {};
  /// Percent of a plane mirror's samples that may differ from the image of the mirrored camera.
  /// Negative: the method does not claim to render plane mirrors.
  double planeMirrorPercent = -1.0;
  /// Percent of samples in a white furnace that may differ from white.
  double furnacePercent = 0.0;
};

/// Another name of a method in run configs: the method with one option set.
struct MethodAlias {
  std::string id;
  std::string option;
  std::string value;  ///< JSON
};

/// A method as the program lists it. The generated pages and the tests of every method use these
/// entries.
struct MethodEntry {
  std::string id;
  std::string summary;  ///< one line
  std::string
      paper;  ///< for example "[Wang2014] second_order"; empty if the method is not from a paper
  std::vector<StepInfo> steps;
  std::vector<CounterInfo> counters = {};
  std::vector<TableInfo> tables = {};
  std::vector<SampleLayerInfo> sampleLayers = {};
  TestOptions tests = {};
  const config::Schema& options;  ///< schema of the method's options in a run config
  std::unique_ptr<Method> (*make)(const config::Value& options);
  /// Whether Method::unsupported() may name reflectors. Adds the option `unsupported`.
  bool refusesReflectors = false;
  /// Whether the method can leave samples where it finds nothing (FrameOutput::left). Its option
  /// `fallback` can then name a method, too.
  bool leavesSamples = false;
  /// The options with which this method shades reflectors that another method's option
  /// `unsupported` gives to it. Null: `unsupported` cannot name this method.
  const char* fallbackOptions = nullptr;
  std::vector<MethodAlias> aliases = {};
};

/// The method of configs that do not name one.
inline constexpr const char* kDefaultMethod = "traced";

/// All methods, in the order of `catoptric list`.
const std::vector<MethodEntry>& registry();
/// Finds a method by its id or an alias; null if there is none.
const MethodEntry* findMethod(const std::vector<MethodEntry>& registry, const std::string& name);

}  // namespace catoptric::methods
