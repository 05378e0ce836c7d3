// CPU time (of all threads: other programs disturb it less than the clock on the wall) of the steps
// of second_order's frame, 512 x 512 pixels with 2 x 2 samples, and what each takes at least,
// measured between its repetitions. Prints JSON: means over frames and repetitions, ms.
//
//   second_order_benchmark SCENE PATH FRAMES [REPEATS [OPTIONS]]
//
// Floors ("least"):
//   gbuffer, depth_images   the same triangles drawn with a constant colour; "once": shaded, over
//   the
//                           depth of the same picture, so that each sample is shaded once (and the
//                           depth is not cleared). Culling on the CPU is part of all three
//   readback                a copy of as many bytes by one thread
//   cluster, camera         copies of the bytes that they must read and write
//   intersect, composite    the loads, depth look-ups and writes that each sample needs, at the
//   cost
//                           of full-screen passes that do nothing else, and the reading of what
//                           they read once; a ray needs two texels of depth
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <exception>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "core/error.h"
#include "frame/steps.h"
#include "gl/context.h"
#include "methods/second_order/second_order.h"
#include "raster/scene_raster.h"
#include "scene/animate.h"
#include "scene/camera.h"
#include "scene/loader.h"

namespace catoptric::methods {
namespace {

constexpr int kSize = 512;
constexpr int kSamples = 2;
constexpr double kAllSamples = static_cast<double>(kSize * kSamples) * (kSize * kSamples);
constexpr std::size_t kCopied = std::size_t{24} << 20;
constexpr int kReads = 8;  ///< of a sample, of the calibration

double processMs() {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) * 1e3 + static_cast<double>(t.tv_nsec) * 1e-6;
}

/// Milliseconds of CPU time of `body` and the GL work that it issued.
template <class Body>
double busyMs(Body&& body) {
  const double start = processMs();
  body();
  glFinish();
  return processMs() - start;
}

struct Step {
  double whole = 0.0, once = 0.0, least = 0.0;
};

class Benchmark {
 public:
  Benchmark(const char* sceneFile, const char* pathFile, const char* options)
      : context_(gl::parseDevice("auto")),
        scene_(scene::loadScene(sceneFile)),
        pose_(scene::poseAt(scene_, 0.0)),
        geometry_(bakedGeometry()),
        lighting_(frame::makeLighting(
            scene_, pose_, std::make_shared<frame::EnvironmentLight>(scene_.environment))),
        raster_(scene_, geometry_),
        gbuffer_(raster_.makeGBuffer({kSize, kSize, kSamples, true})),
        picture_(gl::Texture::make2D("frame", GL_RGBA32F, kSize, kSize)),
        path_(scene::loadPath(pathFile, scene_)),
        method_(secondOrderEntry().make(config::parseText(options, "options"))) {
    settings_.width = settings_.height = kSize;
    settings_.samples = kSamples;
    settings_.masks = true;
    timer_.setFinish([this] {
      glFinish();
      const double now = processMs();
      busy_.push_back(now - last_);
      last_ = now;
    });
    method_->prepare(services_, settings_);
  }

  void measure(const std::string& frames, int repeats) {
    std::vector<int> numbers = scene::parseFrames(frames, path_->count());
    const double share = 1.0 / static_cast<double>(numbers.size() * repeats);
    for (const int number : numbers) {
      FrameInput input;
      input.frame = path_->frame(number);
      for (int i = -1; i < repeats; ++i) frame(input, i < 0 ? 0.0 : share);
    }
  }

  void print() const {
    double whole = 0.0, once = 0.0, least = 0.0;
    std::printf("{");
    for (const auto& [name, step] : steps_) {
      std::printf("\"%s\": {\"whole\": %.3f, \"once\": %.3f, \"least\": %.3f},\n ", name.c_str(),
                  step.whole, step.once, step.least);
      whole += step.whole;
      once += step.once;
      least += step.least;
    }
    std::printf("\"frame\": {\"whole\": %.3f, \"once\": %.3f, \"least\": %.3f},\n ", whole, once,
                least);
    for (const auto& [name, count] : counts_) std::printf("\"%s\": %.1f, ", name.c_str(), count);
    std::printf(
        "\n \"ns\": {\"write\": %.3f, \"load\": %.3f, \"depth\": %.3f, \"copied KiB\": %.3f}}\n",
        1e6 * write_, 1e6 * load_, 1e6 * depth_, 1e6 * copy_ * 1024.0);
  }

 private:
  /// A bake's variants of programs without its rays.
  frame::Geometry bakedGeometry() const {
    frame::Geometry geometry = frame::makeGeometry(scene_, pose_);
    if (scene_.bake.mode == scene::BakeMode::None) return geometry;
    for (frame::VertexAttributes& v : geometry.attributes) {
      v.bake = scene_.bake.mode == scene::BakeMode::Full ? Vec4(0.6f, 0.5f, 0.4f, 0.0f)
                                                         : Vec4(0.0f, 0.0f, 0.0f, 0.7f);
    }
    return geometry;
  }

  /// Milliseconds by step of the method's part of a frame.
  std::map<std::string, double> render(const FrameInput& input, Counters& counters) {
    timer_.take();
    busy_.clear();
    last_ = processMs();
    FrameOutput output;
    method_->render(input, services_, output);
    counters = output.counters;
    std::map<std::string, double> times;
    for (std::size_t k = 0; k < busy_.size(); ++k) times[timer_.samples()[k].step] += busy_[k];
    return times;
  }

  double calibrated(gl::Program& program, const char* loads, const char* fetches) {
    if (program.empty()) {
      program =
          gl::Program::fullScreen("calibration", "methods/second_order/shaders/calibration.frag",
                                  {{"LOADS", loads}, {"FETCHES", fetches}});
    }
    return busyMs([&] {
      gbuffer_.reflectionFramebuffer.bind();
      glDisable(GL_STENCIL_TEST);
      glDisable(GL_DEPTH_TEST);
      program.use();
      gbuffer_.normal.bindImage(0, GL_READ_ONLY);
      gbuffer_.depth.bind(2);
      gl::drawFullScreenTriangle();
    });
  }

  /// The frame and its floors once; `share` of it goes into the means.
  void frame(const FrameInput& input, double share) {
    const scene::Camera& camera = input.frame.camera;
    const auto add = [&](const std::string& name, double Step::*part, double ms) {
      steps_[name].*part += share * ms;
    };
    const auto drawGBuffer = [&] { raster_.drawGBuffer(gbuffer_, camera, lighting_); };

    // The frame
    Counters counters;
    Counters ignored;
    raster_.setDrawCost(raster::DrawCost::Whole);
    add("gbuffer", &Step::whole, busyMs(drawGBuffer));
    for (const auto& [name, ms] : render(input, counters)) add(name, &Step::whole, ms);
    add("composite", &Step::whole,
        busyMs([&] { raster_.composite(gbuffer_, camera, {false}, picture_); }));
    add("readback", &Step::whole, busyMs([&] { raster::readRgba(picture_); }));

    // What is drawn: each sample shaded once, and not at all
    raster_.setDrawCost(raster::DrawCost::SeenOnce);
    add("gbuffer", &Step::once, busyMs(drawGBuffer));
    add("depth_images", &Step::once, render(input, ignored)["depth_images"]);
    raster_.setDrawCost(raster::DrawCost::Constant);
    add("depth_images", &Step::least, render(input, ignored)["depth_images"]);
    add("gbuffer", &Step::least, busyMs(drawGBuffer));

    // Copies
    const double copy = busyMs([&] { std::memcpy(to_.data(), from_.data(), kCopied); }) / kCopied;
    const auto reflective = static_cast<double>(counters.at("reflective_samples"));
    const auto planar = static_cast<double>(counters.at("planar_samples"));
    const double read = 24.0 * kAllSamples + 16.0 * kSize * kSize;
    // Ids of all, normals and depth of reflective samples; their rays and clusters are written. A
    // copied byte is read and written
    const double clustered =
        4.0 * kAllSamples + (16.0 + 4.0 + 24.0) * reflective + 2.0 * kAllSamples;
    const double cameras = 24.0 * (reflective - planar) + 2.0 * 2.0 * kAllSamples;
    for (double Step::*part : {&Step::once, &Step::least}) {
      add("readback", part, copy * read);
      add("cluster", part, copy * clustered / 2.0);
      add("camera", part, copy * cameras / 2.0);
    }

    // Loads and writes; milliseconds of one sample
    const double write = calibrated(writes_, "0", "0") / kAllSamples;
    const double load = (calibrated(loads_, "8", "0") / kAllSamples - write) / kReads;
    const double depth = (calibrated(fetches_, "0", "8") / kAllSamples - write) / kReads;
    // Planar mirrors: cluster, colour; others: seven texels of their cluster, normal, four colours
    const double walked = reflective - planar;
    // Those loads are from the cache: what is read for the first time costs a copy's reading more
    const double intersect = planar * (2.0 * load + depth + write + 7.0 * copy) +
                             walked * (12.0 * load + 3.0 * depth + write + 13.0 * copy);
    const double composite = kAllSamples * (2.0 * load + 18.0 * copy) + kSize * kSize * write;
    for (double Step::*part : {&Step::once, &Step::least}) {
      add("intersect", part, intersect);
      add("composite", part, composite);
    }
    for (const char* name : {"clusters", "texels", "triangles"}) {
      counts_[name] += share * static_cast<double>(counters.at(name));
    }
    write_ += share * write;
    load_ += share * load;
    depth_ += share * depth;
    copy_ += share * copy;
  }

  gl::Context context_;
  scene::Scene scene_;
  scene::Pose pose_;
  frame::Geometry geometry_;
  frame::Lighting lighting_;
  raster::SceneRaster raster_;
  raster::GBuffer gbuffer_;
  gl::Texture picture_;
  std::unique_ptr<scene::CameraPath> path_;
  std::unique_ptr<Method> method_;
  frame::StepTimer timer_;
  RunSettings settings_;
  Services services_{scene_, geometry_, lighting_, &raster_, &gbuffer_, nullptr, timer_};
  std::vector<double> busy_;  ///< of the steps that timer_ has seen, ms
  double last_ = 0.0;
  std::vector<char> from_ = std::vector<char>(kCopied, 1);
  std::vector<char> to_ = std::vector<char>(kCopied, 2);
  gl::Program writes_;
  gl::Program loads_;
  gl::Program fetches_;
  std::map<std::string, Step> steps_;
  std::map<std::string, double> counts_;
  double write_ = 0.0, load_ = 0.0, depth_ = 0.0, copy_ = 0.0;  ///< ms, of a sample or byte
};

int run(int argc, char** argv) {
  if (argc < 4) throw UsageError("second_order_benchmark SCENE PATH FRAMES [REPEATS [OPTIONS]]");
  Benchmark benchmark(argv[1], argv[2], argc > 5 ? argv[5] : "{}");
  benchmark.measure(argv[3], argc > 4 ? std::max(1, std::atoi(argv[4])) : 3);
  benchmark.print();
  return 0;
}

}  // namespace
}  // namespace catoptric::methods

int main(int argc, char** argv) {
  try {
    return catoptric::methods::run(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "second_order_benchmark: %s\n", error.what());
    return 1;
  }
}
