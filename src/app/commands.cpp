// What the program consists of, and what every command has.
#include "app/commands.h"

#include <cerrno>
#include <cstdio>

#include "core/text.h"

namespace catoptric::app {
namespace {

constexpr const char* kFooter = R"(Examples:
  catoptric render configs/demo.json --out out/demo
  catoptric render scenes/cornell_box.json --method traced --set image.width=256
  catoptric render configs/demo.json --out out/demo --existing resume
  catoptric merge out/part1 out/part2 --out out/whole
  catoptric submit configs/demo.json --chunks 20 --out out/shared
  catoptric plan configs/demo.json
  catoptric info scenes/living_room.json
  catoptric compare out/demo/traced out/demo/reference
  catoptric layers out/demo/second_order --layer mask --out out/pictures
  catoptric sweep configs/demo.json --vary methods.second_order.level_error=0,0.75

Exit codes:
  0  everything is done
  2  the command line or a run config is wrong
  3  a scene or one of its files is missing or damaged
  4  no OpenGL device can be had; see `catoptric doctor`
  5  output could not be written, or a folder that is not empty stands in its way
  6  some frames failed
  7  a comparison exceeded its limits
  8  the memory did not suffice
  70 a fault of the program itself: please report it
  128 + N  the process was ended by signal N
)";

}  // namespace

Program makeProgram(CommonOptions& common) {
  return {
      "A headless batch renderer for reflections. It renders the frames of a camera path by one or "
      "several methods, and measures their times and errors.",
      kFooter,
      {renderCommand(common), planCommand(common), infoCommand(common), listCommand(common),
       doctorCommand(common), mergeCommand(common), submitCommand(common), statusCommand(common),
       retryCommand(common), cancelCommand(common), compareCommand(common), figureCommand(common),
       layersCommand(common), sweepCommand(common), tablesCommand(common), tuneCommand(common),
       nightlyCommand(common), workerCommand(common)}};
}

Rows commonRows(CommonOptions& common) {
  return {flag("--json", common.json, "Print the data on stdout as JSON"),
          flag("-q,--quiet", common.quiet, "Print only warnings and errors on stderr"),
          flag("-v,--verbose", common.verbose, "Print details on stderr, too")};
}

void printData(const std::string& text) {
  const std::string shown = printable(text);  // names of files and objects are not ours
  if (std::fwrite(shown.data(), 1, shown.size(), stdout) == shown.size() &&
      std::fflush(stdout) == 0)
    return;
  if (errno == EPIPE) throw ReaderGone();
  throw OutputError("stdout: cannot be written");
}

}  // namespace catoptric::app
