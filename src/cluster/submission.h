// A run that is divided among the tasks of a cluster: its folder, the frames of each task, and the
// jobs that were submitted.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace catoptric::cluster {

/// The frames that a submission renders with one method.
struct MethodShare {
  std::string name;
  std::string folder;  ///< relative to the folder of a chunk; empty if the run has one method only
  std::vector<std::vector<int>> chunks;  ///< the frames of each chunk; some chunks may be empty
};

/// An array job, or the job that merges the chunks.
struct Job {
  std::string id;
  int offset = 0;           ///< array task i renders chunk offset + i
  std::vector<int> chunks;  ///< empty for the job that merges
};

enum class Engine { Slurm, Script };
/// Throws UsageError for any other text than an engine's name.
Engine parseEngine(const std::string& text);

/// A submission. Its folder contains submission.json, jobs.jsonl, the run config as submitted, the
/// scripts of the tasks, their logs in logs/, and the run of chunk N in parts/N. Chunks are
/// numbered from 1.
struct Submission {
  std::filesystem::path folder;  ///< absolute
  Engine engine = Engine::Slurm;
  std::string program;        ///< the executable that the tasks run
  std::string workingFolder;  ///< working directory of the tasks
  std::vector<std::string>
      runArguments;  ///< arguments of `render`, besides the config and the chunk
  std::vector<std::string> slurmArguments;  ///< arguments of sbatch
  int maxParallel = 0;  ///< maximum number of simultaneous tasks; 0: Slurm decides
  int chunks = 0;
  std::vector<MethodShare> methods;
  /// Set if the submission is a sweep instead of frames: the words of the sweep's command line
  /// after the config, except those about its folder. One task on one node measures the whole
  /// sweep, because only times from one node are comparable.
  std::vector<std::string> study;
  std::vector<Job> jobs;

  std::filesystem::path config() const { return folder / "config.json"; }
  std::filesystem::path part(int chunk) const { return folder / "parts" / std::to_string(chunk); }
  std::filesystem::path log(int chunk) const;
  std::filesystem::path merged() const { return folder / "merged"; }
  std::filesystem::path studyFolder() const { return folder / "sweep"; }
  bool isStudy() const { return !study.empty(); }
  /// The chunks that contain frames. A sweep is one chunk.
  std::vector<int> wanted() const;
};

bool isSubmission(const std::filesystem::path& folder);

/// Creates the folder, which must be empty, with the text of the run config and the scripts.
/// Throws OutputError.
void createSubmission(const Submission& submission, const std::string& config);
/// Throws UsageError if the folder is not a submission.
Submission readSubmission(const std::filesystem::path& folder);
/// Appends a job to jobs.jsonl.
void recordJob(Submission& submission, const Job& job);

}  // namespace catoptric::cluster
