#include "methods/glossy_lod/tree/traversal.h"

#include <immintrin.h>

#include <algorithm>
#include <bit>
#include <limits>

#include "core/vector_level.h"

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
namespace base {
#define CATOPTRIC_TARGET
#include "methods/glossy_lod/tree/vectors_sse2.h"
#include "methods/glossy_lod/tree/walk.h"
#undef CATOPTRIC_TARGET
}  // namespace base

namespace v3 {
#define CATOPTRIC_TARGET [[gnu::target("avx2,fma,bmi,bmi2,popcnt,lzcnt")]]
#include "methods/glossy_lod/tree/vectors_avx2.h"
#include "methods/glossy_lod/tree/walk.h"
#undef CATOPTRIC_TARGET
}  // namespace v3

namespace v4 {
#define CATOPTRIC_TARGET \
  [[gnu::target("avx512f,avx512vl,avx512bw,avx512dq,avx512cd,avx2,fma,bmi,bmi2,popcnt,lzcnt")]]
#include "methods/glossy_lod/tree/vectors_avx512.h"
#include "methods/glossy_lod/tree/walk.h"
#undef CATOPTRIC_TARGET
}  // namespace v4
// NOLINTEND(bugprone-suspicious-include, misc-include-cleaner)

}  // namespace

void traverse(const TreeView& tree, const RayPacket& packet, float alpha, Levels levels,
              PacketHits& hits, Visits& visits) {
  switch (vectorLevel()) {
    case VectorLevel::V4:
      return v4::walkAll({tree, packet, 0, alpha, hits, visits}, levels);
    case VectorLevel::V3:
      return v3::walkAll({tree, packet, 0, alpha, hits, visits}, levels);
    case VectorLevel::V2:
    case VectorLevel::Base:
      break;
  }
  base::walkAll({tree, packet, 0, alpha, hits, visits}, levels);
}

}  // namespace catoptric::methods::glossy_lod
