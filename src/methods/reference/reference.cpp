#include "methods/reference/reference.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <memory>
#include <mutex>
#include <string>

#include "config/options.h"
#include "core/clock.h"
#include "core/log.h"
#include "core/parallel.h"
#include "core/random.h"
#include "frame/surfaces.h"
#include "methods/reference/channels.h"
#include "methods/reference/places.h"
#include "methods/shared/shared_options.h"
#include "scene/reflectance.h"
#include "trace/lobes/reflect.h"

namespace catoptric::methods {
namespace {

constexpr int kTile = 8;  ///< pixels, so that a tile's samples fit a core's cache; ours
/// Samples of a pixel that are traced together; ours.
constexpr int kBatch = SobolSamples::kMost;
/// Samples of a pixel at which the method gives up; ours.
constexpr int kMostSamples = 4096;
/// Bounces at which paths end even if much is left: that is 0.1 % between mirrors of s = 0.95;
/// ours.
constexpr int kMostBounces = 128;
/// A path ends when the next reflection adds less than this share: a quarter of a display step of
/// white; ours.
constexpr float kLeastShare = 0.001f;
/// Ray cones are as wide as among so many samples along each axis of a pixel, however many are
/// taken, so that more samples converge to the same picture; ours.
constexpr int kConeSamples = 8;
constexpr double kSayAfterSeconds = 10.0;  ///< then a frame says how far it is; ours

struct Options {
  int samples = 4;
  int bounces = 0;
  float maxStandardError = 0.25f;
  trace::ReflectionOptions reflection{.rays = 4};

  bool stated() const { return maxStandardError > 0.0f; }
  int perPixel() const { return samples * samples; }
};

const config::OptionTable<Options>& optionTable() {
  using config::field, config::in, config::range, trace::ReflectionOptions;
  static const config::OptionTable<Options> table(
      "reference", "Options of the method reference.",
      {field(&Options::maxStandardError, "max_standard_error", range(0, 255),
             "samples are added until the frame's standard error is at most this L1_8bit; 0: a "
             "regular grid, without a standard error"),
       field(&Options::samples, "samples", range(1, 64),
             "primary rays along each axis of a pixel, in the first round; with "
             "`max_standard_error` 0 "
             "in all"),
       field(in(&Options::reflection, &ReflectionOptions::rays), "rays", range(1, 256), kRaysHelp),
       field(&Options::bounces, "bounces", range(0, kMostBounces),
             "reflections along a path, as of traced; 0: all that add at least 0.1 %")});
  return table;
}

/// From n samples on 1.5 n and 2 n follow, if n is a power of two: what is too many is less than by
/// doubling, and Sobol's numbers are still spread evenly.
int stepFrom(int samples) {
  return std::max(1, static_cast<int>(std::bit_floor(static_cast<unsigned>(samples))) / 2);
}

/// The number of reflections that can add kLeastShare between the scene's strongest reflectors.
int reach(const scene::Scene& scene, bool fresnel) {
  float most = fresnel ? 1.0f : 0.0f;
  for (const scene::Object& object : scene.objects) {
    const scene::Material& material = scene.materials[static_cast<std::size_t>(object.material)];
    most = std::max(most, material.refraction > 0.0f ? 1.0f : material.specularLevel);
    if (object.reflector != 0 && material.lobe == scene::LobeModel::Ggx)
      most = std::max(most, scene::rimLevel(material.metallicFactor, material.dielectricF90));
  }
  int bounces = 1;
  for (float share = most; share >= kLeastShare && bounces < kMostBounces; share *= most) ++bounces;
  return bounces;
}

const TableInfo& errorTable() {
  static const TableInfo table{
      "standard_error",
      "a frame's samples and the standard error of their mean",
      {{"samples", ColumnType::Integer, "primary rays per pixel"},
       {"L1_8bit", ColumnType::Real, "standard error of the frame, display steps"},
       {"L1_8bit_reflective", ColumnType::Real, "of its reflective pixels"}}};
  return table;
}

/// One primary sample.
struct Sample {
  Vec3 diffuse{0.0f};
  Vec3 reflection{0.0f};
  Vec3 color{0.0f};
  Vec3 oneBounce{0.0f};  ///< as `color`, of paths with one bounce
  Vec3 normal{0.0f};
  float specularLevel = 0.0f;
  Vec3 tint{1.0f};
  float f90 = 1.0f;
  Vec3 highlight{0.0f};
  float z = 0.0f;  ///< along the camera's -z; 0: nothing
  int object = 0;  ///< id
  std::uint8_t flags = 0;
};

/// One tile; its buffers are reused by the tiles of a task.
struct Tile {
  int x0 = 0, y0 = 0, x1 = 0, y1 = 0;  ///< pixels
  std::vector<Place> places;
  std::vector<trace::Ray> rays;
  std::vector<trace::Hit> hits;
  frame::SurfaceLanes lanes;
  std::array<std::size_t, frame::SurfaceLanes::kMost> sampleOfLane{};
  std::array<frame::SurfacePoint, frame::SurfaceLanes::kMost> surfaces;
  std::vector<Sample> samples;
  std::vector<trace::ReflectionPoint> points;
  std::vector<std::size_t> sampleOfPoint;
  std::vector<Vec3> radiance;
  std::vector<Vec3> oneBounce;
  std::vector<std::uint8_t> flags;
};

/// The samples of each pixel that are traced together.
struct Batch {
  enum class Kind { Grid, Half, Centre };
  Kind kind = Kind::Grid;
  int half = 0;  ///< 0, 1: two independent sequences
  int first = 0;
  int count = 1;  ///< per pixel
};

struct Totals {
  std::mutex mutex;
  std::uint64_t primary = 0;
  trace::ReflectionCounts reflections;
};

/// A frame while it is sampled: sums over the samples of each pixel.
struct Sums {
  image::Image image;                       ///< all channels but Z, N, id and the error are sums
  std::array<std::vector<Vec3>, 2> halves;  ///< of the colour; empty on a grid
  std::vector<std::uint8_t> reflective;     ///< whether a sample reflects
};

/// In display steps.
struct StandardError {
  double frame = 0.0;
  double reflective = 0.0;
};

class Reference : public Method {
 public:
  explicit Reference(const Options& options) : options_(options) {
    options_.reflection.bounces = options.bounces > 0 ? options.bounces : kMostBounces;
    options_.reflection.leastShare = options.bounces > 0 ? 0.0f : kLeastShare;
    options_.reflection.converges = options.stated();
  }

  MethodPlan plan(const scene::Scene& scene, const RunSettings& settings) const override {
    MethodPlan plan;
    plan.trace = true;
    plan.bounces = options_.bounces > 0 ? options_.bounces : reach(scene, settings.fresnelSchlick);
    const auto pixels = static_cast<std::uint64_t>(settings.width) * settings.height;
    plan.items = {
        {"pass", "trace",
         (options_.stated() ? "at least " : "") + std::to_string(options_.perPixel()) +
             " primary rays a pixel and the reflections of " +
             std::to_string(scene.reflectorCount()) + " reflective objects",
         0},
    };
    if (options_.stated())
      plan.items.push_back(
          {"resource", "halves",
           std::string("two independent means of a pixel, whose difference is its "
                       "error; the layer standard_error") +
               (options_.bounces != 1 ? ", and one_bounce" : ""),
           pixels * (2 * sizeof(Vec3) + 1 + sizeof(float) * (options_.bounces != 1 ? 6 : 3)),
           "image.width, image.height"});
    return plan;
  }

  void prepare(Services&, const RunSettings& settings) override {
    settings_ = settings;
    options_.reflection.fresnelSchlick = settings.fresnelSchlick;
    channels_ = Channels(settings, options_.stated(), options_.stated() && options_.bounces != 1);
  }

  void render(const FrameInput& input, Services& services, FrameOutput& output) override {
    Sums sums;
    image::Image& image = sums.image;
    image.width = settings_.width;
    image.height = settings_.height;
    image.channels = channels_.names;
    image.data.assign(image.pixelCount() * image.channels.size(), 0.0f);
    Totals totals;
    const std::uint64_t unresolvedBefore = services.trace->unresolvedRays();
    services.timer.measure("trace", [&] {
      if (options_.stated()) {
        converge(input, services, sums, totals, output);
      } else {
        draw(input, services, {{Batch::Kind::Grid, 0, 0, options_.perPixel()}}, sums, totals);
        scale(image, options_.perPixel());
      }
    });
    output.counters["primary_rays"] = totals.primary;
    output.counters["rays"] = totals.reflections.rays;
    output.counters["misses"] = totals.reflections.misses;
    output.counters["refused"] = totals.reflections.refused;
    output.counters["not_finite"] = totals.reflections.notFinite;
    output.counters["below_horizon"] = totals.reflections.belowHorizon;
    output.counters["unfinished"] = totals.reflections.unfinished;
    if (!services.geometry.surfaces.empty())
      output.counters["unresolved"] = services.trace->unresolvedRays() - unresolvedBefore;
    output.image = std::move(image);
  }

 private:
  /// Adds samples until the standard error is small enough. Whether it is depends on the
  /// pixels alone, so on neither threads nor chunks.
  void converge(const FrameInput& input, const Services& services, Sums& sums, Totals& totals,
                FrameOutput& output) {
    for (std::vector<Vec3>& half : sums.halves) half.assign(sums.image.pixelCount(), Vec3(0.0f));
    sums.reflective.assign(sums.image.pixelCount(), 0);
    if (channels_.z >= 0 || channels_.normal >= 0 || channels_.id >= 0)
      draw(input, services, {{Batch::Kind::Centre, 0, 0, 1}}, sums, totals);
    std::int64_t said = nowNs();
    StandardError error;
    int each = 0;  // samples of each half
    for (int target = (options_.perPixel() + 1) / 2;;
         target = std::min(each + stepFrom(each), kMostSamples / 2)) {
      std::vector<Batch> batches;
      for (int half = 0; half < 2; ++half)
        for (int first = each; first < target; first += kBatch)
          batches.push_back({Batch::Kind::Half, half, first, std::min(kBatch, target - first)});
      draw(input, services, batches, sums, totals);
      each = target;
      error = standardError(sums, each);
      if (error.frame <= options_.maxStandardError || 2 * each >= kMostSamples) break;
      if (secondsSince(said) < kSayAfterSeconds) continue;
      said = nowNs();
      log::info(fmt::format(
          "frame {}: the reference's standard error is {:.3g} after {} samples "
          "per pixel; it goes on until {:g} (--set methods.reference.max_standard_error)",
          input.frame.number, error.frame, 2 * each, options_.maxStandardError));
    }
    if (!(error.frame <= options_.maxStandardError))
      log::warning(fmt::format(
          "frame {}: the reference's standard error is {:.3g} after {} samples "
          "per pixel, the most that are taken; methods.reference.max_standard_error is {:g}",
          input.frame.number, error.frame, 2 * each, options_.maxStandardError));
    for (std::size_t p = 0; p < sums.image.pixelCount(); ++p) {
      const Vec3 both = sums.halves[0][p] + sums.halves[1][p];
      for (int c = 0; c < 3; ++c) pixelOf(sums.image, p)[c] = both[c];
    }
    scale(sums.image, 2 * each);
    Table table(errorTable());
    table.add(2 * each, error.frame, error.reflective);
    output.tables.push_back(std::move(table));
  }

  /// Half the differences between the display values of the two halves, stored for each pixel, and
  /// the mean of their amounts. The errors a and b of the halves are independent and alike, so (a -
  /// b) / 2 is distributed as the error (a + b) / 2 of their mean. The noise of all frames is the
  /// same, so this also holds for the change from frame to frame.
  StandardError standardError(Sums& sums, int each) const {
    const auto width = static_cast<std::size_t>(sums.image.width);
    const auto height = static_cast<std::size_t>(sums.image.height);
    const float share = 1.0f / static_cast<float>(each);
    struct Row {
      double all = 0.0, reflective = 0.0;
      std::size_t pixels = 0;
    };
    std::vector<Row> rows(height);
    parallelFor(height, 16, [&](std::size_t begin, std::size_t end) {
      for (std::size_t y = begin; y < end; ++y) {
        for (std::size_t p = y * width; p < (y + 1) * width; ++p) {
          float error = 0.0f;
          for (int c = 0; c < 3; ++c) {
            const float half = 0.5f * (image::display8(sums.halves[0][p][c] * share) -
                                       image::display8(sums.halves[1][p][c] * share));
            pixelOf(sums.image, p)[channels_.error + c] = half;
            error += std::abs(half) / 3.0f;
          }
          rows[y].all += error;
          if (sums.reflective[p] == 0) continue;
          rows[y].reflective += error;
          ++rows[y].pixels;
        }
      }
    });
    Row all;
    for (const Row& row : rows) {
      all.all += row.all;
      all.reflective += row.reflective;
      all.pixels += row.pixels;
    }
    return {all.all / static_cast<double>(width * height),
            all.pixels > 0 ? all.reflective / static_cast<double>(all.pixels) : 0.0};
  }

  static float* pixelOf(image::Image& image, std::size_t pixel) {
    return &image.data[pixel * image.channels.size()];
  }

  /// Makes means of the sums over this many samples.
  void scale(image::Image& image, int samples) const {
    const float share = 1.0f / static_cast<float>(samples);
    const auto isSum = [&](int c) {
      const auto isOf = [&](int first) { return first >= 0 && c >= first && c < first + 3; };
      return c != channels_.z && c != channels_.id && !isOf(channels_.error) &&
             !isOf(channels_.normal);
    };
    for (int c = 0; c < static_cast<int>(image.channels.size()); ++c)
      for (std::size_t p = 0; isSum(c) && p < image.pixelCount(); ++p)
        pixelOf(image, p)[c] *= share;
  }

  /// Adds samples of all pixels.
  void draw(const FrameInput& input, const Services& services, const std::vector<Batch>& batches,
            Sums& sums, Totals& totals) const {
    const int tilesX = (sums.image.width + kTile - 1) / kTile;
    const int tilesY = (sums.image.height + kTile - 1) / kTile;
    parallelFor(static_cast<std::size_t>(tilesX) * static_cast<std::size_t>(tilesY), 1,
                [&](std::size_t begin, std::size_t end) {
                  static thread_local Tile tile;
                  for (std::size_t t = begin; t < end; ++t) {
                    tile.x0 = static_cast<int>(t) % tilesX * kTile;
                    tile.y0 = static_cast<int>(t) / tilesX * kTile;
                    tile.x1 = std::min(sums.image.width, tile.x0 + kTile);
                    tile.y1 = std::min(sums.image.height, tile.y0 + kTile);
                    for (const Batch& batch : batches) {
                      const auto counts = drawTile(input, services, batch, tile, sums);
                      const std::scoped_lock lock(totals.mutex);
                      totals.primary += tile.rays.size();
                      totals.reflections.add(counts);
                    }
                  }
                });
  }

  trace::ReflectionCounts drawTile(const FrameInput& input, const Services& services,
                                   const Batch& batch, Tile& tile, Sums& sums) const {
    const scene::Camera& camera = input.frame.camera;
    const trace::TraceScene& trace = *services.trace;
    aimRays(camera, sums.image, batch, tile);
    tile.hits.resize(tile.rays.size());
    const trace::TraceCounts primary = trace.intersectSerial(tile.rays, tile.hits, true);
    const int coneSamples = options_.stated() ? kConeSamples : options_.samples;
    const float spread = scene::pixelSpreadRad(camera, sums.image.height * coneSamples);
    const std::uint64_t notFinite = shadeHits(camera, services, spread, tile);
    trace::ReflectionCounts counts;
    if (batch.kind != Batch::Kind::Centre) {
      tile.radiance.assign(tile.points.size(), Vec3(0.0f));
      tile.oneBounce.assign(channels_.oneBounce >= 0 ? tile.points.size() : 0, Vec3(0.0f));
      tile.flags.assign(tile.points.size(), 0);
      counts = trace::reflectedRadiance(trace, services.lighting, spread, tile.points,
                                        options_.reflection, false, tile.radiance, tile.flags, {},
                                        {}, tile.oneBounce);
      addReflections(tile);
    }
    counts.refused += primary.refused;
    counts.notFinite += notFinite;

    const auto perPixel = static_cast<std::size_t>(batch.count);
    std::size_t first = 0;
    for (int y = tile.y0; y < tile.y1; ++y) {
      for (int x = tile.x0; x < tile.x1; ++x) {
        const std::size_t pixel = static_cast<std::size_t>(y) * sums.image.width + x;
        addPixel(std::span(tile.samples).subspan(first, perPixel), batch, pixel, sums);
        first += perPixel;
      }
    }
    return counts;
  }

  /// Primary rays, pixel by pixel.
  void aimRays(const scene::Camera& camera, const image::Image& image, const Batch& batch,
               Tile& tile) const {
    const Vec3 eye = camera.eye();
    const Vec3 forward = camera.forward();
    const Mat3 rayFromPixel = scene::rayFromPixel(camera, image.width, image.height);
    const auto perPixel = static_cast<std::size_t>(batch.count);
    tile.places.assign(
        perPixel * static_cast<std::size_t>((tile.x1 - tile.x0) * (tile.y1 - tile.y0)), Place{});
    tile.rays.resize(tile.places.size());
    const bool half = batch.kind == Batch::Kind::Half;
    const SobolSamples sobol(static_cast<std::uint32_t>(batch.first), half ? perPixel : 0);
    std::size_t at = 0;
    for (int y = tile.y0; y < tile.y1; ++y) {
      for (int x = tile.x0; x < tile.x1; ++x) {
        const std::uint32_t noise = pixelNoise(x, y, settings_.seed);
        Place* const places = &tile.places[at];
        if (half) sobol.place(mixedBits(noise + static_cast<std::uint32_t>(batch.half)), places);
        for (int k = 0; batch.kind == Batch::Kind::Grid && k < batch.count; ++k)
          places[k] = gridPlace(x, y, k, options_.samples, noise);
        for (std::size_t k = 0; k < perPixel; ++k, ++at) {
          const Vec2 place = Vec2(x, y) + places[k].at;
          trace::Ray& ray = tile.rays[at];
          ray.origin = eye;
          ray.direction = glm::normalize(rayFromPixel * Vec3(place, 1.0f));
          ray.near = camera.nearMetres / glm::dot(ray.direction, forward);
        }
      }
    }
  }

  /// Shades what the rays hit and notes what reflects; how often radiance was not finite.
  std::uint64_t shadeHits(const scene::Camera& camera, const Services& services, float spread,
                          Tile& tile) const {
    const Vec3 eye = camera.eye();
    const Vec3 forward = camera.forward();
    tile.samples.resize(tile.rays.size());
    tile.points.clear();
    tile.sampleOfPoint.clear();
    std::uint64_t notFinite = 0;
    const auto shade = [&] {
      frame::shadeSurfaces(services.scene, services.geometry, services.lighting, tile.lanes,
                           tile.surfaces.data());
      for (std::size_t k = 0; k < tile.lanes.count; ++k)
        notFinite +=
            addSurface(forward, *services.trace, tile.sampleOfLane[k], tile.surfaces[k], tile) ? 0
                                                                                               : 1;
      tile.lanes.count = 0;
    };
    for (std::size_t i = 0; i < tile.rays.size(); ++i) {
      const trace::Hit& hit = tile.hits[i];
      const Vec3 direction = tile.rays[i].direction;
      if (hit.miss()) {
        Sample& sample = tile.samples[i] = {};
        sample.diffuse = services.lighting.environment->radiance(direction);
        sample.color = sample.oneBounce = sample.diffuse;
        continue;
      }
      tile.sampleOfLane[tile.lanes.count] = i;
      tile.lanes.scatter[tile.lanes.count] = tile.places[i].scatter;
      tile.lanes.add(hit.object, hit.primitive, hit.u, hit.v, eye + hit.distance * direction,
                     direction, spread * hit.distance);
      if (tile.lanes.full()) shade();
    }
    shade();
    return notFinite;
  }

  /// Adds what sample `i` hits; whether its radiance is finite.
  static bool addSurface(const Vec3& forward, const trace::TraceScene& trace, std::size_t i,
                         const frame::SurfacePoint& surface, Tile& tile) {
    const trace::Hit& hit = tile.hits[i];
    const Vec3 direction = tile.rays[i].direction;
    const bool finite = isFinite(surface.diffuse);
    const Vec3 diffuse = finite ? surface.diffuse : Vec3(0.0f);
    Sample& sample = tile.samples[i];
    sample.color = sample.oneBounce = sample.diffuse = diffuse;
    sample.reflection = Vec3(0.0f);
    sample.normal = surface.normal;
    sample.specularLevel = surface.specularLevel;
    sample.tint = surface.tint;
    sample.f90 = surface.f90;
    sample.highlight = surface.highlight;
    sample.z = hit.distance * glm::dot(direction, forward);
    sample.object = surface.object;
    sample.flags = 0;
    if (!(surface.specularLevel > 0.0f)) return finite;
    trace::ReflectionPoint point{
        surface.position, surface.normal,
        direction,        surface.lobe,
        hit.distance,     trace::refractionAt(trace, hit, surface.position, direction)};
    point.extent = trace.extentOf(hit.object);
    point.bent = surface.bent;
    point.lobeHorizon = surface.lobeHorizon;
    point.shift = tile.places[i].shift;
    tile.points.push_back(point);
    tile.sampleOfPoint.push_back(i);
    return finite;
  }

  /// Weighs reflections against diffuse light.
  void addReflections(Tile& tile) const {
    for (std::size_t k = 0; k < tile.points.size(); ++k) {
      Sample& sample = tile.samples[tile.sampleOfPoint[k]];
      const trace::ReflectionWeights weights = trace::reflectionWeights(
          sample.specularLevel, sample.tint, sample.f90, tile.points[k].lobe,
          tile.points[k].direction, sample.normal, settings_.fresnelSchlick);
      sample.reflection = tile.radiance[k];
      sample.color = weights.diffuse * sample.diffuse +
                     weights.reflection * (sample.reflection + sample.highlight);
      if (channels_.oneBounce >= 0)
        sample.oneBounce = weights.diffuse * sample.diffuse +
                           weights.reflection * (tile.oneBounce[k] + sample.highlight);
      sample.flags = tile.flags[k];
    }
  }

  /// Adds a pixel's samples to its sums. Z, N and id are those of the middle sample of a grid, or
  /// of the centre.
  void addPixel(std::span<const Sample> samples, const Batch& batch, std::size_t pixel,
                Sums& sums) const {
    float* const out = pixelOf(sums.image, pixel);
    if (batch.kind != Batch::Kind::Half) {
      const std::size_t middle = batch.kind == Batch::Kind::Centre
                                     ? 0
                                     : static_cast<std::size_t>(options_.samples / 2) *
                                           (static_cast<std::size_t>(options_.samples) + 1);
      const Sample& sample = samples[middle];
      if (channels_.z >= 0) out[channels_.z] = sample.z;
      for (int c = 0; channels_.normal >= 0 && c < 3; ++c)
        out[channels_.normal + c] = sample.normal[c];
      if (channels_.id >= 0) out[channels_.id] = static_cast<float>(sample.object);
      if (batch.kind == Batch::Kind::Centre) return;
    }
    Vec3 color(0.0f), oneBounce(0.0f), reflection(0.0f), diffuse(0.0f);
    float covered = 0.0f, specularLevel = 0.0f;
    std::array<float, 4> masks{};
    for (const Sample& sample : samples) {
      color += sample.color;
      oneBounce += sample.oneBounce;
      reflection += sample.reflection;
      diffuse += sample.diffuse;
      covered += sample.object != 0 ? 1.0f : 0.0f;
      specularLevel += sample.specularLevel;
      for (unsigned bit = 0; bit < 3; ++bit)
        masks[bit] += (sample.flags >> bit & 1) != 0 ? 1.0f : 0.0f;
      masks[3] += sample.specularLevel > 0.0f ? 1.0f : 0.0f;
    }
    const auto add = [&](int channel, const Vec3& v) {
      for (int c = 0; channel >= 0 && c < 3; ++c) out[channel + c] += v[c];
    };
    add(batch.kind == Batch::Kind::Grid ? 0 : -1, color);
    out[3] += covered;
    add(channels_.reflection, reflection);
    add(channels_.diffuse, diffuse);
    if (channels_.s >= 0) out[channels_.s] += specularLevel;
    add(channels_.oneBounce, oneBounce);
    for (std::size_t k = 0; channels_.masks >= 0 && k < masks.size(); ++k)
      out[static_cast<std::size_t>(channels_.masks) + k] += masks[k];
    if (batch.kind == Batch::Kind::Grid) return;
    sums.halves[static_cast<std::size_t>(batch.half)][pixel] += color;
    if (masks[3] > 0.0f) sums.reflective[pixel] = 1;
  }

  Options options_;
  RunSettings settings_;
  Channels channels_;
};

}  // namespace

const MethodEntry& referenceEntry() {
  static const MethodEntry entry{
      .id = "reference",
      .summary = "traces whole images with Embree and many samples: the ground truth for errors",
      .paper = "",
      .steps = {{"trace", "frames", "the whole frame is traced by Embree"}},
      .counters = {{"primary_rays", "rays from the camera"},
                   {"rays", "reflected and refracted rays"},
                   {"misses", "rays that left the scene"},
                   {"refused",
                    "invalid rays, which Embree cannot trace; they return the environment", true},
                   {"not_finite", "radiances that were NaN or infinite, replaced by 0", true},
                   {"below_horizon",
                    "rays that would enter the surface: the normal was corrected, or the lobe's "
                    "ray was mirrored back"},
                   {"unfinished", "paths that ended after 128 bounces with 0.1 % or more left"},
                   {"unresolved", "rays whose intersection with an implicit surface is undecided",
                    false, "implicit surfaces in the scene"}},
      .tables = {errorTable()},
      .tests = {.small = R"({"max_standard_error": 0, "samples": 2, "rays": 4, "bounces": 1})",
                .refracting = R"({"bounces": 2})",
                .variants = {R"({"max_standard_error": 2})", R"({"bounces": 0})"}},
      .options = optionTable().schema(),
      .make = [](const config::Value& options) -> std::unique_ptr<Method> {
        return std::make_unique<Reference>(optionTable().parse(options));
      }};
  return entry;
}

}  // namespace catoptric::methods
