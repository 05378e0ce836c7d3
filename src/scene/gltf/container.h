// The outer form of a glTF file: JSON text, or a GLB of chunks.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

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

/// Another text for some bytes of a file's JSON.
struct Rewrite {
  std::size_t begin = 0;
  std::size_t end = 0;
  std::string text;
};
/// The file's bytes with these texts in its JSON; they must be in order and apart.
std::vector<std::byte> rewritten(const Container& container, std::span<const Rewrite> rewrites);

/// Refuses nesting that would exhaust a recursive parser's stack, before any parser runs.
void checkNesting(std::string_view json, const std::string& file);

}  // namespace catoptric::scene::gltf
