// The bench measures settings: the times of several settings, interleaved, and the errors of each
// against a reference. A folder stores both, so that nothing is measured twice.
#pragma once

#include <functional>
#include <list>
#include <memory>
#include <optional>
#include <set>

#include "core/input_files.h"
#include "run/folder/machine.h"
#include "run/folder/run_folder.h"
#include "study/axes.h"
#include "study/engine.h"
#include "study/frame_errors.h"
#include "study/process.h"

namespace catoptric::study {

/// Functions that apply a study's settings to the config of the command line that started the
/// study.
struct Inputs {
  /// Makes the run config with these settings and one of its methods. Throws UsageError.
  std::function<run::RunConfig(const Settings&, const std::string& method)> readRun;
  /// Makes the command line of a worker in the same way.
  std::function<std::vector<std::string>(const Settings&, const std::string& method)> arguments;
};

struct BenchOptions {
  std::filesystem::path folder;
  int repeats =
      8;  ///< rounds; for short frames up to kMostLonger times as many, until the ratios are clear
  int workers = 8;  ///< maximum number of resident workers; fewer if memory is short
  std::uint64_t seed = 0;
  std::string processor = run::processorName();  ///< the processor on which times are measured
  std::string shaders = {};  ///< a fingerprint of shaders that replace the programs' own
  bool keepFrames = false;
  FirstFrames first = FirstFrames::Once;
  Patience patience;
  std::function<bool()> outOfTime;  ///< then nothing begins that takes time: BudgetSpent is thrown
  std::function<void(const std::string& what, double share)> progress;
};

/// Thrown if the time for a study is over.
struct BudgetSpent : std::exception {
  const char* what() const noexcept override { return "the time for the study is over"; }
};

/// A point that is checked and ready to be measured.
struct Setting {
  Point point;
  run::RunConfig run;
  std::string key;  ///< fingerprint of the program and of everything that its frames depend on
  std::string text() const {
    return point.method + (point.settings.empty() ? "" : " ") + settingsText(point.settings);
  }
};

/// The times of settings that were measured interleaved.
struct Samples {
  std::vector<std::string> keys;
  std::vector<int> frames;
  Measurement measurement;
  int repeats = 0;

  /// The index of a setting; nullopt if it is not among them or was not measured completely.
  std::optional<std::size_t> find(const std::string& key) const;
  /// Whether these are times of these frames as the options ask for, apart from `repeats`.
  bool serve(const std::vector<int>& frames, const BenchOptions& options) const;
};

class Bench {
 public:
  Bench(Inputs inputs, BenchOptions options)
      : study_(std::move(inputs)), options_(std::move(options)) {}

  /// Throws UsageError for settings that the config does not allow, and SceneError.
  Setting prepare(const Point& point);
  /// The frames that the setting's run requests.
  const std::vector<int>& frames(const Setting& setting);
  /// The number of frames of the setting's camera path.
  int pathFrames(const Setting& setting);
  /// The names of the scene's reflective objects, by id.
  const std::map<int, std::string>& reflectors(const Setting& setting);

  /// Sets the reference: a method of the config (or the registry), or a folder with frames.
  void setReference(const std::string& methodOrFolder);
  const std::string& reference() const { return reference_; }
  /// Adds files that made the configs or scenes of settings. A change of an input file ends the
  /// study: all that measures throws InputChanged then, and stores nothing more.
  void watch(const InputFiles& files) { inputs_.add(files); }
  /// Declares the error measures that will be asked for. With kFlicker among them, the errors of a
  /// frame also need the frame before it, which is rendered too.
  void setMetrics(const std::vector<std::string>& metrics);
  /// Sets the time whose ratios further rounds make clear.
  void setTime(const TimeKind& time) { time_ = time; }
  bool knowsErrors(const Setting& setting, const std::vector<int>& frames) {
    return missingErrors(setting, frames).empty();
  }
  /// Throws UsageError if the reference is not possible with these settings, or lacks frames.
  void checkReference(const std::vector<Setting>& settings);

  /// Computes the errors of these frames. Known errors are not computed again. Failures are stored
  /// in failures().
  void findErrors(const std::vector<Setting>& settings, const std::vector<int>& frames);
  const PointErrors& errors(const Setting& setting);
  /// Measures the times of all settings, interleaved, and their errors if `withErrors`. Stores both
  /// in the folder.
  const Samples& measure(const std::vector<Setting>& settings, const std::vector<int>& frames,
                         bool withErrors);
  /// The times of a setting that were measured beside another one, of the most rounds; null: none.
  const Samples* timesBeside(const std::string& key, const std::string& base,
                             const std::vector<int>& frames) const;
  /// Whether these times need not be measured again.
  bool knowsTimes(const std::string& key, const std::string& base,
                  const std::vector<int>& frames) const {
    const Samples* samples = timesBeside(key, base, frames);
    return samples != nullptr && samples->repeats >= options_.repeats;
  }
  /// Measures times and errors that are not known, in groups that all contain `base`, so that all
  /// can be compared.
  void measureBeside(const Setting& base, const std::vector<Setting>& settings,
                     const std::vector<int>& frames);
  /// All measured times, also those of earlier processes if the folder was resumed.
  const std::list<Samples>& samples() const { return samples_; }
  /// Writes all measured times to samples.csv in the folder.
  void writeSamples() const;

  /// The EXR files of frames; renders those that do not exist yet. Throws Error.
  std::map<int, std::filesystem::path> frameFiles(const Setting& setting,
                                                  const std::vector<int>& frames);

  /// Why settings could not be rendered, by key.
  const std::map<std::string, std::string>& failures() const { return failures_; }
  const std::set<std::string>& renderers() const { return renderers_; }
  int framesRendered() const { return framesRendered_; }
  /// The number of settings that can be resident at the same time.
  std::size_t capacity() const;

  const BenchOptions& options() const { return options_; }
  /// Removes the temporary files of killed processes from the folder, and reads the times that
  /// earlier processes have measured.
  void open();
  /// Removes frames that need not be kept.
  void clear();

 private:
  struct SceneFacts {
    std::string fingerprint;
    std::string inputs;  ///< InputFiles::print()
    std::vector<int> frames;
    int pathFrames = 1;
    std::map<int, std::string> reflectors;
  };
  const SceneFacts& sceneFactsOf(const run::RunConfig& run);
  Setting referenceOf(const Setting& setting);
  std::string referenceKey(const Setting& setting);
  std::filesystem::path errorsFile(const Setting& setting);
  std::filesystem::path framesFolder(const Setting& setting) const;
  [[noreturn]] void failWithoutFrames(const std::vector<int>& frames) const;
  report::RunData referenceFrames(const Setting& setting, const std::vector<int>& frames);
  /// The frames to render for the errors of `frames` that are not known.
  std::vector<int> missingErrors(const Setting& setting, const std::vector<int>& frames);
  WorkerProcess* worker(const Setting& setting, const std::vector<std::string>& needed);
  void compare(const Setting& setting, const std::vector<int>& frames,
               const std::map<int, FrameReport>& written);
  void keep(const Samples& samples);
  /// Throws StudyStopped, and InputChanged.
  void checkStop();
  void checkTime() const;
  void say(const std::string& what, double share) const;

  Inputs study_;
  BenchOptions options_;
  std::string reference_;
  bool flicker_ = false;  ///< see setMetrics()
  TimeKind time_;
  std::map<std::string, SceneFacts> scenes_;
  std::map<std::string, std::string> programs_;  ///< fingerprints, by path
  InputFiles inputs_;  ///< all files that settings have read, and the programs
  std::optional<report::RunData> referenceFolder_;  ///< if the reference is a folder with frames
  std::string referencePrint_;                      ///< of that folder: see folderPrint()
  std::list<std::pair<std::string, std::unique_ptr<WorkerProcess>>>
      workers_;  ///< most recently used first
  std::uint64_t workerMemory_ = 0;
  std::map<std::string, PointErrors> errors_;  ///< indexed by file
  std::list<Samples> samples_;
  std::map<std::string, std::string> failures_;
  std::set<std::string> renderers_;
  int framesRendered_ = 0;
};

/// Removes what a study wrote in its folder, apart from the mark that it is a study's. Throws
/// OutputError.
void removeStudy(const std::filesystem::path& folder);

/// The text of a file of times: "round,turn,point,frame,seconds,cpu_seconds,steps,memory_bytes".
/// Frame 0 is a first frame, with all that is built before it. The memory is the most that the
/// process has had so far.
std::string samplesCsv(const Samples& samples, bool header = true);
Samples parseSamples(const std::string& text, const std::string& name);

}  // namespace catoptric::study
