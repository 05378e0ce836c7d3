// References of a glTF file to other data: relative paths and data: URIs.
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

/// The external references in the checked JSON.
struct External {
  /// An entry's key is the name with which tinygltf asks for it (the URI after tinygltf's own,
  /// faulty decoding). An entry has the URI as written, and the length of a buffer.
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

/// The file of a percent-encoded URI, as assetFile() finds it. Throws SceneError for other schemes,
/// and for files outside all folders.
std::filesystem::path fileOfUri(const std::string& uri, const std::string& file,
                                const LoadLimits& limits, const std::string& place);

/// The bytes of a "data:...;base64," URI. Throws SceneError for anything else.
std::string decodeDataUri(std::string_view uri, const std::string& file, const std::string& place);

}  // namespace catoptric::scene::gltf
