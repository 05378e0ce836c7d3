#include "raster/scene_raster.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>

#include "core/error.h"
#include "core/parallel.h"
#include "gl/context.h"
#include "gl/shader.h"
#include "raster/regions/triangle_cover.h"
#include "raster/scene_raster_state.h"

namespace catoptric::raster {

/// Whether the whole box lies beyond the near plane (z <= w).
bool beyondNear(const Mat4& clipFromWorld, const Box3& box) {
  const Mat4 rows = glm::transpose(clipFromWorld);
  const Vec4 plane = rows[3] - rows[2];
  const Vec3 corner(plane.x > 0.0f ? box.min.x : box.max.x, plane.y > 0.0f ? box.min.y : box.max.y,
                    plane.z > 0.0f ? box.min.z : box.max.z);
  return glm::dot(Vec3(plane), corner) + plane.w > 0.0f;
}

bool contains(const Box3& box, const Vec3& p) {
  return glm::all(glm::greaterThanEqual(p, box.min)) && glm::all(glm::lessThanEqual(p, box.max));
}

SceneRaster::SceneRaster(const scene::Scene& scene, const frame::Geometry& geometry)
    : state_(std::make_unique<State>()) {
  State& s = *state_;
  s.materials = Materials(scene);
  s.meshlets = buildMeshlets(geometry);
  s.positions =
      gl::Buffer("positions", geometry.positions.size() * sizeof(Vec3), geometry.positions.data());
  s.attributes = gl::Buffer("vertex attributes",
                            std::span<const frame::VertexAttributes>(geometry.attributes));
  s.indices = gl::Buffer("indices", std::span<const std::uint32_t>(s.meshlets.indices));

  s.vertices = gl::VertexArray("scene");
  s.describeVertices(s.vertices);
  s.vertices.setIndices(s.indices);
  s.noVertices = gl::VertexArray("no vertices");

  const auto largest = [](const Vec3& v) { return std::max({v.x, v.y, v.z}); };
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    const scene::Object& object = scene.objects[i];
    const scene::Material& material = scene.materials[object.material];
    s.objects.push_back({object.material, objectClass(s.materials.classOf(object.material), object),
                         materialFeatures(material) | vertexFeatures(geometry, geometry.objects[i]),
                         material.alphaMode == scene::AlphaMode::Opaque, geometry.objects[i].moving,
                         largest(material.emissive)});
    s.bounds.push_back(geometry.objects[i].bounds);
    s.uvPerMetre.push_back(geometry.objects[i].uvPerMetre);
  }
  s.covered.resize(scene.objects.size());
  s.diameter = geometry.bounds.diameter();
  float color = 0.0f;
  for (const frame::VertexAttributes& vertex : geometry.attributes) {
    s.brightestIrradiance = std::max(s.brightestIrradiance, largest(Vec3(vertex.bake)));
    color = std::max(color, largest(vertex.color));
  }
  for (const scene::Material& material : scene.materials) {
    s.brightestAlbedo = std::max(s.brightestAlbedo, color * largest(material.baseColor));
    s.brightestEmission = std::max(s.brightestEmission, largest(material.emissive));
  }
}

/// Variants read only the attributes that they use.
void describeVertices(gl::VertexArray& array, const gl::Buffer& positions,
                      const gl::Buffer& attributes) {
  using Attributes = frame::VertexAttributes;
  array.setAttribute(0, positions, 3, GL_FLOAT, 0, sizeof(Vec3));
  const auto attribute = [&](GLuint location, int components, std::size_t offset) {
    array.setAttribute(location, attributes, components, GL_FLOAT, offset, sizeof(Attributes));
  };
  attribute(1, 3, offsetof(Attributes, normal));
  attribute(2, 4, offsetof(Attributes, tangent));
  attribute(3, 2, offsetof(Attributes, uv0));
  attribute(4, 2, offsetof(Attributes, uv1));
  attribute(5, 3, offsetof(Attributes, color));
  attribute(6, 4, offsetof(Attributes, bake));
}

SceneRaster::~SceneRaster() = default;

void SceneRaster::update(const frame::Geometry& geometry, std::span<const int> changedObjects) {
  State& s = *state_;
  for (const int object : changedObjects) {
    const frame::ObjectRange& range = geometry.objects[object];
    s.positions.write(range.firstVertex * sizeof(Vec3), range.vertexCount * sizeof(Vec3),
                      &geometry.positions[range.firstVertex]);
    s.attributes.write(range.firstVertex * sizeof(frame::VertexAttributes),
                       range.vertexCount * sizeof(frame::VertexAttributes),
                       &geometry.attributes[range.firstVertex]);
    s.bounds[object] = range.bounds;
    s.uvPerMetre[object] = range.uvPerMetre;
    s.covered[object] = {};
    constexpr std::uint32_t ofVertices = kVertexColor | kBakeIrradiance | kBakeVisibility | kSky;
    s.objects[object].features =
        (s.objects[object].features & ~ofVertices) | vertexFeatures(geometry, range);
    updateMeshletBounds(s.meshlets, geometry, object);
    s.updateLevelBounds(geometry, object);
  }
  s.diameter = geometry.bounds.diameter();
}

GBuffer SceneRaster::makeGBuffer(const GBufferSize& size) const {
  return raster::makeGBuffer(size);
}

void SceneRaster::State::findCovered(const scene::Camera& camera, const Rectangle& image,
                                     const frame::Geometry& geometry) {
  if (coveredCamera != camera || coveredImage != image) {
    for (CoveredSamples& object : covered) object = {};
    coveredCamera = camera;
    coveredImage = image;
  }
  const TriangleCover cover(camera, image.x1, image.y1);
  constexpr std::size_t kGrain = 16;  // meshlets
  for (std::size_t i = 0; i < covered.size(); ++i) {
    const std::span<const Meshlet> members = meshlets.ofObject(i);
    CoveredSamples& samples = covered[i];
    if (!samples.triangles.empty() || members.empty() || objects[i].moving) continue;
    samples.triangles.resize(geometry.objects[i].indexCount / 3);
    samples.meshlets.resize(members.size());
    parallelFor(members.size(), kGrain, [&](std::size_t begin, std::size_t end) {
      for (std::size_t m = begin; m < end; ++m) {
        for (std::uint32_t k = 0; k < members[m].indexCount; k += 3) {
          const std::uint32_t index = members[m].firstIndex + k;
          const auto corner = [&](std::size_t c) {
            return cover.corner(geometry.positions[meshlets.indices[index + c]]);
          };
          const Rectangle shown = cover.covered({corner(0), corner(1), corner(2)});
          samples.triangles[(index - members.front().firstIndex) / 3] = shown;
          samples.meshlets[m] = bounding(samples.meshlets[m], shown);
        }
      }
    });
  }
}

void SceneRaster::State::cull(const FrameView& view, std::span<const Rectangle> parts,
                              int skipObject, Which which, DrawStatistics& statistics) {
  list.clear();
  const Frustum frustum(view.clipFromWorld);
  std::vector<std::uint32_t> seen;  // meshlets of one object
  for (std::size_t i = 0; i < objects.size(); ++i) {
    if (which != Which::All && objects[i].moving != (which == Which::Moving)) continue;
    const std::span<const Meshlet> members = meshlets.ofObject(i);
    std::uint64_t all = 0;
    for (const Meshlet& meshlet : members) all += meshlet.indexCount / 3;
    if (static_cast<int>(i) + 1 == skipObject || !frustum.mayContain(bounds[i])) {
      statistics.culledTriangles += all;
      continue;
    }

    // Backs of a closed opaque object are hidden unless the eye or the near plane is inside
    VisibleObject visible;
    visible.object = static_cast<int>(i);
    visible.cullBacks = meshlets.closed[i] && objects[i].opaque &&
                        (!view.insides || (!contains(bounds[i], view.eye) &&
                                           beyondNear(view.clipFromWorld, bounds[i])));
    float distanceSum = 0.0f;
    float areaSum = 0.0f;
    seen.clear();
    for (std::uint32_t m = 0; m < members.size(); ++m) {
      const Meshlet& meshlet = members[m];
      if (!frustum.mayContain(meshlet.centre, meshlet.radius)) continue;
      if (visible.cullBacks && facesAway(meshlet, view.eye)) continue;
      // The order is that of the whole view, so that parts agree with it where depths are equal
      const float area = meshlet.radius * meshlet.radius;
      distanceSum += area * glm::distance(meshlet.centre, view.eye);
      areaSum += area;
      seen.push_back(m);
    }
    visible.order = areaSum > 0.0f ? distanceSum / areaSum : 0.0f;

    std::uint64_t drawn = 0;
    const auto append = [&](const auto& listRanges) {
      visible.firstRange = list.counts.size();
      visible.triangles = 0;
      std::uint32_t end = 0;
      listRanges([&](std::uint32_t firstIndex, std::uint32_t count) {
        visible.triangles += count / 3;
        if (list.counts.size() > visible.firstRange && firstIndex == end) {
          list.counts.back() += static_cast<GLsizei>(count);
        } else {
          list.counts.push_back(static_cast<GLsizei>(count));
          list.offsets.push_back(reinterpret_cast<const void*>(
              static_cast<std::uintptr_t>(firstIndex) * sizeof(std::uint32_t)));
        }
        end = firstIndex + count;
      });
      visible.rangeCount = list.counts.size() - visible.firstRange;
      drawn += visible.triangles;
      if (visible.rangeCount > 0) list.objects.push_back(visible);
    };
    if (parts.empty()) {
      append([&](const auto& range) {
        for (const std::uint32_t m : seen) range(members[m].firstIndex, members[m].indexCount);
      });
    }
    for (visible.part = 0; visible.part < parts.size(); ++visible.part) {
      const auto shows = [&](const Rectangle& r) {
        return !intersection(r, parts[visible.part]).empty();
      };
      append([&](const auto& range) {
        for (const std::uint32_t m : seen) {
          if (!shows(covered[i].meshlets[m])) continue;
          for (std::uint32_t k = 0; k < members[m].indexCount; k += 3) {
            const std::uint32_t index = members[m].firstIndex + k;
            if (shows(covered[i].triangles[(index - members.front().firstIndex) / 3]))
              range(index, 3);
          }
        }
      });
    }
    statistics.triangles += drawn;
    statistics.culledTriangles += std::max(all, drawn) - drawn;
  }
  std::stable_sort(
      list.objects.begin(), list.objects.end(),
      [](const VisibleObject& a, const VisibleObject& b) { return a.order < b.order; });
}

Variant& SceneRaster::State::variant(std::uint32_t features, const frame::Lighting& lighting) {
  std::map<std::uint32_t, Variant>& ofLights =
      variants[lightSignature(lighting) + (cost == DrawCost::Constant ? " constant" : "")];
  const auto found = ofLights.find(features);
  if (found != ofLights.end()) return found->second;
  std::vector<gl::Define> defines = featureDefines(features);
  const std::vector<gl::Define> lights = lightDefines(lighting);
  defines.insert(defines.end(), lights.begin(), lights.end());
  defines.push_back({"CONSTANT", cost == DrawCost::Constant ? "1" : "0"});
  defines.push_back({"ENVIRONMENT", "0"});  // surfaces see its irradiance only
  Variant made;
  made.program = gl::Program((features & kGBufferPass) != 0 ? "gbuffer"
                             : (features & kViews) != 0     ? "diffuse views"
                             : (features & kVirtual) != 0   ? "virtual objects"
                                                            : "diffuse",
                             {.vertex = "raster/shaders/scene.vert",
                              .fragment = "raster/shaders/scene.frag",
                              .defines = std::move(defines)});
  made.uvPerMetre = made.program.location("uvPerMetre");
  if ((features & kGBufferPass) != 0) made.objectId = made.program.location("objectId");
  if ((features & kVirtual) != 0) {
    made.reflector = made.program.location("reflector");
    made.depthSlack = made.program.location("depthSlack");
    made.fresnel = made.program.location("fresnel");
    made.refraction = made.program.location("refraction");
    made.nextTotal = made.program.location("nextTotal");
  }
  if ((features & kPeel) != 0) made.frontLayer = made.program.location("frontLayer");
  return ofLights.emplace(features, std::move(made)).first->second;
}

DrawStatistics SceneRaster::State::drawObjects(const FrameView& view,
                                               std::span<const Rectangle> parts,
                                               const frame::Lighting& lighting, bool gbuffer,
                                               int skipObject, Which which) {
  DrawStatistics statistics;
  cull(view, parts, skipObject, which, statistics);
  // As where what moves is drawn over what stands still: the same samples where depths are equal
  if (gbuffer) {
    std::stable_partition(
        list.objects.begin(), list.objects.end(),
        [&](const VisibleObject& visible) { return !objects[visible.object].moving; });
  }
  frame.bind(view, lighting);
  vertices.bind();
  glDepthFunc(cost == DrawCost::SeenOnce ? GL_GEQUAL : GL_GREATER);
  glDepthMask(GL_TRUE);
  glFrontFace(view.frontSign > 0.0f ? GL_CCW : GL_CW);
  glCullFace(GL_BACK);
  const bool sky = hasSky(lighting);
  GLuint program = 0;
  int material = -1;
  bool culling = false;
  std::uint64_t batch = 0;
  glDisable(GL_CULL_FACE);
  for (const VisibleObject& visible : list.objects) {
    const ObjectInfo& info = objects[visible.object];

    std::uint32_t features = litFeatures(info.features, sky);
    features = gbuffer ? features | kGBufferPass : diffusePassFeatures(features);
    const Variant& v = variant(features, lighting);
    if (v.program.id() != program) {
      program = v.program.id();
      glUseProgram(program);
    }
    if (info.material != material) {
      material = info.material;
      materials.bind(material);
    }
    if (visible.cullBacks != culling) {
      culling = visible.cullBacks;
      (culling ? glEnable : glDisable)(GL_CULL_FACE);
    }
    if (v.uvPerMetre >= 0) glUniform1f(v.uvPerMetre, uvPerMetre[visible.object]);
    if (gbuffer) {
      if (v.objectId >= 0) {
        glUniform1ui(v.objectId, static_cast<GLuint>(visible.object + 1));
      }
      glStencilFunc(GL_ALWAYS, static_cast<GLint>(info.sampleClass), 0xFF);
    }
    std::optional<ScissoredTo> scissor;
    if (!parts.empty()) scissor.emplace(parts[visible.part]);
    glMultiDrawElements(GL_TRIANGLES, &list.counts[visible.firstRange], GL_UNSIGNED_INT,
                        &list.offsets[visible.firstRange],
                        static_cast<GLsizei>(visible.rangeCount));
    batch += visible.triangles;
    if (batch >= kTrianglesPerBatch) {
      glFlush();
      batch = 0;
    }
  }
  glDisable(GL_CULL_FACE);
  glFrontFace(GL_CCW);
  return statistics;
}

/// Radiance of the environment where depth is still 0 (and the G-buffer's zeros). The frame block
/// is bound. Within `parts` where there are any.
void SceneRaster::State::drawBackground(const frame::Lighting& lighting, bool gbuffer,
                                        std::span<const Rectangle> parts) {
  const std::string type = environmentType(lighting);
  gl::Program& program = backgrounds[type + (gbuffer ? " G-buffer" : "")];
  if (program.empty()) {
    program = gl::Program("background", {.vertex = "raster/shaders/background.vert",
                                         .fragment = "raster/shaders/background.frag",
                                         .defines = {{"ENVIRONMENT", type},
                                                     {"LIGHT_COUNT", "0"},
                                                     {"SKY", "0"},
                                                     {"GBUFFER", gbuffer ? "1" : "0"}}});
  }
  program.use();
  frame.bindEnvironment(lighting);
  noVertices.bind();
  glDepthFunc(GL_EQUAL);
  glDepthMask(GL_FALSE);
  if (parts.empty()) glDrawArrays(GL_TRIANGLES, 0, 3);
  for (const Rectangle& part : parts) {
    const ScissoredTo scissor(part);
    glDrawArrays(GL_TRIANGLES, 0, 3);
  }
  glDepthMask(GL_TRUE);
  glDepthFunc(GL_GREATER);
}

/// All that a G-buffer holds of surfaces.
static void copySamples(const GBuffer& from, const GBuffer& to,
                        std::span<const Rectangle> rectangles) {
  copyTexels(from.diffuse, to.diffuse, rectangles);
  copyTexels(from.normal, to.normal, rectangles);
  copyTexels(from.object, to.object, rectangles);
  copyTexels(from.depth, to.depth, rectangles);
}

void SceneRaster::State::findMoving(const scene::Camera& camera, const Rectangle& image) {
  moving.emplace(image.x1, image.y1);
  for (std::size_t i = 0; i < objects.size(); ++i) {
    if (objects[i].moving) moving->add(shownRectangle(camera, image.x1, image.y1, bounds[i]));
  }
}

DrawStatistics SceneRaster::State::drawSamples(const GBuffer& target, const FrameView& view,
                                               std::span<const Rectangle> parts,
                                               const frame::Lighting& lighting, Which which) {
  target.framebuffer.bind();
  // Colours are not cleared: surfaces write them where depth is above 0, the background elsewhere
  if (cost != DrawCost::SeenOnce) {
    const auto clear = [&] {
      target.framebuffer.clearDepthStencil(0.0f, static_cast<int>(SampleClass::Background));
    };
    if (parts.empty()) clear();
    for (const Rectangle& r : parts) {
      const ScissoredTo scissor(r);
      clear();
    }
  }
  const DrawStatistics statistics = drawSurfaces(view, parts, lighting, which);
  glEnable(GL_DEPTH_TEST);
  drawBackground(lighting, true, parts);
  glDisable(GL_DEPTH_TEST);
  return statistics;
}

DrawStatistics SceneRaster::State::drawSurfaces(const FrameView& view,
                                                std::span<const Rectangle> parts,
                                                const frame::Lighting& lighting, Which which) {
  glDisable(GL_BLEND);
  glEnable(GL_DEPTH_TEST);
  glEnable(GL_STENCIL_TEST);
  glStencilOp(GL_KEEP, GL_KEEP, GL_REPLACE);
  glStencilMask(0xFF);
  const DrawStatistics statistics = drawObjects(view, parts, lighting, true, 0, which);
  glDisable(GL_STENCIL_TEST);
  glDisable(GL_DEPTH_TEST);
  return statistics;
}

DrawStatistics SceneRaster::drawGBuffer(GBuffer& target, const scene::Camera& camera,
                                        const frame::Lighting& lighting,
                                        const std::optional<Region>& part,
                                        const frame::Geometry* geometry) {
  State& s = *state_;
  const float aspect = static_cast<float>(target.width) / static_cast<float>(target.height);
  const FrameView view =
      makeView(scene::clipFromCamera(camera, aspect) * scene::cameraFromWorld(camera), camera.eye(),
               scene::pixelSpreadRad(camera, target.sampleHeight()),
               Vec4(0.0f, 0.0f, target.sampleWidth(), target.sampleHeight()), kNoRadianceLimit);
  s.gbufferView = view;
  DrawStatistics statistics;
  if (!part) {
    if (s.still) s.still->drawn = Region(target.sampleWidth(), target.sampleHeight());
    statistics = s.drawSamples(target, view, {}, lighting, Which::All);
  } else if (!part->empty()) {
    // What stands still, and over it what moves: that lies within the part, or is there already
    const GBuffer& still = drawStill(target, camera, lighting, *part, *geometry, &statistics);
    const std::vector<Rectangle> drawn = part->rectangles();
    copySamples(still, target, drawn);
    target.framebuffer.bind();
    statistics.triangles += s.drawSurfaces(view, {}, lighting, Which::Moving).triangles;
  }
  s.findMoving(camera, {0, 0, target.sampleWidth(), target.sampleHeight()});
  if (part) {
    const std::uint64_t all = geometry->indices.size() / 3;
    statistics.culledTriangles = std::max(all, statistics.triangles) - statistics.triangles;
  }
  return statistics;
}

const GBuffer& SceneRaster::drawStill(const GBuffer& like, const scene::Camera& camera,
                                      const frame::Lighting& lighting, const Region& part,
                                      const frame::Geometry& geometry, DrawStatistics* statistics) {
  State& s = *state_;
  const Rectangle all{0, 0, like.sampleWidth(), like.sampleHeight()};
  if (!s.still || s.still->samples.sampleWidth() != all.x1 ||
      s.still->samples.sampleHeight() != all.y1) {
    s.still.emplace(
        State::StillSamples{makeSurfaceSamples({like.width, like.height, like.samples, false}),
                            Region(all.x1, all.y1)});
  }
  Region missing(all.x1, all.y1);
  for (const Rectangle& r : part.rectangles()) missing.add(r);
  missing.remove(s.still->drawn);
  // Where nothing that moves shows it is in the G-buffer
  Region copied = missing;
  copied.remove(*s.moving);
  const std::vector<Rectangle> copies = copied.rectangles();
  copySamples(like, s.still->samples, copies);
  for (const Rectangle& r : copies) missing.add(r);
  s.still->drawn.add(missing);
  // Elsewhere it is drawn
  copied = missing;
  copied.remove(*s.moving);
  missing.remove(copied);
  if (!missing.empty()) {
    s.findCovered(camera, all, geometry);
    const std::vector<Rectangle> rectangles = missing.rectangles();
    const DrawStatistics drawn =
        s.drawSamples(s.still->samples, s.gbufferView, rectangles, lighting, Which::Still);
    if (statistics != nullptr) statistics->triangles += drawn.triangles;
  }
  return s.still->samples;
}

DrawStatistics SceneRaster::drawDiffuse(const Mat4& clipFromWorld, const Vec3& eye,
                                        float pixelSpreadRad, const frame::Lighting& lighting,
                                        int skipObject, bool insides) {
  GLint viewport[4] = {};
  glGetIntegerv(GL_VIEWPORT, viewport);
  FrameView view =
      makeView(clipFromWorld, eye, pixelSpreadRad,
               Vec4(viewport[0], viewport[1], viewport[2], viewport[3]), kHalfRadianceLimit);
  view.insides = insides;
  State& s = *state_;
  glDisable(GL_BLEND);
  glDisable(GL_STENCIL_TEST);
  glEnable(GL_DEPTH_TEST);
  const DrawStatistics statistics = s.drawObjects(view, {}, lighting, false, skipObject);
  s.drawBackground(lighting, false, {});
  glDisable(GL_DEPTH_TEST);
  return statistics;
}

std::uint64_t clampedTexels(const gl::Texture& cube) {
  constexpr std::uint16_t kLargestHalf = 0x7BFF;
  const auto side = static_cast<std::size_t>(cube.width());
  std::vector<std::uint16_t> texels(6 * side * side * 4);
  cube.read(0, GL_RGBA, GL_HALF_FLOAT, std::as_writable_bytes(std::span(texels)));
  std::uint64_t count = 0;
  for (std::size_t i = 0; i < texels.size(); i += 4) {
    count +=
        texels[i] >= kLargestHalf || texels[i + 1] >= kLargestHalf || texels[i + 2] >= kLargestHalf;
  }
  return count;
}

gl::Texture SceneRaster::drawCubeMap(const Vec3& centre, int faceSize,
                                     const frame::Lighting& lighting, int skipObject) {
  State& s = *state_;
  gl::Texture cube = gl::Texture::makeCube("cube map", GL_RGBA16F, faceSize, 0);
  const gl::Texture depth =
      gl::Texture::make2D("cube map depth", GL_DEPTH_COMPONENT32F, faceSize, faceSize);
  // Near enough to keep everything, far from rounding
  const float nearMetres = std::max(1e-12f, 1e-4f * s.diameter);
  const float spread = 2.0f * std::atan(1.0f / static_cast<float>(faceSize));
  // Right, down and forward of the faces in the order of GL; rows are clip x, -y and w
  struct Face {
    Vec3 right, down, forward;
  };
  const Face faces[6] = {{{0, 0, -1}, {0, -1, 0}, {1, 0, 0}}, {{0, 0, 1}, {0, -1, 0}, {-1, 0, 0}},
                         {{1, 0, 0}, {0, 0, 1}, {0, 1, 0}},   {{1, 0, 0}, {0, 0, -1}, {0, -1, 0}},
                         {{1, 0, 0}, {0, -1, 0}, {0, 0, 1}},  {{-1, 0, 0}, {0, -1, 0}, {0, 0, -1}}};
  for (int i = 0; i < 6; ++i) {
    const gl::Framebuffer target("cube map face", {{.texture = cube, .layer = i}},
                                 {.texture = depth});
    target.bind();
    glDisable(GL_SCISSOR_TEST);
    target.clearDepth(0.0f);
    const Face& f = faces[i];
    const Mat4 rows(Vec4(f.right, -glm::dot(f.right, centre)),
                    Vec4(-f.down, glm::dot(f.down, centre)), Vec4(0.0f, 0.0f, 0.0f, nearMetres),
                    Vec4(f.forward, -glm::dot(f.forward, centre)));
    drawDiffuse(glm::transpose(rows), centre, spread, lighting, skipObject, false);
  }
  cube.generateMipmaps();
  return cube;
}

void SceneRaster::composite(const GBuffer& source, const scene::Camera& camera,
                            const CompositeOptions& options, gl::Texture& frame,
                            const std::optional<Region>& part) {
  State& s = *state_;
  if (frame.width() != source.width || frame.height() != source.height) {
    throw Error(ExitCode::Internal, "composite: the frame's size is not the G-buffer's");
  }
  const bool reflective = s.materials.reflective();
  const bool fresnel = reflective && options.fresnelSchlick;
  const bool tinted = reflective && s.materials.tinted();
  gl::Program& program =
      s.composites[static_cast<std::uint32_t>(source.samples) * 8u + (reflective ? 4u : 0u) +
                   (tinted ? 2u : 0u) + (fresnel ? 1u : 0u)];
  if (program.empty()) {
    program = gl::Program::fullScreen("composite", "raster/shaders/composite.frag",
                                      {{"SAMPLES", std::to_string(source.samples)},
                                       {"REFLECTIVE", reflective ? "1" : "0"},
                                       {"TINTED", tinted ? "1" : "0"},
                                       {"FRESNEL", fresnel ? "1" : "0"}});
  }
  program.use();
  source.diffuse.bindImage(0, GL_READ_ONLY);
  if (reflective) source.reflection.bindImage(2, GL_READ_ONLY);
  if (tinted) {
    source.object.bindImage(1, GL_READ_ONLY);
    s.materials.tints().bind(5);
  }
  if (fresnel) {
    source.normal.bindImage(3, GL_READ_ONLY);
    const float aspect = static_cast<float>(source.width) / static_cast<float>(source.height);
    program.set("rayFromWindow",
                makeView(scene::clipFromCamera(camera, aspect) * scene::cameraFromWorld(camera),
                         camera.eye(), 0.0f,
                         Vec4(0.0f, 0.0f, source.sampleWidth(), source.sampleHeight()), 0.0f)
                    .rayFromWindow);
  }
  glDisable(GL_DEPTH_TEST);
  glDisable(GL_STENCIL_TEST);
  glDisable(GL_BLEND);
  const gl::Framebuffer target("composite", {{.texture = frame}});
  target.bind();
  const Rectangle all{0, 0, source.sampleWidth(), source.sampleHeight()};
  for (const Rectangle& drawn : part ? part->rectangles() : std::vector<Rectangle>{all}) {
    const ScissoredTo scissor(pixelsOf(drawn, source.samples));
    gl::drawFullScreenTriangle();
  }
}

void SceneRaster::bindShadingResources(std::uint32_t program,
                                       const frame::Lighting& lighting) const {
  glUseProgram(program);
  state_->frame.bind(state_->gbufferView, lighting);
  state_->frame.bindEnvironment(lighting);
}

std::vector<gl::Define> SceneRaster::shadingDefines(const frame::Lighting& lighting) {
  std::vector<gl::Define> defines = lightDefines(lighting);
  defines.push_back({"ENVIRONMENT", environmentType(lighting)});
  defines.push_back({"SKY", hasSky(lighting) ? "1" : "0"});
  return defines;
}

void SceneRaster::setDrawCost(DrawCost cost) {
  state_->cost = cost;
}

DrawCost SceneRaster::drawCost() const {
  return state_->cost;
}

std::size_t SceneRaster::memoryBytes() const {
  const State& s = *state_;
  return s.materials.bytes() + s.positions.size() + s.attributes.size() + s.indices.size();
}

}  // namespace catoptric::raster
