#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <bit>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <random>

#include "core/error.h"
#include "core/file.h"
#include "image/exr_camera.h"
#include "image/image.h"

namespace catoptric::image {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::StartsWith;

const std::vector<std::string> kChannels = {"R",
                                            "G",
                                            "B",
                                            "A",
                                            "Z",
                                            "N.X",
                                            "N.Y",
                                            "N.Z",
                                            "reflection.R",
                                            "reflection.G",
                                            "reflection.B",
                                            "id",
                                            "mask.reflective"};

/// Numbers of every size, some of them not to be held by half.
Image noise(int width, int height, const std::vector<std::string>& channels) {
  Image image{width, height, channels, {}};
  std::mt19937 random(7);
  for (std::size_t i = 0; i < image.pixelCount() * channels.size(); ++i)
    image.data.push_back(static_cast<float>(random() % 100000) * 0.01f);
  return image;
}

/// Half's precision: 11 bits.
float halfTolerance(float value) {
  return std::max(std::fabs(value) * 0x1p-11f, 0x1p-25f);
}

class ImageFile : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() /
              ("catoptric_image_" + std::to_string(std::random_device{}()));
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  std::filesystem::path write(const std::string& name, std::span<const std::byte> bytes) {
    const auto path = folder_ / name;
    std::ofstream(path, std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()),
               static_cast<std::streamsize>(bytes.size()));
    return path;
  }
  std::string errorOf(const std::filesystem::path& path) {
    try {
      readImage(path);
    } catch (const SceneError& error) {
      return error.what();
    }
    return "no SceneError";
  }
  std::filesystem::path folder_;
};

TEST_F(ImageFile, EveryCompressionComesBack) {
  const Image image = noise(61, 37, kChannels);
  for (const auto compression : {Compression::None, Compression::Zip, Compression::Piz})
    for (const bool half : {true, false}) {
      ExrOptions options;
      options.compression = compression;
      options.halfBeauty = half;
      const Image back = readImage(write("a.exr", encodeExr(image, options)));
      ASSERT_EQ(back.width, 61);
      ASSERT_EQ(back.height, 37);
      ASSERT_THAT(std::vector(back.channels.begin(), back.channels.begin() + 4),
                  ElementsAre("R", "G", "B", "A"));
      ASSERT_EQ(back.channels.size(), kChannels.size());
      for (std::size_t c = 0; c < kChannels.size(); ++c) {
        const int from = back.channel(kChannels[c]);
        ASSERT_GE(from, 0) << kChannels[c];
        for (int y = 0; y < image.height; ++y)
          for (int x = 0; x < image.width; ++x) {
            const float expected = image.at(x, y, static_cast<int>(c));
            // Data layers are float, bit for bit; only the beauty may be half
            const float tolerance = c < 4 && half ? halfTolerance(expected) : 0.0f;
            ASSERT_NEAR(back.at(x, y, from), expected, tolerance)
                << kChannels[c] << " at " << x << ", " << y;
          }
      }
    }
}

TEST_F(ImageFile, BlocksThatWouldGrowAreStored) {
  Image image{64, 40, {"Z"}, {}};
  std::mt19937 random(3);
  for (std::size_t i = 0; i < image.pixelCount(); ++i)  // all bits but the exponent's highest
    image.data.push_back(std::bit_cast<float>(static_cast<std::uint32_t>(random()) & 0xBFFFFFFFu));
  ExrOptions none;
  none.compression = Compression::None;
  const auto zip = encodeExr(image, {});
  EXPECT_LE(zip.size(), encodeExr(image, none).size());
  EXPECT_EQ(readImage(write("a.exr", zip)).data, image.data);
}

TEST_F(ImageFile, ColoursOfLayersComeBackInOrder) {
  const Image image = noise(4, 4, {"reflection.B", "reflection.G", "reflection.R", "B", "G", "R"});
  const Image back = readImage(write("a.exr", encodeExr(image, {})));
  EXPECT_THAT(back.channels,
              ElementsAre("R", "G", "B", "reflection.R", "reflection.G", "reflection.B"));
  EXPECT_EQ(back.at(2, 3, 3), image.at(2, 3, 2));
}

TEST_F(ImageFile, BytesAreTheSameTwice) {
  const Image image = noise(64, 64, kChannels);
  for (const auto compression : {Compression::None, Compression::Zip, Compression::Piz}) {
    ExrOptions options;
    options.compression = compression;
    EXPECT_EQ(encodeExr(image, options), encodeExr(image, options));
  }
}

TEST_F(ImageFile, ZipLevelReachesTheCodec) {
  Image image{256, 64, {"R", "G", "B"}, {}};
  for (int i = 0; i < 256 * 64 * 3; ++i)
    image.data.push_back(static_cast<float>((i / 7) % 251) + 0.25f * static_cast<float>(i % 13));
  ExrOptions fast;
  fast.zipLevel = 1;
  ExrOptions small;
  small.zipLevel = 9;
  ExrOptions none;
  none.compression = Compression::None;
  EXPECT_LT(encodeExr(image, small).size(), encodeExr(image, fast).size());
  EXPECT_LT(encodeExr(image, fast).size(), encodeExr(image, none).size());
}

TEST_F(ImageFile, HalfClampsAreCounted) {
  Image image{3, 1, {"R", "G", "B", "A", "Z"}, {}};
  image.data = {65504.0f, 65505.0f, -1e9f, 1.0f, 1e9f,   //
                0.0f,     1.0f,     2.0f,  1.0f, 1e30f,  //
                1e38f,    1.0f,     2.0f,  1.0f, 0.0f};
  ExrStatistics statistics;
  const Image back = readImage(write("a.exr", encodeExr(image, {}, &statistics)));
  EXPECT_EQ(statistics.clampedHalf, 3u);
  EXPECT_EQ(back.at(0, 0, 0), 65504.0f);
  EXPECT_EQ(back.at(0, 0, 1), 65504.0f);
  EXPECT_EQ(back.at(0, 0, 2), -65504.0f);
  EXPECT_EQ(back.at(2, 0, 0), 65504.0f);
  EXPECT_EQ(back.at(1, 0, 4), 1e30f);  // data is float: never clamped

  ExrOptions exact;
  exact.halfBeauty = false;
  const Image floats = readImage(write("b.exr", encodeExr(image, exact, &statistics)));
  EXPECT_EQ(statistics.clampedHalf, 0u);
  EXPECT_EQ(floats.at(2, 0, 0), 1e38f);
}

TEST_F(ImageFile, NotFiniteIsRefusedWithItsPlace) {
  for (const float bad : {NAN, INFINITY, -INFINITY}) {
    Image image = noise(5, 4, {"R", "G", "B", "N.X"});
    image.data[(2 * 5 + 3) * 4 + 3] = bad;
    try {
      encodeExr(image, {});
      FAIL() << "no error for " << bad;
    } catch (const FrameError& error) {
      EXPECT_THAT(error.what(), HasSubstr("channel N.X"));
      EXPECT_THAT(error.what(), HasSubstr(std::isnan(bad) ? "NaN" : "infinity"));
      EXPECT_THAT(error.what(), HasSubstr("pixel (3, 2)"));
    }
  }
}

TEST_F(ImageFile, MalformedImagesAreRefused) {
  EXPECT_THROW(encodeExr(Image{}, {}), OutputError);
  EXPECT_THROW(encodeExr(Image{2, 2, {"R"}, {1, 2, 3}}, {}), OutputError);
  EXPECT_THROW(encodeExr(Image{1, 1, {"R", "R"}, {1, 2}}, {}), OutputError);
  EXPECT_THROW(encodeExr(Image{1, 1, {""}, {1}}, {}), OutputError);
  ExrOptions options;
  options.matrices["worldToCamera"] = {1, 2, 3};
  EXPECT_THROW(encodeExr(Image{1, 1, {"R"}, {1}}, options), OutputError);
}

TEST_F(ImageFile, TruncationIsAlwaysNoticed) {
  const Image image = noise(24, 17, {"R", "G", "B", "Z"});
  for (const auto compression : {Compression::None, Compression::Zip, Compression::Piz}) {
    ExrOptions options;
    options.compression = compression;
    const auto whole = encodeExr(image, options);
    for (std::size_t size = 0; size < whole.size(); size += size < 600 ? 7 : 61)
      EXPECT_THAT(errorOf(write("t.exr", std::span(whole.data(), size))), HasSubstr("t.exr"))
          << size << " of " << whole.size();
    EXPECT_THAT(errorOf(write("t.exr", std::span(whole.data(), whole.size() - 1))),
                HasSubstr("t.exr: bad EXR image: "));
  }
}

TEST_F(ImageFile, FlippedBitsNeverCrashAndZipNoticesThem) {
  const Image image = noise(24, 17, {"R", "G", "B", "Z"});
  for (const auto compression : {Compression::None, Compression::Zip, Compression::Piz}) {
    ExrOptions options;
    options.compression = compression;
    const auto whole = encodeExr(image, options);
    std::mt19937 random(3);
    int noticed = 0;
    constexpr int kFlips = 300;
    for (int i = 0; i < kFlips; ++i) {
      auto damaged = whole;
      // The header first, then pixels
      const std::size_t at = i < kFlips / 2 ? random() % 700 : whole.size() / 2 + random() % 1000;
      damaged[at] ^= std::byte{static_cast<unsigned char>(1u << (random() % 8))};
      try {
        const Image back = readImage(write("f.exr", damaged));
        EXPECT_EQ(back.data.size(), back.pixelCount() * back.channels.size());
      } catch (const SceneError&) {
        noticed += i >= kFlips / 2;
      }
    }
    if (compression == Compression::Zip) {
      EXPECT_EQ(noticed, kFlips / 2);
    }
  }
}

TEST_F(ImageFile, OtherFilesAreNamed) {
  const std::vector<std::byte> text(10, std::byte{'x'});
  EXPECT_THAT(errorOf(write("a.exr", text)), HasSubstr("a.exr: neither an EXR nor a Radiance HDR"));
  EXPECT_THAT(errorOf(folder_ / "absent.exr"), HasSubstr("absent.exr"));
}

TEST_F(ImageFile, AttributesAreReadByOtherPrograms) {
  if (std::system("command -v oiiotool >/dev/null 2>&1") != 0)
    GTEST_SKIP() << "oiiotool is not installed (Debian: openimageio-tools)";
  ExrOptions options;
  options.text["catoptric:method"] = "traced";
  options.numbers["catoptric:time"] = 1.25f;
  // A camera at (1, 2, 3) that looks along -z without rotation
  options.matrices["worldToCamera"] =
      exrWorldToCamera(glm::translate(Mat4(1.0f), Vec3(-1.0f, -2.0f, -3.0f)));
  const auto path = write("a.exr", encodeExr(noise(8, 8, kChannels), options));
  const auto listing = folder_ / "info.txt";
  ASSERT_EQ(std::system(("oiiotool --info -v " + path.string() + " >" + listing.string()).c_str()),
            0);
  const std::string info = readTextFile(listing);
  EXPECT_THAT(info, HasSubstr("8 x    8, 13 channel, half/half/half/half/float/float"));
  EXPECT_THAT(info, HasSubstr("DateTime: \"2000:01:01 00:00:00\""));
  EXPECT_THAT(info, HasSubstr("catoptric:method: \"traced\""));
  EXPECT_THAT(info, HasSubstr("catoptric:time: 1.25"));
  EXPECT_THAT(info, HasSubstr("chromaticities: 0.64, 0.33, 0.3, 0.6, 0.15, 0.06, 0.3127, 0.329"));
  EXPECT_THAT(info, HasSubstr("compression: \"zip\""));
  EXPECT_THAT(info, HasSubstr("worldToCamera: 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, 0, -1, -2, 3, 1"));
}

TEST(ExrCamera, ForwardIsPlusZ) {
  // 5 metres ahead of a camera at the eye is (0, 0, 5) in EXR's camera space
  const Vec3 eye(1.0f, 2.0f, 3.0f);
  const Vec3 target(4.0f, 2.0f, 7.0f);
  const auto m = exrWorldToCamera(glm::lookAt(eye, target, Vec3(0, 1, 0)));
  float p[4] = {};
  const float world[4] = {target.x, target.y, target.z, 1.0f};
  for (int column = 0; column < 4; ++column)
    for (int row = 0; row < 4; ++row) p[column] += world[row] * m[4 * row + column];
  EXPECT_NEAR(p[0], 0.0f, 1e-5f);
  EXPECT_NEAR(p[1], 0.0f, 1e-5f);
  EXPECT_NEAR(p[2], 5.0f, 1e-5f);
  EXPECT_NEAR(p[3], 1.0f, 1e-5f);
}

TEST(Display, EqualsDisplay8WithinHalfAStep) {
  constexpr int kCount = 20000;
  Image ramp{kCount, 1, {"R", "G", "B"}, {}};
  for (int i = 0; i < kCount; ++i) {
    const float t = static_cast<float>(i) / kCount;
    ramp.data.insert(ramp.data.end(), {t * 1.2f - 0.1f, t * t * t * 0.01f, t * 50.0f});
  }
  const auto bytes = displayRgb8(ramp);
  ASSERT_EQ(bytes.size(), ramp.data.size());
  for (std::size_t i = 0; i < bytes.size(); ++i)
    // OpenColorIO joins the two pieces of the curve without the standard's gap: slope 12.923
    ASSERT_NEAR(bytes[i], display8(ramp.data[i]), 0.5f + 2.5e-3f) << ramp.data[i];
}

TEST(Display, ExposureIsInStops) {
  const Image image{1, 1, {"R", "G", "B"}, {0.05f, 0.1f, 0.4f}};
  const auto bytes = displayRgb8(image, {{}, {}, 2.0f});
  EXPECT_NEAR(bytes[0], display8(0.2f), 0.51f);
  EXPECT_NEAR(bytes[1], display8(0.4f), 0.51f);
  EXPECT_EQ(bytes[2], 255);
  const auto darker = displayRgb8(image, {{}, {}, -1.0f});
  EXPECT_NEAR(darker[2], display8(0.2f), 0.51f);
}

TEST(Display, NanIsMagentaAndInfinityIsWhite) {
  const float inf = std::numeric_limits<float>::infinity();
  const Image image{4,
                    1,
                    {"A", "R", "G", "B"},
                    {NAN, 0, 0, 0, 1, 0, NAN, 0, 1, inf, inf, inf, 1, -inf, 0.5f, -1}};
  const auto bytes = displayRgb8(image);
  EXPECT_THAT(bytes, ElementsAre(0, 0, 0, 255, 0, 255, 255, 255, 255, 0, 188, 0));
}

TEST(Display, NeedsColour) {
  EXPECT_THROW(displayRgb8(Image{1, 1, {"Z"}, {1}}), OutputError);
}

// As Khronos PBR Neutral, without what that takes off
TEST(Display, TheNeutralViewShowsWhatOthersClip) {
  const auto shown = [](float r, float g, float b) {
    return displayRgb8(Image{1, 1, {"R", "G", "B"}, {r, g, b}}, {{}, kNeutralView, 0.0f});
  };
  const auto expectShown = [&](const std::vector<std::uint8_t>& bytes, float r, float g, float b) {
    EXPECT_NEAR(bytes[0], display8(r), 0.51f);
    EXPECT_NEAR(bytes[1], display8(g), 0.51f);
    EXPECT_NEAR(bytes[2], display8(b), 0.51f);
  };
  expectShown(shown(0.79f, 0.3f, 0.001f), 0.79f, 0.3f, 0.001f);
  // Red of 2: peak 1 - 0.2^2 / (2 + 0.2 - 0.8), and 1 - 1 / (0.15 (2 - peak) + 1) of white
  expectShown(shown(2.0f, 0.0f, 0.0f), 0.97143f, 0.12985f, 0.12985f);
  std::uint8_t last = 0;
  for (float radiance = 1.0f; radiance < 1e6f; radiance *= 2.0f) {
    const auto red = shown(radiance, 0.1f, 0.1f);
    EXPECT_GE(red[0], last);
    EXPECT_GE(red[1], 20);
    last = red[0];
  }
}

class OcioConfig : public ::testing::Test {
 protected:
  void TearDown() override { std::filesystem::remove(file_); }
  DisplayView write(const std::string& text, const std::string& view = "") {
    std::ofstream(file_) << text;
    return {file_, view, 0.0f};
  }
  std::filesystem::path file_ =
      std::filesystem::temp_directory_path() / ("view" + std::to_string(::getpid()) + ".ocio");
};

TEST_F(OcioConfig, ShowsWhatTheBuiltInOneShows) {
  // Its reference space is ACES2065-1, and it names no Rec.709
  const DisplayView aces = write(R"(ocio_profile_version: 2
roles: {default: aces, scene_linear: aces, aces_interchange: aces}
displays:
  Monitor:
    - !<View> {name: Plain, colorspace: shown}
colorspaces:
  - !<ColorSpace> {name: aces, encoding: scene-linear}
  - !<ColorSpace>
    name: shown
    from_scene_reference: !<GroupTransform>
      children:
        - !<MatrixTransform> {matrix: [0.4396329819, 0.3829886981, 0.1773783199, 0, 0.0897764428, 0.8134394286, 0.0967841284, 0, 0.0175411704, 0.1115465500, 0.8709122797, 0, 0, 0, 0, 1], direction: inverse}
        - !<ExponentWithLinearTransform> {gamma: [2.4, 2.4, 2.4, 1], offset: [0.055, 0.055, 0.055, 0], direction: inverse}
)");
  const Image colours{
      3, 1, {"R", "G", "B"}, {0.9f, 0.1f, 0.2f, 0.5f, 0.5f, 0.5f, 0.02f, 0.3f, 0.7f}};
  const auto own = displayRgb8(colours);
  const auto other = displayRgb8(colours, aces);
  for (std::size_t i = 0; i < own.size(); ++i) EXPECT_NEAR(own[i], other[i], 1.01);
  EXPECT_NE(viewFingerprint(aces), viewFingerprint({}));
}

TEST_F(OcioConfig, ErrorsNameTheConfigAndItsViews) {
  const auto errorOf = [](const DisplayView& view) -> std::string {
    try {
      return "(" + viewFingerprint(view) + ")";
    } catch (const UsageError& error) {
      return error.what();
    }
  };
  EXPECT_EQ(errorOf({{}, "Filmic", 0.0f}),
            "the built-in config: has no view \"Filmic\"; its views are sRGB: sRGB, Linear, "
            "Neutral");
  const std::string shipped =
      readTextFile(std::filesystem::path(CATOPTRIC_SOURCE_DIR) / "configs/ocio/catoptric.ocio");
  EXPECT_EQ(errorOf(write(shipped, "Filmic")),
            file_.string() + ": has no view \"Filmic\"; its views are sRGB: sRGB, Linear");
  std::filesystem::resize_file(file_, 60);
  EXPECT_THAT(errorOf({file_, "", 1.0f}), StartsWith(file_.string() + ": "));
}

}  // namespace
}  // namespace catoptric::image
