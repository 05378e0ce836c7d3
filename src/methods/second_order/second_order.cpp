#include "methods/second_order/second_order.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <string>

#include "core/error.h"
#include "methods/contract/layers.h"
#include "methods/second_order/cameras/cluster_camera.h"
#include "methods/second_order/disocclusions.h"
#include "methods/second_order/reports.h"

namespace catoptric::methods::second_order {
namespace {

/// Times that depth images are drawn at 0.7 of their resolution until they fit: 1 / 5000. Ours.
constexpr int kMostShrinks = 24;
/// Memory of the levels for each triangle of the scene, and for building them. Ours, measured: 55
/// to 430.
constexpr std::uint64_t kLevelBytes = 300;

}  // namespace

MethodPlan SecondOrder::plan(const scene::Scene& scene, const RunSettings& settings) const {
  MethodPlan plan;
  plan.gbuffer = true;
  plan.masks = static_cast<std::uint16_t>(
      raster::kMaskEnvironment | raster::kMaskBelowHorizon | raster::kMaskSky |
      (settings.countDisocclusions ? raster::kMaskDisoccluded : 0));
  const SceneReflectors reflectors = findSceneReflectors(scene, settings);
  if (!reflectors.any()) return plan;
  const std::uint64_t samples = settings.sampleCount();
  std::string kinds;
  const auto add = [&](bool has, const char* what) {
    if (has) kinds += (kinds.empty() ? "" : ", ") + std::string(what);
  };
  add(reflectors.planarMirrors, "planar mirrors (the mirrored frame's own samples)");
  add(reflectors.curvedMirrors, "curved mirrors (one ray)");
  add(reflectors.glossy, "glossy objects (rays of a lobe)");
  plan.add(cubeMapItems(options_.faceSize, scene.animated()));
  plan.add(
      {{"precomputation", "levels",
        "coarser levels of objects that do not deform: level_error bounds their shape in texels, "
        "their light in display steps",
        options_.images.levelErrorTexels > 0.0f ? scene.triangleCount() * kLevelBytes : 0,
        "level_error (0: no levels)"},
       {"pass", "readback", "normals, ids and depth for the clustering", 0},
       {"pass", "cluster", "reflective samples by object and normal", 0},
       {"pass", "camera", "a camera for each cluster", 0},
       {"pass", "depth_images", "the diffuse scene, drawn by each cluster's camera", 0},
       {"pass", "intersect", kinds, 0},
       {"resource", "G-buffer copy", "what is read back", samples * (16 + 4 + 4)},
       {"resource", "cluster of each sample", "R16UI", samples * 2},
       {"resource", "depth images",
        "mostly one layer or two; memory_mib allows " +
            std::to_string(options_.images.memoryBytes >> 20) + " MiB",
        DepthImages::usualBytes(settings.width * settings.samples,
                                settings.height * settings.samples, options_.camera.depthImageScale,
                                options_.images),
        "memory_mib, depth_image_scale, depth_layers"}});
  if (settings.countDisocclusions) {
    plan.trace = true;
    plan.items.push_back({"pass", "disocclusions", "asked for: count_disocclusions", 0});
    plan.items.push_back(
        {"resource", "what rays found", "compared with Embree's", samples * sizeof(FoundByRays)});
  }
  if (options_.probes > 0 && (reflectors.curvedMirrors || reflectors.glossy)) {
    plan.trace = true;
    plan.bvh = options_.bvh;
    plan.items.push_back(
        {"pass", "probe",
         "a few samples of curved and glossy clusters are traced, to estimate their error", 0});
    plan.items.push_back(
        {"pass", "compare", "the depth images are compared with these samples", 0});
    plan.items.push_back({"pass", "recompute",
                          "Embree traces small clusters, and those whose error is too large", 0});
    plan.items.push_back({"resource", "traced samples", "what is uploaded", samples * 16});
  }
  return plan;
}

void SecondOrder::prepare(Services& services, const RunSettings& settings) {
  settings_ = settings;
  reflectors_ = findSceneReflectors(services.scene, settings);
  if (!reflectors_.any()) return;
  refractive_ = raster::RefractiveSamples(services.scene);
  if (options_.images.levelErrorTexels > 0.0f) {
    services.timer.measure("levels", [&] {
      services.raster->buildDetailLevels(services.scene, services.geometry, services.lighting);
    });
  }
  if (options_.probes > 0 && (reflectors_.curvedMirrors || reflectors_.glossy)) {
    retrace_ = std::make_unique<Retrace>(options_, settings, services.scene);
  }
  rayPass_ = std::make_unique<RayPass>(options_, reflectors_, services, settings);
  DepthImageOptions images = options_.images;
  images.weight = reflectors_.weight;
  if (options_.glossyReach > 0.0f) {
    images.reach = reflectors_.reach(services.scene, options_.glossyReach);
  }
  images_ = std::make_unique<DepthImages>(settings.width * settings.samples,
                                          settings.height * settings.samples,
                                          options_.camera.depthImageScale, images);
  if (!services.scene.animated()) {
    cubeMap_.draw(services, services.geometry.bounds.centre(), options_.faceSize);
  }
}

void SecondOrder::render(const FrameInput& input, Services& services, FrameOutput& output) {
  raster::GBuffer& gbuffer = *services.gbuffer;
  if (settings_.masks && settings_.reflectors.all()) {
    gbuffer.reflectionFramebuffer.clearColorUint(1, 0);
  }
  output.counters = zeros(counterInfos());
  tracedBelowHorizon_ = 0;
  if (!reflectors_.any()) return;
  frame::StepTimer& timer = services.timer;
  const scene::Camera& camera = input.frame.camera;

  cubeMap_.follow(input, services, services.geometry.bounds.centre(), options_.faceSize);
  output.counters["clamped_cube_map"] = cubeMap_.clampedTexels();
  timer.measure("readback", [&] { raster::readBack(gbuffer, reflectors_.levelsVary, copy_); });
  timer.measure("cluster", [&] {
    clustering_.build(copy_, camera, reflectors_.kinds, options_.cluster,
                      retrace_ ? retrace_->traceable() : std::vector<bool>());
    if (retrace_) leaveSmallOnes(output.counters);
  });
  std::vector<ClusterCamera> cameras;
  float scale = options_.camera.depthImageScale;
  timer.measure("camera", [&] { cameras = makeCameras(services, camera, scale, output.counters); });
  if (retrace_) traceWhatSeesItself(input, services, cameras, output.counters);
  rayPass_->setClusters(clustering_.clusterOf());

  const std::vector<Cluster>& clusters = clustering_.clusters();
  std::vector<std::uint64_t> triangles(clusters.size(), 0);
  RayInputs inputs{camera, *images_, cubeMap_};
  for (std::size_t i = 0; i < clusters.size(); ++i) {
    inputs.onGrids =
        inputs.onGrids && (clusters[i].retraced || cameras[i].mirrorGrid ||
                           !reflectors_.skipOwn[static_cast<std::size_t>(clusters[i].object)]);
  }
  timer.measure("depth_images", [&] {
    // Planar clusters of curved objects are walked over
    inputs.exactGrids = inputs.onGrids && reflectors_.planarMirrors && scale == 1.0f;
    const DetailCounts detail = images_->draw(
        clusters, cameras, reflectors_.skipOwn,
        inputs.exactGrids ? clustering_.clusterOf() : std::span<const std::uint16_t>(),
        camera.eye(), services.geometry, services.lighting, services.raster->scene(), triangles);
    output.counters["left_out"] = detail.leftOut;
    output.counters["bound_by_shape"] = detail.byShape;
    output.counters["bound_by_light"] = detail.byLight;
  });
  timer.measure("intersect", [&] {
    rayPass_->run(services, inputs);
    output.counters["refraction_mirrored"] = refractive_.count(gbuffer);
  });
  if (retrace_) retraceWhatErrs(input, services, output.counters);
  report(cameras, triangles, output);
  if (asksFor(settings_, kClusterLayer)) {
    const std::vector<std::uint16_t>& clusterOf = clustering_.clusterOf();
    SampleLayer& layer = output.sampleLayers.emplace_back(SampleLayer{kClusterLayer, {}});
    layer.numbers.assign(clusterOf.begin(), clusterOf.end());
    for (std::uint32_t& cluster : layer.numbers) {
      if (cluster == Clustering::kRetraced) cluster = 0;
      if (cluster > 0) --cluster;
    }
  }
  if (settings_.countDisocclusions) {
    timer.measure("disocclusions", [&] { countDisocclusions(services, camera, cameras, output); });
  }
}

/// At a resolution that the memory allows: `scale`.
std::vector<ClusterCamera> SecondOrder::makeCameras(Services& services, const scene::Camera& camera,
                                                    float& scale, Counters& counters) {
  const raster::GBuffer& gbuffer = *services.gbuffer;
  CameraOptions options = options_.camera;
  options.sceneBounds.min = services.geometry.bounds.min - camera.eye();
  options.sceneBounds.max = services.geometry.bounds.max - camera.eye();
  options.maxTextureSize = std::min(images_->layerWidth(), images_->layerHeight());
  for (int attempt = 0;; ++attempt) {
    scale = options.depthImageScale;
    std::vector<ClusterCamera> cameras = makeClusterCameras(
        clustering_, camera, gbuffer.sampleWidth(), gbuffer.sampleHeight(), options);
    if (images_->fits(cameras)) return cameras;
    if (attempt == kMostShrinks) {
      throw Error(ExitCode::OutOfMemory,
                  "second_order: the frame is not rendered: the depth images of " +
                      std::to_string(clustering_.clusters().size()) +
                      " clusters do not fit into memory_mib = " +
                      std::to_string(options_.images.memoryBytes >> 20) +
                      " even at the lowest resolution. Raise memory_mib, or lower bin_density");
    }
    options.depthImageScale *= 0.7f;
    ++counters["images_shrunk"];
  }
}

/// Clusters of fewer rays than an image is worth are traced: they need no camera and no probes.
void SecondOrder::leaveSmallOnes(Counters& counters) {
  const std::vector<Cluster>& clusters = clustering_.clusters();
  std::vector<std::uint8_t> retraced(clusters.size(), 0);
  for (std::size_t i = 0; i < clusters.size(); ++i) {
    const Cluster& cluster = clusters[i];
    const auto object = static_cast<std::size_t>(cluster.object);
    const bool flat = cluster.planar && reflectors_.kinds[object] == ReflectorKind::Mirror;
    const int rays = static_cast<int>(cluster.samples) *
                     trace::lobeRays(cluster.widestLobe, options_.camera.rays);
    if (flat || !retrace_->traceable()[object] || rays >= options_.leastImageRays) continue;
    retraced[i] = 1;
    ++counters["small_clusters"];
  }
  if (counters["small_clusters"] > 0) clustering_.leaveToRetrace(retraced);
}

/// Clusters too many of whose probes meet their own object are retraced, and need no image.
void SecondOrder::traceWhatSeesItself(const FrameInput& input, Services& services,
                                      std::vector<ClusterCamera>& cameras, Counters& counters) {
  std::vector<std::uint8_t> retraced(cameras.size(), 0);
  services.timer.measure("probe", [&] {
    retrace_->probe(input, services, copy_, clustering_);
    for (std::size_t i = 0; i < cameras.size(); ++i) {
      retraced[i] = clustering_.clusters()[i].retraced ? 1 : 0;
      const Probed& probed = retrace_->probed()[i];
      counters["probes"] += probed.asked;
      if (probed.selfHitShare() <= options_.selfHitShare) continue;
      retraced[i] = 1;
      ++counters["self_seeing_clusters"];
      cameras[i] = {};
      cameras[i].width = cameras[i].height = 0;
    }
    if (counters["self_seeing_clusters"] == 0) return;
    clustering_.leaveToRetrace(retraced);
    images_->fits(cameras);
  });
}

/// Clusters whose images err by more than the options allow are retraced, too.
void SecondOrder::retraceWhatErrs(const FrameInput& input, Services& services, Counters& counters) {
  std::vector<std::uint8_t> retraced(clustering_.clusters().size(), 0);
  services.timer.measure("compare", [&] {
    retrace_->compare(*services.gbuffer, clustering_.clusters(), reflectors_.weight);
    for (std::size_t i = 0; i < retraced.size(); ++i) {
      retraced[i] = clustering_.clusters()[i].retraced ? 1 : 0;
      if (retraced[i] != 0 || !retrace_->errs(i)) continue;
      retraced[i] = 1;
      ++counters["erring_clusters"];
    }
  });
  if (std::ranges::count(retraced, 1) == 0 && clustering_.samplesAlone() == 0 &&
      !rayPass_->anySeesLamp())
    return;
  services.timer.measure("recompute", [&] {
    clustering_.markRetraced(retraced);
    const Retrace::Done done = retrace_->run(input, services, copy_, clustering_, *rayPass_);
    counters["retraced"] = done.samples;
    tracedBelowHorizon_ = done.belowHorizon;
    counters["refused"] = done.rays.refused;
    counters["not_finite"] = done.rays.notFinite;
  });
}

void SecondOrder::countDisocclusions(Services& services, const scene::Camera& camera,
                                     std::span<const ClusterCamera> cameras, FrameOutput& output) {
  raster::GBuffer& gbuffer = *services.gbuffer;
  std::vector<std::uint16_t> masks;
  if (settings_.masks) masks = raster::readMasks(gbuffer.masks);
  const Disocclusions counted =
      findDisocclusions(copy_, camera, rayPass_->readFound(), clustering_.clusterOf(), cameras,
                        options_.camera.rays, *services.trace, masks);
  if (settings_.masks) raster::writeMasks(gbuffer.masks, masks);
  output.counters["disoccluded"] = counted.samples;
  output.counters["wrong_hit"] = counted.wrongHits;
}

void SecondOrder::report(const std::vector<ClusterCamera>& cameras,
                         const std::vector<std::uint64_t>& triangles, FrameOutput& output) const {
  const std::vector<Cluster>& clusters = clustering_.clusters();
  Counters& c = output.counters;
  rayPass_->count(clustering_.samplesInNoCluster(), c);
  c["below_horizon"] += tracedBelowHorizon_;
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
    const double own = retrace_ ? retrace_->probed()[i].selfHitShare() : 0.0;
    const double error = retrace_ ? retrace_->probed()[i].meanError() : 0.0;
    if (cameras[i].width == 0) {
      rows.add(i, clusters[i].object, clusters[i].samples, clusters[i].planar, clusters[i].concave,
               0, 0, 0, 0.0, 0.0, own, error, true);
      continue;
    }
    c["texels"] += static_cast<std::uint64_t>(cameras[i].width) *
                   static_cast<std::uint64_t>(cameras[i].height);
    c["triangles"] += triangles[i];
    c["empty_images"] += triangles[i] == 0 && !cameras[i].mirrorGrid ? 1 : 0;

    rows.add(i, clusters[i].object, clusters[i].samples, clusters[i].planar, clusters[i].concave,
             cameras[i].width, cameras[i].height, triangles[i], cameras[i].displacement,
             cameras[i].walkTexels, own, error, clusters[i].retraced);
  }
}

}  // namespace catoptric::methods::second_order

namespace catoptric::methods {

const MethodEntry& secondOrderEntry() {
  static const MethodEntry entry{
      .id = "second_order",
      .summary =
          "clusters reflected rays, renders a depth image per cluster, and intersects the rays "
          "with it by ray marching",
      .paper = "[Wang2014]",
      .steps = second_order::stepInfos(),
      .counters = second_order::counterInfos(),
      .tables = {second_order::clustersTable()},
      .sampleLayers =
          {{second_order::kClusterLayer,
            "number of the sample's cluster in clusters.csv plus 1; 0: none, or traced"}},
      // Measured: 0.86 % of a plane mirror, at edges of what it shows; one of 19,200 in the furnace
      .tests = {.variants = {R"({"depth_layers": 2})"},
                .planeMirrorPercent = 1.0,
                .furnacePercent = 0.02},
      .options = second_order::optionTable().schema(),
      .make = [](const config::Value& options) -> std::unique_ptr<Method> {
        return std::make_unique<second_order::SecondOrder>(
            second_order::optionTable().parse(options));
      }};
  return entry;
}

}  // namespace catoptric::methods
