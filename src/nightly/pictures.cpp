#include "nightly/pictures.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/error.h"
#include "core/file.h"
#include "core/hash.h"
#include "measure/display_steps.h"
#include "measure/errors.h"

namespace catoptric::nightly {
namespace {

namespace fs = std::filesystem;
using image::Image;

constexpr int kTile = 16;  ///< pixels

std::array<int, 3> colours(const Image& image) {
  return {image.channel("R"), image.channel("G"), image.channel("B")};
}

/// Mean difference in display steps in the worst tile.
void findWorstTile(const Image& now, const Image& accepted, PictureComparison& comparison) {
  const std::array<int, 3> from = colours(now);
  const std::array<int, 3> to = colours(accepted);
  double worst = 0.0;
  for (int top = 0; top < now.height; top += kTile)
    for (int left = 0; left < now.width; left += kTile) {
      const int right = std::min(left + kTile, now.width);
      const int bottom = std::min(top + kTile, now.height);
      int sum = 0;
      for (int y = top; y < bottom; ++y)
        for (int x = left; x < right; ++x)
          for (std::size_t c = 0; c < 3; ++c)
            if (from[c] >= 0 && to[c] >= 0)
              sum += std::abs(measure::step8(now.at(x, y, from[c])) -
                              measure::step8(accepted.at(x, y, to[c])));
      const double mean =
          static_cast<double>(sum) / (3.0 * static_cast<double>((right - left) * (bottom - top)));
      if (mean <= worst) continue;
      worst = mean;
      comparison.tileX = left;
      comparison.tileY = top;
    }
  comparison.errors["worst_tile"] = worst;
}

}  // namespace

std::uint64_t notFinitePixels(const Image& image) {
  const std::array<int, 3> channels = colours(image);
  std::uint64_t count = 0;
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x)
      count += std::any_of(channels.begin(), channels.end(),
                           [&](int c) { return c >= 0 && !std::isfinite(image.at(x, y, c)); });
  return count;
}

PictureComparison comparePictures(const Image& now, const Image& accepted) {
  const measure::ImageError e = measure::compareImages(now, accepted, "frame");
  PictureComparison comparison;
  comparison.errors = {{"L1_8bit", e.l1()},
                       {"max_8bit", static_cast<double>(e.max8)},
                       {"over_percent", e.overPercent()},
                       {"hdr_flip_mean", e.hdrFlip()},
                       {"hdr_flip_q3", e.hdrFlipPool.weightedQuantile(0.75)}};
  findWorstTile(now, accepted, comparison);
  if (e.objects.empty()) return comparison;
  double worst = 0.0;
  for (const auto& [id, part] : e.objects) {
    comparison.reflectors[id] = part.l1();
    worst = std::max(worst, part.l1());
  }
  comparison.errors["worst_reflector"] = worst;
  return comparison;
}

fs::path storedFrame(const History& history, const std::string& object) {
  return history.folder() / "accepted" / object.substr(0, 2) / (object + ".exr");
}

std::string storeFrame(const History& history, const fs::path& file) {
  const std::vector<std::byte> bytes = readFile(file);
  Fingerprint print;
  print.add(std::span<const std::byte>(bytes));
  std::string object = print.text();
  const fs::path place = storedFrame(history, object);
  std::error_code error;
  if (fs::exists(place, error)) {
    if (readFile(place) != bytes)
      throw OutputError(place.string() + ": the accepted frame is damaged; restore it from a copy");
    return object;
  }
  fs::create_directories(place.parent_path(), error);
  if (error)
    throw OutputError(place.parent_path().string() + ": cannot be created: " + error.message());
  writeFileAtomically(place, std::span<const std::byte>(bytes));
  return object;
}

}  // namespace catoptric::nightly
