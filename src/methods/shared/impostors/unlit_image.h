// What of an object's image no light changes. Light is added when the object or a light has moved.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "frame/shading.h"
#include "methods/shared/impostors/camera.h"

namespace catoptric::methods::impostors {

/// The factors of frame/shading.h at the texels of a depth map: half floats, one plane after the
/// other.
class UnlitImage {
 public:
  /// Bytes of an image.
  static std::uint64_t bytesOf(int size);

  /// `constant`, `normals`, `factors`: RGBA half floats by texel, as raster::DiffuseOutputs gives
  /// them. `depths`: g of Camera::rows(), 0 on the background. `camera`: the image's.
  void set(int size, const Camera& camera, std::span<const std::uint16_t> constant,
           std::span<const std::uint16_t> normals, std::span<const std::uint16_t> factors,
           std::span<const float> depths);
  /// The radiance under a lighting, RGBA half floats by texel, alpha 1 on the object. `camera`: the
  /// image's, moved with the object.
  void light(const Camera& camera, const frame::Lighting& lighting,
             std::vector<std::uint16_t>& radiance) const;

 private:
  enum Plane { kConstant = 0, kAlbedo = 3, kVisibility = 6, kNormal = 7, kPlanes = 10 };
  friend struct LitRow;

  int size_ = 0;
  Mat3 axes_{1.0f};  ///< of the image's camera
  std::array<std::vector<std::uint16_t>, kPlanes> planes_;
  std::vector<float> depths_;
};

}  // namespace catoptric::methods::impostors
