// catoptric sweep.
#include "study/sweep.h"

#include <algorithm>
#include <memory>

#include "app/run_options.h"
#include "app/study_options.h"
#include "config/json_text.h"
#include "core/log.h"
#include "core/text.h"

namespace catoptric::app {
namespace {

struct SweepOptions : StudyOptions {
  std::vector<std::string> vary;
  std::vector<std::string> link;
  std::vector<std::string> where;
  std::vector<std::string> metrics;
  std::string ratioTo;
  std::string keepFrames = "none";
  bool dryRun = false;
};

/// With what the config's "sweep" says where the command line says nothing.
SweepOptions withConfig(SweepOptions options) {
  const run::RunConfig run = readRun(options);
  const run::SweepConfig& config = run.sweep;
  if (options.vary.empty()) {
    options.vary = config.vary;
    if (options.link.empty()) options.link = config.link;
    if (options.where.empty()) options.where = config.where;
  }
  if (options.metrics.empty()) options.metrics = config.metrics;
  if (options.against.empty() && !config.against.empty()) {
    // A folder is named relative to the config.
    const std::filesystem::path folder = run.file.parent_path() / config.against;
    std::error_code ignored;
    options.against =
        std::filesystem::is_directory(folder, ignored) ? folder.string() : config.against;
  }
  if (options.ratioTo.empty()) options.ratioTo = config.ratioTo;
  if (!options.repeatsGiven) options.repeats = config.repeats;
  return options;
}

std::vector<study::Point> pointsOf(const SweepOptions& options,
                                   const std::vector<std::string>& methods) {
  std::vector<study::Axis> axes;
  for (const std::string& text : options.vary) axes.push_back(study::parseAxis(text));
  for (const std::string& link : options.link) study::linkAxes(axes, link);
  std::vector<study::Condition> conditions;
  for (const std::string& where : options.where) conditions.emplace_back(where, axes);
  return study::makePoints(methods, axes, conditions);
}

void checkOptions(const SweepOptions& options, const std::vector<std::string>& methods) {
  for (const std::string& metric : options.metrics) study::requireMetric(metric);
  if (options.keepFrames != "none" && options.keepFrames != "all")
    throw UsageError("--keep-frames \"" + options.keepFrames + "\": must be one of: none, all");
  if (!options.ratioTo.empty() &&
      std::find(methods.begin(), methods.end(), options.ratioTo) == methods.end())
    throw UsageError("--ratio-to \"" + options.ratioTo + "\": the sweep has no such method" +
                     didYouMean(options.ratioTo, methods) + "; it has " + joined(methods, ", "));
}

std::string dryRunText(study::Bench& bench, const std::vector<study::Setting>& settings) {
  std::string text;
  std::size_t renders = 0;
  for (std::size_t i = 0; i < settings.size(); ++i) {
    text += std::to_string(i + 1) + ": " + settings[i].text() + "\n";
    renders +=
        bench.frames(settings[i]).size() * static_cast<std::size_t>(bench.options().repeats + 1);
  }
  return text + std::to_string(settings.size()) + " points, " + std::to_string(renders) +
         " frames to render (" + std::to_string(bench.options().repeats) +
         " timed rounds and one that warms up), and those of the reference\n";
}

ExitCode sweep(const SweepOptions& given, const CommonOptions& common) {
  const SweepOptions options = withConfig(given);
  const ProgressMode mode = parseProgress(options.progress, common.quiet);
  ProgressPrinter printer(mode);
  study::SweepRequest request;
  timeKind(options, 1);  // says what is wrong before anything is loaded
  request.metrics = options.metrics;
  request.ratioTo = options.ratioTo;
  request.against = referenceName(options);
  const std::vector<std::string> methods = studiedMethods(options, request.against);
  checkOptions(options, methods);
  request.points = pointsOf(options, methods);
  const study::Inputs inputs = studyInputs(options);
  request.name = inputs.readRun({}, methods.front()).name;
  const std::filesystem::path folder = studyFolder(options, inputs, methods, "sweep");

  study::BenchOptions benchWith = benchOptions(options, folder, printer);
  benchWith.keepFrames = options.keepFrames == "all";
  study::Bench bench(inputs, benchWith);
  bench.setReference(request.against);
  bench.setMetrics(request.metrics);
  std::vector<study::Setting> settings;
  for (const study::Point& point : request.points) settings.push_back(bench.prepare(point));
  bench.checkReference(settings);
  request.time = timeKind(options, bench.pathFrames(settings.front()));
  bench.setTime(request.time);
  if (options.dryRun) {
    printData(dryRunText(bench, settings));
    return ExitCode::Done;
  }
  openStudyFolder(bench, options.existing, "sweep");

  catchStopSignals(mode == ProgressMode::Json);
  if (!measureUnlessStopped(printer, kResumeHint,
                            [&] { study::runSweep(bench, request, settings); }))
    return stoppedCode();
  const study::SweepResult result = study::evaluateSweep(bench, request, settings);
  study::writeSweep(bench, result, studyContext(bench));
  bench.clear();
  printData(common.json ? study::sweepJson(result, studyContext(bench)) + "\n"
                        : fittedText(study::sweepTable(result)));
  log::info("curves: " + (folder / "report.html").string());
  return bench.failures().empty() ? ExitCode::Done : ExitCode::FramesFailed;
}

}  // namespace

Command sweepCommand(CommonOptions& common) {
  const auto options = std::make_shared<SweepOptions>();
  const Rows own = {
      option("--vary", options->vary, "NAME=VALUES",
             "An option and its values: methods.NAME.OPTION=A,B,C. FROM..TO:COUNT stands for "
             "evenly spaced values, log:FROM..TO:COUNT for evenly spaced logarithms. "
             "`program=FILE,FILE` compares builds of catoptric. Repeat --vary for several options",
             {.oneEach = true}),
      option("--link", options->link, "A,B",
             "Options that change together, value by value, instead of in all combinations",
             {.oneEach = true}),
      option("--where", options->where, "CONDITION",
             "Measure only combinations of values that satisfy this, such as \"rays<=16 && "
             "samples>2\"",
             {.oneEach = true}),
      option("--metric", options->metrics, "NAME",
             "Error measures of docs/measuring.md, separated by commas; the first is plotted "
             "against time [L1_8bit]",
             {.commas = true, .oneEach = true}),
      option("--ratio-to", options->ratioTo, "METHOD",
             "Baseline of time ratios: the first combination of this method [the first of all "
             "combinations]"),
      option("--keep-frames", options->keepFrames, "WHICH",
             "Frames that are kept: none (they are deleted once their errors are measured), or all",
             {.showsDefault = true}),
      flag("--dry-run", options->dryRun, "List the combinations, and write nothing"),
  };
  return {
      "sweep", "Measure time and error for every combination of values of some options.",
      studyRows(*options, common, 0) + timeRows(*options) + own,
      R"(The config's section "sweep" may set vary, link, where, metric, against, ratio_to and repeats;
options of the command line replace them.

Examples:
  catoptric sweep configs/living_room.json --method second_order --frames 1-900x90 \
      --vary methods.second_order.level_error=0,0.375,0.75
  catoptric sweep configs/demo.json --vary image.width=128,256,512 --vary image.height=128,256,512 \
      --link image.width,image.height --against reference
)" + exitCodes({{"2"}, {"5"}, {"6", "some combinations failed"}, {"128 + N"}}),
      [options, &common] { return sweep(*options, common); }};
}

}  // namespace catoptric::app
