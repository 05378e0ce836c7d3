#include "methods/perturbation/perturbation.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "gl/shader.h"
#include "methods/perturbation/reflector.h"
#include "methods/perturbation/virtual_objects.h"
#include "raster/materials.h"

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
           .maximum = 1},
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
          {.name = "unsupported",
           .type = config::FieldType::String,
           .help = "reflectors that are neither planar nor implicit surfaces, or not mirrors: an "
                   "error, or a cube map of the diffuse scene (counted)",
           .defaultText = "\"error\"",
           .allowed = {"error", "environment_map"}},
      }};
  return options;
}

struct Options {
  perturbation::PathOptions path;
  perturbation::TriangleOptions triangles;
  bool environmentMap = false;  ///< for what is not supported
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
  options.path.groups = text("several") == "groups";
  options.path.candidates = integer("candidates");
  options.path.groupAngleRad = radians(number("group_angle"));
  options.path.groupDistance = number("group_distance");
  options.path.errorPixels = number("error");
  options.triangles.errorPixels = number("tessellation_error");
  options.environmentMap = text("unsupported") == "environment_map";
  return options;
}

constexpr int kCubeMapFaceSize = 256;
/// Samples may show a place this part of the reflector's size nearer or farther than the one by
/// which a virtual triangle came about (ours): sheets of different reflections lie farther apart.
constexpr float kDepthSlack = 0.1f;

/// Stencil of mirrors but for the last bit.
constexpr int kMirror = static_cast<int>(raster::SampleClass::PlanarMirror);

enum class Kind : std::uint8_t { Diffuse, Planar, Implicit, Unsupported };

/// What kind of reflector an object is; why it is not supported.
Kind kindOf(const scene::Scene& scene, const scene::Object& object, std::string& reason) {
  const scene::Material& material = scene.materials[object.material];
  const raster::SampleClass kind = raster::materialClass(scene, material);
  if (kind == raster::SampleClass::Diffuse) return Kind::Diffuse;
  if (kind == raster::SampleClass::Glossy) {
    reason = "is glossy: perturbation does mirrors (g = 0)";
  } else if (material.normalTexture.used()) {
    reason = "has a normal map";
  } else if (object.planar) {
    return Kind::Planar;
  } else if (scene.meshes[object.mesh].surface) {
    return Kind::Implicit;
  } else {
    reason = "is neither planar nor an implicit surface (shape \"implicit\")";
  }
  return Kind::Unsupported;
}

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
                          reason + "; \"unsupported\": \"environment_map\" lets it through"});
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
    const auto samples = static_cast<std::uint64_t>(settings.width) * settings.height *
                         settings.samples * settings.samples;
    if (curved > 0) {
      plan.items.push_back({"pass", "paths",
                            std::to_string(curved) + " implicit surfaces; again when the camera or "
                                                     "the reflector moves",
                            0});
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
    return plan;
  }

  void prepare(Services& services, const RunSettings& settings) override {
    settings_ = settings;
    std::vector<std::uint32_t> flags{0};
    bool others = false;
    for (const scene::Object& object : services.scene.objects) {
      std::string reason;
      kinds_.push_back(kindOf(services.scene, object, reason));
      any_ = any_ || kinds_.back() != Kind::Diffuse;
      others = others || kinds_.back() == Kind::Unsupported;
      flags.push_back(kinds_.back() == Kind::Unsupported ? 1 : 0);
    }
    if (!any_) return;
    std::vector<gl::Define> defines = raster::SceneRaster::shadingDefines(services.lighting);
    defines.push_back({"MASKS", settings.masks ? "1" : "0"});
    defines.push_back({"UNSUPPORTED", others ? "1" : "0"});
    uncovered_ = gl::Program::fullScreen(
        "uncovered samples", "methods/perturbation/shaders/uncovered.frag", std::move(defines));
    for (gl::Buffer* counts : {&countsBefore_, &countsAfter_})
      *counts = gl::Buffer("counts of uncovered samples", 2 * sizeof(std::uint32_t));
    const raster::GBuffer& gbuffer = *services.gbuffer;
    depth_ = gl::Texture::make2D("virtual depth", GL_DEPTH32F_STENCIL8, gbuffer.sampleWidth(),
                                 gbuffer.sampleHeight());
    drawTarget_ =
        gl::Framebuffer("virtual objects", {{.texture = gbuffer.reflection}}, {.texture = depth_});
    uncoveredTarget_ =
        settings.masks
            ? gl::Framebuffer("uncovered samples",
                              {{.texture = gbuffer.reflection}, {.texture = gbuffer.masks}},
                              {.texture = depth_})
            : gl::Framebuffer("uncovered samples", {{.texture = gbuffer.reflection}},
                              {.texture = depth_});
    if (others) {
      flagBuffer_ = gl::Buffer("unsupported reflectors", std::span<const std::uint32_t>(flags));
      flags_ = gl::Texture::makeBuffer("unsupported reflectors", GL_R32UI, flagBuffer_);
    }
  }

  void render(const FrameInput& input, Services& services, FrameOutput& output) override {
    for (const char* name :
         {"paths", "vertices", "triangles", "dropped_triangles", "linear", "quadratic", "retraced",
          "not_converged", "environment", "unsupported_reflector", "clamped_cube_map"})
      output.counters[name] = 0;
    if (!any_) {
      if (settings_.masks) services.gbuffer->reflectionFramebuffer.clearColorUint(1, 0);
      return;
    }
    output.changedReflection = update(input, services, output.counters);
    if (!flags_.empty() && (environment_.empty() || services.scene.animated())) {
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
    if (!output.changedReflection) uncoveredCounts_ = {};
    std::array<std::uint32_t, 2> before{};
    std::array<std::uint32_t, 2> after{};
    countsBefore_.read(0, sizeof before, before.data());
    countsAfter_.read(0, sizeof after, after.data());
    for (std::size_t i = 0; i < after.size(); ++i) uncoveredCounts_[i] += after[i] - before[i];
    output.counters["environment"] = uncoveredCounts_[0];
    output.counters["unsupported_reflector"] = uncoveredCounts_[1];
  }

 private:
  /// What is kept of one reflector while it and the camera stand still.
  struct Kept {
    std::optional<perturbation::Reflector> reflector;  ///< of an implicit surface
    std::optional<perturbation::Plane<double>> plane;
    std::map<int, raster::VirtualObject> objects;  ///< by index in geometry.objects
  };

  /// Recomputes what the changes since the last frame ask for. Returns the samples in which that
  /// and what moved may show; none: all.
  std::optional<raster::Rectangle> update(const FrameInput& input, Services& services,
                                          Counters& counters) {
    const frame::Geometry& geometry = services.geometry;
    const scene::Camera& camera = input.frame.camera;
    const bool all = input.firstOfSequence || lastCamera_ != camera;
    lastCamera_ = camera;
    std::optional<raster::Rectangle> part = input.changedSamples;
    if (all || !flags_.empty()) part.reset();
    const perturbation::View view{camera, settings_.width, settings_.height};
    const auto changed = [&](int object) {
      return std::ranges::find(input.changedObjects, object) != input.changedObjects.end();
    };

    // Reflectors
    services.timer.measure("paths", [&] {
      for (int r = 0; r < static_cast<int>(kinds_.size()); ++r) {
        const Kind kind = kinds_[static_cast<std::size_t>(r)];
        if (kind != Kind::Planar && kind != Kind::Implicit) continue;
        if (!all && !changed(r)) continue;
        part.reset();
        const frame::ObjectRange& range = geometry.objects[static_cast<std::size_t>(r)];
        kept_.erase(r);
        Kept& kept = kept_[r];
        if (kind == Kind::Planar) {
          kept.plane = planeOf(geometry, range);
        } else {
          const perturbation::Turn turn{
              &geometry.surfaces[static_cast<std::size_t>(range.surface)].surface, range.bounds};
          kept.reflector.emplace(std::span(&turn, 1), nullptr, geometry.bounds, view,
                                 options_.path);
        }
      }
    });

    // What they show
    services.timer.measure("virtual_objects", [&] {
      perturbation::TriangleCounts counts;
      for (auto& [r, kept] : kept_) {
        if (kept.reflector) counts.paths.paths += kept.reflector->pathCount();
        for (int o = 0; o < static_cast<int>(geometry.objects.size()); ++o) {
          if (kept.objects.contains(o) && !changed(o)) continue;
          if (o == r && !(kept.reflector && kept.reflector->seesItself())) continue;
          const auto old = kept.objects.find(o);
          if (old != kept.objects.end()) {
            if (part) part = raster::bounding(*part, old->second.where);
            kept.objects.erase(old);
          }
          if (geometry.objects[static_cast<std::size_t>(o)].indexCount == 0 ||
              (kept.reflector && kept.reflector->pathCount() == 0))
            continue;
          raster::VirtualTriangles triangles =
              kept.plane
                  ? perturbation::mirroredTriangles(geometry, o, {&*kept.plane, 1}, counts)
                  : perturbation::virtualTriangles(geometry, o, *kept.reflector, o == r, view,
                                                   options_.path.order, options_.triangles, counts);
          triangles.reflector = r + 1;
          if (kept.reflector)
            triangles.depthSlack = kDepthSlack * static_cast<float>(kept.reflector->size());
          const raster::VirtualObject& made =
              kept.objects
                  .emplace(o,
                           raster::VirtualObject(triangles, camera, services.gbuffer->sampleWidth(),
                                                 services.gbuffer->sampleHeight()))
                  .first->second;
          if (part) part = raster::bounding(*part, made.where);
        }
      }
      counters["paths"] = counts.paths.paths;
      counters["vertices"] = counts.vertices;
      counters["outside_octree"] = counts.outside;
      counters["triangles"] = counts.triangles;
      counters["dropped_triangles"] = counts.dropped;
      counters["linear"] = counts.paths.linear;
      counters["quadratic"] = counts.paths.quadratic;
      counters["retraced"] = counts.paths.retraced;
      counters["not_converged"] = counts.paths.notConverged;
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
    return raster::intersection(*part, mirrors_);
  }

  static perturbation::Plane<double> planeOf(const frame::Geometry& geometry,
                                             const frame::ObjectRange& range) {
    const glm::dvec3 n = glm::normalize(glm::dvec3(geometry.attributes[range.firstVertex].normal));
    return {{{n.x, n.y, n.z}}, glm::dot(n, glm::dvec3(geometry.positions[range.firstVertex]))};
  }

  /// Draws what the mirrors show, in `part` alone where there is one.
  void draw(const scene::Camera& camera, const std::optional<raster::Rectangle>& part,
            Services& services) {
    const raster::GBuffer& gbuffer = *services.gbuffer;
    if (settings_.masks && !part) gbuffer.reflectionFramebuffer.clearColorUint(1, 0);
    const raster::Rectangle drawn = part.value_or(mirrors_);
    const std::array<std::uint32_t, 2> zeros{};
    for (gl::Buffer* counts : {&countsBefore_, &countsAfter_})
      counts->write(0, sizeof zeros, zeros.data());
    if (drawn.empty()) return;
    const raster::ScissoredTo scissor(drawn);
    glDisable(GL_BLEND);
    glEnable(GL_STENCIL_TEST);
    glStencilOp(GL_KEEP, GL_KEEP, GL_KEEP);
    if (part) {
      uncoveredTarget_.bind();
      glColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
      fillUncovered(camera, services, countsBefore_);
      glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
      if (settings_.masks) gbuffer.reflectionFramebuffer.clearColorUint(1, 0);
    }

    // The stencil classes of the samples, and no depth
    glBindFramebuffer(GL_READ_FRAMEBUFFER, gbuffer.reflectionFramebuffer.id());
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, drawTarget_.id());
    glBlitFramebuffer(drawn.x0, drawn.y0, drawn.x1, drawn.y1, drawn.x0, drawn.y0, drawn.x1,
                      drawn.y1, GL_STENCIL_BUFFER_BIT, GL_NEAREST);
    drawTarget_.clearDepth(0.0f);

    // Virtual objects on mirrors, which differ in the last bit only
    using raster::SampleClass;
    static_assert((static_cast<int>(SampleClass::PlanarMirror) ^
                   static_cast<int>(SampleClass::CurvedMirror)) == 1);
    drawTarget_.bind();
    glStencilFunc(GL_EQUAL, kMirror, 0xFE);
    std::vector<const raster::VirtualObject*> objects;
    for (const auto& [r, kept] : kept_) {
      for (const auto& [o, object] : kept.objects) objects.push_back(&object);
    }
    services.raster->drawVirtualObjects(objects, gbuffer, camera, services.lighting, drawn);

    // What they leave
    uncoveredTarget_.bind();
    fillUncovered(camera, services, countsAfter_);
    glDisable(GL_STENCIL_TEST);
  }

  /// Mirror samples of the bound framebuffer without depth: the environment; counts them.
  void fillUncovered(const scene::Camera& camera, Services& services, const gl::Buffer& counts) {
    const raster::GBuffer& gbuffer = *services.gbuffer;
    services.raster->bindShadingResources(uncovered_.id(), services.lighting);
    uncovered_.use();
    gbuffer.normal.bind(0);
    counts.bindStorage(1);
    uncovered_.set("rayFromSample",
                   scene::rayFromPixel(camera, gbuffer.sampleWidth(), gbuffer.sampleHeight()));
    if (!flags_.empty()) {
      gbuffer.object.bind(1);
      environment_.bind(2);
      flags_.bind(3);
      const auto face = static_cast<float>(environment_.width());
      uncovered_.set("levelOffset", 0.5f * std::log2(6.0f / kPi * face * face));
      uncovered_.set("lastLevel", static_cast<float>(environment_.levels() - 1));
    }
    glEnable(GL_DEPTH_TEST);
    glDepthFunc(GL_EQUAL);
    glDepthMask(GL_FALSE);
    glStencilFunc(GL_EQUAL, kMirror, 0xFE);
    gl::drawFullScreenTriangle();
    if (!flags_.empty()) {
      glStencilFunc(GL_EQUAL, static_cast<int>(raster::SampleClass::Glossy), 0xFF);
      gl::drawFullScreenTriangle();
    }
    glDepthMask(GL_TRUE);
    glDepthFunc(GL_GREATER);
    glDisable(GL_DEPTH_TEST);
  }

  Options options_;
  RunSettings settings_;
  std::vector<Kind> kinds_;  ///< by index of objects
  bool any_ = false;
  std::optional<scene::Camera> lastCamera_;
  std::map<int, Kept> kept_;  ///< by index of the reflector
  gl::Texture environment_;
  std::uint64_t clampedTexels_ = 0;  ///< of its level 0, by half floats
  gl::Buffer flagBuffer_;
  gl::Texture flags_;
  gl::Texture depth_;
  gl::Framebuffer drawTarget_;
  gl::Framebuffer uncoveredTarget_;
  gl::Buffer countsBefore_;  ///< of uncovered samples, in what is drawn
  gl::Buffer countsAfter_;
  gl::Program uncovered_;
  std::array<std::uint32_t, 2> uncoveredCounts_{};  ///< of the whole frame
  raster::Rectangle mirrors_;                       ///< samples that reflectors may cover
};

std::unique_ptr<Method> make(const config::Value& options) {
  return std::make_unique<Perturbation>(parseOptions(options));
}

}  // namespace

const MethodEntry& perturbationEntry() {
  static const MethodEntry entry{"perturbation",
                                 "virtual objects in planes and implicit surfaces, by perturbing "
                                 "sampled reflection paths",
                                 "[Chen2000]",
                                 {"paths", "virtual_objects", "cube_map", "virtual_draw"},
                                 schema(),
                                 make};
  return entry;
}

}  // namespace catoptric::methods
