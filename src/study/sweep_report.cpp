// What a sweep writes.
#include <algorithm>
#include <map>
#include <set>

#include "config/json_text.h"
#include "core/file.h"
#include "core/text.h"
#include "report/html.h"
#include "report/timings.h"
#include "scene/camera.h"
#include "study/sweep.h"

namespace catoptric::study {
namespace {

using report::exactText;
using report::fixedText;

std::string milliseconds(double seconds) {
  return seconds > 0.0 ? fixedText(1e3 * seconds, seconds < 0.01 ? 2 : 1) : "";
}

/// With three significant digits or so.
std::string errorText(double error) {
  return fixedText(error, error == 0.0 || error >= 100.0 ? 0
                          : error >= 10.0                ? 1
                          : error >= 1.0                 ? 2
                          : error >= 0.1                 ? 3
                                                         : 4);
}

std::string markText(const SweepResult& result, const SweepPoint& point) {
  std::string text = markName(point.judged.mark);
  if (point.judged.mark == Mark::Dominated) text += " by ";
  if (point.judged.mark == Mark::Unclear) text += " beside ";
  if (point.judged.by >= 0)
    text += std::to_string(result.points[static_cast<std::size_t>(point.judged.by)].number);
  if (point.withinUncertainty(result.request.metrics.front())) text += ", within";
  return text;
}

/// Names of the options that vary, in the order of the points.
std::vector<std::string> variedNames(const SweepResult& result) {
  std::vector<std::string> names;
  for (const SweepPoint& point : result.points)
    for (const auto& [name, value] : point.setting.point.settings)
      if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
  return names;
}

std::string valueOf(const SweepPoint& point, const std::string& name) {
  for (const auto& [own, value] : point.setting.point.settings)
    if (own == name) return value;
  return "";
}

/// Of the names that share a column the one that a point has.
std::string valueIn(const SweepPoint& point, const std::vector<std::string>& column) {
  for (const std::string& name : column)
    if (std::string value = valueOf(point, name); !value.empty()) return value;
  return "";
}

std::string pointJson(const SweepResult& result, const SweepPoint& point) {
  config::JsonText settings;
  for (const auto& [name, value] : point.setting.point.settings) settings.add(name, value);
  config::JsonText text;
  text.add("number", point.number)
      .add("key", point.setting.key)
      .add("method", point.setting.point.method)
      .raw("settings", settings.object());
  if (!point.setting.point.program.empty()) text.add("program", point.setting.point.program);
  if (!point.failure.empty()) return text.add("failure", point.failure).object();
  if (point.seconds > 0.0) {
    text.add("seconds", point.seconds)
        .add("first_seconds", point.first)
        .add("steady_seconds", point.steady)
        .add("mean_seconds", point.mean)
        .add("reflection_seconds", point.reflection)
        .add("worst_seconds", point.worstSeconds)
        .add("worst_seconds_frame", point.worstSecondsFrame)
        .add("ratio", point.ratio.value);
    if (point.ratio.interval)
      text.raw("ratio_interval", "[" + config::numberText(point.ratio.interval->low) + "," +
                                     config::numberText(point.ratio.interval->high) + "]");
    config::JsonText steps;
    for (const auto& [step, seconds] : point.steps) steps.add(step, seconds);
    text.raw("steps", steps.object());
  }
  config::JsonText errors;
  for (const auto& [metric, error] : point.errors)
    errors.raw(metric, config::JsonText()
                           .add("all", error)
                           .add("worst", point.worst.at(metric).second)
                           .add("worst_frame", point.worst.at(metric).first)
                           .object());
  text.raw("errors", errors.object());
  if (point.uncertainty > 0.0) text.add("standard_error", point.uncertainty);
  text.add("mark", markName(point.judged.mark)).add("same_pixels_as", point.sameAs);
  if (point.judged.by >= 0)
    text.add("by", result.points[static_cast<std::size_t>(point.judged.by)].number);
  return text.object();
}

/// First frames are timed in each round; else there is one start each, which ranks nothing.
bool showsFirst(const SweepResult& result) {
  return result.request.time.of != TimeKind::Of::Steady;
}

std::string howMeasured(const SweepResult& result) {
  int rounds = 0;
  for (const SweepPoint& point : result.points) rounds = std::max(rounds, point.ratio.rounds);
  std::string text = "Frames " + scene::formatFrames(result.frames) + ". ";
  if (rounds > 0)
    text += "Times: up to " + std::to_string(rounds) +
            " interleaved rounds, frame by frame, after one that warms up; a frame's time is its "
            "median, and the steady time the mean over the frames. " +
            (showsFirst(result) ? std::string(report::kFirstFrames) + " " : "") +
            "Ratios and marks: of the " + timeName(result.request.time) +
            ". In brackets after ratios: the 95 % confidence interval. ";
  return text + "Errors: against " + result.request.against + ", over all frames together.";
}

std::string optionOf(const std::string& name) {
  return name.substr(name.rfind('.') + 1);
}

/// Varied names by columns: the same option of several methods shares one, where no point has two.
std::vector<std::vector<std::string>> columnsOf(const SweepResult& result) {
  std::vector<std::vector<std::string>> columns;
  for (const std::string& name : variedNames(result)) {
    const auto room = [&](const std::vector<std::string>& column) {
      return optionOf(column.front()) == optionOf(name) &&
             std::ranges::none_of(result.points, [&](const SweepPoint& point) {
               return !valueOf(point, name).empty() && !valueIn(point, column).empty();
             });
    };
    const auto found = std::ranges::find_if(columns, room);
    if (found == columns.end())
      columns.push_back({name});
    else
      found->push_back(name);
  }
  return columns;
}

}  // namespace

report::Table sweepTable(const SweepResult& result) {
  report::Table table;
  const std::vector<std::vector<std::string>> varied = columnsOf(result);
  table.columns = {{"", true}, {"method", false}};
  for (const std::vector<std::string>& column : varied)
    table.columns.push_back({optionOf(column.front()), true});
  const TimeKind& time = result.request.time;
  const bool anyTimed =
      std::ranges::any_of(result.points, [](const auto& point) { return point.seconds > 0.0; });
  std::vector<std::pair<TimeKind::Of, double SweepPoint::*>> times;
  if (anyTimed) {
    if (showsFirst(result)) times.emplace_back(TimeKind::Of::First, &SweepPoint::first);
    times.emplace_back(TimeKind::Of::Steady, &SweepPoint::steady);
    if (time.clock == Clock::Wall)  // steps have no CPU time
      times.emplace_back(TimeKind::Of::Reflection, &SweepPoint::reflection);
    if (showsFirst(result)) times.emplace_back(TimeKind::Of::Mean, &SweepPoint::mean);
    for (const auto& [of, seconds] : times)
      table.columns.push_back({timeName({time.clock, of, time.amortize}) + " ms", true,
                               of != time.of && of != TimeKind::Of::Reflection});
    table.columns.push_back({"ratio", false});
  }
  for (const std::string& metric : result.request.metrics) {
    table.columns.push_back({metric, true});
    table.columns.push_back({"worst (frame)", true, true});
  }
  const bool anyHandedOn =
      std::ranges::any_of(result.points, [](const auto& point) { return point.handedOn > 0.0; });
  if (anyHandedOn) table.columns.push_back({"handed on", true});
  table.columns.push_back({"", false});
  for (const SweepPoint& point : result.points) {
    std::vector<std::string> row{std::to_string(point.number), point.setting.point.method};
    if (!point.setting.point.program.empty()) row.back() += " of " + point.setting.point.program;
    for (const std::vector<std::string>& column : varied) row.push_back(valueIn(point, column));
    if (anyTimed) {
      for (const auto& [of, seconds] : times) row.push_back(milliseconds(point.*seconds));
      row.push_back(point.seconds > 0.0 ? ratioText(point.ratio) : "");
    }
    for (const std::string& metric : result.request.metrics) {
      const bool known = point.errors.contains(metric);
      row.push_back(known ? errorText(point.errors.at(metric)) : "");
      row.push_back(known ? errorText(point.worst.at(metric).second) + " (" +
                                std::to_string(point.worst.at(metric).first) + ")"
                          : "");
    }
    if (anyHandedOn)
      row.push_back(point.handedOn > 0.0 ? fixedText(100.0 * point.handedOn, 1) + " %" : "");
    row.push_back(point.failure.empty() ? markText(result, point) : "failed: " + point.failure);
    table.rows.push_back(row);
  }
  table.notes = result.notes;
  if (anyHandedOn)
    table.notes.emplace_back(
        "Handed on: samples that the method leaves to traced rays or another method, of all "
        "samples of the frames, also those that reflect nothing.");
  table.notes.push_back(howMeasured(result));
  return table;
}

std::string sweepCsv(const SweepResult& result) {
  const std::vector<std::string> names = variedNames(result);
  std::string text = "point,key,method,program";
  for (const std::string& name : names) text += "," + csvCell(name);
  text +=
      ",seconds,first_seconds,steady_seconds,reflection_seconds,mean_seconds,worst_seconds,worst_"
      "seconds_frame,ratio,"
      "ratio_low,ratio_high";
  for (const std::string& metric : result.request.metrics)
    text += "," + metric + "," + metric + "_worst," + metric + "_worst_frame";
  text += ",standard_error,mark,by,failure\n";
  for (const SweepPoint& point : result.points) {
    text += std::to_string(point.number) + "," + point.setting.key + "," +
            csvCell(point.setting.point.method) + "," + csvCell(point.setting.point.program);
    for (const std::string& name : names) text += "," + csvCell(valueOf(point, name));
    const auto& interval = point.ratio.interval;
    if (point.seconds > 0.0)
      text += "," + exactText(point.seconds) + "," + exactText(point.first) + "," +
              exactText(point.steady) + "," + exactText(point.reflection) + "," +
              exactText(point.mean) + "," + exactText(point.worstSeconds) + "," +
              std::to_string(point.worstSecondsFrame) + "," + exactText(point.ratio.value) + "," +
              (interval ? exactText(interval->low) + "," + exactText(interval->high) : ",");
    else
      text += ",,,,,,,,,,";
    for (const std::string& metric : result.request.metrics)
      text += point.errors.contains(metric) ? "," + exactText(point.errors.at(metric)) + "," +
                                                  exactText(point.worst.at(metric).second) + "," +
                                                  std::to_string(point.worst.at(metric).first)
                                            : ",,,";
    text += "," + (point.uncertainty > 0.0 ? exactText(point.uncertainty) : std::string()) + "," +
            markName(point.judged.mark) + "," +
            (point.judged.by >= 0
                 ? std::to_string(result.points[static_cast<std::size_t>(point.judged.by)].number)
                 : "") +
            "," + csvCell(point.failure) + "\n";
  }
  return text;
}

std::string sweepJson(const SweepResult& result, const std::string& context) {
  std::vector<std::string> points;
  for (const SweepPoint& point : result.points) points.push_back(pointJson(result, point));
  return config::JsonText()
      .add("name", result.request.name)
      .add("against", result.request.against)
      .add("metrics", result.request.metrics)
      .add("time", timeName(result.request.time))
      .add("frames", scene::formatFrames(result.frames))
      .raw("points", "[" + joined(points, ",\n") + "]")
      .add("notes", result.notes)
      .raw("machine", context)
      .object();
}

/// Whether a method's points differ in one option alone: they make a curve.
bool isCurve(const SweepResult& result, const std::string& group, const std::string& method) {
  std::map<std::string, std::set<std::string>> values;
  for (const SweepPoint& point : result.points)
    if (point.setting.point.group == group && point.setting.point.method == method)
      for (const auto& [name, value] : point.setting.point.settings) values[name].insert(value);
  return std::ranges::count_if(values, [](const auto& one) { return one.second.size() > 1; }) == 1;
}

constexpr const char* kBars =
    "Bars: 95 % interval of the time; errors from the best to the worst frame";

std::vector<Chart> sweepCharts(const SweepResult& result) {
  const std::string& metric = result.request.metrics.front();
  std::vector<std::string> groups;
  for (const SweepPoint& point : result.points)
    if (std::find(groups.begin(), groups.end(), point.setting.point.group) == groups.end())
      groups.push_back(point.setting.point.group);
  std::vector<Chart> charts;
  for (const std::string& group : groups) {
    Chart chart;
    chart.title = result.request.name + (group.empty() ? "" : ": " + group);
    chart.note = kBars;
    chart.xTitle = "ms, " + timeName(result.request.time);
    chart.yTitle = metric + " against " + result.request.against;
    chart.xLog = chart.yLog = true;  // both are compared by ratios
    chart.showFront = true;
    for (const SweepPoint& point : result.points) {
      if (point.setting.point.group != group || point.seconds <= 0.0 ||
          !point.errors.contains(metric))
        continue;
      auto series = std::find_if(
          chart.series.begin(), chart.series.end(),
          [&](const ChartSeries& one) { return one.name == point.setting.point.method; });
      if (series == chart.series.end())
        series = chart.series.insert(
            series, ChartSeries{point.setting.point.method,
                                {},
                                isCurve(result, group, point.setting.point.method)});
      ChartPoint at;
      at.x = 1e3 * point.seconds;
      at.y = point.errors.at(metric);
      if (point.ratio.interval && point.ratio.value > 0.0)
        at.xInterval = Interval{at.x * point.ratio.interval->low / point.ratio.value,
                                at.x * point.ratio.interval->high / point.ratio.value};
      at.yInterval = Interval{point.least.at(metric), point.worst.at(metric).second};
      at.mark = point.judged.mark;
      Settings own = point.setting.point.settings;
      std::erase_if(own, [](const auto& one) { return !one.first.starts_with("methods."); });
      at.label = settingsText(own);
      at.title = std::to_string(point.number) + ": " + point.setting.text() + ": " +
                 fixedText(at.x, 1) + " ms, " + metric + " " + errorText(at.y);
      series->points.push_back(at);
    }
    if (!chart.series.empty()) charts.push_back(std::move(chart));
  }
  return charts;
}

std::string sweepPage(const SweepResult& result, const std::string& context) {
  report::HtmlPage page("Sweep of " + result.request.name);
  const std::vector<Chart> charts = sweepCharts(result);
  if (!charts.empty()) {
    page.svg(toSvg(charts));
    page.paragraph(
        "A filled point is on the Pareto front: no other is as accurate and as fast. A hollow one "
        "is dominated. A dashed one is unclear: another is as accurate, and these rounds do not "
        "decide which of the two is faster.");
  }
  page.table(sweepTable(result));
  page.details("Machine", context);
  return page.text();
}

void writeSweep(const Bench& bench, const SweepResult& result, const std::string& context) {
  const std::filesystem::path& folder = bench.options().folder;
  const auto write = [&](const char* name, const std::string& text) {
    writeFileAtomically(folder / name, std::string_view(text));
  };
  bench.writeSamples();
  write("points.csv", sweepCsv(result));
  write("sweep.json", sweepJson(result, context) + "\n");
  const report::Table table = sweepTable(result);
  report::writeTables(folder, "table", std::span(&table, 1));
  const std::vector<Chart> charts = sweepCharts(result);
  if (!charts.empty()) write("tradeoff.svg", toSvg(charts));
  write("report.html", sweepPage(result, context));
}

}  // namespace catoptric::study
