// A run's folder: frames, their records, timings and summary. One process at a time writes there.
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
  /// Creates or opens the folder and locks it against other processes. Existing::Error: an
  /// OutputError when it holds anything but a lock; Overwrite: leaves the run that is there until
  /// begin(); Resume: reads the records. Waits so long for another process that writes there.
  /// Throws OutputError.
  RunFolder(const std::filesystem::path& path, Existing existing, double waitSeconds = 0.0);
  /// Looks at what stands there and changes nothing: throws what the constructor would throw as far
  /// as that can be told without writing, and reads the records for Resume.
  struct LookOnly {};
  RunFolder(const std::filesystem::path& path, Existing existing, LookOnly);
  ~RunFolder();
  RunFolder(const RunFolder&) = delete;
  RunFolder& operator=(const RunFolder&) = delete;

  const std::filesystem::path& path() const { return path_; }

  /// Why the record of `frame` cannot be trusted ("no record", "another config", ...); empty when
  /// it can: fingerprints agree and the files have the recorded contents.
  std::string distrust(int frame, const FrameFingerprints& wanted) const;
  const FrameRecord* record(int frame) const;
  const std::map<int, FrameRecord>& records() const { return records_; }
  /// Of Overwrite: removes the files of the run that is there, and no others. Called when nothing
  /// but writing can fail any more, and before anything is written.
  void begin();
  /// Whether an earlier run stands there that begin() would remove.
  bool holdsOldRun() const { return overwrites_ && !wasEmpty_; }
  /// Removes what the constructor made and the summary, of a start that failed before any frame: an
  /// empty folder would block the next try.
  void discard();
  /// Forgets a record; its files stay until they are written anew.
  void forget(int frame);

  /// Writes a frame's files' record. Any thread. Throws OutputError, also when the folder was
  /// removed or replaced meanwhile.
  void add(FrameRecord record);
  /// The same for many.
  void add(std::vector<FrameRecord> records);
  /// Writes one file of a frame, atomically. Any thread.
  void writeFile(const std::string& relative, std::span<const std::byte> bytes) const;
  /// Takes over a finished file of another run as a hard link, or as a copy where that cannot be.
  void takeFile(const std::string& relative, const std::filesystem::path& source) const;

  /// Samples of start-up, of this and of earlier processes.
  void addStartup(const std::vector<frame::StepSample>& samples);

  /// timings.csv: frame,step,seconds,clock,first; and a file NAME.csv of each table that
  /// frames have.
  void writeTimings() const;
  /// summary.json; `members`: further JSON texts by name.
  void writeSummary(const std::map<std::string, std::string>& members) const;

 private:
  std::string firstContent() const;
  void requireEmpty() const;
  void createFolder(const std::filesystem::path& path);
  void writeRecords() const;
  void appendRecords(const std::string& lines) const;
  void checkStillThere() const;
  void lock(double waitSeconds);
  void openLocked(Existing existing);

  std::filesystem::path path_;
  int lock_ = -1;
  bool overwrites_ = false;                     ///< begin() has yet to remove a run
  bool wasEmpty_ = false;                       ///< but for a lock and empty folders
  std::vector<std::filesystem::path> created_;  ///< folders that were not there before
  std::mutex mutex_;
  std::map<int, FrameRecord> records_;
  bool appendable_ = false;  ///< frames.jsonl holds what records_ holds
  std::vector<frame::StepSample> startup_;
};

/// True for names that a run gives to files and folders of its own ("frames", "table.md"): no
/// method's folder can be called so.
bool isRunFileName(const std::string& name);

}  // namespace catoptric::run
