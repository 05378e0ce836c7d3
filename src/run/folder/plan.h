// The plan: what this scene, these methods and these outputs require, each item with its reason.
// Nothing outside it is built, compiled or allocated; `catoptric plan` prints it.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "methods/contract/method.h"
#include "run/config/run_config.h"
#include "scene/scene.h"

namespace catoptric::run {

struct PlannedMethod {
  std::string name;
  std::string id;
  methods::MethodPlan needs;
  std::vector<methods::PlanItem> items;  ///< of the shared pipeline and the method's own, in order
  std::size_t warmUpFrames = 0;          ///< rendered for the state of later frames, and not kept
  bool mixed = false;                    ///< other methods may fill some of its reflectors
};

/// Whether a path that is seen through the object goes in and out of it: no pane.
inline bool refractsAsBody(const scene::Scene& scene, const scene::Object& object) {
  const scene::Material& material = scene.materials[static_cast<std::size_t>(object.material)];
  return object.reflector != 0 && !object.planar && material.refraction > 0.0f;
}

struct Plan {
  std::vector<methods::PlanItem> shared;  ///< done once for all methods
  std::vector<PlannedMethod> methods;
  std::size_t frames = 0;
  bool gl = false;  ///< some method needs a context
};

/// Throws UsageError naming the reflectors that a method cannot do. `made`: one per entry of
/// run.methods.
Plan makePlan(const RunConfig& run, const scene::Scene& scene, std::size_t frames,
              const std::vector<std::unique_ptr<methods::Method>>& made);

/// Adds to each method how many frames of the path warm its state up, before or between the frames
/// asked for.
void planWarmUps(Plan& plan, const scene::CameraPath& path, const std::vector<int>& asked,
                 const std::vector<std::unique_ptr<methods::Method>>& made);

/// What the methods need that need more than half of `memoryBytes`; empty when none does. Throws
/// UsageError with the figures for what needs more than all of it.
std::string memoryWarning(const Plan& plan, std::uint64_t memoryBytes);

/// Cube maps that are large beside the frame, one line each; empty when none is.
std::string cubeMapWarning(const Plan& plan, const methods::RunSettings& image);

/// Methods whose paths end inside of bodies that refract, one line each; empty when there are none.
std::string refractionWarning(const Plan& plan, const scene::Scene& scene);

/// As a table for a terminal, and as JSON.
std::string planText(const Plan& plan);
std::string planJson(const Plan& plan);

/// "1.5 MB"; empty for 0.
std::string bytesText(std::uint64_t bytes);

}  // namespace catoptric::run
