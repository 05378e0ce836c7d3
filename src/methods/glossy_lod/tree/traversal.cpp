#include "methods/glossy_lod/tree/traversal.h"

#include <immintrin.h>

#include <algorithm>
#include <bit>
#include <limits>

#include "core/lanes.h"

namespace catoptric::methods::glossy_lod {
namespace {

/// Rays whose directions have the same signs and the same longest axis walk together.
struct Kind {
  int axis;           ///< the longest
  unsigned negative;  ///< bit by axis
};

struct Walk {
  const TreeView& tree;
  const RayPacket& packet;
  std::size_t first;  ///< lane of the packet
  float alpha;
  PacketHits& hits;
  Visits& visits;
};

/// Shared by packets of all widths.
constexpr float kTiny = 1e-20f;     ///< what a direction's 0 is taken as
constexpr float kFarthest = 3e38f;  ///< metres
/// Two more ulps than rounding may take [Ize2013].
constexpr float kSlack = 1.0000005f;

// The walk is written once for vectors `V`; V's operations must be compiled for its instructions,
// and so must all that calls them: it is included once for each.
// NOLINTBEGIN(bugprone-suspicious-include, misc-include-cleaner)
#define CATOPTRIC_WALK CATOPTRIC_TARGET [[gnu::always_inline]] inline
#define CATOPTRIC_OP CATOPTRIC_WALK static

namespace base {
#define CATOPTRIC_TARGET
#define CATOPTRIC_LANES 4
#include "methods/glossy_lod/tree/vectors.h"
#include "methods/glossy_lod/tree/walk.h"
#undef CATOPTRIC_TARGET
#undef CATOPTRIC_LANES
}  // namespace base

namespace v3 {
#define CATOPTRIC_TARGET [[gnu::target(CATOPTRIC_V3)]]
#define CATOPTRIC_LANES 8
#include "methods/glossy_lod/tree/vectors.h"
#include "methods/glossy_lod/tree/walk.h"
#undef CATOPTRIC_TARGET
#undef CATOPTRIC_LANES
}  // namespace v3

namespace v4 {
#define CATOPTRIC_TARGET [[gnu::target(CATOPTRIC_V4)]]
#include "methods/glossy_lod/tree/vectors_avx512.h"
#include "methods/glossy_lod/tree/walk.h"
#undef CATOPTRIC_TARGET
}  // namespace v4
#undef CATOPTRIC_OP
#undef CATOPTRIC_WALK
// NOLINTEND(bugprone-suspicious-include, misc-include-cleaner)

}  // namespace

void traverse(const TreeView& tree, const RayPacket& packet, float alpha, Levels levels,
              PacketHits& hits, Visits& visits) {
  const Walk walk{tree, packet, 0, alpha, hits, visits};
  switch (vectorLevel()) {
    case VectorLevel::V4:
      return v4::walkAll(walk, levels);
    case VectorLevel::V3:
      return v3::walkAll(walk, levels);
    case VectorLevel::V2:
    case VectorLevel::Base:
      break;
  }
  base::walkAll(walk, levels);
}

void crossOwnImages(const TreeView& tree, const NodeRange& nodes, const RayPacket& packet,
                    float reach, OwnCrossings& crossings, Visits& visits) {
  PacketHits none;
  const Walk walk{tree, packet, 0, 0.0f, none, visits};
  switch (vectorLevel()) {
    case VectorLevel::V4:
      return v4::crossAll(walk, nodes, reach, crossings);
    case VectorLevel::V3:
      return v3::crossAll(walk, nodes, reach, crossings);
    case VectorLevel::V2:
    case VectorLevel::Base:
      break;
  }
  base::crossAll(walk, nodes, reach, crossings);
}

}  // namespace catoptric::methods::glossy_lod
