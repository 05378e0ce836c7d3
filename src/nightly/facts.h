// The measurements of a night's cases, and the verdicts on them.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "study/statistics.h"

namespace catoptric::nightly {

/// The roles of the programs that are timed interleaved.
namespace role {
inline constexpr const char* kTonight = "tonight";
inline constexpr const char* kAccepted = "accepted";  ///< the last good build
inline constexpr const char* kAnchor = "anchor";      ///< a fixed build that reveals slow drift
inline constexpr const char* kNamed = "named";        ///< the build that --baseline names
inline constexpr const char* kAgain = "again";  ///< tonight's build a second time, to measure noise
}  // namespace role

/// The times of one program of a case, measured interleaved with the others.
struct Timing {
  std::string role;
  int attempt = 1;  ///< 2: repeated in new processes
  std::string build;
  study::RoundTimes times;
};

struct FrameFacts {
  std::string pixels;  ///< fingerprint of R, G, B
  std::map<std::string, std::uint64_t> counters;
  std::map<std::string, double> steps;  ///< in seconds
  std::string file;                     ///< EXR file, relative to the history; empty: not kept
  std::uint64_t bytes = 0;
  std::uint64_t notFinite = 0;  ///< number of pixels with NaN or infinity
};

/// One case of one night.
struct CaseFacts {
  std::string name;         ///< suite.scene.method
  std::string bench;        ///< fingerprint of what is measured: scene, path, settings, frames
  std::string description;  ///< the fingerprinted values, one line each
  std::string command;      ///< command that renders the case again
  std::string failure;      ///< why the case could not be rendered
  std::map<std::string, std::string> baselineFailures;  ///< by role
  std::map<std::string, std::uint64_t> memory;          ///< peak bytes, by role
  std::string truth;  ///< folder of reference frames, from which errors are measured
  std::vector<Timing> timings;
  std::map<int, FrameFacts> frames;

  /// Whether frame `number` is not the accepted one.
  bool differs(int number) const {
    const auto frame = frames.find(number);
    return frame != frames.end() && !frame->second.file.empty();
  }
  bool differsNear(int number) const {
    return differs(number - 1) || differs(number) || differs(number + 1);
  }
};

struct Night {
  int id = 0;
  std::string suite;
  std::string suitePrint;  ///< fingerprint of the requested part of the suite
  std::string effort;
  std::string machine;
  std::string build;
  std::string version;
  std::string started;   ///< UTC
  std::string finished;  ///< empty: not completely judged
  bool partial = false;  ///< with --only: missing cases do not count as removed
};

/// The status of a case of which another scene was accepted than tonight's.
inline constexpr const char* kChangedScene = "changed scene";

/// The status of a case whose settings have changed.
inline constexpr const char* kChangedSetting = "changed setting";

enum class Outcome { Good, Skipped, Regression, Crash };

/// The verdict on one aspect of a case in a night.
struct Verdict {
  std::string name;  ///< name of the case
  std::string kind;  ///< time, creep, picture, flicker, counter, memory, disk, scene, run
  std::string status;
  Outcome outcome = Outcome::Good;
  int frame = 0;  ///< 0: all frames
  double value = 0.0;
  double low = 0.0;
  double high = 0.0;
  std::string message{};
  int began = 0;  ///< the night in which the fault began; 0: there is no fault
  std::string lastGood{};
  std::string firstBad{};   ///< builds between which the fault began
  int acknowledgement = 0;  ///< 0: none
};

/// A frame that a person has accepted.
struct Reference {
  int frame = 0;
  std::string pixels;
  std::string object;  ///< name in the store; empty: the frame must not exist
  std::map<std::string, std::uint64_t> counters;
  std::uint64_t bytes = 0;
  int night = 0;
};

/// A program with which a case is compared.
struct Baseline {
  std::string role;
  std::string build;
  int night = 0;
};

struct Acknowledgement {
  int id = 0;
  std::string at;
  std::string who;
  std::string what;
  std::string reason;
  std::string undone;  ///< time at which it was undone; empty: it is valid
};

}  // namespace catoptric::nightly
