#include "methods/shared/impostors/options.h"

#include <utility>

namespace catoptric::methods::impostors {
namespace {

using config::field, config::range, config::atLeast;

/// What both methods have.
std::vector<config::Option<Options>> common() {
  return {
      field(&Options::objects, "objects",
            "names of the objects that get impostors; \"auto\": by `least` and `most`"),
      field(&Options::least, "least", range(0.0, 13.0),
            "auto: an object gets an impostor if its solid angle from a reflector (sr), times the "
            "angular error of a look-up by direction (rad), reaches this"),
      field(&Options::most, "most", range(1, 4096),
            "impostors, at most; other objects stay in the environment map"),
      field(&Options::textureSize, "texture_size", range(1, 4096),
            "texels along the edge of an impostor's image")
          .trade("128,256,512"),
      field(&Options::planeSize, "plane_size", range(1, 8192),
            "texels along the edge of a flat object's image"),
      field(&Options::faceSize, "face_size", range(1, 4096),
            "texels along the edge of a face of the cube map")
          .trade("256,512,1024"),
      field(&Options::bounces, "bounces", range(1, 2),
            "reflections along a path; with 2, rays that hit a reflective impostor continue"),
      field(&Options::secondDiffuse, "second_diffuse",
            "whether second reflections contain reflective objects, by their diffuse part; "
            "otherwise only diffuse objects, as in the paper"),
      field(&Options::transitionHeight, "transition_height", atLeast(0.0),
            "height in metres of the walls on the edges of flat objects in which their reflection "
            "blends into the environment map; 0: none (the paper's H)"),
      field(&Options::shareEnvironment, "share_environment",
            "flat objects with walls take their colours from the environment map, which then "
            "contains them; they must hide nothing there"),
      field(&Options::attenuation, "attenuation", atLeast(0.0),
            "metres of a reflected ray over which radiance fades to 1/e; 0: no fading"),
      field(&Options::intersectOn, "intersect_on", kUnits,
            "where mirror rays are intersected: by a shader, by vector code on the CPU, or auto: "
            "on the CPU if OpenGL runs there too"),
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
                            "intersection with depth maps: texel by texel, with the nearest "
                            "simplified row, or with two rows")
                          .trade("walk,srdm"));
    options.push_back(field(&Options::domains, "domains", range(1, 720),
                            "directions of simplified rows (the paper's n)"));
    options.push_back(field(&Options::points, "points", range(2, 512),
                            "points of a simplified row, at most (the paper's m)")
                          .trade("4,8,16,32"));
    options.push_back(field(&Options::refine, "refine", range(0, 512),
                            "texels on either side of a simplified row's hit that are searched for "
                            "the exact hit; 0: none"));
    options.push_back(field(&Options::maps, "maps", range(1, 7),
                            "depth maps of an object for each reflector: one from the reflector, "
                            "the others 60 degrees from it, all around"));
    options.push_back(
        field(&Options::layers, "layers", range(1, 4),
              "depth maps of one camera; each further one stores what those before it hide")
            .trade("1,2"));
    options.push_back(field(&Options::selfMaps, "self_maps", range(0, 6),
                            "depth maps of each curved reflector for its own rays, along its axes; "
                            "0: no reflector reflects itself")
                          .trade("0,6"));
    options.push_back(
        field(&Options::depthMaps, "depth_maps", kDepthMaps,
              "which objects get depth maps. needed: those with the worst billboards, the others "
              "get billboards; auto: needed with more than 32 impostors, otherwise all")
            .trade("auto,all"));
    return config::OptionTable<Options>("depth_impostors", "Options of the method depth_impostors.",
                                        std::move(options));
  }();
  return table;
}

}  // namespace catoptric::methods::impostors
