#include "nightly/lab.h"

#include <cerrno>
#include <cstring>

#include "config/json.h"
#include "core/error.h"
#include "core/hash.h"
#include "core/input_files.h"
#include "core/log.h"
#include "core/text.h"
#include "nightly/bench_print.h"
#include "run/folder/records.h"
#include "run/stage/stage.h"
#include "scene/camera.h"

namespace catoptric::nightly {
namespace {

namespace fs = std::filesystem;

/// Settings of a scene that are of this method; the others are of all methods, or of another.
study::Settings settingsOf(const NightScene& scene, const std::string& method) {
  study::Settings own;
  for (const auto& [name, value] : scene.settings)
    if (name.starts_with("methods." + method + ".")) own.emplace_back(name, value);
  return own;
}

/// A full or read-only disk is no fault of the program that is judged.
void requireRoom(const std::string& failure) {
  for (const int cause : {ENOSPC, EDQUOT, EROFS})
    if (failure.find(std::strerror(cause)) != std::string::npos) throw OutputError(failure);
}

class ProcessLab : public Lab {
 public:
  explicit ProcessLab(LabOptions options) : options_(std::move(options)) {}
  ~ProcessLab() override {
    workers_.clear();
    std::error_code ignored;
    fs::remove_all(options_.work, ignored);
  }

  std::vector<std::string> methods(const NightScene& scene) override {
    std::vector<std::string> names;
    for (const run::MethodConfig& method : options_.inputs(scene, "").readRun({}, "").methods)
      names.push_back(method.name);
    return names;
  }

  BenchFacts bench(const NightCase& one) override {
    try {
      return benchOf(one);
    } catch (const Error&) {
      checkStop();  // a file that somebody is writing is no fault of the case
      throw;
    }
  }

  Turns measure(const NightCase& one, const std::vector<Program>& programs, int rounds, bool fresh,
                const fs::path& writeTo) override {
    if (fresh || one.name != workersOf_) workers_.clear();
    workersOf_ = one.name;
    std::error_code ignored;
    fs::remove_all(options_.work / "frames", ignored);
    Turns turns;
    std::vector<study::Runner*> runners;
    std::vector<std::string> roles;
    study::TurnOptions how;
    how.repeats = rounds;
    how.seed = ++measurements_;
    how.stopRequested = options_.patience.stopRequested;
    how.progress = [&](int, int) { inputs_.requireUnchanged(); };
    for (const Program& program : programs) {
      checkStop();
      try {
        study::WorkerProcess& process = worker(program, argumentsOf(one));
        checkStop();
        process.requireInputs(factsOf(one).inputs);
        runners.push_back(&process);
      } catch (const InputChanged&) {
        throw;
      } catch (const Error& error) {
        checkStop();
        turns.failures[program.role] = error.what();
        continue;
      }
      roles.push_back(program.role);
      if (writeTo.empty()) continue;
      turns.frames[program.role] =
          program.role == role::kTonight ? writeTo : options_.work / "frames" / program.role;
      how.writeTo.push_back(turns.frames[program.role]);
    }
    for (const auto& [name, failure] : turns.failures) requireRoom(failure);
    const study::Measurement measured = study::measureInTurns(runners, factsOf(one).frames, how);
    if (measured.stopped) throw study::StudyStopped();
    checkStop();
    for (const study::SettingResult& result : measured.settings) requireRoom(result.failure);
    for (std::size_t i = 0; i < roles.size(); ++i) {
      turns.memory[roles[i]] = workers_.at(roles[i])->memoryBytes();
      if (!measured.settings[i].failure.empty())
        turns.failures[roles[i]] = measured.settings[i].failure;
      else
        turns.times[roles[i]] = measured.times(i, {options_.clock});
      for (const std::string& step : measured.steps(i))
        turns.steps[roles[i]][step] = measured.stepTimes(i, step);
      if (roles[i] == role::kTonight && !writeTo.empty())
        turns.written = measured.settings[i].written;
    }
    return turns;
  }

  std::map<std::string, StepTimes> starts(const NightCase& one,
                                          const std::vector<Program>& programs,
                                          int rounds) override {
    const std::vector<std::string> arguments = argumentsOf(one);
    std::map<std::string, StepTimes> times;
    try {
      for (std::size_t i = 0; i < static_cast<std::size_t>(rounds) * programs.size(); ++i) {
        checkStop();
        // The first one of a round is the second one of the next
        const Program& program = programs[(i + i / programs.size()) % programs.size()];
        const study::WorkerProcess process(program.file, arguments,
                                           options_.work / "logs" / (program.role + ".txt"),
                                           options_.patience);
        for (const auto& [step, seconds] : process.startup())
          times[program.role][step].push_back({seconds});
      }
    } catch (const InputChanged&) {
      throw;
    } catch (const Error& error) {
      log::warning(one.name + ": " + error.what());
      return {};
    }
    return times;
  }

  void truth(const NightCase& one, const std::vector<int>& frames,
             const fs::path& folder) override {
    NightCase truth = one;
    truth.method = one.scene.against;
    std::unique_ptr<study::WorkerProcess> process;
    for (const int number : frames) {
      std::error_code ignored;
      if (fs::exists(folder / run::framePath("frames", number, ".exr"), ignored)) continue;
      checkStop();
      if (!process) {
        process = std::make_unique<study::WorkerProcess>(options_.program, argumentsOf(truth),
                                                         options_.work / "logs" / "truth.txt",
                                                         options_.patience);
        checkStop();
        process->requireInputs(factsOf(truth).inputs);
      }
      process->render(number, folder);
    }
  }

  void leave() override { workers_.clear(); }

 private:
  struct SceneFacts {
    std::vector<int> frames;
    std::map<int, std::string> objects;
    std::string inputs;  ///< InputFiles::print()
  };

  BenchFacts benchOf(const NightCase& one) {
    const run::RunConfig run = runOf(one);
    BenchFacts facts;
    const SceneFacts& scene = sceneFactsOf(run);
    facts.frames = scene.frames;
    facts.description = describeCase(one) + "threads " + std::to_string(run.threads) + "\nframes " +
                        scene::formatFrames(scene.frames) + "\nscene " + filesPrint(run.scene) +
                        (run.path.empty() ? "" : "\npath " + filesPrint(run.path)) + "\n";
    if (run.environment && run.environment->type == scene::EnvironmentType::File)
      facts.description += "environment_file " + filesPrint(run.environment->file) + "\n";
    Fingerprint print;
    print.add(facts.description);
    facts.print = print.text();
    for (const auto& [id, name] : scene.objects)
      facts.description += "object " + std::to_string(id) + " " + name + "\n";
    facts.command = "catoptric render";
    for (const std::string& word : argumentsOf(one))
      if (word != "-q") facts.command += " " + shellWord(word);
    return facts;
  }

  /// Throws StudyStopped, and InputChanged.
  void checkStop() {
    if (options_.patience.stopRequested && options_.patience.stopRequested())
      throw study::StudyStopped();
    inputs_.requireUnchanged();
  }

  const SceneFacts& factsOf(const NightCase& one) { return sceneFactsOf(runOf(one)); }

  run::RunConfig runOf(const NightCase& one) const {
    return options_.inputs(one.scene, one.frames)
        .readRun(settingsOf(one.scene, one.method), one.method);
  }

  /// Of the command line of a worker.
  std::vector<std::string> argumentsOf(const NightCase& one) const {
    return options_.inputs(one.scene, one.frames)
        .arguments(settingsOf(one.scene, one.method), one.method);
  }

  study::WorkerProcess& worker(const Program& program, const std::vector<std::string>& arguments) {
    std::unique_ptr<study::WorkerProcess>& process = workers_[program.role];
    try {
      if (!process)
        process = std::make_unique<study::WorkerProcess>(
            program.file, arguments, options_.work / "logs" / (program.role + ".txt"),
            options_.patience);
    } catch (...) {
      workers_.erase(program.role);
      throw;
    }
    return *process;
  }

  /// Scene and path of a run; the last ones are kept.
  const SceneFacts& sceneFactsOf(const run::RunConfig& run) {
    std::string key = run.file.string() + "\n" + run.scene.string() + "\n" + run.path.string() +
                      "\n" + run.camera + "\n" + run.frames + "\n";
    if (run.environment) key += config::parseText(run.effective, "run").get("environment").dump();
    const auto known = scenes_.find(key);
    if (known != scenes_.end()) return known->second;
    const run::Stage stage(run);
    inputs_.add(stage.inputs());
    SceneFacts facts;
    facts.inputs = stage.inputs().print();
    facts.frames = stage.frames();
    for (std::size_t i = 0; i < stage.scene().objects.size(); ++i)
      if (stage.scene().objects[i].reflector > 0)
        facts.objects[static_cast<int>(i + 1)] = stage.scene().objects[i].name;
    return scenes_.emplace(key, std::move(facts)).first->second;
  }

  LabOptions options_;
  InputFiles inputs_;
  std::map<std::string, SceneFacts> scenes_;
  std::map<std::string, std::unique_ptr<study::WorkerProcess>> workers_;  ///< by role
  std::string workersOf_;
  std::uint64_t measurements_ = 0;
};

}  // namespace

std::unique_ptr<Lab> makeLab(LabOptions options) {
  return std::make_unique<ProcessLab>(std::move(options));
}

}  // namespace catoptric::nightly
