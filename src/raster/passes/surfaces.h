// Draws the scene's surfaces as one view shows them, nearest objects first.
#pragma once

#include "gl/draw_state.h"
#include "raster/passes/visible.h"

namespace catoptric::raster {

struct SurfacePass {
  const SurfaceShaders& shaders;
  /// Which faces are drawn follows from the objects; where the stencil is tested its reference is
  /// their SampleClass.
  gl::DrawState state = {};
  bool stillFirst = false;  ///< what moves is drawn after everything else
};

/// Into the bound framebuffer. `list` is overwritten.
DrawStatistics drawSurfaces(SceneGpu& scene, const FrameView& view, const frame::Lighting& lighting,
                            const SurfacePass& pass, const Selection& selection, DrawList& list);

}  // namespace catoptric::raster
