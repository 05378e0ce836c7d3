#include "study/engine.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <utility>

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

/// How wide the interval of a clear ratio may be (high / low - 1): this fraction of |log ratio|,
/// but within these bounds; ours. Such an interval ends far from 1. Intervals contain the true
/// value at least 95 % of the time (engine_test.cpp).
constexpr double kWideOfDistance = 0.4;
constexpr double kWide = 0.04;
constexpr double kWidest = 0.1;

/// Settings are judged again after one pair of rounds for each of this many rounds so far, at least
/// one pair; ours. The time to compute an interval grows with the square of the rounds.
constexpr int kRoundsPerPair = 16;

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

std::vector<double> growthOf(const Measurement& measurement, const TimeKind& kind) {
  const std::size_t settings = measurement.settings.size();
  std::vector<RoundTimes> times(settings);
  std::size_t rounds = 1;
  for (std::size_t i = 0; i < settings; ++i) {
    if (!measurement.settings[i].failure.empty()) continue;
    times[i] = measurement.times(i, kind);
    rounds = std::max(rounds, times[i].size());
  }
  std::vector<double> growth(settings, 0.0);
  for (std::size_t i = 0; i < settings; ++i)
    for (std::size_t j = 0; j < i; ++j) {
      // Rounds that one of both does not take add nothing.
      if (std::min(times[i].size(), times[j].size()) < rounds) continue;
      const Ratio ratio = pairedRatio(times[i], times[j]);
      const double wide = ratio.interval ? ratio.interval->high / ratio.interval->low - 1.0 : 1.0;
      const double allowed =
          std::clamp(kWideOfDistance * std::abs(std::log(ratio.value)), kWide, kWidest);
      const double ofBoth = wide * wide / (allowed * allowed);
      growth[i] = std::max(growth[i], ofBoth);
      growth[j] = std::max(growth[j], ofBoth);
    }
  return growth;
}

namespace {

/// A measurement while it is made.
class Turns {
 public:
  Turns(const std::vector<Runner*>& runners, const std::vector<int>& frames,
        const TurnOptions& options)
      : runners_(runners),
        frames_(frames),
        options_(options),
        seconds_(runners.size(), 0.0),
        rounds_(runners.size(), options.repeats) {
    result.settings.resize(runners.size());
  }

  bool takes(std::size_t setting, int round) const {
    return result.settings[setting].failure.empty() && round <= rounds_[setting];
  }

  /// Rounds from this one on, each setting's own added up.
  int left(int round) const {
    int sum = 0;
    for (std::size_t i = 0; i < runners_.size(); ++i)
      if (takes(i, round)) sum += rounds_[i] - round + 1;
    return sum;
  }

  /// One turn of a setting. False: the measurement was stopped.
  bool take(int round, int frame, std::size_t setting) {
    if (options_.stopRequested && options_.stopRequested()) {
      result.stopped = true;
      return false;
    }
    if (frame != kFirst) ++done;
    SettingResult& own = result.settings[setting];
    try {
      std::optional<FrameReport> report = render(round, frame, setting);
      if (round > 0 && report) seconds_[setting] += report->seconds;
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
  }

  /// After a round: how many rounds each setting takes, as far as is known.
  void plan(int round) {
    if (round == 0 || (round > options_.repeats && round < next_)) return;
    const int from = std::max(round, options_.repeats);
    // By two: the second round takes the orders of the first one backwards.
    const int most = (kMostLonger * options_.repeats - from) / 2;
    const int fewest = std::clamp(from / kRoundsPerPair, std::min(1, most), most);
    next_ = from + 2 * fewest;
    const double longer = options_.leastSeconds / meanSeconds();
    std::vector<double> growth(runners_.size(), 0.0);
    if (round == from && options_.growth) growth = options_.growth(result);
    for (std::size_t i = 0; i < runners_.size(); ++i) {
      if (!takes(i, round)) continue;
      const double wanted =
          round * std::max(std::min(growth[i], options_.mostSeconds / seconds_[i]), longer);
      const double pairs = std::clamp<double>(std::ceil(0.5 * (wanted - from)), fewest, most);
      rounds_[i] = from + (wanted > from ? 2 * static_cast<int>(pairs) : 0);
    }
  }

  Measurement result;
  int done = 0;  ///< frames

 private:
  /// The mean over the settings that have not failed.
  double meanSeconds() const {
    double sum = 0.0;
    int count = 0;
    for (std::size_t i = 0; i < runners_.size(); ++i) {
      if (!result.settings[i].failure.empty()) continue;
      sum += seconds_[i];
      ++count;
    }
    return sum / std::max(count, 1);
  }

  std::optional<FrameReport> render(int round, int frame, std::size_t setting) {
    if (frame != kFirst) {
      const bool writes = round == 0 && !options_.writeTo.empty();
      return runners_[setting]->render(
          frame, writes ? options_.writeTo[setting] : std::filesystem::path());
    }
    const bool again = options_.first == FirstFrames::EachRound;
    std::optional<FrameReport> report = runners_[setting]->first(frames_.front(), again);
    if (!report && again)
      throw Error(ExitCode::FramesFailed,
                  "this build of catoptric does not say what it builds before the first frame");
    return report;
  }

  const std::vector<Runner*>& runners_;
  const std::vector<int>& frames_;
  const TurnOptions& options_;
  std::vector<double> seconds_;  ///< measured of each setting
  std::vector<int> rounds_;      ///< that each setting takes, as far as is known
  int next_ = 0;                 ///< after this round settings are judged again
};

}  // namespace

Measurement measureInTurns(const std::vector<Runner*>& runners, const std::vector<int>& frames,
                           const TurnOptions& options) {
  Turns turns(runners, frames, options);
  for (int round = 0; const int left = turns.left(round); ++round) {
    std::vector<int> numbers = frames;
    if (options.first == FirstFrames::EachRound ||
        (options.first == FirstFrames::Once && round == 0))
      numbers.insert(numbers.begin(), kFirst);
    const int all = turns.done + left * static_cast<int>(frames.size());
    for (const int frame : numbers)
      for (const std::size_t setting : orderOf(runners.size(), round, frame, options.seed)) {
        if (!turns.takes(setting, round)) continue;
        if (options.outOfTime && options.outOfTime()) {
          std::erase_if(turns.result.turns,
                        [&](const Turn& turn) { return turn.round == round && round > 0; });
          return withoutFailed(std::move(turns.result));
        }
        if (options.progress) options.progress(turns.done, all);
        if (!turns.take(round, frame, setting)) return std::move(turns.result);
      }
    turns.plan(round);
  }
  if (options.progress) options.progress(turns.done, turns.done);
  return withoutFailed(std::move(turns.result));
}

}  // namespace catoptric::study
