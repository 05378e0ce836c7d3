// Checks a glTF file before the parser tinygltf reads it. tinygltf takes members of wrong type as
// absent, wraps large integers, drops elements it cannot read, and reads past the end of some GLB
// files. Here all these are errors with a JSON pointer.
//
// tinygltf also drops integers that are written as floats (36.0), which glTF allows, and wraps
// integers from 2^31 on in extensions and extras. Such numbers are rewritten before it reads them.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "scene/gltf/container.h"
#include "scene/gltf/uris.h"
#include "scene/loader.h"

namespace catoptric::scene::gltf {

/// Whether the loader reads an extension.
bool isKnownExtension(std::string_view name);
/// Whether an extension gives textures images of another kind. A file may require it; a material
/// that needs such an image is refused.
bool isImageExtension(std::string_view name);

/// The results of a check that found no error.
struct Checked {
  External external;
  /// New texts for numbers that tinygltf would misread.
  std::vector<Rewrite> rewrites;
};
/// Checks nesting, JSON syntax, types, required members, allowed values, ranges of all indices,
/// mutually exclusive members, the asset's version, required extensions, and the URIs. Throws
/// SceneError.
Checked checkJson(const Container& container, const std::string& file, const LoadLimits& limits);

}  // namespace catoptric::scene::gltf
