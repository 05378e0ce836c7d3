// Verdicts as JUnit's XML, which CI servers show.
#pragma once

#include <string>
#include <vector>

#include "nightly/facts.h"

namespace catoptric::nightly {

/// A test case for each case and kind of verdict; its class is the suite, scene and method.
std::string junitXml(const Night& night, const std::vector<Verdict>& verdicts);

/// Characters that XML 1.0 does not have are left out, others are written as it wants them.
std::string xmlSafe(const std::string& text);

}  // namespace catoptric::nightly
