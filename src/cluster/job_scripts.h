// The shell scripts of a submission's tasks.
#pragma once

#include <string>
#include <vector>

#include "cluster/submission.h"

namespace catoptric::cluster {

/// Words for a shell, each after a space.
std::string shellWords(const std::vector<std::string>& arguments);

/// chunk.sh: renders one chunk, `chunk.sh NUMBER`, or as a task of a Slurm array
/// `chunk.sh --array OFFSET`.
std::string chunkScript(const Submission& submission);

/// merge.sh: merges the chunks into merged/.
std::string mergeScript(const Submission& submission);

/// run.sh: renders all chunks on this machine, several at a time, and merges them.
std::string runScript(const Submission& submission);

/// Writes them into the submission's folder, to be executed; run.sh for Engine::Script alone.
/// Throws OutputError.
void writeScripts(const Submission& submission);

}  // namespace catoptric::cluster
