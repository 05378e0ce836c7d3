// The right to make a file: one of all processes that see its folder has it, on whatever machine.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <filesystem>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

namespace catoptric {

/// Who has the right to make FILE has made FILE.lock, which names host, process and time. Locks of
/// the system (flock) would not do: not every network file system has them. The holder renews the
/// time of its lock. Another process takes a lock whose holder is known to be gone (of this
/// machine: at once), or that was not renewed for `patienceSeconds` by its own clock.
class FileClaim {
 public:
  static constexpr double kPatienceSeconds = 20.0;  ///< ours: ten times a slow file system's answer

  explicit FileClaim(const std::filesystem::path& file, double patienceSeconds = kPatienceSeconds);
  ~FileClaim() { release(); }
  FileClaim(const FileClaim&) = delete;
  FileClaim& operator=(const FileClaim&) = delete;

  enum class State {
    Mine,
    Taken,      ///< another process makes the file: ask again later
    Impossible  ///< no lock can be had here: nobody can be kept from making the file too
  };
  /// Does not wait. The folder is created when it is missing.
  State take();
  void release();
  /// It was this one's, and another process has taken it, as from a process that was suspended.
  bool lost() const;
  /// "process 17 on node3 since 2026-01-31T12:00:00Z", as the last take() saw it.
  std::string holder() const;
  const std::filesystem::path& lockFile() const { return lock_; }

 private:
  /// A lock as it stands there.
  struct Seen {
    std::string text;
    std::uint64_t inode = 0;
    std::int64_t renewedNs = 0;
    bool operator==(const Seen&) const = default;
  };
  static std::optional<Seen> look(const std::filesystem::path& lock);
  bool create();
  bool isAbandoned(const Seen& now);
  void remove(const Seen& abandoned);
  void renew();

  std::filesystem::path lock_;
  double patienceSeconds_;
  Seen seen_;
  std::int64_t seenSinceNs_ = 0;
  int file_ = -1;  ///< the lock that is this one's
  std::mutex mutex_;
  std::condition_variable ended_;
  bool ends_ = false;
  std::thread renewing_;
};

}  // namespace catoptric
