#include "report/contact_sheet.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "core/error.h"
#include "core/file.h"
#include "core/parallel.h"
#include "image/image.h"

namespace catoptric::report {
namespace {

/// What a preview may hold: 16384 x 16384.
constexpr std::size_t kMaxPixels = std::size_t{1} << 28;

/// The frame as it is shown, at most so wide; empty when the run lacks it.
Rgb8 loadFrame(const RunData& run, int number, int width) {
  const auto preview = run.previews.find(number);
  if (preview == run.previews.end()) {
    const auto frame = run.frames.find(number);
    Shown shown;
    shown.width = width;
    if (frame != run.frames.end()) shown.frame = frame->second;
    return frame == run.frames.end() ? Rgb8{} : pictureOf(shown);
  }
  const image::Image8 png =
      image::decodeImage8(readFile(preview->second), preview->second.string(), kMaxPixels);
  Rgb8 picture{png.width, png.height, {}};
  picture.rgb.reserve(png.rgba.size() / 4 * 3);
  for (std::size_t i = 0; i < png.rgba.size(); i += 4)
    picture.rgb.insert(picture.rgb.end(), {png.rgba[i], png.rgba[i + 1], png.rgba[i + 2]});
  if (png.width <= width) return picture;
  return shrink(picture, width,
                std::max(1, static_cast<int>(
                                std::lround(static_cast<double>(png.height) * width / png.width))));
}

std::string headingOf(const SheetOptions& options, const std::string& name) {
  const auto caption = options.captions.find(name);
  return caption == options.captions.end() ? name : name + "   " + caption->second;
}

}  // namespace

std::vector<int> spread(const std::vector<int>& all, std::size_t count) {
  if (all.size() <= count || count == 0) return all;
  if (count == 1) return {all.front()};
  std::vector<int> chosen;
  for (std::size_t i = 0; i < count; ++i)
    chosen.push_back(all[(i * (all.size() - 1) + (count - 1) / 2) / (count - 1)]);
  return chosen;
}

Figure contactSheet(std::span<const RunData> runs, const SheetOptions& options) {
  std::set<int> numbers;
  for (const RunData& run : runs) {
    for (const auto& [number, file] : run.frames) numbers.insert(number);
    for (const auto& [number, file] : run.previews) numbers.insert(number);
  }
  if (numbers.empty()) throw UsageError("contact sheet: no run has a frame or a preview");
  const bool several = runs.size() > 1;
  const std::vector<int> frames = spread(
      {numbers.begin(), numbers.end()},
      static_cast<std::size_t>(std::max(1, several ? options.maxColumns : options.maxFrames)));
  Figure figure{options.title, {}, true};
  if (!several)
    figure.title += (figure.title.empty() ? "" : ": ") + headingOf(options, runs[0].name);
  std::vector<Rgb8> pictures(runs.size() * frames.size());
  parallelFor(pictures.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      pictures[i] = loadFrame(runs[i / frames.size()], frames[i % frames.size()],
                              std::max(16, options.cellWidth));
  });
  const std::size_t columns =
      several ? frames.size() : static_cast<std::size_t>(std::max(1, options.maxColumns));
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    if (i % columns == 0)
      figure.rows.push_back({several ? headingOf(options, runs[i / frames.size()].name) : "", {}});
    figure.rows.back().panels.push_back(
        {"frame " + std::to_string(frames[i % frames.size()]), std::move(pictures[i])});
  }
  return figure;
}

}  // namespace catoptric::report
