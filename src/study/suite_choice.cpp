// Which method of a run to take: cells front(...) and take(...).
#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "study/suite.h"

namespace catoptric::study {

using config::Value;

/// Flicker may be so many times as large as the error: it is of reflective pixels alone. Ours.
constexpr double kMoreFlicker = 4.0;

std::vector<const SuiteData::Entry*> SuiteData::measuredOf(const std::string& name,
                                                           const Value& cell) const {
  const auto run = runs.find(name.substr(0, name.find('.')));
  if (run == runs.end()) cell.fail("\"" + name + "\" is not a run of this suite");
  std::vector<const Entry*> measured;
  for (const auto& [method, entry] : run->second)
    if (entry.samples != nullptr) measured.push_back(&entry);
  return measured;
}

/// "front(RUN.METHOD, frame)" or "(..., reflection)": the method's mark among all of the run.
SuiteData::Stored SuiteData::front(const std::vector<std::string>& arguments,
                                   const Value& cell) const {
  if (arguments.size() != 2 || (arguments[1] != "frame" && arguments[1] != "reflection"))
    cell.fail("front takes RUN.METHOD, and frame or reflection");
  const TimeKind kind{Clock::Wall,
                      arguments[1] == "frame" ? TimeKind::Of::Steady : TimeKind::Of::Reflection};
  const Entry& one = entry(arguments[0], cell);
  if (one.samples == nullptr) return {"", NAN};
  std::vector<const Entry*> all{&one};
  for (const Entry* other : measuredOf(arguments[0], cell))
    if (other != &one) all.push_back(other);
  std::vector<double> errors;
  for (const Entry* each : all) errors.push_back(each->errors.pooled(kChoiceMetric, each->frames));
  const Judged judged = judge(errors, 0.0, [&](std::size_t a, std::size_t b) {
                          // The mark of the first alone is asked for
                          if (b != 0) return Ratio{2.0, Interval{2.0, 2.0}};
                          return ratioOf(*all[a], *all[b], kind);
                        }).front();
  return {markName(judged.mark), judged.mark == Mark::Front ? 1.0 : 0.0};
}

/// "take(RUN.*, MOST)": the fastest method by whole frames whose error is at most MOST and whose
/// flicker is at most kMoreFlicker * MOST, if it is faster than the run's reference with
/// confidence; otherwise the reference.
SuiteData::Stored SuiteData::take(const std::vector<std::string>& arguments,
                                  const Value& cell) const {
  const double most = arguments.size() == 2 ? std::atof(arguments[1].c_str()) : 0.0;
  if (!(most > 0.0)) cell.fail("take takes RUN.* and the largest error");
  const std::vector<const Entry*> all = measuredOf(arguments[0], cell);
  const auto base =
      std::ranges::find_if(all, [](const Entry* one) { return one->setting.key == one->base; });
  if (base == all.end()) return {"", NAN};
  const Entry* best = *base;
  double least = 1.0;
  for (const Entry* one : all) {
    const double error = one->errors.pooled(kChoiceMetric, one->frames);
    const double flicker = one->errors.pooled(kFlicker, one->frames);
    if (one == *base || !(error <= most) || flicker > kMoreFlicker * most) continue;
    const Ratio ratio = ratioOf(*one, **base);
    if (verdictOf(ratio) != TimeVerdict::Faster || ratio.value >= least) continue;
    best = one;
    least = ratio.value;
  }
  const std::string& name = best->setting.point.method;
  if (best == *base) return {name, 1.0};
  const Ratio reflection = ratioOf(*best, **base, {Clock::Wall, TimeKind::Of::Reflection});
  return {name + " " + report::fixedText(least, 2) + " / " + report::fixedText(reflection.value, 2),
          least};
}

}  // namespace catoptric::study
