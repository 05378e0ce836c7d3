// What the program says on stderr: in colours or not, beside a bar, as JSON lines.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <pty.h>

#include "app/progress_printer.h"
#include "app/test_program.h"
#include "config/json.h"

namespace catoptric::app {
namespace {

using testing::HasSubstr;
using testing::Not;

class Messages : public App {
 protected:
  /// What the program shows on a terminal; `environment` as env(1) takes it.
  std::string onTerminal(const std::string& environment, const std::string& arguments) const {
    int terminal = -1;
    const pid_t child = ::forkpty(&terminal, nullptr, nullptr, nullptr);
    if (child == 0) {
      const std::string command = "cd '" + folder.string() + "' && env -u NO_COLOR TERM=xterm " +
                                  environment + " " CATOPTRIC_PROGRAM " " + arguments +
                                  " >/dev/null";
      ::execl("/bin/sh", "sh", "-c", command.c_str(), nullptr);
      ::_exit(99);
    }
    std::string shown;
    char buffer[4096];
    for (ssize_t n = 0; (n = ::read(terminal, buffer, sizeof buffer)) > 0;)
      shown.append(buffer, static_cast<std::size_t>(n));
    ::close(terminal);
    ::waitpid(child, nullptr, 0);
    return shown;
  }

  /// Every line of `text` as JSON; a line that is none fails the test.
  static std::vector<config::Value> jsonLines(const std::string& text) {
    std::vector<config::Value> lines;
    std::istringstream stream(text);
    for (std::string line; std::getline(stream, line);) {
      EXPECT_NO_THROW(lines.push_back(config::parseText(line, "stderr"))) << line;
    }
    return lines;
  }
};

TEST_F(Messages, ColoursAreForTerminalsWithoutNoColor) {
  EXPECT_THAT(onTerminal("", "render nothing.json"), HasSubstr("\x1b["));
  EXPECT_THAT(onTerminal("NO_COLOR=", "render nothing.json"), HasSubstr("\x1b["));
  const std::string plain = onTerminal("NO_COLOR=1", "render nothing.json");
  EXPECT_THAT(plain, Not(HasSubstr("\x1b")));
  EXPECT_THAT(plain, HasSubstr("error: nothing.json: no such file"));
  EXPECT_THAT(run("render nothing.json").err, Not(HasSubstr("\x1b")));
}

TEST_F(Messages, TheBarMakesRoomForMessages) {
  const std::string shown = onTerminal("NO_COLOR=1", "render run.json --out a -v");
  EXPECT_THAT(shown, HasSubstr("] 6/6, in "));
  // Each message begins a line, which was emptied if the bar stood on it
  for (std::size_t at = shown.find("info: "); at != std::string::npos;
       at = shown.find("info: ", at + 1)) {
    const std::string before = shown.substr(0, at);
    EXPECT_TRUE(before.empty() || before.ends_with("\n") || before.ends_with("\r\x1b[K")) << shown;
  }
  EXPECT_THAT(onTerminal("TERM=dumb", "render run.json --out b"), Not(HasSubstr("\x1b[K")));
}

TEST_F(Messages, JsonProgressIsJsonLinesAlone) {
  const Result result = run("render run.json --out a --frames 1-2 --progress json");
  ASSERT_EQ(result.exitCode, 0) << result.err;
  int frames = 0;
  int messages = 0;
  for (const config::Value& line : jsonLines(result.err)) {
    if (line.has("message")) {
      ++messages;
      EXPECT_EQ(line.get("level").asString(), "info");
    }
    if (line.has("done")) frames = static_cast<int>(line.get("done").asInteger());
  }
  EXPECT_EQ(frames, 2);
  EXPECT_GE(messages, 3);  // the contact sheet, tables, frames

  // Named, it stays with -q; messages do not
  const auto quiet = jsonLines(run("render run.json --out b -q --frames 1 --progress json").err);
  EXPECT_GE(quiet.size(), 2u);
  for (const config::Value& line : quiet) EXPECT_FALSE(line.has("message"));
  EXPECT_EQ(run("render run.json --out c -q --frames 1").err, "");

  // Errors too, that end the program as well
  const Result refused = run("render run.json --out a --progress json");
  EXPECT_EQ(refused.exitCode, 5);
  const auto lines = jsonLines(refused.err);
  ASSERT_EQ(lines.size(), 1u);
  EXPECT_EQ(lines[0].get("level").asString(), "error");
  EXPECT_THAT(lines[0].get("message").asString(), HasSubstr("the folder is not empty"));
}

TEST_F(Messages, BakingIsShown) {
  std::ofstream(folder / "baked.json") << R"({"objects": [
  {"name": "floor", "shape": "plane", "size": [4, 4], "segments": [64, 64]},
  {"name": "ball", "shape": "sphere", "radius": 0.5, "translate": [0, 0.5, 0]}],
  "bake": {"mode": "ambient_occlusion", "rays": 4096}})";
  const Result result = run(
      "render baked.json --method reference --set image.width=8 --set image.height=8 --frames 1 "
      "--out a --progress json");
  ASSERT_EQ(result.exitCode, 0) << result.err;
  double share = 0.0;
  for (const config::Value& line : jsonLines(result.err)) {
    if (!line.has("step")) continue;
    EXPECT_EQ(line.get("step").asString(), "bake");
    EXPECT_GE(line.get("share").asNumber(), share);
    share = line.get("share").asNumber();
  }
  EXPECT_GT(share, 0.0);
  EXPECT_LE(share, 1.0);
}

TEST_F(Messages, ErrorsThatMethodDropsAreNamed) {
  std::ofstream(folder / "two.json") << R"({"scene": "scene.json", "path": "path.json",
    "image": {"width": 8, "height": 8}, "frames": "1", "errors": {"against": ["truth"]},
    "methods": [{"method": "reference", "max_standard_error": 0, "name": "a", "samples": 1, "rays": 1},
                {"method": "reference", "max_standard_error": 0, "name": "truth", "samples": 1, "rays": 1}]})";
  EXPECT_THAT(run("render two.json --method a --out a").err,
              HasSubstr("errors against truth are not computed: --method leaves it out"));
  EXPECT_THAT(run("render two.json --out both").err, Not(HasSubstr("errors against")));
}

TEST(Progress, DurationsRead) {
  EXPECT_EQ(durationText(0.84), "0.8 s");
  EXPECT_EQ(durationText(59.2), "59 s");
  EXPECT_EQ(durationText(245), "4:05");
  EXPECT_EQ(durationText(3723), "1:02:03");
}

}  // namespace
}  // namespace catoptric::app
