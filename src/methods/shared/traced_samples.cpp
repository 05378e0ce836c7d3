#include "methods/shared/traced_samples.h"

#include <algorithm>
#include <mutex>

#include "core/clock.h"
#include "trace/lobes/lobe_tracer.h"

namespace catoptric::methods {

std::vector<PlanItem> tracedItems(const RunSettings& settings, const std::string& which) {
  constexpr std::uint64_t kBytes = 16 + 16 + 4 + 4 + 16 + 1;  // of a sample, read back and uploaded
  const std::uint64_t samples = settings.sampleCount();
  return {{"resource", "marks", "R8UI by sample: " + which, samples},
          {"resource", "bands", "two, for what is read back and uploaded",
           2 * std::min(samples, Bands::largest(settings.width * settings.samples)) * kBytes},
          {"pass", "readback", which},
          {"pass", "trace", "their rays"},
          {"pass", "resolve", "their rays are made, hits shaded"},
          {"pass", "upload", "their radiance"}};
}

TracedCounts traceSamples(const TracedPart& samples, const scene::Camera& camera,
                          Services& services, Bands& bands) {
  raster::GBuffer& gbuffer = *services.gbuffer;
  const trace::TraceScene& trace = samples.trace;
  const SampleTiles tiles({gbuffer.sampleWidth(), gbuffer.sampleHeight()}, camera, trace.scene(),
                          trace.extents(), samples.own);
  const float spread = scene::pixelSpreadRad(camera, gbuffer.sampleHeight());
  TracedCounts counts;
  std::mutex mutex;
  const double seconds =
      bands.run({gbuffer, tiles, services.timer, trace.scene(), samples.own, samples.masks,
                 samples.mark, samples.only},
                [&](const raster::GBufferCopy& copy, const SampleTiles::Members& members,
                    Vec3* radiance, std::uint8_t* flags) {
                  const std::int64_t start = nowNs();
                  trace::ReflectionCounts mine;
                  trace::LobeTracer& tracer = trace::LobeTracer::ofThread();
                  tracer.begin(trace, services.lighting, spread, samples.options);
                  tiles.place(copy, members, tracer.points());
                  tracer.run(radiance, flags, nullptr, mine);
                  mine.resolveSeconds = secondsSince(start) - mine.traceSeconds;
                  const std::scoped_lock lock(mutex);
                  counts.add(mine);
                  counts.samples += members.count;
                });
  counts.shareTime(seconds);
  services.timer.add("trace", counts.traceSeconds);
  services.timer.add("resolve", counts.resolveSeconds);
  return counts;
}

}  // namespace catoptric::methods
