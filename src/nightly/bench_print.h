// Identifies what a case measures, from its files alone. A program with other defaults, or one that
// builds the scene in another way, has the same identity; the change then shows in times and
// pictures.
#pragma once

#include <filesystem>
#include <string>

#include "nightly/night_suite.h"

namespace catoptric::nightly {

/// The fingerprint of a file and, if it is JSON, of all files that it names.
std::string filesPrint(const std::filesystem::path& file);

/// The case's config and settings, one line per value.
std::string describeCase(const NightCase& one);

/// The lines of a description that say which scene was rendered, along which path.
std::string sceneLinesOf(const std::string& description);

/// The lines in which two descriptions differ: "image.width 256 -> 512, ...".
std::string differenceOf(const std::string& before, const std::string& after);

}  // namespace catoptric::nightly
