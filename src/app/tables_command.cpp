// catoptric tables.
#include <algorithm>
#include <charconv>
#include <memory>
#include <optional>
#include <set>

#include "app/study_options.h"
#include "config/json_text.h"
#include "core/clock.h"
#include "core/file.h"
#include "core/log.h"
#include "core/text.h"
#include "report/html.h"
#include "run/folder/machine.h"
#include "run/folder/plan.h"
#include "study/stored.h"
#include "study/suite.h"
#include "study/suite_pictures.h"

namespace catoptric::app {
namespace {

struct TablesOptions {
  std::string suite;
  std::string out;
  std::string effort = "quick";
  std::vector<int> only;
  std::vector<std::string> formats = {"md"};
  int repeats = 8;
  int workers = 8;
  double patience = 30.0;  ///< minutes
  int amortize = 0;
  bool textOnly = false;
  bool check = false;
  std::string into;
  std::string values;
  std::string pictures;
  std::string progress = "auto";
};

const std::vector<std::string> kEfforts = {"smoke", "quick", "full"};
const std::vector<std::string> kFormats = {"md", "csv", "json", "html", "tex"};

void requireOneOf(const std::string& name, const std::string& value,
                  const std::vector<std::string>& allowed) {
  if (std::find(allowed.begin(), allowed.end(), value) == allowed.end())
    throw UsageError(name + " \"" + value + "\"" + didYouMean(value, allowed) +
                     ": must be one of: " + joined(allowed, ", "));
}

/// One run of the suite, checked and ready to be measured.
struct PreparedRun {
  std::string name;
  std::unique_ptr<study::Bench> bench;
  std::vector<study::Setting> settings;
  bool times = true;
  std::map<std::string, std::string> refused = {};  ///< reasons, by method
};

/// `needed`: methods, or null: all; `numbers`: frames, or empty: those of the effort.
PreparedRun prepareRun(const study::SuiteRun& run, const study::Settings& ofEffort,
                       const TablesOptions& options, const std::set<std::string>* needed,
                       const std::vector<int>& numbers, ProgressPrinter& printer,
                       const std::filesystem::path& folder) {
  StudyOptions own;
  own.input = run.config.string();
  own.repeats = options.effort == "smoke" ? 1 : options.repeats;
  own.workers = options.workers;
  own.patience = options.patience;
  InputFiles inputs;  // of which patched scenes and paths are made
  {
    const InputFiles::Recording recording(inputs);
    for (const auto& [name, value] : study::settingsOf(run, ofEffort, folder / "scenes"))
      own.settings.push_back(name + "=" + value);
  }
  const auto frames = run.frames.find(options.effort);
  if (frames != run.frames.end()) own.frames = frames->second;
  if (!numbers.empty()) own.frames = scene::formatFrames(numbers);
  PreparedRun prepared{
      run.name,
      std::make_unique<study::Bench>(
          studyInputs(own), benchOptions(own, folder / options.effort / run.name, printer)),
      {},
      run.times};
  prepared.bench->watch(inputs);
  std::vector<std::string> methods = run.methods.empty() ? studiedMethods(own, "") : run.methods;
  const std::string against = run.against.empty() ? methods.front() : run.against;
  if (needed != nullptr)  // with the reference, beside which all of a run are measured
    std::erase_if(methods, [&](const std::string& method) {
      return !needed->contains("*") && !needed->contains(method) && method != against;
    });
  for (const std::string& method : methods) {
    try {
      prepared.settings.push_back(prepared.bench->prepare({method, {}, "", ""}));
    } catch (const run::UnsupportedError& error) {
      if (!run.mayRefuse) throw;
      prepared.refused[method] = error.reason;
    }
  }
  prepared.bench->setReference(against);
  prepared.bench->checkReference(prepared.settings);
  return prepared;
}

bool isKnown(study::Bench& bench, const PreparedRun& run, const study::Setting& base,
             const std::vector<int>& frames) {
  return std::ranges::all_of(run.settings, [&](const study::Setting& setting) {
    return bench.knowsErrors(setting, frames) &&
           (!run.times || bench.knowsTimes(setting.key, base.key, frames));
  });
}

[[noreturn]] void failUnmeasured(const std::string& run) {
  throw UsageError("--text-only: the run " + run +
                   " has not been measured with the suite's present settings; run without "
                   "--text-only");
}

/// Measures a run as far as it is not known.
void measureRun(const PreparedRun& run, bool textOnly, int amortize, study::SuiteData& data) {
  study::Bench& bench = *run.bench;
  bench.open();
  const std::vector<int>& asked = bench.frames(run.settings.front());
  // What ratios are to, mostly: then they are of neighbours in time.
  const auto against = std::ranges::find_if(run.settings, [&](const study::Setting& setting) {
    return setting.point.method == bench.reference();
  });
  const study::Setting& base = against == run.settings.end() ? run.settings.front() : *against;
  if (textOnly && !isKnown(bench, run, base, asked)) failUnmeasured(run.name);
  if (run.times) bench.measureBeside(base, run.settings, asked);
  bench.findErrors({base}, asked);  // first: its frames are the others' reference
  bench.findErrors(run.settings, asked);
  for (const study::Setting& setting : run.settings) {
    if (const auto failure = bench.failures().find(setting.key); failure != bench.failures().end())
      throw Error(ExitCode::FramesFailed,
                  run.name + ": " + setting.text() + ": " + failure->second);
    const study::Samples* samples =
        run.times ? bench.timesBeside(setting.key, base.key, asked) : nullptr;
    data.runs[run.name][setting.point.method] = {
        setting,
        samples,
        samples == nullptr ? 0 : *samples->find(setting.key),
        base.key,
        bench.errors(setting),
        asked,
        amortize > 0 ? amortize : bench.pathFrames(setting),
        bench.reflectors(setting)};
  }
  bench.clear();
}

/// Says after each run how long the others will take at the same pace.
void measureRuns(const std::vector<PreparedRun>& runs, const TablesOptions& options,
                 study::SuiteData& data) {
  const std::int64_t start = nowNs();
  for (std::size_t i = 0; i < runs.size(); ++i) {
    const std::int64_t own = nowNs();
    measureRun(runs[i], options.textOnly, options.amortize, data);
    if (runs[i].bench->framesRendered() == 0) continue;
    const std::size_t left = runs.size() - i - 1;
    const double each = secondsSince(start) / static_cast<double>(i + 1);
    log::info(runs[i].name + ": " + std::to_string(runs[i].bench->framesRendered()) +
              " frames rendered in " + durationText(secondsSince(own)) +
              (left > 0 ? "; left: " + std::to_string(left) + " runs, about " +
                              durationText(each * static_cast<double>(left))
                        : ""));
  }
}

void writeTables(const study::Suite& suite, const study::SuiteData& data,
                 const TablesOptions& options, const std::filesystem::path& folder,
                 const std::string& context) {
  const std::vector<report::Table> tables = study::suiteTables(suite, data);
  const std::vector<study::SuiteFigure> figures = study::suiteFigures(suite, data);
  std::vector<study::Chart> curves;
  for (const study::SuiteFigure& figure : figures) {
    if (!figure.file.empty() && !options.pictures.empty())
      writeFileAtomically(std::filesystem::path(options.pictures) / figure.file,
                          std::string_view(figure.svg()));
    if (figure.columns == 1)
      curves.insert(curves.end(), figure.charts.begin(), figure.charts.end());
  }
  const auto write = [&](const std::string& name, const std::string& text) {
    writeFileAtomically(folder / name, std::string_view(text));
  };
  if (!curves.empty()) write("curves.svg", study::toSvg(curves));
  const std::string effort = "Effort: " + options.effort +
                             (options.effort == "smoke" ? " (the numbers mean nothing)." : ".");
  std::string markdown = "# " + suite.title + "\n\n" + suite.text + "\n\n" + effort + "\n";
  std::string csv;
  std::string tex;
  std::vector<std::string> json;
  report::HtmlPage page(suite.title);
  page.paragraph(suite.text);
  page.paragraph(effort);
  for (const report::Table& table : tables) {
    markdown += "\n" + report::toMarkdown(table);
    csv += (csv.empty() ? "" : "\n") + csvCell(table.title) + "\n" + report::toCsv(table);
    tex += report::toTex(table) + "\n";
    json.push_back(report::toJson(table));
    page.table(table);
    printData(fittedText(table) + "\n");
  }
  if (!curves.empty()) markdown += "\n![curves](curves.svg)\n";
  for (const study::SuiteFigure& figure : figures) page.svg(figure.svg());
  page.details("Machine", context);
  const std::map<std::string, std::string> texts{
      {"md", markdown},
      {"csv", csv},
      {"json", config::JsonText()
                       .add("title", suite.title)
                       .add("text", suite.text)
                       .add("effort", options.effort)
                       .raw("tables", "[" + joined(json, ",\n") + "]")
                       .raw("machine", context.empty() ? "null" : context)
                       .object() +
                   "\n"},
      {"tex", tex},
      {"html", page.text()}};
  for (const std::string& format : options.formats) write("tables." + format, texts.at(format));
  log::info("tables: " + (folder / ("tables." + options.formats.front())).string());
}

/// What measured the values: this program, on this machine.
std::string measuredBy(const TablesOptions& options) {
  return "catoptric tables --effort " + options.effort + ", " + run::processorName();
}

/// The runs that cells without a stored value need, ready to be measured.
std::vector<PreparedRun> prepareRuns(const study::Suite& suite, const TablesOptions& options,
                                     ProgressPrinter& printer, const std::filesystem::path& folder,
                                     study::SuiteData& data) {
  const auto needed = study::neededMethods(suite, data.stored);
  const auto ofEffort = suite.efforts.find(options.effort);
  if (ofEffort != suite.efforts.end())
    data.otherScenes = std::ranges::any_of(
        ofEffort->second, [](const auto& setting) { return setting.first == "scene"; });
  std::vector<PreparedRun> runs;
  for (const study::SuiteRun& run : suite.runs) {
    const auto methods = needed.find(run.name);
    const bool some = !options.values.empty() || !options.only.empty();
    if (some && methods == needed.end()) continue;
    // Said before the scenes are loaded: that can take minutes.
    if (options.textOnly && !std::filesystem::exists(folder / options.effort / run.name / "errors"))
      failUnmeasured(run.name);
    runs.push_back(
        prepareRun(run, ofEffort == suite.efforts.end() ? study::Settings{} : ofEffort->second,
                   options, some ? &methods->second : nullptr, {}, printer, folder));
    runs.back().bench->setMetrics(study::metricsOf(suite, run.name));
    for (const study::Setting& setting : runs.back().settings)
      data.runs[run.name][setting.point.method].setting = setting;
    for (const auto& [method, reason] : runs.back().refused)
      data.runs[run.name][method].refused = reason;
  }
  return runs;
}

/// Draws the pictures that are not there, or whose runs have changed.
void drawPictures(const study::Suite& suite, const study::SuiteData& data,
                  const TablesOptions& options, study::StoredValues* values,
                  ProgressPrinter& printer, const std::filesystem::path& folder) {
  const auto ofEffort = suite.efforts.find(options.effort);
  study::StatedPrints prints(suite, options.effort);
  for (const study::SuitePicture& picture : study::suitePictures(suite)) {
    const std::filesystem::path file = std::filesystem::path(options.pictures) / picture.file;
    const std::string print = study::printOfPicture(picture, prints);
    if (values != nullptr && values->picture(picture.file) == print &&
        std::filesystem::exists(file))
      continue;
    std::map<std::string, std::map<int, std::filesystem::path>> files;
    for (const auto& [name, methods] : study::framesOf(picture))
      for (const auto& [method, numbers] : methods) {
        const auto run = std::ranges::find(suite.runs, name, &study::SuiteRun::name);
        study::SuiteRun own = *run;
        own.methods = {method};
        own.against.clear();
        const std::vector<int> frames(numbers.begin(), numbers.end());
        const PreparedRun prepared =
            prepareRun(own, ofEffort == suite.efforts.end() ? study::Settings{} : ofEffort->second,
                       options, nullptr, frames, printer, folder);
        files[name + "." + method] = prepared.bench->frameFiles(prepared.settings.front(), frames);
      }
    const report::Figure figure = study::suiteFigure(
        picture, data, [&](const std::string& run, const std::string& method, int frame) {
          return files.at(run + "." + method).at(frame);
        });
    writeFileAtomically(file, report::drawFigure(figure, file));
    if (values != nullptr) values->picture(picture.file) = print;
    printer.endLine();
    log::info("picture: " + file.string());
  }
}

/// Replaces the tables of a page; without `write` only sees whether that can be done.
void writeInto(const std::string& page, const study::Suite& suite, const study::SuiteData& data,
               bool write) {
  const std::string text =
      study::withTables(readTextFile(page), study::suiteTables(suite, data), page);
  if (write) writeFileAtomically(page, std::string_view(text));
}

ExitCode tables(const TablesOptions& options, const CommonOptions& common) {
  requireOneOf("--effort", options.effort, kEfforts);
  const bool needsAll = !options.into.empty() || !options.values.empty() ||
                        !options.pictures.empty() || options.check;
  if (!options.only.empty() && needsAll)
    throw UsageError(
        "--only cannot be combined with --into, --values, --pictures or --check, which need all "
        "tables");
  for (const std::string& format : options.formats) requireOneOf("--format", format, kFormats);
  const ProgressMode mode = parseProgress(options.progress, common.quiet);
  ProgressPrinter printer(mode);
  study::Suite suite = study::readSuite(options.suite);
  std::string name = std::filesystem::path(options.suite).stem().string();
  if (name.ends_with(".suite")) name.resize(name.size() - 6);
  const std::filesystem::path folder = options.out.empty()
                                           ? std::filesystem::path("out/tables") / name
                                           : std::filesystem::path(options.out);
  for (const std::filesystem::path& made : {folder, std::filesystem::path(options.pictures)}) {
    std::error_code error;
    if (!made.empty()) std::filesystem::create_directories(made, error);
    if (error) throw OutputError(made.string() + ": cannot be created: " + error.message());
  }
  catchStopSignals(mode == ProgressMode::Json);
  study::SuiteData data;
  data.figures = suite.figures;
  if (!options.only.empty()) suite = study::withTablesAlone(std::move(suite), options.only);
  std::optional<study::StoredValues> values;
  if (!options.values.empty()) {
    values.emplace(options.values);
    data.stored = values->fresh(suite, options.effort);
  }
  const std::vector<PreparedRun> runs = prepareRuns(suite, options, printer, folder, data);
  // What the cells name is checked before anything is rendered.
  study::suiteTables(suite, data);
  study::suiteFigures(suite, data);
  study::failedChecks(suite, data);
  if (!options.into.empty()) writeInto(options.into, suite, data, false);
  try {
    measureRuns(runs, options, data);
    if (!options.pictures.empty() && !options.textOnly)
      drawPictures(suite, data, options, values ? &*values : nullptr, printer, folder);
  } catch (const study::StudyStopped&) {
    printer.endLine();
    log::warning("stopped; measured frames are kept, and are not rendered again");
    return static_cast<ExitCode>(128 + stopSignal());
  }
  printer.endLine();
  writeTables(suite, data, options, folder, runs.empty() ? "" : studyContext(*runs.front().bench));
  if (!options.into.empty()) writeInto(options.into, suite, data, true);
  if (values) {
    values->keep(suite, data, options.effort, measuredBy(options));
    values->write();
  }
  if (!options.check) return ExitCode::Done;
  const std::vector<std::string> failed = study::failedChecks(suite, data);
  for (const std::string& line : failed) log::error(line);
  return failed.empty() ? ExitCode::Done : ExitCode::LimitsExceeded;
}

}  // namespace

Command tablesCommand(CommonOptions& common) {
  const auto options = std::make_shared<TablesOptions>();
  const Rows own = {
      option("suite", options->suite, "SUITE", "A suite (JSON)", {.required = true}),
      option("--out", options->out, "DIR", "Folder for the results [out/tables/SUITE]",
             {.notEmpty = true}),
      option("--effort", options->effort, "EFFORT",
             "How many frames are rendered: smoke (only to see that it works), quick, or full",
             {.showsDefault = true}),
      option("--only", options->only, "N",
             "Measure and write only these tables, by their numbers, separated by commas",
             {.commas = true, .oneEach = true}),
      option("--format", options->formats, "FORMAT",
             "Formats of the tables, separated by commas: md, csv, json, html, tex",
             {.showsDefault = true, .commas = true, .oneEach = true}),
      option("--repeats", options->repeats, "N", "Timed rounds; smoke takes one",
             {.least = 1, .most = 1000, .showsDefault = true}),
      workersRow(options->workers),
      patienceRow(options->patience),
      amortizeRow(options->amortize),
      flag("--text-only", options->textOnly,
           "Render nothing; make the tables again from earlier measurements"),
      option("--into", options->into, "PAGE.md",
             "Also replace the tables in this page: the lines between \"<!-- table 2 -->\" and "
             "\"<!-- end -->\" become table 2",
             {.notEmpty = true}),
      option("--values", options->values, "FILE.json",
             "Store the values of all cells in this file, and measure only cells whose settings "
             "have changed since",
             {.notEmpty = true}),
      option("--pictures", options->pictures, "DIR",
             "Folder for the suite's pictures; each figure with a `file` in the suite goes there, "
             "too. With --values, only pictures whose runs have changed are drawn",
             {.notEmpty = true}),
      flag("--check", options->check,
           "Exit code 7 if a value is outside its range in the suite's \"checks\""),
      progressRow(options->progress),
  };
  return {
      "tables",
      "Measure the runs of a suite (configs/papers/*.suite.json), and make its tables and curves.",
      own + commonRows(common),
      R"(Examples:
  catoptric tables configs/papers/second_order.suite.json --effort smoke
  catoptric tables configs/papers/second_order.suite.json --effort full --format md,tex,html

Frames that the same program has rendered with the same settings are not rendered again.
)" + exitCodes({{"2"},
                {"5"},
                {"6"},
                {"7", "a value is outside the suite's range (--check)"},
                {"128 + N"}}),
      [options, &common] { return tables(*options, common); }};
}

}  // namespace catoptric::app
