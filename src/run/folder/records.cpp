#include "run/folder/records.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <span>
#include <sstream>

#include "config/json.h"
#include "config/json_text.h"
#include "core/error.h"
#include "core/file.h"
#include "core/hash.h"
#include "core/log.h"

namespace catoptric::run {
namespace {

namespace fs = std::filesystem;
using config::JsonText;
using config::Value;

constexpr std::size_t kMaxRecordBytes = std::size_t{1} << 30;  ///< 100,000s of frames

std::string fingerprintOf(std::span<const std::byte> bytes) {
  Fingerprint fingerprint;
  fingerprint.add(bytes);
  return fingerprint.text();
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
    if (parts.size() != 2) column.fail("a column must be [name, type]");
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
    if (parts.size() != info.columns.size()) row.fail("a row must have a cell for each column");
    methods::Row cells;
    for (std::size_t i = 0; i < parts.size(); ++i)
      cells.push_back(parseCell(parts[i], info.columns[i].type));
    table.addRow(std::move(cells));
  }
  return table;
}

}  // namespace

std::string framePath(const std::string& folder, int frame, const std::string& extension) {
  return fmt::format("{}/frame.{:04}{}", folder, frame, extension);
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
                               .object())
      .add("renderer", record.origin.renderer)
      .add("processor", record.origin.processor)
      .add("instructions", record.origin.instructions)
      .add("light", record.origin.light)
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
      fingerprints.get("camera").asString(), fingerprints.get("build").asString()};
  const auto text = [&](const char* name) {  // records of earlier versions have less
    return value.has(name) ? value.get(name).asString() : "";
  };
  record.origin = {value.get("renderer").asString(), text("processor"), text("instructions"),
                   text("light")};
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
    if (parts.size() != 4) step.fail("a step must be [name, seconds, clock, first]");
    record.samples.push_back({record.frame, parts[0].asString(), parts[1].asNumber(),
                              parts[2].asString(), parts[3].asBool()});
  }
  return record;
}

RunRecords readRunRecords(const fs::path& path) {
  RunRecords known;
  std::error_code error;
  const fs::path file = path / "frames.jsonl";
  if (!fs::exists(file, error)) return known;
  std::istringstream lines(readTextFile(file, kMaxRecordBytes));
  int lineNumber = 0;
  for (std::string line; std::getline(lines, line);) {
    const std::string place = file.string() + " line " + std::to_string(++lineNumber);
    try {
      FrameRecord record = parseRecord(line, place);
      const int number = record.frame;
      known.frames[number] = std::move(record);
    } catch (const UsageError& unreadable) {
      log::warning(std::string(unreadable.what()) + " (this record is ignored)");
    }
  }
  // Start-up samples of earlier processes stay in the table.
  const fs::path timings = path / "timings.csv";
  if (!fs::exists(timings, error)) return known;
  std::istringstream table(readTextFile(timings, kMaxRecordBytes));
  for (std::string line; std::getline(table, line);) {
    std::istringstream row(line);
    std::array<std::string, 5> cells;
    for (std::string& cell : cells) std::getline(row, cell, ',');
    if (cells[0] == "0")
      known.startup.push_back(
          {0, cells[1], std::strtod(cells[2].c_str(), nullptr), cells[3], cells[4] == "1"});
  }
  return known;
}

bool staysInside(const FrameRecord& record) {
  return std::all_of(record.files.begin(), record.files.end(), [](const FileRecord& file) {
    const fs::path path = file.path;
    return path.is_relative() && path.has_filename() &&
           std::find(path.begin(), path.end(), fs::path("..")) == path.end();
  });
}

std::string damage(const fs::path& folder, const FrameRecord& record) {
  if (record.files.empty()) return "its record names no file";
  for (const FileRecord& file : record.files) {
    const fs::path path = folder / file.path;
    std::error_code error;
    if (!fs::is_regular_file(path, error)) return file.path + " is missing";
    if (fs::file_size(path, error) != file.bytes)
      return file.path + " does not have the size that was written";
    try {
      if (fingerprintOf(readFile(path)) != file.content)
        return file.path + " does not have the contents that were written";
    } catch (const SceneError& unreadable) {
      return unreadable.what();
    }
  }
  return "";
}

}  // namespace catoptric::run
