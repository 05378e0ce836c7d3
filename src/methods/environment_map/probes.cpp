#include "methods/environment_map/probes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace catoptric::methods {
namespace {

/// A group is flat if one axis of its box has at most this share of the diagonal. Ours.
constexpr float kFlat = 0.1f;
/// A flat group's map is raised by this share of the diagonal, at most to the scene's middle. Ours:
/// half a metre over a floor of 3 x 3 m.
constexpr float kRaise = 0.125f;

Vec3 middleOf(int object, const frame::Geometry& geometry) {
  return geometry.objects[static_cast<std::size_t>(object)].bounds.centre();
}

/// The axis along which the middles of a group lie farthest apart.
struct Spread {
  int axis = 0;
  float from = 0.0f;
  float to = 0.0f;
  float length() const { return to - from; }
};

Spread spreadOf(std::span<const int> group, const frame::Geometry& geometry) {
  Box3 middles;
  for (const int object : group) middles.extend(middleOf(object, geometry));
  Spread widest;
  for (int axis = 0; axis < 3; ++axis) {
    const Spread spread{axis, middles.min[axis], middles.max[axis]};
    if (axis == 0 || spread.length() > widest.length()) widest = spread;
  }
  return widest;
}

}  // namespace

std::vector<std::vector<int>> groupReflectors(std::vector<int> reflectors,
                                              const frame::Geometry& geometry, int most) {
  if (reflectors.empty()) return {};
  std::vector<std::vector<int>> groups{std::move(reflectors)};
  while (static_cast<int>(groups.size()) < most) {
    const auto widest = std::ranges::max_element(
        groups, {}, [&](const auto& group) { return spreadOf(group, geometry).length(); });
    const Spread spread = spreadOf(*widest, geometry);
    if (!(spread.length() > 0.0f)) break;
    const auto near = [&](int object) {
      const float at = middleOf(object, geometry)[spread.axis];
      return at - spread.from < spread.to - at;
    };
    const auto far = std::stable_partition(widest->begin(), widest->end(), near);
    std::vector<int> cut(far, widest->end());
    widest->erase(far, widest->end());
    groups.push_back(std::move(cut));
  }
  return groups;
}

Vec3 probeCentre(std::span<const int> group, const frame::Geometry& geometry) {
  Box3 box;
  for (const int object : group)
    box.extend(geometry.objects[static_cast<std::size_t>(object)].bounds);
  Vec3 centre = box.centre();
  const Vec3 size = box.max - box.min;
  std::array<int, 3> axes = {0, 1, 2};  // the thinnest first
  std::ranges::sort(axes, {}, [&](int axis) { return size[axis]; });
  const float thin = kFlat * box.diameter();
  if (size[axes[0]] > thin || size[axes[1]] <= thin) return centre;
  const int across = axes[0];
  const float inwards = geometry.bounds.centre()[across] - centre[across];
  centre[across] += std::copysign(std::min(kRaise * box.diameter(), std::abs(inwards)), inwards);
  return centre;
}

}  // namespace catoptric::methods
