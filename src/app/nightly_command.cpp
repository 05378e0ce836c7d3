// catoptric nightly.
#include <pwd.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <map>
#include <memory>

#include "app/study_options.h"
#include "config/json_text.h"
#include "core/file.h"
#include "core/log.h"
#include "core/text.h"
#include "methods/contract/method.h"
#include "nightly/accept.h"
#include "nightly/builds.h"
#include "nightly/judge_night.h"
#include "nightly/junit.h"
#include "nightly/night.h"
#include "nightly/page.h"
#include "nightly/summary.h"
#include "report/table.h"

namespace catoptric::app {
namespace {

namespace fs = std::filesystem;
using nightly::History, nightly::Night, nightly::Outcome, nightly::Verdict;

struct NightlyOptions {
  std::string what;
  std::vector<std::string> cases;
  std::string history = "out/nightly/history.db";
  std::string effort = "full";
  std::vector<std::string> only;
  std::string program;
  std::string baseline = nightly::role::kAccepted;
  double timeGate = 0.0;  ///< percent; 0: the suite's
  int repeats = 8;
  std::string clock = "wall";
  double patience = 30.0;  ///< minutes
  bool runOnly = false;
  bool compareOnly = false;
  bool reportOnly = false;
  std::string html;
  bool singleFile = false;
  std::string junit;
  std::string reason;
  std::string progress = "auto";
};

std::string userName() {
  const passwd* user = ::getpwuid(::getuid());
  return user != nullptr ? user->pw_name : std::to_string(::getuid());
}

/// Counters that must be 0, of all methods.
std::vector<std::string> countersThatMustBeZero() {
  std::vector<std::string> names;
  for (const methods::MethodEntry& entry : methods::registry())
    for (const methods::CounterInfo& counter : entry.counters)
      if (counter.mustBeZero) names.push_back(counter.name);
  return names;
}

study::Inputs inputsOf(const nightly::NightScene& scene, const std::string& frames) {
  RunOptions run;
  run.input = scene.config.string();
  for (const auto& [name, value] : scene.settings)
    if (!name.starts_with("methods.")) run.settings.push_back(name + "=" + value);
  run.frames = frames;
  return studyInputs(run);
}

/// The newest night of the suite that `fits`.
Night newestNight(const History& history, const std::string& suite, bool judged) {
  for (const Night& night : history.nights(suite, 100))
    if (!judged || !night.finished.empty()) return night;
  throw UsageError(std::string("the history has no ") + (judged ? "judged " : "") +
                   "night of the suite " + suite);
}

void writeNightReports(const History& history, const Night& night,
                       const std::vector<Verdict>& verdicts, const nightly::NightSuite& suite,
                       const NightlyOptions& options) {
  if (!options.junit.empty()) {
    const fs::path file = options.junit;
    std::error_code ignored;
    if (file.has_parent_path()) fs::create_directories(file.parent_path(), ignored);
    writeFileAtomically(file, std::string_view(nightly::junitXml(night, verdicts)));
  }
  if (options.html.empty()) return;
  nightly::PageOptions page;
  page.title = suite.title;
  page.out = options.html;
  page.singleFile = options.singleFile;
  page.historyOption = options.history;
  const fs::path file = nightly::writePage(history, night, verdicts, page);
  log::info("page: " + file.string());
}

std::string listOf(const std::vector<std::string>& items) {
  return "[" + joined(items, ",") + "]";
}

/// Rows as objects of JSON, or the table as text.
std::string tableText(const report::Table& table, bool json) {
  if (!json) return table.rows.empty() ? "" : fittedText(table) + "\n";
  std::vector<std::string> items;
  for (const std::vector<std::string>& row : table.rows) {
    config::JsonText item;
    for (std::size_t i = 0; i < row.size(); ++i) item.add(table.columns[i].title, row[i]);
    items.push_back(item.object());
  }
  return listOf(items);
}

/// What `keep` chooses of the verdicts, as a table or as items of a list of JSON.
template <class Keep>
std::string verdictsText(const std::vector<Verdict>& verdicts, bool json, const Keep& keep) {
  report::Table table;
  table.columns = {
      {"case", false}, {"what", false}, {"verdict", false}, {"since", true}, {"", false}};
  std::vector<std::string> items;
  for (const Verdict& verdict : verdicts) {
    if (!keep(verdict)) continue;
    table.rows.push_back(
        {verdict.name + (verdict.frame != 0 ? ":" + std::to_string(verdict.frame) : ""),
         verdict.kind, verdict.status, std::to_string(verdict.began), verdict.message});
    items.push_back(config::JsonText()
                        .add("case", verdict.name)
                        .add("frame", verdict.frame)
                        .add("kind", verdict.kind)
                        .add("verdict", verdict.status)
                        .add("since", verdict.began)
                        .add("message", verdict.message)
                        .object());
  }
  if (json) return listOf(items);
  return table.rows.empty() ? "" : fittedText(table) + "\n";
}

/// Table of what is not good, and the last line.
ExitCode conclude(const Night& night, const std::vector<Verdict>& verdicts, bool json) {
  const nightly::Summary summary = nightly::summaryOf(verdicts);
  const ExitCode code = summary.crashes > 0       ? ExitCode::FramesFailed
                        : summary.regressions > 0 ? ExitCode::LimitsExceeded
                                                  : ExitCode::Done;
  const std::string faults = verdictsText(verdicts, json, [](const Verdict& verdict) {
    const Outcome outcome = nightly::outcomeOf(verdict);
    return outcome == Outcome::Regression || outcome == Outcome::Crash;
  });
  const char* end = code == ExitCode::Done             ? "good"
                    : code == ExitCode::LimitsExceeded ? "REGRESSION"
                                                       : "CRASH";
  if (json)
    printData(config::JsonText()
                  .add("night", night.id)
                  .add("cases", summary.cases)
                  .add("regressions", summary.regressions)
                  .add("crashes", summary.crashes)
                  .add("skipped", summary.skipped)
                  .add("to_accept", summary.toAccept)
                  .add("changed_settings", summary.changedSettings)
                  .add("end", end)
                  .raw("faults", faults)
                  .object() +
              "\n");
  else
    printData(faults + "Night " + std::to_string(night.id) + ": " + summary.text() + ": " + end +
              "\n");
  return code;
}

nightly::LabOptions labOptions(const NightlyOptions& options, const fs::path& folder) {
  nightly::LabOptions lab;
  lab.inputs = inputsOf;
  lab.program = options.program.empty() ? study::ownProgram() : fs::path(options.program);
  lab.clock = parseClock(options.clock);
  lab.work = folder / "work" / std::to_string(::getpid());
  lab.patience = patience(options.patience);
  return lab;
}

/// Measures what the night lacks; none: it was asked to stop.
std::optional<Night> measure(History& history, const nightly::NightSuite& suite,
                             const NightlyOptions& options, ProgressPrinter& printer) {
  const nightly::LabOptions lab = labOptions(options, history.folder());
  nightly::NightOptions how;
  how.rounds = options.repeats;
  how.mostRounds = 4 * options.repeats;
  how.baseline = options.baseline;
  how.program = lab.program;
  how.stopRequested = lab.patience.stopRequested;
  how.progress = [&](const std::string& what, double share) { printer.showStep(what, share); };
  std::optional<Night> night;
  measureUnlessStopped(printer, "stopped; the same command continues this night", [&] {
    night = nightly::measureSuite(history, suite, options.effort, options.only,
                                  *nightly::makeLab(lab), how);
  });
  return night;
}

/// Every case by the program and by the one that --baseline names; no history.
ExitCode compareWithProgram(const NightlyOptions& options, nightly::NightSuite suite,
                            ProgressPrinter& printer, bool json) {
  const fs::path folder = fs::path(options.history).parent_path();
  for (nightly::NightScene& scene : suite.scenes)
    scene.settings.emplace_back("image.half", "false");  // every bit counts
  const nightly::LabOptions lab = labOptions(options, folder);
  const std::unique_ptr<nightly::Lab> rooms = nightly::makeLab(lab);
  nightly::BuildsReport report;
  const auto compare = [&] {
    report = nightly::compareCases(
        nightly::casesOf(suite, options.effort, options.only, *rooms), *rooms,
        {lab.program, options.baseline, folder / "baseline", options.repeats, suite.gates.time},
        [&](const std::string& what, double share) { printer.showStep(what, share); });
  };
  if (!measureUnlessStopped(printer, "", compare)) return stoppedCode();
  const std::string rows = tableText(report.table, json);
  if (json)
    printData(config::JsonText()
                  .raw("rows", rows)
                  .add("frames", report.frames)
                  .add("equal", report.equal)
                  .add("slower", report.slower)
                  .add("undecided", report.undecided)
                  .add("crashes", report.crashes)
                  .add("without_baseline", report.withoutBaseline)
                  .object() +
              "\n");
  else
    printData(rows + report.sentence(suite.gates.time) + "\n");
  return report.exitCode();
}

ExitCode runSuite(const NightlyOptions& options, const CommonOptions& common) {
  const ProgressMode mode = parseProgress(options.progress, common.quiet);
  ProgressPrinter printer(mode);
  catchStopSignals(mode == ProgressMode::Json);
  nightly::NightSuite suite = nightly::readNightSuite(options.what);
  if (options.timeGate > 0.0) suite.gates.time = options.timeGate / 100.0;
  std::error_code ignored;
  if (fs::is_regular_file(options.baseline, ignored))
    return compareWithProgram(options, suite, printer, common.json);
  if (options.repeats == 0)
    throw UsageError("--repeats 0 measures no times: name a program with --baseline, or 1 or more");
  const bool measures = !options.compareOnly && !options.reportOnly;
  History history(options.history, measures             ? History::Mode::Create
                                   : options.reportOnly ? History::Mode::Read
                                                        : History::Mode::Write);
  Night night;
  if (measures) {
    const std::optional<Night> measured = measure(history, suite, options, printer);
    if (!measured) return stoppedCode();
    night = *measured;
    if (options.runOnly) {
      printData("Night " + std::to_string(night.id) + ": measured, not judged\n");
      return ExitCode::Done;
    }
  } else {
    night = newestNight(history, suite.name, options.reportOnly);
  }
  const std::vector<Verdict> verdicts =
      options.reportOnly
          ? history.verdicts(night.id)
          : nightly::judgeNight(history, night, suite.gates, countersThatMustBeZero());
  if (measures) nightly::dropOld(history);
  if (const auto judged = history.night(night.id)) {
    night = *judged;
  } else {
    throw UsageError(options.history + ": the history is damaged (night " +
                     std::to_string(night.id) +
                     " is gone); put a copy in its place, or begin another one with --history");
  }
  writeNightReports(history, night, verdicts, suite, options);
  return conclude(night, verdicts, common.json);
}

ExitCode acceptCases(const NightlyOptions& options, bool json) {
  if (options.cases.empty())
    throw UsageError(
        "nightly accept: name a case, such as cornell_box.traced:12 (SCENE.METHOD:FRAME; * stands "
        "for any text)");
  History history(options.history, History::Mode::Write);
  const nightly::Accepted accepted =
      nightly::acceptVerdicts(history, {options.cases, options.reason, userName()});
  if (json)
    printData(config::JsonText()
                  .add("acknowledgement", accepted.acknowledgement)
                  .add("frames", accepted.frames)
                  .add("times", accepted.times)
                  .object() +
              "\n");
  else
    printData("Acceptance " + std::to_string(accepted.acknowledgement) + ": " +
              std::to_string(accepted.frames) + " frames, times of " +
              std::to_string(accepted.times) +
              " cases; take it back with `catoptric nightly undo " +
              std::to_string(accepted.acknowledgement) + "`\n");
  return ExitCode::Done;
}

ExitCode undoAcceptance(const NightlyOptions& options) {
  int number = 0;
  const std::string text = options.cases.size() == 1 ? options.cases[0] : "";
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (text.empty() || error != std::errc() || end != text.data() + text.size())
    throw UsageError(
        "nightly undo: give the number of one acceptance; `catoptric nightly log` lists them");
  History history(options.history, History::Mode::Write);
  history.undo(number, nightly::utcNow());
  printData("Acceptance " + text + " is withdrawn\n");
  return ExitCode::Done;
}

report::Table nightTable(const History& history, const std::vector<Night>& nights) {
  report::Table table;
  table.title = "Nights";
  table.columns = {{"night", true},       {"began", false},  {"suite", false},
                   {"effort", false},     {"build", false},  {"cases", true},
                   {"regressions", true}, {"crashes", true}, {"to accept", true}};
  for (const Night& night : nights) {
    const nightly::Summary summary = nightly::summaryOf(history.verdicts(night.id));
    table.rows.push_back({std::to_string(night.id), night.started, night.suite, night.effort,
                          night.build.substr(0, 8),
                          night.finished.empty() ? "unfinished" : std::to_string(summary.cases),
                          std::to_string(summary.regressions), std::to_string(summary.crashes),
                          std::to_string(summary.toAccept)});
  }
  return table;
}

report::Table acknowledgementTable(const History& history) {
  report::Table table;
  table.title = "Acceptances";
  table.columns = {{"number", true}, {"when", false},   {"who", false},
                   {"what", false},  {"reason", false}, {"undone", false}};
  for (const nightly::Acknowledgement& one : history.acknowledgements())
    table.rows.push_back(
        {std::to_string(one.id), one.at, one.who, one.what, one.reason, one.undone});
  return table;
}

/// What `accept` can be given: of the newest night that was judged.
report::Table wantedTable(const History& history, const std::vector<Night>& nights) {
  report::Table table;
  table.columns = {{"case", false}, {"what", false}, {"verdict", false}, {"frames", false}};
  const auto judged = std::find_if(nights.begin(), nights.end(),
                                   [](const Night& night) { return !night.finished.empty(); });
  if (judged == nights.end()) return table;
  table.title = "Night " + std::to_string(judged->id) + ": waiting for acceptance";
  std::map<std::array<std::string, 3>, std::vector<std::string>> frames;
  for (const Verdict& verdict : history.verdicts(judged->id))
    if (nightly::wantsAcceptance(verdict))
      frames[{verdict.name, verdict.kind, verdict.status}].push_back(
          verdict.frame != 0 ? std::to_string(verdict.frame) : "all");
  for (const auto& [what, numbers] : frames)
    table.rows.push_back({what[0], what[1], what[2], joined(numbers, ",")});
  return table;
}

ExitCode printLog(const NightlyOptions& options, bool json) {
  const History history(options.history, History::Mode::Read);
  const std::vector<Night> nights = history.nights("", 30);
  const std::string all = tableText(nightTable(history, nights), json);
  const std::string wanted = tableText(wantedTable(history, nights), json);
  const std::string accepted = tableText(acknowledgementTable(history), json);
  printData(json ? config::JsonText()
                           .raw("nights", all)
                           .raw("wanted", wanted)
                           .raw("acknowledgements", accepted)
                           .object() +
                       "\n"
                 : all + wanted + accepted);
  return ExitCode::Done;
}

ExitCode nightlyCommand(const NightlyOptions& options, const CommonOptions& common) {
  if (options.what == "accept") return acceptCases(options, common.json);
  if (options.what == "undo") return undoAcceptance(options);
  if (options.what == "log") return printLog(options, common.json);
  if (!options.cases.empty())
    throw UsageError("nightly: \"" + options.cases.front() +
                     "\" is one argument too many; choose cases with --only");
  if (options.runOnly + options.compareOnly + options.reportOnly > 1)
    throw UsageError("--run-only, --compare-only and --report-only exclude each other");
  if (options.singleFile && options.html.empty())
    throw UsageError("--single-file needs --html DIR");
  return runSuite(options, common);
}

Rows reportRows(NightlyOptions& options) {
  return Rows{
      flag("--run-only", options.runOnly, "Measure only; judge later with --compare-only"),
      flag("--compare-only", options.compareOnly, "Judge the newest night again; render nothing"),
      flag("--report-only", options.reportOnly,
           "Write only the page and the JUnit file of the newest judged night"),
      option("--html", options.html, "DIR", "Write the page into this folder", {.notEmpty = true}),
      flag("--single-file", options.singleFile,
           "Write the page as one file, index.html, of at most 10 MB"),
      option("--junit", options.junit, "FILE", "Write the verdicts as JUnit XML",
             {.notEmpty = true}),
      option("--reason", options.reason, "TEXT", "For accept: why"),
      progressRow(options.progress),
  };
}

}  // namespace

Command nightlyCommand(CommonOptions& common) {
  const auto options = std::make_shared<NightlyOptions>();
  const Rows own = {
      option("what", options->what, "SUITE|accept|undo|log",
             "A suite to run (JSON); or accept: accept results of the newest night; undo: withdraw "
             "an acceptance; log: list what is accepted and what is not yet",
             {.required = true}),
      option("cases", options->cases, "CASE",
             "For accept: a case, SCENE.METHOD, or one of its frames, SCENE.METHOD:FRAME; * stands "
             "for any text. For undo: the number of the acceptance, as log prints it"),
      option("--history", options->history, "FILE", "Database of all nights",
             {.notEmpty = true, .showsDefault = true}),
      option("--effort", options->effort, "EFFORT",
             "Set of frames to render, one of the suite's \"efforts\", such as smoke or full",
             {.showsDefault = true}),
      option("--only", options->only, "NAME",
             "Run only these cases, separated by commas: by tag, scene, method or name "
             "(SCENE.METHOD); * stands for any text",
             {.commas = true, .oneEach = true}),
      option("--program", options->program, "FILE", "Build to judge [this one]",
             {.notEmpty = true}),
      option("--baseline", options->baseline, "accepted|anchor|BUILD|FILE",
             "Build to compare times with. accepted: the accepted build and the anchor (the build "
             "of the first acceptance). anchor: only the anchor. BUILD: a stored build, by the "
             "first characters of its fingerprint, as log prints it. FILE: the program of another "
             "build. With FILE, both builds render the suite. Frames are compared bit for bit, and "
             "step times in interleaved rounds; the history is not used",
             {.notEmpty = true, .showsDefault = true}),
      option("--time-gate", options->timeGate, "PERCENT",
             "Largest slowdown against the accepted build that passes, in percent [the suite's]",
             {.least = 0.1, .most = 1000}),
      option(
          "--repeats", options->repeats, "N",
          "Timed rounds at first; undecided cases get up to four times as many. 0, with a program "
          "as --baseline: compare only pixels",
          {.least = 0, .most = 1000, .showsDefault = true}),
      clockRow(options->clock),
      patienceRow(options->patience),
  };
  return {"nightly",
          "Render a suite of scenes every night, and compare times, frames, counters and memory "
          "with what was accepted.",
          own + reportRows(*options) + commonRows(common), R"(Examples:
  catoptric nightly configs/nightly/own.suite.json --html out/nightly/page --junit out/nightly/junit.xml
  catoptric nightly configs/nightly/own.suite.json --effort smoke --only smoke
  catoptric nightly configs/nightly/own.suite.json --baseline ../before/build/release/bin/catoptric
  catoptric nightly accept 'cornell_box.*' --reason "bent normals"
  catoptric nightly undo 3
  catoptric nightly log

If a night was interrupted, the same command continues it.
)" + exitCodes({{"2"}, {"6", "a case could not be rendered"}, {"7", "a regression"}}),
          [options, &common] { return nightlyCommand(*options, common); }};
}

}  // namespace catoptric::app
