#include "methods/perturbation/reports.h"

namespace catoptric::methods {

const std::vector<StepInfo>& perturbationSteps() {
  static const std::vector<StepInfo> steps = {
      {"paths", "frames",
       "sparse rays meet the reflectors, the paths are expanded; again when the camera or a "
       "reflector moved"},
      {"virtual_objects", "frames",
       "where the vertices of reflected objects appear; again for what moved"},
      {"cube_map", "frames",
       "with unsupported reflectors: the cube map is drawn, again when something moved"},
      {"virtual_draw", "frames", "virtual objects are drawn, what they leave sees the environment"},
      {"disocclusions", "frames",
       "with count_disocclusions: Embree's rays say which samples missed a surface"},
  };
  return steps;
}

const std::vector<CounterInfo>& perturbationCounters() {
  static const std::vector<CounterInfo> counters = {
      {"paths", "sampled paths"},
      {"path_types", "sequences of reflectors that are followed"},
      {"path_types_missed", "sequences that are visible but that no sampled path meets"},
      {"path_types_left_out",
       "sequences beyond max_path_types: their reflectors show the diffuse "
       "part there"},
      {"total_reflection",
       "sampled paths that were reflected totally where they should leave a "
       "body"},
      {"vertices", "vertices whose reflections were looked for"},
      {"triangles", "virtual triangles drawn"},
      {"dropped_triangles", "virtual triangles that were left out"},
      {"coarse_objects", "objects whose edges were halved no more, as that had cost too much"},
      {"linear", "reflections found by the first order alone"},
      {"quadratic", "reflections found by the second order"},
      {"retraced", "reflections found by a path traced anew"},
      {"not_converged", "candidates that led to no reflection"},
      {"reflections_left_out", "reflections of a point beyond its 64th"},
      {"environment", "samples that nothing covers: sky and gaps alike see the environment"},
      {"unsupported_reflector", "samples of reflectors that the method cannot do"},
      {"clamped_cube_map", "texels of the cube map beyond half floats", true},
      {"disoccluded", "gaps: samples that nothing covers where a surface is", false,
       "count_disocclusions"},
  };
  return counters;
}

}  // namespace catoptric::methods
