// A suite of nightly cases: scenes by methods, with what they may differ by.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "nightly/gates.h"
#include "study/suite_run.h"

namespace catoptric::nightly {

/// Its `against` is the method whose frames are the truth.
struct NightScene : study::StatedRun {
  std::vector<std::string> tags;
};

struct NightSuite {
  std::string file;  ///< as it was named
  std::string name;  ///< the file's name without its ending
  std::string title;
  std::vector<NightScene> scenes;
  Gates gates;
};

/// Throws UsageError with the place of what is wrong.
NightSuite readNightSuite(const std::filesystem::path& file);

/// One scene by one method.
struct NightCase {
  std::string name;  ///< suite.scene.method
  NightScene scene;
  std::string method;
  std::string frames;  ///< of the effort
};

}  // namespace catoptric::nightly
