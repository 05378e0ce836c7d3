// Reads and writes whole files. Reading has a size limit. Writing is atomic.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace catoptric {

/// Reads a regular file of at most `maxBytes`. Throws SceneError, which names the path, if the file
/// is missing, not regular, too large, or unreadable.
std::vector<std::byte> readFile(const std::filesystem::path& path,
                                std::size_t maxBytes = std::size_t{1} << 31);
std::string readTextFile(const std::filesystem::path& path,
                         std::size_t maxBytes = std::size_t{1} << 26);

/// Writes a temporary file (temporaryName()) in the same folder, calls fsync, renames the file and
/// calls fsync for the folder. On failure it removes the temporary file and throws OutputError with
/// path and cause.
void writeFileAtomically(const std::filesystem::path& path, std::span<const std::byte> bytes);
void writeFileAtomically(const std::filesystem::path& path, std::string_view text);

/// Flushes the folder's directory entries to disk (fsync). Throws OutputError. A file system
/// without this operation causes no error.
void syncFolder(const std::filesystem::path& folder);

/// Identifies the boot of the machine and the PID namespace (a container has its own) within which
/// PIDs are unique. 8 hexadecimal digits.
std::string processSpace();

/// ".NAME.PID@SPACE.ENDING.tmp" in the folder of `path`; `ending` has 6 characters.
std::filesystem::path temporaryName(const std::filesystem::path& path, std::string_view ending);

/// Removes the temporary files that terminated processes left in `folder` (writeFileAtomically()),
/// including those of an earlier process that had this process's PID. Files of other machines are
/// removed when they are an hour old, because their processes cannot be checked. Other files stay.
/// Call this before writing to the folder. Returns the number of removed files. Throws OutputError
/// if a file cannot be removed.
int sweepTemporaryFiles(const std::filesystem::path& folder);

/// The folder $CATOPTRIC_CACHE, $XDG_CACHE_HOME/catoptric or ~/.cache/catoptric; created if
/// missing. Empty if none can be used: there is then no caching.
std::filesystem::path cacheFolder();

}  // namespace catoptric
