// Runs that are killed, stopped, starved of room, or made by several processes: nothing unreadable
// stands under a final name, and what is finished later is the undisturbed run, bit for bit.
// CATOPTRIC_LONG=1: 100 kills and every size of a frame instead of a sample.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <linux/capability.h>
#include <signal.h>
#include <sys/mount.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <random>
#include <sstream>
#include <thread>

#include "config/json.h"
#include "core/error.h"
#include "core/file.h"

namespace catoptric {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

// What a signal ends at once takes a second; a busy machine's patience.
constexpr double kSoonSeconds = 60.0;
using testing::HasSubstr;

bool isLong() {
  const char* text = std::getenv("CATOPTRIC_LONG");
  return text != nullptr && std::string(text) == "1";
}

std::string textOf(const fs::path& file) {
  std::ostringstream text;
  text << std::ifstream(file).rdbuf();
  return text.str();
}

double secondsSince(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

struct Ended {
  int code = -1;    ///< exit code; -1 when a signal ended it
  int signal = 0;   ///< that ended it
  std::string err;  ///< stderr
};

class Crash : public testing::Test {
 protected:
  Crash() {
    const auto* info = testing::UnitTest::GetInstance()->current_test_info();
    folder = fs::path(testing::TempDir()) /
             ("crash_" + std::string(info->name()) + "_" + std::to_string(::getpid()));
    fs::remove_all(folder);
    fs::create_directories(folder);
    std::ofstream(folder / "scene.json") << scene("");
    std::ofstream(folder / "path.json")
        << R"({"frames": 8, "orbit": {"center": [0, 0.5, 0], "radius": 3, "height": 0.8}})";
    std::ofstream(folder / "run.json") << R"({
  "scene": "scene.json", "path": "path.json", "preview": {"enabled": false},
  "image": {"width": 48, "height": 32},
  "methods": [{"method": "reference", "max_standard_error": 0, "samples": 2, "rays": 2}]
})";
  }
  ~Crash() override { fs::remove_all(folder); }

  static std::string scene(const std::string& more) {
    return R"({"objects": [
  {"name": "floor", "shape": "plane", "size": [4, 4], "material": {"base_color": [0.6, 0.5, 0.4]}},
  {"name": "ball", "shape": "sphere", "radius": 0.5, "translate": [0, 0.5, 0],
   "material": {"base_color": [0.9, 0.9, 0.9], "s": 0.9, "g": 0}}],)" +
           more + R"("environment": {"type": "gradient", "zenith": [0.2, 0.4, 0.9],
  "horizon": [1, 1, 1], "ground": [0.2, 0.2, 0.2]}})";
  }

  /// Starts the program in the test's folder; `inChild` runs there just before.
  pid_t start(std::vector<std::string> arguments, const std::function<void()>& inChild = {}) const {
    arguments.insert(arguments.begin(), "catoptric");
    std::vector<char*> pointers;
    for (std::string& argument : arguments) pointers.push_back(argument.data());
    pointers.push_back(nullptr);
    const pid_t child = ::fork();
    if (child != 0) return child;
    if (::chdir(folder.c_str()) != 0) ::_exit(98);
    ::setenv("XDG_CACHE_HOME", (folder / "cache").c_str(), 1);
    const std::string name = "err." + std::to_string(::getpid()) + ".txt";
    if (::freopen(name.c_str(), "w", stderr) == nullptr) ::_exit(98);
    if (::freopen("/dev/null", "w", stdout) == nullptr) ::_exit(98);
    if (inChild) inChild();
    ::execv(CATOPTRIC_PROGRAM, pointers.data());
    ::_exit(99);
  }
  Ended wait(pid_t child) const {
    int status = 0;
    EXPECT_EQ(::waitpid(child, &status, 0), child);
    const fs::path errors = folder / ("err." + std::to_string(child) + ".txt");
    Ended ended;
    if (WIFEXITED(status)) ended.code = WEXITSTATUS(status);
    if (WIFSIGNALED(status)) ended.signal = WTERMSIG(status);
    ended.err = textOf(errors);
    fs::remove(errors);
    return ended;
  }
  Ended run(const std::vector<std::string>& arguments,
            const std::function<void()>& inChild = {}) const {
    return wait(start(arguments, inChild));
  }
  /// What stands under final names; names of temporary files are given too.
  std::map<std::string, std::string> frames(const std::string& out) const {
    std::map<std::string, std::string> files;
    std::error_code error;
    for (const auto& entry : fs::directory_iterator(folder / out / "frames", error))
      files[entry.path().filename().string()] = textOf(entry.path());
    return files;
  }
  /// Waits until a run has begun; it catches signals from then on.
  void awaitRun(const std::string& out) const {
    const auto begin = Clock::now();
    while (!fs::exists(folder / out / "summary.json") && secondsSince(begin) < kSoonSeconds)
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  /// Waits until a run has written so many frames, or has ended.
  void awaitFrames(pid_t child, const std::string& out, std::size_t count) const {
    const auto written = [&] {
      std::error_code error;
      return static_cast<std::size_t>(std::ranges::count_if(
          fs::directory_iterator(folder / out / "frames", error),
          [](const auto& e) { return !e.path().filename().string().starts_with("."); }));
    };
    siginfo_t ended{};
    while (written() < count &&
           ::waitid(P_PID, static_cast<id_t>(child), &ended, WEXITED | WNOHANG | WNOWAIT) == 0 &&
           ended.si_pid == 0) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  }
  /// All frames of `out` that bear a final name are those of the undisturbed run.
  void expectOnlyWholeFrames(const std::string& out,
                             const std::map<std::string, std::string>& whole) const {
    for (const auto& [name, bytes] : frames(out))
      if (!name.starts_with(".")) {
        EXPECT_TRUE(whole.at(name) == bytes) << out << " " << name;
      }
  }

  fs::path folder;
};

const std::vector<std::string> kRender = {"render", "run.json", "-q", "--out"};

std::vector<std::string> with(std::vector<std::string> arguments,
                              const std::vector<std::string>& more) {
  arguments.insert(arguments.end(), more.begin(), more.end());
  return arguments;
}

TEST_F(Crash, KilledRunsResumeToTheUndisturbedRun) {
  const auto begin = Clock::now();
  ASSERT_EQ(run(with(kRender, {"whole"})).code, 0);
  const double duration = secondsSince(begin);
  const auto whole = frames("whole");
  ASSERT_EQ(whole.size(), 8u);

  std::mt19937 random(20240611);
  int killed = 0;
  int unfinished = 0;
  const int kills = isLong() ? 100 : 8;
  // More of them where a busy machine let runs end before they were killed
  for (int i = 0; i < kills || (unfinished < kills / 4 && i < 4 * kills); ++i) {
    // One moment in each of as many equal parts of the run, by the frames that it has written: a
    // busy machine's runs differ in length
    const double part = i % kills;
    const double share = (part + std::uniform_real_distribution<double>(0.0, 1.0)(random)) / kills;
    const double moment = share * static_cast<double>(whole.size());
    const auto written = static_cast<std::size_t>(moment);
    const std::string out = "killed" + std::to_string(i);
    const pid_t child = start(with(kRender, {out}));
    awaitFrames(child, out, written);
    // ... and within the next frame's 10 ms, or within the start-up
    const double next = written > 0 ? 0.01 : 0.5 * duration;
    std::this_thread::sleep_for(
        std::chrono::duration<double>((moment - static_cast<double>(written)) * next));
    ::kill(child, SIGKILL);
    if (wait(child).signal == SIGKILL) ++killed;
    expectOnlyWholeFrames(out, whole);
    if (frames(out).size() < whole.size()) ++unfinished;
    const Ended resumed = run(with(kRender, {out, "--existing", "resume"}));
    EXPECT_EQ(resumed.code, 0) << resumed.err;
    EXPECT_TRUE(frames(out) == whole) << out;  // no temporary file is left either
    fs::remove_all(folder / out);
  }
  EXPECT_GE(killed, kills / 2);
  EXPECT_GE(unfinished, kills / 4);
}

TEST_F(Crash, AFileIsWholeOrNotThereAtEverySize) {
  const std::string bytes(600, 'n');
  const fs::path file = folder / "file";
  for (std::size_t limit = 0; limit <= bytes.size(); ++limit) {
    std::ofstream(file) << "old";
    const pid_t child = ::fork();
    if (child == 0) {
      ::signal(SIGXFSZ, SIG_IGN);
      const rlimit room{limit, limit};
      ::setrlimit(RLIMIT_FSIZE, &room);
      try {
        writeFileAtomically(file, bytes);
      } catch (const OutputError&) {
        ::_exit(5);
      }
      ::_exit(0);
    }
    int status = 0;
    ASSERT_EQ(::waitpid(child, &status, 0), child);
    const bool fits = limit == bytes.size();
    EXPECT_EQ(WEXITSTATUS(status), fits ? 0 : 5) << limit;
    EXPECT_EQ(textOf(file), fits ? bytes : "old") << limit;
  }
  fs::remove(file);
  for (const auto& entry : fs::directory_iterator(folder))
    EXPECT_FALSE(entry.path().filename().string().ends_with(".tmp")) << entry.path();
}

TEST_F(Crash, NoRoomIsNeverASilentLoss) {
  // Frames of one size that is larger than all other files of the run.
  const std::vector<std::string> render =
      with({"render", "run.json", "-q", "--frames", "1-2", "--set", "image.width=96", "--set",
            "image.height=64", "--set", "image.compression=none"},
           {"--out"});
  ASSERT_EQ(run(with(render, {"whole"})).code, 0);
  const auto whole = frames("whole");
  const std::size_t size = whole.at("frame.0001.exr").size();
  constexpr std::size_t kOtherFiles = 12000;
  ASSERT_GT(size, 3 * kOtherFiles);
  // Files may grow to `limit` bytes: a write that is cut short, as on a disk that fills.
  const std::size_t step = isLong() ? 256 : size / 6;
  for (std::size_t limit = 0; limit < size; limit += step) {
    const Ended ended = run(with(render, {"full", "--existing", "resume"}), [&] {
      const rlimit room{limit, limit};
      ::setrlimit(RLIMIT_FSIZE, &room);
    });
    EXPECT_EQ(ended.code, 5) << limit;
    // Where errors can be written, they name the file.
    if (limit > kOtherFiles) {
      EXPECT_THAT(ended.err, HasSubstr("full/frames/frame.000")) << limit;
      EXPECT_THAT(ended.err, HasSubstr("cannot be written: File too large")) << limit;
    }
    expectOnlyWholeFrames("full", whole);
    for (const auto& [name, bytes] : frames("full"))
      EXPECT_FALSE(name.starts_with(".")) << "a temporary file is left: " << name;
  }
  ASSERT_EQ(run(with(render, {"full", "--existing", "resume"})).code, 0);
  EXPECT_TRUE(frames("full") == whole);
}

TEST_F(Crash, FullDisksAreNamed) {
  ASSERT_EQ(run(with(kRender, {"whole"})).code, 0);
  const auto whole = frames("whole");
  fs::create_directories(folder / "disk");
  if (::mount("none", (folder / "disk").c_str(), "tmpfs", 0, "size=256k") != 0)
    GTEST_SKIP() << "a small file system can be mounted by root alone; the test above limits "
                    "files instead";
  // From one page upwards, until the run fits.
  int refused = 0;
  for (int pages = 1; pages <= 64; pages += isLong() ? 1 : 12) {
    std::ofstream(folder / "disk/filler")
        << std::string(static_cast<std::size_t>(64 - pages) * 4096, 'x');
    const Ended ended = run(with(kRender, {"disk/run", "--existing", "resume"}));
    expectOnlyWholeFrames("disk/run", whole);
    if (ended.code == 0) {
      EXPECT_TRUE(frames("disk/run") == whole) << pages;
    } else {
      EXPECT_EQ(ended.code, 5) << ended.err;
      EXPECT_THAT(ended.err, HasSubstr("No space left on device"));
      ++refused;
    }
    fs::remove(folder / "disk/filler");
  }
  EXPECT_GE(refused, 1);
  EXPECT_EQ(run(with(kRender, {"disk/run", "--existing", "resume"})).code, 0);
  EXPECT_TRUE(frames("disk/run") == whole);
  ::umount((folder / "disk").c_str());
}

TEST_F(Crash, ReadOnlyAndVanishedFoldersAreExit5) {
  fs::create_directories(folder / "locked");
  fs::permissions(folder / "locked", fs::perms::owner_read | fs::perms::owner_exec);
  // Root writes to read-only folders, too, unless it gives up that right
  const Ended locked = run(with(kRender, {"locked"}), [] {
    if (::getuid() == 0 && ::prctl(PR_CAPBSET_DROP, CAP_DAC_OVERRIDE, 0, 0, 0) != 0) ::_exit(98);
  });
  EXPECT_EQ(locked.code, 5) << locked.err;
  EXPECT_THAT(locked.err, HasSubstr("locked: cannot be written: Permission denied"));

  const pid_t child = start(with(kRender, {"gone", "--set", "methods.0.samples=16"}));
  for (int i = 0; i < 2000 && !fs::exists(folder / "gone/frames.jsonl"); ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  fs::rename(folder / "gone", folder / "moved");
  const Ended gone = wait(child);
  EXPECT_EQ(gone.code, 5) << gone.err;
  EXPECT_THAT(gone.err, HasSubstr("gone"));
}

TEST_F(Crash, TwoProcessesInOneFolder) {
  ASSERT_EQ(run(with(kRender, {"whole"})).code, 0);
  for (const char* existing : {"error", "resume"}) {
    const std::string out = std::string("shared_") + existing;
    const pid_t a = start(with(kRender, {out, "--existing", existing}));
    const pid_t b = start(with(kRender, {out, "--existing", existing}));
    for (const pid_t child : {a, b}) {
      const Ended ended = wait(child);
      EXPECT_TRUE(ended.code == 0 || ended.code == 5) << ended.err;
      if (ended.code == 5) {
        EXPECT_THAT(ended.err, testing::AnyOf(HasSubstr("another process is writing this run"),
                                              HasSubstr("the folder is not empty")));
      }
    }
    EXPECT_TRUE(frames(out) == frames("whole")) << existing;
  }
}

TEST_F(Crash, ChunksMergeToTheWholeRunInAnyOrder) {
  ASSERT_EQ(run(with(kRender, {"whole"})).code, 0);
  // Two at a time, the last first.
  const pid_t c = start(with(kRender, {"c", "--chunk", "3/3"}));
  const pid_t a = start(with(kRender, {"a", "--chunk", "1/3"}));
  ASSERT_EQ(wait(c).code, 0);
  ASSERT_EQ(wait(a).code, 0);

  const Ended gap = run({"merge", "c", "a", "--out", "early"});
  EXPECT_EQ(gap.code, 6);
  EXPECT_THAT(gap.err, HasSubstr("frames 3-5 are in no run; render them with --frames 3-5"));
  EXPECT_FALSE(fs::exists(folder / "early"));

  ASSERT_EQ(run(with(kRender, {"b", "--chunk", "2/3"})).code, 0);
  const Ended merged = run({"merge", "c", "a", "b", "--out", "one"});
  ASSERT_EQ(merged.code, 0) << merged.err;
  ASSERT_EQ(run({"merge", "b", "c", "a", "--out", "two"}).code, 0);
  EXPECT_TRUE(frames("one") == frames("whole"));
  for (const char* file : {"frames.jsonl", "timings.csv", "summary.json"})
    EXPECT_EQ(textOf(folder / "one" / file), textOf(folder / "two" / file)) << file;
  const config::Value summary = config::parseFile(folder / "one/summary.json");
  EXPECT_EQ(summary.get("frames").dump(), "[1,2,3,4,5,6,7,8]");
  EXPECT_EQ(summary.get("steps").get("trace").get("count").asInteger(), 8);
  const config::Value undivided = config::parseFile(folder / "whole/summary.json");
  for (const std::string& member : undivided.keys()) EXPECT_TRUE(summary.has(member)) << member;
  for (const char* member : {"step_kinds", "reflectors", "plan", "method", "config"})
    EXPECT_EQ(summary.get(member).dump(), undivided.get(member).dump()) << member;
  EXPECT_EQ(summary.get("startup").get("scene").get("count").asInteger(), 3);
  // The merged run is a run: nothing of it is rendered again.
  const Ended resumed = run({"render", "run.json", "--out", "one", "--existing", "resume"});
  EXPECT_EQ(resumed.code, 0);
  EXPECT_THAT(resumed.err, HasSubstr("0/0, 8 reused"));

  // Runs that do not belong together, and damage; nothing is written then.
  ASSERT_EQ(run(with(kRender, {"other", "--chunk", "2/3", "--seed", "7"})).code, 0);
  const Ended other = run({"merge", "a", "other", "c", "--out", "no"});
  EXPECT_EQ(other.code, 2);
  EXPECT_THAT(other.err, HasSubstr("other: frames 3-5 differ in method or image"));
  EXPECT_EQ(run({"merge", "a", "b", "c", "--out", "one"}).code, 5);
  EXPECT_EQ(run({"merge", "a", "a", "--out", "no"}).code, 2);
  EXPECT_EQ(run({"merge", "a", "nothing", "--out", "no"}).code, 2);
  fs::remove(folder / "b/frames/frame.0004.exr");  // a link: the merged run keeps its own
  EXPECT_TRUE(frames("one") == frames("whole"));
  const Ended damaged = run({"merge", "a", "b", "c", "--out", "no"});
  EXPECT_EQ(damaged.code, 6);
  EXPECT_THAT(damaged.err, HasSubstr("b: frame 4: frames/frame.0004.exr is missing"));
  EXPECT_FALSE(fs::exists(folder / "no"));
}

TEST_F(Crash, SignalsEndALongBake) {
  std::ofstream(folder / "scene.json")
      << scene(R"("bake": {"mode": "full", "rays": 65536, "bounces": 16},)");
  const pid_t child = start({"render", "run.json", "--out", "baked"});
  awaitRun("baked");
  std::this_thread::sleep_for(std::chrono::milliseconds(500));
  const auto asked = Clock::now();
  ::kill(child, SIGTERM);
  const Ended ended = wait(child);
  EXPECT_EQ(ended.code, 128 + SIGTERM) << ended.err;
  EXPECT_LT(secondsSince(asked), kSoonSeconds);
  EXPECT_THAT(ended.err, HasSubstr("frames 1-8 are missing"));
  EXPECT_FALSE(fs::exists(folder / "baked/frames.jsonl"));
  EXPECT_TRUE(!fs::exists(folder / "cache/catoptric") || fs::is_empty(folder / "cache/catoptric"));
}

TEST_F(Crash, LongFramesAreDroppedAndASecondSignalEndsAtOnce) {
  const std::vector<std::string> slow = {
      "--set", "image.width=1600", "--set", "image.height=1200", "--set", "methods.0.samples=16"};
  for (const bool twice : {false, true}) {
    const std::string out = twice ? "twice" : "once";
    const pid_t child = start(with(with({"render", "run.json", "--out", out}, slow),
                                   {"--stop-within", twice ? "600" : "0.5"}));
    awaitRun(out);
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    const auto asked = Clock::now();
    ::kill(child, SIGINT);
    if (twice) {
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
      ::kill(child, SIGTERM);
    }
    const Ended ended = wait(child);
    EXPECT_EQ(ended.code, 128 + (twice ? SIGTERM : SIGINT)) << ended.err;
    EXPECT_LT(secondsSince(asked), kSoonSeconds);
    if (!twice) {
      EXPECT_THAT(ended.err, HasSubstr("the current frame is dropped"));
    }
    EXPECT_TRUE(frames(out).empty());
  }
}

TEST_F(Crash, ClosedPipesEndQuietly) {
  const std::string command = "cd '" + folder.string() +
                              "' && { " CATOPTRIC_PROGRAM
                              " list; echo $? >code.txt; } 2>/dev/null | true";
  // The reader may end before or after the data came.
  EXPECT_EQ(std::system(command.c_str()), 0);
  EXPECT_THAT(textOf(folder / "code.txt"), testing::AnyOf("0\n", "141\n"));
}

}  // namespace
}  // namespace catoptric
