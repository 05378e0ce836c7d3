#include "methods/environment_map/environment_map.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "config/options.h"
#include "gl/query.h"
#include "gl/shader.h"
#include "methods/environment_map/cube_map.h"
#include "methods/environment_map/probes.h"
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
constexpr auto kBlends = config::names<bool>({{"nearest", false}, {"distance", true}});

/// More would exceed the 16 texture units that OpenGL guarantees.
constexpr int kMostProbes = 8;

struct Options {
  bool environmentOnly = false;
  Proxy proxy = Proxy::None;
  std::optional<Vec3> centre;  ///< absent: the middle of the scene's bounds
  int probes = 1;
  bool blended = false;
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
         .help = "viewpoint of a single map: \"scene\" (the centre of its bounds) or [x, y, z], "
                 "metres",
         .defaultText = "\"scene\""},
        readCentre},
       field(&Options::probes, "probes", config::range(1, kMostProbes),
             "cube maps; above 1: each in the middle of a group of neighbouring reflectors"),
       field(&Options::blended, "blend", kBlends,
             "maps that a sample reads. nearest: its group's; distance: the two nearest, blended"),
       field(&Options::proxy, "proxy", kProxies,
             "where the scene that a map shows lies. none: infinitely far; box: on its bounds; "
             "sphere: on one about the viewpoint, as wide as the bounds' longest edge")
           .trade("none,box"),
       field(&Options::faceSize, "face_size", config::range(1, 4096), kFaceSizeHelp)
           .trade("256,512,1024")});
  return table;
}

class EnvironmentMap : public Method {
 public:
  explicit EnvironmentMap(const Options& options) : options_(options) {
    // The environment is infinitely far away
    if (options_.environmentOnly) {
      options_.proxy = Proxy::None;
      options_.probes = 1;
    }
  }

  MethodPlan plan(const scene::Scene& scene, const RunSettings& settings) const override {
    MethodPlan plan;
    plan.gbuffer = true;
    plan.masks = raster::kMaskEnvironment | raster::kMaskBelowHorizon;
    const Reflectors reflectors = findReflectors(scene, settings.reflectors);
    if (!reflectors.any()) return plan;
    const int maps = std::min(options_.probes, static_cast<int>(reflectors.count()));
    if (options_.environmentOnly) {
      const int size = environmentFaceSize(scene.environment, options_.faceSize);
      plan.items = {{"precomputation", "cube_map",
                     "cube map of the environment, drawn once: it does not change"},
                    {"resource", "cube map",
                     "6 faces of " + std::to_string(size) + " x " + std::to_string(size) +
                         ", RGBA32F, with mip levels",
                     cubeMapBytes(size, 16)}};
    } else {
      plan.items = cubeMapItems(options_.faceSize, scene.animated(), maps);
    }
    if (maps > 1) {
      plan.items.back().lower = "probes, face_size";
      plan.items.push_back({"pass", "probes", "finds the cube maps that the frame's samples read"});
    }
    std::string kinds = reflectors.mirrors() ? "mirrors (level 0)" : "";
    if (reflectors.glossy) {
      kinds += std::string(kinds.empty() ? "" : ", ") + "glossy objects (level by the lobe)";
    }
    plan.items.push_back({"pass", "resolve",
                          (maps > 1 && options_.blended ? "two look-ups" : "one look-up") +
                              (" per reflective sample: " + kinds)});
    return plan;
  }

  void prepare(Services& services, const RunSettings& settings) override {
    masks_ = settings.masks;
    clearsMasks_ = settings.masks && settings.reflectors.all();
    reflectors_ = findReflectors(services.scene, settings.reflectors);
    refractive_ = raster::RefractiveSamples(services.scene);
    if (options_.probes > 1 && reflectors_.any()) placeProbes(services);
    maps_.resize(std::max<std::size_t>(1, groups_.size()));
    read_.assign(maps_.size(), true);
    const auto program = [&](const char* label, const char* glossy) {
      std::vector<gl::Define> defines = raster::SceneRaster::shadingDefines(services.lighting);
      defines.insert(defines.end(), {{"GLOSSY", glossy},
                                     {"MASKS", masks_ ? "1" : "0"},
                                     {"PROXY", std::to_string(static_cast<int>(options_.proxy))},
                                     {"PROBES", std::to_string(maps_.size())},
                                     {"BLEND", blends() ? "1" : "0"},
                                     {"GGX", services.scene.hasGgxLobes() ? "1" : "0"}});
      return gl::Program::fullScreen(label, "methods/environment_map/shaders/lookup.frag",
                                     std::move(defines));
    };
    if (reflectors_.mirrors()) mirror_ = program("environment look-up", "0");
    if (reflectors_.glossy) glossy_ = program("environment look-up, glossy", "1");
    bentCount_ = gl::Buffer("samples with a bent normal", sizeof(std::uint32_t));
    if (reflectors_.mirrors()) mirrorCount_ = gl::FragmentCounter("mirror samples");
    if (reflectors_.glossy) glossyCount_ = gl::FragmentCounter("glossy samples");

    // What does not change is drawn before the first frame, unless a frame may do without it
    if (!services.scene.animated() && maps_.size() == 1) drawMaps({}, services);
  }

  void render(const FrameInput& input, Services& services, FrameOutput& output) override {
    raster::GBuffer& gbuffer = *services.gbuffer;
    if (clearsMasks_) gbuffer.reflectionFramebuffer.clearColorUint(1, 0);
    output.counters["environment"] = 0;
    output.counters["below_horizon"] = 0;
    output.counters["refraction_mirrored"] = 0;
    output.counters["probes"] = 0;
    output.counters["clamped_cube_map"] = 0;
    if (!reflectors_.any()) return;

    if (maps_.size() > 1)
      services.timer.measure("probes", [&] { findRead(services, input.frame.camera); });
    drawMaps(input, services);
    for (std::size_t i = 0; i < maps_.size(); ++i)
      if (read_[i]) output.counters["clamped_cube_map"] += maps_[i].clampedTexels();
    if (std::ranges::find(read_, true) == read_.end()) return;
    std::uint64_t mirrored = 0;
    services.timer.measure("resolve", [&] {
      lookUp(gbuffer, services, input.frame.camera);
      mirrored = refractive_.count(gbuffer);
    });
    std::uint64_t samples = 0;
    if (reflectors_.mirrors()) samples += mirrorCount_.read();
    if (reflectors_.glossy) samples += glossyCount_.read();
    output.counters["environment"] = samples;
    if (samples > 0)
      output.counters["probes"] = static_cast<std::uint64_t>(std::ranges::count(read_, true));
    std::uint32_t bent = 0;
    bentCount_.read(0, sizeof bent, &bent);
    output.counters["below_horizon"] = bent;
    output.counters["refraction_mirrored"] = mirrored;
  }

 private:
  bool blends() const { return maps_.size() > 1 && options_.blended; }

  /// Groups the reflectors, as they stand at time 0: frames must not depend on others.
  void placeProbes(const Services& services) {
    std::vector<int> own;
    const std::vector<bool> reflects = reflectors_.reflects();
    for (std::size_t i = 0; i < reflects.size(); ++i)
      if (reflects[i]) own.push_back(static_cast<int>(i));
    groups_ = groupReflectors(std::move(own), services.geometry, options_.probes);
    if (groups_.size() < 2) return;
    std::vector<std::uint8_t> numbers(reflects.size() + 1);
    for (std::size_t g = 0; g < groups_.size(); ++g)
      for (const int object : groups_[g])
        numbers[static_cast<std::size_t>(object) + 1] = static_cast<std::uint8_t>(g);
    numbers_ = gl::Buffer("groups of reflectors", std::span<const std::uint8_t>(numbers));
    groupOf_ = gl::Texture::makeBuffer("groups of reflectors", GL_R8UI, numbers_);
    marks_ = gl::Buffer("cube maps that are read", groups_.size() * sizeof(std::uint32_t));
    findRead_ = gl::Program::fullScreen("cube maps that are read",
                                        "methods/environment_map/shaders/read_maps.frag",
                                        {{"PROBES", std::to_string(groups_.size())},
                                         {"BLEND", options_.blended ? "1" : "0"},
                                         {"PROXY", "0"}});
  }

  /// Sets read_ to the maps that the frame's samples read.
  void findRead(const Services& services, const scene::Camera& camera) {
    const raster::GBuffer& gbuffer = *services.gbuffer;
    std::vector<std::uint32_t> marks(maps_.size(), 0);
    marks_.write(0, marks.size() * sizeof marks[0], marks.data());
    marks_.bindStorage(0);
    gbuffer.reflectionFramebuffer.bind();
    findRead_.use();
    bindPlaces(findRead_, services, camera);
    findRead_.set("rayFromSample",
                  scene::rayFromPixel(camera, gbuffer.sampleWidth(), gbuffer.sampleHeight()));
    for (gl::DrawState state :
         {raster::onMirrors(), raster::onSamplesOf(raster::SampleClass::Glossy)}) {
      state.colors = 0;
      const gl::DrawScope scope(state);
      gl::drawFullScreenTriangle();
    }
    glMemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
    marks_.read(0, marks.size() * sizeof marks[0], marks.data());
    for (std::size_t i = 0; i < marks.size(); ++i) read_[i] = marks[i] != 0;
  }

  /// Draws those maps that are read, and whose contents have changed.
  void drawMaps(const FrameInput& input, Services& services) {
    if (!reflectors_.any()) return;
    if (!options_.environmentOnly) {
      for (std::size_t i = 0; i < maps_.size(); ++i)
        maps_[i].follow(input, services, centreOf(i, services), options_.faceSize, read_[i]);
    } else if (maps_[0].empty()) {
      services.timer.measure("cube_map", [&] {
        const frame::EnvironmentLight& environment = *services.lighting.environment;
        maps_[0].take(makeEnvironmentCubeMap(
            environment, environmentFaceSize(environment.description(), options_.faceSize)));
      });
    }
  }

  Vec3 centreOf(std::size_t map, const Services& services) const {
    if (!groups_.empty()) return probeCentre(groups_[map], services.geometry);
    return options_.centre ? Vec3(glm::dvec3(*options_.centre) - services.scene.origin)
                           : services.geometry.bounds.centre();
  }

  /// What tells a sample's place, and its maps.
  void bindPlaces(gl::Program& program, const Services& services,
                  const scene::Camera& camera) const {
    if (options_.proxy != Proxy::None || blends()) {
      services.gbuffer->depth.bind(2);
      program.set("nearMetres", camera.nearMetres);
      std::vector<Vec3> centres;
      for (std::size_t i = 0; i < maps_.size(); ++i)
        centres.push_back(centreOf(i, services) - camera.eye());
      program.set("centres", std::span<const Vec3>(centres));
    }
    if (maps_.size() > 1 && !blends()) {
      services.gbuffer->object.bind(1);
      groupOf_.bind(3);
    }
  }

  void placeProxy(gl::Program& program, const Services& services,
                  const scene::Camera& camera) const {
    services.raster->bindShadingResources(program.id(), services.lighting);
    const Vec3 eye = camera.eye();
    const Box3& box = services.geometry.bounds;
    const Vec3 size = box.max - box.min;
    program.set("least", box.min - eye);
    program.set("most", box.max - eye);
    program.set("radius", 0.5f * std::max({1e-6f, size.x, size.y, size.z}));
  }

  // One full-screen pass per kind of reflector, on its stencil class alone.
  void lookUp(const raster::GBuffer& gbuffer, const Services& services,
              const scene::Camera& camera) {
    gbuffer.reflectionFramebuffer.bind();
    gbuffer.normal.bind(0);
    for (std::size_t i = 0; i < maps_.size(); ++i)
      maps_[i].bind(raster::shared::kFirstPassUnit + static_cast<int>(i));
    constexpr std::uint32_t kNone = 0;
    bentCount_.write(0, sizeof kNone, &kNone);
    bentCount_.bindStorage(0);
    const Mat3 ray = scene::rayFromPixel(camera, gbuffer.sampleWidth(), gbuffer.sampleHeight());
    if (reflectors_.mirrors()) {
      bindPlaces(mirror_, services, camera);
      if (options_.proxy != Proxy::None) placeProxy(mirror_, services, camera);
      pass(mirror_, mirrorCount_, ray, raster::onMirrors());
    }
    if (reflectors_.glossy) {
      bindPlaces(glossy_, services, camera);
      if (options_.proxy != Proxy::None) placeProxy(glossy_, services, camera);
      const auto any = std::ranges::find(read_, true) - read_.begin();
      maps_[static_cast<std::size_t>(any)].setLevels(glossy_);  // all have one size
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
  std::vector<std::vector<int>> groups_;  ///< of reflectors, one for each map; empty: one map
  std::vector<CubeMap> maps_;
  std::vector<bool> read_;  ///< by map: whether the frame's samples read it
  gl::Buffer numbers_;      ///< by object id: its group
  gl::Texture groupOf_;
  gl::Buffer marks_;  ///< by map
  gl::Program findRead_;
  gl::Program mirror_;
  gl::Program glossy_;
  gl::FragmentCounter mirrorCount_;
  gl::FragmentCounter glossyCount_;
  gl::Buffer bentCount_;  ///< one number
};

std::unique_ptr<Method> make(const config::Value& value) {
  const Options options = optionTable().parse(value);
  if (options.centre && options.probes > 1)
    value.get("center").fail("names the viewpoint of a single map; with \"probes\" " +
                             std::to_string(options.probes) + " only \"scene\" is allowed");
  return std::make_unique<EnvironmentMap>(options);
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
                {"probes", "frames",
                 "with several probes: finds the cube maps that the frame's samples read"},
                {"resolve", "frames", "the look-up per sample"}},
      .counters = {{"environment", "reflective samples, which all use the cube map"},
                   {"below_horizon",
                    "of these, samples whose normal was corrected, so that the mirrored ray leaves "
                    "the surface"},
                   {"refraction_mirrored",
                    "samples of refractive materials, which are mirrored instead"},
                   {"probes", "cube maps that the frame's samples read"},
                   {"clamped_cube_map", "texels of the cube map above the range of half floats",
                    true}},
      .tests = {.small = R"({"face_size": 64})",
                .variants = {R"({"proxy": "box"})", R"({"proxy": "sphere"})", R"({"probes": 3})",
                             R"({"probes": 4, "blend": "distance", "proxy": "box"})"}},
      .options = optionTable().schema(),
      .make = make,
      .fallbackOptions = R"({"face_size": 256})"};  // as small as the methods' own fallbacks; ours
  return entry;
}

}  // namespace catoptric::methods
