// The container of a glTF file: plain JSON text, or a GLB file of chunks.
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

/// The parts of a file.
struct Container {
  bool binary = false;  ///< whether it is a GLB file
  std::string_view json;
  std::span<const std::byte> bin;  ///< the BIN chunk; empty if there is none
};

/// Recognises a GLB file by its magic number, checks its structure and splits it. Any other file is
/// JSON as a whole.
Container splitContainer(std::span<const std::byte> bytes, const std::string& file);

/// A replacement for some bytes of a file's JSON.
struct Rewrite {
  std::size_t begin = 0;
  std::size_t end = 0;
  std::string text;
};
/// The file's bytes after these replacements in its JSON. They must be sorted and must not overlap.
std::vector<std::byte> rewritten(const Container& container, std::span<const Rewrite> rewrites);

/// Refuses nesting so deep that it would exhaust a recursive parser's stack. Runs before any
/// parser.
void checkNesting(std::string_view json, const std::string& file);

}  // namespace catoptric::scene::gltf
