// The plan of a run: everything that its scene, methods and outputs require, each item with its
// reason. Nothing else is built, compiled or allocated. `catoptric plan` prints it.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "core/error.h"
#include "frame/shading.h"
#include "methods/contract/method.h"
#include "run/config/run_config.h"
#include "scene/scene.h"

namespace catoptric::run {

struct PlannedMethod {
  std::string name;
  std::string id;
  methods::MethodPlan needs;
  std::vector<methods::PlanItem> items;  ///< items of the shared pipeline, then those of the method
  std::size_t warmUpFrames =
      0;  ///< frames that are rendered only for the state of later frames, and discarded
  bool mixed = false;  ///< whether other methods may shade some of its reflectors
};

/// Whether a path that is refracted by the object enters and leaves it, as opposed to passing a
/// pane.
inline bool refractsAsBody(const scene::Scene& scene, const scene::Object& object) {
  const scene::Material& material = scene.materials[static_cast<std::size_t>(object.material)];
  return object.reflector != 0 && !object.planar && material.refraction > 0.0f;
}

struct Plan {
  std::vector<methods::PlanItem> shared;  ///< done once for all methods
  std::vector<PlannedMethod> methods;
  std::size_t frames = 0;
  bool gl = false;  ///< whether any method needs a GL context

  /// The memory that the process needs for this method, with all that methods share.
  std::uint64_t bytesOf(const PlannedMethod& method) const;
};

/// The methods of a run that do not support its scene, or some of its reflectors.
struct UnsupportedError : UsageError {
  UnsupportedError(const std::string& what, std::string why)
      : UsageError(what), reason(std::move(why)) {}
  std::string reason;  ///< one line: how many objects the first such method refuses, and why
};

/// Makes the plan. `made`: one method per entry of run.methods. Throws UnsupportedError, which
/// names the reflectors that a method does not support.
Plan makePlan(const RunConfig& run, const scene::Scene& scene,
              const frame::EnvironmentLight& environment, std::size_t frames,
              const std::vector<std::unique_ptr<methods::Method>>& made);

/// Sets for each method how many frames of the path only warm up its state, before or between the
/// requested frames.
void planWarmUps(Plan& plan, const scene::CameraPath& path, const std::vector<int>& asked,
                 const std::vector<std::unique_ptr<methods::Method>>& made);

/// A warning about cube maps that are large compared with the frame, one line each; or empty.
std::string cubeMapWarning(const Plan& plan, const methods::RunSettings& image);

/// A warning about methods whose paths end inside refractive objects, one line each; or empty.
std::string refractionWarning(const Plan& plan, const scene::Scene& scene);

/// Notes about unexpected reflections: nothing is reflective, or only dielectrics below the
/// threshold; Fresnel's term has no effect; mirrors in mirrors look diffuse.
std::vector<std::string> reflectionNotes(const Plan& plan, const scene::Scene& scene,
                                         const methods::RunSettings& image);

/// The plan as a table for a terminal, and as JSON.
std::string planText(const Plan& plan);
std::string planJson(const Plan& plan);

/// What rendering a scene needs at most, without process and frames: the loaded scene, its
/// geometry, their copies for GL, and Embree's structure.
std::uint64_t sceneMemoryBound(const scene::Scene& scene);

/// For example "1.5 MB"; empty for 0.
std::string bytesText(std::uint64_t bytes);

}  // namespace catoptric::run
