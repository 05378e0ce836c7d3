#include "core/input_files.h"

#include <gmock/gmock.h>

#include <chrono>
#include <fstream>

#include "core/file.h"

namespace catoptric {
namespace {

namespace fs = std::filesystem;

class Inputs : public testing::Test {
 protected:
  Inputs() : folder_(fs::path(testing::TempDir()) / "input_files") {
    fs::create_directories(folder_);
    write("scene", "a ball");
    write("path", "around it");
    const InputFiles::Recording recording(files_);
    for (const char* name : {"scene", "path"}) readTextFile(folder_ / name);
  }
  ~Inputs() override { fs::remove_all(folder_); }

  void write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name) << text;
  }
  /// Makes the last change of a file so old that its time tells something.
  void age(const std::string& name, int seconds) const {
    fs::last_write_time(folder_ / name,
                        fs::file_time_type::clock::now() - std::chrono::seconds(seconds));
  }

  fs::path folder_;
  InputFiles files_;
};

TEST_F(Inputs, AChangeIsNamed) {
  EXPECT_NO_THROW(files_.requireUnchanged());
  write("path", "around IT");  // of the same size, perhaps within the clock's resolution
  try {
    files_.requireUnchanged();
    FAIL() << "not noticed";
  } catch (const InputChanged& error) {
    EXPECT_EQ(error.code(), ExitCode::Usage);
    EXPECT_THAT(error.what(), testing::StartsWith((folder_ / "path").string() + " has changed"));
  }
}

TEST_F(Inputs, WhatIsSavedAgainAsItWasIsNoChange) {
  age("scene", 100);
  EXPECT_NO_THROW(files_.requireUnchanged());
  write("scene", "a ball");
  EXPECT_NO_THROW(files_.requireUnchanged());
  fs::remove(folder_ / "scene");
  EXPECT_THROW(files_.requireUnchanged(), InputChanged);
}

TEST_F(Inputs, AnOldFileIsReplaced) {
  age("scene", 100);
  EXPECT_NO_THROW(files_.requireUnchanged());  // now its time is known
  write("other", "a cube");
  age("other", 50);
  fs::rename(folder_ / "other", folder_ / "scene");
  EXPECT_THROW(files_.requireUnchanged(), InputChanged);
}

TEST_F(Inputs, OtherContentsOfTheSameFileAreAChange) {
  InputFiles later;
  const std::string before = files_.print();
  {
    const InputFiles::Recording recording(later);
    readTextFile(folder_ / "path");
  }
  files_.add(later);
  EXPECT_EQ(files_.print(), before);
  write("path", "straight on");
  InputFiles latest;
  {
    const InputFiles::Recording recording(latest);
    readTextFile(folder_ / "path");
  }
  EXPECT_NE(latest.print(), later.print());
  EXPECT_THROW(files_.add(latest), InputChanged);
}

TEST_F(Inputs, OnlyWhatIsReadWhileRecordingCounts) {
  write("output", "1");
  readTextFile(folder_ / "output");
  write("output", "2");
  EXPECT_NO_THROW(files_.requireUnchanged());
}

}  // namespace
}  // namespace catoptric
