#include "methods/perturbation/disocclusions.h"

#include <numeric>
#include <vector>

#include "core/parallel.h"
#include "methods/shared/sample_points.h"
#include "trace/lobes/reflect.h"

namespace catoptric::methods::perturbation {
namespace {

struct Question {
  std::size_t sample = 0;
  int reflectionsLeft = 1;  ///< until the one that nothing covers
  trace::ReflectionPoint point;
};

}  // namespace

std::uint64_t findDisocclusions(const raster::GBufferCopy& gbuffer, const scene::Camera& camera,
                                std::span<const std::uint8_t> uncovered,
                                const frame::Lighting& lighting, const trace::TraceScene& trace,
                                std::span<std::uint8_t> masks) {
  const auto width = static_cast<std::size_t>(gbuffer.sampleWidth());
  const auto height = static_cast<std::size_t>(gbuffer.sampleHeight());
  const SamplePoints pointAt(gbuffer, camera, trace);
  std::vector<std::uint64_t> ofRow(height);
  parallelFor(height, 8, [&](std::size_t begin, std::size_t end) {
    std::vector<Question> questions;
    std::vector<Question> next;
    std::vector<trace::Ray> rays;
    std::vector<trace::Hit> hits;
    for (std::size_t y = begin; y < end; ++y) {
      questions.clear();
      for (std::size_t x = 0; x < width; ++x) {
        const std::size_t at = y * width + x;
        if (uncovered[at] == 0) continue;
        questions.push_back({at, uncovered[at], pointAt(static_cast<int>(x), static_cast<int>(y))});
      }
      // A reflection of all of them at a time
      while (!questions.empty()) {
        rays.clear();
        for (Question& question : questions) {
          bool below = false;
          bool total = false;
          trace::settle(trace, question.point);
          rays.push_back(trace::lobeRay(question.point, 0, 1, below, total));
        }
        hits.resize(rays.size());
        trace.intersectSerial(rays, hits, true);
        next.clear();
        for (std::size_t k = 0; k < questions.size(); ++k) {
          const Question& question = questions[k];
          if (hits[k].miss()) continue;
          if (question.reflectionsLeft == 1) {
            ++ofRow[y];
            if (!masks.empty()) masks[question.sample] |= raster::kMaskDisoccluded;
            continue;
          }
          const Vec3& direction = rays[k].direction;
          const frame::SurfacePoint surface = frame::shadeSurface(
              trace.scene(), trace.geometry(), lighting, hits[k].object, hits[k].primitive,
              hits[k].u, hits[k].v, rays[k].origin + hits[k].distance * direction, direction, 0.0f);
          if (!(surface.specularLevel > 0.0f)) continue;
          next.push_back({question.sample, question.reflectionsLeft - 1,
                          trace::nextPoint(trace, question.point, 0, direction, hits[k], surface)});
        }
        questions.swap(next);
      }
    }
  });
  return std::accumulate(ofRow.begin(), ofRow.end(), std::uint64_t{0});
}

}  // namespace catoptric::methods::perturbation
