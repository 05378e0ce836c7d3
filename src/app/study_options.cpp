#include "app/study_options.h"

#include <algorithm>
#include <map>

#include "app/run_options.h"
#include "config/json_text.h"
#include "core/clock.h"
#include "core/file.h"
#include "core/log.h"
#include "core/text.h"
#include "gl/given_shaders.h"
#include "run/folder/machine.h"

namespace catoptric::app {
namespace {

namespace fs = std::filesystem;

/// Frames are written for their errors alone: no previews.
constexpr const char* kStudySetting = "preview.enabled=false";

RunOptions withSettings(const RunOptions& options, const study::Settings& settings,
                        const std::string& method) {
  RunOptions own = options;
  own.settings.insert(own.settings.begin(), kStudySetting);
  for (const auto& [name, value] : settings) own.settings.push_back(name + "=" + value);
  if (method.empty()) return own;
  own.methods = {method};
  own.settings.emplace_back("errors.against=[]");  // frames are compared by the one who asks
  return own;
}

}  // namespace

OptionRow workersRow(int& workers) {
  return option(
      "--workers", workers, "N",
      "Combinations are timed in groups of at most N, fewer if memory is short. A group is "
      "kept in memory and timed in interleaved rounds. One combination is in "
      "all groups, so ratios hold between groups, too",
      {.least = 2, .most = 256, .showsDefault = true});
}

OptionRow patienceRow(double& minutes) {
  return option("--patience", minutes, "MINUTES",
                "Time that a program may take for its start or for a frame, before it is killed",
                {.least = 0.01, .most = 100'000, .showsDefault = true});
}

OptionRow clockRow(std::string& clock) {
  return option("--clock", clock, "CLOCK",
                "Clock of the times: wall, or cpu (the CPU time of all threads; other programs "
                "disturb it less)",
                {.showsDefault = true});
}

OptionRow amortizeRow(int& amortize) {
  return option("--amortize", amortize, "N",
                "Frames that share the cost of all that is built, in the mean time of a frame [the "
                "frames of the path]",
                {.least = 0, .most = 10'000'000});
}

Rows timeRows(StudyOptions& options) {
  return {
      option("--time", options.time, "KIND",
             "Time that counts: steady (of a frame after others), first (of the first frame, "
             "with all that the method builds before it), or mean (of --amortize frames, builds "
             "included). first and mean start every method anew in each round",
             {.showsDefault = true}),
      amortizeRow(options.amortize)};
}

Rows studyRows(StudyOptions& options, CommonOptions& common, int leastRepeats) {
  return runRows(options, common) +
         Rows{
             option("--out", options.out, "DIR",
                    "Folder for the results [out/CONFIG_COMMAND, such as out/demo_sweep]",
                    {.notEmpty = true}),
             option("--against", options.against, "METHOD|DIR",
                    "Reference of the errors: a method, or a folder with frames [the first of the "
                    "config's errors.against]",
                    {.notEmpty = true}),
             option("--repeats", options.repeats, "N",
                    std::string("Timed rounds, after one that warms up") +
                        (leastRepeats == 0 ? "; 0: errors only" : "") +
                        ". Confidence intervals of time ratios need 8 rounds or more",
                    {.least = static_cast<double>(leastRepeats),
                     .most = 1000,
                     .showsDefault = true,
                     .given = &options.repeatsGiven}),
             workersRow(options.workers),
             patienceRow(options.patience),
             option("--budget", options.budget, "MINUTES",
                    "Time for all. When it is over, the frame at hand is the last one, and the "
                    "results are those of what is measured [no limit]",
                    {.least = 0}),
             existingRow(options.existing),
             clockRow(options.clock),
             progressRow(options.progress),
         };
}

study::Inputs studyInputs(const RunOptions& options) {
  return {[options](const study::Settings& settings, const std::string& method) {
            return readRun(withSettings(options, settings, method));
          },
          [options](const study::Settings& settings, const std::string& method) {
            const RunOptions own = withSettings(options, settings, method);
            std::vector<std::string> words{own.input, "-q", "--method", own.methods.front()};
            for (const std::string& setting : own.settings) {
              words.emplace_back("--set");
              words.push_back(setting);
            }
            const auto add = [&](const char* name, const std::string& value) {
              if (value.empty()) return;
              words.emplace_back(name);
              words.push_back(value);
            };
            add("--frames", own.frames);
            add("--camera", own.camera);
            add("--environment", own.environment);
            for (const std::string& folder : own.assetPaths) add("--asset-path", folder);
            add("--ground", own.ground);
            add("--device", own.device);
            add("--threads", own.threads);
            add("--seed", own.seed);
            add("--shader-dir", gl::shaderFolder().string());
            return words;
          }};
}

std::string referenceName(const StudyOptions& options) {
  if (!options.against.empty()) return options.against;
  RunOptions all = options;
  all.methods.clear();
  const run::RunConfig run = readRun(all);
  if (run.errorsAgainst.empty())
    throw UsageError(options.input +
                     ": the config has no errors.against; give the reference of the errors, such "
                     "as --against reference");
  return run.errorsAgainst.front();
}

std::vector<std::string> studiedMethods(const StudyOptions& options, const std::string& against) {
  std::vector<std::string> names;
  for (const run::MethodConfig& method : readRun(options).methods) names.push_back(method.name);
  if (options.methods.empty() && names.size() > 1) std::erase(names, against);
  return names;
}

study::Clock parseClock(const std::string& text) {
  if (text == "wall") return study::Clock::Wall;
  if (text == "cpu") return study::Clock::Cpu;
  const std::vector<std::string> names{"wall", "cpu"};
  throw UsageError("--clock \"" + text + "\"" + didYouMean(text, names) +
                   ": must be one of: wall, cpu");
}

study::TimeKind timeKind(const StudyOptions& options, int pathFrames) {
  study::TimeKind kind;
  kind.clock = parseClock(options.clock);
  const std::map<std::string, study::TimeKind::Of> kinds{{"steady", study::TimeKind::Of::Steady},
                                                         {"first", study::TimeKind::Of::First},
                                                         {"mean", study::TimeKind::Of::Mean}};
  const auto found = kinds.find(options.time);
  const std::vector<std::string> names{"steady", "first", "mean"};
  if (found == kinds.end())
    throw UsageError("--time \"" + options.time + "\"" + didYouMean(options.time, names) +
                     ": must be one of: " + joined(names, ", "));
  kind.of = found->second;
  kind.amortize = options.amortize > 0 ? options.amortize : pathFrames;
  return kind;
}

fs::path studyFolder(const StudyOptions& options, const study::Inputs& inputs,
                     const std::vector<std::string>& methods, const std::string& kind) {
  return options.out.empty() ? "out/" + inputs.readRun({}, methods.front()).name + "_" + kind
                             : options.out;
}

void openStudyFolder(study::Bench& bench, const std::string& existing, const std::string& mark) {
  const fs::path& folder = bench.options().folder;
  const run::Existing how = run::parseExisting(existing);
  std::error_code error;
  // A process that is killed may still be writing the mark.
  const bool empty = std::ranges::all_of(
      fs::directory_iterator(folder, error),
      [](const auto& entry) { return entry.path().filename().string().starts_with(".study."); });
  const fs::path kind = folder / "study";
  if (!empty) {
    const bool ours = fs::exists(kind, error) && readTextFile(kind) == mark + "\n";
    if (how == run::Existing::Error)
      throw OutputError(folder.string() +
                        ": is not empty; choose another folder, or --existing resume or overwrite");
    if (!ours)
      throw OutputError(folder.string() +
                        ": is not overwritten, because it is not the folder of a " + mark +
                        " by this program; choose another folder");
    if (how == run::Existing::Overwrite) study::removeStudy(folder);
  }
  fs::create_directories(folder, error);
  if (error) throw OutputError(folder.string() + ": cannot be created: " + error.message());
  writeFileAtomically(kind, std::string_view(mark + "\n"));
  bench.open();
}

study::Patience patience(double minutes) {
  return {60.0 * minutes, [] { return stopSignal() != 0; }};
}

study::BenchOptions benchOptions(const StudyOptions& options, const fs::path& folder,
                                 ProgressPrinter& printer) {
  study::BenchOptions bench;
  bench.folder = folder;
  bench.repeats = options.repeats;
  bench.workers = options.workers;
  bench.shaders = gl::givenShaders();
  if (options.time != "steady") bench.first = study::FirstFrames::EachRound;
  bench.seed = options.seed.empty() ? 0 : std::stoull(options.seed);
  bench.patience = patience(options.patience);
  if (options.budget > 0.0)
    bench.outOfTime = [start = nowNs(), seconds = 60.0 * options.budget] {
      return secondsSince(start) > seconds;
    };
  bench.progress = [&printer](const std::string& what, double share) {
    printer.showStep(what, std::max(0.0, share));
  };
  return bench;
}

bool measureUnlessStopped(ProgressPrinter& printer, const char* hint,
                          const std::function<void()>& measure) {
  bool stopped = false;
  try {
    measure();
  } catch (const study::StudyStopped&) {
    stopped = true;
  }
  printer.endLine();
  if (stopped && *hint != '\0') log::warning(hint);
  return !stopped;
}

std::string studyContext(const study::Bench& bench) {
  return config::JsonText()
      .raw("machine", run::machineJson())
      .add("renderers",
           std::vector<std::string>(bench.renderers().begin(), bench.renderers().end()))
      .object();
}

}  // namespace catoptric::app
