// The state of a submission's chunks, from their folders and from Slurm's queue.
#pragma once

#include <string>
#include <vector>

#include "cluster/slurm.h"
#include "cluster/submission.h"

namespace catoptric::cluster {

enum class ChunkState {
  Done,        ///< all its frames are finished
  Running,     ///< a task renders it
  Waiting,     ///< a task is queued for it
  Held,        ///< its task waits for an action of the user
  NotStarted,  ///< nobody has run its script yet
  Failed,      ///< frames are missing, and no task will render them
};
const char* stateName(ChunkState state);

struct ChunkProgress {
  int chunk = 0;
  ChunkState state = ChunkState::Failed;
  int frames = 0;
  int finished = 0;
  std::string note;  ///< why it is held, or the last lines of the log if it failed
};

struct SubmissionProgress {
  std::vector<ChunkProgress> chunks;
  bool merging = false;  ///< the merge job waits or runs
  bool merged = false;   ///< merged/ contains a run with all frames

  int frames() const;
  int finished() const;
  std::vector<int> chunksThatAre(ChunkState state) const;
  /// Whether any task runs, or waits and will run without help of the user.
  bool moves() const;
};

/// A frame counts as finished if its record exists and its files have the recorded sizes. With
/// `contents`, the recorded contents are checked too, which reads all files.
SubmissionProgress progressOf(const Submission& submission, const std::vector<QueuedTask>& queued,
                              bool contents);

}  // namespace catoptric::cluster
