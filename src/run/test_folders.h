// Folders for tests.
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <map>
#include <string>

#include "core/file.h"

namespace catoptric::run {

namespace fs = std::filesystem;

/// A path with the name of the current test, at which nothing exists yet.
inline fs::path freshFolder() {
  const auto* info = testing::UnitTest::GetInstance()->current_test_info();
  const fs::path path =
      fs::path(testing::TempDir()) / (std::string(info->test_suite_name()) + "_" + info->name());
  fs::remove_all(path);
  return path;
}

/// The contents of a run's frame files, by file name.
inline std::map<std::string, std::string> filesOf(const fs::path& path) {
  std::map<std::string, std::string> files;
  for (const auto& entry : fs::directory_iterator(path / "frames"))
    files[entry.path().filename().string()] = readTextFile(entry.path());
  return files;
}

}  // namespace catoptric::run
