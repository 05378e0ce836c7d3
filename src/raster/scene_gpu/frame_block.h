// The uniform block `Frame` of shading.glsl: a view and the lighting, packed for GL.
#pragma once

#include <string>
#include <vector>

#include "frame/shading.h"
#include "gl/objects.h"
#include "gl/shader.h"

namespace catoptric::raster {

/// Radiance is written up to this: float targets ...
inline constexpr float kNoRadianceLimit = 1e30f;
/// ... and half targets (the largest half).
inline constexpr float kHalfRadianceLimit = 65504.0f;

/// A view as shading.glsl needs it.
struct FrameView {
  Mat4 clipFromWorld{1.0f};
  Mat4 rayFromWindow{1.0f};  ///< (x, y, depth, 1) in window coordinates to position - eye
  Vec3 eye{0.0f};
  float spreadRad = 0.0f;
  float radianceLimit = kNoRadianceLimit;
  /// 1 where gl_FrontFacing means the front, -1 for views that mirror (cube faces).
  float frontSign = 1.0f;
  /// Whether closed objects about the eye or the near plane show their insides; else nothing.
  bool insides = true;
};

/// `viewport`: x, y, width, height in pixels, row 0 on top.
FrameView makeView(const Mat4& clipFromWorld, const Vec3& eye, float spreadRad,
                   const Vec4& viewport, float radianceLimit);

/// Types of the lights in their order, e.g. "pps": what variants are compiled for.
std::string lightSignature(const frame::Lighting& lighting);
/// LIGHT_COUNT and LIGHT_SUM. Throws SceneError when there are more lights than a block can hold.
std::vector<gl::Define> lightDefines(const frame::Lighting& lighting);
/// ENVIRONMENT of shading.glsl: "0" constant, "1" gradient, "2" image.
std::string environmentType(const frame::Lighting& lighting);
/// Whether surfaces that see the sky receive any light of it (or ambient light).
bool hasSky(const frame::Lighting& lighting);

/// The block's buffer and the environment's image.
class FrameResources {
 public:
  void bind(const FrameView& view, const frame::Lighting& lighting);
  void bindEnvironment(const frame::Lighting& lighting);

 private:
  gl::Buffer block_;
  gl::Texture image_;
  const frame::EnvironmentLight* imageOf_ = nullptr;
};

}  // namespace catoptric::raster
