#include "app/report_output.h"

#include <algorithm>
#include <map>
#include <set>

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

/// A method that failed may have none.
bool haveCommonFrame(const report::RunData& a, const report::RunData& b) {
  return std::any_of(a.frames.begin(), a.frames.end(),
                     [&](const auto& frame) { return b.frames.contains(frame.first); });
}

}  // namespace

std::string writeReports(const run::RunConfig& run, const std::vector<run::MethodResult>& results,
                         const std::filesystem::path& out, bool json) {
  // Read back from the disk: the tables describe what is there, and name what is not.
  std::vector<report::RunData> data;
  std::vector<report::TimingTable> timings;
  std::vector<std::string> failures;
  std::map<std::string, std::string> failed;  ///< frames by method
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
    data.push_back(report::readRun(result.folder, result.name));
    timings.push_back(report::timingTable(data.back()));
  }
  report::Table table =
      timings.size() == 1 ? report::timingView(timings.front()) : report::timingComparison(timings);
  table.notes.insert(table.notes.end(), failures.begin(), failures.end());
  const report::Table counters = report::counterView(data);
  std::string text = report::toText(table);
  std::string markdown = report::toMarkdown(table);
  if (!counters.rows.empty() || !counters.notes.empty()) {
    text += "\n" + report::toText(counters);
    markdown += "\n" + report::toMarkdown(counters);
  }
  for (const report::TimingTable& timing : timings)
    if (timings.size() > 1) markdown += "\n" + report::toMarkdown(report::timingView(timing));
  writeFileAtomically(out / "table.md", markdown);
  writeFileAtomically(out / "table.csv", report::timingCsv(timings));

  std::string errorsJson = "[]";
  std::vector<report::RunComparison> comparisons;
  std::set<std::string> done;  // a pair is compared once: the earlier reference counts
  for (const std::string& against : run.errorsAgainst) {
    done.insert(against);
    for (const report::RunData& reference : data)
      if (reference.name == against)
        for (const report::RunData& method : data)
          if (done.count(method.name) == 0 && haveCommonFrame(method, reference))
            comparisons.push_back(report::compareRuns(method, reference));
  }
  if (!comparisons.empty()) {
    report::Table errors = report::errorSummary(comparisons, timings);
    errors.notes.insert(errors.notes.end(), failures.begin(), failures.end());
    text += "\n" + report::toText(errors);
    writeFileAtomically(out / "errors.md", report::toMarkdown(errors));
    writeFileAtomically(out / "errors.csv", report::errorCsv(comparisons));
    errorsJson = report::errorJson(comparisons);
  }

  // Pictures of all methods side by side, with their figures.
  report::SheetOptions sheet;
  sheet.title = run.name;
  for (const auto& [name, frames] : failed) sheet.title += "; " + name + " failed in " + frames;
  for (const report::TimingTable& timing : timings) {
    std::string& caption = sheet.captions[timing.name];
    caption = "median " + report::fixedText(timing.rendering.median * 1e3, 0) + " ms";
    for (const report::RunComparison& comparison : comparisons)
      if (comparison.name == timing.name && comparison.reference == run.errorsAgainst.front())
        caption += ", L1 " + report::fixedText(comparison.pooled.l1(), 2);
  }
  writeFileAtomically(out / "contact_sheet.png", report::contactSheetPng(data, sheet));

  log::info("contact sheet: " + (out / "contact_sheet.png").string());
  log::info("tables: " + (out / "table.md").string() +
            (comparisons.empty() ? "" : ", " + (out / "errors.md").string()));
  for (const run::MethodResult& result : results)
    log::info("frames: " + (result.folder / "frames").string());
  return json ? errorsJson : text;
}

}  // namespace catoptric::app
