// Submits and queries jobs with Slurm's commands (sbatch, squeue, scancel, scontrol).
#pragma once

#include <string>
#include <vector>

#include "cluster/submission.h"

namespace catoptric::cluster {

/// A task that waits or runs.
struct QueuedTask {
  std::string job;     ///< id of the job, or of the array
  int index = 0;       ///< index in the array; 0 if the job is not an array
  std::string state;   ///< as squeue reports it: PENDING, RUNNING, COMPLETING, ...
  std::string reason;  ///< why the task waits
};

/// The user's tasks that wait or run. Throws Error if Slurm does not answer.
std::vector<QueuedTask> queuedTasks();

/// Submits `chunks` to Slurm as job arrays, split so that none exceeds Slurm's MaxArraySize. A
/// further job merges the chunks when all arrays have ended, successful or not. Adds the jobs to
/// submission.jobs and jobs.jsonl. If `chunks` is empty, only the merge job is submitted. Throws
/// UsageError if Slurm refuses.
void submitToSlurm(Submission& submission, const std::vector<int>& chunks);

/// Cancels all jobs of the submission that wait or run.
void cancelInSlurm(const Submission& submission);

/// Array indices in Slurm's syntax, e.g. "1-9:2,20".
std::string arrayIndices(const std::vector<int>& indices);

}  // namespace catoptric::cluster
