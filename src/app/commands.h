// The subcommands: each adds itself and its options to the program, and runs when it was chosen.
#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "core/error.h"

namespace catoptric::app {

/// What a chosen subcommand does; its result is the exit code.
using Action = std::function<ExitCode()>;

/// Options of every subcommand.
struct CommonOptions {
  bool json = false;
  bool quiet = false;
  int verbose = 0;
  std::string shaderFolder;
};

/// Options of what renders or plans.
struct RunOptions {
  std::string input;
  std::string out;
  std::string frames;
  std::vector<std::string> methods;
  std::vector<std::string> settings;
  std::string device;
  std::string threads;
  std::string seed;
};

void addRender(CLI::App& program, CommonOptions& common, Action& action);
void addPlan(CLI::App& program, CommonOptions& common, Action& action);
void addInfo(CLI::App& program, CommonOptions& common, Action& action);
void addList(CLI::App& program, CommonOptions& common, Action& action);
void addDoctor(CLI::App& program, CommonOptions& common, Action& action);
void addMerge(CLI::App& program, CommonOptions& common, Action& action);
void addCompare(CLI::App& program, CommonOptions& common, Action& action);
void addLayers(CLI::App& program, CommonOptions& common, Action& action);

/// Adds --json, -q, -v, --shader-dir.
void addCommon(CLI::App& command, CommonOptions& common);
/// Adds CONFIG|SCENE, --frames, --method, --set, --device, --threads, --seed.
void addRunOptions(CLI::App& command, RunOptions& options);

/// Of options whose empty value would mean something else.
inline CLI::Validator notEmpty() {
  return {[](const std::string& text) { return text.empty() ? "must not be empty" : ""; }, ""};
}

/// Writes data to stdout, and checks that it arrived. Throws OutputError.
void printData(const std::string& text);

}  // namespace catoptric::app
