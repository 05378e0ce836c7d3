#include "methods/second_order/reports.h"

namespace catoptric::methods::second_order {

const std::vector<StepInfo>& stepInfos() {
  static const std::vector<StepInfo> steps = {
      {"levels", "start", "levels of detail are made"},
      {"cube_map", "start, frames", "the cube map is drawn; again after something has moved"},
      {"readback", "frames", "the G-buffer is read back"},
      {"cluster", "frames", "reflective samples are clustered"},
      {"camera", "frames", "each cluster gets a camera"},
      {"probe", "frames", "Embree traces a few samples of each cluster"},
      {"depth_images", "frames", "a depth image is drawn for each cluster"},
      {"intersect", "frames", "reflected rays are intersected with the depth images"},
      {"compare", "frames", "the probes are compared with the depth images"},
      {"recompute", "frames",
       "Embree traces small clusters, and those that reflect their own object or whose probes "
       "differ"},
      {"disocclusions", "frames",
       "with image.count_disocclusions: Embree checks which samples missed a surface",
       StepKind::Check},
  };
  return steps;
}

const std::vector<CounterInfo>& counterInfos() {
  constexpr const char* kDisocclusions = "image.count_disocclusions";
  static const std::vector<CounterInfo> counters = {
      {"reflective_samples", "reflective samples"},
      {"unclustered",
       "reflective samples in no cluster, which use the cube map; with probes only those of "
       "refractive objects and in scenes with flat mirrors alone; Embree traces the others"},
      {"environment",
       "clustered samples with a ray that passed behind a surface or left its image, and uses the "
       "cube map"},
      {"sky", "samples with a ray that left the scene"},
      {"bridged",
       "samples with a ray that ended in the gap between a near and a far surface of "
       "a depth image, and took the nearer one's colour"},
      {"below_horizon",
       "samples of mirrors with a corrected normal, and rays of lobes that were mirrored back "
       "above the surface"},
      {"met_itself",
       "samples with a ray that hits the reflector itself, and returns its diffuse component"},
      {"faded", "samples with a ray that faded to the diffuse colour with distance"},
      {"second_layer_hits", "samples with a hit in the second depth layer"},
      {"refraction_mirrored", "samples of refractive materials, which are mirrored instead"},
      {"clusters", "clusters of reflective samples"},
      {"planar_clusters", "clusters that are planar mirrors"},
      {"planar_samples", "samples in planar clusters"},
      {"concave_clusters", "concave clusters"},
      {"probes", "samples that Embree traced to estimate the clusters' errors"},
      {.name = "retraced", .meaning = "samples that Embree traced", .handedOn = true},
      {"small_clusters", "clusters that are traced because a depth image would cost more"},
      {"self_seeing_clusters", "clusters that are traced because they reflect their own object"},
      {"erring_clusters",
       "clusters that are traced because their probes differ from the depth image"},
      {"lamp_samples",
       "samples with a lobe ray that hits a surface brighter than white; their tiles of 16 x 16 "
       "samples are traced"},
      {"refused", "invalid rays, which Embree cannot trace; they return the environment", true},
      {"not_finite", "radiances that were NaN or infinite, replaced by 0", true},
      {"normals_cancel",
       "clusters whose normals sum to zero; their mean normal then points to the camera"},
      {"parallel_clusters", "clusters of parallel or converging rays, whose eye is far away"},
      {"crossing_clusters", "clusters whose rays cross"},
      {"pushed_back", "clusters whose eye was moved back behind all samples"},
      {"capped_images", "depth images with fewer texels than the samples' spacing needs"},
      {"empty_images", "empty depth images, whose rays are not marched"},
      {"texels", "texels of all depth images"},
      {"triangles", "triangles drawn into all depth images"},
      {"left_out", "objects too small for a depth image, over all images"},
      {"bound_by_shape",
       "objects not drawn coarser because the next level's shape errs too much, over all images"},
      {"bound_by_light",
       "objects not drawn coarser because the next level's light errs too much, over all images"},
      {"images_shrunk", "1 if the resolution of the depth images was reduced to fit memory_mib"},
      {"depth_image_bytes", "memory of the depth images"},
      {"bins_halved",
       "how often the bins were halved along each angle, because there were too many"},
      {"bins_kept", "objects with too many bins for k_means, which keep their bins"},
      {"clamped_cube_map", "texels of the cube map above the range of half floats", true},
      {"disoccluded", "samples without a hit although a surface is there", false, kDisocclusions},
      {"wrong_hit", "mirror rays with a hit on a wrong surface, or where none is", false,
       kDisocclusions},
  };
  return counters;
}

const TableInfo& clustersTable() {
  using enum ColumnType;
  static const TableInfo table{
      "clusters",
      "a cluster of reflected rays",
      {{"cluster", Integer, "number in the frame, from 0; the layer id.cluster is this plus 1"},
       {"object", Integer, "id of the reflector"},
       {"samples", Integer, "its reflective samples"},
       {"planar", Integer, "1: a planar mirror"},
       {"concave", Integer, "1: concave"},
       {"width", Integer, "of its depth image, texels"},
       {"height", Integer, "of its depth image, texels"},
       {"triangles", Integer, "drawn into its depth image"},
       {"displacement", Real,
        "distance of the camera's eye from the image plane, divided by that of the mirrored eye (f "
        "of equation (1) [Wang2014])"},
       {"walk", Real, "length of a mirror ray in its depth image, texels, on average"},
       {"own", Real, "fraction of its probes that hit their own object"},
       {"error", Real, "mean difference between its probes and the depth image, in 8-bit values"},
       {"traced", Integer, "1: traced by Embree, without a depth image if width is 0"}}};
  return table;
}

}  // namespace catoptric::methods::second_order
