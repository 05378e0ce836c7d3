// The way of rays through the tree, without a stack [Carr2006], as deep as their widths ask for
// [Yu2008, section 3.3]. Rays share the loads and branches of a walk, but each meets what it would
// meet alone: the same bits for packets of any make-up and for every level of the machine.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "core/math.h"
#include "methods/glossy_lod/tree/tree.h"

namespace catoptric::methods::glossy_lod {

inline constexpr std::uint32_t kNothing = ~0u;

/// Which levels rays stop at.
enum class Levels : std::uint8_t {
  Adaptive,  ///< as coarse as their width allows [Yu2008, section 3.3]
  Stitched,  ///< so, too, but a ray that misses a coarse quad goes on into the finer ones. Ours
  Off        ///< the finest, as with alpha 0
};

/// Whether an alpha mask cuts a node's quad away at a place in it, 0..1.
struct AlphaTest {
  bool (*isCut)(const void* of, std::uint32_t node, Vec2 at) = nullptr;  ///< null: nothing is cut
  const void* of = nullptr;
};

struct TreeView {
  const Node* nodes = nullptr;
  const Quad* quads = nullptr;
  const Vec4* vertices = nullptr;
  const std::uint32_t* objects = nullptr;  ///< id of each chart's
  std::uint32_t count = 0;                 ///< nodes
  AlphaTest alphaTest;
};

inline constexpr float kAnySlope = 3e38f;

/// Rays that are traced together.
struct RayPacket {
  static constexpr std::size_t kMost = 32;
  using Lane = std::array<float, kMost>;
  alignas(64) std::array<Lane, 3> origin;
  alignas(64) std::array<Lane, 3> direction;
  /// Metres that a ray is wide: base + slope * distance.
  alignas(64) Lane base;
  alignas(64) Lane slope;
  /// Id of the object that a ray leaves; 0: none, or it is exact. An image may lie above the
  /// surface that a ray leaves: it passes by the backs of its own object's quads that are nearer
  /// than kOwnQuads times their boxes' diagonals, and by fronts that are its start's own: see
  /// kStartCosine.
  alignas(64) std::array<std::uint32_t, kMost> own{};
  /// Normal of the surface that a ray leaves, on the ray's side; not read where own is 0.
  alignas(64) std::array<Lane, 3> leaves{};
  std::size_t count = 0;
  /// No slope counts as more where it decides how far to descend.
  float steepest = kAnySlope;
};

inline constexpr float kOwnQuads = 2.0f;  ///< of what bends by 70 degrees at most: ours
/// A triangle is the image of the surface that a ray leaves where both face away from each other,
/// the angle's cosine at the least, and it is nearer to the surface than this part of its box's
/// diagonal: surfaces that are seen from behind meet their own image's front. Ours.
inline constexpr float kStartCosine = 0.7f;
inline constexpr float kStartQuads = 0.25f;

struct PacketHits {
  alignas(64) std::array<float, RayPacket::kMost> metres;
  alignas(64) std::array<std::uint32_t, RayPacket::kMost> node;  ///< kNothing: it leaves the scene
  alignas(64) std::array<float, RayPacket::kMost> u, v;          ///< in the node's quad, 0..1
  alignas(64) std::array<std::uint32_t, RayPacket::kMost> back;  ///< not 0: the quad's back
};

struct Visits {
  std::uint64_t nodes = 0;
  std::uint64_t quads = 0;
  std::uint64_t stopped = 0;   ///< quads of coarser levels
  std::uint64_t ownBacks = 0;  ///< triangles of own images that were passed by
};

/// Adds to `visits`.
void traverse(const TreeView& tree, const RayPacket& packet, float alpha, Levels levels,
              PacketHits& hits, Visits& visits);

}  // namespace catoptric::methods::glossy_lod
