#include "nightly/page_pictures.h"

#include <algorithm>

#include "core/error.h"
#include "core/file.h"
#include "core/text.h"
#include "report/differences.h"

namespace catoptric::nightly {
namespace {

namespace fs = std::filesystem;
using image::Image;

/// Longest side of pictures in a single file, pixels. Ours.
constexpr int kSmall = 160;
constexpr float kStops = 2.0f;

/// Every n-th pixel, so that a difference of single pixels keeps its size.
Image smaller(const Image& image) {
  const int step = (std::max(image.width, image.height) + kSmall - 1) / kSmall;
  if (step <= 1) return image;
  Image small{
      (image.width + step - 1) / step, (image.height + step - 1) / step, image.channels, {}};
  const std::size_t channels = image.channels.size();
  for (int y = 0; y < small.height; ++y)
    for (int x = 0; x < small.width; ++x) {
      const auto from =
          (static_cast<std::size_t>(y) * step * image.width + static_cast<std::size_t>(x) * step) *
          channels;
      small.data.insert(small.data.end(), image.data.begin() + static_cast<std::ptrdiff_t>(from),
                        image.data.begin() + static_cast<std::ptrdiff_t>(from + channels));
    }
  return small;
}

}  // namespace

std::string dataAddress(const std::string& type, std::span<const std::byte> bytes) {
  return "data:" + type + ";base64," + base64(bytes);
}

PictureWriter::PictureWriter(const History& history, fs::path folder, bool singleFile,
                             std::size_t room)
    : history_(history), folder_(std::move(folder)), singleFile_(singleFile), room_(room) {}

std::string PictureWriter::add(const std::string& name, int width, int height,
                               const std::vector<std::uint8_t>& rgb) {
  const std::vector<std::byte> png = image::encodePng(width, height, 3, rgb);
  if (!singleFile_) {
    writeFileAtomically(folder_ / "pictures" / (name + ".png"), std::span<const std::byte>(png));
    return "pictures/" + name + ".png";
  }
  const std::size_t size = 4 * (png.size() + 2) / 3 + 30;
  if (size > room_) return "";
  room_ -= size;
  return dataAddress("image/png", png);
}

FramePictures PictureWriter::write(const std::string& name, const FrameFacts& frame, int number,
                                   const Reference* accepted) {
  FramePictures pictures;
  if (frame.file.empty()) return pictures;
  try {
    Image now = image::readImage(history_.folder() / frame.file);
    const std::string stem = name + "." + std::to_string(number);
    if (accepted == nullptr || accepted->object.empty()) {
      if (singleFile_) now = smaller(now);
      pictures.tonight = add(stem + ".tonight", now.width, now.height, image::displayRgb8(now));
      leftOut_ += pictures.tonight.empty() ? 1 : 0;
      return pictures;
    }
    Image before = image::readImage(storedFrame(history_, accepted->object));
    pictures.comparison = comparePictures(now, before);
    if (singleFile_) {
      now = smaller(now);
      before = smaller(before);
    }
    measure::ErrorMaps maps;
    measure::compareImages(now, before, "frame", {}, &maps);
    pictures.accepted =
        add(stem + ".accepted", before.width, before.height, image::displayRgb8(before));
    pictures.tonight = add(stem + ".tonight", now.width, now.height, image::displayRgb8(now));
    const report::Rgb8 flip = report::heatMap(maps.hdrFlip, now.width, now.height);
    pictures.flip = add(stem + ".flip", flip.width, flip.height, flip.rgb);
    pictures.difference =
        add(stem + ".difference", now.width, now.height, report::differenceRgb8(now, before, 50));
    leftOut_ += pictures.accepted.empty() || pictures.tonight.empty() ? 1 : 0;
    if (singleFile_) return pictures;
    for (const auto& [suffix, stops] : {std::pair{"under", -kStops}, std::pair{"over", kStops}}) {
      pictures.exposures["accepted-" + std::string(suffix)] =
          add(stem + ".accepted." + suffix, before.width, before.height,
              image::displayRgb8(before, {{}, {}, stops}));
      pictures.exposures["tonight-" + std::string(suffix)] =
          add(stem + ".tonight." + suffix, now.width, now.height,
              image::displayRgb8(now, {{}, {}, stops}));
    }
  } catch (const OutputError&) {
    throw;
  } catch (const Error&) {  // a frame that is gone, or of another size: the text says so
    ++leftOut_;
  }
  return pictures;
}

}  // namespace catoptric::nightly
