// One frame of a method without a run: for tests of methods that need no GL.
#pragma once

#include <algorithm>
#include <memory>
#include <string>
#include <utility>

#include "frame/geometry.h"
#include "frame/shading.h"
#include "frame/steps.h"
#include "methods/contract/method.h"
#include "scene/animate.h"
#include "scene/camera.h"
#include "trace/embree/trace_scene.h"

namespace catoptric::test {

/// Scene, geometry and lighting at one moment.
struct Moment {
  const scene::Scene& scene;
  frame::Geometry geometry;
  frame::Lighting lighting;

  explicit Moment(const scene::Scene& s, double timeSeconds = 0.0) : scene(s) {
    const scene::Pose pose = scene::poseAt(s, timeSeconds);
    geometry = frame::makeGeometry(s, pose);
    lighting =
        frame::makeLighting(s, pose, std::make_shared<frame::EnvironmentLight>(s.environment));
  }
};

inline const methods::MethodEntry& methodNamed(const std::string& id) {
  return *std::ranges::find(methods::registry(), id, &methods::MethodEntry::id);
}

/// Renders with a method that makes whole images on the CPU.
inline methods::FrameOutput renderOnCpu(const methods::MethodEntry& entry,
                                        const std::string& options, const Moment& moment,
                                        const scene::Camera& camera,
                                        const methods::RunSettings& settings) {
  const std::unique_ptr<methods::Method> method =
      entry.make(config::parseText(options, "test options"));
  const methods::MethodPlan plan = method->plan(moment.scene, settings);
  trace::TraceScene trace(moment.scene, moment.geometry, plan.bvh);
  frame::StepTimer timer;
  methods::Services services{
      moment.scene, moment.geometry, moment.lighting, nullptr, nullptr, &trace, timer};
  method->prepare(services, settings);
  methods::FrameInput input;
  input.frame.camera = camera;
  methods::FrameOutput output;
  method->render(input, services, output);
  return output;
}

}  // namespace catoptric::test
