#include "methods/planar/planar.h"

#include <algorithm>
#include <functional>
#include <memory>
#include <numeric>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "config/options.h"
#include "gl/query.h"
#include "gl/shader.h"
#include "methods/planar/flat_mirrors.h"
#include "methods/shared/cube_map.h"
#include "methods/shared/shared_options.h"
#include "methods/shared/traced_samples.h"
#include "raster/passes/background.h"
#include "raster/passes/surfaces.h"
#include "raster/regions/screen.h"

namespace catoptric::methods {
namespace {

using namespace planar;
using raster::Rectangle;

constexpr GLuint kCutBlock = 2;  // mirrored.vert

enum class Fallback : std::uint8_t { EnvironmentMap, Traced };
constexpr auto kFallbacks = config::names<Fallback>(
    {{"environment_map", Fallback::EnvironmentMap}, {"traced", Fallback::Traced}});
constexpr int kFaceSize = 256;  // as in the fallbacks of other methods

struct Options {
  int bounces = 1;
  int maxMirrors = 0;
  Fallback fallback = Fallback::EnvironmentMap;
};

const config::OptionTable<Options>& optionTable() {
  using config::field, config::range;
  static const config::OptionTable<Options> table(
      "planar", "Options of the method planar.",
      {field(&Options::bounces, "bounces", range(1, 16), kBouncesHelp),
       field(&Options::maxMirrors, "max_mirrors", range(0, 65536),
             "planes of mirrors that a frame draws, those with most samples first; 0: all"),
       field(&Options::fallback, "fallback", kFallbacks, "how the others are rendered")});
  return table;
}

/// Where the drawings of one reflection after another are.
struct Level {
  gl::Texture color;    ///< RGBA32F; empty for the first, which is GBuffer::reflection
  gl::Texture depth;    ///< 1 outside of the mirrors' samples: nothing is drawn there
  gl::Texture weights;  ///< RGBA32F: of mirrors in this view; see weights.frag
  gl::Framebuffer target;
  gl::Framebuffer weighing;
};

class Planar : public Method {
 public:
  explicit Planar(const Options& options) : options_(options) {}

  std::vector<Unsupported> unsupported(const scene::Scene& scene) const override {
    std::vector<Unsupported> result;
    for (std::size_t i = 0; i < scene.objects.size(); ++i) {
      const scene::Object& object = scene.objects[i];
      if (object.reflector == 0 || isFlatMirror(scene, object)) continue;
      const bool refracts = scene.materials[object.material].refraction > 0.0f;
      result.push_back(
          {static_cast<int>(i) + 1, refracts ? "refracts" : "reflects, but is no flat mirror"});
    }
    return result;
  }

  MethodPlan plan(const scene::Scene& scene, const RunSettings& settings) const override {
    MethodPlan plan;
    plan.gbuffer = true;
    plan.bounces = options_.bounces;
    const std::size_t mirrors = countMirrors(scene);
    const std::size_t own = countMirrors(scene, settings.reflectors);
    if (own == 0) return plan;
    if (leavesOut(own)) planFallback(scene, settings, plan);
    const std::uint64_t samples = settings.sampleCount();
    const int nested = mirrors > 1 ? options_.bounces - 1 : 0;
    plan.add({{"pass", "mirrors",
               "the scene is drawn as " +
                   (leavesOut(own) ? "up to " + std::to_string(options_.maxMirrors) + " planes of "
                                   : std::string()) +
                   std::to_string(own) + " flat mirrors in view show it"},
              {"resource", "mirrored depth", "DEPTH32F by sample", 4 * samples}});
    if (nested > 0)
      plan.items.push_back({"resource", "mirrors in mirrors",
                            "depth, radiance and weights by sample, of " + std::to_string(nested) +
                                (nested == 1 ? " further reflection" : " further reflections"),
                            static_cast<std::uint64_t>(nested) * (4 + 16 + 16) * samples,
                            "bounces"});
    return plan;
  }

  void prepare(Services& services, const RunSettings& settings) override {
    settings_ = settings;
    std::vector<std::uint32_t> none(services.scene.objects.size() + 1, 0);
    planes_ = gl::Buffer("planes of mirrors", std::span<const std::uint32_t>(none));
    planeOf_ = gl::Texture::makeBuffer("planes of mirrors", GL_R32UI, planes_);
    cut_ = gl::Buffer("the plane that cuts", sizeof(Vec4));
    find(services);
    // Of mirrors that are hidden, or in one plane, any may come apart later
    const std::size_t flat = countMirrors(services.scene);
    if (flat == 0) return;
    const std::size_t levels = flat > 1 ? static_cast<std::size_t>(options_.bounces) : 1;
    const int width = services.gbuffer->sampleWidth();
    const int height = services.gbuffer->sampleHeight();
    for (std::size_t l = 0; l < levels; ++l) {
      Level& level = levels_.emplace_back();
      level.depth = gl::Texture::make2D("mirrored depth", GL_DEPTH_COMPONENT32F, width, height);
      if (l > 0) level.color = gl::Texture::make2D("mirrored", GL_RGBA32F, width, height);
      level.target = gl::Framebuffer(
          "mirrored", {{.texture = l > 0 ? level.color : services.gbuffer->reflection}},
          {.texture = level.depth});
      if (l + 1 == levels) continue;
      level.weights = gl::Texture::make2D("weights of mirrors", GL_RGBA32F, width, height);
      level.weighing = gl::Framebuffer("weights of mirrors", {{.texture = level.weights}},
                                       {.texture = level.depth});
    }
    const char* region = "methods/planar/shaders/region.frag";
    region_ = gl::Program::fullScreen("samples of mirrors", region, {{"NESTED", "0"}});
    if (levels > 1) {
      nestedRegion_ = gl::Program::fullScreen("mirrors in a mirror", region, {{"NESTED", "1"}});
      combine_ = gl::Program::fullScreen("reflections of reflections",
                                         "methods/planar/shaders/combine.frag");
    }
    weighing_.defines = {{"FRESNEL", settings.fresnelSchlick ? "1" : "0"},
                         {"GGX", services.scene.hasGgxLobes() ? "1" : "0"}};
    shown_ = gl::FragmentCounter("samples of mirrors");
    if (leavesOut(countMirrors(services.scene, settings.reflectors)))
      prepareFallback(*services.gbuffer);
  }

  void render(const FrameInput& input, Services& services, FrameOutput& output) override {
    raster::GBuffer& gbuffer = *services.gbuffer;
    if (settings_.masks && settings_.reflectors.all())
      gbuffer.reflectionFramebuffer.clearColorUint(1, 0);
    counts_ = {};
    leftOut_.clear();
    if (!levels_.empty()) {
      services.timer.measure("mirrors", [&] {
        if (services.scene.animated()) find(services);
        draw(input.frame.camera, services);
      });
    }
    const bool looksUp = !leftOutShader_.empty() && options_.fallback == Fallback::EnvironmentMap;
    if (looksUp)
      cubeMap_.follow(input, services, services.geometry.bounds.centre(), kFaceSize,
                      !leftOut_.empty());
    if (!leftOut_.empty()) fillLeftOut(input.frame.camera, services);
    output.counters["mirrors"] = counts_.mirrors;
    output.counters["mirrored_views"] = counts_.views;
    output.counters["mirrored_samples"] = counts_.samples;
    output.counters["mirrors_left_out"] = counts_.leftOut;
    output.counters["environment"] = looksUp ? counts_.leftOutSamples : 0;
    output.counters["retraced"] = looksUp ? 0 : counts_.leftOutSamples;
    if (looksUp)
      output.counters["clamped_cube_map"] = leftOut_.empty() ? 0 : cubeMap_.clampedTexels();
  }

 private:
  struct Counts {
    std::uint64_t mirrors = 0;
    std::uint64_t views = 0;
    std::uint64_t samples = 0;
    std::uint64_t leftOut = 0;  ///< mirrors
    std::uint64_t leftOutSamples = 0;
  };
  /// A plane of mirrors that the frame shows beyond max_mirrors.
  struct LeftOut {
    std::size_t mirror = 0;
    Rectangle part;
  };

  /// Number of flat mirrors among these objects.
  static std::size_t countMirrors(const scene::Scene& scene, const frame::ObjectSet& among = {}) {
    std::size_t count = 0;
    for (std::size_t i = 0; i < scene.objects.size(); ++i)
      if (isFlatMirror(scene, scene.objects[i]) && among.contains(static_cast<int>(i))) ++count;
    return count;
  }

  /// Whether there are more of the method's own mirrors than may be drawn.
  bool leavesOut(std::size_t own) const {
    return options_.maxMirrors > 0 && own > static_cast<std::size_t>(options_.maxMirrors);
  }

  void planFallback(const scene::Scene& scene, const RunSettings& settings,
                    MethodPlan& plan) const {
    if (options_.fallback == Fallback::EnvironmentMap) {
      plan.masks |= raster::kMaskEnvironment;
      plan.add(cubeMapItems(kFaceSize, scene.animated()));
      return;
    }
    plan.masks |= raster::kMaskRetraced;
    plan.trace = true;
    plan.add(tracedItems(settings, "samples of mirrors beyond max_mirrors"));
  }

  void prepareFallback(const raster::GBuffer& gbuffer) {
    const bool traced = options_.fallback == Fallback::Traced;
    leftOutShader_ = gl::Program::fullScreen(
        "mirrors left out", "methods/planar/shaders/left_out.frag",
        {{"TRACED", traced ? "1" : "0"}, {"MASKS", settings_.masks ? "1" : "0"}});
    if (!traced) return;
    toTrace_ = gl::Texture::make2D("mirrors left out", GL_R8UI, gbuffer.sampleWidth(),
                                   gbuffer.sampleHeight());
    marks_ = gl::Framebuffer("mirrors left out", {{.texture = toTrace_}});
    tracing_.bounces = options_.bounces;
    tracing_.fresnelSchlick = settings_.fresnelSchlick;
  }

  /// Fills the samples of mirrors beyond max_mirrors.
  void fillLeftOut(const scene::Camera& camera, Services& services) {
    const raster::GBuffer& gbuffer = *services.gbuffer;
    const bool traced = options_.fallback == Fallback::Traced;
    services.timer.measure("mirrors", [&] {
      const gl::Framebuffer& target = traced ? marks_ : gbuffer.reflectionFramebuffer;
      if (traced) target.clearColorUint(0, 0);
      target.bind();
      gbuffer.object.bind(0);
      planeOf_.bind(1);
      leftOutShader_.use();
      if (!traced) {
        gbuffer.normal.bind(2);
        cubeMap_.bind(3);
        leftOutShader_.set("rayFromSample", scene::rayFromPixel(camera, width_, height_));
      }
      for (const LeftOut& one : leftOut_) {
        leftOutShader_.set("plane", static_cast<std::uint32_t>(one.mirror) + 1);
        const gl::DrawScope scope(raster::within(one.part));
        gl::drawFullScreenTriangle();
      }
    });
    if (traced)
      traceSamples({*services.trace, tracing_, settings_.reflectors, settings_.masks,
                    raster::kMaskRetraced, &toTrace_},
                   camera, services, bands_);
  }

  Rectangle shownBy(const View& view, const Box3& box) const {
    return raster::Screen(view.clipFromWorld, nearMetres_, width_, height_).shows(box);
  }

  void find(Services& services) {
    mirrors_ = findFlatMirrors(services.scene, services.geometry);
    std::vector<std::uint32_t> planes(services.scene.objects.size() + 1, 0);
    for (std::size_t m = 0; m < mirrors_.size(); ++m)
      for (const int id : mirrors_[m].ids)
        if (settings_.reflectors.contains(id - 1))
          planes[static_cast<std::size_t>(id)] = static_cast<std::uint32_t>(m) + 1;
    planes_.write(0, planes.size() * sizeof planes[0], planes.data());
  }

  void draw(const scene::Camera& camera, Services& services) {
    const raster::GBuffer& gbuffer = *services.gbuffer;
    width_ = gbuffer.sampleWidth();
    height_ = gbuffer.sampleHeight();
    nearMetres_ = camera.nearMetres;
    spreadRad_ = scene::pixelSpreadRad(camera, height_);
    const View view{glm::dmat4(scene::clipFromCamera(
                        camera, static_cast<float>(width_) / static_cast<float>(height_))) *
                        glm::dmat4(scene::cameraFromWorld(camera)),
                    glm::dvec3(camera.eye())};
    isDrawn_.assign(mirrors_.size(), true);
    if (!leftOutShader_.empty()) choose(view, gbuffer);
    for (std::size_t m = 0; m < mirrors_.size(); ++m) {
      if (!isDrawn_[m]) continue;
      const Rectangle part = shownBy(view, mirrors_[m].bounds);
      const std::uint64_t samples = openMirrors(m, part, gbuffer);
      if (samples == 0) continue;
      counts_.samples += samples;
      counts_.mirrors += mirrors_[m].ids.size();
      drawView(mirrored(view, mirrors_[m].plane), m, 0, part, services);
    }
  }

  /// Keeps max_mirrors planes of mirrors: those that cover the most samples, the first of equals.
  void choose(const View& view, const raster::GBuffer& gbuffer) {
    std::vector<Rectangle> parts;
    std::vector<std::uint64_t> samples;
    for (std::size_t m = 0; m < mirrors_.size(); ++m) {
      parts.push_back(shownBy(view, mirrors_[m].bounds));
      samples.push_back(openMirrors(m, parts[m], gbuffer));
    }
    std::vector<std::size_t> order(mirrors_.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::ranges::stable_sort(order, std::ranges::greater(),
                             [&](std::size_t m) { return samples[m]; });
    for (std::size_t k = static_cast<std::size_t>(options_.maxMirrors); k < order.size(); ++k) {
      const std::size_t m = order[k];
      isDrawn_[m] = false;
      if (samples[m] == 0) continue;
      leftOut_.push_back({m, parts[m]});
      counts_.leftOut += mirrors_[m].ids.size();
      counts_.leftOutSamples += samples[m];
    }
  }

  /// Opens the samples of a plane's mirrors that the frame itself shows. Returns their number.
  std::uint64_t openMirrors(std::size_t mirror, const Rectangle& part,
                            const raster::GBuffer& gbuffer) {
    if (part.empty()) return 0;
    region_.use();
    gbuffer.object.bind(0);
    planeOf_.bind(1);
    region_.set("plane", static_cast<std::uint32_t>(mirror) + 1);
    return open(0, part);
  }

  /// Opens the samples that the current program passes for drawing at a level, and no others.
  /// Returns their number.
  std::uint64_t open(std::size_t level, const Rectangle& part) {
    gl::DrawState state = raster::within(part);
    gl::DrawScope scope(state);
    levels_[level].target.bind();
    levels_[level].target.clearDepth(1.0f);
    state.depth = {.test = true, .function = GL_ALWAYS, .write = true};
    state.colors = 0;
    scope.change(state);
    shown_.begin();
    gl::drawFullScreenTriangle();
    shown_.end();
    return shown_.read();
  }

  /// Draws what the mirrors of a plane show into the open samples of a level.
  void drawView(const View& view, std::size_t mirror, std::size_t l, const Rectangle& part,
                Services& services) {
    ++counts_.views;
    Level& level = levels_[l];
    level.target.bind();
    std::vector<int> hidden = mirrors_[mirror].ids;
    for (std::size_t i = 0; i < services.geometry.objects.size(); ++i)
      if (isCut(view, services.geometry.objects[i].bounds))
        hidden.push_back(static_cast<int>(i) + 1);
    gl::DrawState state = raster::within(part);
    state.depth.test = true;
    drawSurfaces(view, part, diffuse_, state, raster::ObjectSet::without(std::move(hidden)),
                 services);
    state.clipDistances = 0;
    background_.draw(services.raster->scene().frame(), services.lighting, {}, state);
    if (l + 1 == levels_.size()) return;
    for (std::size_t m = 0; m < mirrors_.size(); ++m) {
      if (m == mirror || !isDrawn_[m] || isCut(view, mirrors_[m].bounds)) continue;
      const Rectangle shown = raster::intersection(part, shownBy(view, mirrors_[m].bounds));
      if (!shown.empty()) drawMirror(view, part, m, l, shown, services);
    }
  }

  /// Draws what mirrors show that are seen in `part` of the view of a level, whose drawing has the
  /// viewport `viewed`.
  void drawMirror(const View& view, const Rectangle& viewed, std::size_t mirror, std::size_t l,
                  const Rectangle& part, Services& services) {
    Level& level = levels_[l];
    gl::DrawState state = raster::within(part);
    {
      const gl::DrawScope scope(state);
      level.weighing.clearColor(0, 0.0f, 0.0f, 0.0f, 0.0f);
    }
    level.weighing.bind();
    state.depth = {.test = true, .function = GL_EQUAL, .write = false};
    drawSurfaces(view, viewed, weighing_, state, raster::ObjectSet::only(mirrors_[mirror].ids),
                 services);
    nestedRegion_.use();
    level.weights.bind(0);
    if (open(l + 1, part) == 0) return;
    drawView(mirrored(view, mirrors_[mirror].plane), mirror, l + 1, part, services);

    level.target.bind();
    gl::DrawState blended = raster::within(part);
    blended.blend = {.on = true,
                     .sourceColor = GL_ONE,
                     .targetColor = GL_SRC_ALPHA,
                     .sourceAlpha = GL_ZERO,
                     .targetAlpha = GL_ONE};
    blended.depth = {.test = false, .function = GL_ALWAYS, .write = false};
    const gl::DrawScope scope(blended);
    combine_.use();
    level.weights.bind(0);
    levels_[l + 1].color.bind(1);
    gl::drawFullScreenTriangle();
  }

  void drawSurfaces(const View& view, const Rectangle& viewed,
                    const raster::SurfaceShaders& shaders, gl::DrawState state,
                    const raster::ObjectSet& objects, Services& services) {
    glViewport(viewed.x0, viewed.y0, viewed.width(), viewed.height());
    const Vec4 viewport(viewed.x0, viewed.y0, viewed.width(), viewed.height());
    const Vec4 plane(view.clip);
    cut_.write(0, sizeof plane, &plane);
    cut_.bindUniform(kCutBlock);
    state.clipDistances = 1;
    raster::drawSurfaces(services.raster->scene(),
                         raster::makeView(clipOfPart(view, viewed, width_, height_), Vec3(view.eye),
                                          spreadRad_, viewport, raster::kNoRadianceLimit),
                         services.lighting, {.shaders = shaders, .state = state},
                         {.objects = objects}, list_);
  }

  Options options_;
  RunSettings settings_;
  std::vector<FlatMirrors> mirrors_;
  std::vector<bool> isDrawn_;     ///< by plane: whether max_mirrors lets this frame draw it
  std::vector<LeftOut> leftOut_;  ///< by this frame
  gl::Program leftOutShader_;     ///< empty: all mirrors are drawn
  gl::Texture toTrace_;           ///< R8UI: samples of mirrors left out
  gl::Framebuffer marks_;
  CubeMap cubeMap_;
  trace::ReflectionOptions tracing_;
  Bands bands_;
  std::vector<Level> levels_;  ///< one for each bounce
  gl::Buffer planes_;          ///< by object id: the index of the own mirror's plane + 1, or 0
  gl::Texture planeOf_;
  gl::Buffer cut_;
  gl::Program region_;
  gl::Program nestedRegion_;
  gl::Program combine_;
  gl::FragmentCounter shown_;
  raster::SurfaceShaders diffuse_{.label = "mirrored",
                                  .vertex = "methods/planar/shaders/mirrored.vert",
                                  .fragment = "raster/shaders/diffuse.frag",
                                  .defines = {{"BEHIND", "0"}, {"FACTORS", "0"}}};
  raster::SurfaceShaders weighing_{
      .label = "weights of mirrors",
      .vertex = "methods/planar/shaders/mirrored.vert",
      .fragment = "methods/planar/shaders/weights.frag",
      .outputs = raster::kNormalOutput | raster::kSpecularOutput | raster::kTintOutput};
  raster::Background background_{"raster/shaders/background.frag"};
  raster::DrawList list_;
  int width_ = 0;  ///< of the frame, in samples
  int height_ = 0;
  float nearMetres_ = 0.0f;
  float spreadRad_ = 0.0f;
  Counts counts_;
};

}  // namespace

const MethodEntry& planarEntry() {
  static const MethodEntry entry{
      .id = "planar",
      .summary = "draws the scene once more for each flat mirror, from the mirrored eye",
      .paper = "",
      .steps = {{"mirrors", "frames", "the scene is drawn as flat mirrors show it"},
                {"cube_map", "frames",
                 "with `max_mirrors`: the cube map is drawn; again after something has moved"},
                {"readback", "frames", "samples to be traced are read back"},
                {"trace", "frames", "rays of these samples are traced"},
                {"resolve", "frames", "rays are generated; hits are shaded"},
                {"upload", "frames", "traced reflections are uploaded"}},
      .counters = {{"mirrors", "flat mirrors in planes that the frame shows"},
                   {"mirrored_views",
                    "drawings of the scene: one per plane of mirrors, and per mirror in a mirror"},
                   {"mirrored_samples", "samples of flat mirrors that are drawn"},
                   {"mirrors_left_out", "flat mirrors in view beyond `max_mirrors`"},
                   {"environment", "their samples that use the cube map"},
                   {.name = "retraced", .meaning = "samples that were traced", .handedOn = true},
                   {"clamped_cube_map", "texels of the cube map above the range of half floats",
                    true, "max_mirrors"}},
      .tests = {.variants = {R"({"bounces": 2})", R"({"max_mirrors": 1, "bounces": 2})",
                             R"({"max_mirrors": 1, "fallback": "traced"})"},
                .planeMirrorPercent = 0.1},
      .options = optionTable().schema(),
      .make = [](const config::Value& options) -> std::unique_ptr<Method> {
        return std::make_unique<Planar>(optionTable().parse(options));
      },
      .refusesReflectors = true};
  return entry;
}

}  // namespace catoptric::methods
