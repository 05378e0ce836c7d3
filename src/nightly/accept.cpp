#include "nightly/accept.h"

#include <algorithm>
#include <charconv>
#include <map>
#include <set>

#include "core/error.h"
#include "core/text.h"
#include "nightly/night.h"
#include "nightly/pictures.h"

namespace catoptric::nightly {
namespace {

struct Pattern {
  std::string name;
  int frame = 0;  ///< 0: all
};

Pattern parsePattern(const std::string& text) {
  const std::size_t colon = text.rfind(':');
  if (colon == std::string::npos) return {text, 0};
  Pattern pattern{text.substr(0, colon), 0};
  const char* end = text.data() + text.size();
  const auto [stopped, error] = std::from_chars(text.data() + colon + 1, end, pattern.frame);
  if (error != std::errc() || stopped != end || pattern.frame <= 0)
    throw UsageError("\"" + text + "\": a frame number must follow the colon");
  return pattern;
}

/// The newest night that was judged.
Night judgedNight(const History& history) {
  for (const Night& night : history.nights("", 100))
    if (!night.finished.empty()) return night;
  throw UsageError("no night was judged yet; `catoptric nightly SUITE` makes one");
}

/// What of a case is accepted; empty kinds: nothing.
History::Acceptance acceptanceOf(const History& history, const Night& night,
                                 const std::vector<Verdict>& verdicts, const Pattern& pattern,
                                 const std::string& name) {
  const CaseFacts facts = history.result(night.id, name);
  History::Acceptance accepted{name, facts.bench, {}, {}, {}, pattern.frame};
  bool frames = false;
  for (const Verdict& verdict : verdicts) {
    if (verdict.name != name || !wantsAcceptance(verdict)) continue;
    const bool ofFrame = verdict.kind == "picture" || verdict.kind == "counter";
    if (pattern.frame != 0 && (!ofFrame || verdict.frame != pattern.frame)) continue;
    accepted.kinds.push_back(verdict.kind);
    frames = frames || ofFrame || verdict.kind == "disk" || verdict.kind == "flicker" ||
             verdict.kind == "scene";
    // What takes longer, or more memory, is what the next nights are compared with
    if (verdict.kind == "time" || verdict.kind == "creep" || verdict.kind == "memory")
      accepted.baselines = {{role::kAccepted, night.build, night.id},
                            {role::kAnchor, night.build, night.id}};
  }
  if (!frames) return accepted;
  const std::map<int, Reference> before = history.references(name, facts.bench);
  for (const auto& [number, frame] : facts.frames) {
    if (pattern.frame != 0 && number != pattern.frame) continue;
    if (frame.notFinite > 0) continue;
    Reference reference{number, frame.pixels, "", frame.counters, frame.bytes, night.id};
    const auto known = before.find(number);
    if (!frame.file.empty())
      reference.object = storeFrame(history, history.folder() / frame.file);
    else if (known != before.end())
      reference.object = known->second.object;
    accepted.references.push_back(std::move(reference));
  }
  return accepted;
}

}  // namespace

bool wantsAcceptance(const Verdict& verdict) {
  if (verdict.acknowledgement != 0 || verdict.outcome == Outcome::Good) return false;
  if (verdict.kind == "picture") return verdict.status != "not finite";
  return verdict.status == "slower" || verdict.status == "creeps" ||
         ((verdict.kind == "counter" || verdict.kind == "disk" || verdict.kind == "memory" ||
           verdict.kind == "flicker" || verdict.kind == "scene") &&
          verdict.outcome == Outcome::Regression);
}

Accepted acceptVerdicts(History& history, const AcceptRequest& request) {
  if (request.reason.find_first_not_of(" \t\r\n") == std::string::npos)
    throw UsageError("accepting needs a reason: --reason TEXT");
  const Night night = judgedNight(history);
  const std::vector<Verdict> verdicts = history.verdicts(night.id);
  const std::set<std::string> names = history.measured(night.id);
  std::vector<History::Acceptance> accepted;
  std::set<std::pair<std::string, int>> frames;
  std::set<std::string> times;
  for (const std::string& text : request.patterns) {
    const Pattern pattern = parsePattern(text);
    bool known = false;
    bool any = false;
    for (const std::string& name : names) {
      if (!matchesPattern(name, pattern.name) &&
          !matchesPattern(name, night.suite + "." + pattern.name))
        continue;
      known = true;
      History::Acceptance one = acceptanceOf(history, night, verdicts, pattern, name);
      if (one.kinds.empty()) continue;
      any = true;
      for (const Reference& reference : one.references) frames.insert({name, reference.frame});
      if (!one.baselines.empty()) times.insert(name);
      accepted.push_back(std::move(one));
    }
    if (!known)
      throw UsageError(
          "\"" + pattern.name + "\" is not a case of night " + std::to_string(night.id) +
          didYouMean(pattern.name, std::vector<std::string>(names.begin(), names.end())) +
          "; `catoptric nightly log` lists the cases that wait for acceptance");
    if (!any)
      throw UsageError("\"" + text + "\": nothing in night " + std::to_string(night.id) +
                       " waits for acceptance; crashes and NaN cannot be accepted");
  }
  const int number =
      history.accept({0, utcNow(), request.who, joined(request.patterns, " "), request.reason, ""},
                     night.id, accepted);
  return {number, static_cast<int>(frames.size()), static_cast<int>(times.size())};
}

}  // namespace catoptric::nightly
