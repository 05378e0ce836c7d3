// For tests with a GL context: a scene on the device and in Embree, and the frames that methods
// render of it without a run.
#pragma once

#include <algorithm>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "gl/test_context.h"
#include "methods/shared/sample_points.h"
#include "methods/shared/sample_tiles.h"
#include "methods/testing/cpu_harness.h"
#include "raster/scene_raster.h"
#include "trace/bake/bake.h"
#include "trace/lobes/lobe_tracer.h"

namespace catoptric::test {

inline methods::RunSettings framesOf(int width, int height, int samplesPerAxis,
                                     bool masks = false) {
  methods::RunSettings settings;
  settings.width = width;
  settings.height = height;
  settings.samples = samplesPerAxis;
  settings.masks = masks;
  return settings;
}

/// A scene at one moment, with everything that methods share.
class GlStage {
 public:
  /// `baked`: bakes the light of vertices, if the scene asks for it.
  explicit GlStage(scene::Scene s, const methods::RunSettings& runSettings = {}, bool baked = false)
      : context(gl::testContext()),
        scene(std::move(s)),
        settings(runSettings),
        moment(momentOf(scene, baked)),
        raster(scene, moment.geometry),
        gbuffer(raster.makeGBuffer(
            {settings.width, settings.height, settings.samples, settings.masks})) {
    timer.setFinish([] { gl::Context::current().finish("a step"); });
  }
  GlStage(const GlStage&) = delete;
  GlStage& operator=(const GlStage&) = delete;

  /// Embree's BVH of the scene. The first call builds it, by `policy`.
  trace::TraceScene& embree(trace::BvhPolicy policy = trace::BvhPolicy::Refit) {
    if (!trace_) trace_.emplace(scene, moment.geometry, policy);
    return *trace_;
  }

  /// Moves everything to another time. Returns the indices of objects that changed.
  std::vector<int> moveTo(double seconds) {
    const scene::Pose pose = scene::poseAt(scene, seconds);
    std::vector<int> changed = frame::updateGeometry(moment.geometry, scene, pose);
    moment.lighting = frame::makeLighting(scene, pose, moment.lighting.environment);
    raster.update(moment.geometry, changed);
    if (trace_) trace_->update(changed);
    return changed;
  }

  /// Draws the G-buffer; with `part`, only these samples.
  void draw(const scene::Camera& camera, const std::optional<raster::Region>& part = std::nullopt) {
    timer.measure("gbuffer", [&] {
      raster.drawGBuffer(gbuffer, camera, moment.lighting, part, &moment.geometry);
    });
    context.check("the G-buffer");
  }

  /// The pixels of the last frame: R G B A, row 0 on top.
  std::vector<float> composite(const scene::Camera& camera) {
    gl::Texture frame = gl::Texture::make2D("frame", GL_RGBA32F, settings.width, settings.height);
    raster.composite(gbuffer, camera, {}, frame);
    context.check("the composite");
    return raster::readRgba(frame);
  }

  methods::Services services() {
    return {scene, moment.geometry, moment.lighting, &raster, &gbuffer, trace_ ? &*trace_ : nullptr,
            timer};
  }

  gl::Context& context;
  const scene::Scene scene;
  const methods::RunSettings settings;
  Moment moment;
  raster::SceneRaster raster;
  raster::GBuffer gbuffer;
  frame::StepTimer timer;

 private:
  static Moment momentOf(const scene::Scene& scene, bool baked) {
    Moment moment(scene);
    if (baked) trace::bakeVertices(scene, moment.geometry, *moment.lighting.environment, {});
    return moment;
  }

  std::optional<trace::TraceScene> trace_;
};

/// A method that renders a stage frame by frame.
class GlMethod {
 public:
  GlMethod(GlStage& stage, const methods::MethodEntry& entry, const std::string& options = "{}")
      : GlMethod(stage, entry.make(config::parseText(options, "test options"))) {}
  GlMethod(GlStage& stage, std::unique_ptr<methods::Method> method)
      : stage_(stage), method_(std::move(method)) {
    const methods::MethodPlan plan = method_->plan(stage.scene, stage.settings);
    if (plan.trace) stage.embree(plan.bvh);
    methods::Services services = stage.services();
    stage.timer.beginFrame(0);
    method_->prepare(services, stage.settings);
  }

  /// Renders the next frame, G-buffer and reflections. `changed`: the result of GlStage::moveTo().
  /// `part`: the samples of the G-buffer that may differ from the frame before.
  methods::FrameOutput render(const scene::Camera& camera, std::vector<int> changed = {},
                              const std::optional<raster::Region>& part = std::nullopt) {
    stage_.timer.beginFrame(++frames_);
    stage_.draw(camera, part);
    methods::FrameInput input;
    input.frame.number = frames_;
    input.frame.camera = camera;
    input.changedObjects = std::move(changed);
    input.firstOfSequence = input.restarts = frames_ == 1;
    input.changedSamples = part;
    methods::FrameOutput output;
    methods::Services services = stage_.services();
    method_->render(input, services, output);
    stage_.context.check("the frame");
    return output;
  }

 private:
  GlStage& stage_;
  std::unique_ptr<methods::Method> method_;
  int frames_ = 0;
};

/// The last frame's reflective samples, and the radiance of Embree's rays from the same points.
struct TracedSamples {
  std::vector<trace::ReflectionPoint> points;
  std::vector<std::uint32_t> places;  ///< in the G-buffer
  std::vector<Vec3> ours;             ///< as in GBuffer::reflection
  std::vector<Vec3> traced;
  trace::ReflectionCounts counts;

  TracedSamples(GlStage& stage, const scene::Camera& camera, const trace::ReflectionOptions& rays) {
    raster::GBufferCopy copy;
    raster::readBack(stage.gbuffer, true, copy);
    const std::vector<float> reflection = raster::readRgba(stage.gbuffer.reflection);
    const methods::SamplePoints pointAt(copy, camera, stage.embree());
    // Rays are traced in the same packets as by the method `traced`: if two triangles lie at one
    // distance, the packet decides which one Embree reports.
    const methods::SampleTiles tiles({copy.sampleWidth(), copy.sampleHeight()}, camera, stage.scene,
                                     stage.embree().extents(), {});
    methods::SampleTiles::Members members;
    trace::LobeTracer& tracer = trace::LobeTracer::ofThread();
    tracer.begin(stage.embree(), stage.moment.lighting,
                 scene::pixelSpreadRad(camera, copy.sampleHeight()), rays);
    for (int row = 0; row < methods::SampleTiles::rowsOf(copy.sampleHeight()); ++row) {
      for (int column = 0; column < tiles.columns(); ++column) {
        tiles.find(copy, column, row, members);
        for (std::size_t k = 0; k < members.count; ++k) {
          const std::size_t at = members.at[k];
          points.push_back(pointAt(members.x[k], members.y[k]));
          places.push_back(members.at[k]);
          ours.emplace_back(reflection[4 * at], reflection[4 * at + 1], reflection[4 * at + 2]);
        }
        traced.resize(points.size());
        tiles.place(copy, members, tracer.points());
        tracer.run(traced.data() + traced.size() - members.count, nullptr, nullptr, counts);
      }
    }
  }

  /// Mean absolute difference of 8-bit values with gamma 2.2.
  double l1Of8Bit() const {
    const auto shown = [](const Vec3& v) {
      return glm::clamp(glm::pow(glm::max(v, Vec3(0.0f)), Vec3(1.0f / 2.2f)), 0.0f, 1.0f) * 255.0f;
    };
    double sum = 0.0;
    for (std::size_t i = 0; i < ours.size(); ++i) {
      const Vec3 d = glm::abs(shown(ours[i]) - shown(traced[i]));
      sum += static_cast<double>((d.x + d.y + d.z) / 3.0f);
    }
    return sum / static_cast<double>(std::max<std::size_t>(1, ours.size()));
  }

  bool finite() const {
    return std::all_of(ours.begin(), ours.end(), [](const Vec3& v) { return isFinite(v); });
  }
};

}  // namespace catoptric::test
