#include "report/run_data.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <set>
#include <string_view>

#include "config/json.h"
#include "core/error.h"
#include "core/file.h"
#include "core/log.h"
#include "core/text.h"

namespace catoptric::report {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kHeader = "frame,step,seconds,clock,first";

bool isRun(const fs::path& folder) {
  std::error_code ignored;
  return fs::is_directory(folder / "frames", ignored) ||
         fs::is_regular_file(folder / "timings.csv", ignored);
}

/// Files frame.NUMBER.EXTENSION of a folder; none when it is absent.
std::map<int, fs::path> numberedFiles(const fs::path& folder, const std::string& extension) {
  std::map<int, fs::path> files;
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(folder, ignored)) {
    const std::string name = entry.path().filename().string();
    const std::string start = "frame.";
    if (name.size() <= start.size() + extension.size() || !name.starts_with(start) ||
        !name.ends_with(extension))
      continue;
    const char* first = name.data() + start.size();
    const char* last = name.data() + name.size() - extension.size();
    int number = 0;
    const auto [end, error] = std::from_chars(first, last, number);
    if (error == std::errc() && end == last) files[number] = entry.path();
  }
  return files;
}

/// Says that nothing has this name, and which is the nearest beside it.
void requireThere(const fs::path& path) {
  std::error_code ignored;
  if (fs::exists(path, ignored)) return;
  const fs::path whole = fs::absolute(path / ".").lexically_normal().parent_path();
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(whole.parent_path(), ignored))
    names.push_back(entry.path().filename().string());
  throw UsageError(path.string() + ": no such file or folder" +
                   didYouMean(whole.filename().string(), names));
}

/// The number at the end of a file's name; -1 without one.
int numberAtEnd(const fs::path& file) {
  const std::string stem = file.stem().string();
  std::size_t first = stem.size();
  while (first > 0 && stem[first - 1] >= '0' && stem[first - 1] <= '9') --first;
  int number = -1;
  const auto [end, error] = std::from_chars(stem.data() + first, stem.data() + stem.size(), number);
  return error == std::errc() && end != stem.data() + first ? number : -1;
}

template <class Number>
bool parse(std::string_view text, Number& value) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size();
}

/// Counters, kinds of steps and objects' names; a run that was stopped has no summary.
void readSummary(const fs::path& file, RunData& run) {
  std::error_code ignored;
  if (!fs::exists(file, ignored)) return;
  const config::Value summary = config::parseFile(file);
  const config::Value counters = summary.get("counters");
  if (!counters.isNull())
    for (const std::string& name : counters.keys()) {
      const config::Value counter = counters.get(name);
      run.counters.push_back({name, counter.get("mean").asNumber(), counter.get("max").asNumber()});
    }
  const config::Value kinds = summary.get("step_kinds");
  if (!kinds.isNull())
    for (const std::string& step : kinds.keys()) run.stepKinds[step] = kinds.get(step).asString();
  if (summary.has("keeps")) run.keeps = summary.get("keeps").asString();
  if (summary.has("path_frames"))
    run.pathFrames = static_cast<int>(summary.get("path_frames").asInteger());
  const config::Value reflectors = summary.get("reflectors");
  if (!reflectors.isNull())
    for (const config::Value& reflector : reflectors.asArray())
      run.objectNames[static_cast<int>(reflector.get("id").asInteger())] =
          reflector.get("name").asString();
}

}  // namespace

std::vector<frame::StepSample> parseTimings(const std::string& text, const std::string& name) {
  std::vector<frame::StepSample> samples;
  int lineNumber = 0;
  for (std::size_t start = 0; start < text.size();) {
    const std::size_t end = std::min(text.find('\n', start), text.size());
    std::string_view line(text.data() + start, end - start);
    if (line.ends_with('\r')) line.remove_suffix(1);
    start = end + 1;
    ++lineNumber;
    const auto fail = [&](const std::string& message) {
      throw UsageError(name + ":" + std::to_string(lineNumber) + ": \"" + std::string(line) +
                       "\": " + message);
    };
    if (lineNumber == 1) {
      if (line != kHeader) fail("the header must be " + std::string(kHeader));
      continue;
    }
    std::vector<std::string_view> cells;
    for (std::size_t at = 0; at <= line.size();) {
      const std::size_t comma = std::min(line.find(',', at), line.size());
      cells.push_back(line.substr(at, comma - at));
      at = comma + 1;
    }
    if (cells.size() != 5) fail("a row must have 5 cells");
    frame::StepSample sample;
    if (!parse(cells[0], sample.frame) || sample.frame < 0) fail("not a frame number");
    if (cells[1].empty()) fail("no step");
    if (!parse(cells[2], sample.seconds) || !std::isfinite(sample.seconds) || sample.seconds < 0.0)
      fail("not a time in seconds");
    if (cells[4] != "0" && cells[4] != "1") fail("\"first\" must be 0 or 1");
    sample.step = cells[1];
    sample.clock = cells[3];
    sample.first = cells[4] == "1";
    samples.push_back(std::move(sample));
  }
  if (lineNumber == 0) throw UsageError(name + ": the file is empty");
  return samples;
}

RunData readRun(const fs::path& folder, const std::string& name) {
  if (!isRun(folder))
    throw UsageError(folder.string() + ": not a run's folder (neither frames/ nor timings.csv)");
  RunData run;
  run.folder = folder;
  run.name = !name.empty() ? name : fs::absolute(folder / ".").parent_path().filename().string();
  run.frames = numberedFiles(folder / "frames", ".exr");
  run.previews = numberedFiles(folder / "previews", ".png");
  const fs::path timings = folder / "timings.csv";
  std::error_code ignored;
  if (fs::exists(timings, ignored))
    run.samples = parseTimings(readTextFile(timings, std::size_t{1} << 30), timings.string());

  readSummary(folder / "summary.json", run);

  // A resumed run leaves files of earlier settings in place; its records do not have them
  std::set<int> recorded;
  for (const frame::StepSample& sample : run.samples) recorded.insert(sample.frame);
  recorded.erase(0);
  if (!recorded.empty()) {
    const auto foreign = [&](const auto& file) { return !recorded.contains(file.first); };
    const std::size_t left = std::erase_if(run.frames, foreign);
    std::erase_if(run.previews, foreign);
    if (left > 0) {
      log::warning(folder.string() + ": " + std::to_string(left) +
                   " of its frames are ignored, because timings.csv does not list them: they were "
                   "made with other settings, or copied there");
    }
  }
  return run;
}

RunData readSequence(const fs::path& path) {
  std::error_code ignored;
  requireThere(path);
  RunData sequence;
  sequence.folder = path;
  if (fs::is_regular_file(path, ignored)) {
    const int number = numberAtEnd(path);
    sequence.name = path.filename().string();
    sequence.frames[number >= 0 ? number : 1] = path;
    return sequence;
  }
  if (isRun(path)) return readRun(path);
  sequence.name = fs::absolute(path / ".").parent_path().filename().string();
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(path, ignored))
    if (entry.path().extension() == ".exr") files.push_back(entry.path());
  if (files.empty()) {
    std::vector<std::string> runs;
    for (const auto& entry : fs::directory_iterator(path, ignored))
      if (isRun(entry.path())) runs.push_back(entry.path().string());
    std::sort(runs.begin(), runs.end());
    if (!runs.empty())
      throw UsageError(path.string() + ": has several runs; choose one of " + joined(runs, ", "));
    throw UsageError(path.string() +
                     ": no frames to compare (neither a run's folder, nor an EXR "
                     "file, nor a folder of EXR files)");
  }
  std::sort(files.begin(), files.end());
  for (const fs::path& file : files) {
    int number = numberAtEnd(file);
    if (number < 0 && files.size() > 1)
      throw UsageError(file.string() + ": its name does not end with a frame's number");
    if (number < 0) number = 1;
    const auto [old, added] = sequence.frames.emplace(number, file);
    if (!added)
      throw UsageError(file.string() + ": frame " + std::to_string(number) + " is also " +
                       old->second.filename().string() + "; compare one sequence at a time");
  }
  return sequence;
}

}  // namespace catoptric::report
