#include "methods/shared/impostors/impostor_method.h"

namespace catoptric::methods::impostors {

const TableInfo& impostorsTable() {
  static const TableInfo table{
      "impostors",
      "an impostor that a frame needs",
      {{"object", ColumnType::Integer, "id of the object"},
       {"way", ColumnType::Text, "impostor: quad, plane (a flat object's own plane) or depth map"},
       {"drawn", ColumnType::Integer, "1: drawn in this frame; 0: kept from an earlier one"},
       {"texel_m", ColumnType::Real, "width of a texel at the object's centroid"}}};
  return table;
}

const TableInfo& unfitTable() {
  static const TableInfo table{"unfit",
                               "an unfit reflector in view",
                               {{"object", ColumnType::Integer, "id of the object"},
                                {"reason", ColumnType::Text, "itself or near"},
                                {"traced", ColumnType::Integer, "1: by Embree"}}};
  return table;
}

std::vector<StepInfo> commonSteps() {
  return {{"cube_map", "start, frames",
           "the environment map is drawn without objects that have impostors; again after "
           "something that it shows has moved"},
          {"impostors", "frames", "images of new and changed impostors are drawn"},
          {"choose", "start, frames",
           "start: which reflectors are `unfit`; frames: which have images, if these are many"},
          {"intersect", "frames",
           "rays are intersected with impostors, or looked up in the environment map"},
          {"readback", "frames",
           "masks of samples are read back and counted; for intersections on the CPU also the "
           "G-buffer"},
          {"upload", "frames", "reflections from the CPU are uploaded"},
          {"bvh", "start, frames", "Embree's BVH, if reflectors may be traced"},
          {"trace", "frames", "rays of reflectors without impostors are traced by Embree"},
          {"resolve", "frames", "these rays are generated; hits are shaded"}};
}

std::vector<CounterInfo> commonCounters() {
  return {
      {"environment", "samples with a ray that is looked up in the environment map"},
      {"below_horizon",
       "samples with a corrected normal, so that the mirrored ray leaves the surface"},
      {"second_order", "samples whose ray continued from a reflective impostor"},
      {"transition", "samples with a ray that hits a virtual wall", false,
       "transition_height above 0"},
      {"culled",
       "pairs of a ray and an impostor that were not tested: it lies outside the bounds of a "
       "tile's "
       "rays, or behind their hits; only where the CPU intersects rays"},
      {"impostors_rendered", "images drawn in this frame"},
      {"impostors_reused", "images reused from earlier frames"},
      {"enclosing", "objects about a reflector, in the environment map"},
      {"left_in_map", "objects beyond `most`, in the environment map"},
      {"traced_reflectors", "reflectors that `fallback` traces"},
      {.name = "traced_samples", .meaning = "samples of these", .handedOn = true},
      {"unfit",
       "reflectors in view that reflect much of themselves (itself) or, for billboards, are near "
       "large objects (near)"},
      {"coinciding", "pairs of a reflector and an object with the same centroid"},
      {"refraction_mirrored", "samples of refractive materials, which are mirrored instead"},
      {"shows_clamped",
       "samples that take their radiance from a texel above the range of half floats", true},
      {"clamped_cube_map", "texels of the cube map above the range of half floats", true},
      {"clamped_images", "texels of the impostors' images above the range of half floats", true}};
}

}  // namespace catoptric::methods::impostors
