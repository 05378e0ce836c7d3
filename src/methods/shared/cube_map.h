// A cube map of the scene's diffuse radiance, for environment_map and for the missed rays of other
// methods.
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
  /// Draws the diffuse radiance of `objects` from `centre` (step `cube_map`): RGBA16F, mip-mapped.
  void draw(Services& services, const Vec3& centre, int faceSize, const raster::ObjectSet& objects);
  /// As draw() for all objects except reflectors around the centre, which would hide all else.
  void draw(Services& services, const Vec3& centre, int faceSize);
  /// Draws the map if there is none, or if an object or a light has moved since.
  void follow(const FrameInput& input, Services& services, const Vec3& centre, int faceSize);
  /// Uses a map that was made elsewhere.
  void take(gl::Texture texture);

  bool empty() const { return texture_.empty(); }
  const gl::Texture& texture() const { return texture_; }
  void bind(int unit) const { texture_.bind(unit); }
  /// Sets the uniforms levelOffset and lastLevel, which give the mip level of a lobe (lookup.frag).
  void setLevels(gl::Program& program) const;
  /// Number of texels of level 0 that were clamped to the range of half floats.
  std::uint64_t clampedTexels() const { return clampedTexels_; }

 private:
  gl::Texture texture_;
  std::uint64_t clampedTexels_ = 0;
  std::vector<frame::WorldLight> lights_;  ///< the lights with which the map was drawn
};

}  // namespace catoptric::methods
