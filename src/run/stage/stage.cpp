#include "run/stage/stage.h"

#include <algorithm>

#include "config/json.h"
#include "config/json_text.h"
#include "core/error.h"
#include "core/file.h"
#include "core/hash.h"
#include "core/log.h"
#include "core/nearest_file.h"
#include "core/vector_level.h"
#include "gl/api.h"
#include "gl/device.h"
#include "scene/animate.h"
#include "scene/loader.h"
#include "trace/bake/bake.h"

namespace catoptric::run {
namespace {

/// Leftovers of killed processes; a cache is no reason to fail.
void sweepCache(const std::filesystem::path& cache) {
  try {
    sweepTemporaryFiles(cache);
  } catch (const OutputError& error) {
    log::warning(error.what());
  }
}

/// A path or a run config named as the scene, and so on: one line says what it is.
void checkKinds(const RunConfig& run) {
  const auto check = [](const std::filesystem::path& file, FileKind wanted, const char* member) {
    if (file.extension() != ".json") return;
    FileKind kind = FileKind::Unknown;
    try {
      kind = fileKind(config::parseFile(file));
    } catch (const UsageError&) {  // whoever loads it says more
    }
    if (kind == FileKind::Unknown || kind == wanted) return;
    const char* what = kind == FileKind::RunConfig ? "a run config"
                       : kind == FileKind::Scene   ? "a scene"
                                                   : "a camera path";
    throw UsageError(file.string() + ": is " + what + "; it cannot be the config's \"" + member +
                     "\"");
  };
  check(run.scene, FileKind::Scene, "scene");
  if (!run.path.empty()) check(run.path, FileKind::Path, "path");
}

/// A file that the config names must be there; `reference` says where it is named.
void requireFile(const std::filesystem::path& file, const std::string& reference, ExitCode code) {
  std::error_code ignored;
  if (file.empty() || std::filesystem::is_regular_file(file, ignored)) return;
  const bool onCommandLine = reference.starts_with("--");
  const std::string what = std::filesystem::exists(file, ignored)
                               ? file.string() + " is not a regular file"
                               : noFileText(file);
  throw Error(
      code,
      reference + ": " + what +
          (onCommandLine ? " (names given by --set are relative to the current folder)" : ""));
}

/// Says what was chosen because neither the config nor the scene does.
void sayDefaults(const RunConfig& run, const scene::Scene& scene, std::size_t frames) {
  if (scene.environment.isDefault)
    log::info(
        run.scene.string() +
        ": has no light, so a default sky and sun light it; --environment FILE|COLOUR chooses "
        "another light");
  if (run.path.empty() && run.camera.empty() && !scene.cameras.empty())
    log::info(run.scene.string() + ": its camera \"" + scene.cameras.front().name + "\"" +
              (scene.cameras.size() > 1
                   ? ", the first of " + std::to_string(scene.cameras.size()) +
                         ", is used; --camera NAME uses another one (`catoptric info` lists them)"
                   : " is used") +
              "; --camera front, three_quarter or turntable:48 shows the whole scene");
  if (run.path.empty() && run.frames.empty() && frames > 1 && scene.duration() > 0.0 &&
      !run.camera.starts_with("turntable:"))
    log::info("all " + std::to_string(frames) + " frames of the scene's animation are rendered (" +
              config::numberText(scene.duration()) +
              " s, 30 frames per second); --frames 1 renders the first, --frames 1-" +
              std::to_string(frames) + "x10 every tenth");
}

constexpr int kMaxFrame = 10'000'000;  ///< of any path

}  // namespace

scene::Scene loadScene(const RunConfig& run) {
  try {
    scene::LoadLimits limits = scene::limitsOfEnvironment();
    limits.showMissingTextures = run.showMissingTextures;
    limits.assetFolders = run.assetFolders;
    return scene::loadScene(run.scene, limits, run.environment, run.ground);
  } catch (const UsageError& error) {  // of its description
    throw SceneError(error.what());
  }
}

Stage::Stage(const RunConfig& run) : run_(run) {
  const InputFiles::Recording recording(run_.inputs);
  // Wrong names, frames and files are noticed before anything large is loaded
  gl::parseDevice(run_.device);
  vectorLevel();
  if (!run_.frames.empty()) scene::parseFrames(run_.frames, kMaxFrame);
  requireFile(run_.scene, run_.sceneReference, ExitCode::Scene);
  requireFile(run_.path, run_.pathReference, ExitCode::Usage);
  checkKinds(run_);
  requireFile(run_.preview.ocio, run_.preview.ocioReference, ExitCode::Usage);
  if (!run_.preview.view.empty() || !run_.preview.ocio.empty())
    image::viewFingerprint(run_.preview.shown());
  scene_ = timer_.measure("scene", [&] { return loadScene(run_); });
  for (const std::string& warning : scene_.warnings) log::warning(warning);
  timer_.measure("path", [&] {
    try {
      path_ = run_.path.empty() ? scene::cameraPath(run_.camera, scene_)
                                : scene::loadPath(run_.path, scene_);
    } catch (const UsageError& error) {
      if (!run_.path.empty()) throw;
      throw UsageError(run_.cameraReference + ": " + error.what());
    }
  });
  run_.image.path = path_.get();
  if (run_.frames.empty()) {
    for (int number = 1; number <= path_->count(); ++number) frames_.push_back(number);
  } else {
    try {
      frames_ = scene::parseFrames(run_.frames, path_->count());
    } catch (const UsageError& error) {
      if (!run_.path.empty() || path_->count() > 1) throw;
      throw UsageError(std::string(error.what()) +
                       "; nothing moves; --camera turntable:48 turns around the scene");
    }
  }
  sayDefaults(run_, scene_, frames_.size());
  const std::vector<bool> moving = scene::movingObjects(scene_);
  moving_ = scene_.animated() && (std::find(moving.begin(), moving.end(), true) != moving.end() ||
                                  !scene_.lights.empty());
  // The environment's image may be bad: say so before a folder is made
  environment_ = timer_.measure("environment", [&] {
    return std::make_shared<const frame::EnvironmentLight>(scene_.environment);
  });
}

void Stage::buildGeometry() {
  if (geometryBuilt_) return;
  checkStop();
  // Light is baked at time 0, whatever frames are asked for: chunks must agree.
  const scene::Pose pose = scene::poseAt(scene_, 0.0);
  geometry_ = timer_.measure("geometry", [&] { return frame::makeGeometry(scene_, pose); });
  if (scene_.bake.mode != scene::BakeMode::None) {
    const std::filesystem::path cache = cacheFolder();
    if (!cache.empty()) sweepCache(cache);
    trace::BakeCallbacks callbacks{stopRequested_, {}};
    if (startupProgress_)
      callbacks.progress = [this](double share) { startupProgress_("bake", share); };
    const trace::BakeReport report = timer_.measure("bake", [&] {
      return trace::bakeVertices(scene_, geometry_, *environment_, cache, callbacks);
    });
    if (report.stopped) throw Stopped();
    Fingerprint light;
    for (const frame::VertexAttributes& vertex : geometry_.attributes) light.addValue(vertex.bake);
    light_ = light.text();
    log::debug(report.fromCache ? "baked light comes from the cache"
                                : "light was baked with " + std::to_string(report.rays) + " rays");
  }
  lighting_ = frame::makeLighting(scene_, pose, environment_);
  geometryBuilt_ = true;
}

void Stage::buildRaster() {
  if (raster_) return;
  checkStop();
  context_.emplace(
      timer_.measure("context", [&] { return gl::Context(gl::parseDevice(run_.device)); }));
  timer_.setFinish([] { glFinish(); });  // which cannot throw: it is called by a destructor
  raster_ = timer_.measure(
      "programs", [&] { return std::make_unique<raster::SceneRaster>(scene_, geometry_); });
  raster_->cacheLevelsIn(cacheFolder());
  context_->check("start-up");
}

std::vector<int> Stage::moveTo(double timeSeconds, frame::StepTimer* timer) {
  if (!moving_) return {};
  const auto move = [&] {
    const scene::Pose pose = scene::poseAt(scene_, timeSeconds);
    std::vector<int> changed = frame::updateGeometry(geometry_, scene_, pose);
    lighting_ = frame::makeLighting(scene_, pose, environment_);
    if (raster_ && !changed.empty()) raster_->update(geometry_, changed);
    return changed;
  };
  return timer != nullptr ? timer->measure("geometry", move) : move();
}

}  // namespace catoptric::run
