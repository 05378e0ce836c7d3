#include "run/stage/method_source.h"

#include <algorithm>
#include <array>
#include <map>
#include <numeric>
#include <utility>

#include "core/clock.h"
#include "core/error.h"
#include "core/log.h"
#include "gl/api.h"
#include "methods/contract/layers.h"
#include "raster/regions/screen.h"
#include "run/folder/machine.h"
#include "run/stage/motion_layer.h"
#include "scene/camera.h"

namespace catoptric::run {
namespace {

/// Objects with more triangles are taken as boxes (ours).
constexpr std::uint32_t kManyTriangles = 4096;

/// Where an image may show an object.
void addShown(const frame::Geometry& geometry, int object, const scene::Camera& camera, int width,
              int height, raster::Region& region) {
  const frame::ObjectRange& range = geometry.objects[static_cast<std::size_t>(object)];
  if (range.indexCount > 3 * kManyTriangles) {
    region.add(raster::shownRectangle(camera, width, height, range.bounds));
    return;
  }
  const raster::Screen screen(camera, width, height);
  for (std::uint32_t i = range.firstIndex; i < range.firstIndex + range.indexCount; i += 3) {
    const std::array<Vec3, 3> corners{geometry.positions[geometry.indices[i]],
                                      geometry.positions[geometry.indices[i + 1]],
                                      geometry.positions[geometry.indices[i + 2]]};
    region.add(screen.shows(corners));
  }
}

/// Whether a point is inside a closed object: rays in three directions cross it an odd number of
/// times.
bool isInside(const frame::Geometry& geometry, const frame::ObjectRange& object,
              const Vec3& point) {
  // Directions along which edges are unlikely (ours)
  constexpr std::array kDirections{Vec3(0.31f, 0.87f, 0.38f), Vec3(-0.73f, 0.19f, 0.66f),
                                   Vec3(0.42f, -0.53f, -0.74f)};
  std::array<int, 3> crossings{};
  for (std::uint32_t i = object.firstIndex; i < object.firstIndex + object.indexCount; i += 3) {
    const Vec3 a = geometry.positions[geometry.indices[i]] - point;
    const Vec3 b = geometry.positions[geometry.indices[i + 1]] - point;
    const Vec3 c = geometry.positions[geometry.indices[i + 2]] - point;
    for (std::size_t d = 0; d < kDirections.size(); ++d) {
      // The volumes that the ray spans with the edges have one sign.
      const float ab = glm::dot(kDirections[d], glm::cross(a, b));
      const float bc = glm::dot(kDirections[d], glm::cross(b, c));
      const float ca = glm::dot(kDirections[d], glm::cross(c, a));
      const bool crosses =
          (ab >= 0.0f && bc >= 0.0f && ca >= 0.0f) || (ab < 0.0f && bc < 0.0f && ca < 0.0f);
      const float height = glm::dot(a, glm::cross(b, c));
      if (crosses && (height >= 0.0f) == (ab + bc + ca > 0.0f)) ++crossings[d];
    }
  }
  return std::ranges::all_of(crossings, [](int count) { return count % 2 == 1; });
}

/// Whether all of R, G and B are 0.
bool isBlack(const image::Image& image) {
  std::vector<std::size_t> colors;
  for (const char* name : {"R", "G", "B"}) {
    const auto found = std::find(image.channels.begin(), image.channels.end(), name);
    if (found != image.channels.end())
      colors.push_back(static_cast<std::size_t>(found - image.channels.begin()));
  }
  for (std::size_t pixel = 0; pixel < image.pixelCount(); ++pixel)
    for (const std::size_t color : colors)
      if (image.data[pixel * image.channels.size() + color] != 0.0f) return false;
  return !colors.empty();
}

}  // namespace

MethodSource::MethodSource(Stage& stage, methods::Method& method, const methods::MethodPlan& needs)
    : stage_(stage), method_(method), needs_(needs) {}

MethodSource::~MethodSource() = default;

std::vector<frame::StepSample> MethodSource::prepare() {
  stage_.buildGeometry();
  if (needs_.gl) stage_.buildRaster();
  if (needs_.gl) timer_.setFinish([] { glFinish(); });

  // Structures that follow motion start from the path's first frame, whatever chunk this is.
  stage_.moveTo(stage_.path().frame(1).timeSeconds, nullptr);
  stage_.checkStop();
  if (needs_.trace)
    trace_ = timer_.measure("bvh", [&] {
      return std::make_unique<trace::TraceScene>(stage_.scene(), stage_.geometry(), needs_.bvh);
    });
  const methods::RunSettings& settings = stage_.run().image;
  if (needs_.gbuffer)
    timer_.measure("allocate", [&] {
      gbuffer_ = stage_.raster()->makeGBuffer(
          {settings.width, settings.height, settings.samples, settings.masks});
      composite_ = gl::Texture::make2D("frame", GL_RGBA32F, settings.width, settings.height);
    });
  methods::Services services{stage_.scene(),
                             stage_.geometry(),
                             stage_.lighting(),
                             stage_.raster(),
                             gbuffer_ ? &*gbuffer_ : nullptr,
                             trace_.get(),
                             timer_};
  stage_.checkStop();
  const std::int64_t start = nowNs();
  const std::size_t before = timer_.samples().size();
  method_.prepare(services, settings);
  // What the method did not name itself.
  const std::vector<frame::StepSample>& samples = timer_.samples();
  const double named = std::accumulate(
      samples.begin() + static_cast<std::ptrdiff_t>(before), samples.end(), 0.0,
      [](double sum, const frame::StepSample& sample) { return sum + sample.seconds; });
  timer_.add("prepare", std::max(0.0, secondsSince(start) - named));
  if (needs_.gl) stage_.context()->check("prepare");

  std::vector<frame::StepSample> all = stage_.startup();
  const std::vector<frame::StepSample> own = timer_.take();
  all.insert(all.end(), own.begin(), own.end());
  return all;
}

RenderedFrame MethodSource::render(const FrameRequest& request) {
  const scene::PathFrame& frame = request.frame;
  timer_.take();  // of a frame that failed
  timer_.beginFrame(frame.number);
  methods::FrameInput input;
  input.frame = frame;
  input.firstOfSequence = request.firstOfSequence;
  input.restarts = request.restarts;
  input.kept = request.kept;
  moveTo(input);

  if (request.kept) warnOfInside(frame);

  const bool rebuilds =
      needs_.bvh == trace::BvhPolicy::RebuildLow || needs_.bvh == trace::BvhPolicy::RebuildMedium;
  if (trace_ && (rebuilds || !input.changedObjects.empty()))
    timer_.measure("bvh", [&] { trace_->update(input.changedObjects); });

  RenderedFrame rendered;
  if (needs_.gbuffer) {
    const raster::DrawStatistics drawn = timer_.measure("gbuffer", [&] {
      return stage_.raster()->drawGBuffer(*gbuffer_, frame.camera, stage_.lighting(),
                                          input.changedSamples, &stage_.geometry());
    });
    rendered.counters["gbuffer_triangles"] = drawn.triangles;
    rendered.counters["gbuffer_culled_triangles"] = drawn.culledTriangles;
  }
  methods::Services services{stage_.scene(),
                             stage_.geometry(),
                             stage_.lighting(),
                             stage_.raster(),
                             gbuffer_ ? &*gbuffer_ : nullptr,
                             trace_.get(),
                             timer_};
  methods::FrameOutput output;
  method_.render(input, services, output);
  for (const auto& [name, count] : output.counters) rendered.counters[name] += count;
  rendered.tables = std::move(output.tables);
  std::erase_if(rendered.tables, [](const methods::Table& table) { return table.rows().empty(); });

  const bool composed = std::exchange(composed_, false);
  if (!request.kept) {
    // Nothing of it is looked at
  } else if (output.image) {
    rendered.image = std::move(*output.image);
  } else if (needs_.gbuffer) {
    // What neither shows something that moved nor reflects it is still in the composite
    std::optional<raster::Region> changed;
    if (composed && input.changedSamples && output.changedReflection) {
      changed = input.changedSamples;
      changed->add(*output.changedReflection);
    }
    rendered.image = readFrame(frame, changed, std::move(output.sampleLayers));
    composed_ = true;
  } else {
    throw Error(ExitCode::Internal, "the method has made no image");
  }
  if (needs_.gl) stage_.context()->check("frame");
  warnOfBlack(rendered.image, frame.number);
  lastCamera_ = frame.camera;
  rendered.samples = timer_.take();
  return rendered;
}

void MethodSource::warnOfBlack(const image::Image& image, int frame) {
  if (saidBlack_ || !isBlack(image)) return;
  saidBlack_ = true;
  log::warning("frame " + std::to_string(frame) +
               " is completely black: the camera sees nothing that is lit or emits light. Check "
               "the camera, or add a light or an environment (--environment FILE|COLOUR). Further "
               "black frames are not reported");
}

void MethodSource::warnOfInside(const scene::PathFrame& frame) {
  const std::vector<scene::Object>& objects = stage_.scene().objects;
  for (std::size_t i = 0; i < objects.size() && !saidInside_; ++i) {
    const frame::ObjectRange& range = stage_.geometry().objects[i];
    // Large objects are looked at once: they often are rooms.
    const bool large = range.indexCount > 3 * kManyTriangles;
    const Vec3 eye = frame.camera.eye();
    if (objects[i].reflector == 0 || (large && lookedInside_) ||
        glm::any(glm::lessThan(eye, range.bounds.min)) ||
        glm::any(glm::greaterThan(eye, range.bounds.max)) ||
        !isInside(stage_.geometry(), range, eye))
      continue;
    saidInside_ = true;
    log::warning("frame " + std::to_string(frame.number) +
                 ": the camera is inside the reflective object \"" + objects[i].name +
                 "\"; methods that do not trace all rays may show what is outside. Further such "
                 "frames are not reported");
  }
  lookedInside_ = true;
}

void MethodSource::moveTo(methods::FrameInput& input) {
  const frame::Geometry& geometry = stage_.geometry();
  const bool kept = gbuffer_ && !input.firstOfSequence && lastCamera_ == input.frame.camera;
  lastCamera_.reset();  // until this frame is made
  const frame::Lighting lighting = stage_.lighting();
  const auto shows = [&](int object) {
    raster::Region region(gbuffer_->sampleWidth(), gbuffer_->sampleHeight());
    addShown(geometry, object, input.frame.camera, gbuffer_->sampleWidth(),
             gbuffer_->sampleHeight(), region);
    return region;
  };
  std::map<int, raster::Region> before;
  if (kept) {
    for (std::size_t i = 0; i < geometry.objects.size(); ++i)
      if (geometry.objects[i].moving)
        before.emplace(static_cast<int>(i), shows(static_cast<int>(i)));
  }
  input.changedObjects = stage_.moveTo(input.frame.timeSeconds, &timer_);

  if (!kept || !(lighting == stage_.lighting())) return;
  input.changedSamples.emplace(gbuffer_->sampleWidth(), gbuffer_->sampleHeight());
  for (const int object : input.changedObjects) {
    input.changedSamples->add(before.at(object));
    input.changedSamples->add(shows(object));
  }
}

image::Image MethodSource::readFrame(const scene::PathFrame& frame,
                                     const std::optional<raster::Region>& changed,
                                     std::vector<methods::SampleLayer> sampleLayers) {
  const methods::RunSettings& settings = stage_.run().image;
  timer_.measure("composite", [&] {
    stage_.raster()->composite(*gbuffer_, frame.camera, {settings.fresnelSchlick}, composite_,
                               changed);
  });
  image::Image image;
  image.width = settings.width;
  image.height = settings.height;
  image.channels = {"R", "G", "B", "A"};
  timer_.measure("readback", [&] {
    if (!changed) {
      read_.clear();
      image.data = raster::readRgba(composite_);
      return;
    }
    if (read_.empty()) {
      read_ = raster::readRgba(composite_);
    } else {
      std::vector<raster::Rectangle> pixels;
      for (const raster::Rectangle& r : changed->rectangles())
        pixels.push_back(raster::pixelsOf(r, settings.samples));
      raster::readRgba(composite_, pixels, read_);
    }
    image.data = read_;
  });
  if (settings.layers.empty() && !settings.masks) return image;

  timer_.measure("layers", [&] {
    SampleLayers layers;
    layers.wantNormal = methods::asksFor(settings, "N");
    if (layers.wantNormal || settings.masks) layers.normal = raster::readRgba(gbuffer_->normal);
    if (methods::asksFor(settings, "reflection"))
      layers.reflection = raster::readRgba(gbuffer_->reflection);
    layers.wantDiffuse = methods::asksFor(settings, "diffuse");
    layers.wantSpecular = methods::asksFor(settings, "s");
    if (layers.wantDiffuse || layers.wantSpecular || settings.masks ||
        methods::asksFor(settings, "reflection"))
      layers.diffuse = raster::readRgba(gbuffer_->diffuse);
    layers.ids = std::move(sampleLayers);
    const bool motion = methods::asksFor(settings, "motion");
    const bool moved = motion && frame.number > 1;  // else nothing has
    std::vector<float> depth;
    std::vector<std::uint32_t> object;
    if (moved || methods::asksFor(settings, "Z")) depth = raster::readDepth(gbuffer_->depth);
    if (moved || methods::asksFor(settings, "id")) object = raster::readIds(gbuffer_->object);
    if (motion) layers.motion = motionOf(frame, depth, object);
    if (methods::asksFor(settings, "Z")) layers.depth = std::move(depth);
    if (methods::asksFor(settings, "id")) layers.object = std::move(object);
    if (settings.masks) layers.masks = raster::readMasks(gbuffer_->masks);
    layers.filledMasks = needs_.masks;
    addLayers(image, layers, settings.samples, frame.camera.nearMetres);
  });
  return image;
}

std::vector<Vec3> MethodSource::motionOf(const scene::PathFrame& frame,
                                         std::span<const float> depth,
                                         std::span<const std::uint32_t> object) const {
  if (frame.number == 1)
    return std::vector<Vec3>(static_cast<std::size_t>(gbuffer_->width) * gbuffer_->height,
                             Vec3(0.0f));
  return motionLayer({depth, object, gbuffer_->width, gbuffer_->height, gbuffer_->samples},
                     frame.camera, stage_.geometry(),
                     earlierView(stage_.scene(), stage_.path().frame(frame.number - 1)));
}

std::map<std::string, std::string> MethodSource::context() const {
  std::map<std::string, std::string> context{{"renderer", "CPU"},
                                             {"processor", processorName()},
                                             {"instructions", instructionSets()},
                                             {"light", stage_.light()}};
  if (!needs_.gl) return context;
  const gl::DeviceInfo& info = stage_.context()->info();
  context["renderer"] = info.renderer;
  context["device"] = info.device;
  context["platform"] = info.platformVersion;
  context["vendor"] = info.vendor;
  context["gl_version"] = info.version;
  context["glsl_version"] = info.glslVersion;
  context["timer"] = "wall clock around glFinish";
  return context;
}

}  // namespace catoptric::run
