#include "study/engine.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "core/error.h"
#include "core/input_files.h"
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

/// How wide the interval of a clear ratio may be (high / low - 1); ours.
constexpr double kWide = 0.04;

/// Steps of a frame by any method.
constexpr std::array kShared{"geometry", "gbuffer", "composite", "layers"};

Measurement withoutFailed(Measurement measurement) {
  std::erase_if(measurement.turns, [&](const Turn& turn) {
    return !measurement.settings[turn.setting].failure.empty();
  });
  return measurement;
}

double secondsOf(const FrameReport& report, Clock clock) {
  return clock == Clock::Wall ? report.seconds : report.cpuSeconds;
}

template <class Get>
RoundTimes collect(const std::vector<Turn>& turns, std::size_t setting, bool first,
                   const Get& get) {
  RoundTimes times;
  for (const Turn& turn : turns) {
    if (turn.setting != setting || (turn.frame == kFirst) != first || turn.round == 0) continue;
    times.resize(std::max(times.size(), static_cast<std::size_t>(turn.round)));
    times[static_cast<std::size_t>(turn.round - 1)].push_back(get(turn.report));
  }
  return times;
}

}  // namespace

std::string timeName(const TimeKind& kind) {
  if (kind.of == TimeKind::Of::Mean)
    return "mean of " + std::to_string(kind.amortize) + (kind.amortize == 1 ? " frame" : " frames");
  if (kind.of == TimeKind::Of::Reflection) return "reflection alone";
  return kind.of == TimeKind::Of::First ? "first frame" : "steady frame";
}

RoundTimes Measurement::times(std::size_t setting, const TimeKind& kind) const {
  const auto get = [&](const FrameReport& report) { return secondsOf(report, kind.clock); };
  RoundTimes steady = collect(turns, setting, false, get);
  if (kind.of == TimeKind::Of::Steady) return steady;
  if (kind.of == TimeKind::Of::Reflection)
    return collect(turns, setting, false, [](const FrameReport& report) {
      double seconds = report.seconds;
      for (const char* step : kShared)
        if (const auto found = report.steps.find(step); found != report.steps.end())
          seconds -= found->second;
      return seconds;
    });
  RoundTimes first = collect(turns, setting, true, get);
  if (kind.of == TimeKind::Of::First || first.empty() || kind.amortize == 1) return first;
  const double frames = kind.amortize;
  for (std::size_t round = 0; round < first.size(); ++round) {
    const auto count = static_cast<double>(steady[round].size());
    first[round].front() *= (count + 1.0) / frames;
    for (const double seconds : steady[round])
      first[round].push_back(seconds * (count + 1.0) / count * (frames - 1.0) / frames);
  }
  return first;
}

double Measurement::seconds(std::size_t setting, const TimeKind& kind) const {
  if (const RoundTimes all = times(setting, kind); !all.empty()) return frameSeconds(all).mean;
  const auto once = std::ranges::find_if(
      turns, [&](const Turn& turn) { return turn.setting == setting && turn.frame == kFirst; });
  if (once == turns.end()) return 0.0;
  const double first = secondsOf(once->report, kind.clock);
  if (kind.of == TimeKind::Of::First) return first;
  const double steady = frameSeconds(times(setting, {kind.clock})).mean;
  return (first + (kind.amortize - 1) * steady) / kind.amortize;
}

std::uint64_t Measurement::memoryBytes(std::size_t setting) const {
  std::uint64_t most = 0;
  for (const Turn& turn : turns)
    if (turn.setting == setting) most = std::max(most, turn.report.memoryBytes);
  return most;
}

RoundTimes Measurement::stepTimes(std::size_t setting, const std::string& step) const {
  return collect(turns, setting, false, [&](const FrameReport& report) {
    const auto found = report.steps.find(step);
    return found == report.steps.end() ? 0.0 : found->second;
  });
}

std::vector<std::string> Measurement::steps(std::size_t setting) const {
  std::map<std::string, double> sums;
  for (const Turn& turn : turns)
    if (turn.setting == setting && turn.frame != kFirst)
      for (const auto& [step, seconds] : turn.report.steps) sums[step] += seconds;
  std::vector<std::string> names;
  for (const auto& [step, seconds] : sums) names.push_back(step);
  std::stable_sort(names.begin(), names.end(),
                   [&](const auto& a, const auto& b) { return sums[a] > sums[b]; });
  return names;
}

double growthOf(const Measurement& measurement, const TimeKind& kind) {
  std::optional<RoundTimes> base;
  double growth = 0.0;
  for (std::size_t i = 0; i < measurement.settings.size(); ++i) {
    if (!measurement.settings[i].failure.empty()) continue;
    const RoundTimes times = measurement.times(i, kind);
    if (!base) {
      base = times;
      continue;
    }
    const Ratio ratio = pairedRatio(times, *base);
    const double wide = ratio.interval ? ratio.interval->high / ratio.interval->low - 1.0 : 1.0;
    growth = std::max(growth, wide * wide / (kWide * kWide));
  }
  return growth;
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
  /// One turn of a setting, unless it has failed. False: the measurement was stopped.
  const auto take = [&](int round, int frame, std::size_t setting) {
    if (options.stopRequested && options.stopRequested()) {
      result.stopped = true;
      return false;
    }
    if (frame != kFirst) ++done;
    SettingResult& own = result.settings[setting];
    if (!own.failure.empty()) return true;
    const bool writes = round == 0 && frame != kFirst && !options.writeTo.empty();
    try {
      std::optional<FrameReport> report;
      if (frame == kFirst) {
        report = runners[setting]->first(frames.front(), options.first == FirstFrames::EachRound);
        if (!report && options.first == FirstFrames::EachRound)
          throw Error(ExitCode::FramesFailed,
                      "this build of catoptric does not say what it builds before the first frame");
      } else {
        report = runners[setting]->render(
            frame, writes ? options.writeTo[setting] : std::filesystem::path());
      }
      if (round > 0 && report) measured += report->seconds;
      if (round == 0 && frame != kFirst)
        own.written[frame] = std::move(*report);
      else if (report)
        result.turns.push_back({round, done, setting, frame, std::move(*report)});
    } catch (const InputChanged&) {
      throw;
    } catch (const Error& error) {
      own.failure = error.what();
    }
    return true;
  };
  int rounds = options.repeats;
  const int mostRounds = kMostLonger * options.repeats;
  int expected = rounds;  // with those that will be added
  double clear = 0.0;     // rounds after which the result should be clear
  for (int round = 0; round <= rounds; ++round) {
    std::vector<int> numbers = frames;
    if (options.first == FirstFrames::EachRound ||
        (options.first == FirstFrames::Once && round == 0))
      numbers.insert(numbers.begin(), kFirst);
    for (const int frame : numbers)
      for (const std::size_t setting : orderOf(runners.size(), round, frame, options.seed)) {
        if (options.outOfTime && options.outOfTime()) {
          std::erase_if(result.turns,
                        [&](const Turn& turn) { return turn.round == round && round > 0; });
          return withoutFailed(std::move(result));
        }
        if (options.progress) options.progress(done, (expected + 1) * ofRound);
        if (!take(round, frame, setting)) return result;
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
