#include "methods/shared/impostors/options.h"

#include <utility>

#include "methods/shared/shared_options.h"

namespace catoptric::methods::impostors {
namespace {

using config::field, config::range, config::atLeast;

/// `byDefault`: measured in docs/papers/impostors.md.
config::Option<Options> mostObjects(int byDefault) {
  config::Option<Options> option =
      field(&Options::most, "most", range(1, 4096),
            "largest number of impostors; other objects stay in the environment map");
  option.description.defaultText = std::to_string(byDefault);
  return option;
}

/// What both methods have.
std::vector<config::Option<Options>> common(int most) {
  return {
      field(&Options::objects, "objects",
            "names of the objects that get impostors; \"auto\": chosen by `least` and `most`"),
      field(&Options::least, "least", range(0.0, 13.0),
            "with `objects` auto: objects get impostors if the environment map alone would show "
            "them with at least this error: the object's solid angle from a reflector (sr) "
            "times the angle by which the map's look-up misses the object (rad)"),
      mostObjects(most),
      field(&Options::textureSize, "texture_size", range(1, 4096),
            "texels along the edge of an impostor's image")
          .trade("128,256,512"),
      field(&Options::planeSize, "plane_size", range(1, 8192),
            "texels along the edge of a flat object's image"),
      field(&Options::faceSize, "face_size", range(1, 4096), kFaceSizeHelp).trade("256,512,1024"),
      field(&Options::bounces, "bounces", range(1, 2),
            "reflections along a path; with 2, reflective impostors reflect rays again"),
      field(&Options::secondDiffuse, "second_diffuse",
            "second reflections also show the diffuse component of reflective objects; otherwise "
            "only diffuse objects, as in the paper"),
      field(
          &Options::transitionHeight, "transition_height", atLeast(0.0),
          "height in metres of virtual walls that soften the edges of flat objects: a ray through "
          "a wall blends the edge's colour with the environment map. 0: no walls"),
      field(&Options::shareEnvironment, "share_environment",
            "with `transition_height`: flat objects stay in the environment map. If a ray hits a "
            "flat object, the map is read in the direction from the map's centre to the hit. For "
            "a ray through a virtual wall, this direction is blended with the ray's own. "
            "Reflections are wrong where, seen from the map's centre, a flat object hides other "
            "surfaces"),
      field(&Options::attenuation, "attenuation", atLeast(0.0), kAttenuationHelp),
      field(&Options::intersectOn, "intersect_on", kUnits,
            "where mirror rays are intersected. device: in a shader; processor: on the CPU; auto: "
            "on the CPU if OpenGL runs there"),
      config::mebibytes(&Options::memoryBytes, "memory_mib", "memory of all images, MiB"),
      field(&Options::fallback, "fallback", kFallbacks,
            "`unfit` reflectors, and those whose images exceed `memory_mib` or take longer than "
            "tracing. traced: Embree traces them; none: they keep images; beyond `memory_mib` the "
            "run ends"),
  };
}

}  // namespace

const config::OptionTable<Options>& billboardOptions() {
  static const config::OptionTable<Options> table("billboards", "Options of the method billboards.",
                                                  common(64));
  return table;
}

const config::OptionTable<Options>& depthOptions() {
  static const config::OptionTable<Options> table = [] {
    std::vector<config::Option<Options>> options = common(256);
    options.push_back(field(&Options::intersection, "intersection", kIntersections,
                            "how rays are intersected with depth maps. srdm: along the simplified "
                            "row (see `domains`) that is nearest to the ray's projection; "
                            "srdm_two_rows: along the two nearest; walk: texel by texel")
                          .trade("walk,srdm"));
    options.push_back(field(&Options::domains, "domains", range(1, 720),
                            "number of rotations of a depth map; in each, every row is simplified "
                            "to a polyline of at most `points` points"));
    options.push_back(field(&Options::points, "points", range(2, 512),
                            "largest number of points of a simplified row")
                          .trade("4,8,16,32"));
    options.push_back(field(&Options::refine, "refine", range(0, 512),
                            "texels on either side of a hit with a simplified row that are "
                            "searched for the exact hit; 0: none"));
    options.push_back(
        field(&Options::maps, "maps", range(0, 7),
              "number of depth maps of an object for each reflector. The first looks from the "
              "reflector, the others from directions at 60 degrees to this, evenly around it. 0: "
              "chosen by the directions from which the reflector's points see the object")
            .trade("1,0"));
    options.push_back(field(&Options::layers, "layers", range(1, 4),
                            "depth layers of each depth map (depth peeling)")
                          .trade("1,2"));
    options.push_back(field(&Options::selfMaps, "self_maps", range(0, 6),
                            "number of depth maps of a curved reflector itself, taken along its "
                            "axes, for rays that hit it again; 0: such rays pass through it")
                          .trade("0,6"));
    options.push_back(
        field(&Options::depthMaps, "depth_maps", kDepthMaps,
              "which objects get depth maps instead of billboards. all: every object. needed: all "
              "except those with the smallest errors (as in `least`), whose sum per reflector is "
              "below 0.25. auto: `needed` with more than 32 impostors, otherwise `all`")
            .trade("auto,all"));
    return config::OptionTable<Options>("depth_impostors", "Options of the method depth_impostors.",
                                        std::move(options));
  }();
  return table;
}

}  // namespace catoptric::methods::impostors
