#include "run/stage/steps.h"

namespace catoptric::run {

using methods::StepKind;

const std::vector<methods::StepInfo>& pipelineSteps() {
  static const std::vector<methods::StepInfo> meanings = {
      {"scene", "start", "the scene description and its files are read and checked"},
      {"path", "start", "the camera path is read"},
      {"geometry", "start, frames",
       "vertices in world space; in a frame: moved to its time, where something can move"},
      {"environment", "start",
       "the environment's light is prepared (an image is read and integrated)"},
      {"bake", "start", "light or occlusion per vertex, computed or taken from the cache"},
      {"context", "start", "the OpenGL context is made"},
      {"programs", "start",
       "the shared shaders are compiled, meshes and textures put on the device"},
      {"bvh", "start, frames",
       "Embree's tree is built; in a frame: follows the geometry, by the method's policy"},
      {"allocate", "start", "memory of the G-buffer and the frame"},
      {"prepare", "start", "what a method prepares besides the steps that it names"},
      {"warm_up", "start", "frames that are not kept: the method needs their state for later ones"},
      {"gbuffer", "frames", "diffuse radiance, normals, s, g, ids and depth are rasterized"},
      {"composite", "frames", "diffuse and reflection are joined, samples resolved to pixels"},
      {"readback", "frames", "the frame's pixels are read from the device"},
      {"layers", "frames", "asked-for layers and masks are read and resolved to pixels",
       StepKind::Extras},
      {"other", "frames", "the rest of the frame's time: what no step names", StepKind::Rest},
      {"wait", "frames", "the frame waits for the writers, the second also for what they load",
       StepKind::Waiting},
      {"encode", "beside", "the EXR file is compressed"},
      {"preview", "beside", "the PNG preview is made"},
      {"write", "beside", "files are written, synced and renamed"},
  };
  return meanings;
}

std::map<std::string, std::string> stepKinds() {
  std::map<std::string, std::string> kinds;
  const auto add = [&](const std::vector<methods::StepInfo>& steps) {
    for (const methods::StepInfo& step : steps)
      if (step.kind != StepKind::Rendering) kinds[step.name] = methods::stepKindName(step.kind);
  };
  add(pipelineSteps());
  for (const methods::MethodEntry& entry : methods::registry()) add(entry.steps);
  return kinds;
}

const std::vector<methods::CounterInfo>& pipelineCounters() {
  static const std::vector<methods::CounterInfo> counters = {
      {"gbuffer_triangles", "triangles drawn into the G-buffer", false,
       "methods that use the G-buffer"},
      {"gbuffer_culled_triangles", "triangles left out of it, as no sample shows them", false,
       "methods that use the G-buffer"},
      {"unsupported_reflector",
       "samples of reflectors that their method cannot do and another one fills", false,
       "`unsupported` other than \"error\", and such reflectors"},
      {"clamped_half", "values of the beauty beyond half floats", true},
  };
  return counters;
}

}  // namespace catoptric::run
