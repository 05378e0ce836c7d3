// Draws the diffuse radiance of surfaces from any viewpoint: other views than the frame's own, cube
// maps, impostors.
#pragma once

#include "raster/passes/background.h"
#include "raster/passes/visible.h"

namespace catoptric::raster {

class DiffusePass {
 public:
  explicit DiffusePass(SceneGpu& scene)
      : scene_(scene), background_("raster/shaders/background.frag") {}

  /// See SceneRaster::drawDiffuse().
  DrawStatistics draw(const Mat4& clipFromWorld, const Vec3& eye, float pixelSpreadRad,
                      const frame::Lighting& lighting, const DiffuseDraw& what = {});
  /// See SceneRaster::drawCubeMap().
  gl::Texture drawCubeMap(const Vec3& centre, int faceSize, const frame::Lighting& lighting,
                          const ObjectSet& objects, gl::Texture earlier);

 private:
  SceneGpu& scene_;
  Background background_;
  DrawList list_;
  gl::Texture cubeDepth_;
};

}  // namespace catoptric::raster
