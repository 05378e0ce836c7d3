// Processes that want the same file of a cache: one makes it, and a killed one holds nobody up.
#include "core/file_claim.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstring>
#include <fstream>
#include <functional>
#include <span>
#include <thread>
#include <vector>

#include "core/clock.h"
#include "core/disk_cache.h"
#include "core/error.h"
#include "core/file.h"

namespace catoptric {
namespace {

namespace fs = std::filesystem;
using State = FileClaim::State;

constexpr CacheKind kKind{"test", {'c', 'a', 't', 't', 'e', 's', 't', '1'}, "", "", ""};

fs::path freshFolder() {
  const auto* info = testing::UnitTest::GetInstance()->current_test_info();
  fs::path path = fs::path(testing::TempDir()) / (std::string("claim_") + info->name());
  fs::remove_all(path);
  return path;
}

/// Another process; it ends with what `body` returns.
pid_t start(const std::function<int()>& body) {
  const pid_t child = ::fork();
  if (child == 0) ::_exit(body());
  return child;
}

int exitOf(pid_t child) {
  int status = 0;
  ::waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

void pause(double seconds) {
  std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
}

void waitFor(const fs::path& file) {
  while (!fs::exists(file)) pause(0.01);
}

/// What a process does that needs a value: it reads it, or takes a while to make it and says so.
std::int64_t valueOf(const fs::path& folder, std::int64_t own, double seconds) {
  const CacheEntry entry(kKind, folder, 7);
  const auto bytes = entry.read(1, sizeof(own));
  if (bytes) {
    std::memcpy(&own, bytes->data(), sizeof(own));
  } else {
    std::ofstream(folder.string() + "." + std::to_string(::getpid()) + ".made");
    pause(seconds);
    entry.write(std::as_bytes(std::span(&own, 1)), 1);
  }
  return own;
}

int countOf(const fs::path& folder, const std::string& ending) {
  int count = 0;
  for (const auto& entry : fs::directory_iterator(folder.parent_path())) {
    const std::string name = entry.path().filename().string();
    count += name.starts_with(folder.filename().string() + ".") && name.ends_with(ending) ? 1 : 0;
  }
  return count;
}

TEST(FileClaim, OneOfManyProcessesMakesTheValueForAll) {
  const fs::path folder = freshFolder();
  for (const auto& entry : fs::directory_iterator(folder.parent_path()))
    if (entry.path().extension() == ".made") fs::remove(entry.path());
  constexpr int kProcesses = 6;
  std::vector<pid_t> children;
  for (int i = 1; i <= kProcesses; ++i)
    children.push_back(start([&] { return static_cast<int>(valueOf(folder, i, 0.3)); }));
  const int first = exitOf(children.front());
  for (std::size_t i = 1; i < children.size(); ++i) EXPECT_EQ(exitOf(children[i]), first);
  EXPECT_EQ(countOf(folder, ".made"), 1);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder), {}), 1);  // no lock is left
}

TEST(FileClaim, AKilledProcessHoldsNobodyUp) {
  const fs::path folder = freshFolder();
  const pid_t child = start([&] { return static_cast<int>(valueOf(folder, 1, 1000.0)); });
  FileClaim claim(CacheEntry(kKind, folder, 7).path());
  waitFor(claim.lockFile());
  while (claim.take() == State::Impossible) pause(0.01);
  EXPECT_EQ(claim.take(), State::Taken);
  EXPECT_TRUE(claim.holder().starts_with("process " + std::to_string(child) + " on "))
      << claim.holder();
  ::kill(child, SIGKILL);
  exitOf(child);
  const std::int64_t killed = nowNs();
  EXPECT_EQ(valueOf(folder, 2, 0.0), 2);
  EXPECT_LT(secondsSince(killed), 2.0);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder), {}), 1);
}

TEST(FileClaim, ALockOfAnotherMachineEndsWhenNobodyRenewsIt) {
  const fs::path folder = freshFolder();
  fs::create_directories(folder);
  const fs::path file = folder / "value";
  const std::string foreign = "node3\n17\n01234567\n2026-01-01T00:00:00Z\n";
  writeFileAtomically(fs::path(file.string() + ".lock"), std::string_view(foreign));
  FileClaim claim(file, 0.4);
  EXPECT_EQ(claim.take(), State::Taken);
  EXPECT_EQ(claim.holder(), "process 17 on node3 since 2026-01-01T00:00:00Z");
  for (int i = 0; i < 4; ++i) {  // renewed: it lasts
    pause(0.2);
    fs::last_write_time(claim.lockFile(), fs::file_time_type::clock::now());
    EXPECT_EQ(claim.take(), State::Taken);
  }
  pause(0.5);
  EXPECT_EQ(claim.take(), State::Mine);
  // A lock that was not written to its end has no names
  claim.release();
  std::ofstream(claim.lockFile()) << "node";
  EXPECT_EQ(claim.take(), State::Taken);
  EXPECT_EQ(claim.holder(), "another process");
  pause(0.5);
  EXPECT_EQ(claim.take(), State::Mine);
}

TEST(FileClaim, IsRenewedAsLongAsItIsHeld) {
  const fs::path file = freshFolder() / "value";
  FileClaim claim(file, 0.2);
  ASSERT_EQ(claim.take(), State::Mine);
  const auto taken = fs::last_write_time(claim.lockFile());
  pause(0.5);
  EXPECT_GT(fs::last_write_time(claim.lockFile()), taken);
  EXPECT_FALSE(claim.lost());
  fs::rename(claim.lockFile(), claim.lockFile().string() + ".taken");
  EXPECT_TRUE(claim.lost());
  std::ofstream(claim.lockFile()) << "another's";
  claim.release();
  EXPECT_TRUE(fs::exists(claim.lockFile()));  // it was not this one's
}

TEST(FileClaim, WhoWasSuspendedForLongDoesNotReplaceWhatOthersUse) {
  const fs::path folder = freshFolder();
  const CacheEntry suspended(kKind, folder, 7);
  EXPECT_FALSE(suspended.read(1, sizeof(std::int64_t)));
  fs::remove(suspended.path().string() + ".lock");
  EXPECT_EQ(exitOf(start([&] { return static_cast<int>(valueOf(folder, 5, 0.0)); })), 5);
  const std::int64_t late = 6;
  suspended.write(std::as_bytes(std::span(&late, 1)), 1);
  EXPECT_EQ(valueOf(folder, 7, 0.0), 5);
}

TEST(FileClaim, WithoutALockEachProcessMakesItsOwn) {
  const fs::path file = freshFolder();
  std::ofstream(file) << "no folder";
  EXPECT_EQ(FileClaim(file / "value").take(), State::Impossible);
  EXPECT_EQ(valueOf(file, 3, 0.0), 3);
  EXPECT_EQ(valueOf(file, 4, 0.0), 4);
  // Within a process too, where nobody else could go on
  const fs::path other = file.string() + "_folder/value";
  FileClaim outer(other);
  EXPECT_EQ(outer.take(), State::Mine);
  EXPECT_EQ(FileClaim(other).take(), State::Impossible);
}

TEST(FileClaim, AWaitEndsWhenTheProgramIsToStop) {
  const fs::path folder = freshFolder();
  const pid_t child = start([&] { return static_cast<int>(valueOf(folder, 1, 1000.0)); });
  int asked = 0;
  const CacheEntry entry(kKind, folder, 7, [&] { return ++asked > 2; });
  waitFor(entry.path().string() + ".lock");
  EXPECT_FALSE(entry.read(1, sizeof(std::int64_t)));
  EXPECT_EQ(asked, 3);
  ::kill(child, SIGKILL);
  exitOf(child);
}

TEST(TemporaryFiles, OfOtherMachinesGoWhenTheyAreOld) {
  const fs::path folder = freshFolder();
  fs::create_directories(folder);
  const fs::path young = folder / ".value.17@01234567.abcdef.tmp";
  const fs::path old = folder / ".value.18@01234567.abcdef.tmp";
  for (const fs::path& file : {young, old}) std::ofstream(file) << "half";
  fs::last_write_time(old, fs::file_time_type::clock::now() - std::chrono::hours(2));
  EXPECT_EQ(sweepTemporaryFiles(folder), 1);
  EXPECT_TRUE(fs::exists(young));
}

}  // namespace
}  // namespace catoptric
