// The state that all methods of a run share: the scene, its geometry and light, the GL context, and
// the scene's GL side. It is built once, and only as far as the plan requires.
#pragma once

#include <exception>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "frame/geometry.h"
#include "frame/shading.h"
#include "frame/steps.h"
#include "gl/context.h"
#include "raster/scene_raster.h"
#include "run/config/run_config.h"
#include "scene/camera.h"
#include "scene/scene.h"

namespace catoptric::run {

/// Thrown between the steps of start-up, and within a bake, if the run was asked to stop.
struct Stopped : std::exception {
  const char* what() const noexcept override { return "the run was asked to stop"; }
};

/// The scene of a run config. Throws SceneError with file and place.
scene::Scene loadScene(const RunConfig& run);

class Stage {
 public:
  /// Loads the scene, its environment and the path. Throws SceneError, UsageError.
  explicit Stage(const RunConfig& run);

  const RunConfig& run() const { return run_; }
  const scene::Scene& scene() const { return scene_; }
  const frame::EnvironmentLight& environment() const { return *environment_; }
  const scene::CameraPath& path() const { return *path_; }
  /// The files of config, scene, path, environment and assets, as they were read.
  const InputFiles& inputs() const { return run_.inputs; }
  /// The frames of the run, ascending: its `frames`, or all frames of the path.
  const std::vector<int>& frames() const { return frames_; }

  /// Sets a function that is called during start-up, possibly by several threads.
  void setStopRequested(std::function<bool()> stopRequested) {
    stopRequested_ = std::move(stopRequested);
  }
  /// Sets a function that receives the name of a long start-up step and the fraction of it that is
  /// done. Several threads may call it.
  void setStartupProgress(std::function<void(const std::string&, double)> progress) {
    startupProgress_ = std::move(progress);
  }
  /// Throws Stopped.
  void checkStop() const {
    if (stopRequested_ && stopRequested_()) throw Stopped();
  }

  /// Builds the geometry at time 0 and bakes light. Call once. Throws Stopped.
  void buildGeometry();
  /// Creates the GL context and the scene's GL side. Call once, after buildGeometry().
  void buildRaster();

  /// Updates geometry, light and the GL side to a time. Returns the objects that changed. `timer`:
  /// if set and anything in the scene can move, the time is recorded as step `geometry`.
  std::vector<int> moveTo(double timeSeconds, frame::StepTimer* timer);

  const frame::Geometry& geometry() const { return geometry_; }
  const frame::Lighting& lighting() const { return lighting_; }
  /// The fingerprint of the baked light; empty if none is baked.
  const std::string& light() const { return light_; }
  raster::SceneRaster* raster() { return raster_.get(); }
  gl::Context* context() { return context_ ? &*context_ : nullptr; }

  /// The times of start-up's steps so far. They belong to frame 0.
  const std::vector<frame::StepSample>& startup() const { return timer_.samples(); }

 private:
  RunConfig run_;
  std::function<bool()> stopRequested_;
  std::function<void(const std::string&, double)> startupProgress_;
  frame::StepTimer timer_;
  scene::Scene scene_;
  std::unique_ptr<scene::CameraPath> path_;
  std::vector<int> frames_;
  bool moving_ = false;
  bool geometryBuilt_ = false;
  frame::Geometry geometry_;
  std::shared_ptr<const frame::EnvironmentLight> environment_;
  frame::Lighting lighting_;
  std::string light_;
  std::optional<gl::Context> context_;
  std::unique_ptr<raster::SceneRaster>
      raster_;  // declared after the context, so destroyed before it
};

}  // namespace catoptric::run
