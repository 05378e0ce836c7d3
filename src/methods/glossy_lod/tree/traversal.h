// Stackless traversal of the tree by rays [Carr2006], to the level of detail that their widths
// allow [Yu2008, section 3.3]. Rays of a packet share loads and branches, but the hit of a ray
// does not depend on the others: results are bit-identical for every packet and every vector
// level.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "core/math.h"
#include "methods/glossy_lod/tree/tree.h"

namespace catoptric::methods::glossy_lod {

inline constexpr std::uint32_t kNothing = ~0u;

/// The levels of detail at which rays stop.
enum class Levels : std::uint8_t {
  Adaptive,  ///< as coarse as their width allows [Yu2008, section 3.3]
  /// like Adaptive, but a ray that misses a coarse quad, or hits its back, continues in the finer
  /// quads below it (not in the paper)
  Stitched,
  Off  ///< only the finest level, as with alpha = 0
};

/// Whether an alpha mask removes a node's quad at a position (0..1) in it.
struct AlphaTest {
  bool (*isCut)(const void* of, std::uint32_t node, Vec2 at) = nullptr;  ///< null: none
  const void* of = nullptr;
};

struct TreeView {
  const Node* nodes = nullptr;
  const Quad* quads = nullptr;
  const Vec4* vertices = nullptr;
  const std::uint32_t* objects = nullptr;  ///< id of each chart's object
  std::uint32_t count = 0;                 ///< number of nodes
  AlphaTest alphaTest;
};

inline constexpr float kAnySlope = 3e38f;

/// Rays that are traced together.
struct RayPacket {
  static constexpr std::size_t kMost = 32;
  using Lane = std::array<float, kMost>;
  alignas(64) std::array<Lane, 3> origin;
  alignas(64) std::array<Lane, 3> direction;
  /// Width of a ray in metres: base + slope * distance.
  alignas(64) Lane base;
  alignas(64) Lane slope;
  /// Only hits farther than this count, in metres.
  alignas(64) Lane beyond{};
  /// Id of the object that a ray leaves; 0: none.
  alignas(64) std::array<std::uint32_t, kMost> own{};
  std::size_t count = 0;
  /// Upper limit of the slopes in the decision how far to descend.
  float steepest = kAnySlope;
};

struct PacketHits {
  alignas(64) std::array<float, RayPacket::kMost> metres;
  alignas(64) std::array<std::uint32_t, RayPacket::kMost> node;  ///< kNothing: no hit
  alignas(64) std::array<float, RayPacket::kMost> u, v;  ///< position in the node's quad, 0..1
  alignas(64) std::array<std::uint32_t, RayPacket::kMost> back;  ///< not 0: the ray hits the back
};

struct Visits {
  std::uint64_t nodes = 0;
  std::uint64_t quads = 0;
  std::uint64_t stopped = 0;  ///< hits on quads of coarser levels
  // Set in own_image.cpp
  std::uint64_t lifted = 0;    ///< points that were moved up to their object's image
  std::uint64_t selfHits = 0;  ///< hits that rays passed
};

/// Finds the nearest hit of each ray. Adds to `visits`.
void traverse(const TreeView& tree, const RayPacket& packet, float alpha, Levels levels,
              PacketHits& hits, Visits& visits);

inline constexpr float kNoCrossing = 3e38f;

/// Where rays, extended to both sides, cross the finest level of the object `own`.
struct OwnCrossings {
  alignas(64) RayPacket::Lane apart;  ///< distance of the nearest crossing, or kNoCrossing
  /// Distance of the image of this part of the object above the ray's origin, along the ray; 0: it
  /// lies below.
  alignas(64) RayPacket::Lane lift;
  /// Not 0: the nearest crossing leads through the back.
  alignas(64) std::array<std::uint32_t, RayPacket::kMost> back;
};

/// Searches within `reach` times the sum of the edges of a quad's box. `nodes`: the nodes of all
/// charts of the packet's objects. Adds to `visits`.
void crossOwnImages(const TreeView& tree, const NodeRange& nodes, const RayPacket& packet,
                    float reach, OwnCrossings& crossings, Visits& visits);

}  // namespace catoptric::methods::glossy_lod
