// Removes files of an earlier run from a folder, and nothing else.
#pragma once

#include <filesystem>
#include <functional>
#include <string>

namespace catoptric {

/// Throws OutputError if `folder` is a symbolic link. Call it for subfolders of the folder that the
/// user named, because a run must not change files elsewhere.
void refuseLink(const std::filesystem::path& folder);

/// Removes the regular files below `folder` for which `ours` is true, and the folders that are
/// empty afterwards. `ours` gets the path relative to `folder`, such as "frames/frame.0001.exr". A
/// missing folder is no error. Throws OutputError, also if `folder` or a subfolder is a symbolic
/// link.
void removeFiles(const std::filesystem::path& folder,
                 const std::function<bool(const std::string& relative)>& ours);

}  // namespace catoptric
