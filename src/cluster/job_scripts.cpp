#include "cluster/job_scripts.h"

#include <filesystem>

#include "core/error.h"
#include "core/file.h"
#include "core/text.h"
#include "scene/camera.h"

namespace catoptric::cluster {
namespace {

namespace fs = std::filesystem;

/// How long a task waits for another process that writes its chunk: what a lost node has left
/// there ends after Slurm's KillWait, or goes on to the end. Ours.
constexpr const char* kWaitSeconds = "600";

/// A script of the submission, as a shell word.
std::string scriptPath(const Submission& submission, const char* name) {
  return shellWord((submission.folder / name).string());
}

std::string enterFolder(const Submission& submission) {
  return "cd " + shellWord(submission.workingFolder) + " || exit 5\n";
}

}  // namespace

std::string shellWords(const std::vector<std::string>& arguments) {
  std::string text;
  for (const std::string& argument : arguments) text += " " + shellWord(argument);
  return text;
}

std::string chunkScript(const Submission& submission) {
  const std::string folder = shellWord(submission.folder.string());
  const std::string config = shellWord(submission.config().string());
  const std::string command =
      submission.isStudy()
          ? submission.study.front() + " " + config + shellWords(submission.runArguments) +
                shellWords({submission.study.begin() + 1, submission.study.end()}) +
                " --threads \"$threads\" --out " + shellWord(submission.studyFolder().string()) +
                " --existing resume --progress plain"
          : "render " + config + shellWords(submission.runArguments) +
                " --threads \"$threads\" --chunk \"$chunk/" + std::to_string(submission.chunks) +
                "\" \\\n  --out " + folder + "/parts/$chunk --existing resume --wait " +
                kWaitSeconds + " --no-tables --keep-going --progress plain";
  return "#!/bin/sh\n"
         "# Made by `catoptric submit`. Renders a chunk: chunk.sh NUMBER; as a task of a Slurm "
         "array:\n"
         "# chunk.sh --array OFFSET. It may run again at any time, and twice at a time.\n"
         "threads=0\n"
         "if [ \"$1\" = --array ]; then\n"
         "  chunk=$(($2 + SLURM_ARRAY_TASK_ID))\n"
         "  # The processors that Slurm has given to this task\n"
         "  threads=${SLURM_CPUS_ON_NODE:-0}\n"
         "else\n"
         "  chunk=$1\n"
         "fi\n"
         "# One task bakes the light for all\n"
         "CATOPTRIC_CACHE=" +
         folder +
         "/cache\n"
         "export CATOPTRIC_CACHE\n" +
         enterFolder(submission) +
         "echo \"chunk $chunk on $(uname -n), $(date +%Y-%m-%dT%H:%M:%S.%N)\" >>" + folder +
         "/logs/$chunk.log\n"
         "# exec, so that signals reach the program\n"
         "exec " +
         shellWord(submission.program) + " " + command + " \\\n  >>" + folder +
         "/logs/$chunk.log 2>&1\n";
}

std::string mergeScript(const Submission& submission) {
  const std::string folder = shellWord(submission.folder.string());
  return "#!/bin/sh\n# Made by `catoptric submit`. Merges the chunks into merged/.\n" +
         enterFolder(submission) + "exec " + shellWord(submission.program) + " merge " + folder +
         " --existing overwrite >" + folder + "/logs/merge.log 2>&1\n";
}

/// Runs the script $0 of the chunk $1, and says how it ended.
constexpr const char* kRunOne =
    R"("$0" "$1" && echo "chunk $1 is done" || { echo "chunk $1 failed" >&2; exit 1; })";

std::string runScript(const Submission& submission) {
  const std::string folder = shellWord(submission.folder.string());
  const std::string failed =
      " || { echo \"some chunks failed; see: catoptric status \"" + folder + " >&2; exit 6; }\n";
  if (submission.isStudy())
    return "#!/bin/sh\n# Made by `catoptric submit`. Run it again to continue.\n" +
           scriptPath(submission, kChunkScript) + " 1" + failed;
  std::string chunks;
  for (const int chunk : submission.wanted()) chunks += std::to_string(chunk) + "\n";
  return "#!/bin/sh\n"
         "# Made by `catoptric submit`. Renders all chunks on this machine, PARALLEL at a time, "
         "and\n"
         "# merges them: run.sh [PARALLEL [I/N]]. With I/N it renders the Ith of N shares of the\n"
         "# chunks and merges nothing: run it on N machines that share this folder, then "
         "merge.sh.\n"
         "# Run it again to go on: finished frames are kept.\n"
         "parallel=${1:-1}\n"
         "share=${2:-1/1}\n"
         "if ! printf '%s %s\\n' \"$parallel\" \"$share\" |\n"
         "    grep -qxE '[1-9][0-9]{0,3} [1-9][0-9]{0,5}/[1-9][0-9]{0,5}' || [ $# -gt 2 ] ||\n"
         "    [ \"${share%/*}\" -gt \"${share#*/}\" ]; then\n"
         "  echo \"run.sh: PARALLEL and I/N are numbers from 1, as in run.sh 2 1/3\" >&2\n"
         "  exit 2\n"
         "fi\n"
         "awk -v i=\"${share%/*}\" -v n=\"${share#*/}\" 'NR % n == i % n' <<'CHUNKS' |\n" +
         chunks + "CHUNKS\n  xargs -P \"$parallel\" -n 1 sh -c " + shellWord(kRunOne) + " " +
         scriptPath(submission, kChunkScript) + failed + "[ \"$share\" != 1/1 ] || " +
         scriptPath(submission, kMergeScript) + " || { cat " + folder +
         "/logs/merge.log >&2; exit 6; }\n";
}

void writeScripts(const Submission& submission) {
  const auto write = [&](const char* name, const std::string& text) {
    const fs::path file = submission.folder / name;
    writeFileAtomically(file, text);
    std::error_code error;
    fs::permissions(file, fs::perms::owner_exec | fs::perms::group_exec | fs::perms::others_exec,
                    fs::perm_options::add, error);
    if (error) throw OutputError(file.string() + ": " + error.message());
  };
  write(kChunkScript, chunkScript(submission));
  if (!submission.isStudy()) write(kMergeScript, mergeScript(submission));
  if (submission.engine == Engine::Script) write(kRunScript, runScript(submission));
}

bool isScript(const fs::path& name) {
  return name == kChunkScript || name == kMergeScript || name == kRunScript;
}

}  // namespace catoptric::cluster
