// A whole run: renders every method of a run config, each to its own run folder.
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
  double waitSeconds = 0.0;  ///< for another process that writes to a folder
  std::function<bool()> stopRequested;
  /// Called with the name of a method and its progress.
  std::function<void(const std::string&, const Progress&)> progress;
  /// Called with the name of a long start-up step ("bake") and the fraction of it that is done.
  /// Several threads may call it.
  std::function<void(const std::string&, double)> startupProgress;
};

struct MethodResult {
  std::string name;
  std::filesystem::path folder;
  SequenceResult frames;
};

/// Makes the methods of the run from the registry, in the config's order.
std::vector<std::unique_ptr<methods::Method>> makeMethods(
    const Stage& stage, const std::vector<methods::MethodEntry>& registry);

/// The folder of a method's frames: `out` itself if the run has one method, otherwise a folder in
/// `out`.
std::filesystem::path methodFolder(const RunConfig& run, const MethodConfig& method,
                                   const std::filesystem::path& out);

/// The tasks of rendering `frames` of the path with one method, with the frames' fingerprints.
std::vector<FrameTask> makeTasks(const Stage& stage, const MethodConfig& config,
                                 const methods::Method& method, const std::vector<int>& frames);

struct MethodForecast {
  std::string name;
  std::filesystem::path folder;
  SequenceForecast frames;
};

/// What renderAll() would do. Changes nothing. Throws what renderAll() would throw about the
/// folders.
std::vector<MethodForecast> forecastAll(const Stage& stage,
                                        const std::vector<methods::MethodEntry>& registry,
                                        const SessionOptions& options);

/// Renders all methods, one after the other, until asked to stop. If frames of a method fail, the
/// next methods are rendered nevertheless. The folders of all methods are checked before any method
/// is rendered.
std::vector<MethodResult> renderAll(Stage& stage, const std::vector<methods::MethodEntry>& registry,
                                    const SessionOptions& options);

}  // namespace catoptric::run
