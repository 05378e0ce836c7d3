// A suite of nightly cases: scenes, methods, and the limits of their differences.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "nightly/gates.h"
#include "study/suite_run.h"

namespace catoptric::nightly {

/// A scene. `against` names the method of the reference frames.
struct NightScene : study::StatedRun {
  std::vector<std::string> tags;
};

struct NightSuite {
  std::string file;  ///< as named by the user
  std::string name;  ///< file name without its extension
  std::string title;
  std::vector<NightScene> scenes;
  Gates gates;
};

/// Text of a JSON Schema of suites.
std::string suiteJsonSchema();
/// Throws UsageError with the place of the error.
NightSuite readNightSuite(const std::filesystem::path& file);

/// One scene with one method.
struct NightCase {
  std::string name;  ///< suite.scene.method
  NightScene scene;
  std::string method;
  std::string frames;  ///< the frames of the effort
};

}  // namespace catoptric::nightly
