// What a night measures of its cases, before anybody judges it, and what judging makes of it.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "study/statistics.h"

namespace catoptric::nightly {

/// The programs that are timed in turns.
namespace role {
inline constexpr const char* kTonight = "tonight";
inline constexpr const char* kAccepted = "accepted";  ///< the last build that was good
inline constexpr const char* kAnchor = "anchor";      ///< a build that stays, against creep
inline constexpr const char* kNamed = "named";        ///< one that --baseline names
inline constexpr const char* kAgain = "again";        ///< tonight's once more: the noise
}  // namespace role

/// Times of the programs of a case that were measured in turns.
struct Timing {
  std::string role;
  int attempt = 1;  ///< 2: once more, in fresh processes
  std::string build;
  study::RoundTimes times;
};

struct FrameFacts {
  std::string pixels;  ///< fingerprint of R, G, B
  std::map<std::string, std::uint64_t> counters;
  std::map<std::string, double> steps;  ///< seconds
  std::string file;                     ///< EXR, relative to the history; empty: not kept
  std::uint64_t bytes = 0;
  std::uint64_t notFinite = 0;  ///< pixels
};

/// One case of one night.
struct CaseFacts {
  std::string name;         ///< suite.scene.method
  std::string bench;        ///< fingerprint of what is measured: scene, path, settings, frames
  std::string description;  ///< what the fingerprint is of, a line each
  std::string command;      ///< renders it again
  std::string failure;      ///< why it could not be rendered
  std::map<std::string, std::string> baselineFailures;  ///< by role
  std::map<std::string, std::uint64_t> memory;          ///< peak bytes by role
  std::string truth;  ///< folder of frames of the method that errors are measured against
  std::vector<Timing> timings;
  std::map<int, FrameFacts> frames;
};

/// A night as a whole.
struct Night {
  int id = 0;
  std::string suite;
  std::string suitePrint;  ///< fingerprint of what of the suite was asked for
  std::string effort;
  std::string machine;
  std::string build;
  std::string version;
  std::string started;   ///< UTC
  std::string finished;  ///< empty: it was not judged to its end
  bool partial = false;  ///< --only: cases that are missing are not removed
};

enum class Outcome { Good, Skipped, Regression, Crash };

/// What is said of one side of a case in a night.
struct Verdict {
  std::string name;  ///< of the case
  std::string kind;  ///< time, creep, picture, counter, memory, disk, run
  std::string status;
  Outcome outcome = Outcome::Good;
  int frame = 0;  ///< 0: of all
  double value = 0.0;
  double low = 0.0;
  double high = 0.0;
  std::string message{};
  int began = 0;  ///< the night with which it began; 0: it did not
  std::string lastGood{};
  std::string firstBad{};   ///< builds
  int acknowledgement = 0;  ///< 0: none
};

/// A frame that a person accepted.
struct Reference {
  int frame = 0;
  std::string pixels;
  std::string object;  ///< name in the store; empty: the frame must not be there
  std::map<std::string, std::uint64_t> counters;
  std::uint64_t bytes = 0;
  int night = 0;
};

/// A program that a case is compared with.
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
  std::string undone;  ///< when; empty: it holds
};

}  // namespace catoptric::nightly
