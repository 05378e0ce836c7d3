// Where the cases of a night are rendered: by resident workers of several programs, in turns.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>

#include "nightly/facts.h"
#include "nightly/night_suite.h"
#include "study/bench.h"

namespace catoptric::nightly {

struct BenchFacts {
  std::string print;
  std::string description;
  std::string command;
  std::vector<int> frames;
};

struct Program {
  std::string role;
  std::filesystem::path file;
};

using StepTimes = std::map<std::string, study::RoundTimes>;  ///< by step

/// What programs made of a case.
struct Turns {
  std::map<std::string, study::RoundTimes> times;       ///< by role
  std::map<std::string, std::string> failures;          ///< by role
  std::map<std::string, std::uint64_t> memory;          ///< peak bytes by role
  std::map<std::string, StepTimes> steps;               ///< by role
  std::map<int, study::FrameReport> written;            ///< tonight's frames, on the first call
  std::map<std::string, std::filesystem::path> frames;  ///< their folders by role; until the next
                                                        ///< call, but for tonight's
};

/// Tests have one of their own.
class Lab {
 public:
  virtual ~Lab() = default;
  /// Methods of a scene that names none.
  virtual std::vector<std::string> methods(const NightScene& scene) = 0;
  /// What a case measures. Throws Error when its config or scene is wrong.
  virtual BenchFacts bench(const NightCase& one) = 0;
  /// Renders all frames `rounds` times by each program, after a round that does not count. `fresh`:
  /// in new processes; `writeTo`: where tonight's frames go, empty: nowhere. Throws StudyStopped.
  virtual Turns measure(const NightCase& one, const std::vector<Program>& programs, int rounds,
                        bool fresh, const std::filesystem::path& writeTo) = 0;
  /// Starts each program so often, in turns: times before the first frame by role, "start" of all
  /// steps, "start.bake" of one. Empty where one cannot be started. Throws StudyStopped.
  virtual std::map<std::string, StepTimes> starts(const NightCase& one,
                                                  const std::vector<Program>& programs,
                                                  int rounds) = 0;
  /// Renders what is missing of these frames of the truth into `folder`. Throws Error.
  virtual void truth(const NightCase& one, const std::vector<int>& frames,
                     const std::filesystem::path& folder) = 0;
  /// The case is done: its processes may end.
  virtual void leave() {}
};

struct LabOptions {
  /// Run configs and workers' command lines of a scene and its frames, with those settings of the
  /// scene that all methods have.
  std::function<study::Inputs(const NightScene&, const std::string& frames)> inputs;
  std::filesystem::path program;  ///< that is judged
  std::filesystem::path work;     ///< a folder for logs and what is thrown away
  study::Measurement::Clock clock = study::Measurement::Clock::Wall;
  /// Programs that do not answer for so long are ended, which is a crash; 0: any time is waited.
  double patienceSeconds = 0.0;
  std::function<bool()> stopRequested;
};

std::unique_ptr<Lab> makeLab(LabOptions options);

}  // namespace catoptric::nightly
