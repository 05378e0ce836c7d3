#include "core/file_claim.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <ctime>
#include <set>
#include <vector>

#include "core/clock.h"
#include "core/file.h"

namespace catoptric {
namespace {

namespace fs = std::filesystem;

constexpr double kRenewalsPerPatience = 8.0;  ///< ours: some may be late
constexpr std::size_t kMostBytes = 4096;      ///< of a lock
enum Line { Host, Process, Space, Time, kLines };

/// The locks that this process holds: one of its number may be an earlier process's.
struct Held {
  std::mutex mutex;
  std::set<fs::path> locks;
};
Held& held() {
  static Held instance;
  return instance;
}

std::string ownText() {
  std::array<char, 256> host{};
  ::gethostname(host.data(), host.size() - 1);
  std::array<char, 32> time{};
  const std::time_t now = std::time(nullptr);
  std::tm parts{};
  std::strftime(time.data(), time.size(), "%Y-%m-%dT%H:%M:%SZ", ::gmtime_r(&now, &parts));
  return std::string(host.data()) + "\n" + std::to_string(::getpid()) + "\n" + processSpace() +
         "\n" + time.data() + "\n";
}

/// The lines of a lock; fewer than kLines of one that is not written yet.
std::vector<std::string> linesOf(const std::string& text) {
  std::vector<std::string> lines;
  for (std::size_t start = 0, end; (end = text.find('\n', start)) != std::string::npos;
       start = end + 1)
    lines.push_back(text.substr(start, end - start));
  return lines;
}

}  // namespace

FileClaim::FileClaim(const fs::path& file, double patienceSeconds)
    : lock_(file.string() + ".lock"), patienceSeconds_(patienceSeconds) {}

FileClaim::State FileClaim::take() {
  if (file_ >= 0) return State::Mine;
  constexpr int kTries = 3;  // the folder is made, a lock that is nobody's goes
  for (int i = 0; i < kTries; ++i) {
    if (create()) return State::Mine;
    if (errno == ENOENT) {
      std::error_code error;
      fs::create_directories(lock_.parent_path(), error);
      if (error) return State::Impossible;
      continue;
    }
    if (errno != EEXIST) return State::Impossible;
    const std::optional<Seen> now = look(lock_);
    if (!now) continue;  // released just now
    {
      // In this process: a loop within a loop must not wait for the outer one
      const std::scoped_lock guard(held().mutex);
      if (held().locks.contains(lock_)) return State::Impossible;
    }
    if (!isAbandoned(*now)) return State::Taken;
    remove(*now);
  }
  return State::Taken;
}

/// False with errno.
bool FileClaim::create() {
  const int file = ::open(lock_.c_str(), O_CREAT | O_EXCL | O_WRONLY | O_CLOEXEC, 0644);
  if (file < 0) return false;
  const std::string text = ownText();
  if (::write(file, text.data(), text.size()) != static_cast<ssize_t>(text.size())) {
    ::close(file);
    ::unlink(lock_.c_str());
    errno = ENOSPC;
    return false;
  }
  file_ = file;
  ends_ = false;
  {
    const std::scoped_lock guard(held().mutex);
    held().locks.insert(lock_);
  }
  renewing_ = std::thread([this] { renew(); });
  return true;
}

void FileClaim::renew() {
  const std::chrono::duration<double> pause(patienceSeconds_ / kRenewalsPerPatience);
  std::unique_lock lock(mutex_);
  while (!ended_.wait_for(lock, pause, [this] { return ends_; })) ::futimens(file_, nullptr);
}

void FileClaim::release() {
  if (file_ < 0) return;
  {
    const std::scoped_lock guard(mutex_);
    ends_ = true;
  }
  ended_.notify_all();
  renewing_.join();
  if (!lost()) ::unlink(lock_.c_str());
  ::close(file_);
  file_ = -1;
  const std::scoped_lock guard(held().mutex);
  held().locks.erase(lock_);
}

bool FileClaim::lost() const {
  struct stat ours {};
  struct stat there {};
  return file_ >= 0 && (::fstat(file_, &ours) != 0 || ::stat(lock_.c_str(), &there) != 0 ||
                        ours.st_ino != there.st_ino || ours.st_dev != there.st_dev);
}

std::optional<FileClaim::Seen> FileClaim::look(const fs::path& lock) {
  // Opened anew, so that a network file system asks its server
  const int file = ::open(lock.c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) return std::nullopt;
  struct stat info {};
  std::array<char, kMostBytes> text{};
  const ssize_t bytes = ::fstat(file, &info) == 0 ? ::read(file, text.data(), text.size()) : -1;
  ::close(file);
  if (bytes < 0) return std::nullopt;
  constexpr std::int64_t kNsPerSecond = 1'000'000'000;
  return Seen{std::string(text.data(), static_cast<std::size_t>(bytes)), info.st_ino,
              info.st_mtim.tv_sec * kNsPerSecond + info.st_mtim.tv_nsec};
}

bool FileClaim::isAbandoned(const Seen& now) {
  if (now != seen_) {
    seen_ = now;
    seenSinceNs_ = nowNs();
  }
  const std::vector<std::string> lines = linesOf(now.text);
  if (lines.size() >= kLines && lines[Space] == processSpace()) {
    const pid_t process = std::atoi(lines[Process].c_str());
    if (process <= 0 || process == ::getpid() || (::kill(process, 0) != 0 && errno == ESRCH))
      return true;
  }
  return secondsSince(seenSinceNs_) > patienceSeconds_;
}

/// Of several processes that see the same abandoned lock one alone removes it.
void FileClaim::remove(const Seen& abandoned) {
  const fs::path aside = temporaryName(lock_, "locked");
  if (::rename(lock_.c_str(), aside.c_str()) != 0) return;
  const std::optional<Seen> removed = look(aside);
  // Another process was faster, and this is its lock: back with it, unless it lost it to a third
  if (removed && (removed->text != abandoned.text || removed->inode != abandoned.inode)) {
    [[maybe_unused]] const int linked = ::link(aside.c_str(), lock_.c_str());
  }
  ::unlink(aside.c_str());
}

std::string FileClaim::holder() const {
  const std::vector<std::string> lines = linesOf(seen_.text);
  if (lines.size() < kLines) return "another process";
  return "process " + lines[Process] + " on " + lines[Host] + " since " + lines[Time];
}

}  // namespace catoptric
