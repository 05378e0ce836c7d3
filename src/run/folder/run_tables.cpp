// The tables of a run's folder: timings.csv, the methods' own, and summary.json.
#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "config/json.h"
#include "config/json_text.h"
#include "core/file.h"
#include "run/folder/run_folder.h"

namespace catoptric::run {
namespace {

using config::JsonText;

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

/// Statistics over the frames of the columns of numbers in tables with one row in each frame.
class OneRowTables {
 public:
  void add(const FrameRecord& record) {
    ++frames_;
    for (const methods::Table& table : record.tables) {
      if (table.rows().size() != 1) continue;
      for (std::size_t c = 0; c < table.columns().size(); ++c) {
        const methods::Cell& cell = table.rows().front()[c];
        std::vector<double>& values = tables_[table.name()][table.columns()[c].name];
        if (const auto* whole = std::get_if<std::int64_t>(&cell))
          values.push_back(static_cast<double>(*whole));
        else if (const auto* real = std::get_if<double>(&cell); real && std::isfinite(*real))
          values.push_back(*real);
      }
    }
  }

  std::string text() const {
    JsonText all;
    for (const auto& [name, columns] : tables_) {
      JsonText table;
      for (const auto& [column, values] : columns)
        if (values.size() == frames_) table.raw(column, statisticsText(values));
      if (table.object() != "{}") all.raw(name, table.object());
    }
    return all.object();
  }

 private:
  std::size_t frames_ = 0;
  std::map<std::string, std::map<std::string, std::vector<double>>> tables_;
};

}  // namespace

void RunFolder::writeTimings() const {
  std::string text = "frame,step,seconds,clock,first\n";
  const auto append = [&](const frame::StepSample& sample) {
    text += fmt::format("{},{},{:.9f},{},{:d}\n", sample.frame, sample.step, sample.seconds,
                        sample.clock, sample.first);
  };
  for (const frame::StepSample& sample : startup_) append(sample);
  std::map<std::string, std::string> tables;  // the method's own
  for (const auto& [number, line] : lines_) {
    const FrameRecord record = parseRecord(line, path_.string());
    for (const frame::StepSample& sample : record.samples) append(sample);
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
  writeFileAtomically(path_ / "timings.csv", text);
  for (const auto& [name, csv] : tables) writeFileAtomically(path_ / (name + ".csv"), csv);
}

void RunFolder::writeSummary(const std::map<std::string, std::string>& members) const {
  // Steps: per-frame sums, as several samples of one step may belong to a frame.
  std::map<std::string, std::vector<double>> steps;
  std::map<std::string, std::string> clocks;
  std::vector<double> frames;
  std::map<std::string, std::vector<double>> counters;
  OneRowTables tables;
  std::vector<int> numbers;
  for (const auto& [number, line] : lines_) {
    const FrameRecord record = parseRecord(line, path_.string());
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
    tables.add(record);
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
      .raw("counters", counterTexts.object())
      .raw("tables", tables.text());
  for (const auto& [name, text] : members) summary.raw(name, text);
  writeFileAtomically(path_ / "summary.json",
                      config::parseText(summary.object(), "summary").dump(2) + "\n");
}

}  // namespace catoptric::run
