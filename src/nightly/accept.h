// What people decide: a new picture, a longer time is as it should be.
#pragma once

#include <string>
#include <vector>

#include "nightly/history.h"

namespace catoptric::nightly {

struct AcceptRequest {
  std::vector<std::string> patterns;  ///< CASE, CASE:FRAME; * stands for anything
  std::string reason;
  std::string who;
};

struct Accepted {
  int acknowledgement = 0;
  int frames = 0;
  int times = 0;
};

/// Does somebody have to say that this is as it should be?
bool wantsAcceptance(const Verdict& verdict);

/// Accepts what the newest judged night says of the cases: their frames become the accepted ones,
/// and builds that are slower become what times are compared with. Throws UsageError when a pattern
/// names nothing that wants it, or a frame is NaN; nothing is accepted then.
Accepted acceptVerdicts(History& history, const AcceptRequest& request);

}  // namespace catoptric::nightly
