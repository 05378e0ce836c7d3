#include "run/stage/steps.h"

namespace catoptric::run {

using methods::StepKind;

const std::vector<methods::StepInfo>& pipelineSteps() {
  static const std::vector<methods::StepInfo> meanings = {
      {"scene", "start", "the scene description and its files are read and checked"},
      {"path", "start", "the camera path is read"},
      {"geometry", "start, frames",
       "vertices are transformed to world space; in a frame: only moving vertices"},
      {"environment", "start", "the environment is prepared (an image is read and integrated)"},
      {"bake", "start", "light or occlusion per vertex is computed, or read from the cache"},
      {"context", "start", "the OpenGL context is created"},
      {"programs", "start", "shared shaders are compiled; meshes and textures are uploaded"},
      {"bvh", "start, frames",
       "Embree's BVH is built; in a frame: it is updated by the method's policy"},
      {"allocate", "start", "memory of the G-buffer and the frame is allocated"},
      {"prepare", "start", "other preparations of a method"},
      {"warm_up", "start",
       "earlier frames, whose state the method needs, are rendered and dropped"},
      {"gbuffer", "frames", "diffuse radiance, normals, s, g, ids and depth are rasterized"},
      {"composite", "frames",
       "diffuse and reflection are combined, and samples are resolved to pixels"},
      {"readback", "frames", "the frame's pixels are read back"},
      {"layers", "frames", "requested layers and masks are read back and resolved to pixels",
       StepKind::Extras},
      {"other", "frames", "time of the frame that is in no step", StepKind::Rest},
      {"wait", "frames", "the frame waits for the writers", StepKind::Waiting},
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
      {"gbuffer_culled_triangles", "triangles culled from the G-buffer", false,
       "methods that use the G-buffer"},
      {"unsupported_reflector",
       "samples of reflectors that the method cannot render, and "
       "another method does",
       false, "`unsupported` other than \"error\", if the scene has such reflectors", true},
      {"fallback_samples", "samples that the method of `fallback` rendered", false,
       "a method as `fallback`, if the scene has reflectors", true},
      {"clamped_half", "colour values above the range of half floats", true},
  };
  return counters;
}

}  // namespace catoptric::run
