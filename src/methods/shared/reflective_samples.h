// Reflective samples of a G-buffer as points to trace from, in an order that keeps rays coherent,
// and their light's way back into the G-buffer.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/math.h"
#include "frame/object_set.h"
#include "raster/gbuffer.h"
#include "scene/camera.h"
#include "trace/lobes/reflect.h"

namespace catoptric::methods {

struct ReflectiveSamples {
  std::vector<trace::ReflectionPoint> points;
  std::vector<std::uint32_t> places;  ///< index of the sample in the G-buffer
};

/// All samples with s > 0 on an object of `own`, tile by tile (16 x 16 samples), within a tile by
/// object, within an object along rows of 4 x 2 blocks.
ReflectiveSamples collectReflective(const raster::GBufferCopy& source, const scene::Camera& camera,
                                    const trace::TraceScene& trace,
                                    const frame::ObjectSet& own = {});

/// raster::MaskBits of a sample with these flags of trace::reflectedRadiance().
std::uint16_t maskBits(std::uint8_t flags);

/// Reflections that were made on the CPU, on their way into a G-buffer.
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
