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

/// What a run asks of every method.
struct RunSettings {
  int width = 512;
  int height = 512;
  int samples = 2;  ///< per axis and pixel
  std::uint64_t seed = 1;
  /// The reflective objects that the method fills; of others its plan and render() know nothing:
  /// another method of the frame fills them. Where these are not all, masks are clear when render()
  /// is called, what lies beside its own samples is left alone, and in the stencil others' samples
  /// are of no class (methods/shared/share.h).
  frame::ObjectSet reflectors = {};
  bool masks = false;  ///< fill fallback masks
  /// Compare what is shown with Embree's rays: fill mask and counter `disoccluded`, where the
  /// method can.
  bool countDisocclusions = false;
  bool fresnelSchlick = false;
  std::vector<std::string> layers;  ///< asked-for layers: "Z", "N", "reflection", "diffuse", "id",
                                    ///< "s", and names of MethodEntry::sampleLayers
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
  /// Reflections and refractions that a path may have: its option `bounces`; 0: it has none.
  int bounces = 0;
  bool previousFrame = false;  ///< FrameInput::previous is wanted
  /// Bits of raster::MaskBit that it fills: the others give no layer. Of what it does not measure
  /// nothing is known.
  std::uint16_t masks = 0;
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

/// The path's frame before the one at hand.
struct PreviousFrame {
  scene::PathFrame frame;
  /// Where each object was: as ObjectRange::worldFromObject, at that frame's time.
  std::vector<Mat4> worldFromObject;
};

/// One frame, as the sequence hands it to a method.
struct FrameInput {
  scene::PathFrame frame;
  std::vector<int> changedObjects;  ///< indices whose geometry differs from the last rendered frame
  /// Nothing that was kept of earlier frames may be used: the frame before was not rendered just
  /// now.
  bool firstOfSequence = true;
  /// A restart frame (Method::restartsAt): its pixels must not depend on earlier frames. Always
  /// true of methods without state; true wherever firstOfSequence is.
  bool restarts = true;
  /// False while warming up: the frame is thrown away, and only what later frames need must be
  /// computed.
  bool kept = true;
  /// Where MethodPlan::previousFrame asks for it; none: the path's first frame.
  std::optional<PreviousFrame> previous;
  /// Samples of the G-buffer that may differ from the last frame's, whose camera and lights were
  /// the same; none: all.
  std::optional<raster::Region> changedSamples;
};

/// A number per sample of the frame, row 0 on top; 0: none. Layer id.NAME of the frame's file. Or a
/// vector: layer NAME.X, NAME.Y, NAME.Z.
struct SampleLayer {
  std::string name;
  std::vector<std::uint32_t> numbers;
  std::vector<Vec3> vectors = {};
};

struct FrameOutput {
  Counters counters;
  /// Samples of gbuffer->reflection that may differ from the last frame's; none: all.
  std::optional<raster::Region> changedReflection;
  std::vector<Table> tables;              ///< those of MethodEntry::tables that have rows
  std::vector<SampleLayer> sampleLayers;  ///< those of MethodEntry::sampleLayers that are asked for
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

  /// Fills gbuffer->reflection (and masks) for every reflective sample, or output.image. The
  /// reflection is radiance that arrives: the composite weighs it by the sample's s and tint, each
  /// read from the G-buffer (tints of a scene may differ from sample to sample: GBuffer::tint). A
  /// method weighs only what one reflector shows of another, by the tint of that place:
  /// frame::SurfacePoint::tint, or TINT_OUTPUT of surface.glsl.
  virtual void render(const FrameInput& input, Services& services, FrameOutput& output) = 0;

  /// Whether frame `number` of the path is a restart frame: its pixels do not depend on frames
  /// before it. By the path alone, never by what was asked for, so that chunks, resumed runs and
  /// lists of frames give the same pixels: whoever starts between two restart frames renders all
  /// frames of the path from the one before. Frame 1 always is one. Methods without state: all are.
  virtual bool restartsAt(const scene::CameraPath& /*path*/, int /*number*/) const { return true; }
};

/// What a step's time goes to.
enum class StepKind {
  Rendering,  ///< the frame
  Extras,     ///< layers beside its colour, as they were asked for
  Rest,       ///< what no step names
  Waiting,    ///< for the writers: no part of rendering
  Check,      ///< a measurement that was asked for: no part of rendering
};
/// "rendering", "extras", "rest", "waiting", "check".
const char* stepKindName(StepKind kind);

/// A row of the timing table that a method adds.
struct StepInfo {
  std::string name;
  std::string when;     ///< "start", "frames", "start, frames"
  std::string meaning;  ///< one line
  StepKind kind = StepKind::Rendering;
};

/// A count of each frame.
struct CounterInfo {
  std::string name;
  std::string meaning;      ///< one line
  bool mustBeZero = false;  ///< anything else means that something is wrong or extreme
  /// The option without which, or the scenes but for which, it is not there; empty: always there.
  std::string onlyWith = {};
};

/// 0 for each counter that is always there.
Counters zeros(const std::vector<CounterInfo>& counters);

/// A layer of the frame's file, by sample, that a method can fill.
struct SampleLayerInfo {
  std::string name;
  std::string meaning;
};

/// What the tests that run every method must know of one: JSON objects of its options.
struct TestOptions {
  std::string small = "{}";       ///< fit for frames of 64 pixels
  std::string refracting = "{}";  ///< besides, for scenes with bodies that refract
  /// Besides, one at a time: settings by which frames are made in another way.
  std::vector<std::string> variants = {};
  /// Percent of a plane mirror's samples that may differ from the mirrored camera's image;
  /// negative: the method does not claim to show it.
  double planeMirrorPercent = -1.0;
  /// Percent of samples that may be other than white in a white furnace.
  double furnacePercent = 0.0;
};

/// Another name of a method in run configs: it with one option set.
struct MethodAlias {
  std::string id;
  std::string option;
  std::string value;  ///< JSON
};

/// A method as the program lists it. Pages and tests of every method are made from it.
struct MethodEntry {
  std::string id;
  std::string summary;  ///< one line
  std::string paper;    ///< "[Wang2014] second_order"; empty for the common ones
  std::vector<StepInfo> steps;
  std::vector<CounterInfo> counters = {};
  std::vector<TableInfo> tables = {};
  std::vector<SampleLayerInfo> sampleLayers = {};
  TestOptions tests = {};
  const config::Schema& options;  ///< schema of its options in a run config
  std::unique_ptr<Method> (*make)(const config::Value& options);
  /// Method::unsupported() may name reflectors: its configs have the option `unsupported`.
  bool refusesReflectors = false;
  /// Options by which it fills reflectors that `unsupported` gives it; null: it is no such method.
  const char* fallbackOptions = nullptr;
  std::vector<MethodAlias> aliases = {};
};

/// The method of configs that name none.
inline constexpr const char* kDefaultMethod = "traced";

/// All methods, in the order of `catoptric list`.
const std::vector<MethodEntry>& registry();
/// By its id or an alias; null: there is none.
const MethodEntry* findMethod(const std::vector<MethodEntry>& registry, const std::string& name);

}  // namespace catoptric::methods
