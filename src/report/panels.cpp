// What the panels of figures show.
#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/srgb.h"
#include "image/image.h"
#include "measure/errors.h"
#include "report/differences.h"
#include "report/figure.h"
#include "report/layer_pictures.h"

namespace catoptric::report {
namespace {

constexpr Colour kMasked = {255, 30, 20};

void showMask(Rgb8& picture, const image::Image& frame, const Shown& shown) {
  const std::string layer = layersNamed(frame, "mask." + shown.mask, shown.frame.string()).front();
  const int channel = frame.channel(layer);
  for (int y = 0; y < frame.height; ++y)
    for (int x = 0; x < frame.width; ++x)
      if (frame.at(x, y, channel) > 0.0f)
        std::ranges::copy(
            kMasked, picture.rgb.begin() + (static_cast<std::ptrdiff_t>(y) * frame.width + x) * 3);
}

/// `crop`, or the whole frame. Throws UsageError if it is outside.
Crop partOf(const image::Image& frame, Crop crop, const std::filesystem::path& file) {
  if (crop.width == 0) crop = {0, 0, frame.width, frame.height};
  if (crop.x < 0 || crop.y < 0 || crop.width < 1 || crop.height < 1 ||
      crop.width > frame.width - crop.x || crop.height > frame.height - crop.y)
    throw UsageError(fmt::format(
        "the part {},{},{},{} (x, y, width, height) is outside the frame "
        "{}, which has {} x {} pixels",
        crop.x, crop.y, crop.width, crop.height, file.string(), frame.width, frame.height));
  return crop;
}

void cutOut(image::Image& frame, const Crop& crop) {
  const std::size_t channels = frame.channels.size();
  std::vector<float> data;
  data.reserve(static_cast<std::size_t>(crop.width) * crop.height * channels);
  for (int y = crop.y; y < crop.y + crop.height; ++y) {
    const float* const row =
        &frame.data[(static_cast<std::size_t>(y) * frame.width + crop.x) * channels];
    data.insert(data.end(), row, row + crop.width * channels);
  }
  frame = {crop.width, crop.height, std::move(frame.channels), std::move(data)};
}

/// The part, each pixel a square of `zoom` pixels.
Rgb8 cropped(const Rgb8& picture, const Crop& crop, int zoom) {
  Rgb8 part{crop.width * zoom, crop.height * zoom, {}};
  part.rgb.reserve(static_cast<std::size_t>(part.width) * part.height * 3);
  for (int y = 0; y < part.height; ++y)
    for (int x = 0; x < part.width; ++x) {
      const auto from =
          picture.rgb.begin() +
          (static_cast<std::ptrdiff_t>(crop.y + y / zoom) * picture.width + crop.x + x / zoom) * 3;
      part.rgb.insert(part.rgb.end(), from, from + 3);
    }
  return part;
}

}  // namespace

Rgb8 pictureOf(const Shown& shown) {
  const image::Image frame = image::readImage(shown.frame);
  Rgb8 picture{frame.width, frame.height, {}};
  if (shown.difference > 0)
    picture.rgb = differenceRgb8(frame, image::readImage(shown.against), shown.difference);
  else if (!shown.layer.empty())
    picture = layerPicture(frame, layersNamed(frame, shown.layer, shown.frame.string()).front());
  else
    picture.rgb = image::displayRgb8(frame);
  if (!shown.mask.empty()) showMask(picture, frame, shown);
  picture = cropped(picture, partOf(frame, shown.crop, shown.frame), shown.zoom);
  if (shown.width == 0 || picture.width <= shown.width) return picture;
  return shrink(picture, shown.width,
                std::max(1, static_cast<int>(std::lround(static_cast<double>(picture.height) *
                                                         shown.width / picture.width))));
}

double l1Of(const std::filesystem::path& frame, const std::filesystem::path& against,
            bool reflective, const Crop& crop) {
  image::Image one = image::readImage(frame);
  image::Image other = image::readImage(against);
  if (crop.width > 0 && one.width == other.width && one.height == other.height) {
    const Crop part = partOf(one, crop, frame);
    cutOut(one, part);
    cutOut(other, part);
  }
  const measure::ImageError error = measure::compareImages(one, other, frame.string());
  return reflective ? error.l1Reflective() : error.l1();
}

Rgb8 shrink(const Rgb8& picture, int width, int height) {
  // Each output pixel covers the range [i, i + 1) * size / newSize of the input
  struct Weight {
    int from = 0;
    std::vector<float> weights;
  };
  const auto coverage = [](int size, int newSize) {
    std::vector<Weight> all;
    for (int i = 0; i < newSize; ++i) {
      const double begin = static_cast<double>(i) * size / newSize;
      const double end = static_cast<double>(i + 1) * size / newSize;
      Weight w;
      w.from = static_cast<int>(begin);
      for (int p = w.from; p < size && p < end; ++p)
        w.weights.push_back(static_cast<float>(
            (std::min<double>(end, p + 1) - std::max<double>(begin, p)) / (end - begin)));
      all.push_back(std::move(w));
    }
    return all;
  };
  const auto columns = coverage(picture.width, width);
  const auto rows = coverage(picture.height, height);
  const auto& linear = linearOfSrgb8();

  // Along rows, in linear light
  std::vector<float> narrow(static_cast<std::size_t>(width) * picture.height * 3);
  for (int y = 0; y < picture.height; ++y)
    for (int x = 0; x < width; ++x) {
      const Weight& w = columns[static_cast<std::size_t>(x)];
      for (std::size_t c = 0; c < 3; ++c) {
        float sum = 0.0f;
        for (std::size_t i = 0; i < w.weights.size(); ++i)
          sum +=
              w.weights[i] *
              linear[picture
                         .rgb[(static_cast<std::size_t>(y) * picture.width + w.from + i) * 3 + c]];
        narrow[(static_cast<std::size_t>(y) * width + x) * 3 + c] = sum;
      }
    }
  // Along columns, and back to display steps
  Rgb8 result{width, height, {}};
  result.rgb.resize(static_cast<std::size_t>(width) * height * 3);
  const std::size_t stride = static_cast<std::size_t>(width) * 3;
  for (int y = 0; y < height; ++y) {
    const Weight& w = rows[static_cast<std::size_t>(y)];
    for (std::size_t i = 0; i < stride; ++i) {
      float sum = 0.0f;
      for (std::size_t k = 0; k < w.weights.size(); ++k)
        sum += w.weights[k] * narrow[(static_cast<std::size_t>(w.from) + k) * stride + i];
      result.rgb[static_cast<std::size_t>(y) * stride + i] =
          static_cast<std::uint8_t>(std::lround(image::display8(sum)));
    }
  }
  return result;
}

}  // namespace catoptric::report
