// What both loaders leave to one place.
#pragma once

#include "scene/scene.h"

namespace catoptric::scene {

/// Derives what loaders leave to one place: unit normals, tangents where a normal map needs them,
/// s and g, reflector numbers, planarity, the fingerprint. loadScene calls it once, last; loadGltf
/// and loadDescription do not. Calling it again changes nothing.
void finishScene(Scene& scene);

/// Throws SceneError when a finished scene has too many lights, or when one of its objects, lights
/// or nodes reaches farther than kMaxCoordinate, at rest or at a key of its animation.
void checkScene(const Scene& scene);

/// Gives a material s and g directly, in place of its metallic-roughness factors and texture;
/// finishScene then derives exactly these.
void setReflectance(Material& material, float s, float g);

/// The tint of a metallic-roughness material, by its factors.
void setMetallicTint(Material& material);

}  // namespace catoptric::scene
