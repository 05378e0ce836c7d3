#include "methods/shared/impostors/impostor_method.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "gl/context.h"
#include "methods/shared/impostors/shaders/constants.h"
#include "raster/regions/rectangle.h"
#include "raster/scene_gpu/meshlets.h"
#include "trace/lobes/sky.h"

namespace catoptric::methods::impostors {
namespace {

/// Of a reflector's own depth map: rays are looked at from so far on, so that they do not meet the
/// place that they leave. Ours.
constexpr float kSelfTexels = 4.0f;
/// Slope against the image's plane above which a surface of one of several depth maps is taken for
/// an edge, which hides what is behind: 80 degrees. Ours, measured in docs/papers/impostors.md.
constexpr float kSteepest = 6.0f;

Vec4 planeOf(const Impostor& impostor, const Shape& shape) {
  if (impostor.plane) return Vec4(impostor.plane->normal, -impostor.plane->offset);
  return Vec4(impostor.camera.forward, -glm::dot(impostor.camera.forward, shape.centroid));
}

}  // namespace

void ImpostorMethod::prepare(Services& services, const RunSettings& settings) {
  settings_ = settings;
  reflectors_ = findReflectors(services.scene, settings.reflectors);
  refractive_ = raster::RefractiveSamples(services.scene);
  if (!reflectors_.any()) return;
  reflects_ = reflectors_.reflects();
  mirrors_ = findReflectors(services.scene).reflects();
  tracing_ = {.rays = shared::kLobeRays,
              .bounces = options_.bounces,
              .fresnelSchlick = settings.fresnelSchlick,
              .fadeMetres = options_.attenuation};
  const bool software = gl::Context::current().info().software;
  const bool processor =
      options_.intersectOn == Unit::Processor || (options_.intersectOn == Unit::Auto && software);
  onProcessor_ = processor && reflectors_.mirrors();
  // On a CPU shareByDemand() leaves glossy reflectors to Embree
  const bool lobes = reflectors_.glossy && !(software && options_.fallback == Fallback::Traced);
  kept_ = keptIn(onProcessor_, lobes || !onProcessor_);
  if (kind_ == Kind::DepthMap && RestPose::appliesTo(services.geometry))
    rest_.emplace(services.scene, firstSecondsOf(settings), services.geometry);
  images_.prepare(options_.textureSize, kept_, rest_ ? &*rest_ : nullptr);
  Images::Kept ofPlanes = kept_;
  ofPlanes.depths = false;
  planes_.prepare(options_.planeSize, ofPlanes);
  const auto program = [&](const char* label, const char* glossy) {
    std::vector<gl::Define> with = defines();
    with.push_back({"GLOSSY", glossy});
    with.push_back(
        {"VIEWS",
         kind_ == Kind::DepthMap && (options_.maps != 1 || options_.selfMaps > 0) ? "1" : "0"});
    with.push_back({"GGX", services.scene.hasGgxLobes() ? "1" : "0"});
    with.push_back({"BOUNCES", std::to_string(options_.bounces)});
    with.push_back({"MASKS", settings.masks ? "1" : "0"});
    with.push_back({"WALLS", options_.transitionHeight > 0.0f ? "1" : "0"});
    with.push_back({"FADES", options_.attenuation > 0.0f ? "1" : "0"});
    return gl::Program::fullScreen(label, fragment(), std::move(with));
  };
  if (reflectors_.mirrors() && !onProcessor_) mirror_ = program("impostors", "0");
  if (lobes) glossy_ = program("impostors, glossy", "1");
  prepareMaps();
  const raster::GBuffer& gbuffer = *services.gbuffer;
  known_ = gl::Texture::make2D("marks of samples", GL_R32UI, gbuffer.sampleWidth(),
                               gbuffer.sampleHeight());
  knownCopy_.resize(static_cast<std::size_t>(gbuffer.sampleWidth()) *
                    static_cast<std::size_t>(gbuffer.sampleHeight()));
  target_ =
      settings.masks
          ? gl::Framebuffer(
                "reflection",
                {{.texture = gbuffer.reflection}, {.texture = known_}, {.texture = gbuffer.masks}},
                {.texture = gbuffer.depth})
          : gl::Framebuffer("reflection", {{.texture = gbuffer.reflection}, {.texture = known_}},
                            {.texture = gbuffer.depth});
  if (!services.scene.animated()) {
    follow({}, services);
    drawEnvironment(services);
  }
  services.timer.measure("choose", [&] {
    if (rest_) {
      // What depth maps are chosen makes no reflector unfit
      Choice none;
      none.billboardErrors.assign(reflects_.size(), 0.0f);
      unfit_ = unfitReflectors(options_, services.scene, rest_->geometry(), none, reflects_);
    } else {
      unfit_ = services.scene.animated() ? startOf(services.scene, settings).unfit
                                         : unfitReflectors(options_, services.scene,
                                                           services.geometry, choice_, reflects_);
    }
  });
}

void ImpostorMethod::follow(const FrameInput& input, Services& services) {
  const bool relit = lights_ != services.lighting.lights;
  const bool all = services.scene.animated() && input.firstOfSequence;
  if (!shapes_.empty() && !all && !relit && input.changedObjects.empty()) return;
  const frame::Geometry& geometry = services.geometry;
  const float metres = geometry.bounds.diameter();
  if (shapes_.empty() || all) {
    shapes_ = shapesOf(geometry);
    images_.forgetAll();
    planes_.forgetAll();
    environmentOutdated_ = true;
  } else {
    for (const int o : input.changedObjects)
      shapes_[static_cast<std::size_t>(o)] = shapeOf(geometry, o, metres);
    images_.forget(input.changedObjects);
    planes_.forget(input.changedObjects);
    movedSince_.insert(input.changedObjects.begin(), input.changedObjects.end());
  }
  if (relit) {
    images_.forgetColors();
    planes_.forgetColors();
    environmentOutdated_ = true;
  }
  lights_ = services.lighting.lights;
  choice_ = choose(options_, kind_, services.scene, geometry, shapes_, reflects_, mirrors_,
                   rest_ ? &*rest_ : nullptr);
  costs_ = costsOf(choice_.impostors, lightsMove(services.scene), kept_);
  images_.retain(choice_.impostors);
  planes_.retain(choice_.impostors);
}

std::vector<int> ImpostorMethod::visibleReflectors(const FrameInput& input,
                                                   const Services& services) const {
  const scene::Camera& camera = input.frame.camera;
  const float aspect = static_cast<float>(settings_.width) / static_cast<float>(settings_.height);
  const raster::Frustum frustum(scene::clipFromCamera(camera, aspect) *
                                scene::cameraFromWorld(camera));
  std::vector<int> visible;
  for (std::size_t o = 0; o < reflects_.size(); ++o)
    if (reflects_[o] && frustum.mayContain(services.geometry.objects[o].bounds))
      visible.push_back(static_cast<int>(o));
  return visible;
}

float ImpostorMethod::texelMetres(const Impostor& impostor) const {
  const Camera& camera = impostor.camera;
  return std::sqrt(camera.size.x * camera.size.y) * camera.centreMetres /
         static_cast<float>(impostor.plane ? options_.planeSize : options_.textureSize);
}

int ImpostorMethod::wayOf(const Impostor& impostor) const {
  if (impostor.depth) return shared::kWayDepth;
  const bool walls = impostor.plane && !impostor.slab && options_.transitionHeight > 0.0f;
  if (!walls) return impostor.plane ? shared::kWayPlane : shared::kWayQuad;
  return options_.shareEnvironment ? shared::kWayShared : shared::kWayBox;
}

Box3 ImpostorMethod::boxOf(const Impostor& impostor) const {
  const Camera& camera = impostor.camera;
  const int way = wayOf(impostor);
  const bool walls = way == shared::kWayBox || way == shared::kWayShared;
  Box3 box;
  for (int corner = 0; corner < 8; ++corner) {
    const bool far = (corner & 4) != 0;
    const float z = !impostor.depth ? camera.centreMetres
                    : far           ? camera.farMetres
                                    : camera.nearMetres;
    const Vec2 at = camera.least + camera.size * Vec2((corner & 1) != 0, (corner & 2) != 0);
    Vec3 place = camera.eye + z * (camera.forward + at.x * camera.right + at.y * camera.down);
    if (walls && far) place -= options_.transitionHeight * camera.forward;
    box.extend(place);
  }
  return box;
}

ImpostorLines ImpostorMethod::linesOf(int index, const Services& services) const {
  const Impostor& impostor = choice_.impostors[static_cast<std::size_t>(index)];
  const Shape& shape = shapes_[static_cast<std::size_t>(impostor.object)];
  const Camera& camera = impostor.camera;
  ImpostorLines lines;
  lines.rows = camera.rows();
  lines.quad.plane = planeOf(impostor, shape);
  // On the plane w is one number; beside it u and v are those of the place below
  const Vec4 depth = lines.rows[3];
  const auto onPlane = [&](const Vec4& row, float least, float size) {
    const Vec4 across = (row * size + least * depth) / camera.centreMetres;
    return (across - Vec4(0, 0, 0, least)) / size;
  };
  lines.quad.rowU = onPlane(lines.rows[0], camera.least.x, camera.size.x);
  lines.quad.rowV = onPlane(lines.rows[1], camera.least.y, camera.size.y);
  lines.layer = imagesOf(impostor).layerOf(index);
  lines.way = wayOf(impostor);
  lines.texelMetres = texelMetres(impostor);
  lines.plane = impostor.plane.has_value();
  lines.reflective = impostor.reflective;
  lines.begin = impostor.self ? kSelfTexels * lines.texelMetres : 0.0f;
  lines.steepest = kSteepest * lines.texelMetres / (camera.farMetres - camera.nearMetres);
  lines.object = impostor.object + 1;
  lines.height = options_.transitionHeight;
  lines.side = glm::dot(Vec3(lines.quad.plane), camera.forward) < 0.0f ? 1.0f : -1.0f;
  const scene::Object& object = services.scene.objects[static_cast<std::size_t>(impostor.object)];
  lines.tint = services.scene.materials[object.material].reflectionTint;
  const Box3 box = boxOf(impostor);
  lines.centre = box.centre();
  lines.radius = 0.5f * box.diameter();
  return lines;
}

void ImpostorMethod::makeLines(const Services& services) {
  lines_.assign(choice_.impostors.size(), {});
  for (const int index : needed_)
    lines_[static_cast<std::size_t>(index)] = linesOf(index, services);
}

void ImpostorMethod::uploadTable() {
  std::vector<Vec4> table(lines_.size() * shared::kTableTexels, Vec4(0.0f));
  for (const int index : needed_) {
    const ImpostorLines& lines = lines_[static_cast<std::size_t>(index)];
    Vec4* line = &table[static_cast<std::size_t>(index) * shared::kTableTexels];
    line[shared::kPlane] = lines.quad.plane;
    line[shared::kRowU] = lines.quad.rowU;
    line[shared::kRowV] = lines.quad.rowV;
    line[shared::kMore] = Vec4(static_cast<float>(lines.layer), static_cast<float>(lines.way),
                               lines.texelMetres, lines.reflective ? 1.0f : 0.0f);
    std::ranges::copy(lines.rows, line + shared::kRows);
    line[shared::kWalls] =
        Vec4(lines.height, static_cast<float>(lines.object), lines.side, lines.begin);
    line[shared::kTint] = Vec4(lines.tint, lines.steepest);
  }
  const std::size_t objects = shown_.size();
  std::vector<std::int32_t> lists(3 * (objects + 1), 0);
  for (std::size_t o = 0; o < objects; ++o) {
    const ImpostorList& list = shown_[o];
    const auto first = static_cast<std::int32_t>(lists.size());
    lists[3 * (o + 1)] = traced_[o] ? -1 - first : first;
    lists[3 * (o + 1) + 1] = list.diffuse;
    lists[3 * (o + 1) + 2] = static_cast<std::int32_t>(list.members.size());
    for (std::size_t m = 0; m < list.members.size(); ++m)
      lists.push_back(list.members[m] | list.views[m] << shared::kViewsShift);
  }
  table.resize(std::max<std::size_t>(table.size(), shared::kTableTexels));
  table_ = gl::Buffer("impostors", std::span<const Vec4>(table));
  tableTexture_ = gl::Texture::makeBuffer("impostors", GL_RGBA32F, table_);
  lists_ = gl::Buffer("lists of impostors", std::span<const std::int32_t>(lists));
  listsTexture_ = gl::Texture::makeBuffer("lists of impostors", GL_R32I, lists_);
}

void ImpostorMethod::drawEnvironment(Services& services) {
  std::vector<int> outside =
      outsideEnvironment(options_, services.geometry, shapes_, reflects_, choice_);
  const bool shows = std::ranges::any_of(
      movedSince_, [&](int o) { return !std::ranges::binary_search(outside, o + 1); });
  movedSince_.clear();
  const Box3& bounds = services.geometry.bounds;
  const bool same = outside == outside_ && bounds.min == environmentBounds_.min &&
                    bounds.max == environmentBounds_.max;
  if (!std::exchange(environmentOutdated_, false) && !shows && same) return;
  outside_ = outside;
  environmentBounds_ = bounds;
  cubeMap_.draw(services, bounds.centre(), options_.faceSize,
                raster::ObjectSet::without(std::move(outside)));
  if (onProcessor_) {
    services.timer.measure("cube_map", [&] {
      cubeInMemory_.read(cubeMap_.texture(), std::max(0, cubeMap_.texture().levels() - 3));
    });
  }
}

void ImpostorMethod::render(const FrameInput& input, Services& services, FrameOutput& output) {
  output.counters = zeros(commonCounters());
  if (options_.transitionHeight > 0.0f) output.counters["transition"] = 0;
  output.counters[workCounter()] = 0;
  if (kind_ == Kind::DepthMap) {
    for (const char* name : {"clipped", "searched", "disoccluded"}) output.counters[name] = 0;
    if (options_.intersection == Intersection::Walk) output.counters["projected_texels"] = 0;
  }
  raster::GBuffer& gbuffer = *services.gbuffer;
  if (settings_.masks && settings_.reflectors.all())
    gbuffer.reflectionFramebuffer.clearColorUint(1, 0);
  if (!reflectors_.any()) return;
  follow(input, services);
  share(input, services);
  if (!visible_.empty()) drawEnvironment(services);
  drawImages(services, output);
  ProcessorCounts counts;
  if (onProcessor_) counts = intersectOnProcessor(input, services);
  const bool mirrors = !mirror_.empty() && shows(false);
  const bool glossy = shows(true);
  if (mirrors || glossy) {
    services.timer.measure("intersect", [&] {
      uploadTable();
      target_.bind();
      target_.clearColorUint(1, 0);
      if (mirrors) pass(mirror_, input, services, false);
      if (glossy) pass(glossy_, input, services, true);
    });
    services.timer.measure("readback", [&] { count(counts); });
  }
  output.counters["environment"] = counts.environment;
  output.counters["below_horizon"] = counts.bent;
  output.counters["shows_clamped"] = counts.clamped;
  output.counters["second_order"] = counts.secondOrder;
  output.counters["culled"] = counts.culled;
  if (kind_ == Kind::DepthMap) {
    output.counters["clipped"] = counts.clipped;
    output.counters["searched"] = counts.searched;
    if (options_.intersection == Intersection::Walk)
      output.counters["projected_texels"] = counts.texels;
    output.counters["disoccluded"] = counts.disoccluded;
  }
  if (options_.transitionHeight > 0.0f) output.counters["transition"] = counts.transition;
  output.counters[workCounter()] = counts.work;
  output.counters["refraction_mirrored"] = refractive_.count(gbuffer);
  traceOthers(input, services, output);
  report(services, output);
}

void ImpostorMethod::drawImages(Services& services, FrameOutput& output) {
  std::vector<int> planes;
  std::vector<int> others;
  std::uint64_t bytes = 0;
  std::uint64_t unlit = 0;
  std::size_t maps = 0;
  for (const int index : needed_) {
    const Impostor& impostor = choice_.impostors[static_cast<std::size_t>(index)];
    (impostor.plane ? planes : others).push_back(index);
    bytes += costs_[static_cast<std::size_t>(index)].bytes;
    maps += impostor.depth ? 1 : 0;
    unlit += unlitBytes({&impostor, 1}, kept_);
  }
  const bool lit = bytes + unlit <= options_.memoryBytes;
  if (lit) bytes += unlit;
  const auto without = [&](std::uint64_t used) {
    return options_.memoryBytes - std::min(options_.memoryBytes, used);
  };
  const std::uint64_t plane = bytesOf({.plane = Plane(), .reflective = true}, kept_);
  const std::uint64_t quad = bytesOf({.reflective = true}, kept_);
  const std::uint64_t map =
      mapBytes() + (lit && unlit > 0 ? UnlitImage::bytesOf(options_.textureSize) : 0);
  const auto bytesOfPlanes = [&] { return std::max(planes_.layers(), planes.size()) * plane; };
  const auto bytesOfOthers = [&] {
    return std::max(images_.layers(), others.size()) * quad + std::max(images_.maps(), maps) * map;
  };
  // Half of the memory that is left may keep images that this frame does not need
  const auto most = [&](std::size_t needed, std::uint64_t ofOne, std::uint64_t ofOthers) {
    const std::uint64_t fitting = without(ofOthers) / ofOne;
    return std::max(needed, std::min(needed + without(bytes) / 2 / ofOne, fitting));
  };
  if (bytesOfPlanes() + bytesOfOthers() > options_.memoryBytes) {
    planes_.limit(most(planes.size(), plane, 0));
    images_.limit(most(others.size(), quad + map, 0));
  }
  planes_.update(services, choice_.impostors, planes, most(planes.size(), plane, bytesOfOthers()),
                 false, {});
  images_.update(services, choice_.impostors, others,
                 most(others.size(), quad + map, bytesOfPlanes()), lit,
                 [&](int layer, std::span<const float> texels) { imageDrawn(layer, texels); });
  mapsReady(services, output, images_.layers(), maps);
  makeLines(services);
}

bool ImpostorMethod::shows(bool glossy) const {
  return std::ranges::any_of(visible_, [&](int r) { return isGlossy(r) == glossy; });
}

std::vector<raster::Rectangle> ImpostorMethod::partsOf(bool glossy, const FrameInput& input,
                                                       const Services& services) const {
  const int width = services.gbuffer->sampleWidth();
  const int height = services.gbuffer->sampleHeight();
  raster::Region shown(width, height);
  for (const int r : visible_) {
    if (isGlossy(r) != glossy) continue;
    shown.add(
        raster::shownRectangle(input.frame.camera, width, height,
                               services.geometry.objects[static_cast<std::size_t>(r)].bounds));
  }
  return shown.rectangles();
}

void ImpostorMethod::pass(gl::Program& program, const FrameInput& input, Services& services,
                          bool glossy) {
  const raster::GBuffer& gbuffer = *services.gbuffer;
  const scene::Camera& camera = input.frame.camera;
  gl::DrawState state =
      glossy ? raster::onSamplesOf(raster::SampleClass::Glossy) : raster::onMirrors();
  state.depth.write = false;  // it is read
  gl::DrawScope scope(state);
  program.use();
  gbuffer.normal.bind(shared::kSampleNormalsUnit);
  gbuffer.depth.bind(shared::kSampleDepthsUnit);
  gbuffer.object.bind(shared::kSampleObjectsUnit);
  tableTexture_.bind(shared::kTableUnit);
  listsTexture_.bind(shared::kListsUnit);
  if (!planes_.colors().empty()) planes_.colors().bind(shared::kPlaneColorsUnit);
  if (!planes_.normals().empty()) planes_.normals().bind(shared::kPlaneNormalsUnit);
  if (!images_.colors().empty()) images_.colors().bind(shared::kColorsUnit);
  if (!images_.normals().empty()) images_.normals().bind(shared::kNormalsUnit);
  if (!images_.depths().empty()) images_.depths().bind(shared::kDepthsUnit);
  cubeMap_.bind(shared::kCubeMapUnit);
  cubeMap_.setLevels(program);
  bindMaps(program);
  program.set("rayFromSample",
              scene::rayFromPixel(camera, gbuffer.sampleWidth(), gbuffer.sampleHeight()));
  program.set("eye", camera.eye());
  program.set("nearMetres", camera.nearMetres);
  program.set("spreadRad", scene::pixelSpreadRad(camera, gbuffer.sampleHeight()));
  const Box3& bounds = services.geometry.bounds;
  program.set("sceneLeast", bounds.min);
  program.set("sceneMost", bounds.max);
  program.set("cubeCentre", bounds.centre());
  if (options_.attenuation > 0.0f) {
    program.set("fadeMetres", options_.attenuation);
    program.set("skyKept", std::exp(-trace::kSkyMetres / options_.attenuation));
  }
  if (options_.bounces > 1) program.set("secondDiffuse", options_.secondDiffuse);
  // llvmpipe runs the loops of samples that are discarded, so leave out what Embree traces
  for (const raster::Rectangle& part : partsOf(glossy, input, services)) {
    scope.change(raster::within(part, state));
    gl::drawFullScreenTriangle();
  }
}

void ImpostorMethod::count(ProcessorCounts& counts) {
  known_.read(0, GL_RED_INTEGER, GL_UNSIGNED_INT, std::as_writable_bytes(std::span(knownCopy_)));
  for (const std::uint32_t known : knownCopy_) {
    counts.addMarks(known);
    counts.secondOrder += (known & shared::kMarkSecond) != 0 ? 1 : 0;
    counts.work += known >> shared::kWorkShift;
  }
}

ProcessorCounts ImpostorMethod::intersectOnProcessor(const FrameInput& input, Services& services) {
  raster::GBuffer& gbuffer = *services.gbuffer;
  const scene::Camera& camera = input.frame.camera;
  std::vector<std::uint8_t> mirror(reflects_.size() + 1, 0);
  for (const int r : visible_) mirror[static_cast<std::size_t>(r) + 1] = isGlossy(r) ? 0 : 1;
  const MeetMap meets = [this](int layer, MapRays& rays) { return meetMap(layer, rays); };
  return processor_.run({.gbuffer = gbuffer,
                         .camera = camera,
                         .bounds = services.geometry.bounds,
                         .mirror = mirror,
                         .parts = partsOf(false, input, services),
                         .lines = lines_,
                         .lists = shown_,
                         .images = images_.colorsInMemory(),
                         .normals = images_.normalsInMemory(),
                         .planes = planes_.colorsInMemory(),
                         .planeNormals = planes_.normalsInMemory(),
                         .cube = cubeInMemory_,
                         .meetMap = meets,
                         .options = options_,
                         .countsRays = kind_ == Kind::Billboard,
                         .masks = settings_.masks,
                         .beside = !settings_.reflectors.all(),
                         .timer = services.timer});
}

void ImpostorMethod::report(const Services&, FrameOutput& output) const {
  output.counters["impostors_rendered"] = images_.drawnCount() + planes_.drawnCount();
  output.counters["impostors_reused"] = images_.reusedCount() + planes_.reusedCount();
  output.counters["enclosing"] = choice_.enclosing;
  output.counters["left_in_map"] = choice_.left;
  output.counters["coinciding"] = choice_.coinciding;
  output.counters["unfit"] =
      static_cast<std::uint64_t>(std::ranges::count_if(inView_, [&](int r) { return isUnfit(r); }));
  output.counters["clamped_cube_map"] = cubeMap_.clampedTexels();
  output.counters["clamped_images"] = images_.clampedTexels() + planes_.clampedTexels();
  if (output.counters["unfit"] > 0) {
    Table& table = output.tables.emplace_back(unfitTable());
    for (const int r : inView_) {
      const auto o = static_cast<std::size_t>(r);
      if (isUnfit(r))
        table.add(r + 1, std::string(unfit_[o] == Unfit::Itself ? "itself" : "near"),
                  traced_[o] ? 1 : 0);
    }
  }
  if (needed_.empty()) return;
  Table& table = output.tables.emplace_back(impostorsTable());
  for (const int index : needed_) {
    const Impostor& impostor = choice_.impostors[static_cast<std::size_t>(index)];
    table.add(impostor.object + 1,
              std::string(impostor.depth   ? "depth"
                          : impostor.plane ? "plane"
                                           : "quad"),
              imagesOf(impostor).drawnNow(index) ? 1 : 0, texelMetres(impostor));
  }
}

}  // namespace catoptric::methods::impostors
