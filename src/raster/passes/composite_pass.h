// Resolves the G-buffer's samples and what methods have written to pixels.
#pragma once

#include <cstdint>
#include <map>
#include <optional>

#include "gl/shader.h"
#include "raster/gbuffer.h"
#include "raster/scene_gpu/materials.h"
#include "scene/camera.h"

namespace catoptric::raster {

/// What the composite makes of a G-buffer.
struct CompositeOptions {
  bool fresnelSchlick = false;  ///< s + (1 - s)(1 - cos)^5 instead of s
};

class CompositePass {
 public:
  /// As SceneRaster::composite().
  void draw(const GBuffer& source, const Materials& materials, const scene::Camera& camera,
            const CompositeOptions& options, gl::Texture& frame, const std::optional<Region>& part);

 private:
  std::map<std::uint32_t, gl::Program> programs_;
};

}  // namespace catoptric::raster
