// Generates the shell scripts of a submission's tasks.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "cluster/submission.h"

namespace catoptric::cluster {

/// Names of the scripts in a submission's folder.
inline constexpr const char* kChunkScript = "chunk.sh";
inline constexpr const char* kMergeScript = "merge.sh";
inline constexpr const char* kRunScript = "run.sh";

/// The arguments as shell words, each after a space.
std::string shellWords(const std::vector<std::string>& arguments);

/// chunk.sh renders one chunk: `chunk.sh NUMBER`, or `chunk.sh --array OFFSET` as a task of a Slurm
/// array.
std::string chunkScript(const Submission& submission);

/// merge.sh merges the chunks into merged/.
std::string mergeScript(const Submission& submission);

/// run.sh renders all chunks on this machine, several at a time, and merges them.
std::string runScript(const Submission& submission);

/// Writes the scripts as executable files to the submission's folder; run.sh only for
/// Engine::Script. Throws OutputError.
void writeScripts(const Submission& submission);
/// Whether writeScripts() may write a file of this name.
bool isScript(const std::filesystem::path& name);

}  // namespace catoptric::cluster
