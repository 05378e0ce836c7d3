// catoptric merge.
#include <memory>

#include "app/commands.h"
#include "app/report_output.h"
#include "cluster/submission.h"
#include "config/json.h"
#include "config/json_text.h"
#include "core/text.h"
#include "run/folder/merge.h"
#include "run/sequence/session.h"

namespace catoptric::app {
namespace {

struct MergeOptions {
  std::vector<std::string> runs;
  std::string out;
  std::string existing = "error";
};

/// The folders of the parts: of what was submitted, those of its chunks that a task has begun.
std::vector<std::filesystem::path> partsOf(const MergeOptions& options) {
  std::vector<std::filesystem::path> parts;
  for (const std::string& folder : options.runs) {
    if (!cluster::isSubmission(folder)) {
      parts.emplace_back(folder);
      continue;
    }
    const cluster::Submission submission = cluster::readSubmission(folder);
    for (const int chunk : submission.wanted())
      if (std::filesystem::exists(submission.part(chunk))) parts.push_back(submission.part(chunk));
    if (parts.empty())
      throw UsageError(folder + ": no chunk has been rendered yet; see catoptric status");
  }
  return parts;
}

/// --out, or where the whole of what was submitted belongs.
std::string outOf(const MergeOptions& options) {
  if (!options.out.empty()) return options.out;
  if (options.runs.size() == 1 && cluster::isSubmission(options.runs.front()))
    return cluster::readSubmission(options.runs.front()).merged().string();
  throw UsageError("--out is required: the folder for the whole run");
}

ExitCode merge(const MergeOptions& given, const CommonOptions& common) {
  MergeOptions options = given;
  options.out = outOf(given);
  const run::Existing existing = run::parseExisting(options.existing);
  const std::vector<run::MergedRun> merged =
      run::mergeRuns(partsOf(options), options.out, existing);

  // The tables of the whole, as the undivided run would have written them.
  run::RunConfig config;
  config.name = std::filesystem::path(options.out).filename().string();
  std::vector<run::MethodResult> results;
  std::vector<std::string> texts;
  for (const run::MergedRun& run : merged) {
    run::MethodResult result;
    result.name = run.name;
    result.folder = run.folder;
    result.frames.rendered = run.frames;
    results.push_back(std::move(result));
    texts.push_back(config::JsonText()
                        .add("name", run.name)
                        .add("folder", run.folder.string())
                        .add("frames", run.frames)
                        .object());
  }
  const config::Value errors = config::parseText(merged.front().config, "config").get("errors");
  if (!errors.isNull() && errors.has("against"))
    for (const config::Value& name : errors.get("against").asArray())
      config.errorsAgainst.push_back(name.asString());
  const Reports reports = writeReports(config, results, options.out);
  printData(common.json ? config::JsonText()
                                  .add("out", options.out)
                                  .raw("methods", "[" + joined(texts, ",") + "]")
                                  .raw("timings", reports.timingsJson)
                                  .raw("errors", reports.errorsJson)
                                  .object() +
                              "\n"
                        : reports.text);
  return ExitCode::Done;
}

}  // namespace

Command mergeCommand(CommonOptions& common) {
  const auto options = std::make_shared<MergeOptions>();
  const Rows own = {
      option("runs", options->runs, "RUN",
             "The folders of the parts, in any order, or the folder of a `submit`",
             {.required = true}),
      option("--out", options->out, "DIR",
             "Folder for the whole run [for a `submit`: merged/ in its folder; otherwise required]",
             {.notEmpty = true}),
      option("--existing", options->existing, "HOW",
             "What to do if that folder already has a run: error (refuse), or overwrite",
             {.showsDefault = true}),
  };
  return {
      "merge", "Join the parts of a run, made by `render --chunk`, into one run.",
      own + commonRows(common),
      R"(The parts must agree in settings, scene, program and renderer, and no frame may be missing or
damaged. Otherwise nothing is written. If the parts were made on unlike machines, a warning names
the machines and says how far the frames may differ. The merged frames are hard links to those of
the parts, or copies if the file system has no hard links.

Example:
  catoptric render configs/demo.json --chunk 1/2 --out out/part1
  catoptric render configs/demo.json --chunk 2/2 --out out/part2
  catoptric merge out/part1 out/part2 --out out/whole
)" + exitCodes({{"2", "the command line is wrong, or the parts do not agree"},
                {"5"},
                {"6", "frames are missing or damaged; they are listed"}}),
      [options, &common] { return merge(*options, common); }};
}

}  // namespace catoptric::app
