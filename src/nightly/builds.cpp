#include "nightly/builds.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <set>

#include "core/file.h"
#include "image/image.h"
#include "report/table.h"
#include "run/folder/records.h"
#include "run/stage/steps.h"

namespace catoptric::nightly {
namespace {

namespace fs = std::filesystem;
using StepTimes = std::map<std::string, study::RoundTimes>;

constexpr const char* kWholeFrame = "frame";
/// Shorter steps are not judged: a share of the frame, and what starting a thread may cost. Ours.
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

void addRounds(StepTimes& steps, const Turns& turns, const char* ofRole) {
  const auto add = [&](const std::string& step, const study::RoundTimes& times) {
    steps[step].insert(steps[step].end(), times.begin(), times.end());
  };
  add(kWholeFrame, turns.times.at(ofRole));
  for (const auto& [step, times] : turns.steps.at(ofRole)) add(step, times);
}

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

std::vector<StepRatio> ratiosOf(const StepTimes& now, const StepTimes& before, double gate) {
  const std::map<std::string, std::string> kinds = run::stepKinds();
  const double frame = study::frameSeconds(before.at(kWholeFrame)).mean;
  std::vector<StepRatio> ratios;
  for (auto [step, times] : before) {
    const auto kind = kinds.find(step);
    if (kind != kinds.end() && (kind->second == "waiting" || kind->second == "rest")) continue;
    if (!now.contains(step) || now.at(step).size() != times.size()) continue;
    const double seconds = study::frameSeconds(times).mean;
    if (seconds < std::max(kShortSeconds, kShortShare * frame)) continue;
    study::RoundTimes own = now.at(step);
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
    const Turns first = lab_.measure(one_, programs_, options_.rounds, true, folder / "now");
    BuildsComparison comparison;
    for (const auto& [name, failure] : first.failures)
      (name == role::kTonight ? comparison.failure : comparison.noBaseline) = failure;
    if (!first.failures.empty()) return comparison;
    comparePixels(first, folder / "baseline", comparison);
    comparison.steps = stepsFrom(first);
    if (anyIs(comparison.steps, TimeState::Fails)) confirm(comparison.steps);
    lab_.leave();
    return comparison;
  }

 private:
  /// From the first rounds on until every step is decided.
  std::vector<StepRatio> stepsFrom(Turns turns) {
    StepTimes now;
    StepTimes before;
    std::vector<StepRatio> ratios;
    const bool canTell = kMostTurns * options_.rounds >= study::kLeastRounds;
    for (int i = 0; i < (canTell ? kMostTurns : 1); ++i) {
      if (i > 0) turns = lab_.measure(one_, programs_, options_.rounds, false, {});
      if (!turns.failures.empty()) break;
      addRounds(now, turns, role::kTonight);
      addRounds(before, turns, role::kNamed);
      ratios = ratiosOf(now, before, options_.gate);
      if (!anyIs(ratios, TimeState::Undecided)) break;
    }
    return ratios;
  }

  void confirm(std::vector<StepRatio>& steps) {
    const std::vector<StepRatio> again =
        stepsFrom(lab_.measure(one_, programs_, options_.rounds, true, {}));
    for (StepRatio& step : steps) {
      if (step.state != TimeState::Fails) continue;
      const auto other = std::ranges::find(again, step.step, &StepRatio::step);
      if (other != again.end())
        step = *other;
      else
        step.state = TimeState::Undecided;
    }
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

}  // namespace catoptric::nightly
