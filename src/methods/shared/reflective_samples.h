// Reflections that were made on the CPU, on their way into a G-buffer.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/math.h"
#include "raster/gbuffer.h"

namespace catoptric::methods {

/// raster::MaskBits of a sample with these flags of trace::reflectedRadiance().
std::uint16_t maskBits(std::uint8_t flags);

class ReflectionUpload {
 public:
  /// Puts every sample's light in its place; elsewhere stays what is there if `beside`, else 0.
  /// `flags` as of trace::reflectedRadiance(), empty where no masks are asked for.
  void scatter(const raster::GBuffer& gbuffer, bool beside, std::span<const std::uint32_t> places,
               std::span<const Vec3> radiance, std::span<const std::uint8_t> flags);
  /// Sets further raster::MaskBits of a sample; after a scatter() with flags.
  void mark(std::uint32_t place, std::uint16_t bits);
  /// To GBuffer::reflection, and masks where there were flags.
  void upload(raster::GBuffer& gbuffer) const;

 private:
  // Kept across frames, so that no frame allocates anew.
  std::vector<float> image_;
  std::vector<std::uint16_t> masks_;
};

}  // namespace catoptric::methods
