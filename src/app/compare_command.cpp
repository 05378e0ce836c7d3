// catoptric compare RUN REFERENCE.
#include <optional>

#include "app/commands.h"
#include "core/log.h"
#include "report/errors.h"
#include "report/run_data.h"
#include "report/table.h"

namespace catoptric::app {
namespace {

struct Options {
  std::string run;
  std::string reference;
  std::string out;
  std::optional<double> maxL1;
};

ExitCode compare(const Options& options, const CommonOptions& common) {
  const report::RunData run = report::readRun(options.run);
  const report::RunData reference = report::readRun(options.reference);
  const report::RunComparison comparison = report::compareRuns(run, reference);
  if (!options.out.empty()) report::writeDifferences(run, reference, options.out);
  printData(common.json ? report::errorJson({&comparison, 1}) + "\n"
                        : report::toText(report::errorView(comparison)));
  if (options.maxL1 && comparison.pooled.l1() > *options.maxL1) {
    log::error("L1_8bit is " + report::fixedText(comparison.pooled.l1(), 3) + ", more than the " +
               report::fixedText(*options.maxL1, 3) + " allowed");
    return ExitCode::LimitsExceeded;
  }
  return ExitCode::Done;
}

}  // namespace

void addCompare(CLI::App& program, CommonOptions& common, Action& action) {
  const auto options = std::make_shared<Options>();
  CLI::App* command = program.add_subcommand(
      "compare", "Errors of a run against another, images of the difference");
  command->add_option("run", options->run, "Folder of a run")->required()->type_name("RUN");
  command->add_option("reference", options->reference, "Folder of the run it is compared with")
      ->required()
      ->type_name("REFERENCE");
  command->add_option("--out", options->out, "Write images of the differences here")
      ->type_name("DIR");
  command
      ->add_option("--max-l1", options->maxL1,
                   "Exit 7 when the mean absolute difference (0..255) is larger")
      ->type_name("X");
  addCommon(*command, common);
  command->footer(
      "\nExample:\n  catoptric compare out/demo/traced out/demo/reference --max-l1 2\n");
  command->callback([options, &common, &action] {
    action = [options, &common] { return compare(*options, common); };
  });
}

}  // namespace catoptric::app
