// catoptric tune.
#include <algorithm>
#include <cmath>
#include <memory>
#include <set>

#include "app/run_options.h"
#include "app/study_options.h"
#include "config/json_text.h"
#include "core/file.h"
#include "core/log.h"
#include "core/text.h"
#include "methods/contract/method.h"
#include "report/html.h"
#include "report/table.h"
#include "study/tune_reflectors.h"
#include "study/tune_settings.h"

namespace catoptric::app {
namespace {

struct TuneCommand : StudyOptions {
  std::vector<std::string> vary;
  std::string maxError;
  std::string maxTime;
  std::string verify = "all";
  std::string testPath;
  double marginPercent = 5.0;
  bool perReflector = false;
  bool dryRun = false;
};

study::Bound boundOf(const TuneCommand& options) {
  if (options.maxError.empty() == options.maxTime.empty())
    throw UsageError(options.maxError.empty()
                         ? "give a bound: --max-error 'L1_8bit<=2' or --max-time 100ms"
                         : "--max-error and --max-time cannot be combined; give one of them");
  return options.maxTime.empty() ? study::parseMaxError(options.maxError)
                                 : study::parseMaxTime(options.maxTime);
}

int verifyFrames(const std::string& text) {
  if (text == "all") return 0;
  try {
    std::size_t end = 0;
    const int count = std::stoi(text, &end);
    if (count > 0 && end == text.size()) return count;
  } catch (const std::exception&) {
  }
  throw UsageError("--verify \"" + text + "\": must be all, or a number of frames");
}

/// What --vary says; without it each method's own options that trade accuracy for time.
std::vector<study::Axis> axesOf(const TuneCommand& options,
                                const std::vector<std::string>& methods) {
  std::vector<study::Axis> axes;
  if (options.vary == std::vector<std::string>{"none"}) return axes;
  for (const std::string& text : options.vary) axes.push_back(study::parseAxis(text));
  for (const study::Axis& axis : axes)
    if (axis.method.empty())
      throw UsageError(
          "--vary " + axis.names.front() +
          ": tune varies options of methods (methods.NAME.OPTION); use `sweep` for other options");
  if (!axes.empty()) return axes;
  for (const run::MethodConfig& method : readRun(options).methods) {
    if (std::find(methods.begin(), methods.end(), method.name) == methods.end()) continue;
    const auto entry = std::ranges::find(methods::registry(), method.id, &methods::MethodEntry::id);
    const std::vector<study::Axis> own = study::automaticAxes(
        method.name, entry->options, config::parseText(method.effective, "options"));
    axes.insert(axes.end(), own.begin(), own.end());
  }
  return axes;
}

struct Tuned {
  study::Bound bound;
  std::string against;
  std::vector<study::Setting> settings;
  study::TimeKind time;
  study::TuneResult result;
};

study::Point onTestPath(const TuneCommand& options, study::Point point) {
  point.settings.emplace_back("path", options.testPath);
  return point;
}

/// What the winner does on another path: reported, whatever it is.
std::string testText(study::Bench& bench, const TuneCommand& options, const Tuned& tuned) {
  const study::Setting setting =
      bench.prepare(onTestPath(options, tuned.settings[*tuned.result.best].point));
  const std::vector<int> frames = bench.frames(setting);
  try {
    bench.findErrors({setting}, frames);
  } catch (const study::BudgetSpent&) {
    return "The time was over before the result was tested on " + options.testPath + ".\n";
  }
  const study::PointErrors& errors = bench.errors(setting);
  const double error = errors.pooled(tuned.bound.metric, frames);
  const int worst = errors.worstFrame(tuned.bound.metric, frames);
  if (worst == 0) return "On " + options.testPath + " no frame has " + tuned.bound.metric + ".\n";
  const double worstError = errors.frames.at(worst).metrics.at(tuned.bound.metric);
  const double judged = tuned.bound.everyFrame ? worstError : error;
  return "On " + options.testPath + ": " + tuned.bound.metric + " " + report::fixedText(error, 3) +
         ", at worst " + report::fixedText(worstError, 3) + " in frame " + std::to_string(worst) +
         (tuned.bound.kind == study::Bound::Kind::Time ? ".\n"
          : judged <= tuned.bound.limit                ? ": the bound holds there, too.\n"
                                                       : ": the bound does NOT hold there.\n");
}

/// Which part of the nearest setting's error keeps it above the bound.
std::string heldBy(const study::PointErrors& errors, const study::Bound& bound) {
  std::vector<int> frames;
  for (const auto& [number, frame] : errors.frames) frames.push_back(number);
  if (bound.everyFrame) frames = {errors.worstFrame(bound.metric, frames)};
  double reflective = 0.0;
  double elsewhere = 0.0;
  for (const int number : frames) {
    const auto frame = errors.frames.find(number);
    if (frame == errors.frames.end()) return "";
    reflective += static_cast<double>(frame->second.reflectivePixels);
    elsewhere += static_cast<double>(frame->second.elsewherePixels);
  }
  const auto pooled = [&](const char* metric) { return errors.pooled(metric, frames); };
  std::string text;
  if (bound.metric == "L1_8bit" && reflective > 0.0) {
    const double others =
        elsewhere > 0.0 ? pooled("L1_8bit_elsewhere") * elsewhere / (reflective + elsewhere) : 0.0;
    text += " Of this error, reflective pixels hold " +
            report::fixedText(pooled("L1_8bit") - others, 3) + " and the other pixels " +
            report::fixedText(others, 3) + ", which no method of reflections changes.";
    if (others > bound.limit)
      text +=
          " The bound cannot be met: bound L1_8bit_reflective instead, or compare with `traced`, "
          "which has the methods' own samples.";
    if (const double bounces = pooled("L1_8bit_bounces"); bounces > bound.limit)
      text += " Bounces after the first are worth " + report::fixedText(bounces, 3) +
              "; L1_8bit_one_bounce leaves them out.";
  }
  if (const double uncertainty = errors.uncertainty(bound.metric, frames);
      uncertainty > bound.limit)
    text += " The reference's own standard error is " + report::fixedText(uncertainty, 3) +
            ", above the bound: lower it by --set methods.reference.max_standard_error=N.";
  return text;
}

/// How many times as long the result takes as `traced`, if both were timed beside each other.
std::string overTraced(const study::Bench& bench, const Tuned& tuned) {
  const std::string& own = tuned.settings[*tuned.result.best].key;
  const auto traced = std::ranges::find_if(tuned.settings, [](const study::Setting& setting) {
    return setting.point.method == "traced";
  });
  if (traced == tuned.settings.end() || traced->key == own) return "";
  const study::Samples* most = nullptr;
  for (const study::Samples& samples : bench.samples())
    if (samples.find(own) && samples.find(traced->key) &&
        (most == nullptr || samples.frames.size() > most->frames.size()))
      most = &samples;
  if (most == nullptr) return "";
  const auto times = [&](const std::string& key) {
    return most->measurement.times(*most->find(key), tuned.time);
  };
  return ", " + study::ratioText(study::pairedRatio(times(own), times(traced->key))) +
         " times that of " + traced->text();
}

std::string resultText(study::Bench& bench, const Tuned& tuned) {
  const study::TuneResult& result = tuned.result;
  const std::size_t tried = [&] {
    std::set<std::size_t> all;
    for (const study::Trial& trial : result.trials) all.insert(trial.candidate);
    return all.size();
  }();
  const std::string effort = " (" + std::to_string(tried) + " of " +
                             std::to_string(result.combinations) + " combinations tried)";
  if (!result.best) {
    std::string text = (result.outOfTime ? "The budget was spent before anything was verified to "
                                           "satisfy "
                                         : "Nothing satisfies ") +
                       tuned.bound.text + effort + ".";
    if (result.nearest)
      text += " Nearest: " + tuned.settings[*result.nearest].text() + ", " + tuned.bound.metric +
              " " + report::fixedText(result.error, 3) + ", " +
              (std::isfinite(result.seconds) ? report::fixedText(1e3 * result.seconds, 1) + " ms."
                                             : std::string("not timed."));
    if (result.nearest && tuned.bound.kind == study::Bound::Kind::Error)
      text += heldBy(bench.errors(tuned.settings[*result.nearest]), tuned.bound);
    const bool undecided = std::ranges::any_of(result.trials, [&](const study::Trial& trial) {
      return trial.candidate == result.nearest && trial.verdict == "undecided";
    });
    if (undecided)
      text +=
          " This time could not be distinguished from the bound: try more --repeats, --clock cpu, "
          "or a machine that does nothing else.";
    return text + "\n";
  }
  return tuned.settings[*result.best].text() + ": " + report::fixedText(1e3 * result.seconds, 1) +
         " ms (" + study::timeName(tuned.time) + ")" + overTraced(bench, tuned) + "; " +
         tuned.bound.metric + " " + report::fixedText(result.error, 3) + " against " +
         tuned.against + ", at worst " + report::fixedText(result.worstError, 3) + " in frame " +
         std::to_string(result.worstFrame) + ". " + tuned.bound.text + " " +
         (result.verifiedOnAll
              ? "holds on all frames"
              : "holds on the tested frames, which guarantees nothing for the others") +
         effort + ".\n";
}

study::BenchOptions tuneBench(const TuneCommand& options, const std::filesystem::path& folder,
                              ProgressPrinter& printer) {
  study::BenchOptions bench = benchOptions(options, folder, printer);
  if (options.time == "steady") bench.first = study::FirstFrames::Never;  // nobody reads them
  return bench;
}

/// tune --per-reflector, once all options are checked.
ExitCode tuneMixture(TuneCommand options, const study::Bound& bound, ProgressPrinter& printer) {
  if (!options.vary.empty() || options.budget > 0.0 || options.dryRun)
    throw UsageError("--per-reflector cannot be combined with --vary, --budget or --dry-run");
  const std::string against = referenceName(options);
  const std::vector<std::string> methods = studiedMethods(options, against);
  options.settings.emplace_back(R"(image.layers=["s","id"])");  // whose pixels are whose
  const study::Inputs inputs = studyInputs(options);
  const std::filesystem::path folder = studyFolder(options, inputs, methods, "reflectors");
  study::Bench bench(inputs, tuneBench(options, folder, printer));
  bench.setReference(against);
  const study::Setting first = bench.prepare({methods.front(), {}, "", ""});
  bench.checkReference({first});
  const study::TimeKind time = timeKind(options, bench.pathFrames(first));
  bench.setTime(time);
  openStudyFolder(bench, options.existing, "reflectors");
  catchStopSignals(false);
  study::MixtureResult result;
  if (!measureUnlessStopped(printer, "",
                            [&] { result = study::tuneReflectors(bench, methods, bound, time); }))
    return stoppedCode();
  report::HtmlPage page("A method for each reflector, for " + bound.text);
  page.paragraph(result.text);
  std::string text = result.text;
  report::writeTables(folder, "table", result.tables);
  for (const report::Table& table : result.tables) {
    page.table(table);
    text += "\n" + fittedText(table);
  }
  page.details("Machine", studyContext(bench));
  writeFileAtomically(folder / "report.html", std::string_view(page.text()));
  if (result.best) study::writeTunedConfig(*result.best, folder, result.text);
  bench.clear();
  printData(text);
  return result.best ? ExitCode::Done : ExitCode::LimitsExceeded;
}

ExitCode tune(const TuneCommand& options, const CommonOptions& common) {
  const ProgressMode mode = parseProgress(options.progress, common.quiet);
  ProgressPrinter printer(mode);
  Tuned tuned;
  tuned.bound = boundOf(options);
  study::TuneTimes times{timeKind(options, 1), {}};
  study::TuneOptions tuneOptions;
  tuneOptions.bound = tuned.bound;
  tuneOptions.verifyFrames = verifyFrames(options.verify);
  tuneOptions.margin = 0.01 * options.marginPercent;
  tuneOptions.seed = options.seed.empty() ? 0 : std::stoull(options.seed);
  if (options.repeats < study::kLeastRounds && tuned.bound.kind == study::Bound::Kind::Time)
    throw UsageError("--max-time " + tuned.bound.text +
                     " needs --repeats 8 or more: fewer rounds give no confidence interval");
  if (options.perReflector) return tuneMixture(options, tuned.bound, printer);

  tuned.against = referenceName(options);
  const std::vector<std::string> methods = studiedMethods(options, tuned.against);
  const study::Inputs inputs = studyInputs(options);
  const std::filesystem::path folder = studyFolder(options, inputs, methods, "tune");
  study::Bench bench(inputs, tuneBench(options, folder, printer));
  bench.setReference(tuned.against);
  bench.setMetrics({tuned.bound.metric});
  for (const study::Point& point : study::makePoints(methods, axesOf(options, methods), {}))
    tuned.settings.push_back(bench.prepare(point));
  bench.checkReference(tuned.settings);
  if (!options.testPath.empty()) bench.prepare(onTestPath(options, tuned.settings.front().point));
  tuneOptions.frames = bench.frames(tuned.settings.front());
  tuned.time = times.kind = timeKind(options, bench.pathFrames(tuned.settings.front()));
  bench.setTime(tuned.time);
  if (!tuned.bound.timeOf.empty()) times.timeOf = bench.prepare({tuned.bound.timeOf, {}, "", ""});
  if (options.dryRun) {
    printData(study::tuneForecast(tuned.settings, tuneOptions.frames, options.repeats));
    return ExitCode::Done;
  }
  openStudyFolder(bench, options.existing, "tune");

  catchStopSignals(mode == ProgressMode::Json);
  std::string text;
  const auto measure = [&] {
    tuned.result = study::tuneSettings(bench, tuned.settings, times, tuneOptions);
    text = resultText(bench, tuned);
    if (tuned.result.best && !options.testPath.empty()) text += testText(bench, options, tuned);
  };
  if (!measureUnlessStopped(printer, kResumeHint, measure)) return stoppedCode();
  study::writeTrials(bench, tuned.result, tuned.settings);
  if (tuned.result.best) study::writeTunedConfig(tuned.settings[*tuned.result.best], folder, text);
  report::HtmlPage page("Tuned for " + tuned.bound.text);
  page.paragraph(text);
  const std::string curve =
      study::toSvg(study::trialChart(tuned.result, tuned.settings, tuned.bound, tuned.time));
  page.svg(curve);
  writeFileAtomically(folder / "tradeoff.svg", std::string_view(curve));
  const report::Table trials =
      study::trialTable(tuned.result, tuned.settings, tuned.bound.metric, tuned.time);
  report::writeTables(folder, "table", std::span(&trials, 1));
  page.table(trials);
  page.details("Machine", studyContext(bench));
  writeFileAtomically(folder / "report.html", std::string_view(page.text()));
  bench.clear();
  printData(common.json ? config::JsonText()
                                  .add("satisfied", tuned.result.best.has_value())
                                  .add("text", text)
                                  .object() +
                              "\n"
                        : text);
  if (tuned.result.best) log::info("the run config is " + (folder / "tuned.json").string());
  if (tuned.result.best) return ExitCode::Done;
  return bench.failures().empty() ? ExitCode::LimitsExceeded : ExitCode::FramesFailed;
}

}  // namespace

Command tuneCommand(CommonOptions& common) {
  const auto options = std::make_shared<TuneCommand>();
  const Rows own = {
      option("--max-error", options->maxError, "BOUND",
             "Bound on an error measure: 'L1_8bit<=2' for all frames together, 'L1_8bit<=2 "
             "every-frame' for each frame",
             {.notEmpty = true}),
      option("--max-time", options->maxTime, "BOUND",
             "Bound on the time per frame: 100ms, or 0.8x:traced (0.8 times that of a method)",
             {.notEmpty = true}),
      option("--vary", options->vary, "NAME=VALUES",
             "An option of a method and the values to try, as for `sweep`. The word none: only the "
             "methods as they are in the config. [the options and values for which docs/config.md "
             "says \"`tune` tries\"]",
             {.oneEach = true}),
      flag("--per-reflector", options->perReflector,
           "Choose a method for each reflector: the fastest choice within --max-error"),
      option("--verify", options->verify, "all|N",
             "Number of frames on which the result's error is verified. The bound is guaranteed "
             "only if this is \"all\"",
             {.showsDefault = true}),
      option("--test-path", options->testPath, "PATH",
             "Also report the result's error on this camera path", {.notEmpty = true}),
      option("--margin", options->marginPercent, "PERCENT",
             "Safety margin: predictions must be below the bound by this percentage of it",
             {.least = 0, .most = 50, .showsDefault = true}),
      flag("--dry-run", options->dryRun, "List the combinations, and write nothing"),
  };
  return {"tune",
          "Find the fastest option values within an error bound, or the most accurate ones within "
          "a time bound.",
          studyRows(*options, common, 1) + timeRows(*options) + own,
          R"(Examples:
  catoptric tune configs/living_room.json --method second_order --max-error 'L1_8bit<=2' \
      --vary methods.second_order.level_error=0..1:5 --vary methods.second_order.bin_density=2.5,10,40
  catoptric tune configs/demo.json --max-time 0.8x:traced --vary methods.second_order.level_error=0,0.75
)" + exitCodes({{"2"},
                {"5"},
                {"7", "nothing satisfies the bound; the nearest combination is printed"},
                {"128 + N"}}),
          [options, &common] { return tune(*options, common); }};
}

}  // namespace catoptric::app
