#include "methods/second_order/retrace.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <mutex>

#include "core/math.h"
#include "core/parallel.h"
#include "core/srgb.h"
#include "methods/second_order/shaders/constants.h"
#include "methods/shared/reflective_samples.h"
#include "methods/shared/sample_points.h"
#include "scene/camera.h"
#include "trace/lobes/lobe_tracer.h"

namespace catoptric::methods::second_order {
namespace {

namespace shared = second_order_shared;

/// Share of the frame's samples from which on a cluster is judged in cells. Ours.
constexpr std::size_t kLargeShare = 256;

/// Those of a tile's samples that `wanted` says, in their order.
template <class Wanted>
SampleTiles::Members keep(const SampleTiles::Members& members, Wanted&& wanted) {
  SampleTiles::Members kept;
  for (std::size_t k = 0; k < members.count; ++k) {
    if (!wanted(k)) continue;
    kept.at[kept.count] = members.at[k];
    kept.x[kept.count] = members.x[k];
    kept.y[kept.count] = members.y[k];
    ++kept.count;
  }
  return kept;
}

/// Difference of two radiances as a display shows them, of 255 steps, mean over the channels.
double displayDifference(const Vec3& a, const Vec3& b) {
  double sum = 0.0;
  for (int i = 0; i < 3; ++i) {
    sum += std::abs(srgbFromLinear(std::clamp<double>(a[i], 0.0, 1.0)) -
                    srgbFromLinear(std::clamp<double>(b[i], 0.0, 1.0)));
  }
  return 255.0 / 3.0 * sum;
}

}  // namespace

Retrace::Retrace(const Options& options, const RunSettings& settings, const scene::Scene& scene)
    : most_(options.probes),
      probeError_(options.probeError),
      own_(settings.reflectors),
      masks_(settings.masks) {
  options_.rays = options.camera.rays;
  options_.bounces = 1;
  options_.fresnelSchlick = settings.fresnelSchlick;
  traceable_.push_back(false);
  for (const scene::Object& object : scene.objects)
    traceable_.push_back(!(scene.materials[object.material].refraction > 0.0f));
  gather_ = gl::Program::fullScreen("reflection at probes",
                                    "methods/second_order/shaders/probes.frag", {});
}

void Retrace::choose(const Clustering& clustering) {
  const std::vector<Cluster>& clusters = clustering.clusters();
  const std::span<const SampleBlock> blocks = clustering.blocks();
  std::vector<std::uint32_t> next(clusters.size(), 0);    // number of the next probe's sample
  std::vector<std::uint32_t> passed(clusters.size(), 0);  // samples so far
  std::vector<std::uint32_t> stride(clusters.size(), 1);
  const std::size_t large = std::max(kCell * kCell, clustering.clusterOf().size() / kLargeShare);
  largeOf_.assign(clusters.size(), kNotLarge);
  std::uint32_t larges = 0;
  for (std::size_t c = 0; c < clusters.size(); ++c) {
    std::uint32_t probes = static_cast<std::uint32_t>(most_);
    if (clusters[c].samples >= large) {
      largeOf_[c] = larges++;
      probes *= std::max(1u, clusters[c].samples / static_cast<std::uint32_t>(kCell * kCell));
    }
    stride[c] = std::max(1u, clusters[c].samples / probes);
    next[c] = stride[c] / 2;
  }
  cells_.assign(larges * cellsAcross_ * cellsDown_, {});
  probes_.clear();
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    const SampleBlock& block = blocks[b];
    for (std::size_t row = 0; row + 1 < block.rows.size(); ++row) {
      const auto y = static_cast<std::uint16_t>(b * Clustering::kRows + row);
      for (std::size_t r = block.rows[row]; r < block.rows[row + 1]; ++r) {
        const SampleRun& run = block.runs[r];
        const std::uint32_t c = block.slots[run.slot];
        const bool probed =
            !clusters[c].retraced && traceable_[static_cast<std::size_t>(clusters[c].object)];
        for (; probed && next[c] < passed[c] + run.count; next[c] += stride[c])
          probes_.push_back({c, static_cast<std::uint16_t>(run.x + next[c] - passed[c]), y});
        passed[c] += run.count;
      }
    }
  }
}

void Retrace::probe(const FrameInput& input, Services& services, const raster::GBufferCopy& gbuffer,
                    const Clustering& clustering) {
  cellsAcross_ = (static_cast<std::size_t>(gbuffer.sampleWidth()) + kCell - 1) / kCell;
  cellsDown_ = (static_cast<std::size_t>(gbuffer.sampleHeight()) + kCell - 1) / kCell;
  choose(clustering);
  const scene::Camera& camera = input.frame.camera;
  const SamplePoints pointAt(gbuffer, camera, *services.trace);
  std::vector<trace::ReflectionPoint> points;
  points.reserve(probes_.size());
  for (const Probe& probe : probes_) points.push_back(pointAt(probe.x, probe.y));
  std::vector<trace::FirstHit> hits(points.size());
  seen_.assign(points.size(), Vec3(0.0f));
  trace::reflectedRadiance(*services.trace, services.lighting,
                           scene::pixelSpreadRad(camera, gbuffer.sampleHeight()), points, options_,
                           true, seen_, {}, hits);
  probed_.assign(clustering.clusters().size(), {});
  for (std::size_t i = 0; i < probes_.size(); ++i) {
    Probed& probed = probed_[probes_[i].cluster];
    const trace::Hit& hit = hits[i].hit;
    ++probed.asked;
    if (!hit.miss() && hit.object + 1 == clustering.clusters()[probes_[i].cluster].object)
      ++probed.own;
  }
}

void Retrace::compare(const raster::GBuffer& gbuffer, std::span<const Cluster> clusters,
                      std::span<const float> weight) {
  if (probes_.empty()) return;
  const int rows = static_cast<int>((probes_.size() + shared::kProbesAcross - 1) /
                                    static_cast<std::size_t>(shared::kProbesAcross));
  if (gathered_.empty() || gathered_.height() < rows) {
    places_ = gl::Buffer("probes", static_cast<std::size_t>(rows) * shared::kProbesAcross * 4);
    placeTexture_ = gl::Texture::makeBuffer("probes", GL_R32UI, places_);
    gathered_ =
        gl::Texture::make2D("reflection at probes", GL_RGBA32F, shared::kProbesAcross, rows);
    target_ = gl::Framebuffer("reflection at probes", {{.texture = gathered_}});
  }
  std::vector<std::uint32_t> places;
  places.reserve(probes_.size());
  for (const Probe& probe : probes_)
    places.push_back(probe.x | static_cast<std::uint32_t>(probe.y) << 16);
  places_.write(0, places.size() * sizeof(std::uint32_t), places.data());
  gather_.use();
  gather_.set("probeCount", static_cast<int>(places.size()));
  gbuffer.reflection.bind(shared::kReflectionBinding);
  placeTexture_.bind(shared::kTilesBinding);
  {
    const gl::DrawScope scope(gl::DrawState{});
    target_.bind();
    glViewport(0, 0, shared::kProbesAcross, rows);
    gl::drawFullScreenTriangle();
  }
  std::vector<Vec4> shown(static_cast<std::size_t>(rows) * shared::kProbesAcross);
  gathered_.readRows(0, rows, GL_RGBA, GL_FLOAT, std::as_writable_bytes(std::span(shown)));
  for (std::size_t i = 0; i < probes_.size(); ++i) {
    const std::uint32_t c = probes_[i].cluster;
    const float w = weight[static_cast<std::size_t>(clusters[c].object)];
    const double difference = displayDifference(w * Vec3(shown[i]), w * seen_[i]);
    probed_[c].error += difference;
    if (largeOf_[c] == kNotLarge) continue;
    Probed& cell = cells_[cellOf(largeOf_[c], probes_[i].x, probes_[i].y)];
    ++cell.asked;
    cell.error += difference;
  }
}

bool Retrace::errs(std::size_t cluster) const {
  if (probed_[cluster].meanError() > probeError_) return true;
  if (largeOf_[cluster] == kNotLarge) return false;
  const auto first = cells_.begin() + static_cast<std::ptrdiff_t>(cellOf(largeOf_[cluster], 0, 0));
  return std::any_of(first, first + static_cast<std::ptrdiff_t>(cellsAcross_ * cellsDown_),
                     [&](const Probed& cell) { return errs(cell); });
}

bool Retrace::traces(const Clustering& clustering, std::size_t at, std::size_t x, std::size_t y,
                     bool byLamp) const {
  const std::uint16_t known = clustering.clusterOf()[at];
  if (known < 2) return false;
  if (known == Clustering::kRetraced) return true;
  const std::uint32_t cluster = known - 2u;
  if (byLamp && traceable_[static_cast<std::size_t>(clustering.clusters()[cluster].object)])
    return true;
  if (!clustering.clusters()[cluster].retraced) return false;
  return largeOf_[cluster] == kNotLarge || probed_[cluster].meanError() > probeError_ ||
         errs(cells_[cellOf(largeOf_[cluster], x, y)]);
}

Retrace::Done Retrace::run(const FrameInput& input, Services& services,
                           const raster::GBufferCopy& gbuffer, const Clustering& clustering,
                           const RayPass& shown) {
  const scene::Camera& camera = input.frame.camera;
  const trace::TraceScene& trace = *services.trace;
  const SampleTiles tiles({gbuffer.sampleWidth(), gbuffer.sampleHeight()}, camera, trace.scene(),
                          trace.extents(), own_);
  readRows(*services.gbuffer, tiles, clustering, shown);
  const float spread = scene::pixelSpreadRad(camera, gbuffer.sampleHeight());
  const auto columns = static_cast<std::size_t>(tiles.columns());
  Done done;
  std::mutex mutex;
  parallelFor(columns * rowTraced_.size(), 4, [&](std::size_t begin, std::size_t end) {
    Done mine;
    trace::LobeTracer& tracer = trace::LobeTracer::ofThread();
    tracer.begin(trace, services.lighting, spread, options_);
    std::array<Vec3, SampleTiles::kSamples> radiance;
    std::array<std::uint8_t, SampleTiles::kSamples> flags;
    SampleTiles::Members members;
    for (std::size_t tile = begin; tile < end; ++tile) {
      if (rowTraced_[tile / columns] == 0) continue;
      tiles.find(gbuffer, static_cast<int>(tile % columns), static_cast<int>(tile / columns),
                 members);
      // Apart: of samples that were searched in vain the rays are counted already
      for (const bool searched : {false, true}) {
        const SampleTiles::Members kept = keep(members, [&](std::size_t k) {
          const std::size_t at = members.at[k];
          return searched != (clustering.clusterOf()[at] == Clustering::kRetraced) &&
                 traces(clustering, at, members.x[k], members.y[k], byLamp_[tile] != 0);
        });
        if (kept.count == 0) continue;
        std::fill_n(radiance.begin(), kept.count, Vec3(0.0f));
        std::fill_n(flags.begin(), kept.count, std::uint8_t{0});
        tiles.place(gbuffer, kept, tracer.points());
        trace::ReflectionCounts rays;
        tracer.run(radiance.data(), flags.data(), nullptr, rays);
        if (!searched) mine.belowHorizon += rays.belowHorizon;
        mine.rays.add(rays);
        mine.samples += kept.count;
        put(kept, radiance.data(), flags.data());
      }
    }
    const std::scoped_lock lock(mutex);
    done.rays.add(mine.rays);
    done.samples += mine.samples;
    done.belowHorizon += mine.belowHorizon;
  });
  upload(*services.gbuffer);
  return done;
}

void Retrace::put(const SampleTiles::Members& members, const Vec3* radiance,
                  const std::uint8_t* flags) {
  for (std::size_t k = 0; k < members.count; ++k) {
    float* const texel = &image_[4 * std::size_t{members.at[k]}];
    for (int i = 0; i < 3; ++i) texel[i] = radiance[k][i];
    texel[3] = 1.0f;
    if (masks_)
      maskImage_[members.at[k]] =
          static_cast<std::uint16_t>(raster::kMaskRetraced | maskBits(flags[k]));
  }
}

/// What lies beside the traced samples in their rows of tiles goes up again as it is.
void Retrace::readRows(const raster::GBuffer& gbuffer, const SampleTiles& tiles,
                       const Clustering& clustering, const RayPass& shown) {
  const auto width = static_cast<std::size_t>(gbuffer.sampleWidth());
  rowTraced_.assign(static_cast<std::size_t>(tiles.rowsOf(gbuffer.sampleHeight())), 0);
  for (const Cluster& cluster : clustering.clusters()) {
    if (!cluster.retraced) continue;
    const int first = cluster.top / SampleTiles::kSize;
    const int last = (cluster.bottom - 1) / SampleTiles::kSize;
    std::fill(rowTraced_.begin() + first, rowTraced_.begin() + last + 1, std::uint8_t{1});
  }
  const std::span<const std::uint16_t> clusterOf = clustering.clusterOf();
  for (std::size_t row = 0; row < rowTraced_.size() && clustering.samplesAlone() > 0; ++row) {
    const std::size_t first = row * SampleTiles::kSize * width;
    const auto samples =
        clusterOf.subspan(first, std::min(SampleTiles::kSize * width, clusterOf.size() - first));
    if (std::ranges::find(samples, Clustering::kRetraced) != samples.end()) rowTraced_[row] = 1;
  }
  const auto columns = static_cast<std::size_t>(tiles.columns());
  byLamp_.assign(columns * rowTraced_.size(), 0);
  const std::size_t samples = shown.anySeesLamp() ? clustering.clusterOf().size() : 0;
  for (std::size_t at = 0; at < samples; ++at) {
    if (!shown.seesLamp(at)) continue;
    const std::size_t row = at / width / SampleTiles::kSize;
    rowTraced_[row] = 1;
    byLamp_[row * columns + at % width / SampleTiles::kSize] = 1;
  }
  image_.resize(4 * clustering.clusterOf().size());
  maskImage_.resize(masks_ ? clustering.clusterOf().size() : 0);
  for (std::size_t row = 0; row < rowTraced_.size(); ++row) {
    if (rowTraced_[row] == 0) continue;
    const int top = static_cast<int>(row) * SampleTiles::kSize;
    const int lines = std::min(SampleTiles::kSize, gbuffer.sampleHeight() - top);
    const std::size_t first = static_cast<std::size_t>(top) * width;
    const std::size_t count = static_cast<std::size_t>(lines) * width;
    gbuffer.reflection.readRows(
        top, lines, GL_RGBA, GL_FLOAT,
        std::as_writable_bytes(std::span(image_).subspan(4 * first, 4 * count)));
    if (masks_)
      gbuffer.masks.readRows(top, lines, GL_RED_INTEGER, GL_UNSIGNED_SHORT,
                             std::as_writable_bytes(std::span(maskImage_).subspan(first, count)));
  }
}

void Retrace::upload(raster::GBuffer& gbuffer) const {
  const auto width = static_cast<std::size_t>(gbuffer.sampleWidth());
  for (std::size_t row = 0; row < rowTraced_.size(); ++row) {
    if (rowTraced_[row] == 0) continue;
    const int top = static_cast<int>(row) * SampleTiles::kSize;
    const int lines = std::min(SampleTiles::kSize, gbuffer.sampleHeight() - top);
    const std::size_t first = static_cast<std::size_t>(top) * width;
    gbuffer.reflection.uploadRows(top, lines, GL_RGBA, GL_FLOAT, &image_[4 * first]);
    if (masks_)
      gbuffer.masks.uploadRows(top, lines, GL_RED_INTEGER, GL_UNSIGNED_SHORT, &maskImage_[first]);
  }
}

}  // namespace catoptric::methods::second_order
