// The exclusive right to make a file, among all processes on all machines that use its folder.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <filesystem>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

namespace catoptric {

/// The holder of the right to make FILE creates FILE.lock, which names host, process and time.
/// System locks (flock) are not used because some network file systems lack them. The holder
/// regularly renews the time of its lock. Another process takes the lock over if the holder is
/// known to be dead (at once, if it ran on the same machine), or if the lock was not renewed for
/// `patienceSeconds` by the other process' own clock.
class FileClaim {
 public:
  static constexpr double kPatienceSeconds =
      20.0;  ///< our choice: ten times the response time of a slow file system

  explicit FileClaim(const std::filesystem::path& file, double patienceSeconds = kPatienceSeconds);
  ~FileClaim() { release(); }
  FileClaim(const FileClaim&) = delete;
  FileClaim& operator=(const FileClaim&) = delete;

  enum class State {
    Mine,
    Taken,      ///< another process makes the file; ask again later
    Impossible  ///< no lock is possible here; other processes cannot be kept from making the file
                ///< too
  };
  /// Tries to get the right, without waiting. Creates the folder if it is missing.
  State take();
  void release();
  /// Whether this process had the right and another process has taken it over, for example while
  /// this process was suspended.
  bool lost() const;
  /// For example "process 17 on node3 since 2026-01-31T12:00:00Z": the holder at the last take().
  std::string holder() const;
  const std::filesystem::path& lockFile() const { return lock_; }

 private:
  /// The contents and state of a lock file.
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
  int file_ = -1;  ///< descriptor of this process' own lock
  std::mutex mutex_;
  std::condition_variable ended_;
  bool ends_ = false;
  std::thread renewing_;
};

}  // namespace catoptric
