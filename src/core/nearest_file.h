// Names a file that may have been meant, for messages about missing files.
#pragma once

#include <filesystem>
#include <string>

namespace catoptric {

/// The file whose name is nearest to that of the missing `path`, in the same folder; empty: none.
std::filesystem::path nearestFile(const std::filesystem::path& path);

/// "there is no file PATH", and the nearest one.
std::string noFileText(const std::filesystem::path& path);

}  // namespace catoptric
