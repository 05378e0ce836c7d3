// Measures several settings in turns, frame by frame: what disturbs the machine disturbs all of
// them alike. Knows of its runners only that they render a frame when told.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "study/statistics.h"

namespace catoptric::study {

/// What a runner says of a frame.
struct FrameReport {
  double seconds = 0.0;     ///< of the clock on the wall
  double cpuSeconds = 0.0;  ///< of all its threads
  std::map<std::string, double> steps;
  std::map<std::string, std::uint64_t> counters;
  std::string pixels;  ///< fingerprint of R, G, B; where it was asked to write
};

/// One setting, ready to render.
class Runner {
 public:
  virtual ~Runner() = default;
  /// Renders a frame of the path. `writeTo` empty: nothing is written. Throws Error.
  virtual FrameReport render(int frame, const std::filesystem::path& writeTo) = 0;
};

/// One timed frame.
struct Turn {
  int round = 0;  ///< from 1
  int turn = 0;   ///< of the whole measurement
  std::size_t setting = 0;
  int frame = 0;
  FrameReport report;
};

struct Measurement;

struct TurnOptions {
  int repeats = 8;  ///< timed rounds; the one before them warms up, and writes what is asked for
  /// Rounds of short frames go on, up to kMostLonger times as many, until each setting has been
  /// measured for so long: another program that runs for a second must not fill all rounds.
  double leastSeconds = 0.0;
  /// After that they go on until the ratios can be told well enough, or for so long.
  double mostSeconds = 0.0;
  std::function<bool(const Measurement&)> enough;
  std::uint64_t seed = 0;
  std::vector<std::filesystem::path> writeTo;  ///< of each setting; empty: nothing is written
  std::function<bool()> stopRequested;
  std::function<void(int done, int all)> progress;
};

/// How many times as many rounds as were asked for, at most; ours.
inline constexpr int kMostLonger = 8;

/// What becomes of a setting.
struct SettingResult {
  std::string failure;                 ///< why it is not measured; empty: it is
  std::map<int, FrameReport> written;  ///< frames of the round that warms up
};

struct Measurement {
  std::vector<Turn> turns;
  std::vector<SettingResult> settings;
  bool stopped = false;

  enum class Clock { Wall, Cpu };
  /// Times of a setting by round and frame.
  RoundTimes times(std::size_t setting, Clock clock = Clock::Wall) const;
  /// Of a step, by round and frame; 0 where a frame has none.
  RoundTimes stepTimes(std::size_t setting, const std::string& step) const;
  /// Names of steps of a setting, by the time they take, longest first.
  std::vector<std::string> steps(std::size_t setting) const;
};

/// Renders `frames` by all runners: for each frame every runner has a turn; in what order is
/// chosen by the seed, and reversed in the next round. A runner that throws has no further turn.
Measurement measureInTurns(const std::vector<Runner*>& runners, const std::vector<int>& frames,
                           const TurnOptions& options);

}  // namespace catoptric::study
