#include "raster/passes/background.h"

#include "raster/passes/surfaces.h"

namespace catoptric::raster {

void Background::draw(FrameResources& frame, const frame::Lighting& lighting,
                      std::span<const Rectangle> parts, gl::DrawState state) {
  const std::string type = environmentType(lighting);
  gl::Program& program = programs_[type];
  if (program.empty()) {
    std::vector<gl::Define> defines = {{"ENVIRONMENT", type}, {"LIGHT_COUNT", "0"}, {"SKY", "0"}};
    defines.insert(defines.end(), defines_.begin(), defines_.end());
    program = gl::Program("background", {.vertex = "raster/shaders/background.vert",
                                         .fragment = fragment_,
                                         .defines = std::move(defines)});
  }
  program.use();
  frame.bindEnvironment(lighting);
  state.depth = {.test = true, .function = GL_EQUAL, .write = false};
  gl::DrawScope scope(state);
  if (parts.empty()) gl::drawFullScreenTriangle();
  for (const Rectangle& part : parts) {
    scope.change(within(part, state));
    gl::drawFullScreenTriangle();
  }
}

}  // namespace catoptric::raster
