#include "run/folder/run_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <sstream>

#include "config/json.h"
#include "core/error.h"
#include "core/file.h"
#include "core/hash.h"
#include "core/test_fields.h"
#include "run/test_folders.h"

namespace catoptric::run {
namespace {

namespace fs = std::filesystem;
using std::string_literals::operator""s;

/// An empty folder of this test's own.
std::vector<std::byte> bytesOf(const std::string& text) {
  std::vector<std::byte> bytes;
  for (const char c : text) bytes.push_back(static_cast<std::byte>(c));
  return bytes;
}

using methods::ColumnType;
const methods::TableInfo kImages{"images",
                                 "an image",
                                 {{"image", ColumnType::Integer, ""},
                                  {"object", ColumnType::Integer, ""},
                                  {"planar", ColumnType::Integer, ""},
                                  {"factor", ColumnType::Real, ""},
                                  {"note", ColumnType::Text, ""}}};
const FrameFingerprints kPrints{"c", "s", "k", "b"};

void addFrame(RunFolder& folder, int number, const std::string& contents) {
  const std::string path = framePath("frames", number, ".exr");
  folder.writeFile(path, bytesOf(contents));
  Fingerprint content;
  content.add(std::span<const std::byte>(bytesOf(contents)));
  FrameRecord record;
  record.frame = number;
  record.fingerprints = kPrints;
  record.origin = {"fake \"GL\"", "p", "i", "l"};
  record.files = {{path, contents.size(), content.text()}};
  record.counters = {{"rays", 10}};
  methods::Table& rows = record.tables.emplace_back(kImages);
  rows.add(0, 7, true, 1.0, "one, or \"two\""s);
  rows.add(1, 9, false, 1.0 / 0.0, ""s);
  record.samples = {{number, "gbuffer", 0.25 * number, "wall", number == 1},
                    {number, "encode", 9.0, "overlapped", false}};
  folder.add(record);
}

std::string outputError(const std::function<void()>& action) {
  try {
    action();
  } catch (const OutputError& error) {
    return error.what();
  }
  return "(no error)";
}

TEST(RunFolder, RecordsReadBackTheSame) {
  FrameRecord record;
  record.frame = 7;
  record.timeSeconds = 0.1;
  record.fingerprints = kPrints;
  record.origin = {"r", "p", "i", "l"};
  record.files = {{"frames/frame.0007.exr", 3, "abc"}};
  record.counters = {{"rays", 1234567890123ull}};
  record.samples = {{7, "gbuffer", 1.0 / 3.0, "wall", true}};
  record.tables.emplace_back(kImages).add(0, 3, true, -1.0 / 0.0, "n"s);
  EXPECT_EQ(recordLine(parseRecord(recordLine(record), "test")), recordLine(record));
}

TEST(RunFolder, TrustsOnlyWhatIsUnchanged) {
  const fs::path path = freshFolder();
  {
    RunFolder folder(path, Existing::Error);
    for (int i = 1; i <= 5; ++i) addFrame(folder, i, "frame" + std::to_string(i));
  }
  fs::remove(path / "frames/frame.0002.exr");
  std::ofstream(path / "frames/frame.0003.exr") << "longer than before";
  std::ofstream(path / "frames/frame.0004.exr") << "frameX";
  // Of an earlier process with this one's number; and of one that lives.
  const std::string ending = "@" + processSpace() + ".abcdef.tmp";
  const std::string leftover = ".frame.0009.exr." + std::to_string(::getpid()) + ending;
  const std::string living = ".frame.0009.exr." + std::to_string(::getppid()) + ending;
  std::ofstream(path / "frames" / leftover) << "half";
  std::ofstream(path / "frames" / living) << "half";
  const RunFolder folder(path, Existing::Resume);
  EXPECT_EQ(folder.distrust(1, kPrints), "");
  EXPECT_EQ(folder.distrust(2, kPrints), "frames/frame.0002.exr is missing");
  EXPECT_EQ(folder.distrust(3, kPrints),
            "frames/frame.0003.exr does not have the size that was written");
  EXPECT_EQ(folder.distrust(4, kPrints),
            "frames/frame.0004.exr does not have the contents that were written");
  EXPECT_EQ(folder.distrust(6, kPrints), "it has no record");
  FrameFingerprints other = kPrints;
  other.scene = "t";
  other.build = "u";
  EXPECT_EQ(folder.distrust(5, other), "differences in scene, program");
  FrameFingerprints wanted = kPrints;
  auto& [config, scene, camera, build] = wanted;
  test::expectAllCount([&] { return folder.distrust(5, wanted); }, config, scene, camera, build);
  EXPECT_FALSE(fs::exists(path / "frames" / leftover));
  EXPECT_TRUE(fs::exists(path / "frames" / living));
}

TEST(RunFolder, NothingIsOverwrittenUnasked) {
  const fs::path path = freshFolder();
  { RunFolder folder(path, Existing::Error); }
  {
    RunFolder folder(path, Existing::Error);  // nothing in it yet
    addFrame(folder, 1, "x");
    EXPECT_EQ(
        outputError([&] { RunFolder second(path, Existing::Resume); }),
        path.string() +
            ": another process is writing this run; use --wait SECONDS, or choose another --out");
  }
  std::ofstream(path / "notes.txt") << "mine";
  EXPECT_THAT(outputError([&] { RunFolder folder(path, Existing::Error); }),
              testing::HasSubstr("use --existing resume to keep its finished frames"));
  EXPECT_TRUE(fs::exists(path / "frames/frame.0001.exr"));
  {
    RunFolder folder(path, Existing::Overwrite);
    EXPECT_TRUE(folder.holdsOldRun());
    EXPECT_TRUE(fs::exists(path / "frames.jsonl"));  // until the new run begins
    folder.begin();
    EXPECT_FALSE(folder.holdsOldRun());
  }
  EXPECT_FALSE(fs::exists(path / "frames/frame.0001.exr"));
  EXPECT_FALSE(fs::exists(path / "frames.jsonl"));
  EXPECT_TRUE(fs::exists(path / "notes.txt"));
}

TEST(RunFolder, OverwritingRemovesWhatRecordsName) {
  const fs::path path = freshFolder();
  {
    RunFolder folder(path, Existing::Error);
    addFrame(folder, 1, "x");
    folder.writeTimings();
    folder.writeSummary({});
  }
  const std::vector<std::string> foreign = {"frames/frame.0001.exr.bak", "frames/frame.0002.exr",
                                            "frames/notes.txt", "outside.exr"};
  for (const std::string& name : foreign) std::ofstream(path / name) << "mine";
  // A record cannot name files outside, or a link.
  fs::create_symlink(path / "outside.exr", path / "frames/frame.0003.exr");
  std::string records = readTextFile(path / "frames.jsonl");
  for (const std::string other :
       {"../outside.exr", "frames/../outside.exr", "/outside.exr", "frames/frame.0003.exr"}) {
    std::string line = readTextFile(path / "frames.jsonl");
    line.replace(line.find("frames/frame.0001.exr"), 21, other);
    records += line.replace(line.find("\"frame\":1"), 9, "\"frame\":2");
  }
  std::ofstream(path / "frames.jsonl") << records;
  RunFolder(path, Existing::Overwrite).begin();
  EXPECT_FALSE(fs::exists(path / "frames/frame.0001.exr"));
  for (const char* name : {"frames.jsonl", "timings.csv", "images.csv", "summary.json"})
    EXPECT_EQ(fs::exists(path / name), name == "images.csv"s) << name;  // no method's table here
  for (const std::string& name : foreign) EXPECT_EQ(readTextFile(path / name), "mine") << name;
  EXPECT_TRUE(fs::is_symlink(path / "frames/frame.0003.exr"));
}

TEST(RunFolder, FilesThatNoRunWroteAreNotReplaced) {
  const fs::path path = freshFolder();
  fs::create_directories(path / "frames");
  const auto message = [&](Existing existing) {
    const std::string text = outputError([&] { RunFolder folder(path, existing); });
    EXPECT_EQ(text, outputError([&] { RunFolder folder(path, existing, RunFolder::LookOnly{}); }));
    EXPECT_FALSE(fs::exists(path / ".lock"));
    return text;
  };
  for (const std::string name : {"summary.json", "table.md", "frames/frame.0001.exr"}) {
    std::ofstream(path / name) << "mine";
    for (const Existing existing : {Existing::Overwrite, Existing::Resume})
      EXPECT_THAT(message(existing), testing::HasSubstr(", but no run of this program")) << name;
    EXPECT_EQ(readTextFile(path / name), "mine");
    fs::remove(path / name);
  }
  // Of several methods' runs the folder above has tables.
  std::ofstream(path / "table.md") << "mine";
  EXPECT_THAT(outputError([&] { checkFolderOfRuns(path, {"traced"}); }),
              testing::HasSubstr("table.md, but no run of this program"));
  { RunFolder folder(path / "traced", Existing::Error); }
  EXPECT_EQ(outputError([&] { checkFolderOfRuns(path, {"traced"}); }), "(no error)");
}

TEST(RunFolder, SubfoldersAreNoLinks) {
  const fs::path path = freshFolder();
  fs::create_directories(path / "elsewhere");
  fs::create_directories(path / "run");
  fs::create_directory_symlink("../elsewhere", path / "run/frames");
  fs::create_directory_symlink("elsewhere", path / "traced");
  for (const Existing existing : {Existing::Overwrite, Existing::Resume})
    EXPECT_THAT(outputError([&] { RunFolder folder(path / "run", existing); }),
                testing::HasSubstr("run/frames: is a symbolic link"));
  EXPECT_THAT(outputError([&] { checkFolderOfRuns(path, {"traced"}); }),
              testing::HasSubstr("traced: is a symbolic link"));
  // The user may name a link to a folder.
  EXPECT_EQ(outputError([&] { RunFolder folder(path / "traced", Existing::Overwrite); }),
            "(no error)");
}

TEST(RunFolder, LookingChangesNothing) {
  const fs::path path = freshFolder();
  const auto look = [&](Existing existing) {
    const RunFolder folder(path, existing, RunFolder::LookOnly{});
    return folder.records().size();
  };
  EXPECT_EQ(look(Existing::Error), 0u);
  EXPECT_FALSE(fs::exists(path));
  {
    RunFolder folder(path, Existing::Error);
    addFrame(folder, 1, "x");
  }
  EXPECT_EQ(look(Existing::Resume), 1u);
  EXPECT_EQ(look(Existing::Overwrite), 0u);
  EXPECT_TRUE(fs::exists(path / "frames/frame.0001.exr"));
  EXPECT_EQ(outputError([&] { look(Existing::Error); }),
            outputError([&] { RunFolder folder(path, Existing::Error); }));
}

TEST(RunFolder, WhatIsDiscardedLeavesNothing) {
  const fs::path path = freshFolder();
  const auto startAndFail = [](const fs::path& folder) {
    RunFolder run(folder, Existing::Error);
    run.writeSummary({});
    run.discard();
  };
  startAndFail(path / "a/b");
  EXPECT_FALSE(fs::exists(path));
  // A folder that the user made stays, as empty as it was
  fs::create_directories(path / "mine");
  startAndFail(path / "mine");
  EXPECT_TRUE(fs::is_empty(path / "mine"));
  // Frames stay, and what was there before
  {
    RunFolder folder(path, Existing::Overwrite);
    addFrame(folder, 1, "x");
    folder.discard();
  }
  EXPECT_TRUE(fs::exists(path / "frames/frame.0001.exr"));
  std::ofstream(path / "mine/notes.txt") << "mine";
  RunFolder(path / "mine", Existing::Resume).discard();
  EXPECT_TRUE(fs::exists(path / "mine/notes.txt"));
}

TEST(RunFolder, TimingsAndSummaryComeFromTheRecords) {
  const fs::path path = freshFolder();
  {
    RunFolder folder(path, Existing::Error);
    folder.addStartup({{0, "scene", 0.5, "wall", false}});
    for (int i = 4; i >= 1; --i) addFrame(folder, i, "x");
    folder.writeTimings();
  }
  // A second process adds its own start-up.
  RunFolder folder(path, Existing::Resume);
  folder.addStartup({{0, "scene", 0.125, "wall", false}});
  folder.writeTimings();
  folder.writeSummary({{"config", "{\"a\":1}"}});
  EXPECT_THAT(readTextFile(path / "timings.csv"),
              testing::StartsWith("frame,step,seconds,clock,first\n"
                                  "0,scene,0.500000000,wall,0\n"
                                  "0,scene,0.125000000,wall,0\n"
                                  "1,gbuffer,0.250000000,wall,1\n"
                                  "1,encode,9.000000000,overlapped,0\n"
                                  "2,gbuffer,0.500000000,wall,0\n"));
  EXPECT_THAT(readTextFile(path / "images.csv"),
              testing::StartsWith("frame,image,object,planar,factor,note\n"
                                  "1,0,7,1,1,\"one, or \"\"two\"\"\"\n"
                                  "1,1,9,0,inf,\n"
                                  "2,0,7,1,1,\"one, or \"\"two\"\"\"\n"));
  const config::Value summary = config::parseFile(path / "summary.json");
  EXPECT_EQ(summary.get("steps").get("gbuffer").dump(),
            "{\"clock\":\"wall\",\"count\":4,\"max\":1,\"mean\":0.625,\"median\":0.625,"
            "\"min\":0.25,\"sum\":2.5}");
  EXPECT_EQ(summary.get("frame_seconds").get("max").asNumber(), 1.0);  // encode overlaps
  EXPECT_EQ(summary.get("startup").get("scene").get("count").asInteger(), 2);
  EXPECT_EQ(summary.get("counters").get("rays").get("sum").asInteger(), 40);
  EXPECT_EQ(summary.get("config").dump(), "{\"a\":1}");
}

TEST(RunFolder, RowsThatDoNotFitTheirTableAreRefused) {
  methods::Table table(kImages);
  EXPECT_THROW(table.add(0, 7, true, 1, "an integer where a real belongs"s), Error);
  EXPECT_THROW(table.add(0, 7), Error);
  EXPECT_TRUE(table.rows().empty());
}

TEST(RunFolder, BadRecordsAreNotTrusted) {
  const fs::path path = freshFolder();
  {
    RunFolder folder(path, Existing::Error);
    addFrame(folder, 1, "x");
  }
  std::ofstream(path / "frames.jsonl", std::ios::app) << "{\"frame\": 2, \"fing";
  const RunFolder folder(path, Existing::Resume);
  EXPECT_EQ(folder.distrust(1, kPrints), "");
  EXPECT_EQ(folder.distrust(2, kPrints), "it has no record");
}

TEST(RunFolder, RecordsAreAppendedAndTornOnesDropped) {
  const fs::path path = freshFolder();
  const fs::path file = path / "frames.jsonl";
  const auto identity = [&] {
    struct stat status {};
    EXPECT_EQ(::stat(file.c_str(), &status), 0);
    return status.st_ino;
  };
  {
    RunFolder folder(path, Existing::Error);
    addFrame(folder, 1, "x");
    const auto first = identity();
    const std::string before = readTextFile(file);
    addFrame(folder, 3, "y");
    addFrame(folder, 2, "z");
    EXPECT_EQ(identity(), first);  // not a new file
    EXPECT_TRUE(readTextFile(file).starts_with(before));
  }
  // Killed in the middle of a line: the frame is not known, all others are.
  const std::string whole = readTextFile(file);
  fs::resize_file(file, whole.size() - 20);
  {
    RunFolder folder(path, Existing::Resume);
    EXPECT_EQ(folder.distrust(1, kPrints), "");
    EXPECT_EQ(folder.distrust(3, kPrints), "");
    EXPECT_EQ(folder.distrust(2, kPrints), "it has no record");
    folder.forget(3);
    addFrame(folder, 2, "z");
    addFrame(folder, 4, "new");
  }
  const RunRecords known = readRunRecords(path);
  EXPECT_EQ(known.frames.size(), 3u);
  EXPECT_EQ(known.frames.count(3), 0u);
  const std::string text = readTextFile(file);
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 3);
}

TEST(RunFolder, TheLastRecordOfAFrameCounts) {
  const fs::path path = freshFolder();
  {
    RunFolder folder(path, Existing::Error);
    addFrame(folder, 1, "x");
    addFrame(folder, 1, "y");
  }
  EXPECT_EQ(readRunRecords(path).frames.size(), 1u);
  EXPECT_EQ(RunFolder(path, Existing::Resume).distrust(1, kPrints), "");
}

TEST(RunFolder, UnwritableFoldersAreOutputErrors) {
  const fs::path path = freshFolder();
  fs::create_directories(path);
  std::ofstream(path / "file") << "x";
  EXPECT_THAT(outputError([&] { RunFolder folder(path / "file", Existing::Error); }),
              testing::HasSubstr("cannot be created as a folder"));
}

}  // namespace
}  // namespace catoptric::run
