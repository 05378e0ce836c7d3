// Finds the fastest setting within an error, or the most accurate one within a time, without trying
// all combinations: options are tried one at a time, what they do together is predicted from that,
// and the predictions are put to the test from the best one on.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "study/statistics.h"

namespace catoptric::study {

/// What is asked for.
struct Bound {
  enum class Kind { Error, Time } kind = Kind::Error;
  double limit = 0.0;
  std::string metric = "L1_8bit";  ///< of an error
  bool everyFrame = false;         ///< of an error: no frame may exceed it; else their mean
  std::string timeOf;  ///< of a time: `limit` times as long as this method; else seconds
  std::string text;    ///< as it was written
};
/// "L1_8bit<=2", "L1_8bit<=2 every-frame". Throws UsageError.
Bound parseMaxError(const std::string& text);
/// "100ms", "0.1s", "0.8x:traced". Throws UsageError.
Bound parseMaxTime(const std::string& text);

/// The combinations: of each method a lattice of its axes' values.
struct Candidate {
  int branch = 0;           ///< method
  std::vector<int> values;  ///< one index per axis of the branch
};

struct MeasuredTime {
  double seconds = 0.0;
  Ratio ratio;  ///< to what a bound on time counts in: the method that it names, or a second
};

/// What is measured; the numbers are indices of candidates.
class TuneWorld {
 public:
  virtual ~TuneWorld() = default;
  /// Error of each of these frames; empty: the setting cannot be rendered.
  virtual std::vector<double> errors(std::size_t candidate, const std::vector<int>& frames) = 0;
  /// Of all in turns, and in turns with the method that the bound names; of so many measurements
  /// together.
  virtual std::map<std::size_t, MeasuredTime> times(const std::vector<std::size_t>& candidates,
                                                    const std::vector<int>& frames,
                                                    int measurements) = 0;
  /// The error of frames together.
  virtual double pooled(std::size_t candidate, const std::vector<int>& frames) = 0;
  virtual bool outOfTime() const { return false; }
};

/// A line of trials.jsonl.
struct Trial {
  std::string stage;  ///< "screen", "propose", "race", "verify"
  std::size_t candidate = 0;
  int frames = 0;
  double error = 0.0;
  double seconds = 0.0;
  std::string verdict;  ///< "measured", "rejected", "holds", "fails", "undecided"
};

struct TuneOptions {
  Bound bound;
  std::vector<int> frames;  ///< of the path
  int verifyFrames = 0;     ///< 0: all
  std::uint64_t seed = 0;
  double margin = 0.0;    ///< of the bound, left free on the frames that are looked at first
  int mostProposals = 0;  ///< 0: a fifth of the combinations, at least 8; of a time 15
  std::function<void(const Trial&)> say;
};

struct TuneResult {
  std::optional<std::size_t> best;
  std::optional<std::size_t> nearest;  ///< where nothing satisfies
  bool verifiedOnAll = false;
  double error = 0.0;  ///< of `best` on the frames that verified it; of `nearest` else
  double worstError = 0.0;
  int worstFrame = 0;
  double seconds = 0.0;
  std::vector<Trial> trials;
  std::size_t combinations = 0;
};

TuneResult tune(const std::vector<Candidate>& candidates, TuneWorld& world,
                const TuneOptions& options);

}  // namespace catoptric::study
