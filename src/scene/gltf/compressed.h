// Compressed data of a glTF file: EXT_meshopt_compression of buffer views and
// KHR_draco_mesh_compression of primitives.
#pragma once

#include "config/json.h"
#include "scene/gltf/rules.h"

namespace catoptric::scene::gltf {

/// Whether a buffer only stands in for compressed data, and has no bytes.
bool isEmptyFallback(const config::Value& buffer);

/// Checks what the rules of single members cannot. Appends to `rewrites` what tinygltf, which knows
/// neither extension, needs to read the file. Throws SceneError.
void checkCompressed(const Checker& check, const config::Value& root,
                     std::vector<Rewrite>& rewrites);

}  // namespace catoptric::scene::gltf
