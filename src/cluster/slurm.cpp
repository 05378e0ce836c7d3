#include "cluster/slurm.h"

#include <sys/wait.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>

#include "cluster/job_scripts.h"
#include "core/error.h"
#include "core/text.h"
#include "scene/camera.h"

namespace catoptric::cluster {
namespace {

constexpr int kDefaultMaxArraySize = 1001;  ///< Slurm's
/// Ids that a command line takes at once; ours.
constexpr std::size_t kMostIds = 500;

/// Runs a command; what it prints on stdout. What it says on stderr is the user's to read. Throws
/// UsageError when it fails.
std::string output(const std::vector<std::string>& words) {
  std::string command;
  for (const std::string& word : words) command += shellWord(word) + " ";
  std::FILE* pipe = ::popen(command.c_str(), "r");
  if (pipe == nullptr)
    throw Error(ExitCode::Internal, words[0] + ": the command cannot be started");
  std::string text;
  std::array<char, 65536> part{};
  while (const std::size_t n = std::fread(part.data(), 1, part.size(), pipe))
    text.append(part.data(), n);
  const int status = ::pclose(pipe);
  const int code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  constexpr int kNotFound = 127;  // of a shell
  if (code == kNotFound)
    throw UsageError(words[0] +
                     ": command not found; run this on a host with Slurm, or use --to script");
  if (code != 0)
    throw UsageError(words[0] + " failed with exit code " + std::to_string(code) +
                     "; its message is above. The command: " + command);
  return text;
}

std::vector<std::string> split(const std::string& text, char separator) {
  std::vector<std::string> parts;
  for (std::size_t start = 0; start <= text.size();) {
    const std::size_t end = std::min(text.find(separator, start), text.size());
    parts.push_back(text.substr(start, end - start));
    start = end + 1;
  }
  return parts;
}

/// Indices of an array are below this.
int maxArraySize() {
  for (const std::string& line : split(output({"scontrol", "show", "config"}), '\n'))
    if (line.starts_with("MaxArraySize")) {
      const std::size_t equals = line.find('=');
      const int size = equals == std::string::npos ? 0 : std::atoi(line.c_str() + equals + 1);
      if (size > 1) return size;
    }
  return kDefaultMaxArraySize;
}

/// The id that `sbatch --parsable` prints: "17" or "17;cluster".
std::string submitted(const std::vector<std::string>& words) {
  const std::string text = output(words);
  std::string id = text.substr(0, text.find_first_of(";\n"));
  if (id.empty() || id.find_first_not_of("0123456789") != std::string::npos)
    throw UsageError("sbatch printed \"" + text + "\" instead of a job's number");
  return id;
}

std::vector<std::string> sbatchWords(const Submission& submission, const std::string& name,
                                     const std::string& log) {
  std::vector<std::string> words = {"sbatch",
                                    "--parsable",
                                    "--requeue",
                                    "--open-mode=append",
                                    "--job-name=" + name,
                                    "--output=" + (submission.folder / "logs" / log).string()};
  words.insert(words.end(), submission.slurmArguments.begin(), submission.slurmArguments.end());
  return words;
}

}  // namespace

std::string arrayIndices(const std::vector<int>& indices) {
  std::string text = scene::formatFrames(indices);
  std::replace(text.begin(), text.end(), 'x', ':');
  return text;
}

std::vector<QueuedTask> queuedTasks() {
  std::vector<QueuedTask> tasks;
  const std::string text =
      output({"squeue", "--me", "--noheader", "--array", "--format=%F|%K|%T|%r"});
  for (const std::string& line : split(text, '\n')) {
    const std::vector<std::string> cells = split(line, '|');
    if (cells.size() == 4)
      tasks.push_back({cells[0], std::atoi(cells[1].c_str()), cells[2], cells[3]});
  }
  return tasks;
}

void submitToSlurm(Submission& submission, const std::vector<int>& chunks) {
  const std::string name = submission.folder.filename().string();
  std::string dependency = "afterany";
  if (!chunks.empty()) {
    const int window = maxArraySize() - 1;  // index 0 is not used
    for (std::size_t first = 0; first < chunks.size();) {
      const int offset = (chunks[first] - 1) / window * window;
      std::vector<int> indices;
      Job job;
      for (; first < chunks.size() && chunks[first] - offset <= window; ++first) {
        job.chunks.push_back(chunks[first]);
        indices.push_back(chunks[first] - offset);
      }
      const std::string most =
          submission.maxParallel > 0 ? "%" + std::to_string(submission.maxParallel) : "";
      std::vector<std::string> words = sbatchWords(submission, name, "slurm-%A.log");
      words.push_back("--array=" + arrayIndices(indices) + most);
      if (submission.isStudy()) words.emplace_back("--exclusive");  // its times must be its own
      words.push_back((submission.folder / kChunkScript).string());
      words.emplace_back("--array");
      words.push_back(std::to_string(offset));
      job.id = submitted(words);
      job.offset = offset;
      dependency += ":" + job.id;
      recordJob(submission, job);
    }
  }
  if (submission.isStudy()) return;
  std::vector<std::string> words = sbatchWords(submission, name + "-merge", "slurm-%j.log");
  if (!chunks.empty()) words.push_back("--dependency=" + dependency);
  words.push_back((submission.folder / kMergeScript).string());
  recordJob(submission, {submitted(words), 0, {}});
}

void cancelInSlurm(const Submission& submission) {
  std::vector<std::string> ids;
  for (const QueuedTask& task : queuedTasks())
    if (std::any_of(submission.jobs.begin(), submission.jobs.end(),
                    [&](const Job& job) { return job.id == task.job; }) &&
        std::find(ids.begin(), ids.end(), task.job) == ids.end())
      ids.push_back(task.job);
  for (std::size_t first = 0; first < ids.size(); first += kMostIds) {
    std::vector<std::string> words = {"scancel"};
    for (std::size_t i = first; i < std::min(ids.size(), first + kMostIds); ++i)
      words.push_back(ids[i]);
    output(words);
  }
}

}  // namespace catoptric::cluster
