// Slurm, by its own commands (sbatch, squeue, scancel, scontrol).
#pragma once

#include <string>
#include <vector>

#include "cluster/submission.h"

namespace catoptric::cluster {

/// A task that waits or runs.
struct QueuedTask {
  std::string job;     ///< id of the job, or of the array
  int index = 0;       ///< in the array; 0 for a job that is none
  std::string state;   ///< as squeue says: PENDING, RUNNING, COMPLETING, ...
  std::string reason;  ///< why it waits
};

/// What waits or runs of the user. Throws Error when Slurm does not answer.
std::vector<QueuedTask> queuedTasks();

/// Gives `chunks` to Slurm, in as many arrays as its MaxArraySize asks for, and a job that merges
/// when they have ended, whatever became of them; records the jobs. No chunks: it merges alone.
/// Throws UsageError when Slurm refuses.
void submitToSlurm(Submission& submission, const std::vector<int>& chunks);

/// Ends all jobs of the submission that wait or run.
void cancelInSlurm(const Submission& submission);

/// "1-9:2,20": indices of an array in Slurm's way.
std::string arrayIndices(const std::vector<int>& indices);

}  // namespace catoptric::cluster
