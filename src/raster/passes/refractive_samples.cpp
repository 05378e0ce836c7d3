#include "raster/passes/refractive_samples.h"

#include <algorithm>
#include <vector>

#include "raster/scene_gpu/materials.h"

namespace catoptric::raster {

RefractiveSamples::RefractiveSamples(const scene::Scene& scene) {
  const std::vector<SampleClass> classes = materialClasses(scene);
  std::vector<std::uint8_t> refracts{0};
  for (const scene::Object& object : scene.objects) {
    const scene::Material& material = scene.materials[object.material];
    refracts.push_back(
        material.refraction > 0.0f && classes[object.material] == SampleClass::CurvedMirror ? 1
                                                                                            : 0);
  }
  if (std::ranges::count(refracts, 1) == 0) return;
  program_ =
      gl::Program::fullScreen("refractive samples", "raster/shaders/refractive_samples.frag", {});
  counter_ = gl::FragmentCounter("refractive samples");
  buffer_ = gl::Buffer("what refracts", std::span<const std::uint8_t>(refracts));
  refracts_ = gl::Texture::makeBuffer("what refracts", GL_R8UI, buffer_);
}

std::uint64_t RefractiveSamples::count(const GBuffer& gbuffer,
                                       const gl::Framebuffer* marked) const {
  if (program_.empty()) return 0;
  (marked != nullptr ? *marked : gbuffer.reflectionFramebuffer).bind();
  program_.use();
  gbuffer.object.bind(0);
  refracts_.bind(1);
  gl::DrawState state = onMirrors();
  if (marked == nullptr) state.colors = 0;
  const gl::DrawScope scope(state);
  counter_.begin();
  gl::drawFullScreenTriangle();
  counter_.end();
  return counter_.read();
}

}  // namespace catoptric::raster
