#include "study/bench.h"

#include <algorithm>
#include <charconv>
#include <regex>
#include <sstream>

#include "core/error.h"
#include "core/file.h"
#include "core/hash.h"
#include "core/log.h"
#include "core/remove_files.h"
#include "report/table.h"
#include "run/folder/machine.h"
#include "run/folder/memory.h"
#include "run/folder/plan.h"
#include "run/sequence/session.h"

namespace catoptric::study {
namespace {

namespace fs = std::filesystem;

std::string printOf(const std::string& text) {
  Fingerprint print;
  print.add(text);
  return print.text();
}

/// What tells whether the frames of a folder are still the same: names, sizes, times of change.
std::string folderPrint(const report::RunData& folder) {
  Fingerprint print;
  print.add(folder.folder.string());
  for (const auto& [number, file] : folder.frames) {
    std::error_code ignored;
    print.add(file.string());
    print.addValue(fs::file_size(file, ignored));
    print.addValue(fs::last_write_time(file, ignored).time_since_epoch().count());
  }
  return print.text();
}

std::string printOfFile(const fs::path& file) {
  Fingerprint print;
  print.add(readFile(file));
  return print.text();
}

/// Removes the files that a study writes to `folder`, whose path in the study's folder is `place`.
void removeStudyFiles(const fs::path& folder, const std::string& place) {
  static const std::string key = "[0-9a-f]{16}";
  static const std::regex ours("errors/" + key + "-" + key + "\\.json|logs/" + key +
                               "\\.txt|samples/[0-9]+\\.csv|frames/" + key +
                               "/frames/frame\\.[0-9]{4,}\\.exr");
  removeFiles(folder, [&](const std::string& relative) {
    return std::regex_match(place + relative, ours);
  });
}

/// The value of a cell of a file of samples.
template <class T>
T cellNumber(const std::string& cell, const std::string& place) {
  T value{};
  const auto [end, error] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
  if (error != std::errc() || end != cell.data() + cell.size())
    throw UsageError(place + ": \"" + cell + "\" is not a number");
  return value;
}

std::vector<std::string> cellsOf(const std::string& line, char separator) {
  std::vector<std::string> cells;
  std::istringstream text(line);
  for (std::string cell; std::getline(text, cell, separator);) cells.push_back(cell);
  return cells;
}

/// How long each setting is timed at least where rounds are enough to tell; ours. Of frames of 13
/// ms 8 rounds are over in a second, which another program can fill.
constexpr double kLeastSeconds = 4.0;
/// How long at most where growthOf() asks for more; ours. Beside a program that comes and goes a
/// setting that was 5 % slower was found 15 times of 20 in 4 seconds: intervals were 5.5 % wide
/// (tests/same_twice.py --load).
constexpr double kMostSeconds = 12.0;

constexpr std::string_view kSamplesHeader =
    "round,turn,point,frame,seconds,cpu_seconds,steps,memory_bytes";

}  // namespace

std::optional<std::size_t> Samples::find(const std::string& key) const {
  const auto found = std::find(keys.begin(), keys.end(), key);
  if (found == keys.end()) return {};
  const auto index = static_cast<std::size_t>(found - keys.begin());
  const bool measured =
      std::any_of(measurement.turns.begin(), measurement.turns.end(),
                  [&](const Turn& turn) { return turn.setting == index && turn.frame != kFirst; });
  return measured ? std::optional(index) : std::nullopt;
}

bool Samples::serve(const std::vector<int>& wanted, const BenchOptions& options) const {
  return frames == wanted && (options.first != FirstFrames::EachRound ||
                              std::ranges::any_of(measurement.turns, [](const Turn& turn) {
                                return turn.frame == kFirst && turn.round > 0;
                              }));
}

std::string samplesCsv(const Samples& samples, bool header) {
  std::string text = header ? std::string(kSamplesHeader) + "\n" : "";
  for (const Turn& turn : samples.measurement.turns) {
    text += std::to_string(turn.round) + "," + std::to_string(turn.turn) + "," +
            samples.keys[turn.setting] + "," + std::to_string(turn.frame) + "," +
            report::exactText(turn.report.seconds) + "," +
            report::exactText(turn.report.cpuSeconds) + ",";
    std::string steps;
    for (const auto& [step, seconds] : turn.report.steps)
      steps += (steps.empty() ? "" : ";") + step + "=" + report::exactText(seconds);
    text += steps + "," + std::to_string(turn.report.memoryBytes) + "\n";
  }
  return text;
}

Samples parseSamples(const std::string& text, const std::string& name) {
  Samples samples;
  std::istringstream lines(text);
  int number = 0;
  for (std::string line; std::getline(lines, line);) {
    const std::string place = name + ":" + std::to_string(++number);
    if (number == 1) {
      // Older builds leave out the last columns
      if (!kSamplesHeader.starts_with(line)) throw UsageError(place + ": is not a file of samples");
      continue;
    }
    const std::vector<std::string> cells = cellsOf(line, ',');
    if (cells.size() < 6) throw UsageError(place + ": a line of samples must have 6 to 8 cells");
    Turn turn;
    turn.round = cellNumber<int>(cells[0], place);
    turn.turn = cellNumber<int>(cells[1], place);
    const auto known = std::find(samples.keys.begin(), samples.keys.end(), cells[2]);
    turn.setting = static_cast<std::size_t>(known - samples.keys.begin());
    if (known == samples.keys.end()) samples.keys.push_back(cells[2]);
    turn.frame = cellNumber<int>(cells[3], place);
    turn.report.seconds = cellNumber<double>(cells[4], place);
    turn.report.cpuSeconds = cellNumber<double>(cells[5], place);
    for (const std::string& step :
         cells.size() > 6 ? cellsOf(cells[6], ';') : std::vector<std::string>{}) {
      const std::size_t equals = step.find('=');
      if (equals == std::string::npos) throw UsageError(place + ": \"" + step + "\" is not a step");
      turn.report.steps[step.substr(0, equals)] =
          cellNumber<double>(step.substr(equals + 1), place);
    }
    if (cells.size() > 7) turn.report.memoryBytes = cellNumber<std::uint64_t>(cells[7], place);
    samples.repeats = std::max(samples.repeats, turn.round);
    if (turn.frame != kFirst &&
        std::find(samples.frames.begin(), samples.frames.end(), turn.frame) == samples.frames.end())
      samples.frames.push_back(turn.frame);
    samples.measurement.turns.push_back(std::move(turn));
  }
  std::sort(samples.frames.begin(), samples.frames.end());
  samples.measurement.settings.resize(samples.keys.size());
  return samples;
}

const Bench::SceneFacts& Bench::sceneFactsOf(const run::RunConfig& run) {
  std::string name =
      run.scene.string() + "\n" + run.path.string() + "\n" + run.camera + "\n" + run.frames + "\n";
  for (const run::MethodConfig& method : run.methods) name += method.id + "\n";
  if (run.environment)
    name += config::parseText(run.effective, "run").get("environment").asString();
  const auto known = scenes_.find(name);
  if (known != scenes_.end()) return known->second;

  const run::Stage stage(run);
  const auto made = run::makeMethods(stage, methods::registry());
  run::makePlan(run, stage.scene(), stage.environment(), stage.frames().size(),
                made);  // says what cannot be done
  SceneFacts facts;
  inputs_.add(stage.inputs());
  facts.inputs = stage.inputs().print();
  Fingerprint print;
  print.addValue(stage.scene().fingerprint);
  if (!run.path.empty()) print.add(printOfFile(run.path));
  if (!run.camera.empty()) print.add(run.camera);
  facts.fingerprint = print.text();
  facts.frames = stage.frames();
  facts.pathFrames = stage.path().count();
  for (std::size_t i = 0; i < stage.scene().objects.size(); ++i)
    if (stage.scene().objects[i].reflector > 0)
      facts.reflectors[static_cast<int>(i + 1)] = stage.scene().objects[i].name;
  return scenes_.emplace(name, std::move(facts)).first->second;
}

Setting Bench::prepare(const Point& point) {
  Setting setting{point, study_.readRun(point.settings, point.method), ""};
  inputs_.add(setting.run.inputs);
  std::string& program = programs_[point.program];
  if (program.empty()) {
    std::error_code error;
    if (!point.program.empty() && !fs::is_regular_file(point.program, error))
      throw UsageError("program " + point.program + ": no such file; give a build of catoptric");
    const InputFiles::Recording recording(inputs_);
    program = printOfFile(point.program.empty() ? ownProgram() : fs::path(point.program)) +
              options_.shaders;
  }
  // With its name: the same options twice are two settings, which may be compared.
  setting.key =
      printOf(point.method + "\n" + setting.run.pixelSettings(setting.run.methods.front()) + "\n" +
              std::to_string(setting.run.threads) + "\n" + sceneFactsOf(setting.run).fingerprint +
              "\n" + program + "\n" + options_.processor);
  return setting;
}

const std::vector<int>& Bench::frames(const Setting& setting) {
  return sceneFactsOf(setting.run).frames;
}

int Bench::pathFrames(const Setting& setting) {
  return sceneFactsOf(setting.run).pathFrames;
}

const std::map<int, std::string>& Bench::reflectors(const Setting& setting) {
  return sceneFactsOf(setting.run).reflectors;
}

void Bench::checkStop() {
  if (options_.patience.stopRequested && options_.patience.stopRequested()) throw StudyStopped();
  inputs_.requireUnchanged();
  if (referenceFolder_ && folderPrint(*referenceFolder_) != referencePrint_)
    throw InputChanged(reference_);
}

void Bench::checkTime() const {
  if (options_.outOfTime && options_.outOfTime()) throw BudgetSpent();
}

void Bench::setReference(const std::string& methodOrFolder) {
  reference_ = methodOrFolder;
  std::error_code ignored;
  if (!fs::exists(reference_, ignored)) return;
  referenceFolder_ = report::readSequence(reference_);
  referenceFolder_->folder = fs::canonical(reference_);
  referencePrint_ = folderPrint(*referenceFolder_);
}

void Bench::say(const std::string& what, double share) const {
  if (options_.progress) options_.progress(what, share);
}

/// The reference of a setting: what all methods have in common, by the reference's method.
Setting Bench::referenceOf(const Setting& setting) {
  Point point{reference_, {}, "", setting.point.group};
  for (const auto& [name, value] : setting.point.settings)
    if (!name.starts_with("methods.") || name.starts_with("methods." + reference_ + "."))
      point.settings.emplace_back(name, value);
  return prepare(point);
}

std::string Bench::referenceKey(const Setting& setting) {
  return referenceFolder_ ? referencePrint_ : referenceOf(setting).key;
}

fs::path Bench::errorsFile(const Setting& setting) {
  return options_.folder / "errors" / (setting.key + "-" + referenceKey(setting) + ".json");
}

fs::path Bench::framesFolder(const Setting& setting) const {
  return options_.folder / "frames" / setting.key;
}

const PointErrors& Bench::errors(const Setting& setting) {
  const fs::path file = errorsFile(setting);
  const auto known = errors_.find(file.string());
  if (known != errors_.end()) return known->second;
  return errors_.emplace(file.string(), readErrors(file)).first->second;
}

std::size_t Bench::capacity() const {
  const auto most = static_cast<std::size_t>(std::max(2, options_.workers));
  if (workerMemory_ == 0) return most;
  // Workers may have 60 % of what is free and of what they have (ours): frames are written, too
  const double free = static_cast<double>(run::freeMemory()) / static_cast<double>(workerMemory_);
  const auto fitting =
      static_cast<std::size_t>(0.6 * (free + static_cast<double>(workers_.size())));
  return std::clamp<std::size_t>(fitting, 2, most);
}

/// The worker of a setting, started where it is not resident; those that are not `needed` go where
/// there is no room. Null, and a failure, when it cannot start.
WorkerProcess* Bench::worker(const Setting& setting, const std::vector<std::string>& needed) {
  const auto found = std::find_if(workers_.begin(), workers_.end(),
                                  [&](const auto& one) { return one.first == setting.key; });
  if (found != workers_.end()) {
    workers_.splice(workers_.begin(), workers_, found);
    return workers_.front().second.get();
  }
  for (auto last = workers_.end(); workers_.size() >= capacity() && last != workers_.begin();) {
    --last;
    if (std::find(needed.begin(), needed.end(), last->first) == needed.end())
      last = workers_.erase(last);
  }
  checkStop();
  checkTime();
  say("starting " + setting.text(), -1.0);
  try {
    const fs::path program =
        setting.point.program.empty() ? ownProgram() : fs::path(setting.point.program);
    auto process = std::make_unique<WorkerProcess>(
        program, study_.arguments(setting.point.settings, setting.point.method),
        options_.folder / "logs" / (setting.key + ".txt"), options_.patience);
    checkStop();
    process->requireInputs(sceneFactsOf(setting.run).inputs);
    renderers_.insert(process->renderer());
    workerMemory_ = std::max(workerMemory_, process->memoryBytes());
    workers_.emplace_front(setting.key, std::move(process));
    return workers_.front().second.get();
  } catch (const UsageError&) {
    throw;
  } catch (const Error& error) {
    checkStop();
    failures_[setting.key] = error.what();
    log::error(setting.text() + ": " + error.what());
    return nullptr;
  }
}

void Bench::checkReference(const std::vector<Setting>& settings) {
  for (const Setting& setting : settings) {
    referenceKey(setting);
    if (!referenceFolder_) continue;
    std::vector<int> lacking = frames(setting);
    std::erase_if(lacking, [&](int number) { return referenceFolder_->frames.contains(number); });
    if (!lacking.empty()) failWithoutFrames(lacking);
  }
}

void Bench::failWithoutFrames(const std::vector<int>& frames) const {
  throw UsageError("the reference " + reference_ + " lacks frames " + scene::formatFrames(frames));
}

report::RunData Bench::referenceFrames(const Setting& setting, const std::vector<int>& frames) {
  if (referenceFolder_) return *referenceFolder_;
  const Setting reference = referenceOf(setting);
  report::RunData data;
  data.name = reference_;
  data.folder = framesFolder(reference);
  data.frames = frameFiles(reference, frames);
  return data;
}

std::map<int, fs::path> Bench::frameFiles(const Setting& setting, const std::vector<int>& frames) {
  const fs::path folder = framesFolder(setting);
  std::map<int, fs::path> files;
  std::error_code ignored;
  for (const int number : frames) {
    files[number] = folder / run::framePath("frames", number, ".exr");
    if (fs::exists(files[number], ignored)) continue;
    checkStop();
    checkTime();
    WorkerProcess* process = worker(setting, {});
    if (process == nullptr)
      throw Error(ExitCode::FramesFailed, setting.text() + ": " + failures_[setting.key]);
    say(setting.text() + ", frame " + std::to_string(number), -1.0);
    process->render(number, folder);
    ++framesRendered_;
  }
  return files;
}

void Bench::setMetrics(const std::vector<std::string>& metrics) {
  flicker_ = std::find(metrics.begin(), metrics.end(), kFlicker) != metrics.end();
}

std::vector<int> Bench::missingErrors(const Setting& setting, const std::vector<int>& frames) {
  const std::map<int, FrameErrors>& known = errors(setting).frames;
  std::set<int> missing;
  for (const int number : frames) {
    const auto found = known.find(number);
    if (found == known.end()) missing.insert(number);
    if (flicker_ && number > 1 &&
        (found == known.end() || !found->second.metrics.contains(kFlicker)))
      missing.insert({number - 1, number});
  }
  return {missing.begin(), missing.end()};
}

/// Compares frames that were written, keeps the errors, and removes the frames.
void Bench::compare(const Setting& setting, const std::vector<int>& frames,
                    const std::map<int, FrameReport>& written) {
  report::RunData run;
  run.name = setting.point.method;
  run.folder = framesFolder(setting);
  for (const int number : frames)
    run.frames[number] = run.folder / run::framePath("frames", number, ".exr");
  report::RunData reference = referenceFrames(setting, frames);
  std::erase_if(reference.frames, [&](const auto& one) { return !run.frames.contains(one.first); });
  const report::RunComparison comparison = report::compareRuns(run, reference);
  if (!comparison.onlyInRun.empty()) failWithoutFrames(comparison.onlyInRun);
  const fs::path file = errorsFile(setting);
  PointErrors all = errors(setting);
  for (const int number : frames) {
    FrameErrors one = frameErrors(comparison, number);
    one.pixels = written.at(number).pixels;
    one.counters = written.at(number).counters;
    FrameErrors& known = all.frames[number];
    if (known.metrics.contains(kFlicker) && !one.metrics.contains(kFlicker)) {
      one.metrics[kFlicker] = known.metrics.at(kFlicker);
      one.flickerPixels = known.flickerPixels;
    }
    known = std::move(one);
  }
  checkStop();
  writeErrors(file, all);
  errors_[file.string()] = std::move(all);
  if (options_.keepFrames || setting.key == referenceKey(setting)) return;
  removeStudyFiles(run.folder, "frames/" + setting.key + "/");
}

void Bench::findErrors(const std::vector<Setting>& settings, const std::vector<int>& frames) {
  for (const Setting& setting : settings) {
    const std::vector<int> missing = missingErrors(setting, frames);
    if (missing.empty() || failures_.contains(setting.key)) continue;
    WorkerProcess* process = worker(setting, {});
    if (process == nullptr) continue;
    std::map<int, FrameReport> written;
    try {
      for (const int number : missing) {
        checkStop();
        checkTime();
        say("errors of " + setting.text(),
            static_cast<double>(written.size()) / static_cast<double>(missing.size()));
        written[number] = process->render(number, framesFolder(setting));
        ++framesRendered_;
      }
    } catch (const UsageError&) {
      throw;
    } catch (const Error& error) {
      failures_[setting.key] = error.what();
      log::error(setting.text() + ": " + error.what());
      continue;
    }
    compare(setting, missing, written);
  }
}

const Samples& Bench::measure(const std::vector<Setting>& settings, const std::vector<int>& frames,
                              bool withErrors) {
  const auto needsOthers = [&](const Setting& setting) {  // for flicker
    return std::ranges::any_of(missingErrors(setting, frames), [&](int number) {
      return std::ranges::find(frames, number) == frames.end();
    });
  };
  if (withErrors && std::ranges::any_of(settings, needsOthers)) {
    findErrors(settings, frames);
    withErrors = false;
  }
  std::vector<std::string> needed;
  for (const Setting& setting : settings) needed.push_back(setting.key);
  // The reference first: where a budget ends the rounds, there are errors, too
  for (const Setting& setting : settings)
    if (withErrors && !failures_.contains(setting.key) && !knowsErrors(setting, frames) &&
        std::ranges::find(needed, referenceKey(setting)) == needed.end())
      referenceFrames(setting, frames);
  Samples samples;
  samples.frames = frames;
  samples.repeats = options_.repeats;
  std::vector<Runner*> runners;
  std::vector<const Setting*> running;
  TurnOptions turns;
  std::vector<std::vector<int>> missing;
  for (const Setting& setting : settings) {
    if (failures_.contains(setting.key)) continue;
    WorkerProcess* process = worker(setting, needed);
    if (process == nullptr) continue;
    runners.push_back(process);
    running.push_back(&setting);
    samples.keys.push_back(setting.key);
    missing.push_back(withErrors ? missingErrors(setting, frames) : std::vector<int>{});
    turns.writeTo.push_back(missing.back().empty() ? fs::path() : framesFolder(setting));
  }
  turns.repeats = options_.repeats;
  turns.leastSeconds = options_.repeats >= kLeastRounds ? kLeastSeconds : 0.0;
  if (options_.repeats >= kLeastRounds) {
    turns.mostSeconds = kMostSeconds;
    turns.growth = [this](const Measurement& so) { return growthOf(so, time_); };
  }
  turns.first = options_.repeats > 0 ? options_.first : FirstFrames::Never;
  turns.seed = options_.seed;
  turns.stopRequested = options_.patience.stopRequested;
  turns.outOfTime = options_.outOfTime;
  turns.progress = [&](int done, int all) {
    inputs_.requireUnchanged();
    say("timing " + std::to_string(runners.size()) + " settings, interleaved, group " +
            std::to_string(samples_.size() + 1),
        static_cast<double>(done) / all);
  };
  samples.measurement = measureInTurns(runners, frames, turns);
  framesRendered_ += static_cast<int>(samples.measurement.turns.size()) +
                     static_cast<int>(frames.size() * runners.size());
  if (samples.measurement.stopped) throw StudyStopped();
  checkStop();
  for (std::size_t i = 0; i < running.size(); ++i) {
    const SettingResult& result = samples.measurement.settings[i];
    if (result.failure.empty()) continue;
    failures_[running[i]->key] = result.failure;
    log::error(running[i]->text() + ": " + result.failure);
  }
  int rounds = 0;
  for (const Turn& turn : samples.measurement.turns) rounds = std::max(rounds, turn.round);
  samples.repeats = std::min(samples.repeats, rounds);
  if (rounds > 0) keep(samples);
  samples_.push_back(std::move(samples));
  const std::vector<SettingResult>& results = samples_.back().measurement.settings;
  for (std::size_t i = 0; i < running.size(); ++i)
    if (results[i].failure.empty() && !missing[i].empty() &&
        results[i].written.size() == frames.size())  // the round that warms up was not cut short
      compare(*running[i], missing[i], results[i].written);
  if (rounds == 0) checkTime();
  return samples_.back();
}

const Samples* Bench::timesBeside(const std::string& key, const std::string& base,
                                  const std::vector<int>& frames) const {
  const Samples* most = nullptr;
  for (const Samples& samples : samples_)
    if (samples.serve(frames, options_) && samples.find(key) && samples.find(base) &&
        (most == nullptr || samples.repeats > most->repeats))
      most = &samples;
  return most;
}

void Bench::measureBeside(const Setting& base, const std::vector<Setting>& settings,
                          const std::vector<int>& frames) {
  std::vector<Setting> waiting;
  for (const Setting& setting : settings)
    if (setting.key != base.key && !knowsTimes(setting.key, base.key, frames))
      waiting.push_back(setting);
  if (waiting.empty() && !knowsTimes(base.key, base.key, frames)) measure({base}, frames, true);
  for (std::size_t next = 0; next < waiting.size();) {
    std::vector<Setting> batch{base};
    while (batch.size() < capacity() && next < waiting.size()) batch.push_back(waiting[next++]);
    measure(batch, frames, true);
  }
}

void Bench::keep(const Samples& samples) {
  const fs::path folder = options_.folder / "samples";
  fs::create_directories(folder);
  int number = 1;
  std::error_code ignored;
  while (fs::exists(folder / (std::to_string(number) + ".csv"), ignored)) ++number;
  writeFileAtomically(folder / (std::to_string(number) + ".csv"),
                      std::string_view(samplesCsv(samples)));
}

void Bench::writeSamples() const {
  std::string text;
  for (const Samples& one : samples_) text += samplesCsv(one, text.empty());
  writeFileAtomically(options_.folder / "samples.csv", std::string_view(text));
}

void Bench::open() {
  for (const char* folder : {"", "errors", "samples"})  // of processes that were killed
    sweepTemporaryFiles(options_.folder / folder);
  std::error_code ignored;
  for (int number = 1;; ++number) {
    const fs::path file = options_.folder / "samples" / (std::to_string(number) + ".csv");
    if (!fs::exists(file, ignored)) return;
    samples_.push_back(parseSamples(readTextFile(file, std::size_t{1} << 31), file.string()));
  }
}

void Bench::clear() {
  workers_.clear();
  if (options_.keepFrames) return;
  removeStudyFiles(options_.folder / "logs", "logs/");
}

void removeStudy(const fs::path& folder) {
  for (const char* name : {"errors", "frames", "logs", "samples"})
    removeStudyFiles(folder / name, std::string(name) + "/");
  std::error_code ignored;
  for (const char* name :
       {"samples.csv", "points.csv", "sweep.json", "table.md", "table.tex", "report.html",
        "tradeoff.svg", "tuned.json", "trials.jsonl", "tune.json"})
    fs::remove(folder / name, ignored);
}

}  // namespace catoptric::study
