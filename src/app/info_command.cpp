// catoptric info SCENE.
#include <fmt/core.h>

#include <algorithm>
#include <filesystem>
#include <memory>

#include "app/commands.h"
#include "app/run_options.h"
#include "config/json.h"
#include "config/json_text.h"
#include "core/error.h"
#include "core/math.h"
#include "core/text.h"
#include "frame/shading.h"
#include "run/config/run_config.h"
#include "run/folder/plan.h"
#include "run/stage/reflective_share.h"
#include "run/stage/stage.h"
#include "scene/animate.h"
#include "scene/loader.h"

namespace catoptric::app {
namespace {

using config::JsonText;

std::string paddedTo(std::string text, std::size_t width) {
  if (text.size() < width) text.resize(width, ' ');
  return text;
}

const char* environmentName(scene::EnvironmentType type) {
  switch (type) {
    case scene::EnvironmentType::Constant:
      return "constant";
    case scene::EnvironmentType::Gradient:
      return "gradient";
    case scene::EnvironmentType::File:
      return "image";
  }
  return "";
}

const char* bakeName(scene::BakeMode mode) {
  switch (mode) {
    case scene::BakeMode::None:
      return "none";
    case scene::BakeMode::AmbientOcclusion:
      return "ambient occlusion";
    case scene::BakeMode::Full:
      return "full";
  }
  return "";
}

std::size_t trianglesOf(const scene::Scene& scene, const scene::Object& object) {
  return scene.meshes[static_cast<std::size_t>(object.mesh)].indices.size() / 3;
}

/// Run configs and camera paths are JSON, too.
void requireScene(const std::string& input) {
  const std::filesystem::path file = input;
  std::error_code ignored;
  if (file.extension() != ".json" || !std::filesystem::is_regular_file(file, ignored)) return;
  config::Value root;
  try {
    root = config::parseFile(file);
  } catch (const UsageError&) {
    return;  // a scene that cannot be read: said when it is loaded
  }
  const run::FileKind kind = run::fileKind(root);
  if (kind == run::FileKind::Path)
    throw UsageError(input + ": is a camera path; info takes a scene (.json, .gltf, .glb)");
  if (kind != run::FileKind::RunConfig) return;
  const std::filesystem::path scene =
      (file.parent_path() / root.get("scene").asString()).lexically_normal();
  throw UsageError(input + ": is a run config, not a scene. For its scene: catoptric info " +
                   scene.string() + ". For what a run of it needs: catoptric plan " + input);
}

const scene::Material& materialOf(const scene::Scene& scene, const scene::Object& object) {
  return scene.materials[static_cast<std::size_t>(object.material)];
}

std::vector<std::string> namesOfCameras(const scene::Scene& scene) {
  std::vector<std::string> names;
  for (const scene::CameraDefinition& camera : scene.cameras) names.push_back(camera.name);
  return names;
}

/// To a ten-thousandth of the scene's size.
std::string placeText(const scene::Scene& scene, const Box3& bounds, const Vec3& p) {
  const glm::dvec3 place = glm::dvec3(p) + scene.origin;
  const double step = 1e-4 * std::max(static_cast<double>(bounds.diameter()), 1e-6);
  const int digits = std::clamp(static_cast<int>(std::ceil(-std::log10(step))), 0, 9);
  const auto text = [&](double x) {
    const double scale = std::pow(10.0, digits);
    return config::numberText(std::round(x * scale) / scale);
  };
  return text(place.x) + "," + text(place.y) + "," + text(place.z);
}

/// The default camera as --camera takes it, EYE/TARGET/FOV; the target is as far as the scene's
/// centre.
std::string cameraText(const scene::Scene& scene, const Box3& bounds) {
  const scene::Camera camera = scene::cameraPath("", scene)->frame(1).camera;
  const float far = std::max(glm::dot(bounds.centre() - camera.eye(), camera.forward()),
                             0.1f * bounds.diameter());
  return placeText(scene, bounds, camera.eye()) + "/" +
         placeText(scene, bounds, camera.eye() + far * camera.forward()) + "/" +
         fmt::format("{:.4g}", degrees(camera.verticalFovRad));
}

std::string infoJson(const std::string& input, const scene::Scene& scene,
                     const std::vector<bool>& moving) {
  std::vector<std::string> reflectors;
  std::vector<std::string> textures;
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    const scene::Object& object = scene.objects[i];
    if (object.reflector == 0) continue;
    const scene::Material& material = materialOf(scene, object);
    reflectors.push_back(JsonText()
                             .add("reflector", object.reflector)
                             .add("id", static_cast<int>(i + 1))
                             .add("name", object.name)
                             .add("material", material.name)
                             .add("s", material.specularLevel)
                             .add("g", material.roughness)
                             .add("planar", object.planar)
                             .add("moving", static_cast<bool>(moving[i]))
                             .add("triangles", trianglesOf(scene, object))
                             .object());
  }
  for (const scene::Texture& texture : scene.textures)
    textures.push_back(JsonText()
                           .add("name", texture.name)
                           .add("width", texture.levels.empty() ? 0 : texture.levels[0].width)
                           .add("height", texture.levels.empty() ? 0 : texture.levels[0].height)
                           .object());
  const Box3 bounds = scene::boundsAtStart(scene);
  return JsonText()
      .add("scene", input)
      .add("name", scene.name)
      .add("objects", scene.objects.size())
      .add("triangles", scene.triangleCount())
      .add("diffuse_triangles", scene.triangleCount() - scene.reflectiveTriangleCount())
      .add("reflective_objects", scene.reflectorCount())
      .add("reflective_share", run::reflectiveShare(scene))
      .add("moving_objects",
           static_cast<std::uint64_t>(std::count(moving.begin(), moving.end(), true)))
      .add("duration", scene.duration())
      .add("lights", scene.lights.size())
      .add("cameras", scene.cameras.size())
      .add("camera_names", namesOfCameras(scene))
      .add("camera", cameraText(scene, bounds))
      .raw("bounds", "[[" + placeText(scene, bounds, bounds.min) + "],[" +
                         placeText(scene, bounds, bounds.max) + "]]")
      .add("environment", environmentName(scene.environment.type))
      .add("bake", bakeName(scene.bake.mode))
      .add("memory_bytes", scene.memoryBytes())
      .add("memory_bound_bytes", run::sceneMemoryBound(scene))
      .raw("reflectors", "[" + joined(reflectors, ",") + "]")
      .raw("textures", "[" + joined(textures, ",") + "]")
      .add("notes", scene.notes)
      .add("warnings", scene.warnings)
      .object();
}

std::string reflectorsText(const scene::Scene& scene) {
  std::size_t widest = 4;
  for (const scene::Object& object : scene.objects)
    if (object.reflector > 0) widest = std::max(widest, object.name.size());
  std::string text = "reflectors\n  " + paddedTo("no", 4) + paddedTo("id", 5) +
                     paddedTo("name", widest + 2) + paddedTo("s", 7) + paddedTo("g", 8) +
                     paddedTo("planar", 8) + "triangles\n";
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    const scene::Object& object = scene.objects[i];
    if (object.reflector == 0) continue;
    const scene::Material& material = materialOf(scene, object);
    text += "  " + paddedTo(std::to_string(object.reflector), 4) +
            paddedTo(std::to_string(i + 1), 5) + paddedTo(object.name, widest + 2) +
            fmt::format("{:<7.3g}{:<8.3g}", material.specularLevel, material.roughness) +
            paddedTo(object.planar ? "yes" : "no", 8) + std::to_string(trianglesOf(scene, object)) +
            "\n";
  }
  return text;
}

std::string texturesText(const scene::Scene& scene) {
  std::string text = "textures\n";
  for (const scene::Texture& texture : scene.textures) {
    std::string size = "?";
    if (!texture.levels.empty())
      size =
          std::to_string(texture.levels[0].width) + "x" + std::to_string(texture.levels[0].height);
    text += "  " + size + "  " + texture.name + "\n";
  }
  return text;
}

/// "notes" and a line for each; nothing when there are none.
std::string listText(const char* title, const std::vector<std::string>& lines) {
  std::string text;
  for (const std::string& line : lines) text += "  " + line + "\n";
  return lines.empty() ? "" : std::string(title) + "\n" + text;
}

std::string infoText(const std::string& input, const scene::Scene& scene,
                     const std::vector<bool>& moving) {
  std::string text = (scene.name.empty() ? input : scene.name) + " (" + input + ")\n";
  const auto line = [&](const char* name, const std::string& value) {
    text += "  " + paddedTo(name, 14) + value + "\n";
  };
  line("triangles", std::to_string(scene.triangleCount()) + ", of which " +
                        std::to_string(scene.triangleCount() - scene.reflectiveTriangleCount()) +
                        " diffuse");
  line("objects", std::to_string(scene.objects.size()) + ", of which " +
                      std::to_string(scene.reflectorCount()) + " reflective and " +
                      std::to_string(std::count(moving.begin(), moving.end(), true)) + " moving");
  if (scene.reflectorCount() > 0)
    line("reflective", fmt::format("{:.1f} % of the first frame of the scene's own camera",
                                   100.0 * run::reflectiveShare(scene)));
  line("materials", std::to_string(scene.materials.size()));
  line("lights", std::to_string(scene.lights.size()));
  const std::vector<std::string> cameras = namesOfCameras(scene);
  line("cameras", cameras.empty() ? "none" : joined(cameras, ", "));
  const Box3 bounds = scene::boundsAtStart(scene);
  line("camera", cameraText(scene, bounds) + "  (what --camera takes: eye/target/field of view)");
  line("bounds",
       placeText(scene, bounds, bounds.min) + " to " + placeText(scene, bounds, bounds.max));
  line("environment", scene.environment.isDefault
                          ? std::string("a default sky and sun, because the file has no light")
                          : std::string(environmentName(scene.environment.type)));
  line("baked light", bakeName(scene.bake.mode));
  if (scene.animated())
    line("animation", fmt::format("{:.3g} s", static_cast<float>(scene.duration())));
  line("memory", run::bytesText(scene.memoryBytes()) + " loaded, at most " +
                     run::bytesText(run::sceneMemoryBound(scene)) +
                     " while rendering (frames apart)");
  if (scene.reflectorCount() > 0) text += reflectorsText(scene);
  if (!scene.textures.empty()) text += texturesText(scene);
  return text + listText("notes", scene.notes) + listText("warnings", scene.warnings);
}

ExitCode info(RunOptions options, const CommonOptions& common) {
  options.input = listedFile(options.input, {"scenes"});
  const std::string& input = options.input;
  requireScene(input);
  const scene::Scene scene = run::loadScene(readScene(options));
  // Reads the environment's image: it may be bad.
  static_cast<void>(frame::EnvironmentLight(scene.environment));
  const std::vector<bool> moving = scene::movingObjects(scene);
  printData(common.json ? infoJson(input, scene, moving) + "\n" : infoText(input, scene, moving));
  return ExitCode::Done;
}

}  // namespace

Command infoCommand(CommonOptions& common) {
  const auto options = std::make_shared<RunOptions>();
  return {"info", "Show a scene's triangles, reflectors, textures and memory.",
          Rows{option("scene", options->input, "SCENE", "A scene (.json, .gltf, .glb)",
                      {.required = true})} +
              sceneRows(*options) + commonRows(common),
          "Example:\n  catoptric info scenes/cornell_box.json\n",
          [options, &common] { return info(*options, common); }};
}

}  // namespace catoptric::app
