// What bounds a process's memory, and runs that do not fit in it.
#include "run/folder/memory.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <vector>

#include "core/error.h"
#include "run/test_folders.h"

namespace catoptric::run {
namespace {

using testing::HasSubstr;

constexpr std::uint64_t kMiB = 1 << 20;

/// A root with a machine that has 1000 MiB free, on which this process has 10 MiB.
class Machine {
 public:
  Machine() : root_(freshFolder()) {
    write("proc/meminfo", "MemTotal: 9999999 kB\nMemAvailable: 819200 kB\nSwapFree: 204800 kB\n");
    const auto pages = static_cast<std::uint64_t>(::sysconf(_SC_PAGE_SIZE));
    write("proc/self/statm", std::to_string(10 * kMiB / pages) + " " +
                                 std::to_string(10 * kMiB / pages) + " 0 0 0 0 0\n");
  }
  void write(const fs::path& file, const std::string& text) const {
    fs::create_directories((root_ / file).parent_path());
    writeFileAtomically(root_ / file, text);
  }
  ObtainableMemory memory() const { return obtainableMemory(root_); }
  std::uint64_t free() const { return freeMemory(root_); }
  std::uint64_t peak() const { return peakMemory(root_); }

 private:
  fs::path root_;
};

TEST(Memory, WithoutGroupsItIsWhatTheMachineHasFree) {
  const Machine machine;
  EXPECT_EQ(machine.memory().bytes, 1010 * kMiB);
  EXPECT_EQ(machine.memory().limit, "this machine still has");
}

TEST(Memory, GroupsAboveTheProcessBoundIt) {
  const Machine machine;
  machine.write("proc/self/cgroup", "0::/job_1/step_0\n");
  machine.write("sys/fs/cgroup/job_1/step_0/memory.max", "max\n");
  machine.write("sys/fs/cgroup/job_1/step_0/memory.current", "1\n");
  EXPECT_EQ(machine.memory().bytes, 1010 * kMiB);
  // 500 MiB, of which 200 are used; 50 of these are pages of files
  machine.write("sys/fs/cgroup/job_1/memory.max", std::to_string(500 * kMiB));
  machine.write("sys/fs/cgroup/job_1/memory.current", std::to_string(200 * kMiB));
  machine.write("sys/fs/cgroup/job_1/memory.stat",
                "anon 9\ninactive_file " + std::to_string(50 * kMiB) + "\n");
  EXPECT_EQ(machine.memory().bytes, (10 + 350) * kMiB);
  EXPECT_THAT(machine.memory().limit, HasSubstr("control group"));
  // Pages of files that were used more than once
  machine.write("sys/fs/cgroup/job_1/memory.stat", "inactive_file " + std::to_string(50 * kMiB) +
                                                       "\nactive_file " +
                                                       std::to_string(30 * kMiB) + "\n");
  EXPECT_EQ(machine.memory().bytes, (10 + 380) * kMiB);
}

TEST(Memory, GroupsOfTheOlderVersionBoundIt) {
  const Machine machine;
  machine.write("proc/self/cgroup", "5:cpu,cpuacct:/job_2\n4:memory:/job_2\n");
  machine.write("sys/fs/cgroup/memory/job_2/memory.limit_in_bytes", std::to_string(300 * kMiB));
  machine.write("sys/fs/cgroup/memory/job_2/memory.usage_in_bytes", std::to_string(100 * kMiB));
  EXPECT_EQ(machine.memory().bytes, (10 + 200) * kMiB);
  machine.write("sys/fs/cgroup/memory/job_2/memory.stat",
                "active_file 1\ntotal_inactive_file " + std::to_string(20 * kMiB) +
                    "\ntotal_active_file " + std::to_string(40 * kMiB) + "\n");
  EXPECT_EQ(machine.memory().bytes, (10 + 260) * kMiB);
}

// Workers that swap are timed wrongly, and a limit of one process is not shared by several.
TEST(Memory, ProcessesShareWhatIsFreeWithoutSwap) {
  const Machine machine;
  EXPECT_EQ(machine.free(), 800 * kMiB);
  machine.write("proc/self/cgroup", "0::/job\n");
  machine.write("sys/fs/cgroup/job/memory.max", std::to_string(900 * kMiB));
  machine.write("sys/fs/cgroup/job/memory.current", std::to_string(50 * kMiB));
  EXPECT_EQ(machine.free(), 800 * kMiB);
  machine.write("sys/fs/cgroup/job/memory.current", std::to_string(200 * kMiB));
  EXPECT_EQ(machine.free(), 700 * kMiB);
}

// Not what the process had that started it: ru_maxrss begins with that.
TEST(Memory, APeakIsOfThisProgramAlone) {
  const Machine machine;
  machine.write("proc/self/status",
                "Name:\tcatoptric\nVmPeak:\t 9999 kB\nVmHWM:\t 1234 kB\nVmRSS:\t 10 kB\n");
  EXPECT_EQ(machine.peak(), 1234u * 1024);
  machine.write("proc/self/status", "Name:\tcatoptric\n");
  EXPECT_GT(machine.peak(), kMiB);
  std::vector<char> memory(256 * kMiB, 1);
  EXPECT_EQ(memory[memory.size() / 2], 1);
  memory = {};
  EXPECT_GT(peakMemory(), 256 * kMiB);
}

TEST(Memory, GpusAreFoundByTheirDevices) {
  const Machine machine;
  EXPECT_FALSE(machine.memory().gpu);
  machine.write("dev/dri/card0", "");  // a display without a GPU has one, too
  EXPECT_FALSE(machine.memory().gpu);
  machine.write("dev/dri/renderD128", "");
  EXPECT_TRUE(machine.memory().gpu);
}

/// A method "mine" that needs `mib` MiB, most of them for its G-buffer.
Plan planOf(std::uint64_t mib) {
  Plan plan;
  plan.shared = {{"resource", "process", "the program", 10 * kMiB},
                 {"pass", "bake", "no memory", 0}};
  plan.methods.resize(1);
  plan.methods[0].name = "mine";
  plan.methods[0].items = {{"resource", "frames", "pixels", 30 * kMiB, "image.width"},
                           {"resource", "gbuffer", "samples", (mib - 40) * kMiB, "image.samples"}};
  return plan;
}

// Runs have used between 0.5 and 1.2 times of what their plan says.
TEST(Memory, RunsThatMayNotFitAreWarnedOf) {
  const ObtainableMemory memory{1200 * kMiB, "this machine still has"};
  EXPECT_EQ(memoryWarning(planOf(1000), memory), "");
  EXPECT_EQ(memoryWarning(planOf(1001), memory),
            "mine needs about 1.0 GB of memory; this machine still has 1.3 GB: it may end for "
            "lack of memory, or slow down");
}

TEST(Memory, RunsThatCannotFitAreRefused) {
  const ObtainableMemory memory{1000 * kMiB, "this machine still has"};
  EXPECT_NO_THROW(requireMemory(planOf(2000), memory));
  Plan onGpu = planOf(2001);
  onGpu.methods[0].needs.gl = true;
  EXPECT_NO_THROW(requireMemory(onGpu, {memory.bytes, memory.limit, true}));
  EXPECT_THROW(requireMemory(onGpu, memory), Error);
  try {
    requireMemory(planOf(2001), memory);
    FAIL() << "fits";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ExitCode::OutOfMemory);
    EXPECT_STREQ(
        error.what(),
        "mine needs about 2.1 GB of memory; this machine still has 1.0 GB. Its "
        "largest parts are:\n  gbuffer, 2.1 GB: samples; lowered by image.samples\n  "
        "frames, 31.5 MB: pixels; lowered by image.width\n  process, 10.5 MB: the program");
  }
}

}  // namespace
}  // namespace catoptric::run
