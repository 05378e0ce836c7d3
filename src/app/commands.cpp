// What the program consists of, and what every command has.
#include "app/commands.h"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>

#include "core/text.h"

namespace catoptric::app {
namespace {

constexpr const char* kExamples = R"(Examples:
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
)";

constexpr ExitText kExitTexts[] = {
    {"0", "done"},
    {"2", "the command line or a config is wrong"},
    {"3", "a scene, or a file that it names, is missing or damaged"},
    {"4", "no OpenGL device can render; see `catoptric doctor`"},
    {"5", "output could not be written, or the output folder is not empty"},
    {"6", "some frames failed"},
    {"7", "a comparison exceeded its limits"},
    {"8", "out of memory"},
    {"70", "a fault of the program itself; please report it"},
    {"128 + N", "ended by signal N"}};

std::string footer() {
  std::string text = std::string(kExamples) + "\nExit codes:\n";
  for (const ExitText& exit : kExitTexts)
    text += "  " + std::string(exit.code) + (exit.code.size() == 1 ? "  " : " ") + exit.text + "\n";
  return text;
}

}  // namespace

Program makeProgram(CommonOptions& common) {
  return {
      "A headless batch renderer for reflections. It renders the frames of a camera path by one or "
      "several methods, and measures their times and errors.",
      footer(),
      {renderCommand(common), planCommand(common), infoCommand(common), listCommand(common),
       doctorCommand(common), mergeCommand(common), submitCommand(common), statusCommand(common),
       retryCommand(common), cancelCommand(common), compareCommand(common), figureCommand(common),
       layersCommand(common), sweepCommand(common), tablesCommand(common), tuneCommand(common),
       nightlyCommand(common), workerCommand(common)}};
}

std::string exitCodes(std::vector<ExitText> codes) {
  if (codes.empty() || codes.front().code != "0") codes.insert(codes.begin(), {"0"});
  std::vector<std::string> texts;
  for (const ExitText& exit : codes) {
    const auto* known = std::ranges::find(kExitTexts, exit.code, &ExitText::code);
    texts.push_back(std::string(exit.code) + " " +
                    (exit.text != nullptr ? exit.text : known->text));
  }
  return "\n" + wrapped("Exit codes: " + joined(texts, "; ") + ".", kHelpWidth) + "\n";
}

OptionRow existingRow(std::string& how) {
  return option("--existing", how, "HOW",
                "What to do if the folder already has results: error (refuse), overwrite (replace "
                "them), or resume (keep the finished ones that still fit, and make the others)",
                {.showsDefault = true});
}

OptionRow progressRow(std::string& how) {
  return option("--progress", how, "HOW",
                "How to show progress on stderr: bar, plain (lines), json (every line is a JSON "
                "object), none, or auto (a bar on a terminal, otherwise lines; none with --quiet)",
                {.showsDefault = true});
}

Rows commonRows(CommonOptions& common) {
  return {flag("--json", common.json, "Print the results on stdout as JSON"),
          flag("-q,--quiet", common.quiet, "Print only warnings and errors on stderr"),
          flag("-v,--verbose", common.verbose, "Print details on stderr, too")};
}

std::string fittedText(const report::Table& table) {
  winsize window{};
  const bool narrow = ::isatty(STDOUT_FILENO) != 0 &&
                      ::ioctl(STDOUT_FILENO, TIOCGWINSZ, &window) == 0 && window.ws_col > 0;
  return narrow ? report::toText(table, window.ws_col) : report::toText(table);
}

void printData(const std::string& text) {
  const std::string shown = printable(text);  // names of files and objects are not ours
  if (std::fwrite(shown.data(), 1, shown.size(), stdout) == shown.size() &&
      std::fflush(stdout) == 0)
    return;
  if (errno == EPIPE) throw ReaderGone();
  throw OutputError("standard output cannot be written");
}

}  // namespace catoptric::app
