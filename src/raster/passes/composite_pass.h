// Resolves samples to pixels: combines the G-buffer with the reflections that methods have written.
#pragma once

#include <cstdint>
#include <map>
#include <optional>

#include "gl/shader.h"
#include "raster/gbuffer.h"
#include "raster/scene_gpu/materials.h"
#include "scene/camera.h"

namespace catoptric::raster {

struct CompositeOptions {
  bool fresnelSchlick = false;  ///< use s + (1 - s)(1 - cos)^5 instead of s
};

class CompositePass {
 public:
  /// See SceneRaster::composite().
  void draw(const GBuffer& source, const Materials& materials, const scene::Camera& camera,
            const CompositeOptions& options, gl::Texture& frame, const std::optional<Region>& part);

 private:
  std::map<std::uint32_t, gl::Program> programs_;
};

}  // namespace catoptric::raster
