#include "raster/passes/visible.h"

#include <algorithm>

namespace catoptric::raster {
namespace {

/// Collects the ranges of one object in one part; neighbours are joined.
class RangeCollector {
 public:
  RangeCollector(DrawList& list, VisibleObject& visible) : list_(list), visible_(visible) {
    visible_.firstRange = list_.counts.size();
    visible_.triangles = 0;
  }
  void add(std::uint32_t firstIndex, std::uint32_t count) {
    visible_.triangles += count / 3;
    if (list_.counts.size() > visible_.firstRange && firstIndex == end_) {
      list_.counts.back() += static_cast<GLsizei>(count);
    } else {
      list_.counts.push_back(static_cast<GLsizei>(count));
      list_.offsets.push_back(reinterpret_cast<const void*>(
          static_cast<std::uintptr_t>(firstIndex) * sizeof(std::uint32_t)));
    }
    end_ = firstIndex + count;
  }
  /// Lists the object where anything was added; its triangles.
  std::uint64_t finish() {
    visible_.rangeCount = list_.counts.size() - visible_.firstRange;
    if (visible_.rangeCount > 0) list_.objects.push_back(visible_);
    return visible_.triangles;
  }

 private:
  DrawList& list_;
  VisibleObject& visible_;
  std::uint32_t end_ = 0;  ///< of the last range
};

/// Collects those triangles of `seen` meshlets that may show in one part.
void collectShown(std::span<const Meshlet> members, std::span<const std::uint32_t> seen,
                  const CoveredSamples& covered, const Rectangle& part, RangeCollector& ranges) {
  const auto shows = [&](const Rectangle& r) { return !intersection(r, part).empty(); };
  for (const std::uint32_t m : seen) {
    if (!shows(covered.meshlets[m])) continue;
    for (std::uint32_t k = 0; k < members[m].indexCount; k += 3) {
      const std::uint32_t index = members[m].firstIndex + k;
      if (shows(covered.triangles[(index - members.front().firstIndex) / 3])) ranges.add(index, 3);
    }
  }
}

}  // namespace

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

void listVisible(const SceneGpu& scene, const FrameView& view, const Selection& selection,
                 DrawList& list, DrawStatistics& statistics) {
  list.clear();
  const Frustum frustum(view.clipFromWorld);
  std::vector<std::uint32_t> seen;  // meshlets of one object
  for (std::size_t i = 0; i < scene.objects().size(); ++i) {
    const DeviceObject& object = scene.objects()[i];
    const Which which = selection.which;
    if (which != Which::All && object.moving != (which == Which::Moving)) continue;
    const std::span<const Meshlet> members = scene.meshlets().ofObject(i);
    std::uint64_t all = 0;
    for (const Meshlet& meshlet : members) all += meshlet.indexCount / 3;
    if (!selection.objects.has(static_cast<int>(i) + 1) || !frustum.mayContain(object.bounds)) {
      statistics.culledTriangles += all;
      continue;
    }

    // Backs of a closed opaque object are hidden unless the eye or the near plane is inside
    VisibleObject visible;
    visible.object = static_cast<int>(i);
    visible.cullBacks = scene.meshlets().closed[i] && object.opaque &&
                        (!view.insides || (!contains(object.bounds, view.eye) &&
                                           beyondNear(view.clipFromWorld, object.bounds)));
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
    if (selection.parts.empty()) {
      RangeCollector ranges(list, visible);
      for (const std::uint32_t m : seen) ranges.add(members[m].firstIndex, members[m].indexCount);
      drawn += ranges.finish();
    }
    for (visible.part = 0; visible.part < selection.parts.size(); ++visible.part) {
      RangeCollector ranges(list, visible);
      collectShown(members, seen, selection.covered[i], selection.parts[visible.part], ranges);
      drawn += ranges.finish();
    }
    statistics.triangles += drawn;
    statistics.culledTriangles += std::max(all, drawn) - drawn;
  }
  std::ranges::stable_sort(list.objects, {}, &VisibleObject::order);
}

}  // namespace catoptric::raster
