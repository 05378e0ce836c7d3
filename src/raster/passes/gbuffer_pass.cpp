#include "raster/passes/gbuffer_pass.h"

#include <algorithm>

#include "core/parallel.h"
#include "raster/passes/surfaces.h"
#include "raster/regions/triangle_cover.h"

namespace catoptric::raster {
namespace {

SurfaceShaders gbufferShaders(const Materials& materials) {
  return {
      .label = "gbuffer",
      .vertex = "raster/shaders/scene.vert",
      .fragment = "raster/shaders/gbuffer.frag",
      .outputs = kRadianceOutput | kNormalOutput | kSpecularOutput |
                 (materials.tintVaries() ? std::uint32_t{kTintOutput} : 0u) |
                 (materials.highlights() ? std::uint32_t{kHighlightOutput} : 0u) |
                 (materials.lobeHorizons() ? std::uint32_t{kLobeHorizonOutput} : 0u),
  };
}

/// All that a G-buffer holds of surfaces.
void copySamples(const GBuffer& from, const GBuffer& to, std::span<const Rectangle> rectangles) {
  copyTexels(from.diffuse, to.diffuse, rectangles);
  copyTexels(from.normal, to.normal, rectangles);
  copyTexels(from.object, to.object, rectangles);
  if (!from.tint.empty()) copyTexels(from.tint, to.tint, rectangles);
  if (!from.highlight.empty()) copyTexels(from.highlight, to.highlight, rectangles);
  if (!from.lobeHorizon.empty()) copyTexels(from.lobeHorizon, to.lobeHorizon, rectangles);
  copyTexels(from.depth, to.depth, rectangles);
}

}  // namespace

std::vector<gl::Define> GBufferPass::backgroundDefines(const Materials& materials) {
  const auto flag = [](bool on) { return std::string(on ? "1" : "0"); };
  return {{"TINT_OUTPUT", flag(materials.tintVaries())},
          {"HIGHLIGHT_OUTPUT", flag(materials.highlights())},
          {"LOBE_HORIZON_OUTPUT", flag(materials.lobeHorizons())}};
}

void GBufferPass::forget(std::span<const int> changedObjects) {
  if (covered_.empty()) return;
  for (const int object : changedObjects) covered_[object] = {};
}

void GBufferPass::findCovered(const scene::Camera& camera, const Rectangle& image,
                              const frame::Geometry& geometry) {
  covered_.resize(scene_.objects().size());
  if (coveredCamera_ != camera || coveredImage_ != image) {
    for (CoveredSamples& object : covered_) object = {};
    coveredCamera_ = camera;
    coveredImage_ = image;
  }
  const TriangleCover cover(camera, image.x1, image.y1);
  const std::vector<std::uint32_t>& indices = scene_.meshlets().indices;
  constexpr std::size_t kGrain = 16;  // meshlets
  for (std::size_t i = 0; i < covered_.size(); ++i) {
    const std::span<const Meshlet> members = scene_.meshlets().ofObject(i);
    CoveredSamples& samples = covered_[i];
    if (!samples.triangles.empty() || members.empty() || scene_.objects()[i].moving) continue;
    samples.triangles.resize(geometry.objects[i].indexCount / 3);
    samples.meshlets.resize(members.size());
    parallelFor(members.size(), kGrain, [&](std::size_t begin, std::size_t end) {
      for (std::size_t m = begin; m < end; ++m) {
        for (std::uint32_t k = 0; k < members[m].indexCount; k += 3) {
          const std::uint32_t index = members[m].firstIndex + k;
          const auto corner = [&](std::size_t c) {
            return cover.corner(geometry.positions[indices[index + c]]);
          };
          const Rectangle shown = cover.covered({corner(0), corner(1), corner(2)});
          samples.triangles[(index - members.front().firstIndex) / 3] = shown;
          samples.meshlets[m] = bounding(samples.meshlets[m], shown);
        }
      }
    });
  }
}

void GBufferPass::findMoving(const scene::Camera& camera, const Rectangle& image) {
  moving_.emplace(image.x1, image.y1);
  for (const DeviceObject& object : scene_.objects()) {
    if (object.moving) moving_->add(shownRectangle(camera, image.x1, image.y1, object.bounds));
  }
}

DrawStatistics GBufferPass::drawSamples(const GBuffer& target, std::span<const Rectangle> parts,
                                        const frame::Lighting& lighting, Which which) {
  target.framebuffer.bind();
  // Colours are not cleared: surfaces write them where depth is above 0, the background elsewhere
  {
    gl::DrawScope scope{gl::DrawState()};
    const auto clear = [&] {
      target.framebuffer.clearDepthStencil(0.0f, static_cast<int>(SampleClass::Background));
    };
    if (parts.empty()) clear();
    for (const Rectangle& r : parts) {
      scope.change(within(r));
      clear();
    }
  }
  const DrawStatistics statistics = drawOver(parts, lighting, which);
  background_.draw(scene_.frame(), lighting, parts);
  return statistics;
}

DrawStatistics GBufferPass::drawOver(std::span<const Rectangle> parts,
                                     const frame::Lighting& lighting, Which which) {
  const SurfaceShaders shaders = gbufferShaders(scene_.materials());
  SurfacePass pass{.shaders = shaders, .stillFirst = true};
  pass.state.depth.test = true;
  pass.state.stencil = {.test = true, .pass = GL_REPLACE};
  const Selection selection{.which = which, .parts = parts, .covered = covered_};
  return drawSurfaces(scene_, view_, lighting, pass, selection, list_);
}

DrawStatistics GBufferPass::draw(GBuffer& target, const scene::Camera& camera,
                                 const frame::Lighting& lighting, const std::optional<Region>& part,
                                 const frame::Geometry* geometry) {
  const int width = target.sampleWidth();
  const int height = target.sampleHeight();
  const float aspect = static_cast<float>(target.width) / static_cast<float>(target.height);
  view_ = makeView(scene::clipFromCamera(camera, aspect) * scene::cameraFromWorld(camera),
                   camera.eye(), scene::pixelSpreadRad(camera, height),
                   Vec4(0.0f, 0.0f, width, height), kNoRadianceLimit);
  DrawStatistics statistics;
  if (!part) {
    if (still_) still_->drawn = Region(width, height);
    statistics = drawSamples(target, {}, lighting, Which::All);
  } else if (!part->empty()) {
    // What stands still, and over it what moves: that lies within the part, or is there already
    const GBuffer& still = drawStill(target, camera, lighting, *part, *geometry, &statistics);
    const std::vector<Rectangle> drawn = part->rectangles();
    copySamples(still, target, drawn);
    target.framebuffer.bind();
    statistics.triangles += drawOver({}, lighting, Which::Moving).triangles;
  }
  findMoving(camera, {0, 0, width, height});
  if (part) {
    const std::uint64_t all = geometry->indices.size() / 3;
    statistics.culledTriangles = std::max(all, statistics.triangles) - statistics.triangles;
  }
  return statistics;
}

const GBuffer& GBufferPass::drawStill(const GBuffer& like, const scene::Camera& camera,
                                      const frame::Lighting& lighting, const Region& part,
                                      const frame::Geometry& geometry, DrawStatistics* statistics) {
  const Rectangle all{0, 0, like.sampleWidth(), like.sampleHeight()};
  if (!still_ || still_->samples.sampleWidth() != all.x1 ||
      still_->samples.sampleHeight() != all.y1) {
    still_.emplace(StillSamples{
        makeSurfaceSamples({like.width, like.height, like.samples, false, !like.tint.empty(),
                            !like.highlight.empty(), !like.lobeHorizon.empty()}),
        Region(all.x1, all.y1)});
  }
  Region missing(all.x1, all.y1);
  for (const Rectangle& r : part.rectangles()) missing.add(r);
  missing.remove(still_->drawn);
  // Where nothing that moves shows it is in the G-buffer
  Region copied = missing;
  copied.remove(*moving_);
  const std::vector<Rectangle> copies = copied.rectangles();
  copySamples(like, still_->samples, copies);
  for (const Rectangle& r : copies) missing.add(r);
  still_->drawn.add(missing);
  // Elsewhere it is drawn
  copied = missing;
  copied.remove(*moving_);
  missing.remove(copied);
  if (!missing.empty()) {
    findCovered(camera, all, geometry);
    const std::vector<Rectangle> rectangles = missing.rectangles();
    const DrawStatistics drawn = drawSamples(still_->samples, rectangles, lighting, Which::Still);
    if (statistics != nullptr) statistics->triangles += drawn.triangles;
  }
  return still_->samples;
}

}  // namespace catoptric::raster
