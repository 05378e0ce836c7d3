// catoptric worker: what sweep, tune and tables start to render frames when told.
#include <iostream>
#include <memory>

#include "app/commands.h"
#include "app/run_options.h"
#include "study/worker.h"

namespace catoptric::app {

Command workerCommand(CommonOptions& common) {
  const auto options = std::make_shared<RunOptions>();
  return {"worker",
          "Render frames when told by JSON lines on stdin. `sweep`, `tune` and `tables` start it.",
          runRows(*options, common),
          "",
          [options] {
            run::Stage stage(readRun(*options));
            study::serveFrames(
                stage,
                [](std::string& line) { return static_cast<bool>(std::getline(std::cin, line)); },
                [](const std::string& answer) { printData(answer + "\n"); });
            return ExitCode::Done;
          },
          true};  // not for people
}

}  // namespace catoptric::app
