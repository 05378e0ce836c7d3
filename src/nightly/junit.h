// Verdicts as JUnit XML, which CI servers display.
#pragma once

#include <string>
#include <vector>

#include "nightly/facts.h"

namespace catoptric::nightly {

/// One test case per case and kind of verdict. Its class is the suite, scene and method.
std::string junitXml(const Night& night, const std::vector<Verdict>& verdicts);

/// Removes characters that XML 1.0 does not allow and escapes the others as needed.
std::string xmlSafe(const std::string& text);

}  // namespace catoptric::nightly
