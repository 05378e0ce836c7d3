#include "nightly/night.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdlib>

#include "core/error.h"
#include "core/file.h"
#include "core/hash.h"
#include "core/input_files.h"
#include "core/log.h"
#include "core/text.h"
#include "image/image.h"
#include "nightly/judge.h"
#include "nightly/open_night.h"
#include "nightly/pictures.h"
#include "run/folder/machine.h"
#include "run/folder/records.h"

namespace catoptric::nightly {
namespace {

namespace fs = std::filesystem;

fs::path buildFolder(const History& history, const std::string& build) {
  return history.folder() / "builds" / build;
}

/// Programs of a case, tonight's first.
std::vector<Program> programsOf(const History& history, const Night& night, CaseFacts& facts,
                                std::map<std::string, std::string>& builds,
                                const NightOptions& options, bool again) {
  std::vector<Program> programs{{role::kTonight, options.program}};
  builds[role::kTonight] = night.build;
  std::set<std::string> seen{night.build};
  std::vector<std::string> names{role::kAccepted, role::kAnchor};
  if (options.baseline != role::kAccepted) names = {role::kAnchor, role::kNamed};
  for (const std::string& name : names) {
    const std::optional<Baseline> baseline =
        name != role::kNamed ? history.baseline(facts.name, facts.bench, night.machine, name)
        : options.baseline != role::kAnchor ? Baseline{name, options.baseline, 0}
                                            : std::optional<Baseline>();
    if (!baseline || !seen.insert(baseline->build).second) continue;
    std::error_code ignored;
    const fs::path kept = keptProgram(history, baseline->build);
    if (!fs::is_regular_file(kept, ignored)) {
      facts.baselineFailures[name] = "the program " + baseline->build + " is not kept any more";
      continue;
    }
    programs.push_back({name, kept});
    builds[name] = baseline->build;
  }
  if (again && programs.size() > 1) {
    programs.push_back({role::kAgain, options.program});
    builds[role::kAgain] = night.build;
  }
  return programs;
}

void append(study::RoundTimes& to, const study::RoundTimes& more) {
  to.insert(to.end(), more.begin(), more.end());
}

Timing& timingOf(CaseFacts& facts, const std::string& ofRole, int attempt,
                 const std::string& build) {
  for (Timing& timing : facts.timings)
    if (timing.role == ofRole && timing.attempt == attempt) return timing;
  return facts.timings.emplace_back(Timing{ofRole, attempt, build, {}});
}

/// Is the ratio to the accepted or the anchor build in this state, at the first attempt?
bool anyRatio(const CaseFacts& facts, TimeState state, double gate) {
  for (const char* name : kBaselines) {
    const std::optional<TimeRatio> ratio = timeRatio(facts, name, 1, gate);
    if (ratio && ratio->state == state) return true;
  }
  return false;
}

/// Tonight's build differs too much from itself: more rounds may mend that.
bool isNoisy(const CaseFacts& facts, double gate) {
  const std::optional<TimeRatio> again = timeRatio(facts, role::kAgain, 1, gate);
  return again && std::max(again->ratio.value, 1.0 / again->ratio.value) > 1.0 + gate;
}

/// Keeps the frames that differ from the accepted ones, and removes the others.
void keepFrames(const History& history, CaseFacts& facts,
                const std::map<int, study::FrameReport>& written, const fs::path& folder) {
  const std::map<int, Reference> references = history.references(facts.name, facts.bench);
  for (const auto& [number, report] : written) {
    const fs::path file = folder / run::framePath("frames", number, ".exr");
    FrameFacts frame{report.pixels, report.counters, report.steps, "", 0, 0};
    std::error_code ignored;
    frame.bytes = fs::file_size(file, ignored);
    const auto accepted = references.find(number);
    if (accepted != references.end() && accepted->second.pixels == report.pixels) {
      fs::remove(file, ignored);
    } else {
      frame.file = fs::relative(file, history.folder()).string();
      frame.notFinite = notFinitePixels(image::readImage(file));
    }
    facts.frames[number] = std::move(frame);
  }
}

/// The truth of frames that changed, and of their neighbours, in a folder that all nights share.
void findTruth(const History& history, const NightCase& one, CaseFacts& facts, Lab& lab) {
  std::vector<int> differing;
  for (const auto& [number, frame] : facts.frames)
    if (facts.differsNear(number)) differing.push_back(number);
  if (one.scene.against.empty() || differing.empty() || one.method == one.scene.against) return;
  NightCase truth = one;
  truth.method = one.scene.against;
  try {
    const fs::path folder = fs::path("truth") / lab.bench(truth).print;
    lab.truth(one, differing, history.folder() / folder);
    facts.truth = folder.string();
  } catch (const InputChanged&) {
    throw;
  } catch (const UsageError& error) {
    throw UsageError(one.name + ": the reference (\"against\" in the suite): " + error.what());
  } catch (const Error& error) {
    log::warning(one.name + ": the reference could not be rendered: " + error.what());
  }
}

std::string machineName() {
  std::array<char, 256> host{};
  ::gethostname(host.data(), host.size() - 1);
  return std::string(host.data()) + ", " + run::processorName();
}

class CaseMeasurement {
 public:
  CaseMeasurement(History& history, const Night& night, const NightCase& one, Lab& lab,
                  const Gates& gates, const NightOptions& options)
      : history_(history), night_(night), one_(one), lab_(lab), gates_(gates), options_(options) {
    facts_.name = one.name;
  }

  CaseFacts measure(bool again) {
    try {
      const BenchFacts bench = lab_.bench(one_);
      facts_.bench = bench.print;
      facts_.description = bench.description;
      facts_.command = bench.command;
    } catch (const InputChanged&) {
      throw;
    } catch (const Error& error) {
      facts_.bench = "none";
      facts_.failure = error.what();
      return facts_;
    }
    programs_ = programsOf(history_, night_, facts_, builds_, options_, again);
    const bool timed = programs_.size() > 1;
    const fs::path folder = history_.nightFolder(night_.id) / one_.name;
    std::error_code ignored;
    fs::remove_all(folder, ignored);  // of a process that was killed
    const Turns first = turns(1, timed ? options_.rounds : 0, false, folder);
    if (!facts_.failure.empty()) return facts_;
    facts_.memory = first.memory;
    keepFrames(history_, facts_, first.written, folder);
    for (int rounds = options_.rounds; timed && rounds < options_.mostRounds; rounds *= 2)
      if (anyRatio(facts_, TimeState::Undecided, gates_.time) || isNoisy(facts_, gates_.again))
        turns(1, rounds, false, {});
    if (facts_.failure.empty() && anyRatio(facts_, TimeState::Fails, gates_.time)) repeat();
    findTruth(history_, one_, facts_, lab_);
    lab_.leave();
    return facts_;
  }

 private:
  /// Renders by all programs that have not failed, and keeps times.
  Turns turns(int attempt, int rounds, bool fresh, const fs::path& writeTo) {
    Turns measured = lab_.measure(one_, programs_, rounds, fresh, writeTo);
    for (const auto& failed : measured.failures) {
      const std::string& name = failed.first;
      if (name == role::kTonight)
        facts_.failure = failed.second;
      else
        facts_.baselineFailures[name] = failed.second;
      std::erase_if(facts_.timings, [&](const Timing& timing) { return timing.role == name; });
      std::erase_if(programs_, [&](const Program& program) { return program.role == name; });
    }
    for (const auto& [name, times] : measured.times)
      if (!times.empty()) append(timingOf(facts_, name, attempt, builds_.at(name)).times, times);
    return measured;
  }

  /// A failure counts when it is there in fresh processes, too.
  void repeat() {
    const study::RoundTimes& first = timingOf(facts_, role::kTonight, 1, night_.build).times;
    const int rounds = static_cast<int>(first.size());
    std::erase_if(programs_, [](const Program& program) { return program.role == role::kAgain; });
    turns(2, rounds, true, {});
  }

  History& history_;
  const Night& night_;
  const NightCase& one_;
  Lab& lab_;
  const Gates& gates_;
  const NightOptions& options_;
  CaseFacts facts_;
  std::vector<Program> programs_;
  std::map<std::string, std::string> builds_;
};

}  // namespace

std::vector<NightCase> casesOf(const NightSuite& suite, const std::string& effort,
                               const std::vector<std::string>& only, Lab& lab) {
  std::vector<NightCase> cases;
  for (const NightScene& scene : suite.scenes) {
    const auto frames = scene.frames.find(effort);
    if (frames == scene.frames.end()) continue;
    const std::vector<std::string> methods =
        scene.methods.empty() ? lab.methods(scene) : scene.methods;
    for (const std::string& method : methods) {
      const std::string name = suite.name + "." + scene.name + "." + method;
      const bool wanted =
          only.empty() || std::any_of(only.begin(), only.end(), [&](const std::string& word) {
            return std::find(scene.tags.begin(), scene.tags.end(), word) != scene.tags.end() ||
                   matchesPattern(name, word) || matchesPattern(name, suite.name + "." + word) ||
                   matchesPattern(scene.name, word) || matchesPattern(method, word);
          });
      if (wanted) cases.push_back({name, scene, method, frames->second});
    }
  }
  if (cases.empty())
    throw UsageError("no case of " + suite.file + " with frames for --effort " + effort +
                     (only.empty() ? "" : " matches --only " + joined(only, ",")));
  return cases;
}

fs::path keptProgram(const History& history, const std::string& build) {
  return buildFolder(history, build) / "bin" / "catoptric";
}

void keepProgram(const History& history, const fs::path& program, const std::string& build) {
  const fs::path folder = buildFolder(history, build);
  std::error_code error;
  if (fs::exists(folder, error)) return;
  const fs::path partial = folder.string() + "." + std::to_string(::getpid()) + ".tmp";
  try {
    fs::remove_all(partial);
    fs::create_directories(partial / "bin");
    fs::copy_file(program, partial / "bin" / "catoptric");
    fs::rename(partial, folder);
  } catch (const fs::filesystem_error& failure) {
    fs::remove_all(partial, error);
    if (fs::exists(folder, error)) return;  // another process was faster
    throw OutputError(folder.string() +
                      ": the program cannot be copied here: " + failure.code().message());
  }
}

std::string keptBuild(const History& history, const std::string& text) {
  std::vector<std::string> kept;
  std::vector<std::string> fitting;
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(history.folder() / "builds", ignored)) {
    const std::string name = entry.path().filename().string();
    if (entry.path().extension() == ".tmp") continue;
    kept.push_back(name);
    if (name.starts_with(text)) fitting.push_back(name);
  }
  if (fitting.size() == 1) return fitting.front();
  std::sort(kept.begin(), kept.end());
  throw UsageError("--baseline " + text + ": " +
                   (fitting.empty() ? "no stored build has a fingerprint that begins so"
                                    : "several stored builds have fingerprints that begin so") +
                   ". Allowed: accepted, anchor, or one of: " +
                   (kept.empty() ? "(no builds are stored yet)" : joined(kept, ", ")));
}

void dropOld(const History& history) {
  const std::set<std::string> used = history.buildsInUse();
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(history.folder() / "builds", ignored))
    if (!used.contains(entry.path().filename().string()) && entry.path().extension() != ".tmp")
      fs::remove_all(entry.path(), ignored);
  const std::vector<Night> newest = history.nights("", kRawNights);
  for (const auto& entry : fs::directory_iterator(history.folder() / "nights", ignored)) {
    const int number = std::atoi(entry.path().filename().c_str());
    if (number > 0 && !newest.empty() && number < newest.back().id)
      fs::remove_all(entry.path(), ignored);
  }
}

void measureNight(History& history, const Night& night, const std::vector<NightCase>& cases,
                  const Gates& gates, Lab& lab, const NightOptions& options) {
  const std::set<std::string> known = history.measured(night.id);
  // In an interrupted night, what has changed since is measured again
  const auto isMeasured = [&](const NightCase& one) {
    if (!known.contains(one.name)) return false;
    try {
      return history.bench(night.id, one.name)->first == lab.bench(one).print;
    } catch (const InputChanged&) {
      throw;
    } catch (const Error&) {
      return true;
    }
  };
  int number = 0;
  for (const NightCase& one : cases) {
    const bool again = number++ % std::max(1, options.againEvery) == 0;
    if (isMeasured(one)) continue;
    if (options.progress)
      options.progress(one.name,
                       static_cast<double>(number - 1) / static_cast<double>(cases.size()));
    CaseMeasurement measurement(history, night, one, lab, gates, options);
    history.addResult(night.id, measurement.measure(again));
  }
}

Night measureSuite(History& history, const NightSuite& suite, const std::string& effort,
                   const std::vector<std::string>& only, Lab& lab, NightOptions options) {
  const std::vector<NightCase> cases = casesOf(suite, effort, only, lab);
  if (options.baseline != role::kAccepted && options.baseline != role::kAnchor)
    options.baseline = keptBuild(history, options.baseline);
  std::string names =
      options.baseline == role::kAccepted ? "" : "against " + options.baseline + "\n";
  for (const NightCase& one : cases) names += one.name + "\n";
  Fingerprint asked;
  asked.add(names);
  Fingerprint build;
  build.add(std::span<const std::byte>(readFile(options.program)));
  const OpenNight open(history, {0, suite.name, asked.text(), effort, machineName(), build.text(),
                                 run::versionText(), utcNow(), "", !only.empty()});
  if (open.resumed()) log::info("night " + std::to_string(open.night().id) + " continues");
  keepProgram(history, options.program, build.text());
  measureNight(history, open.night(), cases, suite.gates, lab, options);
  return open.night();
}

}  // namespace catoptric::nightly
