// Makes the layers of a frame from the samples of its G-buffer.
#pragma once

#include <cstdint>
#include <vector>

#include "image/image.h"
#include "methods/contract/method.h"

namespace catoptric::run {

/// Samples of a G-buffer, row 0 on top. Empty members yield no layer.
struct SampleLayers {
  std::vector<float> diffuse;             ///< rgb and s; required for `reflection` and `masks`
  bool wantDiffuse = true;                ///< write layer diffuse, from `diffuse`
  bool wantSpecular = false;              ///< write layer s, from `diffuse`
  std::vector<float> normal;              ///< xyz and g; `masks` needs it for mask.glossy
  bool wantNormal = true;                 ///< write layers N.*, from `normal`
  std::vector<float> reflection;          ///< rgb
  std::vector<float> depth;               ///< reversed-Z
  std::vector<std::uint32_t> object;      ///< ids
  std::vector<methods::SampleLayer> ids;  ///< layers id.NAME, or NAME.X to NAME.Z
  std::vector<Vec3> motion;               ///< one per pixel: layers motion.X to motion.Z
  std::vector<std::uint16_t> masks;
  std::uint16_t filledMasks = 0;  ///< the valid bits of `masks`; only these give layers
};
/// The layers that image.layers and image.masks can add to any method's frames.
const std::vector<methods::SampleLayerInfo>& frameLayers();
/// Adds layers to `image`, with `samples` samples per pixel and axis. Z, N and ids are those of
/// each pixel's centre sample; the others are means over its samples. Z is the distance along -z in
/// metres, 0 on the background.
void addLayers(image::Image& image, const SampleLayers& layers, int samples, float nearMetres);

}  // namespace catoptric::run
