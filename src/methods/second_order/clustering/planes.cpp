#include "methods/second_order/clustering/planes.h"

namespace catoptric::methods::second_order {

void vote(const SampleBlock& block, std::uint32_t first, std::uint32_t last, BinPlanes& planes) {
  constexpr auto kStep = static_cast<std::uint32_t>(kLanes);
  for (std::uint32_t i = first; i < last;) {
    const std::uint32_t next = std::min(last, i + kStep);
    if (next - i == kStep) {
      const Lanes3 normal = block.normal.load(i, kLanes);
      const Lanes3 before = block.normal.load(i - 1, kLanes);
      const Lanes3 turned{normal.x - before.x, normal.y - before.y, normal.z - before.z};
      const Mask4 same = dot(turned, turned) <= kPlanarNormal * kPlanarNormal;
      if (noneOf(same) || (allOf(same) && planes.voteAll(block.position.load(i, kLanes), normal))) {
        i = next;
        continue;
      }
    }
    for (; i < next; ++i) {
      const Vec3 turned = block.normal[i] - block.normal[i - 1];
      if (glm::dot(turned, turned) <= kPlanarNormal * kPlanarNormal) {
        planes.vote(block.position[i], block.normal[i]);
      }
    }
  }
}

}  // namespace catoptric::methods::second_order
