// Draws the scene's surfaces as seen in one view, nearest objects first.
#pragma once

#include "gl/draw_state.h"
#include "raster/passes/visible.h"

namespace catoptric::raster {

struct SurfacePass {
  const SurfaceShaders& shaders;
  /// The state of the pass. The objects determine which faces are culled. If the stencil is tested,
  /// the object's SampleClass is the reference value.
  gl::DrawState state = {};
  bool stillFirst = false;  ///< moving objects are drawn after all still ones
};

/// Draws into the bound framebuffer. `list` is overwritten.
DrawStatistics drawSurfaces(SceneGpu& scene, const FrameView& view, const frame::Lighting& lighting,
                            const SurfacePass& pass, const Selection& selection, DrawList& list);

}  // namespace catoptric::raster
