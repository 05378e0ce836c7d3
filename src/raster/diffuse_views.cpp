// Many diffuse images in few passes: all views are culled at once on the CPU, then object after
// object is drawn into all views of a layer, by indirect draws.
//
// A viewport is set per draw: gl_ViewportIndex would let one draw serve 16 views, but makes
// llvmpipe take triangles apart (a third more CPU time for the living room's views).
#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/error.h"
#include "core/parallel.h"
#include "core/srgb.h"
#include "gl/context.h"
#include "raster/scene_raster_state.h"

namespace catoptric::raster {
namespace {

/// Meshlets between two visible ones that are drawn along rather than paying for a further command.
/// Ours.
constexpr std::uint32_t kGapIndices = 64 * 3;

constexpr GLuint kViewBinding = 2;  ///< of scene.vert's block

/// As glMultiDrawElementsIndirect reads it.
struct Command {
  std::uint32_t count = 0;
  std::uint32_t instances = 1;
  std::uint32_t firstIndex = 0;
  std::int32_t baseVertex = 0;
  std::uint32_t baseInstance = 0;
};

/// The uniform block View of scene.vert, at offsets that every driver allows.
struct alignas(256) ViewBlock {
  Mat4 clipFromWorld;
  Vec4 eye;
  Vec4 ownClip;
};

/// How an object's triangles are drawn in a view.
enum class Sides : std::uint8_t { Both, Front, Own };

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

/// What one view sees: ranges of indices, in the order of objects that all views share.
struct ViewList {
  struct Range {
    std::uint32_t object;
    Sides sides;
    Command command;
  };
  std::vector<Range> ranges;
  std::uint64_t triangles = 0;
};

void SceneRaster::buildDetailLevels(const scene::Scene& scene, const frame::Geometry& geometry) {
  State& s = *state_;
  std::vector<LevelSource> sources;
  for (const scene::Object& object : scene.objects) {
    const scene::Material& material = scene.materials[object.material];
    Vec3 albedo = material.baseColor;
    if (material.baseColorTexture.used()) {
      albedo *= meanColor(scene.textures[material.baseColorTexture.texture]);
    }
    // What shines stays as it is: it may lie just before a wall
    sources.push_back({.whole = scene.nodes[object.node].skin != scene::kNone ||
                                !scene.meshes[object.mesh].morphTargets.empty() ||
                                material.emissive != Vec3(0.0f),
                       .albedo = std::max({albedo.x, albedo.y, albedo.z})});
  }
  s.levels = raster::buildDetailLevels(geometry, sources);
  const auto base = static_cast<std::uint32_t>(s.meshlets.indices.size());
  for (Meshlet& meshlet : s.levels.meshlets) meshlet.firstIndex += base;
  std::vector<std::uint32_t> all = s.meshlets.indices;
  all.insert(all.end(), s.levels.indices.begin(), s.levels.indices.end());
  s.levelIndices = gl::Buffer("indices of all levels", std::span<const std::uint32_t>(all));
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
                                  ViewList& seen) const {
  seen.ranges.clear();
  seen.triangles = 0;
  const Frustum frustum(view.clipFromWorld);
  for (const std::uint32_t i : order) {
    const bool own = static_cast<int>(i) + 1 == view.ownObject;
    if ((own && view.skipOwn) || !frustum.mayContain(bounds[i])) continue;

    // The coarsest level whose error does not show at the nearest place of the object
    std::span<const Meshlet> members = meshlets.ofObject(i);
    if (view.levelErrorTexels > 0.0f && !levels.firstOfObject.empty()) {
      const float allowed = view.levelErrorTexels * view.texelSpreadRad *
                            std::max(view.nearestMetres, distanceTo(bounds[i], view.eye));
      if (bounds[i].diameter() < 0.5f * allowed) continue;
      const float grown =
          levelExtent[i] > 0.0f ? std::max(1.0f, bounds[i].diameter() / levelExtent[i]) : 1.0f;
      for (const DetailLevel& level : levels.ofObject(i)) {
        if (level.error * grown > allowed) break;
        members = {levels.meshlets.data() + level.firstMeshlet, level.meshletCount};
      }
    }

    // Backs of a closed opaque object are hidden; so are they for the eye behind its own surface
    const bool cullBacks =
        own || (meshlets.closed[i] && objects[i].opaque && !contains(bounds[i], view.eye) &&
                beyondNear(view.clipFromWorld, bounds[i]));
    std::uint32_t end = 0;
    bool open = false;
    for (const Meshlet& meshlet : members) {
      if (!frustum.mayContain(meshlet.centre, meshlet.radius) ||
          (cullBacks && facesAway(meshlet, view.eye))) {
        continue;
      }
      if (open && meshlet.firstIndex - end <= kGapIndices) {
        Command& last = seen.ranges.back().command;
        last.count = meshlet.firstIndex + meshlet.indexCount - last.firstIndex;
      } else {
        seen.ranges.push_back({i,
                               own         ? Sides::Own
                               : cullBacks ? Sides::Front
                                           : Sides::Both,
                               {.count = meshlet.indexCount, .firstIndex = meshlet.firstIndex}});
        open = true;
      }
      end = meshlet.firstIndex + meshlet.indexCount;
    }
  }
  for (const ViewList::Range& range : seen.ranges) seen.triangles += range.command.count / 3;
}

void SceneRaster::drawDiffuseViews(std::span<const DiffuseView> views,
                                   std::span<const gl::Framebuffer> layers,
                                   const frame::Lighting& lighting,
                                   std::span<std::uint64_t> triangles) {
  State& s = *state_;
  if (views.empty()) return;

  // Small objects first: what they hide of the room's shell is then not shaded
  std::vector<std::uint32_t> order(s.objects.size());
  std::iota(order.begin(), order.end(), 0u);
  std::stable_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    return s.bounds[a].diameter() < s.bounds[b].diameter();
  });

  // Cull all views
  std::vector<ViewList> lists(views.size());
  parallelFor(views.size(), 4, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) s.listView(views[i], order, lists[i]);
  });
  for (std::size_t i = 0; i < views.size(); ++i) triangles[i] = lists[i].triangles;

  // Draws of each layer in the order of objects, so that an object's state is set once
  struct Draw {
    std::uint32_t object;
    Sides sides;
    std::uint32_t view;
    std::uint32_t firstCommand, commands;
    std::uint64_t triangles;
  };
  std::vector<Command> commands;
  std::vector<Draw> draws;
  std::vector<std::size_t> next(views.size(), 0);
  for (std::size_t first = 0; first < views.size();) {
    std::size_t last = first;
    while (last < views.size() && views[last].layer == views[first].layer) ++last;
    for (const std::uint32_t object : order) {
      for (const Sides sides : {Sides::Both, Sides::Front, Sides::Own}) {
        for (std::size_t i = first; i < last; ++i) {
          Draw draw{object,
                    sides,
                    static_cast<std::uint32_t>(i),
                    static_cast<std::uint32_t>(commands.size()),
                    0,
                    0};
          const std::vector<ViewList::Range>& ranges = lists[i].ranges;
          while (next[i] < ranges.size() && ranges[next[i]].object == object &&
                 ranges[next[i]].sides == sides) {
            commands.push_back(ranges[next[i]].command);
            draw.triangles += ranges[next[i]].command.count / 3;
            ++next[i];
          }
          draw.commands = static_cast<std::uint32_t>(commands.size()) - draw.firstCommand;
          if (draw.commands > 0) draws.push_back(draw);
        }
      }
    }
    first = last;
  }

  // Views' blocks and commands
  std::vector<ViewBlock> blocks;
  blocks.reserve(views.size());
  for (const DiffuseView& view : views) {
    blocks.push_back({view.clipFromWorld, Vec4(view.eye, view.texelSpreadRad), view.ownClip});
  }
  const auto fill = [](gl::Buffer& buffer, const char* label, const void* data, std::size_t size) {
    if (buffer.size() < size) buffer = gl::Buffer(label, size + size / 2);
    if (size > 0) buffer.write(0, size, data);
  };
  fill(s.viewBlocks, "views", blocks.data(), blocks.size() * sizeof(ViewBlock));
  fill(s.commands, "draw commands", commands.data(), commands.size() * sizeof(Command));
  if (s.viewVertices.empty()) {
    s.viewVertices = gl::VertexArray("scene in many views");
    s.describeVertices(s.viewVertices);
    s.viewVertices.setIndices(s.levelIndices.empty() ? s.indices : s.levelIndices);
  }

  FrameView shared;
  shared.radianceLimit =
      radianceBound(s.brightestIrradiance, s.brightestAlbedo, s.brightestEmission, lighting);
  s.frame.bind(shared, lighting);
  glDisable(GL_BLEND);
  glDisable(GL_STENCIL_TEST);
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_GREATER);
  glDepthMask(GL_TRUE);
  glFrontFace(GL_CCW);
  glCullFace(GL_BACK);
  glEnable(GL_SCISSOR_TEST);
  glBindBuffer(GL_DRAW_INDIRECT_BUFFER, s.commands.id());
  const bool sky = hasSky(lighting);

  s.viewVertices.bind();
  int layer = -1;
  GLuint program = 0;
  int material = -1;
  std::uint32_t object = static_cast<std::uint32_t>(s.objects.size());
  Sides state = Sides::Both;
  std::uint64_t batched = 0;
  for (const Draw& draw : draws) {
    const DiffuseView& view = views[draw.view];
    if (view.layer != layer) {
      layer = view.layer;
      layers[layer].bind();
    }
    if (draw.object != object) {
      object = draw.object;
      const ObjectInfo& info = s.objects[object];
      const Variant& v =
          s.variant(diffusePassFeatures(litFeatures(info.features, sky)) | kViews, lighting);
      if (v.program.id() != program) {
        program = v.program.id();
        glUseProgram(program);
      }
      if (info.material != material) {
        material = info.material;
        s.materials.bind(material);
      }
      if (v.uvPerMetre >= 0) glUniform1f(v.uvPerMetre, s.uvPerMetre[object]);
    }
    if (draw.sides != state) {
      state = draw.sides;
      (state == Sides::Both ? glDisable : glEnable)(GL_CULL_FACE);
      (state == Sides::Own ? glEnable : glDisable)(GL_CLIP_DISTANCE0);
    }
    glViewport(view.x, view.y, view.width, view.height);
    glScissor(view.x, view.y, view.width, view.height);
    s.viewBlocks.bindUniformRange(kViewBinding, draw.view * sizeof(ViewBlock), sizeof(ViewBlock));
    glMultiDrawElementsIndirect(
        GL_TRIANGLES, GL_UNSIGNED_INT,
        reinterpret_cast<const void*>(std::uintptr_t{draw.firstCommand} * sizeof(Command)),
        static_cast<GLsizei>(draw.commands), sizeof(Command));
    batched += draw.triangles;
    if (batched >= kTrianglesPerBatch) {
      glFlush();
      batched = 0;
    }
  }
  glDisable(GL_CULL_FACE);
  glDisable(GL_CLIP_DISTANCE0);
  glDisable(GL_SCISSOR_TEST);
  glDisable(GL_DEPTH_TEST);
  glBindBuffer(GL_DRAW_INDIRECT_BUFFER, 0);
}

}  // namespace catoptric::raster
