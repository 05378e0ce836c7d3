#include "run/folder/run_folder.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <set>
#include <thread>
#include <utility>

#include "core/clock.h"
#include "core/error.h"
#include "core/file.h"
#include "core/log.h"
#include "core/remove_files.h"
#include "core/text.h"
#include "methods/contract/method.h"

namespace catoptric::run {
namespace {

namespace fs = std::filesystem;

constexpr const char* kLockName = ".lock";
constexpr const char* kRecordsName = "frames.jsonl";
/// What a run writes beside its frames.
constexpr std::array kRunFiles = {kRecordsName, "timings.csv", "summary.json", "table.md",
                                  "table.csv",  "errors.md",   "errors.csv",   "contact_sheet.png"};
constexpr std::array kFrameFolders = {"frames", "previews"};
constexpr const char* kNoRun = ", but no run of this program; choose another --out, or remove it";
constexpr const char* kFileInTheWay = ": cannot be created as a folder: a file has this name";

/// Whether a run was begun in this folder.
bool holdsRun(const fs::path& folder) {
  std::error_code ignored;
  return fs::exists(folder / kLockName, ignored) || fs::exists(folder / kRecordsName, ignored);
}

/// These, and the tables of all methods.
std::vector<std::string> runFiles() {
  std::vector<std::string> names(kRunFiles.begin(), kRunFiles.end());
  for (const methods::MethodEntry& entry : methods::registry())
    for (const methods::TableInfo& table : entry.tables) names.push_back(table.name + ".csv");
  return names;
}

}  // namespace

Existing parseExisting(const std::string& text) {
  if (text == "error") return Existing::Error;
  if (text == "overwrite") return Existing::Overwrite;
  if (text == "resume") return Existing::Resume;
  const std::array<std::string, 3> allowed = {"error", "overwrite", "resume"};
  throw UsageError("--existing: \"" + text + "\" is not allowed" + didYouMean(text, allowed) +
                   "; allowed: " + joined(allowed, ", "));
}

bool isRunFileName(const std::string& name) {
  const std::vector<std::string> files = runFiles();
  return std::find(files.begin(), files.end(), name) != files.end() ||
         std::find(kFrameFolders.begin(), kFrameFolders.end(), name) != kFrameFolders.end();
}

void checkFolderOfRuns(const fs::path& out, const std::vector<std::string>& methods) {
  for (const std::string& method : methods) refuseLink(out / method);
  std::error_code ignored;
  bool hasRun = holdsRun(out);
  for (const auto& entry : fs::directory_iterator(out, ignored))
    hasRun = hasRun || holdsRun(entry.path());
  if (hasRun) return;
  for (const char* name : kRunFiles)
    if (fs::exists(out / name, ignored)) throw OutputError(out.string() + ": has " + name + kNoRun);
}

RunFolder::RunFolder(const fs::path& path, Existing existing, double waitSeconds)
    : path_(path), overwrites_(existing == Existing::Overwrite) {
  // One process at a time: two would give frames and records of different runs. One that ends early
  // removes the folder that it made: then it is made again.
  constexpr int kMostTries = 100;
  try {
    requireOurs(existing);  // before there is a lock, by which a run's folder is known
    for (int tries = 0; tries < kMostTries && lock_ < 0; ++tries) {
      created_.clear();
      createFolder(path_);
      lock_ = ::open((path_ / kLockName).c_str(), O_CREAT | O_RDWR | O_CLOEXEC, 0644);
      if (lock_ < 0 && errno != ENOENT) break;
    }
    if (lock_ < 0)
      throw OutputError(path_.string() + ": cannot be written: " + std::strerror(errno));
    lock(waitSeconds);
    openLocked(existing);
  } catch (const fs::filesystem_error& failure) {
    ::close(lock_);
    throw OutputError(path_.string() + ": " + failure.what());
  } catch (...) {
    ::close(lock_);
    throw;
  }
}

void RunFolder::lock(double waitSeconds) {
  constexpr auto kAskAgain = std::chrono::milliseconds(200);  // ours
  const std::int64_t start = nowNs();
  while (::flock(lock_, LOCK_EX | LOCK_NB) != 0) {
    if (errno != EWOULDBLOCK) {
      log::warning(path_.string() + ": cannot be locked (" + std::strerror(errno) +
                   "); make sure that only one process writes there");
      return;
    }
    if (secondsSince(start) >= waitSeconds)
      throw OutputError(
          path_.string() +
          ": another process is writing this run; use --wait SECONDS, or choose another --out");
    std::this_thread::sleep_for(kAskAgain);
  }
}

RunFolder::RunFolder(const fs::path& path, Existing existing, LookOnly) : path_(path) {
  std::error_code error;
  if (!fs::exists(path_, error)) return;
  if (!fs::is_directory(path_, error)) throw OutputError(path_.string() + kFileInTheWay);
  try {
    requireOurs(existing);
    if (existing == Existing::Error) requireEmpty();
    for (const char* folder : kFrameFolders) refuseLink(path_ / folder);
    if (existing == Existing::Resume)
      for (auto& [number, record] : readRunRecords(path_).frames) keep(std::move(record));
  } catch (const fs::filesystem_error& failure) {
    throw OutputError(path_.string() + ": " + failure.what());
  }
}

/// Creates a folder and what lies above it, and remembers what was not there.
void RunFolder::createFolder(const fs::path& path) {
  std::error_code error;
  std::vector<fs::path> missing;
  for (fs::path at = fs::absolute(path).lexically_normal(); !fs::exists(at, error);
       at = at.parent_path())
    if (at.has_filename()) missing.push_back(at);
  fs::create_directories(path, error);
  if (error)
    throw OutputError(path.string() + ": cannot be created as a folder: " + error.message());
  if (!fs::is_directory(path, error)) throw OutputError(path.string() + kFileInTheWay);
  created_.insert(created_.end(), missing.rbegin(), missing.rend());
}

void RunFolder::discard() {
  if (!records_.empty() || !wasEmpty_) return;
  std::error_code ignored;
  fs::remove(path_ / "summary.json", ignored);
  fs::remove(path_ / kLockName, ignored);
  for (auto folder = created_.rbegin(); folder != created_.rend(); ++folder)
    fs::remove(*folder, ignored);  // those that are empty
}

/// The name of something in the folder that is neither a lock nor an empty folder; else empty.
std::string RunFolder::firstContent() const {
  for (const fs::directory_entry& entry : fs::directory_iterator(path_))
    if (entry.path().filename() != kLockName && !(entry.is_directory() && fs::is_empty(entry)))
      return entry.path().filename().string();
  return "";
}

void RunFolder::requireEmpty() const {
  if (const std::string content = firstContent(); !content.empty())
    throw OutputError(path_.string() + ": the folder is not empty (it holds " + content +
                      "); use --existing resume to keep its finished frames, --existing "
                      "overwrite to replace them, or another --out");
}

/// Refuses a folder in which a run would replace files that no run wrote.
void RunFolder::requireOurs(Existing existing) const {
  if (holdsRun(path_) || !fs::is_directory(path_)) return;
  if (existing == Existing::Error) requireEmpty();
  const auto refuse = [&](const std::string& name) {
    throw OutputError(path_.string() + ": has " + name + kNoRun);
  };
  std::error_code ignored;
  for (const std::string& name : runFiles())
    if (fs::exists(path_ / name, ignored)) refuse(name);
  for (const char* folder : kFrameFolders)
    if (fs::exists(path_ / folder, ignored) && !fs::is_empty(path_ / folder, ignored))
      refuse(std::string(folder) + "/ with files");
}

void RunFolder::openLocked(Existing existing) {
  wasEmpty_ = firstContent().empty();
  if (existing == Existing::Error) requireEmpty();
  sweepTemporaryFiles(path_);
  for (const char* folder : kFrameFolders) {
    refuseLink(path_ / folder);
    createFolder(path_ / folder);
    sweepTemporaryFiles(path_ / folder);
  }
  syncFolder(path_);
  syncFolder(fs::absolute(path_).lexically_normal().parent_path());
  if (existing == Existing::Resume) {
    RunRecords known = readRunRecords(path_);
    for (auto& [number, record] : known.frames) keep(std::move(record));
    startup_ = std::move(known.startup);
  }
}

void RunFolder::begin() {
  if (!std::exchange(overwrites_, false)) return;
  std::set<std::string> written;
  for (const auto& [number, record] : readRunRecords(path_).frames)
    if (staysInside(record))
      for (const FileRecord& file : record.files) written.insert(file.path);
  try {
    // Records go last: until then they tell what is ours.
    for (const std::string& file : written)
      if (fs::is_regular_file(fs::symlink_status(path_ / file))) fs::remove(path_ / file);
    for (const std::string& name : runFiles())
      if (name != kRecordsName) fs::remove(path_ / name);
    fs::remove(path_ / kRecordsName);
    std::vector<std::string> strange;
    for (const char* folder : kFrameFolders)
      for (const fs::directory_entry& entry : fs::directory_iterator(path_ / folder))
        strange.push_back(entry.path().string());
    if (!strange.empty())
      log::warning(
          *std::min_element(strange.begin(), strange.end()) +
          (strange.size() == 1 ? "" : " and " + std::to_string(strange.size() - 1) + " more") +
          ": not removed, because no record of a run names it");
  } catch (const fs::filesystem_error& failure) {
    throw OutputError(path_.string() + ": " + failure.what());
  }
  syncFolder(path_);
}

RunFolder::~RunFolder() {
  if (lock_ >= 0) ::close(lock_);
}

const FrameRecord* RunFolder::record(int frame) const {
  const auto found = records_.find(frame);
  return found == records_.end() ? nullptr : &found->second;
}

std::string RunFolder::distrust(int frame, const FrameFingerprints& wanted) const {
  const FrameRecord* known = record(frame);
  if (known == nullptr) return "it has no record";
  const FrameFingerprints& has = known->fingerprints;
  std::vector<std::string> differences;
  if (has.config != wanted.config) differences.push_back("method or image settings");
  if (has.scene != wanted.scene) differences.push_back("scene");
  if (has.camera != wanted.camera) differences.push_back("camera or time");
  if (has.build != wanted.build) differences.push_back("program");
  if (!differences.empty()) return "differences in " + joined(differences, ", ");
  return damage(path_, *known);
}

void RunFolder::forget(int frame) {
  const std::scoped_lock guard(mutex_);
  records_.erase(frame);
  lines_.erase(frame);
  appendable_ = false;
}

void RunFolder::writeFile(const std::string& relative, std::span<const std::byte> bytes) const {
  writeFileAtomically(path_ / relative, bytes);
}

void RunFolder::takeFile(const std::string& relative, const fs::path& source) const {
  std::error_code error;
  fs::create_hard_link(source, path_ / relative, error);
  if (error) {
    writeFileAtomically(path_ / relative, std::span<const std::byte>(readFile(source)));
  } else {
    syncFolder((path_ / relative).parent_path());
  }
}

void RunFolder::keep(FrameRecord record) {
  const int number = record.frame;
  std::string& line = lines_[number] = recordLine(record);
  line.shrink_to_fit();
  record.counters = {};
  record.tables = {};
  record.samples = {};
  records_[number] = std::move(record);
}

void RunFolder::add(FrameRecord record) {
  std::vector<FrameRecord> records;
  records.push_back(std::move(record));
  add(std::move(records));
}

void RunFolder::add(std::vector<FrameRecord> records) {
  const std::scoped_lock guard(mutex_);
  checkStillThere();
  std::string lines;
  for (FrameRecord& record : records) {
    const int number = record.frame;
    keep(std::move(record));
    lines += lines_.at(number) + "\n";
  }
  // What an earlier process left is written anew once, without forgotten and torn records; from
  // then on lines are appended. Of several of a frame the last counts.
  if (appendable_) {
    appendRecords(lines);
  } else {
    writeRecords();
    appendable_ = true;
  }
}

void RunFolder::checkStillThere() const {
  struct stat ours {};
  struct stat there {};
  if (::fstat(lock_, &ours) != 0 || ::stat((path_ / kLockName).c_str(), &there) != 0 ||
      ours.st_ino != there.st_ino || ours.st_dev != there.st_dev)
    throw OutputError(path_.string() + ": the folder was removed or replaced during the run");
}

void RunFolder::writeRecords() const {
  std::string text;
  for (const auto& [number, line] : lines_) text += line + "\n";
  writeFileAtomically(path_ / kRecordsName, text);
}

void RunFolder::appendRecords(const std::string& lines) const {
  const fs::path path = path_ / kRecordsName;
  const int file = ::open(path.c_str(), O_WRONLY | O_APPEND | O_CLOEXEC);
  if (file < 0) throw OutputError(path.string() + ": cannot be written: " + std::strerror(errno));
  struct stat before {};
  bool good = ::fstat(file, &before) == 0;
  std::size_t done = 0;
  while (good && done < lines.size()) {
    const ssize_t n = ::write(file, lines.data() + done, lines.size() - done);
    if (n < 0 && errno == EINTR) continue;
    if (n == 0) errno = ENOSPC;
    good = n > 0;
    if (good) done += static_cast<std::size_t>(n);
  }
  good = good && ::fsync(file) == 0;
  const int cause = errno;
  // A part of a line would be dropped by who resumes; it need not stay.
  if (!good && done > 0 && ::ftruncate(file, before.st_size) != 0)
    log::warning(path.string() + ": its last record is incomplete and is ignored");
  ::close(file);
  if (!good) throw OutputError(path.string() + ": cannot be written: " + std::strerror(cause));
}

void RunFolder::addStartup(const std::vector<frame::StepSample>& samples) {
  startup_.insert(startup_.end(), samples.begin(), samples.end());
}

}  // namespace catoptric::run
