#include "report/timings.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "config/json_text.h"
#include "core/text.h"

namespace catoptric::report {
namespace {

constexpr const char* kOverlapped = "overlapped";
/// Steps before the first frame that build nothing for the method: they are the scene's, or frames
/// before the run's first one.
const std::set<std::string> kOfScene = {"scene",       "path", "geometry",
                                        "environment", "bake", "warm_up"};

/// Whether a step is no part of rendering (methods::StepKind, as summary.json names it).
bool isApart(const RunData& run, const std::string& step) {
  const auto kind = run.stepKinds.find(step);
  return kind != run.stepKinds.end() && (kind->second == "waiting" || kind->second == "check");
}

/// Values of one row, one for each frame, and which of them are of first frames.
struct Series {
  std::string clock;
  std::map<int, double> perFrame;
  std::set<int> firsts;
};

StepStatistics statisticsOf(const std::string& step, const std::string& clock,
                            std::vector<double> values) {
  StepStatistics s;
  s.step = step;
  s.clock = clock;
  s.count = static_cast<int>(values.size());
  if (values.empty()) return s;
  for (const double value : values) s.sum += value;  // in the order of frames
  std::sort(values.begin(), values.end());
  const std::size_t n = values.size();
  s.min = values.front();
  s.max = values.back();
  s.median = n % 2 == 1 ? values[n / 2] : 0.5 * (values[n / 2 - 1] + values[n / 2]);
  s.mean = s.sum / static_cast<double>(n);
  return s;
}

StepStatistics statisticsOf(const std::string& step, const Series& series) {
  std::vector<double> values;
  double firstSum = 0.0;
  for (const auto& [frame, seconds] : series.perFrame) {
    values.push_back(seconds);
    if (series.firsts.contains(frame)) firstSum += seconds;
  }
  StepStatistics s = statisticsOf(step, series.clock, std::move(values));
  if (!series.firsts.empty()) s.first = firstSum / static_cast<double>(series.firsts.size());
  return s;
}

std::string ms(double seconds) {
  return fixedText(seconds * 1e3, 2);
}

std::string json(const StepStatistics& s) {
  config::JsonText text;
  text.add("step", s.step).add("clock", s.clock).add("count", s.count).add("min", s.min);
  text.add("median", s.median).add("mean", s.mean).add("max", s.max).add("sum", s.sum);
  if (s.first >= 0.0) text.add("first", s.first);
  return text.object();
}

std::string json(const std::vector<StepStatistics>& steps) {
  std::vector<std::string> texts;
  for (const StepStatistics& s : steps) texts.push_back(json(s));
  return "[" + joined(texts, ",") + "]";
}

/// Seconds of what a method builds before its first frame, in one process.
double secondsOfBuilds(const std::vector<StepStatistics>& preparation) {
  double sum = 0.0;
  int processes = 1;
  for (const StepStatistics& s : preparation) {
    if (s.step == "scene") processes = s.count;
    if (!kOfScene.contains(s.step)) sum += s.sum;
  }
  return sum / processes;
}

/// Why the frames' times are too long for a method that keeps something; empty: they are not.
std::string apartNote(const RunData& run, const std::set<int>& frames) {
  if (run.keeps.empty() || frames.empty() ||
      static_cast<int>(frames.size()) == *frames.rbegin() - *frames.begin() + 1)
    return "";
  return run.name + " keeps " + run.keeps +
         " from frame to frame. These frames are not consecutive, so its steady frames take longer "
         "than those of the whole path.";
}

/// What the rows of first and steady frames are.
std::string meaning(bool anySteady) {
  return std::string(kFirstFrames) + (anySteady ? " Steady frame: every other." : "");
}

std::string framesText(int frames) {
  return "mean of " + std::to_string(frames) + (frames == 1 ? " frame" : " frames");
}

std::string perSecond(double seconds) {
  return seconds > 0.0 ? fixedText(1.0 / seconds, 2) : "";
}

}  // namespace

const StepStatistics* TimingTable::find(const std::string& step) const {
  for (const auto* group : {&steps, &apart, &overlapped, &preparation})
    for (const StepStatistics& s : *group)
      if (s.step == step) return &s;
  return nullptr;
}

TimingTable timingTable(const RunData& run, int amortize) {
  std::vector<std::string> order;
  std::map<std::string, Series> series;
  std::vector<std::string> preparationOrder;
  std::map<std::string, std::vector<double>> preparation;
  std::map<std::string, std::string> preparationClocks;
  Series rendering{"wall", {}, {}};
  Series frame{"wall", {}, {}};
  std::set<int> numbers;
  for (const frame::StepSample& sample : run.samples) {
    if (sample.frame == 0) {
      if (!preparation.contains(sample.step)) preparationOrder.push_back(sample.step);
      preparation[sample.step].push_back(sample.seconds);
      preparationClocks[sample.step] = sample.clock;
      continue;
    }
    numbers.insert(sample.frame);
    if (!series.contains(sample.step)) order.push_back(sample.step);
    Series& s = series[sample.step];
    s.clock = sample.clock;
    s.perFrame[sample.frame] += sample.seconds;
    if (sample.first) s.firsts.insert(sample.frame);
    if (sample.clock == kOverlapped) continue;
    frame.perFrame[sample.frame] += sample.seconds;
    if (sample.first) frame.firsts.insert(sample.frame);
    if (isApart(run, sample.step)) continue;
    rendering.perFrame[sample.frame] += sample.seconds;
    if (sample.first) rendering.firsts.insert(sample.frame);
  }

  TimingTable table;
  table.name = run.name;
  table.frames = static_cast<int>(numbers.size());
  for (const std::string& step : preparationOrder)
    table.preparation.push_back(statisticsOf(step, preparationClocks[step], preparation[step]));
  for (const std::string& step : order) {
    const Series& s = series[step];
    (s.clock == kOverlapped ? table.overlapped
     : isApart(run, step)   ? table.apart
                            : table.steps)
        .push_back(statisticsOf(step, s));
  }
  table.rendering = statisticsOf("rendering", rendering);
  table.frame = statisticsOf("frame", frame);
  const double builds = secondsOfBuilds(table.preparation);
  std::vector<double> first;
  std::vector<double> steady;
  for (const auto& [number, seconds] : rendering.perFrame)
    if (rendering.firsts.contains(number))
      first.push_back(builds + seconds);
    else
      steady.push_back(seconds);
  table.first = statisticsOf("first frame", "wall", std::move(first));
  table.steady = statisticsOf("steady frame", "wall", std::move(steady));
  table.note = apartNote(run, numbers);
  table.amortize = amortize > 0 ? amortize : run.pathFrames;
  if (table.first.count > 0 && (table.amortize == 1 || table.steady.count > 0))
    table.mean = (table.first.mean + (table.amortize - 1) * table.steady.mean) / table.amortize;
  return table;
}

Table timingView(const TimingTable& timings) {
  Table table;
  table.title = timings.name + ": " + std::to_string(timings.frames) + " frames, times in ms";
  table.columns = {{"step", false},   {"clock", false}, {"frames", true, true}, {"min", true, true},
                   {"median", true},  {"mean", true},   {"max", true},          {"first", true},
                   {"share %", true}, {"per s", true}};
  const auto row = [&](const StepStatistics& s, bool share, bool rate) {
    table.rows.push_back({s.step, s.clock, std::to_string(s.count), ms(s.min), ms(s.median),
                          ms(s.mean), ms(s.max), s.first >= 0.0 ? ms(s.first) : "",
                          share && timings.rendering.sum > 0.0
                              ? fixedText(100.0 * s.sum / timings.rendering.sum, 1)
                              : "",
                          rate ? perSecond(s.median) : ""});
  };
  for (const StepStatistics& s : timings.steps) row(s, true, false);
  if (timings.frames > 0) {
    table.rows.emplace_back();
    row(timings.rendering, true, true);
    for (const StepStatistics& s : timings.apart) row(s, false, false);
    if (!timings.apart.empty()) row(timings.frame, false, true);
    table.rows.emplace_back();
    for (const StepStatistics* s : {&timings.first, &timings.steady})
      if (s->count > 0) row(*s, false, false);
    if (timings.mean)
      table.rows.push_back({framesText(timings.amortize), "wall", "", "", "", ms(*timings.mean)});
    table.notes.push_back(meaning(timings.steady.count > 0));
    if (!timings.note.empty()) table.notes.push_back(timings.note);
  }
  if (!timings.overlapped.empty()) {
    table.rows.emplace_back();
    for (const StepStatistics& s : timings.overlapped) row(s, false, false);
  }
  if (!timings.preparation.empty()) {
    table.rows.emplace_back();
    double sum = 0.0;
    for (const StepStatistics& s : timings.preparation) {
      row(s, false, false);
      sum += s.sum;
    }
    table.notes.push_back("Before the first frame: " + ms(sum) + " ms in all (last rows).");
  }
  if (timings.rendering.first >= 0.0)
    table.notes.emplace_back(
        "Min, median, mean and max include first frames (memory is allocated, caches are filled); "
        "per s is computed from the median.");
  return table;
}

Table timingComparison(std::span<const TimingTable> methods) {
  Table table;
  if (methods.empty()) return table;
  table.title = "Median ms per frame";
  table.columns.push_back({"step", false});
  for (const TimingTable& method : methods) table.columns.push_back({method.name, true});

  // Steps of all methods, in the order in which they first occur
  using Group = std::vector<StepStatistics> TimingTable::*;
  bool someFramesOnly = false;
  const auto addGroup = [&](Group group, bool preparation) {
    std::vector<std::string> order;
    for (const TimingTable& method : methods)
      for (const StepStatistics& s : method.*group)
        if (std::find(order.begin(), order.end(), s.step) == order.end()) order.push_back(s.step);
    // What no step names stands last
    std::stable_partition(order.begin(), order.end(),
                          [](const std::string& step) { return step != "other"; });
    for (const std::string& step : order) {
      std::vector<std::string> cells{step};
      for (const TimingTable& method : methods) {
        cells.emplace_back();
        for (const StepStatistics& s : method.*group) {
          if (s.step != step) continue;
          someFramesOnly = someFramesOnly || (!preparation && s.count < method.frames);
          cells.back() = ms(preparation ? s.sum : s.median);
        }
      }
      table.rows.push_back(cells);
    }
    return !order.empty();
  };
  const auto addRow = [&](const std::string& name, const auto& textOf) {
    std::vector<std::string> cells{name};
    for (const TimingTable& method : methods) cells.push_back(textOf(method));
    if (std::any_of(cells.begin() + 1, cells.end(), [](const auto& cell) { return !cell.empty(); }))
      table.rows.push_back(cells);
  };
  addGroup(&TimingTable::steps, false);
  table.rows.emplace_back();
  addRow("rendering", [](const auto& m) { return m.frames > 0 ? ms(m.rendering.median) : ""; });
  addRow("frames per s", [](const auto& m) { return perSecond(m.rendering.median); });
  table.rows.emplace_back();
  addRow("first frame", [](const auto& m) { return m.first.count > 0 ? ms(m.first.mean) : ""; });
  addRow("steady frame", [](const auto& m) { return m.steady.count > 0 ? ms(m.steady.mean) : ""; });
  addRow(framesText(methods.front().amortize),
         [](const auto& m) { return m.mean ? ms(*m.mean) : ""; });
  table.rows.emplace_back();
  if (addGroup(&TimingTable::overlapped, false)) table.rows.emplace_back();
  if (addGroup(&TimingTable::preparation, true))
    table.notes.emplace_back(
        "Last rows: before the first frame, summed over the processes that made the run.");
  else
    table.rows.pop_back();
  const bool anySteady =
      std::ranges::any_of(methods, [](const auto& method) { return method.steady.count > 0; });
  table.notes.push_back(meaning(anySteady) + " These rows are means.");
  for (const TimingTable& method : methods)
    if (!method.note.empty()) table.notes.push_back(method.note);
  if (someFramesOnly)
    table.notes.emplace_back(
        "For a step that only some frames have, the median is over these frames.");
  return table;
}

Table counterView(std::span<const RunData> runs) {
  Table table;
  table.title = "Counted per frame: mean (most)";
  table.columns.push_back({"counter", false});
  std::map<std::string, std::vector<std::string>> rows;
  std::set<std::string> counted;
  for (std::size_t i = 0; i < runs.size(); ++i) {
    table.columns.push_back({runs[i].name, true});
    for (const Counter& counter : runs[i].counters) {
      auto& cells = rows[counter.name];
      cells.resize(runs.size());
      if (counter.max > 0.0) counted.insert(counter.name);
      cells[i] = fixedText(counter.mean, counter.mean == std::floor(counter.mean) ? 0 : 1);
      if (counter.max != counter.mean) cells[i] += " (" + fixedText(counter.max, 0) + ")";
    }
  }
  std::vector<std::string> zero;
  for (auto& [name, cells] : rows) {
    if (!counted.contains(name)) {
      zero.push_back(name);
      continue;
    }
    cells.insert(cells.begin(), name);
    table.rows.push_back(cells);
  }
  if (!zero.empty()) table.notes.push_back("0 in all frames: " + joined(zero, ", ") + ".");
  return table;
}

std::string timingCsv(std::span<const TimingTable> methods) {
  std::string text = "method,kind,step,clock,count,min,median,mean,max,sum,first\n";
  for (const TimingTable& method : methods) {
    const auto add = [&](const char* kind, const StepStatistics& s) {
      text += csvCell(method.name) + "," + kind + "," + csvCell(s.step) + "," + csvCell(s.clock) +
              "," + std::to_string(s.count);
      for (const double value : {s.min, s.median, s.mean, s.max, s.sum})
        text += "," + exactText(value);
      text += "," + (s.first >= 0.0 ? exactText(s.first) : "") + "\n";
    };
    for (const StepStatistics& s : method.preparation) add("preparation", s);
    for (const StepStatistics& s : method.steps) add("step", s);
    for (const StepStatistics& s : method.apart) add("apart", s);
    for (const StepStatistics& s : method.overlapped) add("overlapped", s);
    if (method.frames == 0) continue;
    add("total", method.rendering);
    add("total", method.frame);
    for (const StepStatistics* s : {&method.first, &method.steady})
      if (s->count > 0) add("total", *s);
    if (method.mean)
      add("total", statisticsOf(framesText(method.amortize), "wall", {*method.mean}));
  }
  return text;
}

std::string timingJson(std::span<const TimingTable> methods) {
  std::vector<std::string> texts;
  for (const TimingTable& method : methods) {
    config::JsonText text;
    text.add("name", method.name).add("frames", method.frames);
    if (method.frames > 0)
      text.raw("rendering", json(method.rendering)).raw("frame", json(method.frame));
    if (method.first.count > 0) text.raw("first", json(method.first));
    if (method.steady.count > 0) text.raw("steady", json(method.steady));
    if (method.mean) text.add("amortize", method.amortize).add("mean_seconds", *method.mean);
    texts.push_back(text.raw("steps", json(method.steps))
                        .raw("apart", json(method.apart))
                        .raw("overlapped", json(method.overlapped))
                        .raw("preparation", json(method.preparation))
                        .object());
  }
  return "[" + joined(texts, ",") + "]";
}

}  // namespace catoptric::report
