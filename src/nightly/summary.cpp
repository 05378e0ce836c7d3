#include "nightly/summary.h"

#include <algorithm>
#include <array>

#include "core/text.h"

namespace catoptric::nightly {
namespace {

/// Kinds of cases that are neither bad nor good. A case counts as the first kind that it has.
constexpr std::array kSkippedKinds = {"changed settings", "removed",  "accepted", "new",
                                      "improved",         "undecided"};

std::string skippedKind(const Verdict& verdict) {
  if (verdict.acknowledgement != 0) return "accepted";
  if (verdict.status == kChangedSetting) return "changed settings";
  if (verdict.status == "new" || verdict.status == "removed" || verdict.status == "improved")
    return verdict.status;
  return "undecided";  // its times
}

}  // namespace

Outcome outcomeOf(const Verdict& verdict) {
  return verdict.acknowledgement != 0 && verdict.outcome != Outcome::Good ? Outcome::Skipped
                                                                          : verdict.outcome;
}

std::string Summary::text() const {
  std::string all = std::to_string(cases) + " cases: " + std::to_string(regressions) +
                    " regressions, " + std::to_string(crashes) + " crashes";
  for (const auto& [kind, count] : skippedByKind) all += ", " + std::to_string(count) + " " + kind;
  all += "; " + std::to_string(toAccept) + " frames wait for acceptance";
  if (!changedSettings.empty()) all += "; changed settings: " + joined(changedSettings, ", ");
  return all;
}

Summary summaryOf(const std::vector<Verdict>& verdicts) {
  Summary summary;
  std::map<std::string, std::vector<const Verdict*>> byCase;
  for (const Verdict& verdict : verdicts) {
    byCase[verdict.name].push_back(&verdict);
    if (verdict.status == kChangedSetting) summary.changedSettings.push_back(verdict.name);
    if (verdict.kind == "picture" && verdict.acknowledgement == 0 &&
        (verdict.status == "new" || verdict.status == "changed" || verdict.status == "improved"))
      ++summary.toAccept;
  }
  summary.cases = static_cast<int>(byCase.size());
  for (const auto& [name, own] : byCase) {
    Outcome worst = Outcome::Good;
    std::size_t kind = kSkippedKinds.size();
    for (const Verdict* verdict : own) {
      const Outcome outcome = outcomeOf(*verdict);
      worst = std::max(worst, outcome);
      if (outcome != Outcome::Skipped) continue;
      const auto at = std::ranges::find(kSkippedKinds, skippedKind(*verdict));
      kind = std::min(kind, static_cast<std::size_t>(at - kSkippedKinds.begin()));
    }
    summary.regressions += worst == Outcome::Regression ? 1 : 0;
    summary.crashes += worst == Outcome::Crash ? 1 : 0;
    if (worst != Outcome::Skipped) continue;
    ++summary.skipped;
    ++summary.skippedByKind[kSkippedKinds[kind]];
  }
  return summary;
}

}  // namespace catoptric::nightly
