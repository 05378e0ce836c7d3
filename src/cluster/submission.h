// A run that is shared among the tasks of a cluster: its folder, what each task renders, and the
// jobs that were given to the cluster.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace catoptric::cluster {

/// What a submission renders of one method.
struct MethodShare {
  std::string name;
  std::string folder;  ///< below the folder of a chunk; empty for a run's only method
  std::vector<std::vector<int>> chunks;  ///< the frames of each chunk; some chunks may be empty
};

/// An array job, or the job that merges.
struct Job {
  std::string id;
  int offset = 0;           ///< the chunk of array task i is offset + i
  std::vector<int> chunks;  ///< none: it merges
};

enum class Engine { Slurm, Script };
/// Throws UsageError.
Engine parseEngine(const std::string& text);

/// The folder holds submission.json, jobs.jsonl, the run config as it was submitted, the scripts of
/// the tasks, their logs in logs/, and the run of chunk N in parts/N. Chunks count from 1.
struct Submission {
  std::filesystem::path folder;  ///< absolute
  Engine engine = Engine::Slurm;
  std::string program;                      ///< the file that the tasks run
  std::string workingFolder;                ///< in which they run
  std::vector<std::string> runArguments;    ///< of `render`, besides the config and the chunk
  std::vector<std::string> slurmArguments;  ///< of sbatch
  int maxParallel = 0;                      ///< tasks at the same time; 0: as many as Slurm lets
  int chunks = 0;
  std::vector<MethodShare> methods;
  /// In place of frames: a sweep, whose times count only where one task on one node measures them
  /// all. The words of its command line after the config, without those about its folder.
  std::vector<std::string> study;
  std::vector<Job> jobs;

  std::filesystem::path config() const { return folder / "config.json"; }
  std::filesystem::path part(int chunk) const { return folder / "parts" / std::to_string(chunk); }
  std::filesystem::path log(int chunk) const;
  std::filesystem::path merged() const { return folder / "merged"; }
  std::filesystem::path studyFolder() const { return folder / "sweep"; }
  bool isStudy() const { return !study.empty(); }
  /// The chunks that have frames; a study is one chunk.
  std::vector<int> wanted() const;
};

bool isSubmission(const std::filesystem::path& folder);

/// Writes the folder, which must not hold anything yet, with the text of the run config. Throws
/// OutputError.
void createSubmission(const Submission& submission, const std::string& config);
/// Throws UsageError for a folder that is none.
Submission readSubmission(const std::filesystem::path& folder);
/// Adds a job to jobs.jsonl.
void recordJob(Submission& submission, const Job& job);

}  // namespace catoptric::cluster
