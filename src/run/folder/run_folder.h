// A run's folder: frames, their records, timings and summary. One process at a time writes to it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <mutex>
#include <span>
#include <string>
#include <vector>

#include "frame/steps.h"
#include "run/folder/records.h"

namespace catoptric::run {

enum class Existing { Error, Overwrite, Resume };
/// Throws UsageError.
Existing parseExisting(const std::string& text);

class RunFolder {
 public:
  /// Creates or opens the folder and locks it against other processes. Existing::Error: throws
  /// OutputError if the folder contains anything but a lock. Overwrite: the present run stays until
  /// begin(). Resume: reads the records. If another process writes to the folder, waits for it up
  /// to `waitSeconds`. Throws OutputError, also if the folder has files of a run's names but no
  /// run, or if frames or previews is a symbolic link.
  RunFolder(const std::filesystem::path& path, Existing existing, double waitSeconds = 0.0);
  /// Inspects the folder and changes nothing. Throws what the constructor above would throw, as far
  /// as this can be known without writing. Reads the records for Resume.
  struct LookOnly {};
  RunFolder(const std::filesystem::path& path, Existing existing, LookOnly);
  ~RunFolder();
  RunFolder(const RunFolder&) = delete;
  RunFolder& operator=(const RunFolder&) = delete;

  const std::filesystem::path& path() const { return path_; }

  /// Why the record of `frame` cannot be trusted ("no record", "another config", ...). Empty if it
  /// can: the fingerprints agree and the files have the recorded contents.
  std::string distrust(int frame, const FrameFingerprints& wanted) const;
  /// The record of a frame without its counters, tables and samples, of which long runs have too
  /// many to keep in memory; null if there is no record.
  const FrameRecord* record(int frame) const;
  const std::map<int, FrameRecord>& records() const { return records_; }
  /// For Overwrite: removes the files that the present run's records name, and its tables. Warns of
  /// files that stay in its folders. Called before anything is written, when only writing can still
  /// fail.
  void begin();
  /// Whether there is an earlier run that begin() would remove.
  bool holdsOldRun() const { return overwrites_ && !wasEmpty_; }
  /// Called after a start that failed before any frame: removes what the constructor created, and
  /// the summary. Otherwise the remaining folder would block the next attempt.
  void discard();
  /// Removes a record; its files stay until they are overwritten.
  void forget(int frame);

  /// Writes the record of a frame whose files are written. Any thread may call it. Throws
  /// OutputError, also if the folder was removed or replaced meanwhile.
  void add(FrameRecord record);
  /// The same for many records.
  void add(std::vector<FrameRecord> records);
  /// Writes one file of a frame atomically. Any thread may call it.
  void writeFile(const std::string& relative, std::span<const std::byte> bytes) const;
  /// Adds a finished file of another run as a hard link, or as a copy if that is impossible.
  void takeFile(const std::string& relative, const std::filesystem::path& source) const;

  /// Adds the times of start-up's steps, of this process or of earlier ones.
  void addStartup(const std::vector<frame::StepSample>& samples);

  /// Writes timings.csv (frame,step,seconds,clock,first), and a file NAME.csv for each table of the
  /// frames.
  void writeTimings() const;
  /// Writes summary.json. `members`: further members, as JSON texts by name.
  void writeSummary(const std::map<std::string, std::string>& members) const;

 private:
  std::string firstContent() const;
  void requireEmpty() const;
  void createFolder(const std::filesystem::path& path);
  void keep(FrameRecord record);
  void writeRecords() const;
  void appendRecords(const std::string& lines) const;
  void checkStillThere() const;
  void lock(double waitSeconds);
  void requireOurs(Existing existing) const;
  void openLocked(Existing existing);

  std::filesystem::path path_;
  int lock_ = -1;
  bool overwrites_ = false;                     ///< begin() has not removed the earlier run yet
  bool wasEmpty_ = false;                       ///< apart from a lock and empty folders
  std::vector<std::filesystem::path> created_;  ///< folders that the constructor created
  std::mutex mutex_;
  std::map<int, FrameRecord> records_;  ///< without counters, tables and samples
  std::map<int, std::string> lines_;    ///< the whole records, as they are in frames.jsonl
  bool appendable_ = false;             ///< frames.jsonl agrees with records_
  std::vector<frame::StepSample> startup_;
};

/// Each method's run gets a folder in `out`. Throws OutputError if such a folder is a symbolic
/// link, or if the run's files would replace files that no run wrote.
void checkFolderOfRuns(const std::filesystem::path& out, const std::vector<std::string>& methods);

/// Whether a run uses this name for its own files or folders ("frames", "table.md"), so that no
/// method's folder can have it.
bool isRunFileName(const std::string& name);

}  // namespace catoptric::run
