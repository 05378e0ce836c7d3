// The steps of finishScene that have their own source files; private to this folder.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "scene/scene.h"

namespace catoptric::scene {

inline std::size_t index(int i) {
  return static_cast<std::size_t>(i);
}

/// Adds a note to the scene, unless it has it already.
void addNote(Scene& scene, const std::string& note);

/// Makes unit normals, and tangents where a normal map needs them. Adds notes about missing data
/// that was made up.
void finishMeshes(Scene& scene);
/// Adds notes about objects that have textures but no texture coordinates.
void noteMissingTextureCoordinates(Scene& scene);

/// Fingerprint of everything that can change a pixel; names and notes are not part of it.
std::uint64_t fingerprintOf(const Scene& scene);

}  // namespace catoptric::scene
