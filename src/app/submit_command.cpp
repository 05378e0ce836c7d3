// catoptric submit.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <memory>

#include "app/commands.h"
#include "app/plan_command.h"
#include "app/run_options.h"
#include "cluster/job_scripts.h"
#include "cluster/slurm.h"
#include "cluster/submission.h"
#include "config/json_text.h"
#include "core/log.h"
#include "core/text.h"
#include "run/folder/records.h"
#include "run/sequence/session.h"
#include "scene/camera.h"

namespace catoptric::app {
namespace {

namespace fs = std::filesystem;

struct SubmitOptions : RunOptions {
  std::string to = "slurm";
  int chunks = 0;
  double taskMinutes = 5.0;
  std::string times;
  int maxParallel = 0;
  std::vector<std::string> sbatch;
  std::vector<std::string> study;
  bool dryRun = false;
};

/// What an earlier run says of the times of this one.
struct MeasuredTimes {
  double startupSeconds = 0.0;
  double frameSeconds = 0.0;  ///< of all methods
};

/// Means of a run's frames, and of its start-ups; of all its methods.
MeasuredTimes measuredTimes(const fs::path& folder) {
  std::vector<fs::path> runs;
  std::error_code error;
  if (fs::exists(folder / "frames.jsonl", error)) runs.push_back(folder);
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, error))
    if (fs::exists(entry.path() / "frames.jsonl", error)) runs.push_back(entry.path());
  if (runs.empty())
    throw UsageError("--times " + folder.string() +
                     ": has no run; render some frames of this config there first");
  MeasuredTimes times;
  for (const fs::path& path : runs) {
    const run::RunRecords records = run::readRunRecords(path);
    double seconds = 0.0;
    for (const auto& [number, record] : records.frames)
      for (const frame::StepSample& sample : record.samples)
        if (sample.clock != "overlapped") seconds += sample.seconds;
    if (!records.frames.empty())
      times.frameSeconds += seconds / static_cast<double>(records.frames.size());
    for (const frame::StepSample& sample : records.startup) times.startupSeconds += sample.seconds;
  }
  return times;
}

/// --chunks, or as many as have tasks of --task-minutes.
int chunkCount(const SubmitOptions& options, std::size_t frames) {
  // More than there are frames would be empty
  if (options.chunks > 0)
    return static_cast<int>(std::min(static_cast<std::size_t>(options.chunks), frames));
  if (options.times.empty())
    throw UsageError(
        "give the number of chunks by --chunks N; or --times RUN, a run of some of these frames, "
        "so that each task takes about --task-minutes");
  const MeasuredTimes times = measuredTimes(options.times);
  constexpr double kSecondsPerMinute = 60.0;
  const double left = options.taskMinutes * kSecondsPerMinute - times.startupSeconds;
  if (left < times.frameSeconds)
    log::warning("even a task with one frame takes longer than --task-minutes: " +
                 std::to_string(std::lround(times.startupSeconds + times.frameSeconds)) + " s, " +
                 std::to_string(std::lround(times.startupSeconds)) +
                 " s of it before the first frame");
  const double perChunk = std::max(1.0, std::floor(left / times.frameSeconds));
  return static_cast<int>(std::ceil(static_cast<double>(frames) / perChunk));
}

/// Which frames each chunk has, for each method.
std::vector<cluster::MethodShare> sharesOf(const run::Stage& stage, int chunks) {
  std::vector<cluster::MethodShare> shares;
  const auto made = run::makeMethods(stage, methods::registry());
  for (std::size_t i = 0; i < made.size(); ++i) {
    const run::MethodConfig& method = stage.run().methods[i];
    const std::vector<run::FrameTask> tasks =
        run::makeTasks(stage, method, *made[i], stage.frames());
    const std::vector<int> numbers = run::askedNumbers(tasks);
    const std::vector<std::size_t> bounds = run::chunkBounds(tasks, chunks);
    cluster::MethodShare share{
        method.name, run::methodFolder(stage.run(), method, "").string(), {}};
    for (std::size_t c = 0; c + 1 < bounds.size(); ++c)
      share.chunks.emplace_back(numbers.begin() + static_cast<std::ptrdiff_t>(bounds[c]),
                                numbers.begin() + static_cast<std::ptrdiff_t>(bounds[c + 1]));
    shares.push_back(std::move(share));
  }
  return shares;
}

/// The program's own file, which the tasks run too.
std::string ownProgram() {
  std::error_code error;
  const fs::path path = fs::read_symlink("/proc/self/exe", error);
  if (error)
    throw Error(ExitCode::Internal, "the program's own file (/proc/self/exe) cannot be found");
  return path.string();
}

/// What stands after --.
void checkStudy(const std::vector<std::string>& study) {
  if (study.front() != "sweep")
    throw UsageError("\"" + study.front() +
                     "\" cannot be submitted, only a sweep: -- sweep OPTIONS");
  for (const std::string& word : study)
    for (const char* own : {"--out", "--existing", "--progress", "--dry-run"})
      if (word.starts_with(own))
        throw UsageError(word + ": cannot be used here; submit sets it for the sweep");
}

/// What the sweep would refuse is refused now; it says why.
void trySweep(const cluster::Submission& submission) {
  const std::string command =
      cluster::shellWords({submission.program, "sweep"}) +
      cluster::shellWords({submission.config().string()}) +
      cluster::shellWords(submission.runArguments) +
      cluster::shellWords({submission.study.begin() + 1, submission.study.end()}) +
      " --dry-run -q >/dev/null";
  if (std::system(command.c_str()) != 0)
    throw UsageError("catoptric sweep refuses these arguments; its message is above");
}

std::string summaryText(const cluster::Submission& submission, std::size_t frames) {
  if (submission.isStudy()) return "a sweep, in one task";
  const auto counted = [](std::size_t count, const std::string& what) {
    return std::to_string(count) + " " + what + (count == 1 ? "" : "s");
  };
  const std::size_t chunks = submission.wanted().size();
  std::string text = counted(frames, "frame") + " by " +
                     counted(submission.methods.size(), "method") + " in " +
                     counted(chunks, "chunk");
  const auto asked = static_cast<std::size_t>(submission.chunks);
  if (chunks < std::min(asked, frames))
    text += " (instead of " + std::to_string(asked) +
            ": a chunk begins only at a frame that needs no earlier frame)";
  return text;
}

/// What is refused leaves no folder that would stand in the way of the next try.
void createAndSubmit(cluster::Submission& submission, const std::string& config) {
  cluster::createSubmission(submission, config);
  try {
    if (submission.isStudy()) trySweep(submission);
    if (submission.engine == cluster::Engine::Slurm)
      cluster::submitToSlurm(submission, submission.wanted());
  } catch (const Error&) {
    std::error_code ignored;
    if (submission.jobs.empty()) fs::remove_all(submission.folder, ignored);
    throw;
  }
}

ExitCode submit(const SubmitOptions& options, const CommonOptions& common) {
  cluster::Submission submission;
  submission.engine = cluster::parseEngine(options.to);
  const InputConfig input = readConfig(options);
  const run::Stage stage(input.run);
  planOf(stage);  // what the tasks would refuse is refused now
  submission.folder =
      fs::absolute(options.out.empty() ? "out/" + input.run.name : options.out).lexically_normal();
  if (!submission.folder.has_filename()) submission.folder = submission.folder.parent_path();
  submission.program = ownProgram();
  submission.workingFolder = fs::current_path().string();
  for (const std::string& method : options.methods) {
    submission.runArguments.emplace_back("--method");
    submission.runArguments.push_back(method);
  }
  if (!common.shaderFolder.empty())
    submission.runArguments.insert(submission.runArguments.end(),
                                   {"--shader-dir", fs::absolute(common.shaderFolder).string()});
  submission.slurmArguments = options.sbatch;
  submission.maxParallel = options.maxParallel;
  submission.study = options.study;
  if (submission.isStudy()) {
    checkStudy(options.study);
    submission.chunks = 1;
  } else {
    submission.chunks = chunkCount(options, stage.frames().size());
    submission.methods = sharesOf(stage, submission.chunks);
  }

  const std::string summary = summaryText(submission, stage.frames().size());
  if (options.dryRun) {
    printData(summary + "\n");
    return ExitCode::Done;
  }
  createAndSubmit(submission, portableConfig(input));

  std::vector<std::string> jobs;
  for (const cluster::Job& job : submission.jobs) jobs.push_back(job.id);
  if (common.json)
    printData(config::JsonText()
                  .add("out", submission.folder.string())
                  .add("chunks", static_cast<int>(submission.wanted().size()))
                  .add("jobs", jobs)
                  .object() +
              "\n");
  else if (submission.engine == cluster::Engine::Slurm)
    printData(summary + ", jobs " + joined(jobs, ", ") + "\nSee: catoptric status " +
              submission.folder.string() + "\n");
  else
    printData(summary + "\nRun: " + (submission.folder / cluster::kRunScript).string() +
              " [PARALLEL]\n");
  return ExitCode::Done;
}

Rows taskRows(SubmitOptions& options) {
  return Rows{
      option("--to", options.to, "ENGINE",
             "How the tasks are run: by slurm, or by a shell script (script)",
             {.showsDefault = true}),
      option("--chunks", options.chunks, "N",
             "Number of chunks into which the frames are divided; a task renders one chunk",
             {.least = 1, .most = 1'000'000}),
      option("--task-minutes", options.taskMinutes, "MINUTES",
             "With --times: time that a task should take",
             {.least = 0.01, .most = 100'000, .showsDefault = true}),
      option("--times", options.times, "RUN",
             "Instead of --chunks: a run of some of these frames, made by `render` on one of the "
             "nodes; the size of the chunks follows from its times",
             {.notEmpty = true}),
      option("--max-parallel", options.maxParallel, "N",
             "Largest number of tasks that run at the same time [as many as Slurm allows]",
             {.least = 1, .most = 1'000'000}),
      option("--sbatch", options.sbatch, "ARG",
             "An argument for sbatch, such as --sbatch=--partition=long; repeat the option for "
             "several",
             {.oneEach = true}),
      flag("--dry-run", options.dryRun, "Print how the frames would be divided, and write nothing"),
  };
}

}  // namespace

Command submitCommand(CommonOptions& common) {
  const auto options = std::make_shared<SubmitOptions>();
  const Rows own = {
      option(
          "study", options->study, "-- sweep OPTIONS",
          "Run a sweep in one task, instead of rendering frames: the word sweep and its options"),
      option("--out", options->out, "DIR",
             "Folder for the chunks and, in merged/, for the whole run; all nodes must have access "
             "to it [out/CONFIG, such as out/demo]",
             {.notEmpty = true}),
  };
  return {"submit",
          "Distribute the frames of a run over the nodes of a cluster, or over processes.",
          runRows(*options, common) + own + taskRows(*options), R"(Examples:
  catoptric submit configs/demo.json --chunks 20 --out out/shared --sbatch=--cpus-per-task=4
  catoptric status out/shared
  catoptric retry out/shared
  catoptric submit configs/demo.json --out out/levels -- sweep --vary image.width=128,256
  catoptric submit configs/demo.json --chunks 8 --to script --out out/shared && out/shared/run.sh 2
)" + exitCodes({{"2", "the command line or the config is wrong, or Slurm refuses"}, {"3"}, {"5"}}),
          [options, &common] { return submit(*options, common); }};
}

}  // namespace catoptric::app
