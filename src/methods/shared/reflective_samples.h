// Collects reflections that were computed on the CPU, and uploads them to a G-buffer.
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
  /// Stores the radiance of the samples at `places`. Other samples are not changed if `beside` is
  /// set, otherwise they become 0. `flags`: as for trace::reflectedRadiance(), empty if no masks
  /// are requested.
  void scatter(const raster::GBuffer& gbuffer, bool beside, std::span<const std::uint32_t> places,
               std::span<const Vec3> radiance, std::span<const std::uint8_t> flags);
  /// Sets further raster::MaskBits of a sample, after a scatter() with flags.
  void mark(std::uint32_t place, std::uint16_t bits);
  /// Uploads to GBuffer::reflection, and to the masks if there were flags.
  void upload(raster::GBuffer& gbuffer) const;

 private:
  // Kept across frames to avoid allocations.
  std::vector<float> image_;
  std::vector<std::uint16_t> masks_;
};

}  // namespace catoptric::methods
