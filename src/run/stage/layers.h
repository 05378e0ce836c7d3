// Layers of a frame from the samples of its G-buffer.
#pragma once

#include <cstdint>
#include <vector>

#include "image/image.h"
#include "methods/contract/method.h"

namespace catoptric::run {

/// Samples of a G-buffer, row 0 on top; what is empty gives no layer.
struct SampleLayers {
  std::vector<float> diffuse;             ///< rgb and s; `reflection` and `masks` need it
  bool wantDiffuse = true;                ///< layer diffuse, from `diffuse`
  bool wantSpecular = false;              ///< layer s, likewise
  std::vector<float> normal;              ///< xyz and g; `masks` needs it for mask.glossy
  bool wantNormal = true;                 ///< layers N.*, from `normal`
  std::vector<float> reflection;          ///< rgb
  std::vector<float> depth;               ///< reversed-Z
  std::vector<std::uint32_t> object;      ///< ids
  std::vector<methods::SampleLayer> ids;  ///< layers id.NAME, NAME.X to NAME.Z
  std::vector<std::uint16_t> masks;
  std::uint16_t filledMasks = 0;  ///< bits of `masks` that mean something: those give layers
};
/// Adds layers to `image`: Z, N and ids of each pixel's middle sample, means of the others; Z is
/// the distance along -z in metres, 0 where there is nothing. `samples` per axis.
void addLayers(image::Image& image, const SampleLayers& layers, int samples, float nearMetres);

}  // namespace catoptric::run
