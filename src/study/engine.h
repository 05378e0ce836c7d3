// Measures several settings interleaved, frame by frame, so that disturbances of the machine affect
// all of them alike. The engine knows only that its runners render a frame on request.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "study/statistics.h"

namespace catoptric::study {

/// The result of rendering one frame.
struct FrameReport {
  double seconds = 0.0;     ///< wall-clock time
  double cpuSeconds = 0.0;  ///< CPU time of all its threads
  std::map<std::string, double> steps;
  std::map<std::string, std::uint64_t> counters;
  std::string pixels;             ///< fingerprint of R, G, B; only if writing was requested
  std::uint64_t memoryBytes = 0;  ///< most of its process so far; 0: not known
};

/// One setting that is ready to render.
class Runner {
 public:
  virtual ~Runner() = default;
  /// Renders a frame of the path. `writeTo` empty: nothing is written. Throws Error.
  virtual FrameReport render(int frame, const std::filesystem::path& writeTo) = 0;
  /// The time of the first frame after a new start, with all that the method builds before. It is
  /// `frame`, or the restart frame before it. `again`: also if it is known. nullopt: cannot be
  /// known. Throws Error.
  virtual std::optional<FrameReport> first(int /*frame*/, bool /*again*/) { return {}; }
};

/// One timed frame.
struct Turn {
  int round = 0;  ///< counted from 1; 0: a first frame in the round that warms up
  int turn = 0;   ///< number within the whole measurement
  std::size_t setting = 0;
  int frame = 0;  ///< kFirst: a first frame
  FrameReport report;
};
inline constexpr int kFirst = 0;

struct Measurement;

/// When first frames are timed.
enum class FirstFrames { Never, Once, EachRound };

struct TurnOptions {
  int repeats = 8;  ///< timed rounds; the warm-up round before them writes the requested frames
  /// If frames are short, rounds continue until settings have been measured for this long on
  /// average, at most kMostLonger times as many rounds. Otherwise another program that runs for a
  /// second could disturb all rounds.
  double leastSeconds = 0.0;
  /// Then rounds continue with the settings whose `growth` is above 1, each at most for this long.
  /// `growth` says how many times as many rounds each setting needs.
  double mostSeconds = 0.0;
  std::function<std::vector<double>(const Measurement&)> growth;
  FirstFrames first = FirstFrames::Never;
  std::uint64_t seed = 0;
  std::vector<std::filesystem::path>
      writeTo;  ///< folder for each setting; empty: nothing is written
  std::function<bool()> stopRequested;
  std::function<bool()> outOfTime;  ///< then no further frame begins: complete rounds are kept
  /// `all`: frames, as many as are expected by now.
  std::function<void(int done, int all)> progress;
};

/// Rounds may exceed the requested number by at most this factor (our choice).
inline constexpr int kMostLonger = 8;

/// The result of one setting.
struct SettingResult {
  std::string failure;                 ///< why it was not measured; empty: it was
  std::map<int, FrameReport> written;  ///< frames of the warm-up round
};

enum class Clock { Wall, Cpu };

/// The time of a setting that counts.
struct TimeKind {
  Clock clock = Clock::Wall;
  enum class Of {
    Steady,  ///< of frames that follow others
    First,   ///< of the first frame, with all that is built before it
    Mean,    ///< of a frame at the end of `amortize` frames: one first frame, otherwise steady ones
    Reflection  ///< of steady frames, without the steps that they take by any method; wall clock
  } of = Of::Steady;
  int amortize = 1;
};
/// "steady frame", "first frame", "mean of 900 frames", or "reflection alone".
std::string timeName(const TimeKind& kind);
struct Measurement {
  std::vector<Turn> turns;
  std::vector<SettingResult> settings;
  bool stopped = false;

  /// The times of a setting, by round and frame. For means, all columns of a row are scaled so that
  /// their mean is the mean time. Empty if the wanted first frames were not timed in each round.
  RoundTimes times(std::size_t setting, const TimeKind& kind = {}) const;
  /// The mean time of a frame. First frames that were timed only once suffice. 0: not known.
  double seconds(std::size_t setting, const TimeKind& kind) const;
  /// The most memory, in bytes, of the processes that rendered a setting; 0: not known.
  std::uint64_t memoryBytes(std::size_t setting) const;
  /// The times of a step of a setting, by round and frame; 0 if a frame does not have the step.
  RoundTimes stepTimes(std::size_t setting, const std::string& step) const;
  /// The names of a setting's steps, sorted by time, longest first.
  std::vector<std::string> steps(std::size_t setting) const;
};

/// How many times as many rounds make the ratios of each setting to all others clear, for times of
/// this kind: an interval's width falls with the root of the rounds. An interval may be wider the
/// farther its ratio is from 1. Settings that failed or have taken fewer rounds than another do not
/// count: their growth is 0.
std::vector<double> growthOf(const Measurement& measurement, const TimeKind& kind);

/// Renders `frames` with all runners. Each runner has one turn per frame. The seed determines the
/// order of the runners, which is reversed in the next round. A runner that throws gets no further
/// turns.
Measurement measureInTurns(const std::vector<Runner*>& runners, const std::vector<int>& frames,
                           const TurnOptions& options);

}  // namespace catoptric::study
