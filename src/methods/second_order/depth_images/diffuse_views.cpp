// A viewport is set per draw: gl_ViewportIndex would let one draw serve 16 views, but makes
// llvmpipe take triangles apart (a third more CPU time for the living room's views).
#include "methods/second_order/depth_images/diffuse_views.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <optional>

#include "gl/draw_state.h"
#include "gl/workarounds.h"
#include "methods/second_order/depth_images/view_lists.h"
#include "raster/constants.h"

namespace catoptric::methods::second_order {
namespace {

using raster::SceneGpu;

#include "methods/second_order/shaders/views_constants.glsl"

/// After so many triangles GL is flushed (gl::Workaround::SoftwareFlushBatches). Ours; these
/// triangles are small: the rooms' 35k to 90k.
constexpr std::uint64_t kTrianglesPerBatch = 4'000;
/// What keeps a compound draw's views in their rectangles: bits of gl_ClipDistance.
constexpr std::uint8_t kBorders = 0b11110;
constexpr std::uint8_t kOwnClip = 0b00001;

/// As glMultiDrawElementsIndirect reads it; the first instance is the view of a compound draw.
struct Command {
  std::uint32_t count = 0;
  std::uint32_t instances = 1;
  std::uint32_t firstIndex = 0;
  std::int32_t baseVertex = 0;
  std::uint32_t firstInstance = 0;
};

/// The uniform block View of views.glsl, at offsets that every driver allows. Each view has two:
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

/// No surface is brighter: thin triangles of coarse levels would otherwise extrapolate what they
/// interpolate. Lights that are not baked have no such bound.
float radianceBound(const raster::Brightest& brightest, const frame::Lighting& lighting) {
  if (!lighting.lights.empty()) return raster::kHalfRadianceLimit;
  float sky = kPi * std::max({lighting.ambient.x, lighting.ambient.y, lighting.ambient.z});
  if (lighting.environment) {
    // Every Y_k of order <= 2 stays below 1.1
    for (const Vec3& c : lighting.environment->irradianceSh()) {
      sky += 1.1f * std::max({std::abs(c.x), std::abs(c.y), std::abs(c.z)});
    }
  }
  // Unlit: the albedo
  const float lit = brightest.albedo * std::max(1.0f, (brightest.irradiance + sky) / kPi);
  return std::min(raster::kHalfRadianceLimit, lit + brightest.emission);
}

raster::SurfaceShaders viewShaders(bool compound, bool behind) {
  return {.label = "diffuse views",
          .vertex = "methods/second_order/shaders/views.vert",
          .fragment = "methods/second_order/shaders/views.frag",
          .defines = {{"COMPOUND", compound ? "1" : "0"}, {"PEEL", behind ? "1" : "0"}}};
}

/// Triangles of one object in one view.
struct Draw {
  std::uint32_t object;
  Sides sides;
  std::uint32_t view, group;
  std::size_t first, count;  ///< of all views' indices
};

/// Writes to a buffer that grows where it must.
void fill(gl::Buffer& buffer, const char* label, const void* data, std::size_t size) {
  if (buffer.size() < size) buffer = gl::Buffer(label, size + size / 2);
  if (size > 0) buffer.write(0, size, data);
}

}  // namespace

/// The draws of one frame's views.
class ViewDraws {
 public:
  ViewDraws(DiffuseViews& buffers, SceneGpu& scene, std::span<const DiffuseView> views,
            const ViewLayers& layers)
      : buffers_(buffers), scene_(scene), views_(views), layers_(layers) {}

  /// In the order of layers and objects, so that an object's state is set once.
  void list(std::span<const std::uint32_t> order, std::span<const ViewList> lists);
  /// Writes views' blocks, commands and indices.
  void upload(std::span<const ViewList> lists);
  /// Draws all; or again what lies behind.
  void draw(const frame::Lighting& lighting, bool behind, gl::DrawScope& scope);

 private:
  void uploadViews();
  void uploadCompound();
  gl::VertexArray& vertices();
  /// Sets what all draws of an object in a layer share.
  void useObject(std::uint32_t object, raster::PassPrograms& programs, bool sky, bool behind);
  /// One draw, or those of a compound one, from `k` on; returns the next, and counts triangles.
  std::size_t drawViews(std::size_t k, bool behind, gl::DrawScope& scope, std::uint64_t& triangles);
  std::size_t drawCompound(std::size_t k, bool behind, gl::DrawScope& scope,
                           std::uint64_t& triangles);

  DiffuseViews& buffers_;
  SceneGpu& scene_;
  std::span<const DiffuseView> views_;
  const ViewLayers& layers_;
  std::vector<Draw> draws_;
  std::vector<std::size_t> firstIndex_;  ///< of each view, and one past the end
  std::vector<std::size_t> groups_;      ///< first view of each compound draw
  const bool oneClipDistance_ = gl::worksAround(gl::Workaround::MesaOneClipDistance);
  // Of the draws so far
  int layer_ = -1;
  std::optional<std::uint32_t> group_;
  GLuint program_ = 0;
  int material_ = -1;
};

void ViewDraws::list(std::span<const std::uint32_t> order, std::span<const ViewList> lists) {
  firstIndex_.assign(views_.size() + 1, 0);
  for (std::size_t i = 0; i < views_.size(); ++i) {
    firstIndex_[i + 1] = firstIndex_[i] + lists[i].indices.size();
  }
  std::vector<std::size_t> next(views_.size(), 0);
  for (std::size_t first = 0; first < views_.size();) {
    std::size_t last = first;
    while (last < views_.size() && views_[last].layer == views_[first].layer &&
           (!layers_.compound || last - first < kCompoundViews)) {
      ++last;
    }
    const auto group = static_cast<std::uint32_t>(groups_.size());
    groups_.push_back(first);
    for (const std::uint32_t object : order) {
      for (const Sides sides : {Sides::Both, Sides::Front, Sides::OwnFront, Sides::OwnBoth}) {
        for (std::size_t i = first; i < last; ++i) {
          const std::vector<ViewList::Range>& ranges = lists[i].ranges;
          if (next[i] == ranges.size()) continue;
          const ViewList::Range& range = ranges[next[i]];
          if (range.object != object || range.sides != sides) continue;
          draws_.push_back({object, sides, static_cast<std::uint32_t>(i), group,
                            firstIndex_[i] + range.first, range.count});
          ++next[i];
        }
      }
    }
    first = last;
  }
}

void ViewDraws::uploadViews() {
  std::vector<ViewBlock> blocks;
  blocks.reserve(2 * views_.size());
  for (const DiffuseView& view : views_) {
    const Vec4 eye(view.eye, view.texelSpreadRad);
    blocks.push_back({view.clipFromWorld, eye, Vec4(0.0f, 0.0f, 0.0f, 1.0f)});
    blocks.push_back({view.clipFromWorld, eye, view.ownClip});
  }
  fill(buffers_.blocks_, "views", blocks.data(), blocks.size() * sizeof(ViewBlock));
}

void ViewDraws::uploadCompound() {
  std::vector<CompoundBlock> blocks(groups_.size() * kCompoundViews);
  for (std::size_t g = 0; g < groups_.size(); ++g) {
    const std::size_t end = g + 1 < groups_.size() ? groups_[g + 1] : views_.size();
    for (std::size_t i = groups_[g]; i < end; ++i) {
      const DiffuseView& view = views_[i];
      const gl::Framebuffer& layer = layers_.targets[view.layer];
      const Vec2 scale = Vec2(view.width, view.height) / Vec2(layer.width(), layer.height());
      const Vec2 corner = Vec2(view.x, view.y) / Vec2(layer.width(), layer.height());
      const Vec2 centre(2.0f * corner.x + scale.x - 1.0f, 1.0f - 2.0f * corner.y - scale.y);
      blocks[g * kCompoundViews + i - groups_[g]] = {
          view.clipFromWorld, Vec4(view.eye, view.texelSpreadRad), view.ownClip,
          Vec4(scale.x, scale.y, centre.x, centre.y)};
    }
  }
  fill(buffers_.blocks_, "views", blocks.data(), blocks.size() * sizeof(CompoundBlock));
  std::vector<Command> commands;
  for (const Draw& draw : draws_) {
    commands.push_back(
        {.count = static_cast<std::uint32_t>(draw.count),
         .firstIndex = static_cast<std::uint32_t>(draw.first),
         .firstInstance = static_cast<std::uint32_t>(draw.view - groups_[draw.group])});
  }
  fill(buffers_.commands_, "draw commands", commands.data(), commands.size() * sizeof(Command));
}

gl::VertexArray& ViewDraws::vertices() {
  gl::VertexArray& vertices = layers_.compound ? buffers_.compoundVertices_ : buffers_.vertices_;
  if (!vertices.empty()) return vertices;
  vertices = gl::VertexArray("scene in many views");
  scene_.describeVertices(vertices);
  if (layers_.compound) {
    std::array<float, kCompoundViews> numbers;
    std::iota(numbers.begin(), numbers.end(), 0.0f);
    buffers_.numbers_ = gl::Buffer("numbers of views", std::span<const float>(numbers));
    vertices.setAttribute(kViewAttribute, buffers_.numbers_, 1, GL_FLOAT, 0, sizeof(float));
    vertices.setPerInstance(kViewAttribute);
  }
  return vertices;
}

void ViewDraws::upload(std::span<const ViewList> lists) {
  if (layers_.compound) {
    uploadCompound();
  } else {
    uploadViews();
  }
  gl::VertexArray& vertices = this->vertices();
  const std::size_t bytes = firstIndex_.back() * sizeof(std::uint32_t);
  if (buffers_.indices_.size() < std::max<std::size_t>(1, bytes)) {
    buffers_.indices_ = gl::Buffer("indices of many views", bytes + bytes / 2);
  }
  vertices.setIndices(buffers_.indices_);
  for (std::size_t i = 0; i < views_.size(); ++i) {
    const std::vector<std::uint32_t>& indices = lists[i].indices;
    if (indices.empty()) continue;
    buffers_.indices_.write(firstIndex_[i] * sizeof(std::uint32_t),
                            indices.size() * sizeof(std::uint32_t), indices.data());
  }
  vertices.bind();
  if (layers_.compound) glBindBuffer(GL_DRAW_INDIRECT_BUFFER, buffers_.commands_.id());
}

void ViewDraws::useObject(std::uint32_t object, raster::PassPrograms& programs, bool sky,
                          bool behind) {
  const raster::DeviceObject& info = scene_.objects()[object];
  const raster::SurfaceProgram& used = programs.of(info.features, sky);
  if (used.program.id() != program_) {
    program_ = used.program.id();
    glUseProgram(program_);
  }
  if (info.material != material_) {
    material_ = info.material;
    scene_.materials().bind(material_);
  }
  if (behind) glUniform1i(used.program.location("frontLayer"), layer_);
  glUniform1f(used.uvPerMetre, info.uvPerMetre);  // ignored at location -1
}

std::size_t ViewDraws::drawCompound(std::size_t k, bool behind, gl::DrawScope& scope,
                                    std::uint64_t& triangles) {
  const Draw& draw = draws_[k];
  if (group_ != draw.group) {
    group_ = draw.group;
    const gl::Framebuffer& layer = layers_.targets[layer_];
    glViewport(0, 0, layer.width(), layer.height());
    gl::DrawState state = scope.state();
    state.scissor = gl::Scissor{0, 0, layer.width(), layer.height()};
    scope.change(state);
    buffers_.blocks_.bindUniformRange(kViewBlock, *group_ * kGroupBytes, kGroupBytes);
  }
  const std::size_t first = k;
  for (; k < draws_.size() && draws_[k].object == draw.object && draws_[k].sides == draw.sides &&
         draws_[k].group == group_ && (!behind || views_[draws_[k].view].peel);
       ++k) {
    triangles += draws_[k].count / 3;
  }
  glMultiDrawElementsIndirect(
      GL_TRIANGLES, GL_UNSIGNED_INT,
      reinterpret_cast<const void*>(std::uintptr_t{first} * sizeof(Command)),
      static_cast<GLsizei>(k - first), sizeof(Command));
  return k;
}

std::size_t ViewDraws::drawViews(std::size_t k, bool behind, gl::DrawScope& scope,
                                 std::uint64_t& triangles) {
  const Draw& draw = draws_[k];
  const DiffuseView& view = views_[draw.view];
  const bool own = draw.sides == Sides::OwnFront || draw.sides == Sides::OwnBoth;
  gl::DrawState state = scope.state();
  state.cullBacks = draw.sides == Sides::Front || draw.sides == Sides::OwnFront;
  // What should not be clipped has a distance of 1
  const bool clips = own || (!layers_.compound && oneClipDistance_);
  state.clipDistances =
      static_cast<std::uint8_t>((layers_.compound ? kBorders : 0) | (clips ? kOwnClip : 0));
  if (layers_.compound) {
    scope.change(state);
    return drawCompound(k, behind, scope, triangles);
  }
  glViewport(view.x, view.y, view.width, view.height);
  state.scissor = gl::Scissor{view.x, view.y, view.width, view.height};
  scope.change(state);
  buffers_.blocks_.bindUniformRange(kViewBlock, (2 * draw.view + (own ? 1 : 0)) * sizeof(ViewBlock),
                                    sizeof(ViewBlock));
  glDrawElements(GL_TRIANGLES, static_cast<GLsizei>(draw.count), GL_UNSIGNED_INT,
                 reinterpret_cast<const void*>(std::uintptr_t{draw.first} * sizeof(std::uint32_t)));
  triangles += draw.count / 3;
  return k + 1;
}

void ViewDraws::draw(const frame::Lighting& lighting, bool behind, gl::DrawScope& scope) {
  raster::PassPrograms& programs =
      scene_.programs().of(viewShaders(layers_.compound, behind), lighting);
  const bool sky = raster::hasSky(lighting);
  layer_ = -1;
  group_.reset();
  program_ = 0;
  material_ = -1;
  auto object = static_cast<std::uint32_t>(scene_.objects().size());
  const bool flushes = gl::worksAround(gl::Workaround::SoftwareFlushBatches);
  std::uint64_t batched = 0;
  for (std::size_t k = 0; k < draws_.size();) {
    const DiffuseView& view = views_[draws_[k].view];
    if (behind && !view.peel) {
      ++k;
      continue;
    }
    const bool newLayer = view.layer != layer_;
    if (newLayer) {
      layer_ = view.layer;
      const std::size_t second = behind ? layers_.targets.size() / 2 : 0;
      layers_.targets[static_cast<std::size_t>(layer_) + second].bind();
    }
    if (draws_[k].object != object || newLayer) {
      object = draws_[k].object;
      useObject(object, programs, sky, behind);
    }
    k = drawViews(k, behind, scope, batched);
    if (flushes && batched >= kTrianglesPerBatch) {
      glFlush();
      batched = 0;
    }
  }
}

DetailCounts DiffuseViews::draw(SceneGpu& scene, std::span<const DiffuseView> views,
                                const ViewLayers& layers, const frame::Geometry& geometry,
                                const frame::Lighting& lighting,
                                std::span<std::uint64_t> triangles) {
  if (views.empty()) return {};
  const std::vector<std::uint32_t> order = smallestFirst(scene);
  const std::vector<ViewList> lists = listViews(scene, views, order, geometry);
  DetailCounts detail;
  for (std::size_t i = 0; i < views.size(); ++i) {
    const bool twice = layers.peeled != nullptr && views[i].peel;
    triangles[i] = (twice ? 2 : 1) * lists[i].indices.size() / 3;
    detail.add(lists[i].detail);
  }
  ViewDraws draws(*this, scene, views, layers);
  draws.list(order, lists);
  draws.upload(lists);

  raster::FrameView shared;
  shared.radianceLimit = radianceBound(scene.brightest(), lighting);
  scene.frame().bind(shared, lighting);
  gl::DrawState state;
  state.depth.test = true;
  gl::DrawScope scope(state);
  draws.draw(lighting, false, scope);
  if (layers.peeled != nullptr) {
    // What is read is another layer than what is written
    glTextureBarrier();
    layers.peeled->bind(kFrontDepthUnit);
    draws.draw(lighting, true, scope);
  }
  if (layers.compound) glBindBuffer(GL_DRAW_INDIRECT_BUFFER, 0);
  return detail;
}

}  // namespace catoptric::methods::second_order
