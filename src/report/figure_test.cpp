#include "report/figure.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <random>

#include "core/error.h"
#include "core/file.h"
#include "image/image.h"

namespace catoptric::report {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

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

/// Frames of 8 x 4 pixels whose red display step is 10 x and whose green one 20 y.
class Frames : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() /
              ("catoptric_figure_" + std::to_string(std::random_device{}()));
    std::filesystem::create_directories(folder_);
    frame_ = write("frame.exr", 0);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  /// Red is `more` steps brighter from row `top` on; the mask has the pixel (1, 0).
  std::filesystem::path write(const std::string& name, int more, int top = 0) {
    image::Image image{8, 4, {"R", "G", "B", "mask.sky"}, {}};
    for (int i = 0; i < 32; ++i) {
      const auto linear = [](int step) {
        const double v = step / 255.0;
        return static_cast<float>(v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4));
      };
      image.data.insert(image.data.end(), {linear(10 * (i % 8) + (i / 8 < top ? 0 : more)),
                                           linear(20 * (i / 8)), 0.0f, i == 1 ? 0.5f : 0.0f});
    }
    image::ExrOptions options;
    options.halfBeauty = false;
    writeFileAtomically(folder_ / name, image::encodeExr(image, options));
    return folder_ / name;
  }
  static Colour at(const Rgb8& picture, int x, int y) {
    const auto* p = &picture.rgb[(static_cast<std::size_t>(y) * picture.width + x) * 3];
    return {p[0], p[1], p[2]};
  }
  std::filesystem::path folder_;
  std::filesystem::path frame_;
};

TEST_F(Frames, PartsAreEnlargedByWholePixels) {
  Shown shown;
  shown.frame = frame_;
  EXPECT_EQ(at(pictureOf(shown), 7, 3), (Colour{70, 60, 0}));
  shown.crop = {5, 1, 3, 2};
  shown.zoom = 4;
  const Rgb8 part = pictureOf(shown);
  ASSERT_EQ(part.width, 12);
  ASSERT_EQ(part.height, 8);
  for (int y = 0; y < 8; ++y)
    for (int x = 0; x < 12; ++x)
      EXPECT_EQ(at(part, x, y), (Colour{static_cast<std::uint8_t>(10 * (5 + x / 4)),
                                        static_cast<std::uint8_t>(20 * (1 + y / 4)), 0}));
  for (const Crop& outside : {Crop{6, 0, 3, 1}, Crop{-1, 0, 3, 1}, Crop{0, 4, 1, 1}}) {
    shown.crop = outside;
    try {
      pictureOf(shown);
      FAIL() << outside.x;
    } catch (const UsageError& error) {
      EXPECT_THAT(error.what(), HasSubstr("is outside the frame"));
      EXPECT_THAT(error.what(), HasSubstr("which has 8 x 4 pixels"));
    }
  }
}

TEST_F(Frames, DifferencesMasksAndLayers) {
  const std::filesystem::path other = write("other.exr", 3);
  Shown shown;
  shown.frame = frame_;
  shown.against = other;
  shown.difference = 50;
  EXPECT_EQ(at(pictureOf(shown), 4, 2), (Colour{150, 0, 0}));
  shown.difference = 100;  // clamped
  EXPECT_EQ(at(pictureOf(shown), 4, 2), (Colour{255, 0, 0}));
  EXPECT_DOUBLE_EQ(l1Of(frame_, other, false), 1.0);  // 3 steps in one of three channels
  const std::filesystem::path part = write("part.exr", 3, 2);
  EXPECT_DOUBLE_EQ(l1Of(frame_, part, false), 0.5);
  EXPECT_DOUBLE_EQ(l1Of(frame_, part, false, {1, 0, 7, 2}), 0.0);
  EXPECT_DOUBLE_EQ(l1Of(frame_, part, false, {1, 1, 4, 3}), 2.0 / 3.0);
  EXPECT_THROW(l1Of(frame_, part, false, {1, 1, 4, 4}), UsageError);
  Shown masked;
  masked.frame = frame_;
  masked.mask = "sky";
  EXPECT_EQ(at(pictureOf(masked), 1, 0), (Colour{255, 30, 20}));
  EXPECT_EQ(at(pictureOf(masked), 2, 0), (Colour{20, 0, 0}));
  masked.mask.clear();
  masked.layer = "mask.sky";
  EXPECT_EQ(at(pictureOf(masked), 1, 0), (Colour{128, 128, 128}));
  masked.layer = "cluster";
  EXPECT_THROW(pictureOf(masked), UsageError);
}

Rgb8 flat(int width, int height, Colour colour) {
  Rgb8 picture{width, height, {}};
  for (int i = 0; i < width * height; ++i)
    picture.rgb.insert(picture.rgb.end(), colour.begin(), colour.end());
  return picture;
}

TEST_F(Frames, PanelsStandWhereTheyShould) {
  Figure figure{"",
                {{"", {{"a", flat(50, 20, {200, 0, 0})}, {"", flat(50, 20, {0, 200, 0})}}},
                 {"", {{"", flat(50, 10, {0, 0, 200})}, {"", {}}}}}};
  const auto bytes = drawFigure(figure, "f.png");
  EXPECT_EQ(bytes, drawFigure(figure, "f.png"));
  const image::Image8 png = image::decodeImage8(bytes, "f", 1 << 20);
  const auto pixel = [&](int x, int y) {
    const auto* p = &png.rgba[(static_cast<std::size_t>(y) * png.width + x) * 4];
    return Colour{p[0], p[1], p[2]};
  };
  // Gaps of 6, a line of 20 above the first row
  ASSERT_EQ(png.width, 50 + 6 + 50);
  ASSERT_EQ(png.height, 20 + 20 + 6 + 10);
  EXPECT_EQ(pixel(0, 20), (Colour{200, 0, 0}));
  EXPECT_EQ(pixel(49, 39), (Colour{200, 0, 0}));
  EXPECT_EQ(pixel(50, 20), (Colour{255, 255, 255}));
  EXPECT_EQ(pixel(56, 20), (Colour{0, 200, 0}));
  EXPECT_EQ(pixel(0, 46), (Colour{0, 0, 200}));
  EXPECT_EQ(pixel(105, 55), (Colour{221, 221, 221})) << "missing";
  bool text = false;
  for (int y = 0; y < 20; ++y)
    for (int x = 0; x < 28; ++x) text = text || pixel(x, y)[0] < 128;
  EXPECT_TRUE(text);
}

TEST_F(Frames, LabelsAreText) {
  const Figure figure{"Title", {{"row", {{"a < b, L1_8bit 0.5", flat(300, 9, {1, 2, 3})}}}}};
  const auto textOf = [&](const char* file) {
    const auto bytes = drawFigure(figure, file);
    EXPECT_EQ(bytes, drawFigure(figure, file));
    return std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  };
  const std::string svg = textOf("f.svg");
  EXPECT_THAT(svg, HasSubstr(">a &lt; b, L1_8bit 0.5</text>"));
  EXPECT_THAT(svg, HasSubstr(">Title</text>"));
  EXPECT_THAT(svg, HasSubstr("<image x=\"0\" y=\"68\" width=\"300\" height=\"9\""));
  EXPECT_THAT(textOf("f.pdf"), HasSubstr("DejaVuSans"));
  EXPECT_THROW(drawFigure(figure, "f.jpg"), UsageError);
  // What is too wide becomes smaller, then is cut; what is no UTF-8 is drawn, too
  const Figure narrow{"",
                      {{"",
                        {{"traced by the other program, frame 12 of 900", flat(60, 9, {1, 2, 3})},
                         {"a\xFFz", flat(60, 9, {1, 2, 3})}}}}};
  const auto bytes = drawFigure(narrow, "f.svg");
  const std::string text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  EXPECT_THAT(text, HasSubstr("font-size=\"9\""));
  EXPECT_THAT(text, HasSubstr("…</text>"));
  EXPECT_THAT(text, HasSubstr("a\\xffz"));
}

}  // namespace
}  // namespace catoptric::report
