// Draws the radiance of the environment where no surface was drawn (depth 0).
#pragma once

#include <map>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "gl/draw_state.h"
#include "raster/regions/rectangle.h"
#include "raster/scene_gpu/frame_block.h"

namespace catoptric::raster {

class Background {
 public:
  /// `fragment` is a shader that includes environment.glsl. `defines` are additional.
  explicit Background(std::string fragment, std::vector<gl::Define> defines = {})
      : fragment_(std::move(fragment)), defines_(std::move(defines)) {}

  /// Draws into the bound framebuffer. The frame block must be bound. Draws within `parts` if there
  /// are any; otherwise `state` sets the scissor.
  void draw(FrameResources& frame, const frame::Lighting& lighting,
            std::span<const Rectangle> parts, gl::DrawState state = {});

 private:
  std::string fragment_;
  std::vector<gl::Define> defines_;
  std::map<std::string, gl::Program> programs_;  ///< keyed by the type of environment
};

}  // namespace catoptric::raster
