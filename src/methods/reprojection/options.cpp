#include "methods/reprojection/options.h"

#include "methods/shared/bvh_policies.h"

namespace catoptric::methods::reprojection {
namespace {

using config::field;

constexpr auto kEdges = config::names<Edges>(
    {{"trace", Edges::Trace}, {"nearest", Edges::Nearest}, {"rims", Edges::Rims}});

constexpr auto kMappings = config::names<Mapping>({{"gather", Mapping::Gather},
                                                   {"grid", Mapping::Grid},
                                                   {"splat", Mapping::Splat},
                                                   {"surface", Mapping::Surface}});

}  // namespace

const config::OptionTable<Options>& optionTable() {
  static const config::OptionTable<Options> table(
      "reprojection", "Options of the method reprojection.",
      {
          field(&Options::keyframeThreshold, "keyframe_threshold", config::range(0.0, 1.0),
                "a frame becomes a key frame if more than this fraction of the mirrors' samples "
                "would be traced")
              .trade("0.1,0.22,0.35"),
          field(&Options::keyframeEvery, "keyframe_every", config::range(0, 100000),
                "frames from a key frame to the next, at most; 0: no limit"),
          field(&Options::restartEvery, "restart_every", config::range(1, 100000),
                "frames 1, 1 + n, 1 + 2n, ... are key frames in any case, and so are camera cuts: "
                "a run that starts in between first renders from the last one"),
          field(&Options::epsilon, "epsilon", config::range(0.0, 1.0),
                "relative difference of two neighbours' distances along the reflected path from "
                "which they count as two surfaces"),
          field(&Options::edges, "edges", kEdges,
                "a sample whose match lies between two surfaces. trace: it is traced; nearest: it "
                "takes the nearer one (edges are off by up to half a sample); rims: it is traced, "
                "and so are samples at silhouettes of reflectors")
              .trade("trace,nearest,rims"),
          field(&Options::magnification, "magnification", config::atLeast(1.0),
                "samples that a sample of the key frame may cover, at most"),
          field(&Options::rays, "rays", config::range(1, 64),
                "rays per sample on rough reflectors (g above 0.05), which are always traced"),
          field(&Options::bounces, "bounces", config::range(1, 16),
                "reflections along a path; the last surface shows its diffuse component"),
          field(&Options::bvh, "bvh", kBvhPolicies,
                "Embree's BVH: built once, moving objects refitted (static); refitted or rebuilt "
                "as a whole in every frame (others)"),
          field(&Options::mapping, "mapping", kMappings,
                "gather: each sample searches the key frame; grid (the paper's): samples of the "
                "key frame move as vertices of two meshes; splat: as points, with holes between "
                "them; surface: reflections stay on their surface (also called image_warp)"),
          field(&Options::fidelity, "fidelity", config::range(0.0, 100.0),
                "a match farther than this from the mirrored ray, in samples of the key frame, is "
                "traced instead (not with mapping: surface)")
              .trade("0.1,0.25,0.5,1"),
          field(&Options::border, "border", config::range(0, 64),
                "samples of the band around traced areas in which traced and reprojected radiance "
                "are blended; 0: none")
              .trade("0,2,4"),
          field(&Options::refine, "refine", "refine matches to sub-sample accuracy"),
      });
  return table;
}

}  // namespace catoptric::methods::reprojection
