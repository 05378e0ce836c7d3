// Where settings are measured: times of several in turns, errors of each against its reference,
// both kept in a folder so that nothing is done twice.
#pragma once

#include <functional>
#include <list>
#include <memory>
#include <optional>
#include <set>

#include "run/folder/machine.h"
#include "run/folder/run_folder.h"
#include "study/axes.h"
#include "study/engine.h"
#include "study/frame_errors.h"
#include "study/process.h"

namespace catoptric::study {

/// What a study knows of the command line that it was started by.
struct Inputs {
  /// The run config with these settings, and one method of it. Throws UsageError.
  std::function<run::RunConfig(const Settings&, const std::string& method)> readRun;
  /// The same for a worker's command line.
  std::function<std::vector<std::string>(const Settings&, const std::string& method)> arguments;
};

struct BenchOptions {
  std::filesystem::path folder;
  int repeats = 8;  ///< of short frames up to kMostLonger times as many, if enough to tell
  int workers = 8;  ///< resident at once, at most; fewer where memory is short
  std::uint64_t seed = 0;
  std::string processor = run::processorName();  ///< that times are taken on
  bool keepFrames = false;
  std::function<bool()> stopRequested;
  std::function<void(const std::string& what, double share)> progress;
};

/// A point, checked and ready.
struct Setting {
  Point point;
  run::RunConfig run;
  std::string key;  ///< fingerprint of what its frames depend on, and of the program
  std::string text() const {
    return point.method + (point.settings.empty() ? "" : " ") + settingsText(point.settings);
  }
};

/// Samples of settings that were measured in turns.
struct Samples {
  std::vector<std::string> keys;
  std::vector<int> frames;
  Measurement measurement;
  int repeats = 0;

  /// Index of a setting; none: it is not among them, or was not measured to the end.
  std::optional<std::size_t> find(const std::string& key) const;
};

/// Thrown when the study was asked to stop.
struct StudyStopped : std::exception {
  const char* what() const noexcept override { return "the study was asked to stop"; }
};

class Bench {
 public:
  Bench(Inputs inputs, BenchOptions options);

  /// Throws UsageError for what the config does not allow, SceneError.
  Setting prepare(const Point& point);
  /// Frames that the setting's run asks for.
  const std::vector<int>& frames(const Setting& setting);
  /// Names of the scene's reflective objects by their ids.
  const std::map<int, std::string>& reflectors(const Setting& setting);

  /// A method of the config (or the registry), or a folder with frames.
  void setReference(const std::string& methodOrFolder) { reference_ = methodOrFolder; }
  const std::string& reference() const { return reference_; }
  /// Throws UsageError for a reference that these settings cannot have.
  void checkReference(const std::vector<Setting>& settings) {
    for (const Setting& setting : settings) referenceKey(setting);
  }

  /// Errors of these frames; what is known already is not rendered again. Failures by key.
  void findErrors(const std::vector<Setting>& settings, const std::vector<int>& frames);
  const PointErrors& errors(const Setting& setting);
  /// Times of all settings in turns, and their errors where `withErrors`. Kept in the folder.
  const Samples& measure(const std::vector<Setting>& settings, const std::vector<int>& frames,
                         bool withErrors);
  /// All that was measured, also by earlier processes where the folder was resumed.
  const std::list<Samples>& samples() const { return samples_; }
  /// Writes it into the folder's samples.csv.
  void writeSamples() const;

  /// EXR files of frames, which are rendered where they are not there yet. Throws Error.
  std::map<int, std::filesystem::path> frameFiles(const Setting& setting,
                                                  const std::vector<int>& frames);

  /// Why settings could not be rendered, by key.
  const std::map<std::string, std::string>& failures() const { return failures_; }
  const std::set<std::string>& renderers() const { return renderers_; }
  int framesRendered() const { return framesRendered_; }
  /// How many settings can be resident at once.
  std::size_t capacity() const;

  const BenchOptions& options() const { return options_; }
  /// Reads what earlier processes measured.
  void readSamples();
  /// Removes frames that are not to be kept.
  void clear();

 private:
  struct SceneFacts {
    std::string fingerprint;
    std::vector<int> frames;
    std::map<int, std::string> reflectors;
  };
  const SceneFacts& sceneFactsOf(const run::RunConfig& run);
  Setting referenceOf(const Setting& setting);
  std::string referenceKey(const Setting& setting);
  std::filesystem::path errorsFile(const Setting& setting);
  std::filesystem::path framesFolder(const Setting& setting) const;
  report::RunData referenceFrames(const Setting& setting, const std::vector<int>& frames);
  WorkerProcess* worker(const Setting& setting, const std::vector<std::string>& needed);
  void compare(const Setting& setting, const std::vector<int>& frames,
               const std::map<int, FrameReport>& written);
  void keep(const Samples& samples);
  void checkStop() const;
  void say(const std::string& what, double share) const;

  Inputs inputs_;
  BenchOptions options_;
  std::string reference_;
  std::map<std::string, SceneFacts> scenes_;
  std::map<std::string, std::string> programs_;  ///< fingerprints by path
  std::list<std::pair<std::string, std::unique_ptr<WorkerProcess>>> workers_;  ///< last used first
  std::uint64_t workerMemory_ = 0;
  std::map<std::string, PointErrors> errors_;  ///< by file
  std::list<Samples> samples_;
  std::map<std::string, std::string> failures_;
  std::set<std::string> renderers_;
  int framesRendered_ = 0;
};

/// The text of a file of samples: "round,turn,point,frame,seconds,cpu_seconds,steps".
std::string samplesCsv(const Samples& samples, bool header = true);
Samples parseSamples(const std::string& text, const std::string& name);

}  // namespace catoptric::study
