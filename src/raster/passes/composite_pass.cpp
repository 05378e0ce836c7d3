#include "raster/passes/composite_pass.h"

#include <string>
#include <vector>

#include "core/error.h"
#include "gl/draw_state.h"
#include "raster/constants.h"
#include "raster/passes/surfaces.h"
#include "raster/scene_gpu/frame_block.h"

namespace catoptric::raster {

void CompositePass::draw(const GBuffer& source, const Materials& materials,
                         const scene::Camera& camera, const CompositeOptions& options,
                         gl::Texture& frame, const std::optional<Region>& part) {
  if (frame.width() != source.width || frame.height() != source.height) {
    throw Error(ExitCode::Internal, "composite: the frame's size is not the G-buffer's");
  }
  const bool reflective = materials.reflective();
  const bool fresnel = reflective && options.fresnelSchlick;
  const bool ggx = reflective && materials.ggx();
  const int tinted = !reflective ? 0 : !source.tint.empty() ? 2 : materials.tinted() ? 1 : 0;
  const bool highlights = reflective && !source.highlight.empty();
  gl::Program& program =
      programs_[static_cast<std::uint32_t>(source.samples) * 64u +
                static_cast<std::uint32_t>(tinted) * 16u + (ggx ? 8u : 0u) +
                (highlights ? 4u : 0u) + (reflective ? 2u : 0u) + (fresnel ? 1u : 0u)];
  if (program.empty()) {
    program = gl::Program::fullScreen("composite", "raster/shaders/composite.frag",
                                      {{"SAMPLES", std::to_string(source.samples)},
                                       {"REFLECTIVE", reflective ? "1" : "0"},
                                       {"TINTED", std::to_string(tinted)},
                                       {"HIGHLIGHTS", highlights ? "1" : "0"},
                                       {"FRESNEL", fresnel ? "1" : "0"},
                                       {"GGX", ggx ? "1" : "0"}});
  }
  program.use();
  source.diffuse.bindImage(shared::kDiffuseImage, GL_READ_ONLY);
  if (reflective) source.reflection.bindImage(shared::kReflectionImage, GL_READ_ONLY);
  if (highlights) source.highlight.bindImage(shared::kHighlightImage, GL_READ_ONLY);
  if (tinted == 2) source.tint.bindImage(shared::kTintImage, GL_READ_ONLY);
  if (tinted == 1) {
    source.object.bindImage(shared::kObjectImage, GL_READ_ONLY);
    materials.tints().bind(shared::kTintsUnit);
  }
  const Rectangle all{0, 0, source.sampleWidth(), source.sampleHeight()};
  if (fresnel || ggx) {
    source.normal.bindImage(shared::kNormalImage, GL_READ_ONLY);
    const float aspect = static_cast<float>(source.width) / static_cast<float>(source.height);
    program.set("rayFromWindow",
                makeView(scene::clipFromCamera(camera, aspect) * scene::cameraFromWorld(camera),
                         camera.eye(), 0.0f, Vec4(0.0f, 0.0f, all.x1, all.y1), 0.0f)
                    .rayFromWindow);
  }
  const gl::Framebuffer target("composite", {{.texture = frame}});
  target.bind();
  gl::DrawScope scope{gl::DrawState()};
  for (const Rectangle& drawn : part ? part->rectangles() : std::vector<Rectangle>{all}) {
    scope.change(within(pixelsOf(drawn, source.samples)));
    gl::drawFullScreenTriangle();
  }
}

}  // namespace catoptric::raster
