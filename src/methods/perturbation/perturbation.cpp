#include "methods/perturbation/perturbation.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/clock.h"
#include "core/log.h"
#include "gl/query.h"
#include "gl/shader.h"
#include "methods/perturbation/disocclusions.h"
#include "methods/perturbation/reflector.h"
#include "methods/perturbation/virtual_objects.h"
#include "raster/scene_gpu/materials.h"
#include "scene/animate.h"

namespace catoptric::methods {
namespace {

using perturbation::Order;

const config::Schema& schema() {
  static const config::Schema options = {
      .name = "perturbation",
      .help = "Options of the method perturbation.",
      .fields = {
          {.name = "order",
           .type = config::FieldType::String,
           .help =
               "what becomes of the nearest sampled path: taken as it is, moved by its Jacobian, "
               "by its Hessian too, or whichever the error allows, and traced anew where none "
               "does",
           .defaultText = "\"auto\"",
           .allowed = {"nearest", "linear", "quadratic", "auto"}},
          {.name = "sample_spacing",
           .type = config::FieldType::Integer,
           .help = "pixels between sampled paths, at most; reflectors that are small in the frame "
                   "get more (min_paths)",
           .defaultText = "16",
           .minimum = 1,
           .maximum = 256},
          {.name = "min_paths",
           .type = config::FieldType::Integer,
           .help = "paths closer together, down to 1 pixel, until a reflector has so many",
           .defaultText = "64",
           .minimum = 1,
           .maximum = 65536},
          {.name = "max_bounces",
           .type = config::FieldType::Integer,
           .help = "reflections along a path; after the last a surface shows its diffuse component",
           .defaultText = "1",
           .minimum = 1,
           .maximum = static_cast<double>(perturbation::kMaxTurns)},
          {.name = "max_path_types",
           .type = config::FieldType::Integer,
           .help = "sequences of reflectors that are followed, shorter ones first; what reflects "
                   "beyond them shows its diffuse component (counted: path_types_left_out)",
           .defaultText = "1024",
           .minimum = 1,
           .maximum = 65536},
          {.name = "several",
           .type = config::FieldType::String,
           .help = "how several reflections of a point are told apart: by minima among "
                   "neighbouring paths, or as in the paper by groups of the nearest ones",
           .defaultText = "\"minima\"",
           .allowed = {"minima", "groups"}},
          {.name = "candidates",
           .type = config::FieldType::Integer,
           .help = "nearest sampled paths of a vertex that are put into groups",
           .defaultText = "5",
           .minimum = 1,
           .maximum = 64},
          {.name = "group_angle",
           .type = config::FieldType::Number,
           .help = "degrees between reflected directions of one group, at most",
           .defaultText = "30",
           .minimum = 0,
           .maximum = 180},
          {.name = "group_distance",
           .type = config::FieldType::Number,
           .help = "distance between reflection points of one group, at most, as a share of the "
                   "reflector's diameter",
           .defaultText = "0.1",
           .minimum = 0,
           .maximum = 1},
          {.name = "error",
           .type = config::FieldType::Number,
           .help = "order auto: error of a vertex that the estimate allows, pixels",
           .defaultText = "0.1",
           .minimum = 0.001,
           .maximum = 100},
          {.name = "tessellation_error",
           .type = config::FieldType::Number,
           .help = "edges of reflected objects are halved where their middle shows farther than "
                   "this from where its ends say, pixels; 0: the given triangles",
           .defaultText = "0.5",
           .minimum = 0,
           .maximum = 100},
          {.name = "traced_per_pixel",
           .type = config::FieldType::Number,
           .help = "order auto: edges of one object in one sequence of reflectors are halved until "
                   "so many paths have been traced anew, for each pixel of the image and 262144 at "
                   "least; then its reflections are coarser than tessellation_error (a warning; "
                   "counted: coarse_objects)",
           .defaultText = "8",
           .minimum = 0,
           .maximum = 1000},
          {.name = "unsupported",
           .type = config::FieldType::String,
           .help = "reflectors that are neither planar nor implicit surfaces, or not mirrors: an "
                   "error, or a cube map of the diffuse scene (counted)",
           .defaultText = "\"error\"",
           .allowed = {"error", "environment_map"}},
          {.name = "count_disocclusions",
           .type = config::FieldType::Bool,
           .help = "trace what no virtual object covers by Embree: counts disoccluded, where there "
                   "is a surface, mask.disoccluded; takes the time of a ray tracer",
           .defaultText = "false"},
      }};
  return options;
}

struct Options {
  perturbation::PathOptions path;
  perturbation::TriangleOptions triangles;
  std::size_t maxBounces = 1;
  std::size_t maxPathTypes = 1024;
  float tracedPerPixel = 8.0f;
  bool environmentMap = false;  ///< for what is not supported
  bool countDisocclusions = false;
};

Options parseOptions(const config::Value& value) {
  config::require(value, schema());
  const auto integer = [&](const char* name) {
    return static_cast<int>(config::valueOr(value, schema(), name).asInteger());
  };
  const auto number = [&](const char* name) {
    return static_cast<float>(config::valueOr(value, schema(), name).asNumber());
  };
  const auto text = [&](const char* name) {
    return config::valueOr(value, schema(), name).asString();
  };
  Options options;
  const std::string order = text("order");
  options.path.order = order == "nearest"     ? Order::Nearest
                       : order == "linear"    ? Order::Linear
                       : order == "quadratic" ? Order::Quadratic
                                              : Order::Auto;
  options.path.sampleSpacing = integer("sample_spacing");
  options.path.fewestPaths = integer("min_paths");
  options.maxBounces = static_cast<std::size_t>(integer("max_bounces"));
  options.maxPathTypes = static_cast<std::size_t>(integer("max_path_types"));
  options.path.groups = text("several") == "groups";
  options.path.candidates = integer("candidates");
  options.path.groupAngleRad = radians(number("group_angle"));
  options.path.groupDistance = number("group_distance");
  options.path.errorPixels = number("error");
  options.triangles.errorPixels = number("tessellation_error");
  options.tracedPerPixel = number("traced_per_pixel");
  options.environmentMap = text("unsupported") == "environment_map";
  options.countDisocclusions = config::valueOr(value, schema(), "count_disocclusions").asBool();
  return options;
}

constexpr const char* kUncovered = "uncovered samples";
constexpr const char* kUncoveredSource = "methods/perturbation/shaders/uncovered.frag";
constexpr int kCubeMapFaceSize = 256;
/// Paths meet planes this part of their size beyond the border too (ours).
constexpr double kPlaneMargin = 0.25;
/// Samples may show a place this part of the reflector's size nearer or farther than the one by
/// which a virtual triangle came about (ours): sheets of different reflections lie farther apart.
constexpr float kDepthSlack = 0.1f;

/// Draws write no colours until the end of the scope.
struct ColorsKept {
  ColorsKept() { glColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE); }
  ~ColorsKept() { glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE); }
  ColorsKept(const ColorsKept&) = delete;
  ColorsKept& operator=(const ColorsKept&) = delete;
};

enum class Kind : std::uint8_t { Diffuse, Planar, Implicit, Unsupported };

/// What kind of reflector an object is; why it is not supported.
Kind kindOf(const scene::Scene& scene, const scene::Object& object, std::string& reason) {
  const scene::Material& material = scene.materials[object.material];
  const raster::SampleClass kind = raster::materialClass(scene, material);
  // One that a mask cuts is a mesh (frame::Geometry)
  const bool surface =
      scene.meshes[object.mesh].surface && material.alphaMode != scene::AlphaMode::Mask;
  if (kind == raster::SampleClass::Diffuse) return Kind::Diffuse;
  if (kind == raster::SampleClass::Glossy) {
    reason = "is glossy: perturbation does mirrors (g = 0)";
  } else if (material.normalTexture.used()) {
    reason = "has a normal map";
  } else if (material.refraction > 0.0f && !surface) {
    reason = "refracts, and is not an implicit surface";
  } else if (object.planar && !(material.refraction > 0.0f)) {
    return Kind::Planar;
  } else if (surface) {
    return Kind::Implicit;
  } else {
    reason =
        "is a curved mesh; mirrors must be planar or implicit surfaces without \"alpha_cutoff\" (a "
        "ball: \"shape\": \"implicit\", \"surface\": \"sphere\")";
  }
  return Kind::Unsupported;
}

/// Tells what a frame is at when it takes long.
class SlowNews {
 public:
  /// `name` says what begins.
  void begin(std::string name) {
    const std::scoped_lock lock(mutex_);
    name_ = std::move(name);
    say();
  }
  /// So many vertices were looked up, by any thread.
  void add(std::size_t vertices) {
    const std::scoped_lock lock(mutex_);
    vertices_ += vertices;
    say();
  }

 private:
  static constexpr std::int64_t kEveryNs = 10'000'000'000;  ///< ours
  void say() {
    const std::int64_t now = nowNs();
    if (now - last_ < kEveryNs) return;
    last_ = now;
    log::info("perturbation: this frame takes long: " + std::to_string(vertices_) +
              " vertices so far, now " + name_);
  }

  std::mutex mutex_;
  std::string name_;
  std::uint64_t vertices_ = 0;
  std::int64_t last_ = nowNs();
};

class Perturbation : public Method {
 public:
  explicit Perturbation(const Options& options) : options_(options) {}

  std::vector<Unsupported> unsupported(const scene::Scene& scene) const override {
    std::vector<Unsupported> result;
    if (options_.environmentMap) return result;
    for (std::size_t i = 0; i < scene.objects.size(); ++i) {
      std::string reason;
      if (kindOf(scene, scene.objects[i], reason) == Kind::Unsupported) {
        result.push_back({static_cast<int>(i) + 1,
                          reason + "; --set methods.perturbation.unsupported=environment_map lets "
                                   "it show the cube map"});
      }
    }
    return result;
  }

  MethodPlan plan(const scene::Scene& scene, const RunSettings& settings) const override {
    MethodPlan plan;
    plan.gbuffer = true;
    int planar = 0;
    int curved = 0;
    int others = 0;
    for (const scene::Object& object : scene.objects) {
      std::string reason;
      const Kind kind = kindOf(scene, object, reason);
      planar += kind == Kind::Planar ? 1 : 0;
      curved += kind == Kind::Implicit ? 1 : 0;
      others += kind == Kind::Unsupported ? 1 : 0;
    }
    if (planar + curved + others == 0) return plan;
    plan.bounces = static_cast<int>(options_.maxBounces);
    plan.bouncesOption = "max_bounces";
    const auto samples = static_cast<std::uint64_t>(settings.width) * settings.height *
                         settings.samples * settings.samples;
    const bool several = options_.maxBounces > 1 && planar + curved > 0;
    const std::vector<bool> moving = scene::movingObjects(scene);
    const bool kept = std::ranges::find(moving, true) != moving.end();
    if (curved > 0 || several) {
      std::string why = std::to_string(curved) + " implicit surfaces";
      if (several) {
        why += " and " + std::to_string(planar) + " planes, sequences of up to " +
               std::to_string(options_.maxBounces) + " where a sampled path meets them";
      }
      plan.items.push_back(
          {"pass", "paths", why + "; again when the camera or a reflector moves", 0});
      const std::uint64_t types = mostTypes(static_cast<std::uint64_t>(planar + curved));
      plan.items.push_back({"resource", "sampled paths",
                            "of at most " + std::to_string(types) +
                                " path types, where each one's reflector fills the frame",
                            types * pathBytes(settings)});
    }
    if (planar + curved > 0) {
      plan.items.push_back({"pass", "virtual_objects",
                            "every other object in " + std::to_string(planar) + " planar and " +
                                std::to_string(curved) +
                                " implicit mirrors; again when something moves",
                            0});
    }
    if (others > 0) {
      plan.items.push_back(
          {"pass", "cube_map", std::to_string(others) + " reflectors are not supported", 0});
    }
    plan.items.push_back({"pass", "virtual_draw", "with a depth buffer of their own", 0});
    plan.items.push_back({"resource", "virtual depth", "depth and stencil", samples * 8});
    if (kept)
      plan.items.push_back({"resource", "still virtual objects",
                            "colour, depth and stencil of what stands still while the camera does",
                            samples * 24});
    if (several) {
      plan.items.push_back(
          {"resource", "levels of virtual objects",
           "at most, for reflections in reflections: colour, depth and stencil; "
           "mirrored directions and reflectors of the levels before" +
               std::string(kept ? "; twice, for what stands still" : ""),
           (kept ? 2 : 1) * (options_.maxBounces - 1) * samples * (16 + 8 + 16 + 4)});
    }
    if (options_.countDisocclusions) {
      plan.trace = true;
      plan.items.push_back({"pass", "disocclusions", "asked for: count_disocclusions", 0});
      plan.items.push_back(
          {"resource", "G-buffer copy", "what is read back for that", samples * (16 + 16 + 4 + 4)});
    }
    return plan;
  }

  void prepare(Services& services, const RunSettings& settings) override {
    settings_ = settings;
    std::vector<float> bends{1.0f};
    for (const scene::Object& object : services.scene.objects) {
      std::string reason;
      kinds_.push_back(kindOf(services.scene, object, reason));
      any_ = any_ || kinds_.back() != Kind::Diffuse;
      others_ = others_ || kinds_.back() == Kind::Unsupported;
      const float index = services.scene.materials[object.material].refraction;
      const bool refracts = kinds_.back() == Kind::Implicit && index > 0.0f;
      refracts_ = refracts_ || refracts;
      bends.push_back(kinds_.back() == Kind::Unsupported ? -1.0f : refracts ? 1.0f / index : 0.0f);
    }
    for (std::size_t i = 0; i < kinds_.size(); ++i) {
      if (kinds_[i] != Kind::Diffuse && services.geometry.objects[i].moving) keepsStill_ = false;
    }
    if (!any_) return;
    defines_ = raster::SceneRaster::shadingDefines(services.lighting);
    defines_.push_back({"MASKS", settings.masks ? "1" : "0"});
    std::vector<gl::Define> defines = defines_;
    defines.push_back({"UNSUPPORTED", others_ ? "1" : "0"});
    defines.push_back({"REFRACTS", refracts_ ? "1" : "0"});
    defines.push_back({"DIRECTIONS", "0"});
    uncovered_ = gl::Program::fullScreen(kUncovered, kUncoveredSource, std::move(defines));
    hidden_ =
        gl::Program::fullScreen("hidden samples", "methods/perturbation/shaders/hidden.frag", {});
    addLevel(*services.gbuffer);
    if (others_) unsupportedCount_ = gl::Buffer("unsupported samples", sizeof(std::uint32_t));
    if (others_ || refracts_) {
      bendBuffer_ = gl::Buffer("what reflectors do to rays", std::span<const float>(bends));
      bends_ = gl::Texture::makeBuffer("what reflectors do to rays", GL_R32F, bendBuffer_);
    }
  }

  void render(const FrameInput& input, Services& services, FrameOutput& output) override {
    for (const char* name :
         {"paths", "path_types", "path_types_missed", "path_types_left_out", "total_reflection",
          "vertices", "triangles", "dropped_triangles", "coarse_objects", "reflections_left_out",
          "linear", "quadratic", "retraced", "not_converged", "environment",
          "unsupported_reflector", "clamped_cube_map"})
      output.counters[name] = 0;
    if (!any_) {
      if (settings_.masks) services.gbuffer->reflectionFramebuffer.clearColorUint(1, 0);
      return;
    }
    output.changedReflection = update(input, services, output.counters);
    if (others_ && (environment_.empty() || services.scene.animated())) {
      services.timer.measure("cube_map", [&] {
        environment_ = services.raster->drawCubeMap(services.geometry.bounds.centre(),
                                                    kCubeMapFaceSize, services.lighting);
        clampedTexels_ = raster::clampedTexels(environment_);
        environment_.setFilter(GL_LINEAR_MIPMAP_LINEAR, GL_LINEAR);
      });
    }
    output.counters["clamped_cube_map"] = clampedTexels_;
    services.timer.measure("virtual_draw",
                           [&] { draw(input.frame.camera, output.changedReflection, services); });
    // Samples that were uncovered before in what was drawn are counted again
    std::uint32_t others = 0;
    if (others_) unsupportedCount_.read(0, sizeof others, &others);
    if (!output.changedReflection) uncoveredSamples_ = 0;
    for (const Level& level : levels_) {
      if (level.counted) uncoveredSamples_ += level.after.read();
      if (level.counted && output.changedReflection) uncoveredSamples_ -= level.before.read();
    }
    output.counters["environment"] = uncoveredSamples_ - others;
    output.counters["unsupported_reflector"] = others;
    if (options_.countDisocclusions) {
      services.timer.measure("disocclusions", [&] {
        output.counters["disoccluded"] = countDisocclusions(services, input.frame.camera);
      });
    }
  }

 private:
  /// Sequences of so many reflectors, as far as they are followed.
  std::uint64_t mostTypes(std::uint64_t reflectors) const {
    std::uint64_t all = 0;
    std::uint64_t ofLength = 1;
    for (std::size_t length = 0; length < options_.maxBounces; ++length) {
      ofLength = std::min<std::uint64_t>(ofLength * reflectors, options_.maxPathTypes);
      all += ofLength;
    }
    return std::min<std::uint64_t>(all, options_.maxPathTypes);
  }
  /// Of one type's paths over a whole frame.
  std::uint64_t pathBytes(const RunSettings& settings) const {
    const int spacing = options_.path.sampleSpacing;
    const auto samples = static_cast<std::uint64_t>((settings.width + spacing - 1) / spacing) *
                         static_cast<std::uint64_t>((settings.height + spacing - 1) / spacing);
    return std::max(samples, static_cast<std::uint64_t>(options_.path.fewestPaths)) *
           options_.maxBounces * sizeof(perturbation::Bounce<double>);
  }
  struct PlaneMirror {
    perturbation::Plane<double> plane;
    implicit::Surface surface;  ///< the same
  };
  /// What is kept of one sequence of reflectors while they and the camera stand still.
  struct PathType {
    std::optional<perturbation::Reflector> paths;     ///< none: a plane by itself, exactly
    std::vector<perturbation::Plane<double>> planes;  ///< where all of them are
    std::uint32_t number = 0;                         ///< of samples that show them
    std::map<int, raster::VirtualObject> objects;     ///< by index in geometry.objects
    bool occurs() const { return !paths || paths->pathCount() > 0; }
  };
  /// A place where a path turns.
  struct Meeting {
    int object = 0;        ///< index
    bool through = false;  ///< refracts
    bool operator<(const Meeting& other) const {
      return std::pair(object, through) < std::pair(other.object, other.through);
    }
  };
  using Sequence = std::vector<Meeting>;  ///< from the eye on

  /// Images of what is seen by so many reflections, and what they are drawn into.
  struct Images {
    gl::Texture color;      ///< RGBA32F; empty: the G-buffer's reflection
    gl::Texture direction;  ///< RGBA32F: mirrored at reflectors; likewise for levels that go on
    gl::Texture reflector;  ///< R32UI: numbers of path types
    gl::Texture depth;
    gl::Framebuffer last;  ///< colour alone
    gl::Framebuffer goesOn;
  };
  struct Level {
    Images all;
    Images still;  ///< of what stands still, in stillTiles_; uncovered samples have no colour
    gl::Framebuffer uncovered;
    gl::FragmentCounter before;  ///< uncovered samples in what is drawn, before that and after
    gl::FragmentCounter after;
    bool counted = false;  ///< in this frame
  };

  /// Recomputes what the changes since the last frame ask for. Returns the samples in which that
  /// and what moved may show; none: all.
  std::optional<raster::Region> update(const FrameInput& input, Services& services,
                                       Counters& counters) {
    const frame::Geometry& geometry = services.geometry;
    const scene::Camera& camera = input.frame.camera;
    const bool all = input.firstOfSequence || lastCamera_ != camera;
    lastCamera_ = camera;
    std::optional<raster::Region> part = input.changedSamples;
    if (all || others_) part.reset();
    const perturbation::View view{camera, settings_.width, settings_.height};
    const auto changed = [&](int object) {
      return std::ranges::find(input.changedObjects, object) != input.changedObjects.end();
    };
    SlowNews news;
    services.timer.measure("paths", [&] {
      std::erase_if(types_, [&](const auto& type) {
        return all ||
               std::ranges::any_of(type.first, [&](const Meeting& m) { return changed(m.object); });
      });
      for (int r = 0; r < static_cast<int>(kinds_.size()); ++r) {
        const Kind kind = kinds_[static_cast<std::size_t>(r)];
        if ((kind != Kind::Planar && kind != Kind::Implicit) || !(all || changed(r))) continue;
        part.reset();
        if (kind == Kind::Planar)
          planes_[r] = planarMirror(geometry, geometry.objects[static_cast<std::size_t>(r)]);
      }
      findTypes(services.scene, geometry, view, news);
      numberTypes(services.scene);
    });
    services.timer.measure("virtual_objects", [&] {
      perturbation::TriangleCounts counts;
      std::vector<std::string> coarse;
      std::vector<std::string> leftOut;
      for (auto& [sequence, type] : types_) {
        if (!type.occurs()) continue;
        ++counters["path_types"];
        if (type.paths) counts.paths.paths += type.paths->pathCount();
        const int body = inside(services.scene, sequence);
        for (int o = 0; o < static_cast<int>(geometry.objects.size()); ++o) {
          if (type.objects.contains(o) && !changed(o)) continue;
          const auto old = type.objects.find(o);
          if (old != type.objects.end()) {
            if (part) part->add(old->second.where);
            type.objects.erase(old);
          }
          if (body >= 0 && body != o) continue;
          const std::string name = nameOf(services.scene, sequence, o);
          news.begin(name);
          perturbation::TriangleCounts made;
          const raster::VirtualTriangles* triangles =
              trianglesOf(geometry, sequence.back().object, type, o, view, news, made);
          counts.add(made);
          if (made.coarse > 0) coarse.push_back(name);
          if (made.paths.leftOut > 0) leftOut.push_back(name);
          if (!triangles) continue;
          const auto drawn = type.objects.emplace(
              o, raster::VirtualObject(*triangles, camera, services.gbuffer->sampleWidth(),
                                       services.gbuffer->sampleHeight()));
          if (part) part->add(drawn.first->second.where);
        }
      }
      linkObjects(services.scene);
      for (const auto& [sequence, type] : types_) {
        if (!type.paths) continue;
        counters["total_reflection"] += type.paths->totalReflections();
        counters["path_types_missed"] += type.paths->missed() ? 1 : 0;
      }
      counters["path_types_left_out"] = typesLeftOut_;
      counters["paths"] = counts.paths.paths;
      counters["vertices"] = counts.vertices;
      counters["triangles"] = counts.triangles;
      counters["dropped_triangles"] = counts.dropped;
      counters["coarse_objects"] = counts.coarse;
      warnOfCoarse(coarse);
      warnOfLeftOut(leftOut, counts.paths.leftOut);
      counters["linear"] = counts.paths.linear;
      counters["quadratic"] = counts.paths.quadratic;
      counters["retraced"] = counts.paths.retraced;
      counters["not_converged"] = counts.paths.notConverged;
      counters["reflections_left_out"] = counts.paths.leftOut;
    });

    // Nothing of it shows beside the mirrors
    if (!part) {
      mirrors_ = {};
      for (std::size_t r = 0; r < kinds_.size(); ++r) {
        if (kinds_[r] == Kind::Diffuse) continue;
        mirrors_ = raster::bounding(
            mirrors_,
            raster::shownRectangle(camera, services.gbuffer->sampleWidth(),
                                   services.gbuffer->sampleHeight(), geometry.objects[r].bounds));
      }
      return std::nullopt;
    }
    part->clip(mirrors_);
    return part;
  }

  static float refractionOf(const scene::Scene& scene, int object) {
    return scene.materials[scene.objects[static_cast<std::size_t>(object)].material].refraction;
  }

  /// Whether a scale of 0 leaves nothing of the object.
  static bool vanished(const frame::Geometry& geometry, int object) {
    const frame::ObjectRange& range = geometry.objects[static_cast<std::size_t>(object)];
    if (range.surface < 0) return range.bounds.min == range.bounds.max;
    return geometry.surfaces[static_cast<std::size_t>(range.surface)].vanishedAt.has_value();
  }

  /// The body inside which a path is after these turns; -1: none. Such bodies are solid: a path
  /// that has entered one meets its surface next.
  static int inside(const scene::Scene& scene, const Sequence& sequence) {
    int body = -1;
    for (const Meeting& meeting : sequence) {
      if (meeting.through && refractionOf(scene, meeting.object) > 0.0f)
        body = body < 0 ? meeting.object : -1;
    }
    return body;
  }

  /// What is made, for messages: an object (-1: paths) in a sequence of reflectors.
  static std::string nameOf(const scene::Scene& scene, const Sequence& sequence, int o) {
    const auto name = [&](int object) {
      return "\"" + scene.objects[static_cast<std::size_t>(object)].name + "\"";
    };
    std::string text = o < 0 ? "paths by" : name(o) + " in";
    for (const Meeting& meeting : sequence)
      text += (&meeting == sequence.data() ? " " : ", ") + name(meeting.object);
    return text;
  }

  /// The first of some things, and how many others there are.
  static std::string firstOf(const std::vector<std::string>& names) {
    if (names.size() == 1) return names[0];
    return names[0] + " and " + std::to_string(names.size() - 1) + " more";
  }

  /// Says once in a run that images are coarser than was asked for.
  void warnOfCoarse(const std::vector<std::string>& objects) {
    if (objects.empty() || warnedOfCoarse_) return;
    warnedOfCoarse_ = true;
    std::array<char, 32> allowed{};
    std::snprintf(allowed.data(), allowed.size(), "%g",
                  static_cast<double>(options_.tracedPerPixel));
    log::warning(
        "perturbation: " + firstOf(objects) +
        " are reflected more coarsely than tessellation_error: halving their edges would "
        "trace more paths than traced_per_pixel (" +
        allowed.data() +
        ") allows; raise it, or tessellation_error, or lower max_bounces; waves and many sheets, "
        "which show every point often, are faster by method traced (counted: coarse_objects)");
  }

  /// Says once in a run that points show more often than is followed.
  void warnOfLeftOut(const std::vector<std::string>& objects, std::uint64_t reflections) {
    if (objects.empty() || warnedOfLeftOut_) return;
    warnedOfLeftOut_ = true;
    log::warning("perturbation: " + firstOf(objects) + " show points more than " +
                 std::to_string(perturbation::kMaxReflections) +
                 " times: " + std::to_string(reflections) +
                 " reflections are left out; method traced shows such reflectors (counted: "
                 "reflections_left_out)");
  }

  /// How a path may go on at an object: in two ways where it is inside of it.
  static std::vector<Meeting> waysOn(const scene::Scene& scene, int body, int object) {
    if (body < 0) return {{object, refractionOf(scene, object) > 0.0f}};
    if (body != object) return {};
    return {{object, true}, {object, false}};
  }

  /// Paths by the reflectors one after the other [Chen2000] Sec. III-B.1; longer ones only where
  /// the shorter occur. Keeps those that were found before, and no others.
  void findTypes(const scene::Scene& scene, const frame::Geometry& geometry,
                 const perturbation::View& view, SlowNews& news) {
    std::map<Sequence, PathType> found;
    std::size_t occurring = 0;
    typesLeftOut_ = 0;
    std::vector<Sequence> shorter{{}};
    for (std::size_t length = 1; length <= options_.maxBounces; ++length) {
      std::vector<Sequence> longer;
      for (const Sequence& start : shorter) {
        const int body = inside(scene, start);
        for (int r = 0; r < static_cast<int>(kinds_.size()); ++r) {
          const Kind kind = kinds_[static_cast<std::size_t>(r)];
          if (kind != Kind::Planar && kind != Kind::Implicit) continue;
          if (vanished(geometry, r)) continue;
          for (const Meeting& meeting : waysOn(scene, body, r)) {
            Sequence sequence = start;
            sequence.push_back(meeting);
            if (occurring == options_.maxPathTypes) {
              ++typesLeftOut_;
              continue;
            }
            // Nodes keep their place: longer types refer to shorter ones
            auto type = types_.extract(sequence);
            if (type.empty()) {
              news.begin(nameOf(scene, sequence, -1));
              const perturbation::Reflector* before =
                  length > 1 ? &*found.at(start).paths : nullptr;
              found.emplace(sequence, makeType(scene, geometry, sequence, before, view));
            } else {
              found.insert(std::move(type));
            }
            if (!found.at(sequence).occurs()) continue;
            ++occurring;
            longer.push_back(std::move(sequence));
          }
        }
      }
      shorter = std::move(longer);
    }
    types_ = std::move(found);
  }

  PathType makeType(const scene::Scene& scene, const frame::Geometry& geometry,
                    const Sequence& sequence, const perturbation::Reflector* before,
                    const perturbation::View& view) const {
    PathType type;
    std::vector<perturbation::Turn> turns;
    double index = 1.0;
    bool isInside = false;
    for (const Meeting& meeting : sequence) {
      const frame::ObjectRange& range = geometry.objects[static_cast<std::size_t>(meeting.object)];
      perturbation::Turn turn;
      turn.bounds = range.bounds;
      turn.points = {geometry.positions.data() + range.firstVertex, range.vertexCount};
      turn.through = meeting.through;
      turn.indexBefore = index;
      turn.inside = isInside;
      if (meeting.through) {
        isInside = !isInside;
        index = isInside ? static_cast<double>(refractionOf(scene, meeting.object)) : 1.0;
      }
      turn.indexAfter = index;
      const auto plane = planes_.find(meeting.object);
      if (plane == planes_.end()) {
        turn.surface = &geometry.surfaces[static_cast<std::size_t>(range.surface)].surface;
      } else {
        turn.surface = &plane->second.surface;
        type.planes.push_back(plane->second.plane);
      }
      turns.push_back(turn);
    }
    if (type.planes.size() < sequence.size()) type.planes.clear();
    if (type.planes.empty() || options_.maxBounces > 1)
      type.paths.emplace(turns, before, geometry.bounds, view, options_.path);
    return type;
  }

  /// Numbers of path types: of one reflector its object's id, of others whatever follows.
  void numberTypes(const scene::Scene& scene) {
    std::uint32_t number = static_cast<std::uint32_t>(kinds_.size());
    std::vector<Vec4> tints(number + 1 + types_.size(), Vec4(1.0f));
    deepest_ = 0;
    for (auto& [sequence, type] : types_) {
      if (!type.occurs()) continue;
      deepest_ = std::max(deepest_, sequence.size());
      type.number =
          sequence.size() == 1 ? static_cast<std::uint32_t>(sequence[0].object) + 1 : ++number;
      const scene::Object& last = scene.objects[static_cast<std::size_t>(sequence.back().object)];
      tints[type.number] = Vec4(scene.materials[last.material].reflectionTint, 1.0f);
    }
    if (deepest_ < 2 || tints == lastTints_) return;
    tintBuffer_ = gl::Buffer("tints of reflectors in reflectors", std::span<const Vec4>(tints));
    tints_ = gl::Texture::makeBuffer("tints of reflectors in reflectors", GL_RGBA32F, tintBuffer_);
    lastTints_ = std::move(tints);
  }

  /// What one path type, whose last turn is at `last`, shows of one object; null where it never
  /// does.
  const raster::VirtualTriangles* trianglesOf(const frame::Geometry& geometry, int last,
                                              const PathType& type, int o,
                                              const perturbation::View& view, SlowNews& news,
                                              perturbation::TriangleCounts& counts) {
    const bool own = o == last;
    if (geometry.objects[static_cast<std::size_t>(o)].indexCount == 0) return nullptr;
    if (own && !(type.planes.empty() && type.paths->seesItself())) return nullptr;
    if (type.planes.empty()) {
      perturbation::TriangleOptions options = options_.triangles;
      options.maxTraced =
          std::max(perturbation::kFewestTraced,
                   static_cast<std::size_t>(static_cast<double>(options_.tracedPerPixel) *
                                            view.width * view.height));
      options.lookedUp = [&](std::size_t places) { news.add(places); };
      perturbation::virtualTriangles(geometry, o, *type.paths, own, view, options_.path.order,
                                     options, connectivity_[o], counts, triangles_);
      triangles_.depthSlack = kDepthSlack * static_cast<float>(type.paths->size());
    } else {
      triangles_ =
          perturbation::mirroredTriangles(geometry, o, type.planes, view.camera.eye(), counts);
    }
    return &triangles_;
  }

  /// On whose samples virtual objects show, and what shows on those.
  void linkObjects(const scene::Scene& scene) {
    for (auto& [sequence, type] : types_) {
      const int body = inside(scene, sequence);
      for (auto& [o, object] : type.objects) {
        object.reflector = type.number;
        object.next = object.nextTotal = 0;
        const float index = refractionOf(scene, o);
        object.refraction = index > 0.0f ? (body == o ? index : 1.0f / index) : 0.0f;
        for (const Meeting& meeting : waysOn(scene, body, o)) {
          Sequence longer = sequence;
          longer.push_back(meeting);
          const auto next = types_.find(longer);
          if (next == types_.end() || !next->second.occurs()) continue;
          const bool total = body == o && !meeting.through;
          (total ? object.nextTotal : object.next) = next->second.number;
        }
      }
    }
  }

  static PlaneMirror planarMirror(const frame::Geometry& geometry,
                                  const frame::ObjectRange& range) {
    const glm::dvec3 n = glm::normalize(glm::dvec3(geometry.attributes[range.firstVertex].normal));
    const double offset = glm::dot(n, glm::dvec3(geometry.positions[range.firstVertex]));
    // A little more of it than there is: paths about its border serve what shows there
    implicit::Domain domain{glm::dvec3(range.bounds.min), glm::dvec3(range.bounds.max)};
    const double margin = kPlaneMargin * domain.diameter();
    domain.min -= margin;
    domain.max += margin;
    return {{{{n.x, n.y, n.z}}, offset}, implicit::planeSurface(n, offset, domain)};
  }

  static gl::Texture makeImage(const char* label, GLenum format, const raster::GBuffer& gbuffer) {
    return gl::Texture::make2D(label, format, gbuffer.sampleWidth(), gbuffer.sampleHeight());
  }
  static const gl::Texture& colorOf(const Images& images, const raster::GBuffer& gbuffer) {
    return images.color.empty() ? gbuffer.reflection : images.color;
  }
  static Images makeImages(const raster::GBuffer& gbuffer, bool inReflection) {
    Images images;
    images.depth = makeImage("virtual depth", GL_DEPTH32F_STENCIL8, gbuffer);
    if (!inReflection) images.color = makeImage("virtual objects", GL_RGBA32F, gbuffer);
    images.last = gl::Framebuffer("virtual objects", {{.texture = colorOf(images, gbuffer)}},
                                  {.texture = images.depth});
    return images;
  }
  /// ... that a level more follows
  static void goOn(Images& images, const raster::GBuffer& gbuffer) {
    images.direction = makeImage("mirrored directions", GL_RGBA32F, gbuffer);
    images.reflector = makeImage("reflectors in reflectors", GL_R32UI, gbuffer);
    images.goesOn = gl::Framebuffer("virtual objects, first of several levels",
                                    {{.texture = colorOf(images, gbuffer)},
                                     {.texture = images.direction},
                                     {.texture = images.reflector}},
                                    {.texture = images.depth});
  }

  /// The images of one level more.
  void addLevel(const raster::GBuffer& gbuffer) {
    if (!levels_.empty()) goOn(levels_.back().all, gbuffer);
    Level level;
    level.all = makeImages(gbuffer, levels_.empty());
    const gl::Texture& color = colorOf(level.all, gbuffer);
    level.before = gl::FragmentCounter("samples that were uncovered");
    level.after = gl::FragmentCounter("uncovered samples");
    level.uncovered =
        settings_.masks
            ? gl::Framebuffer("uncovered samples", {{.texture = color}, {.texture = gbuffer.masks}},
                              {.texture = level.all.depth})
            : gl::Framebuffer("uncovered samples", {{.texture = color}},
                              {.texture = level.all.depth});
    levels_.push_back(std::move(level));
    if (levels_.size() == 2) {
      std::vector<gl::Define> defines = defines_;
      defines.push_back({"UNSUPPORTED", "0"});
      defines.push_back({"REFRACTS", "0"});
      defines.push_back({"DIRECTIONS", "1"});
      uncoveredInside_ = gl::Program::fullScreen(kUncovered, kUncoveredSource, std::move(defines));
      join_ = gl::Program::fullScreen("virtual objects joined",
                                      "methods/perturbation/shaders/join.frag", {});
    }
  }

  /// Stencil bits: samples of a level are marked, and keep the marks of the levels before. The
  /// first level's are mirrors, whose two classes differ in the last bit only.
  static constexpr int kMirror = static_cast<int>(raster::SampleClass::PlanarMirror);
  static constexpr int levelBits(std::size_t level) { return level == 0 ? kMirror : 4 << level; }
  static constexpr int levelMask(std::size_t level) {
    return level == 0 ? kMirror | static_cast<int>(raster::SampleClass::Glossy) : 4 << level;
  }
  static_assert((kMirror ^ static_cast<int>(raster::SampleClass::CurvedMirror)) == 1);
  static_assert((4 << (perturbation::kMaxTurns - 1)) <= 0xFF);

  /// Draws what the mirrors show, in `part` alone where there is one.
  void draw(const scene::Camera& camera, const std::optional<raster::Region>& part,
            Services& services) {
    const raster::GBuffer& gbuffer = *services.gbuffer;
    while (levels_.size() < deepest_) addLevel(gbuffer);
    if (!part) stillTiles_.reset();
    const std::size_t count = std::max<std::size_t>(1, deepest_);
    std::vector<raster::Rectangle> drawn;
    for (const raster::Rectangle& r :
         part ? part->rectangles() : std::vector<raster::Rectangle>{mirrors_}) {
      const raster::Rectangle inside = raster::intersection(r, mirrors_);
      if (!inside.empty()) drawn.push_back(inside);
    }
    if (settings_.masks && !part) gbuffer.reflectionFramebuffer.clearColorUint(1, 0);
    if (others_) {
      const std::uint32_t zero = 0;
      unsupportedCount_.write(0, sizeof zero, &zero);
    }
    glDisable(GL_BLEND);
    glEnable(GL_STENCIL_TEST);
    glStencilOp(GL_KEEP, GL_KEEP, GL_KEEP);

    // What was uncovered
    for (std::size_t level = 0; level < levels_.size(); ++level)
      levels_[level].counted = level < count && !drawn.empty();
    if (part) {
      const ColorsKept kept;
      for (std::size_t level = count; level-- > 0;)
        fillUncovered(level, drawn, camera, services, levels_[level].before);
    }

    const raster::GBuffer* still =
        part && keepsStill_ ? &drawStill(*part, count, drawn, camera, services) : nullptr;
    for (std::size_t level = 0; level < count; ++level) {
      const bool goesOn = level + 1 < count;
      if (settings_.masks && level == 0) {
        for (const raster::Rectangle& r : drawn) {
          const raster::ScissoredTo scissor(r);
          gbuffer.reflectionFramebuffer.clearColorUint(1, 0);
        }
      }
      if (still != nullptr) {
        takeStill(level, goesOn, drawn, gbuffer, *still);
        raster::Rectangle bounds;
        for (const raster::Rectangle& r : drawn) bounds = raster::bounding(bounds, r);
        drawObjects(level, goesOn, &Level::all, gbuffer, {Group::Moving}, {&bounds, 1}, camera,
                    services);
      } else {
        clearLevel(level, goesOn, &Level::all, gbuffer, drawn);
        drawObjects(level, goesOn, &Level::all, gbuffer,
                    {Group::Still, Group::Reflector, Group::Moving}, drawn, camera, services);
      }
      fillUncovered(level, drawn, camera, services, levels_[level].after);
    }

    // Join them, deepest first: each is seen through the s of the one before
    glEnable(GL_BLEND);
    glBlendFuncSeparate(GL_DST_ALPHA, GL_ONE_MINUS_DST_ALPHA, GL_ZERO, GL_ONE);
    for (std::size_t level = count; level-- > 1;) {
      levels_[level - 1].all.last.bind();
      join_.use();
      levels_[level].all.color.bind(0);
      levels_[level - 1].all.reflector.bind(1);
      tints_.bind(2);
      glStencilFunc(GL_EQUAL, levelBits(level), static_cast<GLuint>(levelMask(level)));
      fill(drawn);
    }
    glDisable(GL_BLEND);
    glDisable(GL_STENCIL_TEST);
  }

  /// Runs the program on all samples of some rectangles.
  static void fill(std::span<const raster::Rectangle> drawn) {
    for (const raster::Rectangle& r : drawn) {
      const raster::ScissoredTo scissor(r);
      gl::drawFullScreenTriangle();
    }
  }

  /// Virtual objects by what they are, in the order in which they are drawn.
  enum class Group : std::uint8_t { Still, Reflector, Moving };
  static Group groupOf(const frame::Geometry& geometry, int o,
                       const raster::VirtualObject& object) {
    if (object.next + object.nextTotal > 0) return Group::Reflector;
    return geometry.objects[static_cast<std::size_t>(o)].moving ? Group::Moving : Group::Still;
  }

  /// A level's samples: their stencil, and no depth.
  void clearLevel(std::size_t number, bool goesOn, Images Level::*images,
                  const raster::GBuffer& gbuffer, std::span<const raster::Rectangle> drawn) {
    const Images& own = levels_[number].*images;
    const gl::Framebuffer& target = goesOn ? own.goesOn : own.last;
    glBindFramebuffer(GL_READ_FRAMEBUFFER, number == 0 ? gbuffer.framebuffer.id()
                                                       : (levels_[number - 1].*images).last.id());
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, target.id());
    for (const raster::Rectangle& r : drawn) {
      glBlitFramebuffer(r.x0, r.y0, r.x1, r.y1, r.x0, r.y0, r.x1, r.y1, GL_STENCIL_BUFFER_BIT,
                        GL_NEAREST);
      const raster::ScissoredTo scissor(r);
      target.clearDepth(0.0f);
    }
  }

  /// Virtual objects, where the level before shows their reflector. All rectangles at once: changes
  /// of framebuffers are what costs.
  void drawObjects(std::size_t number, bool goesOn, Images Level::*images,
                   const raster::GBuffer& gbuffer, std::initializer_list<Group> groups,
                   std::span<const raster::Rectangle> drawn, const scene::Camera& camera,
                   Services& services) {
    const Images& own = levels_[number].*images;
    (goesOn ? own.goesOn : own.last).bind();
    const int here = levelBits(number);
    const auto mask = static_cast<GLuint>(levelMask(number));
    const raster::VirtualPass pass{
        .reflectors = number == 0 ? gbuffer.object : (levels_[number - 1].*images).reflector,
        .depth = number == 0 ? gbuffer.depth : (levels_[number - 1].*images).depth,
        .continues = goesOn,
        .fresnel = settings_.fresnelSchlick};
    const int next = goesOn ? levelBits(number + 1) : 0;
    glStencilOp(GL_KEEP, GL_KEEP, GL_REPLACE);
    glStencilMask(static_cast<GLuint>(next));
    for (const Group group : groups) {
      std::vector<const raster::VirtualObject*> objects;
      for (const auto& [sequence, type] : types_) {
        if (sequence.size() != number + 1) continue;
        for (const auto& [o, object] : type.objects) {
          if (groupOf(services.geometry, o, object) == group) objects.push_back(&object);
        }
      }
      glStencilFunc(GL_EQUAL, group == Group::Reflector ? here | next : here, mask);
      services.raster->drawVirtualObjects(objects, pass, camera, services.lighting, drawn);
    }
    glStencilMask(0xFF);
    glStencilOp(GL_KEEP, GL_KEEP, GL_KEEP);
  }

  /// Draws what stands still where it is needed, the first time with this camera everywhere: many
  /// frames follow where one does, and a frame's first paths cost far more. Returns the G-buffer of
  /// that.
  const raster::GBuffer& drawStill(const raster::Region& part, std::size_t count,
                                   std::span<const raster::Rectangle> drawn,
                                   const scene::Camera& camera, Services& services) {
    for (std::size_t level = 0; level < count; ++level) {
      Images& images = levels_[level].still;
      if (images.depth.empty()) images = makeImages(*services.gbuffer, false);
      if (level + 1 < count && images.goesOn.empty()) goOn(images, *services.gbuffer);
    }
    raster::Region missing = part;
    if (!stillTiles_) missing.add(mirrors_);
    for (const raster::Rectangle& r : drawn) missing.add(r);
    const raster::GBuffer& gbuffer = services.raster->drawStill(
        *services.gbuffer, camera, services.lighting, missing, services.geometry);
    glEnable(GL_STENCIL_TEST);
    glStencilOp(GL_KEEP, GL_KEEP, GL_KEEP);
    if (stillTiles_) missing.remove(*stillTiles_);
    if (missing.empty()) return gbuffer;
    std::vector<raster::Rectangle> rectangles;
    for (const raster::Rectangle& r : missing.rectangles()) {
      const raster::Rectangle inside = raster::intersection(r, mirrors_);
      if (!inside.empty()) rectangles.push_back(inside);
    }
    for (std::size_t level = 0; level < count; ++level) {
      clearLevel(level, level + 1 < count, &Level::still, gbuffer, rectangles);
      drawObjects(level, level + 1 < count, &Level::still, gbuffer,
                  {Group::Still, Group::Reflector}, rectangles, camera, services);
    }
    if (stillTiles_) missing.add(*stillTiles_);
    stillTiles_ = std::move(missing);
    return gbuffer;
  }

  /// Puts what stands still into a level's images, but where something that moves hides its
  /// reflector.
  void takeStill(std::size_t number, bool goesOn, std::span<const raster::Rectangle> drawn,
                 const raster::GBuffer& gbuffer, const raster::GBuffer& still) {
    const Level& level = levels_[number];
    raster::copyTexels(level.still.depth, level.all.depth, drawn);
    raster::copyTexels(level.still.color, colorOf(level.all, gbuffer), drawn);
    if (goesOn) {
      raster::copyTexels(level.still.direction, level.all.direction, drawn);
      raster::copyTexels(level.still.reflector, level.all.reflector, drawn);
    }
    const ColorsKept kept;
    glColorMaski(2, GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
    (goesOn ? level.all.goesOn : level.all.last).bind();
    hidden_.use();
    (number == 0 ? gbuffer.object : levels_[number - 1].all.reflector).bind(0);
    (number == 0 ? still.object : levels_[number - 1].still.reflector).bind(1);
    glStencilFunc(GL_ALWAYS, 0, 0xFF);
    glStencilOp(GL_KEEP, GL_KEEP, GL_REPLACE);
    fill(drawn);
    glStencilOp(GL_KEEP, GL_KEEP, GL_KEEP);
  }

  /// Samples of a level without depth: the environment; counts them.
  void fillUncovered(std::size_t number, std::span<const raster::Rectangle> drawn,
                     const scene::Camera& camera, Services& services,
                     const gl::FragmentCounter& counter) {
    const raster::GBuffer& gbuffer = *services.gbuffer;
    levels_[number].uncovered.bind();
    gl::Program& uncovered = number == 0 ? uncovered_ : uncoveredInside_;
    services.raster->bindShadingResources(uncovered.id(), services.lighting);
    uncovered.use();
    if (number == 0) {
      gbuffer.normal.bind(0);
      uncovered.set("rayFromSample",
                    scene::rayFromPixel(camera, gbuffer.sampleWidth(), gbuffer.sampleHeight()));
    } else {
      levels_[number - 1].all.direction.bind(0);
    }
    if (number == 0 && !bends_.empty()) {
      gbuffer.object.bind(1);
      bends_.bind(3);
    }
    const bool others = number == 0 && others_;
    if (others) {
      environment_.bind(2);
      unsupportedCount_.bindStorage(1);
      const auto face = static_cast<float>(environment_.width());
      uncovered.set("levelOffset", 0.5f * std::log2(6.0f / kPi * face * face));
      uncovered.set("lastLevel", static_cast<float>(environment_.levels() - 1));
    }
    glEnable(GL_DEPTH_TEST);
    glDepthFunc(GL_EQUAL);
    glDepthMask(GL_FALSE);
    counter.begin();
    glStencilFunc(GL_EQUAL, levelBits(number), static_cast<GLuint>(levelMask(number)));
    fill(drawn);
    if (others) {
      glStencilFunc(GL_EQUAL, static_cast<int>(raster::SampleClass::Glossy), 0xFF);
      fill(drawn);
    }
    counter.end();
    glDepthMask(GL_TRUE);
    glDepthFunc(GL_GREATER);
    glDisable(GL_DEPTH_TEST);
  }

  /// Of the whole frame.
  std::uint64_t countDisocclusions(Services& services, const scene::Camera& camera) const {
    raster::GBuffer& gbuffer = *services.gbuffer;
    raster::GBufferCopy copy;
    raster::readBack(gbuffer, true, copy);
    std::vector<bool> reflects(copy.object.size());
    for (std::size_t at = 0; at < reflects.size(); ++at) {
      if (copy.object[at] == 0 || !(copy.diffuse[4 * at + 3] > 0.0f)) continue;
      const Kind kind = kinds_[copy.object[at] - 1];
      reflects[at] = kind == Kind::Planar || kind == Kind::Implicit;
    }
    std::vector<std::uint8_t> uncovered(reflects.size());
    const std::size_t count = std::max<std::size_t>(1, deepest_);
    for (std::size_t level = 0; level < count; ++level) {
      const std::vector<float> depth = raster::readDepth(levels_[level].all.depth);
      std::vector<std::uint32_t> reflectors(reflects.size());
      if (level + 1 < count) reflectors = raster::readIds(levels_[level].all.reflector);
      for (std::size_t at = 0; at < reflects.size(); ++at) {
        if (!reflects[at]) continue;
        const bool covered = depth[at] > 0.0f;
        if (!covered) uncovered[at] = static_cast<std::uint8_t>(level + 1);
        reflects[at] = covered && reflectors[at] != 0;
      }
    }
    std::vector<std::uint8_t> masks;
    if (settings_.masks) {
      masks = raster::readMasks(gbuffer.masks);
      // What was drawn in parts has those of frames before
      for (std::uint8_t& mask : masks)
        mask = static_cast<std::uint8_t>(mask & ~raster::kMaskDisoccluded);
    }
    const std::uint64_t disoccluded = perturbation::findDisocclusions(
        copy, camera, uncovered, services.lighting, *services.trace, masks);
    if (settings_.masks) gbuffer.masks.upload(0, 0, GL_RED_INTEGER, GL_UNSIGNED_BYTE, masks.data());
    return disoccluded;
  }

  Options options_;
  RunSettings settings_;
  std::vector<Kind> kinds_;  ///< by index of objects
  bool any_ = false;
  std::optional<scene::Camera> lastCamera_;
  std::map<int, PlaneMirror> planes_;   ///< by index of their object
  std::map<Sequence, PathType> types_;  ///< those that were looked for
  std::uint64_t typesLeftOut_ = 0;      ///< sequences beyond max_path_types
  bool warnedOfCoarse_ = false;
  bool warnedOfLeftOut_ = false;
  std::map<int, perturbation::Connectivity> connectivity_;  ///< by index in geometry.objects
  raster::VirtualTriangles triangles_;                      ///< of one object, for the next
  std::size_t deepest_ = 0;  ///< reflections of the longest that occurs
  std::vector<Level> levels_;
  gl::Texture environment_;
  std::uint64_t clampedTexels_ = 0;  ///< of its level 0, by half floats
  bool others_ = false;              ///< reflectors that are not supported
  bool refracts_ = false;
  gl::Buffer bendBuffer_;
  gl::Texture bends_;  ///< by object id, as uncovered.frag has it; empty: all mirror
  gl::Buffer unsupportedCount_;
  std::uint64_t uncoveredSamples_ = 0;  ///< of the whole frame
  /// What stands still is kept: no reflector moves.
  bool keepsStill_ = true;
  std::optional<raster::Region> stillTiles_;
  raster::Rectangle mirrors_;        ///< samples that reflectors may cover
  std::vector<gl::Define> defines_;  ///< of both
  gl::Program uncovered_;
  gl::Program uncoveredInside_;  ///< on later levels
  gl::Program join_;
  gl::Program hidden_;
  std::vector<Vec4> lastTints_;
  gl::Buffer tintBuffer_;
  gl::Texture tints_;
};

std::unique_ptr<Method> make(const config::Value& options) {
  return std::make_unique<Perturbation>(parseOptions(options));
}

}  // namespace

const MethodEntry& perturbationEntry() {
  static const MethodEntry entry{
      "perturbation",
      "virtual objects in planes and implicit surfaces, by perturbing "
      "sampled reflection paths",
      "[Chen2000]",
      {"paths", "virtual_objects", "cube_map", "virtual_draw", "bvh", "disocclusions"},
      schema(),
      make};
  return entry;
}

}  // namespace catoptric::methods
