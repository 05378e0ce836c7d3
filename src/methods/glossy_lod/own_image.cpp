#include "methods/glossy_lod/own_image.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "methods/glossy_lod/mesh_surface.h"

namespace catoptric::methods::glossy_lod {
namespace {

/// How far from a point the image of its object is searched, in sums of the edges of a quad's box.
/// Nearby first: farther away lie other parts of the object. Ours: with 0.5 alone L1_8bit is twice
/// as much (teapot's spout, size 32); with 0.1 alone rays leave a sphere of size 16.
constexpr std::array kImageReaches = {0.1f, 0.5f};

/// A hit is near if its distance from the ray's origin is below this many diagonals of the quad's
/// box. Ours, for surfaces that bend by up to 70 degrees.
constexpr float kNearQuads = 2.0f;

/// A ray starts in front of a triangle if it starts so many times the distance of surface and image
/// above the triangle's plane. Ours: 1, 2 and 4 give the same L1_8bit within a tenth, 0 and 8 up to
/// twice as much (teapot's spout and lid, sizes 32 to 512).
constexpr float kAbove = 2.0f;

/// The most hits that a ray passes. Ours: rays of the teapot pass up to 5.
constexpr int kMostPassed = 8;

struct SelfHits {
  const std::array<LeftPoint, RayPacket::kMost>& left;
  const SceneImages& images;
  const frame::Geometry& geometry;
  const TreeView& tree;
  const RayPacket& packet;

  /// Whether hit number `at` of `hits`, by the ray of this lane, is near, on the ray's own object.
  bool isNear(const PacketHits& hits, std::size_t at, std::size_t lane) const {
    const std::uint32_t node = hits.node[at];
    if (node == kNothing || tree.objects[tree.quads[node].chart] != packet.own[lane]) return false;
    const Node& box = tree.nodes[node];
    return hits.metres[at] < kNearQuads * glm::distance(box.least, box.most);
  }
  /// Whether the triangle of a hit folds over.
  bool folds(const PacketHits& hits, std::size_t at) const {
    const std::uint32_t flag = hits.u[at] + hits.v[at] > 1.0f ? kUpperFolds : kLowerFolds;
    return (tree.nodes[hits.node[at]].flags & flag) != 0;
  }
  /// Whether only the image is hit: the ray does not start in front of the triangle that the hit
  /// stands for.
  bool isSelfHit(const PacketHits& hits, std::size_t at, std::size_t lane) const {
    if (!isNear(hits, at, lane)) return false;
    if (folds(hits, at)) return true;
    const bool back = hits.back[at] != 0;
    const MeshTriangle triangle =
        triangleUnder(geometry, images, {hits.node[at], {hits.u[at], hits.v[at]}, back});
    const Vec3 normal = normalizedOr(glm::cross(triangle.e1, triangle.e2), Vec3(0.0f));
    const float above = glm::dot(normal, left[lane].position - triangle.p0);
    const Vec3 origin(packet.origin[0][lane], packet.origin[1][lane], packet.origin[2][lane]);
    return (back ? -above : above) <
           kAbove * std::max(left[lane].apart, glm::distance(origin, left[lane].position));
  }
  /// Whether the hit leads from the ray's side of the image to the other. Here the back of a folded
  /// triangle is its own back: layers that fold over one another lead in and out by turns.
  bool enters(const PacketHits& hits, std::size_t at, std::size_t lane) const {
    return ((hits.back[at] != 0) != folds(hits, at)) == left[lane].back;
  }
};

/// A ray that stays on its side of the surface sees this side, also of triangles that fold over.
void showOwnSide(const SelfHits& self, PacketHits& hits) {
  for (std::size_t lane = 0; lane < self.packet.count; ++lane)
    if (self.isNear(hits, lane, lane) && self.enters(hits, lane, lane))
      hits.back[lane] = self.left[lane].back ? 1 : 0;
}

/// A ray that has passed a hit.
struct Passing {
  std::size_t lane;
  float metres;  ///< distance of that hit
  bool entered;  ///< that hit has led below the image
};

void copyRay(const RayPacket& from, const Passing& ray, RayPacket& to, std::size_t at) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    to.origin[axis][at] = from.origin[axis][ray.lane];
    to.direction[axis][at] = from.direction[axis][ray.lane];
  }
  to.base[at] = from.base[ray.lane];
  to.slope[at] = from.slope[ray.lane];
  to.beyond[at] = ray.metres;
}

void copyHit(const PacketHits& from, std::size_t at, PacketHits& to, std::size_t lane) {
  to.metres[lane] = from.metres[at];
  to.node[lane] = from.node[at];
  to.u[lane] = from.u[at];
  to.v[lane] = from.v[at];
  to.back[lane] = from.back[at];
}

}  // namespace

void liftOntoImages(const SceneImages& images, const TreeView& tree, trace::PointLanes& points,
                    LeftPoint* left, Visits& visits) {
  RayPacket packet;
  OwnCrossings crossings;
  for (std::size_t first = 0; first < points.count; first += RayPacket::kMost) {
    packet.count = std::min(RayPacket::kMost, points.count - first);
    NodeRange nodes;
    for (std::size_t lane = 0; lane < packet.count; ++lane) {
      const std::size_t i = first + lane;
      left[i] = {points.position.at(i), 0.0f, false};
      packet.origin[0][lane] = points.position.x[i];
      packet.origin[1][lane] = points.position.y[i];
      packet.origin[2][lane] = points.position.z[i];
      packet.direction[0][lane] = points.lobeHorizon.x[i];
      packet.direction[1][lane] = points.lobeHorizon.y[i];
      packet.direction[2][lane] = points.lobeHorizon.z[i];
      const int object = points.object[i];
      const bool shown = object != 0 && images.reflects(object - 1);
      packet.own[lane] = shown ? static_cast<std::uint32_t>(object) : 0;
      if (shown) nodes.extend(images.nodesOf(object - 1));
    }
    if (nodes.first >= nodes.end) continue;
    for (const float reach : kImageReaches) {
      crossOwnImages(tree, nodes, packet, reach, crossings, visits);
      bool allFound = true;
      for (std::size_t lane = 0; lane < packet.count; ++lane) {
        if (packet.own[lane] == 0) continue;
        const std::size_t i = first + lane;
        if (!(crossings.apart[lane] < kNoCrossing)) {
          allFound = false;
          continue;
        }
        packet.own[lane] = 0;
        left[i].apart = crossings.apart[lane];
        // A line out of the front meets the image of this front from below
        left[i].back = crossings.back[lane] == 0;
        const float lift = crossings.lift[lane];
        if (lift == 0.0f) continue;
        points.position.set(i, left[i].position + lift * points.lobeHorizon.at(i));
        ++visits.lifted;
      }
      if (allFound) break;
    }
  }
}

void traverseFrom(const std::array<LeftPoint, RayPacket::kMost>& left, const SceneImages& images,
                  const frame::Geometry& geometry, const TreeView& tree, const RayPacket& packet,
                  float alpha, Levels levels, PacketHits& hits, Visits& visits) {
  traverse(tree, packet, alpha, levels, hits, visits);
  const SelfHits self{left, images, geometry, tree, packet};
  std::array<Passing, RayPacket::kMost> passing;
  std::size_t count = 0;
  for (std::size_t lane = 0; lane < packet.count; ++lane)
    if (self.isSelfHit(hits, lane, lane))
      passing[count++] = {lane, hits.metres[lane], self.enters(hits, lane, lane)};
  RayPacket onward;
  onward.steepest = packet.steepest;
  PacketHits next;
  for (int passed = 0; passed < kMostPassed && count > 0; ++passed) {
    onward.count = count;
    for (std::size_t i = 0; i < count; ++i) copyRay(packet, passing[i], onward, i);
    traverse(tree, onward, alpha, levels, next, visits);
    std::size_t remaining = 0;
    for (std::size_t i = 0; i < count; ++i) {
      Passing ray = passing[i];
      if (ray.entered) {
        // A ray that does not come out again nearby has hit the surface after all
        if (!self.isNear(next, i, ray.lane) || self.enters(next, i, ray.lane)) continue;
        ray.entered = false;
      } else {
        ++visits.selfHits;
        copyHit(next, i, hits, ray.lane);
        if (!self.isSelfHit(next, i, ray.lane)) continue;
        ray.entered = self.enters(next, i, ray.lane);
      }
      ray.metres = next.metres[i];
      passing[remaining++] = ray;
    }
    count = remaining;
  }
  showOwnSide(self, hits);
}

}  // namespace catoptric::methods::glossy_lod
