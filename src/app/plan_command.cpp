// catoptric plan.
#include "app/plan_command.h"

#include <memory>

#include "app/commands.h"
#include "app/run_options.h"
#include "core/log.h"
#include "methods/contract/method.h"
#include "run/folder/memory.h"
#include "run/sequence/session.h"

namespace catoptric::app {
namespace {

ExitCode plan(const RunOptions& options, const CommonOptions& common) {
  const run::Stage stage(readRun(options));
  const run::Plan planned = planOf(stage);
  printData(common.json ? run::planJson(planned) + "\n" : run::planText(planned));
  return ExitCode::Done;
}

}  // namespace

run::Plan planOf(const run::Stage& stage) {
  const auto made = run::makeMethods(stage, methods::registry());
  run::Plan plan =
      run::makePlan(stage.run(), stage.scene(), stage.environment(), stage.frames().size(), made);
  run::planWarmUps(plan, stage.path(), stage.frames(), made);
  if (const std::string warning = run::memoryWarning(plan, run::obtainableMemory());
      !warning.empty())
    log::warning(warning);
  if (const std::string warning = run::cubeMapWarning(plan, stage.run().image); !warning.empty())
    log::warning(warning);
  if (const std::string warning = run::refractionWarning(plan, stage.scene()); !warning.empty())
    log::warning(warning);
  for (const std::string& note : run::reflectionNotes(plan, stage.scene(), stage.run().image))
    log::info(note);
  return plan;
}

Command planCommand(CommonOptions& common) {
  const auto options = std::make_shared<RunOptions>();
  return {"plan", "Show what a run would build, compile and allocate, and why.",
          runRows(*options, common),
          "Example:\n  catoptric plan configs/demo.json --method traced\n",
          [options, &common] { return plan(*options, common); }};
}

}  // namespace catoptric::app
