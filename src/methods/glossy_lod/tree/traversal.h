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
  /// Id of the object that a ray leaves; 0: none, or its surface is exact. An object's geometry
  /// image may lie above the true surface that a ray leaves. Such a ray therefore ignores hits on
  /// that object that are near (kOwnQuads) and low (kStartQuads): all backs, and fronts that
  /// continue the starting surface (kStartCosine).
  alignas(64) std::array<std::uint32_t, kMost> own{};
  /// Normal of the surface that a ray leaves, on the ray's side; unused where `own` is 0.
  alignas(64) std::array<Lane, 3> leaves{};
  std::size_t count = 0;
  /// Upper limit of the slopes in the decision how far to descend.
  float steepest = kAnySlope;
};

/// A hit is near if its distance from the ray's origin is below this many diagonals of the quad's
/// box. Chosen by us for surfaces that bend by up to 70 degrees.
inline constexpr float kOwnQuads = 2.0f;
/// A hit is low if its height above the starting surface is at most this many diagonals of the
/// quad's box. Our choice. If the limit does not apply to backs, rays pass through walls of grooves
/// (teapot's lid, size 32: L1_8bit 0.76 instead of 0.41).
inline constexpr float kStartQuads = 0.25f;
/// A front-facing triangle continues the surface that a ray leaves if the normals are opposite
/// (cosine at most -kStartCosine). This happens for surfaces seen from behind. Not from the paper.
inline constexpr float kStartCosine = 0.7f;

struct PacketHits {
  alignas(64) std::array<float, RayPacket::kMost> metres;
  alignas(64) std::array<std::uint32_t, RayPacket::kMost> node;  ///< kNothing: no hit
  alignas(64) std::array<float, RayPacket::kMost> u, v;  ///< position in the node's quad, 0..1
  alignas(64) std::array<std::uint32_t, RayPacket::kMost> back;  ///< not 0: the ray hits the back
};

struct Visits {
  std::uint64_t nodes = 0;
  std::uint64_t quads = 0;
  std::uint64_t stopped = 0;   ///< hits on quads of coarser levels
  std::uint64_t ownBacks = 0;  ///< ignored triangles of the object that the ray leaves
};

/// Finds the nearest hit of each ray. Adds to `visits`.
void traverse(const TreeView& tree, const RayPacket& packet, float alpha, Levels levels,
              PacketHits& hits, Visits& visits);

}  // namespace catoptric::methods::glossy_lod
