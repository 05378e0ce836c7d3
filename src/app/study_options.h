// Options of the commands that measure, and the conversion of settings to run configs.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "app/commands.h"
#include "app/progress_printer.h"
#include "app/stop_signals.h"
#include "study/bench.h"

namespace catoptric::app {

struct StudyOptions : RunOptions {
  std::string against;
  int repeats = 8;
  bool repeatsGiven = false;
  int workers = 8;
  double patience = 30.0;  ///< minutes
  double budget = 0.0;     ///< minutes; 0: no limit
  std::string existing = "error";
  std::string progress = "auto";
  std::string clock = "wall";
  std::string time = "steady";
  int amortize = 0;  ///< 0: the frames of the path
};

OptionRow workersRow(int& workers);
OptionRow patienceRow(double& minutes);
OptionRow clockRow(std::string& clock);
OptionRow amortizeRow(int& amortize);
/// --time and --amortize.
Rows timeRows(StudyOptions& options);

/// Options of a run, and --out, --against, --repeats, --workers, --patience, --budget, --existing,
/// --clock, --progress.
Rows studyRows(StudyOptions& options, CommonOptions& common, int leastRepeats);

/// Functions that turn a study's settings into run configs and into command lines of workers.
study::Inputs studyInputs(const RunOptions& options);

/// The method or folder to compare with: --against, or the first of the config's errors.against.
/// Throws UsageError if there is none.
std::string referenceName(const StudyOptions& options);

/// The names of the studied methods: those of --method, otherwise the config's except the
/// reference.
std::vector<std::string> studiedMethods(const StudyOptions& options, const std::string& against);

study::Clock parseClock(const std::string& text);
/// The time that --clock, --time and --amortize name, for a path of `pathFrames` frames.
study::TimeKind timeKind(const StudyOptions& options, int pathFrames);

/// How long a worker may give no answer: this many minutes, or until a signal has asked the program
/// to stop.
study::Patience patience(double minutes);

/// The folder of --out, otherwise out/NAME_KIND, where NAME is the config's name.
std::filesystem::path studyFolder(const StudyOptions& options, const study::Inputs& inputs,
                                  const std::vector<std::string>& methods, const std::string& kind);

/// Prepares the folder of the bench, which measures and stores the results, as --existing says.
/// `mark`: the kind of study, which is stored in the folder; a folder of another kind is refused.
/// Throws UsageError, OutputError.
void openStudyFolder(study::Bench& bench, const std::string& existing, const std::string& mark);

/// The options of the bench of a study in `folder`, whose budget begins now; `printer` shows the
/// progress.
study::BenchOptions benchOptions(const StudyOptions& options, const std::filesystem::path& folder,
                                 ProgressPrinter& printer);

/// Runs `measure`. Returns false if it was asked to stop; `hint` tells how to continue.
bool measureUnlessStopped(ProgressPrinter& printer, const char* hint,
                          const std::function<void()>& measure);

inline constexpr const char* kResumeHint =
    "stopped; measurements are kept; continue with --existing resume";

/// JSON that describes where the times were measured.
std::string studyContext(const study::Bench& bench);

}  // namespace catoptric::app
