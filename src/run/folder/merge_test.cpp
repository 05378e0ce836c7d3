// What merge joins, what it refuses, and what it says of parts from unlike machines.
#include "run/folder/merge.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>

#include "config/json.h"
#include "core/error.h"
#include "core/file.h"
#include "core/hash.h"
#include "core/log.h"

namespace catoptric::run {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

const FrameOrigin kOrigin{"llvmpipe (LLVM 15.0.6, 256 bits)", "CPU A", "Embree avx2, x86-64-v3",
                          "light 1"};

class Merging : public testing::Test {
 protected:
  Merging() {
    const auto* info = testing::UnitTest::GetInstance()->current_test_info();
    folder_ = fs::path(testing::TempDir()) / (std::string("merge_") + info->name());
    fs::remove_all(folder_);
    log::setFormatter([this](log::Level level, const std::string& message) {
      if (level == log::Level::Warning) warnings_.push_back(message);
      return "";
    });
  }
  ~Merging() override { log::setFormatter({}); }

  /// The run `name` has these frames, each a file of `contents` and its number.
  void addPart(const std::string& name, const std::vector<int>& frames,
               const std::function<void(FrameRecord&)>& change = {},
               const std::string& contents = "pixels of frame ") {
    RunFolder folder(folder_ / name, Existing::Error);
    for (const int number : frames) {
      const std::string text = contents + std::to_string(number);
      FrameRecord record;
      record.frame = number;
      record.fingerprints = {"config", "scene", "camera", "build"};
      record.origin = kOrigin;
      if (change) change(record);
      Fingerprint content;
      content.add(std::as_bytes(std::span(text)));
      const std::string path = framePath("frames", number, ".exr");
      folder.writeFile(path, std::as_bytes(std::span(text)));
      record.files = {{path, text.size(), content.text()}};
      folder.add(record);
    }
    folder.writeSummary({{"sequence", R"({"frames": "1-4", "chunk": 1, "chunks": 2})"}});
  }
  /// Empty when they are merged; else why not.
  std::string merge(const std::vector<std::string>& names, const std::string& out = "whole") {
    std::vector<fs::path> parts;
    for (const std::string& name : names) parts.push_back(folder_ / name);
    try {
      mergeRuns(parts, folder_ / out, Existing::Overwrite);
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  }

  fs::path folder_;
  std::vector<std::string> warnings_;
};

TEST_F(Merging, TheSameFrameTwiceMustBeTheSameInEveryByte) {
  addPart("a", {1, 2, 3});
  addPart("b", {3, 4});
  EXPECT_EQ(merge({"a", "b"}), "");
  addPart("other", {3, 4}, {}, "pixelX of frame ");  // as long as the others
  EXPECT_THAT(merge({"a", "other"}), HasSubstr("frames 3 are also in another part"));
  addPart("moved", {3, 4}, [](FrameRecord& r) { r.fingerprints.camera = "x"; });
  EXPECT_THAT(merge({"a", "moved"}), HasSubstr("frames 3 are also in another part"));
}

TEST_F(Merging, TheWholeIsInsideNoPart) {
  addPart("a", {1, 2});
  addPart("b", {3, 4});
  for (const std::string out : {"b/whole", "a/frames", "a/../b/x/"})
    EXPECT_THAT(merge({"a", "b"}, out), HasSubstr(": --out is inside this part")) << out;
  EXPECT_THAT(merge({"a", "b"}, "b"), HasSubstr("b: is --out itself"));
  fs::rename(folder_ / "a", folder_ / "ab");
  EXPECT_EQ(merge({"ab", "b"}, "abc"), "");  // a name that begins alike
}

TEST_F(Merging, WhatPixelsDependOnMustAgree) {
  addPart("a", {1, 2});
  const std::vector<std::pair<std::string, std::function<void(FrameRecord&)>>> changes{
      {"method or image settings", [](FrameRecord& r) { r.fingerprints.config = "x"; }},
      {"scene", [](FrameRecord& r) { r.fingerprints.scene = "x"; }},
      {"program", [](FrameRecord& r) { r.fingerprints.build = "x"; }},
      {"renderer", [](FrameRecord& r) { r.origin.renderer = "llvmpipe (LLVM 16.0.0, 256 bits)"; }},
      {"renderer", [](FrameRecord& r) { r.origin.renderer = "NVIDIA H100"; }}};
  for (std::size_t i = 0; i < changes.size(); ++i) {
    const std::string name = "b" + std::to_string(i);
    addPart(name, {3, 4}, changes[i].second);
    EXPECT_THAT(merge({"a", name}),
                HasSubstr("frames 3-4 differ in " + changes[i].first + " from"));
  }
  EXPECT_FALSE(fs::exists(folder_ / "whole"));
}

TEST_F(Merging, AlikeMachinesNeedNoWord) {
  addPart("a", {1, 2});
  addPart("b", {3, 4});
  EXPECT_EQ(merge({"a", "b"}), "");
  EXPECT_THAT(warnings_, IsEmpty());
  const config::Value machines = config::parseFile(folder_ / "whole/summary.json").get("machines");
  ASSERT_EQ(machines.asArray().size(), 1u);
  EXPECT_EQ(machines.asArray()[0].get("frames").asString(), "1-4");
}

TEST_F(Merging, UnlikeMachinesAreNamedWithTheirFrames) {
  addPart("a", {1, 4});
  addPart("b", {2}, [](FrameRecord& r) {
    r.origin.processor = "CPU B";
    r.origin.instructions = "Embree sse4.2, x86-64-v2";
    r.origin.renderer = "llvmpipe (LLVM 15.0.6, 128 bits)";
  });
  addPart("c", {3}, [](FrameRecord& r) { r.origin.light = "light 2"; });
  EXPECT_EQ(merge({"a", "b", "c"}), "");
  EXPECT_THAT(
      warnings_,
      ElementsAre(
          HasSubstr("rendered on 2 kinds of machines"),
          "  3 frames (1,3-4) on CPU A, Embree avx2, x86-64-v3, llvmpipe (LLVM 15.0.6, 256 bits)",
          "  1 frame (2) on CPU B, Embree sse4.2, x86-64-v2, llvmpipe (LLVM 15.0.6, 128 bits)",
          HasSubstr("2 different bakes")));
  const config::Value machines = config::parseFile(folder_ / "whole/summary.json").get("machines");
  ASSERT_EQ(machines.asArray().size(), 3u);
  EXPECT_EQ(machines.asArray()[0].get("processor").asString(), "CPU B");
  EXPECT_EQ(machines.asArray()[0].get("frames").asString(), "2");
}

}  // namespace
}  // namespace catoptric::run
