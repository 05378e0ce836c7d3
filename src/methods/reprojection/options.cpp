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
                "share of the mirrors' samples that may be traced anew: a frame with more becomes "
                "a key "
                "frame")
              .trade("0.1,0.22,0.35"),
          field(&Options::keyframeEvery, "keyframe_every", config::range(0, 100000),
                "frames from a key frame to the next at the most; 0: keyframe_threshold alone "
                "decides"),
          field(&Options::restartEvery, "restart_every", config::range(1, 100000),
                "frames 1, 1 + n, 1 + 2n, ... of the path are key frames in any case, and so are "
                "cuts of "
                "the camera: whoever begins in between must render from the one before"),
          field(
              &Options::epsilon, "epsilon", config::range(0.0, 1.0),
              "relative difference of two neighbours' distances along the reflected path at which "
              "they do not show one surface"),
          field(
              &Options::edges, "edges", kEdges,
              "a sample that is found between samples of two surfaces is traced anew, or shows the "
              "surface of the nearest one: fewer rays, edges off by up to half a sample; rims: it "
              "is "
              "traced anew, and so are the samples at the rims of reflectors, where narrow "
              "reflections come out that the key frame could not see")
              .trade("trace,nearest,rims"),
          field(&Options::magnification, "magnification", config::atLeast(1.0),
                "area over which a sample of the key frame may be stretched, in samples"),
          field(&Options::rays, "rays", config::range(1, 64),
                "rays per sample on surfaces with g above 0.05, as in traced; those are always "
                "traced "
                "anew"),
          field(&Options::bounces, "bounces", config::range(1, 16),
                "reflections along a path; after the last a surface shows its diffuse component"),
          field(&Options::bvh, "bvh", kBvhPolicies,
                "how Embree's structure follows the geometry in each frame"),
          field(
              &Options::mapping, "mapping", kMappings,
              "how reflections are found again. gather: each sample of the frame looks in the key "
              "frame; grid, as in the paper: each sample of the key frame looks where it goes, and "
              "two meshes move it there; splat: single points do, between which holes open (both "
              "slow; what moving mirrors show is traced anew); "
              "surface: "
              "they stay on the surface that the key frame showed them on, which is the paper's "
              "control and also called image_warp"),
          field(&Options::fidelity, "fidelity", config::range(0.0, 100.0),
                "distance from the mirrored ray, in samples of the key frame, at which what was "
                "found "
                "there is traced anew (mapping: surface has no such test)")
              .trade("0.1,0.25,0.5,1"),
          field(&Options::border, "border", config::range(0, 64),
                "samples over which what is found again goes over into areas that are traced anew: "
                "that many more are traced about them; 0: none")
              .trade("0,2,4"),
          field(&Options::refine, "refine",
                "correct what was found by what is shown between the samples"),
      });
  return table;
}

}  // namespace catoptric::methods::reprojection
