// CPU time (of all threads: other programs disturb it less than the clock on the wall) of the steps
// of second_order's frame, 512 x 512 pixels with 2 x 2 samples, and what each takes at least,
// measured between its repetitions. Prints JSON: means over frames and repetitions, ms.
//
//   second_order_benchmark SCENE PATH FRAMES [REPEATS [OPTIONS]]
//
// Floors ("least"):
//   gbuffer, depth_images   the same triangles drawn with a constant colour; "once": shaded, over
//     the depth of the same picture, so that each sample is shaded once (and the depth is not
//     cleared). Culling on the CPU is part of all three
//   readback   a copy of as many bytes by one thread
//   cluster    position, normal and share of the sums of each reflective sample, bin and mirror ray
//     of those that are not in planar mirrors, by vector instructions in one thread, and a copy of
//     what is read of the others
//   camera     copies of the bytes that it must read and write
//   intersect  what each sample must read and write, and nothing else (reads.frag): its cluster's
//     number and table, the very texels that its walk reads up to its hit, four depths and colours
//     there; of planar mirrors one of each
//   composite  a pass that does nothing but read both images (and the tints of samples' objects,
//     where reflections have any: nothing else says which tint) and write the frame
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <exception>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "core/error.h"
#include "core/file.h"
#include "frame/steps.h"
#include "gl/context.h"
#include "gl/shader.h"
#include "methods/second_order/clustering/sums.h"
#include "methods/second_order/second_order.h"
#include "raster/scene_gpu/materials.h"
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

/// Angle of (x, y) in turns, to a few degrees: the arithmetic that a bin takes at least.
inline float turnOf(float x, float y) {
  const float ax = std::abs(x);
  const float ay = std::abs(y);
  const float t = std::min(ax, ay) / std::max(std::max(ax, ay), 1e-30f);
  float turn = t * (0.159f - 0.034f * t);
  turn = ay > ax ? 0.25f - turn : turn;
  turn = x < 0.0f ? 0.5f - turn : turn;
  return y < 0.0f ? 1.0f - turn : turn;
}

/// Samples' positions and normals, as `cluster` must have them, and of the first `binned` bins and
/// mirror rays.
struct ClusterKernel {
  VectorArrays position, normal, direction;
  std::vector<std::int32_t> bins;

  __attribute__((target_clones("avx2", "default"))) void run(const raster::GBufferCopy& copy,
                                                             const Mat3& rayFromPixel, int count,
                                                             int binned) {
    const auto width = copy.sampleWidth();
    for (int first = 0; first < count; first += width) {
      const int end = std::min(count, first + width);
      const int row = first / width;
      const Vec3 rowRay = rayFromPixel * Vec3(0.5f, static_cast<float>(row) + 0.5f, 1.0f);
      const Vec3 step = rayFromPixel[0];
      const float* __restrict depth = copy.depth.data();
      const float* __restrict source = copy.normal.data();
      float* __restrict px = position.x.data();
      float* __restrict py = position.y.data();
      float* __restrict pz = position.z.data();
      float* __restrict nx = normal.x.data();
      float* __restrict ny = normal.y.data();
      float* __restrict nz = normal.z.data();
      for (int k = first; k < end; ++k) {
        const float scale = 0.1f / depth[k];
        const auto x = static_cast<float>(k - first);
        px[k] = scale * (rowRay.x + x * step.x);
        py[k] = scale * (rowRay.y + x * step.y);
        pz[k] = scale * (rowRay.z + x * step.z);
      }
      for (int k = first; k < end; ++k) {
        nx[k] = source[4 * k];
        ny[k] = source[4 * k + 1];
        nz[k] = source[4 * k + 2];
      }
      float* __restrict dx = direction.x.data();
      float* __restrict dy = direction.y.data();
      float* __restrict dz = direction.z.data();
      std::int32_t* __restrict bin = bins.data();
      for (int k = first; k < std::min(end, binned); ++k) {
        const float across = std::sqrt(nx[k] * nx[k] + nz[k] * nz[k]);
        bin[k] = static_cast<std::int32_t>(8.0f * turnOf(ny[k], across)) * 13 +
                 static_cast<std::int32_t>(13.0f * turnOf(nx[k], nz[k]));
        const float scale = 1.0f / std::sqrt(px[k] * px[k] + py[k] * py[k] + pz[k] * pz[k]);
        const float twice = 2.0f * scale * (px[k] * nx[k] + py[k] * ny[k] + pz[k] * nz[k]);
        dx[k] = scale * px[k] - twice * nx[k];
        dy[k] = scale * py[k] - twice * ny[k];
        dz[k] = scale * pz[k] - twice * nz[k];
      }
    }
  }
};

struct Step {
  double whole = 0.0, once = 0.0, least = 0.0;
};

/// While it lives GL draws over the depth of the same picture, drawn before, which is not cleared:
/// each sample is shaded once.
class SeenOnce {
 public:
  SeenOnce() {
    depthFunc_ = glad_glDepthFunc;
    glad_glDepthFunc = [](GLenum f) { depthFunc_(f == GL_GREATER ? GLenum{GL_GEQUAL} : f); };
    glad_glClearNamedFramebufferfi = [](GLuint, GLenum, GLint, GLfloat, GLint) {};
    glad_glClearTexSubImage = [](GLuint, GLint, GLint, GLint, GLint, GLsizei, GLsizei, GLsizei,
                                 GLenum, GLenum, const void*) {};
    glad_glTextureSubImage3D = [](GLuint, GLint, GLint, GLint, GLint, GLsizei, GLsizei, GLsizei,
                                  GLenum, GLenum, const void*) {};
  }
  ~SeenOnce() {
    glad_glDepthFunc = depthFunc_;
    glad_glClearNamedFramebufferfi = clearFramebuffer_;
    glad_glClearTexSubImage = clearTexture_;
    glad_glTextureSubImage3D = writeTexture_;
  }
  SeenOnce(const SeenOnce&) = delete;
  SeenOnce& operator=(const SeenOnce&) = delete;

 private:
  static inline PFNGLDEPTHFUNCPROC depthFunc_ = nullptr;
  PFNGLCLEARNAMEDFRAMEBUFFERFIPROC clearFramebuffer_ = glad_glClearNamedFramebufferfi;
  PFNGLCLEARTEXSUBIMAGEPROC clearTexture_ = glad_glClearTexSubImage;
  PFNGLTEXTURESUBIMAGE3DPROC writeTexture_ = glad_glTextureSubImage3D;
};

/// While it lives programs are compiled that give surfaces a constant colour.
class Unshaded {
 public:
  Unshaded() {
    std::string pattern = (std::filesystem::temp_directory_path() / "catoptric-XXXXXX").string();
    folder_ = mkdtemp(pattern.data());
    write("raster/shaders/gbuffer.frag",
          "#include \"raster/shaders/surface.glsl\"\n"
          "uniform uint objectId;\n"
          "layout(location = 0) out vec4 outDiffuse;\n"
          "layout(location = 1) out vec4 outNormal;\n"
          "layout(location = 2) out uint outObject;\n"
          "void main() {\n"
          "  outDiffuse = outNormal = vec4(0.5);\n"
          "  outObject = objectId;\n"
          "}\n");
    write("methods/second_order/shaders/views.frag",
          "#include \"raster/shaders/surface.glsl\"\n"
          "uniform int frontLayer;\n"
          "layout(location = 0) out vec4 outDiffuse;\n"
          "void main() { outDiffuse = vec4(0.5); }\n");
    gl::setShaderFolder(folder_);
  }
  ~Unshaded() {
    gl::setShaderFolder({});
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
  }
  Unshaded(const Unshaded&) = delete;
  Unshaded& operator=(const Unshaded&) = delete;

 private:
  void write(const std::string& file, const std::string& text) const {
    std::filesystem::create_directories((folder_ / file).parent_path());
    writeFileAtomically(folder_ / file, text);
  }
  std::filesystem::path folder_;
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
        unshaded_(scene_, geometry_),
        materials_(scene_),
        gbuffer_(raster_.makeGBuffer({kSize, kSize, kSamples, true})),
        picture_(gl::Texture::make2D("frame", GL_RGBA32F, kSize, kSize)),
        path_(scene::loadPath(pathFile, scene_)),
        method_(secondOrderOptions().parse(config::parseText(options, "options"))),
        unshadedMethod_(secondOrderOptions().parse(config::parseText(options, "options"))) {
    settings_.width = settings_.height = kSize;
    settings_.samples = kSamples;
    settings_.masks = true;
    timer_.setFinish([this] {
      glFinish();
      const double now = processMs();
      busy_.push_back(now - last_);
      last_ = now;
    });
    method_.prepare(services_, settings_);
    unshadedMethod_.prepare(unshadedServices_, settings_);
    const auto all = static_cast<std::size_t>(kAllSamples);
    for (VectorArrays* v : {&kernel_.position, &kernel_.normal, &kernel_.direction}) v->resize(all);
    kernel_.bins.resize(all);
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
    const char* separator = "";
    for (const auto& [name, count] : counts_) {
      std::printf("%s\"%s\": %.1f", separator, name.c_str(), count);
      separator = ", ";
    }
    std::printf("}\n");
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
    return render(method_, services_, input, counters);
  }
  std::map<std::string, double> render(Method& method, Services& services, const FrameInput& input,
                                       Counters& counters) {
    timer_.take();
    busy_.clear();
    last_ = processMs();
    FrameOutput output;
    method.render(input, services, output);
    counters = output.counters;
    std::map<std::string, double> times;
    for (std::size_t k = 0; k < busy_.size(); ++k) times[timer_.samples()[k].step] += busy_[k];
    return times;
  }

  /// Of passes that do nothing but what intersect must for mirrors, in the images of the frame that
  /// was rendered last: read what its walks have read, write the reflection.
  double intersectReads(const scene::Camera& camera) {
    if (walks_.empty()) {
      std::vector<gl::Define> defines = method_.rayPass().walkDefines(false);
      defines.push_back({"RECORD"});
      walksOf_ = gl::Program::fullScreen("walks, recorded",
                                         "methods/second_order/benchmark/walks.frag", defines);
      for (const char* kind : {"0", "1"}) {
        defines.push_back({"KIND", kind});
        readsOf_.push_back(
            gl::Program::fullScreen("reads", "methods/second_order/benchmark/reads.frag", defines));
        defines.pop_back();
      }
      walks_ =
          gl::Texture::make2D("walks", GL_RGBA32F, gbuffer_.sampleWidth(), gbuffer_.sampleHeight());
    }
    const auto draw = [](raster::SampleClass sampleClass) {
      gl::DrawState state = raster::onSamplesOf(sampleClass);
      state.depth.write = false;
      const gl::DrawScope scope(state);
      gl::drawFullScreenTriangle();
    };
    const RayInputs inputs = method_.rayInputs(camera);
    gbuffer_.reflectionFramebuffer.bind();
    gbuffer_.reflectionFramebuffer.clearColor(0, 0.0f, 0.0f, 0.0f, 0.0f);
    method_.rayPass().bindWalk(walksOf_, services_, inputs);
    draw(raster::SampleClass::CurvedMirror);
    glCopyImageSubData(gbuffer_.reflection.id(), GL_TEXTURE_2D, 0, 0, 0, 0, walks_.id(),
                       GL_TEXTURE_2D, 0, 0, 0, 0, gbuffer_.sampleWidth(), gbuffer_.sampleHeight(),
                       1);
    glFinish();
    const double ms = busyMs([&] {
      for (gl::Program& reads : readsOf_) {
        method_.rayPass().bindWalk(reads, services_, inputs);
        walks_.bindImage(7, GL_READ_ONLY);
        draw(&reads == &readsOf_[0] ? raster::SampleClass::PlanarMirror
                                    : raster::SampleClass::CurvedMirror);
      }
    });
    return ms;
  }

  /// Of a pass that does nothing but what composite must: read its images, write the frame.
  double compositeReads() {
    if (reads_.empty()) {
      reads_ = gl::Program::fullScreen(
          "calibration", "methods/second_order/benchmark/calibration.frag",
          {{"SAMPLES", std::to_string(kSamples)}, {"TINTED", materials_.tinted() ? "1" : "0"}});
    }
    const gl::Framebuffer target("calibration", {{.texture = picture_}});
    return busyMs([&] {
      target.bind();
      reads_.use();
      gbuffer_.diffuse.bindImage(0, GL_READ_ONLY);
      gbuffer_.reflection.bindImage(1, GL_READ_ONLY);
      gbuffer_.object.bindImage(2, GL_READ_ONLY);
      materials_.tints().bind(5);
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
    add("gbuffer", &Step::whole, busyMs(drawGBuffer));
    for (const auto& [name, ms] : render(input, counters)) add(name, &Step::whole, ms);
    add("composite", &Step::whole,
        busyMs([&] { raster_.composite(gbuffer_, camera, {false}, picture_); }));
    add("readback", &Step::whole, busyMs([&] { raster::readRgba(picture_); }));

    // What rays must read, over the same images
    const double reads = intersectReads(camera);

    // What is drawn: each sample shaded once, and not at all
    {
      const SeenOnce once;
      add("gbuffer", &Step::once, busyMs(drawGBuffer));
      add("depth_images", &Step::once, render(input, ignored)["depth_images"]);
    }
    {
      const Unshaded constant;
      add("depth_images", &Step::least,
          render(unshadedMethod_, unshadedServices_, input, ignored)["depth_images"]);
      add("gbuffer", &Step::least,
          busyMs([&] { unshaded_.drawGBuffer(gbuffer_, camera, lighting_); }));
    }

    // Copies
    const double copy = busyMs([&] { std::memcpy(to_.data(), from_.data(), kCopied); }) / kCopied;
    const auto reflective = static_cast<double>(counters.at("reflective_samples"));
    const auto planar = static_cast<double>(counters.at("planar_samples"));
    const double read = 24.0 * kAllSamples + 16.0 * kSize * kSize;
    const double cameras = 24.0 * (reflective - planar) + 2.0 * 2.0 * kAllSamples;
    raster::readBack(gbuffer_, false, samples_);
    Sums sums;
    const double clustered = busyMs([&] {
      kernel_.run(samples_, scene::rayFromPixel(camera, kSize * kSamples, kSize * kSamples),
                  static_cast<int>(reflective), static_cast<int>(reflective - planar));
      for (std::uint32_t first = 0; first + kSize < reflective; first += kSize) {
        sums.add(kernel_.position, kernel_.normal, {first, 0, 0, kSize}, 0, Vec3(0.0f));
      }
    });
    sum_ += sums.dot;
    for (double Step::*part : {&Step::once, &Step::least}) {
      add("readback", part, copy * read);
      // And the ids of all samples are read, their clusters written
      add("cluster", part, clustered + copy * (4.0 + 2.0) * kAllSamples / 2.0);
      add("camera", part, copy * cameras / 2.0);
    }

    const double composite = compositeReads();
    for (double Step::*part : {&Step::once, &Step::least}) {
      add("intersect", part, reads);
      add("composite", part, composite);
    }
    for (const char* name : {"clusters", "texels", "triangles"}) {
      counts_[name] += share * static_cast<double>(counters.at(name));
    }
  }

  gl::Context context_;
  scene::Scene scene_;
  scene::Pose pose_;
  frame::Geometry geometry_;
  frame::Lighting lighting_;
  raster::SceneRaster raster_;
  raster::SceneRaster unshaded_;  ///< whose programs are compiled by Unshaded
  raster::Materials materials_;
  raster::GBuffer gbuffer_;
  gl::Texture picture_;
  std::unique_ptr<scene::CameraPath> path_;
  SecondOrder method_;
  SecondOrder unshadedMethod_;
  frame::StepTimer timer_;
  RunSettings settings_;
  Services services_{scene_, geometry_, lighting_, &raster_, &gbuffer_, nullptr, timer_};
  Services unshadedServices_{scene_, geometry_, lighting_, &unshaded_, &gbuffer_, nullptr, timer_};
  std::vector<double> busy_;  ///< of the steps that timer_ has seen, ms
  double last_ = 0.0;
  std::vector<char> from_ = std::vector<char>(kCopied, 1);
  std::vector<char> to_ = std::vector<char>(kCopied, 2);
  raster::GBufferCopy samples_;
  ClusterKernel kernel_;
  double sum_ = 0.0;  ///< so that nothing is left out
  gl::Program reads_;
  gl::Program walksOf_;
  std::vector<gl::Program> readsOf_;  ///< of planar and of curved mirrors
  gl::Texture walks_;
  std::map<std::string, Step> steps_;
  std::map<std::string, double> counts_;
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
