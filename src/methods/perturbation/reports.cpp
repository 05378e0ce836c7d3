#include "methods/perturbation/reports.h"

namespace catoptric::methods {

const std::vector<StepInfo>& perturbationSteps() {
  static const std::vector<StepInfo> steps = {
      {"paths", "frames",
       "sparse rays meet the reflectors, the paths are expanded; again when the camera or a "
       "reflector moved"},
      {"virtual_objects", "frames",
       "where the vertices of reflected objects appear; again for what moved"},
      {"virtual_draw", "frames", "virtual objects are drawn, what they leave sees the environment"},
      {"recompute", "frames", "with gaps: trace, what samples see that no virtual object covers"},
      {"disocclusions", "frames",
       "with image.count_disocclusions: Embree's rays say which samples missed a surface",
       StepKind::Check},
  };
  return steps;
}

const std::vector<CounterInfo>& perturbationCounters() {
  static const std::vector<CounterInfo> counters = {
      {"paths", "sampled paths"},
      {"path_types", "sequences of reflectors that sampled paths meet, and that are followed"},
      {"path_types_missed",
       "sequences by which reflectors show a further one, too small for any sampled path to meet "
       "it"},
      {"path_types_left_out",
       "sequences beyond the first 1024: there their reflectors show their diffuse component"},
      {"total_reflection",
       "sampled paths that could not leave a body, because its surface reflects them totally"},
      {"vertices",
       "places whose reflections were looked up: vertices, those in one place once, and middles of "
       "edges"},
      {"triangles", "virtual triangles that were made"},
      {"dropped_triangles",
       "virtual triangles left out because their vertices do not share a reflection; 0 with order: "
       "auto, which cuts them"},
      {"coarse_objects",
       "objects whose edges were halved no more because they had cost traced_per_pixel paths"},
      {"objects_left_out",
       "objects in mirrors beyond memory_mib, which show the environment in their place"},
      {"linear", "reflections found by moving a sampled path by its Jacobian"},
      {"quadratic", "reflections found by moving a path by its Jacobian and Hessian"},
      {"retraced", "reflections for which a path was traced anew"},
      {"not_converged", "candidates that led to no reflection"},
      {"reflections_left_out", "reflections of a point beyond its 64th"},
      {"environment", "samples that nothing covers: sky and gaps alike see the environment"},
      {"traced_gaps",
       "with gaps: trace, samples that nothing covers and that see a surface: they show it"},
      {"refused", "rays that could not be traced; they see the environment", true},
      {"not_finite", "radiances that were no number: taken as 0", true},
      {"disoccluded", "gaps: samples that nothing covers where a surface is", false,
       "image.count_disocclusions"},
  };
  return counters;
}

}  // namespace catoptric::methods
