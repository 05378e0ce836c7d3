// Acceptance by people: they confirm that a changed picture or a longer time is intended.
#pragma once

#include <string>
#include <vector>

#include "nightly/history.h"

namespace catoptric::nightly {

struct AcceptRequest {
  std::vector<std::string> patterns;  ///< CASE or CASE:FRAME; * matches any characters
  std::string reason;
  std::string who;
};

struct Accepted {
  int acknowledgement = 0;
  int frames = 0;
  int times = 0;
};

/// Whether a person must accept this verdict.
bool wantsAcceptance(const Verdict& verdict);

/// Accepts the verdicts of the newest judged night on the selected cases. Their frames become the
/// accepted ones, and slower builds become the baseline for times. Throws UsageError, and accepts
/// nothing, if a pattern matches nothing that needs acceptance, or if a frame contains NaN.
Accepted acceptVerdicts(History& history, const AcceptRequest& request);

}  // namespace catoptric::nightly
