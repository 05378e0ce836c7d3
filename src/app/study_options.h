// What the commands that measure have in common: options, and how settings become run configs.
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
  std::string existing = "error";
  std::string progress = "auto";
  std::string clock = "wall";
};

/// The options of a run and --out, --against, --repeats, --workers, --existing, --clock,
/// --progress.
Rows studyRows(StudyOptions& options, CommonOptions& common);

/// Settings of a study become run configs and command lines of workers.
study::Inputs studyInputs(const RunOptions& options);

/// The method or folder to compare with: --against, or the first of the config's errors.against.
/// Throws UsageError when there is none.
std::string referenceName(const StudyOptions& options);

/// Names of the methods that are studied: those of --method, else all of the config but the
/// reference.
std::vector<std::string> studiedMethods(const StudyOptions& options, const std::string& against);

study::Measurement::Clock parseClock(const std::string& text);

/// --out, or out/NAME_KIND.
std::filesystem::path studyFolder(const StudyOptions& options, const study::Inputs& inputs,
                                  const std::vector<std::string>& methods, const std::string& kind);

/// Prepares the bench's folder as --existing says; `mark` is what it keeps of a study's kind.
/// Throws UsageError, OutputError.
void openStudyFolder(study::Bench& bench, const std::string& existing, const std::string& mark);

/// Options of the bench of a study in `folder`; progress goes to `printer`.
study::BenchOptions benchOptions(const StudyOptions& options, const std::filesystem::path& folder,
                                 ProgressPrinter& printer);

/// Runs `measure`; false: it was asked to stop, and `hint` says how to go on.
bool measureUnlessStopped(ProgressPrinter& printer, const char* hint,
                          const std::function<void()>& measure);

inline constexpr const char* kResumeHint =
    "stopped; what was measured is kept: go on with --existing resume";

/// JSON of where the times were measured.
std::string studyContext(const study::Bench& bench);

}  // namespace catoptric::app
