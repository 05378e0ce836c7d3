#include "methods/perturbation/virtual_layers.h"

#include <cmath>
#include <string>
#include <utility>

namespace catoptric::methods::perturbation {
namespace {

constexpr const char* kUncovered = "uncovered samples";
constexpr const char* kUncoveredSource = "methods/perturbation/shaders/uncovered.frag";

/// Stencil bits: samples of a level are marked, and keep the marks of the levels before. The
/// first level's are mirrors, whose two classes differ in the last bit only.
constexpr int kMirror = static_cast<int>(raster::SampleClass::PlanarMirror);
constexpr int levelBits(std::size_t level) {
  return level == 0 ? kMirror : 4 << level;
}
constexpr int levelMask(std::size_t level) {
  return level == 0 ? kMirror | static_cast<int>(raster::SampleClass::Glossy) : 4 << level;
}
static_assert((kMirror ^ static_cast<int>(raster::SampleClass::CurvedMirror)) == 1);
static_assert((4 << (kMaxTurns - 1)) <= 0xFF);

gl::Texture makeImage(const char* label, GLenum format, const raster::GBuffer& gbuffer) {
  return gl::Texture::make2D(label, format, gbuffer.sampleWidth(), gbuffer.sampleHeight());
}

/// On the samples of a level.
gl::DrawState onLevel(std::size_t level) {
  gl::DrawState state;
  state.stencil = {.test = true,
                   .function = GL_EQUAL,
                   .reference = levelBits(level),
                   .compareMask = static_cast<GLuint>(levelMask(level))};
  return state;
}

/// Runs the program on all samples of some rectangles.
void fill(std::span<const raster::Rectangle> drawn, const gl::DrawState& state) {
  gl::DrawScope scope(state);
  for (const raster::Rectangle& r : drawn) {
    scope.change(raster::within(r, state));
    gl::drawFullScreenTriangle();
  }
}

}  // namespace

VirtualLayers::Images VirtualLayers::makeImages(const raster::GBuffer& gbuffer, bool inReflection) {
  Images images;
  images.depth = makeImage("virtual depth", GL_DEPTH32F_STENCIL8, gbuffer);
  if (!inReflection) images.color = makeImage("virtual objects", GL_RGBA32F, gbuffer);
  images.last = gl::Framebuffer("virtual objects", {{.texture = colorOf(images, gbuffer)}},
                                {.texture = images.depth});
  return images;
}

void VirtualLayers::goOn(Images& images, const raster::GBuffer& gbuffer) {
  images.direction = makeImage("mirrored directions", GL_RGBA32F, gbuffer);
  images.reflector = makeImage("reflectors in reflectors", GL_R32UI, gbuffer);
  const char* label = "virtual objects, first of several levels";
  const gl::Texture& color = colorOf(images, gbuffer);
  if (gbuffer.tint.empty()) {
    images.goesOn = gl::Framebuffer(
        label, {{.texture = color}, {.texture = images.direction}, {.texture = images.reflector}},
        {.texture = images.depth});
    return;
  }
  images.tint = makeImage("tints of reflectors in reflectors", GL_RGBA32F, gbuffer);
  images.goesOn = gl::Framebuffer(label,
                                  {{.texture = color},
                                   {.texture = images.direction},
                                   {.texture = images.reflector},
                                   {.texture = images.tint}},
                                  {.texture = images.depth});
}

void VirtualLayers::prepare(Services& services, const RunSettings& settings,
                            const std::vector<Kind>& kinds) {
  settings_ = settings;
  std::vector<float> bends{1.0f};
  for (std::size_t i = 0; i < kinds.size(); ++i) {
    const scene::Object& object = services.scene.objects[i];
    const float index = services.scene.materials[object.material].refraction;
    const bool refracts = kinds[i] == Kind::Implicit && index > 0.0f;
    refracts_ = refracts_ || refracts;
    bends.push_back(refracts ? 1.0f / index : 0.0f);
    if (kinds[i] != Kind::Diffuse && services.geometry.objects[i].moving) keepsStill_ = false;
  }
  defines_ = raster::SceneRaster::shadingDefines(services.lighting);
  defines_.push_back({"MASKS", settings.masks ? "1" : "0"});
  std::vector<gl::Define> defines = defines_;
  defines.push_back({"REFRACTS", refracts_ ? "1" : "0"});
  defines.push_back({"DIRECTIONS", "0"});
  uncovered_ = gl::Program::fullScreen(kUncovered, kUncoveredSource, std::move(defines));
  hidden_ =
      gl::Program::fullScreen("hidden samples", "methods/perturbation/shaders/hidden.frag", {});
  addLevel(*services.gbuffer);
  if (refracts_) {
    bendBuffer_ = gl::Buffer("what reflectors do to rays", std::span<const float>(bends));
    bends_ = gl::Texture::makeBuffer("what reflectors do to rays", GL_R32F, bendBuffer_);
  }
}

void VirtualLayers::addLevel(const raster::GBuffer& gbuffer) {
  if (!levels_.empty()) goOn(levels_.back().all, gbuffer);
  Level level;
  level.all = makeImages(gbuffer, levels_.empty());
  const gl::Texture& color = colorOf(level.all, gbuffer);
  level.before = gl::FragmentCounter("samples that were uncovered");
  level.after = gl::FragmentCounter("uncovered samples");
  level.uncovered =
      settings_.masks
          ? gl::Framebuffer("uncovered samples", {{.texture = color}, {.texture = gbuffer.masks}},
                            {.texture = level.all.depth})
          : gl::Framebuffer("uncovered samples", {{.texture = color}},
                            {.texture = level.all.depth});
  levels_.push_back(std::move(level));
  if (levels_.size() == 2) {
    std::vector<gl::Define> defines = defines_;
    defines.push_back({"REFRACTS", "0"});
    defines.push_back({"DIRECTIONS", "1"});
    uncoveredInside_ = gl::Program::fullScreen(kUncovered, kUncoveredSource, std::move(defines));
    join_ =
        gl::Program::fullScreen("virtual objects joined", "methods/perturbation/shaders/join.frag",
                                {{"TINT_SAMPLES", gbuffer.tint.empty() ? "0" : "1"}});
  }
}

void VirtualLayers::findMirrors(const scene::Camera& camera, Services& services,
                                const std::vector<Kind>& kinds) {
  mirrors_ = {};
  for (std::size_t r = 0; r < kinds.size(); ++r) {
    if (kinds[r] == Kind::Diffuse || !settings_.reflectors.contains(static_cast<int>(r))) continue;
    mirrors_ =
        raster::bounding(mirrors_, raster::shownRectangle(camera, services.gbuffer->sampleWidth(),
                                                          services.gbuffer->sampleHeight(),
                                                          services.geometry.objects[r].bounds));
  }
}

void VirtualLayers::setTints(std::vector<Vec4> tints) {
  if (types_.deepest() < 2 || tints == lastTints_) return;
  tintBuffer_ = gl::Buffer("tints of reflectors in reflectors", std::span<const Vec4>(tints));
  tints_ = gl::Texture::makeBuffer("tints of reflectors in reflectors", GL_RGBA32F, tintBuffer_);
  lastTints_ = std::move(tints);
}

void VirtualLayers::count(bool inPart, Counters& counters) {
  // Samples that were uncovered before in what was drawn are counted again
  if (!inPart) uncoveredSamples_ = 0;
  for (const Level& level : levels_) {
    if (level.counted) uncoveredSamples_ += level.after.read();
    if (level.counted && inPart) uncoveredSamples_ -= level.before.read();
  }
  counters["environment"] = uncoveredSamples_;
}

std::vector<std::uint8_t> VirtualLayers::uncoveredReflections(std::vector<bool> reflects) const {
  std::vector<std::uint8_t> uncovered(reflects.size());
  const std::size_t count = levelCount();
  for (std::size_t level = 0; level < count; ++level) {
    const std::vector<float> depth = raster::readDepth(levels_[level].all.depth);
    std::vector<std::uint32_t> reflectors(reflects.size());
    if (level + 1 < count) reflectors = raster::readIds(levels_[level].all.reflector);
    for (std::size_t at = 0; at < reflects.size(); ++at) {
      if (!reflects[at]) continue;
      const bool covered = depth[at] > 0.0f;
      if (!covered) uncovered[at] = static_cast<std::uint8_t>(level + 1);
      reflects[at] = covered && reflectors[at] != 0;
    }
  }
  return uncovered;
}

std::vector<raster::Rectangle> VirtualLayers::insideMirrors(
    std::span<const raster::Rectangle> rectangles) const {
  std::vector<raster::Rectangle> result;
  for (const raster::Rectangle& r : rectangles) {
    const raster::Rectangle inside = raster::intersection(r, mirrors_);
    if (!inside.empty()) result.push_back(inside);
  }
  return result;
}

void VirtualLayers::draw(const scene::Camera& camera, const std::optional<raster::Region>& part,
                         Services& services) {
  const raster::GBuffer& gbuffer = *services.gbuffer;
  while (levels_.size() < types_.deepest()) addLevel(gbuffer);
  if (!part) staticTiles_.reset();
  const std::size_t count = levelCount();
  const std::vector<raster::Rectangle> drawn =
      insideMirrors(part ? part->rectangles() : std::vector<raster::Rectangle>{mirrors_});
  if (clearsMasks() && !part) gbuffer.reflectionFramebuffer.clearColorUint(1, 0);

  // What was uncovered
  for (std::size_t level = 0; level < levels_.size(); ++level)
    levels_[level].counted = level < count && !drawn.empty();
  if (part) {
    for (std::size_t level = count; level-- > 0;)
      fillUncovered(level, drawn, camera, services, levels_[level].before, false);
  }

  drawLevels(camera, part, drawn, services);
  joinLevels(drawn);
}

void VirtualLayers::drawLevels(const scene::Camera& camera,
                               const std::optional<raster::Region>& part,
                               std::span<const raster::Rectangle> drawn, Services& services) {
  const raster::GBuffer& gbuffer = *services.gbuffer;
  const std::size_t count = levelCount();
  const raster::GBuffer* staticPart =
      part && keepsStill_ ? &drawStatic(*part, count, drawn, camera, services) : nullptr;
  for (std::size_t level = 0; level < count; ++level) {
    const bool goesOn = level + 1 < count;
    if (clearsMasks() && level == 0) {
      for (const raster::Rectangle& r : drawn) {
        const gl::DrawScope scope(raster::within(r));
        gbuffer.reflectionFramebuffer.clearColorUint(1, 0);
      }
    }
    if (staticPart != nullptr) {
      takeStatic(level, goesOn, drawn, gbuffer, *staticPart);
      raster::Rectangle bounds;
      for (const raster::Rectangle& r : drawn) bounds = raster::bounding(bounds, r);
      drawObjects(level, goesOn, &Level::all, gbuffer, {Group::Moving}, {&bounds, 1}, camera,
                  services);
    } else {
      clearLevel(level, goesOn, &Level::all, gbuffer, drawn);
      drawObjects(level, goesOn, &Level::all, gbuffer,
                  {Group::Static, Group::Reflector, Group::Moving}, drawn, camera, services);
    }
    fillUncovered(level, drawn, camera, services, levels_[level].after, true);
  }
}

void VirtualLayers::joinLevels(std::span<const raster::Rectangle> drawn) {
  for (std::size_t level = levelCount(); level-- > 1;) {
    levels_[level - 1].all.last.bind();
    join_.use();
    levels_[level].all.color.bind(0);
    const Images& through = levels_[level - 1].all;
    if (through.tint.empty()) {
      through.reflector.bind(1);
      tints_.bind(2);
    } else {
      through.tint.bind(1);
    }
    gl::DrawState state = onLevel(level);
    state.blend = {.on = true,
                   .sourceColor = GL_DST_ALPHA,
                   .targetColor = GL_ONE_MINUS_DST_ALPHA,
                   .sourceAlpha = GL_ZERO,
                   .targetAlpha = GL_ONE};
    fill(drawn, state);
  }
}

VirtualLayers::Group VirtualLayers::groupOf(const frame::Geometry& geometry, int o,
                                            const VirtualObject& object) {
  if (object.next + object.nextTotal > 0) return Group::Reflector;
  return geometry.objects[static_cast<std::size_t>(o)].moving ? Group::Moving : Group::Static;
}

void VirtualLayers::clearLevel(std::size_t number, bool goesOn, Images Level::*images,
                               const raster::GBuffer& gbuffer,
                               std::span<const raster::Rectangle> drawn) {
  const Images& own = levels_[number].*images;
  const gl::Framebuffer& target = goesOn ? own.goesOn : own.last;
  glBindFramebuffer(GL_READ_FRAMEBUFFER, number == 0 ? gbuffer.framebuffer.id()
                                                     : (levels_[number - 1].*images).last.id());
  glBindFramebuffer(GL_DRAW_FRAMEBUFFER, target.id());
  for (const raster::Rectangle& r : drawn) {
    glBlitFramebuffer(r.x0, r.y0, r.x1, r.y1, r.x0, r.y0, r.x1, r.y1, GL_STENCIL_BUFFER_BIT,
                      GL_NEAREST);
    const gl::DrawScope scope(raster::within(r));
    target.clearDepth(0.0f);
  }
}

void VirtualLayers::drawObjects(std::size_t number, bool goesOn, Images Level::*images,
                                const raster::GBuffer& gbuffer, std::initializer_list<Group> groups,
                                std::span<const raster::Rectangle> drawn,
                                const scene::Camera& camera, Services& services) {
  const Images& own = levels_[number].*images;
  (goesOn ? own.goesOn : own.last).bind();
  VirtualPass pass{
      .reflectors = number == 0 ? gbuffer.object : (levels_[number - 1].*images).reflector,
      .depth = number == 0 ? gbuffer.depth : (levels_[number - 1].*images).depth,
      .continues = goesOn,
      .fresnel = settings_.fresnelSchlick,
      .stencil = onLevel(number).stencil};
  const int here = levelBits(number);
  const int next = goesOn ? levelBits(number + 1) : 0;
  pass.stencil.writeMask = static_cast<GLuint>(next);
  pass.stencil.pass = GL_REPLACE;
  for (const Group group : groups) {
    std::vector<const VirtualObject*> objects;
    for (const auto& [sequence, type] : types_) {
      if (sequence.size() != number + 1) continue;
      for (const auto& [o, object] : type.objects) {
        if (groupOf(services.geometry, o, object) == group) objects.push_back(&object);
      }
    }
    pass.stencil.reference = group == Group::Reflector ? here | next : here;
    drawVirtualObjects(*services.raster, objects, pass, camera, services.lighting, drawn);
  }
}

const raster::GBuffer& VirtualLayers::drawStatic(const raster::Region& part, std::size_t count,
                                                 std::span<const raster::Rectangle> drawn,
                                                 const scene::Camera& camera, Services& services) {
  for (std::size_t level = 0; level < count; ++level) {
    Images& images = levels_[level].staticPart;
    if (images.depth.empty()) images = makeImages(*services.gbuffer, false);
    if (level + 1 < count && images.goesOn.empty()) goOn(images, *services.gbuffer);
  }
  raster::Region missing = part;
  if (!staticTiles_) missing.add(mirrors_);
  for (const raster::Rectangle& r : drawn) missing.add(r);
  const raster::GBuffer& gbuffer = services.raster->drawStill(
      *services.gbuffer, camera, services.lighting, missing, services.geometry);
  if (staticTiles_) missing.remove(*staticTiles_);
  if (missing.empty()) return gbuffer;
  const std::vector<raster::Rectangle> rectangles = insideMirrors(missing.rectangles());
  for (std::size_t level = 0; level < count; ++level) {
    clearLevel(level, level + 1 < count, &Level::staticPart, gbuffer, rectangles);
    drawObjects(level, level + 1 < count, &Level::staticPart, gbuffer,
                {Group::Static, Group::Reflector}, rectangles, camera, services);
  }
  if (staticTiles_) missing.add(*staticTiles_);
  staticTiles_ = std::move(missing);
  return gbuffer;
}

void VirtualLayers::takeStatic(std::size_t number, bool goesOn,
                               std::span<const raster::Rectangle> drawn,
                               const raster::GBuffer& gbuffer, const raster::GBuffer& staticPart) {
  const Level& level = levels_[number];
  raster::copyTexels(level.staticPart.depth, level.all.depth, drawn);
  raster::copyTexels(level.staticPart.color, colorOf(level.all, gbuffer), drawn);
  if (goesOn) {
    raster::copyTexels(level.staticPart.direction, level.all.direction, drawn);
    raster::copyTexels(level.staticPart.reflector, level.all.reflector, drawn);
    if (!level.all.tint.empty()) raster::copyTexels(level.staticPart.tint, level.all.tint, drawn);
  }
  (goesOn ? level.all.goesOn : level.all.last).bind();
  hidden_.use();
  (number == 0 ? gbuffer.object : levels_[number - 1].all.reflector).bind(0);
  (number == 0 ? staticPart.object : levels_[number - 1].staticPart.reflector).bind(1);
  gl::DrawState state;
  state.stencil = {.test = true, .function = GL_ALWAYS, .reference = 0, .pass = GL_REPLACE};
  state.colors = 0b100;
  fill(drawn, state);
}

void VirtualLayers::fillUncovered(std::size_t number, std::span<const raster::Rectangle> drawn,
                                  const scene::Camera& camera, Services& services,
                                  const gl::FragmentCounter& counter, bool colors) {
  const raster::GBuffer& gbuffer = *services.gbuffer;
  levels_[number].uncovered.bind();
  gl::Program& uncovered = number == 0 ? uncovered_ : uncoveredInside_;
  services.raster->bindShadingResources(uncovered.id(), services.lighting);
  uncovered.use();
  if (number == 0) {
    gbuffer.normal.bind(0);
    uncovered.set("rayFromSample",
                  scene::rayFromPixel(camera, gbuffer.sampleWidth(), gbuffer.sampleHeight()));
  } else {
    levels_[number - 1].all.direction.bind(0);
  }
  if (number == 0 && !bends_.empty()) {
    gbuffer.object.bind(1);
    bends_.bind(3);
  }
  gl::DrawState state = onLevel(number);
  state.depth = {.test = true, .function = GL_EQUAL, .write = false};
  if (!colors) state.colors = 0;
  counter.begin();
  fill(drawn, state);
  counter.end();
}

}  // namespace catoptric::methods::perturbation
