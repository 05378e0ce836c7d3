#include "methods/second_order/options.h"

#include <cstdint>

#include "methods/shared/shared_options.h"

namespace catoptric::methods::second_order {
namespace {

using config::field;
using config::in;
using config::range;

constexpr auto kClusterings = config::names<bool>({{"bins", false}, {"k_means", true}});
constexpr auto kSelfIntersect =
    config::names<SelfIntersect>({{"ignore", SelfIntersect::None},
                                  {"self_intersect", SelfIntersect::OfConcaveClusters},
                                  {"self_intersect_all", SelfIntersect::OfAllButPlanarMirrors}});
constexpr auto kLobeRays = config::names<LobeRays>(
    {{"cone", LobeRays::Walked}, {"neighbourhood", LobeRays::LookedUpAtTheCentresDistance}});

}  // namespace

const config::OptionTable<Options>& optionTable() {
  static const config::OptionTable<Options> table(
      "second_order", "Options of the method second_order.",
      {field(in(&Options::cluster, &ClusterOptions::maxThetaBins), "max_theta_bins", range(1, 128),
             "largest number of azimuth bins of normals (360 degrees about the vertical)"),
       field(in(&Options::cluster, &ClusterOptions::maxPhiBins), "max_phi_bins", range(1, 64),
             "largest number of polar-angle bins of normals (180 degrees from the vertical)"),
       field(
           in(&Options::cluster, &ClusterOptions::binDensity), "bin_density", range(0.01, 1000),
           "factor on the paper's number of bins, which grows with the object's area in the frame")
           .trade("2.5,10,40"),
       field(in(&Options::cluster, &ClusterOptions::kMeans), "clustering", kClusterings,
             "how reflective samples are clustered. bins: by bins of normals; k_means: the bins "
             "are then refined by k-means of the rays, except on planar parts"),
       field(in(&Options::camera, &CameraOptions::depthImageScale), "depth_image_scale",
             range(0.05, 8),
             "resolution of the depth images along each axis; 1: texels as dense as the cluster's "
             "samples")
           .trade("0.5,0.7,1"),
       field(in(&Options::images, &DepthImageOptions::levelErrorTexels), "level_error",
             range(0, 16),
             "largest error of a level of detail, texels of the depth image (up to 4 times this "
             "where s is small); 0: the finest level")
           .trade("0,0.75,1.5,3"),
       field(in(&Options::camera, &CameraOptions::rays), "rays", range(1, 64), kRaysHelp)
           .trade("4,8,16"),
       config::mebibytes(in(&Options::images, &DepthImageOptions::memoryBytes), "memory_mib",
                         "memory of the depth images, MiB; their resolution is reduced to fit"),
       field(in(&Options::images, &DepthImageOptions::compound), "compound",
             "draw all depth images of an atlas layer by one draw call, instead of one for each"),
       field(in(&Options::images, &DepthImageOptions::depthLayers), "depth_layers", range(1, 2),
             "2: depth images, except those of planar mirrors, also store the second surface, for "
             "rays that pass behind the first"),
       field(&Options::faceSize, "face_size", range(1, 4096),
             "texels along the edge of a cube map face; rays without a hit are looked up there"),
       field(&Options::selfIntersect, "concave", kSelfIntersect,
             "rays that hit their own object. ignore: they pass through it; self_intersect: in "
             "concave clusters they return its diffuse component; self_intersect_all: in all "
             "clusters except planar mirrors"),
       field(&Options::lobeRays, "glossy", kLobeRays,
             "rays of a lobe. cone: each ray is marched; neighbourhood: only the central ray is "
             "marched, the other rays are looked up at the distance of its hit"),
       field(&Options::glossyReach, "glossy_reach", range(0, 1000000),
             "glossy reflections fade to the reflector's diffuse colour as rays get longer. Rays "
             "of at least `glossy_reach` x (1 - g) / g metres show that colour only. 0: no fading"),
       field(&Options::probes, "probes", range(0, 1024),
             "samples of each curved or glossy cluster that Embree traces to estimate its error; "
             "0: none"),
       field(&Options::probeError, "probe_error", range(0, 255),
             "largest mean difference between a cluster and its probes, in 8-bit values; Embree "
             "traces clusters above it"),
       field(&Options::bvh, "bvh", kBvhPolicies, kBvhHelp)});
  return table;
}

}  // namespace catoptric::methods::second_order
