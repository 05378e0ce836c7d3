#include "methods/shared/impostors/options.h"

#include <utility>

namespace catoptric::methods::impostors {
namespace {

using config::field, config::range, config::atLeast;

/// What both methods have.
std::vector<config::Option<Options>> common() {
  return {
      field(&Options::objects, "objects",
            "names of the objects that get impostors; \"auto\": those whose reflections by "
            "direction alone would be wrong"),
      field(&Options::least, "least", range(0.0, 13.0),
            "auto: solid angle from a reflector, times the angle by which a look-up by direction "
            "is wrong, from which an object gets an impostor"),
      field(&Options::most, "most", range(1, 4096),
            "objects that get an impostor at the most; the others stay in the environment map"),
      field(&Options::textureSize, "texture_size", range(1, 4096),
            "texels along the edge of an impostor's image")
          .trade("128,256,512"),
      field(&Options::planeSize, "plane_size", range(1, 8192),
            "texels along the edge of the image of an object's own plane"),
      field(&Options::faceSize, "face_size", range(1, 4096),
            "texels along the edge of a face of the environment map")
          .trade("256,512,1024"),
      field(&Options::bounces, "bounces", range(1, 2),
            "reflections along a path: with 2 rays that hit a reflective impostor go on"),
      field(&Options::secondDiffuse, "second_diffuse",
            "whether rays that are reflected again see the diffuse part of reflective objects, as "
            "in traced; else they see diffuse objects alone, as in the paper"),
      field(&Options::transitionHeight, "transition_height", atLeast(0.0),
            "metres: height of the walls on the edges of flat objects in which their reflection "
            "turns into that of the environment map; 0: none (the paper's H)"),
      field(&Options::shareEnvironment, "share_environment",
            "flat objects with walls take their colours from the environment map, which then shows "
            "them; they must hide nothing there"),
      field(&Options::attenuation, "attenuation", atLeast(0.0),
            "metres along a reflected ray over which what it meets fades to 1/e; 0: not at all"),
      field(&Options::intersectOn, "intersect_on", kUnits,
            "where rays of mirrors are intersected: by a shader on the device, by vector code on "
            "the processor, or where it is faster: on the processor if the device is one"),
  };
}

}  // namespace

const config::OptionTable<Options>& billboardOptions() {
  static const config::OptionTable<Options> table("billboards", "Options of the method billboards.",
                                                  common());
  return table;
}

const config::OptionTable<Options>& depthOptions() {
  static const config::OptionTable<Options> table = [] {
    std::vector<config::Option<Options>> options = common();
    options.push_back(field(&Options::intersection, "intersection", kIntersections,
                            "how rays are intersected with depth maps: texel by texel along their "
                            "projection, or with the simplified row nearest to it, or with two")
                          .trade("walk,srdm"));
    options.push_back(field(&Options::domains, "domains", range(1, 720),
                            "directions of simplified rows (the paper's n)"));
    options.push_back(field(&Options::points, "points", range(2, 512),
                            "points of a simplified row at the most (the paper's m)")
                          .trade("4,8,16,32"));
    options.push_back(field(&Options::refine, "refine", range(0, 512),
                            "texels on either side of a hit with simplified rows that are walked "
                            "over for the exact place; 0: none"));
    options.push_back(field(&Options::maps, "maps", range(1, 7),
                            "depth maps of an object for each reflector: the first looks from the "
                            "reflector, the others 60 degrees from there, all around"));
    options.push_back(field(&Options::layers, "layers", range(1, 4),
                            "depth maps of one camera: the second shows what the first hides, the "
                            "third what both hide")
                          .trade("1,2"));
    options.push_back(field(&Options::selfMaps, "self_maps", range(0, 6),
                            "depth maps of each curved reflector that its own rays are intersected "
                            "with, looking along its axes; 0: no reflector shows itself")
                          .trade("0,6"));
    options.push_back(
        field(
            &Options::depthMaps, "depth_maps", kDepthMaps,
            "which objects get depth maps. needed: those whose billboard would be most wrong, the "
            "others get a billboard; auto: needed where more than 32 objects have impostors, "
            "else all")
            .trade("auto,all"));
    return config::OptionTable<Options>("depth_impostors", "Options of the method depth_impostors.",
                                        std::move(options));
  }();
  return table;
}

}  // namespace catoptric::methods::impostors
