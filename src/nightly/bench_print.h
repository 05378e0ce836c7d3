// What a case measures, as its files say it: a program with other defaults, or one that makes the
// same scene otherwise, has the same bench, and what it changes is seen in times and pictures.
#pragma once

#include <filesystem>
#include <string>

#include "nightly/night_suite.h"

namespace catoptric::nightly {

/// Fingerprint of a file and of all files that it names, if it is JSON.
std::string filesPrint(const std::filesystem::path& file);

/// The case's config and settings, a line for each value.
std::string describeCase(const NightCase& one);

/// Lines that only one of two descriptions has: "image.width 256 -> 512, ...".
std::string differenceOf(const std::string& before, const std::string& after);

}  // namespace catoptric::nightly
