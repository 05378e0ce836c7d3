// Counts the samples of refractive surfaces, for methods that treat these as mirrors or leave them.
#pragma once

#include <cstdint>

#include "gl/objects.h"
#include "gl/query.h"
#include "gl/shader.h"
#include "raster/gbuffer.h"
#include "scene/scene.h"

namespace catoptric::raster {

class RefractiveSamples {
 public:
  RefractiveSamples() = default;
  /// Empty, at no cost, if no mirror of the scene also refracts.
  explicit RefractiveSamples(const scene::Scene& scene);

  /// The number of such samples among the mirror samples of the G-buffer; 0 when empty. The one
  /// colour of `marked`, R32UI, takes their objects.
  std::uint64_t count(const GBuffer& gbuffer, const gl::Framebuffer* marked = nullptr) const;

 private:
  gl::Program program_;
  gl::FragmentCounter counter_;
  gl::Buffer buffer_;
  gl::Texture refracts_;  ///< R8UI, indexed by object id
};

}  // namespace catoptric::raster
