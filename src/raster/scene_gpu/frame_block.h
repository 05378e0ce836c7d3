// The uniform block `Frame` of shading.glsl: a view and the lighting, packed for GL.
#pragma once

#include <string>
#include <vector>

#include "frame/shading.h"
#include "gl/objects.h"
#include "gl/shader.h"

namespace catoptric::raster {

/// Largest radiance that is written to float targets.
inline constexpr float kNoRadianceLimit = 1e30f;
/// Largest radiance that is written to half-float targets: the largest half.
inline constexpr float kHalfRadianceLimit = 65504.0f;

/// A view as shading.glsl needs it.
struct FrameView {
  Mat4 clipFromWorld{1.0f};
  Mat4 rayFromWindow{1.0f};  ///< maps (x, y, depth, 1) in window coordinates to position - eye
  Vec3 eye{0.0f};
  float spreadRad = 0.0f;
  float radianceLimit = kNoRadianceLimit;
  /// 1 if gl_FrontFacing means the front side; -1 for views that mirror (cube faces).
  float frontSign = 1.0f;
  /// Whether closed objects that contain the eye or intersect the near plane show their inner
  /// sides. If false, nothing of them is drawn there.
  bool insides = true;
};

/// `viewport`: x, y, width, height in pixels, row 0 on top.
FrameView makeView(const Mat4& clipFromWorld, const Vec3& eye, float spreadRad,
                   const Vec4& viewport, float radianceLimit);

/// The types of the lights in their order, e.g. "pps". Shader variants are compiled per signature.
std::string lightSignature(const frame::Lighting& lighting);
/// The defines LIGHT_COUNT and LIGHT_SUM. Throws SceneError if there are more lights than a block
/// can hold.
std::vector<gl::Define> lightDefines(const frame::Lighting& lighting);
/// ENVIRONMENT of shading.glsl: "0" constant, "1" gradient, "2" image.
std::string environmentType(const frame::Lighting& lighting);
/// Whether surface points that see the sky receive light from it (or ambient light).
bool hasSky(const frame::Lighting& lighting);

/// The buffer of the block, and the environment's texture.
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
