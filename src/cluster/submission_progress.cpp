#include "cluster/submission_progress.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <map>

#include "run/folder/records.h"

namespace catoptric::cluster {
namespace {

namespace fs = std::filesystem;

/// States of squeue in which a task does something, or has just done so.
constexpr std::array kAtWork = {"RUNNING",   "COMPLETING", "CONFIGURING", "STAGE_OUT",
                                "SUSPENDED", "STOPPED",    "SIGNALING",   "RESIZING"};
/// Reasons of waiting tasks that nothing but a person changes.
constexpr std::array kHeldBy = {"JobHeldUser",
                                "JobHeldAdmin",
                                "DependencyNeverSatisfied",
                                "JobHoldMaxRequeue",
                                "launch failed requeued held",
                                "PartitionNodeLimit",
                                "BadConstraints"};

template <std::size_t n>
bool isOneOf(const std::array<const char*, n>& words, const std::string& word) {
  return std::find(words.begin(), words.end(), word) != words.end();
}

/// Whether a frame's files are there, as its record says.
bool isFinished(const fs::path& folder, const run::FrameRecord& record, bool contents) {
  if (contents) return run::damage(folder, record).empty();
  return !record.files.empty() &&
         std::all_of(record.files.begin(), record.files.end(), [&](const run::FileRecord& file) {
           std::error_code error;
           return fs::file_size(folder / file.path, error) == file.bytes && !error;
         });
}

int finishedFrames(const fs::path& folder, const std::vector<int>& frames, bool contents) {
  if (frames.empty()) return 0;
  const run::RunRecords records = run::readRunRecords(folder);
  return static_cast<int>(std::count_if(frames.begin(), frames.end(), [&](int frame) {
    const auto record = records.frames.find(frame);
    return record != records.frames.end() && isFinished(folder, record->second, contents);
  }));
}

/// Whether a process writes there, as far as the file system tells.
bool isWritten(const fs::path& folder) {
  const int file = ::open((folder / ".lock").c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) return false;
  const bool busy = ::flock(file, LOCK_SH | LOCK_NB) != 0;
  ::close(file);
  return busy;
}

/// The last line of a log that says more than where the task ran.
std::string lastWords(const fs::path& log, int chunk) {
  std::ifstream file(log);
  std::string last;
  const std::string start = "chunk " + std::to_string(chunk) + " on ";
  for (std::string line; std::getline(file, line);)
    if (line.starts_with(start))
      last = "no message in its log; it ran as " + line;
    else if (!line.empty())
      last = line;
  return last.empty() ? "it has not started" : last;
}

/// Of a chunk that is not done.
ChunkState stateOf(int chunk, const Submission& submission, const QueuedTask* task) {
  if (task != nullptr) {
    if (isOneOf(kAtWork, task->state)) return ChunkState::Running;
    const bool held = isOneOf(kHeldBy, task->reason) || task->state.ends_with("HOLD");
    return held ? ChunkState::Held : ChunkState::Waiting;
  }
  const bool written = std::any_of(
      submission.methods.begin(), submission.methods.end(),
      [&](const MethodShare& method) { return isWritten(submission.part(chunk) / method.folder); });
  if (written) return ChunkState::Running;
  std::error_code error;
  const bool started =
      submission.engine == Engine::Slurm || fs::exists(submission.log(chunk), error);
  return started ? ChunkState::Failed : ChunkState::NotStarted;
}

/// Frames of a chunk; a study counts as one.
ChunkProgress progressOfChunk(const Submission& submission, int chunk, bool contents) {
  ChunkProgress progress;
  progress.chunk = chunk;
  for (const MethodShare& method : submission.methods) {
    const std::vector<int>& frames = method.chunks[static_cast<std::size_t>(chunk) - 1];
    progress.frames += static_cast<int>(frames.size());
    progress.finished += finishedFrames(submission.part(chunk) / method.folder, frames, contents);
  }
  if (submission.isStudy()) {
    std::error_code error;
    progress.frames = 1;
    progress.finished = fs::exists(submission.studyFolder() / "sweep.json", error) ? 1 : 0;
  }
  return progress;
}

}  // namespace

const char* stateName(ChunkState state) {
  switch (state) {
    case ChunkState::Done:
      return "done";
    case ChunkState::Running:
      return "running";
    case ChunkState::Waiting:
      return "waiting";
    case ChunkState::Held:
      return "held";
    case ChunkState::NotStarted:
      return "not started";
    case ChunkState::Failed:
      return "failed";
  }
  return "";
}

int SubmissionProgress::frames() const {
  int sum = 0;
  for (const ChunkProgress& chunk : chunks) sum += chunk.frames;
  return sum;
}

int SubmissionProgress::finished() const {
  int sum = 0;
  for (const ChunkProgress& chunk : chunks) sum += chunk.finished;
  return sum;
}

std::vector<int> SubmissionProgress::chunksThatAre(ChunkState state) const {
  std::vector<int> numbers;
  for (const ChunkProgress& chunk : chunks)
    if (chunk.state == state) numbers.push_back(chunk.chunk);
  return numbers;
}

bool SubmissionProgress::moves() const {
  return merging || !chunksThatAre(ChunkState::Running).empty() ||
         !chunksThatAre(ChunkState::Waiting).empty();
}

SubmissionProgress progressOf(const Submission& submission, const std::vector<QueuedTask>& queued,
                              bool contents) {
  // The task of a chunk is that of the last job that has it
  std::map<int, const QueuedTask*> taskOf;
  SubmissionProgress progress;
  for (const Job& job : submission.jobs)
    for (const QueuedTask& task : queued) {
      if (task.job != job.id) continue;
      if (job.chunks.empty())
        progress.merging = progress.merging || !isOneOf(kHeldBy, task.reason);
      else
        taskOf[job.offset + task.index] = &task;
    }
  for (const int chunk : submission.wanted()) {
    ChunkProgress one = progressOfChunk(submission, chunk, contents);
    one.state = ChunkState::Done;
    if (one.finished < one.frames) {
      const auto found = taskOf.find(chunk);
      const QueuedTask* task = found == taskOf.end() ? nullptr : found->second;
      one.state = stateOf(chunk, submission, task);
      if (one.state == ChunkState::Held) one.note = task->reason;
      if (one.state == ChunkState::Failed) one.note = lastWords(submission.log(chunk), chunk);
    }
    progress.chunks.push_back(std::move(one));
  }
  if (submission.isStudy())
    progress.merged = progress.finished() == progress.frames();
  else
    progress.merged = std::all_of(
        submission.methods.begin(), submission.methods.end(), [&](const MethodShare& method) {
          std::vector<int> frames;
          for (const std::vector<int>& chunk : method.chunks)
            frames.insert(frames.end(), chunk.begin(), chunk.end());
          return finishedFrames(submission.merged() / method.folder, frames, contents) ==
                 static_cast<int>(frames.size());
        });
  return progress;
}

}  // namespace catoptric::cluster
