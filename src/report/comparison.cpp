#include "report/comparison.h"

#include <fmt/core.h>

#include <algorithm>
#include <utility>

#include "core/error.h"
#include "core/file.h"
#include "core/parallel.h"
#include "image/image.h"
#include "report/differences.h"

namespace catoptric::report {
namespace {

void writeFilmFrame(Figure figure, const std::vector<float>& changes,
                    const std::filesystem::path& file) {
  std::vector<Panel>& panels = figure.rows.front().panels;
  const Rgb8& image = panels.front().picture;
  // Black where there is no frame before
  const std::vector<float> none(changes.empty() ? image.rgb.size() / 3 : 0);
  Rgb8 map = changeMap(changes.empty() ? none : changes, image.width);
  map.height = image.height;  // without its bar, so that the panels are aligned
  map.rgb.resize(image.rgb.size());
  panels.push_back(
      {fmt::format("change of the error, 0 to {} steps", kMostChange), std::move(map)});
  writeFileAtomically(file, drawFigure(figure, file));
}

}  // namespace

RunComparison compareRuns(const RunData& run, const RunData& reference,
                          const measure::CompareOptions& options, const PictureOptions& pictures) {
  RunComparison comparison;
  comparison.name = run.name;
  comparison.reference = reference.name;
  comparison.objectNames = run.objectNames.empty() ? reference.objectNames : run.objectNames;
  std::vector<int> common;
  for (const auto& [number, file] : run.frames)
    (reference.frames.contains(number) ? common : comparison.onlyInRun).push_back(number);
  for (const auto& [number, file] : reference.frames)
    if (!run.frames.contains(number)) comparison.onlyInReference.push_back(number);
  if (common.empty())
    throw UsageError(run.folder.string() + " has no frame in common with " +
                     reference.folder.string() + " (" + std::to_string(run.frames.size()) +
                     " and " + std::to_string(reference.frames.size()) + " frames)");

  // One frame a thread at a time; motion needs the frames in order. A frame without neighbours is
  // in no pair and in no window.
  const auto hasNeighbour = [&](std::size_t i) {
    return (i > 0 && common[i - 1] == common[i] - 1) ||
           (i + 1 < common.size() && common[i + 1] == common[i] + 1);
  };
  const auto batch = static_cast<std::size_t>(threadCount());
  measure::MotionMeter meter;
  for (std::size_t first = 0; first < common.size(); first += batch) {
    const std::size_t count = std::min(batch, common.size() - first);
    std::vector<measure::ImageError> errors(count);
    std::vector<measure::SignedError> signedErrors(count);
    std::vector<Figure> films(count);
    parallelFor(count, 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const int number = common[first + i];
        const auto& file = run.frames.at(number);
        const image::Image image = image::readImage(file);
        const image::Image truth = image::readImage(reference.frames.at(number));
        measure::ErrorMaps maps;
        errors[i] = measure::compareImages(image, truth, file.string(), options, &maps);
        if (hasNeighbour(first + i))
          signedErrors[i] = measure::signedError(image, truth, file.string());
        if (!pictures.folder.empty())
          writeDifferences({image, truth, maps, errors[i], number, run.name, reference.name},
                           pictures.folder);
        if (!pictures.film.empty())
          films[i] = filmFrame({image, truth, maps, errors[i], number, run.name, reference.name});
      }
    });
    std::vector<int> widths(count);
    std::vector<std::vector<float>> changes(count);
    for (std::size_t i = 0; i < count; ++i) {
      const int number = common[first + i];
      measure::addErrors(comparison.pooled, errors[i], number);
      comparison.frames[number] = std::move(errors[i]);
      widths[i] = signedErrors[i].width;
      changes[i] = meter.add(number, std::move(signedErrors[i]));
    }
    parallelFor(count, 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        if (!pictures.folder.empty() && !changes[i].empty())
          writeChanges(changes[i], widths[i], common[first + i], pictures.folder);
        if (!pictures.film.empty())
          writeFilmFrame(std::move(films[i]), changes[i],
                         pictures.film / fmt::format("{:04}.png", first + i + 1));
      }
    });
  }
  comparison.motion = meter.result();
  return comparison;
}

}  // namespace catoptric::report
