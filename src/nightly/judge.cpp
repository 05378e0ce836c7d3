#include "nightly/judge.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "report/table.h"

namespace catoptric::nightly {
namespace {

/// An error against the truth that is smaller by less is no improvement. Ours.
constexpr double kImprovement = 0.02;

const Timing* timingOf(const CaseFacts& facts, const std::string& ofRole, int attempt) {
  for (const Timing& timing : facts.timings)
    if (timing.role == ofRole && timing.attempt == attempt) return &timing;
  return nullptr;
}

/// Logarithm of how much longer each round took than the gate allows: the median of its frames.
void addExcess(std::vector<double>& excess, const study::RoundTimes& times,
               const study::RoundTimes& base, double gate) {
  for (std::size_t r = 0; r < times.size(); ++r) {
    std::vector<double> ratios;
    for (std::size_t f = 0; f < times[r].size(); ++f)
      ratios.push_back(std::log(times[r][f] / base[r][f]));
    excess.push_back(study::median(ratios) - std::log1p(gate));
  }
}

bool comparable(const Timing* times, const Timing* base) {
  return times != nullptr && base != nullptr && !times->times.empty() &&
         times->times.size() == base->times.size() &&
         times->times[0].size() == base->times[0].size() && !times->times[0].empty();
}

}  // namespace

TimeState stateOf(const study::Ratio& ratio, double gate) {
  if (!ratio.interval) return TimeState::Undecided;
  if (ratio.interval->low > 1.0 + gate) return TimeState::Fails;
  return ratio.interval->high < 1.0 + gate ? TimeState::Holds : TimeState::Undecided;
}

std::optional<TimeRatio> timeRatio(const CaseFacts& facts, const char* ofRole, int attempt,
                                   double gate) {
  const Timing* times = timingOf(facts, role::kTonight, attempt);
  const Timing* base = timingOf(facts, ofRole, attempt);
  if (!comparable(times, base)) return {};
  TimeRatio result{study::pairedRatio(times->times, base->times), TimeState::Undecided, 1.0};
  result.state = stateOf(result.ratio, gate);
  std::vector<double> excess;
  addExcess(excess, times->times, base->times, gate);
  result.p = signedRankP(excess);
  return result;
}

std::optional<TimeRatio> confirmedRatio(const CaseFacts& facts, const char* ofRole, double gate) {
  std::optional<TimeRatio> first = timeRatio(facts, ofRole, 1, gate);
  if (!first || first->state != TimeState::Fails) return first;
  const std::optional<TimeRatio> second = timeRatio(facts, ofRole, 2, gate);
  if (!second) {
    first->state = TimeState::Undecided;
    return first;
  }
  // The larger of the two says what can be relied on: the one nearer to the gate
  TimeRatio result = second->ratio.value < first->ratio.value ? *second : *first;
  result.state = second->state;
  std::vector<double> excess;
  for (const int attempt : {1, 2})
    addExcess(excess, timingOf(facts, role::kTonight, attempt)->times,
              timingOf(facts, ofRole, attempt)->times, gate);
  result.p = signedRankP(excess);
  return result;
}

double signedRankP(const std::vector<double>& values) {
  std::vector<double> sizes;
  for (const double value : values)
    if (value != 0.0) sizes.push_back(value);
  const std::size_t count = sizes.size();
  if (count == 0) return 1.0;
  std::sort(sizes.begin(), sizes.end(),
            [](double a, double b) { return std::abs(a) < std::abs(b); });
  std::size_t positive = 0;
  for (std::size_t i = 0; i < count; ++i)
    if (sizes[i] > 0.0) positive += i + 1;
  // Of all choices of signs, the share whose positive ranks add up to at least as much
  const std::vector<double> share = study::signedRankShares(count);
  return std::accumulate(share.begin() + static_cast<std::ptrdiff_t>(positive), share.end(), 0.0);
}

std::vector<bool> falseDiscoveries(const std::vector<double>& p, double share) {
  std::vector<std::size_t> order(p.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return p[a] < p[b]; });
  std::size_t positive = 0;
  for (std::size_t i = 0; i < order.size(); ++i)
    if (p[order[i]] <= share * static_cast<double>(i + 1) / static_cast<double>(p.size()))
      positive = i + 1;
  std::vector<bool> called(p.size(), false);
  for (std::size_t i = 0; i < positive; ++i) called[order[i]] = true;
  return called;
}

std::vector<std::size_t> changePoints(const std::vector<double>& values, double penalty) {
  const std::size_t count = values.size();
  const double none = std::numeric_limits<double>::infinity();
  // cost[e]: the least for the first e values; from[e]: where its last level begins
  std::vector<double> cost(count + 1, none);
  std::vector<std::size_t> from(count + 1, 0);
  cost[0] = -penalty;
  for (std::size_t end = 1; end <= count; ++end) {
    std::vector<double> level;
    for (std::size_t begin = end; begin-- > 0;) {
      level.push_back(values[begin]);
      const double middle = study::median(level);
      double sum = cost[begin] + penalty;
      for (const double value : level) sum += std::abs(value - middle);
      if (sum >= cost[end]) continue;
      cost[end] = sum;
      from[end] = begin;
    }
  }
  std::vector<std::size_t> changes;
  for (std::size_t end = count; end > 0 && from[end] > 0; end = from[end])
    changes.insert(changes.begin(), from[end]);
  return changes;
}

PictureState judgePicture(const PictureErrors& errors, const Gates& gates,
                          const std::optional<std::pair<double, double>>& truth) {
  PictureState state{"within", "", 0.0};
  double most = 1.0;
  for (const auto& [name, limit] : gates.picture) {
    const auto found = errors.find(name);
    if (found == errors.end()) continue;
    const double excess = limit > 0.0 ? found->second / limit : found->second > 0.0 ? 1e9 : 0.0;
    if (excess <= 1.0) continue;
    state.status = "changed";
    state.message += (state.message.empty() ? "" : ", ") + name + " " +
                     report::fixedText(found->second, 3) + " (limit " +
                     report::fixedText(limit, 3) + ")";
    if (excess > most) {
      most = excess;
      state.value = found->second;
    }
  }
  if (truth && state.status == "changed") {
    state.message += "; L1_8bit against the reference " + report::fixedText(truth->second, 3) +
                     " -> " + report::fixedText(truth->first, 3);
    if (truth->first < truth->second * (1.0 - kImprovement)) state.status = "improved";
  }
  return state;
}

std::vector<std::string> worseCounters(const std::map<std::string, std::uint64_t>& now,
                                       const std::map<std::string, std::uint64_t>& accepted,
                                       const std::vector<std::string>& mustBeZero,
                                       const Gates& gates) {
  std::vector<std::string> worse;
  const auto contains = [](const std::vector<std::string>& names, const std::string& name) {
    return std::find(names.begin(), names.end(), name) != names.end();
  };
  for (const auto& [name, count] : now) {
    const auto found = accepted.find(name);
    const std::uint64_t before = found == accepted.end() ? 0 : found->second;
    if (count <= before) continue;
    if (contains(mustBeZero, name))
      worse.push_back(name + " must be 0 and is " + std::to_string(count) +
                      (before > 0 ? ", " + std::to_string(before) + " were accepted" : ""));
    else if (contains(gates.watch, name) && found != accepted.end() &&
             static_cast<double>(count) > (1.0 + gates.watchRise) * static_cast<double>(before))
      worse.push_back(name + " rose from " + std::to_string(before) + " to " +
                      std::to_string(count));
  }
  return worse;
}

}  // namespace catoptric::nightly
