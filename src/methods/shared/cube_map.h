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

/// What a plan says of cube maps of the scene. `again`: what they show may change between frames.
/// `maps`: at most so many, each drawn when a frame first reads it.
std::vector<PlanItem> cubeMapItems(int faceSize, bool again, int maps = 1);

/// Ids of the objects that a map around `centre` leaves out, since from within them nothing else
/// would be seen: reflectors whose box holds the centre, and other objects whose surface encloses
/// it. Larger than half of the scene they are a room and stay, except reflectors whose surface
/// encloses it. A flat reflector stays.
std::vector<int> enclosing(const Vec3& centre, const scene::Scene& scene,
                           const frame::Geometry& geometry);

class CubeMap {
 public:
  /// Draws the diffuse radiance of `objects` from `centre` (step `cube_map`): RGBA16F, mip-mapped.
  void draw(Services& services, const Vec3& centre, int faceSize, const raster::ObjectSet& objects);
  /// As draw() for all objects except those that enclose the centre.
  void draw(Services& services, const Vec3& centre, int faceSize);
  /// Called in each frame: draws the map if the frame reads it and there is none, or if an object
  /// or a light has moved since it was drawn.
  void follow(const FrameInput& input, Services& services, const Vec3& centre, int faceSize,
              bool read = true);
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
  void drawUntimed(Services& services, const Vec3& centre, int faceSize,
                   const raster::ObjectSet& objects);

  gl::Texture texture_;
  std::uint64_t clampedTexels_ = 0;
  std::vector<frame::WorldLight> lights_;  ///< the lights with which the map was drawn
  bool outdated_ = false;                  ///< an object has moved since
};

}  // namespace catoptric::methods
