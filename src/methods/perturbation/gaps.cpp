#include "methods/perturbation/gaps.h"

#include <vector>

#include "methods/shared/sample_points.h"

namespace catoptric::methods::perturbation {

FilledGaps fillGaps(const raster::GBufferCopy& gbuffer, const scene::Camera& camera,
                    std::span<const std::uint8_t> uncovered, const trace::ReflectionOptions& paths,
                    bool marks, Services& services, ReflectionUpload& upload) {
  const auto width = static_cast<std::size_t>(gbuffer.sampleWidth());
  const SamplePoints pointAt(gbuffer, camera, *services.trace);
  std::vector<trace::ReflectionPoint> points;
  std::vector<std::uint32_t> places;
  for (std::size_t at = 0; at < uncovered.size(); ++at) {
    if (uncovered[at] == 0) continue;
    points.push_back(pointAt(static_cast<int>(at % width), static_cast<int>(at / width)));
    places.push_back(static_cast<std::uint32_t>(at));
  }
  FilledGaps filled;
  if (points.empty()) return filled;
  std::vector<Vec3> radiance(points.size());
  std::vector<std::uint8_t> flags(marks ? points.size() : 0);
  std::vector<trace::FirstHit> hits(points.size());
  filled.rays = trace::reflectedRadiance(*services.trace, services.lighting,
                                         scene::pixelSpreadRad(camera, gbuffer.sampleHeight()),
                                         points, paths, true, radiance, flags, hits);
  upload.scatter(*services.gbuffer, true, places, radiance, flags);
  for (std::size_t k = 0; k < points.size(); ++k) {
    if (hits[k].hit.miss()) continue;
    ++filled.samples;
    if (marks) upload.mark(places[k], raster::kMaskRetraced);
  }
  upload.upload(*services.gbuffer);
  return filled;
}

}  // namespace catoptric::methods::perturbation
