#include "methods/second_order/depth_images/view_lists.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/parallel.h"
#include "raster/passes/visible.h"
#include "raster/regions/triangle_culling.h"

namespace catoptric::methods::second_order {
namespace {

using raster::DetailLevel;
using raster::DeviceObject;
using raster::Meshlet;
using raster::SceneGpu;

/// Levels of what is shown more dimly err no more: thin things would vanish. Ours.
constexpr float kDimmest = 0.25f;
/// Levels may show light that is off by so many display steps for each texel that their places may
/// be off. Ours, measured in the rooms: 2 draws 4 % more triangles for 5 % less error, 4 neither.
constexpr float kStepsPerTexel = 3.0f;

/// Distance from a point to a box.
float distanceTo(const Box3& box, const Vec3& p) {
  return glm::length(glm::max(glm::max(box.min - p, p - box.max), Vec3(0.0f)));
}

/// Meshlets of the coarsest level whose error does not show at the nearest place of the object;
/// false where the object itself does not.
bool chooseLevel(const SceneGpu& scene, std::size_t i, const DiffuseView& view,
                 std::span<const Meshlet>& members, DetailCounts& detail) {
  const DeviceObject& object = scene.objects()[i];
  members = scene.meshlets().ofObject(i);
  if (view.levelErrorTexels <= 0.0f || scene.levels().firstOfObject.empty()) return true;
  const float bright = view.levelErrorTexels * view.texelSpreadRad *
                       std::max(view.nearestMetres, distanceTo(object.bounds, view.eye));
  if (object.bounds.diameter() < 0.5f * bright) {
    ++detail.leftOut;
    return false;
  }
  const float shown = view.shown * std::max(1.0f, object.emission);
  const float dim = std::clamp(shown, kDimmest, 1.0f);
  const float allowed = bright / dim;
  const float steps = kStepsPerTexel * view.levelErrorTexels / dim;
  const float grown = object.levelExtent > 0.0f
                          ? std::max(1.0f, object.bounds.diameter() / object.levelExtent)
                          : 1.0f;
  for (const DetailLevel& level : scene.levels().ofObject(i)) {
    const bool shapeShows = level.error.metres * grown > allowed;
    if (shapeShows || level.error.steps > steps) {
      ++(shapeShows ? detail.byShape : detail.byLight);
      break;
    }
    members = {scene.levels().meshlets.data() + level.firstMeshlet, level.meshletCount};
  }
  return true;
}

void listView(const SceneGpu& scene, const DiffuseView& view, std::span<const std::uint32_t> order,
              const frame::Geometry& geometry, float snap, ViewList& seen) {
  const raster::Frustum frustum(view.clipFromWorld);
  const auto tooFar = [&](const Vec3& centre, float radius) {
    return glm::dot(view.farClip, Vec4(centre, 1.0f)) < -radius * glm::length(Vec3(view.farClip));
  };
  for (const std::uint32_t i : order) {
    const DeviceObject& object = scene.objects()[i];
    const bool own = static_cast<int>(i) + 1 == view.ownObject;
    if ((own && view.skipOwn) || !frustum.mayContain(object.bounds) ||
        tooFar(object.bounds.centre(), 0.5f * object.bounds.diameter())) {
      continue;
    }
    std::span<const Meshlet> members;
    if (!chooseLevel(scene, i, view, members, seen.detail)) continue;

    // Backs of a closed opaque object are hidden; so are they for the eye behind its own surface
    const bool cullBacks = own ? !view.ownBacks
                               : (scene.meshlets().closed[i] && object.opaque &&
                                  !raster::contains(object.bounds, view.eye) &&
                                  raster::beyondNear(view.clipFromWorld, object.bounds));
    const raster::TriangleCulling culling(view.clipFromWorld, object.bounds, view.width,
                                          view.height, snap, cullBacks,
                                          own ? view.ownClip : Vec4(0.0f, 0.0f, 0.0f, 1.0f));
    const std::size_t first = seen.indices.size();
    for (const Meshlet& meshlet : members) {
      if (!frustum.mayContain(meshlet.centre, meshlet.radius) ||
          tooFar(meshlet.centre, meshlet.radius) ||
          (cullBacks && raster::facesAway(meshlet, view.eye))) {
        continue;
      }
      culling.append(scene.indices().subspan(meshlet.firstIndex, meshlet.indexCount),
                     scene.positions(geometry), seen.indices);
    }
    if (seen.indices.size() == first) continue;
    const Sides sides = own         ? (cullBacks ? Sides::OwnFront : Sides::OwnBoth)
                        : cullBacks ? Sides::Front
                                    : Sides::Both;
    seen.ranges.push_back({i, sides, first, seen.indices.size() - first});
  }
}

}  // namespace

std::vector<std::uint32_t> smallestFirst(const SceneGpu& scene) {
  std::vector<std::uint32_t> order(scene.objects().size());
  std::iota(order.begin(), order.end(), 0u);
  std::stable_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    return scene.objects()[a].bounds.diameter() < scene.objects()[b].bounds.diameter();
  });
  return order;
}

std::vector<ViewList> listViews(const SceneGpu& scene, std::span<const DiffuseView> views,
                                std::span<const std::uint32_t> order,
                                const frame::Geometry& geometry) {
  GLint subpixelBits = 0;
  glGetIntegerv(GL_SUBPIXEL_BITS, &subpixelBits);
  const float snap = std::exp2(-static_cast<float>(subpixelBits));
  std::vector<ViewList> lists(views.size());
  parallelFor(views.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      listView(scene, views[i], order, geometry, snap, lists[i]);
    }
  });
  return lists;
}

}  // namespace catoptric::methods::second_order
