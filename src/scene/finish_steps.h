// The steps of finishScene that stand in files of their own; for the sources of this folder only.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "scene/scene.h"

namespace catoptric::scene {

inline std::size_t index(int i) {
  return static_cast<std::size_t>(i);
}

/// Adds a note to the scene, once.
void addNote(Scene& scene, const std::string& note);

/// Unit normals, and tangents where a normal map needs them; notes what had to be made up.
void finishMeshes(Scene& scene);
/// Notes objects that have textures but no texture coordinates.
void noteMissingTextureCoordinates(Scene& scene);

/// Everything that can change a pixel; no names, no notes.
std::uint64_t fingerprintOf(const Scene& scene);

}  // namespace catoptric::scene
