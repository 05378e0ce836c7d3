// Options of the method glossy_lod.
#pragma once

#include "config/options.h"
#include "methods/glossy_lod/tree/traversal.h"

namespace catoptric::methods::glossy_lod {

enum class Objects : std::uint8_t { Diffuse, All };

/// The order in which the children of a node are visited.
enum class Order : std::uint8_t { NearFirst, AsBuilt };

struct Options {
  int rays = 8;           ///< as in the method traced
  float alpha = 3.0f;     ///< [Yu2008] Eq. (7)
  float coarsest = 0.0f;  ///< degrees; 0: no limit (not in the paper)
  Levels levels = Levels::Stitched;
  Order order = Order::NearFirst;  ///< not in the paper
  bool filter = true;
  bool automatic = false;  ///< choose rays and alpha by the lobe's exponent [Yu2008] Sec. 4
  int size = 0;  ///< quads along the edge of an object's geometry image; 0: see findSizes()
  std::uint64_t memoryBytes = std::uint64_t{512} << 20;  ///< limit for images whose size is 0
  Objects objects = Objects::All;
  int bounces = 1;  ///< as in the method traced
};

const config::OptionTable<Options>& optionTable();

}  // namespace catoptric::methods::glossy_lod
