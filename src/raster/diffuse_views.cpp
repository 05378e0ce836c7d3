// Many diffuse images in few passes: all views are culled at once on the CPU, triangle by triangle,
// then object after object is drawn into all views of a layer.
//
// A viewport is set per draw: gl_ViewportIndex would let one draw serve 16 views, but makes
// llvmpipe take triangles apart (a third more CPU time for the living room's views).
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "core/error.h"
#include "core/parallel.h"
#include "core/srgb.h"
#include "gl/context.h"
#include "raster/regions/triangle_culling.h"
#include "raster/scene_raster_state.h"

namespace catoptric::raster {
namespace {

constexpr GLuint kViewBinding = 2;           ///< of scene.vert's block
constexpr std::size_t kCompoundViews = 128;  ///< of a compound draw: what 16 KiB hold
constexpr GLuint kViewAttribute = 7;
/// Levels of what is shown more dimly err no more: thin things would vanish. Ours.
constexpr float kDimmest = 0.25f;
/// What keeps a compound draw's views in their rectangles.
constexpr std::array<GLenum, 4> kBorders = {GL_CLIP_DISTANCE1, GL_CLIP_DISTANCE2, GL_CLIP_DISTANCE3,
                                            GL_CLIP_DISTANCE4};

/// As glMultiDrawElementsIndirect reads it; the first instance is the view of a compound draw.
struct Command {
  std::uint32_t count = 0;
  std::uint32_t instances = 1;
  std::uint32_t firstIndex = 0;
  std::int32_t baseVertex = 0;
  std::uint32_t firstInstance = 0;
};

/// The uniform block View of scene.vert, at offsets that every driver allows. Each view has two:
/// for other objects and for its own.
struct alignas(256) ViewBlock {
  Mat4 clipFromWorld;
  Vec4 eye;
  Vec4 ownClip;
};

/// One of the block Views.
struct CompoundBlock {
  Mat4 clipFromWorld;
  Vec4 eye;
  Vec4 ownClip;
  Vec4 place;
};
constexpr std::size_t kGroupBytes = kCompoundViews * sizeof(CompoundBlock);
static_assert(kGroupBytes % 256 == 0 && kGroupBytes <= 16384);

/// How an object's triangles are drawn in a view.
enum class Sides : std::uint8_t { Both, Front, OwnFront, OwnBoth };

/// Distance from a point to a box.
float distanceTo(const Box3& box, const Vec3& p) {
  return glm::length(glm::max(glm::max(box.min - p, p - box.max), Vec3(0.0f)));
}

/// Linear mean of a texture: its last mip level.
Vec3 meanColor(const scene::Texture& texture) {
  if (texture.levels.empty() || texture.levels.back().rgba.size() < 3) return Vec3(1.0f);
  const std::vector<std::uint8_t>& last = texture.levels.back().rgba;
  const auto linear = [&](std::size_t i) {
    return texture.srgb ? linearOfSrgb8()[last[i]] : static_cast<float>(last[i]) / 255.0f;
  };
  return {linear(0), linear(1), linear(2)};
}

/// What an open surface gets from ambient light and environment, mean over its directions: the
/// largest component, W/m^2.
float skyIrradiance(const frame::Lighting& lighting) {
  Vec3 sky = kPi * lighting.ambient;
  constexpr float kConstantHarmonic = 0.282095f;
  if (lighting.environment) sky += kConstantHarmonic * lighting.environment->irradianceSh()[0];
  return std::max({sky.x, sky.y, sky.z});
}

/// No surface is brighter: thin triangles of coarse levels would otherwise extrapolate what they
/// interpolate. Lights that are not baked have no such bound.
float radianceBound(float irradiance, float albedo, float emission,
                    const frame::Lighting& lighting) {
  if (!lighting.lights.empty()) return kHalfRadianceLimit;
  float sky = kPi * std::max({lighting.ambient.x, lighting.ambient.y, lighting.ambient.z});
  if (lighting.environment) {
    // Every Y_k of order <= 2 stays below 1.1
    for (const Vec3& c : lighting.environment->irradianceSh()) {
      sky += 1.1f * std::max({std::abs(c.x), std::abs(c.y), std::abs(c.z)});
    }
  }
  const float lit = albedo * std::max(1.0f, (irradiance + sky) / kPi);  // unlit: the albedo
  return std::min(kHalfRadianceLimit, lit + emission);
}

}  // namespace

/// What one view sees, in the order of objects that all views share.
struct ViewList {
  struct Range {
    std::uint32_t object;
    Sides sides;
    std::size_t first, count;  ///< of `indices`
  };
  std::vector<Range> ranges;
  std::vector<std::uint32_t> indices;
  std::uint64_t leftOut = 0;  ///< objects that would be too small to show
};

void SceneRaster::buildDetailLevels(const scene::Scene& scene, const frame::Geometry& geometry,
                                    const frame::Lighting& lighting) {
  State& s = *state_;
  std::vector<LevelSource> sources;
  for (const scene::Object& object : scene.objects) {
    const scene::Material& material = scene.materials[object.material];
    Vec3 albedo = material.baseColor;
    if (material.baseColorTexture.used()) {
      albedo *= meanColor(scene.textures[material.baseColorTexture.texture]);
    }
    sources.push_back({.whole = scene.nodes[object.node].skin != scene::kNone ||
                                !scene.meshes[object.mesh].morphTargets.empty(),
                       .albedo = std::max({albedo.x, albedo.y, albedo.z})});
  }
  s.levels = raster::buildDetailLevels(geometry, sources, skyIrradiance(lighting));
  const auto base = static_cast<std::uint32_t>(s.meshlets.indices.size());
  for (Meshlet& meshlet : s.levels.meshlets) meshlet.firstIndex += base;
  std::vector<std::uint32_t> all = s.meshlets.indices;
  all.insert(all.end(), s.levels.indices.begin(), s.levels.indices.end());
  s.levels.indices = std::move(all);
  s.levelExtent.clear();
  for (const frame::ObjectRange& range : geometry.objects) {
    s.levelExtent.push_back(range.bounds.diameter());
  }
}

void SceneRaster::State::updateLevelBounds(const frame::Geometry& geometry, int object) {
  if (levels.firstOfObject.empty()) return;
  for (const DetailLevel& level : levels.ofObject(static_cast<std::size_t>(object))) {
    updateBounds(std::span(levels.meshlets).subspan(level.firstMeshlet, level.meshletCount),
                 levels.indices, geometry);
  }
}

void SceneRaster::State::listView(const DiffuseView& view, std::span<const std::uint32_t> order,
                                  const frame::Geometry& geometry, float snap,
                                  ViewList& seen) const {
  const std::span<const std::uint32_t> all =
      levels.indices.empty() ? meshlets.indices : levels.indices;
  const Frustum frustum(view.clipFromWorld);
  const auto tooFar = [&](const Vec3& centre, float radius) {
    return glm::dot(view.farClip, Vec4(centre, 1.0f)) < -radius * glm::length(Vec3(view.farClip));
  };
  for (const std::uint32_t i : order) {
    const bool own = static_cast<int>(i) + 1 == view.ownObject;
    if ((own && view.skipOwn) || !frustum.mayContain(bounds[i]) ||
        tooFar(bounds[i].centre(), 0.5f * bounds[i].diameter())) {
      continue;
    }

    // The coarsest level whose error does not show at the nearest place of the object
    std::span<const Meshlet> members = meshlets.ofObject(i);
    if (view.levelErrorTexels > 0.0f && !levels.firstOfObject.empty()) {
      const float bright = view.levelErrorTexels * view.texelSpreadRad *
                           std::max(view.nearestMetres, distanceTo(bounds[i], view.eye));
      if (bounds[i].diameter() < 0.5f * bright) {
        ++seen.leftOut;
        continue;
      }
      const float shown = view.shown * std::max(1.0f, objects[i].emission);
      const float allowed = bright / std::clamp(shown, kDimmest, 1.0f);
      const float grown =
          levelExtent[i] > 0.0f ? std::max(1.0f, bounds[i].diameter() / levelExtent[i]) : 1.0f;
      for (const DetailLevel& level : levels.ofObject(i)) {
        if (level.error * grown > allowed) break;
        members = {levels.meshlets.data() + level.firstMeshlet, level.meshletCount};
      }
    }

    // Backs of a closed opaque object are hidden; so are they for the eye behind its own surface
    const bool cullBacks =
        own ? !view.ownBacks
            : (meshlets.closed[i] && objects[i].opaque && !contains(bounds[i], view.eye) &&
               beyondNear(view.clipFromWorld, bounds[i]));
    const TriangleCulling culling(view.clipFromWorld, bounds[i], view.width, view.height, snap,
                                  cullBacks, own ? view.ownClip : Vec4(0.0f, 0.0f, 0.0f, 1.0f));
    const std::size_t first = seen.indices.size();
    for (const Meshlet& meshlet : members) {
      if (!frustum.mayContain(meshlet.centre, meshlet.radius) ||
          tooFar(meshlet.centre, meshlet.radius) || (cullBacks && facesAway(meshlet, view.eye))) {
        continue;
      }
      culling.append(all.subspan(meshlet.firstIndex, meshlet.indexCount), geometry.positions,
                     seen.indices);
    }
    if (seen.indices.size() == first) continue;
    const Sides sides = own         ? (cullBacks ? Sides::OwnFront : Sides::OwnBoth)
                        : cullBacks ? Sides::Front
                                    : Sides::Both;
    seen.ranges.push_back({i, sides, first, seen.indices.size() - first});
  }
}

std::uint64_t SceneRaster::drawDiffuseViews(std::span<const DiffuseView> views,
                                            std::span<const gl::Framebuffer> layers,
                                            const frame::Geometry& geometry,
                                            const frame::Lighting& lighting,
                                            std::span<std::uint64_t> triangles, bool compound,
                                            const gl::Texture* peeled) {
  State& s = *state_;
  if (views.empty()) return 0;

  // Small objects first: what they hide of the room's shell is then not shaded
  std::vector<std::uint32_t> order(s.objects.size());
  std::iota(order.begin(), order.end(), 0u);
  std::stable_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    return s.bounds[a].diameter() < s.bounds[b].diameter();
  });

  // Cull all views
  GLint subpixelBits = 0;
  glGetIntegerv(GL_SUBPIXEL_BITS, &subpixelBits);
  const float snap = std::exp2(-static_cast<float>(subpixelBits));
  std::vector<ViewList> lists(views.size());
  parallelFor(views.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      s.listView(views[i], order, geometry, snap, lists[i]);
    }
  });
  std::uint64_t leftOut = 0;
  std::vector<std::size_t> firstIndex(views.size() + 1, 0);
  for (std::size_t i = 0; i < views.size(); ++i) {
    triangles[i] = (peeled != nullptr && views[i].peel ? 2 : 1) * lists[i].indices.size() / 3;
    firstIndex[i + 1] = firstIndex[i] + lists[i].indices.size();
    leftOut += lists[i].leftOut;
  }

  // Draws of each layer in the order of objects, so that an object's state is set once
  struct Draw {
    std::uint32_t object;
    Sides sides;
    std::uint32_t view, group;
    std::size_t first, count;  // indices
  };
  std::vector<Draw> draws;
  std::vector<std::size_t> next(views.size(), 0);
  std::vector<std::size_t> groups;  // first view of each
  for (std::size_t first = 0; first < views.size();) {
    std::size_t last = first;
    while (last < views.size() && views[last].layer == views[first].layer &&
           (!compound || last - first < kCompoundViews)) {
      ++last;
    }
    const auto group = static_cast<std::uint32_t>(groups.size());
    groups.push_back(first);
    for (const std::uint32_t object : order) {
      for (const Sides sides : {Sides::Both, Sides::Front, Sides::OwnFront, Sides::OwnBoth}) {
        for (std::size_t i = first; i < last; ++i) {
          const std::vector<ViewList::Range>& ranges = lists[i].ranges;
          if (next[i] == ranges.size()) continue;
          const ViewList::Range& range = ranges[next[i]];
          if (range.object != object || range.sides != sides) continue;
          draws.push_back({object, sides, static_cast<std::uint32_t>(i), group,
                           firstIndex[i] + range.first, range.count});
          ++next[i];
        }
      }
    }
    first = last;
  }

  // Views' blocks and indices
  const auto fill = [](gl::Buffer& buffer, const char* label, const void* data, std::size_t size) {
    if (buffer.size() < size) buffer = gl::Buffer(label, size + size / 2);
    if (size > 0) buffer.write(0, size, data);
  };
  std::vector<Command> commands;
  if (compound) {
    std::vector<CompoundBlock> blocks(groups.size() * kCompoundViews);
    for (std::size_t g = 0; g < groups.size(); ++g) {
      const std::size_t end = g + 1 < groups.size() ? groups[g + 1] : views.size();
      for (std::size_t i = groups[g]; i < end; ++i) {
        const DiffuseView& view = views[i];
        const gl::Framebuffer& layer = layers[view.layer];
        const Vec2 scale = Vec2(view.width, view.height) / Vec2(layer.width(), layer.height());
        const Vec2 corner = Vec2(view.x, view.y) / Vec2(layer.width(), layer.height());
        const Vec2 centre(2.0f * corner.x + scale.x - 1.0f, 1.0f - 2.0f * corner.y - scale.y);
        blocks[g * kCompoundViews + i - groups[g]] = {
            view.clipFromWorld, Vec4(view.eye, view.texelSpreadRad), view.ownClip,
            Vec4(scale.x, scale.y, centre.x, centre.y)};
      }
    }
    fill(s.viewBlocks, "views", blocks.data(), blocks.size() * sizeof(CompoundBlock));
    for (const Draw& draw : draws) {
      commands.push_back(
          {.count = static_cast<std::uint32_t>(draw.count),
           .firstIndex = static_cast<std::uint32_t>(draw.first),
           .firstInstance = static_cast<std::uint32_t>(draw.view - groups[draw.group])});
    }
    fill(s.commands, "draw commands", commands.data(), commands.size() * sizeof(Command));
  } else {
    std::vector<ViewBlock> blocks;
    blocks.reserve(2 * views.size());
    for (const DiffuseView& view : views) {
      const Vec4 eye(view.eye, view.texelSpreadRad);
      blocks.push_back({view.clipFromWorld, eye, Vec4(0.0f, 0.0f, 0.0f, 1.0f)});
      blocks.push_back({view.clipFromWorld, eye, view.ownClip});
    }
    fill(s.viewBlocks, "views", blocks.data(), blocks.size() * sizeof(ViewBlock));
  }
  gl::VertexArray& vertices = compound ? s.compoundVertices : s.viewVertices;
  if (vertices.empty()) {
    vertices = gl::VertexArray("scene in many views");
    s.describeVertices(vertices);
    if (compound) {
      std::array<float, kCompoundViews> numbers;
      std::iota(numbers.begin(), numbers.end(), 0.0f);
      s.viewNumbers = gl::Buffer("numbers of views", std::span<const float>(numbers));
      vertices.setAttribute(kViewAttribute, s.viewNumbers, 1, GL_FLOAT, 0, sizeof(float));
      vertices.setPerInstance(kViewAttribute);
    }
  }
  const std::size_t bytes = firstIndex.back() * sizeof(std::uint32_t);
  if (s.viewIndices.size() < std::max<std::size_t>(1, bytes)) {
    s.viewIndices = gl::Buffer("indices of many views", bytes + bytes / 2);
  }
  vertices.setIndices(s.viewIndices);
  for (std::size_t i = 0; i < views.size(); ++i) {
    const std::vector<std::uint32_t>& indices = lists[i].indices;
    if (indices.empty()) continue;
    s.viewIndices.write(firstIndex[i] * sizeof(std::uint32_t),
                        indices.size() * sizeof(std::uint32_t), indices.data());
  }

  FrameView shared;
  shared.radianceLimit =
      radianceBound(s.brightestIrradiance, s.brightestAlbedo, s.brightestEmission, lighting);
  s.frame.bind(shared, lighting);
  glDisable(GL_BLEND);
  glDisable(GL_STENCIL_TEST);
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(s.cost == DrawCost::SeenOnce ? GL_GEQUAL : GL_GREATER);
  glDepthMask(GL_TRUE);
  glFrontFace(GL_CCW);
  glCullFace(GL_BACK);
  glEnable(GL_SCISSOR_TEST);
  const bool sky = hasSky(lighting);

  vertices.bind();
  if (compound) {
    glBindBuffer(GL_DRAW_INDIRECT_BUFFER, s.commands.id());
    for (const GLenum border : kBorders) glEnable(border);
  }
  // llvmpipe (Mesa 22.3.6) clips by a distance that a shader writes even where no clip distance is
  // enabled: one always is, and what should not be clipped has a distance of 1
  if (!compound) glEnable(GL_CLIP_DISTANCE0);
  Sides state = Sides::Both;
  const auto drawAll = [&](bool behind) {
    const std::uint32_t pass =
        kViews | (compound ? kCompound : 0u) | (behind ? std::uint32_t{kPeel} : 0u);
    int layer = -1;
    std::uint32_t group = ~0u;
    GLuint program = 0;
    int material = -1;
    std::uint32_t object = static_cast<std::uint32_t>(s.objects.size());
    std::uint64_t batched = 0;
    for (std::size_t k = 0; k < draws.size();) {
      const Draw& draw = draws[k];
      const DiffuseView& view = views[draw.view];
      if (behind && !view.peel) {
        ++k;
        continue;
      }
      const bool newLayer = view.layer != layer;
      if (newLayer) {
        layer = view.layer;
        layers[static_cast<std::size_t>(layer) + (behind ? layers.size() / 2 : 0)].bind();
      }
      if (draw.object != object || newLayer) {
        object = draw.object;
        const ObjectInfo& info = s.objects[object];
        const Variant& v =
            s.variant(diffusePassFeatures(litFeatures(info.features, sky)) | pass, lighting);
        if (v.program.id() != program) {
          program = v.program.id();
          glUseProgram(program);
        }
        if (info.material != material) {
          material = info.material;
          s.materials.bind(material);
        }
        if (behind) glUniform1i(v.frontLayer, layer);
        if (v.uvPerMetre >= 0) glUniform1f(v.uvPerMetre, s.uvPerMetre[object]);
      }
      const bool own = draw.sides == Sides::OwnFront || draw.sides == Sides::OwnBoth;
      if (draw.sides != state) {
        state = draw.sides;
        const bool fronts = state == Sides::Front || state == Sides::OwnFront;
        (fronts ? glEnable : glDisable)(GL_CULL_FACE);
        if (compound) (own ? glEnable : glDisable)(GL_CLIP_DISTANCE0);
      }
      if (compound) {
        if (draw.group != group) {
          group = draw.group;
          glViewport(0, 0, layers[layer].width(), layers[layer].height());
          glScissor(0, 0, layers[layer].width(), layers[layer].height());
          s.viewBlocks.bindUniformRange(kViewBinding, group * kGroupBytes, kGroupBytes);
        }
        const std::size_t first = k;
        for (; k < draws.size() && draws[k].object == draw.object && draws[k].sides == draw.sides &&
               draws[k].group == group && (!behind || views[draws[k].view].peel);
             ++k) {
          batched += draws[k].count / 3;
        }
        glMultiDrawElementsIndirect(
            GL_TRIANGLES, GL_UNSIGNED_INT,
            reinterpret_cast<const void*>(std::uintptr_t{first} * sizeof(Command)),
            static_cast<GLsizei>(k - first), sizeof(Command));
      } else {
        glViewport(view.x, view.y, view.width, view.height);
        glScissor(view.x, view.y, view.width, view.height);
        s.viewBlocks.bindUniformRange(
            kViewBinding, (2 * draw.view + (own ? 1 : 0)) * sizeof(ViewBlock), sizeof(ViewBlock));
        glDrawElements(
            GL_TRIANGLES, static_cast<GLsizei>(draw.count), GL_UNSIGNED_INT,
            reinterpret_cast<const void*>(std::uintptr_t{draw.first} * sizeof(std::uint32_t)));
        batched += draw.count / 3;
        ++k;
      }
      if (batched >= kTrianglesPerViewBatch) {
        glFlush();
        batched = 0;
      }
    }
  };
  drawAll(false);
  if (peeled != nullptr) {
    // What is read is another layer than what is written
    glTextureBarrier();
    peeled->bind(5);
    drawAll(true);
  }
  glDisable(GL_CULL_FACE);
  glDisable(GL_CLIP_DISTANCE0);
  if (compound) {
    for (const GLenum border : kBorders) glDisable(border);
    glBindBuffer(GL_DRAW_INDIRECT_BUFFER, 0);
  }
  glDisable(GL_SCISSOR_TEST);
  glDisable(GL_DEPTH_TEST);
  return leftOut;
}

}  // namespace catoptric::raster
