// catoptric tune.
#include "study/tune.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <set>

#include "app/run_options.h"
#include "app/study_options.h"
#include "app/tune_reflectors.h"
#include "config/json_text.h"
#include "core/clock.h"
#include "core/file.h"
#include "core/log.h"
#include "core/text.h"
#include "methods/contract/method.h"
#include "report/table.h"
#include "scene/camera.h"
#include "study/page.h"

namespace catoptric::app {
namespace {

using study::Measurement;

struct TuneCommand : StudyOptions {
  std::vector<std::string> vary;
  std::string maxError;
  std::string maxTime;
  std::string verify = "all";
  std::string testPath;
  double marginPercent = 5.0;
  double budgetMinutes = 0.0;
  bool perReflector = false;
};

/// The settings of a study, measured by its bench.
class BenchWorld : public study::TuneWorld {
 public:
  BenchWorld(study::Bench& bench, std::vector<study::Setting> settings, const study::Bound& bound,
             Measurement::Clock clock, double budgetSeconds, std::optional<study::Setting> timeOf)
      : bench_(bench),
        settings_(std::move(settings)),
        bound_(bound),
        clock_(clock),
        budgetSeconds_(budgetSeconds),
        timeOf_(std::move(timeOf)) {}

  std::vector<double> errors(std::size_t i, const std::vector<int>& frames) override {
    bench_.findErrors({settings_[i]}, frames);
    std::vector<double> values;
    for (const int frame : frames) {
      const auto& known = bench_.errors(settings_[i]).frames;
      const auto found = known.find(frame);
      if (found == known.end()) return {};
      const auto value = found->second.metrics.find(bound_.metric);
      values.push_back(value == found->second.metrics.end() ? 0.0 : value->second);
    }
    return values;
  }

  double pooled(std::size_t i, const std::vector<int>& frames) override {
    return bench_.errors(settings_[i]).pooled(bound_.metric, frames);
  }

  std::map<std::size_t, study::MeasuredTime> times(const std::vector<std::size_t>& of,
                                                   const std::vector<int>& frames,
                                                   int measurements) override {
    std::map<std::size_t, study::MeasuredTime> result;
    // All batches have the same setting among them: their times are made from ratios to it.
    const study::Setting base = timeOf_ ? *timeOf_ : settings_[of.front()];
    for (std::size_t next = 0; next < of.size();) {
      std::vector<study::Setting> batch{base};
      std::vector<std::size_t> own;
      while (next < of.size() && batch.size() < std::max<std::size_t>(2, bench_.capacity())) {
        own.push_back(of[next]);
        if (settings_[of[next++]].key != base.key) batch.push_back(settings_[own.back()]);
      }
      const std::map<std::string, study::RoundTimes> all = measured(batch, frames, measurements);
      if (!all.contains(base.key)) continue;
      const study::RoundTimes& ofBase = all.at(base.key);
      if (baseSeconds_[base.key] == 0.0) baseSeconds_[base.key] = study::frameSeconds(ofBase).mean;
      for (const std::size_t i : own) {
        const auto at = all.find(settings_[i].key);
        if (at == all.end()) continue;
        const study::Ratio ratio = study::pairedRatio(at->second, ofBase);
        const double seconds = baseSeconds_[base.key] * ratio.value;
        const study::RoundTimes second(at->second.size(),
                                       std::vector<double>(at->second.front().size(), 1.0));
        result[i] = {seconds, timeOf_ ? ratio : study::pairedRatio(at->second, second)};
      }
    }
    return result;
  }

  bool outOfTime() const override {
    return budgetSeconds_ > 0.0 && secondsSince(start_) > budgetSeconds_;
  }

 private:
  /// Times by key, of so many measurements together; what was measured by this or an earlier
  /// process is taken as it is.
  std::map<std::string, study::RoundTimes> measured(const std::vector<study::Setting>& batch,
                                                    const std::vector<int>& frames,
                                                    int measurements) {
    std::map<std::string, study::RoundTimes> times;
    const auto join = [&](const study::Samples& samples) {
      for (const study::Setting& setting : batch) {
        const auto at = samples.find(setting.key);
        if (!at) continue;
        study::RoundTimes& all = times[setting.key];
        for (std::vector<double>& round : samples.measurement.times(*at, clock_))
          all.push_back(std::move(round));
      }
    };
    for (const study::Samples& samples : bench_.samples())
      if (measurements > 0 && samples.frames == frames &&
          samples.repeats >= bench_.options().repeats &&
          std::ranges::all_of(batch, [&](const study::Setting& setting) {
            return samples.find(setting.key).has_value();
          })) {
        join(samples);
        --measurements;
      }
    for (; measurements > 0; --measurements) join(bench_.measure(batch, frames, false));
    return times;
  }

  study::Bench& bench_;
  std::vector<study::Setting> settings_;
  study::Bound bound_;
  Measurement::Clock clock_;
  double budgetSeconds_;
  std::optional<study::Setting> timeOf_;
  std::map<std::string, double> baseSeconds_;
  const std::int64_t start_ = nowNs();
};

/// The point's place in its method's lattice.
std::vector<study::Candidate> candidatesOf(const std::vector<study::Point>& points) {
  std::vector<std::string> methods;
  std::map<std::string, std::map<std::string, std::vector<std::string>>> values;
  std::vector<study::Candidate> candidates;
  for (const study::Point& point : points) {
    auto method = std::find(methods.begin(), methods.end(), point.method);
    if (method == methods.end()) method = methods.insert(method, point.method);
    study::Candidate candidate{static_cast<int>(method - methods.begin()), {}};
    for (const auto& [name, value] : point.settings) {
      std::vector<std::string>& known = values[point.method][name];
      const auto at = std::find(known.begin(), known.end(), value);
      candidate.values.push_back(static_cast<int>(at - known.begin()));
      if (at == known.end()) known.push_back(value);
    }
    candidates.push_back(std::move(candidate));
  }
  return candidates;
}

study::Bound boundOf(const TuneCommand& options) {
  if (options.maxError.empty() == options.maxTime.empty())
    throw UsageError(options.maxError.empty()
                         ? "name what is wanted: --max-error 'L1_8bit<=2' or --max-time 100ms"
                         : "--max-error and --max-time contradict each other: name one of them");
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
      throw UsageError("--vary " + axis.names.front() +
                       ": tune varies options of methods (methods.NAME.OPTION); `sweep` measures "
                       "others");
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

/// A run config of one setting, with what is known of it.
std::string tunedJson(const study::Setting& setting, const std::filesystem::path& folder,
                      const std::string& evidence) {
  const config::Value all = config::parseText(setting.run.effective, "effective config");
  const auto relative = [&](const std::string& name) {
    return std::filesystem::proximate(name, folder).generic_string();
  };
  const config::Value entry = all.get("methods").asArray().front();
  config::JsonText method;
  method.add("method", entry.get("method").asString()).add("name", entry.get("name").asString());
  for (const std::string& name : entry.get("options").keys())
    method.raw(name, entry.get("options").get(name).dump());
  if (entry.has("reflectors")) {
    config::JsonText rules;
    for (const std::string& reflector : entry.get("reflectors").keys()) {
      const config::Value rule = entry.get("reflectors").get(reflector);
      config::JsonText one;
      one.add("method", rule.get("method").asString());
      for (const std::string& name : rule.get("options").keys())
        one.raw(name, rule.get("options").get(name).dump());
      rules.raw(reflector, one.object());
    }
    method.raw("reflectors", rules.object());
  }
  config::JsonText text;
  text.raw("comment", evidence).add("scene", relative(all.get("scene").asString()));
  if (!all.get("path").asString().empty()) text.add("path", relative(all.get("path").asString()));
  if (!all.get("environment").asString().empty())
    text.add("environment", all.get("environment").asString());
  return text.add("frames", all.get("frames").asString())
             .raw("image", all.get("image").dump())
             .raw("methods", "[" + method.object() + "]")
             .raw("seed", all.get("seed").dump())
             .object() +
         "\n";
}

std::string trialJson(const study::Trial& trial, const study::Setting& setting) {
  return config::JsonText()
      .add("stage", trial.stage)
      .add("setting", setting.text())
      .add("frames", trial.frames)
      .add("error", trial.error)
      .add("seconds", trial.seconds)
      .add("verdict", trial.verdict)
      .object();
}

report::Table trialTable(const study::TuneResult& result,
                         const std::vector<study::Setting>& settings, const std::string& metric) {
  report::Table table;
  table.columns = {{"stage", false}, {"setting", false}, {"frames", true},
                   {metric, true},   {"ms", true},       {"", false}};
  for (const study::Trial& trial : result.trials)
    table.rows.push_back({trial.stage, settings[trial.candidate].text(),
                          std::to_string(trial.frames), report::fixedText(trial.error, 3),
                          report::fixedText(1e3 * trial.seconds, 1), trial.verdict});
  return table;
}

struct Tuned {
  study::Bound bound;
  std::string against;
  std::vector<study::Setting> settings;
  study::TuneResult result;
};

/// What the winner does on another path: reported, whatever it is.
std::string testText(study::Bench& bench, const TuneCommand& options, const Tuned& tuned) {
  study::Point point = tuned.settings[*tuned.result.best].point;
  point.settings.emplace_back("path", options.testPath);
  const study::Setting setting = bench.prepare(point);
  const std::vector<int> frames = bench.frames(setting);
  bench.findErrors({setting}, frames);
  const study::PointErrors& errors = bench.errors(setting);
  const double error = errors.pooled(tuned.bound.metric, frames);
  const int worst = errors.worstFrame(tuned.bound.metric, frames);
  const double worstError = errors.frames.at(worst).metrics.at(tuned.bound.metric);
  const double judged = tuned.bound.everyFrame ? worstError : error;
  return "On " + options.testPath + ": " + tuned.bound.metric + " " + report::fixedText(error, 3) +
         ", at worst " + report::fixedText(worstError, 3) + " in frame " + std::to_string(worst) +
         (tuned.bound.kind == study::Bound::Kind::Time ? ".\n"
          : judged <= tuned.bound.limit                ? ": the bound holds there, too.\n"
                                                       : ": the bound does NOT hold there.\n");
}

std::string resultText(const Tuned& tuned) {
  const study::TuneResult& result = tuned.result;
  const std::size_t tried = [&] {
    std::set<std::size_t> all;
    for (const study::Trial& trial : result.trials) all.insert(trial.candidate);
    return all.size();
  }();
  const std::string effort = " (" + std::to_string(tried) + " of " +
                             std::to_string(result.combinations) + " combinations looked at)";
  if (!result.best) {
    std::string text = "Nothing satisfies " + tuned.bound.text + effort + ".";
    if (result.nearest)
      text += " Nearest: " + tuned.settings[*result.nearest].text() + ", " + tuned.bound.metric +
              " " + report::fixedText(result.error, 3) + ", " +
              report::fixedText(1e3 * result.seconds, 1) + " ms.";
    const bool undecided = std::ranges::any_of(result.trials, [&](const study::Trial& trial) {
      return trial.candidate == result.nearest && trial.verdict == "undecided";
    });
    if (undecided)
      text +=
          " That time could not be told from the bound: try more --repeats, --clock cpu, or a"
          " machine that does nothing else.";
    return text + "\n";
  }
  return tuned.settings[*result.best].text() + ": " + report::fixedText(1e3 * result.seconds, 1) +
         " ms per frame; " + tuned.bound.metric + " " + report::fixedText(result.error, 3) +
         " against " + tuned.against + ", at worst " + report::fixedText(result.worstError, 3) +
         " in frame " + std::to_string(result.worstFrame) + ". " + tuned.bound.text + " " +
         (result.verifiedOnAll ? "holds on all frames"
                               : "held on the frames that were looked at, which is no proof") +
         effort + ".\n";
}

void writeTuned(const study::Bench& bench, const Tuned& tuned, const std::string& text) {
  const std::filesystem::path& folder = bench.options().folder;
  std::string trials;
  for (const study::Trial& trial : tuned.result.trials)
    trials += trialJson(trial, tuned.settings[trial.candidate]) + "\n";
  writeFileAtomically(folder / "trials.jsonl", std::string_view(trials));
  std::string samples;
  for (const study::Samples& one : bench.samples())
    samples += study::samplesCsv(one, samples.empty());
  writeFileAtomically(folder / "samples.csv", std::string_view(samples));
  if (tuned.result.best)
    writeFileAtomically(folder / "tuned.json",
                        std::string_view(tunedJson(tuned.settings[*tuned.result.best], folder,
                                                   config::jsonString(text))));
  study::Page page("Tuned for " + tuned.bound.text);
  page.paragraph(text);
  page.table(trialTable(tuned.result, tuned.settings, tuned.bound.metric));
  page.details("Machine", studyContext(bench));
  writeFileAtomically(folder / "report.html", std::string_view(page.text()));
}

/// tune --per-reflector, once all options are checked.
ExitCode tuneMixture(TuneCommand options, const study::Bound& bound, Measurement::Clock clock,
                     ProgressPrinter& printer) {
  if (!options.vary.empty())
    throw UsageError(
        "--per-reflector chooses among methods as the config has them: --vary "
        "contradicts it");
  const std::string against = referenceName(options);
  const std::vector<std::string> methods = studiedMethods(options, against);
  options.settings.emplace_back(R"(image.layers=["s","id"])");  // whose pixels are whose
  const study::Inputs inputs = studyInputs(options);
  const std::filesystem::path folder =
      options.out.empty() ? "out/" + inputs.readRun({}, methods.front()).name + "_reflectors"
                          : options.out;
  study::Bench bench(inputs, benchOptions(options, folder, printer));
  bench.setReference(against);
  bench.checkReference({bench.prepare({methods.front(), {}, "", ""})});
  openStudyFolder(folder, options.existing, "reflectors");
  if (options.existing == "resume") bench.readSamples();
  catchStopSignals(false);
  MixtureResult result;
  try {
    result = tuneReflectors(bench, methods, bound, clock);
  } catch (const study::StudyStopped&) {
    printer.endLine();
    return static_cast<ExitCode>(128 + stopSignal());
  }
  printer.endLine();
  study::Page page("A method for each reflector, for " + bound.text);
  page.paragraph(result.text);
  std::string text = result.text;
  for (const report::Table& table : result.tables) {
    page.table(table);
    text += "\n" + report::toText(table);
  }
  page.details("Machine", studyContext(bench));
  writeFileAtomically(folder / "report.html", std::string_view(page.text()));
  if (result.best)
    writeFileAtomically(
        folder / "tuned.json",
        std::string_view(tunedJson(*result.best, folder, config::jsonString(result.text))));
  bench.clear();
  printData(text);
  return result.best ? ExitCode::Done : ExitCode::LimitsExceeded;
}

ExitCode tune(const TuneCommand& options, const CommonOptions& common) {
  const ProgressMode mode = parseProgress(options.progress, common.quiet);
  ProgressPrinter printer(mode);
  Tuned tuned;
  tuned.bound = boundOf(options);
  const Measurement::Clock clock = parseClock(options.clock);
  study::TuneOptions tuneOptions;
  tuneOptions.bound = tuned.bound;
  tuneOptions.verifyFrames = verifyFrames(options.verify);
  tuneOptions.margin = 0.01 * options.marginPercent;
  tuneOptions.seed = options.seed.empty() ? 0 : std::stoull(options.seed);
  if (options.repeats < study::kLeastRounds && tuned.bound.kind == study::Bound::Kind::Time)
    throw UsageError("--max-time " + tuned.bound.text +
                     " needs --repeats 8 or more: fewer rounds cannot tell");
  if (options.repeats < 1) throw UsageError("--repeats 0: tune needs times");
  if (options.perReflector) return tuneMixture(options, tuned.bound, clock, printer);

  tuned.against = referenceName(options);
  const std::vector<std::string> methods = studiedMethods(options, tuned.against);
  const std::vector<study::Point> points = study::makePoints(methods, axesOf(options, methods), {});
  const study::Inputs inputs = studyInputs(options);
  const std::filesystem::path folder =
      options.out.empty() ? "out/" + inputs.readRun({}, methods.front()).name + "_tune"
                          : options.out;
  study::Bench bench(inputs, benchOptions(options, folder, printer));
  bench.setReference(tuned.against);
  for (const study::Point& point : points) tuned.settings.push_back(bench.prepare(point));
  bench.checkReference(tuned.settings);
  tuneOptions.frames = bench.frames(tuned.settings.front());
  std::optional<study::Setting> timeOf;
  if (!tuned.bound.timeOf.empty()) timeOf = bench.prepare({tuned.bound.timeOf, {}, "", ""});
  openStudyFolder(folder, options.existing, "tune");
  if (options.existing == "resume") bench.readSamples();

  catchStopSignals(mode == ProgressMode::Json);
  std::string text;
  try {
    BenchWorld world(bench, tuned.settings, tuned.bound, clock, 60.0 * options.budgetMinutes,
                     timeOf);
    tuned.result = study::tune(candidatesOf(points), world, tuneOptions);
    text = resultText(tuned);
    if (tuned.result.best && !options.testPath.empty()) text += testText(bench, options, tuned);
  } catch (const study::StudyStopped&) {
    printer.endLine();
    log::warning("stopped; what was measured is kept: go on with --existing resume");
    return static_cast<ExitCode>(128 + stopSignal());
  }
  printer.endLine();
  writeTuned(bench, tuned, text);
  bench.clear();
  printData(common.json ? config::JsonText()
                                  .add("satisfied", tuned.result.best.has_value())
                                  .add("text", text)
                                  .object() +
                              "\n"
                        : text);
  if (tuned.result.best) log::info("the run config is " + (folder / "tuned.json").string());
  return tuned.result.best ? ExitCode::Done : ExitCode::LimitsExceeded;
}

}  // namespace

Command tuneCommand(CommonOptions& common) {
  const auto options = std::make_shared<TuneCommand>();
  const Rows own = {
      option("--max-error", options->maxError, "BOUND",
             "The largest error, as L1_8bit<=2: of all frames together, or with \" every-frame\" "
             "of each of them",
             {.notEmpty = true}),
      option("--max-time", options->maxTime, "BOUND",
             "The longest time of a frame: 100ms, or 0.8x:traced (as a share of a method's)",
             {.notEmpty = true}),
      option("--vary", options->vary, "NAME=VALUES",
             "An option of a method and the values it may have, as for `sweep`; without any, each "
             "method's options that trade accuracy for time (docs/config.md has their values). "
             "none: the methods as the config has them",
             {.oneEach = true}),
      flag("--per-reflector", options->perReflector,
           "Choose a method for each reflector, so that the whole is within the error and as fast "
           "as can be"),
      option("--verify", options->verify, "all|N",
             "On how many frames the result's error is verified; only all is a proof",
             {.showsDefault = true}),
      option("--test-path", options->testPath, "PATH",
             "Report the result's error on this camera path, too", {.notEmpty = true}),
      option("--margin", options->marginPercent, "PERCENT",
             "Percent of the bound that predictions leave free",
             {.least = 0, .most = 50, .showsDefault = true}),
      option("--budget", options->budgetMinutes, "MINUTES",
             "Minutes after which nothing new is tried [no end]", {.least = 0}),
  };
  return {"tune",
          "Find the fastest setting within an error, or the most accurate one within a time.",
          studyRows(*options, common) + own, R"(Examples:
  catoptric tune configs/living_room.json --method second_order --max-error 'L1_8bit<=2' \
      --vary methods.second_order.level_error=0..1:5 --vary methods.second_order.bin_density=2.5,10,40
  catoptric tune configs/demo.json --max-time 0.8x:traced --vary methods.second_order.level_error=0,0.75

Exit codes: 0 done; 2 the command line or the config is wrong; 5 output could not be written; 7 nothing
satisfies the bound, and the nearest setting is named; 128 + N ended by signal N.
)",
          [options, &common] { return tune(*options, common); }};
}

}  // namespace catoptric::app
