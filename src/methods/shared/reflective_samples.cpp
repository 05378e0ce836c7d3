#include "methods/shared/reflective_samples.h"

#include "core/parallel.h"

namespace catoptric::methods {

std::uint16_t maskBits(std::uint8_t flags) {
  std::uint16_t bits = 0;
  if ((flags & 1) != 0) bits |= raster::kMaskEnvironment;
  if ((flags & 2) != 0) bits |= raster::kMaskBelowHorizon;
  if ((flags & 4) != 0) bits |= raster::kMaskSky;
  return bits;
}

void ReflectionUpload::scatter(const raster::GBuffer& gbuffer, bool beside,
                               std::span<const std::uint32_t> places,
                               std::span<const Vec3> radiance,
                               std::span<const std::uint8_t> flags) {
  const std::size_t total = static_cast<std::size_t>(gbuffer.sampleWidth()) *
                            static_cast<std::size_t>(gbuffer.sampleHeight());
  if (beside) {
    image_ = raster::readRgba(gbuffer.reflection);
  } else {
    image_.assign(4 * total, 0.0f);
  }
  parallelFor(places.size(), 16384, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) {
      float* texel = &image_[4 * static_cast<std::size_t>(places[k])];
      texel[0] = radiance[k].x;
      texel[1] = radiance[k].y;
      texel[2] = radiance[k].z;
      texel[3] = 1.0f;
    }
  });
  masks_.clear();
  if (flags.empty()) return;
  if (beside) {
    masks_ = raster::readMasks(gbuffer.masks);
  } else {
    masks_.assign(total, 0);
  }
  for (std::size_t k = 0; k < places.size(); ++k) {
    masks_[places[k]] = maskBits(flags[k]);
  }
}

void ReflectionUpload::mark(std::uint32_t place, std::uint16_t bits) {
  masks_[place] |= bits;
}

void ReflectionUpload::upload(raster::GBuffer& gbuffer) const {
  gbuffer.reflection.upload(0, 0, GL_RGBA, GL_FLOAT, image_.data());
  if (!masks_.empty()) raster::writeMasks(gbuffer.masks, masks_);
}

}  // namespace catoptric::methods
