// What all methods of a run share: the scene, its geometry and light, the GL context and the
// scene's GL side. Built once, and only as far as the plan asks.
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

/// Thrown between the steps of start-up, and within a bake, when the run was asked to stop.
struct Stopped : std::exception {
  const char* what() const noexcept override { return "the run was asked to stop"; }
};

class Stage {
 public:
  /// Loads the scene, its environment and the path. Throws SceneError, UsageError.
  explicit Stage(const RunConfig& run);

  const RunConfig& run() const { return run_; }
  const scene::Scene& scene() const { return scene_; }
  const scene::CameraPath& path() const { return *path_; }
  /// The run's frames (its `frames`, else all of the path), ascending.
  const std::vector<int>& frames() const { return frames_; }

  /// Asked during start-up; may be called by several threads.
  void setStopRequested(std::function<bool()> stopRequested) {
    stopRequested_ = std::move(stopRequested);
  }
  /// Told of long steps of start-up: the step, the share that is done; by several threads.
  void setStartupProgress(std::function<void(const std::string&, double)> progress) {
    startupProgress_ = std::move(progress);
  }
  /// Throws Stopped.
  void checkStop() const {
    if (stopRequested_ && stopRequested_()) throw Stopped();
  }

  /// Geometry at time 0, baked light; once. Throws Stopped.
  void buildGeometry();
  /// Context and the scene's GL side; once. Needs the geometry.
  void buildRaster();

  /// Brings geometry, light and the GL side to a moment; returns the objects that changed. With
  /// `timer` as step `geometry`, where something can move at all.
  std::vector<int> moveTo(double timeSeconds, frame::StepTimer* timer);

  const frame::Geometry& geometry() const { return geometry_; }
  const frame::Lighting& lighting() const { return lighting_; }
  /// Fingerprint of the baked light; empty where none is baked.
  const std::string& light() const { return light_; }
  raster::SceneRaster* raster() { return raster_.get(); }
  gl::Context* context() { return context_ ? &*context_ : nullptr; }

  /// Samples of start-up so far (frame 0).
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
  std::unique_ptr<raster::SceneRaster> raster_;  // after the context: destroyed before it
};

}  // namespace catoptric::run
