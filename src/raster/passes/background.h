// Radiance of the environment where nothing is drawn: where the depth is still 0.
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
  /// `fragment` includes environment.glsl, and has these defines beside that file's.
  explicit Background(std::string fragment, std::vector<gl::Define> defines = {})
      : fragment_(std::move(fragment)), defines_(std::move(defines)) {}

  /// Into the bound framebuffer; the frame block is bound. Within `parts` where there are any, else
  /// where `state` says.
  void draw(FrameResources& frame, const frame::Lighting& lighting,
            std::span<const Rectangle> parts, gl::DrawState state = {});

 private:
  std::string fragment_;
  std::vector<gl::Define> defines_;
  std::map<std::string, gl::Program> programs_;  ///< by type of environment
};

}  // namespace catoptric::raster
