#include "methods/screen_space/second_layer.h"

#include "raster/constants.h"
#include "raster/passes/surfaces.h"

namespace catoptric::methods::screen_space {
namespace {

constexpr GLuint kDistancesBlock = 2;  // second_layer.frag

}  // namespace

SecondLayer::SecondLayer(int width, int height)
    : colour_(gl::Texture::make2D("second layer", GL_RGBA32F, width, height)),
      surface_(gl::Texture::make2D("surfaces of the second layer", GL_RG32UI, width, height)),
      depth_(
          gl::Texture::make2D("depths of the second layer", GL_DEPTH_COMPONENT32F, width, height)),
      target_("second layer", {{.texture = colour_}, {.texture = surface_}}, {.texture = depth_}),
      distances_("distances of the second layer", sizeof(Vec4)) {}

void SecondLayer::draw(Services& services, float nearMetres, float separation) {
  static const raster::SurfaceShaders shaders{
      .label = "second layer",
      .vertex = "raster/shaders/scene.vert",
      .fragment = "methods/screen_space/shaders/second_layer.frag",
      .outputs = raster::kRadianceOutput | raster::kNormalOutput | raster::kSpecularOutput};
  target_.bind();
  {
    const gl::DrawScope scope{gl::DrawState()};
    target_.clearDepth(0.0f);
    target_.clearColor(0, 0.0f, 0.0f, 0.0f, -1.0f);
  }
  const Vec4 distances(nearMetres, separation, 0.0f, 0.0f);
  distances_.write(0, sizeof distances, &distances);
  distances_.bindUniform(kDistancesBlock);
  services.gbuffer->depth.bind(raster::shared::kFirstPassUnit);
  raster::SurfacePass pass{.shaders = shaders};
  pass.state.depth.test = true;
  raster::drawSurfaces(services.raster->scene(), services.raster->gbufferView(), services.lighting,
                       pass, {}, list_);
}

}  // namespace catoptric::methods::screen_space
