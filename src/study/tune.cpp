#include "study/tune.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <set>

#include "core/error.h"
#include "core/random.h"
#include "report/contact_sheet.h"
#include "study/errors.h"

namespace catoptric::study {
namespace {

constexpr int kScreenFrames = 8;  ///< on which options are tried one at a time; ours
constexpr int kRaceFrames = 16;   ///< on which the last ones race; ours
constexpr std::size_t kLast = 5;  ///< that race and are verified together
constexpr double kEqual = 0.02;   ///< times this near count as equal: then the error decides
constexpr double kAlike = 0.10;   ///< how far predictions of time are trusted; ours
constexpr std::uint32_t kRandomOf =
    5;  ///< every fifth proposal is drawn, against wrong predictions

double number(const std::string& text, const std::string& where) {
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value))
    throw UsageError(where + ": \"" + text + "\" is no number");
  return value;
}

/// One call of tune().
class Tuning {
 public:
  Tuning(const std::vector<Candidate>& candidates, TuneWorld& world, const TuneOptions& options)
      : candidates_(candidates), world_(world), options_(options) {
    result_.combinations = candidates.size();
    looked_ = report::spread(options.frames, kScreenFrames);
  }

  TuneResult run() {
    screen();
    predict();
    rank();
    std::size_t next = 0;
    while (!result_.best && next < order_.size() && !world_.outOfTime()) {
      const std::vector<std::size_t> last = propose(next);
      if (last.empty()) break;
      verify(race(last));
    }
    return std::move(result_);
  }

 private:
  bool byError() const { return options_.bound.kind == Bound::Kind::Error; }

  void say(const std::string& stage, std::size_t candidate, std::size_t frames, double error,
           double seconds, const std::string& verdict) {
    result_.trials.push_back({stage, candidate, static_cast<int>(frames), error, seconds, verdict});
    if (options_.say) options_.say(result_.trials.back());
  }

  /// The error that the bound is about.
  double judgedError(std::size_t candidate, const std::vector<int>& frames) {
    const std::vector<double> errors = world_.errors(candidate, frames);
    if (errors.empty()) return INFINITY;
    if (byError() && options_.bound.everyFrame) return *std::ranges::max_element(errors);
    return world_.pooled(candidate, frames);
  }

  /// The middle of each method's lattice, and what differs from it in one option.
  void screen() {
    std::map<int, std::vector<int>> sizes;
    for (const Candidate& candidate : candidates_) {
      std::vector<int>& size = sizes[candidate.branch];
      size.resize(candidate.values.size());
      for (std::size_t a = 0; a < size.size(); ++a)
        size[a] = std::max(size[a], candidate.values[a] + 1);
    }
    std::vector<std::size_t> asked;
    for (const auto& [branch, size] : sizes) {
      std::vector<int> middle;
      for (const int count : size) middle.push_back(count / 2);
      for (std::size_t i = 0; i < candidates_.size(); ++i) {
        if (candidates_[i].branch != branch) continue;
        int differing = 0;
        for (std::size_t a = 0; a < middle.size(); ++a)
          if (candidates_[i].values[a] != middle[a]) ++differing;
        if (differing == 0) middle_[branch] = i;
        if (differing <= 1) asked.push_back(i);
      }
    }
    if (asked.empty()) asked.push_back(0);
    const std::map<std::size_t, MeasuredTime> times = world_.times(asked, looked_);
    for (const std::size_t i : asked) {
      const auto time = times.find(i);
      if (time == times.end()) continue;  // it cannot be rendered
      known_[i] = {judgedError(i, looked_), time->second.seconds};
      say("screen", i, looked_.size(), known_[i].error, known_[i].seconds, "measured");
    }
  }

  /// What options do together: each as many times faster and more wrong as it does alone.
  void predict() {
    for (std::size_t i = 0; i < candidates_.size(); ++i) {
      const Candidate& candidate = candidates_[i];
      const auto middle = middle_.find(candidate.branch);
      if (const auto known = known_.find(i); known != known_.end()) {
        predicted_[i] = known->second;
        continue;
      }
      if (middle == middle_.end() || !known_.contains(middle->second)) {
        predicted_[i] = {INFINITY, INFINITY};
        continue;
      }
      const Known& from = known_[middle->second];
      Known guess = from;
      for (std::size_t a = 0; a < candidate.values.size(); ++a) {
        Candidate alone = candidates_[middle->second];
        alone.values[a] = candidate.values[a];
        const std::optional<std::size_t> index = find(alone);
        if (!index || !known_.contains(*index)) continue;
        guess.seconds *= known_[*index].seconds / from.seconds;
        guess.error += known_[*index].error - from.error;
      }
      guess.error = std::max(guess.error, 0.0);
      predicted_[i] = guess;
    }
  }

  std::optional<std::size_t> find(const Candidate& wanted) const {
    for (std::size_t i = 0; i < candidates_.size(); ++i)
      if (candidates_[i].branch == wanted.branch && candidates_[i].values == wanted.values)
        return i;
    return {};
  }

  /// The order of the proposals: those that should satisfy by what is wanted of them, then the
  /// others by how little they should miss; every fifth drawn from the rest.
  void rank() {
    std::vector<std::size_t> best;
    for (const auto& [i, guess] : predicted_)
      if (std::isfinite(guess.error) && std::isfinite(guess.seconds)) best.push_back(i);
    const auto misses = [&](std::size_t i) {
      const double value = byError() ? predicted_[i].error : predicted_[i].seconds;
      return std::max(0.0, value - limit());
    };
    const auto wanted = [&](std::size_t i) {
      return byError() ? predicted_[i].seconds : predicted_[i].error;
    };
    std::stable_sort(best.begin(), best.end(), [&](std::size_t a, std::size_t b) {
      return misses(a) != misses(b) ? misses(a) < misses(b) : wanted(a) < wanted(b);
    });
    std::uint32_t state = mixedBits(static_cast<std::uint32_t>(options_.seed) + 1);
    while (!best.empty()) {
      std::size_t taken = 0;
      if (order_.size() % kRandomOf == kRandomOf - 1) {
        state = mixedBits(state);
        taken = state % best.size();
        drawn_.insert(best[taken]);
      }
      order_.push_back(best[taken]);
      best.erase(best.begin() + static_cast<std::ptrdiff_t>(taken));
    }
    const std::size_t most = options_.mostProposals > 0
                                 ? static_cast<std::size_t>(options_.mostProposals)
                                 : std::max<std::size_t>(8, candidates_.size() / 5);
    if (order_.size() > most) order_.resize(most);
  }

  /// Of a bound on the time in seconds, or as predicted from the ratio to a method.
  double limit() {
    const Bound& bound = options_.bound;
    if (bound.timeOf.empty()) return bound.limit * (1.0 - options_.margin);
    if (methodSeconds_ == 0.0 && !known_.empty()) {
      const auto& [candidate, known] = *known_.begin();
      methodSeconds_ = known.seconds / world_.ratioToMethod(candidate, looked_).value;
    }
    return bound.limit * methodSeconds_ * (1.0 - options_.margin);
  }

  /// The next ones that survive a look at the worst frames known and at the spread ones.
  std::vector<std::size_t> propose(std::size_t& next) {
    std::vector<std::size_t> last;
    double fastest = INFINITY;
    while (next < order_.size() && last.size() < kLast && !world_.outOfTime()) {
      const std::size_t i = order_[next++];
      const bool drawn = drawn_.contains(i);
      if (byError() && !drawn && predicted_[i].seconds > fastest * (1.0 + kAlike)) continue;
      const double error = judgedWithWorst(i);
      const bool rejected = byError() && error > options_.bound.limit;
      say("propose", i, looked_.size() + worst_.size(), error, predicted_[i].seconds,
          rejected ? "rejected" : "measured");
      noteNearest(i, error, predicted_[i].seconds);
      if (rejected || !std::isfinite(error)) continue;
      last.push_back(i);
      fastest = std::min(fastest, predicted_[i].seconds);
    }
    return last;
  }

  /// One frame beyond the bound is a proof against `every-frame`; of a mean, the frames that are
  /// spread count.
  double judgedWithWorst(std::size_t i) {
    if (!byError() || !options_.bound.everyFrame || worst_.empty()) return judgedError(i, looked_);
    const double onWorst = judgedError(i, std::vector<int>(worst_.begin(), worst_.end()));
    return onWorst > options_.bound.limit ? onWorst : std::max(onWorst, judgedError(i, looked_));
  }

  void noteNearest(std::size_t i, double error, double seconds) {
    const double miss = byError() ? error : seconds;
    if (miss >= nearest_) return;
    nearest_ = miss;
    result_.nearest = i;
    if (result_.best) return;
    result_.error = error;
    result_.seconds = seconds;
  }

  /// In turns, on more frames; the best first.
  std::vector<std::size_t> race(std::vector<std::size_t> last) {
    const std::vector<int> frames = report::spread(options_.frames, kRaceFrames);
    const std::map<std::size_t, MeasuredTime> times = world_.times(last, frames);
    std::map<std::size_t, double> errors;
    for (const std::size_t i : last) {
      errors[i] = judgedError(i, frames);
      const auto time = times.find(i);
      known_[i] = {errors[i], time == times.end() ? INFINITY : time->second.seconds};
      say("race", i, frames.size(), known_[i].error, known_[i].seconds, "measured");
    }
    std::stable_sort(last.begin(), last.end(), [&](std::size_t a, std::size_t b) {
      return byError() ? known_[a].seconds < known_[b].seconds : errors[a] < errors[b];
    });
    // What is as fast goes by its error.
    if (byError())
      std::stable_sort(last.begin(), last.end(), [&](std::size_t a, std::size_t b) {
        const double fast = known_[last.front()].seconds * (1.0 + kEqual);
        const bool aFast = known_[a].seconds <= fast;
        const bool bFast = known_[b].seconds <= fast;
        return aFast != bFast ? aFast : aFast && errors[a] < errors[b];
      });
    return last;
  }

  /// The first that holds.
  void verify(const std::vector<std::size_t>& last) {
    for (const std::size_t i : last) {
      if (world_.outOfTime()) return;
      if (!byError()) {
        const std::string verdict = timeVerdict(i);
        say("verify", i, looked_.size(), known_[i].error, known_[i].seconds, verdict);
        if (verdict != "holds") continue;
      }
      const bool all = options_.verifyFrames == 0 ||
                       options_.verifyFrames >= static_cast<int>(options_.frames.size());
      const std::vector<int> frames = all ? options_.frames : drawnFrames();
      const std::vector<double> errors = world_.errors(i, frames);
      if (errors.empty()) continue;
      const auto worst = std::ranges::max_element(errors);
      const int worstFrame = frames[static_cast<std::size_t>(worst - errors.begin())];
      const double error = judgedError(i, frames);
      const bool holds = !byError() || error <= options_.bound.limit;
      if (byError())
        say("verify", i, frames.size(), error, known_[i].seconds, holds ? "holds" : "fails");
      if (!holds) {
        worst_.insert(worstFrame);
        noteNearest(i, error, known_[i].seconds);
        continue;
      }
      result_.best = i;
      result_.verifiedOnAll = all;
      result_.error = world_.pooled(i, frames);
      result_.worstError = *worst;
      result_.worstFrame = worstFrame;
      result_.seconds = known_[i].seconds;
      return;
    }
  }

  std::string timeVerdict(std::size_t i) {
    const std::vector<int> frames = report::spread(options_.frames, kRaceFrames);
    if (options_.bound.timeOf.empty())
      return known_[i].seconds <= options_.bound.limit ? "holds" : "fails";
    const Ratio ratio = world_.ratioToMethod(i, frames);
    if (!ratio.interval) return "undecided";
    if (ratio.interval->high <= options_.bound.limit) return "holds";
    return ratio.interval->low > options_.bound.limit ? "fails" : "undecided";
  }

  /// Drawn once for all, so that all are judged on the same ones.
  std::vector<int> drawnFrames() const {
    std::vector<int> rest = options_.frames;
    std::set<int> drawn;
    std::uint32_t state = mixedBits(static_cast<std::uint32_t>(options_.seed) + 77);
    while (static_cast<int>(drawn.size()) < options_.verifyFrames && !rest.empty()) {
      state = mixedBits(state);
      const auto at = rest.begin() + static_cast<std::ptrdiff_t>(state % rest.size());
      drawn.insert(*at);
      rest.erase(at);
    }
    return {drawn.begin(), drawn.end()};
  }

  struct Known {
    double error = 0.0;
    double seconds = 0.0;
  };

  const std::vector<Candidate>& candidates_;
  TuneWorld& world_;
  const TuneOptions& options_;
  TuneResult result_;
  std::vector<int> looked_;            ///< frames that every proposal is looked at on
  std::set<int> worst_;                ///< frames on which something failed
  std::map<int, std::size_t> middle_;  ///< by method
  std::map<std::size_t, Known> known_;
  std::map<std::size_t, Known> predicted_;
  std::vector<std::size_t> order_;
  std::set<std::size_t> drawn_;
  double nearest_ = INFINITY;
  double methodSeconds_ = 0.0;
};

}  // namespace

Bound parseMaxError(const std::string& text) {
  const std::string where = "--max-error \"" + text + "\"";
  const std::size_t sign = text.find("<=");
  if (sign == std::string::npos)
    throw UsageError(where + ": must be MEASURE<=LIMIT, such as L1_8bit<=2");
  Bound bound;
  bound.text = text;
  bound.metric = text.substr(0, sign);
  requireMetric(bound.metric);
  std::string rest = text.substr(sign + 2);
  if (const std::size_t space = rest.find(' '); space != std::string::npos) {
    const std::string word = rest.substr(space + 1);
    if (word != "every-frame" && word != "mean")
      throw UsageError(where + ": \"" + word + "\" must be one of: every-frame, mean");
    bound.everyFrame = word == "every-frame";
    rest.resize(space);
  }
  bound.limit = number(rest, where);
  if (bound.limit < 0.0) throw UsageError(where + ": no error is below 0");
  return bound;
}

Bound parseMaxTime(const std::string& text) {
  const std::string where = "--max-time \"" + text + "\"";
  Bound bound;
  bound.kind = Bound::Kind::Time;
  bound.text = text;
  if (const std::size_t sign = text.find("x:"); sign != std::string::npos) {
    bound.timeOf = text.substr(sign + 2);
    bound.limit = number(text.substr(0, sign), where);
  } else if (text.ends_with("ms")) {
    bound.limit = 1e-3 * number(text.substr(0, text.size() - 2), where);
  } else if (text.ends_with("s")) {
    bound.limit = number(text.substr(0, text.size() - 1), where);
  } else {
    throw UsageError(where + ": must be a time, such as 100ms, or one of a method, as 0.8x:traced");
  }
  if (bound.limit <= 0.0) throw UsageError(where + ": no frame takes no time");
  return bound;
}

TuneResult tune(const std::vector<Candidate>& candidates, TuneWorld& world,
                const TuneOptions& options) {
  return Tuning(candidates, world, options).run();
}

}  // namespace catoptric::study
