#include "nightly/builds.h"

#include <fmt/core.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <set>
#include <utility>

#include "core/file.h"
#include "image/image.h"
#include "report/table.h"
#include "run/folder/records.h"
#include "run/stage/steps.h"

namespace catoptric::nightly {
namespace {

namespace fs = std::filesystem;

constexpr const char* kWholeFrame = "frame";
constexpr const char* kWholeStart = "start";
/// Shorter steps are not judged: a share of the whole, and what starting a thread may cost. Ours.
constexpr double kShortShare = 0.01;
constexpr double kShortSeconds = 5e-5;
constexpr int kMostTurns = 4;  ///< times as many rounds as were asked for

/// What differs between two frames, a line for each channel.
std::vector<std::string> differingChannels(const image::Image& now, const image::Image& before) {
  if (now.width != before.width || now.height != before.height) return {"another size"};
  std::set<std::string> names(now.channels.begin(), now.channels.end());
  names.insert(before.channels.begin(), before.channels.end());
  std::vector<std::string> lines;
  for (const std::string& name : names) {
    const int to = now.channel(name);
    const int from = before.channel(name);
    if (to < 0 || from < 0) {
      lines.push_back(name + ": only in the frame of " +
                      (from < 0 ? "this build" : "the baseline"));
      continue;
    }
    int count = 0;
    double worst = -1.0;
    std::string where;
    for (int y = 0; y < now.height; ++y)
      for (int x = 0; x < now.width; ++x) {
        const float a = before.at(x, y, from);
        const float b = now.at(x, y, to);
        if (std::bit_cast<std::uint32_t>(a) == std::bit_cast<std::uint32_t>(b)) continue;
        ++count;
        const double apart =
            std::isfinite(a) && std::isfinite(b) ? std::abs(double{a} - double{b}) : INFINITY;
        if (apart <= worst) continue;
        worst = apart;
        where = std::to_string(x) + "," + std::to_string(y) + ": " + report::exactText(double{a}) +
                " -> " + report::exactText(double{b});
      }
    if (count > 0)
      lines.push_back(name + ": " + std::to_string(count) + " pixels, worst at " + where);
  }
  return lines;
}

/// Keeps both frames where they differ, and neither where they are equal.
void comparePixels(const Turns& turns, const fs::path& folder, BuildsComparison& comparison) {
  for (const auto& [number, report] : turns.written) {
    const std::string name = run::framePath("frames", number, ".exr");
    const fs::path now = turns.frames.at(role::kTonight) / name;
    const fs::path before = turns.frames.at(role::kNamed) / name;
    const std::vector<std::string> lines =
        differingChannels(image::readImage(now), image::readImage(before));
    for (const std::string& line : lines)
      comparison.differences.push_back("frame " + std::to_string(number) + " " + line);
    ++comparison.frames;
    if (lines.empty()) {
      ++comparison.equal;
      fs::remove(now);
    } else {
      fs::create_directories((folder / name).parent_path());
      writeFileAtomically(folder / name, std::span<const std::byte>(readFile(before)));
    }
  }
}

/// Times of this build and of the baseline.
struct BothTimes {
  StepTimes now;
  StepTimes before;

  void add(const std::map<std::string, StepTimes>& byRole) {
    for (const auto& [steps, name] : {std::pair(&now, role::kTonight), {&before, role::kNamed}})
      for (const auto& [step, times] : byRole.at(name))
        (*steps)[step].insert((*steps)[step].end(), times.begin(), times.end());
  }
};

/// Leaves out frames that lack the step in a round of one of both.
void keepFramesWithStep(study::RoundTimes& times, study::RoundTimes& others) {
  const auto lacks = [](const study::RoundTimes& rounds, std::size_t frame) {
    return std::ranges::any_of(rounds, [&](const auto& round) { return round[frame] <= 0.0; });
  };
  for (std::size_t frame = times.front().size(); frame-- > 0;) {
    if (!lacks(times, frame) && !lacks(others, frame)) continue;
    for (study::RoundTimes* rounds : {&times, &others})
      for (std::vector<double>& round : *rounds)
        round.erase(round.begin() + static_cast<std::ptrdiff_t>(frame));
  }
}

std::vector<StepRatio> ratiosOf(const BothTimes& both, const std::string& whole, double gate) {
  const std::map<std::string, std::string> kinds = run::stepKinds();
  if (!both.before.contains(whole)) return {};
  const double all = study::frameSeconds(both.before.at(whole)).mean;
  std::vector<StepRatio> ratios;
  for (auto [step, times] : both.before) {
    const auto kind = kinds.find(step);
    if (kind != kinds.end() && (kind->second == "waiting" || kind->second == "rest")) continue;
    if (!both.now.contains(step) || both.now.at(step).size() != times.size()) continue;
    const double seconds = study::frameSeconds(times).mean;
    if (seconds < std::max(kShortSeconds, kShortShare * all)) continue;
    study::RoundTimes own = both.now.at(step);
    keepFramesWithStep(own, times);
    if (times.front().empty()) continue;
    const study::Ratio ratio = study::pairedRatio(own, times);
    ratios.push_back({step, seconds, ratio, stateOf(ratio, gate)});
  }
  std::ranges::stable_sort(ratios, std::greater<>(), &StepRatio::seconds);
  return ratios;
}

bool anyIs(const std::vector<StepRatio>& ratios, TimeState state) {
  return std::ranges::find(ratios, state, &StepRatio::state) != ratios.end();
}

class BuildsMeasurement {
 public:
  BuildsMeasurement(const NightCase& one, Lab& lab, const BuildsOptions& options)
      : one_(one),
        lab_(lab),
        options_(options),
        programs_{{role::kTonight, options.program}, {role::kNamed, options.baseline}} {}

  BuildsComparison compare() {
    const fs::path folder = options_.folder / one_.name;
    fs::remove_all(folder);
    Turns first = lab_.measure(one_, programs_, options_.rounds, true, folder / "now");
    BuildsComparison comparison;
    for (const auto& [name, failure] : first.failures)
      (name == role::kTonight ? comparison.failure : comparison.noBaseline) = failure;
    if (!first.failures.empty()) return comparison;
    comparePixels(first, folder / "baseline", comparison);
    if (options_.rounds == 0) return comparison;
    comparison.steps = judged(kWholeFrame, [&](BothTimes& both, bool fresh) {
      Turns turns = std::exchange(first, {});
      if (turns.times.empty()) turns = lab_.measure(one_, programs_, options_.rounds, fresh, {});
      if (!turns.failures.empty()) return false;
      for (auto& [name, steps] : turns.steps) steps[kWholeFrame] = turns.times.at(name);
      both.add(turns.steps);
      return true;
    });
    lab_.leave();
    const std::vector<StepRatio> starts = judged(kWholeStart, [&](BothTimes& both, bool) {
      const std::map<std::string, StepTimes> steps = lab_.starts(one_, programs_, options_.rounds);
      if (steps.size() == 2) both.add(steps);
      return steps.size() == 2;
    });
    comparison.steps.insert(comparison.steps.end(), starts.begin(), starts.end());
    return comparison;
  }

 private:
  /// Measures once more; false: that failed.
  using AddRounds = std::function<bool(BothTimes&, bool fresh)>;

  /// Rounds until every step is decided; `fresh`: in new processes.
  std::vector<StepRatio> decided(const std::string& whole, const AddRounds& addRounds, bool fresh) {
    BothTimes both;
    std::vector<StepRatio> ratios;
    const bool canTell = kMostTurns * options_.rounds >= study::kLeastRounds;
    for (int i = 0; i < (canTell ? kMostTurns : 1); ++i) {
      if (!addRounds(both, fresh && i == 0)) break;
      ratios = ratiosOf(both, whole, options_.gate);
      if (!anyIs(ratios, TimeState::Undecided)) break;
    }
    return ratios;
  }

  /// A step that fails is measured again.
  std::vector<StepRatio> judged(const std::string& whole, const AddRounds& addRounds) {
    std::vector<StepRatio> steps = decided(whole, addRounds, false);
    if (!anyIs(steps, TimeState::Fails)) return steps;
    const std::vector<StepRatio> again = decided(whole, addRounds, true);
    for (StepRatio& step : steps) {
      if (step.state != TimeState::Fails) continue;
      const auto other = std::ranges::find(again, step.step, &StepRatio::step);
      if (other != again.end())
        step = *other;
      else
        step.state = TimeState::Undecided;
    }
    return steps;
  }

  const NightCase& one_;
  Lab& lab_;
  const BuildsOptions& options_;
  const std::vector<Program> programs_;
};

}  // namespace

BuildsComparison compareBuilds(const NightCase& one, Lab& lab, const BuildsOptions& options) {
  return BuildsMeasurement(one, lab, options).compare();
}

void BuildsReport::add(const std::string& name, const BuildsComparison& one) {
  const auto row = [&](const std::string& what, const char* verdict, const std::string& text) {
    table.rows.push_back({name, what, verdict, text});
  };
  crashes += one.failure.empty() ? 0 : 1;
  withoutBaseline += one.noBaseline.empty() ? 0 : 1;
  if (!one.failure.empty()) row("run", "crash", one.failure);
  if (!one.noBaseline.empty()) row("run", "no baseline", one.noBaseline);
  frames += one.frames;
  equal += one.equal;
  if (one.frames > 0)
    row("pixels", one.equal == one.frames ? "equal" : "differ",
        std::to_string(one.equal) + " of " + std::to_string(one.frames) + " frames are equal");
  for (const std::string& difference : one.differences) row("pixels", "differ", difference);
  for (const StepRatio& step : one.steps) {
    const bool fails = step.state == TimeState::Fails;
    const bool holds = step.state == TimeState::Holds;
    slower += fails ? 1 : 0;
    undecided += fails || holds ? 0 : 1;
    row(step.step,
        fails   ? "slower"
        : holds ? "holds"
                : "undecided",
        study::ratioText(step.ratio) + " times " + report::fixedText(1e3 * step.seconds, 2) +
            " ms");
  }
}

ExitCode BuildsReport::exitCode() const {
  if (crashes > 0) return ExitCode::FramesFailed;
  return slower > 0 || equal < frames || frames == 0 ? ExitCode::LimitsExceeded : ExitCode::Done;
}

std::string BuildsReport::sentence(double gate) const {
  std::string text = std::to_string(equal) + " of " + std::to_string(frames) +
                     " frames are equal bit for bit, " + std::to_string(slower) +
                     " steps are slower by more than " + fmt::format("{:g} %, ", 100.0 * gate) +
                     std::to_string(undecided) + " undecided, " + std::to_string(crashes) +
                     " crashes, " + std::to_string(withoutBaseline) + " cases without a baseline: ";
  if (crashes > 0) return text + "CRASH";
  if (exitCode() != ExitCode::Done) return text + "REGRESSION";
  return text + "good";
}

BuildsReport compareCases(const std::vector<NightCase>& cases, Lab& lab,
                          const BuildsOptions& options,
                          const std::function<void(const std::string&, double)>& progress) {
  BuildsReport report;
  double done = 0.0;
  for (const NightCase& one : cases) {
    progress(one.name, done++ / static_cast<double>(cases.size()));
    report.add(one.name, compareBuilds(one, lab, options));
  }
  return report;
}

}  // namespace catoptric::nightly
