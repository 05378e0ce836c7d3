// What an impostor method builds: its plan, and which reflectors of a frame have impostors.
#include <algorithm>
#include <limits>

#include "core/error.h"
#include "core/text.h"
#include "gl/context.h"
#include "methods/shared/impostors/impostor_method.h"
#include "methods/shared/impostors/shaders/constants.h"
#include "raster/regions/rectangle.h"
#include "scene/animate.h"

namespace catoptric::methods::impostors {
namespace {

Error beyondMemory(std::uint64_t bytes, std::size_t images) {
  constexpr std::uint64_t kMiB = 1ull << 20;
  return {ExitCode::OutOfMemory,
          std::to_string(images) + " images of objects take " +
              std::to_string((bytes + kMiB - 1) / kMiB) +
              " MiB, more than memory_mib; raise memory_mib, lower texture_size or most, or set "
              "fallback to traced"};
}

/// Throws UsageError where one of the names is no object's.
void checkNames(const std::vector<std::string>& names, const scene::Scene& scene) {
  constexpr std::size_t kListed = 20;  // of a scene's objects
  std::vector<std::string> known;
  for (const scene::Object& object : scene.objects) known.push_back(object.name);
  for (const std::string& name : names) {
    if (name == "auto" || std::ranges::find(known, name) != known.end()) continue;
    std::string text = "objects: no object of the scene is called \"" + name + "\"" +
                       didYouMean(name, known) + "; allowed: \"auto\"";
    for (std::size_t i = 0; i < std::min(known.size(), kListed); ++i)
      text += ", \"" + known[i] + "\"";
    throw UsageError(text + (known.size() > kListed ? " and more" : ""));
  }
}

/// Frames that an image serves if nothing moves, and a depth map if a reflector sees the object
/// from changing directions. Ours: in the scene `moving` a quarter of the maps is new in each
/// frame.
constexpr double kFrames = 32.0;
constexpr double kTurningFrames = 4.0;
/// Time of lighting a texel of an unlit image, as texels. Ours.
constexpr double kLit = 0.15;
/// Time of a test of a mirrored ray against an object's depth maps on the CPU, as texels. Ours: a
/// fit to the rooms.
constexpr double kTexelsPerDepthMaps = 3.5;

/// How many objects of a list have depth maps; of an object's maps a ray rarely asks a second one.
std::uint64_t mapsOf(const ImpostorList& list, std::span<const Impostor> impostors) {
  std::uint64_t count = 0;
  for (std::size_t m = 0; m < list.members.size();
       m += static_cast<std::size_t>(std::max(1, list.views[m])))
    count += impostors[static_cast<std::size_t>(list.members[m])].depth ? 1 : 0;
  return count;
}

/// Time of intersecting mirrors' rays on the CPU. `tests`: of a ray and an object's depth maps.
double ofMirrors(std::uint64_t tests, std::uint64_t rays) {
  return beyondTracing(kTexelsPerDepthMaps * static_cast<double>(tests), rays);
}

/// Names of the unfit reflectors, with the reasons.
std::string listed(const std::vector<Unfit>& unfit, const scene::Scene& scene) {
  std::string text;
  for (const auto& [reason, words] : {std::pair(Unfit::Itself, "; reflect much of themselves: "),
                                      std::pair(Unfit::Near, "; billboards would be far off: ")}) {
    const char* separator = words;
    for (std::size_t o = 0; o < unfit.size(); ++o) {
      if (unfit[o] != reason) continue;
      text += separator + scene.objects[o].name;
      separator = ", ";
    }
  }
  return text;
}

/// How many times an impostor's image is drawn per frame. `rows`: with the time of simplifying its
/// rows; `relit`: lights move; `lit`: Images::isLit().
double drawnOf(const Impostor& impostor, bool rows, bool relit, bool lit) {
  constexpr double kRows = 3.0;  // to simplify a depth map's rows, as texels; ours
  const double colors = 1.0 + impostor.peeled;
  const double whole = colors + (rows && impostor.depth ? kRows : 0.0);
  // A billboard always faces the reflector; a plane's image stays while only the reflector moves
  const bool changes = impostor.moves || relit || (impostor.turns && !impostor.plane);
  if (impostor.deforms || (!impostor.depth && changes)) return whole;
  const double again = impostor.moves || relit ? (lit ? kLit : colors) : 0.0;
  return whole / (impostor.turns ? kTurningFrames : kFrames) + again;
}

}  // namespace

std::uint64_t ImpostorMethod::bytesOf(const Impostor& impostor, Images::Kept kept) const {
  kept.depths = kept.depths && !impostor.plane;
  const int size = impostor.plane ? options_.planeSize : options_.textureSize;
  return Images::bytesOf(size, kept, impostor.reflective) +
         (kept.onDevice && !impostor.plane ? deviceBytes() : 0) + (impostor.depth ? mapBytes() : 0);
}

std::vector<Cost> ImpostorMethod::costsOf(std::span<const Impostor> impostors, bool relit,
                                          const Images::Kept& kept) const {
  std::vector<Cost> costs;
  for (const Impostor& impostor : impostors) {
    const int size = impostor.plane ? options_.planeSize : options_.textureSize;
    const double times = drawnOf(impostor, options_.intersection != Intersection::Walk, relit,
                                 Images::isLit(impostor, kept));
    costs.push_back({bytesOf(impostor, kept), times * size * size});
  }
  return costs;
}

std::uint64_t ImpostorMethod::unlitBytes(std::span<const Impostor> impostors,
                                         const Images::Kept& kept) const {
  const auto count = std::ranges::count_if(
      impostors, [&](const Impostor& impostor) { return Images::isLit(impostor, kept); });
  return static_cast<std::uint64_t>(count) * UnlitImage::bytesOf(options_.textureSize);
}

Cost ImpostorMethod::mostOf(const RunSettings& settings, bool redrawn, std::uint64_t rays) const {
  if (options_.fallback == Fallback::None)
    return {options_.memoryBytes, std::numeric_limits<double>::infinity()};
  const double cube = 6.0 * options_.faceSize * options_.faceSize;
  return {options_.memoryBytes,
          allowedTexels(settings.sampleCount(), rays) - (redrawn ? cube : 0.0)};
}

ImpostorMethod::Start ImpostorMethod::startOf(const scene::Scene& scene,
                                              const RunSettings& settings) const {
  const frame::Geometry geometry =
      frame::makeGeometry(scene, scene::poseAt(scene, firstSecondsOf(settings)));
  const std::vector<bool> reflects = findReflectors(scene, settings.reflectors).reflects();
  const std::vector<Shape> shapes = shapesOf(geometry);
  Start start;
  start.choice =
      choose(options_, kind_, scene, geometry, shapes, reflects, findReflectors(scene).reflects());
  start.unfit = unfitReflectors(options_, scene, geometry, start.choice, reflects);
  start.redrawn = environmentMoves(
      scene, geometry, outsideEnvironment(options_, geometry, shapes, reflects, start.choice));
  start.rests = kind_ == Kind::DepthMap && RestPose::appliesTo(geometry);
  return start;
}

MethodPlan ImpostorMethod::plan(const scene::Scene& scene, const RunSettings& settings) const {
  checkNames(options_.objects, scene);
  MethodPlan plan;
  plan.gbuffer = true;
  plan.masks = raster::kMaskEnvironment | raster::kMaskClamped;
  if (kind_ == Kind::DepthMap) plan.masks |= raster::kMaskDisoccluded;
  if (options_.transitionHeight > 0.0f) plan.masks |= raster::kMaskTransition;
  const Reflectors reflectors = findReflectors(scene, settings.reflectors);
  if (!reflectors.any()) return plan;
  const bool again = scene.animated();
  const auto [choice, unfit, redrawn, rests] = startOf(scene, settings);
  const std::string unfitNames = listed(unfit, scene);
  const bool inMemory = options_.intersectOn != Unit::Device && reflectors.mirrors();
  // Embree traces the others: those that are unfit, and on a CPU glossy ones
  const bool traces = options_.fallback == Fallback::Traced;
  const bool lobes = reflectors.glossy && !(traces && options_.intersectOn != Unit::Device);
  const std::vector<bool> reflects = reflectors.reflects();
  std::vector<bool> needed(choice.impostors.size(), false);
  for (std::size_t o = 0; o < choice.listOf.size(); ++o) {
    const bool glossy = reflectors.classOf[o + 1] == raster::SampleClass::Glossy;
    if (reflects[o] && !(traces && unfit[o] != Unfit::No) && (lobes || !glossy))
      addNeeded(choice.listOf[o], choice, needed);
  }
  std::vector<Impostor> impostors;
  for (std::size_t i = 0; i < needed.size(); ++i)
    if (needed[i]) impostors.push_back(choice.impostors[i]);
  Cost all;
  for (const Cost& cost :
       costsOf(impostors, lightsMove(scene), keptIn(inMemory, lobes || !inMemory)))
    all.add(cost);
  all.bytes += unlitBytes(impostors, keptIn(inMemory, true));
  const std::uint64_t samples = settings.sampleCount();
  std::uint64_t tests = 0;  // by a ray
  for (std::size_t o = 0; o < choice.listOf.size(); ++o)
    if (reflectors.classOf[o + 1] != raster::SampleClass::Glossy)
      tests = std::max(tests, mapsOf(choice.listOf[o], choice.impostors));
  const double ofTests = inMemory ? ofMirrors(tests * samples, samples) : 0.0;
  // The time of a frame limits how many images there are; where nothing moves, frames add theirs
  const double ofFrame = all.texels + (again ? ofTests : 0.0);
  const double texels =
      mostOf(settings, redrawn, samples * (reflectors.glossy ? shared::kLobeRays : 1)).texels;
  const double drawn = std::clamp(texels / std::max(ofFrame, 1.0), 0.0, 1.0);
  const std::uint64_t bytes = std::min(
      static_cast<std::uint64_t>(drawn * static_cast<double>(all.bytes)), options_.memoryBytes);
  const std::string images = std::to_string(impostors.size()) + " of " +
                             std::to_string(std::ranges::count(choice.chosen, true)) +
                             " objects for " + std::to_string(reflectors.count()) +
                             " reflective objects";
  const Cost most{all.bytes, all.texels + ofTests};
  // Later poses may need more
  plan.trace =
      options_.fallback == Fallback::Traced && (again || reflectors.glossy || !unfitNames.empty() ||
                                                !most.within(mostOf(settings, false, 0)));
  plan.add(cubeMapItems(options_.faceSize, again));
  plan.add({{"precomputation", "choose", "which reflectors reflect much of themselves"},
            {"pass", "impostors",
             "those of reflectors in view, drawn when first needed and when changed"},
            {"pass", "intersect", std::to_string(reflectors.count()) + " reflective objects"},
            {"pass", "readback", "marks of the samples are counted"},
            {"resource", "images", images + (bytes < all.bytes ? ", as many as fit" : ", at most"),
             bytes},
            {"resource", "marks", "R32UI by sample", 4 * samples}});
  if (rests)
    plan.items.push_back({"resource", "rest pose",
                          "depth maps of what moves rigidly are drawn there, and kept",
                          frame::geometryBytes(scene)});
  if (plan.trace) {
    plan.masks |= raster::kMaskRetraced;
    plan.items.insert(
        plan.items.end(),
        {{"pass", "choose", "in frames whose images exceed memory_mib, or cost more than tracing"},
         {"pass", "trace", "reflectors that get no images in such frames" + unfitNames},
         {"pass", "resolve", "their rays are generated; hits are shaded"},
         {"resource", "samples", "of such frames, read back", 24 * samples}});
  }
  return plan;
}

void ImpostorMethod::addNeeded(const ImpostorList& list, const Choice& choice,
                               std::vector<bool>& needed) const {
  for (const int i : list.members) {
    needed[static_cast<std::size_t>(i)] = true;
    if (options_.bounces < 2) continue;
    const Impostor& impostor = choice.impostors[static_cast<std::size_t>(i)];
    if (!impostor.reflective) continue;
    const ImpostorList& second = choice.listOf[static_cast<std::size_t>(impostor.object)];
    const auto count =
        options_.secondDiffuse ? second.members.size() : static_cast<std::size_t>(second.diffuse);
    for (std::size_t m = 0; m < count; ++m)
      needed[static_cast<std::size_t>(second.members[m])] = true;
  }
}

std::vector<int> ImpostorMethod::neededOf(std::span<const int> reflectors) const {
  std::vector<bool> seen(choice_.impostors.size(), false);
  for (const int r : reflectors) addNeeded(shown_[static_cast<std::size_t>(r)], choice_, seen);
  std::vector<int> needed;
  for (std::size_t i = 0; i < seen.size(); ++i)
    if (seen[i]) needed.push_back(static_cast<int>(i));
  return needed;
}

void ImpostorMethod::share(const FrameInput& input, Services& services) {
  visible_ = visibleReflectors(input, services);
  traced_.assign(reflects_.size(), false);
  inView_ = visible_;
  if (options_.fallback == Fallback::Traced) {
    std::erase_if(visible_, [&](int r) { return isUnfit(r); });
    for (const int r : inView_) traced_[static_cast<std::size_t>(r)] = isUnfit(r);
  }
  shown_ = choice_.listOf;
  needed_ = neededOf(visible_);
  const bool redrawn = environmentMoves(
      services.scene, services.geometry,
      outsideEnvironment(options_, services.geometry, shapes_, reflects_, choice_));
  Cost all;
  for (const int index : needed_) all.add(costs_[static_cast<std::size_t>(index)]);
  if (onProcessor_) {
    std::uint64_t tests = 0;  // by a ray
    for (const int r : visible_)
      if (!isGlossy(r))
        tests = std::max(tests, mapsOf(shown_[static_cast<std::size_t>(r)], choice_.impostors));
    std::uint64_t rays = 0;
    for (const raster::Rectangle& part : partsOf(false, input, services))
      rays += static_cast<std::uint64_t>(part.width()) * static_cast<std::uint64_t>(part.height());
    all.texels += ofMirrors(tests * rays, rays);
  }
  const bool slow = reflectors_.glossy && options_.fallback == Fallback::Traced &&
                    gl::Context::current().info().software;
  if (!slow && all.within(mostOf(settings_, redrawn, 0))) return;
  if (options_.fallback == Fallback::None) throw beyondMemory(all.bytes, needed_.size());
  shareByDemand(input, services, redrawn);
}

void ImpostorMethod::shareByDemand(const FrameInput& input, Services& services, bool redrawn) {
  std::vector<Demand::Rays> raysOf(reflects_.size(), Demand::Rays::None);
  for (const int r : inView_) {
    const auto o = static_cast<std::size_t>(r);
    // Rays that are reflected again may meet anything of a list
    raysOf[o] = !isGlossy(r) && options_.bounces < 2 ? Demand::Rays::Mirrored : Demand::Rays::Any;
  }
  std::vector<Reach> reaches;
  for (const Impostor& impostor : choice_.impostors) {
    const Box3 box = boxOf(impostor);
    reaches.push_back({box.centre(), 0.5f * box.diameter(), impostor.depth});
  }
  services.timer.measure("readback", [&] { raster::readBack(*services.gbuffer, false, copy_); });
  // Shaders on a CPU take longer than tracing for a lobe, whatever its rays meet
  const bool software = gl::Context::current().info().software;
  std::vector<Wish> wishes;
  std::uint64_t rays = 0;
  services.timer.measure("choose", [&] {
    const Demand demand(copy_, input.frame.camera, raysOf, choice_.listOf, reaches);
    for (const int r : inView_) {
      const std::uint64_t samples = demand.samplesOf(r);
      if (isUnfit(r)) {
        traced_[static_cast<std::size_t>(r)] = samples > 0;
        rays += samples * (isGlossy(r) ? shared::kLobeRays : 1);
        continue;
      }
      shown_[static_cast<std::size_t>(r)] = demand.listOf(r);
      if (samples == 0) continue;
      const bool glossy = isGlossy(r);
      const std::uint64_t ofLobes = samples * (glossy ? shared::kLobeRays : 1);
      const int one[] = {r};
      wishes.push_back({r, ofLobes, 0.0, neededOf(one)});
      const ImpostorList& list = shown_[static_cast<std::size_t>(r)];
      if (glossy && software)
        wishes.back().texels = std::numeric_limits<double>::infinity();
      else if (!glossy && onProcessor_)
        wishes.back().texels = ofMirrors(
            options_.bounces < 2 ? demand.testsOf(r) : mapsOf(list, choice_.impostors) * samples,
            samples);
      rays += ofLobes;
    }
    const std::vector<bool> granted = grant(wishes, costs_, mostOf(settings_, redrawn, rays));
    visible_.clear();
    for (std::size_t w = 0; w < wishes.size(); ++w) {
      const int r = wishes[w].reflector;
      if (granted[w]) visible_.push_back(r);
      traced_[static_cast<std::size_t>(r)] = !granted[w];
    }
    needed_ = neededOf(visible_);
  });
}

void ImpostorMethod::traceOthers(const FrameInput& input, Services& services, FrameOutput& output) {
  output.counters["traced_reflectors"] =
      static_cast<std::uint64_t>(std::ranges::count(traced_, true));
  if (output.counters["traced_reflectors"] == 0) return;
  const frame::ObjectSet own(traced_);
  const auto counts =
      traceSamples({*services.trace, tracing_, own, settings_.masks, raster::kMaskRetraced},
                   input.frame.camera, services, bands_);
  output.counters["traced_samples"] = counts.samples;
  output.counters["below_horizon"] += counts.belowHorizon;
}

}  // namespace catoptric::methods::impostors
