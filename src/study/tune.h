// Finds the fastest setting within an error bound, or the most accurate setting within a time
// bound, without trying all combinations. Options are first varied one at a time. The results
// predict the combinations. The best predictions are then measured, in order.
#pragma once

#include <cmath>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "study/statistics.h"

namespace catoptric::study {

/// The bound that the setting must satisfy.
struct Bound {
  enum class Kind { Error, Time } kind = Kind::Error;
  double limit = 0.0;
  std::string metric = "L1_8bit";  ///< measure of an error bound
  bool everyFrame =
      false;  ///< for an error bound: whether it applies to every frame; otherwise to their mean
  std::string timeOf;  ///< for a time bound: `limit` is a multiple of this method's time; empty:
                       ///< `limit` is in seconds
  std::string text;    ///< as the user wrote it
};
/// Parses "L1_8bit<=2" or "L1_8bit<=2 every-frame". Throws UsageError.
Bound parseMaxError(const std::string& text);
/// Parses "100ms", "0.1s" or "0.8x:traced". Throws UsageError.
Bound parseMaxTime(const std::string& text);

/// A combination of option values. The combinations of a method form a lattice: one axis per
/// option.
struct Candidate {
  int branch = 0;           ///< index of the method
  std::vector<int> values;  ///< one index per axis of the method
};

struct MeasuredTime {
  double seconds = 0.0;
  /// The time divided by the unit of a time bound: the time of the method that the bound names,
  /// or one second.
  Ratio ratio;
};

/// The measurements that tune() needs. Settings are given by indices of candidates.
class TuneWorld {
 public:
  virtual ~TuneWorld() = default;
  /// The error of each of these frames; empty: the setting cannot be rendered.
  virtual std::vector<double> errors(std::size_t candidate, const std::vector<int>& frames) = 0;
  /// The times of all candidates, interleaved with each other and with the method that the bound
  /// names. Each time combines this many `measurements`, earlier ones included.
  virtual std::map<std::size_t, MeasuredTime> times(const std::vector<std::size_t>& candidates,
                                                    const std::vector<int>& frames,
                                                    int measurements) = 0;
  /// The error of the frames together.
  virtual double pooled(std::size_t candidate, const std::vector<int>& frames) = 0;
  /// Whether the time is over: errors() and times() lack then what would take more.
  virtual bool outOfTime() const { return false; }
  /// The error of the frames of which it is known, together; NaN: of none.
  virtual double errorSoFar(std::size_t) { return NAN; }
  /// How many candidates are measured together: between them the time may be over.
  virtual std::size_t together() const { return SIZE_MAX; }
};

/// A trial: one line of trials.jsonl.
struct Trial {
  /// "screen": one option differs from the middle values. "propose": a combination that should
  /// be fast enough is tried on few frames. "race": the best proposals are timed together.
  /// "verify": the error is computed on all frames. "time": a time is compared with a time bound.
  std::string stage;
  std::size_t candidate = 0;
  int frames = 0;
  double error = 0.0;
  double seconds = 0.0;
  /// "measured", "not timed", "no effect", "rejected", "holds", "fails" or "undecided"
  std::string verdict;
};

struct TuneOptions {
  Bound bound;
  std::vector<int> frames;  ///< all frames of the path
  int verifyFrames = 0;     ///< 0: all frames
  std::uint64_t seed = 0;
  double margin =
      0.0;  ///< fraction of the bound that is kept free on the frames that are measured first
  int mostProposals = 0;  ///< 0: a fifth of the combinations, at least 8; for a time bound 15
  std::function<void(const Trial&)> say;
};

struct TuneResult {
  std::optional<std::size_t> best;
  std::optional<std::size_t> nearest;  ///< set if no setting satisfies the bound
  bool outOfTime = false;              ///< the time was over before the search was
  bool verifiedOnAll = false;
  double error =
      0.0;  ///< error of `best` on the frames that verified it; without `best`, error of `nearest`
  double worstError = 0.0;
  int worstFrame = 0;
  double seconds = 0.0;  ///< infinite: not timed
  std::vector<Trial> trials;
  std::size_t combinations = 0;
};

/// The frames and candidates with which the search begins: those that differ from the middle of
/// their method's lattice in one option at most.
std::vector<int> screenFrames(const std::vector<int>& frames);
std::vector<std::size_t> screenedFirst(const std::vector<Candidate>& candidates);

TuneResult tune(const std::vector<Candidate>& candidates, TuneWorld& world,
                const TuneOptions& options);

}  // namespace catoptric::study
