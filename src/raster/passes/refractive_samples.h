// How many samples show surfaces that refract: methods that mirror them count them.
#pragma once

#include <cstdint>

#include "gl/query.h"
#include "gl/shader.h"
#include "raster/gbuffer.h"
#include "scene/scene.h"

namespace catoptric::raster {

class RefractiveSamples {
 public:
  RefractiveSamples() = default;
  /// Empty, and free of cost, where no mirror of the scene has a refraction.
  explicit RefractiveSamples(const scene::Scene& scene);

  /// Of the G-buffer's mirrors; 0 when empty.
  std::uint64_t count(const GBuffer& gbuffer) const;

 private:
  gl::Program program_;
  gl::FragmentCounter counter_;
  gl::Buffer buffer_;
  gl::Texture refracts_;  ///< R8UI by object id
};

}  // namespace catoptric::raster
