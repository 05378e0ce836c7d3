// The lab renders the cases of a night with resident workers of several programs, interleaved.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>

#include "nightly/facts.h"
#include "nightly/night_suite.h"
#include "study/bench.h"

namespace catoptric::nightly {

/// What a case measures. The case is compared with earlier nights only if the fingerprint `print`
/// is the same.
struct BenchFacts {
  std::string print;
  std::string description;
  std::string command;
  std::vector<int> frames;
};

struct Program {
  std::string role;  ///< its part in the comparison, e.g. "tonight" or "accepted" (facts.h)
  std::filesystem::path file;
};

using StepTimes = std::map<std::string, study::RoundTimes>;  ///< indexed by step

/// The results of several programs for one case. All maps except `written` are indexed by the
/// programs' roles.
struct Turns {
  std::map<std::string, study::RoundTimes> times;  ///< times of whole frames
  std::map<std::string, std::string> failures;     ///< why a program could not render
  std::map<std::string, std::uint64_t> memory;     ///< peak bytes
  std::map<std::string, StepTimes> steps;
  /// Tonight's frames, indexed by their number, if measure() has written them.
  std::map<int, study::FrameReport> written;
  std::map<std::string, std::filesystem::path>
      frames;  ///< the folders of frames, by role; valid until the next call, except that tonight's
               ///< folder stays
};

/// The interface of a lab; tests have their own implementation.
class Lab {
 public:
  virtual ~Lab() = default;
  /// The methods of a scene's config, for scenes that name no methods themselves.
  virtual std::vector<std::string> methods(const NightScene& scene) = 0;
  /// Returns what a case measures. Throws Error if its config or scene is wrong.
  virtual BenchFacts bench(const NightCase& one) = 0;
  /// Renders all frames `rounds` times with each program, after an uncounted warm-up round.
  /// `fresh`: in new processes. `writeTo`: folder for tonight's frames; empty: none. Throws
  /// StudyStopped.
  virtual Turns measure(const NightCase& one, const std::vector<Program>& programs, int rounds,
                        bool fresh, const std::filesystem::path& writeTo) = 0;
  /// Starts each program `rounds` times, interleaved. Returns the times before the first frame, by
  /// role: "start" is the sum of all steps, "start.bake" one step. Empty for a program that cannot
  /// be started. Throws StudyStopped.
  virtual std::map<std::string, StepTimes> starts(const NightCase& one,
                                                  const std::vector<Program>& programs,
                                                  int rounds) = 0;
  /// Renders those reference frames that are missing in `folder`. Throws Error.
  virtual void truth(const NightCase& one, const std::vector<int>& frames,
                     const std::filesystem::path& folder) = 0;
  /// Called when a case is finished: its processes may end.
  virtual void leave() {}
};

struct LabOptions {
  /// Makes run configs and workers' command lines for a scene and its frames. They contain the
  /// scene's settings, except the settings of single methods.
  std::function<study::Inputs(const NightScene&, const std::string& frames)> inputs;
  std::filesystem::path program;  ///< the program that is judged
  std::filesystem::path work;     ///< folder for logs and temporary files
  study::Clock clock = study::Clock::Wall;
  study::Patience patience;  ///< a program that gives no answer counts as a crash
};

std::unique_ptr<Lab> makeLab(LabOptions options);

}  // namespace catoptric::nightly
