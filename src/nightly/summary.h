// How many of a night's cases are bad, and what is to be known of the others.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "nightly/facts.h"

namespace catoptric::nightly {

/// Bad verdicts that were accepted (`nightly accept`) count as skipped.
Outcome outcomeOf(const Verdict& verdict);

/// The number of cases, each counted once, by its worst verdict.
struct Summary {
  int cases = 0;
  int regressions = 0;
  int crashes = 0;
  int skipped = 0;                           ///< neither bad nor good
  std::map<std::string, int> skippedByKind;  ///< "new", "undecided", ...
  std::vector<std::string> changedSettings;  ///< their names
  int toAccept = 0;                          ///< frames that are new, changed or improved

  /// Numbers, and the names in `changedSettings`.
  std::string text() const;
};
Summary summaryOf(const std::vector<Verdict>& verdicts);

}  // namespace catoptric::nightly
