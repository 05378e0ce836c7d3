// What a glTF file names beside itself: relative paths and data: URIs.
#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>

#include "config/json.h"
#include "scene/gltf/container.h"
#include "scene/loader.h"

namespace catoptric::scene::gltf {

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

/// Checks the URIs of all buffers and images.
External checkUris(const config::Value& root, const Container& container, const std::string& file,
                   const LoadLimits& limits);

/// Percent-decoded path of a relative URI. Throws SceneError for absolute paths, other schemes, and
/// what leaves the folder of the file that names it.
std::filesystem::path relativePath(const std::string& uri, const std::string& file,
                                   const std::string& place);

/// Bytes of a "data:...;base64," URI; throws SceneError for anything else.
std::string decodeDataUri(std::string_view uri, const std::string& file, const std::string& place);

}  // namespace catoptric::scene::gltf
