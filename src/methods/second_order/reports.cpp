#include "methods/second_order/reports.h"

namespace catoptric::methods::second_order {

const std::vector<StepInfo>& stepInfos() {
  static const std::vector<StepInfo> steps = {
      {"levels", "start", "coarser levels of objects are made"},
      {"cube_map", "start, frames", "the cube map is drawn, again when something moved"},
      {"readback", "frames", "the G-buffer is read from the device"},
      {"cluster", "frames", "reflective samples are put into clusters"},
      {"camera", "frames", "each cluster gets a camera"},
      {"probe", "frames",
       "Embree traces a few samples of each cluster, to tell which see their own object"},
      {"depth_images", "frames", "the scene is drawn as each cluster sees it"},
      {"intersect", "frames", "reflected rays are found in the depth images"},
      {"compare", "frames", "what the probes have seen is compared with what is shown"},
      {"recompute", "frames", "Embree traces clusters that see their own object, or err"},
      {"disocclusions", "frames",
       "with image.count_disocclusions: Embree's rays say which samples missed a surface",
       StepKind::Check},
  };
  return steps;
}

const std::vector<CounterInfo>& counterInfos() {
  constexpr const char* kDisocclusions = "image.count_disocclusions";
  static const std::vector<CounterInfo> counters = {
      {"reflective_samples", "samples that reflect"},
      {"unclustered", "reflective samples in no cluster: they see the cube map"},
      {"environment",
       "clustered samples with a ray that ended behind something or left its image: "
       "they see the cube map"},
      {"sky", "samples with a ray that left the scene"},
      {"bridged", "samples with a hit that bridges an edge in depth"},
      {"below_horizon",
       "samples of mirrors whose normal was bent, and rays of lobes below the surface, folded up"},
      {"met_itself", "samples with a ray that met its own object: they show the diffuse component"},
      {"faded", "samples with a ray that faded to the diffuse colour with distance"},
      {"second_layer_hits", "samples with a ray that ended in the second depth layer"},
      {"refraction_mirrored", "samples of materials that refract: they are mirrored instead"},
      {"clusters", "clusters of reflective samples"},
      {"planar_clusters", "clusters that are planar mirrors"},
      {"planar_samples", "samples in planar clusters"},
      {"concave_clusters", "concave clusters"},
      {"probes", "samples that Embree traced to see which clusters err"},
      {"retraced", "samples of clusters that err: traced by Embree"},
      {"small_clusters", "clusters that are traced, as a depth image would cost more"},
      {"self_seeing_clusters", "clusters that are traced, as they meet their own object"},
      {"erring_clusters", "clusters that are traced, as their probes differ from what was shown"},
      {"lamp_samples",
       "samples whose lobes see what is brighter than white: traced, with their 16 x 16 samples"},
      {"refused", "rays that Embree could not take: they see the environment", true},
      {"not_finite", "radiances of hits that were NaN or infinite, taken as 0", true},
      {"normals_cancel", "clusters whose normals cancel: the normal is turned to the eye"},
      {"parallel_clusters", "clusters of parallel or converging rays: the eye is far away"},
      {"crossing_clusters", "clusters whose rays cross"},
      {"pushed_back", "clusters whose eye would have been before a sample"},
      {"capped_images", "depth images with fewer texels than the samples' spacing asks for"},
      {"empty_images", "depth images that show nothing: their rays are not walked"},
      {"texels", "texels of all depth images"},
      {"triangles", "triangles drawn into all depth images"},
      {"left_out", "objects too small for a depth image, over all images"},
      {"bound_by_shape",
       "objects drawn no coarser, as the next level's shape would show, over all images"},
      {"bound_by_light", "... as the next level's light would show"},
      {"images_shrunk", "1: the frame's depth images were drawn more coarsely to fit memory_mib"},
      {"depth_image_bytes", "memory of the depth images"},
      {"bins_halved", "times that bins were halved along each angle, as there were too many"},
      {"bins_kept", "objects that kept their bins, as they have too many for k_means"},
      {"clamped_cube_map", "texels of the cube map beyond half floats", true},
      {"disoccluded", "samples that found nothing where a surface is", false, kDisocclusions},
      {"wrong_hit", "mirror rays that found another surface than they meet, or one where is none",
       false, kDisocclusions},
  };
  return counters;
}

const TableInfo& clustersTable() {
  using enum ColumnType;
  static const TableInfo table{
      "clusters",
      "a cluster of reflected rays",
      {{"cluster", Integer, "number in the frame, from 0; the layer id.cluster has it plus 1"},
       {"object", Integer, "id of the reflector"},
       {"samples", Integer, "its reflective samples"},
       {"planar", Integer, "1: a planar mirror"},
       {"concave", Integer, "1: a concave one"},
       {"width", Integer, "of its depth image, texels"},
       {"height", Integer, "of its depth image, texels"},
       {"triangles", Integer, "drawn into its depth image"},
       {"displacement", Real, "f of equation (1) [Wang2014]"},
       {"walk", Real, "length of a mirror ray in its depth image, texels, on average"},
       {"own", Real, "share of its probes that meet their own object"},
       {"error", Real, "mean difference of its probes from what is shown, of 255"},
       {"traced", Integer, "1: by Embree; without a depth image where width is 0"}}};
  return table;
}

}  // namespace catoptric::methods::second_order
