// A whole run: every method of a run config, each in a run folder of its own.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "run/folder/plan.h"
#include "run/sequence/sequence.h"
#include "run/stage/stage.h"

namespace catoptric::run {

struct SessionOptions {
  std::filesystem::path out;
  Existing existing = Existing::Error;
  Chunk chunk;
  bool keepGoing = false;
  double waitSeconds = 0.0;  ///< for another process that writes a folder
  std::function<bool()> stopRequested;
  /// Name of the method, its progress.
  std::function<void(const std::string&, const Progress&)> progress;
  /// A long step of start-up ("bake"), the share of it that is done; called by several threads.
  std::function<void(const std::string&, double)> startupProgress;
};

struct MethodResult {
  std::string name;
  std::filesystem::path folder;
  SequenceResult frames;
};

/// The methods of the run, made from the registry, in the config's order.
std::vector<std::unique_ptr<methods::Method>> makeMethods(
    const Stage& stage, const std::vector<methods::MethodEntry>& registry);

/// Where a method's frames go: `out` itself for the only method of a run, else a folder in it.
std::filesystem::path methodFolder(const RunConfig& run, const MethodConfig& method,
                                   const std::filesystem::path& out);

/// The frames of one method with their fingerprints.
std::vector<FrameTask> makeTasks(const Stage& stage, const MethodConfig& config,
                                 const methods::Method& method);

struct MethodForecast {
  std::string name;
  std::filesystem::path folder;
  SequenceForecast frames;
};

/// What renderAll() would do; changes nothing. Throws what it would throw about the folders.
std::vector<MethodForecast> forecastAll(const Stage& stage,
                                        const std::vector<methods::MethodEntry>& registry,
                                        const SessionOptions& options);

/// Renders all methods, one after the other, those after one that failed frames too, until asked to
/// stop. Folders are checked for all methods before any is rendered.
std::vector<MethodResult> renderAll(Stage& stage, const std::vector<methods::MethodEntry>& registry,
                                    const SessionOptions& options);

}  // namespace catoptric::run
