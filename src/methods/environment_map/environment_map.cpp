#include "methods/environment_map/environment_map.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>

#include "config/options.h"
#include "gl/query.h"
#include "gl/shader.h"
#include "methods/environment_map/cube_map.h"
#include "methods/shared/cube_map.h"
#include "methods/shared/reflectors.h"
#include "methods/shared/shared_options.h"
#include "raster/passes/refractive_samples.h"

namespace catoptric::methods {
namespace {

constexpr auto kSources = config::names<bool>({{"scene", false}, {"environment", true}});

enum class Proxy : std::uint8_t { None, Box, Sphere };
constexpr auto kProxies =
    config::names<Proxy>({{"none", Proxy::None}, {"box", Proxy::Box}, {"sphere", Proxy::Sphere}});

struct Options {
  bool environmentOnly = false;
  Proxy proxy = Proxy::None;
  std::optional<Vec3> centre;  ///< absent: the middle of the scene's bounds
  int faceSize = 512;
};

void readCentre(Options& options, const config::Value& center) {
  if (center.kind() != config::Value::Kind::String) {
    options.centre = center.asVec3();
  } else if (center.asString() != "scene") {
    center.fail("\"" + center.asString() + "\": allowed are \"scene\" and [x, y, z] in metres");
  }
}

const config::OptionTable<Options>& optionTable() {
  using config::field;
  static const config::OptionTable<Options> table(
      "environment_map", "Reflections looked up in a cube map by direction",
      {field(&Options::environmentOnly, "source", kSources,
             "contents of the cube map: the diffuse scene, or the environment alone"),
       {{.name = "center",
         .type = config::FieldType::Any,
         .help = "viewpoint of the cube map: \"scene\" (the centre of its bounds) or [x, y, z] in "
                 "metres",
         .defaultText = "\"scene\""},
        readCentre},
       field(&Options::proxy, "proxy", kProxies,
             "how far away the scene is that the cube map shows. none: infinitely; box: on the box "
             "of the scene's bounds; sphere: on a sphere about the viewpoint, whose "
             "diameter is the box's longest edge")
           .trade("none,box"),
       field(&Options::faceSize, "face_size", config::range(1, 4096), kFaceSizeHelp)
           .trade("256,512,1024")});
  return table;
}

class EnvironmentMap : public Method {
 public:
  explicit EnvironmentMap(const Options& options) : options_(options) {
    // The environment is infinitely far away
    if (options_.environmentOnly) options_.proxy = Proxy::None;
  }

  MethodPlan plan(const scene::Scene& scene, const RunSettings& settings) const override {
    MethodPlan plan;
    plan.gbuffer = true;
    plan.masks = raster::kMaskEnvironment | raster::kMaskBelowHorizon;
    const Reflectors reflectors = findReflectors(scene, settings.reflectors);
    if (!reflectors.any()) return plan;
    const std::string what =
        options_.environmentOnly ? "the environment" : "the diffuse scene from one point";
    const bool again = !options_.environmentOnly && scene.animated();
    plan.items.push_back({again ? "pass" : "precomputation", "cube_map",
                          "cube map of " + what +
                              (again ? ", drawn again in frames in which an object or a light moved"
                                     : ", drawn once: it does not change")});
    const int size = options_.environmentOnly
                         ? environmentFaceSize(scene.environment, options_.faceSize)
                         : options_.faceSize;
    plan.items.push_back({"resource", "cube map",
                          "6 faces of " + std::to_string(size) + " x " + std::to_string(size) +
                              (options_.environmentOnly ? ", RGBA32F" : ", RGBA16F") +
                              ", with mip levels",
                          cubeMapBytes(size, options_.environmentOnly ? 16 : 8)});
    std::string kinds = reflectors.mirrors() ? "mirrors (level 0)" : "";
    if (reflectors.glossy) {
      kinds += std::string(kinds.empty() ? "" : ", ") + "glossy objects (level by the lobe)";
    }
    plan.items.push_back({"pass", "resolve", "one look-up per reflective sample: " + kinds});
    return plan;
  }

  void prepare(Services& services, const RunSettings& settings) override {
    masks_ = settings.masks;
    clearsMasks_ = settings.masks && settings.reflectors.all();
    reflectors_ = findReflectors(services.scene, settings.reflectors);
    refractive_ = raster::RefractiveSamples(services.scene);
    const auto program = [&](const char* label, const char* glossy) {
      std::vector<gl::Define> defines = raster::SceneRaster::shadingDefines(services.lighting);
      defines.insert(defines.end(), {{"GLOSSY", glossy},
                                     {"MASKS", masks_ ? "1" : "0"},
                                     {"PROXY", std::to_string(static_cast<int>(options_.proxy))},
                                     {"GGX", services.scene.hasGgxLobes() ? "1" : "0"}});
      return gl::Program::fullScreen(label, "methods/environment_map/shaders/lookup.frag",
                                     std::move(defines));
    };
    if (reflectors_.mirrors()) mirror_ = program("environment look-up", "0");
    if (reflectors_.glossy) glossy_ = program("environment look-up, glossy", "1");
    bentCount_ = gl::Buffer("samples with a bent normal", sizeof(std::uint32_t));
    if (reflectors_.mirrors()) mirrorCount_ = gl::FragmentCounter("mirror samples");
    if (reflectors_.glossy) glossyCount_ = gl::FragmentCounter("glossy samples");

    // What does not change is drawn before the first frame.
    if (!services.scene.animated()) drawEnvironment({}, services);
  }

  void render(const FrameInput& input, Services& services, FrameOutput& output) override {
    raster::GBuffer& gbuffer = *services.gbuffer;
    if (clearsMasks_) gbuffer.reflectionFramebuffer.clearColorUint(1, 0);
    output.counters["environment"] = 0;
    output.counters["below_horizon"] = 0;
    output.counters["refraction_mirrored"] = 0;
    output.counters["clamped_cube_map"] = cubeMap_.clampedTexels();
    if (!reflectors_.any()) return;

    drawEnvironment(input, services);
    std::uint64_t mirrored = 0;
    services.timer.measure("resolve", [&] {
      lookUp(gbuffer, services, input.frame.camera);
      mirrored = refractive_.count(gbuffer);
    });
    std::uint64_t samples = 0;
    if (reflectors_.mirrors()) samples += mirrorCount_.read();
    if (reflectors_.glossy) samples += glossyCount_.read();
    output.counters["environment"] = samples;
    std::uint32_t bent = 0;
    bentCount_.read(0, sizeof bent, &bent);
    output.counters["below_horizon"] = bent;
    output.counters["refraction_mirrored"] = mirrored;
    output.counters["clamped_cube_map"] = cubeMap_.clampedTexels();
  }

 private:
  void drawEnvironment(const FrameInput& input, Services& services) {
    if (!reflectors_.any()) return;
    if (!options_.environmentOnly) {
      cubeMap_.follow(input, services, centreOf(services), options_.faceSize);
    } else if (cubeMap_.empty()) {
      services.timer.measure("cube_map", [&] {
        const frame::EnvironmentLight& environment = *services.lighting.environment;
        cubeMap_.take(makeEnvironmentCubeMap(
            environment, environmentFaceSize(environment.description(), options_.faceSize)));
      });
    }
  }

  Vec3 centreOf(const Services& services) const {
    return options_.centre ? Vec3(glm::dvec3(*options_.centre) - services.scene.origin)
                           : services.geometry.bounds.centre();
  }

  void placeProxy(gl::Program& program, const Services& services,
                  const scene::Camera& camera) const {
    services.raster->bindShadingResources(program.id(), services.lighting);
    const Vec3 eye = camera.eye();
    const Vec3 centre = centreOf(services);
    const Box3& box = services.geometry.bounds;
    const Vec3 size = box.max - box.min;
    program.set("nearMetres", camera.nearMetres);
    program.set("centre", centre - eye);
    program.set("least", box.min - eye);
    program.set("most", box.max - eye);
    program.set("radius", 0.5f * std::max({1e-6f, size.x, size.y, size.z}));
  }

  // One full-screen pass per kind of reflector, on its stencil class alone.
  void lookUp(const raster::GBuffer& gbuffer, const Services& services,
              const scene::Camera& camera) {
    gbuffer.reflectionFramebuffer.bind();
    gbuffer.normal.bind(0);
    cubeMap_.bind(1);
    constexpr std::uint32_t kNone = 0;
    bentCount_.write(0, sizeof kNone, &kNone);
    bentCount_.bindStorage(0);
    const Mat3 ray = scene::rayFromPixel(camera, gbuffer.sampleWidth(), gbuffer.sampleHeight());
    if (options_.proxy != Proxy::None) gbuffer.depth.bind(2);
    if (reflectors_.mirrors()) {
      if (options_.proxy != Proxy::None) placeProxy(mirror_, services, camera);
      pass(mirror_, mirrorCount_, ray, raster::onMirrors());
    }
    if (reflectors_.glossy) {
      if (options_.proxy != Proxy::None) placeProxy(glossy_, services, camera);
      cubeMap_.setLevels(glossy_);
      pass(glossy_, glossyCount_, ray, raster::onSamplesOf(raster::SampleClass::Glossy));
    }
  }

  static void pass(gl::Program& program, const gl::FragmentCounter& counter, const Mat3& ray,
                   const gl::DrawState& state) {
    const gl::DrawScope scope(state);
    program.use();
    program.set("rayFromSample", ray);
    counter.begin();
    gl::drawFullScreenTriangle();
    counter.end();
  }

  Options options_;
  bool masks_ = false;
  bool clearsMasks_ = false;  ///< the whole frame is its own
  Reflectors reflectors_;
  raster::RefractiveSamples refractive_;
  CubeMap cubeMap_;
  gl::Program mirror_;
  gl::Program glossy_;
  gl::FragmentCounter mirrorCount_;
  gl::FragmentCounter glossyCount_;
  gl::Buffer bentCount_;  ///< one number
};

std::unique_ptr<Method> make(const config::Value& options) {
  return std::make_unique<EnvironmentMap>(optionTable().parse(options));
}

}  // namespace

const MethodEntry& environmentMapEntry() {
  static const MethodEntry entry{
      .id = "environment_map",
      .summary =
          "looks the reflected direction up in a cube map, by default as if all were infinitely "
          "far "
          "away",
      .paper = "",
      .steps = {{"cube_map", "start, frames",
                 "the cube map is drawn; again after something has moved"},
                {"resolve", "frames", "the look-up per sample"}},
      .counters = {{"environment", "reflective samples, which all use the cube map"},
                   {"below_horizon",
                    "of these, samples whose normal was corrected, so that the mirrored ray leaves "
                    "the surface"},
                   {"refraction_mirrored",
                    "samples of refractive materials, which are mirrored instead"},
                   {"clamped_cube_map", "texels of the cube map above the range of half floats",
                    true}},
      .tests = {.small = R"({"face_size": 64})",
                .variants = {R"({"proxy": "box"})", R"({"proxy": "sphere"})"}},
      .options = optionTable().schema(),
      .make = make,
      .fallbackOptions = R"({"face_size": 256})"};  // as small as the methods' own fallbacks; ours
  return entry;
}

}  // namespace catoptric::methods
