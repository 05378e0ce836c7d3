#include "study/tune.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <set>
#include <tuple>

#include "core/error.h"
#include "core/random.h"
#include "report/contact_sheet.h"
#include "study/frame_errors.h"

namespace catoptric::study {
namespace {

constexpr int kScreenFrames = 8;  ///< on which options are tried one at a time; ours
constexpr int kRaceFrames = 16;   ///< on which the last ones race; ours
constexpr std::size_t kLast = 5;  ///< that race and are verified together
constexpr double kEqual = 0.02;   ///< times this near count as equal: then the error decides
constexpr double kAlike = 0.10;   ///< how far predictions of time are trusted; ours
constexpr std::uint32_t kRandomOf =
    5;                                ///< every fifth proposal is drawn, against wrong predictions
constexpr int kMostMeasurements = 3;  ///< of a time that a bound cannot be told from; ours

double number(const std::string& text, const std::string& where) {
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value))
    throw UsageError(where + ": \"" + text + "\" is not a number");
  return value;
}

/// One call of tune().
class Tuning {
 public:
  Tuning(const std::vector<Candidate>& candidates, TuneWorld& world, const TuneOptions& options)
      : candidates_(candidates), world_(world), options_(options) {
    result_.combinations = candidates.size();
    looked_ = screenFrames(options.frames);
    state_ = mixedBits(static_cast<std::uint32_t>(options.seed) + 1);
  }

  TuneResult run() {
    screen();
    predict();
    if (byError())
      searchWithinError();
    else
      searchWithinTime();
    result_.outOfTime = world_.outOfTime();
    if (result_.outOfTime && !result_.best) nameNearest();
    return std::move(result_);
  }

 private:
  void searchWithinError() {
    rank();
    std::size_t next = 0;
    while (!result_.best && next < order_.size() && !world_.outOfTime()) {
      const std::vector<std::size_t> last = propose(next);
      if (last.empty()) break;
      verify(race(last));
    }
  }

  /// When the time is over: the nearest of all of which anything is known, on whatever frames.
  void nameNearest() {
    const auto missed = [&](const Known& known) {
      const double value = byError() ? known.error : known.ratio.value;
      return std::max(0.0, value - options_.bound.limit);
    };
    const auto other = [&](const Known& known) { return byError() ? known.seconds : known.error; };
    const Known* nearest = nullptr;
    if (known_.empty())
      for (std::size_t i = 0; i < candidates_.size(); ++i)
        if (const double error = world_.errorSoFar(i); std::isfinite(error))
          known_[i] = untimed(error);
    for (const auto& [i, known] : known_) {
      if (!std::isfinite(known.error)) continue;
      if (nearest != nullptr &&
          std::pair(missed(*nearest), other(*nearest)) <= std::pair(missed(known), other(known)))
        continue;
      nearest = &known;
      result_.nearest = i;
      result_.error = known.error;
      result_.seconds = known.seconds;
    }
  }

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

  /// What differs from the middle of its method's lattice in one option at most.
  void screen() {
    std::vector<std::size_t> asked = screenedFirst(candidates_);
    for (const std::size_t i : asked)
      middle_.emplace(candidates_[i].branch, i);  // each method's first one
    const std::size_t first = asked.front();      // beside which all are timed
    asked.erase(asked.begin());
    const std::size_t together = std::max<std::size_t>(2, world_.together());
    do {
      std::vector<std::size_t> chunk;
      if (!known_.contains(first)) chunk.push_back(first);
      const std::size_t count = std::min(together - 1, asked.size());
      chunk.insert(chunk.end(), asked.begin(), asked.begin() + static_cast<std::ptrdiff_t>(count));
      asked.erase(asked.begin(), asked.begin() + static_cast<std::ptrdiff_t>(count));
      screen(first, chunk);
    } while (!asked.empty() && !world_.outOfTime());
    for (const auto& [branch, middle] : middle_)
      if (known_.contains(middle)) settle(middle);
  }

  /// Errors first: without one a candidate tells nothing.
  void screen(std::size_t first, const std::vector<std::size_t>& chunk) {
    std::map<std::size_t, double> errors;
    for (const std::size_t i : chunk) errors[i] = judgedError(i, looked_);
    std::vector<std::size_t> timed = chunk;
    if (timed.front() != first) timed.insert(timed.begin(), first);
    const std::map<std::size_t, MeasuredTime> times = world_.times(timed, looked_, 1);
    for (const std::size_t i : chunk) {
      const auto time = times.find(i);
      if (time == times.end()) {  // it cannot be rendered, or the time is over
        if (!std::isfinite(errors[i])) continue;
        known_[i] = untimed(errors[i]);
        say("screen", i, looked_.size(), errors[i], 0.0, "not timed");
        continue;
      }
      known_[i] = {errors[i], time->second.seconds, time->second.ratio};
      say("screen", i, looked_.size(), known_[i].error, known_[i].seconds, "measured");
    }
  }

  /// An option that changes no error in any of its values has the middle one, or the fastest one
  /// where that is faster: combinations with its other values are not proposed.
  void settle(std::size_t middle) {
    const std::vector<double> errors = world_.errors(middle, looked_);
    for (std::size_t a = 0; a < candidates_[middle].values.size(); ++a) {
      std::size_t best = middle;
      std::set<std::size_t> alike;
      bool changes = false;
      for (const auto& [i, known] : known_) {
        Candidate other = candidates_[i];
        if (other.branch != candidates_[middle].branch || i == middle) continue;
        other.values[a] = candidates_[middle].values[a];
        if (other.values != candidates_[middle].values) continue;
        alike.insert(i);
        if (world_.errors(i, looked_) != errors) changes = true;
        if (known.seconds < known_[middle].seconds * (1.0 - kEqual) &&
            known.seconds < known_[best].seconds)
          best = i;
      }
      if (changes || alike.empty()) continue;
      alike.insert(middle);
      for (const std::size_t i : alike) {
        if (i == best) continue;
        say("screen", i, looked_.size(), known_[i].error, known_[i].seconds, "no effect");
        settled_.insert({candidates_[i].branch, a, candidates_[i].values[a]});
      }
    }
  }

  bool isSettled(const Candidate& candidate) const {
    for (std::size_t a = 0; a < candidate.values.size(); ++a)
      if (settled_.contains({candidate.branch, a, candidate.values[a]})) return true;
    return false;
  }

  /// What options do together: each as many times faster and more wrong as it does alone.
  void predict() {
    for (std::size_t i = 0; i < candidates_.size(); ++i) {
      const Candidate& candidate = candidates_[i];
      if (isSettled(candidate)) continue;
      const auto middle = middle_.find(candidate.branch);
      if (const auto known = known_.find(i); known != known_.end()) {
        predicted_[i] = known->second;
        continue;
      }
      if (middle == middle_.end() || !known_.contains(middle->second)) {
        predicted_[i] = {INFINITY, INFINITY, {}};
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

  /// The order of the proposals: those that should satisfy by their time, then the others by how
  /// little they should miss; every fifth drawn from the rest.
  void rank() {
    std::vector<std::size_t> best;
    for (const auto& [i, guess] : predicted_)
      if (std::isfinite(guess.error) && std::isfinite(guess.seconds)) best.push_back(i);
    const double limit = options_.bound.limit * (1.0 - options_.margin);
    const auto misses = [&](std::size_t i) { return std::max(0.0, predicted_[i].error - limit); };
    std::stable_sort(best.begin(), best.end(), [&](std::size_t a, std::size_t b) {
      return misses(a) != misses(b) ? misses(a) < misses(b)
                                    : predicted_[a].seconds < predicted_[b].seconds;
    });
    while (!best.empty()) {
      std::size_t taken = 0;
      if (order_.size() % kRandomOf == kRandomOf - 1) {
        taken = draw(best.size());
        drawn_.insert(best[taken]);
      }
      order_.push_back(best[taken]);
      best.erase(best.begin() + static_cast<std::ptrdiff_t>(taken));
    }
    if (order_.size() > mostProposals()) order_.resize(mostProposals());
  }

  std::size_t draw(std::size_t count) {
    state_ = mixedBits(state_);
    return state_ % count;
  }

  std::size_t mostProposals() const {
    if (options_.mostProposals > 0) return static_cast<std::size_t>(options_.mostProposals);
    return std::max<std::size_t>(byError() ? 8 : 3 * kLast, candidates_.size() / 5);
  }

  /// The most accurate within a time. What has just the time that is allowed can never be told from
  /// what has more: so each race has candidates that keep more and more away from the limit, until
  /// one holds; then those that should be more accurate than it and still within the limit.
  void searchWithinTime() {
    for (const auto& [i, guess] : predicted_)
      if (std::isfinite(guess.error) && std::isfinite(guess.seconds)) order_.push_back(i);
    const std::size_t most = std::min(mostProposals(), order_.size());
    std::optional<std::size_t> best;
    double margin = options_.margin;
    while (proposed_ < most && !world_.outOfTime()) {
      const std::vector<std::size_t> last =
          best ? proposeBetter(*best, most) : proposeWithin(margin, most);
      if (last.empty()) break;
      for (const std::size_t i : race(last)) {
        if (best && known_[i].error >= known_[*best].error) break;
        const std::string verdict = timeVerdict(i);
        say("time", i, raceFrames().size(), known_[i].error, known_[i].seconds, verdict);
        if (verdict == "holds") {
          best = i;
          break;
        }
        noteNearest(i, known_[i].error, known_[i].seconds);
      }
    }
    if (best) verify({*best});
  }

  /// Seconds that a bound on time allows.
  double limitSeconds() const {
    for (const auto& [i, known] : known_)
      if (std::isfinite(known.ratio.value))
        return options_.bound.limit * known.seconds / known.ratio.value;
    return 0.0;
  }

  /// Takes a candidate out of those that are left.
  void take(std::size_t at, std::vector<std::size_t>& last) {
    last.push_back(order_[at]);
    order_.erase(order_.begin() + static_cast<std::ptrdiff_t>(at));
    ++proposed_;
  }

  /// The most accurate with a margin to the limit that doubles from one to the next, and one drawn.
  std::vector<std::size_t> proposeWithin(double& margin, std::size_t most) {
    std::vector<std::size_t> last;
    while (proposed_ < most && !order_.empty() && last.size() < kLast) {
      std::size_t taken = 0;
      if (last.size() == kLast - 1) {
        taken = draw(order_.size());
      } else {
        const double limit = limitSeconds() * (1.0 - std::min(margin, 0.95));
        const auto misses = [&](std::size_t i) {
          return std::max(0.0, predicted_[i].seconds - limit);
        };
        for (std::size_t at = 1; at < order_.size(); ++at) {
          const std::size_t a = order_[at];
          const std::size_t b = order_[taken];
          if (misses(a) != misses(b) ? misses(a) < misses(b)
                                     : predicted_[a].error < predicted_[b].error)
            taken = at;
        }
        margin = std::max(2.0 * margin, 0.01);
      }
      take(taken, last);
    }
    return last;
  }

  /// Those that should be more accurate than `best`, and within the limit as far as predictions are
  /// trusted, the most accurate first.
  std::vector<std::size_t> proposeBetter(std::size_t best, std::size_t most) {
    std::stable_sort(order_.begin(), order_.end(), [&](std::size_t a, std::size_t b) {
      return predicted_[a].error < predicted_[b].error;
    });
    std::vector<std::size_t> last;
    for (std::size_t at = 0; at < order_.size() && last.size() < kLast && proposed_ < most;) {
      const Known& guess = predicted_[order_[at]];
      if (guess.error < known_[best].error && guess.seconds <= limitSeconds() * (1.0 + kAlike))
        take(at, last);
      else
        ++at;
    }
    return last;
  }

  /// The next ones that survive a look at the worst frames known and at the spread ones.
  std::vector<std::size_t> propose(std::size_t& next) {
    std::vector<std::size_t> last;
    double fastest = INFINITY;
    while (next < order_.size() && last.size() < kLast && !world_.outOfTime()) {
      const std::size_t i = order_[next++];
      const bool drawn = drawn_.contains(i);
      if (!drawn && predicted_[i].seconds > fastest * (1.0 + kAlike)) continue;
      const double error = judgedWithWorst(i);
      const bool rejected = error > options_.bound.limit;
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
    if (!options_.bound.everyFrame || worst_.empty()) return judgedError(i, looked_);
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
    const std::vector<int> frames = raceFrames();
    const std::map<std::size_t, MeasuredTime> times = world_.times(last, frames, 1);
    std::map<std::size_t, double> errors;
    for (const std::size_t i : last) {
      errors[i] = judgedError(i, frames);
      const auto time = times.find(i);
      if (world_.outOfTime() && (time == times.end() || !std::isfinite(errors[i]))) continue;
      known_[i] = untimed(errors[i]);
      if (time != times.end()) known_[i] = {errors[i], time->second.seconds, time->second.ratio};
      say("race", i, frames.size(), known_[i].error, known_[i].seconds, "measured");
    }
    std::erase_if(last, [&](std::size_t i) { return !known_.contains(i); });  // the time was over
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
      const bool all = options_.verifyFrames == 0 ||
                       options_.verifyFrames >= static_cast<int>(options_.frames.size());
      const std::vector<int> frames = all ? options_.frames : drawnFrames();
      const std::vector<double> errors = world_.errors(i, frames);
      if (errors.empty()) continue;
      const auto worst = std::ranges::max_element(errors);
      const int worstFrame = frames[static_cast<std::size_t>(worst - errors.begin())];
      const double error = judgedError(i, frames);
      const bool holds = !byError() || error <= options_.bound.limit;
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

  /// Measured again while the interval does not tell.
  std::string timeVerdict(std::size_t i) {
    const double limit = options_.bound.limit;
    for (int measurements = 1;; ++measurements) {
      if (measurements > 1) {
        const std::map<std::size_t, MeasuredTime> times =
            world_.times({i}, raceFrames(), measurements);
        if (!times.contains(i)) return world_.outOfTime() ? "undecided" : "fails";
        known_[i].seconds = times.at(i).seconds;
        known_[i].ratio = times.at(i).ratio;
      }
      const std::optional<Interval>& interval = known_[i].ratio.interval;
      if (interval && interval->high <= limit) return "holds";
      if (known_[i].ratio.rounds == 0 || (interval && interval->low > limit)) return "fails";
      // Far from the limit by its value but not by its interval: more rounds may tell.
      if (measurements == kMostMeasurements || !interval || known_[i].ratio.value > limit)
        return "undecided";
    }
  }

  std::vector<int> raceFrames() const { return report::spread(options_.frames, kRaceFrames); }

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
    Ratio ratio;  ///< to what a bound on time counts in
  };
  static Known untimed(double error) { return {error, INFINITY, {INFINITY, {}, 0, 0}}; }

  const std::vector<Candidate>& candidates_;
  TuneWorld& world_;
  const TuneOptions& options_;
  TuneResult result_;
  std::vector<int> looked_;            ///< frames that every proposal is looked at on
  std::set<int> worst_;                ///< frames on which something failed
  std::map<int, std::size_t> middle_;  ///< by method
  std::map<std::size_t, Known> known_;
  std::map<std::size_t, Known> predicted_;
  std::set<std::tuple<int, std::size_t, int>> settled_;  ///< method, option, value: not proposed
  std::vector<std::size_t> order_;
  std::set<std::size_t> drawn_;
  std::size_t proposed_ = 0;
  double nearest_ = INFINITY;
  std::uint32_t state_ = 0;
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
  if (bound.limit < 0.0) throw UsageError(where + ": the bound must not be below 0");
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
    throw UsageError(
        where +
        ": must be a time, such as 100ms, or a multiple of a method's time, such as 0.8x:traced");
  }
  if (bound.limit <= 0.0) throw UsageError(where + ": the bound must be above 0");
  return bound;
}

std::vector<int> screenFrames(const std::vector<int>& frames) {
  return report::spread(frames, kScreenFrames);
}

std::vector<std::size_t> screenedFirst(const std::vector<Candidate>& candidates) {
  std::map<int, std::vector<int>> sizes;
  for (const Candidate& candidate : candidates) {
    std::vector<int>& size = sizes[candidate.branch];
    size.resize(candidate.values.size());
    for (std::size_t a = 0; a < size.size(); ++a)
      size[a] = std::max(size[a], candidate.values[a] + 1);
  }
  std::vector<std::size_t> middles;
  std::vector<std::size_t> others;
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    const std::vector<int>& size = sizes[candidates[i].branch];
    int differing = 0;
    for (std::size_t a = 0; a < size.size(); ++a)
      if (candidates[i].values[a] != size[a] / 2) ++differing;
    if (differing <= 1) (differing == 0 ? middles : others).push_back(i);
  }
  middles.insert(middles.end(), others.begin(), others.end());
  if (middles.empty()) middles.push_back(0);
  return middles;
}

TuneResult tune(const std::vector<Candidate>& candidates, TuneWorld& world,
                const TuneOptions& options) {
  return Tuning(candidates, world, options).run();
}

}  // namespace catoptric::study
