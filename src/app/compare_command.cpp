// catoptric compare RUN REFERENCE.
#include <fmt/core.h>

#include <filesystem>
#include <memory>
#include <optional>

#include "app/commands.h"
#include "app/film.h"
#include "core/error.h"
#include "core/file.h"
#include "core/log.h"
#include "core/text.h"
#include "report/comparison.h"
#include "report/error_tables.h"
#include "report/motion_tables.h"
#include "report/run_data.h"
#include "report/table.h"

namespace catoptric::app {
namespace {

struct CompareOptions {
  std::string run;
  std::string reference;
  std::string out;
  std::string video;
  std::optional<double> maxL1;
  std::optional<double> fail;
  double failPercent = 0.0;
  std::optional<double> hardFail;
  std::optional<double> maxMean;
  measure::FlipOptions flip;
};

/// Two single files are one frame, whatever their numbers.
void pairSingleFiles(report::RunData& run, const report::RunData& reference) {
  if (!std::filesystem::is_regular_file(run.folder) ||
      !std::filesystem::is_regular_file(reference.folder))
    return;
  run.frames = {{reference.frames.begin()->first, run.frames.begin()->second}};
}

std::string numbers(const std::vector<int>& frames) {
  std::string text;
  for (const int frame : frames) text += (text.empty() ? "" : ",") + std::to_string(frame);
  return text;
}

/// Says what exceeds the limits; whether anything does.
bool exceeds(const report::RunComparison& c, const CompareOptions& options) {
  bool failed = false;
  const auto fail = [&](const std::string& message) {
    log::error(message);
    failed = true;
  };
  if (!c.onlyInReference.empty())
    fail("frames " + numbers(c.onlyInReference) + " are missing in " + options.run);
  if (!c.onlyInRun.empty())
    fail("frames " + numbers(c.onlyInRun) + " are missing in " + options.reference);
  if (options.maxL1 && c.pooled.l1() > *options.maxL1)
    fail("L1_8bit is " + report::fixedText(c.pooled.l1(), 3) + ", more than the " +
         report::fixedText(*options.maxL1, 3) + " allowed");
  for (const auto& [number, e] : c.frames) {
    const std::string frame = "frame " + std::to_string(number) + ": ";
    const bool limits = options.fail || options.hardFail || options.maxMean;
    if (limits && e.notFinite + e.notFiniteReference > 0)
      fail(frame + "NaN or infinity in " + std::to_string(e.notFinite) + " pixels, and in " +
           std::to_string(e.notFiniteReference) + " of the reference");
    if (options.fail && e.overPercent() > options.failPercent)
      fail(frame + fmt::format("{:.6g} % of the pixels differ by more than ", e.overPercent()) +
           report::exactText(*options.fail) + "; --fail-percent allows " +
           report::exactText(options.failPercent) + " %");
    if (options.hardFail && e.maxLinear > *options.hardFail)
      fail(frame +
           fmt::format("pixel {},{} differs by {:.6g}, more than the ", e.maxLinearX, e.maxLinearY,
                       e.maxLinear) +
           report::exactText(*options.hardFail) + " allowed");
    if (options.maxMean && e.meanLargest() > *options.maxMean)
      fail(frame +
           fmt::format("the mean pixel difference is {:.6g}, more than the ", e.meanLargest()) +
           report::exactText(*options.maxMean) + " allowed");
  }
  return failed;
}

ExitCode compare(const CompareOptions& options, const CommonOptions& common) {
  report::RunData run = report::readSequence(options.run);
  const report::RunData reference = report::readSequence(options.reference);
  pairSingleFiles(run, reference);
  measure::CompareOptions measures;
  measures.flip = options.flip;
  if (options.fail) measures.threshold = *options.fail;
  measures.forLimits = options.fail || options.hardFail || options.maxMean;
  std::filesystem::path film;
  if (!options.video.empty()) {
    checkFilm(options.video, false);
    film = newFilmFolder(options.video);
  }
  const report::RunComparison comparison =
      report::compareRuns(run, reference, measures, {options.out, film});
  const std::span<const report::RunComparison> one(&comparison, 1);
  std::vector<report::Table> tables{report::errorView(comparison)};
  tables.front().title =
      options.run + " against " + options.reference;  // methods' names may be equal
  if (!comparison.pooled.objects.empty()) tables.push_back(report::objectView(comparison));
  if (comparison.pooled.classes.size() > 1) tables.push_back(report::attributionView(comparison));
  if (comparison.frames.size() > 1) tables.push_back(report::motionView(comparison));
  if (!options.out.empty()) {
    const std::filesystem::path out = options.out;
    report::writeTables(out, "tables", tables);
    writeFileAtomically(out / "errors.csv", report::errorCsv(one));
    writeFileAtomically(out / "errors.json", report::errorJson(one) + "\n");
    writeFileAtomically(out / "motion.csv", report::motionCsv(one));
    writeFileAtomically(out / "attribution.csv", report::attributionCsv(one));
    log::info("pictures and tables: " + out.string());
  }
  std::string text;
  for (const report::Table& table : tables) text += (text.empty() ? "" : "\n") + fittedText(table);
  printData(common.json ? report::errorJson(one) + "\n" : text);
  const ExitCode made = film.empty() ? ExitCode::Done : makeFilm(options.video);
  return exceeds(comparison, options) ? ExitCode::LimitsExceeded : made;
}

}  // namespace

Command compareCommand(CommonOptions& common) {
  const auto options = std::make_shared<CompareOptions>();
  const Rows own = {
      option("run", options->run, "RUN", kFramesHelp, {.required = true}),
      option("reference", options->reference, "REFERENCE",
             "Frames to compare the run with: a folder or file, as for RUN", {.required = true}),
      option("--out", options->out, "DIR",
             "Folder for pictures of the differences and for tables (CSV, JSON, Markdown, TeX) "
             "[none are written]",
             {.notEmpty = true}),
      option(
          "--video", options->video, "FILE",
          "Film of run, reference and the change of the error, side by side; needs ffmpeg, which "
          "knows the format by FILE's extension, such as .mp4; without it, the pictures stay in "
          "FILE.frames, and the exit code is 5 [none is made]",
          {.notEmpty = true}),
      option("--fail", options->fail, "X",
             "A pixel fails if its R, G, B or A differs by more than X (scene-linear; for "
             "values above 1, relative to the larger one). The exit code is 7 if pixels of a frame "
             "fail",
             {.least = 0}),
      option("--fail-percent", options->failPercent, "P",
             "Percentage of a frame's pixels that may fail [0]",
             {.least = 0, .most = 100, .needs = "--fail"}),
      option("--hard-fail", options->hardFail, "X",
             "The exit code is 7 if R, G, B or A of any pixel differs by more than X, measured as "
             "for --fail",
             {.least = 0}),
      option("--max-mean", options->maxMean, "X",
             "The exit code is 7 if a frame's mean difference exceeds X: the mean over its pixels "
             "of the largest difference of R, G, B and A, measured as for --fail",
             {.least = 0}),
      option("--max-l1", options->maxL1, "X",
             "The exit code is 7 if L1_8bit, the mean absolute difference of 8-bit sRGB values, "
             "exceeds X",
             {.least = 0}),
      option("--start-exposure", options->flip.startExposure, "EV",
             "Lowest exposure of HDR-FLIP, in stops [-3]", {.least = -60, .most = 60}),
      option("--stop-exposure", options->flip.stopExposure, "EV",
             "Highest exposure of HDR-FLIP, in stops [3]", {.least = -60, .most = 60}),
      option("--num-exposures", options->flip.exposures, "N",
             "Number of exposures of HDR-FLIP, at most 100 [6]", {.least = 1, .most = 100}),
      option("--ppd", options->flip.pixelsPerDegree, "N",
             "Pixels per degree of visual angle, for FLIP; 1 to 400 [67.02]",
             {.least = 1, .most = 400}),
  };
  return {"compare", "Measure the errors of a run against another run, and draw the differences.",
          own + commonRows(common),
          R"(Example:
  catoptric compare out/demo/traced out/demo/reference --fail 0.1 --fail-percent 2

docs/measuring.md explains every measure.
)" + exitCodes({{"2"},
                {"3", "a frame is damaged"},
                {"5"},
                {"7", "a limit is exceeded, or only one side has a frame"}}),
          [options, &common] { return compare(*options, common); }};
}

}  // namespace catoptric::app
