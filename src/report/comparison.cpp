#include "report/comparison.h"

#include "core/error.h"
#include "core/parallel.h"
#include "image/image.h"
#include "report/differences.h"

namespace catoptric::report {

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

  std::vector<measure::ImageError> errors(common.size());
  parallelFor(common.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const auto& file = run.frames.at(common[i]);
      const image::Image image = image::readImage(file);
      const image::Image truth = image::readImage(reference.frames.at(common[i]));
      measure::ErrorMaps maps;
      errors[i] = measure::compareImages(image, truth, file.string(), options, &maps);
      if (!pictures.folder.empty())
        writeDifferences({image, truth, maps, errors[i], common[i], run.name, reference.name},
                         pictures.folder);
    }
  });
  for (std::size_t i = 0; i < common.size(); ++i) {
    comparison.frames[common[i]] = errors[i];
    measure::addErrors(comparison.pooled, errors[i], common[i]);
  }
  return comparison;
}

}  // namespace catoptric::report
