// The gate in front of the glTF parser: what must hold before tinygltf sees a file. tinygltf takes
// wrong types for absent members, wraps large integers, drops elements it cannot read, and reads
// past the end of some GLB files; here all of that is an error with its JSON pointer. It also drops
// integers that are written as floats (36.0), which glTF allows, and wraps integers from 2^31 of
// extensions and extras: such numbers are written anew for it.
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

/// Checks nesting, JSON syntax, types, required members, allowed values, ranges of all indices,
/// exclusive members, the asset's version, required extensions, and the URIs.
struct Checked {
  External external;
  /// Numbers that tinygltf would misread as they are written.
  std::vector<Rewrite> rewrites;
};
Checked checkJson(const Container& container, const std::string& file, const LoadLimits& limits);

}  // namespace catoptric::scene::gltf
