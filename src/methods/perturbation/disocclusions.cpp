#include "methods/perturbation/disocclusions.h"

#include <vector>

#include "methods/shared/sample_points.h"
#include "methods/shared/sample_questions.h"
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
                                std::span<std::uint16_t> masks) {
  const auto width = static_cast<std::size_t>(gbuffer.sampleWidth());
  const auto height = static_cast<std::size_t>(gbuffer.sampleHeight());
  const SamplePoints pointAt(gbuffer, camera, trace);
  return sumOverRows<std::uint64_t>(height, [&](std::size_t y, AskedRays& asked) {
    std::uint64_t disoccluded = 0;
    std::vector<Question> questions;
    for (std::size_t x = 0; x < width; ++x) {
      const std::size_t at = y * width + x;
      if (uncovered[at] == 0) continue;
      questions.push_back({at, uncovered[at], pointAt(static_cast<int>(x), static_cast<int>(y))});
    }
    // A reflection of all of them at a time
    std::vector<Question> next;
    while (!questions.empty()) {
      asked.rays.clear();
      for (Question& question : questions) {
        trace::settle(trace, question.point);
        asked.rays.push_back(trace::lobeRay(question.point, 0, 1).ray);
      }
      asked.ask(trace);
      next.clear();
      for (std::size_t k = 0; k < questions.size(); ++k) {
        const Question& question = questions[k];
        const trace::Hit& hit = asked.hits[k];
        if (hit.miss()) continue;
        if (question.reflectionsLeft == 1) {
          ++disoccluded;
          if (!masks.empty()) masks[question.sample] |= raster::kMaskDisoccluded;
          continue;
        }
        const Vec3& direction = asked.rays[k].direction;
        const frame::SurfacePoint surface = frame::shadeSurface(
            trace.scene(), trace.geometry(), lighting, hit.object, hit.primitive, hit.u, hit.v,
            asked.rays[k].origin + hit.distance * direction, direction, 0.0f, Vec2(0.5f));
        if (!(surface.specularLevel > 0.0f)) continue;
        next.push_back({question.sample, question.reflectionsLeft - 1,
                        trace::nextPoint(trace, question.point, 0, direction, hit, surface)});
      }
      questions.swap(next);
    }
    return disoccluded;
  });
}

}  // namespace catoptric::methods::perturbation
