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
  std::string environment;
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
void addSubmit(CLI::App& program, CommonOptions& common, Action& action);
/// status, retry, cancel: of what was submitted.
void addStatus(CLI::App& program, CommonOptions& common, Action& action);
void addRetry(CLI::App& program, CommonOptions& common, Action& action);
void addCancel(CLI::App& program, CommonOptions& common, Action& action);
void addCompare(CLI::App& program, CommonOptions& common, Action& action);
void addLayers(CLI::App& program, CommonOptions& common, Action& action);
void addSweep(CLI::App& program, CommonOptions& common, Action& action);
void addTables(CLI::App& program, CommonOptions& common, Action& action);
void addNightly(CLI::App& program, CommonOptions& common, Action& action);
void addTune(CLI::App& program, CommonOptions& common, Action& action);
void addWorker(CLI::App& program, CommonOptions& common, Action& action);

/// Reads the command line (without the program's name) and runs the command. Throws what it throws,
/// and UsageError for what cannot be understood.
ExitCode runProgram(std::vector<std::string> arguments);

/// Adds --json, -q, -v.
void addCommon(CLI::App& command, CommonOptions& common);
/// Adds CONFIG|SCENE, --frames, --method, --set, --device, --threads, --seed, --shader-dir, and the
/// common options.
void addRunOptions(CLI::App& command, RunOptions& options, CommonOptions& common);

/// Of options whose empty value would mean something else.
inline CLI::Validator notEmpty() {
  return {[](const std::string& text) { return text.empty() ? "must not be empty" : ""; }, ""};
}

/// A number from `low` to `high`; the help text says so, not CLI11.
inline CLI::Validator within(double low, double high) {
  return CLI::Range(low, high).description("");
}
/// 0 or more.
inline CLI::Validator notNegative() {
  return CLI::Validator(CLI::NonNegativeNumber).description("");
}

/// What reads stdout has seen enough (`| head`): no error of ours.
struct ReaderGone {};

/// Writes data to stdout, and checks that it arrived. Throws OutputError, ReaderGone.
void printData(const std::string& text);

}  // namespace catoptric::app
