#include "nightly/open_night.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "core/error.h"

namespace catoptric::nightly {
namespace {

namespace fs = std::filesystem;

/// Of unfinished nights so many are looked at. Ours.
constexpr int kLookedAt = 20;

/// A file that is locked as long as it is open; -1: another process has it.
int lockFile(const fs::path& file, bool wait) {
  std::error_code error;
  fs::create_directories(file.parent_path(), error);
  const int descriptor = ::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644);
  if (descriptor < 0)
    throw OutputError(file.string() + ": cannot be written: " + std::strerror(errno));
  if (::flock(descriptor, wait ? LOCK_EX : LOCK_EX | LOCK_NB) == 0) return descriptor;
  ::close(descriptor);
  return -1;
}

}  // namespace

bool OpenNight::take(const History& history, int id) {
  lock_ = lockFile(history.nightFolder(id) / "lock", false);
  return lock_ >= 0;
}

OpenNight::OpenNight(History& history, const Night& wanted) {
  // One process at a time looks for a night, or begins one
  const int guard = lockFile(history.folder() / "nights" / "lock", true);
  try {
    for (const Night& night : history.nights(wanted.suite, kLookedAt)) {
      const bool same = night.finished.empty() && night.suitePrint == wanted.suitePrint &&
                        night.effort == wanted.effort && night.machine == wanted.machine &&
                        night.build == wanted.build;
      if (!same || !take(history, night.id)) continue;
      night_ = night;
      resumed_ = true;
      break;
    }
    if (!resumed_) {
      night_ = wanted;
      night_.id = history.beginNight(wanted);
      take(history, night_.id);
    }
  } catch (...) {
    ::close(guard);
    throw;
  }
  ::close(guard);
}

OpenNight::~OpenNight() {
  if (lock_ >= 0) ::close(lock_);
}

}  // namespace catoptric::nightly
