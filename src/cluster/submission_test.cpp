// Folders of submissions, scripts and array indices; Slurm itself is asked by tests/slurm.py.
#include "cluster/submission.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <sstream>

#include "cluster/job_scripts.h"
#include "cluster/slurm.h"
#include "cluster/submission_progress.h"
#include "core/error.h"
#include "core/text.h"

namespace catoptric::cluster {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

std::string textOf(const fs::path& file) {
  std::ostringstream text;
  text << std::ifstream(file).rdbuf();
  return text.str();
}

class Submissions : public testing::Test {
 protected:
  Submissions() {
    const auto* info = testing::UnitTest::GetInstance()->current_test_info();
    folder_ = fs::absolute(fs::path(testing::TempDir()) /
                           (std::string("it's a submission ") + info->name()));
    fs::remove_all(folder_);
    made_.folder = folder_;
    made_.engine = Engine::Script;
    made_.program = "/bin/echo";
    made_.workingFolder = "/";
    made_.runArguments = {"--method", "it's $HOME"};
    made_.slurmArguments = {"--partition=long"};
    made_.maxParallel = 3;
    made_.chunks = 3;
    made_.methods = {{"a", "a", {{1, 2}, {}, {3}}}, {"b", "b", {{1, 2, 3}, {}, {}}}};
  }
  ~Submissions() override { fs::remove_all(folder_); }

  fs::path folder_;
  Submission made_;
};

TEST_F(Submissions, AreReadAsTheyWereWritten) {
  createSubmission(made_, "{}");
  recordJob(made_, {"17", 1000, {1001, 1003}});
  recordJob(made_, {"18", 0, {}});
  const Submission read = readSubmission(folder_);
  EXPECT_EQ(read.folder, folder_);
  EXPECT_EQ(read.engine, Engine::Script);
  EXPECT_EQ(read.runArguments, made_.runArguments);
  EXPECT_EQ(read.slurmArguments, made_.slurmArguments);
  EXPECT_EQ(read.maxParallel, 3);
  EXPECT_EQ(read.chunks, 3);
  ASSERT_EQ(read.methods.size(), 2u);
  EXPECT_EQ(read.methods[0].chunks, made_.methods[0].chunks);
  EXPECT_EQ(read.methods[1].folder, "b");
  EXPECT_THAT(read.wanted(), ElementsAre(1, 3));
  ASSERT_EQ(read.jobs.size(), 2u);
  EXPECT_EQ(read.jobs[0].offset, 1000);
  EXPECT_THAT(read.jobs[0].chunks, ElementsAre(1001, 1003));
  EXPECT_THAT(read.jobs[1].chunks, IsEmpty());
}

TEST_F(Submissions, NeedAnEmptyFolder) {
  createSubmission(made_, "{}");
  EXPECT_THROW(createSubmission(made_, "{}"), OutputError);
  // Killed before it was a submission: made anew. Others' files are not.
  std::filesystem::remove(made_.folder / "submission.json");
  createSubmission(made_, "{}");
  EXPECT_TRUE(fs::exists(made_.folder / "run.sh"));
  for (const char* other : {"parts/mine.txt", "mine.txt"}) {
    std::filesystem::remove(made_.folder / "submission.json");
    std::ofstream(made_.folder / other) << "mine";
    EXPECT_THROW(createSubmission(made_, "{}"), OutputError);
    std::filesystem::remove(made_.folder / other);
  }
  std::filesystem::remove(made_.folder / "parts");
  EXPECT_THROW(createSubmission(made_, "{}"), OutputError);
  EXPECT_THROW(readSubmission(folder_ / "parts"), UsageError);
}

TEST_F(Submissions, ScriptsPassEveryWordAsItIs) {
  createSubmission(made_, "{}");
  ASSERT_EQ(std::system((shellWord((folder_ / "chunk.sh").string()) + " 3").c_str()), 0);
  const std::string log = textOf(made_.log(3));
  EXPECT_THAT(log, HasSubstr("--method it's $HOME"));
  EXPECT_THAT(log, HasSubstr("--chunk 3/3 --out " + made_.part(3).string()));
}

TEST_F(Submissions, TasksShareACacheInTheFolderAndNoShaders) {
  const fs::path program = folder_.string() + " program";
  std::ofstream(program) << "#!/bin/sh\necho $CATOPTRIC_CACHE, $XDG_CACHE_HOME\n";
  fs::permissions(program, fs::perms::owner_all);
  made_.program = program.string();
  createSubmission(made_, "{}");
  const std::string chunk = shellWord((folder_ / "chunk.sh").string());
  ASSERT_EQ(std::system(("XDG_CACHE_HOME=/own " + chunk + " 1").c_str()), 0);
  EXPECT_THAT(textOf(made_.log(1)), HasSubstr((folder_ / "cache").string() + ", /own\n"));
}

TEST_F(Submissions, ArrayTasksAddTheirOffset) {
  createSubmission(made_, "{}");
  ASSERT_EQ(std::system(("SLURM_ARRAY_TASK_ID=2 SLURM_CPUS_ON_NODE=7 " +
                         shellWord((folder_ / "chunk.sh").string()) + " --array 1")
                            .c_str()),
            0);
  EXPECT_THAT(textOf(made_.log(3)), HasSubstr("--threads 7 --chunk 3/3"));
}

TEST_F(Submissions, RunScriptsTakeAllChunksOrAShareOfThem) {
  createSubmission(made_, "{}");
  const std::string script = shellWord((folder_ / "run.sh").string());
  for (const char* wrong : {"0", "-1", "x", "2 0/2", "2 3/2", "2 1", "2 1/2 more", "99999"})
    EXPECT_EQ(WEXITSTATUS(std::system((script + " " + wrong + " 2>/dev/null").c_str())), 2)
        << wrong;
  EXPECT_FALSE(fs::exists(made_.log(3)));
  ASSERT_EQ(std::system((script + " 2 2/2").c_str()), 0);
  EXPECT_FALSE(fs::exists(made_.log(1)));
  EXPECT_TRUE(fs::exists(made_.log(3)));
  EXPECT_FALSE(fs::exists(folder_ / "logs/merge.log"));
  ASSERT_EQ(std::system(script.c_str()), 0);
  EXPECT_TRUE(fs::exists(made_.log(1)));
  EXPECT_FALSE(fs::exists(made_.log(2)));  // it is empty
  EXPECT_TRUE(fs::exists(folder_ / "logs/merge.log"));
}

TEST_F(Submissions, StatesComeFromTheQueueWhereFramesAreMissing) {
  made_.methods = {{"a", "", {{1}, {2}, {3}}}};
  createSubmission(made_, "{}");
  std::ofstream(made_.log(2)) << "chunk 2 on node, today\nerror: it was too much\n\n";
  recordJob(made_, {"5", 0, {1, 2, 3}});
  recordJob(made_, {"6", 0, {}});
  const SubmissionProgress progress = progressOf(made_,
                                                 {{"4", 2, "RUNNING", "None"},
                                                  {"5", 1, "PENDING", "Resources"},
                                                  {"5", 3, "PENDING", "JobHeldUser"},
                                                  {"6", 0, "PENDING", "Dependency"}},
                                                 false);
  EXPECT_EQ(progress.frames(), 3);
  EXPECT_EQ(progress.finished(), 0);
  EXPECT_THAT(progress.chunksThatAre(ChunkState::Waiting), ElementsAre(1));
  EXPECT_THAT(progress.chunksThatAre(ChunkState::Failed), ElementsAre(2));
  EXPECT_THAT(progress.chunksThatAre(ChunkState::Held), ElementsAre(3));
  EXPECT_EQ(progress.chunks[1].note, "error: it was too much");
  EXPECT_TRUE(progress.merging);
  EXPECT_FALSE(progress.merged);
  EXPECT_TRUE(progress.moves());
}

TEST_F(Submissions, AChunkThatAProcessWritesIsRunning) {
  createSubmission(made_, "{}");
  const fs::path part = made_.part(1) / "b";
  fs::create_directories(part);
  std::ofstream(part / ".lock") << "";
  std::ofstream(made_.log(3)) << "chunk 3 on node, today\n";
  EXPECT_THAT(progressOf(made_, {}, false).chunksThatAre(ChunkState::NotStarted), ElementsAre(1));
  EXPECT_THAT(progressOf(made_, {}, false).chunksThatAre(ChunkState::Failed), ElementsAre(3));
  const int file = ::open((part / ".lock").c_str(), O_RDONLY);
  ASSERT_EQ(::flock(file, LOCK_EX), 0);
  EXPECT_THAT(progressOf(made_, {}, false).chunksThatAre(ChunkState::Running), ElementsAre(1));
  ::close(file);
}

TEST_F(Submissions, TheLastJobOfAChunkSaysItsState) {
  made_.methods = {{"a", "", {{1}, {2}, {3}}}};
  createSubmission(made_, "{}");
  recordJob(made_, {"5", 0, {1, 2, 3}});
  recordJob(made_, {"6", 1, {2, 3}});
  recordJob(made_, {"7", 0, {}});
  const auto progressWith = [&](const std::string& reason) {
    return progressOf(made_,
                      {{"5", 2, "PENDING", "JobHeldUser"},
                       {"6", 1, "RUNNING", "None"},
                       {"6", 2, "PENDING", reason},
                       {"7", 0, "PENDING", reason}},
                      false);
  };
  const SubmissionProgress progress = progressWith("Resources");
  EXPECT_THAT(progress.chunksThatAre(ChunkState::Running), ElementsAre(2));
  EXPECT_THAT(progress.chunksThatAre(ChunkState::Waiting), ElementsAre(3));
  EXPECT_TRUE(progress.merging);
  for (const char* reason :
       {"JobHeldUser", "JobHeldAdmin", "DependencyNeverSatisfied", "JobHoldMaxRequeue",
        "launch failed requeued held", "PartitionNodeLimit", "BadConstraints"}) {
    const SubmissionProgress held = progressWith(reason);
    EXPECT_THAT(held.chunksThatAre(ChunkState::Held), ElementsAre(3)) << reason;
    EXPECT_FALSE(held.merging) << reason;
  }
}

TEST_F(Submissions, ArraysEndAtSlurmsLargestIndex) {
  // Programs of Slurm's names: indices are below 4, and each job is written down.
  createSubmission(made_, "{}");
  const fs::path programs = folder_ / "programs";
  fs::create_directories(programs);
  std::ofstream(programs / "scontrol") << "#!/bin/sh\necho 'MaxArraySize = 4'\n";
  std::ofstream(programs / "sbatch") << "#!/bin/sh\ncd " << shellWord(programs.string())
                                     << "\necho \"$@\" >>jobs\ngrep -c . jobs\n";
  for (const char* name : {"scontrol", "sbatch"})
    fs::permissions(programs / name, fs::perms::owner_all);
  const std::string path = std::getenv("PATH");
  setenv("PATH", (programs.string() + ":" + path).c_str(), 1);
  submitToSlurm(made_, {3, 4, 6, 7});
  setenv("PATH", path.c_str(), 1);
  ASSERT_EQ(made_.jobs.size(), 4u);
  const std::vector<std::vector<int>> chunks = {{3}, {4, 6}, {7}, {}};
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(made_.jobs[i].id, std::to_string(i + 1));
    EXPECT_EQ(made_.jobs[i].offset, i < 3 ? static_cast<int>(3 * i) : 0);
    EXPECT_EQ(made_.jobs[i].chunks, chunks[i]);
  }
  const std::string jobs = textOf(programs / "jobs");
  for (const char* words : {"--array=3%3", "--array=1,3%3", "--array=1%3", "chunk.sh --array 0\n",
                            "chunk.sh --array 3\n", "chunk.sh --array 6\n",
                            "--dependency=afterany:1:2:3 ", "--partition=long"})
    EXPECT_THAT(jobs, HasSubstr(words));
}

TEST(Slurm, ArrayIndicesHaveTheirOwnSteps) {
  EXPECT_EQ(arrayIndices({1, 2, 3, 4, 8}), "1-4,8");
  EXPECT_EQ(arrayIndices({1, 3, 5, 7}), "1-7:2");
}

TEST(Engines, AreSlurmAndScript) {
  EXPECT_EQ(parseEngine("slurm"), Engine::Slurm);
  EXPECT_THROW(parseEngine("slrum"), UsageError);
}

}  // namespace
}  // namespace catoptric::cluster
