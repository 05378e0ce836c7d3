#include "image/hdr.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "core/error.h"

namespace catoptric::image {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::vector<std::byte> bytesOf(const std::string& text) {
  const auto* first = reinterpret_cast<const std::byte*>(text.data());
  return {first, first + text.size()};
}

std::string header(const std::string& size, const std::string& more = "") {
  return "#?RADIANCE\n# a comment\n" + more + "FORMAT=32-bit_rle_rgbe\n\n" + size + "\n";
}

Image decode(const std::string& text) {
  return decodeHdr(bytesOf(text), "sky.hdr", 1 << 20);
}

std::string hdrError(const std::string& text) {
  try {
    decode(text);
  } catch (const SceneError& error) {
    return error.what();
  }
  return "no error";
}

std::string rgbe(int r, int g, int b, int e) {
  return {static_cast<char>(r), static_cast<char>(g), static_cast<char>(b), static_cast<char>(e)};
}

TEST(Hdr, FlatPixelsHaveTheirExponent) {
  // mantissa / 256 * 2^(e - 128)
  const Image image = decode(header("-Y 1 +X 3") + rgbe(128, 64, 32, 129) + rgbe(255, 0, 1, 136) +
                             rgbe(9, 9, 9, 0));
  EXPECT_THAT(image.channels, ElementsAre("R", "G", "B"));
  EXPECT_THAT(image.data, ElementsAre(1.0f, 0.5f, 0.25f, 255.0f, 0.0f, 1.0f, 0.0f, 0.0f, 0.0f));
}

TEST(Hdr, ExposureIsDividedOut) {
  const Image image =
      decode(header("-Y 1 +X 1", "EXPOSURE=4\nEXPOSURE= 0.5\n") + rgbe(128, 128, 128, 129));
  EXPECT_THAT(image.data, ElementsAre(0.5f, 0.5f, 0.5f));
}

TEST(Hdr, OldRunsRepeatThePixelBefore) {
  const Image image =
      decode(header("-Y 1 +X 4") + rgbe(128, 0, 0, 129) + rgbe(1, 1, 1, 2) + rgbe(0, 128, 0, 129));
  EXPECT_THAT(image.data, ElementsAre(1, 0, 0, 1, 0, 0, 1, 0, 0, 0, 1, 0));
  EXPECT_THAT(hdrError(header("-Y 1 +X 4") + rgbe(1, 1, 1, 2)),
              HasSubstr("a run extends beyond the end of its row"));
  EXPECT_THAT(hdrError(header("-Y 1 +X 4") + rgbe(5, 1, 1, 2) + rgbe(1, 1, 1, 4)),
              HasSubstr("a run extends beyond the end of its row"));
}

TEST(Hdr, NewRunsAndLiterals) {
  std::string row = rgbe(2, 2, 0, 8);
  row += std::string{char(128 + 8), char(128)};             // R: run of 8
  row += std::string{8, 0, 16, 32, 48, 64, 80, 96, 112};    // G: literal
  row += std::string{char(128 + 3), 64, 5, 1, 2, 3, 4, 5};  // B: both
  row += std::string{char(128 + 8), char(136)};             // E
  const Image image = decode(header("-Y 2 +X 8") + row + row);
  for (int y = 0; y < 2; ++y)
    for (int x = 0; x < 8; ++x) {
      EXPECT_EQ(image.at(x, y, 0), 128.0f);
      EXPECT_EQ(image.at(x, y, 1), 16.0f * static_cast<float>(x));
      EXPECT_EQ(image.at(x, y, 2), x < 3 ? 64.0f : static_cast<float>(x - 2));
    }
  EXPECT_THAT(hdrError(header("-Y 1 +X 9") + rgbe(2, 2, 0, 8)),
              HasSubstr("does not have the image's width"));
}

TEST(Hdr, EveryTruncationIsAnError) {
  std::string row = rgbe(2, 2, 0, 8);
  for (int c = 0; c < 4; ++c) row += std::string{char(128 + 8), char(100 + c)};
  const std::string whole = header("-Y 2 +X 8") + row + row;
  ASSERT_NO_THROW(decode(whole));
  for (std::size_t size = 0; size < whole.size(); ++size)
    EXPECT_THROW(decode(whole.substr(0, size)), SceneError) << size;
}

TEST(Hdr, FlippedBitsNeverCrash) {
  std::string row = rgbe(2, 2, 0, 8);
  for (int c = 0; c < 4; ++c) row += std::string{char(128 + 8), char(100 + c)};
  const std::string whole = header("-Y 2 +X 8") + row + row;
  std::size_t refused = 0;
  std::size_t others = 0;
  for (std::size_t bit = 0; bit < whole.size() * 8; ++bit) {
    std::string damaged = whole;
    damaged[bit / 8] = static_cast<char>(damaged[bit / 8] ^ (1 << (bit % 8)));
    try {
      const Image image = decode(damaged);
      EXPECT_EQ(image.data.size(), image.pixelCount() * 3);
      others += image.data != decode(whole).data;
    } catch (const SceneError&) {
      ++refused;
    }
  }
  // Of a row's 12 bytes two are a mark, two its length, and eight runs and their values
  EXPECT_GE(refused, whole.size() * 8 / 4);
  EXPECT_GE(others, std::size_t{2 * 4 * 8});  // each bit of a value
}

TEST(Hdr, WhatIsNotReadIsNamed) {
  EXPECT_THAT(hdrError("#?RADIANCE\nFORMAT=32-bit_rle_xyze\n\n-Y 1 +X 1\nabcd"),
              HasSubstr("FORMAT=32-bit_rle_xyze"));
  EXPECT_THAT(hdrError(header("+X 4 -Y 4")), HasSubstr("resolution \"+X 4 -Y 4\""));
  EXPECT_THAT(hdrError(header("-Y 4000 +X 4000")), HasSubstr("4000 x 4000 pixels, more than"));
  EXPECT_THAT(hdrError(header("-Y 0 +X 4")), HasSubstr("resolution"));
  EXPECT_THAT(hdrError(header("-Y 1 +X 1", "EXPOSURE=nan\n")), HasSubstr("EXPOSURE=nan"));
}

}  // namespace
}  // namespace catoptric::image
