// Files are made here by libpng and libjpeg, so that every kind has known pixels.
#include <cmath>
#include <cstdio>
#include <functional>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <jpeglib.h>
#include <png.h>

#include "core/error.h"
#include "image/image.h"

namespace catoptric::image {
namespace {

using Bytes = std::vector<std::byte>;

struct PngKind {
  int bits = 8;
  int type = PNG_COLOR_TYPE_RGB;
  int interlace = PNG_INTERLACE_NONE;
  std::vector<png_color> palette = {};
  std::vector<png_byte> alphas = {};  // of the palette
};

Bytes makePng(unsigned width, unsigned height, const PngKind& kind,
              const std::vector<std::vector<std::uint8_t>>& rows) {
  Bytes bytes;
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  png_infop info = png_create_info_struct(png);
  png_set_write_fn(
      png, &bytes,
      [](png_structp p, png_bytep data, std::size_t size) {
        auto& to = *static_cast<Bytes*>(png_get_io_ptr(p));
        const auto* from = reinterpret_cast<const std::byte*>(data);
        to.insert(to.end(), from, from + size);
      },
      nullptr);
  png_set_IHDR(png, info, width, height, kind.bits, kind.type, kind.interlace,
               PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  if (!kind.palette.empty())
    png_set_PLTE(png, info, kind.palette.data(), static_cast<int>(kind.palette.size()));
  if (!kind.alphas.empty())
    png_set_tRNS(png, info, kind.alphas.data(), static_cast<int>(kind.alphas.size()), nullptr);
  std::vector<png_bytep> pointers;
  for (const auto& row : rows) pointers.push_back(const_cast<png_bytep>(row.data()));
  png_set_rows(png, info, pointers.data());
  png_write_png(png, info, PNG_TRANSFORM_IDENTITY, nullptr);
  png_destroy_write_struct(&png, &info);
  return bytes;
}

struct JpegKind {
  J_COLOR_SPACE input = JCS_RGB;
  int components = 3;
  bool progressive = false;
};

Bytes makeJpeg(unsigned width, unsigned height, const JpegKind& kind,
               const std::vector<std::uint8_t>& pixels) {
  jpeg_compress_struct jpeg{};
  jpeg_error_mgr errors{};
  jpeg.err = jpeg_std_error(&errors);
  jpeg_create_compress(&jpeg);
  unsigned char* data = nullptr;
  unsigned long size = 0;
  jpeg_mem_dest(&jpeg, &data, &size);
  jpeg.image_width = width;
  jpeg.image_height = height;
  jpeg.input_components = kind.components;
  jpeg.in_color_space = kind.input;
  jpeg_set_defaults(&jpeg);
  jpeg_set_quality(&jpeg, 100, TRUE);
  if (kind.progressive) jpeg_simple_progression(&jpeg);
  jpeg_start_compress(&jpeg, TRUE);
  while (jpeg.next_scanline < height) {
    auto* row = const_cast<JSAMPROW>(pixels.data() + std::size_t{jpeg.next_scanline} * width *
                                                         static_cast<unsigned>(kind.components));
    jpeg_write_scanlines(&jpeg, &row, 1);
  }
  jpeg_finish_compress(&jpeg);
  jpeg_destroy_compress(&jpeg);
  const auto* first = reinterpret_cast<const std::byte*>(data);
  Bytes bytes(first, first + size);
  std::free(data);
  return bytes;
}

std::string errorOf(const std::function<void()>& body) {
  try {
    body();
  } catch (const SceneError& error) {
    return error.what();
  }
  return "no SceneError";
}

std::vector<std::uint8_t> pixel(const Image8& image, int x, int y) {
  const auto* p = &image.rgba[(static_cast<std::size_t>(y) * image.width + x) * 4];
  return {p, p + 4};
}

constexpr std::size_t kCap = 1 << 20;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::StartsWith;

TEST(DecodePng, RgbGetsOpaqueAlpha) {
  const auto bytes = makePng(2, 1, {}, {{10, 20, 30, 40, 50, 60}});
  const Image8 image = decodeImage8(bytes, "a.png", kCap);
  EXPECT_EQ(image.width, 2);
  EXPECT_EQ(image.height, 1);
  EXPECT_THAT(image.rgba, ElementsAre(10, 20, 30, 255, 40, 50, 60, 255));
}

TEST(DecodePng, SixteenBitsAreRounded) {
  // 0x0101 -> 1 exactly; 0xFFFF -> 255; 0x00FF / 257 = 0.99 -> 1
  const auto bytes = makePng(1, 1, {.bits = 16}, {{0x01, 0x01, 0xFF, 0xFF, 0x00, 0xFF}});
  EXPECT_THAT(decodeImage8(bytes, "a.png", kCap).rgba, ElementsAre(1, 255, 1, 255));
}

TEST(DecodePng, PaletteWithTransparency) {
  const auto bytes = makePng(3, 1,
                             {.bits = 2,
                              .type = PNG_COLOR_TYPE_PALETTE,
                              .palette = {{1, 2, 3}, {4, 5, 6}, {7, 8, 9}},
                              .alphas = {0, 128}},
                             {{0b00011000}});
  const Image8 image = decodeImage8(bytes, "a.png", kCap);
  EXPECT_THAT(pixel(image, 0, 0), ElementsAre(1, 2, 3, 0));
  EXPECT_THAT(pixel(image, 1, 0), ElementsAre(4, 5, 6, 128));
  EXPECT_THAT(pixel(image, 2, 0), ElementsAre(7, 8, 9, 255));
}

TEST(DecodePng, GrayOneBitAndGrayAlpha) {
  const auto bits = makePng(2, 1, {.bits = 1, .type = PNG_COLOR_TYPE_GRAY}, {{0b01000000}});
  EXPECT_THAT(decodeImage8(bits, "a.png", kCap).rgba,
              ElementsAre(0, 0, 0, 255, 255, 255, 255, 255));
  const auto alpha = makePng(1, 1, {.type = PNG_COLOR_TYPE_GRAY_ALPHA}, {{77, 33}});
  EXPECT_THAT(decodeImage8(alpha, "a.png", kCap).rgba, ElementsAre(77, 77, 77, 33));
}

TEST(DecodePng, InterlacedEqualsPlain) {
  std::vector<std::vector<std::uint8_t>> rows(13);
  for (std::size_t y = 0; y < rows.size(); ++y)
    for (std::size_t i = 0; i < 11 * 3; ++i)
      rows[y].push_back(static_cast<std::uint8_t>(y * 17 + i * 5));
  const auto plain = decodeImage8(makePng(11, 13, {}, rows), "a.png", kCap);
  const auto adam7 =
      decodeImage8(makePng(11, 13, {.interlace = PNG_INTERLACE_ADAM7}, rows), "a.png", kCap);
  EXPECT_EQ(plain.rgba, adam7.rgba);
  EXPECT_THAT(pixel(plain, 10, 12), ElementsAre(98, 103, 108, 255));
}

TEST(DecodeJpeg, FlatColoursOfEveryKind) {
  constexpr unsigned kSize = 16;
  std::vector<std::uint8_t> rgb;
  for (unsigned i = 0; i < kSize * kSize; ++i) rgb.insert(rgb.end(), {200, 100, 50});
  for (const bool progressive : {false, true}) {
    const auto bytes = makeJpeg(kSize, kSize, {.progressive = progressive}, rgb);
    const Image8 image = decodeImage8(bytes, "a.jpg", kCap);
    const auto p = pixel(image, 7, 9);
    EXPECT_NEAR(p[0], 200, 2);
    EXPECT_NEAR(p[1], 100, 2);
    EXPECT_NEAR(p[2], 50, 2);
    EXPECT_EQ(p[3], 255);
  }
  const std::vector<std::uint8_t> gray(kSize * kSize, 90);
  const auto bytes = makeJpeg(kSize, kSize, {.input = JCS_GRAYSCALE, .components = 1}, gray);
  EXPECT_THAT(pixel(decodeImage8(bytes, "a.jpg", kCap), 3, 3), ElementsAre(90, 90, 90, 255));
}

TEST(DecodeJpeg, CmykOfAdobeIsInverted) {
  // libjpeg writes the Adobe marker for CMYK; the stored values then mean 255 - ink
  constexpr unsigned kSize = 8;
  std::vector<std::uint8_t> inks;
  for (unsigned i = 0; i < kSize * kSize; ++i) inks.insert(inks.end(), {255, 128, 0, 200});
  const auto bytes = makeJpeg(kSize, kSize, {.input = JCS_CMYK, .components = 4}, inks);
  const auto p = pixel(decodeImage8(bytes, "a.jpg", kCap), 4, 4);
  EXPECT_NEAR(p[0], 200, 2);
  EXPECT_NEAR(p[1], 100, 2);
  EXPECT_NEAR(p[2], 0, 2);
  EXPECT_EQ(p[3], 255);
}

TEST(DecodeImage8, SizeIsCheckedBeforeAllocation) {
  // The header claims 60000 x 60000; nothing else of such a picture is there
  auto png = makePng(2, 1, {}, {{1, 2, 3, 4, 5, 6}});
  EXPECT_THAT(errorOf([&] { decodeImage8(png, "big.png", 1); }),
              HasSubstr("2 x 1 pixels, more than the 1 allowed"));
  auto jpeg = makeJpeg(16, 16, {}, std::vector<std::uint8_t>(16 * 16 * 3, 9));
  for (std::size_t i = 0; i + 8 < jpeg.size(); ++i)
    if (jpeg[i] == std::byte{0xFF} && jpeg[i + 1] == std::byte{0xC0})
      for (std::size_t k = 5; k < 9; ++k) jpeg[i + k] = std::byte{0xEA};
  EXPECT_THAT(errorOf([&] { decodeImage8(jpeg, "big.jpg", kCap); }),
              HasSubstr("60138 x 60138 pixels, more than the 1048576 allowed"));
}

TEST(DecodeImage8, OtherBytesAreNamed) {
  const Bytes bytes(20, std::byte{'x'});
  EXPECT_THAT(errorOf([&] { decodeImage8(bytes, "room.gltf: image 3", kCap); }),
              StartsWith("room.gltf: image 3: neither PNG nor JPEG (20 bytes"));
  EXPECT_THAT(errorOf([&] { decodeImage8({}, "e", kCap); }), HasSubstr("(0 bytes"));
}

TEST(DecodeImage8, EveryTruncationIsAnError) {
  std::vector<std::vector<std::uint8_t>> rows(8);
  std::vector<std::uint8_t> flat;
  for (std::size_t y = 0; y < 8; ++y)
    for (std::size_t i = 0; i < 8 * 3; ++i) {
      rows[y].push_back(static_cast<std::uint8_t>(y * 31 + i * i * 7));
      flat.push_back(rows[y].back());
    }
  for (const Bytes& whole : {makePng(8, 8, {}, rows), makeJpeg(8, 8, {}, flat),
                             makeJpeg(8, 8, {.progressive = true}, flat)}) {
    ASSERT_NO_THROW(decodeImage8(whole, "whole", kCap));
    for (std::size_t size = 0; size < whole.size(); ++size) {
      const std::span part(whole.data(), size);
      EXPECT_THROW(decodeImage8(part, "part", kCap), SceneError) << size << " of " << whole.size();
    }
  }
}

TEST(DecodeImage8, FlippedBitsNeverCrash) {
  std::vector<std::vector<std::uint8_t>> rows(8);
  std::vector<std::uint8_t> flat;
  for (std::size_t y = 0; y < 8; ++y)
    for (std::size_t i = 0; i < 8 * 3; ++i) {
      rows[y].push_back(static_cast<std::uint8_t>(y * 31 + i * i * 7));
      flat.push_back(rows[y].back());
    }
  const Bytes png = makePng(8, 8, {}, rows);
  std::size_t refused = 0;
  for (const Bytes& whole :
       {png, makeJpeg(8, 8, {}, flat), makeJpeg(8, 8, {.progressive = true}, flat)})
    for (std::size_t bit = 0; bit < whole.size() * 8; ++bit) {
      Bytes damaged = whole;
      damaged[bit / 8] ^= std::byte{static_cast<unsigned char>(1u << (bit % 8))};
      try {
        const Image8 image = decodeImage8(damaged, "damaged", kCap);
        EXPECT_EQ(image.rgba.size(), std::size_t{4} * image.width * image.height);
      } catch (const SceneError&) {
        refused += whole == png;
      }
    }
  // PNG's checksums leave nothing unnoticed but bits of unused chunks' names and values
  EXPECT_GE(refused, png.size() * 8 * 95 / 100);
}

TEST(EncodePng, ComesBackAndIsTheSameTwice) {
  for (const int channels : {1, 3, 4}) {
    constexpr int kWidth = 37;
    constexpr int kHeight = 21;
    std::vector<std::uint8_t> pixels(static_cast<std::size_t>(kWidth) * kHeight * channels);
    for (std::size_t i = 0; i < pixels.size(); ++i)
      pixels[i] = static_cast<std::uint8_t>(i * 73 + i * i / 11);
    const Bytes bytes = encodePng(kWidth, kHeight, channels, pixels);
    EXPECT_EQ(bytes, encodePng(kWidth, kHeight, channels, pixels));
    const Image8 image = decodeImage8(bytes, "round.png", kCap);
    ASSERT_EQ(image.width, kWidth);
    ASSERT_EQ(image.height, kHeight);
    for (std::size_t p = 0; p < pixels.size() / channels; ++p)
      for (int c = 0; c < 4; ++c) {
        const int expected = c == 3 ? (channels == 4 ? pixels[4 * p + 3] : 255)
                                    : pixels[p * channels + (channels == 1 ? 0 : c)];
        ASSERT_EQ(image.rgba[4 * p + c], expected) << p << ' ' << c;
      }
  }
}

TEST(EncodePng, WrongSizesAreErrors) {
  const std::vector<std::uint8_t> pixels(12);
  EXPECT_THROW(encodePng(2, 2, 4, pixels), OutputError);
  EXPECT_THROW(encodePng(0, 2, 3, pixels), OutputError);
  EXPECT_THROW(encodePng(3, 2, 2, pixels), OutputError);
}

TEST(Display8, KnownValuesOfTheStandard) {
  EXPECT_EQ(display8(0.0f), 0.0f);
  EXPECT_EQ(display8(1.0f), 255.0f);
  EXPECT_EQ(display8(-3.0f), 0.0f);
  EXPECT_EQ(display8(1e30f), 255.0f);
  EXPECT_NEAR(display8(0.18f), 255 * 0.461356, 1e-3);  // 1.055 * 0.18^(1/2.4) - 0.055
  EXPECT_NEAR(display8(0.2140411f), 255 * 0.5, 1e-3);  // inverse: ((0.5 + 0.055) / 1.055)^2.4
  EXPECT_NEAR(display8(0.002f), 255 * 12.92 * 0.002, 1e-4);
  EXPECT_TRUE(std::isnan(display8(NAN)));
}

}  // namespace
}  // namespace catoptric::image
