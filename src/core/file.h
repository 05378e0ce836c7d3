// Whole files: read with a cap, written so that a final name never holds a part of a file.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace catoptric {

/// Reads a regular file of at most `maxBytes`. Throws SceneError that names the path when it is
/// missing, not a regular file, too large, or unreadable.
std::vector<std::byte> readFile(const std::filesystem::path& path,
                                std::size_t maxBytes = std::size_t{1} << 31);
std::string readTextFile(const std::filesystem::path& path,
                         std::size_t maxBytes = std::size_t{1} << 26);

/// Writes to a temporary name in the same folder, fsyncs, renames, fsyncs the folder. Throws
/// OutputError naming path and cause; the temporary file is removed then.
void writeFileAtomically(const std::filesystem::path& path, std::span<const std::byte> bytes);
void writeFileAtomically(const std::filesystem::path& path, std::string_view text);

/// $XDG_CACHE_HOME/catoptric or ~/.cache/catoptric; created when missing. Empty when neither can
/// be had: caches are then not used.
std::filesystem::path cacheFolder();

}  // namespace catoptric
