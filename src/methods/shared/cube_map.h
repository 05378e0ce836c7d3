// The diffuse scene as a cube map: what environment_map shows, and what other methods show of rays
// that find nothing.
#pragma once

#include <cstdint>
#include <vector>

#include "frame/shading.h"
#include "gl/objects.h"
#include "gl/shader.h"
#include "methods/contract/method.h"

namespace catoptric::methods {

/// Bytes of a cube map with the whole mip chain.
std::uint64_t cubeMapBytes(int faceSize, std::uint64_t bytesPerTexel);

class CubeMap {
 public:
  /// Draws the diffuse scene from `centre`, as step `cube_map`: RGBA16F with mip levels.
  void draw(Services& services, const Vec3& centre, int faceSize, const raster::ObjectSet& objects);
  /// The same of all objects but reflectors about the centre, which would hide all else.
  void draw(Services& services, const Vec3& centre, int faceSize);
  /// The same when there is none, or when an object or a light has moved since.
  void follow(const FrameInput& input, Services& services, const Vec3& centre, int faceSize);
  /// Takes a map that something else has made.
  void take(gl::Texture texture);

  bool empty() const { return texture_.empty(); }
  const gl::Texture& texture() const { return texture_; }
  void bind(int unit) const { texture_.bind(unit); }
  /// Sets uniforms levelOffset and lastLevel: the mip level of a lobe (lookup.frag).
  void setLevels(gl::Program& program) const;
  /// Texels of level 0 at the limit of half floats.
  std::uint64_t clampedTexels() const { return clampedTexels_; }

 private:
  gl::Texture texture_;
  std::uint64_t clampedTexels_ = 0;
  std::vector<frame::WorldLight> lights_;  ///< that it was drawn with
};

}  // namespace catoptric::methods
