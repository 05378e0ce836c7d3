// Options of the method reprojection.
#pragma once

#include <cstdint>

#include "config/options.h"
#include "trace/embree/trace_scene.h"

namespace catoptric::methods::reprojection {

/// What becomes of a sample that is found between samples of two surfaces.
enum class Edges : std::uint8_t {
  Trace,    ///< it is traced anew
  Nearest,  ///< it shows the surface of the nearest one
  Rims,     ///< it is traced anew, and so is what moves along a reflector's rim
};

/// How reflections come from the key frame to the current one.
enum class Mapping : std::uint8_t {
  Gather,   ///< each sample of the frame looks in the key frame
  Grid,     ///< [Xie2017] Sec. 3.2: two meshes of the key frame's samples are drawn
  Splat,    ///< [Xie2017] Fig. 5, left: its samples are drawn as points
  Surface,  ///< the paper's control, image_warp: reflections stay on their surfaces
};
/// Whether the key frame's light is moved, and not what it comes from.
constexpr bool movesLight(Mapping mapping) {
  return mapping == Mapping::Grid || mapping == Mapping::Splat;
}

struct Options {
  Mapping mapping = Mapping::Gather;
  float keyframeThreshold = 0.22f;  ///< ours; [Xie2017] Sec. 4.4: 0.3
  int keyframeEvery = 0;            ///< 0: by content alone
  int restartEvery = 64;            ///< ours
  float epsilon = 0.05f;            ///< ours: relative difference of lengths along the path
  Edges edges = Edges::Trace;
  float magnification = 16.0f;  ///< [Xie2017] Sec. 4.1
  float fidelity = 0.25f;       ///< ours: samples of the key frame
  bool refine = true;
  int border = 0;  ///< ours; the paper's outlook
  int rays = 8;
  int bounces = 1;
  trace::BvhPolicy bvh = trace::BvhPolicy::Static;
};

const config::OptionTable<Options>& optionTable();

}  // namespace catoptric::methods::reprojection
