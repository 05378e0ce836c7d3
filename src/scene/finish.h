// The last steps of loading, which both loaders share.
#pragma once

#include "scene/scene.h"

namespace catoptric::scene {

/// Derives unit normals, tangents where a normal map needs them, s and g, reflector numbers,
/// planarity and the fingerprint. loadScene calls it once, at the end; loadGltf and loadDescription
/// do not. A second call changes nothing.
void finishScene(Scene& scene);

/// Lets all materials with a GGX lobe reflect, as glTF means them; before finishScene(). Without
/// this call those whose s is below kReflectiveThreshold are diffuse, as the dielectrics of the
/// papers' rooms.
void letDielectricsReflect(Scene& scene);

/// Throws SceneError if a finished scene has too many lights, or if an object, light or node lies
/// farther out than kMaxCoordinate, at rest or at a key of its animation.
void checkScene(const Scene& scene);

/// Sets s and g of a material directly instead of metallic-roughness factors and texture.
/// finishScene then derives exactly these values.
void setReflectance(Material& material, float s, float g);

/// Sets the tint of a metallic-roughness material from its factors.
void setMetallicTint(Material& material);

}  // namespace catoptric::scene
