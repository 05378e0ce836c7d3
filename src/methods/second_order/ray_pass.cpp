#include "methods/second_order/ray_pass.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <string>
#include <type_traits>
#include <utility>

#include "methods/second_order/shaders/constants.h"
namespace catoptric::methods::second_order {
namespace {

namespace shared = second_order_shared;

/// Samples along the edge of a tile with a sample that is still to be looked up: those of an
/// integer of marks. Ours.
constexpr int kTileSamples = 4;
/// Marks of the samples of a row of a tile: those of a run without masks are bytes, which are
/// cleared, read and counted in half the time.
template <class Marks>
using TileRow = std::conditional_t<sizeof(Marks) == 1, std::uint32_t, std::uint64_t>;

/// A mark in all samples of a row of a tile, beside raster::MaskBit.
template <class Marks>
constexpr TileRow<Marks> everySample(std::uint32_t mark) {
  constexpr std::uint64_t kOnes = sizeof(Marks) == 1 ? 0x01010101u : 0x0001000100010001u;
  return static_cast<TileRow<Marks>>(kOnes * mark);
}
constexpr std::uint32_t kMarkBridged = shared::kMarkBridged;
constexpr std::uint32_t kMarkLater = shared::kMarkLater;
static_assert(kMarkLater <= 0xFF && kMarkBridged <= 0xFF);

/// Counted by shaders/rays.frag, in the order of its kCount... constants.
constexpr std::array<const char*, 4> kCountNames = {"below_horizon", "met_itself", "faded",
                                                    "second_layer_hits"};
static_assert(shared::kCountBelowHorizon == 0 && shared::kCountSelf == 1 &&
              shared::kCountFaded == 2 && shared::kCountSecond == 3);
/// Counted in its marks, `environment` together with `unclustered`.
constexpr std::array<std::pair<std::uint32_t, const char*>, 4> kMarks = {
    {{raster::kMaskEnvironment, "environment"},
     {raster::kMaskSky, "sky"},
     {kMarkBridged, "bridged"},
     {raster::kMaskRetraced, "lamp_samples"}}};

gl::Program planarProgram(bool exactGrid, int depthLayers) {
  return gl::Program::fullScreen(
      "look-up in mirrored frames", "methods/second_order/shaders/planar.frag",
      {{"EXACT_GRID", exactGrid ? "1" : "0"}, {"LAYERS", std::to_string(depthLayers)}});
}

}  // namespace

RayPass::RayPass(const Options& options, const SceneReflectors& reflectors,
                 const Services& services, const RunSettings& settings)
    : options_(options), reflectors_(reflectors) {
  sharesFrame_ = !settings.reflectors.all();
  countDisocclusions_ = settings.countDisocclusions;
  // What most frames need
  if (reflectors_.planarMirrors) planar(options_.camera.depthImageScale == 1.0f);
  if (reflectors_.curvedMirrors) curved(services);
  lobeHorizons_ = !services.gbuffer->lobeHorizon.empty();
  ggx_ = services.scene.hasGgxLobes();
  if (reflectors_.glossy) glossy_ = walkProgram(services, true);
  std::vector<gl::Define> defines = raster::SceneRaster::shadingDefines(services.lighting);
  defines.push_back({"GGX", ggx_ ? "1" : "0"});
  lookUps_ = gl::Program("samples that found nothing",
                         {.vertex = "methods/second_order/shaders/tiles.vert",
                          .fragment = "methods/second_order/shaders/look_up.frag",
                          .defines = std::move(defines)});

  counts_ = gl::Buffer("fallback counts", kCountNames.size() * sizeof(std::uint32_t));
  const int width = settings.width * settings.samples;
  const int height = settings.height * settings.samples;
  const std::size_t samples = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  if (settings.masks) {
    masks_.resize(samples);
  } else {
    marks_.resize(samples);
    const raster::GBuffer& gbuffer = *services.gbuffer;
    ownMarks_ = gl::Texture::make2D("marks of samples", GL_R8UI, width, height);
    ownTarget_ =
        gl::Framebuffer("reflection", {{.texture = gbuffer.reflection}, {.texture = ownMarks_}},
                        {.texture = gbuffer.depth});
  }
  if (countDisocclusions_) {
    found_.resize(samples);
    foundBuffer_ = gl::Buffer("what rays found", found_.size() * sizeof(FoundByRays));
  }
  tilesAcross_ = (width + kTileSamples - 1) / kTileSamples;
  tilesDown_ = (height + kTileSamples - 1) / kTileSamples;
  const auto tiles = static_cast<std::size_t>(tilesAcross_) * static_cast<std::size_t>(tilesDown_);
  tiles_ = gl::Buffer("tiles to look up", tiles * sizeof(std::uint32_t));
  tileTexture_ = gl::Texture::makeBuffer("tiles to look up", GL_R32UI, tiles_);
  clusterSamples_ = gl::Texture::make2D("cluster of each sample", GL_R16UI, width, height);
}

gl::Program RayPass::walkProgram(const Services& services, bool lobes) const {
  std::vector<gl::Define> defines = {
      {"LOBES", lobes ? "1" : "0"},
      {"RAYS", std::to_string(options_.camera.rays)},
      {"NEIGHBOURHOOD", options_.lobeRays == LobeRays::Walked ? "0" : "1"},
      {"FADE", options_.glossyReach > 0.0f ? "1" : "0"},
      {"SELF", std::to_string(static_cast<int>(options_.selfIntersect))},
      {"LAMPS", options_.probes > 0 ? "1" : "0"},
      {"LOBE_HORIZONS", lobeHorizons_ ? "1" : "0"},
      {"GGX", ggx_ ? "1" : "0"},
      {"FOUND", countDisocclusions_ ? "1" : "0"},
      {"LAYERS", std::to_string(options_.images.depthLayers)}};
  if (lobes) {
    for (gl::Define& define : raster::SceneRaster::shadingDefines(services.lighting)) {
      defines.push_back(std::move(define));
    }
  }
  return gl::Program::fullScreen(lobes ? "walk over depth images, lobes" : "walk over depth images",
                                 "methods/second_order/shaders/rays.frag", std::move(defines));
}

gl::Program& RayPass::curved(const Services& services) {
  if (curved_.empty()) curved_ = walkProgram(services, false);
  return curved_;
}

gl::Program& RayPass::planar(bool exact) {
  gl::Program& made = exact ? planarExact_ : planarScaled_;
  if (made.empty()) made = planarProgram(exact, options_.images.depthLayers);
  return made;
}

void RayPass::setClusters(std::span<const std::uint16_t> clusterOf) {
  clusterOf_ = clusterOf;
  clusterSamples_.upload(0, 0, GL_RED_INTEGER, GL_UNSIGNED_SHORT, clusterOf.data());
}

void RayPass::bindSamples(gl::Program& program, const Services& services,
                          const RayInputs& inputs) const {
  const raster::GBuffer& gbuffer = *services.gbuffer;
  program.use();
  clusterSamples_.bindImage(shared::kClustersBinding, GL_READ_ONLY);
  gbuffer.normal.bindImage(shared::kNormalsBinding, GL_READ_ONLY);
  gbuffer.depth.bind(shared::kDepthsBinding);
  gbuffer.diffuse.bindImage(shared::kDiffuseBinding, GL_READ_ONLY);
  const Mat3 rayFromPixel =
      scene::rayFromPixel(inputs.camera, gbuffer.sampleWidth(), gbuffer.sampleHeight());
  program.set("rayFromPixel", rayFromPixel);
  program.set("pixelFromRay", glm::inverse(rayFromPixel));
  program.set("nearMetres", inputs.camera.nearMetres);
  program.set("sampleSize", 1.0f / Vec2(gbuffer.sampleWidth(), gbuffer.sampleHeight()));
}

void RayPass::bindWalk(gl::Program& program, const Services& services,
                       const RayInputs& inputs) const {
  bindSamples(program, services, inputs);
  inputs.images.bind();
  program.set("atlasTexel", 1.0f / Vec2(inputs.images.layerWidth(), inputs.images.layerHeight()));
  program.set("secondLayer", inputs.images.secondLayer());
  program.set("farthest", 4.0f * services.geometry.bounds.diameter());
}

void RayPass::bindFallback(gl::Program& program, const Services& services,
                           const RayInputs& inputs) const {
  services.raster->bindShadingResources(program.id(), services.lighting);
  inputs.cubeMap.bind(shared::kCubeMapBinding);
  inputs.cubeMap.setLevels(program);
  const Box3& bounds = services.geometry.bounds;
  const Vec3 eye = inputs.camera.eye();
  program.set("sceneLeast", bounds.min - eye);
  program.set("sceneMost", bounds.max - eye);
  program.set("cubeCentre", bounds.centre() - eye);
}

void RayPass::run(Services& services, const RayInputs& inputs) {
  const raster::GBuffer& gbuffer = *services.gbuffer;
  const bool masks = ownMarks_.empty();
  if (!masks) ownTarget_.clearColorUint(1, 0);
  const std::vector<std::uint32_t> zeros(kCountNames.size(), 0);
  counts_.write(0, zeros.size() * sizeof(std::uint32_t), zeros.data());
  if (countDisocclusions_) {
    std::fill(found_.begin(), found_.end(), FoundByRays{});
    foundBuffer_.write(0, found_.size() * sizeof(FoundByRays), found_.data());
    foundBuffer_.bindStorage(shared::kFoundBinding);
  }
  (masks ? gbuffer.reflectionFramebuffer : ownTarget_).bind();
  followRays(services, inputs);
  // What found nothing, apart from the others: they would all pay for the cube map and the sky
  if (masks) {
    takeMarks(gbuffer.masks, GL_UNSIGNED_SHORT, masks_);
  } else {
    takeMarks(ownMarks_, GL_UNSIGNED_BYTE, marks_);
  }
  if (!later_.empty()) lookUp(services, inputs);
}

void RayPass::followRays(Services& services, const RayInputs& inputs) {
  counts_.bindStorage(shared::kCountsBinding);
  const auto draw = [](raster::SampleClass sampleClass) {
    gl::DrawState state = raster::onSamplesOf(sampleClass);
    state.depth.write = false;  // it is read
    const gl::DrawScope scope(state);
    gl::drawFullScreenTriangle();
  };
  const auto walk = [&](gl::Program& program, raster::SampleClass sampleClass) {
    bindWalk(program, services, inputs);
    if (sampleClass == raster::SampleClass::Glossy) {
      bindFallback(program, services, inputs);
      if (lobeHorizons_)
        services.gbuffer->lobeHorizon.bindImage(shared::kLobeHorizonsBinding, GL_READ_ONLY);
      if (options_.glossyReach > 0.0f) program.set("reach", options_.glossyReach);
    }
    if (options_.selfIntersect != SelfIntersect::None) {
      services.gbuffer->object.bindImage(shared::kObjectsBinding, GL_READ_ONLY);
    }
    draw(sampleClass);
  };
  // An object known as flat need not be flat in the frame (it deforms, or is one pixel large)
  if (reflectors_.planarMirrors && inputs.onGrids) {
    gl::Program& program = planar(inputs.exactGrids);
    program.use();
    clusterSamples_.bindImage(shared::kClustersBinding, GL_READ_ONLY);
    inputs.images.bind();
    program.set("atlasTexel", 1.0f / Vec2(inputs.images.layerWidth(), inputs.images.layerHeight()));
    draw(raster::SampleClass::PlanarMirror);
  } else if (reflectors_.planarMirrors) {
    walk(curved(services), raster::SampleClass::PlanarMirror);
  }
  if (reflectors_.curvedMirrors) walk(curved_, raster::SampleClass::CurvedMirror);
  if (reflectors_.glossy) walk(glossy_, raster::SampleClass::Glossy);
}

template <class Marks>
void RayPass::takeMarks(const gl::Texture& texture, GLenum type, std::vector<Marks>& marks) {
  texture.read(0, GL_RED_INTEGER, type, std::as_writable_bytes(std::span(marks)));
  if (sharesFrame_) {
    // What lies beside the method's own samples are others' masks
    for (std::size_t at = 0; at < marks.size(); ++at) {
      if (clusterOf_[at] == 0) marks[at] = 0;
    }
  }
  std::array<std::uint64_t, kMarks.size()> counts{};
  later_.clear();
  const int width = texture.width();
  std::vector<bool> listed(static_cast<std::size_t>(tilesAcross_));
  for (int y = 0; y < texture.height(); ++y) {
    if (y % kTileSamples == 0) listed.assign(listed.size(), false);
    const Marks* line = &marks[static_cast<std::size_t>(y) * static_cast<std::size_t>(width)];
    for (int x = 0; x < width; x += kTileSamples) {
      TileRow<Marks> row = 0;
      if (x + kTileSamples <= width) {
        std::memcpy(&row, line + x, sizeof row);
      } else {
        std::memcpy(&row, line + x, sizeof(Marks) * static_cast<std::size_t>(width - x));
      }
      if (row == 0) continue;
      for (std::size_t i = 0; i < kMarks.size(); ++i) {
        counts[i] += std::popcount(row & everySample<Marks>(kMarks[i].first));
      }
      const auto tile = static_cast<std::size_t>(x / kTileSamples);
      if ((row & everySample<Marks>(kMarkLater)) == 0 || listed[tile]) continue;
      listed[tile] = true;
      later_.push_back(static_cast<std::uint32_t>(y / kTileSamples * tilesAcross_) +
                       static_cast<std::uint32_t>(tile));
    }
  }
  markCounts_.assign(counts.begin(), counts.end());
}

void RayPass::lookUp(Services& services, const RayInputs& inputs) {
  glTextureBarrier();
  bindSamples(lookUps_, services, inputs);
  bindFallback(lookUps_, services, inputs);
  services.gbuffer->reflection.bind(shared::kReflectionBinding);
  tiles_.write(0, later_.size() * sizeof(std::uint32_t), later_.data());
  tileTexture_.bind(shared::kTilesBinding);
  lookUps_.set("tilesAcross", tilesAcross_);
  lookUps_.set("tilesDown", tilesDown_);
  gl::DrawState state;
  state.depth.write = false;  // it is read
  state.colors = 0b01;        // the masks are marks
  const gl::DrawScope scope(state);
  glViewport(0, 0, tilesAcross_ * kTileSamples, tilesDown_ * kTileSamples);
  gl::drawPoints(later_.size(), kTileSamples);
}

void RayPass::count(std::uint64_t unclustered, Counters& counters) const {
  std::array<std::uint32_t, kCountNames.size()> counts{};
  counts_.read(0, sizeof counts, counts.data());
  for (std::size_t i = 0; i < counts.size(); ++i) counters[kCountNames[i]] = counts[i];
  for (std::size_t i = 0; i < kMarks.size(); ++i) counters[kMarks[i].second] = markCounts_[i];
  counters["environment"] -= unclustered;
  counters["unclustered"] = unclustered;
}

std::span<const FoundByRays> RayPass::readFound() {
  foundBuffer_.read(0, found_.size() * sizeof(FoundByRays), found_.data());
  return found_;
}

}  // namespace catoptric::methods::second_order
