// catoptric worker: what sweep, tune and tables start to render frames when told.
#include <iostream>
#include <memory>

#include "app/commands.h"
#include "app/run_options.h"
#include "study/worker.h"

namespace catoptric::app {

void addWorker(CLI::App& program, CommonOptions& common, Action& action) {
  CLI::App* command = program.add_subcommand(
      "worker",
      "Render frames when told by JSON lines on stdin. `sweep`, `tune` and `tables` start it.");
  command->group("");  // not for people
  const auto options = std::make_shared<RunOptions>();
  addRunOptions(*command, *options, common);
  command->callback([options, &action] {
    action = [options] {
      run::Stage stage(readRun(*options));
      study::serveFrames(
          stage, [](std::string& line) { return static_cast<bool>(std::getline(std::cin, line)); },
          [](const std::string& answer) { printData(answer + "\n"); });
      return ExitCode::Done;
    };
  });
}

}  // namespace catoptric::app
