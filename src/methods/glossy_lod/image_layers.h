// Layers that show the geometry images themselves, as the camera sees them.
#pragma once

#include <string>
#include <vector>

#include "methods/contract/method.h"
#include "methods/glossy_lod/scene_images.h"

namespace catoptric::methods::glossy_lod {

/// chart, image_position, image_normal, image_place.
std::vector<SampleLayerInfo> imageLayers();

/// Adds those that are asked for, of a frame of width x height samples: each sample's ray meets the
/// finest quads.
void showImages(const SceneImages& images, const scene::Camera& camera, int width, int height,
                const std::vector<std::string>& asked, std::vector<SampleLayer>& layers);

/// How far a quad's half is from a square's: 1 less the ratio of its map's singular values. 0: it
/// is turned and scaled alone, 1: it is a line.
float distortion(const Vec3& right, const Vec3& up);

}  // namespace catoptric::methods::glossy_lod
