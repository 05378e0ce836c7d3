#include "report/contact_sheet.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <random>

#include "core/error.h"
#include "core/file.h"
#include "image/image.h"

namespace catoptric::report {
namespace {

using ::testing::ElementsAre;

TEST(Spread, KeepsFirstAndLast) {
  const std::vector<int> all{1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11};
  EXPECT_THAT(spread(all, 3), ElementsAre(1, 6, 11));
  EXPECT_THAT(spread(all, 2), ElementsAre(1, 11));
  EXPECT_THAT(spread(all, 1), ElementsAre(1));
  EXPECT_EQ(spread(all, 11), all);
  EXPECT_EQ(spread(all, 20), all);
}

class Sheet : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() /
              ("catoptric_sheet_" + std::to_string(std::random_device{}()));
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  /// A preview of one colour.
  void addPreview(RunData& run, int number, int width, int height, Colour colour) {
    const auto file = folder_ / run.name / ("frame." + std::to_string(number) + ".png");
    std::filesystem::create_directories(file.parent_path());
    std::vector<std::uint8_t> rgb;
    for (int i = 0; i < width * height; ++i) rgb.insert(rgb.end(), colour.begin(), colour.end());
    writeFileAtomically(file, image::encodePng(width, height, 3, rgb));
    run.previews[number] = file;
  }
  std::filesystem::path folder_;
};

Colour firstPixel(const Panel& panel) {
  return {panel.picture.rgb[0], panel.picture.rgb[1], panel.picture.rgb[2]};
}

TEST_F(Sheet, RowsAreMethodsAndColumnsAreFrames) {
  std::vector<RunData> runs(2);
  runs[0].name = "traced";
  runs[1].name = "reference";
  const Colour red{200, 0, 0};
  const Colour green{0, 200, 0};
  const Colour blue{0, 0, 200};
  addPreview(runs[0], 1, 100, 50, red);
  addPreview(runs[0], 2, 100, 50, green);
  addPreview(runs[1], 2, 100, 50, blue);
  SheetOptions options;
  options.cellWidth = 50;
  options.captions["traced"] = "12 ms";
  const Figure sheet = contactSheet(runs, options);
  ASSERT_EQ(sheet.rows.size(), 2u);
  EXPECT_EQ(sheet.rows[0].heading, "traced   12 ms");
  EXPECT_EQ(sheet.rows[1].heading, "reference");
  const std::vector<Panel>& first = sheet.rows[0].panels;
  ASSERT_EQ(first.size(), 2u);
  EXPECT_EQ(first[1].label, "frame 2");
  EXPECT_EQ(first[0].picture.width, 50);
  EXPECT_EQ(first[0].picture.height, 25);
  EXPECT_EQ(firstPixel(first[0]), red);
  EXPECT_EQ(firstPixel(first[1]), green);
  EXPECT_EQ(sheet.rows[1].panels[0].picture.width, 0) << "a frame that the reference lacks";
  EXPECT_EQ(firstPixel(sheet.rows[1].panels[1]), blue);
}

TEST_F(Sheet, OneRunFillsAGridAndKeepsShapes) {
  std::vector<RunData> runs(1);
  runs[0].name = "traced";
  for (int i = 1; i <= 4; ++i) addPreview(runs[0], i, 40, 40, {200, 0, 0});
  addPreview(runs[0], 5, 40, 20, {200, 0, 0});  // of another shape
  SheetOptions options;
  options.maxColumns = 3;
  options.title = "run";
  const Figure sheet = contactSheet(runs, options);
  EXPECT_EQ(sheet.title, "run: traced");
  ASSERT_EQ(sheet.rows.size(), 2u);
  EXPECT_EQ(sheet.rows[0].panels.size(), 3u);
  ASSERT_EQ(sheet.rows[1].panels.size(), 2u);
  EXPECT_EQ(sheet.rows[1].panels[0].picture.width, 40) << "not enlarged";
  EXPECT_EQ(sheet.rows[1].panels[1].picture.height, 20);
}

TEST_F(Sheet, NothingToShowIsAnError) {
  const std::vector<RunData> runs(2);
  EXPECT_THROW(contactSheet(runs), UsageError);
}

}  // namespace
}  // namespace catoptric::report
