#include "run/folder/run_folder.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "config/json.h"
#include "config/json_text.h"
#include "core/error.h"
#include "core/file.h"
#include "core/hash.h"
#include "core/log.h"
#include "core/text.h"
#include "methods/contract/method.h"

namespace catoptric::run {
namespace {

namespace fs = std::filesystem;
using config::JsonText;
using config::Value;

constexpr const char* kLockName = ".lock";
constexpr std::size_t kMaxRecordBytes = std::size_t{1} << 30;  ///< 100,000s of frames
/// What a run writes, and an overwriting run therefore may remove.
constexpr std::array kRunFiles = {"frames.jsonl", "timings.csv",      "summary.json",
                                  "table.md",     "table.csv",        "errors.md",
                                  "errors.csv",   "contact_sheet.png"};
constexpr std::array kFrameFolders = {"frames", "previews"};
constexpr const char* kFileInTheWay = ": cannot be created as a folder: a file has this name";

/// These, and the tables of all methods.
std::vector<std::string> runFiles() {
  std::vector<std::string> names(kRunFiles.begin(), kRunFiles.end());
  for (const methods::MethodEntry& entry : methods::registry())
    for (const methods::TableInfo& table : entry.tables) names.push_back(table.name + ".csv");
  return names;
}

std::string fingerprintOf(std::span<const std::byte> bytes) {
  Fingerprint fingerprint;
  fingerprint.add(bytes);
  return fingerprint.text();
}

/// {min, median, mean, max, sum, count} of per-frame sums.
std::string statisticsText(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  double sum = 0.0;
  for (const double value : values) sum += value;
  const std::size_t n = values.size();
  const double median = n % 2 == 1 ? values[n / 2] : 0.5 * (values[n / 2 - 1] + values[n / 2]);
  return JsonText()
      .add("min", values.front())
      .add("median", median)
      .add("mean", sum / static_cast<double>(n))
      .add("max", values.back())
      .add("sum", sum)
      .add("count", static_cast<int>(n))
      .object();
}

std::string samplesText(const std::vector<frame::StepSample>& samples) {
  std::string text;
  for (const frame::StepSample& sample : samples) {
    if (!text.empty()) text += ",";
    text += "[" + config::jsonString(sample.step) + "," + config::numberText(sample.seconds) + "," +
            config::jsonString(sample.clock) + "," + (sample.first ? "true" : "false") + "]";
  }
  return "[" + text + "]";
}

/// JSON has no infinity and no NaN: they stand there as text.
std::string cellJson(const methods::Cell& cell) {
  const auto* real = std::get_if<double>(&cell);
  const bool isText = std::holds_alternative<std::string>(cell);
  if (isText) return config::jsonString(std::get<std::string>(cell));
  const std::string text = methods::cellText(cell);
  return real != nullptr && !std::isfinite(*real) ? config::jsonString(text) : text;
}

/// {"NAME":{"columns":[["COLUMN","integer"],...],"rows":[[...],...]},...}
std::string tablesText(const std::vector<methods::Table>& tables) {
  JsonText all;
  for (const methods::Table& table : tables) {
    std::string columns;
    for (const methods::Column& column : table.columns())
      columns += (columns.empty() ? "[" : ",[") + config::jsonString(column.name) + "," +
                 config::jsonString(methods::columnTypeName(column.type)) + "]";
    std::string rows;
    for (const methods::Row& row : table.rows()) {
      std::string cells;
      for (const methods::Cell& cell : row) cells += (cells.empty() ? "" : ",") + cellJson(cell);
      rows += (rows.empty() ? "[" : ",[") + cells + "]";
    }
    all.raw(table.name(),
            JsonText().raw("columns", "[" + columns + "]").raw("rows", "[" + rows + "]").object());
  }
  return all.object();
}

methods::Cell parseCell(const Value& value, methods::ColumnType type) {
  switch (type) {
    case methods::ColumnType::Integer:
      return static_cast<std::int64_t>(value.asInteger());
    case methods::ColumnType::Real:
      if (value.kind() == Value::Kind::String)  // "inf", "-inf", "nan"
        return std::strtod(value.asString().c_str(), nullptr);
      return value.asNumber();
    case methods::ColumnType::Text:
      return value.asString();
  }
  return {};
}

methods::Table parseTable(const std::string& name, const Value& value) {
  methods::TableInfo info;
  info.name = name;
  for (const Value& column : value.get("columns").asArray()) {
    const std::vector<Value>& parts = column.asArray();
    if (parts.size() != 2) column.fail("a column is [name, type]");
    const std::string type = parts[1].asString();
    const auto is = [&](methods::ColumnType t) { return type == methods::columnTypeName(t); };
    info.columns.push_back({parts[0].asString(),
                            is(methods::ColumnType::Integer) ? methods::ColumnType::Integer
                            : is(methods::ColumnType::Real)  ? methods::ColumnType::Real
                                                             : methods::ColumnType::Text,
                            ""});
  }
  methods::Table table(info);
  for (const Value& row : value.get("rows").asArray()) {
    const std::vector<Value>& parts = row.asArray();
    if (parts.size() != info.columns.size()) row.fail("a row has a cell for each column");
    methods::Row cells;
    for (std::size_t i = 0; i < parts.size(); ++i)
      cells.push_back(parseCell(parts[i], info.columns[i].type));
    table.addRow(std::move(cells));
  }
  return table;
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

std::string framePath(const std::string& folder, int frame, const std::string& extension) {
  std::array<char, 16> number{};
  std::snprintf(number.data(), number.size(), "%04d", frame);
  return folder + "/frame." + number.data() + extension;
}

std::string recordLine(const FrameRecord& record) {
  std::string files;
  for (const FileRecord& file : record.files) {
    if (!files.empty()) files += ",";
    files += JsonText()
                 .add("path", file.path)
                 .add("bytes", file.bytes)
                 .add("content", file.content)
                 .object();
  }
  return JsonText()
      .add("frame", record.frame)
      .add("time", record.timeSeconds)
      .raw("fingerprints", JsonText()
                               .add("config", record.fingerprints.config)
                               .add("scene", record.fingerprints.scene)
                               .add("camera", record.fingerprints.camera)
                               .add("build", record.fingerprints.build)
                               .add("machine", record.fingerprints.machine)
                               .object())
      .add("renderer", record.renderer)
      .raw("files", "[" + files + "]")
      .add("counters", record.counters)
      .raw("tables", tablesText(record.tables))
      .raw("steps", samplesText(record.samples))
      .object();
}

FrameRecord parseRecord(const std::string& line, const std::string& place) {
  const Value value = config::parseText(line, place);
  FrameRecord record;
  record.frame = static_cast<int>(value.get("frame").asInteger());
  record.timeSeconds = value.get("time").asNumber();
  const Value fingerprints = value.get("fingerprints");
  record.fingerprints = {
      fingerprints.get("config").asString(), fingerprints.get("scene").asString(),
      fingerprints.get("camera").asString(), fingerprints.get("build").asString(),
      fingerprints.get("machine").asString()};
  record.renderer = value.get("renderer").asString();
  for (const Value& file : value.get("files").asArray())
    record.files.push_back({file.get("path").asString(),
                            static_cast<std::uint64_t>(file.get("bytes").asInteger()),
                            file.get("content").asString()});
  const Value counters = value.get("counters");
  for (const std::string& key : counters.keys())
    record.counters[key] = static_cast<std::uint64_t>(counters.get(key).asNumber());
  if (value.has("tables")) {
    const Value tables = value.get("tables");
    for (const std::string& name : tables.keys())
      record.tables.push_back(parseTable(name, tables.get(name)));
  }
  for (const Value& step : value.get("steps").asArray()) {
    const std::vector<Value>& parts = step.asArray();
    if (parts.size() != 4) step.fail("a step is [name, seconds, clock, first]");
    record.samples.push_back({record.frame, parts[0].asString(), parts[1].asNumber(),
                              parts[2].asString(), parts[3].asBool()});
  }
  return record;
}

RunFolder::RunFolder(const fs::path& path, Existing existing) : path_(path) {
  createFolder(path_);

  // One process at a time: two would give frames and records of different runs.
  lock_ = ::open((path_ / kLockName).c_str(), O_CREAT | O_RDWR | O_CLOEXEC, 0644);
  if (lock_ < 0) throw OutputError(path_.string() + ": cannot be written: " + std::strerror(errno));
  try {
    if (::flock(lock_, LOCK_EX | LOCK_NB) != 0) {
      if (errno == EWOULDBLOCK)
        throw OutputError(path_.string() + ": another process is writing this run");
      log::warning(path_.string() + ": cannot be locked (" + std::strerror(errno) +
                   "): see to it that one process alone writes there");
    }
    openLocked(existing);
  } catch (const fs::filesystem_error& failure) {
    ::close(lock_);
    throw OutputError(path_.string() + ": " + failure.what());
  } catch (...) {
    ::close(lock_);
    throw;
  }
}

RunFolder::RunFolder(const fs::path& path, Existing existing, LookOnly) : path_(path) {
  std::error_code error;
  if (!fs::exists(path_, error)) return;
  if (!fs::is_directory(path_, error)) throw OutputError(path_.string() + kFileInTheWay);
  try {
    if (existing == Existing::Error) requireEmpty();
    if (existing == Existing::Resume) records_ = readRunRecords(path_).frames;
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

void RunFolder::openLocked(Existing existing) {
  wasEmpty_ = firstContent().empty();
  if (existing == Existing::Error) requireEmpty();
  // Records go first: a frame without one counts for nothing.
  if (existing == Existing::Overwrite)
    for (const std::string& name : runFiles()) fs::remove(path_ / name);
  sweepTemporaryFiles(path_);
  for (const char* folder : kFrameFolders) {
    createFolder(path_ / folder);
    sweepTemporaryFiles(path_ / folder);
    if (existing != Existing::Overwrite) continue;
    std::vector<fs::path> unwanted;
    for (const fs::directory_entry& entry : fs::directory_iterator(path_ / folder))
      if (entry.path().filename().string().starts_with("frame.") && entry.is_regular_file())
        unwanted.push_back(entry.path());
    for (const fs::path& file : unwanted) fs::remove(file);
  }
  syncFolder(path_);
  syncFolder(fs::absolute(path_).lexically_normal().parent_path());
  if (existing == Existing::Resume) {
    RunRecords known = readRunRecords(path_);
    records_ = std::move(known.frames);
    startup_ = std::move(known.startup);
  }
}

RunFolder::~RunFolder() {
  if (lock_ >= 0) ::close(lock_);
}

RunRecords readRunRecords(const fs::path& path) {
  RunRecords known;
  std::error_code error;
  const fs::path file = path / "frames.jsonl";
  if (!fs::exists(file, error)) return known;
  const std::string text = readTextFile(file, kMaxRecordBytes);
  int lineNumber = 0;
  for (std::size_t start = 0; start < text.size();) {
    const std::size_t end = std::min(text.find('\n', start), text.size());
    ++lineNumber;
    const std::string place = file.string() + " line " + std::to_string(lineNumber);
    try {
      FrameRecord record = parseRecord(text.substr(start, end - start), place);
      const int number = record.frame;
      known.frames[number] = std::move(record);
    } catch (const UsageError& unreadable) {
      log::warning(std::string(unreadable.what()) + " (this record is not trusted)");
    }
    start = end + 1;
  }
  // Start-up samples of earlier processes stay in the table.
  const fs::path timings = path / "timings.csv";
  if (!fs::exists(timings, error)) return known;
  const std::string table = readTextFile(timings, kMaxRecordBytes);
  for (std::size_t start = 0; start < table.size();) {
    const std::size_t end = std::min(table.find('\n', start), table.size());
    std::array<std::string, 5> cells;
    std::size_t at = start;
    for (std::string& cell : cells) {
      const std::size_t comma = std::min(table.find(',', at), end);
      cell = table.substr(at, comma - at);
      at = std::min(comma + 1, end);
    }
    if (cells[0] == "0")
      known.startup.push_back(
          {0, cells[1], std::strtod(cells[2].c_str(), nullptr), cells[3], cells[4] == "1"});
    start = end + 1;
  }
  return known;
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
  if (has.machine != wanted.machine) differences.push_back("machine");
  if (!differences.empty()) return "it was made with another " + joined(differences, ", another ");
  return damage(path_, *known);
}

std::string damage(const fs::path& folder, const FrameRecord& record) {
  if (record.files.empty()) return "its record names no file";
  for (const FileRecord& file : record.files) {
    const fs::path path = folder / file.path;
    std::error_code error;
    if (!fs::is_regular_file(path, error)) return file.path + " is missing";
    if (fs::file_size(path, error) != file.bytes)
      return file.path + " has not the size that was written";
    try {
      if (fingerprintOf(readFile(path)) != file.content)
        return file.path + " has not the contents that were written";
    } catch (const SceneError& unreadable) {
      return unreadable.what();
    }
  }
  return "";
}

void RunFolder::forget(int frame) {
  const std::scoped_lock guard(mutex_);
  records_.erase(frame);
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
    lines += recordLine(record) + "\n";
    records_[number] = std::move(record);
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
  for (const auto& [number, record] : records_) text += recordLine(record) + "\n";
  writeFileAtomically(path_ / "frames.jsonl", text);
}

void RunFolder::appendRecords(const std::string& lines) const {
  const fs::path path = path_ / "frames.jsonl";
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
    log::warning(path.string() + ": ends with a torn record");
  ::close(file);
  if (!good) throw OutputError(path.string() + ": cannot be written: " + std::strerror(cause));
}

void RunFolder::addStartup(const std::vector<frame::StepSample>& samples) {
  startup_.insert(startup_.end(), samples.begin(), samples.end());
}

void RunFolder::writeTimings() const {
  std::string text = "frame,step,seconds,clock,first\n";
  const auto append = [&](const frame::StepSample& sample) {
    std::array<char, 32> seconds{};
    std::snprintf(seconds.data(), seconds.size(), "%.9f", sample.seconds);
    text += std::to_string(sample.frame) + "," + sample.step + "," + seconds.data() + "," +
            sample.clock + "," + (sample.first ? "1" : "0") + "\n";
  };
  for (const frame::StepSample& sample : startup_) append(sample);
  for (const auto& [number, record] : records_)
    for (const frame::StepSample& sample : record.samples) append(sample);
  writeFileAtomically(path_ / "timings.csv", text);

  // The method's own tables
  std::map<std::string, std::string> tables;
  for (const auto& [number, record] : records_) {
    for (const methods::Table& table : record.tables) {
      std::string& csv = tables[table.name()];
      if (csv.empty()) {
        csv = "frame";
        for (const methods::Column& column : table.columns()) csv += "," + column.name;
        csv += "\n";
      }
      for (const methods::Row& row : table.rows()) {
        csv += std::to_string(number);
        for (const methods::Cell& cell : row) csv += "," + methods::cellText(cell);
        csv += "\n";
      }
    }
  }
  for (const auto& [name, csv] : tables) writeFileAtomically(path_ / (name + ".csv"), csv);
}

void RunFolder::writeSummary(const std::map<std::string, std::string>& members) const {
  // Steps: per-frame sums, as several samples of one step may belong to a frame.
  std::map<std::string, std::vector<double>> steps;
  std::map<std::string, std::string> clocks;
  std::vector<double> frames;
  std::map<std::string, std::vector<double>> counters;
  std::vector<int> numbers;
  for (const auto& [number, record] : records_) {
    numbers.push_back(number);
    std::map<std::string, double> sums;
    double whole = 0.0;
    for (const frame::StepSample& sample : record.samples) {
      sums[sample.step] += sample.seconds;
      clocks[sample.step] = sample.clock;
      if (sample.clock != "overlapped") whole += sample.seconds;
    }
    for (const auto& [step, seconds] : sums) steps[step].push_back(seconds);
    for (const auto& [name, count] : record.counters)
      counters[name].push_back(static_cast<double>(count));
    frames.push_back(whole);
  }
  JsonText stepTexts;
  for (const auto& [step, values] : steps) {
    const std::string statistics = statisticsText(values);
    stepTexts.raw(step, statistics.substr(0, statistics.size() - 1) +
                            ",\"clock\":" + config::jsonString(clocks[step]) + "}");
  }
  std::map<std::string, std::vector<double>> startupSteps;
  for (const frame::StepSample& sample : startup_)
    startupSteps[sample.step].push_back(sample.seconds);
  JsonText startupTexts;
  for (const auto& [step, values] : startupSteps) startupTexts.raw(step, statisticsText(values));
  JsonText counterTexts;
  for (const auto& [name, values] : counters) counterTexts.raw(name, statisticsText(values));

  JsonText summary;
  summary.add("frames", numbers);
  if (!frames.empty()) summary.raw("frame_seconds", statisticsText(frames));
  summary.raw("steps", stepTexts.object())
      .raw("startup", startupTexts.object())
      .raw("counters", counterTexts.object());
  for (const auto& [name, text] : members) summary.raw(name, text);
  writeFileAtomically(path_ / "summary.json",
                      config::parseText(summary.object(), "summary").dump(2) + "\n");
}

}  // namespace catoptric::run
