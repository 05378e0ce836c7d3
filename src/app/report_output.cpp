#include "app/report_output.h"

#include <algorithm>
#include <map>
#include <set>

#include "app/commands.h"
#include "core/error.h"
#include "core/file.h"
#include "core/log.h"
#include "report/comparison.h"
#include "report/contact_sheet.h"
#include "report/error_tables.h"
#include "report/run_data.h"
#include "report/table.h"
#include "report/timings.h"
#include "scene/camera.h"

namespace catoptric::app {
namespace {

namespace fs = std::filesystem;

/// What the methods of a run have left on the disk: tables describe what is there, and name what is
/// not.
struct FoundRuns {
  std::vector<report::RunData> runs;
  std::vector<report::TimingTable> timings;
  std::vector<std::string> failures;          ///< a line for each frame that failed
  std::map<std::string, std::string> failed;  ///< "frames 2-4" by method

  FoundRuns(const std::vector<run::MethodResult>& results, int amortize) {
    for (const run::MethodResult& result : results) {
      std::vector<int> numbers;
      for (const run::FailedFrame& frame : result.frames.failed) {
        numbers.push_back(frame.frame);
        failures.push_back("FAILED: " + result.name + ", frame " + std::to_string(frame.frame) +
                           ": " + frame.message);
      }
      if (!numbers.empty())
        failed[result.name] =
            (numbers.size() > 1 ? "frames " : "frame ") + scene::formatFrames(numbers);
      if (result.frames.rendered.empty() && result.frames.reused.empty()) continue;
      runs.push_back(report::readRun(result.folder, result.name));
      timings.push_back(report::timingTable(runs.back(), amortize));
    }
  }
};

/// A method that failed may have none.
bool haveCommonFrame(const report::RunData& a, const report::RunData& b) {
  return std::any_of(a.frames.begin(), a.frames.end(),
                     [&](const auto& frame) { return b.frames.contains(frame.first); });
}

/// Every method against those that the config names; a pair is compared once, by the earlier name.
std::vector<report::RunComparison> compareAll(const std::vector<report::RunData>& runs,
                                              const std::vector<std::string>& names) {
  std::vector<report::RunComparison> comparisons;
  std::set<std::string> done;
  for (const std::string& against : names) {
    done.insert(against);
    for (const report::RunData& reference : runs)
      if (reference.name == against)
        for (const report::RunData& method : runs)
          if (done.count(method.name) == 0 && haveCommonFrame(method, reference))
            comparisons.push_back(report::compareRuns(method, reference));
  }
  return comparisons;
}

/// table.md, table.tex, table.csv; returns the tables as text.
std::string writeTimings(const FoundRuns& found, const fs::path& out) {
  const std::vector<report::TimingTable>& timings = found.timings;
  report::Table table =
      timings.size() == 1 ? report::timingView(timings.front()) : report::timingComparison(timings);
  table.notes.insert(table.notes.end(), found.failures.begin(), found.failures.end());
  const report::Table counters = report::counterView(found.runs);
  std::string text = fittedText(table);
  std::vector<report::Table> tables{table};
  if (!counters.rows.empty() || !counters.notes.empty()) {
    text += "\n" + fittedText(counters);
    tables.push_back(counters);
  }
  for (const report::TimingTable& timing : timings)
    if (timings.size() > 1) tables.push_back(report::timingView(timing));
  report::writeTables(out, "table", tables);
  writeFileAtomically(out / "table.csv", report::timingCsv(timings));
  return text;
}

/// errors.md, errors.tex, errors.csv; returns the table as text.
std::string writeErrors(const FoundRuns& found,
                        const std::vector<report::RunComparison>& comparisons,
                        const fs::path& out) {
  report::Table errors = report::errorSummary(comparisons, found.timings);
  errors.notes.insert(errors.notes.end(), found.failures.begin(), found.failures.end());
  report::writeTables(out, "errors", std::span(&errors, 1));
  writeFileAtomically(out / "errors.csv", report::errorCsv(comparisons));
  return fittedText(errors);
}

/// contact_sheet.png: all methods side by side, with their times and errors.
void writeSheet(const run::RunConfig& run, const FoundRuns& found,
                const std::vector<report::RunComparison>& comparisons, const fs::path& out) {
  report::SheetOptions sheet;
  sheet.title = run.name;
  for (const auto& [name, frames] : found.failed)
    sheet.title += "; " + name + " failed in " + frames;
  for (const report::TimingTable& timing : found.timings) {
    std::string& caption = sheet.captions[timing.name];
    caption = (timing.frames == 1 ? "first frame " : "median ") +
              report::fixedText(timing.rendering.median * 1e3, 0) + " ms";
    for (const report::RunComparison& comparison : comparisons)
      if (comparison.name == timing.name && comparison.reference == run.errorsAgainst.front())
        caption += ", L1_8bit " + report::fixedText(comparison.pooled.l1(), 2) + " against " +
                   comparison.reference;
  }
  const fs::path file = out / "contact_sheet.png";
  std::vector<std::byte> picture;
  try {
    picture = report::drawFigure(report::contactSheet(found.runs, sheet), file);
  } catch (const OutputError& error) {  // no font: frames and tables are worth more
    log::warning("no contact sheet: " + std::string(error.what()));
    return;
  }
  writeFileAtomically(file, picture);
  log::info("contact sheet: " + file.string());
}

}  // namespace

Reports writeReports(const run::RunConfig& run, const std::vector<run::MethodResult>& results,
                     const fs::path& out, int amortize) {
  const FoundRuns found(results, amortize);
  Reports reports;
  reports.text = writeTimings(found, out);
  reports.timingsJson = report::timingJson(found.timings);
  const std::vector<report::RunComparison> comparisons = compareAll(found.runs, run.errorsAgainst);
  if (!comparisons.empty()) reports.text += "\n" + writeErrors(found, comparisons, out);
  reports.errorsJson = report::errorJson(comparisons);
  writeSheet(run, found, comparisons, out);

  log::info("tables: " + (out / "table.md").string() +
            (comparisons.empty() ? "" : ", " + (out / "errors.md").string()));
  for (const run::MethodResult& result : results)
    log::info("frames: " + (result.folder / "frames").string());
  return reports;
}

}  // namespace catoptric::app
