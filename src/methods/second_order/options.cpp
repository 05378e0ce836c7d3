#include "methods/second_order/options.h"

#include <cstdint>

#include "methods/shared/bvh_policies.h"

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

/// An integer of MiB, kept in bytes.
config::Option<Options> memory() {
  return {{.name = "memory_mib",
           .type = config::FieldType::Integer,
           .help = "memory of the depth images, MiB; beyond it their resolution is reduced",
           .defaultText = std::to_string(Options{}.images.memoryBytes >> 20),
           .minimum = 1,
           .maximum = 65536},
          [](Options& options, const config::Value& value) {
            options.images.memoryBytes = static_cast<std::uint64_t>(value.asInteger()) << 20;
          }};
}

}  // namespace

const config::OptionTable<Options>& optionTable() {
  static const config::OptionTable<Options> table(
      "second_order", "Options of the method second_order.",
      {field(in(&Options::cluster, &ClusterOptions::maxThetaBins), "max_theta_bins", range(1, 128),
             "bins of normals over 360 degrees around the vertical, at most"),
       field(in(&Options::cluster, &ClusterOptions::maxPhiBins), "max_phi_bins", range(1, 64),
             "bins of normals over 180 degrees from the vertical, at most"),
       field(in(&Options::cluster, &ClusterOptions::binDensity), "bin_density", range(0.01, 1000),
             "factor on the number of an object's bins, which depends on its area in the frame; 1 "
             "is the paper's")
           .trade("2.5,10,40"),
       field(in(&Options::cluster, &ClusterOptions::kMeans), "clustering", kClusterings,
             "bins: by bins of normals; k_means: then by k-means of the rays, except on planar "
             "parts"),
       field(in(&Options::camera, &CameraOptions::depthImageScale), "depth_image_scale",
             range(0.05, 8),
             "resolution of the depth images along each axis; 1: texels as dense as the cluster's "
             "samples")
           .trade("0.5,0.7,1"),
       field(in(&Options::images, &DepthImageOptions::levelErrorTexels), "level_error",
             range(0, 16),
             "error of a level of detail in a depth image, texels (up to 4 times as much where s "
             "is small); 0: the finest level")
           .trade("0,0.75,1.5,3"),
       field(in(&Options::camera, &CameraOptions::rays), "rays", range(1, 64),
             "rays per sample on rough reflectors (g above 0.05); mirrors take one")
           .trade("4,8,16"),
       memory(),
       field(in(&Options::images, &DepthImageOptions::compound), "compound",
             "one draw call for all depth images of a layer, instead of one for each"),
       field(in(&Options::images, &DepthImageOptions::depthLayers), "depth_layers", range(1, 2),
             "2: depth images, except of planar mirrors, also store the second surface, for rays "
             "that pass behind the first"),
       field(&Options::faceSize, "face_size", range(1, 4096),
             "texels along the edge of a face of the cube map, for rays without a hit"),
       field(&Options::selfIntersect, "concave", kSelfIntersect,
             "what a ray returns that hits its own object. ignore: the surface behind it; "
             "self_intersect: the object's diffuse component, in concave clusters; "
             "self_intersect_all: the same, except in planar mirrors"),
       field(&Options::lobeRays, "glossy", kLobeRays,
             "cone: each ray of a lobe is marched; neighbourhood: only the central ray is, the "
             "others are looked up at its distance"),
       field(&Options::glossyReach, "glossy_reach", range(0, 1000000),
             "glossy reflections fade to the diffuse colour over this many metres times (1 - g) / "
             "g; 0: no fading"),
       field(&Options::probes, "probes", range(0, 1024),
             "samples of each curved or glossy cluster that Embree traces to estimate its error; "
             "0: none"),
       field(&Options::probeError, "probe_error", range(0, 255),
             "Embree traces a cluster whose probes differ by more than this on average, in 8-bit "
             "steps of the frame"),
       field(&Options::bvh, "bvh", kBvhPolicies,
             "Embree's BVH: built once, moving objects refitted (static); refitted or rebuilt as a "
             "whole in every frame (others)")});
  return table;
}

}  // namespace catoptric::methods::second_order
