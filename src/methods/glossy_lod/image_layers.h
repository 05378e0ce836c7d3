// Layers that show the geometry images themselves, for debugging.
#pragma once

#include <string>
#include <vector>

#include "methods/contract/method.h"
#include "methods/glossy_lod/scene_images.h"

namespace catoptric::methods::glossy_lod {

/// The layers chart, image_position, image_normal and image_place.
std::vector<SampleLayerInfo> imageLayers();

/// Adds the layers in `asked` for a frame of width x height samples, by intersecting each sample's
/// camera ray with the finest quads.
void showImages(const SceneImages& images, const scene::Camera& camera, int width, int height,
                const std::vector<std::string>& asked, std::vector<SampleLayer>& layers);

/// Distortion of a triangle (half a quad): 1 minus the ratio of the singular values of its map from
/// half a square. 0: the map only turns and scales; 1: the triangle is degenerate.
float distortion(const Vec3& right, const Vec3& up);

}  // namespace catoptric::methods::glossy_lod
