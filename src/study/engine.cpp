#include "study/engine.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/error.h"
#include "core/random.h"

namespace catoptric::study {
namespace {

/// In which order the settings have their turns at a frame: a shuffle of its own for two rounds,
/// which the second of them takes backwards, so that each is as often before another as after it.
std::vector<std::size_t> orderOf(std::size_t settings, int round, int frame, std::uint64_t seed) {
  std::vector<std::size_t> order(settings);
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::uint32_t state = mixedBits(static_cast<std::uint32_t>(seed) ^
                                  mixedBits(static_cast<std::uint32_t>((round + 1) / 2) * 65537u +
                                            static_cast<std::uint32_t>(frame)));
  for (std::size_t i = settings; i > 1; --i) {
    state = mixedBits(state);
    std::swap(order[i - 1], order[state % i]);
  }
  if (round % 2 == 0) std::reverse(order.begin(), order.end());
  return order;
}

Measurement withoutFailed(Measurement measurement) {
  std::erase_if(measurement.turns, [&](const Turn& turn) {
    return !measurement.settings[turn.setting].failure.empty();
  });
  return measurement;
}

template <class Get>
RoundTimes collect(const std::vector<Turn>& turns, std::size_t setting, const Get& get) {
  RoundTimes times;
  for (const Turn& turn : turns) {
    if (turn.setting != setting) continue;
    times.resize(std::max(times.size(), static_cast<std::size_t>(turn.round)));
    times[static_cast<std::size_t>(turn.round - 1)].push_back(get(turn.report));
  }
  return times;
}

}  // namespace

RoundTimes Measurement::times(std::size_t setting, Clock clock) const {
  return collect(turns, setting, [&](const FrameReport& report) {
    return clock == Clock::Wall ? report.seconds : report.cpuSeconds;
  });
}

RoundTimes Measurement::stepTimes(std::size_t setting, const std::string& step) const {
  return collect(turns, setting, [&](const FrameReport& report) {
    const auto found = report.steps.find(step);
    return found == report.steps.end() ? 0.0 : found->second;
  });
}

std::vector<std::string> Measurement::steps(std::size_t setting) const {
  std::map<std::string, double> sums;
  for (const Turn& turn : turns)
    if (turn.setting == setting)
      for (const auto& [step, seconds] : turn.report.steps) sums[step] += seconds;
  std::vector<std::string> names;
  for (const auto& [step, seconds] : sums) names.push_back(step);
  std::stable_sort(names.begin(), names.end(),
                   [&](const auto& a, const auto& b) { return sums[a] > sums[b]; });
  return names;
}

Measurement measureInTurns(const std::vector<Runner*>& runners, const std::vector<int>& frames,
                           const TurnOptions& options) {
  Measurement result;
  result.settings.resize(runners.size());
  const int ofRound = static_cast<int>(frames.size() * runners.size());
  int done = 0;
  double measured = 0.0;  // seconds of all settings
  const auto lasted = [&](double seconds) {
    return measured >= seconds * static_cast<double>(runners.size());
  };
  int rounds = options.repeats;
  const int mostRounds = kMostLonger * options.repeats;
  int expected = rounds;  // with those that will be added
  double clear = 0.0;     // rounds after which the result should be clear
  for (int round = 0; round <= rounds; ++round) {
    for (const int frame : frames) {
      for (const std::size_t setting : orderOf(runners.size(), round, frame, options.seed)) {
        if (options.stopRequested && options.stopRequested()) {
          result.stopped = true;
          return result;
        }
        if (options.outOfTime && options.outOfTime()) {
          std::erase_if(result.turns, [&](const Turn& turn) { return turn.round == round; });
          return withoutFailed(std::move(result));
        }
        if (options.progress) options.progress(done, (expected + 1) * ofRound);
        ++done;
        SettingResult& own = result.settings[setting];
        if (!own.failure.empty()) continue;
        const bool writes = round == 0 && !options.writeTo.empty();
        try {
          FrameReport report = runners[setting]->render(
              frame, writes ? options.writeTo[setting] : std::filesystem::path());
          if (round == 0) {
            own.written[frame] = std::move(report);
          } else {
            measured += report.seconds;
            result.turns.push_back({round, done, setting, frame, std::move(report)});
          }
        } catch (const Error& error) {
          own.failure = error.what();
        }
      }
    }
    const bool isLast = round == rounds;
    const bool decides = isLast && lasted(options.leastSeconds) && !lasted(options.mostSeconds);
    const double growth = decides && options.growth ? options.growth(result) : 1.0;
    const bool goesOn = !lasted(options.leastSeconds) || growth > 1.0;
    // By two: the second round takes the orders of the first one backwards.
    if (isLast && goesOn && rounds + 2 <= mostRounds) rounds += 2;
    const double ofSecond =
        measured > 0.0 ? round * static_cast<double>(runners.size()) / measured : 0.0;  // rounds
    if (decides) clear = round * growth;
    expected = static_cast<int>(
        std::clamp<double>(std::ceil(std::max(options.leastSeconds * ofSecond,
                                              std::min(clear, options.mostSeconds * ofSecond))),
                           rounds, mostRounds));
  }
  if (options.progress) options.progress(done, done);
  return withoutFailed(std::move(result));
}

}  // namespace catoptric::study
