// A run as suites describe it, for tables and for nightly runs.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "config/json.h"
#include "study/axes.h"

namespace catoptric::study {

/// A config with settings, methods and frames.
struct StatedRun {
  std::string name;
  std::filesystem::path config;
  Settings settings;
  std::vector<std::string> methods;           ///< empty: all methods of the config
  std::map<std::string, std::string> frames;  ///< by effort: smoke, quick, full
  std::string against;  ///< method of the reference frames for errors; empty: none
};

/// The schema of a run: the fields of StatedRun, and `more`.
config::Schema runSchemaOfSuite(std::vector<config::Field> more);
/// Text of a JSON Schema of suites: of `suite`, whose member `runs` has values of the schema `run`.
std::string jsonSchemaOfSuite(const config::Schema& suite, const std::string& runs,
                              const config::Schema& run);

/// `value` has been checked against the schema. Its file names are relative to `folder`.
StatedRun readRunOfSuite(const std::string& name, const config::Value& value,
                         const std::filesystem::path& folder);

/// The settings of a run or of an effort. File names are relative to the suite, as in a config.
Settings readSettings(const config::Value& value, const std::filesystem::path& folder);

/// The strings of an array; empty for null.
std::vector<std::string> stringsOf(const config::Value& array);

}  // namespace catoptric::study
