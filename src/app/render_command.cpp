// catoptric render, catoptric plan.
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <csignal>
#include <mutex>
#include <optional>
#include <thread>

#include "app/commands.h"
#include "app/progress.h"
#include "app/report_output.h"
#include "app/run_options.h"
#include "config/json_text.h"
#include "core/log.h"
#include "core/text.h"
#include "methods/contract/method.h"
#include "run/folder/machine.h"
#include "run/sequence/session.h"
#include "scene/camera.h"

namespace catoptric::app {
namespace {

std::atomic<int> stopSignal{0};
static_assert(std::atomic<int>::is_always_lock_free, "a signal handler uses it");

void noteSignal(int number) {
  // A second signal, of either kind, ends at once: what stands on the disk is complete.
  if (stopSignal.exchange(number) != 0) ::_exit(128 + number);
  constexpr char kMessage[] = "\nstopping after this frame; once more to stop at once\n";
  // Nothing else may be called here; a message that cannot be written is no loss.
  [[maybe_unused]] const ssize_t written = ::write(STDERR_FILENO, kMessage, sizeof kMessage - 1);
}

void catchSignals() {
  struct sigaction action {};
  action.sa_handler = noteSignal;
  action.sa_flags = static_cast<int>(SA_RESTART);
  ::sigaction(SIGINT, &action, nullptr);
  ::sigaction(SIGTERM, &action, nullptr);
}

/// Ends the process when a stop that was asked for takes longer than `seconds`: the frame at hand
/// is dropped, all others stay. Frames and GL calls cannot be interrupted otherwise.
class StopDeadline {
 public:
  explicit StopDeadline(double seconds) : thread_([this, seconds] { watch(seconds); }) {}
  ~StopDeadline() {
    {
      const std::scoped_lock lock(mutex_);
      over_ = true;
    }
    changed_.notify_all();
    thread_.join();
  }
  StopDeadline(const StopDeadline&) = delete;
  StopDeadline& operator=(const StopDeadline&) = delete;

 private:
  void watch(double seconds) {
    constexpr auto kInterval = std::chrono::milliseconds(100);
    std::unique_lock lock(mutex_);
    double waited = 0.0;
    while (!changed_.wait_for(lock, kInterval, [this] { return over_; })) {
      if (stopSignal == 0) continue;
      waited += std::chrono::duration<double>(kInterval).count();
      if (waited < seconds) continue;
      log::warning("the frame at hand is dropped; --existing resume goes on with the run");
      ::_exit(128 + stopSignal);
    }
  }

  std::mutex mutex_;
  std::condition_variable changed_;
  bool over_ = false;
  std::thread thread_;  // last: starts when the others are there
};

struct RenderOptions : RunOptions {
  std::string existing = "error";
  std::string chunk = "1/1";
  std::string progress = "auto";
  double stopWithin = 15.0;
  bool keepGoing = false;
  bool dryRun = false;
};

run::Plan planOf(const run::Stage& stage) {
  const auto made = run::makeMethods(stage.run(), methods::registry());
  run::Plan plan = run::makePlan(stage.run(), stage.scene(), stage.frames().size(), made);
  if (const std::string warning = run::memoryWarning(plan, run::physicalMemoryBytes());
      !warning.empty())
    log::warning(warning);
  if (const std::string warning = run::cubeMapWarning(plan, stage.run().image); !warning.empty())
    log::warning(warning);
  if (const std::string warning = run::refractionWarning(plan, stage.scene()); !warning.empty())
    log::warning(warning);
  return plan;
}

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
ExitCode dryRun(const run::Stage& stage, const CommonOptions& common,
                const run::SessionOptions& session) {
  const run::Plan plan = planOf(stage);
  const std::vector<run::MethodForecast> forecasts =
      run::forecastAll(stage, methods::registry(), session);
  std::vector<std::string> methodTexts;
  std::string text;
  for (const run::MethodForecast& method : forecasts) {
    const run::SequenceForecast& frames = method.frames;
    methodTexts.push_back(config::JsonText()
                              .add("name", method.name)
                              .add("folder", method.folder.string())
                              .add("rendered", scene::formatFrames(frames.rendered))
                              .add("reused", scene::formatFrames(frames.reused))
                              .add("warmed_up", scene::formatFrames(frames.warmedUp))
                              .object());
    text += method.folder.string() + ": " + framesText(frames.rendered) + " would be rendered";
    if (session.existing == run::Existing::Resume)
      text += ", " + framesText(frames.reused) + " re-used (if the renderer is the same)";
    if (session.existing == run::Existing::Overwrite && std::filesystem::exists(method.folder))
      text += ", in place of the run that is there";
    if (!frames.warmedUp.empty())
      text += "; " + framesText(frames.warmedUp) +
              " too, for what later frames need of them, and not kept";
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

ExitCode render(const RenderOptions& options, const CommonOptions& common) {
  // All options are checked before anything is loaded.
  run::SessionOptions session;
  session.existing = run::parseExisting(options.existing);
  session.chunk = run::parseChunk(options.chunk);
  session.keepGoing = options.keepGoing;
  const ProgressMode mode = common.quiet ? ProgressMode::None : parseProgress(options.progress);
  const run::RunConfig run = readRun(options);
  session.out = outFolder(options, run);

  // Until the scene is loaded a signal ends the process by itself: nothing has been written.
  run::Stage stage(run);
  if (options.dryRun) return dryRun(stage, common, session);
  planOf(stage);  // what cannot be done, or needs too much memory, is said before all else

  catchSignals();
  const StopDeadline deadline(options.stopWithin);
  ProgressPrinter printer(mode);
  session.stopRequested = [] { return stopSignal != 0; };
  session.progress = [&](const std::string& method, const run::Progress& progress) {
    printer.show(method, progress);
  };
  const std::vector<run::MethodResult> results =
      run::renderAll(stage, methods::registry(), session);
  printer.endLine();

  // Tables of what is there, also when frames are missing.
  bool anyFailed = false;
  for (const run::MethodResult& result : results) {
    for (const run::FailedFrame& frame : result.frames.failed) {
      anyFailed = true;
      log::error(result.name + ": frame " + std::to_string(frame.frame) + ": " + frame.message);
    }
    if (!result.frames.missing.empty())
      log::warning(result.name + ": frames " + scene::formatFrames(result.frames.missing) +
                   " are missing; render them with --existing resume, or --frames " +
                   scene::formatFrames(result.frames.missing));
  }
  const bool anyFrames =
      std::any_of(results.begin(), results.end(), [](const run::MethodResult& result) {
        return !result.frames.rendered.empty() || !result.frames.reused.empty();
      });
  if (!anyFrames && !anyFailed && stopSignal == 0) log::info("this chunk holds no frame");
  std::string tables;
  if (anyFrames && stopSignal == 0) tables = writeReports(run, results, session.out, common.json);
  if (common.json) {
    config::JsonText all;
    all.add("out", session.out.string()).raw("methods", resultsJson(results));
    if (!tables.empty()) all.raw("errors", tables);
    printData(all.object() + "\n");
  } else {
    printData(tables);
  }
  if (stopSignal != 0) return static_cast<ExitCode>(128 + stopSignal);
  return anyFailed ? ExitCode::FramesFailed : ExitCode::Done;
}

ExitCode plan(const RunOptions& options, const CommonOptions& common) {
  const run::Stage stage(readRun(options));
  const run::Plan planned = planOf(stage);
  printData(common.json ? run::planJson(planned) + "\n" : run::planText(planned));
  return ExitCode::Done;
}

}  // namespace

void addRunOptions(CLI::App& command, RunOptions& options) {
  command.add_option("input", options.input, "Run config, or a scene (.json, .gltf, .glb)")
      ->required()
      ->type_name("CONFIG|SCENE");
  command.add_option("--frames", options.frames, "Frames of the path, such as 1-100x2,120")
      ->check(notEmpty())
      ->type_name("LIST");
  command
      .add_option("--method", options.methods,
                  "Method, or a name in the config; several: with commas, or the option again")
      ->type_name("NAME")
      ->delimiter(',')
      ->allow_extra_args(false);
  command
      .add_option(
          "--set", options.settings,
          "Changes one value of the config, such as image.width=256 or methods.traced.bvh=refit "
          "(a method's name, or its number in the config)")
      ->type_name("A.B=VALUE")
      ->allow_extra_args(false);
  command.add_option("--device", options.device, "auto, egl:N, surfaceless, osmesa")
      ->type_name("DEVICE");
  command.add_option("--threads", options.threads, "Threads; 0: one per processor")->type_name("N");
  command.add_option("--seed", options.seed, "Seed of all random numbers")->type_name("N");
}

void addRender(CLI::App& program, CommonOptions& common, Action& action) {
  CLI::App* command = program.add_subcommand("render", "Render the frames of a path");
  const auto options = std::make_shared<RenderOptions>();
  addRunOptions(*command, *options);
  command
      ->add_option("--out", options->out,
                   "Folder of the results (out/NAME); several methods: a folder each in it")
      ->check(notEmpty())
      ->type_name("DIR");
  command
      ->add_option("--existing", options->existing,
                   "What to do with an earlier run in that folder: error, overwrite, or resume "
                   "(keep the finished frames that fit)")
      ->capture_default_str()
      ->type_name("HOW");
  command->add_option("--chunk", options->chunk, "Only the i-th of n parts of the frames")
      ->type_name("I/N");
  command->add_flag("--keep-going", options->keepGoing,
                    "Go on after a frame that fails (exit 6 at the end)");
  command
      ->add_option(
          "--stop-within", options->stopWithin,
          "Seconds that SIGINT or SIGTERM leaves the frame at hand to be finished; then it "
          "is dropped")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 86400.0))
      ->type_name("SECONDS");
  command->add_flag("--dry-run", options->dryRun, "Say what would be done; write nothing");
  command->add_option("--progress", options->progress, "On stderr: auto, bar, plain, json, none")
      ->capture_default_str()
      ->type_name("HOW");
  addCommon(*command, common);
  command->footer(R"(
Examples:
  catoptric render configs/demo.json --out out/demo
  catoptric render room.glb --method environment_map --set image.width=1024
  catoptric render configs/demo.json --frames 1-100x10 --existing overwrite
  catoptric render configs/demo.json --chunk 2/8 --out out/part2
)");
  command->callback([options, &common, &action] {
    action = [options, &common] { return render(*options, common); };
  });
}

void addPlan(CLI::App& program, CommonOptions& common, Action& action) {
  CLI::App* command =
      program.add_subcommand("plan", "Say what a run would build, compile and allocate, and why");
  const auto options = std::make_shared<RunOptions>();
  addRunOptions(*command, *options);
  addCommon(*command, common);
  command->footer("\nExample:\n  catoptric plan configs/demo.json --method traced\n");
  command->callback([options, &common, &action] {
    action = [options, &common] { return plan(*options, common); };
  });
}

}  // namespace catoptric::app
