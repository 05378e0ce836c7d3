// A page of many cases, of which a tenth fails. With NIGHTLY_PAGE=DIR there are 2,000, and the
// pages are kept there for tests/nightly_page.py to open them in a browser.
#include "nightly/page.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <regex>
#include <sstream>

#include "core/error.h"
#include "core/file.h"
#include "nightly/judge_night.h"
#include "nightly/pictures.h"

namespace catoptric::nightly {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::Not;

const char* const kKept = std::getenv("NIGHTLY_PAGE");
const int kCases = kKept != nullptr ? 2000 : 200;
const int kFailures = kCases / 10;

std::string nameOf(int number) {
  return "own.scene_" + std::to_string(number / 10) + ".method_" + std::to_string(number % 10);
}

/// A sphere before a sky, which `steps` makes lighter.
void writeFrame(const fs::path& file, int number, float lighter) {
  image::Image picture{128, 96, {"R", "G", "B", "id.object", "mask.reflective"}, {}};
  for (int y = 0; y < 96; ++y)
    for (int x = 0; x < 128; ++x) {
      const float u = (static_cast<float>(x) - 64.0f) / 40.0f;
      const float v = (static_cast<float>(y) - 48.0f) / 40.0f;
      const float inside = 1.0f - u * u - v * v;
      const bool ball = inside > 0.0f;
      const float light = ball ? 0.1f + 1.4f * inside * (0.6f - 0.4f * u - 0.4f * v) + lighter
                               : 0.3f + 0.004f * static_cast<float>(y);
      picture.data.insert(picture.data.end(),
                          {light * (ball ? 1.0f : 0.6f), light * 0.8f,
                           light * (ball ? 0.3f + 0.03f * static_cast<float>(number % 20) : 1.0f),
                           ball ? 7.0f : 8.0f, ball ? 1.0f : 0.0f});
    }
  fs::create_directories(file.parent_path());
  const std::vector<std::byte> bytes = image::encodeExr(picture, {});
  std::ofstream(file).write(reinterpret_cast<const char*>(bytes.data()),
                            static_cast<std::streamsize>(bytes.size()));
}

class LargePage : public testing::Test {
 protected:
  LargePage() {
    std::error_code error;
    const fs::path quick = fs::is_directory("/dev/shm", error) ? "/dev/shm" : testing::TempDir();
    folder = quick / ("catoptric_page_" + std::to_string(::getpid()));
    fs::remove_all(folder);
    history = std::make_unique<History>(folder / "history.db", History::Mode::Create);
    makeNights();
  }
  ~LargePage() override {
    history.reset();
    fs::remove_all(folder);
  }

  void makeNights() {
    for (int i = 1; i <= 3; ++i) {
      night = {0,         "own",
               "p",       "full",
               "machine", "build" + std::to_string(i),
               "1.0",     "2026-01-0" + std::to_string(i) + "T00:00:00Z",
               "",        false};
      night.id = history->beginNight(night);
      const int cases = i == 3 ? kCases : kFailures;
      std::vector<Verdict> verdicts;
      for (int number = 0; number < cases; ++number) addCase(number, i, verdicts);
      if (i == 1) accept();
      history->judge(night.id, verdicts, {}, "2026-01-01T01:00:00Z");
    }
  }

  void addCase(int number, int ofNight, std::vector<Verdict>& verdicts) {
    CaseFacts facts;
    facts.name = nameOf(number);
    facts.bench = "bench";
    facts.description = "object 7 ball\nobject 8 floor\n";
    facts.command = "catoptric render configs/x.json --set 'a=\"b<c>\"'";
    const bool fails = number < kFailures;
    const bool hasFrame = fails && ofNight != 2;
    if (hasFrame) {
      FrameFacts frame{
          "p" + std::to_string(ofNight), {{"rays", 100}}, {{"reflect", 0.01}}, "", 1, 0};
      frame.file = "nights/" + std::to_string(night.id) + "/" + facts.name + "/f.exr";
      writeFrame(folder / frame.file, number, ofNight == 3 ? 0.02f : 0.0f);
      facts.frames[12] = frame;
    }
    history->addResult(night.id, facts);
    for (const char* kind : {"run", "time", "creep", "memory"}) {
      Verdict verdict;
      verdict.name = facts.name;
      verdict.kind = kind;
      verdict.status = "holds";
      verdict.value = 1.0 + 0.01 * ofNight;
      if (fails && ofNight == 3 && std::string(kind) == "time") {
        verdict.status = "slower";
        verdict.outcome = Outcome::Regression;
        verdict.value = 1.3;
        verdict.began = 3;
        verdict.lastGood = "build2";
        verdict.firstBad = "build3";
        verdict.message = "takes 1.30 times as long & <more>";
      }
      verdicts.push_back(verdict);
    }
    Verdict picture;
    picture.name = facts.name;
    picture.kind = "picture";
    picture.status = fails && ofNight == 3 ? "changed" : "same";
    picture.outcome = fails && ofNight == 3 ? Outcome::Regression : Outcome::Good;
    picture.frame = fails && ofNight == 3 ? 12 : 0;
    picture.message = "L1_8bit 1.2 (limit 0.05)";
    verdicts.push_back(picture);
  }

  void accept() {
    std::vector<History::Acceptance> accepted;
    for (int number = 0; number < kFailures; ++number) {
      const fs::path file = folder / "nights" / std::to_string(night.id) / nameOf(number) / "f.exr";
      accepted.push_back({nameOf(number),
                          "bench",
                          {{12, "p1", storeFrame(*history, file), {}, 1, night.id}},
                          {},
                          {},
                          0});
    }
    history->accept({0, "2026-01-01T00:10:00Z", "me", "*", "first <night>", ""}, night.id,
                    accepted);
  }

  static std::string textOf(const fs::path& file) {
    std::ostringstream text;
    text << std::ifstream(file).rdbuf();
    return text.str();
  }

  fs::path folder;
  std::unique_ptr<History> history;
  Night night;
};

TEST_F(LargePage, ItIsStrictAndWithinItsSize) {
  const fs::path out = kKept != nullptr ? fs::path(kKept) : folder / "out";
  PageOptions options{"Own & all", out / "folder", false, "history.db"};
  const std::vector<Verdict> verdicts = history->verdicts(night.id);
  const std::string page = textOf(writePage(*history, night, verdicts, options));
  // Nothing that a strict Content-Security-Policy refuses
  for (const char* refused : {"<style", " style=", "<script>", "data:", "onclick", "javascript:"})
    EXPECT_THAT(page, Not(HasSubstr(refused)));
  EXPECT_THAT(page, HasSubstr("<script src=\"nightly.js\"></script>"));
  EXPECT_THAT(page, HasSubstr(std::to_string(kCases) + " cases: " + std::to_string(kFailures) +
                              " regressions"));
  EXPECT_THAT(page, HasSubstr("since night 3; last good build build2, first bad build build3"));
  EXPECT_THAT(page, Not(HasSubstr("<more>")));
  // Failures come first, and every address leads somewhere
  EXPECT_LT(page.find("<article"), page.find("<h2>All cases"));
  std::set<std::string> ids;
  const std::regex id("id=\"([^\"]*)\"");
  for (std::sregex_iterator at(page.begin(), page.end(), id), end; at != end; ++at)
    EXPECT_TRUE(ids.insert((*at)[1]).second) << (*at)[1];
  EXPECT_EQ(static_cast<int>(ids.size()), kFailures + 1);
  int sources = 0;
  const std::regex source("(src|data-[a-z]+-[a-z]+)=\"([^\"]*)\"");
  for (std::sregex_iterator at(page.begin(), page.end(), source), end; at != end; ++at, ++sources)
    EXPECT_TRUE(fs::exists(out / "folder" / std::string((*at)[2]))) << (*at)[2];
  EXPECT_EQ(sources, kFailures * 9 + 1);  // 4 pictures, 4 exposures, a curve; and the script

  fs::create_directories(out / "other" / "pictures");
  std::ofstream(out / "other" / "pictures" / "mine.png") << "mine";
  options.out = out / "other";
  EXPECT_THROW(writePage(*history, night, verdicts, options), OutputError);
  EXPECT_TRUE(fs::exists(out / "other" / "pictures" / "mine.png"));

  options.out = out / "single";
  options.singleFile = true;
  const fs::path file = writePage(*history, night, verdicts, options);
  EXPECT_LE(fs::file_size(file), kSingleFileBytes);
  const std::string single = textOf(file);
  EXPECT_THAT(single, Not(HasSubstr("src=\"pictures")));
  EXPECT_THAT(single, HasSubstr("data:image/png;base64,"));
  std::printf("folder's page %zu bytes, single file %zu bytes\n", page.size(), single.size());
}

}  // namespace
}  // namespace catoptric::nightly
