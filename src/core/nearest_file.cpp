#include "core/nearest_file.h"

#include <vector>

#include "core/text.h"

namespace catoptric {

std::filesystem::path nearestFile(const std::filesystem::path& path) {
  namespace fs = std::filesystem;
  std::vector<std::string> names;
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(
           path.parent_path().empty() ? fs::path(".") : path.parent_path(), error))
    if (entry.is_regular_file(error)) names.push_back(entry.path().filename().string());
  const std::string nearest = nearestName(path.filename().string(), names);
  return nearest.empty() ? fs::path() : path.parent_path() / nearest;
}

std::string noFileText(const std::filesystem::path& path) {
  const std::filesystem::path nearest = nearestFile(path);
  return "there is no file " + path.string() +
         (nearest.empty() ? "" : " (did you mean \"" + nearest.string() + "\"?)");
}

}  // namespace catoptric
