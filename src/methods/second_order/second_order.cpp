#include "methods/second_order/second_order.h"

#include <algorithm>
#include <array>
#include <bit>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/error.h"
#include "gl/shader.h"
#include "methods/second_order/cameras/cluster_camera.h"
#include "methods/second_order/clustering/clusters.h"
#include "methods/second_order/depth_images/depth_images.h"
#include "methods/second_order/disocclusions.h"
#include "methods/second_order/reports.h"
#include "methods/shared/cube_map.h"
#include "methods/shared/reflectors.h"
#include "raster/refractive_samples.h"

namespace catoptric::methods {
namespace {

/// Values of `concave`, as SELF of intersect.frag numbers them.
constexpr std::array<const char*, 3> kSelfIntersect = {"ignore", "self_intersect",
                                                       "self_intersect_all"};

const config::Schema& schema() {
  static const config::Schema options = {
      .name = "second_order",
      .help = "Options of the method second_order.",
      .fields = {
          {.name = "max_theta_bins",
           .type = config::FieldType::Integer,
           .help = "bins of normals over 360 degrees around the vertical, at most",
           .defaultText = "13",
           .minimum = 1,
           .maximum = 128},
          {.name = "max_phi_bins",
           .type = config::FieldType::Integer,
           .help = "bins of normals over 180 degrees from the vertical, at most",
           .defaultText = "8",
           .minimum = 1,
           .maximum = 64},
          {.name = "bin_density",
           .type = config::FieldType::Number,
           .help = "factor on the number of bins that an object's area gives it; 1 is the paper's",
           .defaultText = "10",
           .minimum = 0.01,
           .maximum = 1000},
          {.name = "min_cluster_samples",
           .type = config::FieldType::Integer,
           .help = "smaller clusters see the environment map",
           .defaultText = "16",
           .minimum = 1,
           .maximum = 1000000},
          {.name = "clustering",
           .type = config::FieldType::String,
           .help = "bins: by bins of normals; k_means: from there each object's samples go to the "
                   "nearest of as many mean rays, planar parts apart",
           .defaultText = "\"bins\"",
           .allowed = {"bins", "k_means"}},
          {.name = "depth_image_scale",
           .type = config::FieldType::Number,
           .help = "resolution of the depth images against their cluster's own",
           .defaultText = "1",
           .minimum = 0.05,
           .maximum = 8},
          {.name = "max_texels_per_sample",
           .type = config::FieldType::Number,
           .help = "texels of a depth image per sample of its cluster, at most",
           .defaultText = "2",
           .minimum = 0.25,
           .maximum = 64},
          {.name = "level_error",
           .type = config::FieldType::Number,
           .help = "error of an object's level of detail in a depth image, texels; up to 4 times "
                   "as much where s is small; 0: always the finest level",
           .defaultText = "0.75",
           .minimum = 0,
           .maximum = 16},
          {.name = "rays",
           .type = config::FieldType::Integer,
           .help = "rays per sample on surfaces with g above 0.05; mirrors take one",
           .defaultText = "8",
           .minimum = 1,
           .maximum = 64},
          {.name = "memory_mib",
           .type = config::FieldType::Integer,
           .help = "memory of the depth images; more than fits is drawn at a lower resolution",
           .defaultText = "512",
           .minimum = 1,
           .maximum = 65536},
          {.name = "compound",
           .type = config::FieldType::Bool,
           .help =
               "one draw sends an object's triangles to all depth images of a layer; otherwise a "
               "draw for each image",
           .defaultText = "true"},
          {.name = "depth_layers",
           .type = config::FieldType::Integer,
           .help =
               "2: depth images of what is not a planar mirror have the second nearest surface, "
               "too, for rays that pass behind the nearest",
           .defaultText = "1",
           .minimum = 1,
           .maximum = 2},
          {.name = "environment_face_size",
           .type = config::FieldType::Integer,
           .help = "texels along the edge of a face of the cube map for rays that find nothing",
           .defaultText = "256",
           .minimum = 1,
           .maximum = 4096},
          {.name = "concave",
           .type = config::FieldType::String,
           .help = "what rays that meet their own object again show: what lies behind it (ignore), "
                   "or its "
                   "diffuse component, of concave clusters' rays (self_intersect) or of all that "
                   "are not "
                   "planar mirrors' (self_intersect_all)",
           .defaultText = "\"ignore\"",
           .allowed = {kSelfIntersect.begin(), kSelfIntersect.end()}},
          {.name = "glossy",
           .type = config::FieldType::String,
           .help = "cone: every ray of a lobe is walked; neighbourhood: the one in its centre, the "
                   "others are looked up at its distance",
           .defaultText = "\"cone\"",
           .allowed = {"cone", "neighbourhood"}},
          {.name = "glossy_reach",
           .type = config::FieldType::Number,
           .help = "glossy reflections fade to the diffuse colour over this many metres times (1 - "
                   "g) / g; 0: they do not",
           .defaultText = "0",
           .minimum = 0,
           .maximum = 1000000},
          {.name = "count_disocclusions",
           .type = config::FieldType::Bool,
           .help = "compare what rays find with Embree's rays: counts disoccluded and wrong_hit, "
                   "mask.disoccluded; takes the time of a ray tracer",
           .defaultText = "false"},
      }};
  return options;
}

struct Options {
  ClusterOptions cluster;
  CameraOptions camera;
  DepthImageOptions images;
  int faceSize = 256;
  int selfIntersect = 0;  ///< of kSelfIntersect
  bool neighbourhood = false;
  float glossyReach = 0.0f;
  bool countDisocclusions = false;
};

Options parseOptions(const config::Value& value) {
  config::require(value, schema());
  const auto integer = [&](const char* name) {
    return config::valueOr(value, schema(), name).asInteger();
  };
  const auto number = [&](const char* name) {
    return static_cast<float>(config::valueOr(value, schema(), name).asNumber());
  };
  Options options;
  options.cluster.maxThetaBins = static_cast<int>(integer("max_theta_bins"));
  options.cluster.maxPhiBins = static_cast<int>(integer("max_phi_bins"));
  options.cluster.binDensity = number("bin_density");
  options.cluster.minSamples = static_cast<int>(integer("min_cluster_samples"));
  options.cluster.kMeans = config::valueOr(value, schema(), "clustering").asString() == "k_means";
  options.camera.depthImageScale = number("depth_image_scale");
  options.camera.maxTexelsPerSample = number("max_texels_per_sample");
  options.camera.rays = static_cast<int>(integer("rays"));
  options.images.levelErrorTexels = number("level_error");
  options.images.memoryBytes = static_cast<std::uint64_t>(integer("memory_mib")) << 20;
  options.images.compound = config::valueOr(value, schema(), "compound").asBool();
  options.images.depthLayers = static_cast<int>(integer("depth_layers"));
  options.neighbourhood = config::valueOr(value, schema(), "glossy").asString() == "neighbourhood";
  options.glossyReach = number("glossy_reach");
  options.selfIntersect = static_cast<int>(
      std::ranges::find(kSelfIntersect, config::valueOr(value, schema(), "concave").asString()) -
      kSelfIntersect.begin());
  options.countDisocclusions = config::valueOr(value, schema(), "count_disocclusions").asBool();
  options.faceSize = static_cast<int>(integer("environment_face_size"));
  return options;
}

/// What the scene has of reflectors, hence which passes run.
struct SceneReflectors : Reflectors {
  std::vector<ReflectorKind> kinds;  ///< by object id
  std::vector<bool> skipOwn;         ///< by object id: flat, hence never seen in itself
  std::vector<float> weight;         ///< by object id: of its reflections, at most
  bool bent = false;  ///< normal maps may turn reflected rays below the surface that they leave
  bool levelsVary = false;  ///< s comes from a texture: some samples may not reflect
};

SceneReflectors findSceneReflectors(const scene::Scene& scene, bool fresnel) {
  SceneReflectors found;
  static_cast<Reflectors&>(found) = findReflectors(scene);
  found.kinds.push_back(ReflectorKind::None);
  found.skipOwn.push_back(false);
  found.weight.push_back(1.0f);
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    const scene::Object& object = scene.objects[i];
    const scene::Material& material = scene.materials[object.material];
    const raster::SampleClass kind = found.classOf[i + 1];
    found.kinds.push_back(kind == raster::SampleClass::Diffuse  ? ReflectorKind::None
                          : kind == raster::SampleClass::Glossy ? ReflectorKind::Glossy
                                                                : ReflectorKind::Mirror);
    found.skipOwn.push_back(object.planar);
    const Vec3& tint = material.reflectionTint;
    const bool varies = fresnel || material.metallicRoughnessTexture.used();
    found.weight.push_back((varies ? 1.0f : material.specularLevel) *
                           std::max({tint.x, tint.y, tint.z}));
    found.bent =
        found.bent || (kind != raster::SampleClass::Diffuse && material.normalTexture.used());
    found.levelsVary = found.levelsVary || (kind != raster::SampleClass::Diffuse &&
                                            material.metallicRoughnessTexture.used());
  }
  return found;
}

/// Times that depth images are drawn at 0.7 of their resolution until they fit: 1 / 5000. Ours.
constexpr int kMostShrinks = 24;

/// Samples along the edge of a tile with a sample that is still to be looked up: those of an
/// integer of marks. Ours.
constexpr int kTileSamples = 4;
using Marks = std::uint16_t;
using TileRow = std::uint64_t;

/// Marks of intersect.frag in all samples of a row of a tile, beside raster::MaskBit.
constexpr TileRow everySample(Marks mark) {
  return 0x0001000100010001u * mark;
}
constexpr Marks kMarkBridged = 1u << 14;
constexpr Marks kMarkLater = 1u << 15;

/// Counted by intersect.frag.
constexpr std::array<const char*, 4> kCountNames = {"below_horizon", "met_itself", "faded",
                                                    "second_layer_hits"};
/// Counted in its marks, `environment` together with `unclustered`.
constexpr std::array<std::pair<Marks, const char*>, 3> kMarks = {
    {{raster::kMaskEnvironment, "environment"},
     {raster::kMaskSky, "sky"},
     {kMarkBridged, "bridged"}}};

bool readsMeasured = false;

class SecondOrder : public Method {
 public:
  explicit SecondOrder(const Options& options) : options_(options) {}

  MethodPlan plan(const scene::Scene& scene, const RunSettings& settings) const override {
    MethodPlan plan;
    plan.gbuffer = true;
    const SceneReflectors reflectors = findSceneReflectors(scene, settings.fresnelSchlick);
    if (!reflectors.any()) return plan;
    const auto samples = static_cast<std::uint64_t>(settings.width) * settings.height *
                         settings.samples * settings.samples;
    std::string kinds;
    const auto add = [&](bool has, const char* what) {
      if (has) kinds += (kinds.empty() ? "" : ", ") + std::string(what);
    };
    add(reflectors.planarMirrors, "planar mirrors (the mirrored frame's own samples)");
    add(reflectors.curvedMirrors, "curved mirrors (one ray)");
    add(reflectors.glossy, "glossy objects (rays of a lobe)");
    const bool again = scene.animated();
    plan.items = {
        {"precomputation", "levels", "coarser levels of objects that do not deform", 0},
        {again ? "pass" : "precomputation", "cube_map",
         std::string("the diffuse scene from one point, for rays that find nothing") +
             (again ? ", drawn again in frames in which an object or a light moved"
                    : ", drawn once: it does not change"),
         0},
        {"pass", "readback", "normals, ids and depth for the clustering", 0},
        {"pass", "cluster", "reflective samples by object and normal", 0},
        {"pass", "camera", "a camera for each cluster", 0},
        {"pass", "depth_images", "the diffuse scene as each cluster sees it", 0},
        {"pass", "intersect", kinds, 0},
        {"resource", "cube map",
         "6 faces of " + std::to_string(options_.faceSize) + " x " +
             std::to_string(options_.faceSize) + ", RGBA16F, with mip levels",
         cubeMapBytes(options_.faceSize, 8)},
        {"resource", "G-buffer copy", "what is read back", samples * (16 + 4 + 4)},
        {"resource", "cluster of each sample", "R16UI", samples * 2},
        {"resource", "depth images", "at most, by memory_mib", options_.images.memoryBytes},
    };
    if (options_.countDisocclusions && reflectors.any()) {
      plan.trace = true;
      plan.items.push_back({"pass", "disocclusions", "asked for: count_disocclusions", 0});
      plan.items.push_back(
          {"resource", "what rays found", "compared with Embree's", samples * sizeof(Found)});
    }
    return plan;
  }

  void prepare(Services& services, const RunSettings& settings) override {
    settings_ = settings;
    reflectors_ = findSceneReflectors(services.scene, settings.fresnelSchlick);
    if (!reflectors_.any()) return;
    refractive_ = raster::RefractiveSamples(services.scene);
    if (options_.images.levelErrorTexels > 0.0f) {
      services.timer.measure("levels", [&] {
        services.raster->buildDetailLevels(services.scene, services.geometry, services.lighting);
      });
    }
    // What most frames need; the rest with the first frame that does
    if (reflectors_.planarMirrors) {
      planar(services, options_.camera.depthImageScale == 1.0f);
    }
    if (reflectors_.curvedMirrors) curved(services);
    if (reflectors_.glossy) glossy_ = program(services, "walk over depth images, lobes", "2");
    lookUps_ = program(services, "samples that found nothing", "3");
    counts_ = gl::Buffer("fallback counts", kCountNames.size() * sizeof(std::uint32_t));
    const int width = settings.width * settings.samples;
    const int height = settings.height * settings.samples;
    marks_.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
    if (!settings.masks) {
      const raster::GBuffer& gbuffer = *services.gbuffer;
      ownMarks_ = gl::Texture::make2D("marks of samples", GL_R16UI, width, height);
      ownTarget_ =
          gl::Framebuffer("reflection", {{.texture = gbuffer.reflection}, {.texture = ownMarks_}},
                          {.texture = gbuffer.depth});
    }
    if (options_.countDisocclusions) {
      found_.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
      foundBuffer_ = gl::Buffer("what rays found", found_.size() * sizeof(Found));
    }
    tilesAcross_ = (width + kTileSamples - 1) / kTileSamples;
    tilesDown_ = (height + kTileSamples - 1) / kTileSamples;
    const auto tiles =
        static_cast<std::size_t>(tilesAcross_) * static_cast<std::size_t>(tilesDown_);
    tiles_ = gl::Buffer("tiles to look up", tiles * sizeof(std::uint32_t));
    tileTexture_ = gl::Texture::makeBuffer("tiles to look up", GL_R32UI, tiles_);
    clusterSamples_ = gl::Texture::make2D("cluster of each sample", GL_R16UI, width, height);
    DepthImageOptions images = options_.images;
    images.weight = reflectors_.weight;
    if (options_.glossyReach > 0.0f) images.reach = reachOfObjects(services.scene);
    images_ = std::make_unique<DepthImages>(width, height, options_.camera.depthImageScale, images);
    if (!services.scene.animated()) {
      environment_.draw(services, services.geometry.bounds.centre(), options_.faceSize);
    }
  }

  void render(const FrameInput& input, Services& services, FrameOutput& output) override {
    raster::GBuffer& gbuffer = *services.gbuffer;
    if (settings_.masks) gbuffer.reflectionFramebuffer.clearColorUint(1, 0);
    output.counters = zeros(secondOrderCounters());
    if (!reflectors_.any()) return;
    frame::StepTimer& timer = services.timer;
    const scene::Camera& camera = input.frame.camera;

    environment_.follow(input, services, services.geometry.bounds.centre(), options_.faceSize);
    output.counters["clamped_cube_map"] = environment_.clampedTexels();
    timer.measure("readback", [&] { raster::readBack(gbuffer, reflectors_.levelsVary, copy_); });
    timer.measure("cluster",
                  [&] { clustering_.build(copy_, camera, reflectors_.kinds, options_.cluster); });

    // Cameras, at a resolution that the memory allows
    CameraOptions cameraOptions = options_.camera;
    cameraOptions.sceneBounds.min = services.geometry.bounds.min - camera.eye();
    cameraOptions.sceneBounds.max = services.geometry.bounds.max - camera.eye();
    cameraOptions.maxTextureSize = std::min(images_->layerWidth(), images_->layerHeight());
    std::vector<ClusterCamera> cameras;
    timer.measure("camera", [&] {
      for (int attempt = 0;; ++attempt) {
        cameras = makeClusterCameras(clustering_, camera, gbuffer.sampleWidth(),
                                     gbuffer.sampleHeight(), cameraOptions);
        if (images_->fits(cameras)) break;
        if (attempt == kMostShrinks) {
          throw UsageError("second_order: the depth images of " +
                           std::to_string(clustering_.clusters().size()) +
                           " clusters do not fit into memory_mib " +
                           std::to_string(options_.images.memoryBytes >> 20) +
                           " at any resolution; allow more, or fewer clusters by a larger "
                           "min_cluster_samples or a smaller bin_density");
        }
        cameraOptions.depthImageScale *= 0.7f;
        ++output.counters["images_shrunk"];
      }
      clusterSamples_.upload(0, 0, GL_RED_INTEGER, GL_UNSIGNED_SHORT,
                             clustering_.clusterOf().data());
    });

    const std::vector<Cluster>& clusters = clustering_.clusters();
    std::vector<std::uint64_t> triangles(clusters.size(), 0);
    bool onGrids = true;
    for (std::size_t i = 0; i < clusters.size(); ++i) {
      onGrids = onGrids && (cameras[i].mirrorGrid ||
                            !reflectors_.skipOwn[static_cast<std::size_t>(clusters[i].object)]);
    }
    bool exact = false;
    timer.measure("depth_images", [&] {
      // Planar clusters of curved objects are walked over
      exact = onGrids && reflectors_.planarMirrors && cameraOptions.depthImageScale == 1.0f;
      output.counters["left_out"] = images_->draw(
          clusters, cameras, reflectors_.skipOwn,
          exact ? clustering_.clusterOf() : std::span<const std::uint16_t>(), camera.eye(),
          services.geometry, services.lighting, *services.raster, triangles);
    });
    timer.measure("intersect", [&] {
      if (!settings_.masks) ownTarget_.clearColorUint(1, 0);
      intersect(services, gbuffer, camera, onGrids, exact);
      output.counters["refraction_mirrored"] = refractive_.count(gbuffer);
    });
    report(clusters, cameras, triangles, output);
    if (readsMeasured) measureReads(services, gbuffer, camera, onGrids, exact);
    if (std::ranges::find(settings_.layers, kClusterLayer) != settings_.layers.end()) {
      const std::vector<std::uint16_t>& clusterOf = clustering_.clusterOf();
      SampleLayer& layer = output.sampleLayers.emplace_back(SampleLayer{kClusterLayer, {}});
      layer.numbers.assign(clusterOf.begin(), clusterOf.end());
      for (std::uint32_t& cluster : layer.numbers) {
        if (cluster > 0) --cluster;
      }
    }
    if (options_.countDisocclusions) {
      timer.measure("disocclusions",
                    [&] { countDisocclusions(services, camera, cameras, output); });
    }
  }

 private:
  /// How far the rays of lobes go, as intersect.frag has it; where g varies over an object, 0.
  std::vector<float> reachOfObjects(const scene::Scene& scene) const {
    std::vector<float> reach(reflectors_.kinds.size(), 0.0f);
    for (std::size_t i = 1; i < reach.size(); ++i) {
      const scene::Material& material = scene.materials[scene.objects[i - 1].material];
      if (reflectors_.kinds[i] == ReflectorKind::Glossy &&
          !material.metallicRoughnessTexture.used()) {
        reach[i] = options_.glossyReach * (1.0f - material.glossiness) / material.glossiness;
      }
    }
    return reach;
  }
  gl::Program program(const Services& services, const char* label, const char* kind,
                      bool exactGrid = false, bool record = false) const {
    std::vector<gl::Define> defines = raster::SceneRaster::shadingDefines(services.lighting);
    defines.push_back({"KIND", kind});
    defines.push_back({"RAYS", std::to_string(options_.camera.rays)});
    defines.push_back({"NEIGHBOURHOOD", options_.neighbourhood ? "1" : "0"});
    defines.push_back({"FADE", options_.glossyReach > 0.0f ? "1" : "0"});
    defines.push_back({"SELF", std::to_string(options_.selfIntersect)});
    defines.push_back({"BENT", *kind != '0' && reflectors_.bent ? "1" : "0"});
    defines.push_back({"FOUND", options_.countDisocclusions ? "1" : "0"});
    defines.push_back({"LAYERS", std::to_string(options_.images.depthLayers)});
    defines.push_back({"EXACT_GRID", exactGrid ? "1" : "0"});
    defines.push_back({"RECORD", record ? "1" : "0"});
    return gl::Program(label, {.vertex = *kind == '3' ? "methods/second_order/shaders/tiles.vert"
                                                      : "gl/fullscreen.vert",
                               .fragment = "methods/second_order/shaders/intersect.frag",
                               .defines = std::move(defines)});
  }
  gl::Program& curved(const Services& services) {
    if (curved_.empty()) curved_ = program(services, "walk over depth images", "1");
    return curved_;
  }
  /// `exact`: a texel for each sample.
  gl::Program& planar(const Services& services, bool exact) {
    gl::Program& made = exact ? planarExact_ : planarScaled_;
    if (made.empty()) made = program(services, "look-up in mirrored frames", "0", exact);
    return made;
  }

  void intersect(Services& services, const raster::GBuffer& gbuffer, const scene::Camera& camera,
                 bool onGrids, bool exact, bool record = false) {
    const std::vector<std::uint32_t> zeros(kCountNames.size(), 0);
    counts_.write(0, zeros.size() * sizeof(std::uint32_t), zeros.data());
    if (options_.countDisocclusions) {
      std::fill(found_.begin(), found_.end(), Found{});
      foundBuffer_.write(0, found_.size() * sizeof(Found), found_.data());
      foundBuffer_.bindStorage(2);
    }
    (settings_.masks ? gbuffer.reflectionFramebuffer : ownTarget_).bind();
    glDisable(GL_DEPTH_TEST);
    glDepthMask(GL_FALSE);
    glDisable(GL_BLEND);
    glDisable(GL_SCISSOR_TEST);
    glEnable(GL_STENCIL_TEST);
    glStencilOp(GL_KEEP, GL_KEEP, GL_KEEP);
    const auto use = [&](gl::Program& program) {
      services.raster->bindShadingResources(program.id(), services.lighting);
      program.use();
      clusterSamples_.bindImage(0, GL_READ_ONLY);
      gbuffer.normal.bindImage(1, GL_READ_ONLY);
      gbuffer.depth.bind(2);
      images_->bind();
      environment_.bind(7);
      counts_.bindStorage(1);
      if (options_.images.depthLayers > 1) program.set("secondLayer", images_->secondLayer());
      program.set("rayFromPixel",
                  scene::rayFromPixel(camera, gbuffer.sampleWidth(), gbuffer.sampleHeight()));
      gbuffer.diffuse.bindImage(4, GL_READ_ONLY);
      if (options_.glossyReach > 0.0f) program.set("reach", options_.glossyReach);
      if (options_.selfIntersect > 0) gbuffer.object.bindImage(6, GL_READ_ONLY);
      if (options_.selfIntersect > 0 || reflectors_.bent) {
        program.set("pixelFromRay", glm::inverse(scene::rayFromPixel(camera, gbuffer.sampleWidth(),
                                                                     gbuffer.sampleHeight())));
      }
      program.set("nearMetres", camera.nearMetres);
      program.set("farthest", 4.0f * services.geometry.bounds.diameter());
      program.set("samplesPerPixel", gbuffer.samples);
      const Box3& bounds = services.geometry.bounds;
      program.set("sceneLeast", bounds.min - camera.eye());
      program.set("sceneMost", bounds.max - camera.eye());
      program.set("cubeCentre", bounds.centre() - camera.eye());
      program.set("sampleSize", 1.0f / Vec2(gbuffer.sampleWidth(), gbuffer.sampleHeight()));
      program.set("atlasTexel", 1.0f / Vec2(images_->layerWidth(), images_->layerHeight()));
      environment_.setLevels(program);
    };
    const auto pass = [&](gl::Program& program, raster::SampleClass sampleClass) {
      if (program.empty()) return;
      use(program);
      glStencilFunc(GL_EQUAL, static_cast<GLint>(sampleClass), 0xFF);
      gl::drawFullScreenTriangle();
    };
    if (record) {
      gbuffer.reflectionFramebuffer.clearColor(0, 0.0f, 0.0f, 0.0f, 0.0f);
      pass(recorded_, raster::SampleClass::CurvedMirror);
      glDisable(GL_STENCIL_TEST);
      glDepthMask(GL_TRUE);
      return;
    }
    // An object known as flat need not be flat in the frame (it deforms, or is one pixel large)
    if (reflectors_.planarMirrors) {
      pass(onGrids ? planar(services, exact) : curved(services), raster::SampleClass::PlanarMirror);
    }
    if (reflectors_.curvedMirrors) pass(curved_, raster::SampleClass::CurvedMirror);
    if (reflectors_.glossy) pass(glossy_, raster::SampleClass::Glossy);
    glDisable(GL_STENCIL_TEST);

    // What found nothing, apart from the others: they would all pay for the cube map and the sky
    takeMarks(settings_.masks ? gbuffer.masks : ownMarks_);
    if (!later_.empty()) {
      glTextureBarrier();
      use(lookUps_);
      gbuffer.reflection.bind(8);
      tiles_.write(0, later_.size() * sizeof(std::uint32_t), later_.data());
      tileTexture_.bind(9);
      lookUps_.set("tilesAcross", tilesAcross_);
      lookUps_.set("tilesDown", tilesDown_);
      glColorMaski(1, GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
      glViewport(0, 0, tilesAcross_ * kTileSamples, tilesDown_ * kTileSamples);
      gl::drawPoints(later_.size(), kTileSamples);
      glColorMaski(1, GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
    }
    glDepthMask(GL_TRUE);
  }

  /// Counts the samples' marks and lists the tiles with one that is still to be looked up.
  void takeMarks(const gl::Texture& marks) {
    marks.read(0, GL_RED_INTEGER, GL_UNSIGNED_SHORT, std::as_writable_bytes(std::span(marks_)));
    markCounts_ = {};
    later_.clear();
    const int width = marks.width();
    std::vector<bool> listed(static_cast<std::size_t>(tilesAcross_));
    for (int y = 0; y < marks.height(); ++y) {
      if (y % kTileSamples == 0) listed.assign(listed.size(), false);
      const Marks* line = &marks_[static_cast<std::size_t>(y) * static_cast<std::size_t>(width)];
      for (int x = 0; x < width; x += kTileSamples) {
        TileRow row = 0;
        if (x + kTileSamples <= width) {
          std::memcpy(&row, line + x, sizeof row);
        } else {
          std::memcpy(&row, line + x, sizeof(Marks) * static_cast<std::size_t>(width - x));
        }
        if (row == 0) continue;
        for (std::size_t i = 0; i < kMarks.size(); ++i) {
          markCounts_[i] += std::popcount(row & everySample(kMarks[i].first));
        }
        const auto tile = static_cast<std::size_t>(x / kTileSamples);
        if ((row & everySample(kMarkLater)) == 0 || listed[tile]) continue;
        listed[tile] = true;
        later_.push_back(static_cast<std::uint32_t>(y / kTileSamples * tilesAcross_) +
                         static_cast<std::uint32_t>(tile));
      }
    }
  }

  /// Mirrors alone, as the benchmark's scenes have them.
  void measureReads(Services& services, const raster::GBuffer& gbuffer, const scene::Camera& camera,
                    bool onGrids, bool exact) {
    if (recorded_.empty()) {
      recorded_ = program(services, "walks, recorded", "1", false, true);
      const auto reads = [](const char* kind) {
        return gl::Program::fullScreen("reads", "methods/second_order/benchmark/reads.frag",
                                       {{"KIND", kind}});
      };
      planarReads_ = reads("0");
      curvedReads_ = reads("1");
      walks_ =
          gl::Texture::make2D("walks", GL_RGBA32F, gbuffer.sampleWidth(), gbuffer.sampleHeight());
    }
    intersect(services, gbuffer, camera, onGrids, exact, true);
    glCopyImageSubData(gbuffer.reflection.id(), GL_TEXTURE_2D, 0, 0, 0, 0, walks_.id(),
                       GL_TEXTURE_2D, 0, 0, 0, 0, gbuffer.sampleWidth(), gbuffer.sampleHeight(), 1);
    services.timer.measure("recording", [] {});
    services.timer.measure("reads", [&] {
      gbuffer.reflectionFramebuffer.bind();
      glDisable(GL_DEPTH_TEST);
      glDepthMask(GL_FALSE);
      glEnable(GL_STENCIL_TEST);
      clusterSamples_.bindImage(0, GL_READ_ONLY);
      walks_.bindImage(1, GL_READ_ONLY);
      gbuffer.depth.bind(2);
      images_->bind();
      for (gl::Program* reads : {&planarReads_, &curvedReads_}) {
        const bool planar = reads == &planarReads_;
        reads->use();
        if (!planar)
          reads->set("sampleSize", 1.0f / Vec2(gbuffer.sampleWidth(), gbuffer.sampleHeight()));
        reads->set("atlasTexel", 1.0f / Vec2(images_->layerWidth(), images_->layerHeight()));
        glStencilFunc(GL_EQUAL,
                      static_cast<GLint>(planar ? raster::SampleClass::PlanarMirror
                                                : raster::SampleClass::CurvedMirror),
                      0xFF);
        gl::drawFullScreenTriangle();
      }
      glDisable(GL_STENCIL_TEST);
      glDepthMask(GL_TRUE);
    });
  }

  void countDisocclusions(Services& services, const scene::Camera& camera,
                          std::span<const ClusterCamera> cameras, FrameOutput& output) {
    raster::GBuffer& gbuffer = *services.gbuffer;
    foundBuffer_.read(0, found_.size() * sizeof(Found), found_.data());
    std::vector<std::uint16_t> masks;
    if (settings_.masks) masks = raster::readMasks(gbuffer.masks);
    const Disocclusions counted =
        findDisocclusions(copy_, camera, found_, clustering_.clusterOf(), cameras,
                          options_.camera.rays, *services.trace, masks);
    if (settings_.masks) raster::writeMasks(gbuffer.masks, masks);
    output.counters["disoccluded"] = counted.samples;
    output.counters["wrong_hit"] = counted.wrongHits;
  }

  void report(const std::vector<Cluster>& clusters, const std::vector<ClusterCamera>& cameras,
              const std::vector<std::uint64_t>& triangles, FrameOutput& output) const {
    std::array<std::uint32_t, kCountNames.size()> counts{};
    counts_.read(0, sizeof counts, counts.data());
    Counters& c = output.counters;
    for (std::size_t i = 0; i < counts.size(); ++i) c[kCountNames[i]] = counts[i];
    for (std::size_t i = 0; i < kMarks.size(); ++i) c[kMarks[i].second] = markCounts_[i];
    c["environment"] -= clustering_.samplesInNoCluster();
    c["unclustered"] = clustering_.samplesInNoCluster();
    c["clusters"] = clusters.size();
    c["reflective_samples"] = clustering_.reflectiveSamples();
    c["depth_image_bytes"] = images_->bytes();
    c["empty_images"] = 0;
    c["bins_halved"] = static_cast<std::uint64_t>(clustering_.timesHalved());
    c["bins_kept"] = clustering_.binsKept();
    Table& rows = output.tables.emplace_back(clustersTable());
    for (std::size_t i = 0; i < clusters.size(); ++i) {
      c["planar_clusters"] += clusters[i].planar ? 1 : 0;
      c["planar_samples"] += clusters[i].planar ? clusters[i].samples : 0;
      c["concave_clusters"] += clusters[i].concave ? 1 : 0;
      c["normals_cancel"] += clusters[i].normalsCancel ? 1 : 0;
      c["parallel_clusters"] += cameras[i].parallel ? 1 : 0;
      c["crossing_clusters"] += cameras[i].crossing ? 1 : 0;
      c["pushed_back"] += cameras[i].pushedBack ? 1 : 0;
      c["capped_images"] += cameras[i].capped ? 1 : 0;
      c["texels"] += static_cast<std::uint64_t>(cameras[i].width) *
                     static_cast<std::uint64_t>(cameras[i].height);
      c["triangles"] += triangles[i];
      c["empty_images"] += triangles[i] == 0 && !cameras[i].mirrorGrid ? 1 : 0;

      rows.add(i, clusters[i].object, clusters[i].samples, clusters[i].planar, clusters[i].concave,
               cameras[i].width, cameras[i].height, triangles[i], cameras[i].displacement);
    }
  }

  Options options_;
  RunSettings settings_;
  SceneReflectors reflectors_;
  raster::RefractiveSamples refractive_;
  raster::GBufferCopy copy_;
  Clustering clustering_;
  std::unique_ptr<DepthImages> images_;
  gl::Texture clusterSamples_;
  CubeMap environment_;
  gl::Buffer counts_;
  gl::Buffer foundBuffer_;  ///< of count_disocclusions
  std::vector<Found> found_;
  gl::Program planarExact_;
  gl::Program planarScaled_;

  gl::Program curved_;
  gl::Program glossy_;
  gl::Program lookUps_;
  gl::Program recorded_;  ///< of the benchmark, like the others of reads
  gl::Program planarReads_;
  gl::Program curvedReads_;
  gl::Texture walks_;
  gl::Texture ownMarks_;  ///< as GBuffer::masks, where there are none
  gl::Framebuffer ownTarget_;
  std::vector<Marks> marks_;
  std::array<std::uint64_t, kMarks.size()> markCounts_{};
  int tilesAcross_ = 0;
  int tilesDown_ = 0;
  std::vector<std::uint32_t> later_;  ///< tiles with a sample that is still to be looked up
  gl::Buffer tiles_;                  ///< these
  gl::Texture tileTexture_;
};

std::unique_ptr<Method> make(const config::Value& options) {
  return std::make_unique<SecondOrder>(parseOptions(options));
}

}  // namespace

void setMeasureReads(bool on) {
  readsMeasured = on;
}

const MethodEntry& secondOrderEntry() {
  static const MethodEntry entry{
      .id = "second_order",
      .summary = "clusters of reflected rays, a depth image each, found by walking over it",
      .paper = "[Wang2014]",
      .steps = secondOrderSteps(),
      .counters = secondOrderCounters(),
      .tables = {clustersTable()},
      .sampleLayers =
          {{kClusterLayer,
            "number of the sample's cluster as clusters.csv counts, plus 1; 0: in none"}},
      .options = schema(),
      .make = make};
  return entry;
}

}  // namespace catoptric::methods
