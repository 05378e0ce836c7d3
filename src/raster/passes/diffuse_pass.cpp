#include "raster/passes/diffuse_pass.h"

#include <cmath>
#include <utility>

#include "core/error.h"
#include "raster/constants.h"
#include "raster/cube_faces.h"
#include "raster/passes/surfaces.h"

namespace catoptric::raster {
namespace {

SurfaceShaders diffuseShaders(const DiffuseOutputs& outputs, bool behind) {
  return {.label = outputs.factors ? "diffuse, unlit"
                   : behind        ? "diffuse, behind"
                                   : "diffuse",
          .vertex = "raster/shaders/scene.vert",
          .fragment = "raster/shaders/diffuse.frag",
          .outputs = (outputs.radiance ? std::uint32_t{kRadianceOutput} : 0u) |
                     (outputs.normal ? std::uint32_t{kNormalOutput} : 0u) |
                     (outputs.specular ? std::uint32_t{kSpecularOutput} : 0u),
          .defines = {{"BEHIND", behind ? "1" : "0"}, {"FACTORS", outputs.factors ? "1" : "0"}}};
}

}  // namespace

DrawStatistics DiffusePass::draw(const Mat4& clipFromWorld, const Vec3& eye, float pixelSpreadRad,
                                 const frame::Lighting& lighting, const DiffuseDraw& what) {
  if (what.background && (!what.outputs.radiance || what.outputs.normal || what.outputs.specular)) {
    throw Error(ExitCode::Internal, "a background has radiance alone, no normal, s or g");
  }
  GLint viewport[4] = {};
  glGetIntegerv(GL_VIEWPORT, viewport);
  FrameView view =
      makeView(clipFromWorld, eye, pixelSpreadRad,
               Vec4(viewport[0], viewport[1], viewport[2], viewport[3]), kHalfRadianceLimit);
  view.insides = what.insides;
  const SurfaceShaders shaders = diffuseShaders(what.outputs, what.behind != nullptr);
  if (what.behind != nullptr) what.behind->bind(shared::kFirstPassUnit);
  gl::DrawState state;
  state.scissor = gl::DrawScope::current().scissor;
  SurfacePass pass{.shaders = shaders, .state = state};
  pass.state.depth.test = true;
  const DrawStatistics statistics =
      drawSurfaces(scene_, view, lighting, pass, {.objects = what.objects}, list_);
  if (what.background) background_.draw(scene_.frame(), lighting, {}, state);
  return statistics;
}

gl::Texture DiffusePass::drawCubeMap(const Vec3& centre, int faceSize,
                                     const frame::Lighting& lighting, const ObjectSet& objects,
                                     gl::Texture earlier) {
  const auto fits = [&](const gl::Texture& made) {
    return !made.empty() && made.width() == faceSize;
  };
  gl::Texture cube = fits(earlier) ? std::move(earlier)
                                   : gl::Texture::makeCube("cube map", GL_RGBA16F, faceSize, 0);
  if (!fits(cubeDepth_)) {
    cubeDepth_ = gl::Texture::make2D("cube map depth", GL_DEPTH_COMPONENT32F, faceSize, faceSize);
  }
  // Near enough to keep everything, far from rounding
  const float nearMetres = std::max(1e-12f, 1e-4f * scene_.diameter());
  const float spread = 2.0f * std::atan(1.0f / static_cast<float>(faceSize));
  const gl::DrawScope scope{gl::DrawState()};
  for (std::size_t i = 0; i < kCubeFaces.size(); ++i) {
    const gl::Framebuffer target("cube map face", {{.texture = cube, .layer = static_cast<int>(i)}},
                                 {.texture = cubeDepth_});
    target.bind();
    target.clearDepth(0.0f);
    // Rows are clip x, -y and w
    const CubeFace& f = kCubeFaces[i];
    const Mat4 rows(Vec4(f.right, -glm::dot(f.right, centre)),
                    Vec4(-f.down, glm::dot(f.down, centre)), Vec4(0.0f, 0.0f, 0.0f, nearMetres),
                    Vec4(f.forward, -glm::dot(f.forward, centre)));
    draw(glm::transpose(rows), centre, spread, lighting, {.objects = objects, .insides = false});
  }
  cube.generateMipmaps();
  return cube;
}

}  // namespace catoptric::raster
