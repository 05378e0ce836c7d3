// catoptric nightly as a program: exit codes, kills, several at once, full and read-only disks,
// damaged histories. With CATOPTRIC_LONG=1 100 kills instead of a sample.
#include <gmock/gmock.h>
#include <sys/mount.h>

#include <algorithm>
#include <random>
#include <thread>
#include <vector>

#include "app/test_program.h"
#include "core/clock.h"

namespace catoptric::app {
namespace {

using testing::HasSubstr;
using testing::Not;

class Nightly : public App {
 protected:
  Nightly() {
    std::ofstream(folder / "run.json") << R"({
  "scene": "scene.json", "path": "path.json", "image": {"width": 16, "height": 12},
  "methods": [{"method": "reference", "max_standard_error": 0, "samples": 2, "rays": 1},
              {"method": "reference", "max_standard_error": 0, "name": "truth", "samples": 4, "rays": 1}]})";
    std::ofstream(folder / "small.suite.json") << R"({"title": "Small", "scenes": {
  "ball": {"config": "run.json", "frames": {"full": "1-3"}, "against": "truth", "tags": ["round"]}}})";
  }

  /// A build with a fault: another program that passes everything on to this one.
  void writeBuild(const std::string& name, const std::string& fault) const {
    std::ofstream(folder / name) << "#!/bin/sh\n# " << name << "\n"
                                 << fault << "\nexec '" << CATOPTRIC_PROGRAM << "' \"$@\" $more\n";
    fs::permissions(folder / name, fs::perms::owner_all);
  }

  Result nightly(const std::string& arguments, const std::string& history = "h/history.db") const {
    return run("nightly " + arguments + " --history " + history);
  }
  static std::string suite() { return "small.suite.json --progress none -q "; }

  /// The accepted frames with their bytes.
  std::map<std::string, std::string> accepted(const std::string& history = "h") const {
    std::map<std::string, std::string> files;
    std::error_code ignored;
    for (const auto& entry :
         fs::recursive_directory_iterator(folder / history / "accepted", ignored))
      if (entry.is_regular_file()) files[entry.path().filename().string()] = textOf(entry.path());
    return files;
  }

  static bool isLong() {
    const char* text = std::getenv("CATOPTRIC_LONG");
    return text != nullptr && std::string(text) == "1";
  }
};

TEST_F(Nightly, ExitCodesSayHowTheNightWas) {
  EXPECT_EQ(nightly("accept '*' --reason r").exitCode, 2);  // there is no history
  const Result first = nightly(suite() + "--junit j/n.xml --html page");
  EXPECT_EQ(first.exitCode, 0) << first.err;
  EXPECT_THAT(first.out, HasSubstr("2 cases: 0 regressions, 0 crashes, 2 new; 6 frames"));
  EXPECT_THAT(first.out, HasSubstr(": good\n"));
  EXPECT_THAT(textOf(folder / "j/n.xml"), HasSubstr("classname=\"small.ball.reference\""));
  EXPECT_EQ(nightly("accept '*'").exitCode, 2);  // without a reason
  EXPECT_TRUE(accepted().empty());
  EXPECT_EQ(nightly("accept '*' --reason first").exitCode, 0);
  EXPECT_EQ(nightly(suite()).exitCode, 0);
  writeBuild("other_pixels", "more='--set methods.reference.samples=1'");
  const Result changed = nightly(suite() + "--program ./other_pixels --only reference");
  EXPECT_EQ(changed.exitCode, 7) << changed.err;
  EXPECT_THAT(changed.out, HasSubstr("small.ball.reference:1  picture"));
  EXPECT_THAT(changed.out, HasSubstr(": REGRESSION\n"));
  writeBuild("crashes", "case \"$*\" in *truth*) echo 'error: out of luck' >&2; exit 9;; esac");
  const Result crashed = nightly(suite() + "--program ./crashes");
  EXPECT_EQ(crashed.exitCode, 6) << crashed.err;
  EXPECT_THAT(crashed.out, HasSubstr("out of luck"));
  EXPECT_THAT(crashed.out, HasSubstr(": CRASH\n"));
  // What was seen stays; good nights follow
  EXPECT_EQ(nightly(suite() + "--report-only --junit again.xml").exitCode, 6);
  EXPECT_THAT(textOf(folder / "again.xml"), HasSubstr("<error message=\"crash: out of luck"));
  const Result good = nightly(suite());
  EXPECT_EQ(good.exitCode, 0) << good.out << good.err;
  EXPECT_EQ(nightly("undo 1").exitCode, 0);
  EXPECT_EQ(nightly("undo 1").exitCode, 2);
  const Result log = nightly("log");
  EXPECT_THAT(log.out, HasSubstr("first"));
  EXPECT_THAT(nightly(suite() + "--run-only").out, HasSubstr("not judged"));
  EXPECT_EQ(nightly(suite() + "--compare-only").exitCode, 0);
}

TEST_F(Nightly, AnotherProgramIsComparedWithoutAHistory) {
  writeBuild("same", "");
  writeBuild("other_pixels", "more='--set methods.reference.samples=1'");
  writeBuild("refuses", "echo 'error: no such option' >&2; exit 2");
  const std::string compare = suite() + "--repeats 2 --only reference --baseline ";
  const Result same = nightly(compare + "./same");
  EXPECT_EQ(same.exitCode, 0) << same.out << same.err;
  EXPECT_THAT(same.out, HasSubstr("3 of 3 frames are equal bit for bit, 0 steps are slower"));
  EXPECT_FALSE(fs::exists(folder / "h/history.db"));
  const Result other = nightly(compare + "./other_pixels");
  EXPECT_EQ(other.exitCode, 7) << other.err;
  EXPECT_THAT(other.out, HasSubstr("frame 1 B: "));
  EXPECT_TRUE(fs::exists(folder / "h/baseline/small.ball.reference/now/frames/frame.0001.exr"));
  EXPECT_THAT(nightly(compare + "./refuses --json").out, HasSubstr("\"without_baseline\":1"));
  EXPECT_EQ(nightly(compare + "./same --program ./refuses").exitCode, 6);
}

TEST_F(Nightly, WhatIsWrongEndsWithAHint) {
  const std::string begin = R"({"title": "<b>", "scenes": {)";
  const std::string ball = R"({"config": "run.json", "frames": {"full": "1"}, "methods": ["truth")";
  std::ofstream(folder / "a b.suite.json") << textOf(folder / "small.suite.json");
  std::ofstream(folder / "twice.suite.json") << begin << "\"ball\": " << ball << R"(, "truth"]}}})";
  std::ofstream(folder / "nameless.suite.json") << begin << "\"\": " << ball << "]}}}";
  std::ofstream(folder / "untrue.suite.json")
      << begin << "\"ball\": " << ball << R"(], "against": "nobody"}}})";
  for (const auto& [arguments, hint] : std::map<std::string, std::string>{
           {"small.suite.json --effort ful", "with frames for --effort ful"},
           {"small.suite.json --only square", "matches --only square"},
           {"small.suite.json more", "is one argument too many"},
           {"small.suite.json --single-file", "needs --html DIR"},
           {"small.suite.json --baseline feed", "no stored build has a fingerprint that begins so"},
           {"small.suite.json --run-only --compare-only", "exclude each other"},
           {"small.suite.json --clock sun", "must be one of"},
           {"run.json", "title"},
           {"nothing.json", "nothing.json"},
           {"'a b.suite.json'", "the suite's file name"},
           {"twice.suite.json", "\"truth\" is named twice"},
           {"nameless.suite.json", "the scene's name"},
           {"untrue.suite.json", "untrue.ball.truth: the reference"},
           {"undo", "give the number"},
           {"accept", "name a case, such as"}}) {
    const Result result = nightly(arguments);
    EXPECT_TRUE(result.exitCode == 2 || result.exitCode == 3) << arguments << result.err;
    EXPECT_THAT(result.err, HasSubstr(hint)) << arguments;
  }
}

TEST_F(Nightly, WhatHangsIsACrashAndTheNightGoesOn) {
  writeBuild("hangs", "case \"$*\" in *truth*) exec sleep 600;; esac");
  const Result result =
      nightly("small.suite.json --progress none -q --patience 0.05 --program ./hangs");
  EXPECT_EQ(result.exitCode, 6) << result.err;
  EXPECT_THAT(result.out, HasSubstr("./hangs did not answer for 3 s and was killed"));
  EXPECT_THAT(result.out, HasSubstr("2 cases: 0 regressions, 1 crashes"));
}

TEST_F(Nightly, ProgramsCanReadWhatItSays) {
  const Result first = nightly(suite() + "--only truth --json");
  EXPECT_EQ(first.exitCode, 0) << first.err;
  EXPECT_EQ(
      first.out,
      "{\"night\":1,\"cases\":1,\"regressions\":0,\"crashes\":0,\"skipped\":1,\"to_accept\":3,"
      "\"changed_settings\":[],\"end\":\"good\",\"faults\":[]}\n");
  EXPECT_THAT(nightly("log").out, HasSubstr("small.ball.truth  picture  new      1,2,3"));
  EXPECT_EQ(nightly("accept '*' --reason ' '").exitCode, 2);
  // Several patterns may name the same frames
  EXPECT_EQ(nightly("accept '*' '*.truth' '*:2' --reason r --json").out,
            "{\"acknowledgement\":1,\"frames\":3,\"times\":0}\n");
  EXPECT_THAT(nightly("log --json").out, HasSubstr("\"wanted\":[],\"acknowledgements\":[{"));
}

TEST_F(Nightly, CasesWithChangedSettingsAreNamed) {
  ASSERT_EQ(nightly(suite()).exitCode, 0);
  std::string config = textOf(folder / "run.json");
  std::ofstream(folder / "run.json") << config.replace(config.find("16"), 2, "20");
  const std::string names = "changed settings: small.ball.reference, small.ball.truth";
  EXPECT_THAT(nightly(suite() + "--html page").out,
              HasSubstr("2 changed settings; 6 frames wait for acceptance; " + names + ": good\n"));
  EXPECT_THAT(textOf(folder / "page/index.html"), HasSubstr(names + ".</p>"));
}

TEST_F(Nightly, NobodysPageIsReplaced) {
  ASSERT_EQ(nightly(suite(), "'h o/h.db'").exitCode, 0);
  fs::create_directories(folder / "site");
  std::ofstream(folder / "site/index.html") << "mine";
  for (const char* how : {"--html site", "--html site --single-file"})
    EXPECT_EQ(nightly(suite() + "--report-only " + how, "'h o/h.db'").exitCode, 5) << how;
  EXPECT_EQ(textOf(folder / "site/index.html"), "mine");
  for (const char* how : {"--html page", "--html page", "--html page --single-file"})
    EXPECT_EQ(nightly(suite() + "--report-only " + how, "'h o/h.db'").exitCode, 0) << how;
  // What the page gives to a shell is quoted
  EXPECT_THAT(textOf(folder / "page/index.html"), HasSubstr("--history 'h o/h.db'"));
}

TEST_F(Nightly, KilledAnywhereItGoesOn) {
  const std::int64_t start = nowNs();
  ASSERT_EQ(nightly(suite()).exitCode, 0);
  const double night = secondsSince(start);
  ASSERT_EQ(nightly("accept '*' --reason first").exitCode, 0);
  const auto before = accepted();
  ASSERT_EQ(before.size(), 6u);
  std::mt19937 random(7);
  std::uniform_real_distribution<double> moment(0.0, 0.7 * night);
  const int kills = isLong() ? 100 : 8;
  writeBuild("next", "more='--set image.samples=2'");
  int killed = 0;
  for (int i = 0; i < kills; ++i) {
    // Also while something is accepted: all of it or nothing
    const bool accepts = i % 4 == 3;
    const std::string what = accepts ? "accept '*' --reason again" : suite() + "--program ./next";
    const std::string command = "cd '" + folder.string() + "' && timeout -s KILL " +
                                std::to_string(accepts ? 0.2 * moment(random) : moment(random)) +
                                " " + CATOPTRIC_PROGRAM + " nightly " + what +
                                " --history h/history.db >/dev/null 2>&1";
    const int status = std::system(command.c_str());
    killed += WIFSIGNALED(status) || WEXITSTATUS(status) == 128 + SIGKILL ? 1 : 0;
    const Result log = nightly("log");
    ASSERT_EQ(log.exitCode, 0) << log.err;
    for (const auto& [name, bytes] : before) ASSERT_EQ(accepted()[name], bytes) << name;
  }
  std::printf("%d of %d were killed before their end\n", killed, kills);
  EXPECT_GE(killed, kills / 3);
  const Result last = nightly(suite() + "--program ./next");
  EXPECT_TRUE(last.exitCode == 7 || last.exitCode == 0) << last.err;
  EXPECT_THAT(last.out, HasSubstr("2 cases"));
  EXPECT_THAT(nightly("log").out, Not(HasSubstr("unfinished")));
}

TEST_F(Nightly, EightAtOnceLoseNothing) {
  std::vector<std::thread> threads;
  std::vector<int> codes(8, -1);
  for (std::size_t i = 0; i < codes.size(); ++i)
    threads.emplace_back([&, i] {
      const std::string command = "cd '" + folder.string() +
                                  "' && " CATOPTRIC_PROGRAM
                                  " nightly small.suite.json -q --history h/history.db >out" +
                                  std::to_string(i) + ".txt 2>&1";
      const int status = std::system(command.c_str());
      codes[i] = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
    });
  for (std::thread& thread : threads) thread.join();
  for (std::size_t i = 0; i < codes.size(); ++i)
    EXPECT_EQ(codes[i], 0) << textOf(folder / ("out" + std::to_string(i) + ".txt"));
  const std::string log = nightly("log").out;
  std::size_t nights = 0;
  for (std::size_t at = 0; (at = log.find("  small  ", at)) != std::string::npos; ++at) ++nights;
  EXPECT_EQ(nights, codes.size()) << log;
  EXPECT_THAT(log, Not(HasSubstr("unfinished")));
}

TEST_F(Nightly, DamagedAndStrangeHistoriesAreRefused) {
  ASSERT_EQ(nightly(suite()).exitCode, 0);
  const std::string whole = textOf(folder / "h/history.db");
  const auto refuse = [&](const std::string& bytes, const std::string& hint) {
    std::ofstream(folder / "h/history.db", std::ios::trunc) << bytes;
    for (const std::string& what :
         {suite(), std::string("accept '*' --reason r"), std::string("log")}) {
      const Result result = nightly(what);
      EXPECT_TRUE(result.exitCode == 2 || result.exitCode == 5) << what << result.exitCode;
      EXPECT_THAT(result.err, HasSubstr(hint)) << what;
    }
    EXPECT_EQ(textOf(folder / "h/history.db"), bytes);
    EXPECT_TRUE(accepted().empty());
  };
  std::string damaged = whole;
  std::fill(damaged.begin() + 4096, damaged.begin() + 3 * 4096, '\x5a');
  refuse(damaged, "damaged");
  refuse(whole.substr(0, whole.size() / 2), "damaged");
  refuse("no database at all, but long enough to be read as the header of one: " +
             std::string(200, 'x'),
         "damaged");
  std::string newer = whole;
  newer[63] = 99;  // user_version
  refuse(newer, "newer catoptric");
  std::string strange = whole;
  strange[68] = 1;  // application_id
  refuse(strange, "is not a history of catoptric");
  std::ofstream(folder / "h/history.db", std::ios::trunc) << whole;
  EXPECT_EQ(nightly("accept '*' --reason r").exitCode, 0);
}

TEST_F(Nightly, FullAndReadOnlyDisksAreExit5) {
  fs::create_directories(folder / "disk");
  const auto needed = fs::file_size(CATOPTRIC_PROGRAM) >> 20;
  const std::string size = "size=" + std::to_string(needed + 4) + "m";
  if (::mount("none", (folder / "disk").c_str(), "tmpfs", 0, size.c_str()) != 0)
    GTEST_SKIP() << "a small file system can be mounted by root alone";
  const std::string history = "disk/history.db";
  const auto fill = [&](std::uintmax_t leave) {
    fs::remove(folder / "disk/filler");
    const auto free = fs::space(folder / "disk").available;
    std::ofstream(folder / "disk/filler") << std::string(free > leave ? free - leave : 0, 'x');
  };
  for (const std::uintmax_t leave : {0u, 1u << 16, 1u << 20}) {  // the program is not kept
    fill(leave);
    const Result full = nightly(suite(), history);
    EXPECT_EQ(full.exitCode, 5) << leave << full.err;
  }
  fs::remove(folder / "disk/filler");
  ASSERT_EQ(nightly(suite(), history).exitCode, 0);
  for (const std::uintmax_t leave : {0u, 4096u, 8192u, 3u * 4096u}) {
    fill(leave);
    const Result full = nightly("accept '*' --reason r", history);
    EXPECT_EQ(full.exitCode, 5) << leave << full.err;
    EXPECT_THAT(nightly("log", history).out, Not(HasSubstr("Acceptances"))) << leave;
    const Result night = nightly(suite(), history);
    EXPECT_EQ(night.exitCode, 5) << leave << night.err;
  }
  fs::remove(folder / "disk/filler");
  const std::string before = textOf(folder / history);
  ASSERT_EQ(
      ::mount("none", (folder / "disk").c_str(), "tmpfs", MS_REMOUNT | MS_RDONLY, size.c_str()), 0);
  EXPECT_EQ(nightly(suite(), history).exitCode, 5);
  EXPECT_EQ(nightly("accept '*' --reason r", history).exitCode, 5);
  EXPECT_EQ(nightly("log", history).exitCode, 0);
  EXPECT_EQ(textOf(folder / history), before);
  ASSERT_EQ(::mount("none", (folder / "disk").c_str(), "tmpfs", MS_REMOUNT, size.c_str()), 0);
  EXPECT_EQ(nightly("accept '*' --reason r", history).exitCode, 0);
  EXPECT_EQ(nightly(suite(), history).exitCode, 0);
  ::umount((folder / "disk").c_str());
}

}  // namespace
}  // namespace catoptric::app
