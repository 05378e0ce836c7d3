// Options of the method reprojection.
#pragma once

#include <cstdint>

#include "config/options.h"
#include "trace/embree/trace_scene.h"

namespace catoptric::methods::reprojection {

/// How to shade a sample whose match lies between samples of two surfaces.
enum class Edges : std::uint8_t {
  Trace,    ///< it is retraced
  Nearest,  ///< it takes the nearest sample's value
  Rims,     ///< it is retraced, as are samples that move along a reflector's silhouette
};

/// How reflections are mapped from the key frame to the current frame.
enum class Mapping : std::uint8_t {
  Gather,   ///< each sample of the frame searches the key frame
  Grid,     ///< [Xie2017] Sec. 3.2: two meshes of the key frame's samples are drawn
  Splat,    ///< [Xie2017] Fig. 5, left: the key frame's samples are drawn as points
  Surface,  ///< the paper's baseline image_warp: reflections stay fixed to their surfaces
};
/// Whether samples of the key frame are moved to where their reflections now appear. Otherwise the
/// samples of the current frame look up the key frame.
constexpr bool movesLight(Mapping mapping) {
  return mapping == Mapping::Grid || mapping == Mapping::Splat;
}

struct Options {
  Mapping mapping = Mapping::Gather;
  float keyframeThreshold = 0.22f;  ///< not from the paper; [Xie2017] Sec. 4.4: 0.3
  int keyframeEvery = 0;            ///< 0: chosen by content only
  int restartEvery = 64;            ///< not from the paper
  float epsilon = 0.05f;            ///< relative difference of path lengths (not from the paper)
  Edges edges = Edges::Rims;        ///< not from the paper
  float magnification = 16.0f;      ///< [Xie2017] Sec. 4.1
  float fidelity = 0.25f;           ///< samples of the key frame (not from the paper)
  bool refine = true;
  int border = 0;  ///< the paper's future work
  int rays = 8;
  int bounces = 1;
  trace::BvhPolicy bvh = trace::BvhPolicy::Static;
};

const config::OptionTable<Options>& optionTable();

}  // namespace catoptric::methods::reprojection
