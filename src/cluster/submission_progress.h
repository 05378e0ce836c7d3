// What has become of a submission's chunks: told by their folders, and by Slurm of those that it
// has.
#pragma once

#include <string>
#include <vector>

#include "cluster/slurm.h"
#include "cluster/submission.h"

namespace catoptric::cluster {

enum class ChunkState {
  Done,     ///< all its frames are there
  Running,  ///< a task renders it
  Waiting,  ///< a task is to render it
  Held,     ///< a task waits for something that does not come by itself
  Failed,   ///< frames are missing, and no task makes them
};
const char* stateName(ChunkState state);

struct ChunkProgress {
  int chunk = 0;
  ChunkState state = ChunkState::Failed;
  int frames = 0;
  int finished = 0;
  std::string note;  ///< why it is held; the last words of one that failed
};

struct SubmissionProgress {
  std::vector<ChunkProgress> chunks;
  bool merging = false;  ///< the job that merges waits or runs
  bool merged = false;   ///< merged/ holds a run with all frames

  int frames() const;
  int finished() const;
  std::vector<int> chunksThatAre(ChunkState state) const;
  /// Some task waits or runs, and can end without anybody's help.
  bool moves() const;
};

/// Frames count when their records are there and their files have the recorded sizes; with
/// `contents` when the files have the recorded contents too, which reads them all.
SubmissionProgress progressOf(const Submission& submission, const std::vector<QueuedTask>& queued,
                              bool contents);

}  // namespace catoptric::cluster
