// The outer form of a glTF file: JSON text, or a GLB of chunks.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>

namespace catoptric::scene::gltf {

/// Throws SceneError "file: place: message".
[[noreturn]] void fail(const std::string& file, const std::string& place,
                       const std::string& message);

/// The parts of a file's bytes.
struct Container {
  bool binary = false;  ///< GLB
  std::string_view json;
  std::span<const std::byte> bin;  ///< the BIN chunk; empty when there is none
};

/// Splits a GLB file and checks its structure, recognised by its magic; another file is all JSON.
Container splitContainer(std::span<const std::byte> bytes, const std::string& file);

/// Refuses nesting that would exhaust a recursive parser's stack, before any parser runs.
void checkNesting(std::string_view json, const std::string& file);

}  // namespace catoptric::scene::gltf
