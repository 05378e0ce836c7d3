#include "methods/perturbation/reports.h"

namespace catoptric::methods {

const std::vector<StepInfo>& perturbationSteps() {
  static const std::vector<StepInfo> steps = {
      {"paths", "frames",
       "sparse rays to the reflectors are traced and differentiated; again after the camera or a "
       "reflector has moved"},
      {"virtual_objects", "frames",
       "positions of reflected vertices are computed; again for objects that have moved"},
      {"virtual_draw", "frames",
       "virtual objects are drawn; uncovered samples take the environment"},
      {"recompute", "frames", "with gaps: trace, uncovered samples are traced"},
      {"disocclusions", "frames",
       "with image.count_disocclusions: Embree checks which samples missed a surface",
       StepKind::Check},
  };
  return steps;
}

const std::vector<CounterInfo>& perturbationCounters() {
  static const std::vector<CounterInfo> counters = {
      {"paths", "sampled paths"},
      {"path_types",
       "sequences of reflectors (a mirror, a mirror in a mirror, ...) that "
       "sampled paths hit, and in which virtual objects are drawn"},
      {"path_types_missed",
       "sequences that end at a reflector too small for any sampled path to hit"},
      {"path_types_left_out",
       "sequences beyond the first 1024, whose reflectors show their diffuse component"},
      {"total_reflection", "sampled paths that are totally reflected inside a refractive object"},
      {"vertices",
       "points whose reflections were computed: distinct vertices, and midpoints of edges"},
      {"triangles", "virtual triangles"},
      {"dropped_triangles",
       "virtual triangles left out because not all vertices appear in the same reflection; 0 with "
       "order: auto, which cuts such triangles where the reflection ends"},
      {"coarse_objects",
       "objects whose edges were not subdivided further, because of traced_per_pixel"},
      {"objects_left_out", "objects in mirrors beyond memory_mib, replaced by the environment"},
      {"linear", "reflections computed from a sampled path and its Jacobian"},
      {"quadratic", "reflections computed from a sampled path, its Jacobian and its Hessian"},
      {"retraced", "reflections whose path was traced"},
      {"not_converged", "candidates that did not converge to a reflection"},
      {"reflections_left_out", "reflections of a point beyond its 64th"},
      {"environment", "uncovered samples, in the sky and in gaps, which take the environment"},
      {.name = "traced_gaps",
       .meaning = "with gaps: trace, uncovered samples whose traced ray hits a surface",
       .handedOn = true},
      {"refused", "invalid rays, which Embree cannot trace; they return the environment", true},
      {"not_finite", "radiances that were NaN or infinite, replaced by 0", true},
      {"disoccluded", "uncovered samples whose ray hits a surface", false,
       "image.count_disocclusions"},
  };
  return counters;
}

}  // namespace catoptric::methods
