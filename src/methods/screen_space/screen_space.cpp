#include "methods/screen_space/screen_space.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numeric>
#include <string>
#include <vector>

#include "config/options.h"
#include "gl/query.h"
#include "gl/shader.h"
#include "methods/screen_space/disocclusions.h"
#include "methods/screen_space/second_layer.h"
#include "methods/shared/cube_map.h"
#include "methods/shared/reflectors.h"
#include "methods/shared/shared_options.h"
#include "methods/shared/traced_samples.h"
#include "raster/passes/refractive_samples.h"

namespace catoptric::methods {
namespace {

namespace screen_space_shared {
#include "methods/screen_space/shaders/constants.glsl"
}  // namespace screen_space_shared
namespace shared = screen_space_shared;

enum class Trace : std::uint8_t { HiZ, Dda };
enum class Glossy : std::uint8_t { Rays, Cone };
/// Method: another one, whose samples are left.
enum class Fallback : std::uint8_t { EnvironmentMap, Traced, Black, Method };
constexpr auto kTraces = config::names<Trace>({{"hi_z", Trace::HiZ}, {"dda", Trace::Dda}});
constexpr auto kGlossy = config::names<Glossy>({{"rays", Glossy::Rays}, {"cone", Glossy::Cone}});
constexpr auto kFallbacks = config::names<Fallback>({{"environment_map", Fallback::EnvironmentMap},
                                                     {"traced", Fallback::Traced},
                                                     {"black", Fallback::Black}});

struct Options {
  Trace trace = Trace::HiZ;
  float thickness = 0.1f;
  int stride = 1;
  int maxSteps = 0;
  int layers = 1;
  float separation = 0.5f;
  int rays = 8;
  Glossy glossy = Glossy::Rays;
  Fallback fallback = Fallback::EnvironmentMap;
  int faceSize = 256;
};

const config::OptionTable<Options>& optionTable() {
  using config::atLeast, config::field, config::range;
  static const config::OptionTable<Options> table(
      "screen_space", "Options of the method screen_space.",
      {field(&Options::trace, "trace", kTraces,
             "hi_z: rays skip cells of up to 64 x 64 samples; dda: they visit each sample"),
       field(&Options::thickness, "thickness", atLeast(0.0),
             "metres behind a surface within which a ray hits it")
           .trade("0.02,0.1,0.5"),
       field(&Options::stride, "stride", range(1, 64), "samples that a step of dda takes"),
       field(&Options::maxSteps, "max_steps", range(0, 65536),
             "most steps of a ray; 0: width plus height in samples")
           .trade("64,256,0"),
       field(&Options::layers, "layers", range(1, 2),
             "2: rays also hit the nearest surface `separation` behind what the frame shows"),
       field(&Options::separation, "separation", atLeast(0.0), "least metres between layers"),
       field(&Options::rays, "rays", range(1, 256), kRaysHelp).trade("2,4,8,16,32"),
       field(&Options::glossy, "glossy", kGlossy, "a lobe's rays, or one ray as wide")
           .trade("rays,cone"),
       field(&Options::fallback, "fallback", kFallbacks,
             "what shades rays without a hit: the cube map or black. traced, or another method (a "
             "name or an object), shades the whole sample again"),
       field(&Options::faceSize, "face_size", range(1, 4096), kFaceSizeHelp)});
  return table;
}

/// Refuses options that the others leave without effect.
void refuseIdle(const Options& options, const config::Value& given) {
  const Options defaults;
  if (options.trace == Trace::HiZ && options.stride != defaults.stride)
    given.get("stride").fail(
        R"(has no effect with "trace": "hi_z"; remove it or set "trace": "dda")");
  if (options.layers == 1 && options.separation != defaults.separation)
    given.get("separation").fail(R"(has no effect with "layers": 1; remove it or set "layers": 2)");
}

/// Counters of shaders/constants.glsl's counts, from kSky on.
constexpr std::array<const char*, 8> kEnds = {"sky",           "offscreen",     "behind",
                                              "backface",      "toward_camera", "steps",
                                              "below_horizon", "view_colour"};
static_assert(shared::kSky == 1 && shared::kBelow == 7 && shared::kViewColour == 8 &&
              shared::kSecondHit == kEnds.size() + 1);

constexpr int kCell = 1 << shared::kLastLevel;

int padded(int samples) {
  return (samples + kCell - 1) / kCell * kCell;
}

/// Of a mip chain with texels of this size.
std::uint64_t pyramidBytes(int width, int height, std::uint64_t texel) {
  return texel * static_cast<std::uint64_t>(padded(width)) *
         static_cast<std::uint64_t>(padded(height)) * 4 / 3;
}

class ScreenSpace : public Method {
 public:
  explicit ScreenSpace(const Options& options) : options_(options) {}

  MethodPlan plan(const scene::Scene& scene, const RunSettings& settings) const override {
    MethodPlan plan;
    const Fallback fallback = fallbackOf(settings);
    plan.gbuffer = true;
    plan.masks = raster::kMaskSky | raster::kMaskOffscreen | raster::kMaskBehind |
                 raster::kMaskBackface | raster::kMaskTowardCamera | raster::kMaskSteps |
                 raster::kMaskBelowHorizon | raster::kMaskViewColour;
    if (fallback == Fallback::EnvironmentMap) plan.masks |= raster::kMaskEnvironment;
    if (fallback == Fallback::Traced) plan.masks |= raster::kMaskRetraced;
    if (settings.countDisocclusions) plan.masks |= raster::kMaskDisoccluded;
    const Reflectors reflectors = findReflectors(scene, settings.reflectors);
    if (!reflectors.any()) return plan;
    const int width = settings.width * settings.samples;
    const int height = settings.height * settings.samples;
    const std::uint64_t samples = settings.sampleCount();
    if (twoLayers())
      plan.items = {{"pass", "second_layer", "asked for: layers: 2"},
                    {"resource", "second layer", "radiance, surface and depth by sample",
                     screen_space::SecondLayer::kBytesPerSample * samples, "layers"}};
    plan.add({{"pass", "pyramid", "nearest and farthest depths of cells of samples"},
              {"pass", "march",
               std::to_string(reflectors.count()) +
                   " reflective objects: rays are followed over the frame's depths"},
              {"resource", "pyramid",
               std::string(twoLayers() ? "RGBA32F" : "RG32F") + " by sample, with 6 coarser levels",
               pyramidBytes(width, height, twoLayers() ? 16 : 8)}});
    if (cones(reflectors)) plan.items.push_back({"pass", "colours", "asked for: glossy: cone"});
    if (cones(reflectors))
      plan.items.push_back({"resource", "colours",
                            "RGBA32F by sample and layer, with 6 coarser levels: what cones see",
                            pyramidBytes(width, height, 16) * layers()});
    if (fallback == Fallback::EnvironmentMap)
      plan.add(cubeMapItems(options_.faceSize, scene.animated()));
    if (fallback == Fallback::Method)
      plan.items.push_back({"resource", "left",
                            "R32UI by sample: samples of the method of fallback",
                            4 * settings.sampleCount()});
    if (fallback == Fallback::Traced) {
      plan.trace = true;
      plan.add(tracedItems(settings, "samples with a ray that found nothing"));
    }
    if (settings.countDisocclusions) {
      plan.trace = true;
      plan.items.push_back({"pass", "disocclusions", "asked for: count_disocclusions"});
      const std::uint64_t rays = raysOfLobes(reflectors);
      plan.items.push_back({"resource", "ends of rays",
                            "R32UI by ray, and what is read back to be compared with Embree's",
                            samples * (rays * (4 + 4) + 16 + 4 + 4 + (twoLayers() ? 16 : 0)),
                            "rays"});
    }
    return plan;
  }

  void prepare(Services& services, const RunSettings& settings) override {
    settings_ = settings;
    options_.fallback = fallbackOf(settings);
    reflectors_ = findReflectors(services.scene, settings.reflectors);
    if (!reflectors_.any()) return;
    refractive_ = raster::RefractiveSamples(services.scene);
    raster::GBuffer& gbuffer = *services.gbuffer;
    const int width = gbuffer.sampleWidth();
    const int height = gbuffer.sampleHeight();
    if (twoLayers()) second_ = screen_space::SecondLayer(width, height);
    pyramid_ = gl::Texture::make2D("nearest depths", twoLayers() ? GL_RGBA32F : GL_RG32F,
                                   padded(width), padded(height), shared::kLastLevel + 1);
    pyramid_.setFilter(GL_NEAREST_MIPMAP_NEAREST, GL_NEAREST);
    for (int l = 0; l <= shared::kLastLevel; l += shared::kLevelStep)
      levels_.emplace_back("nearest depths", std::initializer_list<gl::Attachment>{
                                                 {.texture = pyramid_, .level = l}});
    if (cones(reflectors_)) prepareColours(width, height);
    const char* nearest = "methods/screen_space/shaders/pyramid.frag";
    const std::string layerCount = std::to_string(layers());
    first_ = gl::Program::fullScreen("nearest depths, first", nearest,
                                     {{"FIRST", "1"}, {"LAYERS", layerCount}});
    coarser_ = gl::Program::fullScreen("nearest depths", nearest,
                                       {{"FIRST", "0"}, {"LAYERS", layerCount}});
    lobeHorizons_ = !gbuffer.lobeHorizon.empty();
    if (reflectors_.mirrors()) mirrors_ = program(services, 0);
    if (reflectors_.glossy) glossy_ = program(services, options_.rays);
    std::vector<gl::Attachment> targets{{.texture = gbuffer.reflection}};
    if (settings.masks) targets.push_back({.texture = gbuffer.masks});
    if (marksMisses()) {
      missed_ = gl::Texture::make2D("rays that found nothing",
                                    settings.leavesSamples ? GL_R32UI : GL_R8UI, width, height);
      targets.push_back({.texture = missed_});
    }
    target_ = gl::Framebuffer("screen space", targets, {.texture = gbuffer.depth});
    if (settings.leavesSamples)
      left_ = gl::Framebuffer("left samples", {{.texture = missed_}}, {.texture = gbuffer.depth});
    if (settings.countDisocclusions) {
      ends_ = gl::Texture::makeArray("ends of rays", GL_R32UI, width, height,
                                     static_cast<int>(raysOfLobes(reflectors_)));
      endsTarget_ = gl::Framebuffer("ends of rays", {{.texture = ends_}});
    }
    counts_ = gl::Buffer("ends of rays", shared::kCounts * sizeof(std::uint32_t));
    if (options_.fallback == Fallback::EnvironmentMap && !services.scene.animated())
      followCubeMap({}, services);
    tracing_.rays = options_.rays;
    tracing_.bounces = 1;
    tracing_.fresnelSchlick = settings.fresnelSchlick;
    for (auto* counter : {&mirrorSamples_, &glossySamples_})
      *counter = gl::FragmentCounter("reflective samples");
  }

  void render(const FrameInput& input, Services& services, FrameOutput& output) override {
    raster::GBuffer& gbuffer = *services.gbuffer;
    if (settings_.masks && settings_.reflectors.all())
      gbuffer.reflectionFramebuffer.clearColorUint(1, 0);
    std::array<std::uint32_t, shared::kCounts> counts{};
    std::uint64_t samples = 0;
    std::uint64_t missed = 0;
    std::uint64_t refractive = 0;
    if (reflectors_.any()) {
      if (options_.fallback == Fallback::EnvironmentMap) followCubeMap(input, services);
      const float nearMetres = input.frame.camera.nearMetres;
      if (twoLayers())
        services.timer.measure("second_layer",
                               [&] { second_.draw(services, nearMetres, options_.separation); });
      services.timer.measure("pyramid", [&] { drawPyramid(gbuffer, nearMetres); });
      if (cones(reflectors_)) services.timer.measure("colours", [&] { drawColours(gbuffer); });
      services.timer.measure("march", [&] {
        march(services, input.frame.camera);
        refractive = refractive_.count(gbuffer, settings_.leavesSamples ? &left_ : nullptr);
        samples = (reflectors_.mirrors() ? mirrorSamples_.read() : 0) +
                  (reflectors_.glossy ? glossySamples_.read() : 0);
        counts_.read(0, sizeof counts, counts.data());
      });
      const bool any = std::accumulate(counts.begin() + shared::kOffscreen,
                                       counts.begin() + shared::kBelow, std::uint64_t{0}) > 0;
      if (options_.fallback == Fallback::Traced && any)
        missed = traceSamples({*services.trace, tracing_, settings_.reflectors, settings_.masks,
                               raster::kMaskRetraced, &missed_},
                              input.frame.camera, services, bands_)
                     .samples;
      if (options_.fallback == Fallback::Method) output.left = &missed_;
    }
    if (settings_.countDisocclusions) {
      screen_space::Disocclusions counted;
      if (reflectors_.any())
        services.timer.measure("disocclusions",
                               [&] { counted = countDisocclusions(services, input.frame.camera); });
      output.counters["disoccluded"] = counted.disoccluded;
      output.counters["missed_hit"] = counted.missedHits;
      output.counters["wrong_hit"] = counted.wrongHits;
    }
    output.counters["samples"] = samples;
    output.counters["cones"] = cones(reflectors_) ? glossySamples_.read() : 0;
    output.counters["retraced"] = missed;
    output.counters["refraction_mirrored"] = settings_.leavesSamples ? 0 : refractive;
    if (options_.fallback == Fallback::EnvironmentMap)
      output.counters["clamped_cube_map"] = cubeMap_.clampedTexels();
    output.counters["hits"] = counts[shared::kHit];
    if (twoLayers()) output.counters["second_layer_hits"] = counts[shared::kSecondHit];
    for (std::size_t i = 0; i < kEnds.size(); ++i) output.counters[kEnds[i]] = counts[i + 1];
  }

 private:
  void followCubeMap(const FrameInput& input, Services& services) {
    cubeMap_.follow(input, services, services.geometry.bounds.centre(), options_.faceSize);
  }

  Fallback fallbackOf(const RunSettings& settings) const {
    return settings.leavesSamples ? Fallback::Method : options_.fallback;
  }
  bool marksMisses() const {
    return options_.fallback == Fallback::Traced || options_.fallback == Fallback::Method;
  }
  bool cones(const Reflectors& reflectors) const {
    return options_.glossy == Glossy::Cone && reflectors.glossy;
  }
  /// The most rays that a sample has.
  std::uint64_t raysOfLobes(const Reflectors& reflectors) const {
    return reflectors.glossy && !cones(reflectors) ? static_cast<std::uint64_t>(options_.rays) : 1;
  }
  bool twoLayers() const { return options_.layers == 2; }
  std::uint64_t layers() const { return static_cast<std::uint64_t>(options_.layers); }

  void prepareColours(int width, int height) {
    for (std::uint64_t l = 0; l < layers(); ++l) {
      Colours& made = colours_.emplace_back();
      made.texture = gl::Texture::make2D("colours of cones", GL_RGBA32F, padded(width),
                                         padded(height), shared::kLastLevel + 1);
      made.texture.setFilter(GL_LINEAR_MIPMAP_LINEAR, GL_LINEAR);
      made.target = gl::Framebuffer("colours of cones", {{.texture = made.texture}});
    }
    drawColours_ = gl::Program::fullScreen("colours of cones",
                                           "methods/screen_space/shaders/colours.frag", {});
  }

  gl::Program program(const Services& services, int rays) const {
    std::vector<gl::Define> defines = raster::SceneRaster::shadingDefines(services.lighting);
    const int fallback = options_.fallback == Fallback::EnvironmentMap ? 1
                         : options_.fallback == Fallback::Traced       ? 2
                         : options_.fallback == Fallback::Method       ? 3
                                                                       : 0;
    defines.insert(defines.end(), {{"HI_Z", options_.trace == Trace::HiZ ? "1" : "0"},
                                   {"LAYERS", std::to_string(layers())},
                                   {"LOBES", std::to_string(rays)},
                                   {"CONE", rays > 0 && cones(reflectors_) ? "1" : "0"},
                                   {"FOUND", settings_.countDisocclusions ? "1" : "0"},
                                   {"LOBE_HORIZONS", lobeHorizons_ ? "1" : "0"},
                                   {"MASKS", settings_.masks ? "1" : "0"},
                                   {"FALLBACK", std::to_string(fallback)},
                                   {"GGX", services.scene.hasGgxLobes() ? "1" : "0"}});
    return gl::Program::fullScreen(rays > 0 ? "screen space, glossy" : "screen space",
                                   "methods/screen_space/shaders/reflect.frag", std::move(defines));
  }

  void drawPyramid(const raster::GBuffer& gbuffer, float nearMetres) {
    const gl::DrawScope scope{gl::DrawState()};
    for (std::size_t l = 0; l < levels_.size(); ++l) {
      levels_[l].bind();
      gl::Program& used = l == 0 ? first_ : coarser_;
      used.use();
      if (l == 0) {
        gbuffer.depth.bind(0);
        if (twoLayers()) second_.depth().bind(1);
        first_.set("size", glm::ivec2(gbuffer.sampleWidth(), gbuffer.sampleHeight()));
        first_.set("nearMetres", nearMetres);
        first_.set("thickness", options_.thickness);
      } else {
        pyramid_.bindImage(0, GL_READ_ONLY, shared::kLevelStep * static_cast<int>(l - 1));
      }
      gl::drawFullScreenTriangle();
      glMemoryBarrier(GL_FRAMEBUFFER_BARRIER_BIT | GL_SHADER_IMAGE_ACCESS_BARRIER_BIT);
    }
  }

  void drawColours(const raster::GBuffer& gbuffer) {
    const gl::DrawScope scope{gl::DrawState()};
    for (std::size_t l = 0; l < colours_.size(); ++l) {
      colours_[l].target.bind();
      drawColours_.use();
      (l == 0 ? gbuffer.diffuse : second_.colour()).bind(0);
      drawColours_.set("size", glm::ivec2(gbuffer.sampleWidth(), gbuffer.sampleHeight()));
      gl::drawFullScreenTriangle();
      colours_[l].texture.generateMipmaps();
    }
  }

  screen_space::Disocclusions countDisocclusions(Services& services,
                                                 const scene::Camera& camera) const {
    raster::GBuffer& gbuffer = *services.gbuffer;
    raster::GBufferCopy copy;
    raster::readBack(gbuffer, false, copy);
    glMemoryBarrier(GL_TEXTURE_UPDATE_BARRIER_BIT);
    screen_space::FollowedRays followed{
        .ends = raster::readIds(ends_), .rays = options_.rays, .cone = cones(reflectors_)};
    if (twoLayers()) {
      const auto surfaces =
          second_.surface().read<std::uint32_t>(0, GL_RG_INTEGER, GL_UNSIGNED_INT, 2);
      for (std::size_t i = 0; i < surfaces.size(); i += 2)
        followed.secondObject.push_back(surfaces[i]);
      followed.secondDepth = raster::readDepth(second_.depth());
    }
    std::vector<std::uint16_t> masks;
    if (settings_.masks) masks = raster::readMasks(gbuffer.masks);
    const screen_space::Disocclusions counted =
        screen_space::findDisocclusions(copy, camera, followed, *services.trace, masks);
    if (settings_.masks) raster::writeMasks(gbuffer.masks, masks);
    return counted;
  }

  // One full-screen pass per kind of reflector, on its stencil class alone.
  void march(Services& services, const scene::Camera& camera) {
    if (marksMisses()) target_.clearColorUint(settings_.masks ? 2 : 1, 0);
    if (settings_.countDisocclusions) endsTarget_.clearColorUint(0, 0);
    const std::array<std::uint32_t, shared::kCounts> zeros{};
    counts_.write(0, sizeof zeros, zeros.data());
    counts_.bindStorage(0);
    if (reflectors_.mirrors())
      pass(mirrors_, mirrorSamples_, services, camera, raster::onMirrors());
    if (reflectors_.glossy)
      pass(glossy_, glossySamples_, services, camera,
           raster::onSamplesOf(raster::SampleClass::Glossy));
  }

  void pass(gl::Program& program, const gl::FragmentCounter& counter, Services& services,
            const scene::Camera& camera, const gl::DrawState& state) {
    const raster::GBuffer& gbuffer = *services.gbuffer;
    const Vec2 size(gbuffer.sampleWidth(), gbuffer.sampleHeight());
    target_.bind();
    const gl::DrawScope scope(state);
    program.use();
    services.raster->bindShadingResources(program.id(), services.lighting);
    pyramid_.bind(0);
    gbuffer.normal.bindImage(1, GL_READ_ONLY);
    gbuffer.diffuse.bindImage(2, GL_READ_ONLY);
    if (lobeHorizons_) gbuffer.lobeHorizon.bindImage(3, GL_READ_ONLY);
    gbuffer.object.bindImage(4, GL_READ_ONLY);
    if (settings_.countDisocclusions) ends_.bindImage(5, GL_WRITE_ONLY);
    if (options_.fallback == Fallback::EnvironmentMap) {
      cubeMap_.bind(1);
      cubeMap_.setLevels(program);
    }
    if (twoLayers()) {
      second_.colour().bindImage(6, GL_READ_ONLY);
      second_.surface().bindImage(7, GL_READ_ONLY);
    }
    for (std::size_t l = 0; l < colours_.size(); ++l)
      colours_[l].texture.bind(static_cast<GLuint>(2 + l));
    const float focal = 0.5f * size.y / std::tan(0.5f * camera.verticalFovRad);
    const Mat3 worldFromCamera(camera.worldFromCamera);
    program.set("size", size);
    program.set("focal", Vec2(focal));
    program.set("nearMetres", camera.nearMetres);
    program.set("eyeFromWorld",
                glm::transpose(Mat3(worldFromCamera[0], -worldFromCamera[1], -worldFromCamera[2])));
    program.set("thickness", options_.thickness);
    program.set("maxSteps", options_.maxSteps > 0 ? options_.maxSteps
                                                  : gbuffer.sampleWidth() + gbuffer.sampleHeight());
    program.set("stride", static_cast<float>(options_.stride));
    program.set("rayFromSample",
                scene::rayFromPixel(camera, gbuffer.sampleWidth(), gbuffer.sampleHeight()));
    counter.begin();
    gl::drawFullScreenTriangle();
    counter.end();
  }

  Options options_;
  RunSettings settings_;
  Reflectors reflectors_;
  raster::RefractiveSamples refractive_;
  bool lobeHorizons_ = false;
  CubeMap cubeMap_;
  screen_space::SecondLayer second_;  ///< empty with one layer
  gl::Texture pyramid_;               ///< reversed depths
  std::vector<gl::Framebuffer> levels_;
  /// For cones: diffuse radiance of a layer, and the share of a texel that is known.
  struct Colours {
    gl::Texture texture;
    gl::Framebuffer target;
  };
  std::vector<Colours> colours_;
  gl::Program drawColours_;
  gl::Program first_;
  gl::Program coarser_;
  gl::Program mirrors_;
  gl::Program glossy_;
  /// Whether a ray of the sample found nothing: R8UI; for a method of `fallback` R32UI, the object.
  gl::Texture missed_;
  gl::Texture ends_;  ///< R32UI: with count_disocclusions, how rays ended
  gl::Framebuffer endsTarget_;
  gl::Framebuffer target_;
  gl::Framebuffer left_;  ///< `missed_` alone
  gl::Buffer counts_;
  gl::FragmentCounter mirrorSamples_;
  gl::FragmentCounter glossySamples_;
  trace::ReflectionOptions tracing_;
  Bands bands_;
};

}  // namespace

const MethodEntry& screenSpaceEntry() {
  static const MethodEntry entry{
      .id = "screen_space",
      .summary = "follows reflected rays over the depths of the frame itself",
      .paper = "",
      .steps = {{"cube_map", "start, frames",
                 "the cube map is drawn; again after something has moved"},
                {"second_layer", "frames",
                 "with layers 2: the surfaces behind those that the frame shows are drawn"},
                {"pyramid", "frames", "nearest and farthest depths of cells of samples"},
                {"colours", "frames", "with cones: means of what the frame shows"},
                {"march", "frames", "rays are followed over the frame's depths"},
                {"readback", "frames", "samples to be traced are read back"},
                {"trace", "frames", "rays of these samples are traced"},
                {"resolve", "frames", "rays are generated; hits are shaded"},
                {"upload", "frames", "traced reflections are uploaded"},
                {"disocclusions", "frames",
                 "with image.count_disocclusions: Embree checks the rays", StepKind::Check}},
      .counters = {{"samples", "reflective samples"},
                   {"cones", "glossy samples with a cone in place of their rays"},
                   {"hits", "rays that hit a surface which the frame shows"},
                   {"sky", "rays that leave the scene over the background"},
                   {"offscreen", "rays that leave the frame"},
                   {"behind", "rays that passed behind a surface which the frame shows"},
                   {"backface", "rays that met the back of a surface which the frame shows"},
                   {"toward_camera", "rays that pass the eye"},
                   {"steps", "rays that took all of their steps"},
                   {"view_colour",
                    "of `hits`: on surfaces that reflect, whose diffuse radiance is taken"},
                   {"second_layer_hits", "of `hits`: on the second layer", false, "layers 2"},
                   {"below_horizon",
                    "samples whose normal was corrected, or with a ray that would enter the "
                    "surface"},
                   {.name = "retraced", .meaning = "samples that were traced", .handedOn = true},
                   {"disoccluded", "rays that found nothing although a surface is there", false,
                    "image.count_disocclusions"},
                   {"missed_hit", "of `disoccluded`: the frame shows that surface", false,
                    "image.count_disocclusions"},
                   {"wrong_hit", "rays with a hit on a wrong surface, or where none is", false,
                    "image.count_disocclusions"},
                   {"refraction_mirrored",
                    "samples of refractive materials, which are mirrored instead"},
                   {"clamped_cube_map", "texels of the cube map above the range of half floats",
                    true, "fallback environment_map"}},
      .tests = {.small = R"({"face_size": 64})",
                .variants = {R"({"trace": "dda"})", R"({"fallback": "traced", "glossy": "cone"})",
                             R"({"fallback": "black", "layers": 2})"}},
      .options = optionTable().schema(),
      .make = [](const config::Value& options) -> std::unique_ptr<Method> {
        const Options read = optionTable().parse(options);
        refuseIdle(read, options);
        return std::make_unique<ScreenSpace>(read);
      },
      .leavesSamples = true};
  return entry;
}

}  // namespace catoptric::methods
