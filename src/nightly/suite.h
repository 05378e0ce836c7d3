// A suite of nightly cases: scenes by methods, with what they may differ by.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "nightly/gates.h"

namespace catoptric::nightly {

struct NightScene {
  std::string name;
  std::filesystem::path config;
  std::vector<std::pair<std::string, std::string>> settings;  ///< as for --set
  std::vector<std::string> methods;                           ///< empty: all of the config
  std::map<std::string, std::string> frames;                  ///< by effort
  std::string against;  ///< method whose frames are the truth; empty: none
  std::vector<std::string> tags;
};

struct NightSuite {
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
