#include "run/sequence/session.h"

#include <algorithm>

#include "config/json_text.h"
#include "core/error.h"
#include "core/hash.h"
#include "core/text.h"
#include "methods/contract/keeps.h"
#include "run/folder/machine.h"
#include "run/stage/encoder.h"
#include "run/stage/method_source.h"
#include "run/stage/mixed_method.h"
#include "run/stage/steps.h"

namespace catoptric::run {
namespace {

namespace fs = std::filesystem;

std::string fingerprintText(const std::string& text) {
  Fingerprint fingerprint;
  fingerprint.add(text);
  return fingerprint.text();
}

/// Names of the reflective objects by the ids of the layer id.object.
std::string reflectorsJson(const scene::Scene& scene) {
  std::vector<std::string> texts;
  for (std::size_t i = 0; i < scene.objects.size(); ++i)
    if (scene.objects[i].reflector > 0)
      texts.push_back(config::JsonText()
                          .add("id", static_cast<int>(i + 1))
                          .add("name", scene.objects[i].name)
                          .object());
  return "[" + joined(texts, ",") + "]";
}

/// One method goes into the folder itself, several into a folder each: they must not be mixed.
void requireOneLayout(const RunConfig& run, const fs::path& out) {
  std::error_code ignored;
  if (run.methods.size() > 1) {
    std::vector<std::string> names;
    for (const MethodConfig& method : run.methods) names.push_back(method.name);
    checkFolderOfRuns(out, names);
    return;
  }
  if (fs::exists(out / "frames.jsonl", ignored)) return;
  std::vector<std::string> runs;
  for (const auto& entry : fs::directory_iterator(out, ignored))
    if (fs::exists(entry.path() / "frames.jsonl", ignored)) runs.push_back(entry.path().string());
  std::sort(runs.begin(), runs.end());
  if (!runs.empty())
    throw UsageError(out.string() + ": has the runs of several methods, a folder each (" +
                     joined(runs, ", ") + "); for one of these methods use --out " +
                     (out / run.methods.front().name).string());
}

}  // namespace

std::vector<std::unique_ptr<methods::Method>> makeMethods(
    const Stage& stage, const std::vector<methods::MethodEntry>& registry) {
  std::vector<std::unique_ptr<methods::Method>> made;
  for (const MethodConfig& method : stage.run().methods)
    made.push_back(makeMethod(method, stage.scene(), stage.run().image, registry));
  return made;
}

std::filesystem::path methodFolder(const RunConfig& run, const MethodConfig& method,
                                   const std::filesystem::path& out) {
  return run.methods.size() == 1 ? out : out / method.name;
}

std::vector<FrameTask> makeTasks(const Stage& stage, const MethodConfig& config,
                                 const methods::Method& method, const std::vector<int>& frames) {
  FrameFingerprints common;
  common.config = fingerprintText(stage.run().pixelSettings(config));
  Fingerprint scenePrint;
  scenePrint.addValue(stage.scene().fingerprint);
  common.scene = scenePrint.text();
  common.build = buildFingerprint();

  return makeTasks(stage.path(), frames, method, common);
}

std::vector<MethodForecast> forecastAll(const Stage& stage,
                                        const std::vector<methods::MethodEntry>& registry,
                                        const SessionOptions& options) {
  const RunConfig& run = stage.run();
  const std::vector<std::unique_ptr<methods::Method>> made = makeMethods(stage, registry);
  requireOneLayout(run, options.out);
  SequenceOptions sequence;
  sequence.existing = options.existing;
  sequence.chunk = options.chunk;
  std::vector<MethodForecast> forecasts;
  for (std::size_t i = 0; i < made.size(); ++i) {
    const MethodConfig& method = run.methods[i];
    const fs::path folder = methodFolder(run, method, options.out);
    forecasts.push_back(
        {method.name, folder,
         forecastSequence(makeTasks(stage, method, *made[i], stage.frames()), folder, sequence)});
  }
  return forecasts;
}

std::vector<MethodResult> renderAll(Stage& stage, const std::vector<methods::MethodEntry>& registry,
                                    const SessionOptions& options) {
  const RunConfig& run = stage.run();
  std::vector<std::unique_ptr<methods::Method>> made = makeMethods(stage, registry);
  Plan plan = makePlan(run, stage.scene(), stage.environment(), stage.frames().size(), made);
  planWarmUps(plan, stage.path(), stage.frames(), made);

  requireOneLayout(run, options.out);
  // A folder that is in the way should be noticed now, not after hours of other methods.
  if (options.existing == Existing::Error)
    for (const MethodConfig& method : run.methods)
      RunFolder(methodFolder(run, method, options.out), options.existing).discard();

  stage.setStopRequested(options.stopRequested);
  stage.setStartupProgress(options.startupProgress);
  std::vector<MethodResult> results;
  for (std::size_t i = 0; i < made.size(); ++i) {
    const MethodConfig& method = run.methods[i];
    SequenceOptions sequence;
    sequence.existing = options.existing;
    sequence.chunk = options.chunk;
    sequence.keepGoing = options.keepGoing;
    sequence.waitSeconds = options.waitSeconds;
    sequence.stopRequested = options.stopRequested;
    if (options.progress)
      sequence.progress = [&](const Progress& progress) {
        options.progress(method.name, progress);
      };
    sequence.encode = makeEncoder(run, method, stage.scene().origin);
    config::JsonText kinds;
    for (const auto& [step, kind] : stepKinds()) kinds.add(step, kind);
    config::JsonText text;
    text.add("name", method.name);
    method.addSettings(text);
    sequence.summary = {{"config", run.effective},
                        {"method", text.object()},
                        {"machine", machineJson()},
                        {"step_kinds", kinds.object()},
                        {"keeps", config::jsonString(methods::keepsOf(*made[i]))},
                        {"path_frames", std::to_string(stage.path().count())},
                        {"reflectors", reflectorsJson(stage.scene())},
                        {"plan", planJson(plan)}};

    MethodSource source(stage, *made[i], plan.methods[i].needs);
    MethodResult result;
    result.name = method.name;
    result.folder = methodFolder(run, method, options.out);
    result.frames = runSequence(source, makeTasks(stage, method, *made[i], stage.frames()),
                                result.folder, sequence);
    const bool stopped = result.frames.stopped;
    results.push_back(std::move(result));
    // The method's GL objects go before those of the next one are made.
    made[i].reset();
    if (stopped) break;
  }
  return results;
}

}  // namespace catoptric::run
