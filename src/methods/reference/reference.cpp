#include "methods/reference/reference.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <memory>
#include <string>

#include "config/options.h"
#include "core/parallel.h"
#include "core/random.h"
#include "methods/shared/shared_options.h"
#include "trace/lobes/reflect.h"

namespace catoptric::methods {
namespace {

constexpr int kTile = 16;  ///< pixels; ours

struct Options {
  int samples = 4;
  trace::ReflectionOptions reflection{.rays = 16};
};

const config::OptionTable<Options>& optionTable() {
  using config::field, config::in, config::range, trace::ReflectionOptions;
  static const config::OptionTable<Options> table(
      "reference", "Options of the method reference.",
      {field(&Options::samples, "samples", range(1, 64),
             "primary rays along each axis of a pixel, on a regular grid"),
       field(in(&Options::reflection, &ReflectionOptions::rays), "rays", range(1, 256), kRaysHelp),
       field(in(&Options::reflection, &ReflectionOptions::bounces), "bounces", range(1, 16),
             kBouncesHelp)});
  return table;
}

/// One primary sample.
struct Sample {
  Vec3 diffuse{0.0f};
  Vec3 reflection{0.0f};
  Vec3 color{0.0f};
  Vec3 normal{0.0f};
  float specularLevel = 0.0f;
  Vec3 tint{1.0f};
  Vec3 highlight{0.0f};
  float z = 0.0f;  ///< along the camera's -z; 0: nothing
  int object = 0;  ///< id
  std::uint8_t flags = 0;
};

/// One tile; its buffers are reused by the tiles of a task.
struct Tile {
  int x0 = 0, y0 = 0, x1 = 0, y1 = 0;  ///< pixels
  std::vector<trace::Ray> rays;
  std::vector<trace::Hit> hits;
  std::vector<Sample> samples;
  std::vector<trace::ReflectionPoint> points;
  std::vector<std::size_t> sampleOfPoint;
  std::vector<Vec3> radiance;
  std::vector<std::uint8_t> flags;
};

class Reference : public Method {
 public:
  explicit Reference(const Options& options) : options_(options) {}

  MethodPlan plan(const scene::Scene& scene, const RunSettings& /*settings*/) const override {
    MethodPlan plan;
    plan.trace = true;
    plan.bounces = options_.reflection.bounces;
    plan.items = {
        {"pass", "trace",
         std::to_string(options_.samples * options_.samples) +
             " primary rays a pixel and the reflections of " +
             std::to_string(scene.reflectorCount()) + " reflective objects",
         0},
    };
    return plan;
  }

  void prepare(Services&, const RunSettings& settings) override {
    settings_ = settings;
    options_.reflection.fresnelSchlick = settings.fresnelSchlick;
  }

  void render(const FrameInput& input, Services& services, FrameOutput& output) override {
    image::Image image;
    image.width = settings_.width;
    image.height = settings_.height;
    image.channels = channels(settings_);
    image.data.assign(image.pixelCount() * image.channels.size(), 0.0f);

    const int tilesX = (image.width + kTile - 1) / kTile;
    const int tilesY = (image.height + kTile - 1) / kTile;
    std::atomic<std::uint64_t> primary{0};
    std::atomic<std::uint64_t> rays{0};
    std::atomic<std::uint64_t> misses{0};
    std::atomic<std::uint64_t> refused{0};
    std::atomic<std::uint64_t> notFinite{0};
    std::atomic<std::uint64_t> belowHorizon{0};
    const std::uint64_t unresolvedBefore = services.trace->unresolvedRays();
    services.timer.measure("trace", [&] {
      parallelFor(static_cast<std::size_t>(tilesX) * static_cast<std::size_t>(tilesY), 1,
                  [&](std::size_t begin, std::size_t end) {
                    Tile tile;
                    for (std::size_t t = begin; t < end; ++t) {
                      tile.x0 = static_cast<int>(t) % tilesX * kTile;
                      tile.y0 = static_cast<int>(t) / tilesX * kTile;
                      tile.x1 = std::min(image.width, tile.x0 + kTile);
                      tile.y1 = std::min(image.height, tile.y0 + kTile);
                      const trace::ReflectionCounts counts =
                          renderTile(input, services, tile, image);
                      primary += tile.rays.size();
                      rays += counts.rays;
                      misses += counts.misses;
                      refused += counts.refused;
                      notFinite += counts.notFinite;
                      belowHorizon += counts.belowHorizon;
                    }
                  });
    });
    output.counters["primary_rays"] = primary;
    output.counters["rays"] = rays;
    output.counters["misses"] = misses;
    output.counters["refused"] = refused;
    output.counters["not_finite"] = notFinite;
    output.counters["below_horizon"] = belowHorizon;
    if (!services.geometry.surfaces.empty())
      output.counters["unresolved"] = services.trace->unresolvedRays() - unresolvedBefore;
    output.image = std::move(image);
  }

 private:
  static bool asks(const RunSettings& settings, const char* layer) {
    return std::find(settings.layers.begin(), settings.layers.end(), layer) !=
           settings.layers.end();
  }

  /// In the order of the rasterizing methods' layers (run/method_source.cpp).
  static std::vector<std::string> channels(const RunSettings& settings) {
    std::vector<std::string> names = {"R", "G", "B", "A"};
    const auto add = [&](std::initializer_list<const char*> more) {
      names.insert(names.end(), more.begin(), more.end());
    };
    if (asks(settings, "Z")) add({"Z"});
    if (asks(settings, "N")) add({"N.X", "N.Y", "N.Z"});
    if (asks(settings, "reflection")) add({"reflection.R", "reflection.G", "reflection.B"});
    if (asks(settings, "diffuse")) add({"diffuse.R", "diffuse.G", "diffuse.B"});
    if (asks(settings, "s")) add({"s"});
    if (asks(settings, "id")) add({"id.object"});
    if (settings.masks)
      add({"mask.environment", "mask.below_horizon", "mask.sky", "mask.reflective"});
    return names;
  }

  int perPixel() const { return options_.samples * options_.samples; }

  trace::ReflectionCounts renderTile(const FrameInput& input, Services& services, Tile& tile,
                                     image::Image& image) const {
    const scene::Camera& camera = input.frame.camera;
    const trace::TraceScene& trace = *services.trace;
    aimRays(camera, image, tile);
    tile.hits.resize(tile.rays.size());
    const trace::TraceCounts primary = trace.intersectSerial(tile.rays, tile.hits, true);
    // Ray cones are those of its own samples: it shows what the others approach
    const float spread = scene::pixelSpreadRad(camera, image.height * options_.samples);
    const std::uint64_t notFinite = shadeHits(camera, services, spread, tile);
    tile.radiance.assign(tile.points.size(), Vec3(0.0f));
    tile.flags.assign(tile.points.size(), 0);
    trace::ReflectionCounts counts =
        trace::reflectedRadiance(trace, services.lighting, spread, tile.points, options_.reflection,
                                 false, tile.radiance, tile.flags);
    counts.refused += primary.refused;
    counts.notFinite += notFinite;
    addReflections(tile);

    const auto perPixel = static_cast<std::size_t>(this->perPixel());
    std::size_t first = 0;
    for (int y = tile.y0; y < tile.y1; ++y) {
      for (int x = tile.x0; x < tile.x1; ++x) {
        writePixel(
            std::span(tile.samples).subspan(first, perPixel),
            &image.data[(static_cast<std::size_t>(y) * image.width + x) * image.channels.size()]);
        first += perPixel;
      }
    }
    return counts;
  }

  /// Primary rays, pixel by pixel.
  void aimRays(const scene::Camera& camera, const image::Image& image, Tile& tile) const {
    const Vec3 eye = camera.eye();
    const Vec3 forward = camera.forward();
    tile.rays.clear();
    for (int y = tile.y0; y < tile.y1; ++y) {
      for (int x = tile.x0; x < tile.x1; ++x) {
        for (int k = 0; k < perPixel(); ++k) {
          const int row = k / options_.samples;
          const float px =
              static_cast<float>(x) + (static_cast<float>(k % options_.samples) + 0.5f) /
                                          static_cast<float>(options_.samples);
          const float py = static_cast<float>(y) +
                           (static_cast<float>(row) + 0.5f) / static_cast<float>(options_.samples);
          trace::Ray ray;
          ray.origin = eye;
          ray.direction = scene::rayDirection(camera, image.width, image.height, px, py);
          ray.near = camera.nearMetres / glm::dot(ray.direction, forward);
          tile.rays.push_back(ray);
        }
      }
    }
  }

  /// Shades what the rays hit and notes what reflects; how often radiance was not finite.
  std::uint64_t shadeHits(const scene::Camera& camera, const Services& services, float spread,
                          Tile& tile) const {
    const trace::TraceScene& trace = *services.trace;
    const Vec3 eye = camera.eye();
    const Vec3 forward = camera.forward();
    tile.samples.assign(tile.rays.size(), Sample{});
    tile.points.clear();
    tile.sampleOfPoint.clear();
    std::uint64_t notFinite = 0;
    for (std::size_t i = 0; i < tile.rays.size(); ++i) {
      const trace::Hit& hit = tile.hits[i];
      const Vec3 direction = tile.rays[i].direction;
      Sample& sample = tile.samples[i];
      if (hit.miss()) {
        sample.diffuse = services.lighting.environment->radiance(direction);
        sample.color = sample.diffuse;
        continue;
      }
      const Vec3 position = eye + hit.distance * direction;
      const frame::SurfacePoint surface = frame::shadeSurface(
          services.scene, services.geometry, services.lighting, hit.object, hit.primitive, hit.u,
          hit.v, position, direction, spread * hit.distance, scatterOf(tile, i));
      const bool finite = isFinite(surface.diffuse);
      notFinite += finite ? 0 : 1;
      sample.diffuse = finite ? surface.diffuse : Vec3(0.0f);
      sample.color = sample.diffuse;
      sample.normal = surface.normal;
      sample.specularLevel = surface.specularLevel;
      sample.tint = surface.tint;
      sample.highlight = surface.highlight;
      sample.z = hit.distance * glm::dot(direction, forward);
      sample.object = surface.object;
      if (!(surface.specularLevel > 0.0f)) continue;
      trace::ReflectionPoint point{
          position,     surface.normal, direction,
          surface.lobe, hit.distance,   trace::refractionAt(trace, hit, position, direction)};
      point.extent = trace.extentOf(hit.object);
      point.bent = surface.bent;
      point.lobeHorizon = surface.lobeHorizon;
      point.shift = lobeShift(tile, i);
      tile.points.push_back(point);
      tile.sampleOfPoint.push_back(i);
    }
    return notFinite;
  }

  /// A pixel's lobes interleave; pixels are shifted against each other.
  Vec2 lobeShift(const Tile& tile, std::size_t sample) const {
    const auto perPixel = static_cast<std::size_t>(this->perPixel());
    const auto cell = static_cast<float>(sample % perPixel);
    const std::size_t pixelInTile = sample / perPixel;
    const auto width = static_cast<std::size_t>(tile.x1 - tile.x0);
    const auto x =
        static_cast<std::uint32_t>(tile.x0) + static_cast<std::uint32_t>(pixelInTile % width);
    const auto y =
        static_cast<std::uint32_t>(tile.y0) + static_cast<std::uint32_t>(pixelInTile / width);
    const std::uint32_t noise =
        mixedBits(x ^ mixedBits(y ^ mixedBits(static_cast<std::uint32_t>(settings_.seed))));
    return {glm::fract((cell + 0.5f) / static_cast<float>(perPixel) + unitFloat(noise)),
            glm::fract(cell * 0.6180340f + unitFloat(mixedBits(noise)))};
  }

  /// As in a G-buffer with as many samples.
  Vec2 scatterOf(const Tile& tile, std::size_t sample) const {
    const int cell = static_cast<int>(sample) % perPixel();
    const int pixel = static_cast<int>(sample) / perPixel();
    const int across = tile.x1 - tile.x0;
    return frame::scatterPlace(
        (tile.x0 + pixel % across) * options_.samples + cell % options_.samples,
        (tile.y0 + pixel / across) * options_.samples + cell / options_.samples);
  }

  /// Weighs reflections against diffuse light.
  void addReflections(Tile& tile) const {
    for (std::size_t k = 0; k < tile.points.size(); ++k) {
      Sample& sample = tile.samples[tile.sampleOfPoint[k]];
      const trace::ReflectionWeights weights = trace::reflectionWeights(
          sample.specularLevel, sample.tint, tile.points[k].lobe, tile.points[k].direction,
          sample.normal, settings_.fresnelSchlick);
      sample.reflection = tile.radiance[k];
      sample.color = weights.diffuse * sample.diffuse +
                     weights.reflection * (sample.reflection + sample.highlight);
      sample.flags = tile.flags[k];
    }
  }

  /// Means over the samples; Z, N and id of the middle one.
  void writePixel(std::span<const Sample> samples, float* out) const {
    const float share = 1.0f / static_cast<float>(samples.size());
    const auto mean = [&](auto&& value) {
      float sum = 0.0f;
      for (const Sample& sample : samples) sum += value(sample);
      *out++ = sum * share;
    };
    const auto meanRgb = [&](Vec3 Sample::*member) {
      for (int c = 0; c < 3; ++c) mean([&](const Sample& s) { return (s.*member)[c]; });
    };
    const Sample& middle = samples[static_cast<std::size_t>(options_.samples / 2) *
                                   (static_cast<std::size_t>(options_.samples) + 1)];
    meanRgb(&Sample::color);
    mean([](const Sample& s) { return s.object != 0 ? 1.0f : 0.0f; });
    if (asks(settings_, "Z")) *out++ = middle.z;
    if (asks(settings_, "N")) {
      for (int c = 0; c < 3; ++c) *out++ = middle.normal[c];
    }
    if (asks(settings_, "reflection")) meanRgb(&Sample::reflection);
    if (asks(settings_, "diffuse")) meanRgb(&Sample::diffuse);
    if (asks(settings_, "s")) mean([](const Sample& s) { return s.specularLevel; });
    if (asks(settings_, "id")) *out++ = static_cast<float>(middle.object);
    if (settings_.masks) {
      mean([](const Sample& s) { return (s.flags & 1) != 0 ? 1.0f : 0.0f; });
      mean([](const Sample& s) { return (s.flags & 2) != 0 ? 1.0f : 0.0f; });
      mean([](const Sample& s) { return (s.flags & 4) != 0 ? 1.0f : 0.0f; });
      mean([](const Sample& s) { return s.specularLevel > 0.0f ? 1.0f : 0.0f; });
    }
  }

  Options options_;
  RunSettings settings_;
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
                   {"unresolved", "rays whose intersection with an implicit surface is undecided",
                    false, "implicit surfaces in the scene"}},
      .tests = {.small = R"({"samples": 2, "rays": 4})", .refracting = R"({"bounces": 2})"},
      .options = optionTable().schema(),
      .make = [](const config::Value& options) -> std::unique_ptr<Method> {
        return std::make_unique<Reference>(optionTable().parse(options));
      }};
  return entry;
}

}  // namespace catoptric::methods
