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

TEST(Shrink, IsTheMeanInLinearLight) {
  // Black and white stripes: half the light, which sRGB shows as step 188
  Rgb8 stripes{6, 2, {}};
  for (int i = 0; i < 12; ++i) {
    const auto v = static_cast<std::uint8_t>(i % 2 == 0 ? 0 : 255);
    stripes.rgb.insert(stripes.rgb.end(), {v, v, 0});
  }
  EXPECT_THAT(shrink(stripes, 3, 1).rgb, ElementsAre(188, 188, 0, 188, 188, 0, 188, 188, 0));
  // 3 pixels to 2: the middle one counts half in each; (255 + 0 / 2) / 1.5 -> 2/3 of the light
  const Rgb8 three{3, 1, {255, 255, 255, 0, 0, 0, 255, 255, 255}};
  const int expected = static_cast<int>(std::lround(image::display8(2.0f / 3.0f)));
  EXPECT_THAT(shrink(three, 2, 1).rgb, testing::Each(expected));
  // Nothing changes at the same size
  EXPECT_EQ(shrink(stripes, 6, 2).rgb, stripes.rgb);
}

/// Dots of a picture as text.
std::string dots(const Rgb8& picture) {
  std::string text;
  for (int y = 0; y < picture.height; ++y) {
    for (int x = 0; x < picture.width; ++x)
      text += picture.rgb[(static_cast<std::size_t>(y) * picture.width + x) * 3] > 0 ? '#' : '.';
    text += '\n';
  }
  return text;
}

TEST(Font, DrawsAndCutsAtBorders) {
  Rgb8 picture{12, 9, std::vector<std::uint8_t>(12 * 9 * 3)};
  drawText(picture, 0, 0, 1, "Ag", {255, 255, 255});
  EXPECT_EQ(dots(picture),
            ".###........\n"
            "#...#.......\n"
            "#...#..####.\n"
            "#####.#...#.\n"
            "#...#.#...#.\n"
            "#...#.#...#.\n"
            "#...#..####.\n"
            "..........#.\n"
            ".......###..\n");
  EXPECT_EQ(textWidth("Ag", 1), 11);
  EXPECT_EQ(textWidth("Ag", 3), 33);
  EXPECT_NO_THROW(drawText(picture, -7, 6, 4, "W\xC3\xA4", {255, 255, 255}));
}

TEST(Font, AllLettersDiffer) {
  std::set<std::string> shapes;
  for (char c = ' '; c <= '~'; ++c) {
    Rgb8 picture{6, 9, std::vector<std::uint8_t>(6 * 9 * 3)};
    drawText(picture, 0, 0, 1, std::string(1, c), {255, 255, 255});
    EXPECT_TRUE(shapes.insert(dots(picture)).second) << c;
  }
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
    Rgb8 picture{width, height, {}};
    picture.rgb.resize(static_cast<std::size_t>(width) * height * 3);
    fillRectangle(picture, 0, 0, width, height, colour);
    writeFileAtomically(file, image::encodePng(width, height, 3, picture.rgb));
    run.previews[number] = file;
  }
  std::filesystem::path folder_;
};

Colour at(const Rgb8& picture, int x, int y) {
  const auto* p = &picture.rgb[(static_cast<std::size_t>(y) * picture.width + x) * 3];
  return {p[0], p[1], p[2]};
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
  const Rgb8 sheet = contactSheet(runs, options);
  // Margins 16, gap 8, cells 50 x 25, two lines of text above the first row, one above the second
  ASSERT_EQ(sheet.width, 16 + 50 + 8 + 50 + 16);
  ASSERT_EQ(sheet.height, 16 + 24 + (24 + 25) + 8 + (24 + 25) + 16);
  EXPECT_EQ(at(sheet, 16, 64), red);
  EXPECT_EQ(at(sheet, 65, 88), red);
  EXPECT_EQ(at(sheet, 74, 64), green);
  EXPECT_EQ(at(sheet, 123, 145), blue);
  // The frame that the reference lacks is grey, neither black nor another frame
  EXPECT_EQ(at(sheet, 17, 122), (Colour{44, 46, 50}));
}

TEST_F(Sheet, OneRunFillsAGridAndKeepsShapes) {
  std::vector<RunData> runs(1);
  runs[0].name = "traced";
  const Colour red{200, 0, 0};
  for (int i = 1; i <= 4; ++i) addPreview(runs[0], i, 40, 40, red);
  addPreview(runs[0], 5, 40, 20, red);  // of another shape: letterboxed
  SheetOptions options;
  options.maxColumns = 3;
  const Rgb8 sheet = contactSheet(runs, options);
  ASSERT_EQ(sheet.width, 16 + 3 * 40 + 2 * 8 + 16);  // not enlarged to 320
  ASSERT_EQ(sheet.height, 16 + (27 + 8) + 2 * (24 + 40) + 8 + 16);
  const int secondRow = 16 + 35 + 24 + 40 + 8 + 24;
  EXPECT_EQ(at(sheet, 16, secondRow), red);
  EXPECT_NE(at(sheet, 16 + 48, secondRow), red);
  EXPECT_EQ(at(sheet, 16 + 48, secondRow + 10), red);
  const auto png = contactSheetPng(runs, options);
  EXPECT_EQ(image::decodeImage8(png, "sheet", 1 << 20).width, sheet.width);
}

TEST_F(Sheet, NothingToShowIsAnError) {
  const std::vector<RunData> runs(2);
  EXPECT_THROW(contactSheet(runs), UsageError);
}

}  // namespace
}  // namespace catoptric::report
