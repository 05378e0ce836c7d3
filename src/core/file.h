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

/// Writes to a temporaryName() in the same folder, fsyncs, renames, fsyncs the folder. Throws
/// OutputError naming path and cause; the temporary file is removed then.
void writeFileAtomically(const std::filesystem::path& path, std::span<const std::byte> bytes);
void writeFileAtomically(const std::filesystem::path& path, std::string_view text);

/// Makes names that were added to or removed from a folder last. Throws OutputError; a file system
/// that has no such operation is no error.
void syncFolder(const std::filesystem::path& folder);

/// Among which processes numbers of processes say who is meant: a start of a machine, and there a
/// namespace of numbers (a container has its own). 8 hexadecimal digits.
std::string processSpace();

/// ".NAME.PID@SPACE.ENDING.tmp" beside `path`; `ending` has 6 characters.
std::filesystem::path temporaryName(const std::filesystem::path& path, std::string_view ending);

/// Removes the temporary files that writeFileAtomically() of dead processes (and of an earlier
/// process with this one's number) has left in `folder`; no others. Those of other machines, of
/// whose processes nothing is known here, go when they are an hour old. Call before writing there.
/// Returns how many. Throws OutputError when one cannot be removed.
int sweepTemporaryFiles(const std::filesystem::path& folder);

/// $CATOPTRIC_CACHE, $XDG_CACHE_HOME/catoptric or ~/.cache/catoptric; created when missing. Empty
/// when none can be had: caches are then not used.
std::filesystem::path cacheFolder();

}  // namespace catoptric
