#include "methods/reprojection/options.h"

#include "methods/shared/shared_options.h"

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
                "a frame becomes a key frame if more than this fraction of its mirror samples "
                "would be traced")
              .trade("0.1,0.22,0.35"),
          field(&Options::keyframeEvery, "keyframe_every", config::range(0, 100000),
                "largest number of frames from a key frame to the next; 0: no limit"),
          field(&Options::restartEvery, "restart_every", config::range(1, 100000),
                "n: frames 1, 1 + n, 1 + 2n, ... and camera cuts are always key frames, at which "
                "runs may restart"),
          field(&Options::epsilon, "epsilon", config::range(0.0, 1.0),
                "two neighbouring samples are of different surfaces if their distances along the "
                "reflected path differ by more than this fraction"),
          field(&Options::edges, "edges", kEdges,
                "what happens to a sample whose match (the place in the key frame where its "
                "reflection is found) lies between two surfaces. trace: it is traced; nearest: it "
                "takes the nearer surface (edges are off by up to half a sample); rims: it is "
                "traced, as are samples at reflectors' silhouettes")
              .trade("rims,trace,nearest"),
          field(&Options::magnification, "magnification", config::atLeast(1.0),
                "largest number of samples that a sample of the key frame may cover"),
          field(&Options::rays, "rays", config::range(1, 64),
                "rays per sample on rough reflectors, which are always traced"),
          field(&Options::bounces, "bounces", config::range(1, 16), kBouncesHelp),
          field(&Options::bvh, "bvh", kBvhPolicies, kBvhHelp),
          field(&Options::mapping, "mapping", kMappings,
                "gather: each sample searches the key frame; grid: the key frame's samples are "
                "vertices of two meshes, as in the paper; splat: they are points, with holes "
                "between them; surface: reflections stay at their place on the reflector"),
          field(&Options::fidelity, "fidelity", config::range(0.0, 100.0),
                "largest distance of a match (see `edges`) from the mirrored ray, in samples of "
                "the key frame; beyond it the sample is traced (not with `mapping: surface`)")
              .trade("0.1,0.25,0.5,1"),
          field(&Options::border, "border", config::range(0, 64),
                "width in samples of the band around traced areas in which traced and reprojected "
                "radiance are blended; 0: none")
              .trade("0,2,4"),
          field(&Options::refine, "refine", "refine matches (see `edges`) to sub-sample accuracy"),
      });
  return table;
}

}  // namespace catoptric::methods::reprojection
