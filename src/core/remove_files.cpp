#include "core/remove_files.h"

#include <vector>

#include "core/error.h"

namespace catoptric {

namespace fs = std::filesystem;

void refuseLink(const fs::path& folder) {
  std::error_code ignored;
  if (fs::is_symlink(folder, ignored))
    throw OutputError(folder.string() +
                      ": is a symbolic link; files behind it are not changed: remove it");
}

void removeFiles(const fs::path& folder,
                 const std::function<bool(const std::string& relative)>& ours) {
  refuseLink(folder);
  try {
    if (!fs::is_directory(folder)) return;
    std::vector<fs::path> files;
    std::vector<fs::path> folders{folder};
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder)) {
      if (entry.is_directory()) {
        refuseLink(entry.path());
        folders.push_back(entry.path());
      } else if (entry.is_regular_file() && !entry.is_symlink() &&
                 ours(entry.path().lexically_relative(folder).generic_string())) {
        files.push_back(entry.path());
      }
    }
    for (const fs::path& file : files) fs::remove(file);
    for (auto at = folders.rbegin(); at != folders.rend(); ++at)
      if (fs::is_empty(*at)) fs::remove(*at);
  } catch (const fs::filesystem_error& failure) {
    throw OutputError(failure.what());
  }
}

}  // namespace catoptric
