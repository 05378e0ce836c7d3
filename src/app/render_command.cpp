// catoptric render.
#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <optional>

#include "app/film.h"
#include "app/plan_command.h"
#include "app/report_output.h"
#include "app/run_options.h"
#include "app/study_options.h"
#include "config/json_text.h"
#include "core/log.h"
#include "core/text.h"
#include "methods/contract/method.h"
#include "report/run_data.h"
#include "run/folder/memory.h"
#include "run/sequence/session.h"
#include "scene/camera.h"
#include "study/repeats.h"

namespace catoptric::app {
namespace {

struct RenderOptions : RunOptions {
  std::string existing = "error";
  std::string chunk = "1/1";
  std::string progress = "auto";
  double stopWithin = 15.0;
  double wait = 0.0;
  bool keepGoing = false;
  bool noTables = false;
  bool dryRun = false;
  int repeats = 0;
  int amortize = 0;
  std::string video;
  std::string ocio;
  std::string view;
  std::string ratioTo;  ///< empty: traced, else reference, else the first method
};

std::filesystem::path outFolder(const RunOptions& options, const run::RunConfig& run) {
  return options.out.empty() ? std::filesystem::path("out") / run.name
                             : std::filesystem::path(options.out);
}

std::string resultsJson(const std::vector<run::MethodResult>& results) {
  std::vector<std::string> texts;
  for (const run::MethodResult& result : results) {
    std::vector<int> failed;
    for (const run::FailedFrame& frame : result.frames.failed) failed.push_back(frame.frame);
    texts.push_back(config::JsonText()
                        .add("name", result.name)
                        .add("folder", result.folder.string())
                        .add("rendered", result.frames.rendered)
                        .add("reused", result.frames.reused)
                        .add("failed", failed)
                        .add("missing", result.frames.missing)
                        .add("stopped", result.frames.stopped)
                        .object());
  }
  return "[" + joined(texts, ",") + "]";
}

/// "frames 1-6"; "no frame".
std::string framesText(const std::vector<int>& frames) {
  if (frames.empty()) return "no frame";
  return (frames.size() == 1 ? "frame " : "frames ") + scene::formatFrames(frames);
}

/// What the run would do; the folders are those that it would refuse, too.
ExitCode dryRun(const run::Stage& stage, const run::Plan& plan, const CommonOptions& common,
                const run::SessionOptions& session) {
  const std::vector<run::MethodForecast> forecasts =
      run::forecastAll(stage, methods::registry(), session);
  std::vector<std::string> methodTexts;
  std::string text;
  for (const run::MethodForecast& method : forecasts) {
    const run::SequenceForecast& frames = method.frames;
    methodTexts.push_back(config::JsonText()
                              .add("name", method.name)
                              .add("folder", method.folder.string())
                              .add("rendered", frames.rendered)
                              .add("reused", frames.reused)
                              .add("warmed_up", frames.warmedUp)
                              .object());
    text += method.folder.string() + ": " + framesText(frames.rendered) + " would be rendered";
    if (session.existing == run::Existing::Resume)
      text += ", " + framesText(frames.reused) + " re-used (if the renderer is the same)";
    if (session.existing == run::Existing::Overwrite && std::filesystem::exists(method.folder))
      text += ", replacing the existing run";
    if (!frames.warmedUp.empty())
      text += "; " + framesText(frames.warmedUp) + " would be rendered to warm up, and not kept";
    text += "\n";
  }
  if (common.json)
    printData(config::JsonText()
                  .add("out", session.out.string())
                  .raw("methods", "[" + joined(methodTexts, ",") + "]")
                  .raw("plan", run::planJson(plan))
                  .object() +
              "\n");
  else
    printData(text + run::planText(plan));
  return ExitCode::Done;
}

/// Says what is missing, and of failed frames why; the exit code that follows.
ExitCode sayFailures(const std::vector<run::MethodResult>& results) {
  ExitCode code = ExitCode::Done;
  for (const run::MethodResult& result : results) {
    for (const run::FailedFrame& frame : result.frames.failed) {
      if (code != ExitCode::OutOfMemory)
        code = frame.outOfMemory ? ExitCode::OutOfMemory : ExitCode::FramesFailed;
      log::error(result.name + ": frame " + std::to_string(frame.frame) + ": " + frame.message);
    }
    if (!result.frames.missing.empty())
      log::warning(result.name + ": frames " + scene::formatFrames(result.frames.missing) +
                   " are missing; render them with --existing resume, or --frames " +
                   scene::formatFrames(result.frames.missing));
  }
  return code;
}

/// Writes the tables of what is there, also when frames are missing, and prints the results.
void printResults(const run::RunConfig& run, const std::vector<run::MethodResult>& results,
                  const std::filesystem::path& out, bool anyFailed, const RenderOptions& options,
                  bool asJson, const std::optional<study::RepeatedTimes>& repeated) {
  const bool anyFrames =
      std::any_of(results.begin(), results.end(), [](const run::MethodResult& result) {
        return !result.frames.rendered.empty() || !result.frames.reused.empty();
      });
  if (!anyFrames && !anyFailed && stopSignal() == 0)
    log::info("this chunk has no frame: there are more chunks than frames");
  Reports reports;
  const bool tables = anyFrames && !options.noTables && stopSignal() == 0;
  if (tables) reports = writeReports(run, results, out, options.amortize);
  if (tables && !asJson && options.repeats == 0 && results.size() > 1)
    log::info("--repeats 8 measures the methods in turns, and prints ratios of their times");
  if (!asJson) {
    printData(reports.text + (repeated ? "\n" + repeated->text : ""));
    return;
  }
  config::JsonText all;
  all.add("out", out.string()).raw("methods", resultsJson(results));
  if (tables) all.raw("timings", reports.timingsJson).raw("errors", reports.errorsJson);
  if (repeated) all.raw("repeats", repeated->json);
  printData(all.object() + "\n");
}

/// Times the methods in turns, where that is asked for and the run is whole.
std::optional<study::RepeatedTimes> repeatTimes(const RenderOptions& options,
                                                const run::Stage& stage,
                                                const std::filesystem::path& out,
                                                ProgressPrinter& printer) {
  if (options.repeats == 0 || stopSignal() != 0) return {};
  StudyOptions own;
  static_cast<RunOptions&>(own) = options;
  own.repeats = options.repeats;
  own.workers = 256;  // all methods of a run at once, as far as memory allows
  study::removeStudy(out / "repeats");
  std::optional<study::RepeatedTimes> times;
  measureUnlessStopped(printer, "", [&] {
    study::Bench bench(studyInputs(options), benchOptions(own, out / "repeats", printer));
    bench.watch(stage.inputs());  // times are of the scene that was rendered
    const run::RunConfig& run = stage.run();
    times =
        study::timeRepeats(bench, run, study::ratioMethod(run, options.ratioTo), options.amortize);
    bench.clear();
  });
  return times;
}

/// The film of a method: FILE, or FILE with the method's name before its extension.
std::filesystem::path filmOf(const std::filesystem::path& file, const run::RunConfig& run,
                             const std::string& method) {
  if (run.methods.size() == 1) return file;
  std::filesystem::path name = file.stem();
  name += "." + method;
  name += file.extension();
  return file.parent_path() / name;
}

/// Makes films of the methods' previews.
ExitCode makeFilms(const std::filesystem::path& video, const run::RunConfig& run,
                   const std::vector<run::MethodResult>& results) {
  ExitCode code = ExitCode::Done;
  for (const run::MethodResult& result : results) {
    const std::filesystem::path film = filmOf(video, run, result.name);
    const std::filesystem::path pictures = newFilmFolder(film);
    int number = 0;
    for (const auto& [frame, preview] : report::readSequence(result.folder).previews)
      std::filesystem::create_symlink(std::filesystem::absolute(preview),
                                      pictures / fmt::format("{:04}.png", ++number));
    if (const ExitCode made = makeFilm(film); made != ExitCode::Done) code = made;
  }
  return code;
}

/// The options with those of previews among --set.
RunOptions withPreviews(const RenderOptions& options) {
  RunOptions all = options;
  const auto set = [&](const std::string& name, const std::string& value) {
    if (!value.empty()) all.settings.push_back(name + "=" + config::jsonString(value));
  };
  set("preview.ocio", options.ocio);
  set("preview.view", options.view);
  return all;
}

/// A film that cannot be made is said before frames are rendered.
void checkVideo(const std::filesystem::path& video, const run::RunConfig& run, bool again) {
  if (video.empty()) return;
  if (!run.preview.enabled)
    throw UsageError("--video is made of previews; set preview.enabled to true");
  for (const run::MethodConfig& method : run.methods)
    checkFilm(filmOf(video, run, method.name), again);
}

/// Options of --repeats that contradict others.
void checkRepeats(const RenderOptions& options, const run::RunConfig& run) {
  if (!options.ratioTo.empty() && options.repeats == 0)
    throw UsageError("--ratio-to needs --repeats N");
  study::ratioMethod(run, options.ratioTo);
  if (options.repeats > 0 && options.chunk != "1/1")
    throw UsageError(
        "--repeats measures all frames of the run; it cannot be combined with --chunk");
}

ExitCode render(const RenderOptions& options, const CommonOptions& common) {
  // All options are checked before anything is loaded.
  run::SessionOptions session;
  session.existing = run::parseExisting(options.existing);
  session.chunk = run::parseChunk(options.chunk);
  session.keepGoing = options.keepGoing;
  session.waitSeconds = options.wait;
  const ProgressMode mode = parseProgress(options.progress, common.quiet);
  ProgressPrinter printer(mode);
  const run::RunConfig run = readRun(withPreviews(options));
  checkRepeats(options, run);
  checkVideo(options.video, run, session.existing != run::Existing::Error);
  session.out = outFolder(options, run);
  if (!run.errorsDropped.empty())
    log::info("errors against " + joined(run.errorsDropped, ", ") +
              " are not computed: --method leaves " +
              (run.errorsDropped.size() == 1 ? "it" : "them") + " out");

  // Until the scene is loaded a signal ends the process by itself: nothing has been written.
  run::Stage stage(run);
  const run::Plan plan = planOf(stage);  // what cannot be done is said before all else
  run::requireMemory(plan, run::obtainableMemory());
  if (options.dryRun) return dryRun(stage, plan, common, session);

  catchStopSignals(mode == ProgressMode::Json);
  const StopDeadline deadline(options.stopWithin);
  session.stopRequested = [] { return stopSignal() != 0; };
  session.progress = [&](const std::string& method, const run::Progress& progress) {
    printer.show(method, progress);
  };
  session.startupProgress = [&](const std::string& step, double share) {
    printer.showStep(step, share);
  };
  const std::vector<run::MethodResult> results =
      run::renderAll(stage, methods::registry(), session);
  printer.endLine();

  const ExitCode code = sayFailures(results);
  printResults(run, results, session.out, code != ExitCode::Done, options, common.json,
               repeatTimes(options, stage, session.out, printer));
  if (stopSignal() != 0) return stoppedCode();
  const ExitCode films =
      options.video.empty() ? ExitCode::Done : makeFilms(options.video, run, results);
  return code == ExitCode::Done ? films : code;
}

}  // namespace

Command renderCommand(CommonOptions& common) {
  const auto options = std::make_shared<RenderOptions>();
  const Rows own = {
      option("--out", options->out, "DIR",
             "Folder for the results; several methods get a folder each in it [out/CONFIG, such as "
             "out/demo]",
             {.notEmpty = true}),
      existingRow(options->existing),
      option("--chunk", options->chunk, "I/N",
             "Divide the frames into N successive parts, and render only the Ith; `catoptric "
             "merge` joins the parts"),
      flag("--keep-going", options->keepGoing,
           "If a frame fails, render the others; the exit code is then 6, or 8 where memory was "
           "too small"),
      option(
          "--video", options->video, "FILE",
          "Make a film of each method's previews, with 30 frames per second. Needs ffmpeg, which "
          "takes the format from FILE's extension, such as .mp4; without it, the pictures stay in "
          "FILE.frames, and the exit code is 5",
          {.notEmpty = true}),
      option("--ocio", options->ocio, "CONFIG",
             "OpenColorIO config (.ocio) for the previews [built in]", {.notEmpty = true}),
      option("--view", options->view, "NAME",
             "The config's view for previews. The built-in config has sRGB, Linear, and Neutral, "
             "which is sRGB but compresses radiance above 0.8 [Neutral, or the config's first]",
             {.notEmpty = true}),
      flag("--no-tables", options->noTables,
           "Write frames and their records, but no tables and no contact sheet"),
      option("--wait", options->wait, "SECONDS",
             "If another process writes the folder, wait for it at most this long",
             {.least = 0, .most = 86400, .showsDefault = true}),
      option("--stop-within", options->stopWithin, "SECONDS",
             "After SIGINT or SIGTERM, time in which the current frame may be finished before it "
             "is dropped",
             {.least = 0, .most = 86400, .showsDefault = true}),
      flag("--dry-run", options->dryRun,
           "Print which frames would be rendered or re-used, and what `plan` prints, and write "
           "nothing. Errors in the config, the scene or the folder are reported as in a real run"),
      progressRow(options->progress),
      option("--repeats", options->repeats, "N",
             "After the run, time all its methods in N interleaved rounds, and print the time "
             "ratios with 95 % confidence intervals, which need 8 rounds or more [0: no timing]",
             {.least = 0, .most = 1000}),
      option("--ratio-to", options->ratioTo, "METHOD",
             "Baseline of the time ratios of --repeats [traced, otherwise reference, otherwise the "
             "first method]",
             {.notEmpty = true}),
      amortizeRow(options->amortize),
  };
  return {"render", "Render the frames of a camera path.", runRows(*options, common) + own,
          R"(Examples:
  catoptric render configs/demo.json --out out/demo
  catoptric render room.glb --method environment_map --set image.width=1024
  catoptric render configs/demo.json --method reference --set methods.reference.max_standard_error=1
  catoptric render configs/demo.json --frames 1-100x10 --existing overwrite
  catoptric render configs/demo.json --chunk 2/8 --out out/part2
)" + exitCodes({{"2"}, {"3"}, {"4"}, {"5"}, {"6"}, {"8"}, {"128 + N"}}),
          [options, &common] { return render(*options, common); }};
}

}  // namespace catoptric::app
