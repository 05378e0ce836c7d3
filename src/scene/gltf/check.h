// The gate in front of the glTF parser: what must hold before tinygltf sees a file. tinygltf takes
// wrong types for absent members, wraps large integers, drops elements it cannot read, and reads
// past the end of some GLB files; here all of that is an error with its JSON pointer.
#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <string_view>

#include "scene/loader.h"

namespace catoptric::scene::gltf {

/// Throws SceneError "file: place: message".
[[noreturn]] void fail(const std::string& file, const std::string& place,
                       const std::string& message);

/// Whether the loader reads an extension.
bool isKnownExtension(std::string_view name);

/// The parts of a file's bytes.
struct Container {
  bool binary = false;  ///< GLB
  std::string_view json;
  std::span<const std::byte> bin;  ///< the BIN chunk; empty when there is none
};

/// Splits a GLB file and checks its structure, recognised by its magic; another file is all JSON.
Container splitContainer(std::span<const std::byte> bytes, const std::string& file);

/// What the checked JSON says about files beside it.
struct External {
  /// By the name under which tinygltf asks for it (its own, faulty, decoding of a URI): the URI as
  /// written, and for buffers their length.
  struct Entry {
    std::string uri;
    std::string place;
    bool buffer = false;
    std::size_t byteLength = 0;
  };
  std::map<std::string, Entry> byParserName;
};

/// Checks nesting, JSON syntax, types, required members, allowed values, ranges of all indices,
/// exclusive members, the asset's version, required extensions, and the URIs.
External checkJson(const Container& container, const std::string& file, const LoadLimits& limits);

/// Percent-decoded path of a relative URI. Throws SceneError for absolute paths, other schemes, and
/// what leaves the folder of the file that names it.
std::filesystem::path relativePath(const std::string& uri, const std::string& file,
                                   const std::string& place);

/// Bytes of a "data:...;base64," URI; throws SceneError for anything else.
std::string decodeDataUri(std::string_view uri, const std::string& file, const std::string& place);

}  // namespace catoptric::scene::gltf
