// catoptric status, retry, cancel: of what `submit` has made.
#include <algorithm>
#include <chrono>
#include <memory>
#include <thread>

#include "app/commands.h"
#include "cluster/job_scripts.h"
#include "cluster/slurm.h"
#include "cluster/submission.h"
#include "cluster/submission_progress.h"
#include "config/json_text.h"
#include "core/log.h"
#include "core/text.h"
#include "scene/camera.h"

namespace catoptric::app {
namespace {

using cluster::ChunkState;

struct StatusOptions {
  std::string folder;
  bool wait = false;
  bool verify = false;
  bool dryRun = false;
};

constexpr ChunkState kStates[] = {ChunkState::Done, ChunkState::Running,    ChunkState::Waiting,
                                  ChunkState::Held, ChunkState::NotStarted, ChunkState::Failed};
constexpr std::size_t kMostNotes = 10;  ///< lines about chunks; ours

cluster::SubmissionProgress progressOf(const cluster::Submission& submission, bool verify) {
  const bool slurm = submission.engine == cluster::Engine::Slurm;
  return cluster::progressOf(
      submission, slurm ? cluster::queuedTasks() : std::vector<cluster::QueuedTask>(), verify);
}

std::string numbers(const std::vector<int>& chunks) {
  return chunks.empty() ? "" : scene::formatFrames(chunks);
}

std::string progressText(const cluster::Submission& submission,
                         const cluster::SubmissionProgress& progress) {
  if (submission.isStudy()) {
    const cluster::ChunkProgress& only = progress.chunks.front();
    return "the sweep is " + std::string(cluster::stateName(only.state)) +
           (only.note.empty() ? "" : ": " + only.note) + "\n";
  }
  std::string text = std::to_string(progress.finished()) + " of " +
                     std::to_string(progress.frames()) + " frames are there\n";
  for (const ChunkState state : kStates)
    if (const std::vector<int> chunks = progress.chunksThatAre(state); !chunks.empty())
      text += std::to_string(chunks.size()) + (chunks.size() == 1 ? " chunk " : " chunks ") +
              cluster::stateName(state) + ": " + numbers(chunks) + "\n";
  std::size_t notes = 0;
  for (const cluster::ChunkProgress& chunk : progress.chunks)
    if (!chunk.note.empty() && notes++ < kMostNotes)
      text += "  chunk " + std::to_string(chunk.chunk) + ": " + chunk.note + "\n";
  if (notes > kMostNotes) text += "  and " + std::to_string(notes - kMostNotes) + " more\n";
  return text + (progress.merged    ? "merged\n"
                 : progress.merging ? "to be merged\n"
                                    : "not merged\n");
}

std::string progressJson(const cluster::SubmissionProgress& progress) {
  config::JsonText states;
  for (const ChunkState state : kStates)
    states.add(cluster::stateName(state), progress.chunksThatAre(state));
  std::vector<std::string> notes;
  for (const cluster::ChunkProgress& chunk : progress.chunks)
    if (!chunk.note.empty())
      notes.push_back(
          config::JsonText().add("chunk", chunk.chunk).add("note", chunk.note).object());
  return config::JsonText()
             .add("frames", progress.frames())
             .add("finished", progress.finished())
             .raw("chunks", states.object())
             .raw("notes", "[" + joined(notes, ",") + "]")
             .add("merging", progress.merging)
             .add("merged", progress.merged)
             .object() +
         "\n";
}

ExitCode status(const StatusOptions& options, const CommonOptions& common) {
  cluster::Submission submission = cluster::readSubmission(options.folder);
  cluster::SubmissionProgress progress = progressOf(submission, options.verify);
  // Slurm is asked ever more rarely. Ours
  constexpr auto kAtMost = std::chrono::milliseconds(15'000);
  auto pause = std::chrono::milliseconds(250);
  while (options.wait && progress.moves()) {
    std::this_thread::sleep_for(pause);
    pause = std::min(kAtMost, pause + pause / 4);
    submission = cluster::readSubmission(options.folder);
    progress = progressOf(submission, options.verify);
  }
  printData(common.json ? progressJson(progress) : progressText(submission, progress));
  const auto any = [&](ChunkState state) { return !progress.chunksThatAre(state).empty(); };
  const bool idle = any(ChunkState::NotStarted) && !any(ChunkState::Running);
  const bool lost = any(ChunkState::Failed) || any(ChunkState::Held);
  if (lost)
    log::warning("frames are missing that no task will render; run: catoptric retry " +
                 options.folder);
  else if (idle)
    log::info("to start: " + (submission.folder / cluster::kRunScript).string() + " [PARALLEL]");
  return lost || idle ? ExitCode::FramesFailed : ExitCode::Done;
}

ExitCode retry(const StatusOptions& options, const CommonOptions& common) {
  cluster::Submission submission = cluster::readSubmission(options.folder);
  const cluster::SubmissionProgress progress = progressOf(submission, options.verify);
  std::vector<int> failed = progress.chunksThatAre(ChunkState::Failed);
  std::ranges::copy(progress.chunksThatAre(ChunkState::NotStarted), std::back_inserter(failed));
  std::ranges::sort(failed);
  const bool slurm = submission.engine == cluster::Engine::Slurm;
  const bool merges = !failed.empty() || (!progress.merged && !progress.moves());
  if (slurm && merges && !options.dryRun) cluster::submitToSlurm(submission, failed);
  if (common.json) {
    printData(config::JsonText().add("chunks", failed).add("merge", merges).object() + "\n");
    return ExitCode::Done;
  }
  std::string text = "No chunk has failed\n";
  if (merges)
    text = std::string(slurm && !options.dryRun ? "Submitted: " : "To be submitted: ") +
           (failed.empty() ? "" : "chunks " + numbers(failed) + ", and ") + "the merge\n";
  if (!slurm && merges)
    text += "Run: " + (submission.folder / cluster::kRunScript).string() + " [PARALLEL]\n";
  printData(text);
  return ExitCode::Done;
}

ExitCode cancel(const StatusOptions& options) {
  const cluster::Submission submission = cluster::readSubmission(options.folder);
  if (submission.engine != cluster::Engine::Slurm)
    throw UsageError(options.folder +
                     ": was submitted with --to script; interrupt its run.sh instead");
  cluster::cancelInSlurm(submission);
  return ExitCode::Done;
}

OptionRow folderRow(StatusOptions& options) {
  return option("run", options.folder, "RUN", "The folder (--out) of a `catoptric submit`",
                {.required = true});
}

OptionRow verifyRow(StatusOptions& options) {
  return flag("--verify", options.verify,
              "Read all frames, and count only those whose contents are as they were written");
}

}  // namespace

Command statusCommand(CommonOptions& common) {
  const auto options = std::make_shared<StatusOptions>();
  const Rows own = {
      folderRow(*options),
      flag("--wait", options->wait, "Wait until no task is waiting or running"),
      verifyRow(*options),
  };
  return {"status", "Print the state of the chunks of a `submit`.", own + commonRows(common),
          R"(Example:
  catoptric status out/shared --wait
)" + exitCodes({{"0", "no frame is missing, or tasks still render the missing ones"},
                {"2", "the command line is wrong, or Slurm does not answer"},
                {"6", "frames are missing that no task will render"}}),
          [options, &common] { return status(*options, common); }};
}

Command retryCommand(CommonOptions& common) {
  const auto options = std::make_shared<StatusOptions>();
  const Rows own = {
      folderRow(*options),
      verifyRow(*options),
      flag("--dry-run", options->dryRun, "List the chunks, and submit nothing"),
  };
  return {"retry",
          "Resubmit the chunks with missing frames, except those that a task renders or is waiting "
          "to render.",
          own + commonRows(common),
          R"(Finished frames are kept, even those of a failed chunk.

Example:
  catoptric retry out/shared
)",
          [options, &common] { return retry(*options, common); }};
}

Command cancelCommand(CommonOptions& common) {
  const auto options = std::make_shared<StatusOptions>();
  return {"cancel", "Cancel the waiting and running tasks of a `submit`. Finished frames are kept.",
          Rows{folderRow(*options)} + commonRows(common),
          "Example:\n  catoptric cancel out/shared\n", [options] { return cancel(*options); }};
}

}  // namespace catoptric::app
