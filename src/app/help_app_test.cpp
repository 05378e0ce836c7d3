// What the program says of itself: helps, lists, completions, the manual page.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "app/test_program.h"
#include "config/json.h"

namespace catoptric::app {
namespace {

using testing::HasSubstr;
using testing::Not;

TEST_F(App, HelpVersionAndListAreQuick) {
  const Result help = run("render --help");
  EXPECT_EQ(help.exitCode, 0);
  EXPECT_EQ(help.err, "");
  EXPECT_THAT(help.out, HasSubstr("--existing"));
  EXPECT_EQ(run("help render").out, help.out);
  EXPECT_EQ(run("help").out, run("--help").out);
  EXPECT_THAT(run("--version").out, HasSubstr("catoptric 0."));
  const config::Value list = config::parseText(run("list --json").out, "list");
  EXPECT_EQ(list.get("methods").asArray().back().get("name").asString(), "reference");
  EXPECT_THAT(run("list").out, HasSubstr("metrics"));
  EXPECT_THAT(run("list metrics").out, HasSubstr("flicker "));
  const std::string options = run("list options traced").out;
  EXPECT_THAT(options, HasSubstr("methods.traced.rays "));
  EXPECT_THAT(options, Not(HasSubstr("image.width")));
  EXPECT_THAT(run("list options").out, HasSubstr("image.width "));
  EXPECT_THAT(run("list layers glossy_lod").out, testing::StartsWith("chart "));
  EXPECT_THAT(run("list --schema siute").err, HasSubstr("did you mean \"suite\"?"));
  EXPECT_THAT(run("list second").err, HasSubstr("allowed: methods, options, "));
  // Every step of the listed methods is explained, in the program and in the docs.
  const std::string steps = run("list steps").out;
  const std::string docs = textOf(fs::path(CATOPTRIC_SOURCE_DIR) / "docs/methods.md");
  for (const config::Value& step : list.get("steps").asArray()) {
    const std::string name = step.get("name").asString();
    EXPECT_THAT(docs, HasSubstr("- `" + name + "`"));
    EXPECT_THAT(steps, HasSubstr(name + " "));
  }
  for (const char* name : {"cube_map", "resolve", "wait", "other", "layers"})
    EXPECT_THAT(steps, HasSubstr(std::string(name) + " "));
}

TEST_F(App, HelpPagesAreOfTheirCommandAndFitATerminal) {
  for (const std::string command :
       {"render", "plan", "info", "list", "doctor", "merge", "compare", "layers"}) {
    const std::string help = run(command + " --help").out;
    EXPECT_THAT(help, HasSubstr("Example")) << command;
    EXPECT_THAT(help, HasSubstr("  catoptric " + command)) << command;
    std::istringstream lines(help);
    for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 100u) << line;
  }
  EXPECT_THAT(run("doctor --help").out, testing::Not(HasSubstr("catoptric render")));
}

TEST_F(App, ShellsCompleteWhatTheProgramKnows) {
  std::ofstream(folder / "complete.bash")
      << run("list --completion bash").out << "catoptric() { " CATOPTRIC_PROGRAM R"( "$@"; }
ask() {
  COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); _catoptric; echo "${COMPREPLY[*]}"
}
ask catoptric ren
ask catoptric render --fr
ask catoptric render run.json --existing re
ask catoptric render --method trac
ask catoptric list co
ask catoptric render run.js
ask catoptric sweep --vary image.wi
)";
  const std::string command =
      "cd '" + folder.string() + "' && bash complete.bash >stdout.txt 2>stderr.txt";
  ASSERT_EQ(std::system(command.c_str()), 0) << textOf(folder / "stderr.txt");
  EXPECT_EQ(textOf(folder / "stdout.txt"),
            "render\n--frames\nresume\ntraced\ncounters configs\nrun.json\nimage.width=\n");
  EXPECT_EQ(run("list --completion fish").exitCode, 2);
  // Words of values are those that the help names
  const std::string help = run("render --help").out;
  for (const char* word : {"overwrite", "resume", "plain", "json", "surfaceless", "osmesa"})
    EXPECT_THAT(help, HasSubstr(word));
}

TEST_F(App, TheManualPageNamesEveryCommandAndOption) {
  const std::string page = run("list --man").out;
  for (const char* part : {".SS render", ".SS compare", ".SH EXIT STATUS", ".SH EXAMPLES",
                           "\\fB\\-\\-existing\\fR \\fIHOW\\fR", "8  out of memory"})
    EXPECT_THAT(page, HasSubstr(part));
  const std::string command = "man -l --warnings=all - >/dev/null 2>'" +
                              (folder / "man.txt").string() + "' <'" +
                              (folder / "stdout.txt").string() + "'";
  if (std::system("man --version >/dev/null 2>&1") != 0) GTEST_SKIP() << "man is not installed";
  EXPECT_EQ(std::system(command.c_str()), 0);
  EXPECT_EQ(textOf(folder / "man.txt"), "");
}

}  // namespace
}  // namespace catoptric::app
