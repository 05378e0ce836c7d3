#include "run/folder/plan.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <optional>
#include <set>
#include <span>

#include "config/json_text.h"
#include "core/error.h"
#include "core/parallel.h"
#include "core/text.h"
#include "methods/contract/layers.h"
#include "methods/contract/restarts.h"
#include "raster/scene_gpu/materials.h"
#include "raster/scene_gpu/scene_gpu.h"
#include "scene/animate.h"
#include "scene/reflectance.h"
#include "trace/lobes/lobe_tracer.h"

namespace catoptric::run {
namespace {

using methods::PlanItem;

/// Cube maps with fewer texels are no matter (about a second on two cores); of others those with so
/// many times the frame's samples are warned of, drawn again or once. RGBA16F with mips. Ours.
constexpr double kManyCubeTexels = 4e6;
constexpr double kManyTimesAgain = 4.0;
constexpr double kManyTimesOnce = 64.0;
constexpr double kCubeMapTexelBytes = 8.0 * 4.0 / 3.0;

constexpr std::uint64_t kWriters = 2;
constexpr std::uint64_t kFramesUnderWay = 4 + kWriters;  ///< one rendered, 3 queued, the writers'

/// The options that lower the memory of a frame's samples, and of its pixels.
constexpr const char* kFrameOptions = "image.width, image.height, image.samples";
constexpr const char* kPixelOptions = "image.width, image.height, image.layers";

std::string count(std::size_t n, const std::string& noun) {
  return std::to_string(n) + " " + noun + (n == 1 ? "" : "s");
}

std::size_t movingCount(const scene::Scene& scene) {
  const std::vector<bool> moving = scene::movingObjects(scene);
  return static_cast<std::size_t>(std::count(moving.begin(), moving.end(), true));
}

/// Of the program, its libraries and small arrays; and of a GL driver with the shaders that every
/// frame needs. Ours, measured with tiny frames by llvmpipe.
constexpr std::uint64_t kProcessBytes = 45'000'000;
constexpr std::uint64_t kDriverBytes = 110'000'000;

/// Of each variant of the surfaces' shaders, as llvmpipe compiles it for the passes of a frame.
/// Ours, measured.
constexpr std::uint64_t kVariantBytes = 6'000'000;

std::size_t shaderVariants(const scene::Scene& scene) {
  std::set<std::uint32_t> features;
  for (const scene::Object& object : scene.objects)
    features.insert(
        raster::materialFeatures(scene.materials[static_cast<std::size_t>(object.material)]));
  return features.size();
}

/// The environment's image, which rays look up; beside it the file's image while it is loaded, then
/// the copy for OpenGL and what that is made of.
std::uint64_t environmentBytes(const frame::EnvironmentLight& environment, bool gl) {
  return environment.pixels().size() * (sizeof(Vec3) + (gl ? 2 : 1) * sizeof(Vec4));
}

/// What all methods share: scene, geometry, baked light, context, programs.
std::vector<PlanItem> sharedItems(const RunConfig& run, const scene::Scene& scene,
                                  const frame::EnvironmentLight& environment, bool gl) {
  const std::size_t moving = movingCount(scene);
  std::vector<PlanItem> items;
  items.push_back(
      {"resource", "process", "the program and its libraries, as measured", kProcessBytes});
  items.push_back({"precomputation", "scene", run.scene.generic_string() + " is loaded and checked",
                   scene.memoryBytes(), "smaller textures and meshes"});
  items.push_back({"precomputation", "geometry",
                   count(scene.triangleCount(), "triangle") + " of " +
                       count(scene.objects.size(), "object") + " in world space",
                   frame::geometryBytes(scene), "fewer triangles"});
  if (scene.environment.type == scene::EnvironmentType::File)
    items.push_back({"precomputation", "environment",
                     "the environment is an image: " + scene.environment.file.generic_string(),
                     environmentBytes(environment, gl), "a smaller environment image"});
  if (scene.bake.mode != scene::BakeMode::None)
    items.push_back(
        {"precomputation", "bake",
         std::string("the scene asks for ") +
             (scene.bake.mode == scene::BakeMode::Full ? "baked light" : "ambient occlusion") +
             ", " + count(static_cast<std::size_t>(scene.bake.rays), "ray") +
             " per vertex; kept in the cache",
         0});
  if (gl) {
    const std::size_t variants = shaderVariants(scene);
    items.push_back({"resource", "context",
                     "a method rasterizes; device " + run.device + "; a driver, as measured",
                     kDriverBytes});
    items.push_back({"resource", "programs",
                     "geometry, " + count(scene.textures.size(), "texture") + " and " +
                         count(scene.materials.size(), "material") + " are uploaded; " +
                         count(variants, "variant") + " of shaders",
                     raster::uploadedGeometryBytes(scene) + raster::textureBytes(scene) +
                         variants * kVariantBytes,
                     "fewer triangles, smaller textures"});
  }
  if (moving > 0)
    items.push_back(
        {"pass", "geometry", count(moving, "object") + " can move: updated in every frame", 0});
  return items;
}

const char* policyName(trace::BvhPolicy policy) {
  switch (policy) {
    case trace::BvhPolicy::Static:
      return "static";
    case trace::BvhPolicy::Refit:
      return "refit";
    case trace::BvhPolicy::RebuildLow:
      return "rebuild_low";
    case trace::BvhPolicy::RebuildMedium:
      return "rebuild_medium";
  }
  return "";
}

/// What a frame's layers take: floats of a pixel in its file, bytes of a sample that is read back.
struct LayerSizes {
  std::uint64_t floats = 0;
  std::uint64_t sampleBytes = 0;
};

LayerSizes layerSizes(const methods::RunSettings& image, std::uint16_t filledMasks) {
  const auto asked = [&](const char* name) { return methods::asksFor(image, name); };
  LayerSizes sizes;
  for (const std::string& layer : image.layers) {
    const bool vector =
        layer == "N" || layer == "reflection" || layer == "diffuse" || layer == "motion";
    sizes.floats += vector ? 3 : 1;
    // diffuse and s are read together; motion is made of Z and id
    if (layer != "diffuse" && layer != "s" && layer != "motion")
      sizes.sampleBytes += vector ? 16 : 4;
  }
  if (asked("motion")) sizes.sampleBytes += (asked("Z") ? 0 : 4) + (asked("id") ? 0 : 4);
  if (image.masks) {  // also the masks of the reflective and of the glossy samples
    sizes.floats += 2 + static_cast<std::uint64_t>(std::popcount(filledMasks));
    sizes.sampleBytes += 2 + (asked("N") ? 0 : 16);
  }
  if (image.masks || asked("diffuse") || asked("s") || asked("reflection")) sizes.sampleBytes += 16;
  return sizes;
}

/// The G-buffer, and what follows it: composite, readback, layers.
void addBefore(const RunConfig& run, const scene::Scene& scene, const raster::GBufferSize& size,
               std::vector<PlanItem>& items) {
  const std::uint64_t samples = run.image.sampleCount();
  items.push_back(
      {"resource", "gbuffer",
       std::to_string(run.image.width) + "x" + std::to_string(run.image.height) + " pixels with " +
           std::to_string(run.image.samples) + "x" + std::to_string(run.image.samples) +
           " samples" + (size.tints ? ", with tints" : "") +
           (size.highlights ? ", with highlights" : "") + (run.image.masks ? ", with masks" : ""),
       samples * raster::bytesPerSample(size), kFrameOptions});
  items.push_back({"pass", "gbuffer", "diffuse radiance, normals, s, g, ids and depth", 0});
  if (const std::size_t moving = movingCount(scene); moving > 0 && moving < scene.objects.size())
    items.push_back({"resource", "still gbuffer",
                     "of what stands still, where something moves while the camera does not",
                     samples * raster::surfaceBytesPerSample(size), kFrameOptions});
}

/// What follows the method in a frame, and behind the rendering.
void addAfter(const RunConfig& run, const methods::MethodPlan& needs, std::size_t frames,
              std::vector<PlanItem>& items) {
  const std::uint64_t pixels =
      static_cast<std::uint64_t>(run.image.width) * static_cast<std::uint64_t>(run.image.height);
  const LayerSizes layers = layerSizes(run.image, needs.masks);
  const std::uint64_t floats = 4 + layers.floats;
  if (needs.gbuffer) {
    items.push_back({"pass", "composite",
                     std::string("samples are resolved to pixels") +
                         (run.image.fresnelSchlick ? ", with Fresnel" : ""),
                     pixels * 4 * sizeof(float), "image.width, image.height"});
    items.push_back({"pass", "readback", "the frame is written to a file", 0});
    if (layers.floats > 0) {
      std::vector<std::string> names = run.image.layers;
      if (run.image.masks) {
        names.insert(names.end(), {"mask.reflective", "mask.glossy"});
        for (const methods::MaskInfo& mask : methods::kMasks)
          if ((needs.masks & mask.bit) != 0) names.emplace_back(mask.name);
      }
      items.push_back(
          {"pass", "layers", "asked for: " + joined(names, ", "),
           run.image.sampleCount() * layers.sampleBytes + pixels * layers.floats * sizeof(float),
           "image.layers, image.masks"});
    }
  }
  // Colour and layers of pixels, floats: the frame at hand, those that wait, those being written.
  const std::uint64_t waiting = std::min<std::uint64_t>(frames, kFramesUnderWay);
  items.push_back({"resource", "frames",
                   "pixels of frames on their way to the files, at most " + std::to_string(waiting),
                   pixels * floats * sizeof(float) * waiting, kPixelOptions});
  // Halves of all floats, and the compressed file with half of their size; then the preview
  const std::uint64_t writers = std::min<std::uint64_t>(frames, kWriters);
  items.push_back({"pass", "encode", "EXR, behind the rendering", pixels * floats * 3 * writers,
                   kPixelOptions});
  if (run.preview.enabled)
    items.push_back(
        {"pass", "preview", "PNG, behind the rendering", pixels * 4 * writers, "preview.enabled"});
  items.push_back({"pass", "write", "files are synced and renamed, behind the rendering", 0});
}

/// `gbuffer`: its size, where a method needs it.
std::vector<PlanItem> methodItems(const RunConfig& run, const scene::Scene& scene,
                                  const methods::MethodPlan& needs,
                                  const raster::GBufferSize& gbuffer, std::size_t frames) {
  std::vector<PlanItem> items;
  if (needs.trace) {
    items.push_back({"resource", "bvh",
                     "rays are traced; policy " + std::string(policyName(needs.bvh)) +
                         "; at most, while it is built",
                     trace::bvhBuildBytes(scene), "fewer triangles"});
    if (needs.bounces > 1)
      items.push_back(
          {"resource", "paths",
           "at most " + std::to_string(needs.bounces) + " reflections, in each of " +
               count(static_cast<std::size_t>(threadCount()), "thread"),
           static_cast<std::uint64_t>(threadCount()) * trace::LobeTracer::bytesOf(needs.bounces),
           "bounces, threads"});
    const bool rebuilds =
        needs.bvh == trace::BvhPolicy::RebuildLow || needs.bvh == trace::BvhPolicy::RebuildMedium;
    if (rebuilds) {
      items.push_back({"pass", "bvh", "the policy rebuilds it in every frame", 0});
    } else if (movingCount(scene) > 0) {
      items.push_back({"pass", "bvh", "follows the moving objects", 0});
    }
  }
  if (needs.gbuffer) addBefore(run, scene, gbuffer, items);
  items.insert(items.end(), needs.items.begin(), needs.items.end());
  addAfter(run, needs, frames, items);
  return items;
}

std::string itemJson(const PlanItem& item) {
  config::JsonText text;
  text.add("kind", item.kind).add("name", item.name).add("reason", item.reason);
  if (item.bytes > 0) text.add("bytes", item.bytes);
  return text.object();
}

std::string itemsJson(const std::vector<PlanItem>& items) {
  std::vector<std::string> texts;
  for (const PlanItem& item : items) texts.push_back(itemJson(item));
  return "[" + joined(texts, ",") + "]";
}

void appendItems(const std::vector<PlanItem>& items, std::string& text) {
  std::size_t widest = 0;
  for (const PlanItem& item : items) widest = std::max(widest, item.name.size());
  for (const PlanItem& item : items) {
    std::string line = "  " + item.kind +
                       std::string(16 - std::min<std::size_t>(15, item.kind.size()), ' ') +
                       item.name + std::string(widest + 2 - item.name.size(), ' ') + item.reason;
    if (item.bytes > 0) line += " (" + bytesText(item.bytes) + ")";
    text += line + "\n";
  }
}

/// How to render what a method refuses, or what its fallback does.
std::string hint(const MethodConfig& method) {
  const auto refuses = [](const std::string& id) {
    const methods::MethodEntry* entry = methods::findMethod(methods::registry(), id);
    return entry == nullptr || entry->refusesReflectors;
  };
  std::string name = "methods." + method.name;
  const bool inFallback = !method.fallback.empty() && refuses(method.fallback.front().id);
  // A method without the option does all reflectors itself: another one was named for this object.
  if (!inFallback && !refuses(method.id))
    return "give another method for it in \"reflectors\" of " + name;
  if (inFallback) name += ".fallback";
  return "--set " + name + ".unsupported=" + joined(fallbackMethods(), " (or =") +
         ") renders it by that method";
}

}  // namespace

std::uint64_t sceneMemoryBound(const scene::Scene& scene) {
  return scene.memoryBytes() + frame::geometryBytes(scene) + raster::uploadedGeometryBytes(scene) +
         raster::textureBytes(scene) + trace::bvhBuildBytes(scene);
}

std::string bytesText(std::uint64_t bytes) {
  if (bytes == 0) return "";
  constexpr std::array kUnits = {"bytes", "kB", "MB", "GB", "TB"};
  double value = static_cast<double>(bytes);
  std::size_t unit = 0;
  while (value >= 1000.0 && unit + 1 < kUnits.size()) {
    value /= 1000.0;
    ++unit;
  }
  return fmt::format("{:.{}f} {}", value, unit == 0 ? 0 : 1, kUnits[unit]);
}

namespace {

/// Why an object is a reflector that nobody takes for one; "" for others.
std::string whyReflector(const scene::Scene& scene, const scene::Object& object) {
  const float s = scene.materials[static_cast<std::size_t>(object.material)].specularLevel;
  if (!(s > 0.0f) || s >= scene::kReflectiveThreshold) return "";
  return fmt::format(" (a reflector, since plastic reflects {:.2g} %)", 100.0f * s);
}

/// Appends a line for each of the first objects that method `i` of the run does not support, and
/// one for all others.
void appendRefusals(std::vector<std::string>& lines, const RunConfig& run, std::size_t i,
                    const scene::Scene& scene, const std::vector<methods::Unsupported>& all) {
  constexpr std::size_t kNamed = 3;
  const std::string start = run.methods[i].name + " cannot render ";
  for (const methods::Unsupported& unsupported :
       std::span(all).first(std::min(all.size(), kNamed))) {
    const std::size_t index = static_cast<std::size_t>(unsupported.object - 1);
    const std::string what = unsupported.object > 0 && index < scene.objects.size()
                                 ? "object " + std::to_string(unsupported.object) + " \"" +
                                       scene.objects[index].name + "\"" +
                                       whyReflector(scene, scene.objects[index])
                                 : "the scene";
    lines.push_back(start + what + " of " + run.scene.generic_string() + ": " + unsupported.reason +
                    (unsupported.object > 0 ? "; " + hint(run.methods[i]) : ""));
  }
  if (all.size() > kNamed)
    lines.push_back(start + std::to_string(all.size() - kNamed) +
                    " other objects either; `catoptric info` lists all reflectors");
}

}  // namespace

Plan makePlan(const RunConfig& run, const scene::Scene& scene,
              const frame::EnvironmentLight& environment, std::size_t frames,
              const std::vector<std::unique_ptr<methods::Method>>& made) {
  Plan plan;
  plan.frames = frames;
  std::vector<std::string> refused;
  std::string reason;  // of the first
  std::optional<raster::GBufferSize> gbuffer;
  for (std::size_t i = 0; i < made.size(); ++i) {
    const std::vector<methods::Unsupported> unsupported = made[i]->unsupported(scene);
    if (refused.empty() && !unsupported.empty())
      reason = "refuses " + std::to_string(unsupported.size()) + ": " + unsupported.front().reason;
    appendRefusals(refused, run, i, scene, unsupported);
    PlannedMethod method;
    method.name = run.methods[i].name;
    method.id = run.methods[i].id;
    method.mixed = !run.methods[i].reflectors.empty() || !run.methods[i].fallback.empty();
    method.needs = made[i]->plan(scene, run.image);
    method.needs.gl = method.needs.gl || method.needs.gbuffer;
    plan.gl = plan.gl || method.needs.gl;
    if (method.needs.gbuffer && !gbuffer)  // once: it looks at the textures of roughness
      gbuffer = raster::withTexturesFor(
          scene, {run.image.width, run.image.height, run.image.samples, run.image.masks});
    method.items =
        methodItems(run, scene, method.needs, gbuffer.value_or(raster::GBufferSize{}), frames);
    plan.methods.push_back(std::move(method));
  }
  if (!refused.empty()) throw UnsupportedError(joined(refused, "\n"), reason);
  plan.shared = sharedItems(run, scene, environment, plan.gl);
  return plan;
}

void planWarmUps(Plan& plan, const scene::CameraPath& path, const std::vector<int>& asked,
                 const std::vector<std::unique_ptr<methods::Method>>& made) {
  for (std::size_t i = 0; i < plan.methods.size(); ++i) {
    PlannedMethod& method = plan.methods[i];
    method.warmUpFrames = methods::withWarmUp(*made[i], path, asked).size() - asked.size();
    if (method.warmUpFrames > 0)
      method.items.insert(method.items.begin(),
                          {"pass", "warm_up",
                           count(method.warmUpFrames, "more frame") +
                               " of the path, to warm up: the method keeps state between frames "
                               "since the last restart frame",
                           0});
  }
}

std::uint64_t Plan::bytesOf(const PlannedMethod& method) const {
  std::uint64_t bytes = 0;
  for (const std::vector<PlanItem>* items : {&shared, &method.items})
    for (const PlanItem& item : *items) bytes += item.bytes;
  return bytes;
}

std::string cubeMapWarning(const Plan& plan, const methods::RunSettings& image) {
  const double samples =
      static_cast<double>(image.width) * image.height * image.samples * image.samples;
  std::string warning;
  for (const PlannedMethod& method : plan.methods) {
    const auto find = [&](const char* name) {
      return std::find_if(method.items.begin(), method.items.end(),
                          [&](const PlanItem& item) { return item.name == name; });
    };
    const auto map = find("cube map");
    const auto step = find("cube_map");
    if (map == method.items.end() || step == method.items.end()) continue;
    const bool again = step->kind == "pass";
    const double texels = static_cast<double>(map->bytes) / kCubeMapTexelBytes;
    const double times = texels / samples;
    if (texels < kManyCubeTexels || times < (again ? kManyTimesAgain : kManyTimesOnce)) continue;
    warning += (warning.empty() ? "" : "\n") + method.name + ": the cube map (" + map->reason +
               ", " + bytesText(map->bytes) + ") has " + std::to_string(std::lround(times)) +
               " times the frame's samples, and is " +
               (again ? "drawn in each frame in which something moved" : "drawn before the first") +
               ": this will take most of the time; lower its face size";
  }
  return warning;
}

std::string refractionWarning(const Plan& plan, const scene::Scene& scene) {
  constexpr int kThroughABody = 2;  // in and out; one is enough for a pane
  std::string first;
  std::size_t bodies = 0;
  for (const scene::Object& object : scene.objects) {
    if (refractsAsBody(scene, object) && bodies++ == 0) first = object.name;
  }
  std::string warning;
  for (const PlannedMethod& method : plan.methods) {
    const int bounces = method.needs.bounces;
    if (bodies == 0 || bounces == 0 || bounces >= kThroughABody) continue;
    warning += (warning.empty() ? "" : "\n") + method.name + ": nothing can be seen through \"" +
               first + "\"" + (bodies > 1 ? " and " + count(bodies - 1, "other object") : "") +
               ": entering and leaving an object takes 2 bounces, but bounces is " +
               std::to_string(bounces) +
               (method.mixed ? "; give the method that renders it bounces 2 or more"
                             : "; set methods." + method.name + ".bounces=2 or more");
  }
  return warning;
}

std::vector<std::string> reflectionNotes(const Plan& plan, const scene::Scene& scene,
                                         const methods::RunSettings& image) {
  std::vector<std::string> notes;
  std::size_t reflectors = 0;
  std::size_t strong = 0;  // reflect more than dielectrics do
  std::size_t dielectrics = 0;
  bool fresnelMatters = false;
  for (const scene::Object& object : scene.objects) {
    const scene::Material& material = scene.materials[static_cast<std::size_t>(object.material)];
    const bool ggx = material.lobe == scene::LobeModel::Ggx;
    if (object.reflector != 0) {
      ++reflectors;
      strong += material.specularLevel >= scene::kReflectiveThreshold ? 1 : 0;
      fresnelMatters = fresnelMatters || (!ggx && material.specularLevel < 1.0f);
    } else if (ggx && !material.unlit && material.dielectricF0 != Vec3(0.0f)) {
      ++dielectrics;
    }
  }
  if (dielectrics > 0 && reflectors == 0)
    notes.push_back("nothing reflects: " + count(dielectrics, "object") +
                    fmt::format(" of glTF's dielectrics reflect less than {:g} % at normal "
                                "incidence, and count as diffuse; the scene's \"dielectrics\": "
                                "\"on\" lets them reflect",
                                100.0f * scene::kReflectiveThreshold));
  if (image.fresnelSchlick && reflectors > 0 && !fresnelMatters)
    notes.push_back(
        "image.fresnel changes nothing here: s is 1 of all reflective objects, or their lobe is "
        "GGX, "
        "which always has Fresnel's term");
  std::string oneBounce;
  std::string idle;
  for (const PlannedMethod& method : plan.methods) {
    if (method.needs.gbuffer) idle += (idle.empty() ? "" : ", ") + method.name;
    if (method.needs.bounces == 1) oneBounce += (oneBounce.empty() ? "" : ", ") + method.name;
  }
  if (reflectors + dielectrics == 0 && !idle.empty())
    notes.push_back("nothing reflects: no object has a reflectance s of " +
                    fmt::format("{:g}", scene::kReflectiveThreshold) +
                    " or more, so that no pixel depends on the method (" + idle + ")");
  if (strong > 1 && !oneBounce.empty())
    notes.push_back(
        "a mirror that is seen in a mirror shows its diffuse colour, since bounces is 1 "
        "(" +
        oneBounce + "); bounces=2 shows the second reflection");
  return notes;
}

std::string planText(const Plan& plan) {
  std::string text = "once, for " + count(plan.frames, "frame") + " by " +
                     count(plan.methods.size(), "method") + ":\n";
  appendItems(plan.shared, text);
  for (const PlannedMethod& method : plan.methods) {
    text += method.name + (method.name == method.id ? "" : " (" + method.id + ")") + ":\n";
    appendItems(method.items, text);
    text += "  memory in all: about " + bytesText(plan.bytesOf(method)) + "\n";
  }
  return text;
}

std::string planJson(const Plan& plan) {
  std::vector<std::string> methods;
  for (const PlannedMethod& method : plan.methods)
    methods.push_back(config::JsonText()
                          .add("name", method.name)
                          .add("method", method.id)
                          .add("context", method.needs.gl)
                          .add("memory_bytes", plan.bytesOf(method))
                          .add("warm_up_frames", static_cast<int>(method.warmUpFrames))
                          .raw("items", itemsJson(method.items))
                          .object());
  return config::JsonText()
      .add("frames", static_cast<int>(plan.frames))
      .add("context", plan.gl)
      .raw("shared", itemsJson(plan.shared))
      .raw("methods", "[" + joined(methods, ",") + "]")
      .object();
}

}  // namespace catoptric::run
