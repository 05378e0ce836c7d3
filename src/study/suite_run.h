// A run as suites state it, those of tables and those of nights.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "config/json.h"
#include "study/axes.h"

namespace catoptric::study {

/// A config with settings, some methods, some frames.
struct StatedRun {
  std::string name;
  std::filesystem::path config;
  Settings settings;
  std::vector<std::string> methods;           ///< empty: all of the config
  std::map<std::string, std::string> frames;  ///< by effort: smoke, quick, full
  std::string against;                        ///< method that errors are against; empty: none
};

/// The schema of a run with these fields and `more`.
config::Schema runSchemaOfSuite(std::vector<config::Field> more);

/// `value` is checked against the schema already; its files are relative to `folder`.
StatedRun readRunOfSuite(const std::string& name, const config::Value& value,
                         const std::filesystem::path& folder);

/// Settings of a run or of an effort. Files are relative to the suite, as in a config.
Settings readSettings(const config::Value& value, const std::filesystem::path& folder);

/// An array of strings; null: none.
std::vector<std::string> stringsOf(const config::Value& array);

}  // namespace catoptric::study
