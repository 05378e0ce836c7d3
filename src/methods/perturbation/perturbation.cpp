#include "methods/perturbation/perturbation.h"

#include <fmt/core.h>

#include <algorithm>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/log.h"
#include "core/parallel.h"
#include "methods/perturbation/disocclusions.h"
#include "methods/perturbation/gaps.h"
#include "methods/perturbation/kinds.h"
#include "methods/perturbation/options.h"
#include "methods/perturbation/path_types.h"
#include "methods/perturbation/plane_culling.h"
#include "methods/perturbation/reports.h"
#include "methods/perturbation/slow_frame_log.h"
#include "methods/perturbation/virtual_layers.h"
#include "methods/perturbation/virtual_objects.h"
#include "scene/animate.h"

namespace catoptric::methods {
namespace perturbation {
namespace {

/// Samples may show a place this part of the reflector's size nearer or farther than the one by
/// which a virtual triangle came about (ours): sheets of different reflections lie farther apart.
constexpr float kDepthSlack = 0.1f;

class Perturbation : public Method {
 public:
  explicit Perturbation(const Options& options)
      : options_(options), types_(options, kinds_), layers_(types_) {}

  std::vector<Unsupported> unsupported(const scene::Scene& scene) const override {
    std::vector<Unsupported> result;
    for (std::size_t i = 0; i < scene.objects.size(); ++i) {
      std::string reason;
      if (kindOf(scene, scene.objects[i], reason) == Kind::Unsupported) {
        result.push_back({static_cast<int>(i) + 1, reason});
      }
    }
    return result;
  }

  MethodPlan plan(const scene::Scene& scene, const RunSettings& settings) const override {
    MethodPlan plan;
    plan.gbuffer = true;
    plan.masks = static_cast<std::uint16_t>(
        raster::kMaskEnvironment |
        (options_.traceGaps ? raster::kMaskRetraced | raster::kMaskSky : 0) |
        (settings.countDisocclusions ? raster::kMaskDisoccluded : 0));
    int planar = 0;
    int curved = 0;
    int own = 0;
    for (std::size_t i = 0; i < scene.objects.size(); ++i) {
      std::string reason;
      const Kind kind = kindOf(scene, scene.objects[i], reason);
      planar += kind == Kind::Planar ? 1 : 0;
      curved += kind == Kind::Implicit ? 1 : 0;
      own += kind != Kind::Diffuse && settings.reflectors.contains(static_cast<int>(i)) ? 1 : 0;
    }
    if (own == 0) return plan;
    plan.bounces = static_cast<int>(options_.bounces);
    const bool several = options_.bounces > 1 && planar + curved > 0;
    if (curved > 0 || several) {
      std::string why = std::to_string(curved) + " implicit surfaces";
      if (several) {
        why += " and " + std::to_string(planar) + " planes, sequences of up to " +
               std::to_string(options_.bounces) + " where a sampled path meets them";
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
    if (planar + curved > 0)
      planObjects(scene, static_cast<std::uint64_t>(planar), static_cast<std::uint64_t>(curved),
                  plan);
    planDrawing(scene, settings, several, plan);
    return plan;
  }

  void prepare(Services& services, const RunSettings& settings) override {
    settings_ = settings;
    for (std::size_t i = 0; i < services.scene.objects.size(); ++i) {
      std::string reason;
      kinds_.push_back(kindOf(services.scene, services.scene.objects[i], reason));
      any_ = any_ ||
             (kinds_.back() != Kind::Diffuse && settings.reflectors.contains(static_cast<int>(i)));
    }
    types_.setFirst(settings.reflectors);
    warnOfNearest(services.scene);
    if (any_) layers_.prepare(services, settings, kinds_);
  }

  void render(const FrameInput& input, Services& services, FrameOutput& output) override {
    output.counters = zeros(perturbationCounters());
    if (!any_) {
      if (settings_.masks && settings_.reflectors.all())
        services.gbuffer->reflectionFramebuffer.clearColorUint(1, 0);
      return;
    }
    output.changedReflection = update(input, services, output.counters);
    services.timer.measure("virtual_draw", [&] {
      layers_.draw(input.frame.camera, output.changedReflection, services);
    });
    layers_.count(output.changedReflection.has_value(), output.counters);
    if (options_.traceGaps) {
      services.timer.measure("recompute",
                             [&] { traceGaps(services, input.frame.camera, output.counters); });
      output.changedReflection.reset();  // a gap may lie, and show, anywhere
    }
    if (settings_.countDisocclusions) {
      services.timer.measure("disocclusions", [&] {
        output.counters["disoccluded"] = countDisocclusions(services, input.frame.camera);
      });
    }
  }

 private:
  /// Paths as they were sampled miss most of what a lens shows: they change too fast.
  void warnOfNearest(const scene::Scene& scene) const {
    if (options_.path.order != Order::Nearest) return;
    for (std::size_t i = 0; i < kinds_.size(); ++i) {
      const scene::Object& object = scene.objects[i];
      const scene::Material& material = scene.materials[static_cast<std::size_t>(object.material)];
      if (kinds_[i] != Kind::Implicit || !(material.refraction > 0.0f)) continue;
      log::warning(
          "perturbation: \"" + object.name +
          "\" refracts; with \"order\": \"nearest\" most of what is seen through it is missing, "
          "and the environment or black shows instead. Set order to linear, quadratic or auto");
      return;
    }
  }

  /// The virtual objects: each one in each sequence of mirrors.
  void planObjects(const scene::Scene& scene, std::uint64_t planar, std::uint64_t curved,
                   MethodPlan& plan) const {
    std::uint64_t vertices = 0;
    std::uint64_t triangles = 0;
    for (const scene::Object& object : scene.objects) {
      const scene::Mesh& mesh = scene.meshes[static_cast<std::size_t>(object.mesh)];
      vertices += mesh.positions.size();
      triangles += mesh.indices.size() / 3;
    }
    const std::uint64_t types = mostTypes(planar + curved);
    const std::uint64_t ofPlanes = mostTypes(planar);
    const std::uint64_t single = std::min(planar, ofPlanes);
    const std::uint64_t all =
        types * scene.objects.size() * kObjectBytes + ofPlanes * triangles * kTriangleBytes +
        vertices * (single * planarVertexBytes(1) + (ofPlanes - single) * planarVertexBytes(2) +
                    (types - ofPlanes) * kVertexBytes);
    plan.items.push_back(
        {"resource", "virtual objects",
         "at most, before edges are halved: " + std::to_string(scene.objects.size()) +
             " objects in " + std::to_string(types) + " sequences of mirrors" +
             (all > options_.memoryBytes ? ", more than memory_mib allows: the others are left out"
                                         : "; with halved edges no more than memory_mib"),
         std::min(all, options_.memoryBytes)});
  }

  /// What is drawn, read back and allocated for it; `several`: reflections in reflections.
  void planDrawing(const scene::Scene& scene, const RunSettings& settings, bool several,
                   MethodPlan& plan) const {
    const std::uint64_t samples = settings.sampleCount();
    const std::vector<bool> moving = scene::movingObjects(scene);
    const bool kept = std::ranges::find(moving, true) != moving.end();
    plan.items.push_back({"pass", "virtual_draw", "with a depth buffer of their own", 0});
    plan.items.push_back({"resource", "virtual depth", "depth and stencil", samples * 8});
    if (kept)
      plan.items.push_back({"resource", "still virtual objects",
                            "colour, depth and stencil of what stands still while the camera does",
                            samples * 24});
    if (several) {
      plan.items.push_back({"resource", "levels of virtual objects",
                            "at most, for reflections in reflections: colour, depth and stencil; "
                            "mirrored directions and reflectors of the levels before" +
                                std::string(kept ? "; twice, for what stands still" : ""),
                            (kept ? 2 : 1) * (options_.bounces - 1) * samples * (16 + 8 + 16 + 4)});
    }
    if (options_.traceGaps) {
      plan.trace = true;
      plan.items.push_back({"pass", "recompute",
                            "asked for: gaps: trace, where no virtual object covers a sample", 0});
      plan.items.push_back({"resource", "G-buffer copy and traced samples",
                            "what is read back and uploaded for that",
                            samples * (16 + 16 + 4 + 4 + 16)});
    }
    if (settings.countDisocclusions) {
      plan.trace = true;
      plan.items.push_back({"pass", "disocclusions", "asked for: count_disocclusions", 0});
      plan.items.push_back(
          {"resource", "G-buffer copy", "what is read back for that", samples * (16 + 16 + 4 + 4)});
    }
  }

  /// Sequences of so many reflectors, as far as they are followed.
  std::uint64_t mostTypes(std::uint64_t reflectors) const {
    std::uint64_t all = 0;
    std::uint64_t ofLength = 1;
    for (std::size_t length = 0; length < options_.bounces; ++length) {
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
           options_.bounces * sizeof(Bounce<double>);
  }

  /// Recomputes what the changes since the last frame ask for. Returns the samples in which that
  /// and what moved may show; none: all.
  std::optional<raster::Region> update(const FrameInput& input, Services& services,
                                       Counters& counters) {
    // What did not fit depends on what was there before: it would be another in a run of its own
    const bool all =
        input.firstOfSequence || lastCamera_ != input.frame.camera || objectsLeftOut_ > 0;
    lastCamera_ = input.frame.camera;
    std::optional<raster::Region> part = input.changedSamples;
    if (all) part.reset();
    const View view{input.frame.camera, settings_.width, settings_.height};
    const auto changed = [&](int object) {
      return std::ranges::find(input.changedObjects, object) != input.changedObjects.end();
    };
    SlowFrameLog frameLog;
    services.timer.measure("paths", [&] {
      types_.forget(all, changed);
      for (int r = 0; r < static_cast<int>(kinds_.size()); ++r) {
        const Kind kind = kinds_[static_cast<std::size_t>(r)];
        if ((kind != Kind::Planar && kind != Kind::Implicit) || !(all || changed(r))) continue;
        part.reset();
        if (kind == Kind::Planar) types_.setPlane(services.geometry, r);
      }
      types_.find(services.scene, services.geometry, view, frameLog);
      layers_.setTints(types_.number(services.scene));
    });
    services.timer.measure("virtual_objects", [&] {
      updateObjects(changed, view, services, part, frameLog, counters);
    });

    // Nothing of it shows beside the mirrors
    if (!part) {
      layers_.findMirrors(input.frame.camera, services, kinds_);
      return std::nullopt;
    }
    part->clip(layers_.mirrors());
    return part;
  }

  /// What an update has made.
  struct Made {
    TriangleCounts counts;
    std::vector<std::string> coarse;
    std::vector<std::string> leftOut;
    std::uint64_t beyond = 0;  ///< objects in sequences of mirrors that memory_mib leaves out
    std::string firstBeyond;
    std::uint64_t bytes = 0;  ///< of all virtual objects, also those that were there
  };

  /// Makes the virtual objects that are missing or have changed, and adds to `part` where those
  /// showed before and show now.
  template <class Changed>
  void updateObjects(const Changed& changed, const View& view, Services& services,
                     std::optional<raster::Region>& part, SlowFrameLog& frameLog,
                     Counters& counters) {
    const bool fresh =
        std::ranges::all_of(types_, [](const auto& type) { return type.second.bytes.empty(); });
    Made made = makeObjects(changed, view, services, part, frameLog);
    std::uint64_t vertices = 0;
    for (const frame::ObjectRange& range : services.geometry.objects)
      vertices = std::max<std::uint64_t>(vertices, range.vertexCount);
    std::uint64_t largest = 0;
    for (const auto& [sequence, type] : types_)
      largest = std::max(largest, leastBytes(vertices, type));
    if (!fresh && made.bytes + largest > options_.memoryBytes) {
      // What fits must not depend on what was there: all in their order, as in a run of its own
      part.reset();
      for (auto& [sequence, type] : types_) type.forgetObjects();
      made = makeObjects(changed, view, services, part, frameLog);
    }
    for (const auto& [sequence, type] : types_) {
      if (!type.occurs()) continue;
      ++counters["path_types"];
      if (type.paths) made.counts.paths.paths += type.paths->pathCount();
    }
    types_.linkObjects(services.scene);
    putCounts(made.counts, counters);
    objectsLeftOut_ = made.beyond;
    counters["objects_left_out"] = objectsLeftOut_;
    warnOfCoarse(made.coarse);
    warnOfLeftOut(made.leftOut, made.counts.paths.leftOut);
    warnOfBeyond(made);
  }

  template <class Changed>
  Made makeObjects(const Changed& changed, const View& view, Services& services,
                   std::optional<raster::Region>& part, SlowFrameLog& frameLog) {
    const frame::Geometry& geometry = services.geometry;
    PlaneCulling culling(geometry, view.camera, services.gbuffer->sampleWidth(),
                         services.gbuffer->sampleHeight());
    Made made;
    for (auto& [sequence, type] : types_) {
      if (!type.occurs()) continue;
      type.bytes.resize(geometry.objects.size(), PathType::kUnknown);
      for (int o = 0; o < static_cast<int>(geometry.objects.size()); ++o) {
        std::uint64_t& bytes = type.bytes[static_cast<std::size_t>(o)];
        if (changed(o)) bytes = PathType::kUnknown;
        if (bytes != PathType::kUnknown) made.bytes += bytes;
      }
    }
    for (auto& [sequence, type] : types_) {
      if (!type.occurs()) continue;
      const int body = inside(services.scene, sequence);
      std::vector<int> wanted;
      for (int o = 0; o < static_cast<int>(geometry.objects.size()); ++o) {
        std::uint64_t& bytes = type.bytes[static_cast<std::size_t>(o)];
        if (bytes != PathType::kUnknown) continue;
        bytes = 0;
        const auto old = type.objects.find(o);
        if (old != type.objects.end()) {
          if (part) part->add(old->second.where);
          type.objects.erase(old);
        }
        if (body >= 0 && body != o) continue;
        if (!type.planes.empty() && culling.hides(type.planes, sequence[0].object, o)) continue;
        wanted.push_back(o);
      }
      for (std::size_t first = 0; first < wanted.size(); first += kAtOnce) {
        const std::size_t count = std::min(kAtOnce, wanted.size() - first);
        makeSome(sequence, type, std::span(wanted).subspan(first, count), view, services, part,
                 frameLog, made);
      }
    }
    return made;
  }

  /// Objects of a type that are made side by side: what one thread does of each overlaps. Ours.
  static constexpr std::size_t kAtOnce = 8;
  /// One of them.
  struct Making {
    VirtualTriangles triangles;  ///< their memory serves the next
    TriangleCounts counts;
    bool shows = false;
  };

  /// Makes up to kAtOnce objects, of which those are kept, in their order, that memory_mib allows.
  void makeSome(const Sequence& sequence, PathType& type, std::span<const int> objects,
                const View& view, Services& services, std::optional<raster::Region>& part,
                SlowFrameLog& frameLog, Made& made) {
    const frame::Geometry& geometry = services.geometry;
    const auto tooMany = [&](int o) {
      const frame::ObjectRange& range = geometry.objects[static_cast<std::size_t>(o)];
      return made.bytes + leastBytes(range.vertexCount, type) > options_.memoryBytes;
    };
    for (const int o : objects) connectivity_.try_emplace(o);
    making_.resize(std::max(making_.size(), objects.size()));
    parallelFor(objects.size(), 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        making_[i].counts = {};
        making_[i].shows = false;
        if (tooMany(objects[i])) continue;
        frameLog.begin(nameOf(services.scene, sequence, objects[i]));
        making_[i].shows = findTriangles(geometry, sequence.back().object, type, objects[i], view,
                                         frameLog, making_[i]);
      }
    });
    for (std::size_t i = 0; i < objects.size(); ++i) {
      const int o = objects[i];
      Making& one = making_[i];
      if (tooMany(o)) {
        if (made.beyond++ == 0) made.firstBeyond = nameOf(services.scene, sequence, o);
        continue;
      }
      made.counts.add(one.counts);
      if (one.counts.coarse > 0) made.coarse.push_back(nameOf(services.scene, sequence, o));
      if (one.counts.paths.leftOut > 0) made.leftOut.push_back(nameOf(services.scene, sequence, o));
      // What curved mirrors show nothing of has taken its time, which memory_mib bounds, too
      std::uint64_t& bytes = type.bytes[static_cast<std::size_t>(o)];
      bytes = type.planes.empty() ? one.counts.vertices * kVertexBytes : 0;
      if (one.shows) {
        VirtualObject drawn(one.triangles, services.raster->scene(), view.camera,
                            services.gbuffer->sampleWidth(), services.gbuffer->sampleHeight());
        if (!drawn.triangles.empty()) {
          bytes = std::max(bytes, drawn.bytes());
          if (part) part->add(drawn.where);
          type.objects.emplace(o, std::move(drawn));
        }
      }
      made.bytes += bytes;
    }
  }

  /// What an object takes at least in a sequence of reflectors, unless it is not seen at all.
  static std::uint64_t leastBytes(std::uint64_t vertices, const PathType& type) {
    const std::size_t planes = type.planes.size();
    return kObjectBytes + vertices * (planes > 0 ? planarVertexBytes(planes) : kVertexBytes);
  }

  void putCounts(const TriangleCounts& counts, Counters& counters) const {
    for (const auto& [sequence, type] : types_) {
      if (!type.paths) continue;
      counters["total_reflection"] += type.paths->totalReflections();
      counters["path_types_missed"] += type.paths->missed() ? 1 : 0;
    }
    counters["path_types_left_out"] = types_.leftOut();
    counters["paths"] = counts.paths.paths;
    counters["vertices"] = counts.vertices;
    counters["triangles"] = counts.triangles;
    counters["dropped_triangles"] = counts.dropped;
    counters["coarse_objects"] = counts.coarse;
    counters["linear"] = counts.paths.linear;
    counters["quadratic"] = counts.paths.quadratic;
    counters["retraced"] = counts.paths.retraced;
    counters["not_converged"] = counts.paths.notConverged;
    counters["reflections_left_out"] = counts.paths.leftOut;
  }

  /// What one path type, whose last turn is at `last`, shows of one object; false where it never
  /// does.
  bool findTriangles(const frame::Geometry& geometry, int last, const PathType& type, int o,
                     const View& view, SlowFrameLog& frameLog, Making& one) {
    const bool own = o == last;
    if (geometry.objects[static_cast<std::size_t>(o)].indexCount == 0) return false;
    if (own && !(type.planes.empty() && type.paths->seesItself())) return false;
    if (type.planes.empty()) {
      TriangleOptions options = options_.triangles;
      options.maxTraced = std::max(
          kFewestTraced, static_cast<std::size_t>(static_cast<double>(options_.tracedPerPixel) *
                                                  view.width * view.height));
      options.lookedUp = [&](std::size_t places) { frameLog.add(places); };
      virtualTriangles(geometry, o, *type.paths, own, view, options_.path.order, options,
                       connectivity_.at(o), one.counts, one.triangles);
      one.triangles.depthSlack = kDepthSlack * static_cast<float>(type.paths->size());
    } else {
      mirroredTriangles(geometry, o, type.planes, view.camera.eye(), one.counts, one.triangles);
    }
    return true;
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
    log::warning(
        fmt::format("perturbation: the reflections of {} are coarser than tessellation_error, "
                    "because traced_per_pixel ({:g}) limits the splitting of edges. Raise one of "
                    "them, lower bounces, or use the method traced (counter coarse_objects)",
                    firstOf(objects), options_.tracedPerPixel));
  }

  /// Says once in a run that points show more often than is followed.
  void warnOfLeftOut(const std::vector<std::string>& objects, std::uint64_t reflections) {
    if (objects.empty() || warnedOfLeftOut_) return;
    warnedOfLeftOut_ = true;
    log::warning(
        "perturbation: " + firstOf(objects) + ": some points have more than " +
        std::to_string(kMaxReflections) + " reflections; " + std::to_string(reflections) +
        " reflections are left out. The method traced shows all (counter reflections_left_out)");
  }

  /// Says once in a run that mirrors show fewer objects than there are.
  void warnOfBeyond(const Made& made) {
    if (made.beyond == 0 || warnedOfBeyond_) return;
    warnedOfBeyond_ = true;
    log::warning(
        "perturbation: " + std::to_string(made.beyond) +
        " reflected objects (first: " + made.firstBeyond +
        ") are left out, and mirrors show the environment instead: virtual objects need more "
        "than memory_mib (" +
        std::to_string(options_.memoryBytes >> 20) +
        "). Raise it, or use the method traced, which renders many mirrors in less time "
        "(counter objects_left_out)");
  }

  /// Which of a sample's reflections no virtual object covers, counted from 1; 0: none. `copy` is
  /// filled for it.
  std::vector<std::uint8_t> uncovered(const raster::GBuffer& gbuffer,
                                      raster::GBufferCopy& copy) const {
    raster::readBack(gbuffer, true, copy);
    std::vector<bool> reflects(copy.object.size());
    for (std::size_t at = 0; at < reflects.size(); ++at) {
      if (copy.object[at] == 0 || !(copy.diffuse[4 * at + 3] > 0.0f)) continue;
      const Kind kind = kinds_[copy.object[at] - 1];
      reflects[at] = (kind == Kind::Planar || kind == Kind::Implicit) &&
                     settings_.reflectors.contains(static_cast<int>(copy.object[at]) - 1);
    }
    return layers_.uncoveredReflections(std::move(reflects));
  }

  void traceGaps(Services& services, const scene::Camera& camera, Counters& counters) {
    raster::GBufferCopy copy;
    const std::vector<std::uint8_t> open = uncovered(*services.gbuffer, copy);
    const trace::ReflectionOptions paths{.bounces = static_cast<int>(options_.bounces),
                                         .fresnelSchlick = settings_.fresnelSchlick};
    const FilledGaps filled =
        fillGaps(copy, camera, open, paths, settings_.masks, services, gapUpload_);
    counters["traced_gaps"] = filled.samples;
    counters["refused"] = filled.rays.refused;
    counters["not_finite"] = filled.rays.notFinite;
  }

  /// Of the whole frame.
  std::uint64_t countDisocclusions(Services& services, const scene::Camera& camera) const {
    raster::GBuffer& gbuffer = *services.gbuffer;
    raster::GBufferCopy copy;
    const std::vector<std::uint8_t> open = uncovered(gbuffer, copy);
    std::vector<std::uint16_t> masks;
    if (settings_.masks) {
      masks = raster::readMasks(gbuffer.masks);
      // What was drawn in parts has those of frames before
      for (std::uint16_t& mask : masks)
        mask = static_cast<std::uint16_t>(mask & ~raster::kMaskDisoccluded);
    }
    const std::uint64_t disoccluded =
        findDisocclusions(copy, camera, open, services.lighting, *services.trace, masks);
    if (settings_.masks) raster::writeMasks(gbuffer.masks, masks);
    return disoccluded;
  }

  Options options_;
  RunSettings settings_;
  std::vector<Kind> kinds_;  ///< by index of objects
  bool any_ = false;
  std::optional<scene::Camera> lastCamera_;
  PathTypes types_;
  VirtualLayers layers_;
  ReflectionUpload gapUpload_;
  bool warnedOfCoarse_ = false;
  bool warnedOfLeftOut_ = false;
  bool warnedOfBeyond_ = false;
  std::uint64_t objectsLeftOut_ = 0;          ///< in the last frame
  std::map<int, Connectivity> connectivity_;  ///< by index in geometry.objects
  std::vector<Making> making_;
};

std::unique_ptr<Method> make(const config::Value& options) {
  return makeMethod(optionTable().parse(options));
}

}  // namespace

std::unique_ptr<Method> makeMethod(const Options& options) {
  return std::make_unique<Perturbation>(options);
}

}  // namespace perturbation

const MethodEntry& perturbationEntry() {
  static const MethodEntry entry{
      .id = "perturbation",
      .summary =
          "draws virtual objects behind planes and implicit surfaces, by perturbing sampled "
          "reflection paths",
      .paper = "[Chen2000]",
      .steps = perturbationSteps(),
      .counters = perturbationCounters(),
      // Pictures so small have more paths to their folds than traced_per_pixel allows by default
      .tests = {.small = R"({"traced_per_pixel": 1000})",
                .refracting = R"({"bounces": 2, "tessellation_error": 2})",
                .variants = {R"({"gaps": "trace"})"},
                .planeMirrorPercent = 0.1},
      .options = perturbation::optionTable().schema(),
      .make = perturbation::make,
      .refusesReflectors = true};
  return entry;
}

}  // namespace catoptric::methods
