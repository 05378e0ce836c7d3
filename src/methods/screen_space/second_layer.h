// The second depth layer of the frame [Mara2016]: in each sample the nearest surface that lies at
// least a given distance behind the one which the frame shows.
#pragma once

#include <cstdint>

#include "gl/objects.h"
#include "methods/contract/method.h"
#include "raster/passes/visible.h"

namespace catoptric::methods::screen_space {

class SecondLayer {
 public:
  static constexpr std::uint64_t kBytesPerSample = 16 + 8 + 4;

  SecondLayer() = default;
  /// Width and height in samples.
  SecondLayer(int width, int height);

  bool empty() const { return depth_.empty(); }
  /// Draws what lies at least `separation` metres, along the view's axis, behind the G-buffer.
  void draw(Services& services, float nearMetres, float separation);

  /// RGBA32F: diffuse radiance, s; -1 where there is no surface.
  const gl::Texture& colour() const { return colour_; }
  /// RG32UI: object id; shading normal turned to the viewer, packed as a lobe horizon. Undefined
  /// where there is no surface.
  const gl::Texture& surface() const { return surface_; }
  /// Reversed-Z depth as in the G-buffer; 0 where there is no surface.
  const gl::Texture& depth() const { return depth_; }

 private:
  gl::Texture colour_;
  gl::Texture surface_;
  gl::Texture depth_;
  gl::Framebuffer target_;
  gl::Buffer distances_;
  raster::DrawList list_;
};

}  // namespace catoptric::methods::screen_space
